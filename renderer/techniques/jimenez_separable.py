"""Separable subsurface scattering.

Jimenez, Zsolnai, Jarabo, Freude, Auzinger, Wu, von der Pahlen, Wimmer and Gutierrez 2015, Computer
Graphics Forum 34(6), doi:10.1111/cgf.12529. One kernel, two passes; taps follow the surface; the
near taps are rotated by a per-pixel angle that both passes share.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.optics.curve import Curve
from renderer.optics.separable import demo_kernel, tap_edges, tap_offsets
from renderer.parameters import parameter
from renderer.techniques.base import odd
from renderer.techniques.screen import Canvas, ScreenTechnique

MOST_TAPS = 41
REACH_SHARE = 0.993  # of the widest channel's light: 6 mm for d'Eon and Luebke's skin


@dataclass(frozen=True)
class JimenezSeparable(ScreenTechnique):
    """The 2015 filter.

    kernel "preintegrated": the paper's analytic pre-integration, of the medium's own curve;
    "published": the artist's kernel of the published code, whatever the medium. follow "plane":
    taps keep their millimetres on a tilted surface and give way where depth leaves its plane;
    "published": where depth leaves that of the pixel, as in the code.
    """

    taps: int = parameter(
        25, unit="taps a pass", low=3, high=MOST_TAPS, source="published code: 11, 17 or 25"
    )
    kernel: str = parameter(
        "preintegrated",
        choices=("preintegrated", "published"),
        source="Jimenez 2015, sec. 5.1 and code",
    )
    reach_mm: float | None = parameter(
        (None, 6.0),
        unit="mm",
        low=0.1,
        high=500.0,
        source="where it is not given, what holds 99.3 % of the light",
        optional=True,
    )
    scale: float = parameter(
        1.0,
        unit="mm of skin per mm of kernel",
        low=0.01,
        high=20.0,
        source="sssWidth of the code, in physical units",
    )
    follow: str = parameter("plane", choices=("plane", "published"), source="published code")
    follow_surface_mm: float = parameter(
        5.0,
        unit="mm",
        low=0.01,
        high=1000.0,
        source="code: saturate(300 dist sssWidth |dz|) is 1 at about 5 mm",
    )
    near_share: float = parameter(
        0.1,
        unit="of the kernel's width",
        low=0.0,
        high=1.0,
        source="Jimenez 2015, sec. 6: 10 %, 30 % in extreme close-up",
    )

    name: ClassVar[str] = "jimenez_separable"
    title: ClassVar[str] = "Separable"
    paper: ClassVar[str] = "Jimenez et al. 2015, doi:10.1111/cgf.12529"

    def __post_init__(self) -> None:
        super().__post_init__()
        odd(self.where("taps"), self.taps)

    def kernel_table(self, curve: Curve) -> tuple[np.ndarray, np.ndarray]:
        """Offsets (taps,) mm and weights (taps, 3) that sum to 1 per channel."""
        if self.kernel == "published":
            return demo_kernel(self.taps)
        reach = self.reach_mm
        if reach is None:
            quantiles = [curve._quantiles(c) for c in range(curve.channels)]
            reach = max(float(np.interp(REACH_SHARE, *quantile)) for quantile in quantiles)
        offsets = tap_offsets(self.taps, reach)
        edges = np.clip(tap_edges(offsets), -1e6, 1e6)
        return offsets, curve.line_integral(edges[:-1], edges[1:])

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        """Each tap stands for its interval: rotation and bilinear texels spread it so."""
        offsets, weights = self.kernel_table(curve)
        edges = tap_edges(offsets)
        edges[0], edges[-1] = 2 * offsets[0] - edges[1], 2 * offsets[-1] - edges[-2]
        low, high = edges[:-1] * self.scale, edges[1:] * self.scale
        x = np.asarray(x_mm, float)[:, None]
        return np.clip((-x - low) / (high - low), 0, 1) @ weights

    def support_mm(self, curve: Curve) -> float:
        """Of the second pass, and of the first one's rotated taps."""
        offsets, _ = self.kernel_table(curve)
        return self.scale * float(np.abs(offsets).max() + self.near_share * np.ptp(offsets))

    def self_check(self, curve: Curve) -> None:
        offsets, weights = self.kernel_table(curve)
        assert np.allclose(weights.sum(axis=0), 1, atol=1e-9) and np.isfinite(weights).all()
        assert np.allclose(weights, weights[::-1]) and np.allclose(offsets, -offsets[::-1])

    def passes(self, canvas: Canvas) -> None:
        inputs = canvas.inputs
        offsets, weights = self.kernel_table(inputs.curve)
        common = {
            "kernel": np.column_stack([weights, offsets * self.scale]),
            "follow_surface_mm": self.follow_surface_mm,
            "near_mm": self.near_share * np.ptp(offsets) * self.scale,
            "taps": self.taps,
            "plane": int(self.follow == "plane"),
        }
        row = canvas.target()
        defines = {"TAPS": self.taps}
        canvas.draw(row, self.file(), defines, source=inputs.irradiance, axis=(1.0, 0.0), **common)
        canvas.draw(
            canvas.result,
            self.file(),
            defines,
            source=row.textures[0],
            axis=(0.0, 1.0),
            **common,
        )
