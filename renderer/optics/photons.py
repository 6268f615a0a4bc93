"""Monte Carlo as one of the profiles: every channel of a stack through montecarlo.simulate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.optics import fresnel
from renderer.optics.medium import finest_mm, reach_mm
from renderer.optics.model import Profile, radii


@dataclass(frozen=True)
class MonteCarlo(Profile):
    """Light straight down on a stack, photon by photon.

    Per unit of flux that has entered, like every other profile here: the simulation's curves are
    divided by 1 - F of the lit face. Between bin centres log R is interpolated; outside of them,
    and where no photon came, R is unknown (nan).
    """

    photons: int = 1_000_000
    seed: int = 0

    name: ClassVar[str] = "montecarlo"
    paper: ClassVar[str] = "Wang, Jacques and Zheng 1995"
    layers: ClassVar[int] = 0

    def entered(self) -> float:
        """1 - F: the share of the light that enters."""
        return 1 - fresnel.normal_reflectance(self.stack.layers[0].medium.eta / self.stack.n_above)

    def edges_mm(self) -> np.ndarray:
        """Rings in which photons are counted, from a fiftieth of a mean free path to the medium's
        reach: (121,).
        """
        return np.concatenate(
            [
                [0.0],
                np.geomspace(finest_mm(self.stack) / 50, reach_mm(self.stack), 120),
            ]
        )

    def results(self, progress: bool = True) -> list:
        """One simulation a channel (montecarlo.Result), cached by its parameters."""
        from renderer.optics import montecarlo

        stack, edges = self.stack, self.edges_mm()
        out = []
        for c in range(stack.channels):
            out.append(
                montecarlo.simulate(
                    montecarlo.layers_of(stack, c),
                    self.photons,
                    self.seed,
                    stack.n_above,
                    stack.n_below,
                    bins=edges,
                    progress=progress,
                )
            )
        return out

    def _curve(self, r_mm, which: str) -> np.ndarray:
        r, out = radii(r_mm)[:, 0], []
        for result in self.results():
            value = getattr(result, which)
            known = value > 0
            if known.sum() < 2:
                out.append(np.full(len(r), np.nan))
                continue
            with np.errstate(divide="ignore"):
                log = np.interp(
                    np.log(r),
                    np.log(result.r_mm[known]),
                    np.log(value[known]),
                    left=np.nan,
                    right=np.nan,
                )
            out.append(np.exp(log) / self.entered())
        return np.stack(out, axis=-1)

    def reflectance(self, r_mm):
        return self._curve(r_mm, "R")

    def transmittance(self, r_mm):
        if np.isinf(self.stack.thickness_mm):
            return np.zeros((len(radii(r_mm)), self.stack.channels))
        return self._curve(r_mm, "T")

    def totals(self):
        """Diffuse reflectance and transmittance, with the light that passes unscattered: (C,)
        each.
        """
        results = self.results()
        return tuple(
            np.array([getattr(r, name) for r in results]) / self.entered()
            for name in ("diffuse_reflectance", "transmittance")
        )
