"""The definition of a study: the thesis's loads, and what is wrong in another is named."""

import re

import pytest

from analysis.declared import options
from stimuli.errors import InputError
from stimuli.scenes import load_table, read_scene
from stimuli.study import THESIS, Study, load_study, read_study
from stimuli.table import Table
from tests.stimuli.conftest import TOML


def test_thesis_study():
    """Chapter 4 of the thesis: five conditions at three framings; the order is that of its
    matrices.
    """
    study = load_study(THESIS)
    assert [framing.name for framing in study.framings] == ["close-up", "head-shot", "half-length"]
    assert [(condition.name, condition.label) for condition in study.techniques] == [
        ("none", "No SSS"),
        ("jimenez_separable", "Separable"),
        ("golubev", "Golubev"),
        ("golubev_plus", "Golubev Plus"),
        ("jimenez_gaussian", "Gaussian"),
    ]
    assert all(condition.technique == condition.name for condition in study.techniques)
    assert [level.value for level in study.scale] == [-2, -1, 0, 1, 2]
    assert len(study.familiarity.labels) == 5
    assert study.render.size == (1920, 1080)
    assert study.scene == load_table("thesis") and study.questions == 30


def test_what_is_asked_defaults_to_the_thesis(small_study):
    thesis = load_study(THESIS)
    for part in ("question", "scale", "familiarity", "consent"):
        assert getattr(small_study, part) == getattr(thesis, part)


def test_technique_and_parameters_of_a_condition(small_study):
    plain, soft = small_study.techniques
    assert (plain.technique, plain.parameters) == ("plain", {})
    assert (soft.technique, soft.parameters) == ("blur", {"radius_mm": 2.5})


def test_parameters_of_all_techniques_stand_once_and_give_way_to_a_techniques_own(write_toml):
    def parameters(text):
        study = load_study(write_toml(text))
        return {one.name: one.parameters for one in study.techniques}

    text = TOML.replace("[[techniques]]", "[parameters]\nradius_mm = 1.0\n\n[[techniques]]", 1)
    assert parameters(text) == {"plain": {"radius_mm": 1.0}, "soft": {"radius_mm": 2.5}}


def test_record_is_read_back(small_study):
    """What the manifest says of a study is the study, less how its images were made."""
    again = read_study(Table(small_study.record(), "manifest"))
    assert again.record() == small_study.record()
    assert isinstance(again, Study) and again.render is None and again.scene is None


def test_what_is_declared_of_the_analysis_is_kept_as_written(small_study, write_toml):
    assert small_study.analysis == {} and "analysis" not in small_study.record()
    study = load_study(
        write_toml(
            write_toml().read_text()
            + "\n[analysis]\nmargin = 0.3\n[analysis.exclusions]\nzeta = false\n"
        )
    )
    assert study.analysis == {"margin": 0.3, "exclusions": {"zeta": False}}
    assert read_study(Table(study.record(), "manifest")).analysis == study.analysis


def test_analysis_is_checked_once_with_one_answer(write_toml):
    """0.9995 was refused by the study and taken by the analysis; 1 by neither."""
    text = write_toml().read_text()
    study = load_study(write_toml(text + "\n[analysis]\nlevel = 0.9995\n"))
    assert options(study.analysis).level == 0.9995
    with pytest.raises(InputError, match="analysis.level is 1, expected a number between") as one:
        load_study(write_toml(text + "\n[analysis]\nlevel = 1\n"))
    with pytest.raises(InputError) as other:
        options({"level": 1}, str(one.value).partition(".level")[0])
    assert str(one.value) == str(other.value)


def test_a_framing_carries_its_region(write_toml):
    text = (
        write_toml().read_text().replace('name = "near"', 'name = "near"\nregion = [0, 0, 0.5, 1]')
    )
    study = load_study(write_toml(text))
    near, far = study.cells
    assert study.scene_of(near)["camera"]["region"] == [0, 0, 0.5, 1]
    assert "region" not in study.scene_of(far).get("camera", {})
    assert study.record()["framings"][0]["region"] == [0.0, 0.0, 0.5, 1.0]
    assert "region" not in study.record()["framings"][1]
    with pytest.raises(InputError, match=r"framings\[0\]\.region is .*, expected .left, top"):
        load_study(write_toml(text.replace("0.5, 1]", "0.5, 2]")))


def test_a_study_has_its_own_levels_of_the_self_rating(write_toml):
    rating = '[familiarity]\nquestion = "?"\nlabels = ["never", "daily"]\nlevels = [0, 7]\n[render]'
    study = load_study(write_toml(write_toml().read_text().replace("[render]", rating, 1)))
    assert (study.familiarity.labels, study.familiarity.levels) == (("never", "daily"), (0, 7))
    assert read_study(Table(study.record(), "manifest")).familiarity == study.familiarity


def test_head_file_lies_beside_the_study(write_toml):
    path = write_toml(
        write_toml().read_text() + '\n[head]\nname = "scan.glb"\nunit = "cm"\nup = "z"\n'
    )
    scene = load_study(path).scene
    file = str(path.parent / "scan.glb")
    assert scene["objects"]["head"] == {"shape": "scan", "file": file, "unit": "cm", "up": "z"}


FACTORS = """
[[factors]]
name = "person"
label = "Person"
[[factors.levels]]
name = "man"
label = "A man"
[[factors.levels]]
name = "pale"
label = "A pale man"
set = { objects = { head = { person = "man" } }, materials = { head = { melanin = 0.05 } } }

[[factors]]
name = "light"
label = "Light"
[[factors.levels]]
name = "studio"
label = "Studio"
[[factors.levels]]
name = "noon"
label = "Noon"
"""


def test_factors_are_crossed_and_their_levels_patch_the_scene(write_toml):
    study = load_study(write_toml(write_toml().read_text() + FACTORS))
    assert len(study.cells) == 8 and study.questions == 8
    cell = study.cell("far.pale.noon")
    assert cell.levels == {"framing": "far", "person": "pale", "light": "noon"}
    assert study.cell_label(cell) == "Far, A pale man, Noon"
    table = study.scene_of(cell)
    assert table["rig"] == "noon" and table["materials"]["head"]["melanin"] == 0.05
    scene = read_scene(table)
    assert list(scene.lights) == ["sun"] and scene.camera.framing == "far"
    assert scene.materials["head"].melanin == 0.05
    again = read_study(Table(study.record(), "manifest"))
    assert again.cells == study.cells and again.record() == study.record()


def test_cells_can_be_listed(write_toml):
    cells = """
[[cells]]
framing = "near"
person = "man"
light = "noon"
[[cells]]
framing = "far"
person = "pale"
light = "studio"
"""
    study = load_study(write_toml(write_toml().read_text() + FACTORS + cells))
    assert [cell.name for cell in study.cells] == ["near.man.noon", "far.pale.studio"]
    assert read_study(Table(study.record(), "manifest")).cells == study.cells


def test_a_study_without_framings_has_one(write_toml):
    text = write_toml().read_text()
    start, end = text.index("[[framings]]"), text.index("[[techniques]]")
    study = load_study(write_toml(text[:start] + text[end:]))
    assert [cell.name for cell in study.cells] == ["head-shot"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FACTORS.replace('"light"', '"answer"'), r"factors\[1\]\.name: got 'answer'"),
        (FACTORS.replace('"light"', '"weather"'), r"factors\[1\]\.levels\[0\]\.set: missing"),
        (FACTORS.replace('"pale"', '"man"'), r"levels\[1\]\.name: got 'man', expected a value"),
        (FACTORS + '[[cells]]\nframing = "near"\nperson = "man"', r"cells\[0\]\.light: missing"),
    ],
)
def test_factors_at_fault_are_named(write_toml, text, message):
    with pytest.raises(InputError, match=message):
        load_study(write_toml(write_toml().read_text() + text))


def test_consent_knows_its_placeholders(write_toml):
    with pytest.raises(InputError, match=r"consent: got '\{people\}', expected one of"):
        load_study(write_toml('consent = "{questions} of {people}"\n' + write_toml().read_text()))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "small"', 'name = "small', r"line 2"),
        ('name = "small"', "", r"name: missing, expected a name"),
        (
            'name = "small"',
            'name = "Small one"',
            r"name: got 'Small one', expected a name of small letters",
        ),
        (
            'title = "Which is rounder?"',
            'title = " "',
            r"title: got ' ', expected a text that is not blank",
        ),
        ("version = 3", "version = true", r"version: got True, expected an integer from 1"),
        ("seed = 7", "seed = -1", r"seed: got -1, expected an integer from 0"),
        ("seed = 7", "sede = 7", r"seed: missing"),
        (
            "seed = 7",
            "seed = 7\nquestions = 1",
            r"questions: unknown key, did you mean 'question'\?",
        ),
        ("[32, 18]", "[32]", r"render\.size: got \[32\], expected \[width, height\] in pixels"),
        ("[32, 18]", "[32.0, 18]", r"render\.size: got"),
        (
            "supersample = 1",
            "supersample = 0",
            r"render\.supersample: got 0, expected an integer from 1 to 4",
        ),
        ("supersample = 1", "samples = 1", r"render\.samples: unknown key"),
        (
            'name = "far"',
            'name = "near"',
            r"framings\[1\]\.name: got 'near', expected a value that differs from framings\[0\]",
        ),
        (
            'label = "Soft"',
            'label = "Plain"',
            r"techniques\[1\]\.label: got 'Plain', expected a value that differs",
        ),
        (
            'technique = "blur"',
            "technique = 3",
            r"techniques\[1\]\.technique: got 3, expected a name",
        ),
        ("{ radius_mm = 2.5 }", "2.5", r"techniques\[1\]\.parameters: got 2\.5, expected a table"),
        (
            'label = "Soft"',
            'label = "Soft"\nparams = {}',
            r"techniques\[1\]\.params: unknown key, did you mean 'parameters'",
        ),
        (
            "[render]",
            '[question]\ntext = "?"\nleft_label = "A"\n[render]',
            r"question\.right_label: missing",
        ),
        ("[render]", "scale = 5\n[render]", r"scale: got 5, expected a list of 2 to 11 tables"),
        (
            "[render]",
            "scale = ["
            + ", ".join(f'{{value = {v}, label = "{v}"}}' for v in (-2, -1, 0, 2, 1))
            + "]\n[render]",
            r"scale: got \[-2, -1, 0, 2, 1\], expected values that ascend",
        ),
        (
            "[render]",
            '[familiarity]\nquestion = "?"\nlabels = ["a"]\n[render]',
            r"familiarity\.labels is .*, expected texts, two or more",
        ),
        (
            "[render]",
            '[head]\nunit = "ft"\n[render]',
            r"head\.unit: got 'ft', expected one of mm, cm, m, in",
        ),
        ("[render]", '[head]\nname = ""\n[render]', r"head\.name: got ''"),
        (
            "[render]",
            "[analysis]\nmargins = 1\n[render]",
            r"analysis names the unknown margins; did you mean 'margin'",
        ),
        (
            "[render]",
            "[analysis]\nmargin = 0\n[render]",
            r"analysis\.margin is 0, expected a number above 0",
        ),
        (
            "[render]",
            "[analysis]\nmargin = true\n[render]",
            r"analysis\.margin is True, expected a number",
        ),
        (
            "[render]",
            '[analysis]\ntest = "t"\n[render]',
            r"analysis\.test is 't', expected one of wilcoxon, sign",
        ),
        (
            "[render]",
            "[analysis.exclusions]\nzeta = 2\n[render]",
            r"analysis\.exclusions\.zeta is 2, expected a number from -1 to 1",
        ),
        (
            "[render]",
            "[analysis.exclusions]\nspeed = 2\n[render]",
            r"analysis\.exclusions names the unknown speed",
        ),
    ],
)
def test_faults_are_named(write_toml, old, new, message):
    text = write_toml().read_text()
    assert old in text
    with pytest.raises(InputError, match=message) as caught:
        load_study(write_toml(text.replace(old, new, 1)))
    assert "small.toml" in str(caught.value) and "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_one_technique_is_no_comparison(write_toml):
    text = write_toml().read_text()
    with pytest.raises(
        InputError, match=r"techniques: got .*, expected a list of at least 2 tables"
    ):
        load_study(write_toml(text[: text.rindex("[[techniques]]")]))


def test_unreadable_file(tmp_path):
    with pytest.raises(InputError, match="no.toml: cannot be read: No such file"):
        load_study(tmp_path / "no.toml")
    with pytest.raises(InputError, match="cannot be read: Is a directory"):
        load_study(tmp_path)
    (tmp_path / "latin.toml").write_bytes('a = 1\nname = "é"'.encode("latin-1"))
    with pytest.raises(InputError, match=re.escape("latin.toml: line 2: not UTF-8 text")):
        load_study(tmp_path / "latin.toml")
