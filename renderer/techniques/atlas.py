"""The base of techniques that filter light over a surface's texture atlas.

Borshukov and Lewis 2003: light is drawn into the atlas, filtered there, and looked up when the
surface is drawn. The base draws light and places into the atlas, measures how far a texel reaches,
pads the borders of charts and draws the surfaces; a technique is its parameters and `filter`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.parameters import parameter
from renderer.passes.surfaces import Drawn
from renderer.techniques.base import Inputs, Scattered, Technique
from renderer.techniques.cascade import ADD, START, TAPS
from renderer.techniques.screen import output_formats

#: Of a blur along an axis; techniques/atlas_gaussian.glsl has room for as many.
MOST_TAPS = 49
#: Atlases whose charts overlap by more than this share of their texels are refused.
MOST_OVERLAP = 0.01


class Atlas:
    """One surface's atlas, and what is drawn over it.

    light: irradiance, alpha 1 where the medium scatters; place: position in the world in mm, alpha
    as there; texel_mm: mm that a texel reaches along u and v. All are (size, size).
    """

    def __init__(self, inputs: Inputs, drawn: Drawn, size: int):
        assert inputs.room is not None
        self.inputs, self.drawn, self.size = inputs, drawn, size
        self._owned: list[gl.Target] = []
        self.light: gl.Texture
        self.place: gl.Texture
        self.texel_mm: gl.Texture

    def draw_light(self, translucent: bool, texturing: float) -> None:
        """Irradiance, places and the size of texels."""
        room = self.inputs.room
        self._refuse_overlap()
        with room.placed(self.drawn, "ATLAS", (self.size, self.size)) as lit:
            irradiance, _, albedo, _, transmitted, position = lit.textures
            light = self.target()
            light.bind()
            self.inputs.programs("passes/add.frag").use(
                irradiance=irradiance,
                transmitted=transmitted,
                medium=float(room.medium),
                through=float(translucent),
                albedo=albedo,
                texturing=texturing,
            )
            gl.draw_fullscreen(self.inputs.context)
            places = self.target(GL.GL_RGBA32F, GL.GL_RGBA16F)
            self.draw(places, "techniques/atlas_places.glsl", light=light.textures[0], at=position)
        self.light = light.textures[0]
        self.place, self.texel_mm = places.textures

    def mean_texel_mm(self) -> float:
        """The side of a square texel that would cover the surface as often."""
        part, pose = self.drawn.item.primitive, self.drawn.item.pose
        world = _areas(part.positions @ pose[:3, :3].T, part.faces)
        flat = _areas(np.pad(part.texcoord_0, ((0, 0), (0, 1))), part.faces)
        return float(np.sqrt(world / flat) / self.size)

    def _refuse_overlap(self) -> None:
        """InputError where charts lie over each other: their light would be one another's."""
        room, side = self.inputs.room, min(self.size, 512)
        with gl.Target(side, side, [GL.GL_RGBA16F]) as target:
            target.bind(clear=(0.0, 0.0, 0.0, 0.0), blend="add")
            program = self.inputs.programs(
                "techniques/atlas_layers.glsl", {"DOMAIN": "ATLAS"}, vertex="passes/surface.vert"
            )
            values = {**room.camera, "model": self.drawn.item.pose}
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

    def target(self, *formats: int) -> gl.Target:
        """A target of the atlas's size, RGBA32F by default; freed when the atlas is."""
        made = gl.Target(self.size, self.size, list(formats) or [GL.GL_RGBA32F], linear=True)
        self._owned.append(made)
        return made

    def draw(self, into: gl.Target, shader: str, blend: str | None = None, **uniforms) -> None:
        """One pass over the atlas; those of light, place and texel_mm that a shader has are set."""
        into.bind(blend=blend)
        program = self.inputs.programs(shader)
        shared = {
            name: getattr(self, name)
            for name in ("light", "place", "texel_mm")
            if name not in uniforms and hasattr(self, name)
        }
        program.use(**program.accepts(shared), **uniforms)
        gl.draw_fullscreen(self.inputs.context)

    @contextmanager
    def run(self) -> Iterator[Atlas]:
        try:
            yield self
        finally:
            for target in self._owned:
                target.delete()


def _areas(points: np.ndarray, faces: np.ndarray) -> float:
    """The area of all triangles."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


@dataclass(frozen=True)
class AtlasTechnique(Technique):
    """A filter of the atlas. Override `filter` and `taps`.

    size: texels along a side of the atlas. stretch "corrected": a kernel keeps its millimetres
    however the texture stretches over the surface; "none": every texel counts as the mean one.
    padding: texels by which charts are carried on beyond
    their borders, so that looking up between texels meets no foreign ones. seams: "stop" leaves a
    tap out that falls off its chart or lands on another (the middle stands for it); "published"
    takes whatever lies there.
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

    def filter(self, atlas: Atlas) -> gl.Texture:
        """The filtered light: RGBA, alpha 1 where the medium scatters."""
        raise NotImplementedError(f"{self.name} has no filter")

    def taps(self) -> int:
        """Texture reads that a texel takes."""
        raise NotImplementedError(f"{self.name} does not count")

    def scatter(self, inputs: Inputs) -> Scattered:
        room = inputs.room
        if room is None:
            raise ValueError(f"{self.name} needs surfaces, not a picture of them alone")
        result = gl.Target(inputs.width, inputs.height, output_formats(), depth=room.depth)
        try:
            result.bind()
            inputs.programs("techniques/atlas_start.glsl").use(irradiance=inputs.irradiance)
            gl.draw_fullscreen(inputs.context)
            for drawn in room.surfaces:
                self._one(inputs, drawn, result)
        except BaseException:
            result.delete()
            raise
        return Scattered(result)

    def _one(self, inputs: Inputs, drawn: Drawn, result: gl.Target) -> None:
        """Filter one surface's light and draw it where the surface is seen."""
        room = inputs.room
        with Atlas(inputs, drawn, self.size).run() as atlas:
            atlas.draw_light(self.translucent, self.texturing)
            filtered = self.filter(atlas)
            if self.padding:
                padded = atlas.target()
                atlas.draw(padded, "techniques/atlas_pad.glsl", source=filtered, reach=self.padding)
                filtered = padded.textures[0]
            result.bind(depth_test=True)
            GL.glDepthMask(False)
            program = inputs.programs(
                "techniques/atlas_seen.glsl", {"DOMAIN": "SCREEN"}, vertex="passes/surface.vert"
            )
            values = {
                **room.camera,
                "model": drawn.item.pose,
                "filtered": filtered,
                "irradiance": inputs.irradiance,
                "taps": float(self.taps()),
            }
            program.use(**program.accepts(values))
            drawn.mesh.draw()

    def stride(self, atlas: Atlas) -> dict[str, Any]:
        """What every blur's shader is told of seams and of stretch."""
        even = atlas.mean_texel_mm() if self.stretch == "none" else 0.0
        return {"stop": int(self.seams == "stop"), "even_mm": even}


def blur_of_blurs(
    technique: AtlasTechnique,
    atlas: Atlas,
    blurs: list[tuple[float, np.ndarray]],
    unblurred: np.ndarray,
    taps: np.ndarray = TAPS,
    spacing: float = 1.0,
) -> gl.Texture:
    """A weighted sum of Gaussians, each the one before blurred along u and then v (cascade.steps).

    blurs: (sigma in mm of a step, weight (3,)); unblurred (3,): the light's own weight; taps: of
    an axis, an odd number up to MOST_TAPS, spacing sigmas apart.
    """
    row, blurred, total = atlas.target(), atlas.target(), atlas.target()
    common = {
        **technique.stride(atlas),
        "taps": np.pad(taps / taps.sum(), (0, MOST_TAPS - len(taps))),
        "spacing": spacing,
        "reach": len(taps) // 2,
    }
    atlas.draw(total, START, light=atlas.light, unblurred=unblurred, samples=0.0)
    source, shader = atlas.light, "techniques/atlas_gaussian.glsl"
    for sigma, weight in blurs:
        own = {**common, "sigma": sigma}
        atlas.draw(row, shader, source=source, axis=(1.0, 0.0), **own)
        atlas.draw(blurred, shader, source=row.textures[0], axis=(0.0, 1.0), **own)
        source = blurred.textures[0]
        atlas.draw(total, ADD, blend="add", source=source, weight=weight)
    return total.textures[0]
