"""Texture-space sum of Gaussians.

d'Eon and Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU Gems 3, ch.
14: irradiance over the atlas, blurred by six Gaussians, each from the one before, with taps that
follow how far a texel stretches over the surface; half of the albedo before, half after.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from renderer.parameters import parameter
from renderer.techniques.atlas_gaussians import AtlasGaussians


@dataclass(frozen=True)
class DeonLuebke(AtlasGaussians):
    """The 2007 filter.

    kernel "fitted": `terms` Gaussians nearest to the medium's curve; "published": the chapter's
    six, whatever the medium. first "blurred": the narrowest Gaussian is as wide as it is;
    "published": it is the map itself. Light that comes through thin parts is that of Jimenez 2010,
    in the place of the chapter's modified translucent shadow maps, which are not here.
    """

    kernel: str = parameter(
        "fitted", choices=("fitted", "published"), source="GPU Gems 3, sec. 14.3.2"
    )
    terms: int = parameter(6, unit="Gaussians", low=2, high=10, source="GPU Gems 3, sec. 14.3.2")
    first: str = parameter(
        "blurred", choices=("blurred", "published"), source="GPU Gems 3, sec. 14.4.3: unblurred"
    )
    texturing: float = parameter(
        0.5,
        unit="of the albedo's exponent before scattering",
        low=0.0,
        high=1.0,
        source="GPU Gems 3, sec. 14.4.5: pre- and post-scatter",
    )

    name: ClassVar[str] = "deon_luebke"
    title: ClassVar[str] = "d'Eon-Luebke"
    paper: ClassVar[str] = "d'Eon and Luebke 2007, GPU Gems 3, ch. 14"
