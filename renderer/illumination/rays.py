"""A scene as rays meet it: triangles with smooth normals, materials, lamps, an environment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pyrender

from renderer.errors import InputError
from renderer.illumination.models import Coefficients, dot, reflected, unit
from renderer.passes.bake import Tracer, body
from renderer.passes.environment import Surroundings
from renderer.scene.graph import contents
from renderer.scene.material import Shading
from renderer.scene.view import View

#: mm along the normal at which a ray that goes on starts.
OFFSET_MM = 0.01
SHARP = 4096.0  # of the lobe through which rays see an environment map


@dataclass(frozen=True)
class Hits:
    """Where K of the rays meet a surface.

    ray (K,): their places; triangle (K,); points, normals (K, 3): mm, and unit vectors on the side
    that the ray comes from, smooth and `flat`; behind (K,): met from behind, that is inside of a
    clear body; at: the material there.
    """

    ray: np.ndarray
    triangle: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    flat: np.ndarray
    behind: np.ndarray
    at: Coefficients


class World:
    """Surfaces and eyes of a graph, without hair, for rays on the CPU; seed: of soft shadows."""

    def __init__(self, graph: pyrender.Scene, seed: int = 0):
        parts = contents(graph)
        items = [*parts.surfaces, *parts.eyes]
        if not items:
            raise InputError("the scene has no surface; expected at least one mesh")
        bodies = [body(item) for item in items]
        start = np.cumsum([0] + [len(b.positions) for b in bodies])
        self.faces = np.vstack(
            [b.faces.astype(np.int64) + s for b, s in zip(bodies, start, strict=False)]
        )
        self.positions = np.vstack([b.positions for b in bodies]).astype(float)
        self.normals = np.vstack([b.normals for b in bodies]).astype(float)
        self.albedo = np.vstack([b.albedo for b in bodies]).astype(float)
        own = [_own(b.positions, item.pose) for b, item in zip(bodies, items, strict=True)]
        self.own = np.vstack(own)  # positions along each object's own axes, mm
        self.body = np.repeat(np.arange(len(bodies)), [len(b.faces) for b in bodies])
        eye = Shading(model="lambert", albedo=(0.5, 0.5, 0.5))
        materials = [item.primitive.material.value for item in parts.surfaces]
        self.coefficients = Coefficients.of([*materials, *[eye] * len(parts.eyes)])
        self.surroundings = Surroundings(parts.environment)
        self.mean_radiance = self.surroundings.mean()
        self.tracer = Tracer(self.positions, self.faces, parts.lights, self.environment, seed)
        self.flat = np.asarray(self.tracer.mesh.face_normals, float)
        self.areas = np.asarray(self.tracer.mesh.area_faces, float)

    def environment(self, towards: np.ndarray) -> np.ndarray:
        """Radiance (N, 3) from unit directions (N, 3)."""
        return self.surroundings.radiance(towards, SHARP)

    def meet(self, origins: np.ndarray, towards: np.ndarray) -> Hits:
        """What rays (N, 3), (N, 3) meet first."""
        triangle, distance = self.tracer.first(origins, towards)
        ray = np.flatnonzero((triangle >= 0) & np.isfinite(distance))
        triangle, d = triangle[ray], towards[ray]
        points = origins[ray] + distance[ray, None] * d
        corners = self.faces[triangle]
        weights = _barycentric(points, self.positions[corners])
        normals = unit(np.einsum("kc,kci->ki", weights, self.normals[corners]))
        flat = self.flat[triangle]
        behind = dot(flat, d) > 0
        side = np.where(behind, -1.0, 1.0)[:, None]
        normals, flat = normals * side, flat * side
        away = dot(normals, d) > -1e-3  # a smooth normal at the rim of a body
        normals = np.where(away[:, None], flat, normals)
        albedo = np.einsum("kc,kci->ki", weights, self.albedo[corners])
        at = self.coefficients.at(self.body[triangle], albedo)
        return Hits(ray, triangle, points, normals, flat, behind, at)

    def direct(
        self, hits: Hits, towards_eye: np.ndarray, rng: np.random.Generator | None = None
    ) -> np.ndarray:
        """Radiance (K, 3) towards the eye of the lamps' light by the local models.

        rng: draws a place on each lamp; None: shadows are those of points.
        """
        total = np.zeros((len(hits.ray), 3))
        for towards, irradiance in self.tracer.lit(hits.points, hits.normals, 1, rng):
            total += reflected(hits.at, hits.normals, towards, towards_eye, irradiance)
        return total


def _own(positions: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Positions (N, 3) in the world along an object's axes, mm of the world."""
    turn = pose[:3, :3] / np.linalg.norm(pose[:3, 0])
    return (positions - pose[:3, 3]) @ turn


def _barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Weights (K, 3) of points (K, 3) in triangles (K, 3, 3), cut off at the edges."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb, pa, pb = dot(a, a), dot(a, b), dot(b, b), dot(p, a), dot(p, b)
    area = np.maximum(aa * bb - ab * ab, 1e-30)
    v, w = (bb * pa - ab * pb) / area, (aa * pb - ab * pa) / area
    weights = np.clip(np.column_stack([1 - v - w, v, w]), 0, 1)
    return weights / weights.sum(axis=1, keepdims=True)


def camera_rays(
    view: View, width: int, height: int, shift: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions (H W, 3) through the pixels, row by row from the top.

    shift: (H W, 2) in [0, 1), the place in the pixel; None: its middle.
    """
    y, x = np.mgrid[:height, :width].reshape(2, -1)
    shift = np.full((1, 2), 0.5) if shift is None else shift
    u, v = (x + shift[:, 0]) / width, (y + shift[:, 1]) / height
    seen = np.column_stack([2 * u - 1, 1 - 2 * v, np.ones(width * height)])
    towards = unit(seen @ view.rays().T)
    return np.broadcast_to(view.eye, towards.shape).astype(float), towards


def picture(
    shade: Callable[[np.ndarray, np.ndarray], np.ndarray],
    view: View,
    size: tuple[int, int],
    supersample: int = 1,
) -> np.ndarray:
    """Radiance (H, W, 3): `shade` takes origins and directions (N, 3) to radiance (N, 3)."""
    width, height = size
    total = np.zeros((height * width, 3))
    for shift in places(supersample):
        total += shade(*camera_rays(view, width, height, np.tile(shift, (width * height, 1))))
    return (total / supersample**2).reshape(height, width, 3)


def places(supersample: int) -> Iterator[np.ndarray]:
    """The middles (2,) of the supersample^2 parts of a pixel."""
    for k in range(supersample**2):
        yield (np.array([k % supersample, k // supersample]) + 0.5) / supersample
