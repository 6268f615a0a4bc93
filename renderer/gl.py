"""OpenGL by name: context, program, vertex array, target. Everything raises; nothing is swallowed.

The context comes from pyrender's offscreen platforms: EGL by default, OSMesa when
PYOPENGL_PLATFORM=osmesa. PyOpenGL reads that variable on import, so it is set here first.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import numpy as np
from OpenGL import GL

from renderer.errors import InputError

ROOT = Path(__file__).parent
PLATFORMS = ("egl", "osmesa")
_FORMATS = {  # internal format -> (format, channels)
    GL.GL_RGBA32F: (GL.GL_RGBA, 4),
    GL.GL_RGBA16F: (GL.GL_RGBA, 4),
    GL.GL_R32F: (GL.GL_RED, 1),
    GL.GL_RGBA8: (GL.GL_RGBA, 4),
}


class Context:
    """One offscreen OpenGL context. Use as a context manager, or close() it."""

    def __init__(self):
        name = os.environ["PYOPENGL_PLATFORM"]
        if name not in PLATFORMS:
            raise InputError(
                f"PYOPENGL_PLATFORM is {name!r}; expected one of {', '.join(PLATFORMS)}"
            )
        self.name = name
        try:
            if name == "egl":
                from pyrender.platforms.egl import EGLPlatform, get_device_by_index

                self._platform = EGLPlatform(
                    16, 16, device=get_device_by_index(int(os.environ.get("EGL_DEVICE_ID", 0)))
                )
            else:
                from pyrender.platforms.osmesa import OSMesaPlatform

                self._platform = OSMesaPlatform(16, 16)
            self._platform.init_context()
            self._platform.make_current()
        except Exception as error:  # the platforms raise whatever their loader raised
            raise InputError(
                f"no OpenGL context through {name}: {type(error).__name__} {error}; "
                "expected Mesa's libegl1 and libgl1-mesa-dri, or libosmesa6"
            ) from error
        self.vertex_array = GL.glGenVertexArrays(1)
        self.info = {
            key: GL.glGetString(value).decode()
            for key, value in (
                ("gl_vendor", GL.GL_VENDOR),
                ("gl_renderer", GL.GL_RENDERER),
                ("gl_version", GL.GL_VERSION),
            )
        }
        self.info["platform"] = name

    def make_current(self) -> None:
        """Draw with this context from now on (several may be open)."""
        self._platform.make_current()

    def close(self) -> None:
        """Destroy the context and all that it holds."""
        if self._platform is None:
            return
        if (
            self.name == "egl"
        ):  # pyrender's delete_context ends the whole display, other contexts with it
            from OpenGL.EGL import EGL_NO_CONTEXT, EGL_NO_SURFACE, eglDestroyContext, eglMakeCurrent

            display, context = self._platform._egl_display, self._platform._egl_context
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT)
            eglDestroyContext(display, context)
        else:
            self._platform.delete_context()
        self._platform = None


def source(path: str, defines: dict[str, object] | None = None) -> str:
    """GLSL text of `path` (relative to renderer/) with `#include "x"` and defines resolved."""

    def read(name: str, seen: tuple[str, ...]) -> str:
        file = ROOT / name
        if name in seen:
            raise ValueError(f"{seen[-1]}: includes {name} in a circle")
        if not file.is_file():
            raise ValueError(f"{seen[-1] if seen else name}: no shader {name}")
        text = file.read_text(encoding="utf-8")
        return re.sub(
            r'^#include "([^"]+)"\s*$', lambda m: read(m[1], (*seen, name)), text, flags=re.M
        )

    head = "#version 330 core\n" + "".join(f"#define {k} {v}\n" for k, v in (defines or {}).items())
    return head + read(path, ())


class Program:
    """A linked program. `vertex` and `fragment` are shader files relative to renderer/."""

    def __init__(
        self,
        fragment: str,
        vertex: str = "shaders/fullscreen.vert",
        defines: dict[str, object] | None = None,
    ):
        self.name = fragment
        self.id = GL.glCreateProgram()
        for kind, path in ((GL.GL_VERTEX_SHADER, vertex), (GL.GL_FRAGMENT_SHADER, fragment)):
            shader = GL.glCreateShader(kind)
            GL.glShaderSource(shader, source(path, defines))
            GL.glCompileShader(shader)
            if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
                raise RuntimeError(f"{path}: {GL.glGetShaderInfoLog(shader).decode()}")
            GL.glAttachShader(self.id, shader)
            GL.glDeleteShader(shader)
        GL.glLinkProgram(self.id)
        if not GL.glGetProgramiv(self.id, GL.GL_LINK_STATUS):
            raise RuntimeError(f"{fragment}: {GL.glGetProgramInfoLog(self.id).decode()}")
        self._uniforms = {}
        for index in range(GL.glGetProgramiv(self.id, GL.GL_ACTIVE_UNIFORMS)):
            name, size, kind = GL.glGetActiveUniform(self.id, index)
            name = (name.decode() if isinstance(name, bytes) else name).split("[")[0]
            self._uniforms[name] = (GL.glGetUniformLocation(self.id, name), size, kind)

    def use(self, **values) -> None:
        """Bind the program and set every active uniform by name; one left out or unknown is an
        error.
        """
        missing = self._uniforms.keys() - values.keys()
        unknown = values.keys() - self._uniforms.keys()
        if missing:
            raise ValueError(f"{self.name}: uniforms not given: {', '.join(sorted(missing))}")
        if unknown:
            raise ValueError(f"{self.name}: no such uniforms: {', '.join(sorted(unknown))}")
        GL.glUseProgram(self.id)
        unit = 0
        for name, value in values.items():
            where, size, kind = self._uniforms[name]
            if kind == GL.GL_SAMPLER_2D:
                GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
                GL.glBindTexture(GL.GL_TEXTURE_2D, value.id)
                GL.glUniform1i(where, unit)
                unit += 1
                continue
            if kind in (GL.GL_INT, GL.GL_BOOL):
                GL.glUniform1i(where, int(value))
                continue
            array = np.ascontiguousarray(value, dtype=np.float32)
            if kind == GL.GL_FLOAT:
                GL.glUniform1fv(where, size, array)
            elif kind == GL.GL_FLOAT_VEC2:
                GL.glUniform2fv(where, size, array)
            elif kind == GL.GL_FLOAT_VEC3:
                GL.glUniform3fv(where, size, array)
            elif kind == GL.GL_FLOAT_VEC4:
                GL.glUniform4fv(where, size, array)
            elif kind == GL.GL_FLOAT_MAT4:
                GL.glUniformMatrix4fv(where, size, GL.GL_TRUE, array)
            else:
                raise ValueError(
                    f"{self.name}: uniform {name} has a type that this program does not set"
                )

    def accepts(self, values: dict) -> dict:
        """Those of `values` that this program has as active uniforms (for blocks shared by many
        programs).
        """
        return {name: value for name, value in values.items() if name in self._uniforms}


class Texture:
    """A 2-D texture. Linear or nearest filter, clamped at the edges."""

    def __init__(
        self,
        width: int,
        height: int,
        internal: int = GL.GL_RGBA16F,
        linear: bool = False,
        data: np.ndarray | None = None,
        mipmap: bool = False,
        repeat: bool = False,
    ):
        self.width, self.height, self.internal = width, height, internal
        self.id = GL.glGenTextures(1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self.id)
        form, _ = _FORMATS[internal]
        if data is None:
            GL.glTexImage2D(
                GL.GL_TEXTURE_2D, 0, internal, width, height, 0, form, GL.GL_FLOAT, None
            )
        else:
            kind = GL.GL_UNSIGNED_BYTE if data.dtype == np.uint8 else GL.GL_FLOAT
            GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
            GL.glTexImage2D(
                GL.GL_TEXTURE_2D,
                0,
                internal,
                width,
                height,
                0,
                form,
                kind,
                np.ascontiguousarray(data),
            )
        smooth = GL.GL_LINEAR if linear else GL.GL_NEAREST
        GL.glTexParameteri(
            GL.GL_TEXTURE_2D,
            GL.GL_TEXTURE_MIN_FILTER,
            GL.GL_LINEAR_MIPMAP_LINEAR if mipmap else smooth,
        )
        GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MAG_FILTER, smooth)
        wrap = GL.GL_REPEAT if repeat else GL.GL_CLAMP_TO_EDGE
        GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_WRAP_S, wrap)
        GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_WRAP_T, wrap)
        if mipmap:
            GL.glGenerateMipmap(GL.GL_TEXTURE_2D)

    def read(self) -> np.ndarray:
        """The texels: (height, width, channels) float32, row 0 at the top."""
        form, channels = _FORMATS[self.internal]
        GL.glBindTexture(GL.GL_TEXTURE_2D, self.id)
        out = np.empty((self.height, self.width, channels), dtype=np.float32)
        GL.glGetTexImage(GL.GL_TEXTURE_2D, 0, form, GL.GL_FLOAT, out)
        return out[::-1]

    def delete(self) -> None:
        GL.glDeleteTextures(1, [self.id])


class Target:
    """A framebuffer of one texture per internal format, with or without a depth buffer of its own
    or another's.
    """

    def __init__(
        self,
        width: int,
        height: int,
        formats: list[int],
        depth: bool | Target = False,
        linear: bool = False,
    ):
        self.width, self.height = width, height
        self.textures = [Texture(width, height, internal, linear) for internal in formats]
        self.id = GL.glGenFramebuffers(1)
        self._depth = None
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.id)
        for k, texture in enumerate(self.textures):
            GL.glFramebufferTexture2D(
                GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0 + k, GL.GL_TEXTURE_2D, texture.id, 0
            )
        if depth:
            if depth is True:
                self._depth = buffer = GL.glGenRenderbuffers(1)
                GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, buffer)
                GL.glRenderbufferStorage(
                    GL.GL_RENDERBUFFER, GL.GL_DEPTH_COMPONENT32F, width, height
                )
            else:
                buffer = depth._depth
            GL.glFramebufferRenderbuffer(
                GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_RENDERBUFFER, buffer
            )
        GL.glDrawBuffers(len(formats), [GL.GL_COLOR_ATTACHMENT0 + k for k in range(len(formats))])
        state = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
        if state != GL.GL_FRAMEBUFFER_COMPLETE:
            raise InputError(
                f"a {width}x{height} render target is not possible on this driver (status "
                f"{int(state):#x}); expected a smaller size"
            )

    def bind(
        self, clear: tuple[float, ...] | None = None, depth_test: bool = False, blend: bool = False
    ) -> None:
        """Draw here from now on, with all state that matters set afresh."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.id)
        GL.glViewport(0, 0, self.width, self.height)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glDisable(GL.GL_SCISSOR_TEST)
        GL.glColorMask(True, True, True, True)
        GL.glDepthMask(not blend)
        (GL.glEnable if depth_test else GL.glDisable)(GL.GL_DEPTH_TEST)
        GL.glDepthFunc(GL.GL_LEQUAL)
        (GL.glEnable if blend else GL.glDisable)(GL.GL_BLEND)
        GL.glBlendFunc(GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA)  # premultiplied
        if clear is not None:
            GL.glClearColor(*clear)
            GL.glClearDepth(1.0)
            GL.glClear(
                GL.GL_COLOR_BUFFER_BIT | (GL.GL_DEPTH_BUFFER_BIT if depth_test and not blend else 0)
            )

    def delete(self) -> None:
        for texture in self.textures:
            texture.delete()
        if self._depth is not None:
            GL.glDeleteRenderbuffers(1, [self._depth])
        GL.glDeleteFramebuffers(1, [self.id])


class Mesh:
    """Vertex attributes (location -> (N, k) float32 array) and triangle indices (M, 3)."""

    def __init__(self, attributes: dict[int, np.ndarray], faces: np.ndarray):
        self.count = faces.size
        self.vertex_array = GL.glGenVertexArrays(1)
        GL.glBindVertexArray(self.vertex_array)
        self._buffers = list(np.atleast_1d(GL.glGenBuffers(len(attributes) + 1)))
        for buffer, (where, array) in zip(self._buffers, attributes.items(), strict=False):
            array = np.ascontiguousarray(array, dtype=np.float32)
            GL.glBindBuffer(GL.GL_ARRAY_BUFFER, buffer)
            GL.glBufferData(GL.GL_ARRAY_BUFFER, array.nbytes, array, GL.GL_STATIC_DRAW)
            GL.glEnableVertexAttribArray(where)
            GL.glVertexAttribPointer(where, array.shape[1], GL.GL_FLOAT, False, 0, None)
        faces = np.ascontiguousarray(faces, dtype=np.uint32)
        GL.glBindBuffer(GL.GL_ELEMENT_ARRAY_BUFFER, self._buffers[-1])
        GL.glBufferData(GL.GL_ELEMENT_ARRAY_BUFFER, faces.nbytes, faces, GL.GL_STATIC_DRAW)
        GL.glBindVertexArray(0)

    def draw(self) -> None:
        GL.glBindVertexArray(self.vertex_array)
        GL.glDrawElements(GL.GL_TRIANGLES, self.count, GL.GL_UNSIGNED_INT, None)
        GL.glBindVertexArray(0)

    def delete(self) -> None:
        GL.glDeleteVertexArrays(1, [self.vertex_array])
        GL.glDeleteBuffers(len(self._buffers), self._buffers)


def draw_fullscreen(context: Context) -> None:
    """One triangle over the bound target."""
    GL.glBindVertexArray(context.vertex_array)
    GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
    GL.glBindVertexArray(0)


def finish() -> None:
    """Wait until everything drawn so far is done."""
    GL.glFinish()
