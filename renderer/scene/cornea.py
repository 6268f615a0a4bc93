"""The shape of an eye's front: a sphere with the cornea's steeper cap."""

from __future__ import annotations

import numpy as np

CORNEA_RADIUS_MM = 7.8  # of curvature of its front; Gullstrand's schematic eye
LIMBUS_RAD = 0.035  # over which the cap goes over into the ball


def cap_mm(radius: float, iris: float) -> float:
    """How far before the ball's centre the middle of the cornea's sphere lies: it meets the ball at
    the limbus, `iris` from the axis.
    """
    return float(np.sqrt(radius**2 - iris**2) - np.sqrt(CORNEA_RADIUS_MM**2 - iris**2))


def reach(cosine: np.ndarray, radius: float, iris: float) -> np.ndarray:
    """Distance of the surface from the centre along rays with a cosine to the gaze, mm."""
    cap = cap_mm(radius, iris)
    cosine = np.asarray(cosine, float)
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    bulge = cap * cosine + np.sqrt(np.maximum(CORNEA_RADIUS_MM**2 - (cap * sine) ** 2, 0))
    away = np.arccos(np.clip(cosine, -1, 1)) - np.arcsin(iris / radius)
    blend = 1 / (1 + np.exp(np.clip(away / (0.5 * LIMBUS_RAD), -50, 50)))
    return radius + np.maximum(bulge - radius, 0) * blend


def normals(directions: np.ndarray, gaze: np.ndarray, radius: float, iris: float) -> np.ndarray:
    """Unit normals (N, 3) of the surface along unit directions (N, 3) from the centre."""
    cosine = np.asarray(directions, float) @ gaze
    step = 1e-4
    low, high = np.clip(cosine - step, -1, 1), np.clip(cosine + step, -1, 1)
    slope = (reach(high, radius, iris) - reach(low, radius, iris)) / (high - low)
    # of r(u) u: r u less the part of r's gradient that lies in the sphere
    r = reach(cosine, radius, iris)[:, None]
    across = slope[:, None] * (gaze - cosine[:, None] * directions)
    normal = r * directions - across
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)
