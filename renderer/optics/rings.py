"""A profile as a point and a few rings about it: what a few taps of a filter stand for.

A tap that is turned at random from pixel to pixel is, on the mean, a ring; read from a pyramid of
means it is a ring that is spread by its texel. Radii and weights are those whose answer to a
straight edge is nearest to the profile's, so that few taps have nearly no bias, where taps at the
medians of equal shares of the light, as importance sampling places them, cut off its far end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import ndtr

#: Variance along an axis of the mean over a texel that is read bilinearly, in squared texels: a box
#: (1/12) and a tent (1/6).
TEXEL_VARIANCE = 0.25
PIXEL_VARIANCE = 1 / 12
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
    as a share of its radius, never less than pixel_mm. noise: how much the squared weight of a tap,
    over the texels it is a mean of, counts beside the squared miss, times the widest distance.
    factors: a ring is the mean of rings of its radius times each.
    """
    from scipy.optimize import least_squares, nnls

    narrow, wide = float(np.min(distance_mm)), float(np.max(distance_mm))
    parts = (0.0, 4.3 * narrow, 4.3 * narrow + 4.0 * wide, 4.3 * narrow + 25.0 * wide)
    x = np.concatenate(
        [
            np.linspace(*part, count, endpoint=False)
            for part, count in zip(pairwise(parts), (90, 90, 80))
        ]
    )
    share = np.sqrt(np.gradient(x))
    goal = _over_pixel(edge, x, pixel_mm)
    channels = goal.shape[1]
    log_r = np.linspace(np.log(0.05 * narrow), np.log(FARTHEST * wide), COLUMNS)
    table = sum(_answers(x, f * np.exp(log_r), texel, pixel_mm) for f in factors) / len(factors)
    point = ndtr(-x / (np.sqrt(PIXEL_VARIANCE) * pixel_mm))

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


def _answers(x: np.ndarray, radii: np.ndarray, texel: float, pixel_mm: float) -> np.ndarray:
    """What rings of these radii answer to an edge, light where x < 0: (N, K)."""
    turns = np.cos((np.arange(ANGLES) + 0.5) / ANGLES * np.pi)
    sides = np.maximum(texel * radii, pixel_mm)
    return np.column_stack(
        [
            ndtr(-(x[:, None] + r * turns) / (np.sqrt(TEXEL_VARIANCE) * side)).mean(axis=1)
            for r, side in zip(radii, sides)
        ]
    )


def _over_pixel(edge: Callable, x: np.ndarray, pixel_mm: float) -> np.ndarray:
    """The mean of an answer to an edge over a pixel: (N,) >= 0 -> (N, C)."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    total = 0.0
    for node, weight in zip(nodes, weights):
        at = x + 0.5 * pixel_mm * node
        beyond = edge(np.abs(at))
        total = total + 0.5 * weight * np.where(at[:, None] >= 0, beyond, 1 - beyond)
    return total
