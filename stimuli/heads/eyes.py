"""Eyeballs: a sphere with the cornea's steeper cap, turned to the gaze."""

from __future__ import annotations

import numpy as np

from renderer.scene import Eye
from stimuli.heads.anatomy import Eyeball
from stimuli.heads.person import Eyes
from stimuli.heads.subdivide import vertex_normals

CORNEA_RADIUS_MM = 7.8  # of curvature; Gullstrand's schematic eye
LID_CONTACT_MM = (
    0.3  # the ball is that much larger than the base mesh's, so that the lids lie on it
)
RINGS, SEGMENTS = 96, 96


def eyeball(ball: Eyeball, own: Eyes | None = None) -> Eye:
    """An eye of SEGMENTS x RINGS vertices; rings crowd towards the cornea."""
    own = own or Eyes()
    radius, iris = ball.radius + LID_CONTACT_MM, own.iris_mm
    plane = np.sqrt(radius**2 - iris**2)
    cap = plane - np.sqrt(CORNEA_RADIUS_MM**2 - iris**2)
    theta = np.pi * np.linspace(0, 1, RINGS) ** 1.5 * 0.999 + 1e-4
    phi = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    # distance from the centre along a ray at angle theta: the sphere, or the cornea's sphere about
    # (0, 0, cap)
    cosine = np.cos(theta)
    bulge = cap * cosine + np.sqrt(np.maximum(CORNEA_RADIUS_MM**2 - (cap * np.sin(theta)) ** 2, 0))
    limbus = np.arcsin(iris / radius)
    blend = 1 / (1 + np.exp((theta - limbus) / 0.02))
    r = radius + np.maximum(bulge - radius, 0) * blend
    local = np.stack(
        [
            np.outer(np.sin(theta) * r, np.cos(phi)),
            np.outer(np.sin(theta) * r, np.sin(phi)),
            np.outer(cosine * r, np.ones(SEGMENTS)),
        ],
        axis=2,
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(RINGS - 1), np.arange(SEGMENTS), indexing="ij")
    a, b = i * SEGMENTS + j, i * SEGMENTS + (j + 1) % SEGMENTS
    c, d = a + SEGMENTS, b + SEGMENTS
    faces = np.concatenate(
        [np.stack([a, c, b], axis=2).reshape(-1, 3), np.stack([b, c, d], axis=2).reshape(-1, 3)]
    )
    y = np.radians(own.gaze_yaw_deg)
    turn = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    positions = local @ turn.T + ball.centre
    return Eye(
        positions.astype(np.float32),
        vertex_normals(positions, faces).astype(np.float32),
        faces.astype(np.uint32),
        ball.centre,
        turn @ np.array([0.0, 0.0, 1.0]),
        radius,
        iris,
        {name: getattr(own, name) for name in ("iris", "fibres", "collarette", "sclera")},
    )
