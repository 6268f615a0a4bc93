"""One offscreen OpenGL context.

It comes from pyrender's platforms: EGL by default, OSMesa when PYOPENGL_PLATFORM=osmesa. PyOpenGL
reads that variable on import, so it is set here first.
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

from OpenGL import GL

from renderer.errors import InputError

PLATFORMS = ("egl", "osmesa")


class Context:
    """One offscreen OpenGL context; close() it, or use what owns it as a context manager.

    What is made while a context is current belongs to it. Textures, targets and meshes are freed
    by their delete(), and those that are dropped without it are freed before the next one is made:
    nothing leaks, whoever forgets. held: bytes of all that is not freed yet; most: the most that
    was ever held at once (set it to `held` to begin anew).
    """

    current: Context | None = None

    def __init__(self):
        self._dropped: list[tuple[Callable[[int], None], int, int]] = []
        self.held = self.most = 0
        self.nothing: tuple | None = None  # what draw_nothing draws with
        self.clock = None  # renderer.gl.clock.Clock: times every pass
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
        Context.current = self

    def make_current(self) -> None:
        """Draw with this context from now on (several may be open)."""
        if Context.current is not self:
            self._platform.make_current()
            Context.current = self
        self.free_dropped()

    def free_dropped(self) -> None:
        """Free what nobody holds any more."""
        while self._dropped:
            self._free(*self._dropped.pop())

    def _free(self, free: Callable[[int], None], name: int, size: int) -> None:
        free(name)
        self.held -= size

    def close(self) -> None:
        """Destroy the context and all that it holds."""
        if self._platform is None:
            return
        self._dropped.clear()
        if Context.current is self:
            Context.current = None
        if self.name == "egl":
            # pyrender's delete_context ends the whole display, other contexts with it
            from OpenGL.EGL import EGL_NO_CONTEXT, EGL_NO_SURFACE, eglDestroyContext, eglMakeCurrent

            display, context = self._platform._egl_display, self._platform._egl_context
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT)
            eglDestroyContext(display, context)
        else:
            self._platform.delete_context()
        self._platform = None


def owned(owner: object, name: int, free: Callable[[int], None], size: int = 0) -> weakref.finalize:
    """Tie an OpenGL name to its owner: call `free` with the result to free it now. size: its bytes.

    When the owner is dropped without that, the name is put by and freed by its own context, which
    need not be the current one then.
    """
    context = Context.current
    if context is None:
        raise RuntimeError("no OpenGL context is current; expected an open renderer")
    context.free_dropped()
    context.held += size
    context.most = max(context.most, context.held)
    return weakref.finalize(owner, context._dropped.append, (free, name, size))


def free(handle: weakref.finalize) -> None:
    """Free a name at once; a second time does nothing."""
    if (kept := handle.detach()) is not None:
        _, put_by, (entry,), _ = kept
        put_by(entry)
        if Context.current is not None:
            Context.current.free_dropped()
