"""The reference curve of a medium: where light that enters at a point leaves again.

A curve is a mixture of thin rings about the point of entry, per channel normalised to 1: everything
that a kernel needs is then a sum over rings, exact for the mixture, without assuming a formula.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from renderer.errors import InputError

EDGE_REACH_MM = 30.0  # a straight edge is judged this far on either side, or as far as light goes


@dataclass(frozen=True, eq=False)
class Curve:
    """Rings of radius r_mm (K,), > 0, with the shares weights (K, C) of the light, >= 0, sum 1.

    albedo (C,): the share of the diffuse light that has entered which leaves again; None where
    only the shape is known. noise (C,): standard error of the answer to a straight edge, from the
    number of photons; 0 for a formula.
    """

    name: str
    r_mm: np.ndarray
    weights: np.ndarray
    albedo: np.ndarray | None
    noise: np.ndarray
    source: str = ""

    def __post_init__(self) -> None:
        weights = np.asarray(self.weights, float)
        if not (np.isfinite(weights).all() and (weights >= -1e-12).all() and weights.size):
            raise InputError(f"the curve {self.name} has shares that are not numbers of 0 or more")
        total = weights.sum(axis=0)
        if not (total > 0).all():
            raise InputError(f"the curve {self.name} holds no light in a channel; expected some")
        object.__setattr__(self, "weights", np.maximum(weights, 0) / total)

    @property
    def channels(self) -> int:
        return self.weights.shape[1]

    def cdf(self, r_mm) -> np.ndarray:
        """The share of the light that leaves within a radius: (N,) -> (N, C)."""
        order = np.argsort(self.r_mm)
        cumulative = np.vstack([np.zeros(self.channels), np.cumsum(self.weights[order], axis=0)])
        place = np.searchsorted(self.r_mm[order], np.asarray(r_mm, float), side="right")
        return cumulative[place]

    def mean_radius(self) -> np.ndarray:
        """The mean distance between entry and exit, mm: (C,)."""
        return self.r_mm @ self.weights

    def edge(self, x_mm) -> np.ndarray:
        """The answer to a straight edge, light where x < 0: (N,) -> (N, C), from 1 down to 0.

        A ring of radius r about a point at x has the share arccos(x / r) / pi in the light.
        """
        x = np.asarray(x_mm, float)
        result = np.empty((len(x), self.channels))
        for start in range(0, len(x), 512):
            part = np.clip(x[start : start + 512, None] / self.r_mm, -1, 1)
            result[start : start + 512] = (np.arccos(part) / np.pi) @ self.weights
        return result

    def line_integral(self, a_mm, b_mm) -> np.ndarray:
        """The pre-integrated line kernel between a and b: (N,), (N,) -> (N, C).

        a_p(x) = int R(sqrt(x^2 + y^2)) dy; Jimenez et al. 2015, eq. 3.5's kernel.
        """
        return self.edge(np.asarray(a_mm, float)) - self.edge(np.asarray(b_mm, float))

    def stripes(self, period_mm) -> np.ndarray:
        """How much of a sine of light is left: the Hankel transform, J_0 over rings: (N, C)."""
        from scipy.special import j0

        k = 2 * np.pi / np.asarray(period_mm, float)
        return j0(np.outer(k, self.r_mm)) @ self.weights

    def square_stripes(self, width_mm: float) -> np.ndarray:
        """Amplitude left of bright and dark stripes of one width, at their middles: (C,)."""
        n = np.arange(1, 400, 2)
        part = 4 / np.pi * (-1.0) ** ((n - 1) // 2) / n
        return part @ self.stripes(2 * width_mm / n)

    def transmittance(self, thickness_mm) -> np.ndarray:
        """Light through a flat part by its thickness, as if the far side were a shell of the curve.

        Jimenez et al. 2010: T(d) = int R(sqrt(r^2 + d^2)) 2 pi r dr = 1 - P(d): (N,) -> (N, C).
        """
        return 1 - self.cdf(thickness_mm)

    def width(self, low: float = 0.1, high: float = 0.9) -> np.ndarray:
        """Width of a straight edge between two shares of its height, mm: (C,)."""
        return np.array([self._where(c, low) - self._where(c, high) for c in range(self.channels)])

    def _where(self, channel: int, share: float) -> float:
        from scipy.optimize import brentq

        far = float(self.r_mm.max())
        return brentq(lambda x: self.edge([x])[0, channel] - share, -far, far, xtol=1e-6)

    def positions(self, channel: int, points: int = 241) -> np.ndarray:
        """Places across an edge, dense where the answer changes (points,), mm: -x, 0, x."""
        inner, outer = np.interp([0.002, 0.995], *self._quantiles(channel))
        half = np.geomspace(max(inner, 1e-4), min(outer, EDGE_REACH_MM), points // 2)
        return np.concatenate([-half[::-1], [0.0], half])

    def _quantiles(self, channel: int) -> tuple[np.ndarray, np.ndarray]:
        order = np.argsort(self.r_mm)
        return np.cumsum(self.weights[order, channel]), self.r_mm[order]


def edge_error(curve: Curve, edge: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """How far another answer to a straight edge is from the curve's: rms over the edge, (C,).

    edge: positions (N,) mm -> (N, C). The mean is over distance, out to where 99.5 % of the light
    has left: what a viewer sees beside a shadow's edge.
    """
    errors = []
    for c in range(curve.channels):
        x = curve.positions(c)
        miss = edge(x)[:, c] - curve.edge(x)[:, c]
        errors.append(np.sqrt(np.trapezoid(miss**2, x) / (x[-1] - x[0])))
    return np.array(errors)


def from_cdf(
    name: str, cdf: Callable[[np.ndarray], np.ndarray], reach_mm: float, finest_mm: float, **rest
) -> Curve:
    """The curve of a profile whose share within a radius is known: cdf (N,) -> (N, C)."""
    edges = np.concatenate([[0.0], np.geomspace(finest_mm, reach_mm, 700)])
    middle = np.concatenate([[0.6 * finest_mm], np.sqrt(edges[1:-1] * edges[2:])])
    weights = np.diff(cdf(edges), axis=0)
    albedo, noise = rest.pop("albedo", None), np.zeros(weights.shape[1])
    return Curve(name, middle, weights, albedo, noise, **rest)


def from_montecarlo(name: str, results: list, **rest) -> Curve:
    """The curve of one simulation a channel (montecarlo.Result on the same rings)."""
    edges = results[0].edges_mm
    middle = np.sqrt((edges[1:] ** 2 + edges[:-1] ** 2) / 2)
    shares = np.stack([r.R * r.area_mm2 for r in results], axis=1)
    total = np.array([r.diffuse_reflectance for r in results])
    beyond = np.maximum(total - shares.sum(axis=0), 0)
    weights = np.vstack([shares, beyond])
    radii = np.append(middle, 1.2 * edges[-1])
    error = np.stack([r.R_error * r.area_mm2 for r in results], axis=1) / total
    noise = 0.5 * np.sqrt((error**2).sum(axis=0))
    entered = np.array([1 - r.specular for r in results])
    return Curve(name, radii, weights, total / entered, noise, **rest)
