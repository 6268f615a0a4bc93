"""Davidson's model, in which 'no difference' is an outcome of its own, for many tables at once;
with a side effect for one.

P(i) : P(j) : P(no difference) = pi_i : pi_j : nu sqrt(pi_i pi_j), w = log pi. Davidson 1970, JASA
65(329), doi:10.1080/01621459.1970.10481082. With a side (Davidson and Beaver 1977, Biometrics
33(4), doi:10.2307/2529467) the left image's pi is multiplied by gamma.

The model is an exponential family, so that bias is reduced by Jeffreys' prior (Firth 1993,
doi:10.1093/biomet/80.1.27): to the score is added half the trace of I^-1 dI/dtheta, of which dI is
the third cumulant of the three outcomes.
"""

from __future__ import annotations

import numpy as np
from scipy import optimize, special

from analysis.worth.binary import (
    ITERATIONS,
    SCORING_ITERATIONS,
    SCORING_STEP,
    STEP,
    blind_filled,
    bradley_terry,
    climbed,
    connected,
    covariance,
    differences,
    solved,
)

#: What each outcome (i preferred, j preferred, no difference) takes of d = w_i - w_j and of log nu.
FEATURES = np.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 1.0]])


def davidson(
    wins: np.ndarray, ties: np.ndarray, reduced_bias: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """wins and symmetric ties (..., n, n) -> worths (..., n), sum 0, and log nu (...); without ties
    Bradley-Terry and -inf.

    NaN where there is no finite maximum; with `reduced_bias` only where techniques were never
    compared, not even through others, or no answer prefers one.
    """
    wins, ties = np.asarray(wins, float), np.asarray(ties, float)
    shape, n = wins.shape[:-1], wins.shape[-1]
    wins, ties = wins.reshape(-1, n, n), ties.reshape(-1, n, n)
    i, j = np.triu_indices(n, 1)
    over, under, level = wins[:, i, j], wins[:, j, i], ties[:, i, j]
    worth, log_nu = np.full((len(wins), n), np.nan), np.full(len(wins), np.nan)
    without = level.sum(axis=1) == 0
    if without.any():
        worth[without] = bradley_terry(wins[without], reduced_bias)
        log_nu[without & np.isfinite(worth[:, 0])] = -np.inf
    met = wins + ties
    met = met + np.swapaxes(met, 1, 2) if reduced_bias else met
    exists = ~without & connected(met) & ((over + under).sum(axis=1) > 0)
    if n > 1 and exists.any():
        counts = tuple(one[exists] for one in (over, under, level))
        worth[exists], log_nu[exists] = _climb(differences(n), counts, reduced_bias)
    return worth.reshape(shape), log_nu.reshape(shape[:-1])


def _climb(
    x: np.ndarray, counts: tuple[np.ndarray, ...], reduced_bias: bool
) -> tuple[np.ndarray, np.ndarray]:
    """x (K, n); counts: how often i was preferred, j, neither, (R, K) each -> worths (R, n) and log
    nu (R,).
    """
    n = x.shape[1]
    outer = (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)

    def step(theta: np.ndarray, over, under, level) -> np.ndarray:
        m = over + under + level
        p = _outcomes(theta[:, :n] @ x.T, theta[:, n:])
        lean, tie = (p[0] - p[1]) / 2, p[2]
        score = (over - under) / 2 - m * lean, level - m * tie
        information = _information(x, outer, m, lean, tie)
        if reduced_bias:
            added = _third_cumulants(x, information, m, np.stack(p, axis=-1))
            score = score[0] + added[..., 0], score[1] + added[..., 1]
        slope = np.concatenate([score[0] @ x, score[1].sum(axis=1)[:, None]], axis=1)
        return solved(information, slope)

    def start(over, under, level) -> np.ndarray:
        theta = np.zeros((len(over), n + 1))
        theta[:, n] = np.log(2 * level.sum(axis=1) / (over + under).sum(axis=1))
        return theta

    least, most = (SCORING_STEP, SCORING_ITERATIONS) if reduced_bias else (STEP, ITERATIONS)
    theta = climbed(start, step, counts, least, most)
    return theta[:, :n] - theta[:, :n].mean(axis=1, keepdims=True), theta[:, n]


def _outcomes(d: np.ndarray, log_nu: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The probabilities of i, of j and of no difference. d is within twice `FARTHEST`, so that
    nothing overflows.
    """
    up, nu = np.exp(d / 2), np.exp(log_nu)  # divided by sqrt(pi_i pi_j) they weigh up, 1/up, nu
    down = 1 / up
    total = up + down + nu
    return up / total, down / total, nu / total


def _information(
    x: np.ndarray, outer: np.ndarray, m: np.ndarray, lean: np.ndarray, tie: np.ndarray
) -> np.ndarray:
    """(r, n + 1, n + 1): the covariance of the outcomes' features, over all pairs; lean and tie
    (r, K) are their means.
    """
    n = x.shape[1]
    information = np.empty((len(m), n + 1, n + 1))
    information[:, :n, :n] = ((m * ((1 - tie) / 4 - lean**2)) @ outer).reshape(-1, n, n)
    information[:, :n, n] = information[:, n, :n] = -(m * lean * tie) @ x
    information[:, n, n] = (m * tie * (1 - tie)).sum(axis=1)
    return blind_filled(information, n)


def davidson_covariance(wins: np.ndarray, ties: np.ndarray, reduced_bias: bool) -> np.ndarray:
    """wins and ties (n, n) -> (n, n): the inverse information of centred worths, with log nu
    estimated beside them; answers taken as independent.
    """
    wins, ties = np.asarray(wins, float), np.asarray(ties, float)
    if not ties.any():
        return covariance(wins, "bradley_terry", reduced_bias)
    n = len(wins)
    i, j = np.triu_indices(n, 1)
    worth, log_nu = davidson(wins, ties, reduced_bias)
    if not np.isfinite(worth).all():
        return np.full((n, n), np.nan)
    x = differences(n)
    p = _outcomes(x @ worth, log_nu)
    total = (wins[i, j] + wins[j, i] + ties[i, j])[None]
    outer = (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)
    information = _information(x, outer, total, (p[0] - p[1])[None] / 2, p[2][None])[0]
    centred = np.eye(n) - 1 / n
    return centred @ np.linalg.inv(information)[:n, :n] @ centred


def _third_cumulants(
    x: np.ndarray, information: np.ndarray, m: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """(r, K, 2): what Jeffreys' prior adds to the score of each pair's features."""
    places = np.zeros((len(x), 2, x.shape[1] + 1))  # theta -> (d, log nu) of each pair
    places[:, 0, :-1], places[:, 1, -1] = x, 1
    inverse = np.linalg.inv(information)
    spread = np.einsum("kai,rij,kbj->rkab", places, inverse, places, optimize=True)
    away = FEATURES - (p @ FEATURES)[..., None, :]  # (r, K, 3, 2)
    size = np.einsum("rkoa,rkab,rkob->rko", away, spread, away, optimize=True)
    return 0.5 * m[..., None] * np.einsum("rko,rkoc->rkc", p * size, away)


def davidson_sides(counts: np.ndarray) -> tuple[np.ndarray, float, float]:
    """counts (n, n, 3): with i on the left and j on the right, how often left was preferred, right,
    neither -> worths (n,), sum 0, log nu, and the side log gamma (positive favours the left).

    By maximum likelihood; NaN where no finite maximum is found. Without ties log nu is -inf and the
    model is Bradley-Terry with a side.
    """
    counts = np.asarray(counts, float)
    n = len(counts)
    i, j = np.nonzero(counts.sum(axis=2))
    seen, ties = counts[i, j], bool(counts[..., 2].any())
    basis = np.linalg.svd(np.eye(n) - 1 / n)[0][:, : n - 1]
    x = (np.eye(n)[i] - np.eye(n)[j]) @ basis

    def loss(theta: np.ndarray) -> tuple[float, np.ndarray]:
        d = x @ theta[: n - 1] + theta[n - 1]
        level = np.full_like(d, theta[n] if ties else -np.inf)
        log_p = special.log_softmax(np.stack([d / 2, -d / 2, level], axis=-1), axis=-1)
        score = seen @ FEATURES - seen.sum(axis=1)[:, None] * (np.exp(log_p) @ FEATURES)
        slope = [*(score[:, 0] @ x), score[:, 0].sum(), *([score[:, 1].sum()] if ties else [])]
        return -float((seen * np.where(seen > 0, log_p, 0)).sum()), -np.array(slope)

    start = np.zeros(n + ties)
    best = optimize.minimize(loss, start, jac=True, method="BFGS", options={"gtol": 1e-8})
    flat = np.abs(best.jac).max() < 1e-4 * max(1.0, seen.sum())
    if not flat or np.abs(best.x).max() > 15:
        return np.full(n, np.nan), np.nan, np.nan
    return basis @ best.x[: n - 1], float(best.x[n]) if ties else -np.inf, float(best.x[n - 1])
