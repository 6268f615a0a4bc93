"""Kernels fitted to a medium's curve: each technique's family, and how far it stays from the curve.

All fits look at the answer to a straight edge, out to where 99.5 % of the light has left: what is
seen beside a shadow, and what noise in single rings of a simulation hardly touches.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from renderer.errors import InputError
from renderer.optics import burley, gaussians
from renderer.optics.curve import Curve, edge_error


@dataclass(frozen=True, eq=False)
class GaussianFit:
    """Gaussians that the channels share: variance_mm2 (K,), rising; weights (K, C), sum 1.

    error (C,): rms at a straight edge against the curve that was fitted.
    """

    variance_mm2: np.ndarray
    weights: np.ndarray
    error: np.ndarray

    def edge(self, x_mm) -> np.ndarray:
        """The answer to a straight edge: (N,) -> (N, C)."""
        return gaussians.line_integral(x_mm, np.inf, self.variance_mm2, self.weights)


def published_gaussians(curve: Curve) -> GaussianFit:
    """d'Eon and Luebke's six, whatever the curve; error: how far they are from it."""
    fit = GaussianFit(gaussians.SKIN_VARIANCE_MM2, gaussians.SKIN_WEIGHTS, np.zeros(3))
    return GaussianFit(fit.variance_mm2, fit.weights, edge_error(curve, fit.edge))


@lru_cache(maxsize=64)
def gaussian_sum(curve: Curve, terms: int) -> GaussianFit:
    """The `terms` Gaussians nearest to a curve, with variances that all channels share.

    One blur then serves all channels (d'Eon and Luebke 2007, sec. 14.3). Variable projection: for
    given variances the weights are non-negative least squares a channel; the variances are found by
    a trust region over their logarithms, from two even spreads.
    """
    from scipy.optimize import least_squares, nnls

    if not 1 <= terms <= 12:
        raise InputError(f"terms is {terms!r}; expected 1 to 12 Gaussians")
    places = [curve.positions(c, 161) for c in range(curve.channels)]
    goals = [curve.edge(x)[:, c] for c, x in enumerate(places)]
    roots = [np.sqrt(np.gradient(x) / (x[-1] - x[0])) for x in places]

    def weights(log_v: np.ndarray) -> np.ndarray:
        found = np.empty((terms, curve.channels))
        for c, (x, goal, root) in enumerate(zip(places, goals, roots, strict=True)):
            columns = gaussians.line_integral(x, np.inf, np.exp(log_v), np.eye(terms))
            heavy = np.vstack([root[:, None] * columns, 100 * np.ones(terms)])
            found[:, c] = nnls(heavy, np.append(root * goal, 100.0), maxiter=500)[0]
        return found / found.sum(axis=0)

    def residual(log_v: np.ndarray) -> np.ndarray:
        w = weights(log_v)
        parts = []
        for c, (x, goal, root) in enumerate(zip(places, goals, roots, strict=True)):
            got = gaussians.line_integral(x, np.inf, np.exp(log_v), w[:, c : c + 1])[:, 0]
            parts.append(root * (got - goal))
        return np.concatenate(parts)

    shares = [np.interp([0.04, 0.97], *curve._quantiles(c)) for c in range(curve.channels)]
    low = np.log(min(s[0] for s in shares) ** 2 / 2)
    high = np.log(max(s[1] for s in shares) ** 2 / 2)
    best = None
    for inset in (0.0, 0.12):
        width = (high - low) * (1 - 2 * inset)
        start = low + (high - low) * inset + width * (np.arange(terms) + 0.5) / terms
        found = least_squares(residual, start, bounds=(low - 4, high + 3), max_nfev=60, xtol=1e-6)
        if best is None or found.cost < best.cost:
            best = found
    log_v = np.sort(best.x)
    fit = GaussianFit(np.exp(log_v), weights(log_v), np.zeros(curve.channels))
    return GaussianFit(fit.variance_mm2, fit.weights, edge_error(curve, fit.edge))


@dataclass(frozen=True, eq=False)
class BurleyFit:
    """Burley's profile: distance_mm (C,), d = 1 / s; error (C,): rms at a straight edge."""

    distance_mm: np.ndarray
    error: np.ndarray

    def edge(self, x_mm) -> np.ndarray:
        """The answer to a straight edge: (N,) -> (N, C)."""
        x = np.asarray(x_mm, float)
        far = np.full_like(x, np.inf)
        return np.stack([burley.line_integral(x, far, d) for d in self.distance_mm], axis=-1)


@lru_cache(maxsize=64)
def burley_distance(curve: Curve) -> BurleyFit:
    """The Burley distance of each channel that is nearest to a curve."""
    from scipy.optimize import minimize_scalar

    distances = []
    for c in range(curve.channels):
        x = curve.positions(c)
        goal = curve.edge(x)[:, c]

        def miss(log_d: float, x=x, goal=goal) -> float:
            got = burley.line_integral(x, np.full_like(x, np.inf), np.exp(log_d))
            return float(np.trapezoid((got - goal) ** 2, x))

        middle = np.log(curve.mean_radius()[c] / burley.MEAN_RADIUS)
        found = minimize_scalar(miss, bounds=(middle - 2.5, middle + 2.5), method="bounded")
        distances.append(float(np.exp(found.x)))
    fit = BurleyFit(np.array(distances), np.zeros(curve.channels))
    return BurleyFit(fit.distance_mm, edge_error(curve, fit.edge))
