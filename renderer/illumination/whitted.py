"""Ray casting and recursive ray tracing: Whitted 1980, doi:10.1145/358876.358882.

    I = k_a I_a + sum over lamps of the local model + k_r I_r + k_t I_t

With a depth of 0 it is ray casting: the local model where a ray of the eye ends, and a shadow ray
to each lamp. Deeper, the mirrored and the refracted ray bring their own I; all rays of a level are
traced at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from renderer.illumination.models import mirrored, refracted
from renderer.illumination.rays import OFFSET_MM, Hits, World

DEPTH = 6


@dataclass(frozen=True)
class Node:
    """A ray of a tree. parent: place of the ray that it comes from, -1 for the eye's.

    kind: "eye", "reflected" or "refracted"; start, end (3,) mm (end None: it leaves); towards (3,):
    unit vector; share (3,) of the pixel that it brings; brings (3,): the radiance of the local
    model at its end, times share; body: place of the body that it meets, -1 for none.
    """

    parent: int
    kind: str
    level: int
    start: np.ndarray
    towards: np.ndarray
    end: np.ndarray | None
    share: np.ndarray
    brings: np.ndarray
    body: int


@dataclass
class _Rays:
    """The rays of a level: pixel (N,), the node (N,) they come from, share (N, 3) of the pixel."""

    origins: np.ndarray
    towards: np.ndarray
    pixel: np.ndarray
    share: np.ndarray
    parent: np.ndarray
    kind: str

    def take(self, keep: np.ndarray) -> _Rays:
        parts = (self.origins, self.towards, self.pixel, self.share, self.parent)
        return _Rays(*(part[keep] for part in parts), self.kind)


def trace(
    world: World,
    origins: np.ndarray,
    towards: np.ndarray,
    depth: int = DEPTH,
    even: Callable[[Hits], np.ndarray] | None = None,
    least: float = 1 / 512,
    tree: list[Node] | None = None,
) -> np.ndarray:
    """Radiance (N, 3) of rays (N, 3), (N, 3).

    depth: of the recursion. even: the mean radiance (K, 3) that comes in at hits, which is
    reflected by k_d (radiosity's); without it k_a takes the scene's mean. least: rays that bring
    less of a pixel are left out. tree: takes the nodes.
    """
    total = np.zeros((len(origins), 3))
    share, parent = np.ones((len(origins), 3)), np.full(len(origins), -1)
    waiting = [_Rays(origins, towards, np.arange(len(origins)), share, parent, "eye")]
    for level in range(depth + 1):
        following: list[_Rays] = []
        for rays in waiting:
            following += _level(world, rays, level, even, total, tree)
        waiting = [rays.take(rays.share.max(axis=1) > least) for rays in following]
        waiting = [rays for rays in waiting if len(rays.pixel)]
    return total


def _level(world, rays, level, even, total, tree) -> list[_Rays]:
    """Add what these rays bring to `total`; the rays that go on."""
    hits = world.meet(rays.origins, rays.towards)
    brought = np.zeros((len(rays.pixel), 3))
    gone = np.ones(len(rays.pixel), bool)
    gone[hits.ray] = False
    brought[gone] = world.environment(rays.towards[gone])
    at, d = hits.at, rays.towards[hits.ray]
    if even is None:
        local = at.ambient * world.mean_radiance
    else:
        local = at.albedo * even(hits)
    local = local + at.emission + world.direct(hits, -d)
    clear_inside = hits.behind & (at.k_t.max(axis=1) > 0)
    local[clear_inside] = 0
    brought[hits.ray] = local
    brought *= rays.share
    np.add.at(total, rays.pixel, brought)
    node = np.full(len(rays.pixel), -1)
    if tree is not None:
        ends: list = [None] * len(rays.pixel)
        met = np.full(len(rays.pixel), -1)
        met[hits.ray] = world.body[hits.triangle]
        for k, ray in enumerate(hits.ray):
            ends[ray] = hits.points[k]
        node = len(tree) + np.arange(len(rays.pixel))
        tree += [
            Node(int(p), rays.kind, level, start, d, end, share, bring, int(b))
            for p, start, d, end, share, bring, b in zip(
                rays.parent,
                rays.origins,
                rays.towards,
                ends,
                rays.share,
                brought,
                met,
                strict=True,
            )
        ]

    def on(keep, directions, side, weight, kind) -> _Rays:
        ray = hits.ray[keep]
        starts = hits.points[keep] + side * OFFSET_MM * hits.flat[keep]
        shares = rays.share[ray] * weight[keep]
        return _Rays(starts, directions[keep], rays.pixel[ray], shares, node[ray], kind)

    eta = np.where(hits.behind, at.index, 1 / at.index)
    bent, real = refracted(d, hits.normals, eta)
    clear = at.k_t.max(axis=1) > 0
    mirror = at.k_r + np.where(real[:, None], 0, at.k_t)  # total reflection keeps what would leave
    reflects = mirror.max(axis=1) > 0
    return [
        on(reflects, mirrored(d, hits.normals), 1.0, mirror, "reflected"),
        on(clear & real, bent, -1.0, at.k_t, "refracted"),
    ]
