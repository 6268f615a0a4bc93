"""Golubev's filter with samples spent by local contrast.

Vuletic, master's thesis (the study's own technique), ch. 4: a base set of samples also measures the
contrast C = |L_in - L_out| / (L_in + L_out) of the irradiance between an inner disc and the ring
around it, per channel; where round(saturate(C + offset)) is 1 in any channel the extra samples are
taken too.

How the thesis's open points are settled: base and extra samples are together exactly golubev's set,
so that a pixel that takes both equals golubev but for rounding; the inner zone is r < R_max / 2
(areas 1 : 3), R_max the farthest base sample; round(0.5) is up; C = 0 where no light falls; a zone
without skin gives no contrast.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.techniques.base import Inputs, Scattered, output_formats, parameter
from renderer.techniques.golubev import Golubev, disc


@dataclass(frozen=True)
class GolubevPlus(Golubev):
    """12 base samples, 10 more where contrast is high."""

    base_samples: int = parameter(
        12, unit="of the samples", low=2, high=128, source="thesis, sec. 4.3"
    )
    offset: float = parameter(
        0.25,
        unit="contrast",
        low=0.0,
        high=0.5,
        source="thesis, eq. 4.2: active where C >= 0.5 - offset",
    )
    inner_radius: float = parameter(
        0.5,
        unit="of the farthest base sample",
        low=0.01,
        high=0.99,
        source="thesis, sec. 4.2: areas 1 : 3",
    )

    name: ClassVar[str] = "golubev_plus"
    title: ClassVar[str] = "Golubev Plus"
    paper: ClassVar[str] = "Vuletic, master's thesis, ch. 4"
    measures_contrast: ClassVar[bool] = True

    def __post_init__(self):
        super().__post_init__()
        if self.base_samples >= self.samples:
            raise InputError(
                f"{self.name}.base_samples is {self.base_samples}; expected fewer than "
                f"samples, {self.samples}"
            )

    def order(self) -> np.ndarray:
        """Indices of golubev's samples, the base ones (spread evenly over the radii) first."""
        base = np.floor(
            (np.arange(self.base_samples) + 0.5) * self.samples / self.base_samples
        ).astype(int)
        return np.concatenate([base, np.setdiff1d(np.arange(self.samples), base)])

    def self_check(self) -> None:
        super().self_check()
        order = self.order()
        assert (
            sorted(order) == list(range(self.samples))
            and len(set(order[: self.base_samples])) == self.base_samples
        )

    def scatter(self, inputs: Inputs) -> Scattered:
        table = disc(self.samples, float(self.distances().max()))[self.order()]
        program = inputs.programs("techniques/golubev_plus.glsl", {"SAMPLES": self.samples})
        target = gl.Target(inputs.width, inputs.height, output_formats())
        target.bind()
        program.use(
            samples=table,
            base=self.base_samples,
            threshold=0.5 - self.offset,
            inner_mm=self.inner_radius * table[: self.base_samples, 2].max(),
            **self.uniforms(inputs),
        )
        gl.draw_fullscreen(inputs.context)
        return Scattered(target)
