"""Assumptions of a plan from a pilot's answers."""

from __future__ import annotations

import numpy as np
from scipy import optimize, stats

from analysis import worth
from analysis.errors import InputError
from analysis.planning.answering import SIGMA, Answering
from analysis.responses import Responses


def fit_pilot(
    responses: Responses, most: int = 2_000
) -> tuple[dict[str, dict[str, float]], Answering]:
    """Assumptions from a pilot: worths in JOD at each framing and the thresholds, by maximum
    likelihood of the ordered probit P(answer) = Phi(cut - difference) pooled over people, symmetric
    cuts. The taste stays the default: a pilot is too small for it.
    """
    worths, cuts = {}, []
    for framing, items in responses.items.items():
        rows = responses.frame[responses.frame.framing == framing]
        place = {name: at for at, name in enumerate(items)}
        a, b = (rows[side].astype(object).map(place).to_numpy(int) for side in ("a", "b"))
        counts = np.zeros((len(items), len(items), 5))
        np.add.at(counts, (a, b, rows.preference.to_numpy(int) + 2), 1)
        met = counts.sum(axis=2)
        if not worth.strongly_connected((met + met.T)[None])[0]:
            raise InputError(
                f"the pilot at {framing!r} compares its techniques in separate groups; "
                "expected all to be connected"
            )
        fit = _ordered_probit(counts, most)
        won = counts[:, :, :3].sum(axis=2) + counts[:, :, 2:].sum(axis=2).T  # a tie both ways
        if fit is None or not worth.strongly_connected(won[None])[0]:
            raise InputError(
                f"the pilot at {framing!r} has no finite worths: a technique was never or "
                "always preferred, or every answer is 0; "
                "expected more people"
            )
        fitted, slight, clear = fit
        worths[framing] = dict(zip(items, (fitted * SIGMA).tolist(), strict=True))
        cuts.append((slight * SIGMA, clear * SIGMA))
    slight, clear = np.mean(cuts, axis=0)
    return worths, Answering(float(slight), float(clear))


def _ordered_probit(counts: np.ndarray, most: int) -> tuple[np.ndarray, float, float] | None:
    """Worths (n,) centred, and the two cuts, in standard deviations; None where nobody preferred
    anything.

    A kind of answer that nobody gave has its cut at the end of the scale: no 'no difference',
    slight = 0; no clear one, clear = 10.
    """
    n = len(counts)
    i, k = np.nonzero(counts.sum(axis=2))
    about = counts[i, k]
    strong, slight, none = about[:, [0, 4]].sum(), about[:, [1, 3]].sum(), about[:, 2].sum()
    if not strong + slight:
        return None

    def cuts(x: np.ndarray) -> tuple[float, float]:
        first = np.exp(x[n]) if none else 0.0
        step = (np.exp(x[n + 1]) if slight else 0.0) if strong else 10.0
        return first, first + step

    def loss(x: np.ndarray) -> float:
        low, high = cuts(x)
        below = stats.norm.cdf(np.array([-high, -low, low, high]) - (x[k] - x[i])[:, None])
        shares = np.diff(below, axis=1, prepend=0, append=1)
        return (
            -(about * np.log(np.maximum(shares, 1e-300))).sum() + x[:n].sum() ** 2
        )  # the sum is free: 0

    start = np.r_[np.zeros(n), np.log([0.3, 0.9])]
    fit = optimize.minimize(loss, start, method="BFGS", options={"maxiter": most, "gtol": 1e-3})
    return fit.x[:n] - fit.x[:n].mean(), *map(float, cuts(fit.x))
