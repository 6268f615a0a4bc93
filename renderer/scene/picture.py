"""How light becomes a picture: exposure, tone map, backdrop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.parameters import Parameters, parameter

#: filmic: Narkowicz 2016, "ACES filmic tone mapping curve"; hable: Hable 2010, "Uncharted 2: HDR
#: lighting", GDC, white at 11.2; linear: cut off at 1.
TONE_MAPS = ("filmic", "hable", "linear")
BACKDROPS = ("vignette", "environment")


@dataclass(frozen=True)
class Picture(Parameters):
    """Exposure (a factor of radiance), tone map, and what is seen behind the objects.

    backdrop "vignette": radiance `centre` in the middle, `edge` at the border; "environment":
    the scene's environment itself.
    """

    called: ClassVar[str] = "picture"

    exposure: float = parameter(0.76, low=1e-6, high=1e6, source="chosen by eye")
    tone_map: str = parameter("filmic", choices=TONE_MAPS, source="Narkowicz 2016")
    backdrop: str = parameter("vignette", choices=BACKDROPS, source="a studio's")
    centre: tuple[float, float, float] = parameter(
        (0.115, 0.120, 0.130), unit="radiance", low=0.0, high=1e6, source="chosen by eye"
    )
    edge: tuple[float, float, float] = parameter(
        (0.022, 0.024, 0.028), unit="radiance", low=0.0, high=1e6, source="chosen by eye"
    )

    def encode(self, radiance: np.ndarray) -> np.ndarray:
        """Radiance (..., 3) as an image, uint8 sRGB; what passes/composite.frag does on the card.

        For pictures that are made of rays; the backdrop is the frame's alone.
        """
        x = self.exposure * np.asarray(radiance, float)
        if self.tone_map == "filmic":
            x = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
        elif self.tone_map == "hable":
            x = _hable_curve(2 * x) / _hable_curve(np.array(11.2))
        x = np.clip(x, 0, 1)
        srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
        return np.rint(255 * srgb).astype(np.uint8)


def _hable_curve(x: np.ndarray) -> np.ndarray:
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.50) + 0.06) - 0.02 / 0.30
