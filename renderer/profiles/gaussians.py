"""Skin as a sum of six Gaussians: R(r) = sum_i w_i G(v_i, r), G(v, r) = exp(-r^2 / 2v) / (2 pi v).

d'Eon and Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU Gems 3, chapter 14,
figure 14-13; three-layer skin. Each column of weights sums to 1: the surface's colour is kept in the albedo.
"""

from __future__ import annotations

import numpy as np

SKIN_VARIANCE_MM2 = np.array([0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41])
SKIN_WEIGHTS = np.array([  # rows: Gaussians, columns: R, G, B
    [0.233, 0.455, 0.649],
    [0.100, 0.336, 0.344],
    [0.118, 0.198, 0.000],
    [0.113, 0.007, 0.007],
    [0.358, 0.004, 0.000],
    [0.078, 0.000, 0.000],
])


def reflectance(r_mm: np.ndarray, variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS) -> np.ndarray:
    """R(r) in 1/mm^2: r_mm (N,) -> (N, 3)."""
    r = np.asarray(r_mm, dtype=float)[..., None]
    return np.exp(-r**2 / (2 * variance)) / (2 * np.pi * variance) @ weights


def line_integral(a_mm: np.ndarray, b_mm: np.ndarray, variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS) -> np.ndarray:
    """The pre-integrated 1-D kernel a_p(x) = int R(sqrt(x^2 + y^2)) dy, integrated from a to b: (N,) -> (N, 3).

    Jimenez et al. 2015, "Separable subsurface scattering", eq. 3.5's kernel, doi:10.1111/cgf.12529. For a sum of
    Gaussians it is the same sum of 1-D Gaussians.
    """
    from scipy.special import erf

    scale = np.sqrt(2 * variance)
    cdf = lambda x: 0.5 * (1 + erf(np.asarray(x, dtype=float)[..., None] / scale))  # noqa: E731
    return (cdf(b_mm) - cdf(a_mm)) @ weights


def mean_radius(variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS) -> np.ndarray:
    """<r> = int r R 2 pi r dr, mm per channel: (3,)."""
    return np.sqrt(np.pi * variance / 2) @ weights


def transmittance(thickness_mm: np.ndarray, published: bool = False, variance=SKIN_VARIANCE_MM2, weights=SKIN_WEIGHTS) -> np.ndarray:
    """T(d) of a slab lit from behind: (N,) -> (N, 3).

    Exact for this sum: int R(sqrt(r^2 + d^2)) 2 pi r dr = sum w exp(-d^2 / 2v). Jimenez et al. 2010 (eq. 3 there)
    and its shaders drop the 2: published=True.
    """
    d = np.asarray(thickness_mm, dtype=float)[..., None]
    return np.exp(-d**2 / ((1 if published else 2) * variance)) @ weights
