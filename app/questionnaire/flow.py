"""What happens to a participant, without the web: enrol, rate, show, answer, complete, withdraw.

The server owns the position: the current trial is the first one without an answer. Every function
takes the session of a write transaction (`Database.write`), which is on the disk when its block
ends.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from enum import Enum

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.assignment import assign
from app.models import Event, Participant, Response, Trial, now, plain_code
from app.study import Study

#: No letters or digits that look alike; 10 of them are 48 bits.
CODE_ALPHABET = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"
CODE_LENGTH = 10


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


def find(session: Session, visit: str | None, *, lock: bool = False) -> Participant | None:
    """The participant of a visit; None before consent.

    lock: wait until no other transaction holds this participant, so that two clicks come one after
    the other (SQLite has one writer anyway).
    """
    query = select(Participant).where(Participant.visit == visit)
    return session.scalar(query.with_for_update() if lock else query) if visit else None


def enrol(session: Session, study: Study, visit: str) -> Participant:
    """The participant of a visit, with the trials assigned; consent given twice is one
    participant.
    """
    if participant := find(session, visit):
        return participant
    participant = Participant(visit=visit)
    session.add(participant)
    session.flush()  # gives the number
    session.add_all(assign(study, participant))
    _note(session, participant, "consented")
    return participant


def rate(session: Session, participant: Participant, familiarity: int) -> None:
    """Record the self-rating; the first one stays."""
    if participant.familiarity is None and participant.withdrawn_at is None:
        participant.familiarity = familiarity
        _note(session, participant, "rated")


def current(session: Session, participant: Participant) -> Trial | None:
    """The first trial without an answer; None when all are answered."""
    query = (
        select(Trial)
        .outerjoin(Response)
        .where(Trial.participant_id == participant.id, Response.id.is_(None))
    )
    return session.scalar(query.order_by(Trial.order).limit(1))


def following(session: Session, trial: Trial) -> Trial | None:
    """The trial after one, whose images are worth fetching beforehand."""
    return session.scalar(
        select(Trial).filter_by(participant_id=trial.participant_id, order=trial.order + 1)
    )


def count_answers(session: Session, participant: Participant) -> int:
    """How many of a participant's answers are committed."""
    return session.scalar(select(func.count()).where(Response.participant_id == participant.id))


def show(session: Session, trial: Trial) -> None:
    """Note that a question was served: the first time is the trial's start."""
    session.add(Event(participant_id=trial.participant_id, trial_id=trial.id, kind="shown"))


def answer(
    session: Session, study: Study, participant: Participant, trial_id: int, given: Answer
) -> Outcome:
    """Append an answer to the current trial; anything else changes nothing."""
    trial = session.get(Trial, trial_id)
    if trial is None or trial.participant_id != participant.id or participant.withdrawn_at:
        return Outcome.STALE
    if trial.response:
        if trial.response.answer == given.value:
            return Outcome.REPEATED
        _note(
            session,
            participant,
            "refused",
            trial,
            f"kept {trial.response.answer}, refused {given.value}",
        )
        return Outcome.REFUSED
    shown = session.execute(
        select(func.min(Event.at), func.count()).where(
            Event.trial_id == trial.id, Event.kind == "shown"
        )
    ).one()
    images = (
        study.image(trial.cell, trial.left).sha256,
        study.image(trial.cell, trial.right).sha256,
    )
    if (
        trial is not current(session, participant)
        or not shown.count
        or participant.familiarity is None
    ):
        return Outcome.STALE
    if images != (given.image_left_sha256, given.image_right_sha256):
        return Outcome.STALE
    answered_at = now()
    by_server = max(0, round((answered_at - shown[0]).total_seconds() * 1000))
    session.add(
        Response(
            participant_id=participant.id,
            trial_id=trial.id,
            answer=given.value,
            rt_ms=by_server if given.rt_ms is None else given.rt_ms,
            timed_by="server" if given.rt_ms is None else "browser",
            times_shown=shown[1],
            started_at=shown[0],
            answered_at=answered_at,
            **{name: getattr(given, name) for name in _RECORDED},
        )
    )
    return Outcome.RECORDED


_RECORDED = tuple(name for name in Answer.__dataclass_fields__ if name not in ("value", "rt_ms"))


def complete(session: Session, participant: Participant) -> bool:
    """Give the completion code and the withdrawal key once as many answers are committed as there
    are trials; whether they are given.

    Call it in a transaction of its own, after the one of the last answer: what it counts is on the
    disk.
    """
    if participant.completion_code:
        return True
    asked = session.scalar(select(func.count()).where(Trial.participant_id == participant.id))
    if not asked or asked != count_answers(session, participant) or participant.withdrawn_at:
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
    return "".join(secrets.choice(CODE_ALPHABET) for _ in range(CODE_LENGTH))


def find_by_key(session: Session, key: str) -> Participant | None:
    """The participant who was given a withdrawal key, however it was typed; for those who were
    given none, the completion code.
    """
    plain = plain_code(key)
    old = Participant.withdrawal_key.is_(None) & (Participant.completion_code == plain)
    asked = select(Participant).where((Participant.withdrawal_key == plain) | old)
    return session.scalar(asked) if plain else None


def _note(
    session: Session,
    participant: Participant,
    kind: str,
    trial: Trial | None = None,
    detail: str | None = None,
) -> None:
    session.add(
        Event(participant_id=participant.id, trial_id=trial and trial.id, kind=kind, detail=detail)
    )
