"""What every technique is: frozen, validated parameters and one pure pass, irradiance in, scattered
irradiance out.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from OpenGL import GL

from renderer.errors import InputError


def parameter(
    default,
    *,
    unit: str,
    source: str,
    low: float | None = None,
    high: float | None = None,
    choices: tuple = (),
):
    """A dataclass field with its unit, range (or choices) and source."""
    return field(
        default=default,
        metadata={"unit": unit, "source": source, "low": low, "high": high, "choices": choices},
    )


@dataclass(frozen=True)
class Inputs:
    """The shared buffers, all (height, width) at the resolution at which scattering is computed.

    irradiance: RGBA32F, rgb = E, alpha = 1 on scattering material. depth_normal: RGBA32F, x = view
    depth in mm (0 where nothing is), yzw = view-space normal. pixels_per_mm: pixels of this
    resolution per mm at 1 mm distance. supersample: pixels of this resolution per output pixel,
    along one side.
    """

    context: object
    programs: object
    irradiance: object
    depth_normal: object
    width: int
    height: int
    pixels_per_mm: float
    supersample: int


@dataclass(frozen=True)
class Scattered:
    """target.textures[0]: RGBA32F scattered irradiance; [1]: RGBA16F, x = samples taken, y =
    contrast (where it is measured).
    """

    target: object


@dataclass(frozen=True)
class Technique:
    """Base of all techniques.

    `translucent`: transmitted light is added before scattering; `measures_contrast`: it writes
    contrast.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    paper: ClassVar[str]
    translucent: ClassVar[bool] = True
    measures_contrast: ClassVar[bool] = False

    def __post_init__(self):
        for f in dataclasses.fields(self):
            value, meta = getattr(self, f.name), f.metadata
            where = f"{self.name}.{f.name}"
            if meta["choices"]:
                if value not in meta["choices"]:
                    raise InputError(
                        f"{where} is {value!r}; expected one of "
                        f"{', '.join(map(repr, meta['choices']))}"
                    )
                continue
            kind = type(f.default)
            values = value if isinstance(value, (tuple, list)) else (value,)
            if isinstance(f.default, tuple):
                if not isinstance(value, (tuple, list)) or len(value) != len(f.default):
                    raise InputError(f"{where} is {value!r}; expected {len(f.default)} numbers")
                kind = float
                object.__setattr__(self, f.name, tuple(value))
            for x in values:
                good = (
                    isinstance(x, bool)
                    if kind is bool
                    else isinstance(x, (int, float)) and not isinstance(x, bool) and np.isfinite(x)
                )
                if kind is int:
                    good = good and x == int(x)
                if not good:
                    words = {bool: "true or false", int: "an integer"}.get(kind, "a number")
                    raise InputError(f"{where} is {value!r}; expected {words}")
                if kind is not bool and not (meta["low"] <= x <= meta["high"]):
                    raise InputError(
                        f"{where} is {value!r} {meta['unit']}; expected {meta['low']} to "
                        f"{meta['high']}"
                    )
            if kind is int:
                object.__setattr__(self, f.name, int(value))

    def parameters(self) -> dict:
        """The parameters as plain values, for the manifest."""
        return {
            f.name: list(v) if isinstance(v := getattr(self, f.name), tuple) else v
            for f in dataclasses.fields(self)
        }

    def self_check(self) -> None:
        """Raise AssertionError if the kernel is not what the paper says."""

    def scatter(self, inputs: Inputs) -> Scattered:
        """Run the technique."""
        raise NotImplementedError(f"{self.name} has no pass")


def output_formats() -> list[int]:
    """Formats of the final target of every technique: scattered irradiance, then samples and
    contrast.
    """
    return [GL.GL_RGBA32F, GL.GL_RGBA16F]
