"""No subsurface scattering: the surface's own irradiance, and no translucency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from renderer import gl
from renderer.techniques.base import Inputs, Scattered, Technique, output_formats


@dataclass(frozen=True)
class NoScattering(Technique):
    """Lambert's law alone; one sample a pixel."""

    name: ClassVar[str] = "none"
    title: ClassVar[str] = "No SSS"
    paper: ClassVar[str] = "Lambert 1760, Photometria"
    translucent: ClassVar[bool] = False

    def scatter(self, inputs: Inputs) -> Scattered:
        target = gl.Target(inputs.width, inputs.height, output_formats())
        target.bind()
        inputs.programs("techniques/none.glsl").use(irradiance=inputs.irradiance)
        gl.draw_fullscreen(inputs.context)
        return Scattered(target)
