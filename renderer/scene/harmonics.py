"""Spherical harmonics of an environment: nine coefficients, and the irradiance that they give.

Ramamoorthi and Hanrahan 2001, "An efficient representation for irradiance environment maps",
doi:10.1145/383259.383317; Rohat 2012, sec. 4.4 and 5.3. Real harmonics of degree 0 to 2 in the
order 00, 1-1, 10, 11, 2-2, 2-1, 20, 21, 22, over the axes of scenes: x towards the person's left, y
up, z where heads look. Y_1^-1 goes with y and Y_1^1 with x (Rohat's eq. 4.8 has them exchanged).
"""

from __future__ import annotations

import numpy as np

from renderer.scene.lights import Environment
from renderer.scene.maps import directions, solid_angles, turn

NAMES = ("L00", "L1-1", "L10", "L11", "L2-2", "L2-1", "L20", "L21", "L22")
#: What a clamped cosine keeps of each degree: pi, 2 pi / 3, pi / 4 (eq. 8).
COSINE = np.array([np.pi, *3 * [2 * np.pi / 3], *5 * [np.pi / 4]])


def basis(directions) -> np.ndarray:
    """The nine functions at unit directions: (..., 3) -> (..., 9)."""
    d = np.asarray(directions, float)
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    one = np.sqrt(3 / (4 * np.pi))
    two = np.sqrt(15 / (4 * np.pi))
    return np.stack(
        [
            np.full(x.shape, np.sqrt(1 / (4 * np.pi))),
            one * y,
            one * z,
            one * x,
            two * x * y,
            two * y * z,
            np.sqrt(5 / (16 * np.pi)) * (3 * z**2 - 1),
            two * x * z,
            0.5 * two * (x**2 - y**2),
        ],
        axis=-1,
    )


def project(radiance: np.ndarray) -> np.ndarray:
    """Coefficients (9, C) of a map of latitude and longitude (H, 2 H, C), rows from the zenith.

    L = integral of radiance times Y over the sphere (eq. 3), texel by texel with each one's solid
    angle; a constant radiance of 1 has L00 = sqrt(4 pi).
    """
    height = radiance.shape[0]
    weighted = basis(directions(height)) * solid_angles(height)[..., None]
    return np.einsum("hwk,hwc->kc", weighted, np.asarray(radiance, float))


def irradiance(coefficients: np.ndarray, normals) -> np.ndarray:
    """Irradiance at unit normals from coefficients (9, C): (..., 3) -> (..., C), eq. 5."""
    return (basis(normals) * COSINE) @ np.asarray(coefficients, float)


def turned(coefficients: np.ndarray, degrees: float) -> np.ndarray:
    """Coefficients (9, C) of the environment turned about y towards the person's left."""
    rng = np.random.default_rng(0)
    d = rng.normal(size=(64, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    back = d @ turn(Environment(turn_deg=degrees)).T
    # degrees do not mix, so that the nine functions of turned directions are exact sums of nine
    matrix = np.linalg.lstsq(basis(d), basis(back), rcond=None)[0]
    return matrix @ coefficients
