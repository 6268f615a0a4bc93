"""Scattering media: coefficients in 1/mm per channel, layers of them, and presets with their
sources.

Symbols as in Jensen, Marschner, Levoy and Hanrahan 2001, "A practical model for subsurface light
transport", doi:10.1145/383259.383319. Channels are R, G, B unless said otherwise; any number of
them is allowed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from renderer.errors import InputError


def _numbers(name: str, values) -> tuple[float, ...]:
    try:
        numbers = tuple(float(v) for v in np.atleast_1d(np.asarray(values, dtype=float)))
    except (TypeError, ValueError):
        raise InputError(f"{name} is {values!r}; expected numbers in 1/mm") from None
    if not numbers or not all(math.isfinite(v) and v >= 0 for v in numbers):
        raise InputError(
            f"{name} is {', '.join(f'{v:g}' for v in numbers) or 'empty'}; expected finite "
            "numbers of 0 or more, in 1/mm"
        )
    return numbers


def _index(name: str, value) -> float:
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, float, np.number))
        or not math.isfinite(value)
        or value < 1
    ):
        raise InputError(f"{name} is {value!r}; expected an index of refraction of 1 or more")
    return float(value)


@dataclass(frozen=True)
class Medium:
    """A homogeneous medium.

    sigma_a, sigma_s_prime: absorption and reduced scattering, 1/mm, one number a channel, >= 0;
    eta: index of refraction, >= 1; g: mean cosine of scattering, -1 < g < 1. Diffusion knows only
    sigma_s' = sigma_s (1 - g); g is for Monte Carlo.
    """

    sigma_a: tuple[float, ...]
    sigma_s_prime: tuple[float, ...]
    eta: float = 1.3
    g: float = 0.0
    name: str = ""
    source: str = ""

    def __post_init__(self):
        object.__setattr__(self, "sigma_a", _numbers("sigma_a", self.sigma_a))
        object.__setattr__(self, "sigma_s_prime", _numbers("sigma_s_prime", self.sigma_s_prime))
        object.__setattr__(self, "eta", _index("eta", self.eta))
        if len(self.sigma_a) != len(self.sigma_s_prime):
            raise InputError(
                f"sigma_a has {len(self.sigma_a)} channels and sigma_s_prime "
                f"{len(self.sigma_s_prime)}; expected as many"
            )
        if not isinstance(self.g, (int, float, np.number)) or not abs(self.g) < 1:
            raise InputError(
                f"g is {self.g!r}; expected a mean cosine between -1 and 1, both excluded"
            )
        if min(s + a for s, a in zip(self.sigma_s_prime, self.sigma_a, strict=True)) == 0:
            raise InputError(
                "sigma_a and sigma_s_prime are both 0 in a channel; expected a medium that "
                "scatters or absorbs"
            )

    @classmethod
    def from_sigma_s(cls, sigma_a, sigma_s, g: float = 0.0, **rest) -> Medium:
        """A medium from the scattering coefficient itself."""
        if not isinstance(g, (int, float, np.number)) or not abs(g) < 1:
            raise InputError(f"g is {g!r}; expected a mean cosine between -1 and 1, both excluded")
        return cls(sigma_a, tuple(s * (1 - g) for s in _numbers("sigma_s", sigma_s)), g=g, **rest)

    @property
    def channels(self) -> int:
        return len(self.sigma_a)

    @property
    def sigma_s(self) -> np.ndarray:
        """Scattering coefficient, 1/mm: (C,)."""
        return np.array(self.sigma_s_prime) / (1 - self.g)

    @property
    def sigma_t(self) -> np.ndarray:
        """Extinction sigma_a + sigma_s, 1/mm: (C,)."""
        return np.array(self.sigma_a) + self.sigma_s

    @property
    def sigma_t_prime(self) -> np.ndarray:
        """Reduced extinction sigma_a + sigma_s', 1/mm: (C,)."""
        return np.array(self.sigma_a) + np.array(self.sigma_s_prime)

    @property
    def albedo(self) -> np.ndarray:
        """Single-scattering albedo sigma_s / sigma_t: (C,)."""
        return self.sigma_s / self.sigma_t

    @property
    def albedo_prime(self) -> np.ndarray:
        """Reduced albedo alpha' = sigma_s' / sigma_t': (C,)."""
        return np.array(self.sigma_s_prime) / self.sigma_t_prime

    @property
    def sigma_tr(self) -> np.ndarray:
        """Effective transport coefficient sqrt(3 sigma_a sigma_t'), 1/mm: (C,)."""
        return np.sqrt(3 * np.array(self.sigma_a) * self.sigma_t_prime)

    @property
    def mfp(self) -> np.ndarray:
        """Transport mean free path l = 1 / sigma_t', mm: (C,)."""
        return 1 / self.sigma_t_prime

    @property
    def dmfp(self) -> np.ndarray:
        """Diffuse mean free path 1 / sigma_tr, mm; infinite where nothing absorbs: (C,)."""
        with np.errstate(divide="ignore"):
            return 1 / self.sigma_tr


@dataclass(frozen=True)
class Layer:
    """A medium of finite or infinite thickness, mm."""

    medium: Medium
    thickness_mm: float = math.inf

    def __post_init__(self):
        if not isinstance(self.thickness_mm, (int, float, np.number)) or not self.thickness_mm > 0:
            raise InputError(f"thickness is {self.thickness_mm!r}; expected more than 0 mm")


@dataclass(frozen=True)
class Stack:
    """Plane layers from the lit face down, between two clear half-spaces.

    n_above, n_below: indices outside. roughness: Beckmann slope m of the lit face, 0 (smooth) to 1.
    """

    layers: tuple[Layer, ...]
    n_above: float = 1.0
    n_below: float = 1.0
    roughness: float = 0.0
    name: str = ""

    def __post_init__(self):
        object.__setattr__(self, "layers", tuple(self.layers))
        if not self.layers:
            raise InputError("there is no layer; expected one or more")
        if len({layer.medium.channels for layer in self.layers}) != 1:
            raise InputError(
                "the layers differ in their number of channels; expected as many in each"
            )
        if any(math.isinf(layer.thickness_mm) for layer in self.layers[:-1]):
            raise InputError(
                "a layer above another one is infinitely thick; expected a thickness in mm "
                "for all but the last"
            )
        _index("n_above", self.n_above)
        _index("n_below", self.n_below)
        if not isinstance(self.roughness, (int, float)) or not 0 <= self.roughness <= 1:
            raise InputError(
                f"roughness is {self.roughness!r}; expected a Beckmann slope of 0 to 1"
            )

    @classmethod
    def of(cls, medium: Medium, thickness_mm: float = math.inf, **rest) -> Stack:
        """One layer of one medium."""
        return cls((Layer(medium, thickness_mm),), name=rest.pop("name", medium.name), **rest)

    @property
    def channels(self) -> int:
        return self.layers[0].medium.channels

    @property
    def thickness_mm(self) -> float:
        return sum(layer.thickness_mm for layer in self.layers)

    def flipped(self) -> Stack:
        """The same layers, lit from the other side."""
        return Stack(self.layers[::-1], self.n_below, self.n_above, name=self.name)


def reach(mfp, dmfp, thickness_mm: float) -> float:
    """A radius that holds all but a thousandth of what a layer reflects, mm: 12 diffuse mean free
    paths (or thicknesses of all layers, where that is less), and 30 to 300 mean free paths.

    mfp, dmfp: (C,) or one, reduced and diffuse mean free paths in mm.
    """
    mfp = np.asarray(mfp, float)
    return float(np.clip(12 * np.minimum(dmfp, thickness_mm), 30 * mfp, 300 * mfp).max())


def reach_mm(stack: Stack, channel: int | None = None) -> float:
    """The `reach` of a stack's most far-reaching layer and channel."""
    pick = slice(None) if channel is None else slice(channel, channel + 1)
    media = [layer.medium for layer in stack.layers]
    return max(reach(m.mfp[pick], m.dmfp[pick], stack.thickness_mm) for m in media)


def finest_mm(stack: Stack, channel: int | None = None) -> float:
    """The shortest mean free path."""
    pick = slice(None) if channel is None else slice(channel, channel + 1)
    return float(min(layer.medium.mfp[pick].min() for layer in stack.layers))


def fit_radii(stack: Stack, channel: int, points: int = 400) -> np.ndarray:
    """Radii for fits: logarithmic from a hundredth of a mean free path to the reach."""
    return np.geomspace(finest_mm(stack, channel) / 100, reach_mm(stack, channel), points)


def sigma_a_from_index(imaginary, wavelength_nm) -> np.ndarray:
    """Absorption, 1/mm, of a complex index of refraction: sigma_a = 4 pi Im(eta) / lambda (Rohat,
    sec. 4.2.1).
    """
    imaginary, wavelength_nm = (
        np.asarray(imaginary, dtype=float),
        np.asarray(wavelength_nm, dtype=float),
    )
    if not (np.isfinite(imaginary).all() and (imaginary >= 0).all()):
        raise InputError(f"imaginary index is {imaginary}; expected numbers of 0 or more")
    if not (np.isfinite(wavelength_nm).all() and (wavelength_nm > 0).all()):
        raise InputError(f"wavelength is {wavelength_nm}; expected more than 0 nm")
    return 4 * np.pi * imaginary / (wavelength_nm * 1e-6)


# Rohat, tables 4.2 and 4.3: marble's complex index at three wavelengths.
MARBLE_IMAGINARY_INDEX = (1.16979e-7, 1.79447e-7, 2.40125e-7)
MARBLE_WAVELENGTH_NM = (700.0, 550.0, 425.0)

_JENSEN = "measured: Jensen et al. 2001, fig. 5"
_JENSEN_APPLE = _JENSEN + "; Rohat table 4.1 prints sigma_a blue as 0.46, a lost zero"
_BY_EYE = "chosen by eye: no measurement is published"
_DONNER = (
    "Donner and Jensen 2005, three-layer skin (after Tuchin 2000), on which d'Eon and "
    "Luebke 2007 build their six Gaussians"
)


def _jensen(name, sigma_s_prime, sigma_a, eta=1.3, source=_JENSEN) -> Medium:
    return Medium(sigma_a, sigma_s_prime, eta, name=name, source=source)


MEDIA: dict[str, Medium] = {
    medium.name: medium
    for medium in (
        _jensen("apple", (2.29, 2.39, 1.97), (0.0030, 0.0034, 0.046), source=_JENSEN_APPLE),
        _jensen("chicken1", (0.15, 0.21, 0.38), (0.015, 0.077, 0.19)),
        _jensen("chicken2", (0.19, 0.25, 0.32), (0.018, 0.088, 0.20)),
        _jensen("cream", (7.38, 5.47, 3.15), (0.0002, 0.0028, 0.0163)),
        _jensen("ketchup", (0.18, 0.07, 0.03), (0.061, 0.97, 1.45)),
        _jensen("marble", (2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071), eta=1.5),
        _jensen("potato", (0.68, 0.70, 0.55), (0.0024, 0.0090, 0.12)),
        _jensen("skimmilk", (0.70, 1.22, 1.90), (0.0014, 0.0025, 0.0142)),
        _jensen("skin1", (0.74, 0.88, 1.01), (0.032, 0.17, 0.48)),
        _jensen("skin2", (1.09, 1.59, 1.79), (0.013, 0.070, 0.145)),
        _jensen("spectralon", (11.6, 20.4, 14.9), (0.0, 0.0, 0.0)),
        _jensen("wholemilk", (2.55, 3.21, 3.77), (0.0011, 0.0024, 0.014)),
        Medium(
            (0.05, 0.006, 0.035),
            (1.1, 1.3, 1.2),
            1.66,
            name="green_jade",
            source=_BY_EYE + "; Rohat figs. 6.3, 6.8 show it; index of jadeite",
        ),
        Medium(
            (0.03, 0.09, 0.28),
            (1.5, 1.7, 1.9),
            1.35,
            name="chocolate_milk",
            source=_BY_EYE + "; Rohat fig. A.10 shows it",
        ),
        Medium((0.21, 0.21, 0.50), (4.8, 6.0, 6.5), 1.4, name="epidermis", source=_DONNER),
        Medium((0.016, 0.019, 0.030), (3.2, 4.0, 4.6), 1.4, name="upper_dermis", source=_DONNER),
        Medium((0.0085, 0.10, 2.5), (0.45, 0.47, 0.48), 1.4, name="bloody_dermis", source=_DONNER),
    )
}

# The thicknesses and the common index are this project's choice, not read in the paper: each layer
# is thicker than a mean free path, without which the multipole's first source would lie outside of
# its own layer.
SKIN_THREE_LAYERS = Stack(
    (
        Layer(MEDIA["epidermis"], 0.25),
        Layer(MEDIA["upper_dermis"], 1.0),
        Layer(MEDIA["bloody_dermis"]),
    ),
    name="skin_three_layers",
)

STACKS: dict[str, Stack] = {
    **{name: Stack.of(medium) for name, medium in MEDIA.items()},
    SKIN_THREE_LAYERS.name: SKIN_THREE_LAYERS,
}


def preset(name: str) -> Stack:
    """A preset by its name; letter case and hyphens do not matter."""
    stack = STACKS.get(name.lower().replace("-", "_").replace(" ", "_"))
    if stack is None:
        raise InputError(f"no medium {name!r}; expected one of {', '.join(STACKS)}")
    return stack
