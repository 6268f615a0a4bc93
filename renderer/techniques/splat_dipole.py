"""Dipole splats of points on the surface.

Rohat 2012, "Real-time rendering of translucent materials", ch. 5, after Shah, Konttinen and
Pattanaik 2009, doi:10.1109/TVCG.2008.200: R_d of Jensen et al. 2001 as a texture of the distance
between a point and a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.optics import fits
from renderer.optics.curve import Curve
from renderer.optics.transmittance import MODELS
from renderer.parameters import parameter
from renderer.techniques.points import PointsTechnique


@dataclass(frozen=True)
class SplatDipole(PointsTechnique):
    """Points over the mesh (ch. 5.3), under any lights and environment.

    The dipole is fitted to the medium's curve and normalised: the albedo is the surface's own.
    radius "area": a splat holds `share` of the light; "published": of the integral over r alone,
    which is less of the light (sec. 4.3). Light that comes through thin parts comes by the distance
    itself, so that no other translucency is added.
    """

    translucency: str = parameter(
        "none", choices=MODELS, source="Rohat 2012: distances go through the object"
    )
    radius: str = parameter(
        "area", choices=("area", "published"), source="Rohat 2012, sec. 4.3: over r alone"
    )

    name: ClassVar[str] = "splat_dipole"
    title: ClassVar[str] = "Dipole splats"
    paper: ClassVar[str] = "Rohat 2012; Shah et al. 2009, doi:10.1109/TVCG.2008.200"

    def dipole(self, curve: Curve) -> fits.DipoleFit:
        """The dipole for a curve, no shallower than the spacing's blur."""
        fit = fits.dipole(curve)
        least = self.blur * self.spacing_mm
        real = np.maximum(fit.real_mm, least)
        virtual = fit.virtual_mm + (real - fit.real_mm)
        return fits.DipoleFit(real, virtual, fit.sigma_tr, fit.error)

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return self.dipole(curve).edge(x_mm)

    def profile(self, curve: Curve, r_mm: np.ndarray) -> np.ndarray:
        return self.dipole(curve).density(r_mm)

    def reach_mm(self, curve: Curve) -> float:
        fit = self.dipole(curve)
        if self.radius == "area":
            return float(fit.radius(self.share).max())
        r = np.geomspace(1e-3, fit.radius(0.9999).max(), 4000)
        inside = np.cumsum(fit.density(r) * np.gradient(r)[:, None], axis=0)
        inside /= inside[-1]
        return max(float(np.interp(self.share, inside[:, c], r)) for c in range(inside.shape[1]))

    def self_check(self, curve: Curve) -> None:
        fit = self.dipole(curve)
        r = np.geomspace(1e-4, 40 * fit.virtual_mm.max() + 20 / fit.sigma_tr.min(), 200_000)
        total = np.trapezoid(fit.density(r) * 2 * np.pi * r[:, None], r, axis=0)
        assert np.allclose(total, 1, atol=2e-3)
        assert (np.diff(self.table(curve), axis=0) <= 1e-12).all()
