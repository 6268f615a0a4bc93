"""Hair of the scalp grown by a style: combed over the head, gathered in tufts and locks, waved, and
kept out of the head.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from renderer.memory import parts
from stimuli.heads.skin import HEAD_AXIS_Z
from stimuli.heads.smooth import smoothstep
from stimuli.heads.styles import Style

CELL_MM = 4.0  # of the grid of distances
NEAR_MM = 8.0  # nearer than that a distance is one from the nearest vertex's plane
CLEAR_MM = 0.12  # what strands keep off the skin beyond their roots
DENSITY_MM = 3.0  # cells of the density of hair
LOOK_MM = (1.5, 3.0, 5.0, 8.0, 13.0)  # where it is looked up outwards of a point
COMB_MM = 8.0  # cells of the direction of the comb
BLEND_MM = 14.0  # anchors' values are level so near to them
STRANDS, POINTS = 4096, 65536  # reckoned with at once: 100,000 long strands are 72 MB an array


class Grid:
    """Values on a regular grid, blended between its points; (..., C) at low + spacing (i, j, k)."""

    def __init__(self, low: np.ndarray, spacing: float, values: np.ndarray):
        self.low, self.spacing, self.values = low, spacing, values

    def at(self, points: np.ndarray) -> np.ndarray:
        """(N, C) at points (N, 3); outside, the values of the nearest edge."""
        found = np.empty((len(points), self.values.shape[-1]))
        for part in parts(len(points), POINTS):
            where = ((points[part] - self.low) / self.spacing).T
            for c in range(self.values.shape[-1]):
                at = map_coordinates(self.values[..., c], where, order=1, mode="nearest")
                found[part, c] = at
        return found


def _cells(low: np.ndarray, spacing: float, counts: np.ndarray) -> np.ndarray:
    """The places (N, 3) of a grid's points."""
    axes = [low[k] + spacing * np.arange(counts[k]) for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def distances(positions: np.ndarray, normals: np.ndarray, low, high) -> Grid:
    """Signed distance from a surface, mm, positive outside, and its gradient: a grid of (..., 4).

    positions, normals (N, 3): vertices, closer together than cells are wide.
    """
    counts = 2 * np.ceil((np.asarray(high) - low) / (2 * CELL_MM)).astype(int) + 1
    tree = cKDTree(positions)

    def signed_at(points: np.ndarray) -> np.ndarray:
        away, nearest = tree.query(points)
        plane = ((points - positions[nearest]) * normals[nearest]).sum(axis=1)
        return np.where(away < NEAR_MM, plane, np.sign(plane) * away)

    # every second cell, and near the surface all of them
    far = _cells(low, 2 * CELL_MM, counts // 2 + 1)
    coarse = Grid(low, 2 * CELL_MM, signed_at(far).reshape(*counts // 2 + 1, 1))
    points = _cells(low, CELL_MM, counts)
    signed = coarse.at(points)[:, 0]
    near = np.abs(signed) < 2 * NEAR_MM
    signed[near] = signed_at(points[near])
    signed = gaussian_filter(signed.reshape(counts), 0.5)
    slope = np.stack(np.gradient(signed, CELL_MM), axis=-1)
    slope /= np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-6)
    return Grid(np.asarray(low, float), CELL_MM, np.concatenate([signed[..., None], slope], -1))


@dataclass(frozen=True)
class Combed:
    """What the style says at places: length, height, density (N,), direction (N, 3)."""

    length: np.ndarray
    height: np.ndarray
    density: np.ndarray
    comb: np.ndarray


def _on_ball(degrees: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Places (N, 3) on a ball of a head's size."""
    lift = np.arcsin(np.clip((up - 10.0) / 100.0, -0.98, 0.98))
    a = np.radians(degrees)
    flat = np.cos(lift)
    return 95.0 * np.column_stack([flat * np.sin(a), np.sin(lift), flat * np.cos(a)])


def combed(style: Style, points: np.ndarray, eyes: np.ndarray, side: np.ndarray) -> Combed:
    """The style at points (N, 3), mm; side (N,): -1 or 1, on which side of a parting."""
    rows = style.both_sides()
    up = points[:, 1] - eyes[1]
    degrees = np.degrees(np.arctan2(points[:, 0], points[:, 2] - HEAD_AXIS_Z))
    at = _on_ball(degrees, up)
    away = ((at[:, None] - _on_ball(rows[:, 0], rows[:, 1])[None]) ** 2).sum(axis=2)
    weight = 1 / (away + BLEND_MM**2) ** 2
    if style.part_reach_mm:  # what is combed from the other side counts for nothing near the line
        own = np.sign(rows[:, 0] - style.part_mm * 0.6)[None] * side[:, None]
        near = parting_nearness(style, points, eyes)[:, None]
        weight = weight * np.where((own < 0) & (np.abs(rows[None, :, 0]) < 175), 1 - near, 1)
    weight /= weight.sum(axis=1, keepdims=True)
    values = weight @ rows[:, 2:]
    comb = values[:, 3:]
    if style.part_reach_mm:
        near = parting_nearness(style, points, eyes) * np.exp(
            -np.abs(points[:, 0] - style.part_mm) / 22.0
        )
        comb = comb + (1.1 * near * side)[:, None] * [1.0, 0.0, 0.0]
    return Combed(values[:, 0], values[:, 1], values[:, 2], comb)


def combs(style: Style, eyes: np.ndarray, low: np.ndarray, high: np.ndarray) -> dict[int, Grid]:
    """The direction of the comb over a box, for either side of the parting: -1 and 1."""
    counts = np.ceil((high - low) / COMB_MM).astype(int) + 1
    points, grids = _cells(low, COMB_MM, counts), {}
    for side in (-1, 1):
        comb = combed(style, points, eyes, np.full(len(points), side)).comb
        grids[side] = Grid(low, COMB_MM, comb.reshape(*counts, 3))
    return grids


def parting_nearness(style: Style, points: np.ndarray, eyes: np.ndarray) -> np.ndarray:
    """1 beside the parting, 0 beyond its end and below the top of the head (N,)."""
    if not style.part_reach_mm:
        return np.zeros(len(points))
    front = eyes[2] - 5.0
    behind = front - points[:, 2]
    top = smoothstep(40.0, 62.0, points[:, 1] - eyes[1])
    return top * (1 - smoothstep(0.75, 1.1, behind / style.part_reach_mm))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def grow(
    style: Style,
    skin: Grid,
    eyes: np.ndarray,
    roots: np.ndarray,
    normals: np.ndarray,
    side: np.ndarray,
    length: np.ndarray,
    height: np.ndarray,
    turn: np.ndarray,
    lift: np.ndarray,
    points: int,
) -> np.ndarray:
    """Strands (S, points, 3): they leave the skin, turn as they are combed, keep a height over the
    head, fall where they are off it, and slide along what they meet.

    roots, normals (S, 3); length, height, lift (S,) in mm, mm, radians; turn (S, 3): added to the
    direction of the comb.
    """
    flow = combed(style, roots, eyes, side).comb + turn
    flow = _unit(flow - normals * (flow * normals).sum(axis=1, keepdims=True))
    way = np.cos(lift)[:, None] * flow + np.sin(lift)[:, None] * normals
    step = length / (points - 1)
    path, left_side = np.empty((len(roots), points, 3)), (side < 0)[:, None]
    path[:, 0] = roots
    fields = combs(style, eyes, skin.low, skin.low + skin.spacing * np.array(skin.values.shape[:3]))
    p, tied = roots, np.zeros(len(roots))
    keep = 1 - np.exp(-step / style.stiff_mm)
    for k in range(1, points):
        here = skin.at(p)
        out, off = here[:, 1:], here[:, 0]
        comb = np.where(left_side, fields[-1].at(p), fields[1].at(p)) + turn
        if style.tie_mm:
            tie = np.array([0.0, eyes[1] + style.tie_up_mm, HEAD_AXIS_Z + style.tie_forward_mm])
            towards = tie - p
            left = np.linalg.norm(towards, axis=1)
            tied = np.maximum(tied, left < style.tie_mm + step)
            comb = np.where(tied[:, None] > 0, [0.0, -1.0, -0.25], _unit(towards) + 0.3 * turn)
        gone = k * step
        wanted = height * (1 - np.exp(-gone / np.maximum(1.5 * height, 1.0)))
        free = np.maximum(smoothstep(4.0, 22.0, off - height), tied)
        comb = _unit(comb - out * (comb * out).sum(axis=1, keepdims=True) * (1 - free)[:, None])
        hold = np.clip((wanted - off) / np.maximum(2 * step, 1.0), -0.8, 1.0) * (1 - free)
        aim = comb * (1 - 0.92 * free * min(style.gravity, 1.0))[:, None] + hold[:, None] * out
        aim[:, 1] -= style.gravity * (0.10 + 1.2 * free)
        way = _unit(way + keep[:, None] * (_unit(aim) - way))
        p = p + step[:, None] * way
        inside = skin.at(p)
        low = CLEAR_MM + np.minimum(0.35 * height, 0.1 * gone)
        p = p + np.maximum(low - inside[:, 0], 0)[:, None] * inside[:, 1:]
        path[:, k] = p
    return path


def gather(curves, roots, leader: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Curves (S, P, 3) drawn to that of their leader (S,), an index, by `share` (S, P) of the
    way.
    """
    led = curves[leader] + (roots - roots[leader])[:, None] * (1 - share)[..., None]
    return curves + share[..., None] * (led - curves)


def nearest_of(places: np.ndarray, side: np.ndarray, count: int, rng) -> np.ndarray:
    """Each place's leader, one of `count` drawn among them and on its own side (S,)."""
    chosen = rng.permutation(len(places))[:count]
    apart = np.column_stack([places, 60.0 * side])
    return chosen[cKDTree(apart[chosen]).query(apart)[1]]


def covered(curves: np.ndarray, width: np.ndarray, out: np.ndarray) -> np.ndarray:
    """How much hair lies outwards of each point, in [0, 1] (S, P): 1 - exp(-optical depth).

    curves (S, P, 3), width (S,), mm; out (S P, 3) unit: away from the head.
    """
    flat = curves.reshape(-1, 3)
    low = flat.min(axis=0) - 8 * DENSITY_MM
    shape = np.ceil((flat.max(axis=0) + 8 * DENSITY_MM - low) / DENSITY_MM).astype(int) + 1
    piece, index = np.empty(len(curves)), np.empty(len(flat), int)
    for part in parts(len(curves), STRANDS):
        piece[part] = np.linalg.norm(np.diff(curves[part], axis=1), axis=2).mean(axis=1)
    weight = np.repeat(piece * width, curves.shape[1])
    for part in parts(len(flat), POINTS):
        cell = np.round((flat[part] - low) / DENSITY_MM).astype(int)
        index[part] = np.ravel_multi_index(cell.T, shape)
    amount = np.bincount(index, weight, minlength=int(np.prod(shape))).reshape(shape)
    amount = gaussian_filter(amount / DENSITY_MM**3, 0.8)[..., None]
    field, depth = Grid(low, DENSITY_MM, amount), np.zeros(len(flat))
    for part in parts(len(flat), POINTS):
        before = 0.0
        for look in LOOK_MM:
            depth[part] += field.at(flat[part] + look * out[part])[:, 0] * (look - before)
            before = look
    # (2 / pi): the mean share of its length that a strand shows a direction
    return (1 - np.exp(-depth * 2 / np.pi)).reshape(curves.shape[:2])
