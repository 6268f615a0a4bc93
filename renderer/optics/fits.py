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
from renderer.optics import curve as curves
from renderer.optics.curve import Curve, edge_error
from renderer.optics.dipole import pole
from renderer.optics.fresnel import extrapolation


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
        solved = np.empty((terms, curve.channels))
        for c, (x, goal, root) in enumerate(zip(places, goals, roots, strict=True)):
            columns = gaussians.line_integral(x, np.inf, np.exp(log_v), np.eye(terms))
            heavy = np.vstack([root[:, None] * columns, 100 * np.ones(terms)])
            solved[:, c] = nnls(heavy, np.append(root * goal, 100.0), maxiter=500)[0]
        return solved / solved.sum(axis=0)

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
        solution = least_squares(
            residual, start, bounds=(low - 4, high + 3), max_nfev=60, xtol=1e-6
        )
        if best is None or solution.cost < best.cost:
            best = solution
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
        minimum = minimize_scalar(miss, bounds=(middle - 2.5, middle + 2.5), method="bounded")
        distances.append(float(np.exp(minimum.x)))
    fit = BurleyFit(np.array(distances), np.zeros(curve.channels))
    return BurleyFit(fit.distance_mm, edge_error(curve, fit.edge))


@dataclass(frozen=True, eq=False)
class DipoleFit:
    """Jensen et al. 2001's dipole, normalised: depths of the real and the virtual source.

    real_mm, virtual_mm, sigma_tr (C,): mm, mm, 1/mm; error (C,): rms at a straight edge.
    """

    real_mm: np.ndarray
    virtual_mm: np.ndarray
    sigma_tr: np.ndarray
    error: np.ndarray

    def _total(self) -> np.ndarray:
        depths = np.stack([self.real_mm, self.virtual_mm])
        return 0.5 * np.exp(-self.sigma_tr * depths).sum(axis=0)

    def density(self, r_mm) -> np.ndarray:
        """Share of the light that leaves per mm2 at a radius: (N,) -> (N, C)."""
        r = np.asarray(r_mm, float)[:, None]
        total = pole(r, self.real_mm, self.sigma_tr) + pole(r, self.virtual_mm, self.sigma_tr)
        return total / self._total()

    def cdf(self, r_mm) -> np.ndarray:
        """Share of the light that leaves within a radius: (N,) -> (N, C).

        The flux of a pole at depth z through a disc is (exp(-s z) - z / d exp(-s d)) / 2.
        """
        r = np.asarray(r_mm, float)[:, None]
        share = np.zeros((len(r), len(self.sigma_tr)))
        for z in (self.real_mm, self.virtual_mm):
            d = np.hypot(r, z)
            share += 0.5 * (np.exp(-self.sigma_tr * z) - z / d * np.exp(-self.sigma_tr * d))
        return share / self._total()

    def curve(self) -> Curve:
        """Its rings, which answer to edges."""
        reach = float((self.virtual_mm + 12 / self.sigma_tr).max())
        return curves.from_cdf("dipole", self.cdf, reach, float(self.real_mm.min()) / 40)

    def edge(self, x_mm) -> np.ndarray:
        """The answer to a straight edge: (N,) -> (N, C)."""
        return self.curve().edge(x_mm)

    def radius(self, share: float) -> np.ndarray:
        """The radius that holds a share of the light: (C,) mm."""
        r = np.geomspace(1e-3, (self.virtual_mm + 20 / self.sigma_tr).max(), 4000)
        inside = self.cdf(r)
        return np.array([np.interp(share, inside[:, c], r) for c in range(inside.shape[1])])


#: (1 + F_dr) / (1 - F_dr) of a smooth face of index 1.4: where the virtual source of a fit lies.
_EXTRAPOLATION = extrapolation(1.4)


def _dipole(mfp_mm: np.ndarray, albedo: np.ndarray) -> DipoleFit:
    """The dipole of reduced mean free paths and reduced albedos (C,) below an index of 1.4."""
    mfp, sigma_tr = np.asarray(mfp_mm, float), np.sqrt(3 * (1 - albedo)) / mfp_mm
    virtual = mfp * (1 + 4 * _EXTRAPOLATION / 3)
    return DipoleFit(mfp, virtual, sigma_tr, np.zeros(len(mfp)))


@lru_cache(maxsize=64)
def dipole(curve: Curve) -> DipoleFit:
    """The dipole of each channel nearest to a curve: mean free path and reduced albedo are free."""
    from scipy.optimize import minimize

    solutions = []
    for c in range(curve.channels):
        x = curve.positions(c, 121)
        goal = curve.edge(x)[:, c]

        def miss(p: np.ndarray, x=x, goal=goal) -> float:
            one = _dipole(np.exp(p[:1]), 1 / (1 + np.exp(-p[1:])))
            return float(np.trapezoid((one.edge(x)[:, 0] - goal) ** 2, x))

        start = [np.log(0.5 * curve.mean_radius()[c]), 2.0]
        solutions.append(minimize(miss, start, method="Nelder-Mead", options={"maxiter": 120}).x)
    log_mfp, logit = np.transpose(solutions)
    fit = _dipole(np.exp(log_mfp), 1 / (1 + np.exp(-logit)))
    return DipoleFit(fit.real_mm, fit.virtual_mm, fit.sigma_tr, edge_error(curve, fit.edge))
