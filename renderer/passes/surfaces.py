"""Surfaces and eyes under the scene's light, drawn over a domain by the same shading code.

A domain is where a fragment lies: the screen, an object's texture atlas, or points that are listed
one by one; the lamps' own views (depth alone) are `renderer.passes.lamps`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from renderer import caches, gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.optics import media, surface
from renderer.optics import skin as spectral
from renderer.optics.curve import Curve
from renderer.optics.transmittance import TABLE, THICKNESS, Translucency, curve_of
from renderer.passes import facing
from renderer.passes.bake import Baked, Body, bake, body
from renderer.passes.environment import Surroundings
from renderer.passes.lamps import Lamps, of_lamps
from renderer.passes.points import COLUMNS, MOST_TRIANGLES, Points, SurfaceLists
from renderer.scene import lights as lamps_of_a_scene
from renderer.scene import maps as maps_of_a_scene
from renderer.scene.graph import Contents, Item
from renderer.scene.material import (
    INSIDE,
    LAYERS,
    MAPS,
    MODELS,
    ROOTED,
    SCALP,
    SHAVEN,
    Material,
    Shading,
    Skin,
)
from renderer.scene.model import MASKS

_HALF = GL.GL_RGBA16F
#: Irradiance and the material's id; specular; albedo; view depth.
FORMATS = (GL.GL_RGBA32F, _HALF, _HALF, GL.GL_R32F)
#: Over an atlas or points: the normal in the depth's stead, what comes through, the place in the
#: world.
PLACED_FORMATS = (GL.GL_RGBA32F, _HALF, _HALF, _HALF, _HALF, GL.GL_RGBA32F)

#: Shares of light from behind that a skin's fields stop (passes/lids.glsl).
STOPS = ("tarsus", "lip_muscle", "nose_wing", "cartilage")
#: Fields of a skin that passes/skin.frag takes under their own names.
SKIN_UNIFORMS = (
    "melanin",
    "blood",
    "flush",
    "mottling",
    "scalp_from",
    "uneven",
    "eyelid_blood",
    "eyelid_epidermis",
    "lip_blood",
    "lip_melanin",
    "lip_melanin_inner",
    "lip_epidermis",
    "lip_haze",
    "lip_haze_colour",
    "lip_ragged",
    "freckles",
    "freckle_share",
    "spots",
    "spot_share",
    "spots_mm",
    "red_spots",
    "red_share",
    "moles",
    "mole_share",
    "vessels",
    "veins",
    "micro_mm",
    "bumps_mm",
    "f0_oily",
    "roughness_dry",
    "roughness_oily",
    "roughness_lips",
    "lobe_share_oily",
    "oil_patches",
)

#: The code that baked light follows from.
BAKED_BY = [
    Path(__file__).with_name("bake.py"),
    Path(__file__).with_name("environment.py"),
    Path(lamps_of_a_scene.__file__),
    Path(maps_of_a_scene.__file__),
]

Program = Callable[..., gl.Program]


@dataclass
class Drawn:
    """A surface or an eye on the graphics card. id: of the scattering material, 0 for none; gaze
    (3,): of an eye, in its head's axes, None before the first picture.
    """

    item: Item
    mesh: gl.Mesh
    baked: Baked
    id: int = 0
    maps: dict[str, gl.Texture] | None = None
    lists: SurfaceLists | None = None
    gaze: np.ndarray | None = None

    @cached_property
    def corners(self) -> facing.Corners:
        """The surface's triangles as lamps see them."""
        part = self.item.primitive
        return facing.Corners(
            self.item.in_world(part.positions), self.item.turned(part.normals), part.faces
        )


class Surfaces:
    """All surfaces and eyes of a scene, with the light that was baked on them.

    media: the media that scatter, in the order of their ids, 1 first.
    """

    def __init__(
        self, contents: Contents, lights: Sequence, surroundings: Surroundings, rays: int, seed: int
    ):
        self.seed = seed
        table = surface.table()
        height, width = table.shape[:2]
        self.face = gl.Texture(width, height, GL.GL_RGBA32F, linear=True, data=table)
        items = [*contents.surfaces, *contents.eyes]
        eyes_of: dict[int, list[Item]] = {}
        for item in contents.eyes:
            eyes_of.setdefault(item.mesh, []).append(item)
        clothes_of: dict[int, list[Item]] = {}
        worn_over: dict[int, Item] = {}  # a head's skin is the first surface of its mesh
        for item in contents.surfaces:
            if worn_over.setdefault(item.mesh, item) is not item:
                clothes_of.setdefault(item.mesh, []).append(item)
        bodies = []
        for item in items:
            is_skin = worn_over.get(item.mesh) is item
            clothes = clothes_of.get(item.mesh, ()) if is_skin else ()
            bodies.append(body(item, eyes_of.get(item.mesh, ()), clothes))
        baked = _baked(bodies, lights, surroundings, rays, seed) if bodies else []
        self.media: list[str | dict] = []
        self._skin_tables: dict[spectral.Layers, gl.Texture] = {}
        self._transmittances: dict[tuple[int, str, str], tuple[gl.Texture, float]] = {}
        self.surfaces = [
            self._surface(item, b) for item, b in zip(contents.surfaces, baked, strict=False)
        ]
        eyes = baked[len(contents.surfaces) :]
        self.eyes = [_eye(item, b) for item, b in zip(contents.eyes, eyes, strict=True)]
        self._no_edges = gl.Texture(1, 1, GL.GL_RG16F)

    def _surface(self, item: Item, baked: Baked) -> Drawn:
        part = item.primitive
        material: Material = part.material.value
        light = part.proxy.to_full @ baked.light.reshape(-1, 9)
        openness = part.proxy.to_full @ baked.openness[:, None]
        sky = part.proxy.to_full @ baked.sky
        scatters = np.ones(len(part.positions)) if part.scatters is None else part.scatters
        attributes = _attributes(part, part.masks, light, openness, scatters) | {9: sky}
        mesh = gl.Mesh(attributes, part.faces)
        number = 0
        if material.scatters and np.any(scatters):
            medium = material.layered()
            if medium not in self.media:
                self.media.append(medium)
            number = 1 + self.media.index(medium)
        maps = {name: _map(part.material.maps.get(name)) for name in MAPS}
        whole = Baked(light.reshape(-1, 3, 3), openness[:, 0], sky)
        return Drawn(item, mesh, whole, number, maps)

    def curve(self, medium: int) -> Curve:
        """The reference curve of a medium by its id; of the default skin where none scatters."""
        if not self.media:
            return media.curve("skin")
        return media.curve(self.media[medium - 1])

    def vertices(self) -> np.ndarray:
        """All positions (N, 3) in the world, mm."""
        drawn = [*self.surfaces, *self.eyes]
        return np.vstack([d.item.in_world(d.item.primitive.positions) for d in drawn])

    def draw_depth(self, program: gl.Program, shared: dict) -> None:
        """Only where the surfaces are, with a program that takes `model`."""
        for drawn in (*self.surfaces, *self.eyes):
            program.use(**program.accepts({**shared, "model": drawn.item.pose}))
            drawn.mesh.draw()

    def draw(
        self,
        programs: Program,
        lamps: Lamps,
        surroundings: Surroundings,
        shared: dict,
        domain: str = "SCREEN",
        only: Drawn | None = None,
        points: Points | None = None,
        diffuse: str = "lambert",
        only_irradiance: bool = False,
        translucency: Translucency | None = None,
        light: str | int = "all",
    ) -> None:
        """Shade into the bound target: everything, or over a domain `only` one surface.

        shared: camera_position, view, projection (and point_mm for POINTS); points: those of the
        domain POINTS; diffuse: how light passes the face (renderer.optics.surface);
        only_irradiance: without specular and transmitted light; translucency: how what comes
        through is reckoned, over other domains than the screen; light: "all", "lamps" or
        "environment" alone, "none", or the number of a lamp.
        """
        defines = {**lamps.defines(), **surroundings.defines(), "DOMAIN": domain}
        values = {**shared, **lamps.uniforms(), **surroundings.uniforms(), "face_table": self.face}
        own = {**defines, "DIFFUSE": surface.DIFFUSE.index(diffuse), "HORIZON": facing.HORIZON}
        values["mean_radiance"] = surroundings.mean()
        values["even_light"] = float(light in ("all", "environment"))
        if light not in ("all", "lamps"):
            lit = np.arange(len(values["lamp_irradiance"])) == light
            values["lamp_irradiance"] = values["lamp_irradiance"] * lit[:, None]
        if only_irradiance:
            own["DIFFUSE_ONLY"] = 1
        if points is not None:
            values |= points.uniforms()
        for drawn in self.surfaces if only is None else [only]:
            local = isinstance(drawn.item.primitive.material.value, Shading)
            shader = "passes/local.frag" if local else "passes/skin.frag"
            vertex = "passes/surface.vert" if points is None else "shaders/fullscreen.vert"
            program = programs(shader, own, vertex=vertex)
            own_values = {**self._material(drawn), **self._through(drawn, translucency)}
            if domain == "SCREEN" and not local:
                can = drawn.corners.lit(lamps.lights)
                can |= drawn.corners.behind(shared["camera_position"])
                _draw_groups(drawn, can, program, values, own_values)
                continue
            program.use(**program.accepts({**values, **own_values}))
            if points is None:
                drawn.mesh.draw()
            else:
                gl.draw_fullscreen(gl.Context.current)
        if only is not None:
            return
        program = programs("passes/eye.frag", defines, vertex="passes/surface.vert")
        for drawn in self.eyes:
            own = self._eye_values(drawn)
            program.use(**program.accepts({**values, **own}))
            drawn.mesh.draw()

    def look(self, lens: np.ndarray) -> None:
        """Turn the eyes that look into the lens, at (3,) mm in the world, towards it."""
        for drawn in self.eyes:
            eye, pose = drawn.item.primitive.eye, drawn.item.pose
            size = np.linalg.norm(pose[:3, 0])
            gaze = eye.towards((lens - pose[:3, 3]) @ pose[:3, :3] / size**2)
            if drawn.gaze is None or not np.array_equal(gaze, drawn.gaze):
                drawn.mesh.delete()
                drawn.mesh = _eye_mesh(drawn.item.primitive, drawn.baked, eye.looking(gaze))
                drawn.gaze = gaze

    def _eye_values(self, drawn: Drawn) -> dict:
        """The uniforms of an eye."""
        eye, pose = drawn.item.primitive.eye, drawn.item.pose
        size = float(np.linalg.norm(pose[:3, 0]))
        gaze = eye.gaze if drawn.gaze is None else drawn.gaze
        rng = np.random.default_rng([self.seed, 3])
        return {
            "model": pose,
            "centre": pose[:3, :3] @ eye.centre + pose[:3, 3],
            "gaze": pose[:3, :3] @ gaze / size,
            "size": size,
            "radius": eye.radius,
            "iris_radius": eye.iris_radius,
            "iris_base": eye.colours["iris"],
            "iris_fibres": eye.colours["fibres"],
            "iris_collarette": eye.colours["collarette"],
            "sclera_colour": eye.colours["sclera"],
            **eye.values,
            "has_edges": int(eye.edges.size > 2),
            "edges_mm": eye.edges_mm,
            "vessels_rad": eye.VESSELS_RAD,
            "noise_origin": rng.uniform(100, 900, 3),
            **drawn.maps,
        }

    def draw_transmitted(
        self,
        programs: Program,
        lamps: Lamps,
        surroundings: Surroundings,
        shared: dict,
        translucency: Translucency,
    ) -> None:
        """What comes through the surfaces that scatter, over the screen, into the bound target."""
        defines = {**lamps.defines(), **surroundings.defines(), "DOMAIN": "SCREEN"}
        program = programs("passes/transmitted.frag", defines, vertex="passes/surface.vert")
        values = {**shared, **lamps.uniforms(), **surroundings.uniforms()}
        for drawn in self.surfaces:
            if drawn.id:
                through = self._through(drawn, translucency)
                own = {"model": drawn.item.pose, **through, **self.flesh(drawn)}
                can = drawn.corners.lit_through(lamps.lights, translucency.wrap)
                can |= drawn.corners.behind(shared["camera_position"])
                _draw_groups(drawn, can, program, values, own, unlit=False)

    def _through(self, drawn: Drawn, translucency: Translucency | None) -> dict:
        """The uniforms of passes/transmission.glsl for a surface."""
        if not translucency or not drawn.id:
            return {
                "transmittance": self.face,
                "transmittance_reach": 0.0,
                "thickness_scale": 0.0,
                "transmission_thickness": 0,
                "transmission_wrap": 0.0,
            }
        key = (drawn.id, translucency.model, translucency.exponent)
        if key not in self._transmittances:
            medium = self.media[drawn.id - 1]
            curve = curve_of(medium, translucency.model, translucency.exponent)
            table = np.ones((1, TABLE, 4), np.float32)
            table[0, :, :3] = curve.table()
            texture = gl.Texture(TABLE, 1, GL.GL_RGBA32F, linear=True, data=table)
            self._transmittances[key] = (texture, curve.reach_mm)
        texture, reach_mm = self._transmittances[key]
        return {
            "transmittance": texture,
            "transmittance_reach": reach_mm,
            "thickness_scale": translucency.thickness_scale,
            "transmission_wrap": translucency.wrap,
            "transmission_thickness": THICKNESS.index(translucency.thickness),
        }

    def flesh(self, drawn: Drawn) -> dict:
        """The uniforms of passes/lids.glsl: the lids of a surface before the eyes of its mesh, and
        what stops light in them, in lips and in ears.
        """
        eyes = [eye for eye in self.eyes if eye.item.mesh == drawn.item.mesh][:2]
        eyes = [eye for eye in eyes if eye.item.primitive.eye.edges.size > 2]
        shapes = [eye.item.primitive.eye for eye in eyes]
        material = drawn.item.primitive.material.value
        skin = material if isinstance(material, Skin) else Skin  # whose defaults stop light too
        balls = [[*shape.centre, shape.radius] for shape in shapes]
        marks, nowhere = drawn.item.primitive.landmarks, np.full(3, 1e6)
        textures = [eye.maps["edges"] for eye in eyes if eye.maps]
        textures += [self._no_edges] * (2 - len(textures))
        return {
            "lid_count": len(eyes),
            **{name: getattr(skin, name) for name in STOPS},
            **{name: marks.get(name, nowhere) for name in ("ear_l", "ear_r")},
            "lid_ball": np.array(balls + [[0.0, 0.0, 0.0, 1.0]] * (2 - len(balls))),
            "edges_a": textures[0],
            "edges_b": textures[1],
            "edges_mm": shapes[0].edges_mm if shapes else (1.0, 1.0),
        }

    def _material(self, drawn: Drawn) -> dict:
        """The uniforms of a surface's material."""
        part = drawn.item.primitive
        material, marks = part.material.value, part.landmarks
        skin = material if isinstance(material, Skin) else Skin()
        rng = np.random.default_rng([self.seed, 3])
        nowhere = np.zeros(3)
        layers = skin.map_layers if "albedo_map" in part.material.maps else LAYERS
        return {
            "model": drawn.item.pose,
            "procedural": int(isinstance(material, Skin)),
            **{f"layer_{name}": float(name in layers) for name in LAYERS},
            "noise_origin": rng.uniform(100, 900, 3),
            **{name: marks.get(name, nowhere) for name in ("eye_l", "eye_r", "mouth", "nose")},
            **{f"has_{name}": name in part.material.maps for name in MAPS},
            "height_mm": material.height_mm,
            **drawn.maps,
            "albedo_colour": material.albedo,
            "roughness": material.roughness,
            "f0": material.f0,
            "specular_strength": material.specular,
            "lobe_roughness": material.lobe_roughness,
            "lobe_share": material.lobe_share,
            "material_id": float(drawn.id),
            "skin_table": self._skin_table(skin),
            "skin_most": (spectral.MOST_BLOOD, spectral.MOST_MELANIN),
            "skin_thinnest": spectral.THINNEST,
            "skin_blocks": float(spectral.SIZE[0]),
            **{name: getattr(skin, name) for name in SKIN_UNIFORMS},
            "beard_tint": skin.beard,
            "scalp_tint": skin.scalp,
            "scalp_left": SCALP,
            "rooted_left": ROOTED,
            "shaven_left": SHAVEN,
            "inside_left": INSIDE,
            "pore_darkness": skin.pore_shade,
            "pore_depth": skin.pores,
            "furrow_depth": skin.furrows,
            "bump_height": skin.bumps,
            "wrinkle_depth": skin.wrinkles if "eye_l" in marks else 0.0,
            "forehead_lines": skin.forehead_lines_mm,
            "forehead_lines_half": skin.forehead_lines_half_mm,
            "forehead_lines_period": skin.forehead_lines_period_mm,
            "forehead_lines_width": skin.forehead_lines_width_mm,
            "crows_feet_place": skin.crows_feet_place_mm,
            "crows_feet": skin.crows_feet_mm,
            "crows_feet_angle": skin.crows_feet_rad,
            "lid_lines": skin.lid_lines_mm,
            "lid_lines_half": skin.lid_lines_half_mm,
            "lid_lines_period": skin.lid_lines_period_mm,
            "wrinkles_behind": skin.wrinkles_behind_mm,
            "lip_folds": skin.lip_folds,
            "lid_margin": skin.lid_margin,
            "lid_margin_shares": skin.lid_margin_shares,
            "lash_line": skin.lash_line,
            **self.flesh(drawn),
            **(_local(material) if isinstance(material, Shading) else {}),
        }

    def _skin_table(self, material: Skin) -> gl.Texture:
        """The spectral model's table of colours for a skin, made once."""
        layers = material.layers
        if layers not in self._skin_tables:
            values = spectral.table(layers)
            blocks, rows, columns, _ = values.shape
            texels = np.zeros((blocks * rows, columns, 4), np.float32)
            texels[..., :3] = values.reshape(-1, columns, 3)
            size = (columns, blocks * rows, GL.GL_RGBA32F)
            self._skin_tables[layers] = gl.Texture(*size, linear=True, data=texels)
        return self._skin_tables[layers]

    def points(
        self, drawn: Drawn, faces: np.ndarray, weights: np.ndarray, columns: int = COLUMNS
    ) -> Points:
        """Points on a surface: triangles (K,) and barycentric weights (K, 3)."""
        part = drawn.item.primitive
        if len(part.faces) > MOST_TRIANGLES:
            raise InputError(
                f"a surface has {len(part.faces)} triangles; expected at most {MOST_TRIANGLES} for "
                "techniques that put points on it"
            )
        if drawn.lists is None:
            scatters = np.ones(len(part.positions)) if part.scatters is None else part.scatters
            light, openness = drawn.baked.light.reshape(-1, 9), drawn.baked.openness[:, None]
            attributes = _attributes(part, part.masks, light, openness, scatters)
            drawn.lists = SurfaceLists(attributes | {9: drawn.baked.sky}, part.faces)
        return Points(drawn.lists, faces, weights, columns)


def _draw_groups(
    drawn: Drawn, can: np.ndarray, program: gl.Program, values: dict, own: dict, unlit: bool = True
) -> None:
    """Draw a surface, each triangle with the lamps that matter to it.

    can (lamps, M): whether a lamp does; values: with all lamps; unlit: with what none does.
    """
    for group in facing.groups(drawn.item.primitive.faces, can):
        if unlit or group.lamps:
            chosen = {**values, **of_lamps(values, group.lamps), **own}
            program.use(**program.accepts(chosen))
            drawn.mesh.draw_some(group.faces)


def _baked(
    bodies: list[Body], lights: Sequence, surroundings: Surroundings, rays: int, seed: int
) -> list[Baked]:
    """The light on each body, from the cache where it was baked before."""
    meshes = [part for body in bodies for part in vars(body).values()]
    parts = (*meshes, *lights, *surroundings.content(), rays, seed)
    key = caches.key(parts, BAKED_BY, ("numpy", "scipy", "trimesh", "embreex"))

    def make() -> caches.Arrays:
        made = bake(bodies, lights, surroundings.radiance, rays, seed)
        kept = enumerate(vars(one) for one in made)
        return {f"{name}_{k}": value for k, one in kept for name, value in one.items()}

    arrays = caches.kept("light", key, make)
    names = Baked.__dataclass_fields__
    return [Baked(*(arrays[f"{name}_{k}"] for name in names)) for k in range(len(bodies))]


def _local(material: Shading) -> dict:
    """The uniforms of an illumination model, passes/local.frag."""
    return {
        "model_number": MODELS.index(material.model),
        "k_a": (-1.0,) * 3 if material.k_a is None else material.k_a,
        "k_s": material.k_s,
        "exponent": material.exponent,
        "emission": material.emission,
    }


def _attributes(part, masks, light, openness, scatters) -> dict[int, np.ndarray]:
    """What surface.vert reads, by location."""
    count = len(part.positions)
    uvs = np.zeros((count, 2)) if part.texcoord_0 is None else part.texcoord_0
    return {
        0: part.positions,
        1: part.normals,
        2: uvs,
        3: masks[:, :4],
        4: masks[:, 4:],
        5: light[:, 0:3],
        6: light[:, 3:6],
        7: light[:, 6:9],
        8: np.column_stack([openness, scatters]),
    }


def _eye(item: Item, baked: Baked) -> Drawn:
    part = item.primitive
    height, width = part.eye.edges.shape[:2]
    edges = gl.Texture(width, height, GL.GL_RG16F, linear=True, data=part.eye.edges)
    grey = np.repeat(part.eye.vessels[..., None], 4, axis=2)
    side = len(grey)
    vessels = gl.Texture(side, side, GL.GL_RGBA8, linear=True, mipmap=True, data=grey)
    mesh = _eye_mesh(part, baked, (part.positions, part.normals))
    return Drawn(item, mesh, baked, maps={"edges": edges, "vessels": vessels})


def _eye_mesh(part, baked: Baked, shape: tuple[np.ndarray, np.ndarray]) -> gl.Mesh:
    """An eye of positions and normals (N, 3)."""
    count = len(part.positions)
    masks = np.zeros((count, len(MASKS)))
    masks[:, :2] = part.eye.tissue
    light, openness = baked.light.reshape(-1, 9), baked.openness[:, None]
    attributes = _attributes(part, masks, light, openness, np.zeros(count))
    attributes[0], attributes[1] = shape
    return gl.Mesh(attributes, part.faces)


def _map(image: np.ndarray | None) -> gl.Texture:
    """A material's map, see renderer.scene.model.Surface; one texel for none."""
    if image is None:
        return gl.Texture(1, 1, GL.GL_RGBA8)
    smooth = {"linear": True, "mipmap": True, "repeat": True}
    if image.dtype != np.uint8:
        height, width = image.shape
        return gl.Texture(width, height, GL.GL_R32F, data=image[::-1, :, None], **smooth)
    if image.ndim == 2:
        image = np.repeat(image[..., None], 3, axis=2)
    rgba = np.dstack([image, np.full(image.shape[:2], 255, dtype=np.uint8)])[::-1]
    height, width = rgba.shape[:2]
    return gl.Texture(width, height, GL.GL_RGBA8, data=rgba, **smooth)
