"""Memory of builds: nothing of a person is left when the next one is made."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

import renderer
from renderer import memory
from renderer.scene import Strands, shapes
from renderer.scene.material import Material
from stimuli.build import build
from stimuli.heads import Head
from stimuli.scenes import staging
from stimuli.study import load_study

PEOPLE = ("man", "woman", "man_old")
SCENE = """
[objects.head]
shape = "person"
person = "man"

[lights.key]
direction = [-0.4, 0.3, 0.9]
irradiance = [3.0, 3.0, 3.0]

[camera]
framing = "head-shot"
"""
STUDY = """
name = "three"
title = "Three people"
version = 1
seed = 1
scene = "scene.toml"
consent = "{questions} {minutes} {recorded}"

[render]
size = [32, 40]
supersample = 1
seed = 0

[[framings]]
name = "close-up"
label = "Close-up"

[[framings]]
name = "half-length"
label = "Half-length"

[[factors]]
name = "person"
label = "Person"

[[factors.levels]]
name = "man"
label = "Man"

[[factors.levels]]
name = "woman"
label = "Woman"

[[factors.levels]]
name = "man_old"
label = "Old man"

[[techniques]]
name = "none"
label = "None"

[[techniques]]
name = "golubev"
label = "Golubev"

[analysis]
margin = 0.25
test = "wilcoxon"
"""


@pytest.fixture(autouse=True)
def no_collector():
    """What refers to itself in a circle may be left for long: it counts as held."""
    gc.disable()
    yield
    gc.enable()


@pytest.fixture
def study(tmp_path):
    """Three people by two techniques at two framings."""
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "study.toml").write_text(STUDY)
    return load_study(tmp_path / "study.toml")


def ball_with_hair(name):
    """In a person's stead, quickly made: a ball with 200 strands."""
    ball = shapes.sphere(60.0, rings=16)
    model = staging._shape(ball, Material())
    root = np.linspace(0, len(ball.positions) - 1, 200).astype(int)
    points = ball.positions[root][:, None] * (1 + 0.05 * np.arange(5))[:, None]
    ones = np.ones(len(root), np.float32)
    hair = Strands(
        points.reshape(-1, 3).astype(np.float32),
        5 * np.arange(len(root) + 1),
        0.1 * ones,
        ones,
        np.full((len(root), 3), 0.1, np.float32),
        np.zeros(5 * len(root), np.float32),
        root,
        0.5 * ones,
    )
    landmarks = {"eyes": np.array([0.0, 0.0, 60.0])}
    return Head(name, replace(model, strands=hair, landmarks=landmarks), {"person": name}, [])


class Watch:
    """What is alive of the people of a build: `left` when each was made, `given` when memory was
    given back.
    """

    def __init__(self, monkeypatch, held=None):
        self.made, self.left, self.given, self._refs = [], [], [], {}
        watch = self

        class Watched(renderer.Renderer):
            def __init__(self, *args, **options):
                super().__init__(*args, shadow_map=256, **options)

            def frame(self, *args):
                watch.look({"renderer": self, "lamps": self.lamps, "hair": self.hair[0]})
                watch.look({"drawn": self.surfaces.surfaces[0], "context": self.context})
                made = super().frame(*args)
                watch.look({"frame": made})
                if held is not None:
                    held.append(made)
                return made

        monkeypatch.setattr(staging, "load_person", self._load)
        monkeypatch.setattr(renderer, "Renderer", Watched)
        monkeypatch.setattr(memory, "give_back", lambda: self.given.append(self.alive()))

    def look(self, things):
        for what, thing in things.items():
            self._refs[f"{what} of {self.made[-1]}"] = weakref.ref(thing)

    def alive(self):
        return {what for what, thing in self._refs.items() if thing() is not None}

    def seen(self):
        return self._refs.keys()

    def _load(self, name, *_):
        self.left.append(self.alive())
        self.made.append(name)
        head = ball_with_hair(name)
        arrays = {**vars(head.model.surface), **vars(head.model.strands)}
        self.look({k: v for k, v in arrays.items() if isinstance(v, np.ndarray)})
        return head


def test_nothing_of_a_person_is_left_when_the_next_is_made(study, tmp_path, monkeypatch):
    watch = Watch(monkeypatch)
    assert build(study, tmp_path / "out").rendered == 12
    assert watch.made == list(PEOPLE)
    assert watch.left == [set()] * 3
    assert watch.given == [set()] * 3, "each scene's memory goes back when nothing holds it"
    for name in PEOPLE:
        own = ("positions", "faces", "points", "first", "renderer", "lamps", "hair", "frame")
        assert watch.seen() >= {f"{what} of {name}" for what in own}


def test_what_somebody_holds_is_seen(study, tmp_path, monkeypatch):
    """Or the test above could not fail."""
    watch = Watch(monkeypatch, held=[])
    build(study, tmp_path / "out")
    assert watch.left[0] == set()
    assert watch.left[2] >= {f"{what} of man" for what in ("points", "drawn", "frame", "renderer")}
    assert "positions of woman" in watch.left[2] and "points of woman" in watch.given[1]
