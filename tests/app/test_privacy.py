"""docs/privacy.md against the schema: every table is in it, and its way to delete deletes."""

import re
from pathlib import Path

import pytest
from sqlalchemy import text

from app.models import Base, Participant, Response, Statement

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "privacy.md").read_text()
#: Nothing of a person: what the study is, its questions in their order, and numbers for one page.
OF_NOBODY = {"study", "trials", "live"}
#: What is left of who withdrew and was deleted, as the page says.
LEFT = {
    "id",
    "visit",
    "consented_at",
    "consent_language",
    "consent_sha256",
    "completion_code",
    "withdrawal_key",
    "resume_code",
    "completed_at",
    "withdrawn_at",
    "pilot",
    "list_number",
    "excluded_at",
    "excluded_because",
}


def test_the_page_names_every_table_that_is_about_somebody():
    rows = re.findall(r"^\|.*\|$", PAGE, re.M)
    named = set(re.findall(r"`(\w+)`", " ".join(row.split("|")[2] for row in rows)))
    assert named - {"where"} == set(Base.metadata.tables) - OF_NOBODY


def test_what_the_page_says_of_deleting_deletes_who_withdrew_and_nobody_else(app, person):
    one = person().begin().answer(1, 2)
    person().begin().answer(-1)
    database = app.extensions["database"]
    with database.write() as db:
        for number in (1, 2):
            db.add(Statement(participant_id=number, name="own", value="told-by-them"))
            participant = db.get(Participant, number)
            participant.screen = participant.recruit = participant.design_state = "told-by-them"
            participant.recruit_id = f"told-by-them-{number}"
    one.get("/withdraw")
    one.send("confirm", confirm="yes")
    commands = re.search(r"(?s)    (DELETE FROM responses.*?)    VACUUM;", PAGE)[1]
    with database.write() as db:
        for command in filter(str.strip, commands.split(";")):
            db.execute(text(command))
    with database.read() as db:
        gone, stays = db.get(Participant, 1), db.get(Participant, 2)
        columns = set(Base.metadata.tables["participants"].columns.keys())
        told = {name for name in columns - LEFT if getattr(gone, name) is not None}
        assert not told and stays.recruit_id == "told-by-them-2" and stays.familiarity == 3
        assert [row.participant_id for row in db.query(Response)] == [2]
        assert [row.participant_id for row in db.query(Statement)] == [2]


@pytest.mark.sqlite
def test_nothing_of_it_is_in_the_file_after_the_vacuum(app, person, study_dir):
    import sqlite3

    somebody = person().begin()
    somebody.send("trial", answer=1, rt_ms=321, reason_text="told-by-them")
    somebody.get("/withdraw")
    somebody.send("confirm", confirm="yes")
    app.extensions["database"].close()
    files = list(study_dir.glob("study.sqlite3*"))
    assert b"told-by-them" in b"".join(path.read_bytes() for path in files)
    with sqlite3.connect(study_dir / "study.sqlite3", isolation_level=None) as db:
        db.executescript(re.search(r"(?s)    (DELETE FROM responses.*?VACUUM;)", PAGE)[1])
    db.close()
    files = list(study_dir.glob("study.sqlite3*"))
    assert b"told-by-them" not in b"".join(path.read_bytes() for path in files)
