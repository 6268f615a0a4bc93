"""Generated strands: scalp, brows, stubble and the fine hair of the cheeks. Every draw comes from
one seed. Lashes: stimuli/heads/lashes.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from renderer.scene import MASKS, Strands
from renderer.scene.shapes import points_on, triangle_areas
from stimuli.heads import lashes
from stimuli.heads.anatomy import Anatomy
from stimuli.heads.person import Hair, Lashes
from stimuli.heads.skin import azimuth, smoothstep

POINTS = 7


@dataclass(frozen=True)
class Scalp:
    """The fine triangles that roots are drawn on."""

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    masks: np.ndarray

    def column(self, name: str) -> np.ndarray:
        return self.masks[:, MASKS.index(name)]


@dataclass(frozen=True)
class Roots:
    """points, normals (S, 3); vertex (S,) nearest corner; weight (S, 3) and corner (S, 3) of the
    triangle.
    """

    points: np.ndarray
    normals: np.ndarray
    vertex: np.ndarray
    corners: np.ndarray
    weights: np.ndarray

    def at(self, values: np.ndarray) -> np.ndarray:
        """Per-vertex values (N, ...) interpolated at the roots."""
        return np.einsum("sk,sk...->s...", self.weights, values[self.corners])


def scatter_roots(scalp: Scalp, density: np.ndarray, count: int, rng: np.random.Generator) -> Roots:
    """`count` roots with probability proportional to area times density (N,)."""
    shares = triangle_areas(scalp.positions, scalp.faces) * density[scalp.faces].mean(axis=1)
    triangles, weights = points_on(shares, rng.random(count), rng)
    return _roots(scalp, scalp.faces[triangles], weights)


def _roots(scalp: Scalp, corners: np.ndarray, weights: np.ndarray) -> Roots:
    points = np.einsum("sk,skj->sj", weights, scalp.positions[corners])
    normals = np.einsum("sk,skj->sj", weights, scalp.normals[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertex = corners[np.arange(len(corners)), weights.argmax(axis=1)]
    return Roots(points, normals, vertex, corners, weights)


def _tangential(vector: np.ndarray, normals: np.ndarray) -> np.ndarray:
    flat = vector - normals * (vector * normals).sum(axis=1, keepdims=True)
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-6)


def grow(
    roots: Roots,
    flow: np.ndarray,
    length: np.ndarray,
    lift: np.ndarray,
    bend: np.ndarray,
    rng: np.random.Generator,
    frizz: float = 0.0,
) -> np.ndarray:
    """Strands (S, POINTS, 3): start `lift` radians above the skin along `flow` (S, 3), and lie down
    by `bend` radians.
    """
    s = np.linspace(0, 1, POINTS)
    angle = lift[:, None] - bend[:, None] * s[None]
    step = (
        np.cos(angle)[..., None] * flow[:, None] + np.sin(angle)[..., None] * roots.normals[:, None]
    )
    if frizz:
        step += (
            frizz * np.cumsum(rng.normal(size=(len(length), POINTS, 3)), axis=1) / np.sqrt(POINTS)
        )
    step *= (length / (POINTS - 1))[:, None, None]
    offsets = np.concatenate(
        [np.zeros((len(length), 1, 3)), np.cumsum(step[:, :-1], axis=1)], axis=1
    )
    return roots.points[:, None] + offsets


def _noise(p: np.ndarray, scale: float, phase: float) -> np.ndarray:
    """Smooth vector field (N, 3) in about [-1, 1]."""
    q = p / scale + phase
    return (
        np.stack(
            [
                np.sin(q @ [1.0, 1.7, -0.6]) + 0.7 * np.sin(q @ [-2.1, 0.9, 1.4] + 1),
                np.sin(q @ [0.8, -1.2, 1.9] + 2) + 0.7 * np.sin(q @ [1.9, 1.6, 0.4]),
                np.sin(q @ [1.5, 0.7, 1.1] + 4) + 0.7 * np.sin(q @ [-0.6, 2.3, -1.3] + 3),
            ],
            axis=1,
        )
        / 1.5
    )


def _pack(points, width, colour, cover, vertex) -> dict:
    return {
        "points": points,
        "width_mm": width,
        "colour": colour,
        "cover": cover,
        "root_vertex": vertex,
    }


def scalp_hair(
    scalp: Scalp, eyes: np.ndarray, rng: np.random.Generator, count: int, own: Hair
) -> dict:
    """A short cut: longer and combed forward on top, fading towards the neck and the ears."""
    roots = scatter_roots(scalp, scalp.column("hair") ** 1.5, count, rng)
    p, n = roots.points, roots.normals
    up = p[:, 1] - eyes[1]
    around = azimuth(p)
    on_top = smoothstep(40, 92, up + 0.10 * (90 - around))
    side = np.sign(p[:, 0])[:, None] * [1.0, 0, 0]
    forward = np.array([0.35, 0.0, 1.0]) + 0.0 * p
    down = np.array([0, -1.0, -0.45]) + 0.15 * side
    flow = _tangential(
        on_top[:, None] * forward
        + (1 - on_top)[:, None] * down
        + 0.30 * _noise(p, 16, 0.3)
        + 0.22 * _noise(p, 5, 2.0)
        + 0.20 * rng.normal(size=p.shape),
        n,
    )
    hair = roots.at(scalp.column("hair"))
    length = own.scalp_length * (
        (4.5 + 8.0 * smoothstep(-60, 60, up) + 16.0 * on_top)
        * (0.75 + 0.25 * hair)
        * rng.uniform(0.7, 1.1, count)
    )
    # the front edge is short and fine
    length *= 0.45 + 0.55 * hair
    lift = np.radians(24 + 14 * on_top + 8 * rng.normal(size=count))
    points = grow(roots, flow, length, lift, np.radians(18 + 22 * on_top), rng, frizz=0.08)
    layer = 2.5 + 5.5 * on_top
    height = np.einsum("spj,sj->sp", points - p[:, None], n)
    cover = np.clip(1 - height / layer[:, None], 0, 1)
    tone = np.exp(0.25 * rng.normal(size=(count, 1)))
    return _pack(
        points,
        np.full(count, 0.095) * (0.6 + 0.4 * hair),
        np.array(own.colour) * tone * (1 + 0.25 * _noise(p, 12, 5)[:, :1]),
        cover,
        roots.vertex,
    )


class Projector:
    """Drops points of the face plane (x, y) onto the skin along -z."""

    def __init__(self, scalp: Scalp):
        self._scalp = scalp
        self._mesh = trimesh.Trimesh(scalp.positions, scalp.faces, process=False, validate=False)
        self._rays = trimesh.ray.ray_pyembree.RayMeshIntersector(self._mesh)

    def roots(self, xy: np.ndarray) -> Roots:
        origin = np.column_stack([xy, np.full(len(xy), 400.0)])
        face = self._rays.intersects_first(origin, np.tile([0.0, 0.0, -1.0], (len(xy), 1)))
        if (face < 0).any():
            raise ValueError("a brow root misses the face; the landmarks do not fit this head")
        corners = self._scalp.faces[face]
        a, b, c = (self._scalp.positions[corners[:, k], :2] for k in range(3))
        area = lambda p, q, r: (
            (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])
        )
        whole = area(a, b, c)
        weights = (
            np.column_stack([area(xy, b, c), area(a, xy, c), area(a, b, xy)])
            / np.where(np.abs(whole) < 1e-12, 1e-12, whole)[:, None]
        )
        return _roots(self._scalp, corners, np.clip(weights, 0, 1))


def brows(scalp: Scalp, eye_centres, rng: np.random.Generator, count: int, own: Hair) -> list[dict]:
    """Each brow follows an arc over its eye; hairs rise at the nose and turn outwards."""
    project, out = Projector(scalp), []
    for centre in eye_centres:
        side = np.sign(centre[0])
        u = rng.beta(1.35, 1.30, count)
        x = -17.0 + 41.0 * u
        arc = (
            14.0
            + 7.4 * np.sin(np.pi * np.clip(0.06 + 0.80 * u, 0, 1))
            - 5.0 * smoothstep(0.74, 1.0, u)
        )
        half = own.brow_width * 4.0 * (1 - 0.72 * smoothstep(0.35, 1.0, u))
        half = half * smoothstep(-0.12, 0.22, u)
        v = np.clip(rng.normal(size=count) * 0.52, -1, 1)
        roots = project.roots(np.column_stack([centre[0] + side * x, centre[1] + arc + half * v]))
        tilt = (
            np.radians(62 * (1 - smoothstep(0.0, 0.35, u)) + 14 - 34 * smoothstep(0.55, 1.0, u))
            - 0.35 * v
            + 0.16 * rng.normal(size=count)
        )
        flow = _tangential(
            np.column_stack([side * np.cos(tilt), np.sin(tilt), np.zeros(count)]), roots.normals
        )
        length = (
            rng.uniform(4.5, 8.0, count)
            * (0.75 + 0.3 * smoothstep(0.0, 0.3, u))
            * (1 - 0.35 * smoothstep(0.7, 1.0, u))
        )
        points = grow(
            roots,
            flow,
            length,
            np.radians(rng.uniform(10, 24, count)),
            np.radians(np.full(count, 16.0)),
            rng,
            frizz=0.05,
        )
        out.append(
            _pack(
                points,
                rng.uniform(0.045, 0.075, count),
                np.array(own.colour) * 1.6 * np.exp(0.25 * rng.normal(size=(count, 1))),
                np.full((count, POINTS), 0.25),
                roots.vertex,
            )
        )
    return out


def stubble(scalp: Scalp, rng: np.random.Generator, count: int, own: Hair) -> dict:
    """A day's beard."""
    roots = scatter_roots(scalp, scalp.column("beard") ** 1.3, count, rng)
    flow = _tangential(
        np.array([0, -1.0, 0.1])
        + 0.5 * _noise(roots.points, 14, 1.0)
        + 0.35 * rng.normal(size=roots.points.shape),
        roots.normals,
    )
    length = rng.uniform(0.35, 1.1, count)
    points = grow(roots, flow, length, np.radians(rng.uniform(25, 60, count)), np.zeros(count), rng)
    return _pack(
        points,
        rng.uniform(0.05, 0.08, count),
        np.array(own.colour) * 1.3 * np.exp(0.3 * rng.normal(size=(count, 1))),
        np.zeros((count, POINTS)),
        roots.vertex,
    )


def vellus(scalp: Scalp, eyes: np.ndarray, rng: np.random.Generator, count: int, own: Hair) -> dict:
    """Fine pale hair on the cheeks, the ears and the forehead: seen against the light."""
    p = scalp.positions
    density = (
        (1 - scalp.column("hair"))
        * (1 - scalp.column("lips"))
        * (1 - scalp.column("inside"))
        * smoothstep(-130, -100, p[:, 1] - eyes[1])
    )
    roots = scatter_roots(scalp, density, count, rng)
    flow = _tangential(
        np.array([0, -1.0, -0.3])
        + 0.4 * _noise(roots.points, 18, 7.0)
        + 0.3 * rng.normal(size=roots.points.shape),
        roots.normals,
    )
    points = grow(
        roots,
        flow,
        rng.uniform(0.8, 2.0, count),
        np.radians(rng.uniform(20, 50, count)),
        np.radians(np.full(count, 20.0)),
        rng,
    )
    return _pack(
        points,
        np.full(count, 0.009),
        np.tile(own.vellus_colour, (count, 1)),
        np.zeros((count, POINTS)),
        roots.vertex,
    )


def all_strands(
    anatomy: Anatomy,
    scalp: Scalp,
    seed: int,
    share: float = 1.0,
    own: Hair | None = None,
    lash: Lashes | None = None,
) -> Strands:
    """Every strand of the head; share scales the numbers (tests use few)."""
    own, lash = own or Hair(), lash or Lashes()
    rng = np.random.default_rng([seed, 11])
    eyes = anatomy.landmarks["eyes"]
    balls = [ball.centre for ball in anatomy.eyes]
    parts = [
        scalp_hair(scalp, eyes, rng, int(own.scalp * share), own),
        *brows(scalp, balls, rng, int(own.brows * share), own),
        *lashes.grown(anatomy, scalp.positions, scalp.faces, rng, lash, own, POINTS),
        stubble(scalp, rng, int(own.stubble * share), own),
        vellus(scalp, eyes, rng, int(own.vellus * share), own),
    ]
    kinds = {key: np.int64 if key == "root_vertex" else np.float32 for key in parts[0]}
    return Strands(
        **{key: np.concatenate([p[key].astype(kind) for p in parts]) for key, kind in kinds.items()}
    )
