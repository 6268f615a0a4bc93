"""Whether differences hold for other people: tests on participants, never on single answers;
equivalence; trend; familiarity.

Wilcoxon's signed ranks: zeros are dropped before ranking (Wilcoxon 1945), ties share their mean
rank; to 50 people who saw a difference the p is exact, from all changes of sign of these very
ranks, two-sided as twice the smaller tail; beyond that the normal approximation with the variance
corrected for ties and no continuity correction. Sign test: exact binomial on those who preferred
one of the two. Holm 1979 ("A simple sequentially rejective multiple test procedure", Scandinavian
Journal of Statistics 6) over the declared family. Equivalence: two one-sided t tests (Schuirmann
1987, doi:10.1007/BF01068419) on the mean preference, and the bootstrap interval at 1 - 2 alpha; two
techniques are called equivalent only where both put the difference within the margin. All
differences point the same way: positive is for b.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from analysis import bootstrap, worth
from analysis.codebook import FRAMING
from analysis.options import FEWEST_PEOPLE, OVERALL, Options
from analysis.panel import Panel, by_pair, noted, panels
from analysis.responses import Responses

#: To this number of people who saw a difference the signed-rank test is exact.
EXACT_PEOPLE = 50
#: The power at which `familiarity_interaction` says which correlation would be found.
POWER = 0.8

PAIRS = (
    *("framing", "a", "b", "n", "strong_a", "slight_a", "none", "slight_b", "strong_b"),
    *(
        "wilcoxon_p",
        "sign_p",
        "holm_p",
        "tost_p",
        "wilcoxon_method",
        "mean_preference",
        "low",
        "high",
    ),
    *("equivalence_low", "equivalence_high", "tost_holm_p", "equivalent", "rank_biserial", "dz"),
    *("jod", "jod_low", "jod_high", "jod_equivalent"),
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
                        participants' preferences
    jod                 thurstone_jod worth of b less that of a; its interval at the level;
                        jod_equivalent: 1 where the interval at 1 - 2 alpha is within
                        `Options.margin_jod`

    Below 5 participants, and for a TOST where all preferences are alike, there is no p.
    """
    rows, notes = [], bootstrap.few(responses)
    alpha = 1 - options.level
    for name, panel in panels(responses).items():
        preference = preferences(panel)
        table = by_pair(panel, panel.counts).astype(int)
        means = _mean_draws(preference, options)
        jod, jod_draws = _jod(panel, options)
        for k, (i, j) in enumerate(combinations(range(len(panel.items)), 2)):
            mine = preference[:, k]
            mine = mine[np.isfinite(mine)]
            if not len(mine):
                continue
            pair = f"{name}, {panel.items[i]} against {panel.items[j]}"
            wilcoxon_p, method, rank_biserial = signed_rank(mine)
            sign_p = sign_test(mine)
            low, high = bootstrap.interval(means[:, k], len(mine), options.level)
            inner_low, inner_high = bootstrap.interval(means[:, k], len(mine), 1 - 2 * alpha)
            tost_p = equivalence(mine, options.margin)
            if len(mine) < FEWEST_PEOPLE:
                notes.append(
                    f"{pair}: {len(mine)} participants, no test, which needs {FEWEST_PEOPLE}"
                )
            elif options.margin is not None and np.isnan(tost_p):
                notes.append(
                    f"{pair}: all {len(mine)} preferences are alike, no test of equivalence"
                )
            difference, draws = jod[j] - jod[i], jod_draws[:, j] - jod_draws[:, i]
            jod_low, jod_high = bootstrap.interval(draws, panel.people, options.level)
            spread = mine.std(ddof=1) if len(mine) > 1 else 0.0
            if np.isnan(difference):
                jod_low = jod_high = jod_equivalent = np.nan
            else:
                jod_equivalent = _inside(
                    *bootstrap.interval(draws, panel.people, 1 - 2 * alpha), options.margin_jod
                )
            within = _inside(inner_low, inner_high, options.margin)
            rows.append(
                (name, panel.items[i], panel.items[j], len(mine), *table[k])
                + (
                    wilcoxon_p,
                    sign_p,
                    np.nan,
                    tost_p,
                    method,
                    mine.mean(),
                    low,
                    high,
                    inner_low,
                    inner_high,
                    np.nan,
                )
                + (within if np.isnan(within) else float(within and tost_p < alpha), rank_biserial)
                + (
                    mine.mean() / spread if spread > 0 else np.nan,
                    difference,
                    jod_low,
                    jod_high,
                    jod_equivalent,
                )
            )
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
        f"holm_p is Holm's over {scope}, of the {options.test} test; 'overall' is a family of "
        "its own"
    )
    table = noted(rows, PAIRS, notes)
    family = (table.framing == OVERALL) if options.family == "study" else table.framing
    for one in pd.unique(family):
        members = family == one
        table.loc[members, "holm_p"] = holm(table.loc[members, f"{options.test}_p"].to_numpy())
        table.loc[members, "tost_holm_p"] = holm(table.loc[members, "tost_p"].to_numpy())
    return table


def alpha_of(options: Options) -> float:
    """The level of a test that goes with the level of the intervals: 0.05 with 95 %."""
    return round(1 - options.level, 10)


def verdict(row: object, alpha: float) -> str:
    """What a row of `pairs` comes to: 'different', 'equivalent', 'both' or 'undecided'; both tests
    are taken after Holm's correction.

    Equivalent: within the margin by the interval (`equivalent`) and by both one-sided tests. Where
    a margin was declared in JOD alone there is no such test, and the interval decides.
    """
    differs = row.holm_p <= alpha
    if np.isfinite(row.equivalent):
        equal = row.equivalent == 1 and row.tost_holm_p <= alpha
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


def signed_rank(values: np.ndarray) -> tuple[float, str, float]:
    """Wilcoxon's test that values are symmetric about 0: p, 'exact' or 'normal', and the
    rank-biserial correlation, -1 to 1.

    p is NaN below 5 values; 1 where all are 0.
    """
    values = np.asarray(values, float)
    seen = values[values != 0]
    if not len(seen):
        return (1.0 if len(values) >= FEWEST_PEOPLE else np.nan), "exact", 0.0
    ranks = stats.rankdata(np.abs(np.round(seen, 9)))
    up, total = ranks[seen > 0].sum(), ranks.sum()
    biserial = float(2 * up / total - 1)
    method = "exact" if len(seen) <= EXACT_PEOPLE else "normal"
    if len(values) < FEWEST_PEOPLE:
        return np.nan, method, biserial
    if method == "exact":
        doubled = np.rint(2 * ranks).astype(int)
        chance = np.zeros(doubled.sum() + 1)
        chance[0] = 1.0
        for rank in doubled:  # the sum of the ranks that got a plus, each by a fair coin
            chance[rank:] = (chance[rank:] + chance[: len(chance) - rank]) / 2
            chance[:rank] /= 2
        at = round(2 * up)
        return float(min(1.0, 2 * min(chance[: at + 1].sum(), chance[at:].sum()))), method, biserial
    spread = np.sqrt((ranks**2).sum() / 4)  # the variance with ties in it
    return float(2 * stats.norm.sf(abs(up - total / 2) / spread)), method, biserial


def sign_test(values: np.ndarray) -> float:
    """Two-sided exact binomial p of as many values above as below 0, zeros left out; NaN below 5
    values, 1 where all are 0.
    """
    values = np.asarray(values)
    up, down = int((values > 0).sum()), int((values < 0).sum())
    if len(values) < FEWEST_PEOPLE:
        return np.nan
    return float(min(1.0, 2 * stats.binom.cdf(min(up, down), up + down, 0.5))) if up + down else 1.0


def equivalence(values: np.ndarray, margin: float | None) -> float:
    """p of two one-sided t tests that the mean is within +-margin; NaN without a margin, below 5
    values, or where all are alike.
    """
    values = np.asarray(values, float)
    if margin is None or len(values) < FEWEST_PEOPLE or values.std() == 0:
        return np.nan
    error = values.std(ddof=1) / np.sqrt(len(values))
    above, below = (values.mean() + margin) / error, (margin - values.mean()) / error
    return float(stats.t.sf(min(above, below), len(values) - 1))


def holm(p: np.ndarray) -> np.ndarray:
    """Holm's adjusted p, in the order given; NaN stays and does not count."""
    p = np.asarray(p, float)
    known = np.flatnonzero(np.isfinite(p))
    order = known[np.argsort(p[known], kind="stable")]
    adjusted = np.full(len(p), np.nan)
    adjusted[order] = np.minimum(1, np.maximum.accumulate(p[order] * np.arange(len(order), 0, -1)))
    return adjusted


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
        return noted([], columns, [f"{responses.codebook.levels} are no distances: no trend"])
    here = list(panels(responses, overall=False).values())
    if len(here) < 3:
        return noted([], columns, [f"{len(here)} framings: a trend over distance needs 3"])
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
        return noted(rows, columns, notes)
    low, high = bootstrap.interval(
        bootstrap.totals(slopes, options) / len(slopes), len(slopes), options.level
    )
    rows.append(("slope_strength", slopes.mean(), low, high, signed_rank(slopes)[0]))
    page = stats.page_trend_test(
        strength, predicted_ranks=np.arange(len(here), 0, -1), method="asymptotic"
    )
    rows.append(("page_l", page.statistic, np.nan, np.nan, page.pvalue))
    return noted(rows, columns, notes)


def familiarity_interaction(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, technique, n, slope, low, high, spearman, p, holm_p, detectable: does the rating of
    one's own familiarity go with what is preferred?

    slope       of a participant's net score for the technique (points for it less points against
                it, an answer, -2 to 2) a level
    spearman    their rank correlation, p by permuting familiarity over people; Holm over the
                techniques of a framing
    detectable  the correlation that a study of n people finds with a power of 0.8 at this level,
                one test (Fisher's z with the variance 1.06/(n - 3) of Fieller, Hartley and Pearson
                1957); smaller ones were not ruled out
    Of a framing those count who judged every technique. technique '' tests all techniques of the
    framing at once: the sum of squared rank correlations, by the same permutations
    """
    columns = [
        "framing",
        "technique",
        "n",
        "slope",
        "low",
        "high",
        "spearman",
        "p",
        "holm_p",
        "detectable",
    ]
    rows, notes = [], []
    rng = np.random.default_rng([options.seed, 1])
    for name, panel in panels(responses).items():
        net, asked = net_scores(panel)
        rating = responses.ratings.reindex(panel.participants).to_numpy(float)
        here = (asked > 0).all(axis=1) & np.isfinite(rating)
        x = rating[here]
        if here.sum() < FEWEST_PEOPLE or x.std() == 0:
            alike = f"all rated their familiarity {x[0]:.0f}" if here.sum() >= FEWEST_PEOPLE else ""
            few = (
                f"{here.sum()} participants rated themselves and judged every technique, expected "
                f"{FEWEST_PEOPLE}"
            )
            notes.append(f"{name}: {alike or few}: nothing can be said of familiarity")
            continue
        y = net[here] / asked[here]
        ranks = _standard(stats.rankdata(y, axis=0))
        levels = _standard(stats.rankdata(x))
        rho = levels @ ranks / len(x)
        null = np.stack([rng.permutation(levels) @ ranks for _ in range(options.resamples)]) / len(
            x
        )
        p = (1 + (np.abs(null) >= np.abs(rho) - 1e-9).sum(axis=0)) / (1 + options.resamples)
        together = (1 + ((null**2).sum(axis=1) >= (rho**2).sum() - 1e-9).sum()) / (
            1 + options.resamples
        )
        slope, low, high = _slopes(x, y, options)
        found = _detectable(len(x), 1 - options.level)
        rows.append((name, "", len(x), np.nan, np.nan, np.nan, np.nan, together, np.nan, found))
        adjusted = holm(p)
        rows += [
            (name, item, len(x), slope[k], low[k], high[k], rho[k], p[k], adjusted[k], found)
            for k, item in enumerate(panel.items)
        ]
        if name == OVERALL or len(panels(responses)) == 1:
            notes.append(
                f"with {len(x)} participants a correlation of 0.3 with familiarity is found "
                "with a probability of "
                f"{_power(0.3, len(x), 1 - options.level):.2f}, one of 0.5 with "
                f"{_power(0.5, len(x), 1 - options.level):.2f}; "
                f"what is missing a small p is not shown to be absent"
            )
    return noted(rows, columns, notes)


def net_scores(panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    """(P, n) points for less points against each technique, and (P, n) how often it was judged."""
    first, second = (np.eye(len(panel.items))[side] for side in (panel.first, panel.second))
    given = np.where(panel.answered, panel.preference, 0).astype(float)
    return given @ (second - first), panel.answered @ (first + second)


def _mean_draws(preference: np.ndarray, options: Options) -> np.ndarray:
    """(resamples, pairs): mean preference in each resample; NaN where nobody drawn had answered."""
    known = np.isfinite(preference)
    sums = bootstrap.totals(np.stack([np.where(known, preference, 0), known], axis=2), options)
    return np.divide(
        sums[..., 0], sums[..., 1], out=np.full(sums.shape[:2], np.nan), where=sums[..., 1] > 0
    )


def _jod(panel: Panel, options: Options) -> tuple[np.ndarray, np.ndarray]:
    return worth.estimated(panel, "thurstone_jod", options), worth.bootstrapped(
        panel, "thurstone_jod", options
    )


def _inside(low: float, high: float, margin: float | None) -> float:
    """1.0 where the interval is within +-margin, else 0.0; NaN without a margin or an interval."""
    return np.nan if margin is None or np.isnan(low) else float(-margin < low and high < margin)


def _standard(values: np.ndarray) -> np.ndarray:
    """Columns with mean 0 and standard deviation 1; zeros where a column does not vary."""
    centred = values - values.mean(axis=0)
    spread = centred.std(axis=0)
    return np.divide(centred, spread, out=np.zeros_like(centred), where=spread > 0)


def _slopes(
    x: np.ndarray, y: np.ndarray, options: Options
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Least-squares slopes of the columns of y on x, with intervals."""
    x = x - x.mean()
    columns = np.column_stack([np.ones_like(x), x, x * x, y, x[:, None] * y])
    sums = np.vstack([columns.sum(axis=0), bootstrap.totals(columns, options)])
    n, sx, sxx, sy, sxy = (
        sums[:, :1],
        sums[:, 1:2],
        sums[:, 2:3],
        sums[:, 3 : 3 + y.shape[1]],
        sums[:, 3 + y.shape[1] :],
    )
    spread = sxx - sx**2 / n
    slopes = np.divide(
        sxy - sx * sy / n, spread, out=np.full(sy.shape, np.nan), where=spread > 1e-9
    )
    return slopes[0], *bootstrap.interval(slopes[1:], len(x), options.level)


def _detectable(n: int, alpha: float) -> float:
    return float(
        np.tanh((stats.norm.ppf(1 - alpha / 2) + stats.norm.ppf(POWER)) * np.sqrt(1.06 / (n - 3)))
    )


def _power(rho: float, n: int, alpha: float) -> float:
    shift = np.arctanh(rho) / np.sqrt(1.06 / (n - 3))
    critical = stats.norm.ppf(1 - alpha / 2)
    return float(stats.norm.sf(critical - shift) + stats.norm.cdf(-critical - shift))
