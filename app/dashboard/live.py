"""The numbers of the dashboard: who takes part, how far they are, what the answers say so far."""

from __future__ import annotations

from datetime import datetime, timedelta
from statistics import median
from typing import Any

from sqlalchemy import case, func, select
from sqlalchemy.orm import Session

from app import export
from app.models import Participant, Response, Trial, now
from app.study import Study

#: Without an answer for this long, an unfinished participant counts as dropped out (and may still
#: come back).
IDLE = timedelta(minutes=30)


def numbers(db: Session, study: Study, *, simulated: bool) -> dict[str, Any]:
    """Everything the dashboard shows that changes; plain numbers and texts, ready for JSON."""
    people = participants(db)
    states = [person["state"] for person in people]
    return {
        "summary": {
            "started": len(people),
            "completed": states.count("completed"),
            "in_progress": states.count("in progress"),
            "dropped_out": states.count("dropped out"),
            "withdrawn": states.count("withdrawn"),
            "answers": export.count(db),
            "about_other_images": about_other_images(db, study),
        },
        "participants": people,
        "framings": framings(db, study, simulated=simulated),
        "sides": sides(db, study),
    }


def participants(db: Session) -> list[dict[str, Any]]:
    """Each participant, latest first: how far, in which state, the median time of an answer."""
    times: dict[int, list[int]] = {}
    last: dict[int, datetime] = {}
    for participant, rt_ms, at in db.execute(
        select(Response.participant_id, Response.rt_ms, Response.answered_at)
    ):
        times.setdefault(participant, []).append(rt_ms)
        last[participant] = max(at, last.get(participant, at))
    questions = dict(
        db.execute(select(Trial.participant_id, func.count()).group_by(Trial.participant_id)).all()
    )
    result = []
    for person in db.scalars(select(Participant).order_by(Participant.id.desc())):
        answered = times.get(person.id, [])
        idle = now() - last.get(person.id, person.consented_at) > IDLE
        state = "dropped out" if idle else "in progress"
        if person.completed_at:
            state = "completed"
        if person.withdrawn_at:
            state = "withdrawn"
        result.append(
            {
                "code": person.code,
                "familiarity": person.familiarity,
                "began": person.consented_at.strftime("%Y-%m-%d %H:%M"),
                "answered": len(answered),
                "questions": questions.get(person.id, 0),
                "state": state,
                "median_s": round(median(answered) / 1000, 1) if answered else None,
            }
        )
    return result


def framings(db: Session, study: Study, *, simulated: bool) -> list[dict[str, Any]]:
    """For each framing: points and AHP priority of each technique, consistency, and what is still
    missing.
    """
    records = list(export.records(db, study, simulated=simulated))
    if not records:
        return []
    from analysis import ahp, tallies
    from analysis.codebook import of_study
    from analysis.responses import responses_from_records

    responses = responses_from_records(records, of_study(study.definition.record()))
    points = {
        (row.framing, row.technique): row.score for row in tallies.scores(responses).itertuples()
    }
    totals = tallies.totals(responses).set_index("framing")
    result = []
    for framing, comparison in ahp.comparisons(responses).items():
        complete = len(comparison.items) == len(study.techniques) and not comparison.missing
        priorities = ahp.priorities(comparison.matrix) if complete else None
        most = max(points[framing, name] for name in comparison.items) or 1
        result.append(
            {
                "name": framing,
                "label": responses.codebook.framing_label(framing),
                "total": int(totals.total[framing]),
                "answers": int(totals.answers[framing]),
                "cr": priorities and priorities.cr,
                "verdict": priorities.verdict if priorities else "some pairs have no answer yet",
                "techniques": [
                    {
                        "name": name,
                        "label": responses.codebook.label(name),
                        "score": int(points[framing, name]),
                        "score_share": float(points[framing, name] / most),
                        "priority": float(priorities.vector[i]) if priorities else None,
                    }
                    for i, name in enumerate(comparison.items)
                ],
            }
        )
    return result


def about_other_images(db: Session, study: Study) -> int:
    """How many answers are about images that the study no longer has (it was built again in
    between).
    """
    images = (Response.image_left_sha256, Response.image_right_sha256)
    pairs = db.execute(export.counted(*images, func.count()).group_by(*images))
    return sum(
        count for left, right, count in pairs if not {left, right} <= study.images_by_sha256.keys()
    )


def sides(db: Session, study: Study) -> dict[str, Any]:
    """Whether it was really randomised: how often each technique stood on each side, and which side
    was preferred.
    """
    shown = {name: {"left": 0, "right": 0} for name in study.techniques}
    for side, column in (("left", Trial.left), ("right", Trial.right)):
        for name, count in db.execute(export.counted(column, func.count()).group_by(column)):
            shown[name][side] = count
    sign = case((Response.answer < 0, "left"), (Response.answer > 0, "right"), else_="neither")
    preferred = dict(db.execute(export.counted(sign, func.count()).group_by(sign)).all())
    given = dict(
        db.execute(export.counted(Response.answer, func.count()).group_by(Response.answer)).all()
    )
    return {
        "shown": [
            {"label": condition.label, "name": condition.name, **shown[condition.name]}
            for condition in study.definition.techniques
        ],
        "preferred": {side: preferred.get(side, 0) for side in ("left", "neither", "right")},
        "given": [
            {"label": level.label, "count": given.get(level.value, 0)}
            for level in study.definition.scale
        ],
    }
