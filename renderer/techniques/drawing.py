"""What the passes of a technique draw with: its result, and targets that live as long as a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Self

from renderer import gl
from renderer.gl import GL
from renderer.passes.surfaces import Drawn
from renderer.techniques.base import Inputs, Room
from renderer.techniques.cover import Window

#: Of every technique's result: scattered irradiance, then samples and contrast.
RESULT_FORMATS = (GL.GL_RGBA32F, GL.GL_RG16F)


@contextmanager
def result(inputs: Inputs, depth: gl.Target | None = None) -> Iterator[gl.Target]:
    """A technique's result, freed if drawing it fails; depth: a target whose depth it shares."""
    made = gl.Target(inputs.width, inputs.height, list(RESULT_FORMATS), depth=depth or False)
    try:
        yield made
    except BaseException:
        made.delete()
        raise


def draw_kept(
    inputs: Inputs, room: Room, surfaces: Iterable[Drawn], into: gl.Target, domain: str = "SCREEN"
) -> None:
    """Draw the share that lids, lips and ears leave of what comes through to places on surfaces.

    domain: where they are seen, of a target that shares the depth of what is seen; "ATLAS": their
    atlas.
    """
    into.bind(clear=(1.0, 1.0, 1.0, 1.0))
    into.bind(depth_test=domain == "SCREEN")
    GL.glDepthMask(False)
    program = inputs.programs("passes/kept.frag", {"DOMAIN": domain}, vertex="passes/surface.vert")
    for drawn in surfaces:
        own = {**room.camera, "model": drawn.item.pose, **room.flesh(drawn)}
        program.use(**program.accepts(own))
        drawn.mesh.draw()


class Drawing:
    """Passes over the whole of targets of one size; use it as a context manager.

    What `given` names is handed to every shader that has a uniform of that name.
    """

    def __init__(self, inputs: Inputs, width: int, height: int, linear: bool = False):
        self.inputs, self.width, self.height, self.linear = inputs, width, height, linear
        self.given: dict[str, Any] = {}
        self._owned: list[gl.Target] = []

    def target(self, *formats: int) -> gl.Target:
        """A target of that size, RGBA32F by default; freed when the run ends."""
        formats = formats or (GL.GL_RGBA32F,)
        made = gl.Target(self.width, self.height, list(formats), linear=self.linear)
        self._owned.append(made)
        return made

    def draw(
        self,
        into: gl.Target,
        shader: str,
        defines: dict[str, Any] | None = None,
        blend: str | None = None,
        windows: list[Window] | None = None,
        **uniforms,
    ) -> None:
        """One pass over the whole of a target, or over windows of it."""
        program = self.inputs.programs(shader, defines)
        with gl.timed(self.inputs.context, shader):
            into.bind(blend=blend)
            program.use(**{**program.accepts(self.given), **uniforms})
            gl.draw_fullscreen(self.inputs.context, windows)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        for target in self._owned:
            target.delete()
