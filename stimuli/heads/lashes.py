"""Eyelashes: curved hairs in tufts, from the outer rims of the lids' margins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import trimesh

from stimuli.heads.lids import Eyeball, Opening
from stimuli.heads.person import Hair, Lashes

# of the roots from the edge that lies on the ball, seen from the front: the upper lid's margin
# looks down, the lower one's up
RIM_UPPER_MM, RIM_LOWER_MM = 0.28, 0.80
TIP = 0.12  # of the width at the root
# `cover` at root and tip: lashes stand in each other's, the brow's and the cheek's shade
UPPER_SHADED, LOWER_SHADED = (0.85, 0.5), (1.0, 0.9)
BARE_MM = 5.2  # from the inner corner: over the lake of tears no lash grows
DARKER = 0.6  # of the hair's colour


class Lidded(Protocol):
    """A head that hair can be grown on: named points (3,), balls, the openings before them."""

    @property
    def landmarks(self) -> Mapping[str, np.ndarray]: ...
    @property
    def eyes(self) -> Sequence[Eyeball]: ...
    @property
    def openings(self) -> Sequence[Opening | None]: ...


def grown(
    head: Lidded,
    skin: np.ndarray,
    faces: np.ndarray,
    rng: np.random.Generator,
    own: Lashes,
    hair: Hair,
    points: int,
) -> list[dict]:
    """The lashes of both eyes' lids, as stimuli.heads.hair packs strands.

    skin (N, 3), faces (M, 3): what they stand on; points: of each strand.
    """
    colour = np.array(hair.colour) * DARKER if own.colour is None else np.array(own.colour)
    out = []
    for ball, opening in zip(head.eyes, head.openings, strict=True):
        if opening is None:
            continue
        near = np.linalg.norm(skin - ball.centre, axis=1) < 2.0 * ball.radius
        part = faces[near[faces].all(axis=1)]
        mesh = trimesh.Trimesh(skin, part, process=False, validate=False)
        for upper, count in ((True, own.upper), (False, own.lower)):
            if count:
                out.append(_lid(ball, opening, mesh, upper, count, rng, own, colour, points))
    return out


def _roots(
    ball: Eyeball, opening: Opening, mesh: trimesh.Trimesh, x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where the skin is met from the front at (x, y) of the ball's frame, and the nearest vertex;
    places where nothing is met are left out.
    """
    start = np.column_stack([x, y, np.full(len(x), 60.0)]) + ball.centre
    ahead = np.tile([0.0, 0.0, -1.0], (len(x), 1))
    face = mesh.ray.intersects_first(start, ahead)
    hit = face >= 0
    corners, normal = mesh.triangles[face[hit]], mesh.face_normals[face[hit]]
    deep = ((corners[:, 0] - start[hit]) * normal).sum(axis=1) / -normal[:, 2]
    at = start[hit] - deep[:, None] * [0.0, 0.0, 1.0]
    nearest = np.linalg.norm(corners - at[:, None], axis=2).argmin(axis=1)
    return at, mesh.faces[face[hit]][np.arange(len(at)), nearest]


def _lid(
    ball: Eyeball,
    opening: Opening,
    mesh: trimesh.Trimesh,
    upper: bool,
    count: int,
    rng: np.random.Generator,
    own: Lashes,
    colour: np.ndarray,
    points: int,
) -> dict:
    side = ball.side
    first = side * (opening.x[0] if side > 0 else opening.x[-1]) + BARE_MM
    # towards the outer corner they would cross those of the other lid
    last = side * (opening.x[-1] if side > 0 else opening.x[0]) - (1.0 if upper else 2.5)
    # tufts along the lid, evenly with some play; hairs about them
    tufts = max(1, round(count / own.tufts))
    place = ((np.arange(tufts) + rng.uniform(0.0, 1.0, tufts)) / tufts) ** 0.85  # denser outwards
    of = rng.integers(tufts, size=count)
    spread = rng.normal(size=count) * 0.32
    along = first + (last - first) * place[of] + spread
    along = np.clip(along, first, last)
    u = (along - first) / (last - first)
    low, high = opening.at(side * along)
    row = (RIM_UPPER_MM if upper else RIM_LOWER_MM) + 0.25 * rng.random(count)
    y = high + row if upper else low - row
    at, vertex = _roots(ball, opening, mesh, side * along, y)
    if len(at) < count:  # the landmarks do not fit this head
        raise ValueError("a lash's root misses the lid")
    # a tuft's own length, splay and curl, and a hair's share of them
    tuft_length, tuft_turn, tuft_curl = rng.normal(size=(3, tufts))
    scale = 1 + 0.13 * tuft_length[of] + 0.10 * rng.normal(size=count)
    scale = np.clip(scale, 0.45, 1.4)
    scale *= np.where(rng.random(count) < 0.12, rng.uniform(0.35, 0.7, count), 1.0)  # still growing
    shape = (0.55 + 0.45 * np.sin(np.pi * np.clip(0.12 + 0.62 * u, 0, 1))) * (0.85 + 0.25 * u)
    length = (own.upper_mm if upper else own.lower_mm) * scale * shape
    # outwards like spokes of the ball, more so towards the temple; tips of a tuft lean together
    spoke = np.radians(-22 + 62 * u) + np.radians(8.0) * tuft_turn[of]
    spoke += np.radians(7.0) * rng.normal(size=count) - 0.25 * spread
    rise = np.radians((-22.0 if upper else -18.0) + 5.0 * rng.normal(size=count))
    turn = np.radians(74.0 if upper else -24.0) * (own.curl if upper else 1.0)
    turn = turn * (1 + 0.18 * tuft_curl[of] + 0.10 * rng.normal(size=count))
    s = np.linspace(0, 1, points)
    angle = rise[:, None] + turn[:, None] * s[None] ** 0.9
    flat = np.stack([side * np.sin(spoke), np.zeros(count), np.cos(spoke)], axis=1)
    step = np.cos(angle)[..., None] * flat[:, None] + np.sin(angle)[..., None] * [0.0, 1.0, 0.0]
    step *= (length / (points - 1))[:, None, None]
    grown_out = np.concatenate([np.zeros((count, 1, 3)), np.cumsum(step[:, 1:], axis=1)], axis=1)
    width = own.width_mm * (1.0 if upper else 0.68) * rng.uniform(0.8, 1.15, count)
    return {
        "points": at[:, None] + grown_out,
        "width_mm": width,
        "colour": colour * np.exp(0.15 * rng.normal(size=(count, 1))),
        "cover": np.tile(
            np.linspace(*(UPPER_SHADED if upper else LOWER_SHADED), points), (count, 1)
        ),
        "root_vertex": vertex,
        "tip": np.full(count, TIP),
    }
