"""Points spread evenly over a mesh: Turk's relaxation.

Turk 1991, "Generating textures on arbitrary surfaces using reaction-diffusion",
doi:10.1145/127719.122749; Rohat 2012, sec. 5.3.1: neighbours within r = 2 sqrt(A / N) push a point
away by r - d, in the plane of its triangle; it walks over the edges that it crosses.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

FACTOR = 0.15  # of the forces: 0.2 is the most that settles (docs/techniques.md)
MOST_STEP = 0.5  # of the radius, a round
MOST_EDGES = 64  # that a point crosses in a round
BEHIND = -0.5  # cosine of normals: what lies behind a thin part pushes nothing
WELD = 1e-5  # of the mesh's size: vertices nearer than that are one


def neighbours_of(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The triangle beyond each edge (k, k + 1) of each triangle, -1 where the mesh ends: (M, 3).

    Vertices at one place count as one, so that seams of an atlas are no ends; triangles of which
    only an edge or a point is left then, as at a sphere's poles, are nobody's neighbours.
    """
    size = max(float(np.ptp(positions, axis=0).max()), 1e-12)
    cells = np.round((positions - positions.min(axis=0)) / (WELD * size)).astype(np.int64)
    _, same = np.unique(cells, axis=0, return_inverse=True)
    corners = same.ravel()[faces]
    a, b = corners, np.roll(corners, -1, axis=1)
    whole = np.flatnonzero(np.repeat((a != b).all(axis=1), 3))
    low, high = np.minimum(a, b).ravel()[whole], np.maximum(a, b).ravel()[whole]
    key = low * (int(same.max()) + 1) + high
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(key[order][:-1] == key[order][1:])
    # of edges that more than two triangles share the first two are neighbours
    first = first[np.append(True, np.diff(first) > 1)] if len(first) else first
    one, two = whole[order[first]], whole[order[first + 1]]
    beyond = np.full(3 * len(faces), -1)
    beyond[one], beyond[two] = two // 3, one // 3
    return beyond.reshape(-1, 3)


class Mesh:
    """Triangles that points walk over: positions (N, 3) and faces (M, 3)."""

    def __init__(self, positions: np.ndarray, faces: np.ndarray):
        self.corners = np.asarray(positions, float)[faces]
        a, b, c = (self.corners[:, k] for k in range(3))
        normals = np.cross(b - a, c - a)
        doubled = np.linalg.norm(normals, axis=1)
        self.areas = 0.5 * doubled
        self.normals = normals / np.maximum(doubled, 1e-300)[:, None]
        self.beyond = neighbours_of(np.asarray(positions, float), faces)

    def at(self, triangles: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Places (K, 3) of barycentric weights (K, 3)."""
        return np.einsum("kc,kci->ki", weights, self.corners[triangles])

    def weights(self, triangles: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Barycentric weights (K, 3) of places in the planes of triangles, within them."""
        a, b, c = (self.corners[triangles, k] for k in range(3))
        n = np.cross(b - a, c - a)
        square = np.maximum(np.einsum("ki,ki->k", n, n), 1e-300)
        v = np.einsum("ki,ki->k", np.cross(places - a, c - a), n) / square
        w = np.einsum("ki,ki->k", np.cross(b - a, places - a), n) / square
        inside = np.clip(np.column_stack([1 - v - w, v, w]), 0, None)
        return inside / inside.sum(axis=1, keepdims=True)

    def walk(
        self, triangles: np.ndarray, places: np.ndarray, steps: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (K,) and places (K, 3) after steps (K, 3) along the surface.

        What is left of a step at an edge is turned about it into the next triangle's plane; at an
        end of the mesh a point stays.
        """
        triangles, places = triangles.copy(), places.copy()
        left, moving = steps.copy(), np.arange(len(triangles))
        came = np.full(len(triangles), -1)
        for _ in range(MOST_EDGES):
            if not len(moving):
                break
            t, p, step = triangles[moving], places[moving], left[moving]
            n, corner = self.normals[t], self.corners[t]
            edge = np.roll(corner, -1, axis=1) - corner
            outward = np.cross(edge, n[:, None])  # in the plane, away from the triangle
            ahead = np.einsum("ki,kei->ke", step, outward)
            room = np.einsum("kei,kei->ke", corner - p[:, None], outward)
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.where(ahead > 1e-300, np.maximum(room, 0) / ahead, np.inf)
            share[np.arange(len(moving)), came[moving]] = np.where(
                came[moving] >= 0, np.inf, share[np.arange(len(moving)), came[moving]]
            )
            which = np.argmin(share, axis=1)
            near = share[np.arange(len(moving)), which]
            stays = near >= 1
            places[moving] = p + np.minimum(near, 1)[:, None] * step
            on = np.flatnonzero(~stays)
            moving = moving[on]
            t, which, near, step = t[on], which[on], near[on], step[on]
            following = self.beyond[t, which]
            goes = following >= 0
            moving, t, following, which = moving[goes], t[goes], following[goes], which[goes]
            rest = (1 - near[goes])[:, None] * step[goes]
            axis = edge[on][goes, which]
            axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
            along = np.einsum("ki,ki->k", rest, axis)
            across = np.linalg.norm(rest - along[:, None] * axis, axis=1)
            # into the next triangle: away from the edge, whichever way round its corners run
            inward = np.cross(self.normals[following], axis)
            centre = self.corners[following].mean(axis=1) - places[moving]
            inward *= np.sign(np.einsum("ki,ki->k", inward, centre))[:, None]
            left[moving] = along[:, None] * axis + across[:, None] * inward
            came[moving] = np.argmax(self.beyond[following] == t[:, None], axis=1)
            triangles[moving] = following
        return triangles, places


def relax(
    mesh: Mesh, triangles: np.ndarray, weights: np.ndarray, rounds: int, factor: float = FACTOR
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (K,) and barycentric weights (K, 3) of points after some rounds of relaxation."""
    places = mesh.at(triangles, weights)
    radius = 2 * np.sqrt(mesh.areas.sum() / len(places))
    for _ in range(rounds):
        pairs = cKDTree(places).query_pairs(radius, output_type="ndarray")
        n = mesh.normals[triangles]
        near = np.einsum("ki,ki->k", n[pairs[:, 0]], n[pairs[:, 1]]) > BEHIND
        i, j = pairs[near].T
        away = places[i] - places[j]
        distance = np.linalg.norm(away, axis=1)
        force = np.zeros_like(places)
        for here, sign in ((i, 1.0), (j, -1.0)):
            flat = sign * (away - np.einsum("ki,ki->k", away, n[here])[:, None] * n[here])
            length = np.maximum(np.linalg.norm(flat, axis=1), 1e-12 * radius)
            # turned into the plane, a neighbour keeps its distance
            push = ((radius - distance) / length)[:, None] * flat
            for axis in range(3):
                force[:, axis] += np.bincount(here, push[:, axis], len(places))
        step = factor * force
        longest = np.linalg.norm(step, axis=1, keepdims=True)
        step *= np.minimum(1, MOST_STEP * radius / np.maximum(longest, 1e-300))
        triangles, places = mesh.walk(triangles, places, step)
    return triangles, mesh.weights(triangles, places)
