"""Catmull-Clark subdivision of quad meshes as sparse linear maps.

Catmull and Clark 1978, "Recursively generated B-spline surfaces on arbitrary topological meshes",
doi:10.1016/0010-4485(78)90110-0. A level is one sparse matrix, so that any per-vertex attribute
follows the geometry by a product with it.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy import sparse


def _edges(quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unique undirected edges (E, 2) of quads (F, 4), and the edge of each quad side (F, 4)."""
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    low, high = sides.min(axis=1).astype(np.int64), sides.max(axis=1)
    count = int(high.max()) + 1
    keys, of_side = np.unique(low * count + high, return_inverse=True)
    return np.stack(np.divmod(keys, count), axis=1), of_side.reshape(-1, 4)


def _children(quads: np.ndarray, of_side: np.ndarray, vertices: int, edges: int) -> np.ndarray:
    """The four children of each quad: (4F, 4), child k holds corner k of its parent."""
    face = vertices + edges + np.arange(len(quads))
    edge = vertices + of_side
    child = [np.stack([quads[:, k], edge[:, k], face, edge[:, k - 1]], axis=1) for k in range(4)]
    return np.stack(child, axis=1).reshape(-1, 4)


def _incidence(
    rows: np.ndarray, columns: np.ndarray, value: float, shape: tuple[int, int]
) -> sparse.csr_matrix:
    """Sparse matrix with `value` at each (row, column)."""
    return sparse.csr_matrix((np.full(rows.size, value), (rows.ravel(), columns.ravel())), shape)


def _points(quads: np.ndarray, vertices: int):
    """Edges, edge of each side, and the maps to face centres (F, V) and edge midpoints (E, V)."""
    edges, of_side = _edges(quads)
    of_face = np.repeat(np.arange(len(quads)), 4)
    of_edge = np.repeat(np.arange(len(edges)), 2)
    face = _incidence(of_face, quads, 0.25, (len(quads), vertices))
    mid = _incidence(of_edge, edges, 0.5, (len(edges), vertices))
    return edges, of_side, of_face, of_edge, face, mid


def catmull_clark(quads: np.ndarray, vertices: int) -> tuple[sparse.csr_matrix, np.ndarray]:
    """One Catmull-Clark level.

    Parameters: quads (F, 4) int; vertices, their number V.
    Returns: the map (V', V) with rows that sum to 1, and the new quads (4F, 4).
    Border edges follow the cubic B-spline curve rule.
    """
    edges, of_side, of_face, of_edge, face, mid = _points(quads, vertices)
    n_e, n_f = len(edges), len(quads)
    touching = _incidence(of_side, of_face, 1.0, (n_e, n_f))
    faces_at_edge = np.asarray(touching.sum(axis=1)).ravel()
    inner = sparse.diags((faces_at_edge == 2).astype(float))
    border = sparse.diags((faces_at_edge != 2).astype(float))
    edge_point = inner @ (0.5 * mid + 0.25 * (touching @ face)) + border @ mid

    at_vertex = _incidence(quads, of_face, 1.0, (vertices, n_f))
    edge_at = _incidence(edges, of_edge, 1.0, (vertices, n_e))
    n_faces = np.asarray(at_vertex.sum(axis=1)).ravel()
    n_edges = np.asarray(edge_at.sum(axis=1)).ravel()
    on_border = np.asarray((edge_at @ border).sum(axis=1)).ravel() > 0
    used = n_faces > 0
    n = np.where(used, n_faces, 1)
    smooth = (
        sparse.diags(1 / n**2) @ at_vertex @ face
        + sparse.diags(2 / (n * np.where(used, n_edges, 1))) @ edge_at @ mid
        + sparse.diags((n - 3) / n)
    )
    border_edges = edge_at @ border
    n_border = np.where(on_border, np.asarray(border_edges.sum(axis=1)).ravel(), 1)
    curve = 0.5 * sparse.identity(vertices) + sparse.diags(0.5 / n_border) @ border_edges @ mid
    vertex_point = (
        sparse.diags((used & ~on_border).astype(float)) @ smooth
        + sparse.diags((used & on_border).astype(float)) @ curve
        + sparse.diags((~used).astype(float))
    )
    return sparse.vstack([vertex_point, edge_point, face]).tocsr(), _children(
        quads, of_side, vertices, n_e
    )


def bilinear(quads: np.ndarray, vertices: int) -> tuple[sparse.csr_matrix, np.ndarray]:
    """One level that keeps the old points (texture coordinates): edge and face points are means."""
    edges, of_side, _, _, face, mid = _points(quads, vertices)
    return sparse.vstack([sparse.identity(vertices), mid, face]).tocsr(), _children(
        quads, of_side, vertices, len(edges)
    )


def triangles(quads: np.ndarray) -> np.ndarray:
    """Two triangles a quad: (2F, 3)."""
    return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def vertex_normals(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area-weighted unit vertex normals (N, 3) of triangles (M, 3)."""
    a, b, c = (positions[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(normal[:, k], 3), len(positions)) for k in range(3)],
        axis=1,
    )
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)


def refined(
    quads: np.ndarray, uv_quads: np.ndarray, vertices: int, uvs: int, chosen: np.ndarray
) -> tuple[sparse.csr_matrix, sparse.csr_matrix, np.ndarray, np.ndarray, np.ndarray]:
    """One Catmull-Clark level of the chosen quads (F,) bool alone; the others become triangles that
    meet them without gaps.

    All old vertices stay, first and in their order, where the level moves them to. Returns: the
    rows of `catmull_clark`'s map that are kept (V', V); those of `bilinear`'s for the texture
    coordinates; triangles (M, 3) into each; and which of all rows of the level are kept (V',).
    """
    _, of_side = _edges(quads)
    split = np.zeros(of_side.max() + 1, bool)
    split[of_side[chosen]] = True
    sides = split[of_side]  # (F, 4): which sides of a quad get a middle
    whole, _ = catmull_clark(quads, vertices)
    even, _ = bilinear(uv_quads, uvs)
    faces, kept = _fitted(quads, of_side, sides, chosen, vertices)
    _, of_uv_side = _edges(uv_quads)
    uv_faces, uv_kept = _fitted(uv_quads, of_uv_side, sides, chosen, uvs)
    return whole[kept], even[uv_kept], faces, uv_faces, kept


def _fitted(
    quads: np.ndarray, of_side: np.ndarray, sides: np.ndarray, chosen: np.ndarray, vertices: int
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (M, 3) of partly split quads, and the rows of a level that they use."""
    edges = of_side.max() + 1
    corner, middle = quads, vertices + of_side
    face = vertices + edges + np.arange(len(quads))
    parts = []
    for k in range(4):
        child = [corner[:, k], middle[:, k], face, middle[:, k - 1]]
        parts.append(triangles(np.stack(child, axis=1)[chosen]))
    pattern = sides @ (1 << np.arange(4))
    for bits in range(16):
        those = ~chosen & (pattern == bits)
        outline = []
        for k in range(4):
            outline.append(corner[those, k])
            if bits >> k & 1:
                outline.append(middle[those, k])
        # a fan from a middle has no triangle along one side: the first comes after its corner and
        # those before
        first = next((k for k in range(4) if bits >> k & 1), -1)
        ring = outline[first + 1 :] + outline[: first + 1]
        parts += [np.stack([ring[0], a, b], axis=1) for a, b in itertools.pairwise(ring[1:])]
    faces = np.concatenate(parts)
    used = np.zeros(vertices + edges + len(quads), bool)
    used[:vertices] = used[faces] = True
    return (np.cumsum(used) - 1)[faces], np.flatnonzero(used)
