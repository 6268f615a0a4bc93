"""Whether the place of a question in the order, or the question before it, changes the answer."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis import bootstrap
from analysis.inference.people import signed_rank
from analysis.options import FEWEST_PEOPLE, Options
from analysis.panel import with_notes
from analysis.responses import Responses

#: A slope is told for so many questions further on.
QUESTIONS = 10


def order_effects(responses: Responses, options: Options) -> pd.DataFrame:
    """statistic, people, value, low, high, p: means over participants of what is computed within
    each, with bootstrap intervals; p: signed ranks, two-sided.

    strength_slope  change of the strength (0 to 2) over 10 questions: below 0 people tire, or grow
                    careful
    side_slope      change of the answer (-2 left to 2 right) over 10 questions
    time_slope      change of the natural logarithm of the time of an answer over 10 questions
    carry_over      how much more often two questions in a row are answered for the same side than
                    the person's own shares of left and right imply, 0 to 1
    """
    frame = responses.frame
    frame = frame[frame.order.notna()].sort_values(["participant", "order", "line"])
    columns = ["statistic", "people", "value", "low", "high", "p"]
    if frame.empty:
        return with_notes([], columns, ["no place in the order is known: no effects of order"])
    who = frame.participant.cat.codes.to_numpy()
    order = frame.order.to_numpy(float)
    values = {
        "strength_slope": _slopes(who, order, frame.strength.to_numpy(float)),
        "side_slope": _slopes(who, order, frame.answer.to_numpy(float)),
        "time_slope": _slopes(who, order, _log_time(frame.rt_ms.to_numpy(float))),
        "carry_over": _carried_over(who, order, frame.answer.to_numpy(int)),
    }
    rows, notes = [], []
    for name, one in values.items():
        if len(one) < FEWEST_PEOPLE:
            notes.append(
                f"{name}: {len(one)} participants answered what tells it, which {FEWEST_PEOPLE} "
                "have to"
            )
            continue
        draws = bootstrap.totals(one, options) / len(one)
        low, high = bootstrap.interval(draws, len(one), options.level)
        rows.append((name, len(one), one.mean(), low, high, signed_rank(one)[0]))
    return with_notes(rows, columns, notes)


def _log_time(rt_ms: np.ndarray) -> np.ndarray:
    return np.log(np.where(rt_ms > 0, rt_ms, np.nan))


def _slopes(who: np.ndarray, order: np.ndarray, value: np.ndarray) -> np.ndarray:
    """The least-squares slope of value on order of each person with three answers or more."""
    known = np.isfinite(value)
    who, order, value = who[known], order[known], value[known]
    size = int(who.max(initial=-1)) + 1
    n, x, y, xx, xy = (
        np.bincount(who, weight, size)
        for weight in (np.ones(len(who)), order, value, order**2, order * value)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = xx - x**2 / n
        slope = (xy - x * y / n) / spread
    return QUESTIONS * slope[(n >= 3) & (spread > 1e-9)]


def _carried_over(who: np.ndarray, order: np.ndarray, answer: np.ndarray) -> np.ndarray:
    """For each person with five pairs of questions in a row that prefer a side: the share that
    prefer the same side, less what their shares of left and right imply.
    """
    place = np.lexsort((order, who))
    who, order, side = who[place], order[place], np.sign(answer[place])
    follows = (who[1:] == who[:-1]) & (order[1:] == order[:-1] + 1)
    follows &= (side[1:] != 0) & (side[:-1] != 0)
    size = int(who.max(initial=-1)) + 1
    pairs = np.bincount(who[1:][follows], minlength=size)
    same = np.bincount(who[1:][follows], (side[1:] == side[:-1])[follows], size)
    right, decided = (
        np.bincount(who, one, size) for one in ((side > 0).astype(float), (side != 0).astype(float))
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        # two of the person's own decided answers, drawn without replacement, are alike this often
        alike = (right * (right - 1) + (decided - right) * (decided - right - 1)) / (
            decided * (decided - 1)
        )
        excess = same / pairs - alike
    return excess[(pairs >= 5) & np.isfinite(excess)]
