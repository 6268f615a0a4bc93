"""Where the skin is what: lines of hair and beard, and how much of each feature lies where."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar

from renderer.errors import InputError
from renderer.parameters import Parameters, parameter, weights

PLACES = (
    "everywhere",
    "cheeks",
    "nose",
    "wings",
    "ears",
    "chin",
    "forehead",
    "chest",
    "neck",
    "eyelids",
    "rings",
    "rims",
    "knuckle",
)
_LINES = ("hairline", "beard_top", "beard_bottom")
_RAMPS = (
    "hairline_soft_mm",
    "hairline_deg",
    "beard_top_soft_mm",
    "beard_bottom_soft_mm",
    "beard_front_mm",
    "forehead_mm",
    "forehead_deg",
    "chest_mm",
    "chest_half_mm",
    "neck_mm",
)
_WEIGHTS = {
    "flush": {
        "cheeks": 0.55,
        "nose": 0.75,
        "wings": 0.5,
        "ears": 0.10,
        "rims": 0.42,
        "rings": 0.14,
        "knuckle": 0.30,
        "chin": 0.28,
        "forehead": 0.16,
        "chest": 0.16,
        "neck": 0.10,
        "eyelids": 0.20,
    },
    "pores": {
        "everywhere": 0.30,
        "nose": 0.62,
        "wings": 0.60,
        "cheeks": 0.42,
        "forehead": 0.30,
        "chin": 0.30,
        "neck": -0.15,
    },
    "oil": {
        "everywhere": 0.27,
        "nose": 0.68,
        "wings": 0.45,
        "forehead": 0.50,
        "cheeks": 0.28,
        "chin": 0.30,
        "neck": -0.2,
    },
    "smooth": {"eyelids": 0.85, "ears": 0.6},
    "thin": {"eyelids": 1.0, "rings": 0.45, "rims": 0.3},
}

# fmt: off
_HAIRLINE = (
    (0, 61), (14, 62), (26, 66), (36, 62), (46, 46), (56, 34), (63, 8), (67, -12), (71, -20),
    (77, -22), (82, -16), (88, -4), (97, 2), (108, -20), (118, -45), (140, -62), (180, -70),
)
_BEARD_TOP = (
    (0, -44), (14, -46), (24, -60), (38, -66), (52, -52), (62, -34), (70, -24), (78, -36),
    (90, -62), (110, -80), (180, -90),
)
_BEARD_BOTTOM = ((0, -150), (30, -152), (60, -140), (80, -115), (95, -92), (180, -90))
# fmt: on


def _radius(default: float) -> float:
    return parameter(default, unit="mm", low=1.0, high=100.0, source="of a soft spot, by eye")


def _ramp(*default: float) -> tuple[float, ...]:
    """Where a feature begins and where it is whole, at each of its ends."""
    return parameter(default, unit="mm", low=-500.0, high=500.0, source="by eye")


def _degrees(*default: float) -> tuple[float, ...]:
    return parameter(default, unit="degrees", low=0.0, high=180.0, source="by eye")


@dataclass(frozen=True)
class Regions(Parameters):
    """Where the features of a generated person's skin lie; all defaults were chosen by eye.

    hairline, beard_top, beard_bottom: points (azimuth from the face's middle in degrees, 0 to 180
    and rising; height above the eyes in mm) of lines that both sides share. flush, pores, oil: how
    much of it lies at each of PLACES, summed; smooth: the share of pores that is missing there;
    thin: where the epidermis is as thin as on a lid. A table goes over the defaults place by place.
    rings lie below the eyes, rims are those of the ears with their lobes, the knuckle is the
    nose's.

    The lines wander by line_noise_mm (hairline, top and bottom of the beard) over
    line_noise_scale_mm. Ramps say where something begins and where it is whole: *_soft_mm across a
    line, forehead_mm, chest_mm and neck_mm above the eyes (the forehead's end too), chest_half_mm
    and forehead_deg to the sides, beard_front_mm along z; a person's `hairline_mm` counts in full
    within hairline_deg[1]. In two spots of beard_thin_mm the share beard_thin of the beard is
    missing; farther from mouth and chin than beard_dense_mm, beard_sparse of it; everywhere it is
    uneven by beard_patchy over beard_patch_mm.
    """

    called: ClassVar[str] = "regions"

    hairline: tuple[tuple[float, float], ...] = _HAIRLINE
    beard_top: tuple[tuple[float, float], ...] = _BEARD_TOP
    beard_bottom: tuple[tuple[float, float], ...] = _BEARD_BOTTOM
    line_noise_mm: tuple[float, float, float] = parameter(
        (2.8, 4.5, 6.0), unit="mm", low=0.0, high=50.0, source="by eye"
    )
    line_noise_scale_mm: float = parameter(9.0, unit="mm", low=0.5, high=200.0, source="by eye")
    hairline_soft_mm: tuple[float, float] = _ramp(-9.0, 13.0)
    hairline_deg: tuple[float, float] = _degrees(60.0, 30.0)
    beard_top_soft_mm: tuple[float, float] = _ramp(-5.0, 13.0)
    beard_bottom_soft_mm: tuple[float, float] = _ramp(-14.0, 14.0)
    beard_front_mm: tuple[float, float] = _ramp(2.0, 32.0)
    beard_thin: float = parameter(0.55, low=0.0, high=1.0, source="by eye")
    beard_thin_place_mm: tuple[float, float] = parameter(
        (13.0, 11.0), unit="mm outwards and below the mouth", low=0.0, high=100.0, source="by eye"
    )
    beard_thin_mm: float = _radius(5.0)
    beard_dense_mm: float = _radius(26.0)
    beard_sparse: float = parameter(
        0.55, low=0.0, high=1.0, source="share that is missing far from the mouth, by eye"
    )
    beard_patchy: float = parameter(0.3, low=0.0, high=1.0, source="of it, by eye")
    beard_patch_mm: float = parameter(5.0, unit="mm", low=0.5, high=200.0, source="by eye")
    forehead_mm: tuple[float, float, float, float] = _ramp(20.0, 34.0, 66.0, 50.0)
    forehead_deg: tuple[float, float] = _degrees(55.0, 40.0)
    chest_mm: tuple[float, float] = _ramp(-170.0, -230.0)
    chest_half_mm: tuple[float, float] = _ramp(110.0, 30.0)
    neck_mm: tuple[float, float] = _ramp(-115.0, -170.0)
    wings_place_mm: tuple[float, float, float] = parameter(
        (13.0, 3.0, 14.0),
        unit="mm outwards, below and behind the tip of the nose",
        low=-100.0,
        high=100.0,
        source="by eye",
    )
    rings_place_mm: tuple[float, float] = parameter(
        (1.0, 12.5), unit="mm inwards of and below each eye", low=-50.0, high=50.0, source="by eye"
    )
    rings_mm: tuple[float, float] = parameter(
        (12.0, 4.2), unit="mm across, along", low=1.0, high=50.0, source="of a soft spot, by eye"
    )
    rims_mm: tuple[float, float] = parameter(
        (30.0, 17.0),
        unit="mm, half height and half depth of an ear",
        low=5.0,
        high=60.0,
        source="by eye",
    )
    knuckle_place_mm: tuple[float, float] = parameter(
        (23.0, 7.0), unit="mm above and behind the nose's tip", low=0.0, high=60.0, source="by eye"
    )
    knuckle_mm: float = _radius(6.0)
    nose_mm: float = _radius(11.0)
    wings_mm: float = _radius(8.0)
    cheek_mm: float = _radius(17.0)
    chin_mm: float = _radius(15.0)
    cheek_place_mm: tuple[float, float] = parameter(
        (42.0, 33.0), unit="mm outwards and below the eyes", low=0.0, high=100.0, source="by eye"
    )
    flush: dict[str, float] = field(default_factory=dict)
    pores: dict[str, float] = field(default_factory=dict)
    oil: dict[str, float] = field(default_factory=dict)
    smooth: dict[str, float] = field(default_factory=dict)
    thin: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in _RAMPS:
            ends = getattr(self, name)
            if ends[0] == ends[1] or ends[-1] == ends[-2]:
                raise InputError(
                    f"{self.where(name)} is {ends}; expected two places, not one twice"
                )
        for name in _LINES:
            object.__setattr__(self, name, _line(self.where(name), getattr(self, name)))
        for name, default in _WEIGHTS.items():
            own = weights(self.where(name), getattr(self, name), "places", -2, 2, PLACES)
            object.__setattr__(self, name, {**default, **own})


def _line(where: str, points: Any) -> tuple[tuple[float, float], ...]:
    """Points (degrees, mm), checked."""
    try:
        line = tuple((float(degrees), float(mm)) for degrees, mm in points)
    except (TypeError, ValueError):
        raise InputError(f"{where} is {points!r:.60}; expected pairs of degrees and mm") from None
    degrees = [point[0] for point in line]
    rising = all(a < b for a, b in pairwise(degrees))
    if len(line) < 2 or not rising or not 0 <= degrees[0] <= degrees[-1] <= 180:
        raise InputError(f"{where} has degrees {degrees}; expected two or more, 0 to 180, rising")
    if not all(math.isfinite(mm) and abs(mm) <= 500 for _, mm in line):
        raise InputError(f"{where} is {points!r:.60}; expected heights of -500 to 500 mm")
    return line
