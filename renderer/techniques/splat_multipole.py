"""Multipole splats: what comes back from, and through, parts of any thickness.

Rohat 2012, "Real-time rendering of translucent materials", sec. 5.1.2, after Donner and Jensen
2005, doi:10.1145/1073204.1073308, and Shah, Konttinen and Pattanaik 2009,
doi:10.1109/TVCG.2008.200: R and T as textures of the distance and of the thickness below a point,
mixed by the angle between the normals of the point and of the pixel.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics import fits, media, slabs, transmittance
from renderer.optics.curve import Curve
from renderer.optics.medium import Stack
from renderer.optics.slabs import Slabs
from renderer.optics.transmittance import MODELS
from renderer.parameters import parameter
from renderer.techniques.points import PointsTechnique, Tables, distances

ROWS = 32  # of a table over thickness
LEAST_THROUGH = 2e-3  # of what comes through: where a table ends


@dataclass(frozen=True)
class SplatMultipole(PointsTechnique):
    """As `splat_dipole`, with the thickness of the object below each point.

    profiles "fitted": the images of the dipole that is fitted to the medium's curve between two
    faces; an endless part is `splat_dipole`. "layers": the multipole of the medium's own
    coefficients, and of coatings over it the combined profiles, as in the document. through: how
    much comes through, by those profiles, or as Monte Carlo of slabs of the medium has it, spread
    as they say. thinnest: parts that are thinner count as that thick. blur_through: as `blur`, of
    what comes through, along the far face alone. depth: "face", the thickness
    below a point's face; "light", along the light, for the samples of lights alone. distance
    "along": T is looked up by the distance along the face, for which it is defined; "published": by
    the distance itself, which a thin part's T loses much of. medium_scale: all lengths of the
    medium times this.
    """

    translucency: str = parameter(
        "none", choices=MODELS, source="Rohat 2012: T is among the profiles"
    )
    profiles: str = parameter(
        "fitted", choices=("fitted", "layers"), source="Rohat 2012, sec. 4.3 and 4.3.1: layers"
    )
    through: str = parameter(
        "slab",
        choices=("slab", "profiles"),
        source="Rohat 2012, sec. 5.1.2: by the profiles; renderer/optics/transmittance.py",
    )
    thinnest: float = parameter(
        1.2, unit="mean free paths", low=1.01, high=64.0, source="Rohat 2012, sec. 5.1.2: 4"
    )
    blur_through: float = parameter(2.0, unit="of the spacing", low=0.0, high=4.0, source="by eye")
    depth: str = parameter("face", choices=("face", "light"), source="Rohat 2012, fig. 5.7: light")
    distance: str = parameter(
        "along", choices=("along", "published"), source="Rohat 2012, eq. 5.2: published"
    )
    medium_scale: float = parameter(
        1.0, unit="times", low=0.01, high=100.0, source="Rohat 2012: scaled at run time"
    )

    name: ClassVar[str] = "splat_multipole"
    title: ClassVar[str] = "Multipole splats"
    paper: ClassVar[str] = (
        "Rohat 2012; Donner and Jensen 2005, doi:10.1145/1073204.1073308; Shah et al. 2009"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.depth == "light" and self.samples != "lights":
            raise InputError(
                f"{self.where('depth')} is 'light' with samples {self.samples!r}; expected 'face': "
                "points over the surface have no light of their own"
            )

    @property
    def depth_along_light(self) -> bool:
        return self.depth == "light"

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return super().edge(curve, np.asarray(x_mm) / self.medium_scale)

    def reach_mm(self, curve: Curve, spacing_mm: float | None = None) -> float:
        return self.medium_scale * super().reach_mm(curve, spacing_mm)

    def blur_mm(self, curve: Curve, spacing_mm: float) -> np.ndarray:
        return super().blur_mm(curve, spacing_mm / self.medium_scale)

    def slabs(
        self, curve: Curve, medium: str | dict | None, nearest_mm=(0.0, 0.0)
    ) -> tuple[Slabs, float]:
        """Slabs of the medium, and what the whole medium sends back in their unit (C,): 1, unless
        it is a sheet itself.
        """
        stack = None if medium is None else media.read(medium)
        sheet = isinstance(stack, Stack) and bool(np.isfinite(stack.thickness_mm))
        endless = stack
        if sheet:
            *above, last = stack.layers
            endless = replace(stack, layers=(*above, replace(last, thickness_mm=np.inf)))
        if self.profiles == "layers":
            if not isinstance(endless, Stack):
                raise InputError(
                    f"{self.where('profiles')} is 'layers' for {medium!r:.60}, which is known as a "
                    "curve alone; expected a medium with coefficients, or 'fitted'"
                )
            made = slabs.layered(endless, self.thinnest, nearest_mm)
        else:
            of = media.simulated(endless) if sheet else curve
            made = slabs.fitted(fits.dipole(of), self.thinnest, nearest_mm)
        whole = made.totals(np.array([stack.thickness_mm]))[0][0] if sheet else 1.0
        return made, whole

    def tables(self, curve: Curve, medium: str | dict | None, spacing_mm: float) -> Tables:
        key = None if medium is None else json.dumps(medium, sort_keys=True, default=list)
        return _tables(self, curve, key, round(float(spacing_mm), 4))

    def self_check(self, curve: Curve) -> None:
        made, _ = self.slabs(curve, None)
        d = np.geomspace(made.least_mm.max(), made.farthest(LEAST_THROUGH), 6)
        R, T = made.totals(d)
        assert (np.diff(R, axis=0) > -1e-6).all() and (np.diff(T, axis=0) < 1e-6).all()
        assert np.allclose(made.totals(np.array([1e5]))[0], 1, atol=1e-4)


@lru_cache(maxsize=16)
def _tables(technique: SplatMultipole, curve: Curve, key: str | None, spacing_mm: float) -> Tables:
    """The tables of a technique; they take up to some seconds."""
    medium = None if key is None else json.loads(key)
    scale = technique.medium_scale
    shares = (technique.blur, technique.blur_through)
    nearest = tuple(share * spacing_mm / scale for share in shares)
    made, whole = technique.slabs(curve, medium, nearest)
    reach = technique.reach_mm(curve, spacing_mm)
    last = made.farthest(LEAST_THROUGH)
    d = np.geomspace(0.25 * float(made.least_mm.min()), last, ROWS)
    near, far = made.densities(d, distances(reach) / scale)
    R, T = made.totals(d)
    if technique.through == "slab" and medium is not None:
        wanted = transmittance.curve_of(medium, "slab").at(d) * whole
        far *= (wanted / np.maximum(T, 1e-12))[:, None]
    near, far, R = near / R[:, None] / scale**2, far / whole / scale**2, R / whole
    far[-1] = 0
    near[:, -1] = far[:, -1] = 0
    deep = technique.distance == "along"
    return Tables(reach, near, R, far, d * scale, deep=deep, mixed=True)
