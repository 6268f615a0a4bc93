"""The base of techniques that filter the screen's irradiance.

It owns targets, binding and drawing: a technique of one pass is its parameters, its uniforms and
its shader, techniques/NAME.glsl; one of several passes overrides `passes`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from renderer import gl
from renderer.techniques.base import Inputs, Scattered, Technique
from renderer.techniques.drawing import Drawing, result

#: What a pixel that does not scatter is after any pass: its own irradiance, and no samples.
LEFT_ALONE = "techniques/none.glsl"


class Canvas(Drawing):
    """The picture: the result, and what every pass is given that has a uniform of that name."""

    def __init__(self, inputs: Inputs, result: gl.Target):
        super().__init__(inputs, inputs.width, inputs.height)
        self.result = result
        names = ("irradiance", "depths", "pixels_per_mm", "image_size", "first_row")
        self.given = {name: getattr(inputs, name) for name in names}
        self._begun: set[int] = set()

    def filter(
        self,
        into: gl.Target,
        shader: str,
        defines: dict[str, Any] | None = None,
        blend: str | None = None,
        reach_mm: float = 0.0,
        **uniforms,
    ) -> None:
        """A pass that leaves light as it is where nothing scatters, and counts no samples there: it
        is drawn where something does. reach_mm: from how far passes after it take light.
        """
        cover = self.inputs.cover
        if cover is None:
            self.draw(into, shader, defines, blend, **uniforms)
            return
        if into.id not in self._begun:
            self._begun.add(into.id)
            self.draw(into, LEFT_ALONE, windows=cover.rest())
        self.draw(into, shader, defines, blend, cover.scattering(reach_mm), **uniforms)


@dataclass(frozen=True)
class ScreenTechnique(Technique):
    """A filter of the screen. Override `uniforms` (and `defines`), or `passes` for several."""

    shader: ClassVar[str] = ""  # relative to renderer/; by default techniques/NAME.glsl

    def file(self) -> str:
        """The technique's shader."""
        return self.shader or f"techniques/{self.name}.glsl"

    def defines(self) -> dict[str, Any]:
        """What the shader is compiled with."""
        return {}

    def uniforms(self, inputs: Inputs) -> dict[str, Any]:
        """What the shader takes beside irradiance, depths and pixels_per_mm."""
        return {}

    def passes(self, canvas: Canvas) -> None:
        """Draw into canvas.result."""
        uniforms = self.uniforms(canvas.inputs)
        canvas.filter(canvas.result, self.file(), self.defines(), **uniforms)

    def draw(self, canvas: Canvas) -> None:
        """Draw into canvas.result: the passes once; a base that needs them oftener overrides it."""
        self.passes(canvas)

    def scatter(self, inputs: Inputs) -> Scattered:
        with result(inputs) as target, Canvas(inputs, target) as canvas:
            self.draw(canvas)
        return Scattered(target)
