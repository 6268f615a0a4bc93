"""Poisson blurs of the light map.

Gosselin 2004, "Real-time skin rendering", Game Developers Conference; Sander, Gosselin and Mitchell
2004, "Real-time skin rendering on graphics hardware", SIGGRAPH sketches: light is drawn into the
texture atlas and blurred there several times by the same twelve taps and their middle, all colours
alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.optics import fits, gaussians
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.atlas import Atlas, AtlasTechnique

#: Twelve points of a Poisson disc, of radii below 1: the list that ATI's samples of those years
#: carry. The documents print none; whether Gosselin's own shader had this one is not known.
POISSON = np.array(
    [
        (-0.326212, -0.405810),
        (-0.840144, -0.073580),
        (-0.695914, 0.457137),
        (-0.203345, 0.620716),
        (0.962340, -0.194983),
        (0.473434, -0.480026),
        (0.519456, 0.767022),
        (0.185461, -0.893124),
        (0.507431, 0.064425),
        (0.896420, 0.412458),
        (-0.321940, -0.932615),
        (-0.791559, -0.597710),
    ]
)
#: The middle counts as one of thirteen (eq. 13 of the Portuguese chapter on both techniques).
COUNT = len(POISSON) + 1
#: Along each axis, of a radius of 1, about the taps' own mean: they lie off the middle.
MEAN = POISSON.sum(axis=0) / COUNT
VARIANCE = (POISSON**2).sum(axis=0) / COUNT - MEAN**2
_QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])


def disc(turns: int) -> np.ndarray:
    """The taps (12, 2) after a number of quarter turns."""
    return POISSON @ np.linalg.matrix_power(_QUARTER, turns % 4).T


@dataclass(frozen=True)
class Gosselin(AtlasTechnique):
    """The 2004 filter: `blurs` passes of thirteen reads, each from the one before.

    kernel "fitted": the radius at which all blurs together are as wide as the Gaussian, one for
    all channels, that is nearest to the medium's curve; "texels": radius_texels, whatever the
    medium and the size of the atlas, as printed (eq. 12: kernel_size scale_x + scale_y). turned:
    each pass takes the taps a quarter turn on, so that four passes neither move the light (the
    taps lie off the middle) nor widen it more along u than along v; without it, as printed.

    kernel_scale: where the material has a kernel_map (grey, an artist's), its value times the
    first, plus the second, is what of the radius each texel takes; where there is none it is white.
    specular "dimmed": highlights are multiplied by the luminance of the blurred light, as a share
    of specular_full times that of the strongest lamp, so that they fade softly where light does
    (eq. 18, where a lamp's colour would count twice); "own": they are those of all techniques.
    """

    blurs: int = parameter(
        4, unit="passes", low=1, high=32, source="several; the documents print no number"
    )
    kernel: str = parameter("fitted", choices=("fitted", "texels"), source="eq. 12: texels")
    radius_texels: float = parameter(
        4.0, unit="texels", low=0.1, high=256.0, source="an artist's; the documents print none"
    )
    turned: bool = parameter(True, source="the list's mean is (0.03, -0.10) radii off its middle")
    kernel_scale: tuple[float, float] = parameter(
        (1.0, 0.0), unit="of the radius", low=0.0, high=16.0, source="eq. 12: scale_x, scale_y"
    )
    specular: str = parameter("dimmed", choices=("dimmed", "own"), source="eq. 18: dimmed")
    specular_full: float = parameter(
        1.0, unit="of the strongest lamp's luminance", low=1e-3, high=1e3, source="1: white, eq. 18"
    )

    name: ClassVar[str] = "gosselin"
    title: ClassVar[str] = "Gosselin"
    paper: ClassVar[str] = "Gosselin 2004, GDC; Sander et al. 2004, SIGGRAPH sketches"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any(self.kernel_scale):
            raise InputError(
                f"{self.where('kernel_scale')} is (0, 0); expected one of them above 0"
            )

    @property
    def specular_white(self) -> float | None:
        return self.specular_full if self.specular == "dimmed" else None

    def radius_mm(self, curve: Curve) -> float:
        """Of one pass, for a medium's curve, before kernel_scale."""
        variance = float(fits.gaussian_sum(curve, 1).variance_mm2[0])
        return float(np.sqrt(variance / (self.blurs * VARIANCE.mean())))

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        """The Gaussian that the passes tend to where a map is white; of a kernel in texels nothing
        is known in mm.
        """
        radius_mm = sum(self.kernel_scale) * self.radius_mm(curve)
        variance = self.blurs * VARIANCE.mean() * radius_mm**2
        one = np.ones((1, curve.channels))
        return gaussians.line_integral(x_mm, np.inf, np.array([variance]), one)

    def taps(self) -> int:
        return COUNT * self.blurs

    def filter(self, atlas: Atlas) -> gl.Texture:
        texels = self.kernel == "texels"
        common = {
            "taps": len(POISSON),
            "stop": int(self.seams == "stop"),
            "even_mm": atlas.mean_texel_mm() if self.stretch == "none" or texels else 0.0,
            "kernel_map": atlas.drawn.maps["kernel_map"],
            "has_kernel_map": float("kernel_map" in atlas.drawn.item.primitive.material.maps),
            "kernel_scale": self.kernel_scale,
        }
        radius = self.radius_texels * common["even_mm"]
        radius = radius if texels else self.radius_mm(atlas.inputs.curve)
        source, targets = atlas.light, (atlas.target(), atlas.target())
        for k in range(self.blurs):
            into = targets[k % 2]
            offsets = disc(k if self.turned else 0) * radius
            atlas.draw(into, "techniques/gosselin.glsl", source=source, offsets=offsets, **common)
            source = into.textures[0]
        return source

    def self_check(self, curve: Curve) -> None:
        assert (np.linalg.norm(POISSON, axis=1) < 1).all()
        turned = np.sum([disc(k).sum(axis=0) for k in range(4)], axis=0)
        assert np.allclose(turned, 0, atol=1e-12)
        fitted = fits.gaussian_sum(curve, 1).variance_mm2[0]
        assert np.isclose(self.blurs * VARIANCE.mean() * self.radius_mm(curve) ** 2, fitted)
