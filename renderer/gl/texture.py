"""Textures, and targets to draw into."""

from __future__ import annotations

from typing import Self

import numpy as np

from renderer.errors import InputError
from renderer.gl.context import GL, Context, free, owned
from renderer.gl.mesh import draw_fullscreen
from renderer.gl.program import Program

_FORMATS = {  # internal format -> (format, channels, bytes a texel)
    GL.GL_RGBA32F: (GL.GL_RGBA, 4, 16),
    GL.GL_RGBA16F: (GL.GL_RGBA, 4, 8),
    GL.GL_RG16F: (GL.GL_RG, 2, 4),
    GL.GL_R32F: (GL.GL_RED, 1, 4),
    GL.GL_RGBA8: (GL.GL_RGBA, 4, 4),
    GL.GL_DEPTH_COMPONENT16: (GL.GL_DEPTH_COMPONENT, 1, 2),
}
_TYPES = {  # internal format -> how OpenGL hands out its own bits, and numpy's type of them
    GL.GL_RGBA32F: (GL.GL_FLOAT, np.float32),
    GL.GL_RGBA16F: (GL.GL_HALF_FLOAT, np.float16),
    GL.GL_RG16F: (GL.GL_HALF_FLOAT, np.float16),
    GL.GL_R32F: (GL.GL_FLOAT, np.float32),
    GL.GL_DEPTH_COMPONENT16: (GL.GL_UNSIGNED_SHORT, np.uint16),
}
_DEPTH, _DEPTH_BYTES = GL.GL_DEPTH_COMPONENT32F, 4  # of a target's own depth buffer
BLENDS = ("over", "add")


def draw_nothing() -> None:
    """One pixel without textures: until the next draw a software driver keeps what the last one
    read and wrote, deleted or not (llvmpipe: 166 MB for a technique's result of 3840x2160).
    """
    context = Context.current
    if context is None:
        return
    if context.nothing is None:
        context.nothing = (Target(1, 1, [GL.GL_RGBA8]), Program("passes/white.frag"))
    target, program = context.nothing
    target.bind()
    program.use()
    draw_fullscreen(context)


def _delete_texture(name: int) -> None:
    GL.glDeleteTextures(1, [name])


def _delete_framebuffer(name: int) -> None:
    GL.glDeleteFramebuffers(1, [name])


def _delete_renderbuffer(name: int) -> None:
    GL.glDeleteRenderbuffers(1, [name])


class Texture:
    """A 2-D texture. Linear or nearest filter, clamped at the edges unless it repeats.

    mipmap: with levels of means; of what is drawn into it they are made by `reduce`.
    """

    kind = GL.GL_TEXTURE_2D

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
        self._handle = owned(self, self.id, _delete_texture, self._bytes(mipmap))
        GL.glBindTexture(self.kind, self.id)
        self._fill(data)
        smooth = GL.GL_LINEAR if linear else GL.GL_NEAREST
        small = GL.GL_LINEAR_MIPMAP_LINEAR if mipmap else smooth
        wrap = GL.GL_REPEAT if repeat else GL.GL_CLAMP_TO_EDGE
        GL.glTexParameteri(self.kind, GL.GL_TEXTURE_MIN_FILTER, small)
        GL.glTexParameteri(self.kind, GL.GL_TEXTURE_MAG_FILTER, smooth)
        GL.glTexParameteri(self.kind, GL.GL_TEXTURE_WRAP_S, wrap)
        GL.glTexParameteri(self.kind, GL.GL_TEXTURE_WRAP_T, wrap)
        if mipmap and data is not None:
            self.reduce()

    def reduce(self) -> None:
        """Make the levels of means anew from the texels."""
        GL.glBindTexture(self.kind, self.id)
        GL.glGenerateMipmap(self.kind)

    def _bytes(self, mipmap: bool) -> int:
        texels = self.width * self.height
        return _FORMATS[self.internal][2] * (texels * 4 // 3 if mipmap else texels)

    def _fill(self, data: np.ndarray | None) -> None:
        form = _FORMATS[self.internal][0]
        number, data = _upload(data)
        size = (self.width, self.height)
        GL.glTexImage2D(self.kind, 0, self.internal, *size, 0, form, number, data)

    def read(self) -> np.ndarray:
        """The texels: (height, width, channels) float32, row 0 at the top."""
        form, channels, _ = _FORMATS[self.internal]
        GL.glBindTexture(self.kind, self.id)
        out = np.empty((self.height, self.width, channels), dtype=np.float32)
        GL.glGetTexImage(self.kind, 0, form, GL.GL_FLOAT, out)
        return out[::-1]

    def write_rows(self, first: int, texels: np.ndarray) -> None:
        """Fill rows from `first` on, 0 below, with texels (rows, width, channels) of the texture's
        own type, as `Target.read_rows` gives them.
        """
        form, (number, kind) = _FORMATS[self.internal][0], _TYPES[self.internal]
        texels = np.ascontiguousarray(texels, kind)
        GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
        GL.glBindTexture(self.kind, self.id)
        place = (0, first, self.width, len(texels))
        GL.glTexSubImage2D(self.kind, 0, *place, form, number, texels)

    def delete(self) -> None:
        free(self._handle)


class TextureArray(Texture):
    """Layers of 2-D textures of one size; data: (layers, height, width, channels), row 0 below."""

    kind = GL.GL_TEXTURE_2D_ARRAY

    def __init__(self, width: int, height: int, layers: int, internal: int, **options):
        self.layers = layers
        super().__init__(width, height, internal, **options)

    def _bytes(self, mipmap: bool) -> int:
        return self.layers * super()._bytes(mipmap)

    def _fill(self, data: np.ndarray | None) -> None:
        form = _FORMATS[self.internal][0]
        number, data = _upload(data)
        size = (self.width, self.height, self.layers)
        GL.glTexImage3D(self.kind, 0, self.internal, *size, 0, form, number, data)

    def copy_layer(self, layer: int) -> None:
        """Fill a layer with what was drawn into the bound target, of the same size."""
        GL.glBindTexture(self.kind, self.id)
        GL.glCopyTexSubImage3D(self.kind, 0, 0, 0, layer, 0, 0, self.width, self.height)

    def bits(self) -> np.ndarray:
        """The texels (layers, height, width, channels) in the texture's own type, row 0 below."""
        (form, channels, _), (number, kind) = _FORMATS[self.internal], _TYPES[self.internal]
        GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
        GL.glBindTexture(self.kind, self.id)
        out = np.empty((self.layers, self.height, self.width, channels), kind)
        GL.glGetTexImage(self.kind, 0, form, number, out)
        return out

    def set_bits(self, texels: np.ndarray) -> None:
        """Fill the texture with what `bits` gave. Raises ValueError for another shape or type."""
        (form, channels, _), (number, kind) = _FORMATS[self.internal], _TYPES[self.internal]
        shape = (self.layers, self.height, self.width, channels)
        if texels.shape != shape or texels.dtype != kind:
            raise ValueError(f"texels are {texels.shape} {texels.dtype}; expected {shape} {kind}")
        GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
        GL.glBindTexture(self.kind, self.id)
        size = (self.width, self.height, self.layers)
        GL.glTexSubImage3D(self.kind, 0, 0, 0, 0, *size, form, number, np.ascontiguousarray(texels))

    def read(self) -> np.ndarray:
        """The texels: (layers, height, width, channels) float32, row 0 at the top."""
        form, channels, _ = _FORMATS[self.internal]
        GL.glBindTexture(self.kind, self.id)
        out = np.empty((self.layers, self.height, self.width, channels), dtype=np.float32)
        GL.glGetTexImage(self.kind, 0, form, GL.GL_FLOAT, out)
        return out[:, ::-1]


def _upload(data: np.ndarray | None) -> tuple[int, np.ndarray | None]:
    """The type that OpenGL is told, and the data as it reads them."""
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
    if data is None:
        return GL.GL_FLOAT, None
    number = GL.GL_UNSIGNED_BYTE if data.dtype == np.uint8 else GL.GL_FLOAT
    if number == GL.GL_FLOAT:
        data = data.astype(np.float32, copy=False)
    return number, np.ascontiguousarray(data)


class Target:
    """A framebuffer: one texture per internal format, and a depth buffer of its own or another's.

    depth: True for a buffer of its own, another Target to share that one's, False for none. mipmap:
    the textures have levels of means, made by their `reduce`.
    """

    def __init__(
        self,
        width: int,
        height: int,
        formats: list[int],
        depth: bool | Target = False,
        linear: bool = False,
        mipmap: bool = False,
    ):
        self.width, self.height = width, height
        self.textures = [
            Texture(width, height, internal, linear, mipmap=mipmap) for internal in formats
        ]
        self._framebuffer()
        self._depth, self._depth_handle = None, None
        for k, texture in enumerate(self.textures):
            where = GL.GL_COLOR_ATTACHMENT0 + k
            GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, where, GL.GL_TEXTURE_2D, texture.id, 0)
        if depth:
            if isinstance(depth, Target):
                self._depth = depth._depth
            else:
                self._depth = GL.glGenRenderbuffers(1)
                size = _DEPTH_BYTES * width * height
                self._depth_handle = owned(self, self._depth, _delete_renderbuffer, size)
                GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, self._depth)
                GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, _DEPTH, width, height)
            GL.glFramebufferRenderbuffer(
                GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_RENDERBUFFER, self._depth
            )
        self._complete()

    def _framebuffer(self) -> None:
        self.id = GL.glGenFramebuffers(1)
        self._handle = owned(self, self.id, _delete_framebuffer)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.id)

    def _complete(self) -> None:
        state = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
        if state != GL.GL_FRAMEBUFFER_COMPLETE:
            raise InputError(
                f"a {self.width}x{self.height} render target is not possible on this driver "
                f"(status {int(state):#x}); expected a smaller size"
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.delete()

    def bind(
        self,
        clear: tuple[float, ...] | None = None,
        depth_test: bool = False,
        blend: str | None = None,
        only: int | None = None,
    ) -> None:
        """Draw here from now on, with all state that matters set afresh.

        blend "over": premultiplied colour over what is there; "add": sums (all channels). only: the
        place of the one texture that is drawn into; None: all.
        """
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.id)
        drawn = range(len(self.textures)) if only is None else [only]
        GL.glDrawBuffers(len(drawn), [GL.GL_COLOR_ATTACHMENT0 + k for k in drawn])
        GL.glViewport(0, 0, self.width, self.height)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glDisable(GL.GL_SCISSOR_TEST)
        GL.glColorMask(True, True, True, True)
        GL.glDepthMask(blend is None)
        (GL.glEnable if depth_test else GL.glDisable)(GL.GL_DEPTH_TEST)
        GL.glDepthFunc(GL.GL_LEQUAL)
        (GL.glEnable if blend else GL.glDisable)(GL.GL_BLEND)
        over = GL.GL_ONE_MINUS_SRC_ALPHA if blend != "add" else GL.GL_ONE
        GL.glBlendFunc(GL.GL_ONE, over)
        if clear is not None:
            GL.glClearColor(*clear)
            GL.glClearDepth(1.0)
            depth = GL.GL_DEPTH_BUFFER_BIT if depth_test and blend is None else 0
            GL.glClear(GL.GL_COLOR_BUFFER_BIT | depth)

    def read_rows(self, place: int, low: int, high: int) -> np.ndarray:
        """Rows low to high, 0 below, of one of the textures, in its own type: (rows, width,
        channels).
        """
        internal = self.textures[place].internal
        (form, channels, _), (number, kind) = _FORMATS[internal], _TYPES[internal]
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.id)
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT0 + place)
        GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
        out = np.empty((high - low, self.width, channels), kind)
        GL.glReadPixels(0, low, self.width, high - low, form, number, out)
        return out

    def delete(self) -> None:
        for texture in self.textures:
            texture.delete()
        if self._depth_handle is not None:
            free(self._depth_handle)
        free(self._handle)
        draw_nothing()


class DepthArray(Target):
    """Layers of depth alone, to be drawn one by one and read as a texture array.

    Depth is what a fragment shader writes, or the clip space's own z, in steps of 1 / 65535; 1
    where nothing is.
    """

    def __init__(self, size: int, layers: int):
        self.width = self.height = size
        self.textures = []
        self._depth_handle = None
        self.array = TextureArray(size, size, layers, GL.GL_DEPTH_COMPONENT16)
        self._framebuffer()
        self._attach(0)
        GL.glDrawBuffer(GL.GL_NONE)
        GL.glReadBuffer(GL.GL_NONE)
        self._complete()

    def _attach(self, layer: int) -> None:
        GL.glFramebufferTextureLayer(
            GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, self.array.id, 0, layer
        )

    def bind_layer(self, layer: int) -> None:
        """Clear a layer and draw into it from now on."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.id)
        self._attach(layer)
        self.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True)

    def delete(self) -> None:
        self.array.delete()
        super().delete()
