"""No subsurface scattering: the surface's own irradiance, and no translucency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.optics.curve import Curve
from renderer.optics.transmittance import MODELS
from renderer.parameters import parameter
from renderer.techniques.screen import ScreenTechnique


@dataclass(frozen=True)
class NoScattering(ScreenTechnique):
    """Lambert's law alone; one sample a pixel."""

    name: ClassVar[str] = "none"
    title: ClassVar[str] = "No SSS"
    paper: ClassVar[str] = "Lambert 1760, Photometria"
    translucency: str = parameter(
        "none", choices=MODELS, source="light that comes through is scattered light"
    )

    def support_mm(self, curve: Curve) -> float:
        return 0.0

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return np.repeat((np.asarray(x_mm)[:, None] < 0) * 1.0, curve.channels, axis=1)
