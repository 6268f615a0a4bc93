"""subdermal inspect: each bias that is put into a study is flagged, and nothing else."""

import hashlib
import json

import numpy as np
import pytest
from PIL import Image

from app import create_app, inspection, web
from app.cli import main
from stimuli.errors import InputError
from stimuli.inspect import Limits, inspect, noise
from stimuli.manifest import MASKS, load_manifest

CELL, WIDTH, HEIGHT = "close-up", 96, 64


def face(seed: int = 0, noise_levels: float = 0.0) -> np.ndarray:
    """A shaded disc before grey: (HEIGHT, WIDTH, 3) in levels, float."""
    x, y = np.meshgrid(np.arange(WIDTH) - 48.0, np.arange(HEIGHT) - 32.0)
    skin = (x**2 + y**2 < 28**2)[..., None]
    shade = np.clip(0.7 + x / 90, 0, 1)[..., None] * [200.0, 150.0, 130.0]
    rng = np.random.default_rng(seed)
    return np.where(skin, shade + noise_levels * rng.normal(size=(HEIGHT, WIDTH, 1)), 70.0)


def mask() -> np.ndarray:
    x, y = np.meshgrid(np.arange(WIDTH) - 48.0, np.arange(HEIGHT) - 32.0)
    return x**2 + y**2 < 28**2


@pytest.fixture
def study(tmp_path, write_study):
    """Write a study whose conditions at CELL are given images, name -> levels, the rest alike."""

    def write(masked: bool = True, **images):
        folder = write_study(tmp_path / "study", size=(WIDTH, HEIGHT))
        record = json.loads((folder / "manifest.json").read_text())
        names = {one["technique"] for one in record["images"]}
        for k, entry in enumerate(record["images"]):
            # apart from each other enough to be told, by shares that cancel out in the mean
            own = face()
            stripes = 8 * (-1) ** (np.arange(WIDTH) // (1 + k % len(names)))
            own[mask()] += np.broadcast_to(stripes[None, :, None], own.shape)[mask()]
            if entry["framing"] == CELL and entry["technique"] in images:
                own = images[entry["technique"]](own)
            path = folder / entry["file"]
            Image.fromarray(np.clip(np.rint(own), 0, 255).astype(np.uint8)).save(path)
            entry["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
        (folder / "manifest.json").write_text(json.dumps(record))
        if masked:
            (folder / MASKS).mkdir()
            for framing in {entry["framing"] for entry in record["images"]}:
                Image.fromarray(np.where(mask(), 255, 0).astype(np.uint8)).save(
                    folder / MASKS / f"{framing}.png"
                )
        return folder

    return write


def flags(folder, **limits):
    found = inspect(load_manifest(folder), folder / "inspection", Limits(**limits))
    return {(flag.kind, flag.cell) for flag in found.flags}, found


QUIET = {"noise_levels": 50.0, "luminance": 0.02}  # the stripes are no noise and no light


def test_a_fair_study_has_no_flags(study):
    found, all_of_it = flags(study(), **QUIET)
    assert found == set()
    assert len(all_of_it.pictures) == 15 and len(all_of_it.pairs) == 30
    assert all(pair.outside == 0 for pair in all_of_it.pairs)
    assert all_of_it.top >= 1


def outside(own):
    own = own.copy()
    own[:4, :4] += 3
    return own


@pytest.mark.parametrize(
    ("kind", "change", "words"),
    [
        ("brightness", lambda own: own * 1.06, "brighter over the skin"),
        ("colour", lambda own: own + [0, 0, 14], "mean colour"),
        ("clipped", lambda own: np.where(own > 205, 255, own), "clipped highlights"),
        ("outside", outside, "differ by up to 3 levels where nothing scatters"),
    ],
)
def test_what_biases_is_flagged_where_it_is(study, kind, change, words):
    found, all_of_it = flags(study(golubev=change), **QUIET)
    assert (kind, CELL) in found and {cell for _, cell in found} == {CELL}
    assert any(words in flag.words and "by golubev" in flag.words for flag in all_of_it.flags)


def test_noise_is_measured_and_flagged(study):
    rng = np.random.default_rng(3)
    grain = rng.normal(size=(200, 200)) * 4
    ramp = np.add.outer(np.arange(200) * 0.3, np.arange(200) * 0.2) + 60
    for levels in (0.0, 1.0):
        image = np.repeat(np.rint(ramp + levels * grain)[..., None], 3, axis=2).astype(np.uint8)
        measured = noise(image, np.ones((200, 200), bool))
        assert measured == pytest.approx(4.0 * levels, abs=0.45)
    folder = study(golubev=lambda own: own + 12 * rng.normal(size=own.shape) * mask()[..., None])
    _, all_of_it = flags(folder, **QUIET)
    own = sorted((one.noise, one.technique) for one in all_of_it.pictures if one.cell == CELL)
    assert own[-1][1] == "golubev" and own[-1][0] > own[-2][0] + 1
    others = [
        one.noise for one in all_of_it.pictures if (one.cell, one.technique) != (CELL, "golubev")
    ]
    limit = 0.5 * (own[-1][0] + max(others))
    found, _ = flags(folder, luminance=0.02, colour=5.0, noise_levels=limit, noise_ratio=0.0)
    assert found == {("noise", CELL)}


def test_pairs_that_look_alike_are_flagged_by_difference_or_prediction(study):
    folder = study()
    record = json.loads((folder / "manifest.json").read_text())
    images = {(e["framing"], e["technique"]): e for e in record["images"]}
    one, other = images[CELL, "none"], images[CELL, "golubev"]
    # the same pixels: nobody can tell them apart
    (folder / other["file"]).write_bytes((folder / one["file"]).read_bytes())
    other["sha256"] = one["sha256"]
    (folder / "manifest.json").write_text(json.dumps(record))
    found, all_of_it = flags(folder, **QUIET)
    assert found == {("alike", CELL)}
    # a prediction goes over what the difference says
    third = images[CELL, "golubev_plus"]
    record["visibility"] = {
        "metric": "by hand",
        "pairs": [
            {"cell": CELL, "a": "none", "b": "golubev_plus", "jod": 9.95}
            | {"sha256_a": one["sha256"], "sha256_b": third["sha256"]}
        ],
    }
    (folder / "manifest.json").write_text(json.dumps(record))
    _, all_of_it = flags(folder, **QUIET)
    words = [flag.words for flag in all_of_it.flags]
    assert any("predicted 0.05 JOD apart as shown" in line for line in words)


def test_without_masks_all_of_an_image_counts_and_the_page_says_so(study, capsys):
    folder = study(masked=False)
    assert main(["inspect", str(folder), "--limit", "noise_levels=50"]) == 0
    page = (folder / "inspection" / "index.html").read_text(encoding="utf-8")
    assert "has no masks" in page and "30 flags" not in capsys.readouterr().out
    maps = sorted((folder / "inspection" / "maps").glob("*.png"))
    assert len(maps) == 30


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--limit", "brightness=1"], "no limit 'brightness'; expected one of luminance"),
        (["--limit", "colour=red"], "got 'colour=red'; expected NAME=NUMBER"),
        (["--limit", "colour=-1"], "limit colour is -1.0; expected a number from 0"),
    ],
)
def test_bad_limits_are_one_line(study, capsys, arguments, words):
    assert main(["inspect", str(study()), *arguments]) != 0
    assert words in capsys.readouterr().err


def test_a_mask_of_another_size_is_refused(study):
    folder = study()
    Image.new("L", (8, 8)).save(folder / MASKS / f"{CELL}.png")
    with pytest.raises(InputError, match="is 8x8; expected the images' 96x64"):
        flags(folder)


def test_titles_are_escaped_and_the_script_is_whole(study):
    folder = study()
    record = json.loads((folder / "manifest.json").read_text())
    record["study"]["title"] = "<script>alert(1)</script>"
    (folder / "manifest.json").write_text(json.dumps(record))
    manifest = load_manifest(folder)
    page = inspection.write(
        manifest, inspect(manifest, folder / "inspection"), folder / "inspection"
    ).read_text(encoding="utf-8")
    assert "<script>alert" not in page and "&lt;script&gt;alert" in page
    script = inspection.script()
    assert "import " not in script.split("class Viewer")[0] and "export" not in script
    assert "class Viewer" in script


@pytest.mark.parametrize(
    ("viewer", "width"),
    [
        ({"display": "1:1"}, WIDTH),
        ({"display": "fit"}, 384),  # four times as wide, a step of 16 pixels
        ({"modes": ["boosted"], "reference": "golubev", "boost": {"amplify": 3}}, WIDTH),
    ],
)
def test_what_a_browser_fetches_is_what_the_server_sends(tmp_path, write_study, viewer, width):
    folder = write_study(tmp_path / "study", size=(WIDTH, HEIGHT), viewer=viewer)
    found = inspection.fetched(load_manifest(folder))
    app = create_app(folder, f"sqlite:///{tmp_path}/db")
    sizes = {"image/webp": 0, "image/png": 0}
    with app.test_request_context():
        pictures = [web.side(one) for one in app.extensions["study"].manifest.images]
        if "reference" in viewer:
            cells = app.extensions["study"].cells
            pictures += [
                web.picture(app.extensions["study"].manifest.reference(cell)) for cell in cells
            ]
    for address in {one["address"] for one in pictures}:
        for accept in sizes:
            sent = app.test_client().get(f"{address}{width}", headers={"Accept": accept})
            assert sent.mimetype == accept
            sizes[accept] += len(sent.data)
    assert (found.webp, found.png) == tuple(sizes.values())
    assert found.images == len({one["address"] for one in pictures})
    assert "on 1920x1080" in found.words
