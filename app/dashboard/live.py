"""The numbers of the dashboard: who takes part, how far they are, what the answers say so far."""

from __future__ import annotations

import json
import re
from datetime import datetime, timedelta
from math import isnan
from threading import Lock
from time import monotonic
from typing import TYPE_CHECKING, Any

from sqlalchemy import Select, func, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from app import export, recruiting
from app.dashboard import course, results
from app.database import Database
from app.models import Event, Live, LogEntry, Participant, Response, Statement, Trial, now
from app.study import Study

if TYPE_CHECKING:
    from analysis.options import Exclusions, Options
    from analysis.responses import Responses

#: Numbers are at least so old when they are made anew, and making them takes at most this share of
#: a core; `LIVE_PERIOD_S` of the application's settings is another period, 0 for none.
PERIOD_S = 3.0
SHARE = 0.05
#: Numbers that are older are made anew though nothing happened.
OLDEST = timedelta(minutes=1)
#: How long others wait for somebody who is making numbers; who was killed meanwhile holds up no
#: longer.
CLAIM = timedelta(minutes=1)
#: By the server's clock, all answers together came faster than the rule for their median allows;
#: and a browser said that an answer took longer than its question had been there.
TOO_FAST, TIMES_DOUBTFUL = "too_fast", "times_doubtful"
#: What tables say of who breaks a rule, by the rule's name in the study's [analysis.exclusions].
BREAKS = {
    "answered_share": "few answers",
    "one_side_share": "one side",
    "median_rt_ms": "very fast",
    "same_answer_share": "one answer",
    "zeta": "incoherent",
    "repeat_share": "repeats differ",
    "trap_share": "traps missed",
    TOO_FAST: "fast by the server's clock",
    TIMES_DOUBTFUL: "times in doubt",
}
#: Participants on the page that updates itself; all are on a page of their own.
LATEST = 10
#: Without an answer for this long, an unfinished participant counts as dropped out (and may still
#: come back).
IDLE = timedelta(minutes=30)


def shared(database: Database, study: Study, period_s: float = PERIOD_S) -> dict[str, Any]:
    """`numbers`, made once for all who look: anew when something happened since, but not before
    `period_s` have passed, nor so often that it takes more than `SHARE` of a core.

    It has a `version` beside, that changes with it.
    """
    with database.read() as db:
        about, kept, time = _about(db), db.get(Live, 1), now()
        if kept and not _due(kept, about, time):
            return json.loads(kept.numbers)
    with database.write() as db:
        kept = db.get(Live, 1)
        if kept and (_due(kept, about, time) is False or (kept.claimed_until or time) > time):
            return json.loads(kept.numbers)
        if kept:
            kept.claimed_until = time + CLAIM
    with database.read() as db:
        about, began = _about(db), monotonic()
        made = numbers(db, study)
        made["version"] = f"{about}@{now().timestamp():.3f}"
        pause = timedelta(seconds=max(period_s, (monotonic() - began) / SHARE) if period_s else 0)
    row = {
        "about": about,
        "made_at": time,
        "next_at": now() + pause,
        "claimed_until": None,
        "numbers": json.dumps(made),
    }
    try:
        with database.write() as db:
            db.merge(Live(id=1, **row))
    except IntegrityError:
        pass  # the very first numbers, made twice at once: one is kept
    return made


class Everybody:
    """The rows of `participants` and of `quality`, made in a process once for all its pages about
    people: anew when something happened since, answers alone no oftener than `shared` would.
    """

    def __init__(self):
        self._lock = Lock()
        self._made: tuple[list[dict[str, Any]], dict[str, Any]] = [], {}
        self._about, self._at, self._pause_s = "", 0.0, 0.0

    def seen(
        self, db: Session, study: Study, period_s: float = PERIOD_S, code: str | None = None
    ) -> tuple[list[dict[str, Any]], dict[str, Any]]:
        """code: of a participant who must be among them."""
        with self._lock:
            about, age_s = _about(db), monotonic() - self._at
            known = code is None or any(one["code"] == code for one in self._made[0])
            # what researchers did, the last part, shows at once
            judged = about.rpartition(".")[2] == self._about.rpartition(".")[2]
            fresh = about == self._about or (judged and age_s < self._pause_s)
            if not (self._about and known and fresh and age_s < OLDEST.total_seconds()):
                began, answers = monotonic(), responses(db, study)
                self._made = participants(db, study, answers), quality(study, answers)
                self._about, self._at = about, monotonic()
                self._pause_s = max(period_s, (self._at - began) / SHARE) if period_s else 0.0
            return self._made


def _about(db: Session) -> str:
    """Changes with everything that happens: rows are only ever appended."""
    tables = (Response, Event, LogEntry)
    newest = select(*(select(func.max(table.id)).scalar_subquery() for table in tables))
    return ".".join(str(value or 0) for value in db.execute(newest).one())


def _due(kept: Live, about: str, time: datetime) -> bool:
    old = time - kept.made_at > OLDEST  # who dropped out changes by itself
    return time >= kept.next_at and (kept.about != about or old)


def numbers(db: Session, study: Study) -> dict[str, Any]:
    """Everything the dashboard shows that changes; plain numbers and texts, ready for JSON."""
    answers, record = responses(db, study), recruiting.record_of(db)
    people = participants(db, study, answers)
    states = [person["state"] for person in people]
    return {
        "summary": {
            "started": len(people),
            "completed": states.count("completed"),
            "in_progress": states.count("in progress"),
            "dropped_out": states.count("dropped out"),
            "withdrawn": states.count("withdrawn"),
            "excluded": states.count("excluded"),
            "pilot": states.count("pilot"),
            "places": recruiting.places(db, record),
            "answers": export.count(db),
            "about_other_images": about_other_images(db, study),
        },
        "participants": people[:LATEST],
        "framings": results.framings(answers, study, declared(study)),
        "sides": sides(db, study),
        "pages": course.pages(study, people),
        "stopped": course.stopped(people),
        "times": course.times(answers),
    }


def responses(db: Session, study: Study) -> Responses | None:
    """The answers that count, as the analysis takes them; None where there are none."""
    records = export.judgements(db, study)
    if not any(one["kind"] == "main" for one in records):
        return None
    from analysis.codebook import of_study
    from analysis.responses import responses_from_records

    return responses_from_records(records, of_study(study.definition.record()))


def participants(db: Session, study: Study, answers: Responses | None) -> list[dict[str, Any]]:
    """Each participant, latest first: how far, in which state, the median time of an answer, and
    which declared rules they break.
    """
    counted = select(
        Response.participant_id,
        func.count(),
        func.max(Response.answered_at),
        func.count(Response.rt_reported_ms),
    )
    given = {row[0]: row[1:] for row in db.execute(counted.group_by(Response.participant_id))}
    # programs need no time
    people = recruiting.record_of(db).kind == "real"
    fastest_ms = rules(study).median_rt_ms if people else None
    asked = dict(
        db.execute(select(Trial.participant_id, func.count()).group_by(Trial.participant_id)).all()
    )
    stated = dict(
        db.execute(
            select(Statement.participant_id, func.count()).group_by(Statement.participant_id)
        ).all()
    )
    judged = quality(study, answers)
    result = []
    for person in db.scalars(select(Participant).order_by(Participant.id.desc())):
        count, last, doubtful = given.get(person.id, (0, person.consented_at, 0))
        state = "dropped out" if now() - last > IDLE else "in progress"
        if person.completed_at:
            state = "completed"
        if person.pilot:
            state = "pilot"
        if person.excluded_at:
            state = "excluded"
        if person.withdrawn_at:
            state = "withdrawn"
        row = judged.get(person.code)
        median_ms, broken = (row.median_rt_ms, row.excluded) if row else (None, "")
        flags = [broken] if broken and state != "in progress" else []  # half-way is not too little
        took_ms = (last - person.consented_at).total_seconds() * 1000
        if fastest_ms is not None and count and took_ms < count * fastest_ms:
            flags.append(TOO_FAST)
        if doubtful:
            flags.append(TIMES_DOUBTFUL)
        result.append(
            {
                "code": person.code,
                "familiarity": person.familiarity,
                "began": person.consented_at.strftime("%Y-%m-%d %H:%M"),
                "answered": count,
                "questions": asked.get(person.id, 0),
                "page": course.page(
                    study.definition,
                    person,
                    count,
                    asked.get(person.id, 0),
                    stated.get(person.id, 0),
                ),
                "state": state,
                "median_s": None if median_ms is None else round(median_ms / 1000, 1),
                "flags": ", ".join(flags),
            }
        )
    return result


def in_words(flags: str) -> str:
    """Of the `flags` of `participants`, what people read; for templates."""
    return ", ".join(BREAKS[name] for name in re.split("[;,] ", flags)) if flags else ""


def quality(study: Study, answers: Responses | None) -> dict[str, Any]:
    """Participant -> how they answered, with the study's rules of exclusion that apply: a row of
    `analysis.agreement.participants`.
    """
    if answers is None:
        return {}
    from analysis.agreement import participants as judge

    return {row.participant: row for row in judge(answers, declared(study)).itertuples()}


def judged_by(study: Study, row: Any | None) -> list[dict[str, Any]]:
    """Each of the study's rules of exclusion in words, what of a participant it looks at (a row of
    `quality`), and whether they break it.
    """
    if row is None:
        return []
    from analysis.agreement import rules

    options = declared(study)
    looked_at = {
        "answered_share": f"{row.answers} answers",
        "one_side_share": f"{row.left} left, {row.right} right",
        "median_rt_ms": f"{row.median_rt_ms:.0f} ms",
        "same_answer_share": f"{100 * row.same_answer_share:.0f} %",
        "zeta": "" if isnan(row.zeta) else f"{row.zeta:.2f}",
        "repeat_share": f"{100 * row.repeat_share:.0f} %" if row.repeat_share >= 0 else "",
        "trap_share": f"{100 * row.trap_share:.0f} % of {row.traps}" if row.traps else "",
    }
    broken = row.excluded.split("; ")
    return [
        {
            "rule": name,
            "words": text,
            "declared": f"exclusions.{name}" in options.declared,
            "value": looked_at[name] or "–",
            "broken": name in broken,
        }
        for name, text in rules(options).items()
    ]


def declared(study: Study) -> Options:
    from analysis.declared import options

    return options(study.definition.analysis, "the study")


def rules(study: Study) -> Exclusions:
    """The study's rules of exclusion."""
    return declared(study).exclusions


def about_other_images(db: Session, study: Study) -> int:
    """How many answers are about images that the study no longer has (it was built again in
    between).
    """
    images = (Response.image_left_sha256, Response.image_right_sha256)
    pairs = db.execute(export.counted(*images, func.count()).group_by(*images))
    return sum(
        count for left, right, count in pairs if not {left, right} <= study.images_by_sha256.keys()
    )


def _main(*columns: Any) -> Select:
    """`export.counted` of the questions that the study is about."""
    return export.counted(*columns).where(Trial.kind == "main")


def sides(db: Session, study: Study) -> dict[str, Any]:
    """Whether it was really randomised: how often each technique stood on each side, and which side
    was preferred.
    """
    shown = {name: {"left": 0, "right": 0} for name in study.techniques}
    for side, column in (("left", Trial.left), ("right", Trial.right)):
        for name, count in db.execute(_main(column, func.count()).group_by(column)):
            shown[name][side] = count
    given = dict(db.execute(_main(Response.answer, func.count()).group_by(Response.answer)).all())
    return {
        "shown": [
            {"label": condition.label, "name": condition.name, **shown[condition.name]}
            for condition in study.definition.techniques
        ],
        "preferred": {
            "left": sum(count for value, count in given.items() if value < 0),
            "neither": given.get(0, 0),
            "right": sum(count for value, count in given.items() if value > 0),
        },
        "given": [
            {"label": label, "count": given.get(counts, 0)}
            for counts, label in study.definition.strengths.items()
        ],
    }
