"""Twelve heads as files bring them: turned, lying, cut, in other units, noisy, under a hairdo.

Used by tests/heads/test_placing.py and, for the picture of all of them, by benchmarks/scans.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from stimuli.heads import anatomy, fetch
from stimuli.heads.person import Person
from stimuli.parts import PEOPLE, part, read_toml


def turn(axis: str, degrees: float) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def person(name: str) -> Person:
    return Person.read(read_toml(part(name, PEOPLE, "person")), name)


@cache
def head(name: str) -> tuple[np.ndarray, np.ndarray, dict]:
    """Points (N, 3) mm, faces, true landmarks of one that ships; no hair and no eyes."""
    built = anatomy.build_anatomy(fetch.mpfb_data(), person(name), 1)
    bust, balls = built.coarse, built.eyes
    marks = {**built.landmarks, "eye_l": balls[0].centre, "eye_r": balls[1].centre}
    return bust.positions, bust.faces, marks


@dataclass(frozen=True)
class Awkward:
    """A head as a file brings it, and how it is to be understood.

    units_per_mm: of the file. unit, up, turned_deg: what is to be found.
    """

    who: str
    change: str
    rotation: np.ndarray
    units_per_mm: float
    unit: str
    up: str
    turned_deg: float

    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 3) in the file's units and faces (F, 3)."""
        points, faces, _ = head(self.who)
        if self.change == "head alone":
            points, faces = _cut(points, faces, points[:, 1] > -260)
        elif self.change == "mask":
            points, faces = _cut(points, faces, (points[:, 2] > 60) & (points[:, 1] > -240))
        elif self.change == "hairdo":
            points = _under_hair(points)
        elif self.change == "noise":
            points = points + np.random.default_rng(1).normal(size=points.shape) * 1.5
        return self.units_per_mm * points @ self.rotation.T, faces


def _cut(points, faces, keep):
    faces = faces[keep[faces].all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3)


def _under_hair(points):
    """A hairdo of a third of the head's size, above and behind."""
    points = points.copy()
    hair = (points[:, 1] > -75) | ((points[:, 2] < 20) & (points[:, 1] > -200))
    points[hair] = [0, -100, 40] + (points[hair] - [0, -100, 40]) * 1.35
    return points


HEADS = {
    name: Awkward(*fields)
    for name, fields in {
        "as it should be": ("woman", "", np.eye(3), 1e-3, "m", "y", 0),
        "a bust in inches": ("woman", "", np.eye(3), 1 / 25.4, "in", "y", 0),
        "from behind": ("man_dark", "", turn("y", 180), 1.0, "mm", "y", 180),
        "turned by 46 degrees": ("man_dark", "", turn("y", 46), 0.1, "cm", "y", 46),
        "z up": ("woman", "", turn("x", 90), 1.0, "mm", "z", 0),
        "z up, looking along y": ("woman", "", turn("x", 90) @ turn("y", 180), 1.0, "mm", "z", 180),
        "upside down": ("man_dark", "", turn("z", 180), 1.0, "mm", "-y", 0),
        "lying, x up": ("woman", "", turn("z", -90), 0.1, "cm", "x", 0),
        "a unit-normalised head": ("man_dark", "head alone", np.eye(3), 1 / 250, "scaled", "y", 0),
        "a mask": ("woman", "mask", turn("y", -90), 1.0, "mm", "y", -90),
        "a hairdo": ("man_dark", "hairdo", np.eye(3), 0.1, "cm", "y", 0),
        "noise of 1.5 mm": ("woman", "noise", turn("y", -100), 1.0, "mm", "y", -100),
    }.items()
}
