"""Burley's normalised diffusion: R(r) = A s (exp(-s r) + exp(-s r / 3)) / (8 pi r), s = 1 / d.

Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface scattering", Pixar
technical memo 15-04; inverse CDF in closed form: Golubev 2018, "Sampling Burley's normalized diffusion profiles".
"""

from __future__ import annotations

import numpy as np

MEAN_RADIUS = 2.5  # <r> = 2.5 d


def reflectance(r_mm, d_mm, albedo=1.0):
    """R(r) in 1/mm^2, singular at 0."""
    r, s = np.asarray(r_mm, dtype=float), 1 / np.asarray(d_mm, dtype=float)
    return albedo * s * (np.exp(-s * r) + np.exp(-s * r / 3)) / (8 * np.pi * r)


def cdf(r_mm, d_mm=1.0):
    """P(r), the share of the energy within r: 1 - exp(-sr)/4 - 3 exp(-sr/3)/4."""
    x = np.asarray(r_mm, dtype=float) / d_mm
    return 1 - 0.25 * np.exp(-x) - 0.75 * np.exp(-x / 3)


def inverse_cdf(u, d_mm=1.0):
    """r with P(r) = u, u in [0, 1). The thesis's eq. 3.12 prints both exponents as -1/3; one is +1/3."""
    u = 1 - np.asarray(u, dtype=float)
    g = 1 + 4 * u * (2 * u + np.sqrt(1 + 4 * u * u))
    return 3 * np.log((1 + g ** (-1 / 3) + g ** (1 / 3)) / (4 * u)) * d_mm


def from_mean_radius(mean_radius_mm):
    """The scatter distance d, mm, of the Burley profile with this mean radius."""
    return np.asarray(mean_radius_mm, dtype=float) / MEAN_RADIUS
