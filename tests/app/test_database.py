"""Durable, migrated, of one kind and one study for ever."""

import json
import os
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine, inspect, select, text
from sqlalchemy.exc import DatabaseError, IntegrityError

import app as app_package
from app import create_app
from app.errors import InputError
from app.models import Base, Participant, Response, StudyRecord, now


def test_the_migrations_make_the_schema_of_the_models(app):
    with app.extensions["database"]._engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
        tables = set(inspect(connection).get_table_names())
    assert tables == {*Base.metadata.tables, "alembic_version"}


def test_constraints_are_those_of_the_models(app):
    with app.extensions["database"]._engine.connect() as connection:
        found = inspect(connection)
        for table in Base.metadata.tables.values():
            unique = {c["name"] for c in found.get_unique_constraints(table.name)}
            checks = {c["name"] for c in found.get_check_constraints(table.name)}
            foreign = {c["name"] for c in found.get_foreign_keys(table.name)}
            for constraint in table.constraints:
                name = str(constraint.name)
                if not name.startswith("pk_"):
                    assert name in unique | checks | foreign, name


@pytest.mark.sqlite
def test_sqlite_is_set_to_keep_what_it_commits(app):
    with app.extensions["database"].read() as db:
        pragmas = {
            name: db.execute(text(f"PRAGMA {name}")).scalar()
            for name in ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
        }
    assert pragmas == {
        "journal_mode": "wal",
        "synchronous": 2,
        "foreign_keys": 1,
        "busy_timeout": 30_000,
    }


def test_starting_again_keeps_everything(study_dir, person, app):
    person().begin().answer(1, 2)
    key = app.extensions["database"].record().secret_key
    app.extensions["database"].close()
    again = create_app(study_dir)
    assert again.extensions["database"].record().secret_key == key
    with again.extensions["database"].read() as db:
        assert [r.answer for r in db.scalars(select(Response))] == [1, 2]


def test_the_database_itself_refuses_a_second_answer(app, person):
    person().begin().answer(1)
    with app.extensions["database"].read() as db:
        first = db.scalars(select(Response)).one()
        copy = {c.key: getattr(first, c.key) for c in inspect(Response).columns if c.key != "id"}
    with pytest.raises(IntegrityError), app.extensions["database"].write() as db:
        db.add(Response(**copy))
    with pytest.raises(DatabaseError), app.extensions["database"].write() as db:
        db.add(Response(**copy | {"trial_id": 2, "answer": 3}))


def test_a_number_is_never_given_twice(app):
    database = app.extensions["database"]
    with database.write() as db:
        db.add_all([Participant(visit="a"), Participant(visit="b")])
    with database.write() as db:
        db.execute(
            text("DELETE FROM participants WHERE visit = 'b'")
        )  # nothing in the application does this
    with database.write() as db:
        db.add(third := Participant(visit="c"))
        db.flush()
        assert third.id == 3


def test_times_are_utc_and_aware(app):
    before = now()
    with app.extensions["database"].read() as db:
        created = db.scalar(select(StudyRecord.created_at))
    assert created.utcoffset().total_seconds() == 0 and abs((created - before).total_seconds()) < 60


@pytest.mark.sqlite
def test_real_and_simulated_never_mix(study_dir):
    create_app(study_dir)
    create_app(study_dir, simulated=True)
    for file, simulated in (("study.sqlite3", True), ("simulated.sqlite3", False)):
        with pytest.raises(
            InputError, match="kind is '(real|simulated)', expected '(real|simulated)'"
        ):
            create_app(study_dir, f"sqlite:///{study_dir / file}", simulated=simulated)


@pytest.mark.parametrize("key, value", [("name", "other"), ("version", 2), ("seed", 8)])
def test_answers_of_another_study_are_refused(study_dir, key, value):
    create_app(study_dir)
    path = study_dir / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["study"][key] = value
    path.write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=f"{key} is .*, expected {value!r}"):
        create_app(study_dir)


@pytest.mark.sqlite
@pytest.mark.parametrize(
    "url, says",
    [
        ("nonsense", "expected an SQLAlchemy URL"),
        ("nonsense://x/y", "no driver for such a database"),
        ("sqlite:////nonexistent/folder/a.sqlite3", "unable to open database file"),
        ("sqlite:///{study}/manifest.json", "file is not a database"),
    ],
)
def test_what_is_no_database_gets_one_line(study_dir, url, says):
    with pytest.raises(InputError, match=says) as caught:
        create_app(study_dir, url.format(study=study_dir))
    assert "\n" not in str(caught.value)


def test_a_database_of_a_later_version_is_left_alone(study_dir, app):
    with app.extensions["database"].write() as db:
        db.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(InputError, match="schema is not one of this version"):
        create_app(study_dir)


def test_a_password_in_the_address_is_not_repeated(study_dir):
    with pytest.raises(InputError) as caught:
        create_app(study_dir, "postgresql+nodriver://me:tops3cret@localhost/x")
    assert "tops3cret" not in str(caught.value)


def test_an_answer_is_one_look_one_row_and_one_commit(app, person):
    """What a crowd costs: statements of an answer, and nothing written by looking at a page."""
    from sqlalchemy import event

    engine, statements, commits = app.extensions["database"]._engine, [], []
    somebody = person().begin().answer(1)
    event.listen(
        engine, "before_cursor_execute", lambda c, cursor, text, *rest: statements.append(text)
    )
    event.listen(engine, "commit", lambda connection: commits.append(connection))
    form = somebody.form("trial") | {"answer": "1", "rt_ms": "321"}
    reply = somebody.http.post("/question", data=form, headers={"Accept": "application/json"})
    assert reply.json["outcome"] == "recorded"
    kinds = [text.split()[0] for text in statements if not text.startswith(("BEGIN", "SET"))]
    assert kinds == ["SELECT", "INSERT"] and len(commits) == 1
    statements.clear()
    somebody.get("/question")
    assert not any(text.startswith(("INSERT", "UPDATE", "DELETE")) for text in statements)


def test_the_history_of_the_schema_is_one_line():
    """No two migrations have one number, and each follows the one before it."""
    folder = Path(app_package.__file__).parent / "migrations"
    files = sorted((folder / "versions").glob("[0-9]*.py"))
    numbers = [file.name[:4] for file in files]
    assert len(numbers) == len(set(numbers)) and numbers[0] == "0001"
    line = list(ScriptDirectory(folder).walk_revisions())[::-1]
    assert [one.revision for one in line] == numbers
    assert [one.down_revision for one in line] == [None, *numbers[:-1]]
    assert [Path(one.path) for one in line] == files


@pytest.mark.skipif("POSTGRES_URL" not in os.environ, reason="about PostgreSQL")
def test_what_every_answer_asks_for_is_prepared_and_readers_see_one_snapshot(app, person):
    person().begin().answer(1, 2)
    database = app.extensions["database"]
    with database.look() as connection:
        asked = "SELECT count(*) FROM pg_prepared_statements WHERE statement LIKE '%participants%'"
        assert connection.execute(text(asked)).scalar() >= 2
        assert connection.execute(text("SHOW transaction_isolation")).scalar() == "repeatable read"
    with database.append() as connection:
        assert connection.execute(text("SHOW transaction_isolation")).scalar() == "read committed"


@pytest.mark.skipif("POSTGRES_URL" not in os.environ, reason="about PostgreSQL")
def test_an_answer_is_two_round_trips_and_a_page_three(app, person, monkeypatch):
    from pg8000 import core

    somebody, trips, flush = person().begin().answer(1), [], core._flush
    monkeypatch.setattr(core, "_flush", lambda sock: (trips.append(1), flush(sock)))
    form = somebody.form("trial") | {"answer": "1", "rt_ms": "321"}
    reply = somebody.http.post("/question", data=form, headers={"Accept": "application/json"})
    assert reply.json["outcome"] == "recorded" and len(trips) == 2
    trips.clear()
    somebody.get("/question")
    assert len(trips) == 3  # the last of which nobody waits for


@pytest.mark.skipif("POSTGRES_URL" not in os.environ, reason="about PostgreSQL")
def test_a_statement_that_commits_is_the_last_and_undone_where_it_fails(app, person):
    from app.questionnaire.flow import _APPEND

    somebody = person().begin().answer(1)
    database = app.extensions["database"]
    with database.look() as connection:
        row = dict(connection.execute(select(*Response.__table__.c)).mappings().one())
    with pytest.raises(IntegrityError), database.append() as connection:
        connection.execute(text("UPDATE responses SET rt_ms = 1"))
        connection.execute(_APPEND, row | {"id": row["id"] + 1})  # the trial has an answer
    assert somebody.rows[0].rt_ms == row["rt_ms"]
    new = row | {"id": row["id"] + 1, "trial_id": int(somebody.form("trial")["trial"])}
    with (
        pytest.raises(RuntimeError, match="after the one that commits"),
        database.append() as connection,
    ):
        connection.execute(_APPEND, new)
        connection.execute(text("UPDATE responses SET rt_ms = 1"))
    assert [one.rt_ms for one in somebody.rows] == [row["rt_ms"]] * 2  # what was committed is


@pytest.mark.skipif("POSTGRES_URL" not in os.environ, reason="about PostgreSQL")
def test_a_connection_that_the_database_closed_is_replaced_unseen(app, person):
    somebody = person().begin().answer(1)
    url = app.extensions["database"]._engine.url
    other = create_engine(url)
    with other.connect() as connection:
        others = "FROM pg_stat_activity WHERE pid <> pg_backend_pid() AND datname = "
        others += "current_database() AND backend_type = 'client backend'"
        assert connection.scalar(text(f"SELECT count(pg_terminate_backend(pid)) {others}")) >= 1
        connection.commit()
        while connection.scalar(text(f"SELECT count(*) {others}")):  # told to end, they end soon
            connection.commit()
    other.dispose()
    assert len(somebody.answer(1).rows) == 2
