"""The frame: shared passes once per framing,
then any number of techniques over the same buffers.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from OpenGL import GL

from renderer import VERSION, bake, gl, scene
from renderer.errors import InputError
from renderer.profiles import gaussians
from renderer.techniques.base import Inputs, Technique

LAMP_MAP = 4096
EXPOSURE = 0.76
BACKDROP = ((0.115, 0.120, 0.130), (0.022, 0.024, 0.028))  # radiance at the centre and at the edge
THICKNESS_SCALE = 0.38  # mm of slab per mm of depth-map thickness
TRANSMISSION_WRAP = 0.10  # E = saturate(wrap + L . -N): 0 is exact, the published shader uses 0.3
HAIR_EXTINCTION = 1.5
SIZE_LIMIT = 8192  # pixels of a side after supersampling


@dataclass(frozen=True)
class Result:
    """image (H, W, 3) uint8 sRGB; samples (H s, W s) uint8, 0 where no scattering material is seen;
    contrast (H s, W s) float32 in [0, 1], or None where the technique measures none."""

    image: np.ndarray
    samples: np.ndarray
    contrast: np.ndarray | None


class Renderer:
    """One OpenGL context with one model in it.

    size: (width, height) of the images; supersample: 1 to 4 samples a pixel along each side; seed:
    of the solid noise and of the bake; rays: of the bake, per vertex.
    """

    def __init__(
        self,
        model: scene.Model,
        size: tuple[int, int] = (1920, 1080),
        supersample: int = 2,
        seed: int = 0,
        rays: int = 144,
        studio: scene.Studio = scene.STUDIO,
    ):
        width, height = size
        if min(width, height) < 16 or max(width, height) * supersample > SIZE_LIMIT:
            raise InputError(
                f"size is {width}x{height} at supersample {supersample}; expected 16 to "
                f"{SIZE_LIMIT // max(supersample, 1)} pixels a side"
            )
        if supersample not in (1, 2, 3, 4):
            raise InputError(f"supersample is {supersample!r}; expected 1, 2, 3 or 4")
        self.model, self.size, self.supersample, self.seed, self.studio = (
            model,
            (width, height),
            supersample,
            seed,
            studio,
        )
        self.context = gl.Context()
        self._programs: dict = {}
        self._upload(rays)
        self._lamp_maps()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        self.context.close()

    def info(self) -> dict:
        """For the manifest: renderer version and what OpenGL says of itself."""
        return {"version": VERSION, **self.context.info}

    def program(
        self, fragment: str, defines: dict | None = None, vertex: str = "shaders/fullscreen.vert"
    ) -> gl.Program:
        """A program by its fragment shader, compiled once."""
        key = (fragment, vertex, tuple(sorted((defines or {}).items())))
        if key not in self._programs:
            self._programs[key] = gl.Program(fragment, vertex, defines)
        return self._programs[key]

    def _upload(self, rays: int) -> None:
        skin, model = self.model.skin, self.model
        proxy = skin.proxy
        baked, eyes = bake.bake_model(
            proxy.positions,
            proxy.normals,
            proxy.faces,
            proxy.albedo,
            model.eyes,
            self.studio,
            rays,
            self.seed,
        )
        light = proxy.to_full @ baked.light.reshape(-1, 9)
        openness = proxy.to_full @ baked.openness[:, None]
        self._skin_light = light
        scatters = np.ones(len(skin.positions)) if skin.scatters is None else skin.scatters
        self._skin = gl.Mesh(
            {
                0: skin.positions,
                1: skin.normals,
                2: skin.uvs,
                3: skin.masks[:, :4],
                4: skin.masks[:, 4:],
                5: light[:, 0:3],
                6: light[:, 3:6],
                7: light[:, 6:9],
                8: np.column_stack([openness, scatters]),
            },
            skin.faces,
        )
        self._eyes = []
        for eye, lit in zip(model.eyes, eyes, strict=True):
            n, flat = len(eye.positions), lit.light.reshape(-1, 9)
            self._eyes.append(
                gl.Mesh(
                    {
                        0: eye.positions,
                        1: eye.normals,
                        2: np.zeros((n, 2)),
                        3: np.zeros((n, 4)),
                        4: np.zeros((n, 4)),
                        5: flat[:, 0:3],
                        6: flat[:, 3:6],
                        7: flat[:, 6:9],
                        8: np.column_stack([lit.openness, np.zeros(n)]),
                    },
                    eye.faces,
                )
            )
        self._maps = {}
        for name, image in (
            ("albedo_map", skin.albedo_map),
            ("normal_map", skin.normal_map),
            ("roughness_map", skin.roughness_map),
        ):
            if image is None:
                self._maps[name] = gl.Texture(1, 1, GL.GL_RGBA8)
                continue
            if image.ndim == 2:
                image = np.repeat(image[..., None], 3, axis=2)
            rgba = np.dstack([image, np.full(image.shape[:2], 255, dtype=np.uint8)])[::-1]
            self._maps[name] = gl.Texture(
                rgba.shape[1],
                rgba.shape[0],
                GL.GL_RGBA8,
                linear=True,
                data=rgba,
                mipmap=True,
                repeat=True,
            )

    def _lamp_maps(self) -> None:
        """Linear depth from each lamp, mm: solid surfaces (also the thickness of skin), and strands
        apart.
        """
        strands = self.model.strands
        far = [1e6, 0.0, 0.0, 0.0]
        points = [self.model.skin.positions, *(eye.positions for eye in self.model.eyes)]
        if strands is not None:
            points.append(strands.points.reshape(-1, 3))
        everything = np.vstack(points)
        self._lamps = []
        program = self.program("passes/shadow.frag", vertex="passes/shadow.vert")
        for lamp in self.studio.lamps:
            matrix = scene.lamp_matrix(lamp, everything)
            solid = gl.Target(
                LAMP_MAP, LAMP_MAP, [GL.GL_R32F], depth=self._lamps[0][1] if self._lamps else True
            )
            solid.bind(clear=far, depth_test=True)
            program.use(lamp=matrix)
            self._skin.draw()
            for eye in self._eyes:
                eye.draw()
            hair = gl.Target(
                LAMP_MAP, LAMP_MAP, [GL.GL_R32F], depth=self._lamps[0][1] if self._lamps else solid
            )
            hair.bind(clear=far, depth_test=True)
            if strands is not None:
                ribbons = self._ribbons(lamp.towards, 0.16)
                ribbons.draw()
                ribbons.delete()
            self._lamps.append((matrix, solid, hair))

    def _ribbons(self, facing: np.ndarray, width_mm: float) -> gl.Mesh:
        """The strands as flat ribbons towards a lamp, for its shadow map."""
        points = self.model.strands.points.astype(np.float32)
        tangent = np.gradient(points, axis=1)
        across = np.cross(tangent, facing.astype(np.float32))
        across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-6)
        taper = np.linspace(1.0, 0.4, points.shape[1], dtype=np.float32)[None, :, None]
        both = np.stack(
            [points - 0.5 * width_mm * taper * across, points + 0.5 * width_mm * taper * across],
            axis=2,
        )
        return gl.Mesh({0: both.reshape(-1, 3)}, ribbon_faces(*points.shape[:2]))

    def frame(self, framing: str) -> Frame:
        """Draw what all techniques share for one framing, by name."""
        if framing not in scene.FRAMINGS:
            raise InputError(f"no framing {framing!r}; expected one of {', '.join(scene.FRAMINGS)}")
        self.context.make_current()
        return Frame(self, framing)


def ribbon_faces(strands: int, points: int) -> np.ndarray:
    """Triangles (2 S (P - 1), 3) of S ribbons of P point pairs, strand by strand."""
    base = (np.arange(strands)[:, None] * points + np.arange(points - 1)[None]).ravel() * 2
    return np.stack([base, base + 1, base + 2, base + 1, base + 3, base + 2], axis=1).reshape(-1, 3)


class Frame:
    """The shared buffers of one framing. They stay until close() or the next frame's end."""

    def __init__(self, renderer: Renderer, framing: str):
        self.renderer, self.framing = renderer, framing
        s = renderer.supersample
        self.width, self.height = renderer.size[0] * s, renderer.size[1] * s
        self.view = scene.resolve(
            scene.FRAMINGS[framing],
            renderer.model.landmarks,
            self.width,
            self.height,
            renderer.studio,
        )
        self._draw_surfaces()
        self._draw_hair()
        self._lit_through: gl.Target | None = None
        gl.finish()

    def _lighting(self) -> dict:
        lamps = self.renderer._lamps
        return {
            "camera_position": self.view.eye,
            **self.renderer.studio.uniforms(),
            "lamp_matrix": np.array([m for m, _, _ in lamps]),
            "lamp_depth_0": lamps[0][1].textures[0],
            "lamp_depth_1": lamps[1][1].textures[0],
            "lamp_strands_0": lamps[0][2].textures[0],
            "lamp_strands_1": lamps[1][2].textures[0],
            "view": self.view.view,
            "projection": self.view.projection,
        }

    def _defines(self) -> dict:
        return {"LAMPS": len(self.renderer.studio.lamps), "LOBES": len(self.renderer.studio.lobes)}

    def _draw_surfaces(self) -> None:
        r, model = self.renderer, self.renderer.model
        self.surface = gl.Target(
            self.width,
            self.height,
            [GL.GL_RGBA32F, GL.GL_RGBA16F, GL.GL_RGBA16F, GL.GL_RGBA32F, GL.GL_RGBA16F],
            depth=True,
        )
        self.surface.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True)
        GL.glColorMask(False, False, False, False)
        depth = r.program("passes/depth.frag", vertex="passes/surface.vert")
        depth.use(view=self.view.view, projection=self.view.projection)
        r._skin.draw()
        for eye in r._eyes:
            eye.draw()
        GL.glColorMask(True, True, True, True)
        shared = self._lighting()
        skin = r.program("passes/skin.frag", self._defines(), vertex="passes/surface.vert")
        rng = np.random.default_rng([r.seed, 3])
        where = {name: model.landmarks[name] for name in ("eye_l", "eye_r", "mouth", "nose")}
        values = dict(
            **shared,
            **where,
            procedural=int(model.procedural),
            noise_origin=rng.uniform(100, 900, 3),
            has_albedo_map=model.skin.albedo_map is not None,
            has_normal_map=model.skin.normal_map is not None,
            has_roughness_map=model.skin.roughness_map is not None,
            base_colour=model.skin.base_colour or (0.5, 0.5, 0.5),
            gaussian_falloff=0.5 / gaussians.SKIN_VARIANCE_MM2,
            gaussian_weight=gaussians.SKIN_WEIGHTS,
            thickness_scale=THICKNESS_SCALE,
            transmission_wrap=TRANSMISSION_WRAP,
            **r._maps,
        )
        skin.use(**skin.accepts(values))
        r._skin.draw()
        program = r.program("passes/eye.frag", self._defines(), vertex="passes/surface.vert")
        for eye, mesh in zip(model.eyes, r._eyes, strict=True):
            program.use(
                **program.accepts(
                    dict(
                        shared,
                        centre=eye.centre,
                        gaze=eye.gaze,
                        radius=eye.radius,
                        iris_radius=eye.iris_radius,
                    )
                )
            )
            mesh.draw()

    def _draw_hair(self) -> None:
        r, strands = self.renderer, self.renderer.model.strands
        self.hair = gl.Target(self.width, self.height, [GL.GL_RGBA16F], depth=self.surface)
        self.hair.bind(clear=(0.0, 0.0, 0.0, 0.0), depth_test=True, blend="over")
        if strands is None:
            return
        distance = np.linalg.norm(strands.points.mean(axis=1) - self.view.eye, axis=1)
        order = np.argsort(-distance, kind="stable")  # far strands first: blended back to front
        points = strands.points[order].astype(np.float32)
        n, p = points.shape[:2]
        tangent = np.gradient(points, axis=1)  # float32, as the points
        tangent /= np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), 1e-6)
        root = strands.root_vertex[order]
        normal = r.model.skin.normals[root]
        light = r._skin_light[root].reshape(n, 3, 3)
        environment = np.maximum(np.einsum("nci,ni->nc", light, normal), 0)

        def twice(array: np.ndarray) -> np.ndarray:
            return np.repeat(array.reshape(n * p, -1).astype(np.float32), 2, axis=0)

        side = np.tile([-1.0, 1.0], n * p)[:, None]
        width = twice(np.repeat(strands.width_mm[order][:, None], p, axis=1))
        along = twice(np.tile(np.linspace(0, 1, p), (n, 1)))
        per_strand = lambda a: twice(np.repeat(a[:, None, :], p, axis=1))
        mesh = gl.Mesh(
            {
                0: twice(points),
                1: twice(tangent),
                2: np.hstack([side, width, twice(strands.cover[order]), along]),
                3: per_strand(strands.colour[order]),
                4: per_strand(environment),
                5: per_strand(normal),
            },
            ribbon_faces(n, p),
        )
        program = r.program("passes/hair.frag", self._defines(), vertex="passes/hair.vert")
        program.use(
            **program.accepts(
                dict(
                    self._lighting(),
                    pixels_per_mm=self.view.pixels_per_mm,
                    minimum_px=1.3,
                    extinction=HAIR_EXTINCTION,
                )
            )
        )
        mesh.draw()
        mesh.delete()

    def irradiance(self, translucent: bool) -> gl.Texture:
        """The input of the techniques: irradiance, with the transmitted light of Jimenez 2010 added
        or not.
        """
        if not translucent:
            return self.surface.textures[0]
        if self._lit_through is None:
            self._lit_through = gl.Target(self.width, self.height, [GL.GL_RGBA32F])
            self._lit_through.bind()
            self.renderer.program("passes/add.frag").use(
                irradiance=self.surface.textures[0], transmitted=self.surface.textures[4]
            )
            gl.draw_fullscreen(self.renderer.context)
        return self._lit_through.textures[0]

    def inputs(
        self,
        translucent: bool,
        irradiance: gl.Texture | None = None,
        depth_normal: gl.Texture | None = None,
    ) -> Inputs:
        """What a technique gets; the textures can be replaced (tests use a flat patch)."""
        r = self.renderer
        return Inputs(
            r.context,
            r.program,
            irradiance or self.irradiance(translucent),
            depth_normal or self.surface.textures[3],
            self.width,
            self.height,
            self.view.pixels_per_mm,
            r.supersample,
        )

    def render(self, technique: Technique) -> Result:
        """The image of one technique."""
        r = self.renderer
        r.context.make_current()
        scattered = technique.scatter(self.inputs(technique.translucent))
        light, info = scattered.target.textures
        colour = gl.Target(self.width, self.height, [GL.GL_RGBA16F])
        colour.bind()
        surface = self.surface.textures
        r.program("passes/composite.frag").use(
            scattered=light,
            specular=surface[1],
            albedo=surface[2],
            depth_normal=surface[3],
            hair=self.hair.textures[0],
            exposure=EXPOSURE,
            backdrop_centre=BACKDROP[0],
            backdrop_edge=BACKDROP[1],
            aspect=self.width / self.height,
        )
        gl.draw_fullscreen(r.context)
        final = gl.Target(*r.size, [GL.GL_RGBA32F])
        final.bind()
        r.program("passes/resolve.frag").use(colour_map=colour.textures[0], factor=r.supersample)
        gl.draw_fullscreen(r.context)
        image = np.rint(final.textures[0].read()[..., :3] * 255).astype(np.uint8)
        counts = info.read()
        result = Result(
            image,
            np.rint(counts[..., 0]).astype(np.uint8),
            counts[..., 1].copy() if technique.measures_contrast else None,
        )
        for target in (scattered.target, colour, final):
            target.delete()
        return result

    def time(self, techniques: dict[str, Technique], rounds: int) -> dict[str, np.ndarray]:
        """Seconds that scattering alone takes: name -> (rounds, 2) of wall and CPU time.

        The techniques run in turn, so that a machine's drift hits all alike; a round that compiles
        shaders goes before.
        """
        self.renderer.context.make_current()
        spent = {name: np.empty((rounds, 2)) for name in techniques}
        for k in range(-1, rounds):
            for name, technique in techniques.items():
                inputs = self.inputs(technique.translucent)
                gl.finish()
                start = np.array([time.perf_counter(), time.process_time()])
                scattered = technique.scatter(inputs)
                gl.finish()
                if k >= 0:
                    spent[name][k] = np.array([time.perf_counter(), time.process_time()]) - start
                scattered.target.delete()
        return spent

    def close(self) -> None:
        """Free the shared buffers."""
        for target in filter(None, (self._lit_through, self.hair, self.surface)):
            target.delete()
