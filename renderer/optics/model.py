"""What every diffusion profile is: R_d(r), T_d(r) and totals of one stack of layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics.medium import Medium, Stack


def radii(r_mm) -> np.ndarray:
    """r_mm as (N, 1), checked: finite, > 0."""
    r = np.atleast_1d(np.asarray(r_mm, dtype=float))
    if r.ndim != 1 or not np.isfinite(r).all() or (r < 0).any():
        raise InputError(
            "a radius is negative, infinite or not a number; expected millimetres of 0 or more"
        )
    return r[:, None]


@dataclass(frozen=True)
class Profile:
    """Base of all profiles. R and T are per unit of flux that has entered the medium, in 1/mm^2.

    layers: how many the model can take (0: any number); knows_thickness: whether a finite slab
    differs from a half-space; knows_roughness: whether it can take a rough face.
    """

    stack: Stack

    name: ClassVar[str]
    paper: ClassVar[str]
    layers: ClassVar[int] = 1
    knows_thickness: ClassVar[bool] = True
    knows_roughness: ClassVar[bool] = False

    def __post_init__(self):
        if self.layers and len(self.stack.layers) != self.layers:
            raise InputError(
                f"{self.name} is for one layer, got {len(self.stack.layers)}; expected "
                "layered or montecarlo for more"
            )
        if self.stack.roughness and not self.knows_roughness:
            raise InputError(
                f"{self.name} knows smooth faces only, got a roughness of "
                f"{self.stack.roughness:g}; expected 0, or dipole, multipole or layered"
            )

    @property
    def medium(self) -> Medium:
        return self.stack.layers[0].medium

    @property
    def thickness_mm(self) -> float:
        return float(self.stack.thickness_mm)

    def reflectance(self, r_mm) -> np.ndarray:
        """R_d(r), 1/mm^2: (N,) -> (N, C)."""
        raise NotImplementedError

    def transmittance(self, r_mm) -> np.ndarray | None:
        """T_d(r) on the far face, 1/mm^2: (N,) -> (N, C); None where the model has none."""
        return None

    def totals(self) -> tuple[np.ndarray, np.ndarray | None]:
        """int R 2 pi r dr and int T 2 pi r dr, in closed form where there is one: (C,) each."""
        raise NotImplementedError
