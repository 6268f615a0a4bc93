"""How much each technique is worth: four models of paired comparisons, centred on 0 within a
framing, with intervals.

bradley_terry   P(i over j) = logistic(w_i - w_j).  Bradley and Terry 1952, Biometrika 39,
                doi:10.2307/2334029. 'No difference' is half a win for each, or dropped
                (`Options.ties`).
davidson        P(i) : P(j) : P(no difference) = pi_i : pi_j : nu sqrt(pi_i pi_j), w = log pi.
                Davidson 1970, JASA 65(329), doi:10.1080/01621459.1970.10481082: 'no difference' is
                an outcome of its own.
thurstone_jod   P(i over j) = Phi((w_i - w_j) / JOD_SIGMA), case V, in just-objectionable
                differences: 1 JOD is preferred by 75 %. Thurstone 1927; Perez-Ortiz and Mantiuk
                2017, arXiv:1712.03686. 'No difference' as in bradley_terry.
ordinal         all five answers, with a side effect and participants: P(answer <= k) =
                logistic(tau_k - eta), eta = (w_b + v_b) - (w_a + v_a) +- (side + s): tau symmetric
                about 0; v ~ N(0, sd_preference^2) a participant's own taste for each technique,
                centred; s ~ N(0, sd_side^2) their own leaning to the right. Agresti 1992, Applied
                Statistics 41, doi:10.2307/2347562; the integral over v and s by Laplace's
                approximation, its gradient exact, or, with three techniques and few answers a
                person, by adaptive Gauss-Hermite quadrature; intervals by Wald from the observed
                information. Worths are logits for one participant. Under Laplace spreads come out
                some 10 % small with 10 answers a person; worths 1 to 2 %.

A fit that does not exist is NaN, and `missing_fit` names why: an item or a group that was never
beaten or never preferred, groups that were never compared, all answers 'no difference'. Nothing is
smoothed, penalised or added to make one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import optimize, special, stats
from scipy.sparse import csgraph

from analysis import bootstrap
from analysis.options import FEWEST_PEOPLE, Options
from analysis.panel import Panel, noted, panels, tied, wins
from analysis.responses import Responses

#: Standard deviation of a difference in JOD: Phi(1 / JOD_SIGMA) = 0.75.
JOD_SIGMA = 1 / stats.norm.ppf(0.75)
#: Newton's method stops at steps below the first, and gives up after so many or where a worth
#: passes the last (logits, probits);
#: a slope at the last is still far above rounding, so that no flight to infinity is taken for an
#: end.
STEP, ITERATIONS, FARTHEST = 1e-9, 60, 20.0
#: Added to the diagonal of an information, as a share of its mean, so that one that runs flat can
#: be solved.
RIDGE = 1e-11

#: The ordinal model has no random effects where nobody gave more answers than the first, and a note
#: of bias up to the second.
NO_TASTE, FEW_ANSWERS = 2, 6
#: To so many techniques few answers are integrated by quadrature, with so many points along each of
#: as many dimensions.
QUADRATURE_ITEMS, POINTS = 3, 5


def worths(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, model, technique, estimate, low, high; empty numbers where a fit does not exist,
    named in attrs['notes'].
    """
    rows, notes = [], bootstrap.few(responses)
    for name, panel in panels(responses).items():
        for model in options.models:
            estimate, low, high, said = _worth(panel, model, options)
            rows += zip(
                [name] * len(estimate),
                [model] * len(estimate),
                panel.items,
                estimate,
                low,
                high,
                strict=True,
            )
            notes += [f"{name}, {model}: {line}" for line in said]
    return noted(rows, ["framing", "model", "technique", "estimate", "low", "high"], notes)


def parameters(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, model, parameter, estimate, low, high: what the models have beside worths.

    davidson: log_nu. ordinal: side (logits, positive favours the right image), threshold_slight and
    threshold_strong (logits), sd_preference and sd_side (logits, without interval), answers,
    log_likelihood (Laplace).
    """
    rows, notes = [], []
    for name, panel in panels(responses).items():
        if "davidson" in options.models and not missing_fit(panel, "davidson"):
            _, log_nu = davidson(wins(panel, panel.counts, "drop"), tied(panel, panel.counts))
            drawn = bootstrap.counts(panel, options)
            low, high = bootstrap.interval(
                davidson(wins(panel, drawn, "drop"), tied(panel, drawn))[1],
                panel.people,
                options.level,
            )
            if np.isfinite(log_nu):
                rows.append((name, "davidson", "log_nu", float(log_nu), float(low), float(high)))
            else:
                notes.append(
                    f"{name}, davidson: no answer is 'no difference', nu is 0 and log_nu has "
                    "no number"
                )
        if "ordinal" in options.models and not missing_fit(panel, "ordinal"):
            fit = fitted(panel)
            if fit is None:
                continue
            half = stats.norm.ppf((1 + options.level) / 2) * fit.side_error
            rows.append((name, "ordinal", "side", fit.side, fit.side - half, fit.side + half))
            for label, value in zip(fit.threshold_names, fit.thresholds, strict=True):
                rows.append((name, "ordinal", label, value, np.nan, np.nan))
            for label in ("sd_preference", "sd_side", "answers", "log_likelihood"):
                rows.append((name, "ordinal", label, float(getattr(fit, label)), np.nan, np.nan))
    return noted(rows, ["framing", "model", "parameter", "estimate", "low", "high"], notes)


def bootstrapped(panel: Panel, model: str, options: Options) -> np.ndarray:
    """(resamples, n): the worths of bradley_terry, davidson or thurstone_jod in each resample, NaN
    where there is no fit.
    """
    return _fitted(panel, model, bootstrap.counts(panel, options), options.ties)


def estimated(panel: Panel, model: str, options: Options) -> np.ndarray:
    """(n,): the worths of bradley_terry, davidson or thurstone_jod, NaN where there is no fit."""
    if missing_fit(panel, model):
        return np.full(len(panel.items), np.nan)
    return _fitted(panel, model, panel.counts, options.ties)


def _fitted(panel: Panel, model: str, counts: np.ndarray, ties: str) -> np.ndarray:
    if model == "davidson":
        return davidson(wins(panel, counts, "drop"), tied(panel, counts))[0]
    return {"bradley_terry": bradley_terry, "thurstone_jod": thurstone_jod}[model](
        wins(panel, counts, ties)
    )


def _worth(
    panel: Panel, model: str, options: Options
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    empty = np.full(len(panel.items), np.nan)
    reason = missing_fit(panel, model)
    if reason:
        return empty, empty, empty, [f"no finite worths: {reason}"]
    if model == "ordinal":
        fit = fitted(panel)
        if fit is None:
            return (
                empty,
                empty,
                empty,
                [
                    "no finite worths: no maximum of the likelihood was found; with few "
                    "answers a participant tastes, thresholds and worths "
                    "can grow together without end"
                ],
            )
        half = stats.norm.ppf((1 + options.level) / 2) * fit.errors
        return fit.worth, fit.worth - half, fit.worth + half, _caveats(panel, fit)
    estimate = estimated(panel, model, options)
    draws = bootstrapped(panel, model, options)
    low, high = bootstrap.interval(draws, panel.people, options.level)
    lost = int((~np.isfinite(draws)).any(axis=1).sum())
    notes = []
    if lost and panel.people >= FEWEST_PEOPLE:
        kept = (
            "they are left out of the interval"
            if np.isfinite(low).all()
            else "too many for an interval"
        )
        notes.append(f"{lost} of {options.resamples} resamples have no finite worths; {kept}")
    return estimate, low, high, notes


def _caveats(panel: Panel, fit: Ordinal) -> list[str]:
    most = _answers_each(panel)
    if most <= NO_TASTE:
        return [
            (
                f"at most {most} answers a participant: tastes of their own cannot be told from "
                "noise and are not in the model"
            )
        ]
    if most <= FEW_ANSWERS and len(panel.items) > QUADRATURE_ITEMS and fit.sd_preference > 0.5:
        return [
            (
                f"at most {most} answers a participant and tastes that differ: Laplace's "
                "approximation makes worths a few per cent small"
            )
        ]
    return []


# --- binary models
# -----------------------------------------------------------------------------


def bradley_terry(wins: np.ndarray) -> np.ndarray:
    """wins (..., n, n), how often i was preferred to j -> (..., n) worths in logits, sum 0; NaN
    where there is no finite maximum.
    """

    def derivatives(d, over, under):
        p = special.expit(d)
        n = over + under
        return over - n * p, n * p * (1 - p)

    return _binary(wins, derivatives)


def thurstone_jod(wins: np.ndarray) -> np.ndarray:
    """wins (..., n, n), how often i was preferred to j -> (..., n) worths in JOD, sum 0; NaN where
    there is no finite maximum.
    """

    def derivatives(d, over, under):
        density = np.exp(-0.5 * d * d) / np.sqrt(2 * np.pi)
        below = special.ndtr(d)
        up = density / np.maximum(below, 1e-300)  # of log Phi(d)
        down = density / np.maximum(special.ndtr(-d), 1e-300)  # of log Phi(-d), but for its sign
        return over * up - under * down, over * up * (up + d) + under * down * (down - d)

    return _binary(wins, derivatives) * JOD_SIGMA


def _binary(wins: np.ndarray, derivatives: Callable) -> np.ndarray:
    wins = np.asarray(wins, float)
    shape, n = wins.shape[:-1], wins.shape[-1]
    wins = wins.reshape(-1, n, n)
    i, j = np.triu_indices(n, 1)
    over, under = wins[:, i, j], wins[:, j, i]
    result = np.full((len(wins), n), np.nan)
    exists = strongly_connected(wins)
    if n > 1 and exists.any():
        result[exists] = _newton(_differences(n), (over[exists], under[exists]), derivatives)
    return result.reshape(shape)


def _differences(n: int) -> np.ndarray:
    """(n (n - 1)/2, n): the matrix that takes worths to their differences w_i - w_j, i < j."""
    i, j = np.triu_indices(n, 1)
    return np.eye(n)[i] - np.eye(n)[j]


def _newton(x: np.ndarray, data: tuple[np.ndarray, ...], derivatives: Callable) -> np.ndarray:
    """Maximise many concave functions of x w at once; x (K, n), data (R, K) each -> w (R, n), sum
    0, NaN where none is found.
    """
    n = x.shape[1]
    outer = (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)
    w = np.zeros((len(data[0]), n))
    active = np.arange(len(w))
    for _ in range(ITERATIONS):
        slope, curvature = derivatives(w[active] @ x.T, *(one[active] for one in data))
        information = (curvature @ outer).reshape(-1, n, n)
        # The information is blind to a common shift: a constant matrix fills that direction and
        # leaves the rest.
        information += information[:, range(n), range(n)].mean(axis=1)[:, None, None] / n
        step = _solved(information, slope @ x)
        length = np.abs(step).max(axis=1)
        w[active] += step * np.minimum(1, 2 / np.maximum(length, 1e-300))[:, None]
        astray = ~(np.abs(w[active]).max(axis=1) < FARTHEST)
        w[active[astray]] = np.nan
        active = active[(length > STEP) & ~astray]
        if not len(active):
            break
    w[active] = np.nan
    return w - w.mean(axis=1, keepdims=True)


def _solved(information: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Newton steps (R, n) for informations (R, n, n) and slopes (R, n)."""
    size = range(slope.shape[1])
    information[:, size, size] += (
        RIDGE * information[:, size, size].mean(axis=1, keepdims=True) + np.finfo(float).tiny
    )
    return np.linalg.solve(information, slope[..., None])[..., 0]


def davidson(wins: np.ndarray, ties: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """wins and symmetric ties (..., n, n) -> worths (..., n), sum 0, and log nu (...); without ties
    Bradley-Terry and -inf.

    NaN where there is no finite maximum.
    """
    wins, ties = np.asarray(wins, float), np.asarray(ties, float)
    shape, n = wins.shape[:-1], wins.shape[-1]
    wins, ties = wins.reshape(-1, n, n), ties.reshape(-1, n, n)
    i, j = np.triu_indices(n, 1)
    over, under, level = wins[:, i, j], wins[:, j, i], ties[:, i, j]
    worth, log_nu = np.full((len(wins), n), np.nan), np.full(len(wins), np.nan)
    without = level.sum(axis=1) == 0
    if without.any():
        worth[without] = bradley_terry(wins[without])
        log_nu[without & np.isfinite(worth[:, 0])] = -np.inf
    exists = ~without & strongly_connected(wins + ties) & ((over + under).sum(axis=1) > 0)
    if n > 1 and exists.any():
        worth[exists], log_nu[exists] = _davidson(
            _differences(n), over[exists], under[exists], level[exists]
        )
    return worth.reshape(shape), log_nu.reshape(shape[:-1])


def _davidson(
    x: np.ndarray, over: np.ndarray, under: np.ndarray, level: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    n, total = x.shape[1], over + under + level
    outer = (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)
    theta = np.zeros((len(over), n + 1))
    theta[:, n] = np.log(2 * level.sum(axis=1) / (over + under).sum(axis=1))
    active = np.arange(len(theta))
    for _ in range(ITERATIONS):
        t, m = theta[active], total[active]
        # Divided by sqrt(pi_i pi_j) the three outcomes weigh e^(d/2), e^(-d/2) and nu.
        d = t[:, :n] @ x.T
        p = special.softmax(np.stack([d / 2, -d / 2, np.broadcast_to(t[:, n:], d.shape)]), axis=0)
        lean, draw = (p[0] - p[1]) / 2, p[2]
        slope = np.empty_like(t)
        slope[:, :n] = ((over[active] - under[active]) / 2 - m * lean) @ x
        slope[:, n] = (level[active] - m * draw).sum(axis=1)
        information = np.empty((len(t), n + 1, n + 1))
        information[:, :n, :n] = ((m * ((1 - draw) / 4 - lean**2)) @ outer).reshape(-1, n, n)
        information[:, :n, :n] += information[:, range(n), range(n)].mean(axis=1)[:, None, None] / n
        information[:, :n, n] = information[:, n, :n] = -(m * lean * draw) @ x
        information[:, n, n] = (m * draw * (1 - draw)).sum(axis=1)
        step = _solved(information, slope)
        length = np.abs(step).max(axis=1)
        theta[active] += step * np.minimum(1, 2 / np.maximum(length, 1e-300))[:, None]
        astray = ~(np.abs(theta[active]).max(axis=1) < FARTHEST)
        theta[active[astray]] = np.nan
        active = active[(length > STEP) & ~astray]
        if not len(active):
            break
    theta[active] = np.nan
    return theta[:, :n] - theta[:, :n].mean(axis=1, keepdims=True), theta[:, n]


# --- fits that do not exist
# -----------------------------------------------------------------------------


def strongly_connected(wins: np.ndarray) -> np.ndarray:
    """wins (R, n, n) -> (R,) bool: from every item a chain of wins leads to every other one (Ford
    1957, doi:10.2307/2308513).
    """
    n = wins.shape[-1]
    reach = ((wins > 0) | np.eye(n, dtype=bool)).astype(np.float32)
    for _ in range(max(1, int(np.ceil(np.log2(max(n, 2)))))):
        reach = np.minimum(reach @ reach, 1)
    return (reach > 0).all(axis=(1, 2))


def missing_fit(panel: Panel, model: str) -> str | None:
    """Why the model has no finite maximum for this panel, in words; None where it has one.

    bradley_terry and thurstone_jod are held to the answers that prefer one of the two: a technique
    that was tied but never beaten is named too, although half wins would give it a number. davidson
    and ordinal, which model 'no difference', are checked exactly: no direction of the parameters
    may raise or keep the likelihood of every answer.
    """
    counts = panel.counts
    strict, level = wins(panel, counts, "drop"), tied(panel, counts)
    if not strict.any():
        return "every answer is 'no difference'"
    groups, label = csgraph.connected_components(
        strict + level > 0, directed=True, connection="weak"
    )
    if groups > 1:
        return (
            f"{_names(panel, label == 0)} and {_names(panel, label != 0)} were never "
            "compared, not even through others"
        )
    if model == "ordinal" and panel.people < FEWEST_PEOPLE:
        return (
            f"{panel.people} participants; what they share and what is their own needs "
            f"{FEWEST_PEOPLE}"
        )
    if model == "ordinal" and (reason := confounded_side(panel)):
        return reason
    edges = strict if model in ("bradley_terry", "thurstone_jod") else strict + level
    groups, label = csgraph.connected_components(edges > 0, directed=True, connection="strong")
    if groups > 1:
        found = [
            (inside.sum(), order, never, inside)
            for inside in (label == group for group in range(groups))
            for order, (never, matrix) in enumerate(
                (("beaten by", edges), ("preferred to", edges.T))
            )
            if not matrix[np.ix_(~inside, inside)].any()
        ]
        _, _, never, inside = min(
            found, key=lambda one: one[:2]
        )  # a group at an end of the chain; the smallest is the one to name
        return (
            f"{_names(panel, inside)} {'was' if inside.sum() == 1 else 'were'} never "
            f"{never} {_names(panel, ~inside)}"
        )
    if model in ("davidson", "ordinal") and _separated(panel, model):
        return (
            "the answers are separated: worths and thresholds can grow together without "
            "end and only fit better"
        )
    return None


def confounded_side(panel: Panel) -> str | None:
    """Why a preference for a side cannot be told from one for a technique: every pair was shown one
    way round only. None where some pair was shown both ways, or nobody answered twice.
    """
    shown, first_left = panel.answered.sum(axis=0), (panel.first_left & panel.answered).sum(axis=0)
    if shown.max(initial=0) < 2 or ((first_left > 0) & (first_left < shown)).any():
        return None
    left = np.where(first_left > 0, panel.first, panel.second)
    right = np.where(first_left > 0, panel.second, panel.first)
    one_side = [
        f"{item} was always on the {'left' if at in left else 'right'}"
        for at, item in enumerate(panel.items)
        if (at in left) != (at in right)
    ]
    return "side is confounded with technique: every pair was always shown the same way round" + (
        f" ({'; '.join(one_side)})" if one_side else ""
    )


def _names(panel: Panel, chosen: np.ndarray) -> str:
    return ", ".join(name for name, one in zip(panel.items, chosen, strict=True) if one)


def _separated(panel: Panel, model: str) -> bool:
    """Whether a direction of recession exists: one that lowers the likelihood of no observed answer
    and raises that of some.
    """
    x = np.eye(len(panel.items))[panel.second] - np.eye(len(panel.items))[panel.first]
    if model == "davidson":
        sign = np.sign(np.arange(-2, 3))
        seen = {(k, int(sign[c])) for k, c in zip(*np.nonzero(panel.counts), strict=True)}
        if not any(answer == 0 for _, answer in seen):
            return False  # then it is Bradley-Terry, which is connected
        # Of e^(-d/2) : nu : e^(d/2) the observed one must not lose against either other.
        features = {-1: (-0.5, 0), 0: (0, 1), 1: (0.5, 0)}
        rows = [
            [
                *(features[answer][0] - features[other][0]) * x[k],
                features[answer][1] - features[other][1],
            ]
            for k, answer in seen
            for other in features
            if other != answer
        ]
        size = len(panel.items) + 1
    else:
        rank, cuts, _ = _recoded(panel)
        size = len(panel.items) + 1 + cuts.shape[1]
        rows = []
        for left in (True, False):
            for k in range(len(x)):
                eta = [*x[k], 1.0 if left else -1.0]
                for category in np.unique(
                    rank[:, k][panel.answered[:, k] & (panel.first_left[:, k] == left)]
                ):
                    if category < len(cuts):
                        rows.append([*(-np.array(eta)), *cuts[category]])
                    if category > 0:
                        rows.append([*eta, *(-cuts[category - 1])])
    rows = np.array(rows)
    found = optimize.linprog(
        -rows.sum(axis=0),
        A_ub=-rows,
        b_ub=np.zeros(len(rows)),
        bounds=[(-1, 1)] * size,
        method="highs",
    )
    return bool(-found.fun > 1e-7)


# --- the ordinal model
# -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Ordinal:
    """worth, errors (n,): logits and their standard errors; the rest as in `parameters`; covariance
    of worth (n, n).
    """

    worth: np.ndarray
    errors: np.ndarray
    covariance: np.ndarray
    side: float
    side_error: float
    thresholds: np.ndarray
    threshold_names: tuple[str, ...]
    sd_preference: float
    sd_side: float
    log_likelihood: float
    answers: int


def fitted(panel: Panel) -> Ordinal | None:
    """`ordinal`, once a panel; without random effects where nobody gave more than `NO_TASTE`
    answers, which cannot tell them from noise.
    """
    if "ordinal" not in panel.kept:
        panel.kept["ordinal"] = ordinal(panel, mixed=_answers_each(panel) > NO_TASTE)
    return panel.kept["ordinal"]


def _answers_each(panel: Panel) -> int:
    """The most answers that a participant gave."""
    return int(panel.answered.sum(axis=1).max())


def _recoded(panel: Panel) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Only the strengths that were used have a category of their own.

    Category of each answer (P, K), counted from 0; cuts (categories - 1, m): the cuts as sums of m
    positive increments; their names.
    """
    used = np.unique(np.abs(panel.preference[panel.answered].astype(int)))
    labels = {1: "threshold_slight", 2: "threshold_strong"}
    positive = [strength for strength in used if strength > 0]
    rank = np.searchsorted(used, np.abs(panel.preference.astype(int)))
    sign = np.sign(panel.preference.astype(int))
    if used[0] == 0:
        category = sign * rank + len(positive)
        m = len(positive)
        upper = np.tril(np.ones((m, m)))
        return (
            np.where(panel.answered, category, 0),
            np.concatenate([-upper[::-1], upper]),
            tuple(labels[s] for s in positive),
        )
    m = len(positive) - 1
    category = np.where(sign > 0, rank + m + 1, m - rank)
    upper = np.tril(np.ones((m, m)))
    cuts = np.concatenate([-upper[::-1], np.zeros((1, m)), upper])
    return np.where(panel.answered, category, 0), cuts, tuple(labels[s] for s in positive[1:])


def ordinal(panel: Panel, mixed: bool = True) -> Ordinal | None:
    """Fit the cumulative-link model of this module's docstring; without `mixed`, v = s = 0. None
    where no maximum is found.
    """
    problem = _Likelihood(panel, mixed)
    theta = _climb(problem, problem.start())
    if (
        theta is not None
        and mixed
        and len(panel.items) <= QUADRATURE_ITEMS
        and _answers_each(panel) <= FEW_ANSWERS
    ):
        laplace = problem
        theta[-2:] = np.maximum(
            np.abs(theta[-2:]), 0.2
        )  # at a spread of 0 the slope is 0, whatever lies beside it
        for _ in range(2):  # the points follow the modes
            if theta is not None:
                problem = _Quadrature(laplace, theta)
                theta = _climb(problem, theta)
    return None if theta is None else problem.result(theta)


def _climb(problem: _Likelihood, start: np.ndarray) -> np.ndarray | None:
    """The parameters at the maximum: BFGS, then Newton's steps; None where none is found."""
    theta = optimize.minimize(
        problem, start, jac=True, method="BFGS", options={"gtol": 10 * problem.flat, "maxiter": 300}
    ).x
    for _ in range(4):
        value, slope = problem(theta)
        if np.abs(slope).max() < problem.flat:
            break
        try:
            step = np.linalg.solve(problem.information(theta), slope)
        except np.linalg.LinAlgError:
            return None
        if not problem(theta - step)[0] <= value + 1e-12:
            break
        theta = theta - step
    return (
        None if np.abs(problem(theta)[1]).max() > 1e-5 or np.abs(theta).max() > FARTHEST else theta
    )


class _Likelihood:
    """Minus the mean log-likelihood of an answer and its gradient.

    Parameters: worths in an orthonormal basis of the contrasts (n - 1), side, log increments of the
    thresholds (m), sd_preference, sd_side (either sign: only the square counts).
    """

    flat = 1e-8  # a slope at which the maximum is reached

    def __init__(self, panel: Panel, mixed: bool):
        here = panel.answered.any(axis=1)
        self.mixed, self.n = mixed, len(panel.items)
        category, self.cuts, self.names = _recoded(panel)
        self.category, self.mask = category[here], panel.answered[here].astype(float)
        n = self.n
        self.basis = np.linalg.svd(np.eye(n) - 1 / n)[0][:, : n - 1]
        x = np.eye(n)[panel.second] - np.eye(n)[panel.first]
        self.x = x @ self.basis
        self.sign = np.where(panel.first_left[here], 1.0, -1.0)
        self.answers = int(self.mask.sum())
        self.m = self.cuts.shape[1]
        self.mode = np.zeros((len(self.mask), n))

    def start(self) -> np.ndarray:
        theta = np.zeros(self.n + self.m + (2 if self.mixed else 0))
        if self.mixed:
            theta[-2:] = 0.7, 0.3
        return theta

    def _split(self, theta: np.ndarray):
        n, m = self.n, self.m
        spread = theta[n + m :] if self.mixed else np.zeros(2)
        return theta[: n - 1], theta[n - 1], np.exp(theta[n : n + m]), spread

    def _ends(self, eta: np.ndarray, tau: np.ndarray):
        """F at the upper and the lower end of each answer's category, 1 and 0 beyond the last
        cuts.
        """
        edges = np.concatenate([[-np.inf], tau, [np.inf]])
        return special.expit(edges[self.category + 1] - eta), special.expit(
            edges[self.category] - eta
        )

    def __call__(self, theta: np.ndarray) -> tuple[float, np.ndarray]:
        worth, side, increments, (sd_v, sd_s) = self._split(theta)
        tau = self.cuts @ increments
        fixed = self.x @ worth + self.sign * side  # (P, K)
        b, h, _q = self.mode, None, None
        if self.mixed:
            z = np.empty((*fixed.shape, self.n))
            z[..., :-1] = sd_v * self.x
            z[..., -1] = sd_s * self.sign
            z *= self.mask[..., None]
            zt = np.swapaxes(z, 1, 2)
            for _ in range(50):
                up, low = self._ends(fixed + (z @ b[..., None])[..., 0], tau)
                kappa = up * (1 - up) + low * (1 - low)
                information = zt @ (kappa[..., None] * z) + np.eye(self.n)
                slope = (zt @ (up + low - 1)[..., None])[..., 0] - b
                step = np.linalg.solve(information, slope[..., None])[..., 0]
                length = np.abs(step).max(axis=1, keepdims=True)
                b = b + step * np.minimum(1, 3 / np.maximum(length, 1e-300))
                if length.max() < 1e-7:
                    break
            self.mode = b
            eta = fixed + (z @ b[..., None])[..., 0]
        else:
            eta = fixed
        up, low = self._ends(eta, tau)
        f_up, f_low = up * (1 - up), low * (1 - low)
        width = np.diff(np.concatenate([[-np.inf], tau, [np.inf]]))[self.category]
        # F(u) - F(l) = F(u) (1 - F(l)) (1 - e^(l - u)), and u - l does not depend on eta.
        value = (
            np.log(np.maximum(up, 1e-300))
            + np.log1p(-np.minimum(low, 1 - 1e-16))
            + np.log(-np.expm1(-width))
        )
        slope = (up + low - 1) * self.mask
        total = float((value * self.mask).sum())
        grow = np.where(np.isfinite(width), 1 / np.expm1(np.minimum(width, 700)), 0.0)
        score, to_up, to_low = slope, (1 - up + grow) * self.mask, (-low - grow) * self.mask
        spread = []
        if self.mixed:
            d_up, d_low = f_up * (1 - 2 * up), f_low * (1 - 2 * low)
            kappa = (f_up + f_low) * self.mask
            information = self.curvature = zt @ (kappa[..., None] * z) + np.eye(self.n)
            total += float(-0.5 * (b * b).sum() - 0.5 * np.linalg.slogdet(information)[1].sum())
            solved = np.linalg.solve(information, zt)  # (P, n, K): H^-1 z
            h = np.einsum("pkd,pdk->pk", z, solved)
            bend = -(d_up + d_low) * self.mask  # d kappa / d eta
            r = (solved @ (0.5 * bend * h)[..., None])[
                ..., 0
            ]  # H^-1 times the gradient of log|H|/2 in b
            m = (z @ r[..., None])[..., 0]
            score = slope - 0.5 * bend * h + kappa * m
            to_up = to_up - (0.5 * h * d_up + m * f_up) * self.mask
            to_low = to_low - (0.5 * h * d_low + m * f_low) * self.mask
            own = b[:, :-1] @ self.x.T, self.sign * b[:, -1:]
            turned = np.einsum("kd,pdk->pk", self.x, solved[:, :-1]), self.sign * solved[:, -1]
            shifted = r[:, :-1] @ self.x.T, self.sign * r[:, -1:]
            spread = [
                (score * one - kappa * two - slope * three).sum()
                for one, two, three in zip(own, turned, shifted, strict=True)
            ]
        last = len(tau)
        to_tau = np.bincount(self.category.ravel(), to_up.ravel(), last + 1)[:last]
        to_tau = to_tau + np.bincount(self.category.ravel(), to_low.ravel(), last + 1)[1:]
        gradient = np.concatenate(
            [
                score.sum(axis=0) @ self.x,
                [(score * self.sign).sum()],
                (to_tau @ self.cuts) * increments,
                spread,
            ]
        )
        return -total / self.answers, -gradient / self.answers

    def information(self, theta: np.ndarray) -> np.ndarray:
        """The Hessian of the mean, from central differences of the gradient."""
        size, step = len(theta), 1e-4
        rows = [
            (self(theta + step * e)[1] - self(theta - step * e)[1]) / (2 * step)
            for e in np.eye(size)
        ]
        return (np.array(rows) + np.array(rows).T) / 2

    def result(self, theta: np.ndarray) -> Ordinal | None:
        information = self.information(theta) * self.answers
        size = self.n  # worths and side
        if self.mixed:
            # At a spread of 0 the likelihood is even in it: flat there to second order or curved
            # either way, and not coupled to the rest.
            keep = [k for k in range(len(theta)) if k < self.n + self.m or abs(theta[k]) > 1e-3]
            information = information[np.ix_(keep, keep)]
        eigenvalues = np.linalg.eigvalsh(information)
        if eigenvalues[0] <= 1e-10 * eigenvalues[-1]:  # singular but for rounding
            return None
        covariance = np.linalg.inv(information)[:size, :size]
        worth, side, increments, (sd_v, sd_s) = self._split(theta)
        of_worth = self.basis @ covariance[:-1, :-1] @ self.basis.T
        return Ordinal(
            worth=self.basis @ worth,
            errors=np.sqrt(np.diag(of_worth)),
            covariance=of_worth,
            side=float(side),
            side_error=float(np.sqrt(covariance[-1, -1])),
            thresholds=np.cumsum(increments),
            threshold_names=self.names,
            sd_preference=abs(float(sd_v)),
            sd_side=abs(float(sd_s)),
            log_likelihood=-self(theta)[0] * self.answers,
            answers=self.answers,
        )


class _Quadrature(_Likelihood):
    """The same by adaptive Gauss-Hermite quadrature, for few answers a person, where Laplace's
    approximation is poor.

    Each person's points stand about their mode at `theta`, as wide as the curvature there, and
    stay: value and gradient are those of one smooth function. Liu and Pierce 1994,
    doi:10.1093/biomet/81.3.624.
    """

    flat = 1e-6

    def __init__(self, laplace: _Likelihood, theta: np.ndarray):
        laplace(theta)  # leaves the modes and curvatures at theta
        vars(self).update(vars(laplace))
        n = self.n
        node, weight = np.polynomial.hermite_e.hermegauss(POINTS)
        z, mass = (
            np.stack(np.meshgrid(*[one] * n, indexing="ij"), axis=-1).reshape(-1, n)
            for one in (node, weight)
        )
        values, vectors = np.linalg.eigh(self.curvature)
        root = (vectors / np.sqrt(values)[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        self.points = self.mode[:, None, :] + z @ root  # (P, M, n)
        mass = (
            np.log(np.prod(mass, axis=1)) + 0.5 * (z * z).sum(axis=1) - 0.5 * n * np.log(2 * np.pi)
        )
        self.log_mass = (
            mass - 0.5 * (self.points**2).sum(axis=2) - 0.5 * np.log(values).sum(axis=1)[:, None]
        )

    def __call__(self, theta: np.ndarray) -> tuple[float, np.ndarray]:
        worth, side, increments, (sd_v, sd_s) = self._split(theta)
        tau = self.cuts @ increments
        edges = np.concatenate([[-np.inf], tau, [np.inf]])
        total, slopes, to_tau = 0.0, np.zeros(self.n + 2), np.zeros(len(edges))
        step = max(1, (1 << 20) // (self.points.shape[1] * self.category.shape[1]))
        for start in range(0, len(self.points), step):
            part = slice(start, start + step)
            category, sign, mask = (
                one[part, None] for one in (self.category, self.sign, self.mask)
            )  # (p, 1, K)
            taste, lean = self.points[part, :, :-1] @ self.x.T, self.points[part, :, -1:]
            eta = self.x @ worth + sd_v * taste + sign * (side + sd_s * lean)  # (p, M, K)
            up, low = special.expit(edges[category + 1] - eta), special.expit(edges[category] - eta)
            width = edges[category + 1] - edges[category]
            value = (
                np.log(np.maximum(up, 1e-300))
                + np.log1p(-np.minimum(low, 1 - 1e-16))
                + np.log(-np.expm1(-width))
            )
            joint = self.log_mass[part] + (value * mask).sum(axis=2)
            top = joint.max(axis=1, keepdims=True)
            share = np.exp(joint - top)
            whole = share.sum(axis=1, keepdims=True)
            total += float((np.log(whole) + top).sum())
            share = (share / whole)[..., None] * mask  # of each point in the person's integral
            score = share * (up + low - 1)
            grow = np.where(np.isfinite(width), 1 / np.expm1(np.minimum(width, 700)), 0.0)
            slopes[: self.n - 1] += score.sum(axis=(0, 1)) @ self.x
            slopes[self.n - 1 :] += (
                (score * sign).sum(),
                (score * taste).sum(),
                (score * sign * lean).sum(),
            )
            for end, slope in (
                (category + 1, share * (1 - up + grow)),
                (category, -share * (low + grow)),
            ):
                to_tau += np.bincount(end.ravel(), slope.sum(axis=1).ravel(), len(edges) + 1)[
                    : len(edges)
                ]
        gradient = np.concatenate(
            [slopes[: self.n], (to_tau[1:-1] @ self.cuts) * increments, slopes[self.n :]]
        )
        return -total / self.answers, -gradient / self.answers
