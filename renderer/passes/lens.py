"""Depth of field: a thin lens over a finished picture, the same for every technique."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.scene.camera import Camera


@dataclass(frozen=True)
class Confusion:
    """spread: the radius in pixels of the disc that a point infinitely far behind the focus makes;
    focus_mm: the distance that is sharp; subject_mm: that of the camera's target.
    """

    spread: float
    focus_mm: float
    subject_mm: float


def confusion(camera: Camera, height: int) -> Confusion | None:
    """What a camera's lens does in a picture of a height in pixels; None for a pinhole.

    For a lens of focal length f at f-number N focused at s, a point at d makes a disc of diameter
    f^2 / (N (s - f)) * |d - s| / d on the sensor (Potmesil and Chakravarty 1981).
    """
    if not camera.f_number:
        return None
    focal = 0.5 * camera.sensor_mm / np.tan(np.radians(camera.fov_y_deg) / 2)
    focus = camera.distance_mm - camera.focus_mm
    diameter = focal**2 / (camera.f_number * max(focus - focal, 1.0))
    spread = 0.5 * diameter / camera.sensor_mm * height
    return Confusion(float(spread), float(focus), float(camera.distance_mm))


def through_lens(
    context: gl.Context,
    programs: Callable[..., gl.Program],
    picture: np.ndarray,
    surface: gl.Target,
    lens: Confusion,
    grain: float,
    supersample: int,
    largest: float = 24.0,
) -> np.ndarray:
    """The picture (H, W, 3) float32 in linear display light as sRGB in [0, 1] through a lens.

    surface: the frame's buffers, for depth and for what hair hides. Discs are cut off at `largest`
    pixels, where 48 taps would show.
    """
    height, width, _ = picture.shape
    _, specular, _, depths = surface.textures
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = picture
    texture = gl.Texture(width, height, GL.GL_RGBA16F, data=np.ascontiguousarray(rgba[::-1]))
    with (
        gl.Target(width, height, [GL.GL_RGBA32F]) as discs,
        gl.Target(width, height, [GL.GL_RGBA32F]) as final,
    ):
        discs.bind()
        programs("passes/confusion.frag").use(
            depths=depths,
            specular=specular,
            factor=supersample,
            spread=lens.spread,
            focus_mm=lens.focus_mm,
            subject_mm=lens.subject_mm,
            largest=largest,
        )
        gl.draw_fullscreen(context)
        final.bind()
        programs("passes/lens.frag").use(
            picture=texture,
            confusion=discs.textures[0],
            largest=min(lens.spread, largest),
            grain=grain,
        )
        gl.draw_fullscreen(context)
        image = final.textures[0].read()[..., :3].copy()
    texture.delete()
    return image
