"""A study in one file, and out of it again."""

import json
import zipfile

import pytest
from sqlalchemy import select

from app import archive, create_app
from app.cli import main
from app.errors import InputError
from app.models import Base, Live, Participant


def content(app):
    tables = [table for table in Base.metadata.sorted_tables if table is not Live.__table__]
    with app.extensions["database"].read() as db:
        return {
            table.name: [tuple(row) for row in db.execute(select(table).order_by(table.c.id))]
            for table in tables
        }


@pytest.fixture
def written(app, person, tmp_path):
    person().begin().answer(*[1, -2] * 15)
    person().begin().answer(0)
    rows = archive.write(
        tmp_path / "study.zip", app.extensions["study"], app.extensions["database"]
    )
    assert (rows["participants"], rows["responses"], rows["trials"]) == (2, 31, 60)
    return tmp_path / "study.zip"


@pytest.mark.parametrize("kind", ["sqlite", "the test's own"])
def test_everything_comes_back_and_goes_on(app, person, written, tmp_path, kind):
    """Over PostgreSQL, from one kind of database into the other and into its own."""
    study = app.extensions["study"]
    url = f"sqlite:///{tmp_path}/a.sqlite3" if kind == "sqlite" else study.database_url(True)
    archive.read(written, tmp_path / "elsewhere", url)
    assert written.stat().st_mode & 0o777 == 0o600
    again = create_app(tmp_path / "elsewhere", url)
    assert content(again) == content(app)
    for image in again.extensions["study"].manifest.images:
        assert image.path.read_bytes() == (study.directory / image.file).read_bytes()
    newcomer = type(person())(again).begin().answer(2)  # numbers go on
    assert newcomer.answers == [2]
    with again.extensions["database"].read() as db:
        assert db.scalars(select(Participant.id).order_by(Participant.id)).all() == [1, 2, 3]


def altered(path, name, change):
    """The archive with one member changed, or without it."""
    with zipfile.ZipFile(path) as before:
        members = {one: before.read(one) for one in before.namelist()}
    members[name] = change(members[name])
    with zipfile.ZipFile(path, "w") as after:
        for one, data in members.items():
            if data is not None:
                after.writestr(one, data)


def elsewhere(data):
    about = json.loads(data)
    about["files"]["../../evil"] = about["files"].pop("manifest.json")
    return json.dumps(about)


@pytest.mark.parametrize(
    "name, change, says",
    [
        ("tables/responses.jsonl", lambda data: data[: len(data) // 2], "responses"),
        ("tables/responses.jsonl", lambda data: None, "responses.jsonl is missing"),
        ("tables/participants.jsonl", lambda data: data.replace(b"0", b"1", 1), "participants"),
        ("study/manifest.json", lambda data: data + b" ", "manifest.json is damaged"),
        ("archive.json", lambda data: b"[]", "is not an archive"),
        ("archive.json", elsewhere, "lies outside of the study's folder"),
    ],
)
def test_a_damaged_archive_makes_nothing(written, tmp_path, capsys, name, change, says):
    altered(written, name, change)
    assert main(["restore", str(written), "--out", str(tmp_path / "new" / "study")]) == 2
    told = capsys.readouterr().err
    assert says in told and told.count("\n") == 1
    assert not list((tmp_path / "new").glob("**/*"))
    assert not (tmp_path / "evil").exists()


def test_what_is_there_is_not_written_over(app, written, study_dir, tmp_path, capsys):
    assert main(["restore", str(written), "--out", str(study_dir)]) == 2
    assert "is there already" in capsys.readouterr().err
    (tmp_path / "no.zip").write_bytes(b"PK")
    assert main(["restore", str(tmp_path / "no.zip"), "--out", str(tmp_path / "new")]) == 2
    assert "is not an archive" in capsys.readouterr().err
    url = app.extensions["database"]._engine.url.render_as_string(hide_password=False)
    with pytest.raises(InputError, match="has .*study, .* already; expected an empty one"):
        archive.read(written, tmp_path / "new", url)
    assert not (tmp_path / "new").exists()


@pytest.mark.sqlite
def test_an_archive_of_before_there_were_links_restores(app, study_dir, person, tmp_path):
    person().begin().answer(1)
    archive.write(tmp_path / "new.zip", app.extensions["study"], app.extensions["database"])
    with (
        zipfile.ZipFile(tmp_path / "new.zip") as new,
        zipfile.ZipFile(tmp_path / "old.zip", "w") as old,
    ):
        for name in new.namelist():
            data = new.read(name)
            if name == archive.ABOUT:
                about = json.loads(data)
                del about["tables"]["links"]
                data = json.dumps(about).encode()
            if name != "tables/links.jsonl":
                old.writestr(name, data)
    rows = archive.read(tmp_path / "old.zip", tmp_path / "again", None)
    assert rows["responses"] == 1 and (tmp_path / "again/study.sqlite3").is_file()
