"""Environment light with occlusion and interreflection, baked per vertex by ray tracing on the CPU.

For every vertex, cosine-distributed rays meet either the environment or a surface; a surface that
is hit sends back albedo / pi times its own irradiance (lamps with shadow rays, and the
environment), for two bounces, so that occlusion is coloured: skin lights skin. Kept is the vector
irradiance per channel, g = int_H L(w) w dw, from which E(n) = max(0, g . n) is exact at the vertex
normal and first-order right for a bumped one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from renderer.memory import parts
from renderer.scene.graph import Item
from renderer.scene.lights import DistantLight, Light, SpotLight
from renderer.scene.material import Skin

BOUNCES = 2
OFFSET_MM = 0.35
CHUNK = 4096


@dataclass(frozen=True)
class Body:
    """A mesh that light is baked on, in the world.

    positions, normals, albedo (N, 3); faces (M, 3). smooth: how often a vertex's light is averaged
    with its neighbours', since the bake's noise is per vertex: finer meshes take more. hidden:
    below which openness a vertex is hidden by what touches it, (N,), 0 where nothing does, or None:
    see `_borrowed`; ball: whether it is an eye's.
    """

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    albedo: np.ndarray
    smooth: int = 2
    hidden: np.ndarray | None = None
    ball: bool = False


@dataclass(frozen=True)
class Baked:
    """light (N, 3, 3): vector irradiance, [vertex, channel, xyz]; openness (N,): the
    cosine-weighted share of rays that leave; sky (N, 3): the mean direction of those, as long as
    they are of one mind.
    """

    light: np.ndarray
    openness: np.ndarray
    sky: np.ndarray


def hemisphere(n: int) -> np.ndarray:
    """n cosine-distributed directions about +z on a Fibonacci spiral: (n, 3)."""
    k = np.arange(n)
    r = np.sqrt((k + 0.5) / n)
    phi = 2.399963229728653 * k
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r**2)])


def frames(normals: np.ndarray, spin: np.ndarray) -> np.ndarray:
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


def _intersector(mesh: trimesh.Trimesh):
    """Embree where it is installed, trimesh's own (slow, kept) tracer elsewhere; said once."""
    if trimesh.ray.has_embree:
        return trimesh.ray.ray_pyembree.RayMeshIntersector(mesh)
    import warnings

    warnings.warn(
        "embreex is not installed here: baking light with trimesh's own, slower tracer",
        stacklevel=2,
    )
    return trimesh.ray.ray_triangle.RayMeshIntersector(mesh)


def seen(light: Light, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit directions (N, 3) to the lamp, distance (N,) mm, and the factor of its irradiance."""
    if isinstance(light, DistantLight):
        towards = np.broadcast_to(light.towards, points.shape)
        return towards, np.full(len(points), np.inf), np.ones(len(points))
    away = points - light.place
    distance = np.linalg.norm(away, axis=1)
    away = away / np.maximum(distance, 1e-9)[:, None]
    strength = light.falloff(distance)
    if isinstance(light, SpotLight):
        strength = strength * light.cone(away)
    return -away, distance, strength


#: Of lids and balls where they touch, and of skin below cloth: below which openness a vertex counts
#: as hidden, and the share of their light that others lend, open by a quarter more. Chosen by eye.
HIDDEN_BALL, HIDDEN_CORNER, HIDDEN_LID = 0.16, 0.34, 0.20
LENT_BALL, LENT_LID = 0.9, 0.75
LID_MM = 4.0  # from the ball, within which skin is a lid's
HIDDEN_CLOTH, CLOTH_MM = 0.20, 15.0  # mm from the cloth's nearest point


def _borrowed(baked: Baked, own: Body) -> Baked:
    """Light of vertices that another body hides taken from their nearest open neighbours.

    Under a lid nothing arrives, and a triangle across its edge would carry that black to where the
    ball is seen.
    """
    from scipy.spatial import cKDTree

    if own.hidden is None:
        return baked
    share = LENT_BALL if own.ball else LENT_LID
    borrows = np.flatnonzero(baked.openness < own.hidden)
    lends = np.flatnonzero((own.hidden > 0) & (baked.openness > 1.25 * own.hidden))
    if not len(borrows) or not len(lends):
        return baked
    _, nearest = cKDTree(own.positions[lends]).query(own.positions[borrows])
    light, openness, sky = baked.light.copy(), baked.openness.copy(), baked.sky.copy()
    light[borrows] = share * baked.light[lends[nearest]]
    openness[borrows] = share * baked.openness[lends[nearest]]
    sky[borrows] = baked.sky[lends[nearest]]
    return Baked(light, openness, sky)


def body(item: Item, eyes: Sequence[Item] = (), clothes: Sequence[Item] = ()) -> Body:
    """A surface, or an eye, in the world: as coarse as rays take it (its proxy). eyes: those whose
    lids are the surface's; clothes: what is worn over it.
    """
    part = item.primitive
    if hasattr(part, "proxy"):
        proxy = part.proxy
        positions, normals = item.in_world(proxy.positions), item.turned(proxy.normals)
        albedo, value = proxy.albedo, part.material.value
        mapped = "albedo_map" in part.material.maps
        if isinstance(value, Skin) and proxy.masks is not None and not mapped:
            albedo = value.mean_albedo(proxy.masks)
        hidden = None
        if eyes or clothes:
            hidden = np.maximum(_lids(positions, eyes), _below(positions, clothes))
        return Body(positions, normals, proxy.faces, np.asarray(albedo), proxy.smooth, hidden)
    positions, normals = item.in_world(part.positions), item.turned(part.normals)
    grey = np.full((len(positions), 3), 0.5)
    hidden = np.where(part.eye.tissue[:, 0] > 0, HIDDEN_CORNER, HIDDEN_BALL)
    return Body(positions, normals, part.faces, grey, hidden=hidden, ball=True)


def _lids(positions: np.ndarray, eyes: Sequence[Item]) -> np.ndarray:
    """`hidden` of a surface's vertices (N, 3): of those that lie near a ball."""
    near = np.zeros(len(positions), bool)
    for item in eyes:
        eye, size = item.primitive.eye, np.linalg.norm(item.pose[:3, 0])
        away = np.linalg.norm(positions - item.in_world(eye.centre), axis=1)
        near |= away < (eye.radius + LID_MM) * size
    return np.where(near, HIDDEN_LID, 0.0)


def _below(positions: np.ndarray, clothes: Sequence[Item]) -> np.ndarray:
    """`hidden` of a surface's vertices (N, 3): of those that lie beside cloth."""
    from scipy.spatial import cKDTree

    hidden = np.zeros(len(positions))
    for item in clothes:
        cloth = cKDTree(item.in_world(item.primitive.proxy.positions))
        away, _ = cloth.query(positions, distance_upper_bound=CLOTH_MM)
        hidden[np.isfinite(away)] = HIDDEN_CLOTH
    return hidden


class Tracer:
    """The scene as rays see it: triangles, and the radiance that each sends back."""

    def __init__(
        self,
        positions: np.ndarray,
        faces: np.ndarray,
        lights: Sequence[Light],
        radiance: Callable[[np.ndarray], np.ndarray],
        seed: int,
    ):
        self.mesh = trimesh.Trimesh(positions, faces, process=False, validate=False)
        self._rays = _intersector(self.mesh)
        self._lights, self._radiance, self._seed = lights, radiance, seed

    def first(self, origins: np.ndarray, towards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The triangle that each ray meets first, -1 for none (N,), and how far, mm (N,)."""
        triangles = self._rays.intersects_first(origins, towards)
        hit = np.flatnonzero(triangles >= 0)
        corner = self.mesh.triangles[triangles[hit], 0]
        normal = self.mesh.face_normals[triangles[hit]]
        ahead = np.einsum("ni,ni->n", corner - origins[hit], normal)
        along = np.einsum("ni,ni->n", towards[hit], normal)
        distance = np.full(len(origins), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance[hit] = ahead / along
        return triangles, distance

    def blocked(self, origins: np.ndarray, towards: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """Whether anything is nearer than `reach` (N,) mm along unit directions: (N,)."""
        _, distance = self.first(origins, towards)
        return distance < reach - OFFSET_MM

    def lamps(self, points: np.ndarray, normals: np.ndarray, rays: int = 6) -> np.ndarray:
        """Irradiance (N, 3) from the lamps, with shadow rays."""
        total = np.zeros((len(points), 3))
        rng = np.random.default_rng([self._seed, 1])
        for towards, irradiance in self.lit(points, normals, rays, rng):
            total += np.maximum(np.einsum("ni,ni->n", normals, towards), 0)[:, None] * irradiance
        return total

    def lit(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        rays: int,
        rng: np.random.Generator | None,
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """For each lamp unit directions (N, 3) to it and the irradiance (N, 3) of what faces it.

        rays: shadow rays a point, over the lamp's size; rng None: one, to its middle.
        """
        for light in self._lights:
            towards, distance, strength = seen(light, points)
            strength = np.where(np.einsum("ni,ni->n", normals, towards) > 0, strength, 0)
            facing = np.flatnonzero(strength > 0)
            lit = self._unshadowed(light, points, normals, facing, rays, rng, towards, distance)
            share = np.zeros(len(points))
            share[facing] = lit * strength[facing]
            yield towards, share[:, None] * np.array(light.irradiance)

    def _unshadowed(self, light, points, normals, facing, rays, rng, towards, distance):
        """The share of shadow rays that reach the lamp (F,)."""
        if not light.shadow:
            return np.ones(len(facing))
        rays = 1 if rng is None else rays
        origin = np.repeat(points[facing] + OFFSET_MM * normals[facing], rays, axis=0)
        spread = np.zeros((len(origin), 3)) if rng is None else rng.normal(size=(len(origin), 3))
        spread /= 1.5
        if isinstance(light, DistantLight):
            spread *= np.tan(np.radians(light.radius_deg))
            hit = self._rays.intersects_any(origin, light.towards + spread)
            return 1 - hit.reshape(-1, rays).mean(axis=1)
        aim = light.place + light.radius_mm * spread - origin
        reach = np.linalg.norm(aim, axis=1)
        nearer = self.blocked(origin, aim / reach[:, None], reach)
        return 1 - nearer.reshape(-1, rays).mean(axis=1)

    def gather(
        self, points: np.ndarray, normals: np.ndarray, rays: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Directions (N, rays, 3) and the triangle that each ray meets, -1 for none (N, rays)."""
        spin = np.random.default_rng([self._seed, 2]).uniform(0, 2 * np.pi, len(points))
        local = hemisphere(rays)
        hits = np.empty((len(points), rays), dtype=np.int32)
        directions = np.empty((len(points), rays, 3), dtype=np.float32)
        for part in parts(len(points), CHUNK):
            d = np.einsum("nij,rj->nri", frames(normals[part], spin[part]), local)
            origin = np.repeat(points[part] + OFFSET_MM * normals[part], rays, axis=0)
            hits[part] = self._rays.intersects_first(origin, d.reshape(-1, 3)).reshape(-1, rays)
            directions[part] = d
        return directions, hits

    def collect(
        self, normals: np.ndarray, directions: np.ndarray, hits: np.ndarray, sent: np.ndarray
    ) -> Baked:
        """Vector irradiance of rays that see the environment, or triangles that send radiance.

        sent: (F, 3), the radiance of each triangle.
        """
        n, rays = hits.shape
        light = np.empty((n, 3, 3))
        for part in parts(n, CHUNK):
            d, h = directions[part].astype(float), hits[part]
            radiance = self._radiance(d.reshape(-1, 3)).reshape(*h.shape, 3)
            radiance = np.where(h[..., None] < 0, radiance, sent[h])
            cosine = np.maximum(np.einsum("nri,ni->nr", d, normals[part]), 1e-3)
            light[part] = np.pi * np.einsum("nrc,nri,nr->nci", radiance, d, 1 / cosine) / rays
        free = hits < 0
        sky = np.einsum("nri,nr->ni", directions, free.astype(np.float32))
        return Baked(light, free.mean(axis=1), sky / np.maximum(free.sum(axis=1), 1)[:, None])


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


def bake(
    bodies: Sequence[Body],
    lights: Sequence[Light],
    radiance: Callable[[np.ndarray], np.ndarray],
    rays: int,
    seed: int,
) -> list[Baked]:
    """The light on each body, with all of them in each other's way.

    radiance: unit directions (N, 3) to the environment's radiance (N, 3); rays: per vertex.
    """
    start = np.cumsum([0] + [len(body.positions) for body in bodies])
    faces = np.vstack(
        [body.faces.astype(np.int64) + s for body, s in zip(bodies, start, strict=False)]
    )
    albedo = np.vstack([body.albedo for body in bodies])
    points = np.vstack([body.positions for body in bodies]).astype(float)
    normals = np.vstack([body.normals for body in bodies]).astype(float)
    tracer = Tracer(points, faces, lights, radiance, seed)
    lamps = tracer.lamps(points, normals)
    directions, hits = tracer.gather(points, normals, rays)
    # rays that start inside (folded lips, the back of the eyes) meet back faces: those send nothing
    outwards = tracer.mesh.face_normals.astype(np.float32)
    for part in parts(len(points), CHUNK):
        met = hits[part]
        facing = outwards[np.maximum(met, 0)]
        away = np.einsum("nri,nri->nr", directions[part], facing) > 0
        met[(met >= 0) & away] = len(faces)
    irradiance = lamps
    for _ in range(BOUNCES + 1):
        sent = (albedo * irradiance / np.pi)[faces].mean(axis=1)
        sent = np.vstack([sent, np.zeros(3)])
        baked = tracer.collect(normals, directions, hits, sent)
        irradiance = lamps + np.maximum(np.einsum("nci,ni->nc", baked.light, normals), 0)
    of_bodies = []
    for k, body in enumerate(bodies):
        piece = slice(start[k], start[k + 1])
        own = Baked(baked.light[piece], baked.openness[piece], baked.sky[piece])
        own = _borrowed(own, body)
        of_bodies.append(
            Baked(
                _smooth(own.light, body.faces, body.smooth),
                _smooth(own.openness, body.faces, body.smooth),
                _smooth(own.sky, body.faces, body.smooth),
            )
        )
    return of_bodies
