"""The base of techniques of the screen that turn their samples at random from pixel to pixel.

Engines hide what is left of the noise by temporal antialiasing: a new rotation each frame, and the
mean over frames. `frames` does that for a still: nothing moves, so that the mean over frames is
what perfect temporal antialiasing would converge to.
"""

from __future__ import annotations

from dataclasses import dataclass

from renderer import gl
from renderer.gl import GL
from renderer.parameters import parameter
from renderer.techniques.screen import Canvas, ScreenTechnique

GOLDEN = 0.618033988749895  # turns from frame to frame: any run of them is spread evenly
FRAME_FORMATS = (GL.GL_RGBA32F, GL.GL_RGBA32F)  # of the mean: counts too are summed in full


@dataclass(frozen=True)
class RotatedTechnique(ScreenTechnique):
    """A filter of the screen whose shader turns its samples by `rotation()` of rotation.glsl.

    jitter: each pixel has a random rotation of its own (interleaved gradient noise); without it all
    have the same, and the pattern of the samples shows. frames: the mean of this many frames, each
    turned by the golden ratio more than the one before; counts are those of one frame on average.
    """

    jitter: bool = parameter(
        True, source='noise: Jimenez 2014, "Next generation post processing in Call of Duty"'
    )
    frames: int = parameter(
        1, unit="frames", low=1, high=1024, source="temporal antialiasing of a still"
    )

    def draw(self, canvas: Canvas) -> None:
        canvas.given["jitter"] = float(self.jitter)
        canvas.given["turn"] = 0.0
        if self.frames == 1:
            self.passes(canvas)
            return
        size = (canvas.width, canvas.height)
        with gl.Target(*size, list(FRAME_FORMATS)) as mean:
            for k in range(self.frames):
                with gl.Target(*size, list(FRAME_FORMATS)) as one:
                    with Canvas(canvas.inputs, one) as frame:
                        frame.given.update(canvas.given, turn=k * GOLDEN % 1)
                        self.passes(frame)
                    self._add(canvas, one, mean, 1 / self.frames, "add" if k else None)
            self._add(canvas, mean, canvas.result, 1.0, None)

    @staticmethod
    def _add(canvas: Canvas, frame: gl.Target, into: gl.Target, share: float, blend) -> None:
        light, counted = frame.textures
        values = {"light": light, "counted": counted, "share": share}
        canvas.draw(into, "techniques/mean_add.glsl", blend=blend, **values)
