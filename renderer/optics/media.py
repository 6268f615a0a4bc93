"""Media as scenes name them, and the reference curve of each.

A medium is a preset's name, a table of coefficients per channel, a complex index of refraction,
plane layers of such media, or a published curve of which no coefficients are known.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from renderer.errors import InputError
from renderer.optics import curve as curves
from renderer.optics import gaussians, montecarlo
from renderer.optics.curve import Curve
from renderer.optics.medium import (
    MARBLE_WAVELENGTH_NM,
    STACKS,
    Layer,
    Medium,
    Stack,
    finest_mm,
    reach_mm,
    sigma_a_from_index,
)
from renderer.parameters import refuse_unknown

PHOTONS = 400_000  # a channel: an edge's noise is then below a thousandth
SEED = 20240601
RINGS = 160

#: The published curves: only the six Gaussians of d'Eon and Luebke. Their albedo is that of light
#: skin, by eye; the paper keeps it in a texture.
DEON_LUEBKE = "deon_luebke"


@dataclass(frozen=True)
class GaussianCurve:
    """A curve that is only known as a sum of Gaussians; weights (K, C) of variance_mm2 (K,)."""

    name: str
    variance_mm2: tuple[float, ...]
    weights: tuple[tuple[float, ...], ...]
    albedo: tuple[float, ...]
    source: str = ""

    @property
    def channels(self) -> int:
        return len(self.weights[0])

    def curve(self) -> Curve:
        """The rings of the sum."""
        variance, weights = np.array(self.variance_mm2), np.array(self.weights)

        def cdf(r):
            return (1 - np.exp(-(np.asarray(r)[:, None] ** 2) / (2 * variance))) @ weights

        sigma = np.sqrt(variance)
        return curves.from_cdf(
            self.name,
            cdf,
            6 * sigma.max(),
            sigma.min() / 40,
            albedo=np.array(self.albedo),
            source=self.source,
        )


PUBLISHED: dict[str, GaussianCurve] = {
    DEON_LUEBKE: GaussianCurve(
        DEON_LUEBKE,
        tuple(gaussians.SKIN_VARIANCE_MM2),
        tuple(map(tuple, gaussians.SKIN_WEIGHTS)),
        (0.66, 0.42, 0.33),
        "d'Eon and Luebke 2007, GPU Gems 3, ch. 14, fig. 14-13",
    )
}
#: The default skin: three layers, whose coefficients are published (see renderer.optics.medium).
DEFAULT_SKIN = "skin_three_layers"
ALIASES = {"skin": DEFAULT_SKIN}


def names() -> list[str]:
    """What a scene can name."""
    return [*ALIASES, *PUBLISHED, *STACKS]


def read(value: str | Mapping[str, Any], where: str = "medium") -> Stack | GaussianCurve:
    """The medium that a scene names; InputError names the key at fault.

    A table has either sigma_a with sigma_s_prime (or sigma_s) per channel in 1/mm, and eta and g;
    or imaginary_index per channel with sigma_s_prime (and wavelength_nm); or layers, each such a
    table with thickness_mm; or gaussians: variance_mm2 (K,) and weights (K, C).
    """
    if isinstance(value, str):
        key = value.lower().replace("-", "_").replace(" ", "_")
        key = ALIASES.get(key, key)
        preset = PUBLISHED.get(key) or STACKS.get(key)
        if preset is None:
            raise InputError(f"{where} is {value!r}; expected one of {', '.join(names())}")
        return preset
    if not isinstance(value, Mapping):
        raise InputError(f"{where} is {value!r:.60}; expected a preset's name or a table")
    try:
        if "layers" in value:
            refuse_unknown(value, ("layers", "n_above", "n_below", "name"), where)
            layers = tuple(
                _layer(layer, f"{where}.layers[{k}]") for k, layer in enumerate(value["layers"])
            )
            rest = {k: v for k, v in value.items() if k != "layers"}
            return Stack(layers, **rest)
        if "gaussians" in value:
            refuse_unknown(value, ("gaussians", "albedo", "name"), where)
            return _gaussians(value, where)
        return Stack.of(_medium(value, where))
    except TypeError as error:
        raise InputError(f"{where}: {error}") from None


def _layer(table: Mapping[str, Any], where: str) -> Layer:
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {table!r:.60}; expected a table")
    thickness = table.get("thickness_mm", np.inf)
    rest = {key: value for key, value in table.items() if key != "thickness_mm"}
    if set(rest) == {"medium"}:
        stack = read(rest["medium"], f"{where}.medium")
        if not isinstance(stack, Stack) or len(stack.layers) != 1:
            raise InputError(f"{where}.medium has layers or no coefficients; expected one medium")
        return replace(stack.layers[0], thickness_mm=thickness)
    return Layer(_medium(rest, where), thickness)


def _medium(table: Mapping[str, Any], where: str) -> Medium:
    known = ("sigma_a", "sigma_s_prime", "sigma_s", "eta", "g", "name", "source")
    known = (*known, "imaginary_index", "wavelength_nm")
    refuse_unknown(table, known, where)
    table = dict(table)
    if "imaginary_index" in table:
        if "sigma_a" in table:
            raise InputError(f"{where} has sigma_a and imaginary_index; expected one of them")
        wavelength = table.pop("wavelength_nm", MARBLE_WAVELENGTH_NM)
        table["sigma_a"] = tuple(sigma_a_from_index(table.pop("imaginary_index"), wavelength))
    if "sigma_a" not in table or not {"sigma_s", "sigma_s_prime"} & set(table):
        raise InputError(
            f"{where} has {', '.join(table) or 'nothing'}; expected sigma_a and sigma_s_prime"
        )
    if "sigma_s" in table:
        return Medium.from_sigma_s(table.pop("sigma_a"), table.pop("sigma_s"), **table)
    return Medium(**table)


def _gaussians(table: Mapping[str, Any], where: str) -> GaussianCurve:
    entry = table["gaussians"]
    if not isinstance(entry, Mapping):
        raise InputError(f"{where}.gaussians is {entry!r:.60}; expected variance_mm2 and weights")
    refuse_unknown(entry, ("variance_mm2", "weights"), f"{where}.gaussians")
    variance = np.asarray(entry.get("variance_mm2", ()), float)
    weights = np.asarray(entry.get("weights", ()), float)
    good = variance.ndim == 1 and weights.ndim == 2 and len(variance) == len(weights) > 0
    if not good or not (variance > 0).all() or not (weights >= 0).all():
        raise InputError(
            f"{where}.gaussians: expected variance_mm2 (K,) above 0 and weights (K, channels) of 0 "
            "or more"
        )
    weights = weights / weights.sum(axis=0)
    albedo = tuple(table.get("albedo", (0.5,) * weights.shape[1]))
    name = str(table.get("name", "gaussians"))
    return GaussianCurve(name, tuple(variance), tuple(map(tuple, weights)), albedo)


def curve(value: str | Mapping[str, Any], photons: int = PHOTONS, progress: bool = False) -> Curve:
    """The reference curve of what a scene names: a formula, or Monte Carlo of diffuse light.

    Light enters with a cosine distribution, as the irradiance on a surface does. Runs are cached.
    """
    key = value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=list)
    return _curve(key, isinstance(value, str), photons, progress)


@lru_cache(maxsize=32)
def _curve(key: str, is_name: bool, photons: int, progress: bool) -> Curve:
    medium = read(key if is_name else json.loads(key))
    if isinstance(medium, GaussianCurve):
        return medium.curve()
    return simulated(medium, photons, progress)


def simulated(stack: Stack, photons: int = PHOTONS, progress: bool = False) -> Curve:
    """The curve of a stack by Monte Carlo: one run a channel, cached by its parameters."""
    if np.isinf(stack.thickness_mm) and min(stack.layers[-1].medium.sigma_a) == 0:
        raise InputError(
            f"{stack.name or 'the medium'} absorbs nothing in a channel and is infinitely deep; "
            "expected sigma_a above 0, or a thickness"
        )
    results = []
    for c in range(stack.channels):
        edges = np.geomspace(finest_mm(stack, c) / 100, reach_mm(stack), RINGS)
        results.append(
            montecarlo.simulate(
                montecarlo.layers_of(stack, c),
                photons,
                SEED,
                stack.n_above,
                stack.n_below,
                illumination="diffuse",
                bins=np.concatenate([[0.0], edges]),
                progress=progress,
            )
        )
    return _joined(stack.name, results)


def _joined(name: str, results: list) -> Curve:
    """One curve of channels that were counted in rings of their own."""
    parts = [curves.from_montecarlo(name, [result]) for result in results]
    r = np.concatenate([part.r_mm for part in parts])
    weights = np.zeros((len(r), len(parts)))
    start = 0
    for c, part in enumerate(parts):
        weights[start : start + len(part.r_mm), c] = part.weights[:, 0]
        start += len(part.r_mm)
    return Curve(
        name,
        r,
        weights,
        np.array([part.albedo[0] for part in parts]),
        np.array([part.noise[0] for part in parts]),
        f"Monte Carlo, {results[0].photons} photons a channel",
    )


@dataclass(frozen=True)
class Inversion:
    """Coefficients of an isotropic medium whose curve is nearest to a given one.

    residual (C,): rms at a straight edge that is left, since a formula need not be a medium's.
    """

    medium: Medium
    residual: np.ndarray


def invert(target: Curve, photons: int = 100_000, eta: float = 1.0) -> Inversion:
    """Find a medium for a curve: alpha' from the albedo, then the mean free path from the shape.

    The reduced albedo is that which gives the curve's albedo under diffuse light (Chandrasekhar's
    exact solution where the face is matched, Monte Carlo where `eta`, the index within over that
    outside, is not 1); the curve of a medium scales with its mean free path, so that one run a
    channel is then enough.
    """
    from scipy.optimize import brentq, minimize_scalar

    from renderer.optics import chandrasekhar

    if target.albedo is None:
        raise InputError(f"the curve {target.name} has no albedo; expected one to invert it")
    sigma_a, sigma_s, residual = [], [], []
    for c in range(target.channels):
        wanted = float(np.clip(target.albedo[c], 0.001, 0.98))

        def too_bright(a: float, wanted=wanted) -> float:
            if eta == 1:
                return float(chandrasekhar.diffuse_albedo(np.array([a]))[0]) - wanted
            inside = Stack.of(Medium((1 - a,), (a,), eta=eta))
            return float(simulated(inside, photons).albedo[0]) - wanted

        # photons say the albedo to some thousandths: the root need not be finer
        ends = (1e-4, 0.99999) if eta == 1 else (0.01, 0.9999)
        alpha = brentq(too_bright, *ends, xtol=2e-12 if eta == 1 else 1e-4)
        unit = simulated(Stack.of(Medium((1 - alpha,), (alpha,), eta=eta)), photons)
        x = target.positions(c)
        goal = target.edge(x)[:, c]

        def miss(log_mfp: float, unit=unit, x=x, goal=goal) -> float:
            gap = unit.edge(x / np.exp(log_mfp))[:, 0] - goal
            return float(np.sqrt(np.trapezoid(gap**2, x) / (x[-1] - x[0])))

        middle = np.log(target.mean_radius()[c] / unit.mean_radius()[0])
        minimum = minimize_scalar(miss, bounds=(middle - 2, middle + 2), method="bounded")
        mfp = float(np.exp(minimum.x))
        sigma_a.append((1 - alpha) / mfp)
        sigma_s.append(alpha / mfp)
        residual.append(minimum.fun)
    medium = Medium(
        tuple(sigma_a), tuple(sigma_s), eta=eta, name=f"{target.name}_inverted", source="inversion"
    )
    return Inversion(medium, np.array(residual))
