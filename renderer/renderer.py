"""The renderer of one scene: what is made once, for any number of frames."""

from __future__ import annotations

from collections.abc import Collection
from concurrent.futures import Executor
from functools import cached_property
from typing import Self

import numpy as np
import pyrender

from renderer import VERSION, caches, gl, kept
from renderer.errors import InputError
from renderer.frame import Frame
from renderer.memory import give_back, give_back_large
from renderer.optics.transmittance import Translucency
from renderer.passes.environment import Surroundings
from renderer.passes.hair import Hair
from renderer.passes.lamps import LEAST_MM, Lamps, extremes
from renderer.passes.lens import confusion
from renderer.passes.points import Points
from renderer.passes.surfaces import PLACED_FORMATS, Drawn, Surfaces
from renderer.scene import graph as graphs
from renderer.scene.camera import Camera
from renderer.scene.lights import Light
from renderer.scene.picture import Picture
from renderer.scene.view import main_camera, resolve

SHADOW_MAP = 4096
SIZE_LIMIT = 8192  # pixels of a side after supersampling


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
    the baked light; rays: of the bake, per vertex; shadow_map: pixels of a lamp's map; executor:
    walks for the technique `reference`, without it this process does; keep: which of kept.CACHES
    are read and written, `shadows` for the lamps' maps, `views` for frames' buffers.
    """

    def __init__(
        self,
        scene: pyrender.Scene,
        size: tuple[int, int] = (1920, 1080),
        supersample: int = 2,
        seed: int = 0,
        rays: int = 144,
        shadow_map: int = SHADOW_MAP,
        executor: Executor | None = None,
        keep: Collection[str] = (),
    ):
        width, height = size
        if min(width, height) < 16 or max(width, height) * supersample > SIZE_LIMIT:
            raise InputError(
                f"size is {width}x{height} at supersample {supersample}; expected 16 to "
                f"{SIZE_LIMIT // max(supersample, 1)} pixels a side"
            )
        if unknown := set(keep) - set(kept.CACHES):
            known = ", ".join(kept.CACHES)
            raise InputError(f"keep has {', '.join(sorted(unknown))}; expected some of {known}")
        if supersample not in (1, 2, 3, 4):
            raise InputError(f"supersample is {supersample!r}; expected 1, 2, 3 or 4")
        contents = graphs.contents(scene)
        if not contents.surfaces:
            raise InputError("the scene has no surface; expected at least one mesh")
        self.scene, self.size, self.supersample, self.seed = scene, size, supersample, seed
        self.executor, self._shadow_map, self._contents = executor, shadow_map, contents
        give_back_large()
        give_back()  # what the making of the scene has freed
        self.context = gl.Context()
        try:
            self._programs: dict = {}
            self.surroundings = Surroundings(contents.environment)
            self.surfaces = Surfaces(contents, contents.lights, self.surroundings, rays, seed)
            self.keep = frozenset(keep)
            self.kept_as = self._key(rays) if keep else ""
            if "views" not in keep:
                self.light_up()
        except BaseException:
            self.close()
            raise
        give_back()

    def _key(self, rays: int) -> str:
        """What shadow maps are kept by, and frames' buffers with their camera."""
        drawn = [*self.surfaces.surfaces, *self.surfaces.eyes]
        told = (self.info(), self.seed, rays, self._shadow_map)
        return kept.scene_key(self._contents, drawn, self.surroundings.content(), *told)

    @cached_property
    def hair(self) -> list[Hair]:
        """The strands of each mesh that has some."""
        base: dict[int, Drawn] = {}  # a mesh's first surface is what its hair stands on
        for drawn in self.surfaces.surfaces:
            base.setdefault(drawn.item.mesh, drawn)
        return [Hair(item, base[item.mesh]) for item in self._contents.strands]

    @property
    def has_hair(self) -> bool:
        """Whether anything in the scene has strands."""
        return bool(self._contents.strands)

    def _everything(self) -> list[np.ndarray]:
        """All points of the scene, mm, in arrays (N, 3)."""
        return [self.surfaces.vertices(), *(hair.points for hair in self.hair)]

    @cached_property
    def subject(self) -> np.ndarray:
        """What cameras look at (3,), mm: the scene's own, or the middle of all."""
        own = getattr(self.scene, "subject", None)
        if own is not None:
            return np.asarray(own, float)
        low, high = extremes(self._everything(), lambda points: points)
        return 0.5 * (low + high)

    @cached_property
    def lamps(self) -> Lamps:
        """The lamps with their maps, which are drawn when they are first asked for, or read where
        they are kept: ask before a target is bound, by `light_up`.
        """
        lamps = Lamps(
            self._contents.lights,
            self._everything(),
            [hair.casting(LEAST_MM) for hair in self.hair],
            self._shadow_map,
        )
        keeps = "shadows" in self.keep
        if keeps and kept.load_shadows(self.kept_as, lamps, self.hair):
            return lamps
        lamps.draw(self.program, self.surfaces, self.hair)
        for hair in self.hair:
            hair.light(self.context, self.program, lamps, self.surroundings)
            hair.rest()  # until surfaces are drawn
        if keeps:
            kept.keep_shadows(self.kept_as, lamps, self.hair)
        return lamps

    def light_up(self) -> None:
        """Have the lamps' maps drawn or read, with another target than what is bound."""
        _ = self.lamps
        give_back()

    def put_by(self) -> None:
        """Free the lamps' maps and the hair where they are kept, or all that they are for: whoever
        asks for them after all has them read from there.
        """
        kept_here = "shadows" in self.keep and caches.there("shadows", self.kept_as)
        if kept_here or self.keep.issuperset(kept.CACHES):
            for name in ("lamps", "hair"):
                self.__dict__.pop(name, None)
            gl.draw_nothing()  # which was drawn with them
            self.context.free_dropped()
            give_back()

    @property
    def lights(self) -> list[Light]:
        """The scene's lamps as values."""
        return self._contents.lights

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
        lens = confusion(camera, self.size[1]) if camera is not None else None
        return Frame(self, view, picture, lens)

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
        light: str | int = "all",
    ) -> gl.Target:
        """A surface's light over its texture atlas ("ATLAS") or over points on it ("POINTS").

        size: (width, height) in texels; points: from `surfaces.points`, whose size it is; point_mm:
        what a point stands for, finer relief fades; diffuse: how light passes the face;
        only_irradiance: specular and transmitted light are left out, which takes two thirds of
        the time; translucency: how what comes through is reckoned, None for nothing; light: "all",
        "lamps" or "environment" (with what surfaces send each other) alone, "none", or the number
        of a lamp. The target has
        PLACED_FORMATS; the caller frees it. Specular light, and Disney's diffuse, are those towards
        the subject's front.
        """
        self.context.make_current()
        self.light_up()
        target = gl.Target(*size, list(PLACED_FORMATS), depth=domain == "ATLAS")
        target.bind(clear=(0.0, 0.0, 0.0, 0.0))
        shared = {
            "camera_position": self.subject + [0.0, 0.0, 1e4],
            "view": np.eye(4),
            "projection": np.eye(4),
            "point_mm": point_mm,
        }
        sources = (self.lamps, self.surroundings)
        rest = (domain, drawn, points, diffuse, only_irradiance, translucency, light)
        self.surfaces.draw(self.program, *sources, shared, *rest)
        return target
