"""Golubev's filter with as many samples as its disc has pixels for.

Golubev 2020, in Unity's High Definition Render Pipeline, his successor to the filter of 2018: a
sample for every four pixels of the disc that holds 99.7 % of the light, up to a budget of 20, 40 or
80 (low, medium, high quality); radii by the closed inverse of the CDF (Golubev 2019, "Sampling
Burley's normalized diffusion profiles"), evaluated in the shader.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from renderer.optics import burley
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.base import Inputs
from renderer.techniques.golubev import BurleyDisc


@dataclass(frozen=True)
class GolubevAdaptive(BurleyDisc):
    """n = min(pi (r px/mm)^2 / pixels_per_sample, budget) samples; the light itself below one."""

    budget: int = parameter(
        40, unit="samples a pixel", low=1, high=1000, source="HDRP 2020: 20, 40 or 80; medium"
    )
    pixels_per_sample: float = parameter(
        4.0, unit="pixels of the disc", low=0.01, high=1000.0, source="HDRP 2020"
    )

    name: ClassVar[str] = "golubev_adaptive"
    title: ClassVar[str] = "Golubev Adaptive"
    paper: ClassVar[str] = "Golubev 2020, Unity HDRP; Golubev 2019, Sampling Burley's profiles"

    def support_mm(self, curve: Curve) -> float:
        return self.farthest_mm(curve, self.budget)

    def samples_at(self, curve: Curve, pixels_per_mm: float) -> int:
        """Samples of a pixel where so many pixels cover a millimetre of a facing surface."""
        area = np.pi * (self.filter_radius_mm(curve) * pixels_per_mm) ** 2
        return min(int(area / self.pixels_per_sample), self.budget)

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        return {
            **super().uniforms(inputs),
            "distance_mm": float(self.distances(inputs.curve).max()),
            "budget": self.budget,
            "pixels_per_sample": self.pixels_per_sample,
        }

    def self_check(self, curve: Curve) -> None:
        u = (np.arange(self.budget) + 0.5) / self.budget
        widest = float(self.distances(curve).max())
        assert np.allclose(burley.cdf(burley.inverse_cdf(u, widest), widest), u, atol=1e-12)
