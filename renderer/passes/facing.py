"""Which lamps can matter to which triangles, so that no shadow is looked up for the others.

A software driver computes both sides of every branch: what a lamp gives to skin that faces away
from it is looked up 48 times all the same, and thrown away. Triangles are therefore drawn in groups
that share their lamps. What is left out adds exactly nothing, so that all values stay the same to
the bit; `tests/renderer/test_facing.py` holds it to that.

All bounds are those of a triangle's interpolated normal: the sum of its corners' normals with
weights of at least 0, whose length is at most 1, looks no more than the most of them in any
direction, as long as that is less than nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from renderer.scene.lights import Light, PointLight

MARGIN = 1e-3  # of a cosine: far above the rounding of a shader
HORIZON = 0.08  # a lamp lights skin that turns away from it by so much more (passes/skin.frag)


@dataclass(frozen=True)
class Group:
    """Triangles (M, 3) of a surface, and the numbers of the lamps that matter to them."""

    faces: np.ndarray
    lamps: tuple[int, ...]


class Corners:
    """A surface's triangles in the world.

    positions, normals (N, 3): mm, unit length; faces (M, 3).
    """

    def __init__(self, positions: np.ndarray, normals: np.ndarray, faces: np.ndarray):
        self.faces = faces
        self._at = positions[faces]
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        self._normals = (normals / np.maximum(lengths, 1e-12))[faces]
        self._middle = self._at.mean(axis=1)
        self._reach = np.linalg.norm(self._at - self._middle[:, None], axis=2).max(axis=1)

    def _towards(self, light: Light) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of each triangle the cosines (M, 3) of its corners' normals with the way to a lamp, how
        far they may be off (M,), and the sine of half of the lamp at most (M,).
        """
        if not isinstance(light, PointLight):
            cosines = self._normals @ light.towards
            tangent = np.tan(np.radians(light.radius_deg))
            still = np.full(len(self.faces), MARGIN)
            return cosines, still, np.full(len(self.faces), tangent / np.hypot(1.0, tangent))
        to_lamp = light.place - self._middle
        distance = np.linalg.norm(to_lamp, axis=1)
        to_lamp /= np.maximum(distance, 1e-9)[:, None]
        cosines = np.einsum("mci,mi->mc", self._normals, to_lamp)
        nearest = np.maximum(distance - self._reach, 1e-9)
        sine = light.radius_mm / np.hypot(light.radius_mm, nearest)
        return cosines, MARGIN + 2.0 * self._reach / nearest, sine

    def lit(self, lights: Sequence[Light]) -> np.ndarray:
        """Whether each lamp can light each triangle from its front (lamps, M)."""
        can = np.empty((len(lights), len(self.faces)), bool)
        for k, light in enumerate(lights):
            cosines, off, sine = self._towards(light)
            can[k] = cosines.max(axis=1) + off > -np.minimum(sine, 0.999) - HORIZON
        return can

    def lit_through(self, lights: Sequence[Light], wrap: float) -> np.ndarray:
        """Whether light of each lamp can come through each triangle (lamps, M). wrap: added to the
        cosine, see `renderer.optics.transmittance.Translucency`.
        """
        can = np.empty((len(lights), len(self.faces)), bool)
        for k, light in enumerate(lights):
            cosines, off, _ = self._towards(light)
            can[k] = light.shadow & (cosines.min(axis=1) - off < max(wrap, 0.0))
        return can

    def behind(self, eye: np.ndarray) -> np.ndarray:
        """Which triangles show their back to an eye at (3,) mm, whose normals shaders may turn
        (M,).
        """
        across = np.cross(self._at[:, 1] - self._at[:, 0], self._at[:, 2] - self._at[:, 0])
        towards = np.einsum("mi,mi->m", across, eye - self._at[:, 0])
        scale = np.linalg.norm(across, axis=1) * np.linalg.norm(eye - self._at[:, 0], axis=1)
        return towards <= MARGIN * scale


def groups(faces: np.ndarray, can: np.ndarray) -> list[Group]:
    """Triangles (M, 3) by the lamps that matter to them, can (lamps, M); in their order within a
    group.
    """
    if not can.size:
        return [Group(faces, ())]
    kinds, number = np.unique(can, axis=1, return_inverse=True)
    return [
        Group(faces[number.ravel() == k], tuple(np.flatnonzero(kind).tolist()))
        for k, kind in enumerate(kinds.T)
    ]
