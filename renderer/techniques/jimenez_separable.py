"""Separable subsurface scattering.

Jimenez, Zsolnai, Jarabo, Freude, Auzinger, Wu, von der Pahlen, Wimmer and Gutierrez 2015, Computer
Graphics Forum 34(6), doi:10.1111/cgf.12529. One kernel, two passes; taps follow the surface; the
near taps are rotated by a per-pixel angle that both passes share.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from OpenGL import GL

from renderer import gl
from renderer.errors import InputError
from renderer.profiles.separable import demo_kernel, preintegrated_kernel
from renderer.techniques.base import Inputs, Scattered, Technique, output_formats, parameter

MOST_TAPS = 41


@dataclass(frozen=True)
class JimenezSeparable(Technique):
    """kernel "preintegrated": the paper's analytic pre-integration of the same six Gaussians that
    jimenez_gaussian uses; "demo": the artist's kernel of the published code, in which the first
    Gaussian is the strength.
    """

    taps: int = parameter(
        25, unit="taps a pass", low=3, high=MOST_TAPS, source="published code: 11, 17 or 25"
    )
    kernel: str = parameter(
        "preintegrated",
        unit="",
        choices=("preintegrated", "demo"),
        source="Jimenez 2015, sec. 5.1 and code",
    )
    reach_mm: float = parameter(
        6.0, unit="mm", low=0.1, high=50.0, source="more than two sigma of the widest Gaussian"
    )
    scale: float = parameter(
        1.0,
        unit="mm of skin per mm of kernel",
        low=0.01,
        high=20.0,
        source="sssWidth of the code, in physical units",
    )
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

    def __post_init__(self):
        super().__post_init__()
        if self.taps % 2 == 0:
            raise InputError(f"{self.name}.taps is {self.taps}; expected an odd number")

    def kernel_table(self) -> tuple[np.ndarray, np.ndarray]:
        """Offsets (taps,) mm and weights (taps, 3) that sum to 1 per channel."""
        return (
            demo_kernel(self.taps)
            if self.kernel == "demo"
            else preintegrated_kernel(self.taps, self.reach_mm)
        )

    def self_check(self) -> None:
        offsets, weights = self.kernel_table()
        assert np.allclose(weights.sum(axis=0), 1, atol=1e-9) and np.isfinite(weights).all()
        assert np.allclose(weights, weights[::-1]) and np.allclose(offsets, -offsets[::-1])

    def scatter(self, inputs: Inputs) -> Scattered:
        offsets, weights = self.kernel_table()
        program = inputs.programs("techniques/jimenez_separable.glsl", {"TAPS": self.taps})
        near = self.near_share * np.ptp(offsets)
        common = {
            "irradiance": inputs.irradiance,
            "depth_normal": inputs.depth_normal,
            "pixels_per_mm": inputs.pixels_per_mm * self.scale,
            "kernel": np.column_stack([weights, offsets]),
            "follow_surface_mm": self.follow_surface_mm,
            "near_mm": near,
            "taps": self.taps,
        }
        row = gl.Target(inputs.width, inputs.height, [GL.GL_RGBA32F])
        total = gl.Target(inputs.width, inputs.height, output_formats())
        for target, source, axis in (
            (row, inputs.irradiance, (1.0, 0.0)),
            (total, row.textures[0], (0.0, 1.0)),
        ):
            target.bind()
            program.use(source=source, axis=axis, **common)
            gl.draw_fullscreen(inputs.context)
        row.delete()
        return Scattered(total)
