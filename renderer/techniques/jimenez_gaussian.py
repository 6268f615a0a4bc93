"""Screen-space sum of Gaussians.

Jimenez, Sundstedt and Gutierrez 2009, "Screen-space perceptual rendering of human skin", ACM TAP
6(4), doi:10.1145/1609967.1609970. Six Gaussians (d'Eon and Luebke 2007); the first is narrower than
a pixel and is the unblurred image; each other one blurs the one before by the difference of
variances, horizontally, then vertically, with seven taps whose spacing is sigma * alpha / (depth +
beta |depth derivative|).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from OpenGL import GL

from renderer import gl
from renderer.profiles import gaussians
from renderer.techniques.base import Inputs, Scattered, Technique, output_formats, parameter

TAPS = np.array(
    [0.006, 0.061, 0.242, 0.382, 0.242, 0.061, 0.006]
)  # at -3..3 sigma; the paper's shader
TAPS_VARIANCE = float(
    (TAPS * np.arange(-3, 4) ** 2).sum() / TAPS.sum()
)  # 1.079 sigma^2: divided out below


@dataclass(frozen=True)
class JimenezGaussian(Technique):
    """The 2009 filter.

    alpha = 0 derives alpha from the camera, so that sigma keeps its millimetres; the paper's alpha
    = 11 is the same quantity (output pixels per mm of sigma at a depth of one metre) tuned for its
    camera.
    """

    alpha: float = parameter(
        0.0,
        unit="px m/mm (0: from the camera)",
        low=0.0,
        high=200.0,
        source="Jimenez 2009, eq. 3; 11 there",
    )
    beta: float = parameter(800.0, unit="px", low=0.0, high=1e5, source="Jimenez 2009, eq. 3")
    gradient_limit: float = parameter(
        0.001, unit="m/px", low=0.0, high=1.0, source="published shader SSSSS.fx"
    )

    name: ClassVar[str] = "jimenez_gaussian"
    title: ClassVar[str] = "Gaussian"
    paper: ClassVar[str] = "Jimenez et al. 2009, doi:10.1145/1609967.1609970"

    def blurs(self) -> list[tuple[float, np.ndarray]]:
        """(incremental sigma in mm, weight (3,)) of the Gaussians after the first."""
        variance = gaussians.SKIN_VARIANCE_MM2
        sigma = np.sqrt(np.diff(variance) / TAPS_VARIANCE)
        return list(zip(sigma, gaussians.SKIN_WEIGHTS[1:], strict=True))

    def self_check(self) -> None:
        assert np.allclose(gaussians.SKIN_WEIGHTS.sum(axis=0), 1, atol=1e-9)
        reached = gaussians.SKIN_VARIANCE_MM2[0] + np.cumsum(
            [s**2 * TAPS_VARIANCE for s, _ in self.blurs()]
        )
        assert np.allclose(reached, gaussians.SKIN_VARIANCE_MM2[1:])
        assert np.allclose(TAPS, TAPS[::-1])

    def scatter(self, inputs: Inputs) -> Scattered:
        alpha = self.alpha or inputs.pixels_per_mm / inputs.supersample / 1000.0
        program = inputs.programs("techniques/jimenez_gaussian.glsl")
        ping, pong = (
            gl.Target(inputs.width, inputs.height, [GL.GL_RGBA32F, GL.GL_RGBA32F]) for _ in range(2)
        )
        total = gl.Target(inputs.width, inputs.height, output_formats())
        source, sum_so_far, blurs = inputs.irradiance, inputs.irradiance, self.blurs()
        common = {
            "irradiance": inputs.irradiance,
            "depth_normal": inputs.depth_normal,
            "taps": TAPS / TAPS.sum(),
            "reach": len(TAPS) // 2,
            "alpha": alpha * inputs.supersample,
            "beta": self.beta,
            "gradient_limit": self.gradient_limit,
            "supersample": float(inputs.supersample),
        }
        row = gl.Target(inputs.width, inputs.height, [GL.GL_RGBA32F])
        for k, (sigma, weight) in enumerate(blurs):
            last = k == len(blurs) - 1
            row.bind()
            program.use(
                source=source,
                sum_so_far=sum_so_far,
                sigma=sigma,
                axis=(1.0, 0.0),
                weight=(0.0, 0.0, 0.0),
                sum_scale=(0.0, 0.0, 0.0),
                samples=0.0,
                final=0,
                **common,
            )
            gl.draw_fullscreen(inputs.context)
            out = total if last else ping
            out.bind()
            first = gaussians.SKIN_WEIGHTS[0] if k == 0 else np.ones(3)
            program.use(
                source=row.textures[0],
                sum_so_far=sum_so_far,
                sigma=sigma,
                axis=(0.0, 1.0),
                weight=weight,
                sum_scale=first,
                samples=float(2 * len(TAPS) * len(blurs)),
                final=int(last),
                **common,
            )
            gl.draw_fullscreen(inputs.context)
            source, sum_so_far = ping.textures[0], ping.textures[1]
            ping, pong = pong, ping
        for target in (ping, pong, row):
            target.delete()
        return Scattered(total)
