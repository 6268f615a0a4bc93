"""A small study of ready-made images, and a renderer that draws coloured rectangles instead of
heads.
"""

import hashlib
import json
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import PIL.Image
import pytest

from renderer.errors import InputError
from stimuli.study import load_study

TOML = """
name = "small"
title = "Which is rounder?"
version = 3
seed = 7

[render]
size = [32, 18]
supersample = 1
seed = 5

[[framings]]
name = "near"
label = "Near"
set = { camera = { framing = "near", height_mm = 100.0, yaw_deg = 0.0 } }

[[framings]]
name = "far"
label = "Far"
set = { camera = { framing = "far", height_mm = 400.0, yaw_deg = 0.0 } }

[[techniques]]
name = "plain"
label = "Plain"

[[techniques]]
name = "soft"
label = "Soft"
technique = "blur"
parameters = { radius_mm = 2.5 }
"""


@pytest.fixture
def write_toml(tmp_path):
    """Writes a study's TOML text, by default the small study's, and returns its path."""

    def write(text=TOML):
        path = tmp_path / "small.toml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def small_study(write_toml):
    return load_study(write_toml())


@pytest.fixture
def ready_made(tmp_path):
    """A folder with four images from nowhere in particular and a manifest written by hand."""
    folder = tmp_path / "ready-made"
    folder.mkdir()
    images = []
    for framing, size in (("near", (12, 8)), ("far", (6, 4))):
        for value, technique in ((40, "unreal"), (200, "blender")):
            file = f"{framing}-{technique}.png"
            PIL.Image.new("RGB", size, (value, 90, 60)).save(folder / file)
            digest = hashlib.sha256((folder / file).read_bytes()).hexdigest()
            entry = {"framing": framing, "technique": technique, "file": file, "sha256": digest}
            images.append({**entry, "width": size[0], "height": size[1]})
    manifest = {
        "format": "subdermal-manifest/1",
        "study": {
            "name": "engines",
            "title": "Which engine?",
            "version": 1,
            "seed": 11,
            "framings": [{"name": "near", "label": "Near"}, {"name": "far", "label": "Far"}],
            "techniques": [
                {"name": "unreal", "label": "Unreal"},
                {"name": "blender", "label": "Blender"},
            ],
        },
        "images": images,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


@dataclass(frozen=True)
class Plain:
    pass


@dataclass(frozen=True)
class Blur:
    radius_mm: float = 1.0

    def __post_init__(self):
        if not self.radius_mm > 0:
            raise InputError(f"radius_mm: got {self.radius_mm}, expected > 0")


def make(technique, parameters):
    if technique not in ("plain", "blur"):
        raise InputError(f"no technique {technique!r}")
    return Plain() if technique == "plain" else Blur(**parameters)


@dataclass
class FakeRenderer:
    """Draws a colour that depends on all that an image should depend on; `drawn` counts the
    images.
    """

    model: str
    size: tuple
    supersample: int
    seed: int
    keep: tuple = ()
    driver = "fake"
    drawn = []
    frames = []
    scenes = []
    stop_after = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def info(self):
        return {"version": "1", "gl_vendor": type(self).driver}

    def samples(self):
        """The right half scatters, with 4 and 9 samples in turn."""
        counts = np.zeros([self.supersample * side for side in reversed(self.size)], np.uint16)
        counts[::2, counts.shape[1] // 2 :] = 4
        counts[1::2, counts.shape[1] // 2 :] = 9
        return counts

    @contextmanager
    def frame(self, camera, picture):
        framing = camera.framing
        FakeRenderer.frames.append(framing)

        def render(parameters):
            if len(FakeRenderer.drawn) == FakeRenderer.stop_after:
                raise KeyboardInterrupt
            FakeRenderer.drawn.append((framing, parameters))
            made_from = repr((self, framing, parameters, picture))
            colour = hashlib.sha256(made_from.encode()).digest()[:3]
            image = np.tile(np.frombuffer(colour, np.uint8), (self.size[1], self.size[0], 1))
            return SimpleNamespace(image=image, samples=self.samples())

        def time(techniques, rounds):
            return {
                name: np.tile([0.002 * (k + 1), 9.0], (rounds, 1))
                for k, name in enumerate(techniques)
            }

        yield SimpleNamespace(render=render, time=time)


@pytest.fixture
def fake_renderer(monkeypatch):
    """Puts the fake in the place of the renderer and of the stage, and returns its class."""

    def stage(scene, seed):
        FakeRenderer.scenes.append(scene)
        return SimpleNamespace(
            graph=repr(scene.materials),
            provenance={"source": "a sphere"},
            licences=[{"what": "sphere", "licence": "CC0-1.0", "source": "here"}],
            notes=("a sphere has no face",),
        )

    monkeypatch.setattr("renderer.renderer.Renderer", FakeRenderer)
    monkeypatch.setattr("renderer.renderer.driver", lambda: FakeRenderer("", (), 1, 0).info())
    monkeypatch.setattr("renderer.techniques.make", make)
    monkeypatch.setattr("stimuli.scenes.stage", stage)
    monkeypatch.setattr("stimuli.drawing._source", lambda module: "source")
    for name, value in (("driver", "fake"), ("stop_after", None)):
        monkeypatch.setattr(FakeRenderer, name, value)
    for name in ("drawn", "frames", "scenes"):
        monkeypatch.setattr(FakeRenderer, name, [])
    return FakeRenderer
