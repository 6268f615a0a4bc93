"""Generated shapes: meshes with normals and an atlas that does not overlap.

All are centred on the origin, in millimetres, tessellated finely enough for light that is baked
per vertex.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CELLS = 48  # of a face's longer side
ATLAS_MARGIN = 0.02  # of an atlas cell, kept free around each face


@dataclass(frozen=True)
class Shape:
    """positions, normals (N, 3); uvs (N, 2) in [0, 1]; faces (M, 3), outside counter-clockwise.

    colours (N, 3): linear albedo where the shape has its own, else None.
    """

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    faces: np.ndarray
    colours: np.ndarray | None = None
    generated: bool = True


def triangle_areas(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Areas (M,) of triangles (M, 3) of positions (N, 3), in their unit squared."""
    a, b, c = (positions[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def points_on(
    shares: np.ndarray, at: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (K,) and barycentric weights (K, 3) of points, uniform within a triangle.

    shares (M,): of the triangles, of any sum; at (K,): places in their running sum, 0 to 1. The
    weights are 1 - sqrt(x), (1 - y) sqrt(x), y sqrt(x) (Turk 1990, "Generating random points in
    triangles", Graphics Gems).
    """
    running = np.cumsum(shares)
    triangles = np.minimum(np.searchsorted(running, at * running[-1]), len(shares) - 1)
    x, y = rng.random((2, len(at)))
    x = np.sqrt(x)
    return triangles, np.column_stack([1 - x, (1 - y) * x, y * x])


def vertex_normals(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area-weighted unit normals (N, 3) of triangles (M, 3)."""
    p = np.asarray(positions, float)
    a, b, c = (p[faces[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    total = np.zeros_like(p)
    for k in range(3):
        np.add.at(total, faces[:, k], area)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def grid_faces(rows: int, columns: int) -> np.ndarray:
    """Triangles (2 (rows - 1) (columns - 1), 3) of a grid of vertices, row by row."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    b, c, d = a + 1, a + columns, a + columns + 1
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def sphere(radius_mm: float, rings: int = 96) -> Shape:
    """A sphere; its atlas is latitude and longitude."""
    v, u = np.meshgrid(
        np.linspace(0, 1, rings + 1), np.linspace(0, 1, 2 * rings + 1), indexing="ij"
    )
    theta, phi = np.pi * (1 - v), 2 * np.pi * (u - 0.5)
    normals = np.stack(
        [np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=2
    ).reshape(-1, 3)
    uvs = np.stack([u, v], axis=2).reshape(-1, 2)
    return Shape(radius_mm * normals, normals, uvs, grid_faces(rings + 1, 2 * rings + 1))


def knot(radius_mm: float, tube_mm: float, along: int = 360, around: int = 36) -> Shape:
    """A tube in a trefoil knot, (2 + cos 3t) (cos 2t, sin 2t), sin 3t, whose middle reaches
    radius_mm from the axis; its atlas is along and around.
    """
    t = np.linspace(0, 2 * np.pi, along + 1)
    scale = radius_mm / 3

    def middle(t: np.ndarray) -> np.ndarray:
        wide = 2 + np.cos(3 * t)
        return scale * np.column_stack([wide * np.cos(2 * t), wide * np.sin(2 * t), np.sin(3 * t)])

    step = 1e-5
    tangent = (middle(t + step) - middle(t - step)) / (2 * step)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    # away from the torus's ring: a frame that turns smoothly and closes
    ring = 2 * scale * np.column_stack([np.cos(2 * t), np.sin(2 * t), 0 * t])
    out = middle(t) - ring
    out -= np.einsum("ki,ki->k", out, tangent)[:, None] * tangent
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    side = np.cross(tangent, out)
    u, v = np.meshgrid(np.arange(along + 1) / along, np.arange(around + 1) / around, indexing="ij")
    a = 2 * np.pi * v[..., None]
    normals = np.cos(a) * out[:, None] + np.sin(a) * side[:, None]
    positions = middle(t)[:, None] + tube_mm * normals
    uvs = np.stack([u, v], axis=2).reshape(-1, 2)
    faces = grid_faces(along + 1, around + 1)
    return Shape(positions.reshape(-1, 3), normals.reshape(-1, 3), uvs, faces)


_SIDES = (  # outward normal, direction of u, direction of v
    ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
    ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ((-1, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
)


def _join(parts: list[Shape]) -> Shape:
    start = np.cumsum([0] + [len(part.positions) for part in parts])
    faces = [part.faces + s for part, s in zip(parts, start, strict=False)]
    colours = None if parts[0].colours is None else np.vstack([p.colours for p in parts])
    return Shape(
        np.vstack([p.positions for p in parts]),
        np.vstack([p.normals for p in parts]),
        np.vstack([p.uvs for p in parts]),
        np.vstack(faces),
        colours,
    )


def _side(k: int, size: np.ndarray, inward: bool, cells: int) -> Shape:
    normal, along_u, along_v = (np.array(axis, float) for axis in _SIDES[k])
    longest = size.max()
    counts = [max(2, round(cells * abs(axis @ size) / longest)) for axis in (along_u, along_v)]
    v, u = np.meshgrid(
        np.linspace(0, 1, counts[1] + 1), np.linspace(0, 1, counts[0] + 1), indexing="ij"
    )
    u, v = u.ravel(), v.ravel()
    local = normal[None] + (2 * u - 1)[:, None] * along_u + (2 * v - 1)[:, None] * along_v
    positions = 0.5 * local * size
    faces = grid_faces(counts[1] + 1, counts[0] + 1)
    if inward:
        normal, faces = -normal, faces[:, ::-1]
    column, row = k % 3, k // 3
    inner = ATLAS_MARGIN + (1 - 2 * ATLAS_MARGIN) * np.stack([u, v], axis=1)
    uvs = (np.array([column, row]) + inner) / [3, 2]
    return Shape(positions, np.tile(normal, (len(positions), 1)), uvs, faces)


def slab(size_mm, cells: int = CELLS) -> Shape:
    """A closed box of width, height, depth; flat sides, each in a cell of the atlas."""
    size = np.array(size_mm, float)
    return _join([_side(k, size, False, cells) for k in range(6)])


def room(size_mm, left, right, other, closed: bool = False, cells: int = CELLS // 2) -> Shape:
    """The inner faces of a box, open towards +z or closed; albedo of left, right, other walls."""
    size = np.array(size_mm, float)
    parts = []
    for k in (0, 1, 2, 3, 4, 5) if closed else (1, 2, 3, 4, 5):
        side = _side(k, size, True, cells)
        colour = {2: right, 3: left}.get(k, other)
        colours = np.tile(np.array(colour, float), (len(side.positions), 1))
        parts.append(Shape(side.positions, side.normals, side.uvs, side.faces, colours))
    return _join(parts)
