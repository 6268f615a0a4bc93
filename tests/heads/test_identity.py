"""People drawn from a seed: the same for the same, within bounds, and of targets that there are."""

import tomllib

import numpy as np
import pytest
from click.testing import CliRunner

from app.cli import cli
from renderer.errors import InputError
from stimuli import scenes
from stimuli.drawing import own_files
from stimuli.heads.fetch import mpfb_data
from stimuli.heads.identity import MELANIN, Bounds, draw, exposure, written
from stimuli.heads.person import Person
from stimuli.parts import PEOPLE, names, person_table
from stimuli.study import with_head

SEEDS = range(24)
SCENE = scenes.load_table("thesis")


def test_a_seed_draws_the_same_person_and_another_another():
    assert draw(3) == draw(3) and draw(3) != draw(4)
    assert draw(3, Bounds(apart=0.5)) != draw(3)


def test_drawn_people_are_people_within_bounds():
    data, people = mpfb_data(), [draw(seed) for seed in SEEDS]
    for table in people:
        person = Person.read(table, "drawn")
        assert 20 <= person.form.age_years <= 75
        assert MELANIN[0] * 0.99 <= table["skin"]["melanin"] <= MELANIN[1] * 1.01
        for name in table["targets"]:
            assert (data / "targets" / f"{name}.target.gz").is_file(), name
        macro = [w for n, w in table["targets"].items() if n.startswith("macrodetails/universal")]
        assert sum(macro) == pytest.approx(1.0, abs=0.01)
    tones = [np.log(table["skin"]["melanin"]) for table in people]
    assert np.ptp(tones) > 0.7 * np.ptp(np.log(MELANIN))
    assert {"female", "male"} == {table["about"].split("sex ")[1].split(",")[0] for table in people}


def test_bounds_narrow_who_is_drawn():
    bounds = Bounds("female", (60.0, 65.0), (0.8, 0.9), apart=0.0)
    table = draw(1, bounds)
    person = Person.read(table, "drawn")
    assert 60 <= person.form.age_years <= 65 and person.hair.stubble == 0
    assert not any(name.startswith("nose/") for name in table["targets"])
    with pytest.raises(InputError, match="age_years is"):
        Bounds(age_years=(50.0, 40.0))


def test_another_head_stays_dressed():
    portrait = scenes.load_table("portrait")
    made = scenes.read_scene(with_head(portrait, "7")).objects["head"]
    assert made.person == "7" and made.dressed
    assert not scenes.read_scene(with_head(SCENE, "7")).objects["head"].dressed


def test_a_drawn_person_is_a_file_too(tmp_path):
    """What `person draw` writes is read as what the seed draws."""
    assert tomllib.loads(written(5)) == draw(5)
    out = tmp_path / "five.toml"
    said = CliRunner().invoke(cli, ["person", "draw", "5", "--out", str(out)])
    assert said.exit_code == 0 and "seed 5" in said.output
    by_seed = scenes.read_scene(with_head(SCENE, "5"))
    by_file = scenes.read_scene(with_head(SCENE, str(out)))
    assert by_seed.materials == by_file.materials and by_seed.picture == by_file.picture
    assert own_files(by_seed)[0][0] == "person 5"
    assert own_files(by_seed) != own_files(scenes.read_scene(with_head(SCENE, "6")))


def test_exposure_follows_the_person_whom_the_camera_looks_at():
    dark = person_table("man_dark")
    light = scenes.read_scene(SCENE).picture.exposure
    patch = {"objects": {"head": {"person": "man_dark"}}}
    assert dark["exposure"] > 1.3
    made = scenes.read_scene(scenes.merge(SCENE, patch)).picture.exposure
    base = SCENE["picture"]["exposure"]
    assert made == pytest.approx(base * dark["exposure"])
    assert light == pytest.approx(base * person_table("man")["exposure"])


@pytest.mark.parametrize("name", names(PEOPLE))
def test_the_people_that_ship_have_the_exposure_of_their_skin(name):
    table = person_table(name)
    assert table["exposure"] == pytest.approx(exposure(table["skin"]), abs=0.02) and table["about"]


def test_brows_are_people_s_own_and_men_s_the_fuller():
    drawn = [draw(seed, Bounds(sex)) for sex in ("female", "male") for seed in range(12)]
    low, high = (
        np.mean([table["hair"]["brow_half_mm"] * table["hair"]["brows"] for table in each])
        for each in (drawn[:12], drawn[12:])
    )
    assert high > 1.4 * low
    for tables in (drawn, [person_table(name) for name in names(PEOPLE)]):
        read = [Person.read(table, "person").hair for table in tables]
        shapes = {
            (h.brows, h.brow_half_mm, h.brow_arch_mm, h.brow_inner_mm, h.brow_tail) for h in read
        }
        assert len(shapes) == len(read)
        assert np.ptp([h.brow_arch_mm for h in read]) > 2.0


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["draw", "5", "--out", "x.txt"], "ends in .toml"),
        (["draw", "5", "--age", "50", "40", "--out", "x.toml"], "age_years is"),
        (["sheet", "nobody", "--out", "x.png"], "no person 'nobody'"),
        (["sheet", "man", "--out", "x.gif"], "expected .png or .jpg"),
    ],
)
def test_what_cannot_be_drawn_is_said(words, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = CliRunner().invoke(cli, ["person", *words])
    assert said.exit_code and expected in said.output + str(said.exception)
    assert not list(tmp_path.iterdir())
