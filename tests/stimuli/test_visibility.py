"""Predicted visibility: what the page shows, pair by pair, by a metric that is easy to reckon."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from analysis.manifest import open_manifest
from app.cli import main
from app.renditions import resampled
from stimuli.experiment import visibility
from stimuli.manifest import load_manifest
from stimuli.viewing import Screen, Viewer, shown_size


class Levels:
    """10 less a hundredth of the mean difference in levels."""

    name, version = "Levels", "1"

    def __init__(self, screen):
        self.screen = screen

    def jod(self, reference, other):
        assert reference.shape == other.shape and reference.dtype == np.uint8
        return 10 - 0.01 * float(np.abs(reference.astype(float) - other).mean())


def test_a_screen_is_colorvideovdp_s_standard_one():
    """standard_fhd of cvvdp 0.5.7: 24 inches, 1920x1080 at 0.6 m: 37.84 pixels a degree."""
    assert Screen().pixels_per_degree == pytest.approx(37.8425, abs=2e-3)


@pytest.mark.parametrize(
    ("viewer", "box", "zoom", "size"),
    [
        (Viewer(display="fit", modes=("beside",)), (1920, 1080), 0, (944, 531)),
        (Viewer(display="fit", modes=("flicker",)), (1920, 1080), 0, (1440, 810)),
        (Viewer(display="fit", modes=("beside",)), (2400, 400), 0, (1920, 320)),  # stacked
        (Viewer(modes=("beside",)), (900, 700), 0, (900, 700)),
        (Viewer(modes=("beside",)), (1920, 1080), 0, (956, 810)),
        (Viewer(display="fit", modes=("beside",)), (320, 320), 3, (956, 810)),
        (Viewer(modes=("triplet",)), (1920, 1080), 0, (634, 810)),
    ],
)
def test_a_pair_is_placed_as_the_page_places_it(viewer, box, zoom, size):
    """Room of 1920 x 810, gap 8; app/static/geometry.js by hand."""
    shown = shown_size(viewer, Screen(), box, zoom)
    assert (shown.width, shown.height) == size


def test_what_is_shown_is_resampled_or_cut_from_the_middle(tmp_path):
    image = np.zeros((80, 120, 3), np.uint8)
    image[30:50, 40:80] = 255
    Image.fromarray(image).save(tmp_path / "one.png")
    box, file = (0, 0, 120, 80), tmp_path / "one.png"
    screen = Screen(width=136, height=106, page_px=50)
    fitted = shown_size(Viewer(display="fit", modes=("beside",)), screen, (120, 80))
    seen = visibility.show(file, box, fitted, resampled)
    assert seen.shape == (43, 64, 3) and seen[21, 32, 0] > 250
    cut = shown_size(Viewer(modes=("beside",)), screen, (120, 80))
    seen = visibility.show(file, box, cut, resampled)
    assert seen.shape == (56, 64, 3)
    np.testing.assert_array_equal(seen, image[12:68, 28:92])
    large = shown_size(Viewer(modes=("beside",)), screen, (120, 80), zoom=2)
    seen = visibility.show(file, box, large, resampled)
    assert large.scale == 2 and (seen[::2, ::2] == seen[1::2, 1::2]).all()


@pytest.fixture
def predicted(ready_made, monkeypatch):
    """The verb over a study of four images, `Levels` in the place of ColorVideoVDP."""
    monkeypatch.setattr(visibility, "ColorVideoVDP", Levels)
    manifest = json.loads((ready_made / "manifest.json").read_text())
    manifest["format"] = "subdermal-manifest/3"
    manifest["study"]["viewer"] = {"screen": {"width": 1280, "height": 720, "distance_mm": 500}}
    (ready_made / "manifest.json").write_text(json.dumps(manifest))
    return lambda *more: main(["experiment", "visibility", str(ready_made), *more])


def test_the_manifest_holds_what_was_predicted_and_how(ready_made, predicted, capsys):
    assert predicted("--luminance", "300") == 0
    out = capsys.readouterr()
    assert "Levels 1, 1280x720" in out.out and not out.err
    value = open_manifest(ready_made).visibility
    assert value["metric"] == "Levels" and value["version"] == "1"
    assert value["display"]["width"] == 1280 and value["display"]["luminance"] == 300
    (near, far) = value["pairs"]
    assert near["cell"] == "near" and near["jod"] == pytest.approx(10 - 1.6 / 3, abs=1e-4)
    assert far["jod"] == pytest.approx(near["jod"]) and far["flip"] > 0.1
    rows = list(csv.DictReader((ready_made / "visibility.csv").open()))
    assert float(rows[0]["told_apart"]) == pytest.approx(0.6405, abs=1e-3)  # Phi(.5333 / 1.4826)
    assert (ready_made / "visibility.svg").is_file() and (ready_made / "visibility.png").is_file()
    load_manifest(ready_made)  # is read on


def test_a_pair_of_a_changed_image_is_forgotten(ready_made, predicted):
    assert predicted() == 0
    file = ready_made / "manifest.json"
    manifest = json.loads(file.read_text())
    manifest["images"][0]["sha256"] = "0" * 64
    file.write_text(json.dumps(manifest))
    assert [pair["cell"] for pair in open_manifest(file).visibility["pairs"]] == ["far"]


def test_pairs_that_nobody_can_tell_apart_are_warned_of(ready_made, predicted, capsys):
    manifest = json.loads((ready_made / "manifest.json").read_text())
    entry = manifest["images"][1]
    Image.new("RGB", (12, 8), (42, 90, 60)).save(ready_made / entry["file"])
    from stimuli.manifest import sha256

    entry["sha256"] = sha256(ready_made / entry["file"])
    (ready_made / "manifest.json").write_text(json.dumps(manifest))
    assert predicted("--no-write") == 0
    err = capsys.readouterr().err
    assert "1 of 2 pairs are within 0.1 JOD" in err and "unreal/blender at near (0.01)" in err
    assert not open_manifest(ready_made).visibility


def test_a_crop_is_looked_at_and_never_written_down(ready_made, predicted, capsys):
    assert predicted("--crop", "4x4+0+0", "--zoom", "3", "-o", str(ready_made / "out")) == 0
    assert not open_manifest(ready_made).visibility
    row = next(csv.DictReader((ready_made / "out/visibility.csv").open()))
    assert (row["width"], row["height"], float(row["scale"])) == ("12", "12", 3)
    assert predicted("--crop", "40x40+0+0") == 2
    assert "does not fit" in capsys.readouterr().err


def test_without_the_extra_one_line_names_it(ready_made, monkeypatch, capsys):
    import builtins

    own = builtins.__import__

    def lacks(name, *rest, **more):
        if name == "pycvvdp":
            raise ImportError("No module named 'pycvvdp'")
        return own(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", lacks)
    assert main(["experiment", "visibility", str(ready_made)]) == 2
    err = capsys.readouterr().err
    assert "requirements-visibility.lock" in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("value", "words"),
    [("[]", "expected a table with pairs"), ('{"pairs": [{"jod": 11}]}', "expected cell, a, b")],
)
def test_a_bad_prediction_is_one_line(ready_made, value, words, run_bad):
    err = run_bad(ready_made, json.loads(value))
    assert words in err and err.count("\n") == 1


@pytest.fixture
def run_bad(capsys):
    def run(folder, value):
        manifest = json.loads((folder / "manifest.json").read_text())
        manifest["visibility"] = value
        (folder / "manifest.json").write_text(json.dumps(manifest))
        assert main(["experiment", "visibility", str(folder)]) == 2
        return capsys.readouterr().err

    return run
