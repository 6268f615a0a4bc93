"""Random walks of light inside a mesh: embree finds the surface, what happens between is compiled.

Light that enters at one point and leaves at another goes the same way back as often (Helmholtz's
reciprocity), so a walk starts at the point that is seen, goes in as light leaves it there, and ends
where the light came from. Path lengths and scattering are as in `renderer.optics.walk`; lengths are
exponential and so know no past: a walk that a face sends back draws a new one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from renderer.optics.medium import Medium
from renderer.optics.walk import (
    _azimuth,
    _bits,
    _exponential,
    _uniform,
    fresnel,
    henyey_greenstein,
)

FAR = np.float32(1e30)  # mm: a ray that meets nothing
INWARD_MM = 1e-4  # how far off a face a walk starts: more than the rounding of single precision
#: A walk of less weight is ended, or goes on with all of what two such would carry.
ROULETTE_BELOW, ROULETTE_CHANCE = 0.1, 0.5


@dataclass(frozen=True)
class Part:
    """A surface: positions (N, 3) mm in the world, faces (M, 3), outside counter-clockwise."""

    positions: np.ndarray
    faces: np.ndarray


class Solid:
    """Surfaces that bound one medium, as rays see them; triangles are numbered through all parts.

    parts: the surfaces; normals (M, 3): outward, of the triangles; starts: the number of each
    part's first triangle; middle (3,): what `corners` (M, 3, 3) and rays are relative to; bounds
    (3,): half its size.
    """

    def __init__(self, parts: Sequence[Part]):
        self.parts = tuple(parts)
        corners = [np.asarray(p.positions, float)[np.asarray(p.faces, int)] for p in parts]
        self.starts = np.cumsum([0] + [len(c) for c in corners])
        triangles = np.concatenate(corners)
        # single precision is finest about its origin
        self.middle = 0.5 * (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1)))
        self.corners = triangles - self.middle
        self.bounds = np.abs(self.corners).max(axis=(0, 1)) + INWARD_MM
        across = np.cross(
            self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        )
        length = np.linalg.norm(across, axis=1, keepdims=True)
        self.normals = across / np.maximum(length, 1e-30)
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, np.ascontiguousarray(self.corners, np.float32))

    def hits(
        self, origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | float = FAR
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The first triangle (N,), -1 for none, that rays from `origins` (about `middle`) meet
        within `reach` mm, how far it is (N,), and where on it: u (N,), v (N,).
        """
        hits = self._scene.run(
            np.ascontiguousarray(origins, np.float32),
            np.ascontiguousarray(directions, np.float32),
            np.broadcast_to(np.asarray(reach, np.float32), len(origins)).copy(),
            output=1,
        )
        return hits["primID"], hits["tfar"], hits["u"], hits["v"]


@dataclass(frozen=True)
class Walks:
    """Where walks left a solid: source (K,), the index of the start; triangle (K,) and barycentric
    weights (K, 3); carried (K,), the share of the light that is left; directions (K, 3), unit
    vectors, refracted, in which it goes on outside.
    """

    source: np.ndarray
    triangle: np.ndarray
    weights: np.ndarray
    carried: np.ndarray
    directions: np.ndarray


@numba.njit(cache=True, error_model="numpy")
def _start(index, key, state):
    """Random states of walks."""
    for i in range(len(state)):
        # the number of the walk, well mixed: states of neighbours share no stretch of the sequence
        _, state[i] = _bits(key + index[i] * np.uint64(0xD1342543DE82EF95))


@numba.njit(cache=True, error_model="numpy")
def _enter(normals, eta, state, directions):
    """Inward directions of walks, as diffuse light that has passed the face."""
    for i in range(len(normals)):
        s = state[i]
        while True:
            s, bits = _bits(s)
            cosine = math.sqrt(1 - _uniform(bits))
            sine = math.sqrt(max(1 - cosine * cosine, 0.0))
            if eta == 1:
                break
            mirrored, below = fresnel(1.0, eta, cosine)
            s, bits = _bits(s)
            if _uniform(bits) >= mirrored:
                cosine, sine = below, sine / eta
                break
        s, bits = _bits(s)
        c, t = _azimuth(bits)
        c *= sine
        t *= sine
        # a frame about the inward normal: Duff et al. 2017, "Building an orthonormal basis,
        # revisited"
        x, y, z = -normals[i, 0], -normals[i, 1], -normals[i, 2]
        sign = math.copysign(1.0, z)
        a = -1 / (sign + z)
        b = x * y * a
        directions[i, 0] = c * (1 + sign * x * x * a) + t * b + cosine * x
        directions[i, 1] = c * sign * b + t * (sign + y * y * a) + cosine * y
        directions[i, 2] = cosine * z - c * sign * x - t * y
        state[i] = s


@numba.njit(cache=True, error_model="numpy")
def _lengths(state, sigma_t, reach):
    for i in range(len(state)):
        state[i], length = _exponential(state[i])
        reach[i] = length / sigma_t


@numba.njit(cache=True, error_model="numpy")
def _event(
    at,
    direction,
    state,
    weight,
    source,
    reach,
    triangle,
    far,
    u,
    v,
    normals,
    bounds,
    albedo,
    g,
    eta,
    out_source,
    out_triangle,
    out_weights,
    out_carried,
    out_directions,
):
    """What happens at the end of every free path; (walks that go on, walks that left).

    The first arrays are packed: what goes on comes first.
    """
    on, left = 0, 0
    for i in range(len(state)):
        s, w = state[i], weight[i]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        k = triangle[i]
        if k >= 0:
            nx, ny, nz = normals[k, 0], normals[k, 1], normals[k, 2]
            cosine = dx * nx + dy * ny + dz * nz
            step = np.float64(far[i])
            x, y, z = at[i, 0] + dx * step, at[i, 1] + dy * step, at[i, 2] + dz * step
            if cosine > 0:
                mirrored, beyond = 0.0, cosine
                if eta != 1:
                    mirrored, beyond = fresnel(eta, 1.0, min(cosine, 1.0))
                    s, bits = _bits(s)
                    if _uniform(bits) >= mirrored:
                        mirrored = 0.0
                if mirrored == 0:
                    out_source[left], out_triangle[left], out_carried[left] = source[i], k, w
                    out_weights[left, 0] = 1 - np.float64(u[i]) - np.float64(v[i])
                    out_weights[left, 1], out_weights[left, 2] = u[i], v[i]
                    turn = beyond - eta * cosine
                    out_directions[left, 0] = eta * dx + turn * nx
                    out_directions[left, 1] = eta * dy + turn * ny
                    out_directions[left, 2] = eta * dz + turn * nz
                    left += 1
                    continue
                dx -= 2 * cosine * nx
                dy -= 2 * cosine * ny
                dz -= 2 * cosine * nz
            # off the face: back inside, or through a face that is met from outside
            x -= INWARD_MM * nx
            y -= INWARD_MM * ny
            z -= INWARD_MM * nz
        else:
            step = np.float64(reach[i])
            x, y, z = at[i, 0] + dx * step, at[i, 1] + dy * step, at[i, 2] + dz * step
            if abs(x) > bounds[0] or abs(y) > bounds[1] or abs(z) > bounds[2]:
                continue
            w *= albedo
            if w < ROULETTE_BELOW:
                s, bits = _bits(s)
                if _uniform(bits) >= ROULETTE_CHANCE or w == 0:
                    continue
                w /= ROULETTE_CHANCE
            s, bits = _bits(s)
            cosine = henyey_greenstein(g, _uniform(bits))
            sine = math.sqrt(max(1 - cosine * cosine, 0.0))
            s, bits = _bits(s)
            c, t = _azimuth(bits)
            c *= sine
            t *= sine
            sign = math.copysign(1.0, dz)
            a = -1 / (sign + dz)
            b = dx * dy * a
            ex = c * (1 + sign * dx * dx * a) + t * b + cosine * dx
            ey = c * sign * b + t * (sign + dy * dy * a) + cosine * dy
            dz = cosine * dz - c * sign * dx - t * dy
            dx, dy = ex, ey
        at[on, 0], at[on, 1], at[on, 2] = x, y, z
        direction[on, 0], direction[on, 1], direction[on, 2] = dx, dy, dz
        state[on], weight[on], source[on] = s, w, source[i]
        on += 1
    return on, left


def walk(
    solid: Solid,
    medium: Medium,
    channel: int,
    points: np.ndarray,
    normals: np.ndarray,
    index: np.ndarray,
    seed: Sequence[int],
    inside: np.ndarray | None = None,
) -> Walks:
    """Walk from points (N, 3) mm on a solid, with outward normals (N, 3), until all have left.

    Light enters as diffuse light from outside does, or along unit directions `inside` (N, 3) below
    the face, and leaves in any direction. index (N,): a
    number of each walk; with the seed it decides the path, whatever else is walked beside it. A
    face that is met from outside is gone through; where the surface has a hole there is medium
    beyond, as far as the solid's bounds, and what gets out of these is lost.
    """
    key = np.random.SeedSequence([*seed, channel]).generate_state(1, np.uint64)[0]
    eta, g = float(medium.eta), float(medium.g) if abs(medium.g) >= 1e-6 else 0.0
    sigma_t, albedo = float(medium.sigma_t[channel]), float(medium.albedo[channel])
    count = len(points)
    at = np.asarray(points, float) - solid.middle - INWARD_MM * normals
    directions, state = np.empty((count, 3)), np.empty(count, np.uint64)
    _start(index.astype(np.uint64), key, state)
    if inside is None:
        _enter(np.asarray(normals, float), eta, state, directions)
    else:
        directions[:] = inside
    weight, source = np.ones(count), np.arange(count)
    ended = []
    while count:
        reach = np.empty(count)
        _lengths(state[:count], sigma_t, reach)
        hit = solid.hits(at[:count], directions[:count], reach)
        out = (
            np.empty(count, np.int64),
            np.empty(count, np.int64),
            np.empty((count, 3)),
            np.empty(count),
            np.empty((count, 3)),
        )
        walking = (at[:count], directions[:count], state[:count], weight[:count], source[:count])
        rules = (solid.normals, solid.bounds, albedo, g, eta)
        count, left = _event(*walking, reach, *hit, *rules, *out)
        if left:
            ended.append([array[:left] for array in out])
    if not ended:
        none, places = np.empty(0, int), np.empty((0, 3))
        return Walks(none, none, places, np.empty(0), places)
    return Walks(*(np.concatenate(parts) for parts in zip(*ended, strict=True)))
