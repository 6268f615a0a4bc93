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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from renderer.memory import parts
from renderer.scene.lights import Light, PointLight

MARGIN = 1e-3  # of a cosine: far above the rounding of a shader
HORIZON = 0.08  # a lamp lights skin that turns away from it by so much more (passes/skin.frag)
AT_ONCE = 16384  # triangles


@dataclass(frozen=True)
class Group:
    """Triangles (M, 3) of a surface, and the numbers of the lamps that matter to them."""

    faces: np.ndarray
    lamps: tuple[int, ...]


class Corners:
    """A surface's triangles in the world, gone through in parts: kept as corners they would take
    ten times the mesh.

    positions, normals (N, 3): mm, unit length; faces (M, 3).
    """

    def __init__(self, positions: np.ndarray, normals: np.ndarray, faces: np.ndarray):
        self.faces, self._positions = faces, positions
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        self._normals = normals / np.maximum(lengths, 1e-12)

    def _parts(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """Of some triangles which they are, and their corners and their normals (K, 3, 3)."""
        for part in parts(len(self.faces), AT_ONCE):
            faces = self.faces[part]
            yield part, self._positions[faces], self._normals[faces]

    def lit(self, lights: Sequence[Light]) -> np.ndarray:
        """Whether each lamp can light each triangle from its front (lamps, M)."""
        can = np.empty((len(lights), len(self.faces)), bool)
        for part, at, normals in self._parts():
            for k, light in enumerate(lights):
                cosines, off, sine = _towards(light, at, normals)
                can[k, part] = cosines.max(axis=1) + off > -np.minimum(sine, 0.999) - HORIZON
        return can

    def lit_through(self, lights: Sequence[Light], wrap: float) -> np.ndarray:
        """Whether light of each lamp can come through each triangle (lamps, M). wrap: added to the
        cosine, see `renderer.optics.transmittance.Translucency`.
        """
        can = np.empty((len(lights), len(self.faces)), bool)
        for part, at, normals in self._parts():
            for k, light in enumerate(lights):
                cosines, off, _ = _towards(light, at, normals)
                can[k, part] = light.shadow & (cosines.min(axis=1) - off < max(wrap, 0.0))
        return can

    def behind(self, eye: np.ndarray) -> np.ndarray:
        """Which triangles show their back to an eye at (3,) mm, whose normals shaders may turn
        (M,).
        """
        backs = np.empty(len(self.faces), bool)
        for part, at, _ in self._parts():
            across = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
            towards = np.einsum("mi,mi->m", across, eye - at[:, 0])
            scale = np.linalg.norm(across, axis=1) * np.linalg.norm(eye - at[:, 0], axis=1)
            backs[part] = towards <= MARGIN * scale
        return backs


def _towards(
    light: Light, at: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of triangles with corners and normals (M, 3, 3) the cosines (M, 3) of their normals with the
    way to a lamp, how far they may be off (M,), and the sine of half of the lamp at most (M,).
    """
    if not isinstance(light, PointLight):
        cosines = normals @ light.towards
        tangent = np.tan(np.radians(light.radius_deg))
        still = np.full(len(at), MARGIN)
        return cosines, still, np.full(len(at), tangent / np.hypot(1.0, tangent))
    middle = at.mean(axis=1)
    reach = np.linalg.norm(at - middle[:, None], axis=2).max(axis=1)
    to_lamp = light.place - middle
    distance = np.linalg.norm(to_lamp, axis=1)
    to_lamp /= np.maximum(distance, 1e-9)[:, None]
    cosines = np.einsum("mci,mi->mc", normals, to_lamp)
    nearest = np.maximum(distance - reach, 1e-9)
    sine = light.radius_mm / np.hypot(light.radius_mm, nearest)
    return cosines, MARGIN + 2.0 * reach / nearest, sine


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
