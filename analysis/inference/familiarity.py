"""Whether people's rating of their own familiarity goes with what they prefer."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy import stats

from analysis import bootstrap
from analysis.inference.people import holm_in_families
from analysis.options import FEWEST_PEOPLE, OVERALL, Options
from analysis.panel import Panel, panels, with_notes
from analysis.responses import Responses

#: The power at which `familiarity_interaction` says which correlation would be found.
POWER = 0.8


def familiarity_interaction(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, technique, n, slope, low, high, spearman, p, holm_p, detectable: does the rating of
    one's own familiarity go with what is preferred?

    slope       of a participant's net score for the technique (points for it less points against
                it, an answer, -2 to 2) a level
    spearman    their rank correlation, p by permuting familiarity over people; Holm over the
                techniques of the declared family
    detectable  the correlation that a study of n people finds with a power of 0.8 at this level,
                one test (Fisher's z with the variance 1.06/(n - 3) of Fieller, Hartley and Pearson
                1957); smaller ones were not ruled out
    Where all net scores for a technique are alike there is no correlation and no p. Of a framing
    those count who judged every technique. technique '' tests all techniques of the framing at
    once: the sum of squared rank correlations, by the same permutations
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
        same = np.ptp(y, axis=0) < 1e-9
        if same.any():
            rho[same] = p[same] = np.nan
            together = np.nan if same.all() else together
            items = "every technique" if same.all() else ", ".join(np.array(panel.items)[same])
            notes.append(
                f"{name}: everybody's net score is the same for {items}: no correlation with "
                "familiarity"
            )
        slope, low, high = _slopes(x, y, options)
        smallest = _detectable(len(x), 1 - options.level)
        rows.append((name, "", len(x), np.nan, np.nan, np.nan, np.nan, together, np.nan, smallest))
        rows += [
            (name, item, len(x), slope[k], low[k], high[k], rho[k], p[k], np.nan, smallest)
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
    table = with_notes(rows, columns, notes)
    single = table.assign(p=table.p.where(table.technique != ""))
    table["holm_p"] = holm_in_families(single, options)
    return table


def net_scores(panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    """(P, n) points for less points against each technique, and (P, n) how often it was judged."""
    first, second = (np.eye(len(panel.items))[side] for side in (panel.first, panel.second))
    given = np.where(panel.answered, panel.preference, 0).astype(float)
    return given @ (second - first), panel.answered @ (first + second)


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
