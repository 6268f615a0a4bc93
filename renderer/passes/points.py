"""Points on a surface as lists in textures: triangles, weights, corners, attributes of vertices.

A fragment shader looks its own point up and is drawn over the whole of a target: software
rasterisers would shade a block of fragments for every single point that was drawn as one.
"""

from __future__ import annotations

import numpy as np

from renderer import gl
from renderer.gl import GL

COLUMNS = 1024  # points a row
WIDTH = 2048  # texels a row of the lists of triangles and vertices
MOST_TRIANGLES = 2**24  # what single precision counts exactly


class Points:
    """Points of triangles (K,) with barycentric weights (K, 3); delete() frees them.

    size: (width, height) of the target that has a texel a point, row by row from below.
    """

    def __init__(
        self, lists: SurfaceLists, faces: np.ndarray, weights: np.ndarray, columns: int = COLUMNS
    ):
        self.count = len(faces)
        self.size = (columns, -(-self.count // columns))
        texels = np.full((self.size[1] * columns, 4), -1, np.float32)
        texels[: self.count, 0] = faces
        texels[: self.count, 1:] = weights
        self._lists = lists
        self._list = gl.Texture(
            *self.size, GL.GL_RGBA32F, data=texels.reshape(self.size[1], columns, 4)
        )
        self._mesh = gl.Mesh({}, vertices=self.count)

    def uniforms(self) -> dict:
        """What passes/points.glsl reads."""
        lists = {"corner_list": self._lists.corners, "vertex_list": self._lists.vertices}
        return {"point_list": self._list, **lists}

    def draw(self) -> None:
        """A vertex a point, without attributes, in their order."""
        self._mesh.draw()

    def delete(self) -> None:
        self._list.delete()
        self._mesh.delete()


class SurfaceLists:
    """A surface's corners and vertices: attributes (location -> (N, k)), faces (M, 3)."""

    def __init__(self, attributes: dict[int, np.ndarray], faces: np.ndarray):
        columns = np.column_stack([attributes[where] for where in sorted(attributes)])
        self.corners, self.vertices = _list(faces), _list(columns)


def _list(table: np.ndarray) -> gl.Texture:
    """A table (N, k) as texels, row by row, each row filled up to whole texels."""
    rows, columns = table.shape
    whole = -(-columns // 4)
    texels = np.zeros((-(-rows * whole // WIDTH) * WIDTH, 4), np.float32)
    texels[: rows * whole].reshape(rows, whole * 4)[:, :columns] = table
    return gl.Texture(WIDTH, len(texels) // WIDTH, GL.GL_RGBA32F, data=texels.reshape(-1, WIDTH, 4))
