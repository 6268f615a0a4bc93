"""What happens to a participant, without the web: enrol, rate, show, answer, complete, withdraw.

The server owns the position: the current trial is the one after the last answer. Every function
takes the session of a write transaction (`Database.write`), which is on the disk when its block
ends.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from enum import Enum
from types import MappingProxyType

from sqlalchemy import Connection, Row, bindparam, insert, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, undefer

from app import recruiting
from app.assignment import assign
from app.database import Database
from app.models import (
    Event,
    Participant,
    Response,
    Statement,
    Trial,
    now,
    participant_code,
    plain_code,
)
from app.recruiting import Door
from app.study import Study

#: Of `recruiting.ALPHABET`: 48 bits.
CODE_LENGTH = 10

EMPTY: Mapping[str, str] = MappingProxyType({})


class Outcome(Enum):
    """What became of an answer that was sent."""

    RECORDED = "recorded"
    REPEATED = "repeated"  # the same answer again: it counts once
    REFUSED = "refused"  # another answer to a question that has one: the first stays
    STALE = "stale"  # a question that is not the current one, or was shown with other images


@dataclass(frozen=True)
class Answer:
    """What the browser sends with an answer; sizes in CSS pixels, None where the browser could not
    tell.
    """

    value: int
    rt_ms: int | None
    image_left_sha256: str
    image_right_sha256: str
    viewport_width: int | None = None
    viewport_height: int | None = None
    device_pixel_ratio: float | None = None
    shown_width: float | None = None
    shown_height: float | None = None
    view: str | None = None
    beside_ms: int | None = None
    flicker_ms: int | None = None
    wipe_ms: int | None = None
    triplet_ms: int | None = None
    boosted_ms: int | None = None
    away_ms: int | None = None
    flips: int | None = None
    pixel_scale: float | None = None
    pixel_scale_largest: float | None = None
    seen_share: float | None = None
    reason_ticks: str | None = None
    reason_text: str | None = None
    language: str | None = None
    point: int | None = None


def find(session: Session, visit: str | None, *, lock: bool = False) -> Participant | None:
    """The participant of a visit, with how many questions are answered; None before consent.

    lock: wait until no other transaction holds this participant, so that two clicks come one after
    the other (SQLite has one writer anyway).
    """
    return session.scalar(_FIND_AND_LOCK if lock else _FIND, {"visit": visit}) if visit else None


# Statements of every answer are built once: building one costs as much as running it.
_FIND = (
    select(Participant)
    .where(Participant.visit == bindparam("visit"))
    .options(
        undefer(Participant.answered),
        undefer(Participant.questions),
        undefer(Participant.stated),
        undefer(Participant.study_state),
    )
)
_FIND_AND_LOCK = _FIND.with_for_update()


def enrol(
    session: Session,
    study: Study,
    visit: str,
    *,
    insider: bool = False,
    link_fields: Mapping[str, str] = EMPTY,
    token: str | None = None,
    consent: tuple[str, str] | tuple[None, None] = (None, None),
) -> Participant | Door:
    """The participant of a visit, with the trials assigned; consent given twice is one
    participant. The door where nobody can begin now.

    link_fields: what the recruiter's link said (`recruiting.link_fields`). token: of a
    single-use link, which is spent. consent: the language
    of the text that was agreed to, and its sha256.
    """
    record = recruiting.record_of(session, lock=True)  # before looking: two clicks are one person
    if participant := find(session, visit):
        return participant
    if (door := recruiting.door(session, record, insider=insider)) is not Door.OPEN:
        return door
    if (door := recruiting.admission(session, study, link_fields)) is not Door.OPEN:
        return door
    link = recruiting.invitation(session, record, token)
    if isinstance(link, Door):
        return link
    pilot = record.state in ("draft", "pilot")
    participant = Participant(visit=visit, resume_code=_secret(), pilot=pilot)
    participant.consent_language, participant.consent_sha256 = consent
    if link_fields:
        participant.recruit = json.dumps(dict(link_fields))
        participant.recruit_id = link_fields.get(study.definition.recruiting.parameters[0])
    session.add(participant)
    session.flush()  # gives the number
    if link:
        link.participant_id = participant.id
    assign(session, study, record, participant)
    _note(session, participant, "consented")
    return participant


def rate(session: Session, participant: Participant, familiarity: int) -> None:
    """Record the self-rating; the first one stays."""
    if participant.familiarity is None and participant.withdrawn_at is None:
        participant.familiarity = familiarity
        _note(session, participant, "rated")


def measure(participant: Participant, screen: str) -> None:
    """Record what was measured of the screen (JSON, of `app.questionnaire.screen`)."""
    participant.screen = screen


def state(session: Session, participant: Participant, values: dict[str, str]) -> None:
    """Append answers to questions of the study's own, by their names; the first ones stay."""
    known = {one.name for one in participant.statements}
    if participant.withdrawn_at is None:
        for name, value in values.items():
            if name not in known:
                one = Statement(participant_id=participant.id, name=name, value=value)
                session.add(one)
        session.flush()
        session.expire(participant)


def upcoming(
    session: Session | Connection, participant: Participant | Standing, count: int
) -> list[Row]:
    """The next trials (id, order, cell, left, right), at most `count`: the current one first, then
    those whose images are worth fetching beforehand. Empty when all are answered.
    """
    parameters = {
        "participant": participant.id,
        "first": participant.answered + 1,
        "last": participant.answered + count,
    }
    return list(session.execute(_UPCOMING, parameters))


_UPCOMING = (
    select(Trial.id, Trial.order, Trial.cell, Trial.left, Trial.right, Trial.kind)
    .execution_options(prepared=True)
    .where(Trial.participant_id == bindparam("participant"))
    .where(Trial.order.between(bindparam("first"), bindparam("last")))
    .order_by(Trial.order)
)


@dataclass(frozen=True)
class Standing:
    """How far a participant is: what says which page is due, and what the page of a question says
    of them. For what happens with every answer: loading an object costs twice as much.
    """

    id: int
    resume_code: str | None
    familiarity: int | None
    withdrawn_at: datetime | None
    answered: int
    questions: int
    stated: int
    screen: str | None
    study_state: str

    @property
    def code(self) -> str:
        return participant_code(self.id)


def standing(connection: Connection, visit: str | None) -> Standing | None:
    """How far the participant of a visit is; None before consent."""
    row = connection.execute(_STANDING, {"visit": visit}).one_or_none() if visit else None
    return row and Standing(*row)


@dataclass(frozen=True)
class Shown:
    """When a question was first sent to a browser, and how often; the browser's cookie keeps it,
    signed, so that looking at a question writes nothing.
    """

    trial_id: int
    at: datetime
    times: int

    @classmethod
    def again(cls, before: Shown | None, trial: Row) -> Shown:
        """The same after the trial was sent once more."""
        if before is None or before.trial_id != trial.id:
            return cls(trial.id, now(), 1)
        return replace(before, times=before.times + 1)

    @classmethod
    def of_cookie(cls, kept: object) -> Shown | None:
        """What `cookie` gave; None for anything else."""
        match kept:
            case [int(trial_id), int(at_ms), int(times)]:
                return cls(trial_id, datetime.fromtimestamp(at_ms / 1000, UTC), times)
        return None

    def cookie(self) -> list[int]:
        return [self.trial_id, round(self.at.timestamp() * 1000), self.times]


def answer(
    database: Database,
    study: Study,
    visit: str,
    trial_id: int,
    given: Answer,
    shown: Shown | None,
    *,
    bound: bool = True,
) -> tuple[Outcome, Standing] | None:
    """Commit an answer to the current trial; anything else changes nothing. Gives how far the
    participant is then; None where the visit has not begun.

    shown: what this browser's cookie says. The hashes of the images prove that the question was
    shown; a browser that lost its cookie meanwhile has no time but its own. bound: whether the
    browser's time is held to the server's; programs need no time to answer.
    """
    try:
        with database.append() as connection:
            return _answer(connection, study, visit, trial_id, given, shown, bound)
    except IntegrityError:
        # the same click a moment earlier: it has an answer now
        with database.append() as connection:
            return _answer(connection, study, visit, trial_id, given, shown, bound)


def _answer(
    connection: Connection,
    study: Study,
    visit: str,
    trial_id: int,
    given: Answer,
    shown: Shown | None,
    bound: bool,
) -> tuple[Outcome, Standing] | None:
    due = connection.execute(_DUE, {"trial": trial_id, "visit": visit}).one_or_none()
    if due is None:
        return None
    here = Standing(*due[: len(_STANDS)])
    if due.order is None or due.withdrawn_at or due.study_state == "closed":
        return Outcome.STALE, here
    if due.answer is not None:
        if due.answer == given.value and due.point in (None, given.point):
            return Outcome.REPEATED, here
        kept = due.answer if due.point is None else due.point
        refused = given.value if given.point is None else given.point
        event = {
            "participant_id": due.id,
            "trial_id": trial_id,
            "kind": "refused",
            "detail": f"kept {kept}, refused {refused}",
        }
        if not connection.scalar(select(Event.id).filter_by(**event).limit(1)):
            # once: what is repeated without end is not stored without end
            connection.execute(insert(Event.__table__), event | {"at": now()})
        return Outcome.REFUSED, here
    images = (
        study.image(due.cell, due.left).sha256,
        study.image(due.cell, due.right).sha256,
    )
    if (
        due.order != due.answered + 1
        or due.familiarity is None
        or images != (given.image_left_sha256, given.image_right_sha256)
    ):
        return Outcome.STALE, here
    answered_at = now()
    if shown is None or shown.trial_id != trial_id or shown.at > answered_at:
        began = answered_at - timedelta(milliseconds=given.rt_ms or 0)
        if due.consented_at <= answered_at:  # not where the clock was set back
            began = max(began, due.consented_at)
        shown = Shown(trial_id, began, 1)
    by_server = round((answered_at - shown.at).total_seconds() * 1000)
    rt_ms, reported = given.rt_ms, None
    if rt_ms is None:
        rt_ms = by_server
    elif bound and rt_ms > by_server + study.definition.quality.clocks_apart_ms:
        # longer than the question has been there
        rt_ms, reported = by_server, rt_ms
    row = {
        "participant_id": due.id,
        "trial_id": trial_id,
        "answer": given.value,
        "rt_ms": rt_ms,
        "timed_by": "browser" if given.rt_ms is not None and reported is None else "server",
        "rt_server_ms": by_server,
        "rt_reported_ms": reported,
        "times_shown": shown.times,
        "started_at": shown.at,
        "answered_at": answered_at,
    }
    connection.execute(_APPEND, row | {name: getattr(given, name) for name in _RECORDED})
    return Outcome.RECORDED, replace(here, answered=here.answered + 1)


#: The columns of `Standing`, in its order.
_STANDS = (
    Participant.id,
    Participant.resume_code,
    Participant.familiarity,
    Participant.withdrawn_at,
    Participant.answered.expression.label("answered"),
    Participant.questions.expression.label("questions"),
    Participant.stated.expression.label("stated"),
    Participant.screen,
    Participant.study_state.expression.label("study_state"),
)
_STANDING = (
    select(*_STANDS).where(Participant.visit == bindparam("visit")).execution_options(prepared=True)
)
_DUE = (
    select(
        *_STANDS,
        Participant.consented_at,
        Trial.order,
        Trial.cell,
        Trial.left,
        Trial.right,
        Response.answer,
        Response.point,
    )
    .outerjoin(Trial, (Trial.participant_id == Participant.id) & (Trial.id == bindparam("trial")))
    .outerjoin(Response, Response.trial_id == Trial.id)
    .where(Participant.visit == bindparam("visit"))
    .execution_options(prepared=True)
)
_APPEND = insert(Response.__table__).inline().execution_options(prepared=True, commits=True)
_RECORDED = tuple(name for name in Answer.__dataclass_fields__ if name not in ("value", "rt_ms"))


def complete(session: Session, study: Study, participant: Participant) -> bool:
    """Give the completion code and the withdrawal key once as many answers are committed as there
    are trials, and all of the study's own questions are behind; whether they are given.

    Call it in a transaction of its own, after the one of the last answer: what it counts is on the
    disk.
    """
    if participant.completion_code:
        return True
    own = len(study.definition.before) + len(study.definition.after)
    if participant.answered != participant.questions or participant.stated < own:
        return False
    if participant.withdrawn_at:
        return False
    participant.completion_code, participant.withdrawal_key = _secret(), _secret()
    participant.completed_at = now()
    _note(session, participant, "completed")
    return True


def withdraw(session: Session, participant: Participant) -> None:
    """Take a participant's answers out of every export, tally and figure; nothing is physically
    lost.
    """
    if participant.withdrawn_at is None:
        participant.withdrawn_at = now()
        _note(session, participant, "withdrew")


def _secret() -> str:
    return "".join(secrets.choice(recruiting.ALPHABET) for _ in range(CODE_LENGTH))


def find_by_key(session: Session, key: str) -> Participant | None:
    """The participant who was given a withdrawal key, however it was typed; for those who were
    given none, the completion code.
    """
    plain = plain_code(key)
    old = Participant.withdrawal_key.is_(None) & (Participant.completion_code == plain)
    query = select(Participant).where((Participant.withdrawal_key == plain) | old)
    return session.scalar(query) if plain else None


def find_by_resume_code(session: Session, code: str) -> Participant | None:
    """The participant who was given a code to go on elsewhere, however it was typed."""
    plain = plain_code(code)
    return session.scalar(select(Participant).filter_by(resume_code=plain)) if plain else None


def _note(session: Session, participant: Participant, kind: str) -> None:
    session.add(Event(participant_id=participant.id, kind=kind))
