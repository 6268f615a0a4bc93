"""Screen-space sum of Gaussians.

Jimenez, Sundstedt and Gutierrez 2009, "Screen-space perceptual rendering of human skin", ACM TAP
6(4), doi:10.1145/1609967.1609970. A sum of Gaussians, six in the paper (d'Eon and Luebke 2007); the
first is narrower than a pixel there and left unblurred; each other one blurs the one before by the
difference of variances, horizontally, then vertically, with seven taps whose spacing follows depth
and its derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.optics import fits
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.cascade import ADD, START, TAPS, TAPS_VARIANCE, steps
from renderer.techniques.screen import Canvas, ScreenTechnique


@dataclass(frozen=True)
class JimenezGaussian(ScreenTechnique):
    """The 2009 filter.

    kernel "fitted": `terms` Gaussians nearest to the medium's curve; "published": d'Eon and
    Luebke's six, whatever the medium. alpha = 0 derives alpha from the camera, so that sigma keeps
    its millimetres; the paper's alpha = 11 is the same quantity (output pixels per mm of sigma at a
    depth of one metre) tuned for its camera. first "blurred": the narrowest Gaussian is as wide as
    it is; "published": it is the unblurred image. stretch "geometry": taps come closer by the true
    foreshortening of the surface; "published": by alpha / (depth + beta |d depth|) of eq. 3.
    """

    kernel: str = parameter(
        "fitted", choices=("fitted", "published"), source="Jimenez 2009 takes d'Eon and Luebke's"
    )
    terms: int = parameter(6, unit="Gaussians", low=2, high=10, source="six in the paper")
    alpha: float = parameter(
        0.0,
        unit="px m/mm (0: from the camera)",
        low=0.0,
        high=200.0,
        source="Jimenez 2009, eq. 3; 11 there",
    )
    first: str = parameter(
        "blurred", choices=("blurred", "published"), source="Jimenez 2009, sec. 3: unblurred"
    )
    stretch: str = parameter(
        "geometry", choices=("geometry", "published"), source="Jimenez 2009, eq. 3"
    )
    beta: float = parameter(800.0, unit="px", low=0.0, high=1e5, source="Jimenez 2009, eq. 3")
    gradient_limit: float = parameter(
        0.001, unit="m/px", low=0.0, high=1.0, source="published shader SSSSS.fx"
    )

    name: ClassVar[str] = "jimenez_gaussian"
    title: ClassVar[str] = "Gaussian"
    paper: ClassVar[str] = "Jimenez et al. 2009, doi:10.1145/1609967.1609970"

    def fit(self, curve: Curve) -> fits.GaussianFit:
        """The Gaussians for a curve."""
        if self.kernel == "published":
            return fits.published_gaussians(curve)
        return fits.gaussian_sum(curve, self.terms)

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return self.fit(curve).edge(x_mm)

    def blurs(self, fit: fits.GaussianFit) -> list[tuple[float, np.ndarray]]:
        """(incremental sigma in mm, weight (3,)) of the Gaussians that are blurred."""
        all_of_them = steps(fit)
        return all_of_them if self.first == "blurred" else all_of_them[1:]

    def self_check(self, curve: Curve) -> None:
        fit = self.fit(curve)
        assert np.allclose(fit.weights.sum(axis=0), 1, atol=1e-9)
        variances = [s**2 * TAPS_VARIANCE for s, _ in self.blurs(fit)]
        skipped = 0.0 if self.first == "blurred" else fit.variance_mm2[0]
        assert np.allclose(skipped + np.cumsum(variances), fit.variance_mm2[-len(variances) :])
        assert np.allclose(TAPS, TAPS[::-1])

    def passes(self, canvas: Canvas) -> None:
        inputs = canvas.inputs
        fit = self.fit(inputs.curve)
        focal = inputs.pixels_per_mm / inputs.supersample  # output pixels at unit distance
        common = {
            "taps": TAPS / TAPS.sum(),
            "reach": len(TAPS) // 2,
            "alpha": (self.alpha or focal / 1000.0) * inputs.supersample,
            "focal": focal,
            "published": int(self.stretch == "published"),
            "beta": self.beta,
            "gradient_limit": self.gradient_limit,
            "supersample": float(inputs.supersample),
        }
        row, blurred = canvas.target(), canvas.target()
        blurs = self.blurs(fit)
        start = {
            "light": inputs.irradiance,
            "unblurred": np.zeros(3) if self.first == "blurred" else fit.weights[0],
            "samples": float(2 * len(TAPS) * len(blurs)),
        }
        canvas.draw(canvas.result, START, {}, **start)
        source = inputs.irradiance
        for sigma, weight in blurs:
            own = {**common, "sigma": sigma}
            canvas.draw(row, self.file(), {}, source=source, axis=(1.0, 0.0), **own)
            canvas.draw(blurred, self.file(), {}, source=row.textures[0], axis=(0.0, 1.0), **own)
            source = blurred.textures[0]
            canvas.draw(canvas.result, ADD, {}, blend="add", source=source, weight=weight)
