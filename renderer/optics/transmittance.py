"""Light that a thin part lets through, by its thickness: T(s), as a multiple of what a thick part
of the medium sends back of as much light, so that times the albedo it is what leaves.

`curve_of` makes T of a medium by any of MODELS. The medium's own is the judge: Monte Carlo of
slabs. The others are what techniques take in its place: a profile of R alone on a shell at the
depth s (Jimenez et al. 2010; Burley), Donner and Jensen's multipole, and Beer's law as Green 2004
uses it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from renderer.errors import InputError
from renderer.optics import burley, fits, gaussians, media, montecarlo
from renderer.optics.medium import Layer, Medium, Stack
from renderer.optics.multipole import Multipole

MODELS = ("none", "slab", "jimenez", "burley", "multipole", "beer")
EXPONENTS = ("exact", "published")
#: How a thickness is taken from a lamp's depth map, see Translucency; passes/transmission.glsl has
#: them by their places.
THICKNESS = ("corrected", "along", "entry")
PHOTONS = 20_000  # a channel and thickness: T of 0.1 within 0.002
SEED = 20240602
THICKNESSES = 16  # of slabs, a channel
LEAST = 1e-3  # of T: where a curve ends
TABLE = 256  # entries of a curve, spread as the square of their number


@dataclass(frozen=True)
class Translucency:
    """How light that comes through thin parts is reckoned: what a technique asks of the passes.

    model: one of MODELS but "none"; exponent: one of EXPONENTS, of "jimenez"; wrap: added to the
    cosine of the light on the far face; thickness_scale: mm of the medium per mm of thickness in a
    lamp's depth map. thickness: "along" the lamp's ray (Jimenez et al. 2010); "corrected", across
    the part where its far face looks away from the point that is seen, along the ray where both
    look the same way (d'Eon and Luebke 2007, ch. 14.5.3); "entry", from that point to the plane in
    which the light enters, which it meets at that plane's own angle and not at the point's.
    """

    model: str = "slab"
    exponent: str = "exact"
    wrap: float = 0.0
    thickness_scale: float = 1.0
    thickness: str = "corrected"


@dataclass(frozen=True, eq=False)
class Transmittance:
    """T at thickness_mm (N,), rising from 0: values (N, C); 0 beyond, falling to it from the last.

    error (N, C): standard errors where T is estimated, else 0.
    """

    thickness_mm: np.ndarray
    values: np.ndarray
    error: np.ndarray

    @property
    def reach_mm(self) -> float:
        return float(self.thickness_mm[-1])

    def at(self, thickness_mm) -> np.ndarray:
        """T between the entries: (N,) -> (N, C)."""
        s = np.asarray(thickness_mm, float)
        channels = self.values.T
        return np.stack([np.interp(s, self.thickness_mm, t, right=0.0) for t in channels], -1)

    def table(self) -> np.ndarray:
        """T at reach_mm (k / (TABLE - 1))^2, for a texture: (TABLE, C), its last row 0."""
        values = self.at(self.reach_mm * (np.arange(TABLE) / (TABLE - 1)) ** 2)
        values[-1] = 0
        return values


def part(stack: Stack, thickness_mm: float) -> Stack:
    """A part of a body of so many mm, whose every face is the stack's: its layers down to the
    middle of the part, and up again. A stack that has an end is itself, whatever the thickness.
    """
    if not math.isinf(stack.thickness_mm):
        return stack
    left, half = thickness_mm / 2, []
    for layer in stack.layers:
        half.append(Layer(layer.medium, min(layer.thickness_mm, left)))
        left -= half[-1].thickness_mm
        if left <= 0:
            break
    middle = Layer(half[-1].medium, 2 * half[-1].thickness_mm)
    layers = (*half[:-1], middle, *half[-2::-1]) if len(half) > 1 else (middle,)
    return Stack(layers, stack.n_above, stack.n_above, name=stack.name)


def reach_mm(stack: Stack, channel: int) -> float:
    """A thickness that lets less than LEAST through: some diffuse mean free paths below the layers
    that have an end, mm.
    """
    if not math.isinf(stack.thickness_mm):
        return stack.thickness_mm
    ended = sum(layer.thickness_mm for layer in stack.layers[:-1])
    last = stack.layers[-1].medium
    deep = min(last.dmfp[channel] * -math.log(LEAST), 300 * last.mfp[channel])
    return 2 * ended + deep + 4 * last.mfp[channel]


@lru_cache(maxsize=64)
def slabs(stack: Stack, albedo: tuple[float, ...], photons: int = PHOTONS) -> Transmittance:
    """T of a stack by Monte Carlo of parts of it under diffuse light; runs are cached.

    albedo (C,): what a thick part sends back of the light that has entered.
    """
    from scipy.interpolate import PchipInterpolator

    own = [_slabs(stack, c, photons) for c in range(stack.channels)]
    s = max(d[-1] for d, _, _ in own) * (np.arange(TABLE) / (TABLE - 1)) ** 2
    values, errors = np.zeros((TABLE, len(own))), np.zeros((TABLE, len(own)))
    for c, (d, t, error) in enumerate(own):
        within = s <= d[-1]
        values[within, c] = np.exp(PchipInterpolator(d, np.log(t))(s[within])) / albedo[c]
        errors[:, c] = np.interp(s, d, error, right=0.0) / albedo[c]
    return Transmittance(s, values, errors)


def _slabs(stack: Stack, c: int, photons: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One channel: thicknesses (N,) from 0, T (N,) of the light that has entered, and its error."""
    far = reach_mm(stack, c)
    finest = min(layer.medium.mfp[c] for layer in stack.layers)
    d = np.geomspace(min(finest / 8, far / 4), far, THICKNESSES)
    if not math.isinf(stack.thickness_mm):
        d = np.array([far])
    t, error = np.empty(len(d)), np.empty(len(d))
    for k, thickness in enumerate(d):
        whole = part(stack, thickness)
        layers, indices = montecarlo.layers_of(whole, c), (stack.n_above, whole.n_below)
        run = montecarlo.simulate(
            layers, photons, SEED, *indices, illumination="diffuse", bins=[0.0, 1.0]
        )
        entered = 1 - run.specular
        t[k], error[k] = run.transmittance / entered, run.transmittance_error / entered
    if not math.isinf(stack.thickness_mm):  # the sheet lets as much through wherever it is
        return np.array([0.0, 1e4]), np.repeat(t, 2), np.repeat(error, 2)
    seen = t > LEAST * 0.1  # below, a few photons say nothing
    start = 1.0 if stack.layers[0].medium.eta == stack.n_above else t[0]
    kept = (np.append(0.0, d[seen]), np.append(start, t[seen]), np.append(0.0, error[seen]))
    return kept[0], np.minimum.accumulate(kept[1]), kept[2]


def homogeneous(value: str | Mapping[str, Any]) -> Medium:
    """One medium for what a scene names: itself, or of layers and formulas the one whose curve is
    nearest (renderer.optics.media.invert).
    """
    stack = media.read(value)
    if isinstance(stack, Stack) and len(stack.layers) == 1:
        return stack.layers[0].medium
    return media.invert(media.curve(value)).medium


def _beyond(dense: np.ndarray, t: np.ndarray) -> Transmittance:
    """A formula's T over thicknesses, cut where it is below LEAST in every channel."""
    seen = (t > LEAST).any(axis=1)
    last = min(int(np.flatnonzero(seen)[-1]) + 1, len(dense) - 1) if seen.any() else 1
    return Transmittance(dense[: last + 1], t[: last + 1], np.zeros_like(t[: last + 1]))


def curve_of(
    value: str | Mapping[str, Any], model: str = "slab", exponent: str = "exact"
) -> Transmittance:
    """T of what a scene names as a medium, by one of MODELS (but "none").

    exponent: of "jimenez": "exact", the integral over a Gaussian exp(-s^2 / 2 v); "published",
    exp(-s^2 / v), as the papers' shaders have it. "multipole" holds its value at one mean free path
    for thinner slabs, where its first source would lie outside. "multipole" and "beer" know one
    medium: of layers and formulas they take `homogeneous`; Beer's sigma_t is the reduced one.
    """
    curve = media.curve(value)
    if model == "slab":
        stack = media.read(value)
        if not isinstance(stack, Stack):
            stack = Stack.of(homogeneous(value))
        return slabs(stack, tuple(curve.albedo))
    far = 40 * float(curve.mean_radius().max())
    dense = far * (np.arange(4 * TABLE) / (4 * TABLE - 1)) ** 2
    if model == "jimenez":
        fit = fits.gaussian_sum(curve, 6)
        doubled = exponent == "published"
        shares = (fit.variance_mm2, fit.weights)
        return _beyond(dense, gaussians.transmittance(dense, doubled, *shares))
    if model == "burley":
        d_mm = fits.burley_distance(curve).distance_mm
        return _beyond(dense, burley.transmittance(dense[:, None], d_mm))
    medium = homogeneous(value)
    if model == "beer":
        return _beyond(dense, beer(dense, medium.sigma_t_prime))
    if model == "multipole":
        thick = Multipole(Stack.of(medium)).totals()[0]
        least = float(medium.mfp.max()) * 1.001
        t = [Multipole(Stack.of(medium, max(d, least))).totals()[1] for d in dense]
        return _beyond(dense, np.stack(t) / thick)
    raise InputError(f"no model {model!r} of transmittance; expected one of {', '.join(MODELS)}")


def beer(thickness_mm, sigma_t) -> np.ndarray:
    """T = exp(-sigma_t s), Green 2004, "Real-time approximations to subsurface scattering", GPU
    Gems, ch. 16.

    thickness_mm (N,), sigma_t (C,) in 1/mm -> (N, C).
    """
    s, sigma_t = np.asarray(thickness_mm, dtype=float), np.asarray(sigma_t, dtype=float)
    if not (
        np.isfinite(sigma_t).all()
        and (sigma_t >= 0).all()
        and np.isfinite(s).all()
        and (s >= 0).all()
    ):
        raise InputError("a thickness or sigma_t is negative or not finite; expected 0 or more")
    return np.exp(-s[..., None] * sigma_t)


def beer_of(thickness_mm: float, transmitted) -> np.ndarray:
    """sigma_t, 1/mm, with which Beer's law gives these shares at one thickness: the artist's way to
    choose it.
    """
    transmitted = np.asarray(transmitted, dtype=float)
    if not thickness_mm > 0 or not ((transmitted > 0) & (transmitted <= 1)).all():
        raise InputError(
            f"transmitted share is {transmitted} at {thickness_mm} mm; expected shares in (0, "
            "1] and a thickness above 0"
        )
    return -np.log(transmitted) / thickness_mm
