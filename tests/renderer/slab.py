"""A flat slab under a straight edge of light: what a technique answers, in millimetres."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np

import renderer
from renderer import gl
from renderer.techniques.base import Inputs
from stimuli import scenes

SIZE = (640, 360)
BALL = {
    "objects": {"ball": {"shape": "sphere", "radius_mm": 40.0}},
    "materials": {"ball": {"medium": "deon_luebke"}},
    "lights": {"sun": {"direction": [0.5, 0.4, 0.8], "irradiance": [3.0, 3.0, 3.0]}},
    "environment": {"ambient": [0.2, 0.2, 0.2]},
    "camera": {"framing": "ball", "height_mm": 100.0, "angle": "front"},
}


class Bare:
    """A context and its programs, without a scene."""

    def __init__(self):
        self.context = gl.Context()
        self._programs = {}

    def program(self, fragment, defines=None):
        key = (fragment, tuple(sorted((defines or {}).items())))
        if key not in self._programs:
            self._programs[key] = gl.Program(fragment, defines=defines)
        return self._programs[key]

    def flat(self, light, curve, depth_mm=400.0, pixels_per_mm=1800.0):
        """Inputs of a picture that faces the camera: light (H, W, 3), depth_mm one or (H, W)."""
        self.context.make_current()
        height, width = light.shape[:2]
        colour = np.dstack([light, np.ones((height, width))]).astype(np.float32)
        depth = np.zeros((height, width, 4), np.float32)
        depth[..., 0] = depth_mm
        textures = [
            gl.Texture(width, height, gl.GL.GL_RGBA32F, data=np.ascontiguousarray(data[::-1]))
            for data in (colour, depth)
        ]
        size = (width, height, pixels_per_mm)
        return Inputs(self.context, self.program, *textures, *size, 1, curve)


def scatter(technique, inputs):
    """Scattered irradiance (H, W, 3) and samples and contrast (H, W, ...), row 0 at the top."""
    with technique.scatter(inputs).target as target:
        light, count = (texture.read().copy() for texture in target.textures)
    return light[..., :3], count


@contextmanager
def drawn(table, size=(48, 48)):
    """A frame of a scene's table, under its lamps."""
    graph = scenes.stage(scenes.read_scene(table)).graph
    with (
        renderer.Renderer(graph, size, 1, rays=8, shadow_map=256) as drawing,
        drawing.frame() as frame,
    ):
        yield frame


def frame_of_ball(size):
    """A frame of a ball alone, under one lamp."""
    return drawn(BALL, size)


def edge_response(drawing, technique, curve, pixels_per_mm, depth_mm, tilt_deg=0.0):
    """(u (W,), mean (W, 3), standard error (W, 3)) of light where u < 0, u in mm along the slab.

    The slab is turned about the edge by tilt_deg. Means are over the rows, whose rotations differ.
    """
    width, height = SIZE
    x = np.arange(width) + 0.5 - width / 2
    tangent = np.tan(np.radians(tilt_deg))
    depth = depth_mm / (1 - x / pixels_per_mm * tangent)
    u = x * depth / pixels_per_mm / np.cos(np.radians(tilt_deg))
    light = np.ones((height, width, 4), np.float32)
    light[..., :3] = (u < 0)[None, :, None]
    place = np.zeros((height, width, 4), np.float32)
    place[..., 0] = depth
    place[..., 1] = -np.sin(np.radians(tilt_deg))
    place[..., 3] = np.cos(np.radians(tilt_deg))
    drawing.context.make_current()
    textures = [gl.Texture(width, height, gl.GL.GL_RGBA32F, data=data) for data in (light, place)]
    inputs = Inputs(
        drawing.context, drawing.program, *textures, width, height, pixels_per_mm, 1, curve
    )
    with technique.scatter(inputs).target as target:
        got = target.textures[0].read()[..., :3].astype(float)
    rows = got[40:-40]
    return u, rows.mean(axis=0), rows.std(axis=0) / np.sqrt(len(rows))


def width_mm(u, response, low=0.1, high=0.9):
    """Width of an edge between two shares of its height, mm: (3,)."""
    widths = []
    for c in range(response.shape[1]):
        falling = np.minimum.accumulate(response[:, c])
        places = [np.interp(-share, -falling, u) for share in (high, low)]
        widths.append(places[1] - places[0])
    return np.array(widths)


def rms(u, response, curve, reach_mm):
    """rms over distance between a response and the curve's own answer, within reach: (3,)."""
    near = np.abs(u) < reach_mm
    miss = (response - curve.edge(u))[near]
    return np.sqrt(np.trapezoid(miss**2, u[near], axis=0) / np.ptp(u[near]))


def lit(frame, light, medium=1):
    """What a technique over surfaces is given when their light is `light`, whatever the lamps are.

    light: places (..., 3) in mm in the world -> irradiance (..., 3). Atlases and points get it.
    """
    inputs = frame.inputs(False, medium=medium)
    room = inputs.room

    def placed(*args, **options):
        target = room.placed(*args, **options)
        place, e = target.textures[5].read(), target.textures[0].read().copy()
        e[..., :3] = light(place[..., :3])
        height, width = e.shape[:2]
        target.textures[0].delete()
        target.textures[0] = gl.Texture(width, height, gl.GL.GL_RGBA32F, data=e[::-1])
        dark = np.zeros((height, width, 4), np.float32)
        target.textures[4].delete()
        target.textures[4] = gl.Texture(width, height, gl.GL.GL_RGBA32F, data=dark)
        return target

    return replace(inputs, room=replace(room, placed=placed))


def behind_cartilage(inputs, share):
    """Inputs of surfaces about the origin that are an ear, whose cartilage stops a share."""
    flesh, stops = inputs.room.flesh, {"ear_l": np.zeros(3), "cartilage": share}
    return replace(inputs, room=replace(inputs.room, flesh=lambda drawn: flesh(drawn) | stops))


def places(frame):
    """Where the pixels' surfaces lie: (H, W, 3) mm in the world, and which scatter (H, W)."""
    height, width = frame.height, frame.width
    depth = frame.surface.textures[3].read()[..., 0]
    x, y = (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    corners = np.stack([*np.meshgrid(x, y), np.ones((height, width))], axis=-1)
    rays = corners @ frame.view.rays().T
    return frame.view.eye + rays * depth[..., None], frame.surface.textures[0].read()[..., 3] > 0


def slab_table(height_mm, tilt_deg=0.0, target_mm=(0.0, 0.0, 10.0), **material):
    """A scene: a slab of 24 mm before a camera that sees height_mm of it."""
    slab = {"shape": "slab", "size_mm": [24.0, 24.0, 20.0], "rotation_deg": [0.0, tilt_deg, 0.0]}
    return {
        "objects": {"slab": slab},
        "materials": {"slab": {"medium": "deon_luebke", "albedo": [1.0, 1.0, 1.0], **material}},
        "environment": {"ambient": [1.0, 1.0, 1.0]},
        "camera": {
            "framing": "slab",
            "height_mm": height_mm,
            "angle": "front",
            "target_mm": list(target_mm),
        },
    }


def surface_response(
    technique, light, tilt_deg=0.0, size=(240, 60), height_mm=5.0, within_mm=8.0, **material
):
    """(u (W,), mean (W, 3), standard error (W, 3)) as `edge_response`, for a technique over the
    surfaces of a scene: a slab of 24 mm under light(u), u in mm along it. Rows near its top and
    bottom do not count.

    material: what goes over the slab's own.
    """
    turn = np.radians(tilt_deg)
    along, normal = np.array(
        [[np.cos(turn), 0.0, -np.sin(turn)], [np.sin(turn), 0.0, np.cos(turn)]]
    )
    table = slab_table(height_mm, tilt_deg, (10.0 * normal).tolist(), **material)

    def given(place):
        return np.repeat(light(place @ along)[..., None], 3, axis=-1)

    graph = scenes.stage(scenes.read_scene(table)).graph
    with renderer.Renderer(graph, size, 1, rays=8, shadow_map=64) as drawing:
        with drawing.frame() as frame:
            with technique.scatter(lit(frame, given)).target as target:
                got = target.textures[0].read()[..., :3].astype(float)
            where, _ = places(frame)
    rows = got[10:-10]
    u = (where @ along)[size[1] // 2]
    near = np.abs(u) < within_mm
    return u[near], rows.mean(axis=0)[near], rows.std(axis=0)[near] / np.sqrt(len(rows))


RAMP_MM = 0.073  # as wide as a texel of 1024 of the slab's atlas


def edge(u):
    """Light where u < 0, over a ramp."""
    return np.clip(0.5 - u / RAMP_MM, 0, 1)


def stripes(u, stripe_mm=1.0):
    """Bright and dark stripes, a bright one about 0, over ramps."""
    return edge(np.abs(np.mod(u + stripe_mm, 2 * stripe_mm) - stripe_mm) - stripe_mm / 2)


def left(u, response, stripe_mm=1.0):
    """Amplitude (3,) that is left of stripes, from the middles of bright and dark ones."""
    phase = np.mod(u / stripe_mm + 0.5, 2.0)
    middle = np.abs(np.mod(phase, 1.0) - 0.5) < 0.06
    bright, dark = (response[middle & side].mean(axis=0) for side in (phase < 1, phase >= 1))
    return bright - dark


def left_of(edge_of, stripe_mm=1.0, reach_mm=60.0):
    """As `left`, of a kernel whose answer to an edge is edge_of (N,) mm -> (N, 3)."""
    n = np.arange(-reach_mm, reach_mm + 1)[:, None]
    sides = stripe_mm * (2 * n + [[-0.5, 0.5]])
    return sum(
        sign * (edge_of(x - sides[:, 1]) - edge_of(x - sides[:, 0])).sum(axis=0)
        for x, sign in ((0.0, 1), (stripe_mm, -1))
    )


def surface_edge_response(technique, tilt_deg=0.0, size=(240, 60), height_mm=5.0, **material):
    """`surface_response` to an edge of light where u < 0."""
    return surface_response(technique, edge, tilt_deg, size, height_mm, **material)
