"""Bradley-Terry and Thurstone's case V: which of two was preferred, by a link on the difference of
their worths, for many tables of wins at once.

Maximum likelihood by Newton's method. Where it has no finite maximum (a technique, or a group, that
never wins or never loses), or by choice, mean bias reduction: Firth 1993, Biometrika 80(1),
doi:10.1093/biomet/80.1.27; for a generalised linear model with any link Kosmidis and Firth 2009,
Biometrika 96(4), doi:10.1093/biomet/asp055: to the score of pair k is added h_k f'(d_k)/(2 f(d_k)),
with h_k its leverage and f the density of the link. For the logit link this maximises the
likelihood penalised by Jeffreys' prior. It is finite as soon as every technique is reached from
every other one through answers of any kind.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import special, stats

#: Standard deviation of a difference in JOD: Phi(1 / JOD_SIGMA) = 0.75.
JOD_SIGMA = 1 / stats.norm.ppf(0.75)
#: Newton's method stops after a step below the first, since what is left then is about its square
#: (1e-12), and gives up after so many or where a worth passes the last (logits, probits);
#: a slope at the last is still far above rounding, so that no flight to infinity is taken for an
#: end.
STEP, ITERATIONS, FARTHEST = 1e-6, 60, 20.0
#: Fisher scoring with an adjusted score converges linearly and takes more steps.
SCORING_STEP, SCORING_ITERATIONS = 1e-8, 300
#: Added to the diagonal of an information, as a share of its mean, so that one that runs flat can
#: be solved.
RIDGE = 1e-11


@dataclass(frozen=True)
class Link:
    """P(i over j) = F(d), d = w_i - w_j in units of `scale`.

    observed      d, wins of i, wins of j -> slope and curvature of the log-likelihood in d
    information   d -> expected information of one answer about d, f^2/(F (1 - F))
    bend          d -> f'/f, by which bias is reduced
    """

    scale: float
    observed: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    information: Callable[[np.ndarray], np.ndarray]
    bend: Callable[[np.ndarray], np.ndarray]


def _logit(d: np.ndarray, over: np.ndarray, under: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    p = special.expit(d)
    n = over + under
    return over - n * p, n * p * (1 - p)


def _logit_information(d: np.ndarray) -> np.ndarray:
    p = special.expit(d)
    return p * (1 - p)


def _inverse_mills(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """f/F and f/(1 - F) of the normal distribution."""
    density = np.exp(-0.5 * d * d) / np.sqrt(2 * np.pi)
    return tuple(density / np.maximum(special.ndtr(side), 1e-300) for side in (d, -d))


def _probit(d: np.ndarray, over: np.ndarray, under: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    up, down = _inverse_mills(d)
    return over * up - under * down, over * up * (up + d) + under * down * (down - d)


def _probit_information(d: np.ndarray) -> np.ndarray:
    up, down = _inverse_mills(d)
    return up * down


LOGIT = Link(1.0, _logit, _logit_information, lambda d: 1 - 2 * special.expit(d))
PROBIT = Link(JOD_SIGMA, _probit, _probit_information, lambda d: -d)


def bradley_terry(wins: np.ndarray, reduced_bias: bool = False) -> np.ndarray:
    """wins (..., n, n), how often i was preferred to j -> (..., n) worths in logits, sum 0.

    NaN where there is no finite maximum; with `reduced_bias` only where techniques were never
    compared, not even through others. Half wins are allowed.
    """
    return _fit(wins, LOGIT, reduced_bias)


def thurstone_jod(wins: np.ndarray, reduced_bias: bool = False) -> np.ndarray:
    """wins (..., n, n), how often i was preferred to j -> (..., n) worths in JOD, sum 0.

    NaN as in `bradley_terry`.
    """
    return _fit(wins, PROBIT, reduced_bias)


def standard_errors(
    wins: np.ndarray, model: str = "bradley_terry", reduced_bias: bool = False
) -> np.ndarray:
    """wins (n, n) -> (n,): standard errors of centred worths, in the unit of the model, from the
    expected information at the fit; NaN where there is none.

    They take every answer for independent, which answers of one person are not: `worth.worths`
    resamples participants instead.
    """
    return np.sqrt(np.diag(covariance(wins, model, reduced_bias)))


def covariance(wins: np.ndarray, model: str, reduced_bias: bool = False) -> np.ndarray:
    """wins (n, n) -> (n, n): the inverse expected information of centred worths, see
    `standard_errors`.
    """
    link = {"bradley_terry": LOGIT, "thurstone_jod": PROBIT}[model]
    wins = np.asarray(wins, float)
    n = len(wins)
    i, j = np.triu_indices(n, 1)
    worth = _fit(wins, link, reduced_bias) / link.scale
    if not np.isfinite(worth).all():
        return np.full((n, n), np.nan)
    x = differences(n)
    weight = (wins[i, j] + wins[j, i]) * link.information(x @ worth)
    return np.linalg.pinv((x * weight[:, None]).T @ x) * link.scale**2


def _fit(wins: np.ndarray, link: Link, reduced_bias: bool) -> np.ndarray:
    wins = np.asarray(wins, float)
    shape, n = wins.shape[:-1], wins.shape[-1]
    wins = wins.reshape(-1, n, n)
    i, j = np.triu_indices(n, 1)
    over, under = wins[:, i, j], wins[:, j, i]
    result = np.full((len(wins), n), np.nan)
    exists = connected(wins + np.swapaxes(wins, 1, 2)) if reduced_bias else connected(wins)
    if n > 1 and exists.any():
        solve = _scored if reduced_bias else _newton
        result[exists] = solve(differences(n), over[exists], under[exists], link)
    return (result * link.scale).reshape(shape)


def connected(wins: np.ndarray) -> np.ndarray:
    """wins (R, n, n) -> (R,) bool: from every item a chain of wins leads to every other one, and
    only then there is a finite maximum (Ford 1957, doi:10.2307/2308513).
    """
    return reachable(wins).all(axis=(1, 2))


def reachable(wins: np.ndarray) -> np.ndarray:
    """wins (R, n, n) -> (R, n, n) bool: whether a chain of wins leads from i to j, or they are one
    item.
    """
    n = wins.shape[-1]
    reach = ((wins > 0) | np.eye(n, dtype=bool)).astype(np.float32)
    for _ in range(max(1, int(np.ceil(np.log2(max(n, 2)))))):
        reach = np.minimum(reach @ reach, 1)
    return reach > 0


def differences(n: int) -> np.ndarray:
    """(n (n - 1)/2, n): the matrix that takes worths to their differences w_i - w_j, i < j."""
    i, j = np.triu_indices(n, 1)
    return np.eye(n)[i] - np.eye(n)[j]


def _newton(x: np.ndarray, over: np.ndarray, under: np.ndarray, link: Link) -> np.ndarray:
    """Maximise many concave functions of x w at once; x (K, n), over, under (R, K) -> w (R, n), sum
    0, NaN where none is found.
    """

    def step(w: np.ndarray, over, under) -> np.ndarray:
        slope, curvature = link.observed(w @ x.T, over, under)
        return solved(blind_filled((curvature @ outer).reshape(-1, n, n)), slope @ x)

    n = x.shape[1]
    outer = (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)
    w = climbed(_origin(n), step, (over, under), STEP, ITERATIONS)
    return w - w.mean(axis=1, keepdims=True)


def _origin(n: int) -> Callable[..., np.ndarray]:
    """Where a climb begins that knows nothing: all worths 0."""
    return lambda over, under: np.zeros((len(over), n))


def _scored(x: np.ndarray, over: np.ndarray, under: np.ndarray, link: Link) -> np.ndarray:
    """The same with the score adjusted for bias, by Fisher scoring (Kosmidis and Firth 2009)."""

    def step(w: np.ndarray, over, under) -> np.ndarray:
        d = w @ x.T
        slope, _ = link.observed(d, over, under)
        weight = (over + under) * link.information(d)
        information = blind_filled((weight @ outer).reshape(-1, n, n))
        # h_k = weight_k x_k' I^-1 x_k; the common shift that was filled in is orthogonal to x_k
        leverage = weight * ((x @ np.linalg.inv(information)) * x).sum(axis=2)
        return solved(information, (slope + 0.5 * leverage * link.bend(d)) @ x)

    n = x.shape[1]
    outer = (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)
    w = climbed(_origin(n), step, (over, under), SCORING_STEP, SCORING_ITERATIONS)
    return w - w.mean(axis=1, keepdims=True)


def climbed(
    start: Callable[..., np.ndarray],
    step: Callable[..., np.ndarray],
    counts: tuple[np.ndarray, ...],
    least: float,
    iterations: int,
) -> np.ndarray:
    """Parameters (R, m) that climb by steps of at most 2 until they are below `least`; NaN where
    that does not come, or a parameter passes `FARTHEST`.

    counts          (R, ...) each, what was answered
    start(*counts)  (r, m), where it begins
    step(theta, *counts)  (r, m), one step of these rows
    Many tables begin where their sum ends, which for resamples of one study is near all of them.
    """
    theta = start(*counts)
    if len(theta) > 1:
        pooled = climbed(
            start, step, tuple(one.sum(axis=0, keepdims=True) for one in counts), least, iterations
        )
        if np.isfinite(pooled).all():
            theta = np.repeat(pooled, len(theta), axis=0)
    active, here = np.arange(len(theta)), counts
    for _ in range(iterations):
        taken = step(theta[active], *here)
        length = np.abs(taken).max(axis=1)
        theta[active] += taken * np.minimum(1, 2 / np.maximum(length, 1e-300))[:, None]
        astray = ~(np.abs(theta[active]).max(axis=1) < FARTHEST)
        theta[active[astray]] = np.nan
        going = (length > least) & ~astray
        if not going.any():
            return theta
        if not going.all():
            active, here = active[going], tuple(one[going] for one in here)
    theta[active] = np.nan
    return theta


def blind_filled(information: np.ndarray, items: int | None = None) -> np.ndarray:
    """Informations (R, m, m), which are blind to a common shift of the first `items` parameters:
    a constant matrix fills that direction and leaves the rest.
    """
    n = information.shape[1] if items is None else items
    mean = information[:, range(n), range(n)].mean(axis=1)
    information[:, :n, :n] += mean[:, None, None] / n
    return information


def solved(information: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Newton steps (R, m) for informations (R, m, m) and slopes (R, m)."""
    size = range(slope.shape[1])
    information = information.copy()
    information[:, size, size] += (
        RIDGE * information[:, size, size].mean(axis=1, keepdims=True) + np.finfo(float).tiny
    )
    return np.linalg.solve(information, slope[..., None])[..., 0]
