"""Burley's normalised diffusion, importance sampled in screen space.

Golubev 2018, "Efficient screen-space subsurface scattering using Burley's normalized diffusion in
real-time", SIGGRAPH course Advances in Real-Time Rendering in Games. Radii by the inverse CDF of
the widest channel, angles by the golden ratio (a Fibonacci disc), one rotation a pixel, weights
that know depth, normalised by their sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from renderer.optics import burley, fits, media
from renderer.optics.curve import Curve
from renderer.optics.medium import Stack
from renderer.parameters import parameter
from renderer.techniques.base import Inputs
from renderer.techniques.rotated import GOLDEN, RotatedTechnique

FILTER_CDF = 0.997  # the share of the energy within the filter's radius


@dataclass(frozen=True)
class BurleyFilter(RotatedTechnique):
    """What the filters share whose kernel is Burley's profile: its distances, unless given those
    that `parametrisation` has: "fitted" to the medium's curve, or what Burley's published fits say
    of the albedo and the length of the index-matched medium nearest to that curve (light straight
    down by mean free path or by diffuse mean free path, light from everywhere).
    """

    distance_mm: tuple[float, float, float] | None = parameter(
        (None, (1.0, 1.0, 1.0)),
        unit="mm, d = 1/s per channel",
        low=1e-3,
        high=100.0,
        source="fitted to the medium's curve where it is not given",
        optional=True,
    )
    parametrisation: str = parameter(
        "fitted",
        choices=("fitted", *burley.PARAMETRISATIONS),
        source="thesis, eqs. 2.86, 2.88, 2.89: mfp, dmfp, diffuse; Burley 2015",
    )
    scale: float = parameter(
        1.0,
        unit="mm of skin per mm of profile",
        low=0.01,
        high=20.0,
        source="HDRP world scale",
    )
    texturing: float = parameter(
        0.5,
        unit="of the albedo's exponent before scattering",
        low=0.0,
        high=1.0,
        source="HDRP's default profile: pre- and post-scatter",
    )

    def distances(self, curve: Curve) -> np.ndarray:
        """d per channel after scaling, mm: (3,)."""
        if self.distance_mm is not None:
            distances = np.array(self.distance_mm)
        elif self.parametrisation == "fitted":
            distances = fits.burley_distance(curve).distance_mm
        else:
            distances = _parametrised(curve, self.parametrisation)
        return distances * self.scale

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return fits.BurleyFit(self.distances(curve), np.zeros(3)).edge(x_mm)

    def filter_radius_mm(self, curve: Curve) -> float:
        """Radius that holds FILTER_CDF of the widest channel's energy."""
        return float(burley.inverse_cdf(FILTER_CDF, self.distances(curve).max()))


@lru_cache(maxsize=64)
def _parametrised(curve: Curve, parametrisation: str) -> np.ndarray:
    """d of Burley's published fits for the medium nearest to a curve, mm: (C,)."""
    medium = media.invert(curve).medium
    return burley.Burley(Stack.of(medium), parametrisation).distance_mm()


@dataclass(frozen=True)
class BurleyDisc(BurleyFilter):
    """What the techniques share that take samples of Burley's profile over a disc.

    weights "surface": R(r') over R(r), the estimator on the surface itself, whatever its tilt;
    "published": times r' / r, as in the published code, which takes far samples of a tilted surface
    for too many. disc "camera": it faces the camera; "tangent": it lies in the surface's tangent
    plane, from differences of depth.
    """

    weights: str = parameter(
        "surface", choices=("surface", "published"), source="HDRP 2018 multiplies by r' / r"
    )
    disc: str = parameter(
        "camera", choices=("camera", "tangent"), source="thesis, sec. 3.4 and fig. 3.11: camera"
    )

    def farthest_mm(self, curve: Curve, samples: int) -> float:
        """The radius of the farthest of so many samples; on a tilted disc a little more is seen."""
        widest = float(self.distances(curve).max())
        margin = 1.05 if self.disc == "tangent" else 1.0
        return margin * float(burley.inverse_cdf(1 - 0.5 / samples, widest))

    def defines(self) -> dict[str, Any]:
        return {
            "SURFACE_WEIGHTS": int(self.weights == "surface"),
            "TANGENT_DISC": int(self.disc == "tangent"),
        }

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        return {
            "shape": 1 / self.distances(inputs.curve),
            "filter_radius_mm": self.filter_radius_mm(inputs.curve),
        }


@dataclass(frozen=True)
class Golubev(BurleyDisc):
    """22 samples as in the thesis.

    angles "fibonacci": by the golden ratio; "random": at random, the same for all pixels but for
    their rotation.
    """

    samples: int = parameter(
        22, unit="samples a pixel", low=1, high=256, source="thesis, ch. 5; 21 and 55 in HDRP 2018"
    )
    angles: str = parameter(
        "fibonacci", choices=("fibonacci", "random"), source="thesis, sec. 3.4 and fig. 3.9"
    )
    seed: int = parameter(0, low=0, high=2**31 - 1, source="of random angles")

    name: ClassVar[str] = "golubev"
    title: ClassVar[str] = "Golubev"
    paper: ClassVar[str] = "Golubev 2018, SIGGRAPH course"

    def support_mm(self, curve: Curve) -> float:
        return self.farthest_mm(curve, self.samples)

    def sample_set(self, curve: Curve, count: int, first: int) -> np.ndarray:
        """Samples (count, 4): x, y in mm, radius in mm, 1 / (r R(r)) of the sampling channel, which
        is the widest, up to a constant; their angles are numbers `first` on.
        """
        distance = float(self.distances(curve).max())
        r = burley.inverse_cdf((np.arange(count) + 0.5) / count, distance)
        if self.angles == "random":
            turns = np.random.default_rng(self.seed).random(first + count)[first:]
        else:
            turns = (first + np.arange(count)) * GOLDEN % 1.0
        phi = 2 * np.pi * turns
        s = 1 / distance
        density = s * (np.exp(-s * r) + np.exp(-s * r / 3))
        return np.column_stack([r * np.cos(phi), r * np.sin(phi), r, 1 / density])

    def defines(self) -> dict[str, Any]:
        return {**super().defines(), "SAMPLES": self.samples}

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        samples = self.sample_set(inputs.curve, self.samples, 0)
        return {**super().uniforms(inputs), "samples": samples}

    def self_check(self, curve: Curve) -> None:
        u = (np.arange(self.samples) + 0.5) / self.samples
        widest = float(self.distances(curve).max())
        table = self.sample_set(curve, self.samples, 0)
        assert np.allclose(burley.cdf(table[:, 2], widest), u, atol=1e-12)
        assert np.isfinite(table).all() and (np.diff(table[:, 2]) > 0).all()
