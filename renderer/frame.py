"""The renderer of one scene, and its frames: shared passes once, then any number of techniques."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Self

import numpy as np
import pyrender

from renderer import VERSION, gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.memory import give_back, give_back_large
from renderer.optics.transmittance import Translucency
from renderer.passes.composite import composite
from renderer.passes.environment import Surroundings
from renderer.passes.given import draw_given
from renderer.passes.hair import Hair
from renderer.passes.lamps import Lamps
from renderer.passes.pieces import Piece, pieces
from renderer.passes.points import Points
from renderer.passes.surfaces import FORMATS, PLACED_FORMATS, Drawn, Surfaces
from renderer.scene import graph as graphs
from renderer.scene.camera import Camera
from renderer.scene.picture import Picture
from renderer.scene.view import View, main_camera, resolve
from renderer.techniques.base import Inputs, Room, Technique
from renderer.techniques.drawing import RESULT_FORMATS

SHADOW_MAP = 4096
#: Of a reach: half a pixel for each of a technique's passes, and one of a derivative.
ROUNDING_PX = 8
SIZE_LIMIT = 8192  # pixels of a side after supersampling


@dataclass(frozen=True)
class Result:
    """The image of a technique and what it took.

    image (H, W, 3) uint8 sRGB; samples (H s, W s) uint16, 0 where no scattering material is seen;
    contrast (H s, W s) float32 in [0, 1], or None where the technique measures none.
    """

    image: np.ndarray
    samples: np.ndarray
    contrast: np.ndarray | None


def driver() -> dict:
    """What OpenGL says of itself here, and the renderer's version: `Renderer.info` of any scene."""
    context = gl.Context()
    try:
        return {"version": VERSION, **context.info}
    finally:
        context.close()


class Renderer:
    """One OpenGL context with one scene in it; use it as a context manager, or close() it.

    scene: a renderer.scene.graph.SceneGraph, or any pyrender.Scene. size: (width, height) of the
    images; supersample: 1 to 4 samples a pixel along each side; seed: of the solid noise and of
    the baked light; rays: of the bake, per vertex; shadow_map: pixels of a lamp's map.
    """

    def __init__(
        self,
        scene: pyrender.Scene,
        size: tuple[int, int] = (1920, 1080),
        supersample: int = 2,
        seed: int = 0,
        rays: int = 144,
        shadow_map: int = SHADOW_MAP,
    ):
        width, height = size
        if min(width, height) < 16 or max(width, height) * supersample > SIZE_LIMIT:
            raise InputError(
                f"size is {width}x{height} at supersample {supersample}; expected 16 to "
                f"{SIZE_LIMIT // max(supersample, 1)} pixels a side"
            )
        if supersample not in (1, 2, 3, 4):
            raise InputError(f"supersample is {supersample!r}; expected 1, 2, 3 or 4")
        contents = graphs.contents(scene)
        if not contents.surfaces:
            raise InputError("the scene has no surface; expected at least one mesh")
        self.scene, self.size, self.supersample, self.seed = scene, size, supersample, seed
        give_back_large()
        give_back()  # what the making of the scene has freed
        self.context = gl.Context()
        try:
            self._programs: dict = {}
            self.surroundings = Surroundings(contents.environment)
            self.surfaces = Surfaces(contents, contents.lights, self.surroundings, rays, seed)
            base = {drawn.item.mesh: drawn for drawn in self.surfaces.surfaces}
            self.hair = [Hair(item, base[item.mesh]) for item in contents.strands]
            points = [self.surfaces.vertices(), *(h.points.reshape(-1, 3) for h in self.hair)]
            everything = np.vstack(points)
            self.lamps = Lamps(contents.lights, everything, shadow_map)
            self._draw_shadows()
        except BaseException:
            self.close()
            raise
        give_back()
        subject = getattr(scene, "subject", None)
        middle = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
        self.subject = middle if subject is None else np.asarray(subject, float)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Free everything: the context and all that was made in it."""
        self.context.close()

    def info(self) -> dict:
        """For the manifest: renderer version and what OpenGL says of itself."""
        return {"version": VERSION, **self.context.info}

    @property
    def media(self) -> list[str | dict]:
        """The media that scatter in this scene, in the order of their ids (1 first)."""
        return self.surfaces.media

    def program(
        self,
        fragment: str,
        defines: dict | None = None,
        vertex: str = "shaders/fullscreen.vert",
        geometry: str | None = None,
    ) -> gl.Program:
        """A program by its shaders, compiled once."""
        key = (fragment, vertex, geometry, tuple(sorted((defines or {}).items())))
        if key not in self._programs:
            self._programs[key] = gl.Program(fragment, vertex, defines, geometry)
        return self._programs[key]

    def _draw_shadows(self) -> None:
        def solid(_light, program, shared):
            self.surfaces.draw_depth(program, shared)

        def strands(light, program, shared):
            for hair in self.hair:
                program.use(**shared, model=np.eye(4))
                hair.draw_shadows(light)

        self.lamps.draw(
            self.program("passes/shadow.frag", vertex="passes/shadow.vert"), solid, strands
        )

    def frame(self, camera: Camera | None = None, picture: Picture | None = None) -> Frame:
        """Draw what all techniques share for one camera; by default the scene's own.

        picture: exposure, tone map and backdrop; by default the scene's own.
        """
        self.context.make_current()
        width, height = (side * self.supersample for side in self.size)
        camera = camera or getattr(self.scene, "camera", None)
        if camera is None:
            view = main_camera(self.scene, width, height)
        else:
            view = resolve(camera, self.subject, width, height)
        picture = picture or getattr(self.scene, "picture", None) or Picture()
        return Frame(self, view, picture)

    def placed(
        self,
        drawn: Drawn,
        domain: str,
        size: tuple[int, int],
        points: Points | None = None,
        point_mm: float = 1.0,
        diffuse: str = "lambert",
        only_irradiance: bool = False,
        translucency: Translucency | None = None,
    ) -> gl.Target:
        """A surface's light over its texture atlas ("ATLAS") or over points on it ("POINTS").

        size: (width, height) in texels; points: from `surfaces.points`, whose size it is; point_mm:
        what a point stands for, finer relief fades; diffuse: how light passes the face;
        only_irradiance: specular and transmitted light are left out, which takes two thirds of
        the time; translucency: how what comes through is reckoned, None for nothing. The target has
        PLACED_FORMATS; the caller frees it. Specular light, and Disney's diffuse, are those towards
        the subject's front.
        """
        self.context.make_current()
        target = gl.Target(*size, list(PLACED_FORMATS), depth=domain == "ATLAS")
        target.bind(clear=(0.0, 0.0, 0.0, 0.0))
        shared = {
            "camera_position": self.subject + [0.0, 0.0, 1e4],
            "view": np.eye(4),
            "projection": np.eye(4),
            "point_mm": point_mm,
        }
        light = (self.lamps, self.surroundings)
        rest = (domain, drawn, points, diffuse, only_irradiance, translucency)
        self.surfaces.draw(self.program, *light, shared, *rest)
        return target


class Frame:
    """The shared buffers of one view; use it as a context manager, or close() it.

    surface.textures: irradiance (alpha: the medium's id), specular light under hair (alpha: what
    hair hides), albedo (alpha: what gets out through the face), view depth; all at the image's size
    times supersample.
    """

    def __init__(self, renderer: Renderer, view: View, picture: Picture):
        self.renderer, self.view, self.picture = renderer, view, picture
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
        self._draw_surfaces()
        self._draw_hair()
        gl.finish()
        gl.draw_nothing()
        give_back()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _draw_surfaces(self) -> None:
        r = self.renderer
        self.surface = gl.Target(self.width, self.height, list(FORMATS), depth=True)
        self.surface.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True)
        # depth first: the shading passes then touch each pixel once
        GL.glColorMask(False, False, False, False)
        depth = r.program("passes/depth.frag", {"DOMAIN": "SCREEN"}, vertex="passes/surface.vert")
        r.surfaces.draw_depth(depth, self._shared)
        gl.finish()
        GL.glColorMask(True, True, True, True)
        GL.glColorMaski(1, True, True, True, False)  # the alpha of specular light is hair's
        r.surfaces.draw(r.program, r.lamps, r.surroundings, self._shared)

    def _draw_hair(self) -> None:
        r = self.renderer
        self.surface.bind(depth_test=True, blend="over", only=1)
        for hair in r.hair:
            hair.draw(r.program, r.lamps, r.surroundings, self._shared, self.view.pixels_per_mm)

    def _irradiance(self, diffuse: str) -> gl.Texture:
        """Irradiance below a face of that model, alpha the medium's id."""
        if diffuse == "lambert":
            return self.surface.textures[0]
        if diffuse not in self._shaded:
            target = gl.Target(self.width, self.height, [GL.GL_RGBA32F], depth=self.surface)
            target.bind(clear=(0.0, 0.0, 0.0, 0.0))
            target.bind(depth_test=True)  # the depth is there already
            r = self.renderer
            r.surfaces.draw(r.program, r.lamps, r.surroundings, self._shared, diffuse=diffuse)
            self._shaded[diffuse] = target
        return self._shaded[diffuse].textures[0]

    def transmitted(self, translucency: Translucency) -> gl.Texture:
        """Light that comes through thin parts, to be added to the irradiance; the last is kept."""
        if translucency not in self._transmitted:
            for target in self._transmitted.values():
                target.delete()
            self._transmitted.clear()
            target = gl.Target(self.width, self.height, [GL.GL_RGBA16F], depth=self.surface)
            target.bind(clear=(0.0, 0.0, 0.0, 0.0))
            target.bind(depth_test=True)  # the depth is there already
            r = self.renderer
            shared = (r.program, r.lamps, r.surroundings, self._shared)
            r.surfaces.draw_transmitted(*shared, translucency)
            self._transmitted[translucency] = target
        return self._transmitted[translucency].textures[0]

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
        depths = self.surface.textures[3].read()
        return float(depths.min(where=depths > 0, initial=np.inf))

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
                self.surface,
                r.lamps,
            ),
            piece.first,
            self.height,
        )

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
        image = np.empty((self.height // s, self.width // s, 3), np.uint8)
        samples = np.empty((self.height, self.width), np.uint16)
        contrast = np.empty(samples.shape, np.float32) if technique.measures_contrast else None
        for piece in self.pieces(technique):
            with self.scatter(technique, piece) as scattered:
                light, info = scattered.textures
                image[piece.image_rows(self.height, s)] = self.develop(light, technique, piece)
                counts = info.read()[piece.own_rows()]
            rows = piece.image_rows(self.height)
            samples[rows] = np.rint(counts[..., 0])
            if contrast is not None:
                contrast[rows] = counts[..., 1]
            del counts
            give_back()
        return Result(image, samples, contrast)

    def develop(
        self, scattered: gl.Texture, technique: Technique, piece: Piece | None = None
    ) -> np.ndarray:
        """The image (H, W, 3) uint8 sRGB of light that a technique has scattered, or a piece."""
        r = self.renderer
        return composite(
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
        )

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

    def close(self) -> None:
        """Free the shared buffers."""
        self.renderer.context.make_current()
        own = (*self._shaded.values(), *self._transmitted.values(), self.surface)
        for target in own:
            target.delete()
        self._shaded.clear()
        self._transmitted.clear()


def _light(technique: Technique) -> dict:
    """Which light a technique asks for."""
    own = {name: getattr(technique, name) for name in ("texturing", "diffuse")}
    return {"translucency": technique.transmission, **own}
