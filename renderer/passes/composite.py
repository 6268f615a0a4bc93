"""From scattered light to the picture: specular, hair, backdrop, tone map, resolve."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.passes.environment import Surroundings
from renderer.passes.pieces import Piece
from renderer.scene.picture import AGX, BACKDROPS, TONE_MAPS, Picture
from renderer.scene.view import View


def composite(
    context: gl.Context,
    programs: Callable[..., gl.Program],
    scattered: gl.Texture,
    surface: gl.Target,
    picture: Picture,
    view: View,
    surroundings: Surroundings,
    supersample: int,
    texturing: float = 0.0,
    conserving: bool = False,
    piece: Piece | None = None,
    dimmed: tuple[gl.Texture, float] | None = None,
    linear: bool = False,
) -> np.ndarray:
    """The image (H, W, 3) float32 sRGB in [0, 1] of scattered irradiance over a frame's buffers, or
    the rows of it that are right in a piece.

    texturing: the power of the albedo that scattered light has already been multiplied by;
    conserving: the face holds back what it reflects inside; dimmed: specular light without hair and
    the luminance of scattered light at which it is whole, None where it always is; linear: display
    light before it is encoded, for the lens.
    """
    width, height = surface.width, surface.height
    piece = piece or Piece(0, height, 0, height)
    _, specular, albedo, depths = surface.textures
    bare, white = dimmed or (specular, 0.0)
    programs_uniforms = {
        "bare": bare,
        "white": white,
        "scattered": scattered,
        "scattered_row": piece.low - piece.first,
        "image_size": (width, height),
        "first_row": piece.low,
        "specular": specular,
        "albedo": albedo,
        "texturing": texturing,
        "conserving": float(conserving),
        "depths": depths,
        "exposure": picture.exposure,
        "saturation": picture.saturation,
        "power": picture.power,
        **AGX,
        "backdrop_centre": picture.centre,
        "backdrop_edge": picture.edge,
        "aspect": width / height,
        "rays": view.rays(),
        **surroundings.uniforms(),
    }
    chosen = {
        "TONE_MAP": TONE_MAPS.index(picture.tone_map),
        "BACKDROP": BACKDROPS.index(picture.backdrop),
    }
    program = programs("passes/composite.frag", surroundings.defines() | chosen)
    rows = piece.high - piece.low
    size = (width // supersample, rows // supersample)
    with gl.Target(width, rows, [GL.GL_RGBA16F]) as colour:
        colour.bind()
        program.use(**program.accepts(programs_uniforms))
        gl.draw_fullscreen(context)
        with gl.Target(*size, [GL.GL_RGBA32F]) as final:
            final.bind()
            programs("passes/resolve.frag").use(
                colour_map=colour.textures[0],
                factor=supersample,
                grain=picture.grain,
                linear=float(linear),
                first_row=piece.low // supersample,
            )
            gl.draw_fullscreen(context)
            return final.textures[0].read()[..., :3]
