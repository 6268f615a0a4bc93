"""How participants get on: on which page they stop, and how long they take."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from app.models import Participant
from app.study import Study
from stimuli.study import Study as Definition

if TYPE_CHECKING:
    import pandas as pd

    from analysis.responses import Responses

#: Questions are shown in so many parts of their order.
PARTS = 6
#: Pages by what `page` calls them, in their order; those of questions are shown in parts.
NAMES = {
    "self-rating": "Self-rating",
    "before": "Questions before the pairs",
    "screen": "Screen",
    "questions": "Questions",
    "after": "Questions after the pairs",
    "finished": "Finished",
}
#: Who is gone: `state` of a participant.
GONE = ("dropped out", "withdrawn")


def page(
    definition: Definition, person: Participant, answered: int, questions: int, stated: int
) -> str:
    """The page at which somebody is: a key of `NAMES`, in the order of the questionnaire."""
    if person.completed_at:
        return "finished"
    if person.familiarity is None:
        return "self-rating"
    if stated < len(definition.before):
        return "before"
    if definition.screen.check and person.screen is None:
        return "screen"
    return "questions" if answered < questions else "after"


def pages(study: Study, people: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The pages in their order, questions in parts: how many came to each, and how many of those
    stopped there (dropped out or withdrew). Who tries the study out is left out.
    """
    definition, counted = study.definition, [one for one in people if one["state"] != "pilot"]
    parts = _parts(max((one["questions"] for one in counted), default=0))
    shown = {
        "before": bool(definition.before),
        "screen": definition.screen.check,
        "after": bool(definition.after),
    }
    keys = [key for key in NAMES if shown.get(key, True)]
    rows = [(key, part) for key in keys for part in (parts if key == "questions" else [None])]
    at = [
        rows.index((key, _part(parts, one["answered"]) if key == "questions" else None))
        for one in counted
        if (key := one["page"] if one["page"] in keys else "finished")
    ]
    left = Counter(place for place, one in zip(at, counted) if one["state"] in GONE)
    return [
        {
            "page": NAMES[key] if part is None else _span(*part),
            "came": (came := sum(other >= place for other in at)),
            "share": came / len(counted) if counted else 0.0,
            "stopped": left[place],
        }
        for place, (key, part) in enumerate(rows)
    ]


def stopped(people: list[dict[str, Any]]) -> list[dict[str, int]]:
    """After how many answers those who dropped out or withdrew left."""
    left = Counter(one["answered"] for one in people if one["state"] in GONE)
    return [{"answered": answered, "people": left[answered]} for answered in sorted(left)]


def times(answers: Responses | None) -> list[dict[str, Any]]:
    """Quartiles of the time of an answer, s, by the place of the question among a participant's,
    and of all.
    """
    if answers is None:
        return []
    frame = answers.frame[["order", "rt_ms"]].dropna()
    if not len(frame):
        return []
    rows = [
        _quartiles(_span(a, b), frame.rt_ms[here])
        for a, b in _parts(int(frame.order.max()))
        if (here := frame.order.between(a, b)).any()
    ]
    rows.append(_quartiles("All", frame.rt_ms))
    longest = max(row["high"] for row in rows) or 1.0
    for row in rows:
        for name in ("low", "median", "high"):
            row[f"{name}_share"] = row[name] / longest
    return rows


def _quartiles(label: str, ms: pd.Series) -> dict[str, Any]:
    low, median, high = (ms.quantile([0.25, 0.5, 0.75]) / 1000).round(2)
    return {"label": label, "low": float(low), "median": float(median), "high": float(high)}


def _parts(questions: int) -> list[tuple[int, int]]:
    """First and last question of each part, from 1."""
    parts = min(PARTS, questions)
    ends = [round(questions * k / parts) for k in range(parts + 1)] if parts else []
    return [(a + 1, b) for a, b in pairwise(ends)]


def _part(parts: list[tuple[int, int]], answered: int) -> tuple[int, int]:
    """The part of the question that comes after so many answers."""
    return next(part for part in parts if answered < part[1])


def _span(first: int, last: int) -> str:
    return f"Questions {first} to {last}" if first < last else f"Question {first}"
