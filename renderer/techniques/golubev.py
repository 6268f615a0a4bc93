"""Burley's normalised diffusion, importance sampled in screen space.

Golubev 2018, "Efficient screen-space subsurface scattering using Burley's normalized diffusion in
real-time", SIGGRAPH course Advances in Real-Time Rendering in Games. Radii by the inverse CDF of
the widest channel, angles by the golden ratio (a Fibonacci disc), one rotation a pixel, weights
that know depth, normalised by their sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from renderer.optics import burley, fits
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.base import Inputs
from renderer.techniques.screen import ScreenTechnique

GOLDEN = 0.618033988749895
FILTER_CDF = 0.997  # the share of the energy within the filter's radius


def disc(samples: int, distance_mm: float) -> np.ndarray:
    """Sample table (samples, 4): x, y in mm, radius in mm, 1 / (r R(r)) of the sampling channel up
    to a constant.
    """
    k = np.arange(samples)
    r = burley.inverse_cdf((k + 0.5) / samples, distance_mm)
    phi = 2 * np.pi * ((k * GOLDEN) % 1.0)
    s = 1 / distance_mm
    density = s * (np.exp(-s * r) + np.exp(-s * r / 3))
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), r, 1 / density])


@dataclass(frozen=True)
class Golubev(ScreenTechnique):
    """22 samples as in the thesis; distances fitted to the medium's curve unless given.

    weights "surface": R(r') over R(r), the estimator on the surface itself, whatever its tilt;
    "published": times r' / r, as in the published code, which takes far samples of a tilted
    surface for too many.
    """

    samples: int = parameter(
        22, unit="samples a pixel", low=1, high=256, source="thesis, ch. 5; 21 and 55 in HDRP 2018"
    )
    distance_mm: tuple[float, float, float] | None = parameter(
        (None, (1.0, 1.0, 1.0)),
        unit="mm, d = 1/s per channel",
        low=1e-3,
        high=100.0,
        source="fitted to the medium's curve where it is not given",
        optional=True,
    )
    scale: float = parameter(
        1.0,
        unit="mm of skin per mm of profile",
        low=0.01,
        high=20.0,
        source="HDRP world scale",
    )
    weights: str = parameter(
        "surface", choices=("surface", "published"), source="HDRP 2018 multiplies by r' / r"
    )

    name: ClassVar[str] = "golubev"
    title: ClassVar[str] = "Golubev"
    paper: ClassVar[str] = "Golubev 2018, SIGGRAPH course"

    def distances(self, curve: Curve) -> np.ndarray:
        """d per channel after scaling, mm: (3,)."""
        own = self.distance_mm
        distances = fits.burley_distance(curve).distance_mm if own is None else np.array(own)
        return distances * self.scale

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return fits.BurleyFit(self.distances(curve), np.zeros(3)).edge(x_mm)

    def filter_radius_mm(self, curve: Curve) -> float:
        """Radius that holds FILTER_CDF of the widest channel's energy."""
        return float(burley.inverse_cdf(FILTER_CDF, self.distances(curve).max()))

    def table(self, curve: Curve) -> np.ndarray:
        """The samples in the order in which they are taken: (samples, 4), see `disc`."""
        return disc(self.samples, float(self.distances(curve).max()))

    def support_mm(self, curve: Curve) -> float:
        return float(self.table(curve)[:, 2].max())

    def defines(self) -> dict[str, Any]:
        return {"SAMPLES": self.samples, "SURFACE_WEIGHTS": int(self.weights == "surface")}

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        return {
            "samples": self.table(inputs.curve),
            "shape": 1 / self.distances(inputs.curve),
            "filter_radius_mm": self.filter_radius_mm(inputs.curve),
        }

    def self_check(self, curve: Curve) -> None:
        u = (np.arange(self.samples) + 0.5) / self.samples
        widest = float(self.distances(curve).max())
        table = disc(self.samples, widest)
        assert np.allclose(burley.cdf(table[:, 2], widest), u, atol=1e-12)
        assert np.isfinite(table).all() and (np.diff(table[:, 2]) > 0).all()
