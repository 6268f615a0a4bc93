"""A flat slab under a straight edge of light: what a technique answers, in millimetres."""

import numpy as np

from renderer import gl
from renderer.techniques.base import Inputs

SIZE = (640, 360)


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
    found = []
    for c in range(response.shape[1]):
        falling = np.minimum.accumulate(response[:, c])
        places = [np.interp(-share, -falling, u) for share in (high, low)]
        found.append(places[1] - places[0])
    return np.array(found)


def rms(u, response, curve, reach_mm):
    """rms over distance between a response and the curve's own answer, within reach: (3,)."""
    near = np.abs(u) < reach_mm
    miss = (response - curve.edge(u))[near]
    return np.sqrt(np.trapezoid(miss**2, u[near], axis=0) / np.ptp(u[near]))
