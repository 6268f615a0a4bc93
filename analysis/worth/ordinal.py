"""All five answers with a side effect and participants: a cumulative-link mixed model.

P(answer of p about k <= c) = logistic(tau_c - eta_pk), eta = (w_b + v_pb) - (w_a + v_pa) +- (side +
s_p): the sign is + where a stood on the left; tau symmetric about 0; v_p ~ N(0, sd_preference^2) a
participant's own taste for each technique, centred; s_p ~ N(0, sd_side^2) their own leaning to the
right. Agresti 1992, Applied Statistics 41, doi:10.2307/2347562.

The integral over b_p = (v_p, s_p)/sd is by Laplace's approximation, its gradient exact, or, with
three techniques and few answers a person, by adaptive Gauss-Hermite quadrature. With `prior` the
worths, log increments of the thresholds and spreads have weak normal priors (`PRIOR`), so that a
maximum exists where the likelihood alone has none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize, special

from analysis.panel import Panel
from analysis.worth.binary import FARTHEST
from analysis.worth.categories import recoded

#: The model has no random effects where nobody gave more answers than the first, and a note of bias
#: up to the second.
NO_TASTE, FEW_ANSWERS = 2, 6
#: To so many techniques few answers are integrated by quadrature, with so many points along each of
#: as many dimensions.
QUADRATURE_ITEMS, POINTS = 3, 5
#: Standard deviations of the priors of a worth, of a log increment of the thresholds, and of the
#: two spreads, logits: wide beside what is found where the likelihood has a maximum.
PRIOR = (3.0, 2.0, 2.0)
#: With twice as many people or more a climb begins at the fit of so many of them, and with its
#: curvature an answer, at least the second in every direction.
SOME_PEOPLE, LEAST_CURVATURE = 200, 1e-3


@dataclass(frozen=True)
class Ordinal:
    """worth, errors (n,): logits and their standard errors; covariance of worth (n, n).

    side and side_error: logits to the right; thresholds: logits, with their names; sd_preference,
    sd_side: spreads over people, NaN where the model has none; log_likelihood of so many answers;
    prior: whether the fit has one.
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
    parameters: int
    prior: bool = False


def fitted(panel: Panel, prior: bool = False) -> Ordinal | None:
    """`ordinal`, once a panel; without random effects where nobody gave more than `NO_TASTE`
    answers, which cannot tell them from noise.
    """
    key = ("ordinal", prior)
    if key not in panel.kept:
        panel.kept[key] = ordinal(panel, answers_each(panel) > NO_TASTE, prior)
    return panel.kept[key]


def answers_each(panel: Panel) -> int:
    """The most answers that a participant gave."""
    return int(panel.answered.sum(axis=1).max())


def ordinal(panel: Panel, mixed: bool = True, prior: bool = False) -> Ordinal | None:
    """Fit the model of this module's docstring; without `mixed`, v = s = 0. None where no maximum
    is found.
    """
    problem = Likelihood(panel, mixed, prior)
    theta = _climb(problem, *_beginning(panel, problem))
    few = len(panel.items) <= QUADRATURE_ITEMS and answers_each(panel) <= FEW_ANSWERS
    if theta is not None and mixed and few:
        laplace = problem
        # at a spread of 0 the slope is 0, whatever lies beside it
        theta[-2:] = np.maximum(np.abs(theta[-2:]), 0.2)
        for _ in range(2):  # the points follow the modes
            if theta is not None:
                problem = Quadrature(laplace, theta)
                theta = _climb(problem, theta)
    return None if theta is None else problem.result(theta)


def _beginning(panel: Panel, problem: Likelihood) -> tuple[np.ndarray, np.ndarray | None]:
    """Where the climb begins, and the inverse curvature there where it is known: with many people
    the fit of some of them, spread over the table, who gave all categories.
    """
    rows = np.flatnonzero(panel.answered.any(axis=1))
    if len(rows) < 2 * SOME_PEOPLE:
        return problem.start(), None
    some = Likelihood(panel.chosen(rows[:: len(rows) // SOME_PEOPLE]), problem.mixed, problem.prior)
    theta = _climb(some, some.start()) if some.m == problem.m else None
    if theta is None:
        return problem.start(), None
    curvature = some.information(theta)
    if problem.mixed:  # at a spread of 0 the slope is 0, whatever lies beside it
        theta[-2:] = np.maximum(np.abs(theta[-2:]), 0.2)
    values, vectors = np.linalg.eigh(curvature)
    inverse = (vectors / np.maximum(np.abs(values), LEAST_CURVATURE)) @ vectors.T
    return theta, (inverse + inverse.T) / 2


def _climb(
    problem: Likelihood, start: np.ndarray, inverse: np.ndarray | None = None
) -> np.ndarray | None:
    """The parameters at the maximum: BFGS, then Newton's steps; None where none is found."""
    options = {"gtol": 10 * problem.flat, "maxiter": 300, "hess_inv0": inverse}
    theta = optimize.minimize(problem, start, jac=True, method="BFGS", options=options).x
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
    flat = np.abs(problem(theta)[1]).max() <= 1e-5
    return theta if flat and np.abs(theta).max() <= FARTHEST else None


class Cells:
    """The category of each answer as an interval of the latent scale, and what the log-likelihood
    log(F(u) - F(l)) of falling into it does when eta or the cuts move.

    category: places of the answers, any shape; eta: of the same shape; tau: the cuts, ascending; F
    is logistic, u and l the upper and the lower cut less eta; f = F (1 - F).
    """

    def __init__(self, category: np.ndarray, eta: np.ndarray, tau: np.ndarray):
        edges = np.concatenate([[-np.inf], tau, [np.inf]])
        self.upper = special.expit(edges[category + 1] - eta)  # F(u)
        self.lower = special.expit(edges[category] - eta)  # F(l)
        self.width = edges[category + 1] - edges[category]

    def value(self) -> np.ndarray:
        """log(F(u) - F(l)), as F(u) (1 - F(l)) (1 - e^(l - u)): u - l does not depend on eta."""
        return (
            np.log(np.maximum(self.upper, 1e-300))
            + np.log1p(-np.minimum(self.lower, 1 - 1e-16))
            + np.log(-np.expm1(-self.width))
        )

    def score(self) -> np.ndarray:
        """Its derivative in eta."""
        return self.upper + self.lower - 1

    def density(self) -> tuple[np.ndarray, np.ndarray]:
        """f(u) and f(l)."""
        return self.upper * (1 - self.upper), self.lower * (1 - self.lower)

    def curvature(self) -> np.ndarray:
        """kappa: minus its second derivative in eta."""
        of_upper, of_lower = self.density()
        return of_upper + of_lower

    def density_slope(self) -> tuple[np.ndarray, np.ndarray]:
        """f'(u) and f'(l); d kappa / d eta is minus their sum."""
        of_upper, of_lower = self.density()
        return of_upper * (1 - 2 * self.upper), of_lower * (1 - 2 * self.lower)

    def cut_scores(self) -> tuple[np.ndarray, np.ndarray]:
        """Its derivatives in the upper and in the lower cut."""
        grow = np.where(np.isfinite(self.width), 1 / np.expm1(np.minimum(self.width, 700)), 0.0)
        return 1 - self.upper + grow, -self.lower - grow


class Likelihood:
    """Minus the mean log-likelihood of an answer and its gradient.

    Parameters: worths in an orthonormal basis of the contrasts (n - 1), side, log increments of the
    thresholds (m), sd_preference, sd_side (either sign: only the square counts).
    """

    flat = 1e-8  # a slope at which the maximum is reached

    def __init__(self, panel: Panel, mixed: bool, prior: bool = False):
        here = panel.answered.any(axis=1)
        self.mixed, self.prior, self.n = mixed, prior, len(panel.items)
        category, self.cuts, self.names = recoded(panel)
        self.category, self.mask = category[here], panel.answered[here].astype(float)
        n = self.n
        self.basis = np.linalg.svd(np.eye(n) - 1 / n)[0][:, : n - 1]
        x = np.eye(n)[panel.second] - np.eye(n)[panel.first]
        self.x = x @ self.basis
        self.sign = np.where(panel.first_left[here], 1.0, -1.0)
        self.answers = int(self.mask.sum())
        self.m = self.cuts.shape[1]
        self.mode = np.zeros((len(self.mask), n))
        self.known: tuple[np.ndarray, np.ndarray] | None = None  # the last Hessian, and where

    def start(self) -> np.ndarray:
        theta = np.zeros(self.n + self.m + (2 if self.mixed else 0))
        if self.mixed:
            theta[-2:] = 0.7, 0.3
        return theta

    def split(self, theta: np.ndarray) -> tuple[np.ndarray, float, np.ndarray, np.ndarray]:
        """worth (n - 1), side, increments of the thresholds (m), spreads (2)."""
        n, m = self.n, self.m
        spread = theta[n + m :] if self.mixed else np.zeros(2)
        return theta[: n - 1], theta[n - 1], np.exp(theta[n : n + m]), spread

    def __call__(self, theta: np.ndarray) -> tuple[float, np.ndarray]:
        worth, side, increments, spread = self.split(theta)
        tau = self.cuts @ increments
        fixed = self.x @ worth + self.sign * side  # (P, K)
        integral = self._laplace if self.mixed else self._plain
        value, score, to_upper, to_lower, to_spread = integral(fixed, tau, spread)
        to_tau = np.bincount(self.category.ravel(), to_upper.ravel(), len(tau) + 1)[: len(tau)]
        to_tau = to_tau + np.bincount(self.category.ravel(), to_lower.ravel(), len(tau) + 1)[1:]
        gradient = np.concatenate(
            [
                score.sum(axis=0) @ self.x,
                [(score * self.sign).sum()],
                (to_tau @ self.cuts) * increments,
                to_spread,
            ]
        )
        return self._mean(theta, value, gradient)

    def _mean(
        self, theta: np.ndarray, value: float, gradient: np.ndarray
    ) -> tuple[float, np.ndarray]:
        """Minus value and gradient an answer, with the priors where there are any."""
        if self.prior:
            of_worth, of_cut, of_spread = PRIOR
            sd = np.full(len(theta), np.inf)
            sd[: self.n - 1], sd[self.n : self.n + self.m] = of_worth, of_cut
            if self.mixed:
                sd[-2:] = of_spread
            value = value - 0.5 * float(((theta / sd) ** 2).sum())
            gradient = gradient - theta / sd**2
        return -value / self.answers, -gradient / self.answers

    def _plain(self, fixed: np.ndarray, tau: np.ndarray, spread: np.ndarray):
        """Value and slopes without random effects."""
        cells, mask = Cells(self.category, fixed, tau), self.mask
        to_upper, to_lower = cells.cut_scores()
        value = float((cells.value() * mask).sum())
        return value, cells.score() * mask, to_upper * mask, to_lower * mask, []

    def _laplace(self, fixed: np.ndarray, tau: np.ndarray, spread: np.ndarray):
        """Value and exact slopes of Laplace's approximation: log p(y | b) - b'b/2 - log|H|/2 at its
        mode b, with H = Z' kappa Z + 1.
        """
        z = self._effects(spread)
        b, cells = self._modes(fixed, z, tau)
        zt, mask = np.swapaxes(z, 1, 2), self.mask
        kappa = cells.curvature() * mask
        information = self.curvature = zt @ (kappa[..., None] * z) + np.eye(self.n)
        value = float((cells.value() * mask).sum())
        value += float(-0.5 * (b * b).sum() - 0.5 * np.linalg.slogdet(information)[1].sum())

        # log|H|/2 moves with eta by kappa: directly, and by way of the mode
        score, (to_upper, to_lower) = cells.score() * mask, cells.cut_scores()
        of_upper, of_lower = cells.density()
        up_slope, low_slope = cells.density_slope()
        turned = np.linalg.solve(information, zt)  # (P, n, K): H^-1 z
        h = np.einsum("pkd,pdk->pk", z, turned)  # z' H^-1 z
        bend = -(up_slope + low_slope) * mask  # d kappa / d eta
        r = (turned @ (0.5 * bend * h)[..., None])[..., 0]  # H^-1 d(log|H|/2)/db
        by_mode = (z @ r[..., None])[..., 0]
        whole = score - 0.5 * bend * h + kappa * by_mode
        to_upper = (to_upper - 0.5 * h * up_slope - by_mode * of_upper) * mask
        to_lower = (to_lower - 0.5 * h * low_slope - by_mode * of_lower) * mask
        to_spread = [
            (whole * of_b - kappa * of_turned - score * of_r).sum()
            for of_b, of_turned, of_r in zip(
                self._along(b), self._along_each(turned), self._along(r), strict=True
            )
        ]
        return value, whole, to_upper, to_lower, to_spread

    def _effects(self, spread: np.ndarray) -> np.ndarray:
        """z (P, K, n): what a person's taste, in the basis, and leaning add to eta."""
        z = np.empty((*self.category.shape, self.n))
        z[..., :-1] = spread[0] * self.x
        z[..., -1] = spread[1] * self.sign
        z *= self.mask[..., None]
        return z

    def _along(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """values (P, n) of the effects -> what those of taste and of side are of eta, (P, K)."""
        return values[:, :-1] @ self.x.T, self.sign * values[:, -1:]

    def _along_each(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same of values (P, n, K), each answer with its own."""
        return np.einsum("kd,pdk->pk", self.x, values[:, :-1]), self.sign * values[:, -1]

    def _modes(self, fixed: np.ndarray, z: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, Cells]:
        """b (P, n) at which log p(y | b) - b'b/2 is largest, by Newton's steps from the last ones;
        and the cells there.
        """
        b, zt = self.mode, np.swapaxes(z, 1, 2)
        for _ in range(50):
            cells = Cells(self.category, fixed + (z @ b[..., None])[..., 0], tau)
            information = zt @ (cells.curvature()[..., None] * z) + np.eye(self.n)
            slope = (zt @ cells.score()[..., None])[..., 0] - b
            step = np.linalg.solve(information, slope[..., None])[..., 0]
            length = np.abs(step).max(axis=1, keepdims=True)
            b = b + step * np.minimum(1, 3 / np.maximum(length, 1e-300))
            if length.max() < 1e-7:
                break
        self.mode = b
        return b, Cells(self.category, fixed + (z @ b[..., None])[..., 0], tau)

    def information(self, theta: np.ndarray) -> np.ndarray:
        """The Hessian of the mean, from central differences of the gradient; that of the last
        parameters where these are within 1e-6 of them, as after Newton's last step.
        """
        if self.known is not None and np.abs(theta - self.known[0]).max() < 1e-6:
            return self.known[1]
        size, step = len(theta), 1e-4
        rows = [
            (self(theta + step * e)[1] - self(theta - step * e)[1]) / (2 * step)
            for e in np.eye(size)
        ]
        self.known = theta, (np.array(rows) + np.array(rows).T) / 2
        return self.known[1]

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
        worth, side, increments, (sd_v, sd_s) = self.split(theta)
        of_worth = self.basis @ covariance[:-1, :-1] @ self.basis.T
        return Ordinal(
            worth=self.basis @ worth,
            errors=np.sqrt(np.diag(of_worth)),
            covariance=of_worth,
            side=float(side),
            side_error=float(np.sqrt(covariance[-1, -1])),
            thresholds=np.cumsum(increments),
            threshold_names=self.names,
            sd_preference=abs(float(sd_v)) if self.mixed else np.nan,
            sd_side=abs(float(sd_s)) if self.mixed else np.nan,
            log_likelihood=-self(theta)[0] * self.answers,
            answers=self.answers,
            parameters=len(theta),
            prior=self.prior,
        )


class Quadrature(Likelihood):
    """The same by adaptive Gauss-Hermite quadrature, for few answers a person, where Laplace's
    approximation is poor.

    Each person's points stand about their mode at `theta`, as wide as the curvature there, and
    stay: value and gradient are those of one smooth function. Liu and Pierce 1994,
    doi:10.1093/biomet/81.3.624.
    """

    flat = 1e-6

    def __init__(self, laplace: Likelihood, theta: np.ndarray):
        laplace(theta)  # leaves the modes and curvatures at theta
        vars(self).update(vars(laplace))
        self.known = None  # that was the Hessian of another likelihood
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
        worth, side, increments, (sd_v, sd_s) = self.split(theta)
        tau = self.cuts @ increments
        size = len(tau) + 2
        total, slopes, to_tau = 0.0, np.zeros(self.n + 2), np.zeros(size)
        step = max(1, (1 << 20) // (self.points.shape[1] * self.category.shape[1]))
        for start in range(0, len(self.points), step):
            part = slice(start, start + step)
            category, sign, mask = (
                one[part, None] for one in (self.category, self.sign, self.mask)
            )  # (p, 1, K)
            taste, lean = self.points[part, :, :-1] @ self.x.T, self.points[part, :, -1:]
            eta = self.x @ worth + sd_v * taste + sign * (side + sd_s * lean)  # (p, M, K)
            cells = Cells(category, eta, tau)
            joint = self.log_mass[part] + (cells.value() * mask).sum(axis=2)
            top = joint.max(axis=1, keepdims=True)
            share = np.exp(joint - top)
            whole = share.sum(axis=1, keepdims=True)
            total += float((np.log(whole) + top).sum())
            share = (share / whole)[..., None] * mask  # of each point in the person's integral
            score = share * cells.score()
            slopes[: self.n - 1] += score.sum(axis=(0, 1)) @ self.x
            slopes[self.n - 1 :] += (
                (score * sign).sum(),
                (score * taste).sum(),
                (score * sign * lean).sum(),
            )
            of_upper, of_lower = cells.cut_scores()
            for end, slope in ((category + 1, of_upper), (category, of_lower)):
                summed = (share * slope).sum(axis=1).ravel()
                to_tau += np.bincount(end.ravel(), summed, size + 1)[:size]
        gradient = np.concatenate(
            [slopes[: self.n], (to_tau[1:-1] @ self.cuts) * increments, slopes[self.n :]]
        )
        return self._mean(theta, total, gradient)
