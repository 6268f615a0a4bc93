"""How a user's mesh is to stand: its unit, what is up, where the face looks, where its features
are.

`by_face` lays the average head over it (stimuli.heads.register) or takes landmarks that are given;
`by_size` goes by the box around it alone and is what is left where no face is found, which is said.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from stimuli.errors import InputError
from stimuli.heads import register, template
from stimuli.heads.formats import Source
from stimuli.parts import read_toml

UNITS_MM = {"m": 1000.0, "cm": 10.0, "mm": 1.0, "in": 25.4}
"""Millimetres a unit, in the order in which a guess tries them."""
AXES = ("x", "-x", "y", "-y", "z", "-z")

HEAD_MM = (120.0, 900.0)  # largest extent: from a face alone to a broad bust
BODY_MM = 2300.0  # largest extent of a whole person with arms out
# a whole person's least extent is below this part of the largest; a head's or bust's is not
SLENDER = 0.35
# with z up, the height (z) exceeds the depth (y) by more than this; heads have 1.15 or more
Z_UP_RATIO = 1.1
#: From crown to chin: an infant's to a large man's. No two units give heights within it.
CROWN_TO_CHIN_MM = (130.0, 320.0)
#: A face that looks so far from an axis is turned to the front; less is how a head is held.
TURNED_DEG = 8.0
TILTED_DEG = 25.0
NAMES = ("eye_l", "eye_r", "nose", "mouth", "chin")  # what a file of landmarks may give


@dataclass(frozen=True)
class Asked:
    """What the user says of the file; None has it found out.

    unit: mm, cm, m or in. up, forward: axes of the file. yaw_deg: turned about the upward axis, to
    the person's left, after that. head_mm: from crown to chin. scale: mm a unit of the file.
    landmarks: a TOML file of points in the file's coordinates (`NAMES`).
    """

    unit: str | None = None
    up: str | None = None
    forward: str | None = None
    yaw_deg: float | None = None
    head_mm: float | None = None
    scale: float | None = None
    landmarks: str | None = None

    def __post_init__(self) -> None:
        choices = {"unit": tuple(UNITS_MM), "up": AXES, "forward": AXES}
        for name, known in choices.items():
            value = getattr(self, name)
            if value is not None and value not in known:
                what = {"unit": "unit", "up": "upward axis", "forward": "forward axis"}[name]
                raise InputError(
                    f"the {what} {value!r} is unknown; expected one of {', '.join(known)}"
                )


@dataclass(frozen=True, eq=False)
class Placing:
    """mm = mm_per_unit * file @ rotation.T. `unit` is "scaled" where none makes it a head.

    fit: the average head's place in the file, None where no face was found; landmarks: given ones,
    mm, placed.
    """

    rotation: np.ndarray
    mm_per_unit: float
    unit: str
    unit_source: str  # given, format, found or guessed
    up: str
    up_source: str
    turned_deg: float = 0.0
    turned_source: str = "as it stands"  # given or found
    fit: register.Fit | None = None
    landmarks: dict[str, np.ndarray] = field(default_factory=dict)

    def place(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the file, mm."""
        return self.mm_per_unit * points @ self.rotation.T

    def provenance(self) -> dict[str, Any]:
        """What a manifest says of it."""
        words = ("unit", "unit_source", "up", "up_source", "turned_source")
        record: dict[str, Any] = {name: getattr(self, name) for name in words}
        record |= {"mm_per_unit": self.mm_per_unit, "turned_deg": round(self.turned_deg, 1)}
        if self.fit is not None:
            record["face"] = {
                "error_mm": round(self.fit.error_mm, 2),
                "relief": round(self.fit.relief, 3),
                "crown_to_chin_mm": round(self.fit.height * self.mm_per_unit, 1),
            }
        return record


def by_size(source: Source, points, faces, asked: Asked, of_format: bool) -> Placing:
    """Judged by the box around the mesh (points (N, 3), faces (M, 3)) alone."""
    extents = np.ptp(points[faces.reshape(-1)], axis=0)
    up, up_source = _upward(source, extents, asked.up, of_format)
    rotation, turned, turned_source = _turned(source, up, asked, None)
    if asked.scale is not None:
        return Placing(
            rotation, asked.scale, "scaled", "given", up, up_source, turned, turned_source
        )
    unit, unit_source = _unit(source, extents, asked.unit, of_format)
    mm = UNITS_MM[unit]
    return Placing(rotation, mm, unit, unit_source, up, up_source, turned, turned_source)


def by_face(source: Source, points, faces, asked: Asked, of_format: bool) -> Placing:
    """Judged by the face in it, or by landmarks that are given."""
    extents = np.ptp(points[faces.reshape(-1)], axis=0)
    if len(faces) < 50 or extents.min() < 0.03 * extents.max():
        raise source.error(
            f"has {len(faces)} faces and is {extents.min():.3g} units thin and {extents.max():.3g} "
            "long; expected the surface of a head"
        )
    given = {} if asked.landmarks is None else read_landmarks(asked.landmarks)
    axes = [] if asked.up is None else [frame(asked.up)]
    fit = _by_landmarks(given) if given else register.fit(points, faces, axes or None)
    if not given and not fit.found:
        if asked.head_mm is not None:
            raise source.error(
                f"has no face that could be found ({_doubt(fit)}), so its head cannot be made "
                f"{asked.head_mm:g} mm high; give a scale or landmarks"
            )
        source.note(
            f"no face was found in it ({_doubt(fit)}): the camera goes by the box around it, "
            "112 mm below the crown; give landmarks if that is wrong"
        )
        return by_size(source, points, faces, asked, of_format)
    up, up_source = asked.up, "given"
    if up is None:
        up, up_source = _axis(fit.up), "found"
        if up == "y" and of_format:
            up_source = "format"
        elif up != "y":
            source.note(f"{up} was taken as up, since the face in it stands so")
    tilt = np.degrees(np.arccos(np.clip(fit.up @ _vector(up), -1, 1)))
    if tilt > TILTED_DEG:
        source.note(f"the head is tilted by {tilt:.0f} degrees from {up}, and is left so")
    rotation, turned, turned_source = _turned(source, up, asked, fit)
    mm, unit, unit_source = _scale(source, fit, asked, of_format)
    placed = Placing(rotation, mm, unit, unit_source, up, up_source, turned, turned_source, fit)
    marks = {name: placed.place(np.array(point)) for name, point in given.items()}
    return replace(placed, landmarks=marks)


def read_landmarks(path: str) -> dict[str, tuple[float, float, float]]:
    """Points in the file's coordinates by their names: three or more of `NAMES`, a TOML file."""
    table: Mapping[str, Any] = read_toml(Path(path))
    unknown = sorted(set(table) - set(NAMES))
    if unknown or len(table) < 3:
        raise InputError(
            f"{path}: has {', '.join(map(repr, unknown or sorted(table))) or 'nothing'}; expected "
            f"three or more of {', '.join(NAMES)}"
        )
    points = {}
    for name, value in table.items():
        numbers = isinstance(value, list) and all(
            isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v)
            for v in value
        )
        if not numbers or len(value) != 3:
            raise InputError(
                f"{path}: {name} is {value!r:.60}; expected [x, y, z] in the file's coordinates"
            )
        points[name] = tuple(map(float, value))
    return points


def frame(up: str) -> np.ndarray:
    """Rotation whose columns are right, up and forward of a head with that axis up (`AXES`): its
    face towards +z, or -y where z is up, as the formats have it.
    """
    above = _vector(up)
    ahead = np.array([0, 0, 1.0]) if up in ("y", "-y", "x", "-x") else _vector("-y")
    return np.column_stack([np.cross(above, ahead), above, ahead])


def _vector(axis: str) -> np.ndarray:
    vector = np.zeros(3)
    vector["xyz".index(axis[-1])] = -1.0 if axis[0] == "-" else 1.0
    return vector


def _axis(direction: np.ndarray) -> str:
    """The axis of a mesh (`AXES`) that is nearest to a direction (3,)."""
    index = int(np.abs(direction).argmax())
    return ("-" if direction[index] < 0 else "") + "xyz"[index]


def _doubt(fit: register.Fit) -> str:
    return f"the average one is {fit.error_mm:.1f} mm off, its relief {fit.relief:.0%} there"


def _by_landmarks(given: Mapping[str, tuple]) -> register.Fit:
    """The average head's place by landmarks alone (Umeyama)."""
    shape = template.load().landmarks
    own = np.array([shape[name] for name in given])
    seen = np.array([given[name] for name in given])
    scale, rotation, offset = register.similarity(own, seen, np.ones(len(own)))
    error = np.linalg.norm(scale * own @ rotation.T + offset - seen, axis=1).mean() / scale
    return register.Fit(float(scale), rotation, offset, np.ones(3), float(error), 1.0)


def _turned(source, up: str, asked: Asked, fit) -> tuple[np.ndarray, float, str]:
    """Rotation (3, 3) from the file's axes to y up and the face along +z; the degrees turned."""
    base = frame(up)
    yaw, how = 0.0, "as it stands"
    if asked.forward is not None:
        ahead = base.T @ _vector(asked.forward)
        if abs(ahead[1]) > 0.5:
            raise source.error(
                f"cannot look along {asked.forward} with {up} up; expected two different axes"
            )
        yaw, how = math.degrees(math.atan2(ahead[0], ahead[2])), "given"
    elif asked.yaw_deg is None and fit is not None:
        ahead = base.T @ fit.forward
        found = math.degrees(math.atan2(ahead[0], ahead[2]))
        right = 90.0 * round(found / 90)
        if abs(found - right) <= TURNED_DEG:  # files lie along axes; the rest is how a head is held
            found = right
        if found:
            found = abs(found) if abs(found) == 180 else found
            yaw, how = found, "found"
            source.note(
                f"the face looks {abs(found):.0f} degrees to the "
                f"{'left' if found > 0 else 'right'} of straight ahead and was turned to the "
                "front; give forward or yaw if that is wrong"
            )
    if asked.yaw_deg is not None:
        yaw, how = yaw - asked.yaw_deg, "given"
    c, s = math.cos(math.radians(yaw)), math.sin(math.radians(yaw))
    back = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    return back @ base.T, yaw, how


def _scale(source, fit: register.Fit, asked: Asked, of_format: bool) -> tuple[float, str, str]:
    """mm a unit of the file, the unit's name and how it is known."""
    height, (low, high) = fit.height, CROWN_TO_CHIN_MM
    if asked.scale is not None:
        return asked.scale, "scaled", "given"
    if asked.head_mm is not None:
        return asked.head_mm / height, "scaled", "given"
    if asked.unit is not None:
        mm = height * UNITS_MM[asked.unit]
        if not low <= mm <= high:
            raise source.error(
                f"has a head {mm:.4g} mm high from crown to chin if its unit is {asked.unit}; "
                f"expected {low:g} to {high:g} mm, or give the head's height or a scale"
            )
        return UNITS_MM[asked.unit], asked.unit, "given"
    for unit, mm in UNITS_MM.items():
        if low <= height * mm <= high:
            if unit == "m" and of_format:
                return mm, unit, "format"
            source.note(
                f"the unit was taken as {unit}, which makes the head {height * mm:.0f} mm high "
                "from crown to chin; say which it is if that is wrong"
            )
            return mm, unit, "found"
    adult = template.load().height_mm
    source.note(
        f"its head is {height:.4g} units high from crown to chin, which is none in "
        f"{', '.join(UNITS_MM)}: it was scaled to {adult:.0f} mm; give the head's height or a "
        "scale if that is wrong"
    )
    return adult / height, "scaled", "found"


def _upward(source, extents: np.ndarray, given: str | None, of_format: bool) -> tuple[str, str]:
    """Which axis is up, and how that is known."""
    if given:
        return given, "given"
    if of_format:
        return "y", "format"
    _, y, z = extents
    if z <= Z_UP_RATIO * y:
        return "y", "guessed"
    source.note(
        f"z was taken as up, since the head is longer along z ({z:.4g}) than along y "
        f"({y:.4g}); say which is up if that is wrong"
    )
    return "z", "guessed"


def _unit(
    source: Source, extents: np.ndarray, given: str | None, of_format: bool
) -> tuple[str, str]:
    """The unit of the positions, and how that is known."""
    largest, slender = extents.max(), extents.min() < SLENDER * extents.max()
    expected = (
        f"expected {HEAD_MM[0] / 1000} to {HEAD_MM[1] / 1000} m, or up to "
        f"{BODY_MM / 1000} m for a whole body"
    )

    def sized_like_somebody(unit: str) -> bool:
        return HEAD_MM[0] <= largest * UNITS_MM[unit] <= BODY_MM

    if given:
        if not sized_like_somebody(given):
            raise source.error(
                f"is {largest * UNITS_MM[given] / 1000:.4g} m across if its unit is {given}; "
                f"{expected}"
            )
        return given, "given"
    if of_format and sized_like_somebody("m"):
        return "m", "format"
    likely = (
        unit
        for unit in UNITS_MM
        if sized_like_somebody(unit) and (slender or largest * UNITS_MM[unit] <= HEAD_MM[1])
    )
    unit = next(likely, None)
    if unit is None:
        raise source.error(
            f"is {largest:.4g} units across, which is no head in {', '.join(UNITS_MM)} "
            f"({expected}); give its unit, or scale it first"
        )
    size = f"{largest * UNITS_MM[unit] / 10:.4g} cm across"
    source.note(
        f"the unit was taken as {unit}, which makes the head {size}; say which it is if that "
        "is wrong"
    )
    return unit, "guessed"
