"""A sum of Gaussians by blurs of blurs, seven taps an axis: what atlas and screen filters share.

d'Eon and Luebke 2007, GPU Gems 3, ch. 14.4: each Gaussian is the one before, blurred by the
difference of their variances, along one axis and then the other.
"""

from __future__ import annotations

import numpy as np

from renderer.optics import fits
from renderer.optics.curve import Curve

#: At -3 to 3 sigma, of sum 1. GPU Gems 3 prints 0.383 in the middle (sum 1.001), Jimenez's shader
#: 0.382.
TAPS = np.array([0.006, 0.061, 0.242, 0.382, 0.242, 0.061, 0.006])
TAPS /= TAPS.sum()
#: Of the taps, in sigma^2: 1.079, divided out of each step.
TAPS_VARIANCE = float((TAPS * np.arange(-3, 4) ** 2).sum())

#: Shaders of the weighted sum: what it starts from, and one more blur.
START, ADD = "techniques/weighted_start.glsl", "techniques/weighted_add.glsl"


def gaussian_taps(count: int) -> tuple[np.ndarray, float, float]:
    """(weights (count,) of sum 1, spacing in sigma, variance in sigma^2) of taps over 3 sigma."""
    at = np.linspace(-3, 3, count)
    weights = np.exp(-(at**2) / 2)
    weights /= weights.sum()
    return weights, 6 / (count - 1), float((weights * at**2).sum())


def steps(fit: fits.GaussianFit, variance: float = TAPS_VARIANCE) -> list[tuple[float, np.ndarray]]:
    """(sigma in mm of the blur that leads there, weight (C,)) of each Gaussian, narrowest first.

    variance: of the taps that blur, in sigma^2.
    """
    before = np.concatenate([[0.0], fit.variance_mm2[:-1]])
    sigma = np.sqrt((fit.variance_mm2 - before) / variance)
    return list(zip(sigma.tolist(), fit.weights, strict=True))


class SumOfGaussians:
    """The kernel of a technique that blurs so: a mixin, for its own fields of these names.

    kernel "fitted": `terms` Gaussians nearest to the medium's curve; "published": d'Eon and
    Luebke's six, whatever the medium. first "blurred": the narrowest Gaussian is as wide as it is;
    "published": it is the light itself, not blurred.
    """

    kernel: str = "fitted"
    terms: int
    first: str = "blurred"

    def fit(self, curve: Curve) -> fits.GaussianFit:
        """The Gaussians for a curve."""
        if self.kernel == "published":
            return fits.published_gaussians(curve)
        return fits.gaussian_sum(curve, self.terms)

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return self.fit(curve).edge(x_mm)

    def axis_taps(self) -> tuple[np.ndarray, float, float]:
        """(weights, spacing in sigma, variance in sigma^2) of the taps along an axis."""
        return TAPS, 1.0, TAPS_VARIANCE

    def blurs(self, fit: fits.GaussianFit) -> tuple[list[tuple[float, np.ndarray]], np.ndarray]:
        """(incremental sigma in mm, weight (C,)) of each blur, and the unblurred light's weight."""
        blurs = steps(fit, self.axis_taps()[2])
        if self.first == "published":
            return blurs[1:], fit.weights[0]
        return blurs, np.zeros(fit.weights.shape[1])

    def reads(self) -> int:
        """Texture reads that a pixel or texel takes."""
        terms = 6 if self.kernel == "published" else self.terms
        return 2 * len(self.axis_taps()[0]) * (terms - (self.first == "published"))

    def self_check(self, curve: Curve) -> None:
        fit = self.fit(curve)
        assert np.allclose(fit.weights.sum(axis=0), 1, atol=1e-9)
        taps, _, variance = self.axis_taps()
        blurs, _ = self.blurs(fit)
        skipped = fit.variance_mm2[0] if self.first == "published" else 0.0
        reached = skipped + np.cumsum([sigma**2 * variance for sigma, _ in blurs])
        assert np.allclose(reached, fit.variance_mm2[-len(blurs) :])
        assert np.allclose(taps, taps[::-1]) and np.isclose(taps.sum(), 1)
