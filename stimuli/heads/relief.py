"""The height field of a person's form: curves on the skin, and how far each vertex is moved.

A curve's points are given on the base mesh without targets and carried to the person by the mesh
itself, so that they lie on the same anatomy whatever the morphs; widths and heights are the
person's own millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from stimuli.heads.form import PLACES, Form, Place, Relief
from stimuli.heads.smooth import smoothstep
from stimuli.heads.subdivide import triangles

STEP_MM = 0.5  # between the samples of a curve
REACH = 3.2  # widths: farther away nothing is moved
NARROW_MM = 3.0  # curves of a smaller width want finer triangles


@dataclass(frozen=True)
class Curve:
    """A fold or rise on the person: samples, tangents and normals (K, 3), along (K,) in [0, 1]."""

    name: str
    place: Place
    relief: Relief
    side: int  # +1 the person's left, -1 the right, 0 the middle
    points: np.ndarray
    tangents: np.ndarray
    normals: np.ndarray
    along: np.ndarray


class Reference:
    """The base mesh without targets beside the person's, vertex by vertex (N, 3); eyes (3,): the
    middle between the reference's eyes, mm.
    """

    def __init__(self, points, quads, eyes, own, own_normals):
        import trimesh

        self._points, self._faces = points - eyes * [0, 1, 0], triangles(quads)
        self._own, self._normals = own, own_normals
        mesh = trimesh.Trimesh(self._points, self._faces, process=False, validate=False)
        self._rays = trimesh.ray.ray_pyembree.RayMeshIntersector(mesh)
        self._tree, self._own_tree = cKDTree(self._points), cKDTree(own)

    def carried(self, points: np.ndarray) -> np.ndarray:
        """Where the person has reference points (K, 3), of which z may be nan: (K, 3)."""
        result = np.empty((len(points), 3))
        front = np.isnan(points[:, 2])
        _, near = self._tree.query(np.where(front[:, None], 0, points))
        result[:] = self._own[near]
        if front.any():
            at = points[front].copy()
            at[:, 2] = 1000.0
            face = self._rays.intersects_first(at, np.tile([0.0, 0.0, -1.0], (len(at), 1)))
            if (face < 0).any():
                raise ValueError(f"points {points[front][face < 0]} miss the reference head")
            corners = self._faces[face]
            a, b, c = (self._points[corners[:, k], :2] for k in range(3))
            u = _area(at[:, :2], b, c)
            v = _area(a, at[:, :2], c)
            w = _area(a, b, at[:, :2])
            weights = np.column_stack([u, v, w]) / (u + v + w)[:, None]
            result[front] = np.einsum("kc,kcj->kj", weights, self._own[corners])
        return result

    def laid(self, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Samples (K, 3) near the person's skin laid on it, and its normals there."""
        _, near = self._own_tree.query(samples, k=4)
        normals = self._normals[near].mean(axis=1)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        off = ((samples - self._own[near].mean(axis=1)) * normals).sum(axis=1)
        return samples - off[:, None] * normals, normals


def _area(p, q, r):
    return (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])


def curves(form: Form, reference: Reference) -> list[Curve]:
    """All folds and rises of a form that are not flat, on the person."""
    made = []
    for k, (name, place) in enumerate(PLACES.items()):
        relief = form.of(name)
        if relief.height_mm == 0 and relief.bulge_mm == 0:
            continue
        for side in (1, -1) if place.both else (0,):
            rng = np.random.default_rng([form.seed, 11, k, side + 1])
            points = np.array([(*p, np.nan)[:3] for p in place.points], float)
            if side < 0:
                points[:, 0] *= -1
            # the more of a curve's width it strays by, the less it is that fold
            stray = min(form.wander_mm, 0.5 * relief.width_mm) if place.fold else 0.0
            points[:, :2] += np.clip(rng.normal(size=(len(points), 2)), -1.5, 1.5) * stray / 1.5
            weak = place.fold and side and (side > 0) == (form.weaker == "left")
            share = 1 - form.asymmetry if weak else 1.0
            own = Relief(
                relief.height_mm * share,
                relief.width_mm,
                relief.bulge_mm * share,
                relief.bulge_width_mm,
            )
            made.append(_curve(name, place, own, side, reference.carried(points), reference))
    return made


def _curve(name, place, relief, side, points, reference: Reference) -> Curve:
    if len(points) == 1:
        laid, normals = reference.laid(points)
        return Curve(name, place, relief, side, laid, np.zeros((1, 3)), normals, np.full(1, 0.5))
    chord = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    spline = CubicSpline(chord, points)
    count = max(int(chord[-1] / STEP_MM), 2)
    samples, normals = reference.laid(spline(np.linspace(0, chord[-1], count)))
    tangents = np.gradient(samples, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
    return Curve(
        name, place, relief, side, samples, tangents, normals, np.linspace(0, 1, len(samples))
    )


def narrow(made: list[Curve], points: np.ndarray) -> np.ndarray:
    """(N,) bool: the points so near to a narrow curve that coarse triangles would blur it."""
    near = np.zeros(len(points), bool)
    for curve in made:
        wide = curve.relief.width_mm
        if wide < NARROW_MM:
            reach = 1.5 + 1.8 * wide
            distance, _ = cKDTree(curve.points).query(points, distance_upper_bound=reach)
            near |= np.isfinite(distance)
    return near


def offsets(made: list[Curve], points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """How far the vertices are moved (N, 3), mm; points and normals (N, 3) before that."""
    result = np.zeros_like(points)
    for curve in made:
        relief, place = curve.relief, curve.place
        reach = REACH * max(relief.width_mm, 0.75 * relief.bulge_width_mm * (relief.bulge_mm != 0))
        low, high = curve.points.min(axis=0) - reach, curve.points.max(axis=0) + reach
        near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
        distance, which = cKDTree(curve.points).query(points[near], distance_upper_bound=reach)
        near, which = near[np.isfinite(distance)], which[np.isfinite(distance)]
        away = points[near] - curve.points[which]
        tangent, normal = curve.tangents[which], curve.normals[which]
        # between two samples the curve is straight
        along = np.clip((away * tangent).sum(axis=1), -STEP_MM / 2, STEP_MM / 2)
        away -= along[:, None] * tangent
        flat = away - (away * normal).sum(axis=1, keepdims=True) * normal
        d = np.linalg.norm(flat, axis=1)
        begin, end = place.taper
        t = curve.along[which]
        share = np.ones(len(t))
        if len(curve.points) > 1:
            share *= smoothstep(0, 1, t / begin) if begin else 1.0
            share *= smoothstep(0, 1, (1 - t) / end) if end else 1.0
        facing = (normals[near] * normal).sum(axis=1)
        share *= smoothstep(0, 1, (facing - 0.05) / 0.35)
        height = relief.height_mm * np.exp(-((d / relief.width_mm) ** 2))
        if relief.bulge_mm:
            across = np.cross(normal, tangent)
            outer = (flat * across).sum(axis=1) * (-place.bulge if curve.side < 0 else place.bulge)
            x = np.maximum(outer, 0) / relief.bulge_width_mm
            height += relief.bulge_mm * x**2 * np.exp(1 - x**2)
        result[near] += (share * height)[:, None] * normals[near]
    return result
