"""What researchers note, who sees it, and who never does."""

import csv
import io
import re

import pytest
from sqlalchemy import select

from app import archive, create_app
from app.models import Note

HOSTILE = "<script>alert(1)</script>\n\"'><img src=x onerror=alert(1)> {{7*7}}"


def add(somebody, text, place="/dashboard/notes"):
    """Send the form of a note, as the page that has it would."""
    somebody.get("/dashboard/participants/P0001" if "P0001" in place else "/dashboard/")
    data = somebody.form("csrf_token") | {"note": text}
    somebody.page = somebody.http.post(place, data=data, follow_redirects=True)
    return somebody.page


def stored(app):
    with app.extensions["database"].read() as db:
        notes = db.scalars(select(Note).order_by(Note.id))
        return [(note.participant_id, note.who, note.text) for note in notes]


def test_notes_on_a_participant_and_on_the_study(app, person, experimenter, viewer):
    person().begin()
    person().begin()
    assert "The lamp broke" in add(experimenter, "  The lamp broke\r\nat noon ").text
    page = add(experimenter, "wore sunglasses", "/dashboard/participants/P0001/notes").text
    assert "wore sunglasses" in page and "The lamp broke" not in page
    assert stored(app) == [
        (None, "owner", "The lamp broke\nat noon"),
        (1, "owner", "wore sunglasses"),
    ]
    assert "wore sunglasses" not in viewer.get("/dashboard/participants/P0002").text
    seen = viewer.get("/dashboard/notes").text
    assert re.search(r">P0001</a>: wore sunglasses<", seen) and "The lamp broke\nat noon<" in seen
    rows = list(csv.DictReader(io.StringIO(viewer.get("/dashboard/notes.csv").text)))
    assert [(row["who"], row["participant"], row["text"]) for row in rows] == [
        ("owner", "", "The lamp broke\nat noon"),
        ("owner", "P0001", "wore sunglasses"),
    ]


def test_a_viewer_reads_notes_and_writes_none(app, person, experimenter, viewer):
    person().begin()
    add(experimenter, "wore sunglasses", "/dashboard/participants/P0001/notes")
    page = viewer.get("/dashboard/participants/P0001").text
    assert "wore sunglasses" in page and 'name="note"' not in page
    for place in ("/dashboard/notes", "/dashboard/participants/P0001/notes"):
        viewer.get("/dashboard/")
        data = viewer.form("code") | {"note": "mine"}
        assert viewer.http.post(place, data=data).status_code == 403
    assert len(stored(app)) == 1


@pytest.mark.parametrize("text", ["", " \n ", "x" * 2001])
def test_notes_that_are_none(app, experimenter, text):
    assert "A note has 1 to 2000 characters" in add(experimenter, text).text
    assert stored(app) == []


def test_nobody_is_noted_who_is_not_there(app, experimenter):
    experimenter.get("/dashboard/")
    data = experimenter.form("code") | {"note": "nobody"}
    for code in ("P0001", "P1", "x"):
        place = f"/dashboard/participants/{code}/notes"
        assert experimenter.http.post(place, data=data).status_code == 404
    assert stored(app) == []


def test_hostile_notes_are_text_wherever_they_are_shown(app, person, experimenter):
    person().begin()
    add(experimenter, HOSTILE)
    add(experimenter, "=HYPERLINK(1)", "/dashboard/participants/P0001/notes")
    add(experimenter, HOSTILE, "/dashboard/participants/P0001/notes")
    for path in ("/dashboard/", "/dashboard/participants/P0001", "/dashboard/notes"):
        page = experimenter.get(path).text
        assert "&lt;script&gt;alert(1)" in page and "{{7*7}}" in page
        assert "<script>alert" not in page and "<img src=x" not in page
    assert not re.search(r'(?:^|,)"?=', experimenter.get("/dashboard/notes.csv").text, re.M)


def test_participants_never_see_notes_and_no_table_of_answers_has_them(app, person, experimenter):
    somebody = person().begin().answer(1)
    for place in ("/dashboard/notes", "/dashboard/participants/P0001/notes"):
        add(experimenter, "a secret note", place)
    somebody.answer(*[0] * 29)
    for rule in app.url_map.iter_rules():
        path = rule.rule
        if "GET" in rule.methods and "<" not in path:
            assert "secret note" not in somebody.get(path).text, path
    for name in ("responses.csv", "responses.jsonl", "participants.csv", "log.csv", "live.json"):
        assert "secret note" not in experimenter.get(f"/dashboard/{name}").text
    assert b"secret note" not in experimenter.get("/dashboard/export.zip").data


@pytest.mark.sqlite
def test_an_archive_has_notes(app, person, experimenter, tmp_path):
    person().begin()
    add(experimenter, "on the study")
    add(experimenter, "on a person", "/dashboard/participants/P0001/notes")
    archive.write(tmp_path / "a.zip", app.extensions["study"], app.extensions["database"])
    archive.read(tmp_path / "a.zip", tmp_path / "again", None)
    again = create_app(tmp_path / "again")
    assert (
        stored(again)
        == stored(app)
        == [
            (None, "owner", "on the study"),
            (1, "owner", "on a person"),
        ]
    )
