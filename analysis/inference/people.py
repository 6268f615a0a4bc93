"""Tests on people: of one number a person, or of how many people gave each of the five answers.

The two forms of a test are one code path: what `analyse` finds in a table and what `power` finds in
a thousand simulated ones is decided by the same functions.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pandas as pd
from scipy import stats

from analysis.options import FEWEST_PEOPLE, OVERALL, Options

#: To this number of people who saw a difference the signed-rank test is exact.
EXACT_PEOPLE = 50
#: The five answers, in the order of every array of counts.
ANSWERS = np.arange(-2, 3)


def alpha_of(options: Options) -> float:
    """The level of a test that goes with the level of the intervals: 0.05 with 95 %."""
    return round(1 - options.level, 10)


def signed_rank(values: np.ndarray) -> tuple[float, str, float]:
    """Wilcoxon's test that values are symmetric about 0: p, 'exact' or 'normal', and the
    rank-biserial correlation, -1 to 1.

    Zeros are dropped before ranking (Wilcoxon 1945), ties share their mean rank; to `EXACT_PEOPLE`
    values beside 0 the p is exact, from all changes of sign of these very ranks, two-sided as twice
    the smaller tail; beyond that normal, with the variance corrected for ties and no continuity
    correction. p is NaN below 5 values; 1 where all are 0.
    """
    values = np.asarray(values, float)
    nonzero = values[values != 0]
    if not len(nonzero):
        return (1.0 if len(values) >= FEWEST_PEOPLE else np.nan), "exact", 0.0
    ranks = stats.rankdata(np.abs(np.round(nonzero, 9)))
    up, total = ranks[nonzero > 0].sum(), ranks.sum()
    biserial = float(2 * up / total - 1)
    method = "exact" if len(nonzero) <= EXACT_PEOPLE else "normal"
    if len(values) < FEWEST_PEOPLE:
        return np.nan, method, biserial
    if method == "exact":
        tails = _two_tails(tuple(np.rint(2 * np.sort(ranks)).astype(int)))
        return float(tails[round(2 * up)]), method, biserial
    spread = np.sqrt((ranks**2).sum() / 4)  # the variance with ties in it
    return float(2 * stats.norm.sf(abs(up - total / 2) / spread)), method, biserial


def signed_rank_counts(counts: np.ndarray) -> np.ndarray:
    """counts (..., 5) of people by their answer, -2 to 2 -> p of `signed_rank`, (...)."""
    counts = np.asarray(counts)
    shape = counts.shape[:-1]
    counts = np.rint(counts.reshape(-1, 5)).astype(np.int64)
    ones, twos = counts[:, 1] + counts[:, 3], counts[:, 0] + counts[:, 4]
    n = ones + twos
    # mean ranks of the ones and of the twos, and the sum of the ranks of those above 0
    of_ones, of_twos = (ones + 1) / 2, ones + (twos + 1) / 2
    up = counts[:, 3] * of_ones + counts[:, 4] * of_twos
    spread = np.sqrt((ones * of_ones**2 + twos * of_twos**2) / 4)
    away = np.abs(up - n * (n + 1) / 4)
    p = 2 * stats.norm.sf(np.divide(away, spread, out=np.zeros(len(n)), where=spread > 0))
    exact = (n > 0) & (n <= EXACT_PEOPLE)
    kinds, kind = np.unique(
        np.stack([ones[exact], twos[exact]], axis=1), axis=0, return_inverse=True
    )
    exact_p = p[exact]
    doubled = np.rint(2 * up[exact]).astype(int)
    for place, (one, two) in enumerate(kinds):
        here = kind.ravel() == place
        exact_p[here] = _two_tails((one + 1,) * one + (2 * one + two + 1,) * two)[doubled[here]]
    p[exact] = exact_p
    p[n == 0] = 1.0
    p[counts.sum(axis=1) < FEWEST_PEOPLE] = np.nan
    return p.reshape(shape)


@lru_cache(maxsize=4096)
def _two_tails(doubled: tuple[int, ...]) -> np.ndarray:
    """Two-sided p for each sum of doubled ranks that got a plus, each by a fair coin."""
    chance = np.zeros(sum(doubled) + 1)
    chance[0] = 1.0
    for rank in doubled:
        chance[rank:] = (chance[rank:] + chance[: len(chance) - rank]) / 2
        chance[:rank] /= 2
    below = np.cumsum(chance)
    above = np.cumsum(chance[::-1])[::-1]
    return np.minimum(1.0, 2 * np.minimum(below, above))


def sign_test(values: np.ndarray) -> float:
    """Two-sided exact binomial p of as many values above as below 0, zeros left out; NaN below 5
    values, 1 where all are 0.
    """
    values = np.asarray(values)
    up, down = int((values > 0).sum()), int((values < 0).sum())
    if len(values) < FEWEST_PEOPLE:
        return np.nan
    return float(_binomial(np.array(up), np.array(down)))


def sign_counts(counts: np.ndarray) -> np.ndarray:
    """counts (..., 5) of people by their answer -> p of `sign_test`, (...)."""
    counts = np.asarray(counts)
    p = _binomial(counts[..., 3:].sum(axis=-1), counts[..., :2].sum(axis=-1))
    return np.where(counts.sum(axis=-1) < FEWEST_PEOPLE, np.nan, p)


def _binomial(up: np.ndarray, down: np.ndarray) -> np.ndarray:
    return np.minimum(1.0, 2 * stats.binom.cdf(np.minimum(up, down), up + down, 0.5))


def equivalence(values: np.ndarray, margin: float | None) -> float:
    """p of two one-sided t tests that the mean is within +-margin (Schuirmann 1987,
    doi:10.1007/BF01068419); NaN without a margin, below 5 values, or where all are alike.
    """
    values = np.asarray(values, float)
    if margin is None or len(values) < FEWEST_PEOPLE or values.std() == 0:
        return np.nan
    return float(_two_one_sided(values.mean(), values.std(ddof=1), len(values), margin))


def equivalence_counts(counts: np.ndarray, margin: float | None) -> np.ndarray:
    """counts (..., 5) of people by their answer -> p of `equivalence`, (...)."""
    counts = np.asarray(counts, float)
    n = counts.sum(axis=-1)
    if margin is None:
        return np.full(n.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = counts @ ANSWERS / n
        squares = np.clip(counts @ ANSWERS**2 - n * mean**2, 0, None)
        spread = np.sqrt(squares / (n - 1))
        p = _two_one_sided(mean, spread, n, margin)
    return np.where((n < FEWEST_PEOPLE) | ~(squares > 1e-9), np.nan, p)


def _two_one_sided(mean: np.ndarray, spread: np.ndarray, n: np.ndarray, margin: float):
    error = spread / np.sqrt(n)
    return stats.t.sf((margin - np.abs(mean)) / error, n - 1)


def holm(p: np.ndarray) -> np.ndarray:
    """Holm's adjusted p along the last axis, in the order given; NaN stays and does not count.

    Holm 1979, "A simple sequentially rejective multiple test procedure", Scandinavian Journal of
    Statistics 6.
    """
    p = np.asarray(p, float)
    rows = p.reshape(-1, p.shape[-1])
    order = np.argsort(rows, axis=1, kind="stable")  # NaN comes last
    ascending = np.take_along_axis(rows, order, axis=1)
    known = np.isfinite(rows).sum(axis=1, keepdims=True)
    steps = known - np.arange(rows.shape[1])
    adjusted = np.minimum(1, np.maximum.accumulate(ascending * steps, axis=1))
    result = np.empty_like(rows)
    np.put_along_axis(result, order, np.where(np.isnan(ascending), np.nan, adjusted), axis=1)
    return result.reshape(p.shape)


def holm_in_families(table: pd.DataFrame, options: Options, column: str = "p") -> np.ndarray:
    """(rows,) Holm's p of a column of p, over the declared family: all rows of all framings, or
    those of one; the rows of all framings together are a family of their own.
    """
    family = (table.framing == OVERALL) if options.family == "study" else table.framing
    p, adjusted = table[column].to_numpy(float), np.full(len(table), np.nan)
    for one in pd.unique(family):
        members = (family == one).to_numpy()
        adjusted[members] = holm(p[members])
    return adjusted


def declared_p(counts: np.ndarray, options: Options) -> np.ndarray:
    """counts (..., 5) -> p of the declared test, (...)."""
    return {"wilcoxon": signed_rank_counts, "sign": sign_counts}[options.test](counts)


def decided(holm_p: np.ndarray, alpha: float) -> np.ndarray:
    """Whether the declared test finds a difference: Holm's p is at most alpha."""
    return np.asarray(holm_p) <= alpha


def equivalent(
    inside: np.ndarray, tost_p: np.ndarray, tost_holm_p: np.ndarray, alpha: float
) -> np.ndarray:
    """Whether two techniques are called equivalent: the interval at 1 - 2 alpha lies within the
    margin, and both one-sided tests do, alone and after Holm's correction.
    """
    return (
        (np.asarray(inside) == 1)
        & (np.asarray(tost_p) < alpha)
        & (np.asarray(tost_holm_p) <= alpha)
    )


def within(low: np.ndarray, high: np.ndarray, margin: float | None) -> np.ndarray:
    """1.0 where the interval is within +-margin, else 0.0; NaN without a margin or an interval."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    if margin is None:
        return np.full(low.shape, np.nan)[()]
    return np.where(np.isnan(low), np.nan, ((-margin < low) & (high < margin)).astype(float))[()]


def sign_flip(vectors: np.ndarray, options: Options, stream: int) -> tuple[float, float]:
    """vectors (P, m), one a person -> the length of their mean, and p of one as long when each
    person's vector keeps or turns its sign by a fair coin: the test that its mean is 0, for vectors
    symmetric about it. NaN below 5 people.

    stream tells the draws of one test from those of another.
    """
    vectors = vectors[np.isfinite(vectors).all(axis=1)].astype(np.float32)
    people = len(vectors)
    if people < FEWEST_PEOPLE:
        return np.nan, np.nan
    rng = np.random.default_rng([options.seed, stream])
    whole = float((vectors.sum(axis=0) ** 2).sum())
    step, as_long = max(1, (1 << 24) // people), 0
    for start in range(0, options.resamples, step):
        rows = min(step, options.resamples - start)
        signs = 2 * rng.integers(0, 2, (rows, people), dtype=np.int8) - np.int8(1)
        sums = signs.astype(np.float32) @ vectors
        as_long += int(((sums**2).sum(axis=1) >= whole * (1 - 1e-6)).sum())
    return float(np.sqrt(whole) / people), (1 + as_long) / (1 + options.resamples)
