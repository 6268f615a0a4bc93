"""Skin as a sum of six Gaussians: R(r) = sum_i w_i G(v_i, r), G(v, r) = exp(-r^2 / 2v) / (2 pi v).

d'Eon and Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU Gems 3,
chapter 14, figure 14-13; three-layer skin. Each column of weights sums to 1: the surface's colour
is kept in the albedo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from renderer.errors import InputError

SKIN_VARIANCE_MM2 = np.array([0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41])
SKIN_WEIGHTS = np.array(
    [  # rows: Gaussians, columns: R, G, B
        [0.233, 0.455, 0.649],
        [0.100, 0.336, 0.344],
        [0.118, 0.198, 0.000],
        [0.113, 0.007, 0.007],
        [0.358, 0.004, 0.000],
        [0.078, 0.000, 0.000],
    ]
)


def reflectance(r_mm: np.ndarray, variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS) -> np.ndarray:
    """R(r) in 1/mm^2: r_mm (N,) -> (N, 3)."""
    r = np.asarray(r_mm, dtype=float)[..., None]
    return np.exp(-(r**2) / (2 * variance)) / (2 * np.pi * variance) @ weights


def line_integral(
    a_mm: np.ndarray, b_mm: np.ndarray, variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS
) -> np.ndarray:
    """The pre-integrated 1-D kernel a_p(x) = int R(sqrt(x^2 + y^2)) dy, integrated from a to b:
    (N,) -> (N, 3).

    Jimenez et al. 2015, "Separable subsurface scattering", eq. 3.5's kernel, doi:10.1111/cgf.12529.
    For a sum of Gaussians it is the same sum of 1-D Gaussians.
    """
    from scipy.special import erf

    scale = np.sqrt(2 * variance)
    cdf = lambda x: 0.5 * (1 + erf(np.asarray(x, dtype=float)[..., None] / scale))
    return (cdf(b_mm) - cdf(a_mm)) @ weights


def mean_radius(variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS) -> np.ndarray:
    """<r> = int r R 2 pi r dr, mm per channel: (3,)."""
    return np.sqrt(np.pi * variance / 2) @ weights


def transmittance(
    thickness_mm: np.ndarray,
    published: bool = False,
    variance=SKIN_VARIANCE_MM2,
    weights=SKIN_WEIGHTS,
) -> np.ndarray:
    """T(d) of a slab lit from behind: (N,) -> (N, 3).

    Exact for this sum: int R(sqrt(r^2 + d^2)) 2 pi r dr = sum w exp(-d^2 / 2v). Jimenez et al. 2010
    (eq. 3 there) and its shaders drop the 2: published=True.
    """
    d = np.asarray(thickness_mm, dtype=float)[..., None]
    return np.exp(-(d**2) / ((1 if published else 2) * variance)) @ weights


def radial_error(r_mm, target, approximation) -> np.ndarray:
    """E = sqrt(int r (R - G)^2 dr) / sqrt(int r R^2 dr) per channel (Vuletic eq.

    3.1): (N,), (N, C), (N, C) -> (C,).
    """
    r = np.asarray(r_mm, dtype=float)[:, None]
    return np.sqrt(
        np.trapezoid(r * (target - approximation) ** 2, r, axis=0)
        / np.trapezoid(r * target**2, r, axis=0)
    )


@dataclass(frozen=True)
class Fit:
    """A sum of Gaussians: variance_mm2 (K,), weights (K,) >= 0, their prescribed sum, and the error
    of eq. 3.1.
    """

    variance_mm2: np.ndarray
    weights: np.ndarray
    error: float

    def reflectance(self, r_mm) -> np.ndarray:
        """(N,) -> (N,), 1/mm^2."""
        return reflectance(r_mm, self.variance_mm2, self.weights)


def fit(r_mm, target, terms: int, total: float | None) -> Fit:
    """The best sum of `terms` Gaussians with weights >= 0 that sum to `total` (None: free), by the
    error of eq. 3.1.

    r_mm (N,): increasing, from near 0 to where the profile is spent; target (N,): R(r), 1/mm^2.
    d'Eon, Luebke and Enderton 2007, "Efficient rendering of human skin", sec. 5: min int r (R -
    G)^2 dr over weights and variances. Starts are even spreads and what non-negative least squares
    picks from a dense set of variances; each is refined by a trust region over log v and log w, and
    the best is returned.
    """
    from scipy.optimize import least_squares, nnls

    r, target = np.asarray(r_mm, dtype=float), np.asarray(target, dtype=float)
    if isinstance(terms, bool) or not isinstance(terms, (int, np.integer)) or not 1 <= terms <= 20:
        raise InputError(f"terms is {terms!r}; expected a whole number of Gaussians, 1 to 20")
    if (
        r.ndim != 1
        or r.shape != target.shape
        or len(r) < 4 * terms
        or not (np.diff(r) > 0).all()
        or r[0] < 0
    ):
        raise InputError(
            f"expected increasing radii and as many values, at least {4 * terms} for {terms} "
            "Gaussians"
        )
    if not np.isfinite(target).all() or (total is not None and not 0 < total < np.inf):
        raise InputError("a profile to fit has to be finite with a positive total")
    root = np.sqrt(np.gradient(r) * r)  # of the trapezium rule's weights in int r (...)^2 dr
    scale = np.linalg.norm(root * target)
    goal = root * target / scale

    mass = np.cumsum(r * target * np.gradient(r))
    low, high = np.log(
        np.interp([0.01, 0.98], mass / mass[-1], r) ** 2 / 2
    )  # log variances of the profile's own size

    def basis(log_v):
        v = np.exp(log_v)
        return root[:, None] * np.exp(-(r[:, None] ** 2) / (2 * v)) / (2 * np.pi * v) / scale

    def weights(log_w):
        w = np.exp(np.clip(log_w, -60, 60))
        return w if total is None else w / w.sum() * total

    def residual(p):
        return basis(p[:terms]) @ weights(p[terms:]) - goal

    def project(log_v):
        """Non-negative least squares, with the sum as a heavy row."""
        columns, right = basis(log_v), goal
        if total is not None:
            columns, right = (
                np.vstack([columns, 100 * np.ones(len(log_v)) / total]),
                np.append(goal, 100.0),
            )
        size = np.linalg.norm(columns, axis=0)
        return nnls(columns / size, right, maxiter=100 * len(log_v))[0] / size

    dense = np.linspace(low - 3, high + 2, 60)
    share = np.cumsum(project(dense) + 1e-9)
    starts = [np.interp((np.arange(terms) + 0.5) / terms, share / share[-1], dense)]
    for inset in (0.0, 0.15, 0.3):
        width = (high - low) * (1 - 2 * inset)
        starts.append(low + (high - low) * inset + width * (np.arange(terms) + 0.5) / terms)
    best = None
    for start in starts:
        start = start + 1e-3 * np.arange(terms)
        first = np.log(np.maximum(project(start), 1e-3 * target.max() * np.exp(low)))
        # A term that the profile does not need would run away: variances stay near the profile's
        # own.
        bounds = np.repeat([low - 4, -60.0], terms), np.repeat([high + 3, 60.0], terms)
        solution = least_squares(
            residual,
            np.clip(np.concatenate([start, first]), *bounds),
            bounds=bounds,
            max_nfev=1000,
            xtol=1e-11,
            ftol=1e-11,
        )
        if solution.success and (best is None or solution.cost < best.cost):
            best = solution
    if best is None:
        raise ArithmeticError(f"the fit of {terms} Gaussians did not converge")
    order = np.argsort(best.x[:terms])
    variance, w = np.exp(best.x[:terms])[order], weights(best.x[terms:])[order]
    got = reflectance(r, variance, w)
    return Fit(variance, w, float(radial_error(r, target[:, None], got[:, None])[0]))
