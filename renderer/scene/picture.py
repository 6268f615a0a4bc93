"""How light becomes a picture: exposure, tone map, backdrop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

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
