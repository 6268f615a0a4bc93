"""Who did what: the log of a study and that of the accounts of its server, in one order of time."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from datetime import datetime

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from app import export
from app.models import AccountEntry, LogEntry

#: Who did what was logged before there were accounts.
UNKNOWN = "?"


def latest(
    db: Session, accounts_db: Session, count: int, before: datetime | None = None
) -> list[LogEntry | AccountEntry]:
    """At most `count` entries of both logs, the latest first; before: earlier ones alone."""
    entries = []
    for session, table in ((db, LogEntry), (accounts_db, AccountEntry)):
        query = select(table).order_by(table.at.desc(), table.id.desc()).limit(count)
        entries += session.scalars(query if before is None else query.where(table.at < before))
    return sorted(entries, key=lambda entry: (entry.at, entry.id), reverse=True)[:count]


def csv(db: Session, accounts_db: Session) -> Iterator[str]:
    """All entries of both logs, the first first."""
    entries = heapq.merge(
        *(
            session.scalars(_in_order(table))
            for session, table in ((db, LogEntry), (accounts_db, AccountEntry))
        ),
        key=lambda entry: entry.at,
    )
    rows = (
        {
            "at": entry.at.isoformat(timespec="seconds"),
            "who": entry.who or UNKNOWN,
            "action": entry.action,
            "detail": entry.detail,
        }
        for entry in entries
    )
    return export.table_csv(["at", "who", "action", "detail"], rows)


def _in_order(table: type) -> Select:
    return select(table).order_by(table.at, table.id).execution_options(yield_per=500)
