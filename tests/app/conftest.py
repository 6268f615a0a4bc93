"""A study of ready-made images, its application, and people who use it as a browser without scripts
does.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from pathlib import Path

import numpy as np
import pytest
from argon2 import PasswordHasher
from flask import Flask
from jinja2 import BytecodeCache
from jinja2.bccache import Bucket
from PIL import Image
from sqlalchemy import create_engine, make_url, select, text
from werkzeug.routing import Rule

from app import accounts, create_app, database
from app.database import Database
from app.models import Participant, Response
from app.simulation.client import forms
from app.study import Study

FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")


class Compiled(BytecodeCache):
    """Templates as they were compiled for the first application of this process."""

    def __init__(self):
        self.code: dict[str, bytes] = {}

    def load_bytecode(self, bucket: Bucket) -> None:
        if code := self.code.get(bucket.key):
            bucket.bytecode_from_string(code)

    def dump_bytecode(self, bucket: Bucket) -> None:
        self.code[bucket.key] = bucket.bytecode_to_string()


@pytest.fixture(scope="session", autouse=True)
def compiled_once():
    """Hundreds of applications are made here: what makes the pages and addresses of one is compiled
    for the first alone, a sixth of a second each time.
    """
    builders, compile_builder = {}, Rule._compile_builder

    def kept(rule: Rule, append_unknown: bool = True):
        key = rule.rule, str(rule._trace), str(rule.defaults), append_unknown
        if key not in builders:
            builders[key] = compile_builder(rule, append_unknown)
        return builders[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Flask, "jinja_options", {"bytecode_cache": Compiled()})
        patch.setattr(Rule, "_compile_builder", kept)
        yield


@pytest.fixture(autouse=True)
def database_of_the_test(request, monkeypatch):
    """With POSTGRES_URL (`make test-postgres`), every study has its databases there; tests marked
    `sqlite` are about SQLite alone.
    """
    if not (server := os.environ.get("POSTGRES_URL")):
        yield
        return
    if request.node.get_closest_marker("sqlite"):
        pytest.skip("about SQLite")
    engine = create_engine(
        make_url(server).set(drivername="postgresql+pg8000"), isolation_level="AUTOCOMMIT"
    )
    made, opened = {}, []

    def url(study, simulated):
        key = study.directory, simulated
        if key not in made:
            made[key] = f"t{secrets.token_hex(8)}"
            with engine.connect() as db:
                db.execute(text(f"CREATE DATABASE {made[key]}"))
        return make_url(server).set(database=made[key]).render_as_string(hide_password=False)

    init = Database.__init__
    monkeypatch.setattr(Study, "database_url", url)
    monkeypatch.setattr(
        Database, "__init__", lambda self, *a: (init(self, *a), opened.append(self))[0]
    )
    yield
    for one in opened:
        one.close()
    with engine.connect() as db:
        for name in made.values():
            db.execute(text(f"DROP DATABASE {name} WITH (FORCE)"))
    engine.dispose()


#: What makes an empty SQLite database one of the newest schema, after the first test needed one.
SCHEMA = []


@pytest.fixture(autouse=True)
def migrated_once(monkeypatch):
    """The migrations run over one empty SQLite database in each process of the tests; others get
    what came out. Whatever is not empty is migrated as it is by users.
    """
    migrate = database.migrate

    def copied(connection):
        sqlite = connection.dialect.name == "sqlite"
        raw = connection.connection.dbapi_connection
        if not sqlite or raw.execute("SELECT 1 FROM sqlite_master").fetchone():
            migrate(connection)
        elif SCHEMA:
            raw.executescript(SCHEMA[0])
        else:
            migrate(connection)
            SCHEMA.append("\n".join(raw.iterdump()))

    monkeypatch.setattr("app.database.migrate", copied)
    monkeypatch.setattr("app.archive.migrate", copied)


@pytest.fixture(scope="session")
def write_study():
    """Write a study folder by hand, no renderer: 15 small PNGs and their manifest; `changes`
    replace keys of the study.
    """

    def write(directory: Path, size: tuple[int, int] = (64, 36), **changes) -> Path:
        (directory / "images").mkdir(parents=True)
        images = []
        for f, framing in enumerate(FRAMINGS):
            for t, technique in enumerate(TECHNIQUES):
                file = f"images/{framing}_{technique}.png"
                colour = (60 + 40 * t, 90, 60 + 60 * f)
                Image.fromarray(np.full((size[1], size[0], 3), colour, np.uint8)).save(
                    directory / file
                )
                digest = hashlib.sha256((directory / file).read_bytes()).hexdigest()
                image = {"framing": framing, "technique": technique, "file": file, "sha256": digest}
                images.append(image | {"width": size[0], "height": size[1]})
        study = {
            "name": "ready-made",
            "title": "Which one?",
            "version": 1,
            "seed": 7,
            "framings": [{"name": name, "label": f"at {name}"} for name in FRAMINGS],
            "techniques": [{"name": name, "label": f"by {name}"} for name in TECHNIQUES],
        }
        manifest = {"format": "subdermal-manifest/1", "study": study | changes, "images": images}
        (directory / "manifest.json").write_text(json.dumps(manifest))
        return directory

    return write


@pytest.fixture
def study_dir(tmp_path, write_study):
    return write_study(tmp_path / "study")


@pytest.fixture
def database_url():
    """Where the answers go; None: beside the study."""
    return None


@pytest.fixture
def app(study_dir, database_url, monkeypatch):
    app = create_app(study_dir, database_url)
    app.config["LIVE_PERIOD_S"] = 0  # the dashboard's numbers are made anew at once
    monkeypatch.setattr("app.researchers.PAUSE_S", 0)
    monkeypatch.setattr(accounts, "HASHER", PasswordHasher(1, 8, 1))  # as fast as it gets
    return app


@pytest.fixture
def person(app):
    """A new person with a browser of their own: `person()`."""
    return lambda: Person(app)


@pytest.fixture
def experimenter(app):
    """A browser in which an owner is signed in."""
    return researcher(app, "owner")


@pytest.fixture
def viewer(app):
    """A browser in which a viewer is signed in."""
    return researcher(app, "viewer")


PASSWORD = "a password of the tests"


def researcher(app, role):
    """A person who is signed in with an account that is named as its role is."""
    with app.extensions["doorkeeper"].database.write() as db:
        if not accounts.find(db, role):
            accounts.add(db, role, role, PASSWORD, who="the test")
    somebody = Person(app)
    somebody.get("/dashboard/login")
    somebody.send("password", name=role, password=PASSWORD)
    assert somebody.path == "/dashboard/"
    return somebody


class Person:
    """Gets pages and sends the forms that are on them; holds the last page."""

    def __init__(self, app):
        self.app, self.http = app, app.test_client()
        self.page = None

    @property
    def path(self) -> str:
        return self.page.request.path

    def get(self, path: str):
        self.page = self.http.get(path, follow_redirects=True)
        return self.page

    def form(self, field: str) -> dict[str, str]:
        """The fields of the form on the page that has `field`, as a browser would send them before
        anything is chosen.
        """
        return self._form(field).fields

    def send(self, field: str, **filled):
        """Fill in and send the form that has `field`."""
        form = self._form(field)
        data = form.fields | {name: str(value) for name, value in filled.items()}
        self.page = self.http.post(form.action or self.path, data=data, follow_redirects=True)
        return self.page

    def _form(self, field: str):
        return next(form for form in forms(self.page.text) if field in form.fields)

    def begin(self, familiarity: int = 3) -> Person:
        self.get("/")
        self.send("consent", consent="yes")
        self.send("familiarity", familiarity=familiarity)
        assert self.path == "/question"
        return self

    def answer(self, *values: int) -> Person:
        for value in values:
            self.send("trial", answer=value, rt_ms=321)
        return self

    @property
    def rows(self) -> list[Response]:
        """The answers of this browser's participant that are in the database, in their order."""
        with self.http.session_transaction() as session:
            visit = session["visit"]
        with self.app.extensions["database"].read() as db:
            query = (
                select(Response)
                .join(Participant)
                .where(Participant.visit == visit)
                .order_by(Response.id)
            )
            return list(db.scalars(query))

    @property
    def answers(self) -> list[int]:
        return [row.answer for row in self.rows]
