"""Where techniques differ from the truth: beside the edges of shadows, and in back-lit thin parts.

By rays from the points that pixels show, towards each lamp's middle; normals are those of the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from renderer.reference.walk import FAR, Solid
from renderer.scene.lights import DistantLight, Light

OFF_MM = 0.05  # rays start so far off the face
FACING = 0.1  # least cosine at which a lamp's light, and so its shadow, is counted
STEP = 4.0  # neighbours whose depths differ by more pixels than this are not on one surface


def towards(light: Light, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (N, 3) from points to a lamp's middle, and its distance (N,) in mm."""
    if isinstance(light, DistantLight):
        return np.broadcast_to(light.towards, points.shape), np.full(len(points), float(FAR))
    away = light.place - points
    distance = np.linalg.norm(away, axis=1)
    return away / np.maximum(distance, 1e-9)[:, None], distance


def near_shadow_edges(
    everything: Solid,
    lights: Sequence[Light],
    points: np.ndarray,
    normals: np.ndarray,
    where: np.ndarray,
    depths: np.ndarray,
    pixels_per_mm: float,
    within_mm: float,
) -> np.ndarray:
    """Pixels (H, W) that lie within so many mm, across the screen, of a cast shadow's edge.

    points, normals (N, 3): of the pixels `where` (H, W), in their order; everything: what is in
    the lamps' way; depths (H, W) mm. An edge lies between neighbours on one surface, both turned to
    a lamp, of which one sees it.
    """
    from scipy.ndimage import distance_transform_edt

    edges = np.zeros(where.shape, bool)
    for light in lights:
        if not light.shadow:
            continue
        direction, distance = towards(light, points)
        cosine = np.einsum("ni,ni->n", normals, direction)
        origin = points + OFF_MM * normals - everything.middle
        seen = everything.hits(origin, direction, distance)[0] < 0
        turned, lit = np.zeros(where.shape, bool), np.zeros(where.shape, bool)
        turned[where], lit[where] = cosine > FACING, seen
        pixel_mm = depths / pixels_per_mm
        for axis in (0, 1):
            one = [slice(None)] * 2
            other = [slice(None)] * 2
            one[axis], other[axis] = slice(None, -1), slice(1, None)
            one, other = tuple(one), tuple(other)
            near = np.abs(depths[one] - depths[other]) < STEP * pixel_mm[one]
            edge = turned[one] & turned[other] & near & (lit[one] != lit[other])
            edges[one] |= edge
            edges[other] |= edge
    if not edges.any():
        return edges
    return where & (distance_transform_edt(~edges) * depths / pixels_per_mm <= within_mm)


def back_lit(
    everything: Solid,
    solid: Solid,
    lights: Sequence[Light],
    points: np.ndarray,
    normals: np.ndarray,
    thickness_mm: float,
) -> np.ndarray:
    """Which of points (N, 3) on a solid are turned away from a lamp whose light reaches the other
    side of it, straight through the solid, within so many mm.
    """
    lit_through = np.zeros(len(points), bool)
    for light in lights:
        direction, distance = towards(light, points)
        away = np.einsum("ni,ni->n", normals, direction) < 0
        inside = points - OFF_MM * normals - solid.middle
        triangle, far, _, _ = solid.hits(inside, direction, thickness_mm)
        out = np.einsum("ni,ni->n", solid.normals[triangle], direction) > 0
        beyond = points + direction * (far.astype(float) + 2 * OFF_MM)[:, None]
        free = np.ones(len(points), bool)
        if light.shadow:
            free = everything.hits(beyond - everything.middle, direction, distance)[0] < 0
        lit_through |= away & (triangle >= 0) & out & free
    return lit_through
