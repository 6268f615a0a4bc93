"""Texture-space sum of Gaussians.

d'Eon and Luebke 2007, "Advanced techniques for realistic real-time skin rendering", GPU Gems 3, ch.
14: irradiance over the atlas, blurred by six Gaussians, each from the one before, with taps that
follow how far a texel stretches over the surface; half of the albedo before, half after. Through
thin parts light comes by modified translucent shadow maps (sec. 14.5.3): a lamp's map says where
behind a place the light enters, and the blurred light there is added by the thickness between.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import chain
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.optics.transmittance import MODELS
from renderer.parameters import parameter
from renderer.scene.lights import PointLight
from renderer.techniques.atlas import Atlas
from renderer.techniques.atlas_gaussians import AtlasGaussians
from renderer.techniques.cascade import ADD, START
from renderer.techniques.drawing import draw_kept

#: Taken for the thickness where a lamp shines on the surface itself (the chapter's listing).
LIT_MM = 50.0


@dataclass(frozen=True)
class DeonLuebke(AtlasGaussians):
    """The 2007 filter.

    kernel "fitted": `terms` Gaussians nearest to the medium's curve; "published": the chapter's
    six, whatever the medium. first "blurred": the narrowest Gaussian is as wide as it is;
    "published": it is the map itself. translucency "maps": the chapter's modified translucent
    shadow maps, for lamps that cast shadows; the others are what all techniques can have. stretch
    "blurred": the stretch map is blurred along with the light.
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
    stretch: str = parameter(
        "corrected", choices=("corrected", "blurred", "none"), source="GPU Gems 3, sec. 14.4.3"
    )
    translucency: str = parameter(
        "maps", choices=("maps", *MODELS), source="GPU Gems 3, sec. 14.5.3"
    )
    through_terms: int = parameter(
        3,
        unit="Gaussians, the widest",
        low=1,
        high=10,
        source="GPU Gems 3, listing 14-5: the last three of six",
    )
    falloff: float = parameter(
        0.2,
        unit="1/mm, of the thickness that is blurred as exp(-falloff thickness)",
        low=0.01,
        high=10.0,
        source="GPU Gems 3, listing 14-5",
    )
    map_size: int = parameter(
        2048, unit="pixels a side of a lamp's map", low=64, high=4096, source="by eye"
    )
    shrink_mm: float = parameter(
        0.5,
        unit="mm inwards, of a place before it is looked up in a lamp's map",
        low=0.0,
        high=10.0,
        source="Jimenez et al. 2010, sec. 3; 0 in GPU Gems 3, whose maps stripe where light grazes",
    )

    name: ClassVar[str] = "deon_luebke"
    title: ClassVar[str] = "d'Eon-Luebke"
    paper: ClassVar[str] = "d'Eon and Luebke 2007, GPU Gems 3, ch. 14"

    def filter(self, atlas: Atlas) -> gl.Texture:
        fit = self.fit(atlas.inputs.curve)
        blurs, unblurred = self.blurs(fit)
        sigmas, weights = zip(*blurs, strict=True)
        wide = np.sqrt(fit.variance_mm2[-len(blurs) :])
        nearest = len(blurs) - min(self.through_terms, len(blurs))  # of those that are let through
        total = atlas.target()
        atlas.draw(total, START, unblurred=unblurred, samples=0.0)
        with self._ways_through(atlas) as (thinness, enters):
            # each Gaussian takes the thickness as the Gaussian before it has blurred it
            thin = chain([thinness], self.cascade(atlas, thinness, sigmas[:-1])) if enters else None
            for k, blurred in enumerate(self.cascade(atlas, atlas.light, sigmas)):
                atlas.draw(total, ADD, blend="add", source=blurred, weight=weights[k])
                if thin is None:
                    continue
                thinness = next(thin)
                if k >= nearest:
                    own = {"sigma": wide[k], "weight": weights[k], "falloff": self.falloff}
                    own |= {"source": blurred, "thinness": thinness, "enters": enters}
                    atlas.draw(total, "techniques/deon_luebke_through.glsl", blend="add", **own)
        return total.textures[0]

    @contextmanager
    def _ways_through(self, atlas: Atlas) -> Iterator[tuple[gl.Texture, gl.Texture | None]]:
        """exp(-falloff thickness) and where light enters, over the atlas; None: no way through."""
        lamps = atlas.room.lamps()
        if not (self.translucency == "maps" and lamps.layers):
            yield atlas.light, None
            return
        programs = atlas.inputs.programs
        kept = atlas.target(GL.GL_R32F)
        draw_kept(atlas.inputs, atlas.room, (atlas.drawn,), kept, "ATLAS")
        atlas.given["kept"] = kept.textures[0]
        with ExitStack() as held:
            formats = [GL.GL_RGBA16F, GL.GL_RGBA32F]
            ways = held.enter_context(gl.Target(atlas.size, atlas.size, formats, True, True))
            ways.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True)
            formats, side = [GL.GL_RGBA32F, GL.GL_RGBA16F], (self.map_size, self.map_size)
            seen = held.enter_context(gl.Target(*side, formats, depth=True, linear=True))
            for k, light in enumerate(lamps.lights):
                point = isinstance(light, PointLight)
                lamp = np.append(light.place if point else light.towards, float(point))
                for layer in lamps.layers[lamps.first[k] :][: lamps.faces[k]]:
                    seen.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True)
                    name = "techniques/deon_luebke_seen"
                    programs(f"{name}.frag", vertex=f"{name}.vert").use(
                        model=atlas.drawn.item.pose,
                        layer=layer.matrix,
                        depth_range=lamps.depth_range,
                    )
                    atlas.drawn.mesh.draw()
                    ways.bind(depth_test=True)
                    programs("techniques/deon_luebke_thickness.glsl").use(
                        place=atlas.given["place"],
                        normal=atlas.given["normal"],
                        entry=seen.textures[0],
                        entry_normal=seen.textures[1],
                        layer=layer.matrix,
                        lamp=lamp,
                        falloff=self.falloff,
                        shrink_mm=self.shrink_mm,
                        lit_mm=LIT_MM,
                    )
                    gl.draw_fullscreen(atlas.inputs.context)
            yield ways.textures[0], ways.textures[1]
