"""A study of one's own images: what their names say, whatever they are called."""

import random
from itertools import product
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from stimuli.errors import InputError
from stimuli.folder import create, read_folder, refresh, understood
from stimuli.manifest import load_manifest
from stimuli.study import FRAMING


def write(directory: Path, *names: str, size=(8, 6), **how) -> Path:
    for k, name in enumerate(names):
        path = directory / (name if "." in Path(name).name[-5:] else f"{name}.png")
        path.parent.mkdir(parents=True, exist_ok=True)
        PIL.Image.fromarray(np.full((size[1], size[0], 3), k, np.uint8)).save(path, **how)
    return directory


def read(folder):
    return {(*one.levels.values(), one.condition): one.name for one in folder.pictures}


WORDS = ("ours", "golubev", "golubev_plus", "none", "a b", "B-2", "è", "10", "no_sss_at_all")


@pytest.mark.parametrize("seed", range(40))
def test_any_grid_of_names_is_understood(tmp_path, seed):
    """Levels and conditions of any words, joined by any separator that stands in none of them."""
    draw = random.Random(seed)
    mark = draw.choice(["__", "_", "-", " "])
    words = [word for word in WORDS if mark not in word and not (mark == "__" and "_" in word)]
    draw.shuffle(words)
    levels, conditions = words[: draw.randint(1, 3)], words[3 : 3 + draw.randint(2, 3)]
    if len(conditions) < 2:
        conditions = words[-2:]
        levels = words[:1]
    grid = {(one, other): f"{one}{mark}{other}" for one, other in product(levels, conditions)}
    assert read(read_folder(write(tmp_path / "i", *grid.values()))) == grid
    folders = {(one, other): f"{other}/{one}" for one, other in grid}
    if len(conditions) > 1:
        assert read(read_folder(write(tmp_path / "j", *folders.values()))) == folders


@pytest.mark.parametrize(
    "names, pattern, conditions, levels",
    [
        (["a_x", "a_y", "b_x", "b_y"], "{level}_{condition}", ["x", "y"], ["a", "b"]),
        (["skin_near_a", "skin_near_b", "skin_far_a", "skin_far_b"], "{level}_{condition}",
         ["a", "b"], ["skin_far", "skin_near"]),
        (["golubev", "golubev plus", "none"], "{condition}",
         ["golubev", "golubev plus", "none"], ["all"]),
        (["x/a", "x/b", "y/a", "y/b"], "{condition}/{level}", ["x", "y"], ["a", "b"]),
        (["x/a_x", "x/b_x", "y/a_y", "y/b_y"], "{condition}/{level}_{condition}",
         ["x", "y"], ["a", "b"]),
        (["r_2", "r_10", "r_1"], "{level}_{condition}", ["1", "2", "10"], ["r"]),
    ],
)  # fmt: skip
def test_what_is_guessed(tmp_path, names, pattern, conditions, levels):
    folder = read_folder(write(tmp_path, *names))
    assert folder.pattern == pattern and folder.guessed
    assert list(folder.conditions) == conditions and list(folder.levels(FRAMING)) == levels


def test_a_pattern_says_otherwise_and_may_have_more_factors(tmp_path):
    write(tmp_path, "x/a", "x/b", "y/a", "y/b")
    folder = read_folder(tmp_path, "{level}/{condition}")
    assert folder.conditions == ("a", "b") and folder.levels(FRAMING) == ("x", "y")
    grid = product(("man", "woman"), ("day", "night"), ("near", "far"), ("p", "q_r"))
    write(tmp_path / "more", *(f"{p}/{light}-{v}_{c}" for p, light, v, c in grid))
    folder = read_folder(tmp_path / "more", "{person}/{light}-{level}_{condition}")
    assert folder.factors == (FRAMING, "person", "light") and folder.conditions == ("p", "q_r")
    study = create(folder, tmp_path / "s", name="s", title="S")
    assert len(study.cells) == 8 and study.questions == 8 + 1  # one practice pair
    assert {cell.name for cell in study.cells} >= {"near.man.day", "far.woman.night"}


def test_the_study_that_is_made_opens_and_is_the_images(tmp_path):
    source = write(tmp_path / "in", "close up_A", "close up_b c", "far_A", "far_b c")
    create(read_folder(source), tmp_path / "out", name="mine", title='A "title" \\ with é')
    manifest = load_manifest(tmp_path / "out")
    assert manifest.study.title == 'A "title" \\ with é'
    assert [t.label for t in manifest.study.techniques] == ["A", "B c"]
    for image in manifest.images:
        label = {"close-up": "close up", "far": "far"}[image.framing]
        condition = {"a": "A", "b-c": "b c"}[image.technique]
        assert image.path.read_bytes() == (source / f"{label}_{condition}.png").read_bytes()


def test_refreshing_takes_what_was_changed(tmp_path):
    out = tmp_path / "out"
    create(read_folder(write(tmp_path / "in", "a", "b")), out, name="s", title="S")
    before = (out / "manifest.json").read_bytes()
    assert refresh(out) and (out / "manifest.json").read_bytes() == before
    text = (out / "study.toml").read_text()
    (out / "study.toml").write_text(text.replace('title = "S"', 'title = "T"'))
    write(out / "images", "all_a", size=(9, 9))
    write(out / "images", "all_b", size=(9, 9))
    refresh(out)
    manifest = load_manifest(out)
    assert manifest.study.title == "T" and manifest.images[0].width == 9
    (out / "images/all_b.png").unlink()
    with pytest.raises(InputError, match="0 images are named all_b"):
        refresh(out)


def test_a_table_says_what_was_understood(tmp_path):
    lines = understood(read_folder(write(tmp_path, "a_x", "a_y", "b_x", "b_y")))
    assert lines[0].startswith("pattern     {level}_{condition}   (guessed")
    assert lines[1] == "conditions  x   'X'   2 images of 8x6, a_x.png, ..."
    assert lines[3] == "levels      a   'A'   2 images of 8x6, a_x.png, ..."


def _half_transparent(path):
    PIL.Image.new("RGBA", (8, 6), (0, 0, 0, 9)).save(path / "a_x.png")


def _sixteen_bits(path):
    PIL.Image.fromarray(np.zeros((6, 8), np.uint16)).save(path / "a_x.png")


def _turned(path):
    exif = PIL.Image.Exif()
    exif[0x0112] = 6
    PIL.Image.new("RGB", (8, 6)).save(path / "a_x.png", exif=exif)


def _cut_short(path):
    write(path, "a_x", size=(400, 300))
    (path / "a_x.png").write_bytes((path / "a_x.png").read_bytes()[:-60])


@pytest.mark.parametrize(
    "names, spoil, pattern, says",
    [
        ([], None, None, "holds 0 images; expected two at least"),
        (["a_x"], None, None, "holds 1 images"),
        (["a_x", "a_y", "b_x"], None, None, "no image of y at b"),
        (["x/a", "y/a", "y/b"], None, None, "no image of x at b"),
        (["x/a", "b"], None, None, "folders of different depth"),
        (["p/x/a", "p/y/a"], None, None, "2 folders deep"),
        (["x/a", "x/b", "y/a", "y/b"], None, "{level}_{condition}", "x/a is not of the pattern"),
        (["a_x", "a_y"], None, "{level}", "{condition} among them"),
        (["a_x", "a_y"], None, "{answer}_{condition}", "is no column"),
        (["a_x", "a_y"], None, "{condition}_{level}", "one condition alone, a"),
        (["a_x.png", "a_x.jpg", "a_y"], None, None, "with different endings"),
        (["a_x", "a_X"], None, None, "both become the name 'x'"),
        (["a_x", "a_y"], _half_transparent, None, "transparent pixels; expected an opaque"),
        (["a_x", "a_y"], _sixteen_bits, None, "expected 8 bits a channel"),
        (["a_x", "a_y"], _turned, None, "turned by its EXIF data"),
        (["a_x", "a_y"], _cut_short, None, "cannot be read as an image"),
        (["a_x", "a_y"], lambda p: write(p, "a_x", size=(9, 6)), None, "expected one size at a"),
        ([f"{k}" for k in range(25)], None, None, "25 images whose names tell no levels"),
    ],
)
def test_bad_input_is_one_line(tmp_path, names, spoil, pattern, says):
    source = tmp_path / "in"
    source.mkdir()
    write(source, *names)
    if spoil:
        spoil(source)
    with pytest.raises(InputError) as caught:
        folder = read_folder(source, pattern)
        create(folder, tmp_path / "out", name="s", title="S")
    assert says in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists() and list(tmp_path.iterdir()) == [source]


def test_nothing_that_is_there_is_overwritten(tmp_path):
    folder = read_folder(write(tmp_path / "in", "a", "b"))
    (tmp_path / "out").mkdir()
    (tmp_path / "out/thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match="is there already"):
        create(folder, tmp_path / "out", name="s", title="S")
    assert (tmp_path / "out/thesis.txt").read_text() == "years of work"
