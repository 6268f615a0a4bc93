"""OpenGL by name: context, program, texture, target, mesh. Everything raises."""

from renderer.gl.clock import Clock, Pass, timed
from renderer.gl.context import GL, PLATFORMS, Context
from renderer.gl.mesh import Mesh, draw_fullscreen, finish
from renderer.gl.program import Program, source
from renderer.gl.texture import DepthArray, Target, Texture, TextureArray, draw_nothing

__all__ = [
    "GL",
    "PLATFORMS",
    "Clock",
    "Context",
    "DepthArray",
    "Mesh",
    "Pass",
    "Program",
    "Target",
    "Texture",
    "TextureArray",
    "draw_fullscreen",
    "draw_nothing",
    "finish",
    "source",
    "timed",
]
