"""The connection to the database: durable, migrated at start-up, of one kind (real or simulated)
for ever.
"""

from __future__ import annotations

import json
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection, Engine, create_engine, delete, event, make_url, select
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.orm import Session

from app import postgresql
from app.errors import InputError
from app.models import Live, Participant, StudyRecord

if TYPE_CHECKING:
    from app.study import Study

BUSY_TIMEOUT_S = 30
#: Connections that a process keeps: one for each thread that answers (`app.server.Limits`).
POOLED = 8


class Database:
    """`with database.read() as session` sees one snapshot; `with database.write() as session`
    commits at its end.

    A write is on the disk when its block has ended. Writers queue: none starts from a stale read.
    """

    def __init__(self, engine: Engine):
        self._engine = engine
        self._writer = engine.execution_options(writes=True)
        # SQLite has one writer, and who waits for it looks again after longer and longer sleeps:
        # threads of one process rather come one after the other
        sqlite = engine.dialect.name == "sqlite"
        self._turn = threading.Lock() if sqlite else nullcontext()

    @classmethod
    def open(cls, url: str, study: Study, *, simulated: bool) -> Database:
        """Connect, migrate to the newest schema and check that the database is this study's and of
        this kind.
        """
        try:
            shown = make_url(url).render_as_string(hide_password=True)
        except ArgumentError:
            raise InputError(
                "--database: expected an SQLAlchemy URL such as "
                f"sqlite:////data/study.sqlite3, got {url!r}"
            ) from None
        try:
            engine = connect(url)
            with engine.connect() as connection:
                migrate(connection)
        except (NoSuchModuleError, ModuleNotFoundError) as error:
            raise InputError(
                f"{shown}: there is no driver for such a database here ({error}); "
                "PostgreSQL needs pip install --no-deps -r requirements-postgres.lock"
            ) from None
        except DBAPIError as error:
            raise InputError(
                f"{shown}: cannot be opened as a database ({str(error.orig).splitlines()[0]})"
            ) from None
        except CommandError as error:
            raise InputError(
                f"{shown}: its schema is not one of this version of subdermal ({error})"
            ) from None
        database = cls(engine)
        database._claim(study, "simulated" if simulated else "real", shown)
        return database

    def _claim(self, study: Study, kind: str, shown: str) -> None:
        """Record in a new database what it is about; refuse one that is about something else."""
        expected = {
            "kind": kind,
            "name": study.name,
            "version": study.version,
            "seed": study.seed,
            "design": study.design,
        }
        with self.write() as session:
            session.execute(delete(Live))  # numbers of a release before this may have another shape
            record = session.get(StudyRecord, 1)
            content = study.content(images=kind == "real")
            if record is None:
                expected["content"] = json.dumps(content)
                session.add(StudyRecord(id=1, secret_key=secrets.token_hex(32), **expected))
                return
            for key, value in expected.items():
                if (stored := getattr(record, key)) != value:
                    raise InputError(
                        f"{shown}: holds answers of another study: {key} is {stored!r}, "
                        f"expected {value!r}"
                    )
            begun = session.scalar(select(Participant.id).limit(1)) is not None
            kept = json.loads(record.content or "{}") if begun else {}
            if change := _first_change(kept, content):
                raise InputError(
                    f"{shown}: participants saw another study: {change}; put it back, or raise "
                    "`version`, build again and give it a database of its own (--database)"
                )
            record.content = json.dumps(content)  # a new release may show more

    @contextmanager
    def read(self) -> Iterator[Session]:
        with Session(self._engine) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        with self._turn, Session(self._writer, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def look(self) -> Iterator[Connection]:
        """A reader's snapshot in plain rows, for what happens with every question."""
        with self._engine.connect() as connection:
            yield connection

    @contextmanager
    def append(self) -> Iterator[Connection]:
        """A writer's transaction in plain rows, for what happens with every answer: objects cost as
        much as the rest of it.
        """
        with self._turn, self._writer.begin() as connection:
            yield connection

    def record(self) -> StudyRecord:
        """The row that says what this database is about, detached."""
        with self.read() as session:
            record = session.get_one(StudyRecord, 1)
            session.expunge(record)
            return record

    def close(self) -> None:
        self._engine.dispose()


def _first_change(kept: object, now: object, at: str = "") -> str:
    """Where what was kept differs from what is there now, in words; '' where it does not. What was
    not kept yet does not count.
    """
    if isinstance(kept, dict) and isinstance(now, dict):
        for key, value in kept.items():
            name = f"{at}.{key}" if at else key
            if key not in now:
                return f"{name} is gone"
            if change := _first_change(value, now[key], name):
                return change
        return ""
    if isinstance(kept, list) and isinstance(now, list) and len(kept) == len(now):
        changes = (_first_change(*two, f"{at}[{i}]") for i, two in enumerate(zip(kept, now)))
        return next(filter(None, changes), "")
    if kept == now:
        return ""
    was, is_now = (f"{str(value)[:60]!r}" for value in (kept, now))
    return f"{at} was {was}, is {is_now}"


def connect(url: str) -> Engine:
    """An engine with our settings; a connection with the option `writes` begins as a writer.

    postgresql:// is spoken by pg8000, unless the URL names another driver.
    """
    address = make_url(url)
    if address.drivername in ("postgresql", "postgres"):
        address = address.set(drivername="postgresql+pg8000")
    engine = create_engine(
        address,
        pool_pre_ping=address.get_backend_name() != "sqlite",
        pool_size=POOLED,
        hide_parameters=True,  # what people answer stands in no log
    )
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _configure_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
    if engine.dialect.driver == "pg8000":
        postgresql.listen(engine)
    return engine


def _configure_sqlite(connection, _record) -> None:
    """WAL so that readers never wait; FULL so that a commit survives a power cut."""
    connection.isolation_level = None  # we begin transactions ourselves
    cursor = connection.cursor()
    cursor.execute(f"PRAGMA busy_timeout = {BUSY_TIMEOUT_S * 1000}")
    cursor.execute("PRAGMA journal_mode = WAL")
    cursor.execute("PRAGMA synchronous = FULL")
    cursor.execute("PRAGMA foreign_keys = ON")
    cursor.close()


def _begin_sqlite(connection) -> None:
    """A writer takes the lock at once: upgrading a read lock later would fail where it should
    wait.
    """
    writes = connection.get_execution_options().get("writes", False)
    # by the driver itself: SQLAlchemy would take as long again to hand it on
    connection.connection.driver_connection.execute("BEGIN IMMEDIATE" if writes else "BEGIN")


def migrate(connection: Connection) -> None:
    """Bring a database to the newest schema; an empty one gets it."""
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    config.attributes["connection"] = connection.execution_options(writes=True)
    command.upgrade(config, "head")
