"""Environment light with occlusion and interreflection, baked per vertex by ray tracing on the CPU.

For every vertex, cosine-distributed rays meet either the studio's panels or skin; skin that is hit
sends back albedo / pi times its own irradiance (lamps with shadow rays, and the panels), for two
bounces, so that occlusion is coloured: skin lights skin. Kept is the vector irradiance per channel,
g = int_H L(w) w dw, from which E(n) = max(0, g . n) is exact at the vertex normal and first-order
right for a bumped one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from renderer.scene import Studio

BOUNCES = 2
OFFSET_MM = 0.35
CHUNK = 4096


@dataclass(frozen=True)
class Baked:
    """light (N, 3, 3): vector irradiance, [vertex, channel, xyz]; openness (N,): the
    cosine-weighted share of rays that leave.
    """

    light: np.ndarray
    openness: np.ndarray


def _hemisphere(n: int) -> np.ndarray:
    """n cosine-distributed directions about +z on a Fibonacci spiral: (n, 3)."""
    k = np.arange(n)
    r = np.sqrt((k + 0.5) / n)
    phi = 2.399963229728653 * k
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r**2)])


def _frames(normals: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) that take +z to each normal, turned about it by `spin` (N,) radians."""
    sign = np.where(
        normals[:, 2] >= 0, 1.0, -1.0
    )  # Duff et al. 2017, "Building an orthonormal basis, revisited"
    a = -1 / (sign + normals[:, 2])
    b = normals[:, 0] * normals[:, 1] * a
    t = np.column_stack([1 + sign * normals[:, 0] ** 2 * a, sign * b, -sign * normals[:, 0]])
    s = np.column_stack([b, sign + normals[:, 1] ** 2 * a, -normals[:, 1]])
    c, d = np.cos(spin)[:, None], np.sin(spin)[:, None]
    return np.stack([c * t + d * s, c * s - d * t, normals], axis=2)


class Tracer:
    """The model as rays see it: triangles, and the radiance that each sends back."""

    def __init__(self, positions: np.ndarray, faces: np.ndarray, studio: Studio, seed: int):
        self._mesh = trimesh.Trimesh(positions, faces, process=False, validate=False)
        self._rays = trimesh.ray.ray_pyembree.RayMeshIntersector(self._mesh)
        self._studio, self._seed = studio, seed

    def lamps(self, points: np.ndarray, normals: np.ndarray, rays: int = 6) -> np.ndarray:
        """Irradiance (N, 3) from the lamps, with shadow rays."""
        total = np.zeros((len(points), 3))
        rng = np.random.default_rng([self._seed, 1])
        for lamp in self._studio.lamps:
            cosine = np.maximum(normals @ lamp.towards, 0)
            facing = np.flatnonzero(cosine > 0)
            origin = np.repeat(points[facing] + OFFSET_MM * normals[facing], rays, axis=0)
            spread = np.tan(np.radians(lamp.radius_deg)) * rng.normal(size=(len(origin), 3)) / 1.5
            hit = self._rays.intersects_any(origin, lamp.towards + spread).reshape(-1, rays)
            total[facing] += ((1 - hit.mean(axis=1)) * cosine[facing])[:, None] * np.array(
                lamp.irradiance
            )
        return total

    def gather(
        self, points: np.ndarray, normals: np.ndarray, rays: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Directions (N, rays, 3) and the triangle that each ray meets, -1 for none (N, rays)."""
        spin = np.random.default_rng([self._seed, 2]).uniform(0, 2 * np.pi, len(points))
        local = _hemisphere(rays)
        hits = np.empty((len(points), rays), dtype=np.int32)
        directions = np.empty((len(points), rays, 3), dtype=np.float32)
        for start in range(0, len(points), CHUNK):
            part = slice(start, start + CHUNK)
            d = np.einsum("nij,rj->nri", _frames(normals[part], spin[part]), local)
            origin = np.repeat(points[part] + OFFSET_MM * normals[part], rays, axis=0)
            hits[part] = self._rays.intersects_first(origin, d.reshape(-1, 3)).reshape(-1, rays)
            directions[part] = d
        return directions, hits

    def collect(
        self, normals: np.ndarray, directions: np.ndarray, hits: np.ndarray, sent: np.ndarray
    ) -> Baked:
        """Vector irradiance of rays that see the panels, or triangles that send radiance `sent` (F,
        3).
        """
        n, rays = hits.shape
        light = np.empty((n, 3, 3))
        for start in range(0, n, CHUNK):
            part = slice(start, start + CHUNK)
            d, h = directions[part].astype(float), hits[part]
            radiance = self._studio.radiance(d.reshape(-1, 3)).reshape(*h.shape, 3)
            radiance = np.where(h[..., None] < 0, radiance, sent[h])
            cosine = np.maximum(np.einsum("nri,ni->nr", d, normals[part]), 1e-3)
            light[part] = np.pi * np.einsum("nrc,nri,nr->nci", radiance, d, 1 / cosine) / rays
        return Baked(light, (hits < 0).mean(axis=1))


def _smooth(values: np.ndarray, faces: np.ndarray, rounds: int) -> np.ndarray:
    """Average each vertex with its neighbours: the bake's noise is per vertex."""
    from scipy import sparse

    i = faces.ravel()
    j = np.roll(faces, 1, axis=1).ravel()
    n = len(values)
    link = sparse.csr_matrix((np.ones(2 * len(i)), (np.append(i, j), np.append(j, i))), (n, n))
    link.data[:] = 1
    link = sparse.diags(1 / np.maximum(np.asarray(link.sum(axis=1)).ravel(), 1)) @ link
    flat = values.reshape(n, -1)
    for _ in range(rounds):
        flat = 0.5 * flat + 0.5 * (link @ flat)
    return flat.reshape(values.shape)


def bake_model(
    positions: np.ndarray,
    normals: np.ndarray,
    faces: np.ndarray,
    albedo: np.ndarray,
    eyes,
    studio: Studio,
    rays: int,
    seed: int,
) -> tuple[Baked, list[Baked]]:
    """Bake the skin's proxy mesh and each eye.

    positions, normals, albedo (N, 3), faces (M, 3) of the skin; eyes: renderer.scene.Eye. Returns
    the skin's and the eyes' light.
    """
    points = [positions] + [eye.positions for eye in eyes]
    start = np.cumsum([0] + [len(p) for p in points])
    all_faces = np.vstack(
        [faces] + [eye.faces + s for eye, s in zip(eyes, start[1:], strict=False)]
    )
    all_albedo = np.vstack([albedo] + [np.full((len(eye.positions), 3), 0.5) for eye in eyes])
    all_points = np.vstack(points).astype(float)
    all_normals = np.vstack([normals] + [eye.normals for eye in eyes]).astype(float)
    tracer = Tracer(all_points, all_faces, studio, seed)
    lamps = tracer.lamps(all_points, all_normals)
    directions, hits = tracer.gather(all_points, all_normals, rays)
    # rays that start inside (folded lips, the back of the eyes) meet back faces: those send nothing
    away = (
        np.einsum(
            "nri,nri->nr",
            directions,
            tracer._mesh.face_normals[np.maximum(hits, 0)].astype(np.float32),
        )
        > 0
    )
    irradiance = lamps
    for _ in range(BOUNCES + 1):
        sent = (all_albedo * irradiance / np.pi)[all_faces].mean(axis=1)
        sent = np.vstack([sent, np.zeros(3)])
        baked = tracer.collect(
            all_normals, directions, np.where((hits >= 0) & away, len(all_faces), hits), sent
        )
        irradiance = lamps + np.maximum(np.einsum("nci,ni->nc", baked.light, all_normals), 0)
    parts = []
    for k in range(len(points)):
        piece = slice(start[k], start[k + 1])
        mesh_faces = faces if k == 0 else eyes[k - 1].faces
        parts.append(
            Baked(
                _smooth(baked.light[piece], mesh_faces, 2),
                _smooth(baked.openness[piece], mesh_faces, 2),
            )
        )
    return parts[0], parts[1:]
