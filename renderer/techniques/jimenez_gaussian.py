"""Screen-space sum of Gaussians.

Jimenez, Sundstedt and Gutierrez 2009, "Screen-space perceptual rendering of human skin", ACM TAP
6(4), doi:10.1145/1609967.1609970. A sum of Gaussians, six in the paper (d'Eon and Luebke 2007); the
first is narrower than a pixel there and left unblurred; each other one blurs the one before by the
difference of variances, horizontally, then vertically, with seven taps whose spacing follows depth
and its derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.cascade import ADD, START, TAPS, SumOfGaussians
from renderer.techniques.screen import Canvas, ScreenTechnique


@dataclass(frozen=True)
class JimenezGaussian(SumOfGaussians, ScreenTechnique):
    """The 2009 filter.

    kernel "fitted": `terms` Gaussians nearest to the medium's curve; "published": d'Eon and
    Luebke's six, whatever the medium. alpha = 0 derives alpha from the camera, so that sigma keeps
    its millimetres; the paper's alpha = 11 is the same quantity (output pixels per mm of sigma at a
    depth of one metre) tuned for its camera. first "blurred": the narrowest Gaussian is as wide as
    it is; "published": it is the unblurred image. stretch "geometry": taps come closer by the true
    foreshortening of the surface; "published": by alpha / (depth + beta |d depth|) of eq. 3.
    depth_steps "leak": nothing but the stretch keeps light from crossing a step of depth, as in the
    paper; "follow": taps give way to the pixel where depth leaves its surface by follow_surface_mm,
    the remedy that the authors published with their later filters.
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
    depth_steps: str = parameter(
        "leak",
        choices=("leak", "follow"),
        source="Jimenez 2009: leak; Jimenez et al. 2012 to 2015, published code: follow",
    )
    follow_surface_mm: float = parameter(
        5.0,
        unit="mm",
        low=0.01,
        high=1000.0,
        source="code of 2012: saturate(300 dist sssWidth |dz|) is 1 at about 5 mm",
    )
    texturing: float = parameter(
        1.0,
        unit="of the albedo's exponent before scattering",
        low=0.0,
        high=1.0,
        source="published code of 2009: the albedo is in the light that is blurred",
    )

    name: ClassVar[str] = "jimenez_gaussian"
    title: ClassVar[str] = "Gaussian"
    paper: ClassVar[str] = "Jimenez et al. 2009, doi:10.1145/1609967.1609970"

    def support_mm(self, curve: Curve) -> float | None:
        if self.alpha:
            return None  # its widths are no millimetres
        blurs, _ = self.blurs(self.fit(curve))
        return self._reach_mm(blurs)

    def _reach_mm(self, blurs: list[tuple[float, Any]]) -> float:
        """How far blurs of a sigma in mm and a weight reach, one after the other."""
        _, spacing, _ = self.axis_taps()
        return len(TAPS) // 2 * spacing * sum(sigma for sigma, _ in blurs)

    def passes(self, canvas: Canvas) -> None:
        inputs = canvas.inputs
        blurs, unblurred = self.blurs(self.fit(inputs.curve))
        taps, _, _ = self.axis_taps()
        focal = inputs.pixels_per_mm / inputs.supersample  # output pixels at unit distance
        common = {
            "taps": taps,
            "reach": len(taps) // 2,
            "alpha": (self.alpha or focal / 1000.0) * inputs.supersample,
            "focal": focal,
            "published": int(self.stretch == "published"),
            "beta": self.beta,
            "gradient_limit": self.gradient_limit,
            "supersample": float(inputs.supersample),
        }
        follows = self.depth_steps == "follow"
        if follows:
            common["follow"] = 1 / self.follow_surface_mm
        blur = (self.file(), {"FOLLOW": int(follows)})
        row, blurred = canvas.target(), canvas.target()
        start = {"light": inputs.irradiance, "unblurred": unblurred, "samples": self.reads()}
        canvas.filter(canvas.result, START, **start)
        source = inputs.irradiance
        reach_mm = self._reach_mm(blurs)
        for sigma, weight in blurs:
            own = {**common, "sigma": sigma, "reach_mm": reach_mm}
            canvas.filter(row, *blur, source=source, axis=(1.0, 0.0), **own)
            reach_mm = own["reach_mm"] = max(reach_mm - self._reach_mm([(sigma, weight)]), 0.0)
            canvas.filter(blurred, *blur, source=row.textures[0], axis=(0.0, 1.0), **own)
            source = blurred.textures[0]
            canvas.filter(canvas.result, ADD, blend="add", source=source, weight=weight)
