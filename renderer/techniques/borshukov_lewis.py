"""Blurred light maps, with which filtering in texture space began.

Borshukov and Lewis 2003, "Realistic human face rendering for The Matrix Reloaded", SIGGRAPH
sketches, doi:10.1145/965400.965470: light is drawn into the texture atlas, blurred there, more in
red than in green and blue, and looked up when the face is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.parameters import parameter
from renderer.techniques.atlas_gaussians import MOST_TAPS, AtlasGaussians
from renderer.techniques.base import odd
from renderer.techniques.cascade import gaussian_taps


@dataclass(frozen=True)
class BorshukovLewis(AtlasGaussians):
    """Blurs of the light map: a narrow and a broad one by default.

    The sketch prints no constants of its kernel: `terms` Gaussians are fitted to the medium's
    curve. Its blur knows no stretch of the texture (stretch = "none"); the default keeps
    millimetres. A broad Gaussian right after a narrow one needs more than seven taps.
    """

    terms: int = parameter(
        2, unit="Gaussians", low=1, high=10, source="narrow and broad; the sketch prints none"
    )

    taps_per_axis: int = parameter(
        25, unit="taps", low=5, high=MOST_TAPS, source="over 6 sigma; the sketch prints none"
    )

    name: ClassVar[str] = "borshukov_lewis"
    title: ClassVar[str] = "Light-map blur"
    paper: ClassVar[str] = "Borshukov and Lewis 2003, doi:10.1145/965400.965470"

    def __post_init__(self) -> None:
        super().__post_init__()
        odd(self.where("taps_per_axis"), self.taps_per_axis)

    def axis_taps(self) -> tuple[np.ndarray, float, float]:
        return gaussian_taps(self.taps_per_axis)
