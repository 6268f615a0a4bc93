"""The renderer of one scene: what is made once, for any number of frames."""

from __future__ import annotations

from concurrent.futures import Executor
from typing import Self

import numpy as np
import pyrender

from renderer import VERSION, gl
from renderer.errors import InputError
from renderer.frame import Frame
from renderer.memory import give_back, give_back_large
from renderer.optics.transmittance import Translucency
from renderer.passes.environment import Surroundings
from renderer.passes.hair import Hair
from renderer.passes.lamps import LEAST_MM, Lamps
from renderer.passes.lens import confusion
from renderer.passes.points import Points
from renderer.passes.surfaces import PLACED_FORMATS, Drawn, Surfaces
from renderer.scene import graph as graphs
from renderer.scene.camera import Camera
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
    walks for the technique `reference`, without it this process does.
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
        self.executor = executor
        give_back_large()
        give_back()  # what the making of the scene has freed
        self.context = gl.Context()
        try:
            self._programs: dict = {}
            self.surroundings = Surroundings(contents.environment)
            self.surfaces = Surfaces(contents, contents.lights, self.surroundings, rays, seed)
            base: dict[int, Drawn] = {}  # a mesh's first surface is what its hair stands on
            for drawn in self.surfaces.surfaces:
                base.setdefault(drawn.item.mesh, drawn)
            self.hair = [Hair(item, base[item.mesh]) for item in contents.strands]
            points = [self.surfaces.vertices(), *(hair.points for hair in self.hair)]
            everything = np.vstack(points)
            casting = [hair.casting(LEAST_MM) for hair in self.hair]
            strands = np.vstack([np.empty((0, 3)), *casting])
            self.lamps = Lamps(contents.lights, everything, strands, shadow_map)
            self.lamps.draw(self.program, self.surfaces, self.hair)
            for hair in self.hair:
                hair.light(self.context, self.program, self.lamps, self.surroundings)
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
