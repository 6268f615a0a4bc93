"""Who may begin: states of a study, quotas by complete answers, reservations that expire.

A place is taken by who has finished and counts, and by who is at it: begun or answered within the
time of a reservation. Whether there is one, and taking it, is one transaction.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from datetime import timedelta
from enum import Enum

from sqlalchemy import and_, func, or_, select
from sqlalchemy.orm import Session

from app.catalogues import message
from app.models import Link, LogEntry, Participant, Response, StudyRecord, now, plain_code
from app.study import Study

#: Of what a recruiter's link says, characters of each parameter.
LONGEST = 100
#: No letters or digits that look alike.
ALPHABET = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
#: States of a study, with what they mean to participants.
STATES = {
    "draft": "nobody can begin, but owners who are signed in",
    "pilot": "everybody can try it; their answers are kept apart and do not count",
    "open": "everybody can begin, and answers count",
    "paused": "nobody can begin; who has begun goes on",
    "closed": "nobody can begin or answer; withdrawing stays possible",
}


class Door(Enum):
    """What a visitor finds; the value is what the page says, in English."""

    OPEN = ""
    DRAFT = message("This study has not begun yet. Please come back later.")
    PAUSED = message("This study takes a pause. Please come back later.")
    CLOSED = message("This study has ended. Thank you for your interest.")
    FULL = message("All places of this study are taken. Thank you for your interest.")
    AGAIN = message(
        "You have begun this study already. Go on in the browser in which you began, or by the "
        "code that it gave you."
    )
    STRANGER = message("Please come by the link that you were given: it says who is to be paid.")
    COLOURS = message(
        "Thank you. This study is about small differences of colour, and goes on with people who "
        "read most of the plates. Other people read fewer; it says nothing more about you."
    )
    UNINVITED = message("Please come by the link that you were given.")
    SPENT = message(
        "This link was used already: it is for one person. Go on in the browser in which you began."
    )


def record_of(session: Session, *, lock: bool = False) -> StudyRecord:
    """The study's row; lock: nobody else takes a place meanwhile (SQLite has one writer anyway)."""
    query = select(StudyRecord).where(StudyRecord.id == 1)
    return session.scalars(query.with_for_update() if lock else query).one()


def door(session: Session, record: StudyRecord, *, insider: bool) -> Door:
    """Whether a newcomer may begin. insider: is signed in as an owner."""
    if record.state == "draft":
        return Door.OPEN if insider else Door.DRAFT
    if record.state in ("paused", "closed"):
        return Door[record.state.upper()]
    full = record.state == "open" and record.quota is not None
    return Door.FULL if full and places(session, record) >= record.quota else Door.OPEN


def link_fields(study: Study, link: Mapping[str, str]) -> dict[str, str]:
    """What a recruiter's link says, of what the study declares; each at most `LONGEST` long."""
    declared = study.definition.recruiting.parameters
    return {name: link[name][:LONGEST] for name in declared if link.get(name)}


def admission(session: Session, study: Study, fields: Mapping[str, str]) -> Door:
    """Whether the recruiter's link lets somebody in."""
    recruiting = study.definition.recruiting
    if recruiting.required and recruiting.parameters[0] not in fields:
        return Door.STRANGER
    who = fields.get(recruiting.parameters[0]) if recruiting.parameters else None
    query = select(Participant.id).where(Participant.recruit_id == who).limit(1)
    return Door.AGAIN if who and session.scalar(query) else Door.OPEN


def make_links(session: Session, count: int, label: str, *, who: str) -> list[str]:
    """New single-use links, by their tokens."""
    tokens = ["".join(secrets.choice(ALPHABET) for _ in range(16)) for _ in range(count)]
    session.add_all(Link(token=token, label=label[:100]) for token in tokens)
    note(session, "links", f"{count} made{': ' if label else ''}{label[:100]}", who=who)
    return tokens


def set_links_only(session: Session, only: bool, *, who: str) -> None:
    record = record_of(session, lock=True)
    if record.links_only != only:
        note(session, "links", "needed to begin" if only else "not needed to begin", who=who)
        record.links_only = only


def invitation(session: Session, record: StudyRecord, token: str | None) -> Link | Door | None:
    """The unspent link of a token, or the door for whom it does not let in; None where nobody
    needs one. Spend it in the transaction in which `record` was locked.
    """
    if token is None:
        return Door.UNINVITED if record.links_only else None
    link = session.scalar(select(Link).where(Link.token == plain_code(token)))
    if link is None:
        return Door.UNINVITED
    return link if link.participant_id is None else Door.SPENT


def places(session: Session, record: StudyRecord) -> int:
    """How many places are taken."""
    query = select(func.count()).where(counts(), finished_or_at_it(record))
    return session.scalar(query)


def finished_or_at_it(record: StudyRecord):
    """The participants who finished, or began or answered within the time of a reservation, as an
    SQL condition.
    """
    since = now() - timedelta(minutes=record.reservation_minutes)
    last = (
        select(func.max(Response.answered_at))
        .where(Response.participant_id == Participant.id)
        .correlate(Participant)
    )
    return or_(
        Participant.completed_at.is_not(None),
        Participant.consented_at > since,
        last.scalar_subquery() > since,
    )


def counts():
    """The participants whose answers count, as an SQL condition."""
    return and_(
        Participant.withdrawn_at.is_(None),
        Participant.excluded_at.is_(None),
        Participant.pilot.is_(False),
    )


def note(session: Session, action: str, detail: str, *, who: str) -> None:
    """Append to the log; who: the name of an account, or `app.accounts.COMMAND`."""
    session.add(LogEntry(who=who, action=action, detail=detail[:1000]))


def set_state(session: Session, state: str, *, who: str) -> None:
    record = record_of(session, lock=True)
    if record.state != state:
        note(session, "state", f"{record.state} to {state}", who=who)
        record.state = state


def set_quota(session: Session, quota: int | None, minutes: int, *, who: str) -> None:
    record = record_of(session, lock=True)
    detail = f"{record.quota or 'none'} to {quota or 'none'}, {minutes} minutes"
    note(session, "quota", detail, who=who)
    record.quota, record.reservation_minutes = quota, minutes


def exclude(session: Session, participant: Participant, reason: str, *, who: str) -> None:
    """Leave a participant's answers out of every export, tally and figure; nothing is lost."""
    if participant.excluded_at is None:
        participant.excluded_at, participant.excluded_because = now(), reason[:500]
        note(session, "exclude", f"{participant.code}: {reason}", who=who)


def restore(session: Session, participant: Participant, reason: str, *, who: str) -> None:
    """Let them count again."""
    if participant.excluded_at is not None:
        participant.excluded_at = participant.excluded_because = None
        note(session, "restore", f"{participant.code}: {reason}", who=who)
