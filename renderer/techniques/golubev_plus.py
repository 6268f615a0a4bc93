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
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.base import Inputs
from renderer.techniques.golubev import Golubev


@dataclass(frozen=True)
class GolubevPlus(Golubev):
    """12 base samples, 10 more where contrast is high."""

    base_samples: int = parameter(
        12, unit="of the samples", low=2, high=256, source="thesis, sec. 4.3"
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

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base_samples >= self.samples:
            raise InputError(
                f"{self.name}.base_samples is {self.base_samples}; expected fewer than samples, "
                f"{self.samples}"
            )

    def order(self) -> np.ndarray:
        """Indices of golubev's samples, the base ones (spread evenly over the radii) first."""
        base = np.floor(
            (np.arange(self.base_samples) + 0.5) * self.samples / self.base_samples
        ).astype(int)
        return np.concatenate([base, np.setdiff1d(np.arange(self.samples), base)])

    def table(self, curve: Curve) -> np.ndarray:
        return super().table(curve)[self.order()]

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        shared = super().uniforms(inputs)
        farthest = shared["samples"][: self.base_samples, 2].max()
        own = {
            "base": self.base_samples,
            "threshold": 0.5 - self.offset,
            "inner_mm": self.inner_radius * farthest,
        }
        return {**shared, **own}

    def self_check(self, curve: Curve) -> None:
        super().self_check(curve)
        order = self.order()
        assert sorted(order) == list(range(self.samples))
        assert len(set(order[: self.base_samples])) == self.base_samples
