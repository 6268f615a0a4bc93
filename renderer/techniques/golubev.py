"""Burley's normalised diffusion, importance sampled in screen space.

Golubev 2018, "Efficient screen-space subsurface scattering using Burley's normalized diffusion in
real-time", SIGGRAPH course Advances in Real-Time Rendering in Games. Radii by the inverse CDF of
the widest channel, angles by the golden ratio (a Fibonacci disc), one rotation a pixel, weights
that know depth, normalised by their sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.profiles import burley, gaussians
from renderer.techniques.base import Inputs, Scattered, Technique, output_formats, parameter

GOLDEN = 0.618033988749895
FILTER_CDF = 0.997  # the share of the energy within the filter's radius

# The same skin as the Gaussian techniques: the Burley profile of equal mean radius, per channel.
SKIN_DISTANCE_MM = tuple(
    round(float(d), 4) for d in burley.from_mean_radius(gaussians.mean_radius())
)


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
class Golubev(Technique):
    """Defaults: 22 samples as in the thesis; distances of the skin that the Gaussian techniques
    use.
    """

    samples: int = parameter(
        22, unit="samples a pixel", low=1, high=128, source="thesis, ch. 5; 21 and 55 in HDRP 2018"
    )
    distance_mm: tuple[float, float, float] = parameter(
        SKIN_DISTANCE_MM,
        unit="mm, d = 1/s per channel",
        low=1e-3,
        high=100.0,
        source="equal mean radius to d'Eon and Luebke 2007's skin",
    )
    scale: float = parameter(
        1.0, unit="mm of skin per mm of profile", low=0.01, high=20.0, source="HDRP world scale"
    )

    name: ClassVar[str] = "golubev"
    title: ClassVar[str] = "Golubev"
    paper: ClassVar[str] = "Golubev 2018, SIGGRAPH course"

    def distances(self) -> np.ndarray:
        """d per channel after scaling, mm: (3,)."""
        return np.array(self.distance_mm) * self.scale

    def filter_radius_mm(self) -> float:
        """Radius that holds FILTER_CDF of the widest channel's energy."""
        return float(burley.inverse_cdf(FILTER_CDF, self.distances().max()))

    def uniforms(self, inputs: Inputs) -> dict:
        """What the shader of every technique of this family takes."""
        return {
            "irradiance": inputs.irradiance,
            "depth_normal": inputs.depth_normal,
            "pixels_per_mm": inputs.pixels_per_mm,
            "shape": 1 / self.distances(),
            "filter_radius_mm": self.filter_radius_mm(),
        }

    def self_check(self) -> None:
        u = (np.arange(self.samples) + 0.5) / self.samples
        table = disc(self.samples, float(self.distances().max()))
        assert np.allclose(burley.cdf(table[:, 2], self.distances().max()), u, atol=1e-12)
        assert np.isfinite(table).all() and (np.diff(table[:, 2]) > 0).all()

    def scatter(self, inputs: Inputs) -> Scattered:
        program = inputs.programs("techniques/golubev.glsl", {"SAMPLES": self.samples})
        target = gl.Target(inputs.width, inputs.height, output_formats())
        target.bind()
        program.use(
            samples=disc(self.samples, float(self.distances().max())), **self.uniforms(inputs)
        )
        gl.draw_fullscreen(inputs.context)
        return Scattered(target)
