"""Every pair of a framing: what was answered, the tests, intervals alone and together, and what the
pair comes to.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from analysis import bootstrap, worth
from analysis.inference.people import (
    alpha_of,
    decided,
    equivalence,
    equivalent,
    holm_in_families,
    sign_test,
    signed_rank,
    within,
)
from analysis.options import FEWEST_PEOPLE, OVERALL, Options
from analysis.panel import Panel, by_pair, panels, with_notes
from analysis.responses import Responses

PAIRS = (
    *("framing", "a", "b", "n", "strong_a", "slight_a", "none", "slight_b", "strong_b"),
    *("wilcoxon_p", "sign_p", "holm_p", "tost_p", "wilcoxon_method"),
    *("mean_preference", "low", "high"),
    *("equivalence_low", "equivalence_high", "tost_holm_p", "equivalent", "rank_biserial", "dz"),
    *("jod", "jod_low", "jod_high", "jod_equivalent"),
    *("simultaneous_low", "simultaneous_high", "jod_simultaneous_low", "jod_simultaneous_high"),
    *("rank_biserial_low", "rank_biserial_high", "dz_low", "dz_high"),
)


def pairs(responses: Responses, options: Options) -> pd.DataFrame:
    """One row a pair and framing, and 'overall', where a participant's preference is their mean
    over framings; see `PAIRS`.

    n                   participants who answered; strong_a ... strong_b count answers
    holm_p              of the declared test (`Options.test`) over the declared family
                        (`Options.family`); 'overall' is its own family
    tost_p, tost_holm_p equivalence within `Options.margin`; empty without a margin
    mean_preference     -2 to 2, with its bootstrap interval at the level, and at 1 - 2 alpha for
                        equivalence
    equivalent          1 where tost_p < alpha and the interval at 1 - 2 alpha is within the margin,
                        else 0; empty without a margin
    rank_biserial       -1 to 1, matched pairs (Kerby 2014); dz: mean over standard deviation of
                        participants' preferences; with bootstrap intervals
    jod                 thurstone_jod worth of b less that of a; its interval at the level;
                        jod_equivalent: 1 where the interval at 1 - 2 alpha is within
                        `Options.margin_jod`
    simultaneous_low, simultaneous_high, jod_simultaneous_low, jod_simultaneous_high
                        intervals that hold together, over the declared family, at the level; see
                        `simultaneous`

    Below 5 participants, and for a TOST where all preferences are alike, there is no p.
    """
    rows, notes, draws = [], bootstrap.few(responses), []
    for name, panel in panels(responses).items():
        part, remarks, drawn = _of_panel(name, panel, options)
        rows += part
        notes += remarks
        draws.append(drawn)
    if options.margin is None:
        notes.append(
            "no margin of equivalence was declared: no two techniques are called equivalent"
        )
    codebook = responses.codebook
    scope = (
        f"all pairs of all {codebook.levels}"
        if options.family == "study"
        else f"the pairs of a {codebook.level}"
    )
    notes.append(
        f"holm_p is Holm's over {scope}, of the {options.test} test; all {codebook.levels} taken "
        "together are a family of their own"
    )
    table = with_notes(rows, PAIRS, notes)
    table["holm_p"] = holm_in_families(table, options, f"{options.test}_p")
    table["tost_holm_p"] = holm_in_families(table, options, "tost_p")
    family = (table.framing == OVERALL) if options.family == "study" else table.framing
    for one in pd.unique(family):
        members = family == one
        for value, bounds, kind in (
            ("mean_preference", "simultaneous", "mean"),
            ("jod", "jod_simultaneous", "jod"),
        ):
            chosen = np.flatnonzero(members)
            parts = [getattr(drawn, kind) for drawn in draws]
            low, high = simultaneous(
                table.loc[members, value].to_numpy(float),
                np.concatenate([part.draws for part in parts], axis=1)[:, chosen],
                np.concatenate([part.least_error for part in parts])[chosen],
                np.concatenate([part.people for part in parts])[chosen],
                options.level,
            )
            table.loc[members, f"{bounds}_low"] = low
            table.loc[members, f"{bounds}_high"] = high
    return table


@dataclass(frozen=True)
class Drawn:
    """Resamples of what a panel's rows estimate: draws (resamples, rows), the least standard error
    that each may have (rows,), and of how many people each is (rows,).
    """

    draws: np.ndarray
    least_error: np.ndarray
    people: np.ndarray


@dataclass(frozen=True)
class _Draws:
    mean: Drawn
    jod: Drawn


def _of_panel(name: str, panel: Panel, options: Options) -> tuple[list[tuple], list[str], _Draws]:
    """The rows of one panel, notes, and the resamples that simultaneous intervals are made of."""
    alpha, notes, rows = alpha_of(options), [], []
    preference = preferences(panel)
    table = by_pair(panel, panel.counts).astype(int)
    mean, dz = _mean_draws(preference, options)
    jod = worth.estimated(panel, "thurstone_jod", options)
    jod_draws = worth.bootstrapped(panel, "thurstone_jod", options)
    covariance = worth.wald_covariance(panel, "thurstone_jod", options)
    kept = []
    for k, (i, j) in enumerate(combinations(range(len(panel.items)), 2)):
        mine = preference[:, k]
        mine = mine[np.isfinite(mine)]
        if not len(mine):
            continue
        pair = f"{name}, {panel.items[i]} against {panel.items[j]}"
        wilcoxon_p, method, rank_biserial = signed_rank(mine)
        low, high = bootstrap.interval(mean[:, k], len(mine), options.level)
        inner = bootstrap.interval(mean[:, k], len(mine), 1 - 2 * alpha)
        tost_p = equivalence(mine, options.margin)
        if len(mine) < FEWEST_PEOPLE:
            notes.append(f"{pair}: {len(mine)} participants, no test, which needs {FEWEST_PEOPLE}")
        elif options.margin is not None and np.isnan(tost_p):
            notes.append(f"{pair}: all {len(mine)} preferences are alike, no test of equivalence")
        inside = within(*inner, options.margin)
        equal = np.nan if options.margin is None else float(inside == 1 and tost_p < alpha)
        spread = mine.std(ddof=1) if len(mine) > 1 else 0.0
        difference, drawn = jod[j] - jod[i], jod_draws[:, j] - jod_draws[:, i]
        error = 0.0
        if covariance is not None:
            error = float(np.sqrt(covariance[i, i] + covariance[j, j] - 2 * covariance[i, j]))
        bounds = [
            worth.widened(*bootstrap.interval(drawn, panel.people, level), difference, error, level)
            for level in (options.level, 1 - 2 * alpha)
        ]
        if np.isnan(difference):
            bounds = [(np.nan, np.nan)] * 2
        kept.append((k, i, j, error, len(mine)))
        rows.append(
            (name, panel.items[i], panel.items[j], len(mine), *table[k])
            + (wilcoxon_p, sign_test(mine), np.nan, tost_p, method, mine.mean(), low, high)
            + (*inner, np.nan, equal, rank_biserial)
            + (mine.mean() / spread if spread > 0 else np.nan,)
            + (difference, *bounds[0], within(*bounds[1], options.margin_jod))
            + (np.nan,) * 4
            + _effect_intervals(mine, dz[:, k], preference[:, k], options)
        )
    places = np.array([one[0] for one in kept], int)
    first, second = (np.array([one[at] for one in kept], int) for at in (1, 2))
    people = np.array([one[4] for one in kept], int)
    return (
        rows,
        notes,
        _Draws(
            Drawn(mean[:, places], np.zeros(len(places)), people),
            Drawn(
                jod_draws[:, second] - jod_draws[:, first],
                np.array([one[3] for one in kept], float),
                np.full(len(places), panel.people),
            ),
        ),
    )


def simultaneous(
    value: np.ndarray,
    draws: np.ndarray,
    least_error: np.ndarray,
    people: np.ndarray,
    level: float,
) -> tuple[np.ndarray, np.ndarray]:
    """value (m,), its resamples draws (R, m) -> low, high (m,): intervals that hold all m values at
    once as often as `level`.

    By the largest studentised deviation over the resamples (Westfall and Young 1993,
    "Resampling-based multiple testing", section 2.5): the marginal level at which that many
    standard errors hold all deviations together is found from the draws, and each interval takes
    Student's t at that level, for its number of people. least_error: what the standard error is at
    least. NaN below 5 people, and where a value does not vary.
    """
    finite = np.isfinite(draws)
    with np.errstate(invalid="ignore"):
        middle = np.where(finite, draws, 0).sum(axis=0) / np.maximum(finite.sum(axis=0), 1)
        error = np.sqrt(
            (np.where(finite, draws - middle, 0) ** 2).sum(axis=0)
            / np.maximum(finite.sum(axis=0) - 1, 1)
        )
    error = np.maximum(error * np.sqrt(people / np.maximum(people - 1, 1)), least_error)
    usable = (
        np.isfinite(value)
        & (error > 1e-12)
        & (people >= FEWEST_PEOPLE)
        & (finite.mean(axis=0) >= bootstrap.LEAST_SHARE)
    )
    low, high = np.full(len(value), np.nan), np.full(len(value), np.nan)
    if not usable.any():
        return low, high
    deviation = np.abs(np.where(finite, draws - middle, 0))[:, usable] / error[usable]
    critical = np.quantile(deviation.max(axis=1), level)
    tail = stats.norm.sf(critical)
    half = stats.t.isf(tail, people[usable] - 1) * error[usable]
    low[usable], high[usable] = value[usable] - half, value[usable] + half
    return low, high


def verdict(row: object, alpha: float) -> str:
    """What a row of `pairs` comes to: 'different', 'equivalent', 'both' or 'undecided'; both tests
    are taken after Holm's correction.

    Equivalent: within the margin by the interval (`equivalent`) and by both one-sided tests. Where
    a margin was declared in JOD alone there is no such test, and the interval that holds together
    with those of the whole family decides.
    """
    differs = bool(decided(row.holm_p, alpha))
    if np.isfinite(row.equivalent):
        equal = bool(equivalent(row.equivalent, row.tost_p, row.tost_holm_p, alpha))
    else:
        equal = row.jod_equivalent == 1
    if differs and equal:
        return "both"
    return "different" if differs else "equivalent" if equal else "undecided"


def preferences(panel: Panel) -> np.ndarray:
    """(P, n (n - 1)/2): each participant's preference about each pair, -2 to 2, the mean where
    asked at several framings, else NaN.
    """
    n = len(panel.items)
    rank = np.zeros((n, n), int)
    rank[np.triu_indices(n, 1)] = range(n * (n - 1) // 2)
    places = np.zeros((len(panel.first), n * (n - 1) // 2), np.float32)
    places[np.arange(len(panel.first)), rank[panel.first, panel.second]] = 1
    asked = panel.answered.astype(np.float32) @ places
    given = np.where(panel.answered, panel.preference, 0).astype(np.float32) @ places
    return np.divide(given, asked, out=np.full(given.shape, np.nan), where=asked > 0, dtype=float)


def _mean_draws(preference: np.ndarray, options: Options) -> tuple[np.ndarray, np.ndarray]:
    """(resamples, pairs) each: mean preference and its ratio to the standard deviation in each
    resample; NaN where nobody drawn had answered, or all alike.
    """
    known = np.isfinite(preference)
    given = np.where(known, preference, 0)
    sums = bootstrap.totals(np.stack([given, given**2, known], axis=2), options)
    total, squares, n = sums[..., 0], sums[..., 1], sums[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(n > 0, total / n, np.nan)
        variance = np.clip(squares - n * mean**2, 0, None) / (n - 1)
        return mean, np.where(variance > 1e-9, mean / np.sqrt(variance), np.nan)


def _effect_intervals(
    mine: np.ndarray, dz: np.ndarray, column: np.ndarray, options: Options
) -> tuple[float, float, float, float]:
    """The intervals of rank_biserial and dz of one pair."""
    biserial = bootstrap.interval(_biserial_draws(column, options), len(mine), options.level)
    return (*biserial, *bootstrap.interval(dz, len(mine), options.level))


def _biserial_draws(column: np.ndarray, options: Options) -> np.ndarray:
    """(resamples,): the rank-biserial correlation of one pair in each resample, from how many of
    each strength were drawn; 0 where nobody drawn saw a difference.
    """
    size = np.abs(np.round(np.where(np.isfinite(column), column, 0), 9))
    levels = np.unique(size[size > 0])
    if not len(levels):
        return np.zeros(options.resamples)
    at_level = size[:, None] == levels
    above = at_level & (column > 0)[:, None]
    drawn = bootstrap.totals(np.concatenate([at_level, above], axis=1), options)
    count, up = drawn[:, : len(levels)], drawn[:, len(levels) :]
    rank = np.cumsum(count, axis=1) - (count - 1) / 2  # mean ranks
    total = (count * rank).sum(axis=1)
    return (
        np.divide(2 * (up * rank).sum(axis=1), total, out=np.ones(len(total)), where=total > 0) - 1
    )
