"""Separable subsurface scattering.

Jimenez, Zsolnai, Jarabo, Freude, Auzinger, Wu, von der Pahlen, Wimmer and Gutierrez 2015, Computer
Graphics Forum 34(6), doi:10.1111/cgf.12529. One kernel, two passes; taps follow the surface; the
near taps are rotated by a per-pixel angle that both passes share.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics import fits, gaussians, separable
from renderer.optics.curve import Curve
from renderer.optics.separable import demo_kernel, tap_edges, tap_offsets
from renderer.parameters import parameter
from renderer.techniques.base import odd
from renderer.techniques.rotated import RotatedTechnique
from renderer.techniques.screen import Canvas

MOST_TAPS = 41
KERNELS = ("preintegrated", "guided", "svd", "artist", "published")
GRID = 100  # steps of the half-line on which svd and guided kernels are found
REACH_SHARE = 0.993  # of the widest channel's light: 6 mm for d'Eon and Luebke's skin


@lru_cache(maxsize=32)
def kernels(curve: Curve, kind: str, guide_k: float) -> list[separable.Kernel]:
    """The kernel of each channel by one of "guided", "svd" and "artist", of the six Gaussians
    nearest to the curve (whose own rings are too noisy near the middle to be decomposed).
    """
    fit = fits.gaussian_sum(curve, 6)
    made = []
    for c in range(curve.channels):
        share, radius = curve._quantiles(c)
        reach = float(np.interp(REACH_SHARE, share, radius))

        def profile(r: np.ndarray, c: int = c) -> np.ndarray:
            return gaussians.reflectance(r, fit.variance_mm2, fit.weights[:, c])

        if kind == "guided":
            made.append(separable.guided(profile, reach, guide_k, GRID))
        elif kind == "svd":
            made.append(separable.svd(profile, reach, GRID))
        else:
            made.append(separable.artist_fit(profile, reach, GRID)[0])
    return made


@dataclass(frozen=True)
class JimenezSeparable(RotatedTechnique):
    """The 2015 filter.

    kernel "preintegrated": the paper's analytic pre-integration, of the medium's own curve;
    "guided": its optimised one, which cares for the tail by guide_k; "svd": the rank-one part of
    the decomposition, whose lost energy is given back over all taps; "artist": two Gaussians a
    channel, fitted unless all of near_mm, far_mm and near_weight are given; "published": the kernel
    of the published code, whatever the medium. follow "plane":
    taps keep their millimetres on a tilted surface and give way where depth leaves its plane;
    "published": where depth leaves that of the pixel, as in the code.
    """

    taps: int = parameter(
        25, unit="taps a pass", low=3, high=MOST_TAPS, source="published code: 11, 17 or 25"
    )
    kernel: str = parameter(
        "preintegrated", choices=KERNELS, source="Jimenez 2015, sec. 4 and 5, and published code"
    )
    guide_k: float = parameter(
        2.0, unit="power of r", low=0.0, high=8.0, source="Jimenez 2015, eq. 6: 2; 0: the peak"
    )
    near_mm: tuple[float, float, float] | None = parameter(
        (None, (0.1, 0.1, 0.1)),
        unit="mm, sigma per channel",
        low=1e-3,
        high=100.0,
        source="the artist's choice",
        optional=True,
    )
    far_mm: tuple[float, float, float] | None = parameter(
        (None, (1.0, 1.0, 1.0)),
        unit="mm, sigma per channel",
        low=1e-3,
        high=100.0,
        source="the artist's choice",
        optional=True,
    )
    near_weight: tuple[float, float, float] | None = parameter(
        (None, (0.5, 0.5, 0.5)),
        unit="of the near Gaussian",
        low=0.0,
        high=1.0,
        source="the artist's choice",
        optional=True,
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
    texturing: float = parameter(
        1.0,
        unit="of the albedo's exponent before scattering",
        low=0.0,
        high=1.0,
        source="published code of 2012: the albedo is in the light that is blurred",
    )

    name: ClassVar[str] = "jimenez_separable"
    title: ClassVar[str] = "Separable"
    paper: ClassVar[str] = "Jimenez et al. 2015, doi:10.1111/cgf.12529"

    def __post_init__(self) -> None:
        super().__post_init__()
        odd(self.where("taps"), self.taps)
        given = [value is not None for value in (self.near_mm, self.far_mm, self.near_weight)]
        if any(given) and not (all(given) and self.kernel == "artist"):
            raise InputError(
                f"{self.name} has some of near_mm, far_mm and near_weight; expected all three, and "
                "kernel = 'artist'"
            )

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
        if self.kernel == "preintegrated":
            return offsets, curve.line_integral(edges[:-1], edges[1:])
        if self.near_mm is not None:
            weights = np.empty((self.taps, len(self.near_mm)))
            for c, (near, far, w) in enumerate(
                zip(self.near_mm, self.far_mm, self.near_weight, strict=True)
            ):
                pair = (np.array([near, far]) ** 2, np.array([[w], [1 - w]]))
                weights[:, c] = gaussians.line_integral(edges[:-1], edges[1:], *pair)[:, 0]
            return offsets, weights
        made = kernels(curve, self.kernel, self.guide_k)
        return offsets, np.stack([kernel.taps(offsets) for kernel in made], axis=1)

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
        canvas.filter(
            row,
            self.file(),
            defines,
            reach_mm=self.support_mm(inputs.curve),
            source=inputs.irradiance,
            axis=(1.0, 0.0),
            **common,
        )
        canvas.filter(
            canvas.result,
            self.file(),
            defines,
            source=row.textures[0],
            axis=(0.0, 1.0),
            **common,
        )
