"""Vertex attributes with triangles or points, and what draws without any."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from renderer.gl.context import GL, Context, free, owned


def _delete_vertex_array(name: int) -> None:
    GL.glDeleteVertexArrays(1, [name])


def _delete_buffer(name: int) -> None:
    GL.glDeleteBuffers(1, [name])


#: Indices of triangles that are drawn before the driver is waited for: a software driver keeps
#: half a kilobyte of each until it is done.
AT_ONCE = 3 * 32768


class Mesh:
    """Vertex attributes (location -> (N, k) array) and triangles (M, 3); without these, points.

    vertices: how many, where there are no attributes.
    """

    def __init__(
        self,
        attributes: dict[int, np.ndarray],
        faces: np.ndarray | None = None,
        vertices: int = 0,
    ):
        self.vertices = len(next(iter(attributes.values()))) if attributes else vertices
        self.vertex_array = GL.glGenVertexArrays(1)
        self._handles = [owned(self, self.vertex_array, _delete_vertex_array)]
        GL.glBindVertexArray(self.vertex_array)
        for where, array in attributes.items():
            array = np.ascontiguousarray(array, dtype=np.float32)
            self._buffer(GL.GL_ARRAY_BUFFER, array)
            GL.glEnableVertexAttribArray(where)
            GL.glVertexAttribPointer(where, array.shape[1], GL.GL_FLOAT, False, 0, None)
        self.indices = 0
        if faces is not None:
            faces = np.ascontiguousarray(faces, dtype=np.uint32)
            self.indices = faces.size
            self._buffer(GL.GL_ELEMENT_ARRAY_BUFFER, faces)
        GL.glBindVertexArray(0)

    def _buffer(self, kind: int, array: np.ndarray) -> None:
        name = GL.glGenBuffers(1)
        self._handles.append(owned(self, name, _delete_buffer, array.nbytes))
        GL.glBindBuffer(kind, name)
        GL.glBufferData(kind, array.nbytes, array, GL.GL_STATIC_DRAW)

    def draw(self) -> None:
        GL.glBindVertexArray(self.vertex_array)
        self._triangles(self.indices)
        if not self.indices:
            GL.glDrawArrays(GL.GL_POINTS, 0, self.vertices)
        GL.glBindVertexArray(0)

    def draw_some(self, faces: np.ndarray) -> None:
        """Draw triangles (K, 3) of the mesh's vertices in the stead of its own, and wait: software
        drivers keep what is still to be drawn.
        """
        faces = np.ascontiguousarray(faces, dtype=np.uint32)
        GL.glBindVertexArray(self.vertex_array)
        own = GL.glGetIntegerv(GL.GL_ELEMENT_ARRAY_BUFFER_BINDING)
        name = GL.glGenBuffers(1)
        GL.glBindBuffer(GL.GL_ELEMENT_ARRAY_BUFFER, name)
        GL.glBufferData(GL.GL_ELEMENT_ARRAY_BUFFER, faces.nbytes, faces, GL.GL_STREAM_DRAW)
        self._triangles(faces.size)
        finish()
        GL.glBindBuffer(GL.GL_ELEMENT_ARRAY_BUFFER, own)
        GL.glBindVertexArray(0)
        _delete_buffer(name)

    @staticmethod
    def _triangles(indices: int) -> None:
        for start in range(0, indices, AT_ONCE):
            if start:
                finish()
            count, offset = min(AT_ONCE, indices - start), ctypes.c_void_p(4 * start)
            GL.glDrawElements(GL.GL_TRIANGLES, count, GL.GL_UNSIGNED_INT, offset)

    def delete(self) -> None:
        for handle in self._handles:
            free(handle)


def draw_fullscreen(
    context: Context, windows: Sequence[tuple[int, int, int, int]] | None = None
) -> None:
    """One triangle over the bound target; windows (x, y, width, height): over these parts alone,
    where fragments are what they are over the whole.
    """
    GL.glBindVertexArray(context.vertex_array)
    if windows is None:
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
    else:
        GL.glEnable(GL.GL_SCISSOR_TEST)
        for window in windows:
            GL.glScissor(*window)
            GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        GL.glDisable(GL.GL_SCISSOR_TEST)
    GL.glBindVertexArray(0)


def finish() -> None:
    """Wait until everything drawn so far is done."""
    GL.glFinish()
