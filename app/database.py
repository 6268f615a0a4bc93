"""The connection to the database: durable, migrated at start-up, of one kind (real or simulated)
for ever.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection, Engine, create_engine, delete, event, make_url
from sqlalchemy.exc import ArgumentError, DatabaseError, NoSuchModuleError
from sqlalchemy.orm import Session

from app.errors import InputError
from app.models import Live, StudyRecord

if TYPE_CHECKING:
    from app.study import Study

BUSY_TIMEOUT_S = 30


class Database:
    """`with database.read() as session` sees one snapshot; `with database.write() as session`
    commits at its end.

    A write is on the disk when its block has ended. Writers queue: none starts from a stale read.
    """

    def __init__(self, engine: Engine):
        self._engine = engine
        self._writer = engine.execution_options(writes=True)

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
                _migrate(connection)
        except (NoSuchModuleError, ModuleNotFoundError) as error:
            raise InputError(
                f"{shown}: there is no driver for such a database here ({error})"
            ) from None
        except DatabaseError as error:
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
            if record is None:
                session.add(StudyRecord(id=1, secret_key=secrets.token_hex(32), **expected))
                return
            for key, value in expected.items():
                if (found := getattr(record, key)) != value:
                    raise InputError(
                        f"{shown}: holds answers of another study: {key} is {found!r}, "
                        f"expected {value!r}"
                    )

    @contextmanager
    def read(self) -> Iterator[Session]:
        with Session(self._engine) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        with Session(self._writer, expire_on_commit=False) as session, session.begin():
            yield session

    @contextmanager
    def append(self) -> Iterator[Connection]:
        """A writer's transaction in plain rows, for what happens with every answer: objects cost as
        much as the rest of it.
        """
        with self._writer.begin() as connection:
            yield connection

    def record(self) -> StudyRecord:
        """The row that says what this database is about, detached."""
        with self.read() as session:
            record = session.get_one(StudyRecord, 1)
            session.expunge(record)
            return record

    def close(self) -> None:
        self._engine.dispose()


def connect(url: str) -> Engine:
    """An engine with our settings; a connection with the option `writes` begins as a writer."""
    engine = create_engine(url, pool_pre_ping=not url.startswith("sqlite"))
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _configure_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
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
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _migrate(connection) -> None:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    config.attributes["connection"] = connection.execution_options(writes=True)
    command.upgrade(config, "head")
