"""What a technique is given: the light that enters one medium, over any domain."""

from __future__ import annotations

from collections.abc import Callable

from renderer import gl


def draw_given(
    context: gl.Context,
    programs: Callable[..., gl.Program],
    into: gl.Target,
    irradiance: gl.Texture,
    transmitted: gl.Texture | None,
    albedo: gl.Texture,
    medium: int,
    texturing: float,
    first_row: int = 0,
) -> None:
    """Draw irradiance with alpha 1 where the medium scatters, 0 elsewhere.

    medium: the id in irradiance's alpha; transmitted: light that is added to it (Jimenez et al.
    2010: before scattering, not shadowed); texturing: times the albedo to this power; first_row: of
    what is drawn, among the rows of the textures.
    """
    into.bind()
    programs("passes/given.frag").use(
        irradiance=irradiance,
        transmitted=transmitted or irradiance,
        albedo=albedo,
        medium=float(medium),
        through=float(transmitted is not None),
        texturing=texturing,
        first_row=first_row,
    )
    gl.draw_fullscreen(context)
