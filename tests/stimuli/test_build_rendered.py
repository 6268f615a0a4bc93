"""The build with the real renderer and the default head, in small."""

import subprocess
import sys

import numpy as np
import PIL.Image
import pytest

from stimuli.build import build
from stimuli.manifest import load_manifest
from stimuli.study import THESIS, load_study


@pytest.fixture(scope="module")
def thesis_in_small(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "small.toml"
    text = THESIS.read_text()
    for old, new in (
        ("[1920, 1080]", "[160, 90]"),
        ("supersample = 2", "supersample = 1"),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def folder(thesis_in_small, tmp_path_factory):
    out = tmp_path_factory.mktemp("thesis")
    assert build(load_study(thesis_in_small), out).rendered == 15
    return out


def test_manifest_of_the_thesis_study(folder):
    manifest = load_manifest(folder)
    assert len(manifest.images) == 15
    assert {image.parameters["technique"] for image in manifest.images} == {
        t.name for t in manifest.study.techniques
    }
    for image in manifest.images:
        assert {"version", "commit", "gl_vendor", "gl_renderer", "gl_version", "platform"} <= set(
            image.renderer
        )
        assert image.head and image.seed == 0
    assert manifest.licences and all(licence["licence"] for licence in manifest.licences)
    assert "CC0-1.0" in {licence["licence"] for licence in manifest.licences}


def test_conditions_are_different_pictures_of_one_scene(folder):
    """Each framing's five images differ, and differ little: what changes is scattering alone."""
    manifest = load_manifest(folder)
    for framing in manifest.study.framings:
        pixels = [
            np.asarray(PIL.Image.open(manifest.image(framing.name, t.name).path), float)
            for t in manifest.study.techniques
        ]
        apart = [np.abs(a - b).mean() for i, a in enumerate(pixels) for b in pixels[:i]]
        assert min(apart) > 0 and max(apart) < 0.1 * 255


def test_two_builds_with_one_seed_give_the_same_bytes(thesis_in_small, folder, tmp_path):
    """The second one in a process of its own, by the command line."""
    command = [sys.executable, "-m", "app.cli", "build", thesis_in_small, "--out", tmp_path]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout == f"{tmp_path}: 15 images, 15 rendered, 0 up to date\n"
    names = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    assert names == sorted(
        path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()
    )
    assert len(names) == 15 + 15 + 3 + 1  # images, their records, a mask a cell, the manifest
    assert not [
        name for name in names if (folder / name).read_bytes() != (tmp_path / name).read_bytes()
    ]


def test_second_build_renders_nothing(thesis_in_small, folder):
    before = {path: path.stat().st_mtime_ns for path in (folder / "images").iterdir()}
    assert build(load_study(thesis_in_small), folder).rendered == 0
    assert {path: path.stat().st_mtime_ns for path in (folder / "images").iterdir()} == before
