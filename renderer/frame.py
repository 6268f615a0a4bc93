"""One view of a scene: shared passes once, then any number of techniques."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Self

import numpy as np

from renderer import caches, gl, kept
from renderer.gl import GL
from renderer.memory import give_back
from renderer.optics.transmittance import Translucency
from renderer.passes import occlusion
from renderer.passes.composite import composite
from renderer.passes.given import draw_given
from renderer.passes.lens import Confusion, through_lens
from renderer.passes.pieces import Piece, pieces
from renderer.passes.surfaces import FORMATS
from renderer.scene.lights import PointLight
from renderer.scene.picture import Picture
from renderer.scene.view import View
from renderer.techniques.base import Inputs, Room, Technique
from renderer.techniques.cover import ROUNDING_PX, TILE, Cover
from renderer.techniques.drawing import RESULT_FORMATS

if TYPE_CHECKING:
    from renderer.renderer import Renderer

#: Of linear R, G, B: the weights of composite.frag.
LUMINANCE = np.array([0.2125, 0.7154, 0.0721])


@dataclass(frozen=True)
class Result:
    """The image of a technique and what it took.

    image (H, W, 3) uint8 sRGB; samples (H s, W s) uint16, 0 where no scattering material is seen;
    contrast (H s, W s) float32 in [0, 1], or None where the technique measures none.
    """

    image: np.ndarray
    samples: np.ndarray
    contrast: np.ndarray | None


class Frame:
    """The shared buffers of one view; use it as a context manager, or close() it.

    surface.textures: irradiance (alpha: the medium's id), specular light under hair (alpha: what
    hair hides), albedo (alpha: what gets out through the face), view depth; all at the image's size
    times supersample.
    """

    def __init__(
        self, renderer: Renderer, view: View, picture: Picture, lens: Confusion | None = None
    ):
        self.renderer, self.view, self.picture = renderer, view, picture
        self.lens = lens
        s = renderer.supersample
        self.width, self.height = renderer.size[0] * s, renderer.size[1] * s
        self.whole = Piece(0, self.height, 0, self.height)
        self._shaded: dict[str, gl.Target] = {}
        self._transmitted: dict[Translucency, gl.Target] = {}
        self._shared = {
            "camera_position": view.eye,
            "view": view.view,
            "projection": view.projection,
        }
        renderer.surfaces.look(view.eye)
        name = self._name("surfaces")
        if name is None or not caches.there("views", name):
            renderer.light_up()  # before the buffers take their memory
        self.surface = gl.Target(self.width, self.height, list(FORMATS), depth=True)
        self._deep = False  # whether the depth buffer holds the surfaces
        if not self._read("surfaces", self.surface):
            renderer.light_up()
            self._draw_surfaces()
            self._draw_hair()
            self._keep("surfaces", self.surface)
        gl.finish()
        gl.draw_nothing()
        give_back()

    def _name(self, what: object) -> str | None:
        """What buffers of this view are kept by; None where nothing is kept."""
        if "views" not in self.renderer.keep:
            return None
        size = (self.width, self.height)
        return kept.view_key(self.renderer.kept_as, what, *self._shared.values(), size)

    def _read(self, what: object, target: gl.Target) -> bool:
        """Fill a target from the cache, if it is there."""
        name = self._name(what)
        return name is not None and kept.load_view(name, target)

    def _keep(self, what: object, target: gl.Target) -> None:
        if (name := self._name(what)) is not None:
            kept.keep_view(name, target)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _draw_surfaces(self) -> None:
        r = self.renderer
        self.surface.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True)
        self.deepen()  # depth first: the shading passes then touch each pixel once
        GL.glColorMaski(1, True, True, True, False)  # the alpha of specular light is hair's
        r.surfaces.draw(r.program, r.lamps, r.surroundings, self._shared)

    def deepen(self) -> None:
        """Have the depth buffer of what is seen: buffers that were kept come without."""
        if self._deep:
            return
        r = self.renderer
        self.surface.bind(depth_test=True)
        GL.glColorMask(False, False, False, False)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)
        depth = r.program("passes/depth.frag", {"DOMAIN": "SCREEN"}, vertex="passes/surface.vert")
        r.surfaces.draw_depth(depth, self._shared)
        gl.finish()
        GL.glColorMask(True, True, True, True)
        self._deep = True

    def _draw_hair(self) -> None:
        r = self.renderer
        if not r.has_hair:
            return
        depths = occlusion.blocks(self._rows(3, 32 * occlusion.BLOCK))
        sources = (r.context, r.program, r.lamps, r.surroundings, self._shared)
        for hair in r.hair:
            hair.draw(*sources, self.surface, depths)
            hair.rest()

    def _rows(self, place: int, count: int) -> Iterator[np.ndarray]:
        """The last channel of one of the shared buffers, so many rows at a time from below."""
        for low in range(0, self.height, count):
            yield self.surface.read_rows(place, low, min(low + count, self.height))[..., -1]

    def _irradiance(self, diffuse: str) -> gl.Texture:
        """Irradiance below a face of that model, alpha the medium's id."""
        if diffuse == "lambert":
            return self.surface.textures[0]
        if diffuse not in self._shaded:
            self._before_drawing()
            target = gl.Target(self.width, self.height, [GL.GL_RGBA32F], depth=self.surface)
            target.bind(clear=(0.0, 0.0, 0.0, 0.0))
            target.bind(depth_test=True)  # the depth is there already
            r = self.renderer
            r.surfaces.draw(r.program, r.lamps, r.surroundings, self._shared, diffuse=diffuse)
            self._shaded[diffuse] = target
        return self._shaded[diffuse].textures[0]

    def _before_drawing(self) -> None:
        """What surfaces are drawn once more with: lamps and the depth of what is seen."""
        self.renderer.light_up()
        self.deepen()

    def transmitted(self, translucency: Translucency) -> gl.Texture:
        """Light that comes through thin parts, to be added to the irradiance; the last is kept."""
        if translucency not in self._transmitted:
            for target in self._transmitted.values():
                target.delete()
            self._transmitted.clear()
            target = gl.Target(self.width, self.height, [GL.GL_RGBA16F], depth=self.surface)
            if not self._read(translucency, target):
                self._before_drawing()
                target.bind(clear=(0.0, 0.0, 0.0, 0.0))
                target.bind(depth_test=True)  # the depth is there already
                r = self.renderer
                shared = (r.program, r.lamps, r.surroundings, self._shared)
                r.surfaces.draw_transmitted(*shared, translucency)
                self._keep(translucency, target)
            self._transmitted[translucency] = target
        return self._transmitted[translucency].textures[0]

    def _light_for(self, technique: Technique) -> None:
        """Draw what of a technique's light takes the lamps' maps."""
        if through := technique.transmission:
            self.transmitted(through)
        self._irradiance(technique.diffuse)

    def irradiance(
        self,
        translucency: Translucency | None = None,
        medium: int = 1,
        texturing: float = 0.0,
        diffuse: str = "lambert",
        piece: Piece | None = None,
    ) -> gl.Texture:
        """The input of the techniques: irradiance, alpha 1 where this medium scatters.

        translucency: with the light that comes through added, None: without; texturing: times the
        albedo to this power, which the composite then leaves out; diffuse: how light passes the
        face.
        """
        r, piece = self.renderer, piece or self.whole
        below = self._irradiance(diffuse)
        own = len(r.media) <= 1 and not translucency and not texturing
        if own and piece == self.whole:
            return below
        through = self.transmitted(translucency) if translucency else None
        light = (below, through, self.surface.textures[2], medium, texturing)
        given = gl.Target(self.width, piece.rows, [GL.GL_RGBA32F])
        draw_given(r.context, r.program, given, *light, piece.first)
        return given.textures[0]

    def _depths(self, piece: Piece) -> gl.Texture:
        """View depth of a piece's pixels."""
        whole = self.surface.textures[3]
        if piece == self.whole:
            return whole
        copy = gl.Target(self.width, piece.rows, [whole.internal])
        copy.bind()
        self.renderer.program("passes/copy.frag").use(source=whole, first_row=piece.first)
        gl.draw_fullscreen(self.renderer.context)
        return copy.textures[0]

    @cached_property
    def nearest_mm(self) -> float:
        """View depth of the nearest surface that is seen."""
        rows = self._rows(3, TILE)
        return min(float(own.min(where=own > 0, initial=np.inf)) for own in rows)

    @cached_property
    def _tiles(self) -> np.ndarray:
        """Whether each medium scatters in each tile (media, rows, columns), row 0 below."""
        rows, columns = -(-self.height // TILE), -(-self.width // TILE)
        tiles = np.zeros((max(1, len(self.renderer.media)), rows, columns), bool)
        for row, ids in enumerate(self._rows(0, TILE)):
            for k, own in enumerate(tiles[:, row]):
                own[np.flatnonzero((np.rint(ids) == k + 1).any(axis=0)) // TILE] = True
        return tiles

    def _cover(self, medium: int, piece: Piece) -> Cover:
        """Where a medium scatters in a piece."""
        size = (self.width, piece.rows, piece.first, piece.low, piece.high)
        return Cover(self._tiles[medium - 1], *size, self.view.pixels_per_mm / self.nearest_mm)

    def inputs(
        self,
        translucency: Translucency | None = None,
        irradiance: gl.Texture | None = None,
        depths: gl.Texture | None = None,
        medium: int = 1,
        texturing: float = 0.0,
        diffuse: str = "lambert",
        piece: Piece | None = None,
    ) -> Inputs:
        """What a technique gets; the textures can be replaced (tests use a flat patch)."""
        r, piece = self.renderer, piece or self.whole
        return Inputs(
            r.context,
            r.program,
            irradiance or self.irradiance(translucency, medium, texturing, diffuse, piece),
            depths or self._depths(piece),
            self.width,
            piece.rows,
            self.view.pixels_per_mm,
            r.supersample,
            r.surfaces.curve(medium),
            Room(
                tuple(drawn for drawn in r.surfaces.surfaces if drawn.id == medium),
                medium,
                partial(r.placed, diffuse=diffuse, translucency=translucency),
                r.surfaces.points,
                self._shared,
                self._seen,
                lambda: r.lamps,
                r.lights,
                r.media[medium - 1] if r.media else None,
                r.surroundings,
                (*r.surfaces.surfaces, *r.surfaces.eyes),
                r.surfaces.flesh,
            ),
            piece.first,
            self.height,
            r.executor,
            self._cover(medium, piece) if irradiance is None else None,
        )

    def _seen(self) -> gl.Target:
        """The target whose depth buffer holds what is seen."""
        self.deepen()
        return self.surface

    def pieces(self, technique: Technique) -> list[Piece]:
        """The pieces in which a technique's picture is drawn."""
        r, reach_px = self.renderer, None
        media = range(1, max(1, len(r.media)) + 1)
        reaches = [technique.support_mm(r.surfaces.curve(medium)) for medium in media]
        if technique.domain == "screen" and None not in reaches:
            reach_px = ROUNDING_PX + max(reaches) * self.view.pixels_per_mm / self.nearest_mm
        return pieces(self.width, self.height, reach_px, r.supersample)

    def scatter(self, technique: Technique, piece: Piece | None = None) -> gl.Target:
        """Scattered irradiance and counts of all media: one pass of the technique for each."""
        piece = piece or self.whole
        media = range(1, max(1, len(self.renderer.media)) + 1)
        first = self._scattered(technique, 1, piece)
        if len(media) == 1:
            return first
        total = gl.Target(self.width, piece.rows, list(RESULT_FORMATS))
        total.bind(clear=(0.0, 0.0, 0.0, 0.0))
        total.bind(only=0)
        ids = self.surface.textures[0]
        self.renderer.program("passes/copy.frag").use(source=ids, first_row=piece.first)
        gl.draw_fullscreen(self.renderer.context)
        for medium in media:
            if medium > 1:
                first = self._scattered(technique, medium, piece)
            total.bind()
            self.renderer.program("passes/pick.frag").use(
                irradiance=ids,
                scattered=first.textures[0],
                count=first.textures[1],
                medium=float(medium),
                first_row=piece.first,
            )
            gl.draw_fullscreen(self.renderer.context)
            first.delete()
        return total

    def _scattered(self, technique: Technique, medium: int, piece: Piece) -> gl.Target:
        """One medium's scattered light; what the technique was given is freed."""
        inputs = self.inputs(**_light(technique), medium=medium, piece=piece)
        target = technique.scatter(inputs).target
        del inputs
        self.renderer.context.free_dropped()
        gl.draw_nothing()
        return target

    def render(self, technique: Technique) -> Result:
        """The image of one technique."""
        r = self.renderer
        r.context.make_current()
        s = r.supersample
        kind = np.float32 if self.lens else np.uint8
        image = np.empty((self.height // s, self.width // s, 3), kind)
        samples = np.empty((self.height, self.width), np.uint16)
        contrast = np.empty(samples.shape, np.float32) if technique.measures_contrast else None
        if technique.domain == "screen":
            self._light_for(technique)
            r.put_by()
        for piece in self.pieces(technique):
            with self.scatter(technique, piece) as scattered:
                light, info = scattered.textures
                image[piece.image_rows(self.height, s)] = self._developed(light, technique, piece)
                counts = info.read()[piece.own_rows()]
            rows = piece.image_rows(self.height)
            samples[rows] = np.rint(counts[..., 0])
            if contrast is not None:
                contrast[rows] = counts[..., 1]
            del counts
            give_back()
        if self.lens:
            image = _rounded(self._through_lens(image))
        return Result(image, samples, contrast)

    def develop(
        self,
        scattered: gl.Texture,
        technique: Technique,
        rounded: bool = True,
    ) -> np.ndarray:
        """The image (H, W, 3) sRGB of light that a technique has scattered: uint8, or float32 in
        [0, 1] before it is rounded.
        """
        pixels = self._developed(scattered, technique, self.whole, rounded=False)
        if self.lens:
            pixels = self._through_lens(pixels)
        return _rounded(pixels) if rounded else pixels

    def _through_lens(self, pixels: np.ndarray) -> np.ndarray:
        r = self.renderer
        given = (pixels, self.surface, self.lens, self.picture.grain, r.supersample)
        return through_lens(r.context, r.program, *given)

    def _developed(
        self, scattered: gl.Texture, technique: Technique, piece: Piece, rounded: bool = True
    ) -> np.ndarray:
        """The rows of a piece as sRGB; where there is a lens, in linear display light for it."""
        linear = self.lens is not None
        r, bare, dimmed = self.renderer, None, None
        if technique.specular_white is not None:
            bare = self._bare_specular() if r.has_hair else None
            specular = bare.textures[1] if bare else self.surface.textures[1]
            dimmed = (specular, technique.specular_white * self._strongest())
        pixels = composite(
            r.context,
            r.program,
            scattered,
            self.surface,
            self.picture,
            self.view,
            r.surroundings,
            r.supersample,
            technique.texturing,
            technique.diffuse == "conserving",
            piece,
            dimmed,
            linear,
        )
        if bare:
            bare.delete()
        return _rounded(pixels) if rounded and not linear else pixels

    def _bare_specular(self) -> gl.Target:
        """Surfaces once more: textures[1] is specular light without hair. The caller frees it."""
        self._before_drawing()
        target = gl.Target(self.width, self.height, [GL.GL_RGBA16F] * 2, depth=self.surface)
        target.bind(clear=(0.0, 0.0, 0.0, 0.0))
        target.bind(depth_test=True)  # the depth is there already
        r = self.renderer
        r.surfaces.draw(r.program, r.lamps, r.surroundings, self._shared)
        return target

    def _strongest(self) -> float:
        """The luminance of the strongest lamp's irradiance at the subject; of the environment's on
        a sphere where there is no lamp.
        """
        shining = [0.0]
        for light in self.renderer.lights:
            falloff = 1.0
            if isinstance(light, PointLight):
                falloff = light.falloff(np.linalg.norm(self.renderer.subject - light.place))
            shining.append(float(falloff * LUMINANCE @ light.irradiance))
        ambient = np.pi * float(LUMINANCE @ self.renderer.surroundings.mean())
        return max(max(shining) or ambient, 1e-9)

    def time(self, techniques: dict[str, Technique], rounds: int) -> dict[str, np.ndarray]:
        """Seconds that scattering alone takes: name -> (rounds, 2) of wall and CPU time.

        The techniques run in turn, so that a machine's drift hits all alike; a round that compiles
        shaders goes before. Pictures are drawn in one piece, which takes more memory than `render`.
        """
        self.renderer.context.make_current()
        spent = {name: np.zeros((rounds, 2)) for name in techniques}
        for k in range(-1, rounds):
            for name, technique in techniques.items():
                for medium in range(1, max(1, len(self.renderer.media)) + 1):
                    inputs = self.inputs(**_light(technique), medium=medium)
                    gl.finish()
                    start = np.array([time.perf_counter(), time.process_time()])
                    scattered = technique.scatter(inputs).target
                    gl.finish()
                    if k >= 0:
                        spent[name][k] += [time.perf_counter(), time.process_time()] - start
                    scattered.delete()
        return spent

    def passes(self, technique: Technique) -> list[gl.Pass]:
        """What each pass of a technique takes, drawn once more after shaders are compiled; then
        "all", the whole of it with what is done between passes.
        """
        context = self.renderer.context
        context.make_current()
        clock = gl.Clock.of(self.renderer.info()["gl_renderer"])
        for made in (None, clock):
            context.clock = None
            start = len(clock.passes)
            for medium in range(1, max(1, len(self.renderer.media)) + 1):
                inputs = self.inputs(**_light(technique), medium=medium)
                gl.finish()
                context.clock = made
                began = time.perf_counter(), time.process_time()
                try:
                    technique.scatter(inputs).target.delete()
                    gl.finish()
                finally:
                    context.clock = None
            if made:
                spent = time.perf_counter() - began[0], time.process_time() - began[1]
                card = sum(one.card for one in clock.passes[start:])
                clock.passes.append(gl.Pass("all", *spent, card))
        return clock.passes

    def close(self) -> None:
        """Free the shared buffers."""
        self.renderer.context.make_current()
        own = (*self._shaded.values(), *self._transmitted.values(), self.surface)
        for target in own:
            target.delete()
        self._shaded.clear()
        self._transmitted.clear()


def _rounded(pixels: np.ndarray) -> np.ndarray:
    return np.rint(pixels * 255).astype(np.uint8)


def _light(technique: Technique) -> dict:
    """Which light a technique asks for."""
    own = {name: getattr(technique, name) for name in ("texturing", "diffuse")}
    return {"translucency": technique.transmission, **own}
