"""A generated person's hair on a user's scan: grown on it as it lies over the average head.

Hairlines, partings, brows and beards are said in the average head's coordinates
(stimuli.heads.template). The scan is laid back over that head by what stimuli.heads.register found,
its surface gets hair there, and the strands are carried over to where it stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from renderer.scene import MASKS, Strands
from stimuli.errors import InputError
from stimuli.heads import hair, template
from stimuli.heads.lids import Eyeball, Opening, opening
from stimuli.heads.person import Person
from stimuli.heads.placing import Placing

#: A surface so far outside the average head's, in the middle of where hair grows, is a hairdo.
HAIRDO_MM = 9.0


@dataclass(frozen=True)
class Placed:
    """What hair asks of a head: named points (3,), balls, and the openings before them."""

    landmarks: Mapping[str, np.ndarray]
    eyes: Sequence[Eyeball]
    openings: Sequence[Opening | None]


def grown(
    name: str,
    placing: Placing,
    positions: np.ndarray,
    normals: np.ndarray,
    faces: np.ndarray,
    masks: np.ndarray,
    balls: Sequence[Eyeball],
    person: Person,
    seed: int,
) -> Strands:
    """A person's hair, brows, lashes, beard and vellus on a scan called `name`, mm as it is placed.

    positions, normals (N, 3), faces (M, 3): its surface; masks (N, len(MASKS)): the average head's,
    with where hair and beard grow; balls: its eyes, without which it gets no lashes. Raises one
    line where hair cannot be placed.
    """
    fit, shape = placing.fit, template.load()
    if fit is None:
        raise InputError(
            f"{name}: no face was found in it, so hair cannot be placed; give landmarks, or no hair"
        )
    turn, size = placing.rotation @ fit.rotation, fit.scale * placing.mm_per_unit

    def back(points: np.ndarray) -> np.ndarray:
        return fit.back(points @ placing.rotation / placing.mm_per_unit)

    own = back(positions)
    outside = _outside(own, masks[:, MASKS.index("hair")])
    if outside > HAIRDO_MM:
        raise InputError(
            f"{name}: where hair grows it stands {outside:.0f} mm off a bare head, so it has hair "
            "of its own; expected a bald head for more"
        )
    scalp = hair.Scalp(own, normals @ turn, faces, masks)
    if not balls:
        marks = (shape.landmarks["eye_l"], shape.landmarks["eye_r"])
        eyes = [Eyeball(at, person.eyes.radius_mm) for at in marks]
        openings: list[Opening | None] = [None, None]
    else:
        eyes = [Eyeball(back(ball.centre), ball.radius / size) for ball in balls]
        openings = [opening(own, faces, ball) for ball in eyes]
    head = Placed(shape.landmarks, eyes, openings)
    growing = person.hair
    if not scalp.column("beard").any():
        growing = replace(growing, stubble=0)
    try:
        strands = hair.all_strands(head, scalp, seed, 1.0, growing, person.lashes)
    except ValueError as error:
        raise InputError(f"{name}: hair cannot be placed on it: {error}") from error
    placed = placing.place(fit.place(strands.points.astype(float)))
    return replace(strands, points=placed.astype(np.float32))


def _outside(points: np.ndarray, haired: np.ndarray) -> float:
    """How far outside the average head's surface points (N, 3) lie where hair grows, mm: the
    median; 0 where there are none.
    """
    from scipy.spatial import cKDTree

    shape = template.load()
    those = points[haired > 0.5]
    if not len(those):
        return 0.0
    _, nearest = cKDTree(shape.points).query(those)
    apart = ((those - shape.points[nearest]) * shape.normals[nearest]).sum(axis=1)
    return float(np.median(apart))
