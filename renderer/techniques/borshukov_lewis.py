"""Blurred light maps, with which filtering in texture space began.

Borshukov and Lewis 2003, "Realistic human face rendering for The Matrix Reloaded", SIGGRAPH
sketches, doi:10.1145/965400.965470: light is drawn into the texture atlas, blurred there, more in
red than in green and blue, and looked up when the face is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.optics import fits
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.atlas import MOST_TAPS, Atlas, AtlasTechnique, blur_of_blurs
from renderer.techniques.base import odd
from renderer.techniques.cascade import gaussian_taps, steps


@dataclass(frozen=True)
class BorshukovLewis(AtlasTechnique):
    """Blurs of the light map: a narrow and a broad one by default.

    The sketch prints no constants of its kernel: `terms` Gaussians are fitted to the medium's
    curve. Its blur knows no stretch of the texture (stretch = "none"); the default keeps
    millimetres. A broad Gaussian right after a narrow one needs more than seven taps.
    """

    terms: int = parameter(
        2, unit="Gaussians", low=1, high=10, source="narrow and broad; the sketch prints none"
    )

    taps_per_axis: int = parameter(
        25, unit="taps", low=5, high=MOST_TAPS, source="over 6 sigma; the sketch prints none"
    )

    name: ClassVar[str] = "borshukov_lewis"
    title: ClassVar[str] = "Light-map blur"
    paper: ClassVar[str] = "Borshukov and Lewis 2003, doi:10.1145/965400.965470"

    def __post_init__(self) -> None:
        super().__post_init__()
        odd("borshukov_lewis.taps_per_axis", self.taps_per_axis)

    def fit(self, curve: Curve) -> fits.GaussianFit:
        """The Gaussians for a curve."""
        return fits.gaussian_sum(curve, self.terms)

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return self.fit(curve).edge(x_mm)

    def self_check(self, curve: Curve) -> None:
        fit = self.fit(curve)
        assert np.allclose(fit.weights.sum(axis=0), 1, atol=1e-9)
        _, _, variance = gaussian_taps(self.taps_per_axis)
        reached = np.cumsum([sigma**2 * variance for sigma, _ in steps(fit, variance)])
        assert np.allclose(reached, fit.variance_mm2)

    def taps(self) -> int:
        return 2 * self.taps_per_axis * self.terms

    def filter(self, atlas: Atlas) -> gl.Texture:
        taps, spacing, variance = gaussian_taps(self.taps_per_axis)
        blurs = steps(self.fit(atlas.inputs.curve), variance)
        return blur_of_blurs(self, atlas, blurs, np.zeros(3), taps, spacing)
