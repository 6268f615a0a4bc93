"""The base of techniques that filter light over a surface's texture atlas.

Borshukov and Lewis 2003: light is drawn into the atlas, filtered there, and looked up when the
surface is drawn. The base draws light and places into the atlas, measures how far a texel reaches,
pads the borders of charts and draws the surfaces; a technique is its parameters and `filter`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.parameters import parameter
from renderer.passes.given import draw_given
from renderer.passes.surfaces import Drawn
from renderer.scene.shapes import triangle_areas
from renderer.techniques.base import Inputs, Room, Scattered, Technique
from renderer.techniques.cascade import START
from renderer.techniques.drawing import Drawing, result

#: Atlases whose charts overlap by more than this share of their texels are refused.
MOST_OVERLAP = 0.01


class Atlas(Drawing):
    """One surface's atlas, and what is drawn over it.

    light: irradiance, alpha 1 where the medium scatters; place: position in the world in mm, alpha
    as there; texel_mm: mm that a texel reaches along u and v; normal: unit, in the world. All are
    (size, size), and given to every pass.
    """

    def __init__(self, inputs: Inputs, room: Room, drawn: Drawn, size: int):
        super().__init__(inputs, size, size, linear=True)
        self.room, self.drawn, self.size = room, drawn, size
        self.light: gl.Texture

    def draw_light(self, texturing: float) -> None:
        """Irradiance, places and the size of texels."""
        self._refuse_overlap()
        with self.room.placed(self.drawn, "ATLAS", (self.size, self.size)) as lit:
            irradiance, _, albedo, normal, transmitted, position = lit.textures
            light = self.target()
            draw_given(
                self.inputs.context,
                self.inputs.programs,
                light,
                *(irradiance, transmitted, albedo, self.room.medium),
                texturing,
            )
            self.light = self.given["light"] = light.textures[0]
            places = self.target(GL.GL_RGBA32F, GL.GL_RGBA16F, GL.GL_RGBA16F)
            self.draw(places, "techniques/atlas_places.glsl", at=position, facing=normal)
        for name, texture in zip(("place", "texel_mm", "normal"), places.textures, strict=True):
            self.given[name] = texture

    def mean_texel_mm(self) -> float:
        """The side of a square texel that would cover the surface as often."""
        part = self.drawn.item.primitive
        world = triangle_areas(self.drawn.item.in_world(part.positions), part.faces).sum()
        flat = triangle_areas(np.pad(part.texcoord_0, ((0, 0), (0, 1))), part.faces).sum()
        return float(np.sqrt(world / flat) / self.size)

    def _refuse_overlap(self) -> None:
        """InputError where charts lie over each other: their light would be one another's."""
        side = min(self.size, 512)
        with gl.Target(side, side, [GL.GL_RGBA16F]) as target:
            target.bind(clear=(0.0, 0.0, 0.0, 0.0), blend="add")
            program = self.inputs.programs(
                "techniques/atlas_layers.glsl", {"DOMAIN": "ATLAS"}, vertex="passes/surface.vert"
            )
            values = {**self.room.camera, "model": self.drawn.item.pose}
            program.use(**program.accepts(values))
            self.drawn.mesh.draw()
            layers = target.textures[0].read()[..., 0]
        covered, double = (layers > 0.5).sum(), (layers > 1.5).sum()
        if not covered or double > MOST_OVERLAP * covered:
            raise InputError(
                f"the texture coordinates of mesh {self.drawn.item.mesh + 1} cover {int(covered)} "
                f"of {layers.size} texels, {int(double)} of them more than once; expected a place "
                "of its own for each part of the surface, since light is filtered there"
            )


@dataclass(frozen=True)
class AtlasTechnique(Technique):
    """A filter of the atlas. Override `filter` and `taps`.

    size: texels along a side of the atlas. stretch "corrected": a kernel keeps its millimetres
    however the texture stretches over the surface; "none": every texel counts as the mean one.
    padding: texels by which charts are carried on beyond
    their borders, so that looking up between texels meets no foreign ones. seams: "stop" leaves a
    tap out that falls off its chart or lands on another (the middle stands for it); "published"
    takes whatever lies there. coarse_mm: where texels are longer than this on the surface, filtered
    light is looked up by a cubic B-spline (wholly at 1.5 times that length), else linearly: that
    spreads light less, by 0.41 texels and not by 0.58 (standard deviation), but where an edge of
    light crosses long texels aslant it shows teeth.
    """

    domain: ClassVar[str] = "atlas"

    size: int = parameter(
        2048, unit="texels a side", low=64, high=8192, source="1024 in GPU Gems 3, ch. 14"
    )
    stretch: str = parameter(
        "corrected", choices=("corrected", "none"), source="GPU Gems 3, sec. 14.4.3"
    )
    padding: int = parameter(2, unit="texels", low=0, high=16, source="GPU Gems 3, sec. 14.4.2")
    seams: str = parameter("stop", choices=("stop", "published"), source="GPU Gems 3, sec. 14.4.2")
    coarse_mm: float = parameter(
        0.6,
        unit="mm a texel",
        low=1e-3,
        high=1000.0,
        source="by eye on the ear's rim; see docs/techniques.md",
    )

    def filter(self, atlas: Atlas) -> gl.Texture:
        """The filtered light: RGBA, alpha 1 where the medium scatters."""
        raise NotImplementedError(f"{self.name} has no filter")

    def taps(self) -> int:
        """Texture reads that a texel takes."""
        raise NotImplementedError(f"{self.name} does not count")

    def scatter(self, inputs: Inputs) -> Scattered:
        room = inputs.needed_room(self.name)
        with result(inputs, room.depth()) as target:
            target.bind()
            inputs.programs(START).use(light=inputs.irradiance, unblurred=np.ones(3), samples=0.0)
            gl.draw_fullscreen(inputs.context)
            for drawn in room.surfaces:
                self._one(inputs, room, drawn, target)
        return Scattered(target)

    def _one(self, inputs: Inputs, room: Room, drawn: Drawn, target: gl.Target) -> None:
        """Filter one surface's light and draw it where the surface is seen."""
        with Atlas(inputs, room, drawn, self.size) as atlas:
            atlas.draw_light(self.texturing)
            filtered = self.filter(atlas)
            if self.padding:
                padded = atlas.target()
                atlas.draw(padded, "techniques/atlas_pad.glsl", source=filtered, reach=self.padding)
                filtered = padded.textures[0]
            target.bind(depth_test=True)
            GL.glDepthMask(False)
            program = inputs.programs(
                "techniques/atlas_seen.glsl", {"DOMAIN": "SCREEN"}, vertex="passes/surface.vert"
            )
            values = {
                **room.camera,
                "model": drawn.item.pose,
                "filtered": filtered,
                "irradiance": inputs.irradiance,
                "texel_mm": atlas.given["texel_mm"],
                "coarse_mm": self.coarse_mm,
                "taps": float(self.taps()),
            }
            program.use(**program.accepts(values))
            drawn.mesh.draw()
