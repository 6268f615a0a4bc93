"""How light becomes a picture: exposure, tone map, backdrop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.parameters import Parameters, parameter

#: filmic: Narkowicz 2016, "ACES filmic tone mapping curve"; hable: Hable 2010, "Uncharted 2: HDR
#: lighting", GDC, white at 11.2; linear: cut off at 1; agx: Sobotka's AgX, a curve over logarithms
#: of mixed primaries, so that bright skin goes pale and not yellow, by the polynomial fit that is
#: widely used (mean error 3.7e-6); neutral: Khronos 2024, "PBR Neutral", which keeps hues and
#: changes nothing below .76.
TONE_MAPS = ("filmic", "hable", "linear", "agx", "neutral")
BACKDROPS = ("vignette", "environment")


@dataclass(frozen=True)
class Picture(Parameters):
    """Exposure (a factor of radiance), tone map, and what is seen behind the objects.

    What the tone map gives is graded as by the ASC CDL (version 1.2): `saturation` about the luma
    of Rec. 709, then the `power`. `grain` is the standard deviation of a film's grain, of the
    encoded values, by the pixel alone: the same for every technique.
    backdrop "vignette": radiance `centre` in the middle, `edge` at the border; "environment":
    the scene's environment itself.
    """

    called: ClassVar[str] = "picture"

    exposure: float = parameter(0.76, low=1e-6, high=1e6, source="chosen by eye")
    tone_map: str = parameter("filmic", choices=TONE_MAPS, source="Narkowicz 2016")
    saturation: float = parameter(1.0, low=0.0, high=4.0, source="ASC CDL")
    power: float = parameter(1.0, low=0.2, high=5.0, source="ASC CDL")
    grain: float = parameter(0.0, unit="of white", low=0.0, high=0.2, source="none")
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
        x = _CURVES[self.tone_map](self.exposure * np.asarray(radiance, float))
        x = np.clip(x, 0, 1)
        luma = x @ LUMA
        x = np.clip(luma[..., None] + self.saturation * (x - luma[..., None]), 0, 1) ** self.power
        srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
        return np.rint(255 * srgb).astype(np.uint8)


LUMA = np.array([0.2126, 0.7152, 0.0722])


def _filmic(x: np.ndarray) -> np.ndarray:
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)


def _hable_curve(x: np.ndarray) -> np.ndarray:
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.50) + 0.06) - 0.02 / 0.30


def _hable(x: np.ndarray) -> np.ndarray:
    return _hable_curve(2 * x) / _hable_curve(np.array(11.2))


# AgX over linear Rec. 2020; columns of the matrices are the primaries.
_TO_REC2020 = np.array(
    [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0113], [0.0164, 0.0880, 0.8956]]
)
_INSET = np.array(
    [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ]
)
_OUTSET = np.array(
    [
        [1.1271005818144368, -0.11060664309660323, -0.016493938717834573],
        [-0.1413297634984383, 1.157823702216272, -0.016493938717834257],
        [-0.14132976349843826, -0.11060664309660294, 1.2519364065950405],
    ]
)
_AGX_STOPS = (-12.47393, 4.026069)  # log2 of the darkest and of the brightest radiance
#: The same as the composite's uniforms.
AGX = {
    "agx_in": _INSET @ _TO_REC2020,
    "agx_out": _OUTSET,
    "from_rec2020": np.linalg.inv(_TO_REC2020),
    "agx_stops": _AGX_STOPS,
}


def _agx(x: np.ndarray) -> np.ndarray:
    x = np.maximum(np.maximum(x, 0) @ AGX["agx_in"].T, 1e-10)
    low, high = _AGX_STOPS
    x = np.clip((np.log2(x) - low) / (high - low), 0, 1)
    x = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    x = np.maximum(x @ _OUTSET.T, 0) ** 2.2
    return x @ AGX["from_rec2020"].T


def _neutral(x: np.ndarray) -> np.ndarray:
    start, desaturation = 0.8 - 0.04, 0.15
    least = x.min(axis=-1, keepdims=True)
    x = x - np.where(least < 0.08, least - 6.25 * least**2, 0.04)
    peak = x.max(axis=-1, keepdims=True)
    new = 1 - (1 - start) ** 2 / np.maximum(peak + 1 - 2 * start, 1e-6)
    share = 1 / (desaturation * (peak - new) + 1)
    bright = x * new / np.maximum(peak, 1e-6) * share + new * (1 - share)
    return np.where(peak < start, x, bright)


_CURVES = {
    "filmic": _filmic,
    "hable": _hable,
    "linear": lambda x: x,
    "agx": _agx,
    "neutral": _neutral,
}
