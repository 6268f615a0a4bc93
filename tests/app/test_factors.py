"""A study with factors, from its manifest through the pages to the tables of each factor."""

import hashlib
import json

import numpy as np
import pytest
from PIL import Image

from analysis.codebook import read_manifest
from analysis.compute import everything
from analysis.options import Options
from analysis.responses import read_responses
from app import create_app, export
from app.simulation.people import Crowd

FACTORS = {"person": ("anna", "bert"), "light": ("studio", "noon")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One framing, two people, two lights, three techniques: 4 cells of 3 pairs."""
    folder = tmp_path_factory.mktemp("factors")
    images = []
    for p, person in enumerate(FACTORS["person"]):
        for k, light in enumerate(FACTORS["light"]):
            for t, technique in enumerate(("none", "golubev", "gosselin")):
                file = f"near.{person}.{light}_{technique}.png"
                colour = (60 * t, 100 * p, 100 * k)
                Image.fromarray(np.full((8, 8, 3), colour, np.uint8)).save(folder / file)
                digest = hashlib.sha256((folder / file).read_bytes()).hexdigest()
                images.append(
                    {
                        "framing": "near",
                        "levels": {"person": person, "light": light},
                        "technique": technique,
                        "file": file,
                        "sha256": digest,
                        "width": 8,
                        "height": 8,
                    }
                )
    study = {
        "name": "crossed",
        "title": "Which one?",
        "version": 1,
        "seed": 3,
        "framings": [{"name": "near", "label": "Near"}],
        "factors": [
            {
                "name": name,
                "label": name.title(),
                "levels": [{"name": level, "label": level.title()} for level in levels],
            }
            for name, levels in FACTORS.items()
        ],
        "techniques": [
            {"name": name, "label": name.title()} for name in ("none", "golubev", "gosselin")
        ],
    }
    manifest = {"format": "subdermal-manifest/2", "study": study, "images": images}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


@pytest.fixture(scope="module")
def table(folder):
    """responses.csv of eight people who answered through the pages."""
    from tests.app.conftest import Person

    app = create_app(folder)
    study = app.extensions["study"]
    crowd = Crowd(study, 1)
    for number in range(1, 9):
        person = Person(app).begin(familiarity=1 + number % 5)
        if number == 1:
            assert b"12 questions; most people need 4 to 6 minutes" in Person(app).get("/").data
        with app.extensions["database"].read() as session:
            trials = [
                (t.order, t.cell, t.left, t.right)
                for t in session.get(export.Participant, number).trials
            ]
        person.answer(*(crowd.answer(number, *trial)[0] for trial in trials))
    path = folder / "responses.csv"
    with app.extensions["database"].read() as session:
        path.write_text("".join(export.responses_csv(session, study, simulated=False)))
        book = export.codebook_md(study, simulated=False)
    assert "| `light` |" in book and "- person `bert`: Bert" in book
    return path


def test_the_page_shows_the_region_of_each_cell(folder, tmp_path):
    """Each cell's images are sent cut to their region."""
    import shutil

    copy = tmp_path / "regions"
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("*.sqlite3*"))
    manifest = json.loads((copy / "manifest.json").read_text())
    for image in manifest["images"]:
        if image["levels"] == {"person": "anna", "light": "noon"}:
            image["region"] = [0.25, 0.5, 0.75, 1]
    (copy / "manifest.json").write_text(json.dumps(manifest))
    app = create_app(copy)
    root, gap, *rules = app.test_client().get("/study.css").text.splitlines()
    assert gap.startswith(".pair { --gap: ")
    assert root == ":root { --surround: rgb(108 108 108); --on-surround: #fff; }"
    study = app.extensions["study"]
    boxes = [study.image(cell, study.techniques[0]).box for cell in study.cells]
    (width, height) = boxes[0][2:]
    assert boxes[0][:2] == (0, 0)
    assert boxes[1] == (width // 4, height // 2, width * 3 // 4, height)
    assert rules[1] == f'[data-cell="1"] {{ --ratio: {width / height:.6f}; }}'
    assert len(rules) == len(study.cells) == 4


def test_every_answer_is_used_by_each_factor(folder, table):
    header = table.read_text().splitlines()[0].split(",")
    assert header[2:5] == ["framing", "person", "light"]
    for factor in ("framing", "person", "light"):
        answers = read_responses(table, read_manifest(folder), factor=factor)
        assert len(answers.frame) == 8 * 12 and not answers.findings
        levels = FACTORS.get(factor, ("near",))
        assert tuple(answers.codebook.framings) == levels
    assert answers.codebook.framing_label("noon") == "Noon"
    assert any("repeated measures" in note for note in answers.notes)


def test_the_tables_of_a_factor_hold_its_levels(folder, table):
    answers = read_responses(table, read_manifest(folder), factor="person")
    found = everything(answers, Options(resamples=100, models=("bradley_terry",)))
    assert set(found.tables["worths"].framing) == {"anna", "bert", "overall"}
    pairs = found.tables["pairs"]
    assert set(pairs.n) == {8}  # people: each one's two answers in a level are one mean
    wide = found.tables["tallies"]
    assert {"anna", "bert"} <= set(wide.framing)
