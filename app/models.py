"""The tables. Answers and events are only ever appended; nothing here drops or overwrites them."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    DateTime,
    Double,
    ForeignKey,
    Index,
    MetaData,
    String,
    UniqueConstraint,
    func,
    select,
)
from sqlalchemy.orm import (
    DeclarativeBase,
    InstrumentedAttribute,
    Mapped,
    column_property,
    mapped_column,
    relationship,
)
from sqlalchemy.types import TypeDecorator


def now() -> datetime:
    """The time of day, UTC and aware of it."""
    return datetime.now(UTC)


def plain_code(text: str) -> str:
    """A code as it is stored, however it was typed."""
    return "".join(text.split()).replace("-", "").upper()


class UtcDateTime(TypeDecorator):
    """An aware UTC time in every database (SQLite keeps no time zone of its own)."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value, dialect):
        return None if value is None else value.astimezone(UTC)

    def process_result_value(self, value, dialect):
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Base(DeclarativeBase):
    metadata = MetaData(
        naming_convention={
            "pk": "pk_%(table_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
        }
    )
    type_annotation_map = {datetime: UtcDateTime, float: Double}


class StudyRecord(Base):
    """What this database is about. One row, written when the database is made."""

    __tablename__ = "study"

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str] = mapped_column(String(9))
    name: Mapped[str] = mapped_column(String(200))
    version: Mapped[int]
    seed: Mapped[int] = mapped_column(BigInteger)
    design: Mapped[str]  # JSON: the names of cells and techniques, in the order of the study
    secret_key: Mapped[str] = mapped_column(String(64))  # signs the cookies
    simulation_seed: Mapped[int | None] = mapped_column(BigInteger)
    # JSON: the words and images that participants see, once one has begun
    content: Mapped[str | None]
    state: Mapped[str] = mapped_column(String(6), default="open")  # of app.recruiting.STATES
    quota: Mapped[int | None]  # complete participants that are wanted
    reservation_minutes: Mapped[int] = mapped_column(default=120)
    # whether only single-use links let somebody begin
    links_only: Mapped[bool] = mapped_column(default=False)
    created_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (
        CheckConstraint("kind IN ('real', 'simulated')", name="kind"),
        CheckConstraint("id = 1", name="one_row"),
    )


def participant_code(number: int) -> str:
    """The opaque name of a participant: P0001, P0002, ..."""
    return f"P{number:04d}"


class Participant(Base):
    """A person who gave consent; `id` is the number that the design is drawn from."""

    __tablename__ = "participants"
    __table_args__ = {"sqlite_autoincrement": True}  # a number is never given twice

    id: Mapped[int] = mapped_column(primary_key=True)
    visit: Mapped[str] = mapped_column(String(64), unique=True)  # random, from the signed cookie
    consented_at: Mapped[datetime] = mapped_column(default=now)
    # of the text that was agreed to, and the text's hash; None: began before it was recorded
    consent_language: Mapped[str | None] = mapped_column(String(16))
    consent_sha256: Mapped[str | None] = mapped_column(String(64))
    familiarity: Mapped[int | None]
    completion_code: Mapped[str | None] = mapped_column(String(16), unique=True)  # to be shown
    # to be kept; None: completed before there was one, when the code did both
    withdrawal_key: Mapped[str | None] = mapped_column(String(16), index=True, unique=True)
    # to go on elsewhere; None: began before there was one
    resume_code: Mapped[str | None] = mapped_column(String(16), index=True, unique=True)
    screen: Mapped[str | None] = mapped_column(String(500))  # JSON: app.questionnaire.screen
    completed_at: Mapped[datetime | None]
    withdrawn_at: Mapped[datetime | None]
    pilot: Mapped[bool] = mapped_column(default=False)  # tried the study out: does not count
    # JSON: what the recruiter's link said, where the study declares it
    recruit: Mapped[str | None] = mapped_column(String(2000))
    # the first of it: who takes part once
    recruit_id: Mapped[str | None] = mapped_column(String(100), index=True, unique=True)
    # of stimuli.design; None: began before lists were dealt, drawn by the participant's number
    list_number: Mapped[int | None]
    # JSON of analysis.adaptive.State: what the pairs of an adaptive design were chosen from
    design_state: Mapped[str | None] = mapped_column(deferred=True)
    excluded_at: Mapped[datetime | None]
    excluded_because: Mapped[str | None] = mapped_column(String(500))

    trials: Mapped[list[Trial]] = relationship(order_by="Trial.order", back_populates="participant")
    statements: Mapped[list[Statement]] = relationship()

    @property
    def code(self) -> str:
        """The opaque name in exports: P0001, P0002, ..."""
        return participant_code(self.id)


class Trial(Base):
    """One question assigned to one participant: its place in the order, its pair and its sides."""

    __tablename__ = "trials"
    __table_args__ = (UniqueConstraint("participant_id", "order"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    participant_id: Mapped[int] = mapped_column(ForeignKey("participants.id"), index=True)
    order: Mapped[int]  # from 1
    cell: Mapped[str] = mapped_column(String(100))  # names of its levels, joined by dots
    left: Mapped[str] = mapped_column(String(100))
    right: Mapped[str] = mapped_column(String(100))
    kind: Mapped[str] = mapped_column(String(8), server_default="main")  # analysis.manifest.KINDS
    seed: Mapped[str] = mapped_column(
        String(50)
    )  # "study seed/participant": what the design was drawn from

    participant: Mapped[Participant] = relationship(back_populates="trials")
    response: Mapped[Response | None] = relationship(back_populates="trial")


class Response(Base):
    """One committed answer.

    Sizes are in CSS pixels; times the device pixel ratio they are physical ones.
    """

    __tablename__ = "responses"
    __table_args__ = (
        UniqueConstraint("participant_id", "trial_id"),
        CheckConstraint("answer BETWEEN -2 AND 2", name="answer"),
        CheckConstraint("rt_ms >= 0", name="rt_ms"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    participant_id: Mapped[int] = mapped_column(ForeignKey("participants.id"))
    trial_id: Mapped[int] = mapped_column(ForeignKey("trials.id"), unique=True)
    answer: Mapped[int]  # -2..2, as it counts; negative: the left image
    point: Mapped[int | None]  # of the scale, -5..5, as it was given; None: before it was recorded
    rt_ms: Mapped[int]
    timed_by: Mapped[str] = mapped_column(String(7))  # browser | server
    times_shown: Mapped[int]
    started_at: Mapped[datetime]  # when the question was first served
    answered_at: Mapped[datetime] = mapped_column(default=now)
    image_left_sha256: Mapped[str] = mapped_column(String(64))
    image_right_sha256: Mapped[str] = mapped_column(String(64))
    viewport_width: Mapped[int | None]
    viewport_height: Mapped[int | None]
    device_pixel_ratio: Mapped[float | None]
    shown_width: Mapped[float | None]
    shown_height: Mapped[float | None]
    # from here on None: answered before it was recorded, or without JavaScript
    view: Mapped[str | None] = mapped_column(String(10))  # when it was answered
    beside_ms: Mapped[int | None]
    flicker_ms: Mapped[int | None]
    wipe_ms: Mapped[int | None]
    triplet_ms: Mapped[int | None]
    boosted_ms: Mapped[int | None]
    away_ms: Mapped[int | None]
    flips: Mapped[int | None]
    pixel_scale: Mapped[float | None]
    pixel_scale_largest: Mapped[float | None]
    seen_share: Mapped[float | None]
    rt_server_ms: Mapped[int | None]
    reason_ticks: Mapped[str | None] = mapped_column(String(100))  # numbers from 1: "1;3"
    reason_text: Mapped[str | None] = mapped_column(String(2000))
    language: Mapped[str | None] = mapped_column(String(16))  # of the page
    rt_reported_ms: Mapped[int | None]  # where it was more than the server's clock allows

    trial: Mapped[Trial] = relationship(back_populates="response")


class Statement(Base):
    """An answer to a question of the study's own; "" where it was left out. Only ever appended."""

    __tablename__ = "statements"
    __table_args__ = (UniqueConstraint("participant_id", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    participant_id: Mapped[int] = mapped_column(ForeignKey("participants.id"))
    name: Mapped[str] = mapped_column(String(100))
    value: Mapped[str] = mapped_column(String(2000))
    at: Mapped[datetime] = mapped_column(default=now)


def _count(column: InstrumentedAttribute) -> Any:
    """How many rows of another table are a participant's; loaded where it is asked for."""
    rows = select(func.count()).where(column == Participant.id)
    return column_property(rows.correlate_except(column.class_).scalar_subquery(), deferred=True)


#: As of when the participant was loaded. Answers are given in the questions' order: the next
#: question is the one after the last answer.
Participant.answered = _count(Response.participant_id)
Participant.questions = _count(Trial.participant_id)
Participant.stated = _count(Statement.participant_id)
Participant.study_state = column_property(
    select(StudyRecord.state).where(StudyRecord.id == 1).scalar_subquery(), deferred=True
)


class Event(Base):
    """What happened to a participant and when: consented, rated, refused, completed, withdrew
    (and shown, in databases of before 2026-11).
    """

    __tablename__ = "events"

    id: Mapped[int] = mapped_column(primary_key=True)
    participant_id: Mapped[int] = mapped_column(ForeignKey("participants.id"))
    trial_id: Mapped[int | None] = mapped_column(ForeignKey("trials.id"))
    kind: Mapped[str] = mapped_column(String(20))
    detail: Mapped[str | None] = mapped_column(String(200))
    at: Mapped[datetime] = mapped_column(default=now)


Index(None, Event.participant_id, Event.trial_id, Event.kind)


class Link(Base):
    """A link that lets one person begin; spent in the transaction that enrols them."""

    __tablename__ = "links"

    id: Mapped[int] = mapped_column(primary_key=True)
    token: Mapped[str] = mapped_column(String(16), unique=True)
    label: Mapped[str] = mapped_column(String(100))  # for whom, in the researcher's words
    made_at: Mapped[datetime] = mapped_column(default=now)
    participant_id: Mapped[int | None] = mapped_column(ForeignKey("participants.id"), unique=True)


class LogEntry(Base):
    """What researchers did with this study: states, quotas, exclusions, links, downloads. Only ever
    appended, which the database itself sees to.
    """

    __tablename__ = "log"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(default=now)
    # the name of an account, or "command line"; None: of before there were accounts
    who: Mapped[str | None] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(40))
    detail: Mapped[str] = mapped_column(String(1000))


class Note(Base):
    """What a researcher noted about a participant or, without one, about the study; for researchers
    alone. The application only ever appends.
    """

    __tablename__ = "notes"

    id: Mapped[int] = mapped_column(primary_key=True)
    participant_id: Mapped[int | None] = mapped_column(ForeignKey("participants.id"), index=True)
    at: Mapped[datetime] = mapped_column(default=now)
    who: Mapped[str] = mapped_column(String(64))  # the name of an account
    text: Mapped[str] = mapped_column(String(2000))

    participant: Mapped[Participant | None] = relationship()


class Account(Base):
    """Somebody who may sign in to the dashboards of a server. Read in the database of its first
    study alone, as are the two tables below.
    """

    __tablename__ = "accounts"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64), unique=True)  # of app.accounts.NAME
    role: Mapped[str] = mapped_column(String(6))  # of app.accounts.ROLES
    password_hash: Mapped[str] = mapped_column(String(255))  # argon2id
    made_at: Mapped[datetime] = mapped_column(default=now)

    __table_args__ = (CheckConstraint("role IN ('owner', 'viewer')", name="role"),)


class SignIn(Base):
    """A browser in which somebody is signed in; the row goes when they sign out, when their
    password changes, or when it is too old.
    """

    __tablename__ = "sign_ins"

    id: Mapped[int] = mapped_column(primary_key=True)
    account_id: Mapped[int] = mapped_column(ForeignKey("accounts.id"), index=True)
    token_sha256: Mapped[str] = mapped_column(String(64), unique=True)
    at: Mapped[datetime] = mapped_column(default=now)


class AccountEntry(Base):
    """Who signed in or failed to, and what became of accounts. Only ever appended, which the
    database itself sees to.
    """

    __tablename__ = "account_log"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(default=now)
    who: Mapped[str] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(40))
    detail: Mapped[str] = mapped_column(String(1000))


Index(None, AccountEntry.who, AccountEntry.action)

#: What belongs to the server and not to the study; it is in no archive.
OF_THE_SERVER = (Account.__table__, SignIn.__table__, AccountEntry.__table__)
#: Tables of which the database takes back nothing: triggers refuse every change of a row.
APPENDED_ONLY = ("log", "account_log")


class Live(Base):
    """The numbers of the dashboard, made once for all browsers and workers that look. One row;
    nothing is lost with it.
    """

    __tablename__ = "live"
    __table_args__ = (CheckConstraint("id = 1", name="one_row"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    about: Mapped[str] = mapped_column(String(50))  # the newest answer and event it counts
    made_at: Mapped[datetime]
    next_at: Mapped[datetime]  # not made anew before
    claimed_until: Mapped[datetime | None]  # somebody is making it anew
    numbers: Mapped[str]  # JSON
