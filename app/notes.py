"""Researchers' notes on a participant or on the study: with author and time, never shown to
participants and in no table of answers.
"""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload

from app import export
from app.models import Note, Participant

#: Characters of a note.
LONGEST = 2000


def add(session: Session, participant: Participant | None, text: str, *, who: str) -> Note:
    """Append a note on a participant or, without one, on the study."""
    note = Note(participant=participant, text=text, who=who)
    session.add(note)
    return note


def on(session: Session, participant: Participant | None) -> list[Note]:
    """The notes on a participant or, without one, on the study, the latest first."""
    return list(
        session.scalars(
            select(Note)
            .where(Note.participant_id == (participant and participant.id))
            .order_by(Note.id.desc())
        )
    )


def latest(session: Session, count: int) -> list[Note]:
    """At most `count` notes on whatever, the latest first, with their participants."""
    query = select(Note).options(joinedload(Note.participant))
    return list(session.scalars(query.order_by(Note.id.desc()).limit(count)))


def csv(session: Session) -> Iterator[str]:
    """notes.csv: all of them, the first first; no participant: on the study."""
    query = select(Note).options(joinedload(Note.participant)).order_by(Note.id)
    rows = (
        {
            "at": note.at.isoformat(timespec="seconds"),
            "who": note.who,
            "participant": note.participant.code if note.participant else "",
            "text": note.text,
        }
        for note in session.scalars(query)
    )
    return export.table_csv(["at", "who", "participant", "text"], rows)
