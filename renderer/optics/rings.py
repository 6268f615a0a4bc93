"""A profile as a point and a few rings about it: what a few taps of a filter stand for.

A tap that is turned at random from pixel to pixel is, on the mean, a ring; read from a pyramid of
means it is a ring that is spread by its texel. Radii and weights are those whose answer to a
straight edge is nearest to the profile's, so that few taps have nearly no bias, where taps at the
medians of equal shares of the light, as importance sampling places them, cut off its far end.

A picture is taken for what nearest reads of it see: even over each pixel, so that a step of light
lies between two pixels and its answers count at their middles alone. A pixel's own light then has
nothing from across, and a profile's answer is that of its own edge there. Where pixels are as large
as the profile's core this matters: a step that lies anywhere in a pixel would have the fit repay a
blur that nobody reads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtr

#: Variance along an axis of a mean over pixels that is read bilinearly, in squared sides of it: a
#: box (1/12) and a tent (1/6).
TEXEL_VARIANCE = 0.25
COLUMNS = 220  # radii at which the answer of a ring is tabulated
ANGLES = 32
STEPS = 40
FARTHEST = 12.0  # radius of a ring, in widest distances


@dataclass(frozen=True, eq=False)
class Rings:
    """radius_mm (K + 1,), the first 0; weights (K + 1, C), each channel's sum is 1; error (C,): rms
    between the answers to a straight edge, over the distance at which either is not done.
    """

    radius_mm: np.ndarray
    weights: np.ndarray
    error: np.ndarray


def fit(
    edge: Callable[[np.ndarray], np.ndarray],
    distance_mm: np.ndarray,
    rings: int,
    texel: float,
    pixel_mm: float,
    noise: float,
    factors: tuple[float, ...] = (1.0,),
) -> Rings:
    """The point and so many rings whose answer to an edge is nearest to a profile's.

    edge: the profile's own answer, light where x < 0: (N,) mm -> (N, C), for x >= 0. distance_mm
    (C,): Burley's distances, as the scale of the problem. texel: side of what a tap is a mean over,
    as a share of its radius, never less than pixel_mm, at whose middles answers count. noise: how
    much the squared weight of a tap, over the texels it is a mean of, counts beside the squared
    miss, times the widest distance. factors: a ring is the mean of rings of its radius `spread` by
    each.
    """
    from scipy.optimize import least_squares, nnls

    narrow, wide = float(np.min(distance_mm)), float(np.max(distance_mm))
    x = _middles(narrow, wide, pixel_mm)
    share = np.sqrt(np.gradient(x))
    goal = edge(x)
    channels = goal.shape[1]
    log_r = np.linspace(np.log(0.05 * narrow), np.log(FARTHEST * wide), COLUMNS)
    table = np.mean(
        [_answers(x, spread(np.exp(log_r), f, pixel_mm), texel, pixel_mm) for f in factors], axis=0
    )
    point = np.zeros(len(x))

    def answers(radii: np.ndarray) -> np.ndarray:
        place = (np.log(radii) - log_r[0]) / (log_r[1] - log_r[0])
        low = np.clip(place.astype(int), 0, COLUMNS - 2)
        part = np.clip(place - low, 0, 1)
        return np.column_stack([point, table[:, low] * (1 - part) + table[:, low + 1] * part])

    def weighted(radii: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Weights (K + 1, C), and what is to be small."""
        B, means = answers(radii), pixel_mm / np.maximum(texel * radii, pixel_mm)
        quiet = np.diag(np.sqrt(noise * wide) * np.append(0.0, means))
        A = np.vstack([share[:, None] * B, quiet, np.full((1, rings + 1), 1e3)])
        weights = np.column_stack(
            [
                nnls(A, np.concatenate([share * goal[:, c], np.zeros(rings + 1), [1e3]]))[0]
                for c in range(channels)
            ]
        )
        miss = share[:, None] * (B @ weights - goal)
        return weights, np.concatenate([miss.ravel(), (quiet @ weights).ravel()])

    def radii_of(steps: np.ndarray) -> np.ndarray:
        return np.minimum(np.cumsum(np.exp(steps)), np.exp(log_r[-1]))

    start = np.geomspace(1.5 * narrow, 6.0 * wide, rings)
    steps = np.log(np.diff(np.append(0.0, start)))
    bounds = (np.log(0.05 * narrow), np.log(8.0 * wide))
    best = least_squares(
        lambda s: weighted(radii_of(s))[1],
        np.clip(steps, bounds[0] + 1e-6, bounds[1] - 1e-6),
        bounds=bounds,
        diff_step=1e-3,
        max_nfev=STEPS,
    )
    radii = radii_of(best.x)
    weights = weighted(radii)[0]
    weights /= weights.sum(axis=0)
    miss = answers(radii) @ weights - goal
    error = np.sqrt(np.trapezoid(miss**2, x, axis=0) / np.ptp(x))
    return Rings(np.append(0.0, radii), weights, error)


def spread(radius_mm: np.ndarray, factor: float, pixel_mm: float) -> np.ndarray:
    """Radii times a factor, less so of those under two pixels, not at all under one: mm. There is
    nothing between two pixels that a ring could meet.
    """
    return radius_mm * factor ** np.clip(np.asarray(radius_mm) / pixel_mm - 1, 0, 1)


def _middles(narrow: float, wide: float, pixel_mm: float) -> np.ndarray:
    """Distances of pixels' middles from a step between two: mm; near it, all of them."""
    parts = (0.0, 4.3 * narrow, 4.3 * narrow + 4.0 * wide, 4.3 * narrow + 25.0 * wide)
    even = [
        np.linspace(*part, count, endpoint=False)
        for part, count in zip(pairwise(parts), (90, 90, 80))
    ]
    return (np.unique(np.floor(np.concatenate(even) / pixel_mm)) + 0.5) * pixel_mm


def _answers(x: np.ndarray, radii: np.ndarray, texel: float, pixel_mm: float) -> np.ndarray:
    """What rings of these radii answer to an edge, light where x < 0: (N, K)."""
    turns = np.cos((np.arange(ANGLES) + 0.5) / ANGLES * np.pi)
    columns = []
    for r in radii:
        level = np.log2(max(texel * r / pixel_mm, 1.0))
        low, at = int(level), x[:, None] + r * turns
        both = [_read(at, step, pixel_mm).mean(axis=1) for step in (low, low + 1)]
        columns.append(both[0] + (level - low) * (both[1] - both[0]))
    return np.column_stack(columns)


def _read(at: np.ndarray, level: int, pixel_mm: float) -> np.ndarray:
    """What a level of the means, read bilinearly so far from a step, has of the light before it."""
    if level == 0:  # two pixels, one of them lit
        return np.clip(0.5 - at / pixel_mm, 0, 1)
    return ndtr(-at / (np.sqrt(TEXEL_VARIANCE) * 2**level * pixel_mm))
