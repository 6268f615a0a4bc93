"""The literal table of profile models, by the names that commands and files use."""

from __future__ import annotations

import numpy as np

from renderer.errors import InputError
from renderer.medium import Stack
from renderer.profiles.burley import Burley
from renderer.profiles.dipole import BetterDipole, Dipole
from renderer.profiles.gaussians import GaussianSum
from renderer.profiles.layered import Layered
from renderer.profiles.model import Profile
from renderer.profiles.multipole import Multipole
from renderer.profiles.photons import MonteCarlo
from renderer.profiles.quantized_diffusion import QuantizedDiffusion

MODELS: dict[str, type[Profile]] = {
    model.name: model
    for model in (
        Dipole,
        BetterDipole,
        Multipole,
        Layered,
        QuantizedDiffusion,
        Burley,
        GaussianSum,
        MonteCarlo,
    )
}


def make(name: str, stack: Stack, **parameters) -> Profile:
    """A model by its name."""
    if name not in MODELS:
        raise InputError(f"no model {name!r}; expected one of {', '.join(MODELS)}")
    return MODELS[name](stack, **parameters)


def reach_mm(stack: Stack, channel: int | None = None) -> float:
    """A radius that holds all but a thousandth of what a medium reflects: 12 diffuse mean free
    paths of its most far-reaching layer and channel, and between 30 and 300 mean free paths.
    """
    pick = slice(None) if channel is None else slice(channel, channel + 1)
    reach = 0.0
    for layer in stack.layers:
        mfp, dmfp = layer.medium.mfp[pick], layer.medium.dmfp[pick]
        reach = max(reach, float(np.clip(12 * dmfp, 30 * mfp, 300 * mfp).max()))
    return reach


def finest_mm(stack: Stack, channel: int | None = None) -> float:
    """The shortest mean free path."""
    pick = slice(None) if channel is None else slice(channel, channel + 1)
    return float(min(layer.medium.mfp[pick].min() for layer in stack.layers))


def fit_radii(stack: Stack, channel: int, points: int = 400) -> np.ndarray:
    """Radii for fits: logarithmic from a hundredth of a mean free path to the reach."""
    return np.geomspace(finest_mm(stack, channel) / 100, reach_mm(stack, channel), points)
