"""Counts: points per technique, answers per side, distributions of preferences, the trend over
framings.

An answer of strength 1 or 2 gives that many points to the preferred technique, 0 gives none
(Vuletic's thesis, section 5.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.responses import Responses

#: The five answers, from a strong preference for the first of two to one for the second.
DISTRIBUTION = (
    "strong_technique",
    "slight_technique",
    "none",
    "slight_opponent",
    "strong_opponent",
)


@dataclass(frozen=True)
class Trend:
    """Least-squares line through totals at distances 1, 2, 3, ...

    (framings in order, taken as equally far apart).

    r2 is NaN where all totals are the same.
    """

    slope: float
    intercept: float
    r2: float


def scores(responses: Responses) -> pd.DataFrame:
    """framing, technique, score: the points of each technique that has answers at the framing, 0
    included.
    """
    points = responses.frame.groupby(["framing", "winner"], observed=True).strength.sum()
    rows = [
        (framing, technique, int(points.get((framing, technique), 0)))
        for framing, techniques in responses.items.items()
        for technique in techniques
    ]
    return pd.DataFrame(rows, columns=["framing", "technique", "score"])


def totals(responses: Responses) -> pd.DataFrame:
    """framing, total (points), answers, mean_strength (points an answer, 0 to 2)."""
    strength = responses.frame.groupby("framing", observed=True).strength
    table = strength.agg(total="sum", answers="count", mean_strength="mean").reset_index()
    return table.astype({"framing": object, "total": int})


def trend(totals: pd.DataFrame) -> Trend | None:
    """The line of total against distance; None with fewer than three framings, where a line says
    nothing.
    """
    if len(totals) < 3:
        return None
    distance, total = np.arange(1, len(totals) + 1), totals.total.to_numpy(float)
    slope, intercept = np.polyfit(distance, total, 1)
    spread = np.sum((total - total.mean()) ** 2)
    residual = np.sum((total - intercept - slope * distance) ** 2)
    return Trend(
        float(slope), float(intercept), float(1 - residual / spread) if spread else float("nan")
    )


def distributions(responses: Responses) -> pd.DataFrame:
    """framing, technique, opponent, the counts of the five answers, n: each technique against each
    other one, both ways.
    """
    frame = responses.frame
    counts = (
        frame.groupby(["framing", "a", "b", "preference"], observed=True)
        .size()
        .unstack("preference", fill_value=0)
    )
    counts = counts.reindex(columns=range(-2, 3), fill_value=0)
    there = counts.reset_index()
    there.columns = ["framing", "technique", "opponent", *DISTRIBUTION]
    back = there.copy()
    back.columns = ["framing", "opponent", "technique", *reversed(DISTRIBUTION)]
    table = pd.concat([there, back])
    names = ["framing", "technique", "opponent"]
    for column in names[1:]:
        table[column] = pd.Categorical(table[column], responses.codebook.techniques, ordered=True)
    table = (
        table.sort_values(names)[[*names, *DISTRIBUTION]]
        .reset_index(drop=True)
        .astype(dict.fromkeys(names, object))
    )
    return table.assign(n=table[list(DISTRIBUTION)].sum(axis=1))


def preferences(responses: Responses, pair: tuple[str, str]) -> dict[str, np.ndarray]:
    """Framing -> the answers about the pair, (n,) int8 from -2 (strong for pair[0]) to 2 (strong
    for pair[1]).
    """
    a, b = sorted(pair, key=responses.codebook.techniques.index)
    frame = responses.frame
    about = frame[(frame.a == a) & (frame.b == b)]
    sign = 1 if (a, b) == tuple(pair) else -1
    return {
        framing: sign * about.preference[about.framing == framing].to_numpy()
        for framing in responses.items
        if (about.framing == framing).any()
    }


def sides(responses: Responses) -> pd.DataFrame:
    """framing, left, none, right: how many answers favoured the image on the left, neither, the one
    on the right.
    """
    frame = responses.frame
    side = np.sign(frame.answer).map({-1: "left", 0: "none", 1: "right"})
    table = pd.crosstab(frame.framing.astype(object), side).reindex(
        index=list(responses.items), fill_value=0
    )
    return (
        table.reindex(columns=["left", "none", "right"], fill_value=0)
        .rename_axis(index="framing", columns=None)
        .reset_index()
    )


def familiarity(responses: Responses) -> pd.DataFrame:
    """level, label, participants: one row a level of the self-rating, and one without a level for
    those who gave no rating, where there are any.
    """
    codebook = responses.codebook
    counts = responses.ratings.value_counts().reindex(codebook.ratings, fill_value=0)
    table = pd.DataFrame(
        {
            "level": list(codebook.ratings),
            "label": codebook.familiarity,
            "participants": counts.to_numpy(),
        }
    )
    unrated = int(responses.ratings.isna().sum())
    if unrated:
        table = table.astype({"level": object})
        table.loc[len(table)] = ["", "no rating", unrated]
    return table
