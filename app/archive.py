"""The whole of a study in one file: manifest, images and every row of its database, with hashes and
counts. It is a backup, and it imports elsewhere, from one kind of database into another.

A zip: `archive.json` says what is in it, `study/` is the study's folder without what is made from
it, `tables/NAME.jsonl` has a row of a table a line. It holds what the database holds of the study:
keys, completion codes. Who has it can be every participant; responses.csv is for others. Accounts
are the server's, and in no archive.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
import zipfile
from datetime import datetime
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import Connection, Table, func, insert, select, text

from analysis.files import replacing
from app.database import Database, connect, migrate
from app.errors import InputError
from app.models import OF_THE_SERVER, Base, Live, StudyRecord, UtcDateTime
from app.study import Study
from stimuli.manifest import NAME as MANIFEST

FORMAT = "subdermal-archive/1"
ABOUT = "archive.json"
CHUNK_ROWS = 500
#: Tables that every archive has.
_OLDEST = {"study", "participants", "trials", "responses", "statements", "events", "log"}
TABLES = tuple(
    table
    for table in Base.metadata.sorted_tables
    if table is not Live.__table__ and table not in OF_THE_SERVER
)


def write(path: Path, study: Study, database: Database) -> dict[str, int]:
    """Write the archive, whole or not at all, of one snapshot of the database; rows by table."""
    about: dict[str, Any] = {"format": FORMAT, "study": study.name, "version": study.version}
    about |= {"files": {}, "tables": {}}
    files = [MANIFEST, *dict.fromkeys(image.file for image in study.manifest.shown)]
    with replacing(path) as part:
        # nobody else reads the keys in it, not even while it is written
        opened = os.open(part, os.O_CREAT | os.O_WRONLY | os.O_EXCL, 0o600)
        with os.fdopen(opened, "wb") as file, zipfile.ZipFile(file, "w") as archive:
            for name in files:
                inside = f"study/{name}"
                archive.write(study.directory / name, inside, zipfile.ZIP_STORED)
                about["files"][name] = _digest((study.directory / name).open("rb"))
            with database.read() as session:
                for table in TABLES:
                    about["tables"][table.name] = _dump(archive, session.connection(), table)
            archive.writestr(ABOUT, json.dumps(about, indent=2) + "\n")
    return {name: entry["rows"] for name, entry in about["tables"].items()}


def read(path: Path, directory: Path, database_url: str | None) -> dict[str, int]:
    """Make the study's folder and fill its empty database; rows by table.

    InputError where the archive is damaged, the folder is there already or the database is not
    empty; then nothing was made.
    """
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise InputError(f"{directory} is there already; expected a new folder")
    try:
        with zipfile.ZipFile(path) as archive:
            about = _about(archive, path)
            directory.parent.mkdir(parents=True, exist_ok=True)
            made = Path(tempfile.mkdtemp(dir=directory.parent, prefix=f".{directory.name}."))
            try:
                _unpack(archive, path, about, made)
                url = database_url or Study.open(made).database_url(False)
                _fill(archive, path, about, url)
                made.chmod(0o755)
                if directory.is_dir():
                    directory.rmdir()
                made.rename(directory)
            finally:
                shutil.rmtree(made, ignore_errors=True)
    except (zipfile.BadZipFile, OSError) as error:
        if isinstance(error, FileNotFoundError) or not isinstance(error, OSError):
            raise InputError(f"{path}: is not an archive of a study ({error})") from None
        raise
    return {name: entry["rows"] for name, entry in about["tables"].items()}


def _about(archive: zipfile.ZipFile, path: Path) -> dict[str, Any]:
    try:
        about = json.loads(archive.read(ABOUT))
        known = about["format"] == FORMAT and _OLDEST <= about["tables"].keys() <= {
            t.name for t in TABLES
        }
    except (KeyError, TypeError, ValueError):
        known = False
    if not known:
        raise InputError(f"{path}: is not an archive of a study; expected one by subdermal archive")
    return about


def _unpack(archive: zipfile.ZipFile, path: Path, about: dict, directory: Path) -> None:
    for name, sha256 in about["files"].items():
        target = (directory / name).resolve()
        if not target.is_relative_to(directory.resolve()) or target == directory.resolve():
            raise InputError(f"{path}: {name!r} lies outside of the study's folder")
        target.parent.mkdir(parents=True, exist_ok=True)
        with _member(archive, path, f"study/{name}") as source, target.open("wb") as file:
            shutil.copyfileobj(source, file)
        if _digest(target.open("rb")) != sha256:
            raise InputError(f"{path}: {name} is damaged: its sha256 is not {sha256}")


def _fill(archive: zipfile.ZipFile, path: Path, about: dict, url: str) -> None:
    """All rows in one transaction, into a database that has none."""
    shown = "the database" if "@" in url else url
    engine = connect(url)
    try:
        with engine.connect() as connection:
            migrate(connection)
        with engine.execution_options(writes=True).begin() as connection:
            taken = [
                t.name for t in TABLES if connection.scalar(select(func.count()).select_from(t))
            ]
            if taken:
                raise InputError(f"{shown}: has {', '.join(taken)} already; expected an empty one")
            for table in TABLES:
                if table.name not in about["tables"]:
                    continue  # the archive is of before there was such a table
                member = f"tables/{table.name}.jsonl"
                if _digest(_member(archive, path, member)) != about["tables"][table.name]["sha256"]:
                    raise InputError(f"{path}: the table {table.name} is damaged")
                with _member(archive, path, member) as file:
                    rows = _load(connection, table, file)
                if engine.dialect.name == "postgresql" and rows:
                    newest = f'(SELECT max(id) FROM "{table.name}")'
                    sequence = f"pg_get_serial_sequence('{table.name}', 'id')"
                    connection.execute(text(f"SELECT setval({sequence}, {newest})"))
    finally:
        engine.dispose()


def _member(archive: zipfile.ZipFile, path: Path, name: str):
    try:
        return archive.open(name)
    except KeyError:
        raise InputError(f"{path}: is damaged: {name} is missing") from None


def _dump(archive: zipfile.ZipFile, connection: Connection, table: Table) -> dict[str, Any]:
    rows, digest = 0, hashlib.sha256()
    entry = zipfile.ZipInfo(f"tables/{table.name}.jsonl")
    entry.compress_type = zipfile.ZIP_DEFLATED
    selected = connection.execution_options(yield_per=CHUNK_ROWS).execute(
        select(table).order_by(table.primary_key.columns[0])
    )
    with archive.open(entry, "w", force_zip64=True) as file:
        for row in selected.mappings():
            line = json.dumps(dict(row), default=datetime.isoformat, ensure_ascii=False) + "\n"
            file.write(line.encode())
            digest.update(line.encode())
            rows += 1
    return {"rows": rows, "sha256": digest.hexdigest()}


def _load(connection: Connection, table: Table, file: BinaryIO) -> int:
    """Append the rows of a file; how many."""
    rows, count = [], 0
    times = {column.name for column in table.columns if isinstance(column.type, UtcDateTime)}
    for line in file:
        row = json.loads(line)
        if table is StudyRecord.__table__:
            row.pop("password_hash", None)  # of an archive of before there were accounts
        if unknown := row.keys() - table.columns.keys():
            raise InputError(
                f"the archive is of a later version of subdermal: {table.name} has {min(unknown)}"
            )
        for name in times & row.keys():
            row[name] = row[name] and datetime.fromisoformat(row[name])
        rows.append(row)
        count += 1
        if len(rows) == CHUNK_ROWS:
            connection.execute(insert(table), rows)
            rows = []
    if rows:
        connection.execute(insert(table), rows)
    return count


def _digest(file: BinaryIO) -> str:
    with file:
        return hashlib.file_digest(file, "sha256").hexdigest()
