"""Hairstyles as data: stimuli/hairstyles/NAME.toml, or a table of the same fields."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.parameters import Parameters, parameter
from stimuli.parts import ROOT, part, read_toml

HAIRSTYLES = ROOT / "hairstyles"
ANCHOR = ("degrees", "up", "length", "height", "density", "left", "upwards", "forward")
_LIMITS = ((-180, 180), (-150, 160), (0, 700), (0, 60), (0, 1), (-1, 1), (-1, 1), (-1, 1))


def _share(default: float, what: str):
    return parameter(default, unit="share", low=0.0, high=1.0, source=what)


def _mm(default: float, high: float, what: str):
    return parameter(default, unit="mm", low=0.0, high=high, source=what)


@dataclass(frozen=True)
class Style(Parameters):
    """How hair of the scalp grows; all defaults were chosen by eye.

    anchors: rows (azimuth from the face's middle in degrees to the person's left, height above the
    eyes in mm, length in mm, height of the layer over the skin in mm, density in [0, 1], and the
    direction in which it is combed: left, upwards, forward); between them values are blended by
    distance. mirror: rows stand for the other side too. part: x in mm to the person's left of a
    parting, and how far back of the hairline it reaches in mm; a reach of 0 is none.

    Strands gather in `tufts`, and these in `locks`, by shares of the way at their tips. tie: place
    (mm above the eyes, mm before the head's axis) that all strands are drawn to; reach 0 is none.
    """

    called: ClassVar[str] = "style"

    anchors: tuple[tuple[float, ...], ...] = ((0.0, 60.0, 12.0, 6.0, 1.0, 0.0, -0.2, 1.0),)
    mirror: bool = parameter(True, source="rows stand for both sides")
    part_mm: float = parameter(0.0, unit="mm to the left", low=-60, high=60, source="by eye")
    part_reach_mm: float = _mm(0.0, 200.0, "length of the parting from the hairline; 0: none")
    part_gap_mm: float = _mm(0.8, 6.0, "skin that shows in the parting")
    part_dense: float = parameter(
        1.2, unit="more roots beside the parting", low=0.0, high=5.0, source="by eye"
    )
    part_lift_deg: float = parameter(
        24.0, unit="degrees more beside the parting", low=0.0, high=70.0, source="by eye"
    )
    tie_up_mm: float = parameter(0.0, unit="mm above the eyes", low=-100, high=120, source="by eye")
    tie_forward_mm: float = parameter(-75.0, unit="mm", low=-140, high=140, source="by eye")
    tie_mm: float = _mm(0.0, 60.0, "radius of the bound hair; 0: it is not tied")
    locks: int = parameter(1100, low=1, high=20000, source="second trial, by eye")
    tufts: int = parameter(7000, low=1, high=100000, source="second trial, by eye")
    gather_locks: float = _share(0.35, "of tufts at their tips")
    gather_tufts: float = _share(0.65, "of strands at their tips")
    stray_deg: float = parameter(
        14.0, unit="degrees", low=0.0, high=90.0, source="standard deviation of a lock's direction"
    )
    lift_deg: float = parameter(
        28.0, unit="degrees", low=0, high=90, source="of roots off the skin"
    )
    stiff_mm: float = parameter(7.0, unit="mm", low=0.5, high=100.0, source="way to turn as combed")
    gravity: float = parameter(0.8, low=0.0, high=3.0, source="against the comb, off the head")
    shortest: float = parameter(0.55, unit="of the length", low=0.05, high=1.0, source="trial")
    edge: float = _share(0.55, "of the length, at the hairline's very edge")
    wave_mm: float = _mm(0.4, 20.0, "amplitude, side to side")
    wave_length_mm: float = parameter(24.0, unit="mm", low=1.0, high=300.0, source="by eye")
    coil: float = _share(0.0, "of the wave's amplitude that turns out of its plane: 1 is a helix")
    frizz_mm: float = _mm(0.25, 10.0, "each strand's own wandering at its tip")
    flyaways: float = _share(0.012, "strands that leave the layer")
    baby_hairs: int = parameter(2200, unit="hairs", low=0, high=20000, source="at the hairline")
    points: int = parameter(14, unit="a strand", low=4, high=48, source="by eye")

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "anchors", _anchors(self.where("anchors"), self.anchors))

    @classmethod
    def read(cls, table: Any, where: str) -> Style:
        """A style by its name, or from a table of the fields, `like` being one to start from."""
        if isinstance(table, str):
            return super().read(read_toml(part(table, HAIRSTYLES, where)), where)
        if isinstance(table, Mapping) and "like" in table:
            rest = {key: value for key, value in table.items() if key != "like"}
            start = read_toml(part(table["like"], HAIRSTYLES, f"{where}.like"))
            return super().read({**start, **rest}, where)
        return super().read(table, where)

    def both_sides(self) -> np.ndarray:
        """The anchors (A, 8) with those of the other side."""
        rows = np.array(self.anchors)
        if not self.mirror:
            return rows
        other = rows[(np.abs(rows[:, 0]) > 0) & (np.abs(rows[:, 0]) < 180)]
        return np.vstack([rows, other * [-1, 1, 1, 1, 1, -1, 1, 1]])


def _anchors(where: str, rows: Any) -> tuple[tuple[float, ...], ...]:
    try:
        found = tuple(tuple(float(value) for value in row) for row in rows)
    except (TypeError, ValueError):
        raise InputError(f"{where} is {rows!r:.60}; expected rows of eight numbers") from None
    if not found:
        raise InputError(f"{where} is empty; expected at least one row")
    for row in found:
        if len(row) != len(ANCHOR):
            raise InputError(f"{where} has a row {row}; expected {', '.join(ANCHOR)}")
        for name, value, (low, high) in zip(ANCHOR, row, _LIMITS, strict=True):
            if not math.isfinite(value) or not low <= value <= high:
                raise InputError(f"{where}: {name} is {value:g}; expected {low} to {high}")
        if not any(row[5:]):
            raise InputError(f"{where} has a row without a direction: {row}")
    return found
