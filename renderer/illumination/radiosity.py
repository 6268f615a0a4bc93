"""Radiosity: patches, form factors by rays, and their solution; Goral et al. 1984,
doi:10.1145/964965.808601.

    B_i = E_i + rho_i sum_j F_ij B_j

B, E (P, 3) are radiosities, pi times the radiance of a matt surface. E holds what a patch emits and
what it reflects of the lamps and of the environment. The solution does not depend on the view.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial import cKDTree

from renderer.errors import InputError
from renderer.illumination.models import dot
from renderer.illumination.rays import OFFSET_MM, Hits, World
from renderer.passes.bake import frames, hemisphere
from renderer.scene.shapes import points_on

MOST_PATCHES = 6000
CHUNK = 1 << 18  # rays at once
SCALINGS, SWEEPS = 200, 200  # at most


@dataclass(frozen=True)
class Patches:
    """Groups of neighbouring triangles of one body that face about the same way.

    of (F,): the patch of each triangle; centres, normals, albedo, emission (P, 3), mm and radiance;
    area (P,): mm^2; body (P,); size_mm: of their cells.
    """

    of: np.ndarray
    centres: np.ndarray
    normals: np.ndarray
    albedo: np.ndarray
    emission: np.ndarray
    area: np.ndarray
    body: np.ndarray
    size_mm: float


def patches(world: World, size_mm: float) -> Patches:
    """Patches of cells of size_mm along each object's axes, counted from its corner."""
    own = world.own[world.faces]
    each = range(world.body.max() + 1)
    corner = np.array([own[world.body == b].min(axis=(0, 1)) for b in each])
    cells = np.floor((own.mean(axis=1) - corner[world.body]) / size_mm + 1e-4)
    across = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
    facing = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    keys = np.column_stack([world.body, np.rint(2 * facing), cells]).astype(int)
    keys -= keys.min(axis=0)
    numbers = np.ravel_multi_index(tuple(keys.T), tuple(keys.max(axis=0) + 1))
    _, of = np.unique(numbers, return_inverse=True)
    count = of.max() + 1
    if count > MOST_PATCHES:
        raise InputError(
            f"{count} patches of {size_mm:g} mm; expected at most {MOST_PATCHES}: take larger ones"
        )
    area = np.bincount(of, world.areas, count)

    def mean(values: np.ndarray) -> np.ndarray:
        parts = [np.bincount(of, world.areas * column, count) for column in values.T]
        return np.column_stack(parts) / np.maximum(area, 1e-30)[:, None]

    normals = mean(world.flat)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    body = np.zeros(count, int)
    body[of] = world.body
    albedo = mean(world.albedo[world.faces].mean(axis=1))
    emission = world.coefficients.emission[body]
    middles = world.positions[world.faces].mean(axis=1)
    return Patches(of, mean(middles), normals, albedo, emission, area, body, size_mm)


@dataclass(frozen=True)
class Exchange:
    """How patches see each other.

    F (P, P): the share of the light that leaves i and arrives at j; area (P,): mm^2, without what
    lies inside of another body; open (P,): the share that leaves the scene; from_lamps,
    from_around (P, 3): irradiance from lamps and environment. counted: F before it was balanced.
    """

    F: np.ndarray
    area: np.ndarray
    open: np.ndarray
    from_lamps: np.ndarray
    from_around: np.ndarray
    counted: np.ndarray


def exchange(world: World, made: Patches, rays: int, seed: int) -> Exchange:
    """Form factors by `rays` cosine-distributed rays from points all over each patch.

    A ray that meets the back of a face starts inside of a body: it is left out, and with it that
    share of the patch.
    """
    count = len(made.area)
    rng = np.random.default_rng([seed, 4])
    order = np.argsort(made.of, kind="stable")
    ends = np.concatenate([[0], np.cumsum(made.area)])
    local = hemisphere(rays)
    hits, lost, inside = np.zeros((count, count)), np.zeros(count), np.zeros(count)
    lamps, around, known = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    step = max(1, CHUNK // rays)
    for first in range(0, count, step):
        own = np.repeat(np.arange(first, min(first + step, count)), rays)
        stratum = np.tile(np.arange(rays), len(own) // rays)
        at = (ends[own] + (stratum + rng.random(len(own))) / rays * made.area[own]) / ends[-1]
        chosen, weights = points_on(world.areas[order], at, rng)
        triangle = order[chosen]
        points = np.einsum("kc,kci->ki", weights, world.positions[world.faces[triangle]])
        normals = world.flat[triangle]
        # places and directions are spread evenly, each, and drawn together at random
        shuffled = rng.permuted(np.tile(np.arange(rays), (len(own) // rays, 1)), axis=1).ravel()
        turned = frames(normals, rng.uniform(0, 2 * np.pi, len(own)))
        towards = np.einsum("nij,nj->ni", turned, local[shuffled])
        met, _ = world.tracer.first(points + OFFSET_MM * normals, towards)
        behind = (met >= 0) & (dot(towards, world.flat[met]) > 0)
        away = met < 0
        good = ~behind & ~away
        np.add.at(hits, (own[good], made.of[met[good]]), 1)
        np.add.at(lost, own[away], 1)
        np.add.at(inside, own[behind], 1)
        for k, values in enumerate(world.environment(towards[away]).T):
            around[:, k] += np.bincount(own[away], values, count)
        seen = np.flatnonzero(~behind)
        known += np.bincount(own[seen], minlength=count)
        for direction, irradiance in world.tracer.lit(points[seen], normals[seen], 1, rng):
            arrives = irradiance * np.maximum(dot(direction, normals[seen]), 0)[:, None]
            for k in range(3):
                lamps[:, k] += np.bincount(own[seen], arrives[:, k], count)
    rays_left = np.maximum(known, 1)[:, None]
    counted = hits / rays_left
    area = made.area * known / rays
    F = balanced(counted, area)
    return Exchange(
        F, area, lost / rays_left[:, 0], lamps / rays_left, np.pi * around / rays_left, counted
    )


def balanced(counted: np.ndarray, area: np.ndarray, tolerance: float = 1e-9) -> np.ndarray:
    """Form factors that are reciprocal, A_i F_ij = A_j F_ji, with the row sums of `counted`.

    The mean of both directions is scaled by d_i d_j (a symmetric Sinkhorn iteration) until the rows
    sum to what they did: rays alone keep the sums, and reciprocity within their noise. Where rays
    are so few that no scaling does it, what a row lacks stays with its patch.
    """
    exchanged = area[:, None] * counted
    wanted = exchanged.sum(axis=1)
    S = 0.5 * (exchanged + exchanged.T)
    rows = wanted > 0
    S[~rows] = S[:, ~rows] = 0
    d = np.ones(len(area))
    for _ in range(SCALINGS):
        sums = d * (S @ d)
        good = sums > 0
        if np.abs(sums[good] / wanted[good] - 1).max(initial=0) < tolerance:
            break
        d[good] *= np.sqrt(wanted[good] / sums[good])
        d = np.clip(d, 1e-3, 1e3)
    S = d[:, None] * S * d
    fits = np.minimum(1, wanted / np.maximum(S.sum(axis=1), 1e-300))
    S *= np.minimum(fits[:, None], fits)
    S[np.diag_indices_from(S)] += np.maximum(wanted - S.sum(axis=1), 0)
    return S / np.where(area > 0, area, 1)[:, None]


def gauss_seidel(
    F: np.ndarray, albedo: np.ndarray, emitted: np.ndarray, tolerance: float = 1e-6
) -> Iterator[np.ndarray]:
    """B (P, 3): E itself, then after each sweep until it changes by less than `tolerance` of it.

    A sweep updates the patches one after the other with what is known of all others:
    (1 - lower) B_new = E + upper B, where lower and upper are the triangles of rho F.
    """
    B = emitted
    yield B
    for _ in range(SWEEPS):
        new = np.empty_like(B)
        for k in range(3):
            M = albedo[:, k, None] * F
            lower = np.eye(len(F)) - np.tril(M)
            right = emitted[:, k] + np.triu(M, 1) @ B[:, k]
            new[:, k] = solve_triangular(lower, right, lower=True, check_finite=False)
        change = np.abs(new - B).max()
        B = new
        yield B
        if change <= tolerance * max(np.abs(B).max(), 1e-30):
            return
    raise InputError(f"radiosity did not settle in {SWEEPS} sweeps; expected albedo below 1")


@dataclass(frozen=True)
class Solution:
    """Radiosity of a scene.

    sweeps: B (P, 3) after 0, 1, ... of them; incident (P, 3): irradiance from other patches and
    from around, without the lamps'.
    """

    patches: Patches
    exchange: Exchange
    sweeps: list[np.ndarray]
    incident: np.ndarray

    @property
    def B(self) -> np.ndarray:
        """Radiosity (P, 3)."""
        return self.sweeps[-1]

    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """Light that comes in and light that goes, (3,) each: emitted and from lamps and around;
        absorbed and out of the scene.
        """
        area, light = self.exchange.area[:, None], self.exchange.from_lamps
        light = light + self.exchange.from_around
        arriving = light + self.exchange.F @ self.B
        comes = (area * (np.pi * self.patches.emission + light)).sum(axis=0)
        absorbed = (area * (1 - self.patches.albedo) * arriving).sum(axis=0)
        leaves = (area * self.exchange.open[:, None] * self.B).sum(axis=0)
        return comes, absorbed + leaves

    def smooth(self, values: np.ndarray):
        """The function that takes hits to values (K, 3), interpolated between patches (P, 3)."""
        made = self.patches
        seen = np.flatnonzero(self.exchange.area > 1e-3 * made.area)
        tree = cKDTree(_places(made.centres, made.normals, made.body, made.size_mm)[seen])

        def at(hits: Hits) -> np.ndarray:
            body = made.body[made.of[hits.triangle]]
            side = np.where(hits.behind, -1.0, 1.0)[:, None]
            where = _places(hits.points, hits.normals * side, body, made.size_mm)
            distance, near = tree.query(where, k=min(9, len(seen)))
            distance, near = distance.reshape(len(where), -1), near.reshape(len(where), -1)
            weight = np.maximum(1 - (distance / 1.5) ** 2, 0) ** 2 + 1e-9
            weight = weight * self.exchange.area[seen][near]
            weight /= weight.sum(axis=1, keepdims=True)
            return np.einsum("kn,knc->kc", weight, values[seen][near])

        return at


def _places(points, normals, body, size_mm) -> np.ndarray:
    """Points (N, 7) such that what lies near each other is of one body and faces the same way."""
    return np.column_stack([points / size_mm, 2 * normals, 1e3 * body])


def solve(world: World, size_mm: float, rays: int = 512, seed: int = 0) -> Solution:
    """Radiosity of a scene by patches of size_mm, with `rays` a patch for the form factors."""
    made = patches(world, size_mm)
    seen = exchange(world, made, rays, seed)
    light = np.pi * made.emission + made.albedo * (seen.from_lamps + seen.from_around)
    sweeps = list(gauss_seidel(seen.F, made.albedo, light))
    return Solution(made, seen, sweeps, seen.F @ sweeps[-1] + seen.from_around)


def shade_flat(world: World, solution: Solution, B: np.ndarray, origins, towards) -> np.ndarray:
    """Radiance (N, 3) of rays (N, 3): one value a patch."""
    hits = world.meet(origins, towards)
    total = world.environment(towards)
    total[hits.ray] = B[solution.patches.of[hits.triangle]] / np.pi
    return total


def shade_smooth(world: World, solution: Solution, B: np.ndarray, origins, towards) -> np.ndarray:
    """Radiance (N, 3) of rays (N, 3), interpolated between patches."""
    hits = world.meet(origins, towards)
    total = world.environment(towards)
    total[hits.ray] = solution.smooth(B)(hits) / np.pi
    return total
