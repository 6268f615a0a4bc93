"""Monte Carlo: paths from the eye, the light of lamps and emitters gathered at every matt place.

Kajiya 1986, doi:10.1145/15922.15902. The same materials and local models as ray tracing has, with
the interreflection that its ambient term stands for: at each place a path goes on by a cosine-
distributed ray (k_d), a mirrored one (k_r) or a refracted one (k_t). Emitting triangles are chosen
by their power, so that emission counts at the eye and after mirrors alone. Unbiased: paths end by
Russian roulette.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from renderer.illumination.models import dot, mirrored, reflected, refracted, unit
from renderer.illumination.rays import OFFSET_MM, Hits, World, camera_rays
from renderer.passes.bake import frames
from renderer.scene.shapes import points_on
from renderer.scene.view import View

SURE_BOUNCES = 3  # before the roulette
MOST_BOUNCES = 1000


class Emitters:
    """The triangles that emit, to be lit by."""

    def __init__(self, world: World):
        emission = world.coefficients.emission[world.body]
        power = emission.max(axis=1) * world.areas
        self.world, self.shares = world, power
        self.any = bool(power.any())
        with np.errstate(invalid="ignore"):
            self.density = power / power.sum() / world.areas  # of points, 1/mm^2

    def light(self, hits: Hits, towards_eye: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Radiance (K, 3) towards the eye of the light of one point on an emitter."""
        count, world = len(hits.ray), self.world
        if not self.any or not count:
            return np.zeros((count, 3))
        triangle, weights = points_on(self.shares, rng.random(count), rng)
        points = np.einsum("kc,kci->ki", weights, world.positions[world.faces[triangle]])
        start = hits.points + OFFSET_MM * hits.flat
        away = points - start
        reach = np.linalg.norm(away, axis=1)
        towards = away / np.maximum(reach, 1e-12)[:, None]
        facing = np.maximum(-dot(towards, world.flat[triangle]), 0)
        able = (facing > 0) & (dot(towards, hits.normals) > 0) & (reach > OFFSET_MM)
        met = np.full(count, -1)
        met[able], distance = world.tracer.first(start[able], towards[able])
        seen = np.zeros(count, bool)
        seen[able] = distance > reach[able] * (1 - 1e-3) - OFFSET_MM
        emission = world.coefficients.emission[world.body[triangle]]
        share = seen * facing / np.maximum(reach**2 * self.density[triangle], 1e-30)
        return reflected(hits.at, hits.normals, towards, towards_eye, emission * share[:, None])


def trace(
    world: World, origins: np.ndarray, towards: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """An estimate of the radiance (N, 3) of each ray (N, 3), (N, 3), by one path."""
    emitters = Emitters(world)
    total = np.zeros((len(origins), 3))
    pixel, share = np.arange(len(origins)), np.ones((len(origins), 3))
    sees_emission = np.ones(len(origins), bool)
    for bounce in range(MOST_BOUNCES):
        hits = world.meet(origins, towards)
        gone = np.ones(len(pixel), bool)
        gone[hits.ray] = False
        total[pixel[gone]] += share[gone] * world.environment(towards[gone])
        d, at, pixel, share = towards[hits.ray], hits.at, pixel[hits.ray], share[hits.ray]
        clear_inside = hits.behind & (at.k_t.max(axis=1) > 0)
        emits = (sees_emission[hits.ray] & ~hits.behind)[:, None]
        local = world.direct(hits, -d, rng) + emitters.light(hits, -d, rng) + emits * at.emission
        local[clear_inside] = 0
        total[pixel] += share * local

        eta = np.where(hits.behind, at.index, 1 / at.index)
        bent, real = refracted(d, hits.normals, eta)
        inside = clear_inside[:, None]
        through = np.where(real[:, None], at.k_t, 0)
        mirror = at.k_r + np.where(real[:, None], 0, at.k_t)
        weights = np.stack([np.where(inside, 0, at.albedo), mirror, through])
        chances = weights.max(axis=2)
        whole = chances.sum(axis=0)
        survives = np.minimum((share * weights.sum(axis=0)).max(axis=1), 1.0)
        if bounce < SURE_BOUNCES:
            survives = (survives > 0) * 1.0
        drawn = rng.random(len(pixel)) * np.maximum(whole, 1e-30)
        way = (drawn[None] >= np.cumsum(chances, axis=0)).sum(axis=0).clip(0, 2)
        goes = (rng.random(len(pixel)) < survives) & (whole > 0)
        r, phi = np.sqrt(rng.random(len(pixel))), rng.uniform(0, 2 * np.pi, len(pixel))
        flat = np.column_stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r**2)])
        matt = np.einsum("nij,nj->ni", frames(hits.normals, np.zeros(len(pixel))), flat)
        onward = np.where((way == 0)[:, None], matt, mirrored(d, hits.normals))
        onward = np.where((way == 2)[:, None], bent, onward)
        chosen = weights[way, np.arange(len(pixel))]
        chance = chances[way, np.arange(len(pixel))] / np.maximum(whole, 1e-30) * survives
        share = share * chosen / np.maximum(chance, 1e-30)[:, None]
        side = np.where(way == 2, -1.0, 1.0)[:, None]
        origins = hits.points + side * OFFSET_MM * hits.flat
        origins, towards, pixel, share = origins[goes], unit(onward[goes]), pixel[goes], share[goes]
        sees_emission = way[goes] > 0 if emitters.any else np.ones(len(pixel), bool)
        if not len(pixel):
            break
    return total


def picture(
    world: World,
    view: View,
    size: tuple[int, int],
    samples: int,
    seed: int,
    progress: Callable[[int], None] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (H, W, 3) and its standard error, by `samples` (at least 2) paths a pixel."""
    width, height = size
    mean, spread = np.zeros((2, width * height, 3))
    for k in range(samples):
        rng = np.random.default_rng([seed, 5, k])
        shift = rng.random((width * height, 2))
        radiance = trace(world, *camera_rays(view, width, height, shift), rng)
        step = radiance - mean
        mean += step / (k + 1)
        spread += step * (radiance - mean)
        if progress:
            progress(k + 1)
    error = np.sqrt(spread / (samples - 1) / samples)
    return mean.reshape(height, width, 3), error.reshape(height, width, 3)
