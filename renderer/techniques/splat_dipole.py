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
from renderer.techniques.points import PointsTechnique, Tables, blurred, distances


@dataclass(frozen=True)
class SplatDipole(PointsTechnique):
    """Points over the mesh or a grid from each lamp, under any lights and environment.

    Light that comes through thin parts comes by the distance itself, so that no other translucency
    is added; the blur, which is for the face on which light enters, does not reach through them.
    """

    translucency: str = parameter(
        "none", choices=MODELS, source="Rohat 2012: distances go through the object"
    )

    name: ClassVar[str] = "splat_dipole"
    title: ClassVar[str] = "Dipole splats"
    paper: ClassVar[str] = "Rohat 2012; Shah et al. 2009, doi:10.1109/TVCG.2008.200"

    def tables(self, curve: Curve, medium: str | dict | None, spacing_mm: float) -> Tables:
        fit, reach = fits.dipole(curve), self.reach_mm(curve, spacing_mm)
        r = distances(reach)
        near = blurred(fit, self.blur_mm(curve, spacing_mm)).density(r)[None]
        far = fit.density(r)[None]
        near[:, -1] = far[:, -1] = 0
        whole = np.ones((1, near.shape[2]))
        return Tables(reach, near, whole, far, np.array([np.inf]), deep=False, mixed=False)

    def self_check(self, curve: Curve) -> None:
        fit = fits.dipole(curve)
        r = np.geomspace(1e-4, 40 * fit.virtual_mm.max() + 20 / fit.sigma_tr.min(), 200_000)
        total = np.trapezoid(fit.density(r) * 2 * np.pi * r[:, None], r, axis=0)
        assert np.allclose(total, 1, atol=2e-3)
        tables = self.tables(curve, None, self.spacing_mm)
        assert (np.diff(tables.near[0], axis=0) <= 1e-12).all()
