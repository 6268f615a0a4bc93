"""The literal table of profile models, by the names that commands and files use."""

from __future__ import annotations

from renderer.errors import InputError
from renderer.optics.burley import Burley
from renderer.optics.dipole import BetterDipole, Dipole
from renderer.optics.gaussian_sum import GaussianSum
from renderer.optics.layered import Layered
from renderer.optics.medium import Stack
from renderer.optics.model import Profile
from renderer.optics.multipole import Multipole
from renderer.optics.photons import MonteCarlo
from renderer.optics.quantized_diffusion import QuantizedDiffusion

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
