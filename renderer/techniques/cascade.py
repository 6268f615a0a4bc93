"""A sum of Gaussians by blurs of blurs, seven taps an axis: what atlas and screen filters share.

d'Eon and Luebke 2007, GPU Gems 3, ch. 14.4: each Gaussian is the one before, blurred by the
difference of their variances, along one axis and then the other.
"""

from __future__ import annotations

import numpy as np

from renderer.optics.fits import GaussianFit

#: At -3 to 3 sigma, of sum 1. GPU Gems 3 prints 0.383 in the middle (sum 1.001), Jimenez's shader
#: 0.382.
TAPS = np.array([0.006, 0.061, 0.242, 0.382, 0.242, 0.061, 0.006])
#: Of the taps, in sigma^2: 1.079, divided out of each step.
TAPS_VARIANCE = float((TAPS * np.arange(-3, 4) ** 2).sum() / TAPS.sum())

#: Shaders of the weighted sum: what it starts from, and one more blur.
START, ADD = "techniques/weighted_start.glsl", "techniques/weighted_add.glsl"


def gaussian_taps(count: int) -> tuple[np.ndarray, float, float]:
    """(weights (count,) of sum 1, spacing in sigma, variance in sigma^2) of taps over 3 sigma."""
    at = np.linspace(-3, 3, count)
    weights = np.exp(-(at**2) / 2)
    weights /= weights.sum()
    return weights, 6 / (count - 1), float((weights * at**2).sum())


def steps(fit: GaussianFit, variance: float = TAPS_VARIANCE) -> list[tuple[float, np.ndarray]]:
    """(sigma in mm of the blur that leads there, weight (C,)) of each Gaussian, narrowest first.

    variance: of the taps that blur, in sigma^2.
    """
    before = np.concatenate([[0.0], fit.variance_mm2[:-1]])
    sigma = np.sqrt((fit.variance_mm2 - before) / variance)
    return list(zip(sigma.tolist(), fit.weights, strict=True))
