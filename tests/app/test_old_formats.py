"""What the first edition wrote still opens: its manifest, its database, its table of answers.

The files were made by the first edition (commit 65e2347): a study of ready-made images with two
framings and two techniques, two people of whom one has finished.
"""

import shutil
import sqlite3
from pathlib import Path

import pytest

from analysis.codebook import read_manifest
from analysis.responses import read_responses
from app import create_app
from app.models import Trial
from stimuli.manifest import load_manifest

FILES = Path(__file__).parent / "first_edition"


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(FILES, tmp_path / "study"))


def test_the_manifest_opens(folder):
    manifest = load_manifest(folder)
    assert [cell.name for cell in manifest.study.cells] == ["near", "far"]
    assert manifest.image("far", "blender").framing == "far"
    assert "{" not in manifest.study.consent


@pytest.mark.sqlite
def test_the_database_opens_and_goes_on(folder):
    before = sqlite3.connect(folder / "study.sqlite3").execute("SELECT framing FROM trials")
    framings = [row[0] for row in before]
    app = create_app(folder)
    database = app.extensions["database"]
    with database.read() as session:
        assert [trial.cell for trial in session.query(Trial).order_by(Trial.id)] == framings
    with app.test_client() as visitor:
        assert b"Which engine?" in visitor.get("/").data


def test_the_table_of_answers_is_read(folder):
    answers = read_responses(folder / "responses.csv", read_manifest(folder))
    assert answers.participants == 2 and len(answers.frame) == 3


def test_no_factor_takes_the_name_of_a_column():
    from app.export import COLUMNS
    from stimuli.study import RESERVED

    assert {column.name for column in COLUMNS} <= RESERVED
