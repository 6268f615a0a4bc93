"""Preference against distance: whether it weakens from framing to framing."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy import stats

from analysis import bootstrap
from analysis.codebook import FRAMING
from analysis.inference.people import signed_rank
from analysis.options import FEWEST_PEOPLE, Options
from analysis.panel import panels, with_notes
from analysis.responses import Responses


def trend(responses: Responses, options: Options) -> pd.DataFrame:
    """statistic, value, low, high, p: preference against distance, framings in order and taken as
    equally far apart.

    slope_total     least-squares slope of the framings' total points, points a step; as
                    `tallies.trend`, with an interval
    slope_strength  mean over participants of the slope of their mean strength (0 to 2), a step; p:
                    signed ranks of their slopes, two-sided
    page_l          Page's L that strength falls with every step; p one-sided, normal approximation
                    (Page 1963, doi:10.2307/2282965)

    The last two take those who answered at every framing. Empty with fewer than three framings, and
    for the levels of another factor.
    """
    columns = ["statistic", "value", "low", "high", "p"]
    if responses.codebook.factor != FRAMING:
        return with_notes([], columns, [f"{responses.codebook.levels} are no distances: no trend"])
    here = list(panels(responses, overall=False).values())
    if len(here) < 3:
        return with_notes(
            [], columns, [f"a trend over distance needs 3 framings, and the table has {len(here)}"]
        )
    notes = bootstrap.few(responses)
    if not responses.codebook.near_to_far:
        notes.append(f"distance is the order of framings: {responses.codebook.framing_rule}")
    step = np.arange(len(here)) - (len(here) - 1) / 2
    step /= (step**2).sum()
    points = np.stack(
        [np.abs(np.where(panel.answered, panel.preference, 0)).sum(axis=1) for panel in here],
        axis=1,
    )
    asked = np.stack([panel.answered.sum(axis=1) for panel in here], axis=1)
    drawn = bootstrap.totals(points, options) @ step
    rows = [
        (
            "slope_total",
            points.sum(axis=0) @ step,
            *bootstrap.interval(drawn, responses.participants, options.level),
            np.nan,
        )
    ]
    whole = (asked > 0).all(axis=1)
    strength = points[whole] / asked[whole]
    slopes = strength @ step
    if whole.sum() < FEWEST_PEOPLE:
        notes.append(
            f"{whole.sum()} participants answered at every framing: no test of the trend, "
            f"which needs {FEWEST_PEOPLE}"
        )
        return with_notes(rows, columns, notes)
    low, high = bootstrap.interval(
        bootstrap.totals(slopes, options) / len(slopes), len(slopes), options.level
    )
    rows.append(("slope_strength", slopes.mean(), low, high, signed_rank(slopes)[0]))
    page = stats.page_trend_test(
        strength, predicted_ranks=np.arange(len(here), 0, -1), method="asymptotic"
    )
    rows.append(("page_l", page.statistic, np.nan, np.nan, page.pvalue))
    return with_notes(rows, columns, notes)
