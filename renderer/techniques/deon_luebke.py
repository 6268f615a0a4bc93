"""Texture-space sum of Gaussians.

d'Eon and Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU Gems 3, ch.
14: irradiance over the atlas, blurred by six Gaussians, each from the one before, with taps that
follow how far a texel stretches over the surface; half of the albedo before, half after.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.optics import fits
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.atlas import Atlas, AtlasTechnique, blur_of_blurs
from renderer.techniques.cascade import TAPS, TAPS_VARIANCE, steps


@dataclass(frozen=True)
class DeonLuebke(AtlasTechnique):
    """The 2007 filter.

    kernel "fitted": `terms` Gaussians nearest to the medium's curve; "published": the chapter's
    six, whatever the medium. first "blurred": the narrowest Gaussian is as wide as it is;
    "published": it is the map itself. Light that comes through thin parts is that of Jimenez 2010,
    in the place of the chapter's modified translucent shadow maps, which are not here.
    """

    kernel: str = parameter(
        "fitted", choices=("fitted", "published"), source="GPU Gems 3, sec. 14.3.2"
    )
    terms: int = parameter(6, unit="Gaussians", low=2, high=10, source="GPU Gems 3, sec. 14.3.2")
    first: str = parameter(
        "blurred", choices=("blurred", "published"), source="GPU Gems 3, sec. 14.4.3: unblurred"
    )
    texturing: float = parameter(
        0.5,
        unit="of the albedo's exponent before scattering",
        low=0.0,
        high=1.0,
        source="GPU Gems 3, sec. 14.4.5: pre- and post-scatter",
    )

    name: ClassVar[str] = "deon_luebke"
    title: ClassVar[str] = "d'Eon-Luebke"
    paper: ClassVar[str] = "d'Eon and Luebke 2007, GPU Gems 3, ch. 14"

    def fit(self, curve: Curve) -> fits.GaussianFit:
        """The Gaussians for a curve."""
        if self.kernel == "published":
            return fits.published_gaussians(curve)
        return fits.gaussian_sum(curve, self.terms)

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return self.fit(curve).edge(x_mm)

    def self_check(self, curve: Curve) -> None:
        fit = self.fit(curve)
        assert np.allclose(fit.weights.sum(axis=0), 1, atol=1e-9)
        reached = np.cumsum([sigma**2 * TAPS_VARIANCE for sigma, _ in steps(fit)])
        assert np.allclose(reached, fit.variance_mm2)

    def taps(self) -> int:
        terms = 6 if self.kernel == "published" else self.terms
        return 2 * len(TAPS) * (terms - (self.first == "published"))

    def filter(self, atlas: Atlas) -> gl.Texture:
        fit = self.fit(atlas.inputs.curve)
        blurs, unblurred = steps(fit), np.zeros(3)
        if self.first == "published":
            blurs, unblurred = blurs[1:], fit.weights[0]
        return blur_of_blurs(self, atlas, blurs, unblurred)
