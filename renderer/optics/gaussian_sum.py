"""The profile of another model as a sum of Gaussians."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics import gaussians
from renderer.optics.burley import Burley
from renderer.optics.dipole import BetterDipole, Dipole
from renderer.optics.layered import Layered
from renderer.optics.medium import Stack, fit_radii
from renderer.optics.model import Profile, radii
from renderer.optics.multipole import Multipole
from renderer.optics.photons import MonteCarlo
from renderer.optics.quantized_diffusion import QuantizedDiffusion

SOURCES = {
    model.name: model
    for model in (Dipole, BetterDipole, Multipole, Layered, QuantizedDiffusion, Burley, MonteCarlo)
}


@dataclass(frozen=True)
class GaussianSum(Profile):
    """The profile of a model as a sum of `terms` Gaussians a channel, total kept.

    model: dipole (for a stack of several layers: layered).

    T(r) = R(sqrt(r^2 + thickness^2)), Jimenez et al. 2010. d'Eon and Luebke's published skin is
    SKIN_WEIGHTS, not a medium.
    """

    terms: int = 6
    model: str = "dipole"

    name: ClassVar[str] = "gaussian_sum"
    paper: ClassVar[str] = "d'Eon and Luebke 2007"
    layers: ClassVar[int] = 0
    knows_thickness: ClassVar[bool] = False
    knows_roughness: ClassVar[bool] = True

    def fits(self) -> list[gaussians.Fit]:
        """One fit a channel."""
        return _fits(self.stack, self.model, self.terms)

    def reflectance(self, r_mm):
        r = radii(r_mm)[:, 0]
        return np.stack([f.reflectance(r) for f in self.fits()], axis=-1)

    def transmittance(self, r_mm):
        if np.isinf(self.stack.thickness_mm):
            return np.zeros((len(radii(r_mm)), self.stack.channels))
        return self.reflectance(np.hypot(radii(r_mm)[:, 0], self.stack.thickness_mm))

    def totals(self):
        fits, d = self.fits(), np.array([self.stack.thickness_mm])
        through = [gaussians.transmittance(d, False, f.variance_mm2, f.weights)[0] for f in fits]
        return np.array([f.weights.sum() for f in fits]), np.array(through)


@lru_cache(maxsize=32)
def _fits(stack: Stack, model: str, terms: int) -> list[gaussians.Fit]:
    name = "layered" if model == "dipole" and len(stack.layers) > 1 else model
    if name not in SOURCES:
        raise InputError(f"no model {name!r}; expected one of {', '.join(SOURCES)}")
    source = SOURCES[name](stack)
    totals = source.totals()[0]
    out = []
    for channel in range(stack.channels):
        r = fit_radii(stack, channel)
        target = source.reflectance(r)[:, channel]
        out.append(gaussians.fit(r, target, terms, float(totals[channel])))
    return out
