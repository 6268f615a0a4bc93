"""Samples by local contrast: an extension of any filter of one pass that takes a set of samples.

Vuletic, master's thesis (the study's own technique), ch. 4: a base set of samples also measures the
contrast C = |L_in - L_out| / (L_in + L_out) of the irradiance between an inner disc and the ring
around it, per channel; where round(saturate(C + offset)) is 1 in any channel an extra set of
samples is taken too, and both sums are divided once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics.curve import Curve
from renderer.parameters import Parameters, parameter
from renderer.techniques.base import Inputs

#: Most extra samples where each number of them has a set of its own: those are n (n + 1) / 2 rows.
MOST_SETS = 30


def halves(count: int) -> np.ndarray:
    """0 to count - 1 so ordered that any first few are spread evenly (van der Corput): (count,)."""
    bits = max(count - 1, 1).bit_length()
    reversed_bits = [int(f"{k:0{bits}b}"[::-1], 2) for k in range(2**bits)]
    return np.array([k for k in reversed_bits if k < count], dtype=int)


@dataclass(frozen=True)
class ByContrast(Parameters):
    """Put before a technique among the bases of a class: `class GolubevPlus(ByContrast, Golubev)`.
    It has no other fields than its own, so that all defaults are the technique's.

    The technique has `samples`, the most that a pixel takes; `sample_set(curve, count, first)`,
    rows (count, 4) of samples whose column 2 is the radius in mm; a uniform `samples`; and a shader
    of Pixel, Sum (weight and light), begin, take and resolve, which shaders/contrast.glsl follows
    (see golubev_plus.glsl).

    sets "separate": the extra samples are a set of their own, made as the base set is (sec. 4.2),
    whose angles go on where those of the base set end; "nested": base and extra samples are
    together the technique's own set, the base ones spread evenly over it, so that a pixel that
    takes all is as without contrast. levels "two": all extra samples or none (eq. 4.2);
    "continuous": as many as contrast asks for, half of them where "two" begins to take them
    (ch. 6). contrast_exponent: contrast is raised to it first (ch. 6: a remap that is not linear).

    What the thesis leaves open: the inner zone is r < inner_radius R_max (areas 1 : 3), R_max the
    farthest base sample; round(0.5) is up; C = 0 where no light falls, or a zone has no skin.
    """

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
    sets: str = parameter(
        "separate", choices=("separate", "nested"), source="thesis, sec. 4.2: separate"
    )
    levels: str = parameter(
        "two", choices=("two", "continuous"), source="thesis, sec. 4.2: two; ch. 6: continuous"
    )
    contrast_exponent: float = parameter(
        1.0, unit="of the contrast", low=0.1, high=10.0, source="thesis, sec. 4.2: 1; ch. 6: others"
    )

    measures_contrast: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base_samples >= self.samples:
            raise InputError(
                f"{self.name}.base_samples is {self.base_samples}; expected fewer than samples, "
                f"{self.samples}"
            )
        if self._own_sets and self.extra_samples > MOST_SETS:
            raise InputError(
                f"{self.name} has {self.extra_samples} extra samples in a set of their own for "
                f"every number of them; expected at most {MOST_SETS}, or sets = 'nested'"
            )

    @property
    def extra_samples(self) -> int:
        """The most samples beside the base ones."""
        return self.samples - self.base_samples

    @property
    def _own_sets(self) -> bool:
        return self.sets == "separate" and self.levels == "continuous"

    def order(self) -> np.ndarray:
        """Nested: indices of the technique's samples, the base ones first: (samples,)."""
        every = np.arange(self.base_samples)
        base = np.floor((every + 0.5) * self.samples / self.base_samples).astype(int)
        rest = np.setdiff1d(np.arange(self.samples), base)
        return np.concatenate([base, rest[halves(len(rest))]])

    def table(self, curve: Curve) -> np.ndarray:
        """The base samples, then the extra ones, or their sets of 1, 2, ... samples: (N, 4)."""
        if self.sets == "nested":
            return self.sample_set(curve, self.samples, 0)[self.order()]
        numbers = range(1 if self._own_sets else self.extra_samples, self.extra_samples + 1)
        extra = [self.sample_set(curve, count, self.base_samples) for count in numbers]
        return np.vstack([self.sample_set(curve, self.base_samples, 0), *extra])

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        table = self.table(inputs.curve)
        farthest = table[: self.base_samples, 2].max()
        return {
            **super().uniforms(inputs),
            "samples": table,
            "base": self.base_samples,
            "extra": self.extra_samples,
            "threshold": 0.5 - self.offset,
            "inner_mm": self.inner_radius * farthest,
            "exponent": self.contrast_exponent,
            "continuous": int(self.levels == "continuous"),
            "own_sets": int(self._own_sets),
        }

    def defines(self) -> dict[str, Any]:
        many = self.extra_samples * (self.extra_samples + 1) // 2
        rows = self.base_samples + many if self._own_sets else self.samples
        return {**super().defines(), "SAMPLES": rows}

    def self_check(self, curve: Curve) -> None:
        super().self_check(curve)
        order = self.order()
        assert sorted(order) == list(range(self.samples))
        assert len(self.table(curve)) == self.defines()["SAMPLES"]
