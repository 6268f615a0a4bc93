"""Where light is sampled for splats: points over a surface, or a grid in the view of each lamp.

Rohat 2012, ch. 5.1 (point lights: a grid over the part of a lamp's picture that the object takes
up) and ch. 5.3 (environments: points over the mesh by area, relaxed). Rays find what a lamp's
picture would hold at the middle, or at a random place, of a grid's cell: the nearest front face of
the object, and behind it the back face through which light would leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from renderer.errors import InputError
from renderer.passes.bake import Tracer
from renderer.passes.surfaces import Drawn
from renderer.scene.graph import look_at
from renderer.scene.lights import DistantLight, Light, PointLight
from renderer.scene.relaxation import Mesh, relax
from renderer.scene.shapes import points_on

MOST_POINTS = 4_000_000
INSIDE_MM = 1e-2  # under a face from which a ray starts into the object
LEAST_COSINE = 0.05  # of a footprint, whose area grows as 1 / cosine
_CUBE = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


def spread(
    areas: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (count,) and barycentric weights (count, 3) of points that each stand for the same
    area: one in every stratum of the running sum of the triangles' areas (M,) (Rohat 2012, sec.
    5.3.2).
    """
    return points_on(areas, (np.arange(count) + rng.random(count)) / count, rng)


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of one object, K of them.

    part (K,): the place of its surface in the object's; triangles (K,) of that surface, weights (K,
    3); area_mm2 (K,): what a point stands for; spacing_mm: the side of the square of a typical one;
    depth_mm (K,): how thick the object is below it, inf where no far face is.
    """

    part: np.ndarray
    triangles: np.ndarray
    weights: np.ndarray
    area_mm2: np.ndarray
    spacing_mm: float
    depth_mm: np.ndarray


class Body:
    """Surfaces that light may travel between: an object, or all of one medium."""

    def __init__(self, parts: Sequence[Drawn], seed: int):
        self.parts, self._seed = tuple(parts), seed
        positions = [d.item.in_world(d.item.primitive.positions) for d in self.parts]
        faces = [d.item.primitive.faces for d in self.parts]
        start = np.cumsum([0, *map(len, positions)])
        self.positions = np.vstack(positions)
        self.faces = np.vstack([f.astype(np.int64) + s for f, s in zip(faces, start, strict=False)])
        self.first = np.cumsum([0, *map(len, faces)])
        self.mesh = Mesh(self.positions, self.faces)

    @cached_property
    def _rays(self) -> Tracer:
        return Tracer(self.positions, self.faces, (), np.zeros_like, 0)

    def _samples(self, triangles, weights, area_mm2, spacing_mm, towards) -> Samples:
        """Samples of places, with the depth along unit directions (K, 3) into the object."""
        part = np.searchsorted(self.first, triangles, side="right") - 1
        places, n = self.mesh.at(triangles, weights), self.mesh.normals[triangles]
        _, depth = self._rays.first(places - INSIDE_MM * n + INSIDE_MM * towards, towards)
        areas = np.broadcast_to(area_mm2, len(triangles)).astype(float)
        own = triangles - self.first[part]
        return Samples(part, own, weights, areas, spacing_mm, depth + INSIDE_MM)

    def over_surface(self, spacing_mm: float, rounds: int, where: str) -> Samples:
        """Points by area, relaxed by so many rounds; depth is below the face."""
        area = self.mesh.areas.sum()
        count = max(1, round(area / spacing_mm**2))
        _refuse_many(where, spacing_mm, count, area)
        rng = np.random.default_rng([self._seed, self.parts[0].item.mesh])
        triangles, weights = spread(self.mesh.areas, count, rng)
        triangles, weights = relax(self.mesh, triangles, weights, rounds)
        into = -self.mesh.normals[triangles]
        return self._samples(triangles, weights, area / count, np.sqrt(area / count), into)

    def from_lamp(
        self,
        light: Light,
        spacing_mm: float,
        grid: tuple[int, int],
        jitter: float,
        published_area: bool,
        along_light: bool,
        where: str,
    ) -> Samples | None:
        """Points where a grid over the object, as a lamp sees it, meets its front; None: nowhere.

        grid: columns and rows, (0, 0) for as many as the spacing asks for; jitter: share of a cell
        by which points are moved at random. published_area: a point stands for the area of the
        sides of the object's bounding box that face the lamp, over the cells of the grid (Rohat
        2012, eq. 4.6, sec. 5.1.1); else for its own footprint. along_light: the depth is that along
        the light (sec. 5.1.2), else below the face.
        """
        rng = np.random.default_rng([self._seed, self.parts[0].item.mesh, 1])
        cells = (spacing_mm, grid, jitter, rng, where)
        origins, towards, spot = _rays_over(light, self.positions, *cells)
        triangles, distance = self._rays.first(origins, towards)
        n = self.mesh.normals[triangles]
        cosine = -np.einsum("ki,ki->k", n, towards)
        on = np.flatnonzero((triangles >= 0) & (cosine > 0))
        if not len(on):
            return None
        triangles, distance, cosine = triangles[on], distance[on], cosine[on]
        towards, n = towards[on], n[on]
        places = origins[on] + distance[:, None] * towards
        seen = spot[on] * (1.0 if isinstance(light, DistantLight) else distance**2)
        area = seen / np.maximum(cosine, LEAST_COSINE)
        spacing = float(np.sqrt(np.median(area)))
        if published_area:
            area = np.full(len(on), self._box_area(light) / len(origins))
        into = towards if along_light else -n
        weights = self.mesh.weights(triangles, places)
        return self._samples(triangles, weights, area, spacing, into)

    def _box_area(self, light: Light) -> float:
        """Of the sides of the bounding box that face a lamp, mm2."""
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        size, total = high - low, 0.0
        for axis in range(3):
            if isinstance(light, PointLight):
                faces = int(light.place[axis] > high[axis]) + int(light.place[axis] < low[axis])
            else:
                faces = int(abs(light.towards[axis]) > 1e-6)
            total += faces * np.prod(np.delete(size, axis))
        return float(total)


def _refuse_many(where: str, spacing_mm: float, count: int, area: float) -> None:
    if count > MOST_POINTS:
        raise InputError(
            f"{where}.spacing_mm is {spacing_mm:g}, {count} points on {area:.0f} mm2; "
            f"expected at most {MOST_POINTS} points"
        )


def _rays_over(light, points, spacing_mm, grid, jitter, rng, where):
    """Rays through the cells of a grid over the region that points (N, 3) take up in a lamp's view.

    Origins and unit directions (K, 3), and what a cell measures (K,): mm2 of a distant lamp, else
    the solid angle.
    """
    rest = (grid, jitter, rng, where)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    if isinstance(light, DistantLight):
        turn = look_at(light.towards, np.zeros(3))[:3, :3]
        local = points @ turn
        low, high = local[:, :2].min(axis=0), local[:, :2].max(axis=0)
        at, cell = _cells(low, high, spacing_mm, *rest)
        far = np.full(len(at), local[:, 2].max() + 1.0)
        towards = np.broadcast_to(-light.towards, (len(at), 3)).copy()
        return np.column_stack([at, far]) @ turn.T, towards, np.full(len(at), cell)
    axis = middle - light.place
    away = np.linalg.norm(axis)
    turn = look_at(np.zeros(3), axis / max(away, 1e-9))[:3, :3] if away > 0 else np.eye(3)
    local = (points - light.place) @ turn
    if away > 0 and (-local[:, 2] > 0.2 * np.linalg.norm(local, axis=1)).all():
        flat = local[:, :2] / -local[:, 2:]
        views = [(turn, flat.min(axis=0), flat.max(axis=0))]
    else:  # a lamp among the object's parts sees all around
        views = [
            (look_at(np.zeros(3), np.array(side, float))[:3, :3], -np.ones(2), np.ones(2))
            for side in _CUBE
        ]
    towards, spot = [], []
    for turn, low, high in views:
        at, cell = _cells(low, high, spacing_mm / max(away, spacing_mm), *rest)
        long = np.sqrt(1 + (at**2).sum(axis=1))
        local = np.column_stack([at, np.full(len(at), -1.0)]) / long[:, None]
        towards.append(local @ turn.T)
        spot.append(cell / long**3)
    towards = np.vstack(towards)
    return np.broadcast_to(light.place, towards.shape).copy(), towards, np.concatenate(spot)


def _cells(low, high, spacing, grid, jitter, rng, where):
    """A place in each cell of a grid over a rectangle (K, 2), and a cell's area."""
    size = np.maximum(high - low, 1e-9)
    count = np.maximum(np.ceil(size / spacing), 1) if grid == (0, 0) else np.array(grid, float)
    _refuse_many(where, spacing, int(count.prod()), float(size.prod()))
    x, y = np.meshgrid(*(np.arange(int(n)) for n in count), indexing="ij")
    places = np.column_stack([x.ravel(), y.ravel()]) + 0.5
    places += jitter * (rng.random(places.shape) - 0.5)
    return low + places / count * size, float((size / count).prod())
