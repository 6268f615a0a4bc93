"""Resampling people: the bootstrap of participants, whole, with all their answers, from a recorded
seed.

Answers of one person hang together, so that answers are never drawn one by one. Every statistic
here is a function of counts: a resample is a row of weights, how often each participant was drawn,
and the counts of all resamples are one matrix product.

The interval is the expanded percentile interval of Hesterberg 2015 ("What teachers should know
about the bootstrap", The American Statistician 69(4), doi:10.1080/00031305.2015.1089789, section
5.3): with n people the plain percentile interval is too narrow by about sqrt((n - 1)/n) and takes a
normal quantile where Student's is due, so the tail alpha/2 becomes Phi(-sqrt(n/(n - 1)) t_(alpha/2,
n - 1)).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from analysis.options import FEWEST_PEOPLE, Options
from analysis.panel import Panel, by_pair, panels, with_notes
from analysis.responses import Responses

#: An interval is given where at least this share of the resamples has an estimate.
LEAST_SHARE = 0.95
#: Resamples that are drawn and computed on together, from a seed of their own: so draws do not
#: hang on what else is drawn, or where. 13 MB of weights with 100,000 people.
BLOCK = 32
#: Weights that are kept for the next statistic, numbers: 96 MiB.
KEPT = 48 << 20

#: The five answers, ascending.
ANSWERS = np.arange(-2.0, 3.0)


def weights(people: int, resamples: int, seed: int) -> np.ndarray:
    """(resamples, people) float32: how often each participant is in each resample; every row sums
    to people.
    """
    return np.concatenate(list(_chunks(people, resamples, seed)))


def _chunks(people: int, resamples: int, seed: int) -> Iterator[np.ndarray]:
    """`weights` in parts, so that memory stays flat; what fits is drawn once for all statistics of
    a report.
    """
    if people * resamples <= KEPT:
        parts = _kept(people, resamples, seed)
    else:
        parts = _drawn(people, resamples, seed)
    return (part.astype(np.float32) for part in parts)


@lru_cache(maxsize=2)
def _kept(people: int, resamples: int, seed: int) -> tuple[np.ndarray, ...]:
    return tuple(part.astype(np.uint16) for part in _drawn(people, resamples, seed))


def _drawn(people: int, resamples: int, seed: int, first: int = 0) -> Iterator[np.ndarray]:
    """Blocks from resample `first` on, the beginning of a block, each from a seed of its own: the
    child of its number, as `SeedSequence.spawn` makes them.
    """
    for start in range(first, resamples, BLOCK):
        own = np.random.SeedSequence([seed, people], spawn_key=(start // BLOCK,))
        rows = min(BLOCK, resamples - start)
        drawn = np.random.default_rng(own).integers(0, people, (rows, people), dtype=np.int32)
        drawn += np.arange(rows, dtype=np.int32)[:, None] * people
        yield np.bincount(drawn.ravel(), minlength=rows * people).reshape(rows, people)


def totals(values: np.ndarray, options: Options) -> np.ndarray:
    """values (P, ...) of participants -> (resamples, ...) float64: their sums in each resample; the
    draws depend on P and seed alone.
    """
    flat = values.reshape(len(values), -1).astype(np.float32, copy=False)
    sums = [part @ flat for part in _chunks(len(values), options.resamples, options.seed)]
    return np.concatenate(sums).astype(float).reshape(options.resamples, *values.shape[1:])


def counts(panel: Panel, options: Options) -> np.ndarray:
    """(resamples, K, 5): the panel's counts in each resample, in the order of `panel.PREFERENCES`;
    exact, they are whole numbers.
    """
    key = ("counts", options.resamples, options.seed)
    if key not in panel.kept:
        panel.kept[key] = totals(panel.indicators, options)
    return panel.kept[key]


def counts_between(panel: Panel, options: Options, first: int, last: int) -> np.ndarray:
    """Those rows of `counts`, first at the beginning of a block, without what comes before."""
    flat = panel.indicators.reshape(len(panel.indicators), -1)
    last = min(last, options.resamples)
    blocks = _drawn(len(flat), last, options.seed, first)
    sums = [part.astype(np.float32) @ flat for part in blocks]
    return np.concatenate(sums).astype(float).reshape(-1, *panel.indicators.shape[1:])


def interval(draws: np.ndarray, people: int, level: float) -> tuple[np.ndarray, np.ndarray]:
    """draws (resamples, ...) -> low, high (...); NaN below 5 people or where over 5 % of the
    resamples have no estimate.
    """
    draws = np.asarray(draws, float)
    finite = np.isfinite(draws)
    enough = (finite.mean(axis=0) >= LEAST_SHARE) & (people >= FEWEST_PEOPLE)
    if not enough.any():
        return np.full(draws.shape[1:], np.nan)[()], np.full(draws.shape[1:], np.nan)[()]
    tail = _tail(people, level)
    quantile = np.quantile if finite.all() else np.nanquantile
    low, high = quantile(
        np.where(finite, draws, np.nan if enough.all() else np.where(enough, np.nan, 0.0)),
        [tail, 1 - tail],
        axis=0,
    )
    return np.where(enough, low, np.nan)[()], np.where(enough, high, np.nan)[()]


@lru_cache(maxsize=256)
def _tail(people: int, level: float) -> float:
    """The percentile at which an expanded interval ends (Hesterberg 2015)."""
    t = stats.t.ppf((1 - level) / 2, people - 1)
    return float(stats.norm.cdf(np.sqrt(people / (people - 1)) * t))


def score_intervals(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, technique, score, low, high: points as in `tallies.scores`; the interval is for as
    many people as took part.
    """
    rows = []
    for name, panel in panels(responses).items():
        points = _points(panel)
        low, high = interval(totals(points, options), panel.people, options.level)
        rows += zip(
            [name] * len(panel.items), panel.items, points.sum(axis=0), low, high, strict=True
        )
    return with_notes(
        rows, ["framing", "technique", "score", "low", "high"], few(responses)
    ).astype({"score": int})


def median_intervals(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, a, b, n, median_preference, low, high: the median answer about each pair, -2 to 2,
    negative prefers a.
    """
    rows = []
    for name, panel in panels(responses, overall=False).items():
        given = by_pair(panel, panel.counts)
        middle = median(given)
        low, high = interval(
            median(by_pair(panel, counts(panel, options))), panel.people, options.level
        )
        for k, (a, b) in enumerate(combinations(panel.items, 2)):
            if n := int(given[k].sum()):
                rows.append((name, a, b, n, middle[k], low[k], high[k]))
    return with_notes(
        rows, ["framing", "a", "b", "n", "median_preference", "low", "high"], few(responses)
    )


def median(counts: np.ndarray, values: np.ndarray = ANSWERS) -> np.ndarray:
    """counts (..., 5) of answers -> (...): the median of their ascending or descending values; NaN
    where there is no answer.
    """
    below = np.cumsum(counts, axis=-1)
    n = below[..., -1:]
    lower = (below < np.floor((n + 1) / 2)).sum(axis=-1)
    upper = (below < np.floor(n / 2) + 1).sum(axis=-1)
    known = n[..., 0] > 0
    lower, upper = np.where(known, lower, 0), np.where(known, upper, 0)
    return np.where(known, (values[lower] + values[upper]) / 2, np.nan)


def medians(values: np.ndarray, options: Options) -> np.ndarray:
    """values (P,) ascending, one a participant -> (resamples,): their median in each resample."""
    parts = []
    for part in _chunks(len(values), options.resamples, options.seed):
        below = np.cumsum(part, axis=1)
        lower = (below < (len(values) + 1) // 2).sum(axis=1)
        upper = (below < len(values) // 2 + 1).sum(axis=1)
        parts.append((values[lower] + values[upper]) / 2)
    return np.concatenate(parts)


def few(responses: Responses) -> list[str]:
    """The note for a table without intervals."""
    if responses.participants >= FEWEST_PEOPLE:
        return []
    return [
        (
            f"{responses.participants} participants: no intervals, which need {FEWEST_PEOPLE} to "
            "resample"
        )
    ]


def _points(panel: Panel) -> np.ndarray:
    """(P, n): each participant's points for each item, see `tallies`."""
    given = np.where(panel.answered, panel.preference, 0).astype(np.float32)
    first, second = (
        np.eye(len(panel.items), dtype=np.float32)[side] for side in (panel.first, panel.second)
    )
    return np.maximum(-given, 0) @ first + np.maximum(given, 0) @ second
