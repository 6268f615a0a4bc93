"""The base of techniques that filter the screen's irradiance.

It owns targets, binding and drawing: a technique of one pass is its parameters, its uniforms and
its shader, techniques/NAME.glsl; one of several passes overrides `passes`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar

from renderer import gl
from renderer.gl import GL
from renderer.techniques.base import Inputs, Scattered, Technique

#: Of every technique's result: scattered irradiance, then samples and contrast.
FORMATS = (GL.GL_RGBA32F, GL.GL_RG16F)


def output_formats() -> list[int]:
    """Formats of a technique's result."""
    return list(FORMATS)


class Canvas:
    """What the passes of one run draw with: the result's target, and others that live as long."""

    def __init__(self, inputs: Inputs):
        self.inputs = inputs
        self.result = gl.Target(inputs.width, inputs.height, output_formats())
        self._scratch: list[gl.Target] = []

    def target(self, *formats: int) -> gl.Target:
        """Another target of the same size, RGBA32F by default; freed when the run ends."""
        made = gl.Target(self.inputs.width, self.inputs.height, list(formats) or [GL.GL_RGBA32F])
        self._scratch.append(made)
        return made

    def draw(
        self,
        into: gl.Target,
        shader: str,
        defines: dict[str, Any],
        blend: str | None = None,
        **uniforms,
    ) -> None:
        """One pass over the whole of a target; irradiance and depth are always given."""
        into.bind(blend=blend)
        program = self.inputs.programs(shader, defines)
        shared = {
            "irradiance": self.inputs.irradiance,
            "depths": self.inputs.depths,
            "pixels_per_mm": self.inputs.pixels_per_mm,
        }
        program.use(**program.accepts(shared), **uniforms)
        gl.draw_fullscreen(self.inputs.context)

    @contextmanager
    def run(self) -> Iterator[Canvas]:
        try:
            yield self
        except BaseException:
            self.result.delete()
            raise
        finally:
            for target in self._scratch:
                target.delete()


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
        canvas.draw(canvas.result, self.file(), self.defines(), **uniforms)

    def scatter(self, inputs: Inputs) -> Scattered:
        with Canvas(inputs).run() as canvas:
            self.passes(canvas)
        return Scattered(canvas.result)
