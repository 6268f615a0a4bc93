"""The scene graph: pyrender's scene, meshes and lights, extended by what these passes need.

A `pyrender.Scene` of one's own can be handed to the renderer too: its meshes become opaque
surfaces with their base colours, or those of a SurfaceMaterial where they have one, its lights
lamps without a size, its ambient light a constant environment. Lengths are millimetres; a point
light's `intensity` is its irradiance at one metre.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pyrender

from renderer.scene.camera import Camera
from renderer.scene.lights import DistantLight, Environment, Light, PointLight, SpotLight
from renderer.scene.material import Material
from renderer.scene.model import MASKS, Eye, Model, Proxy, Strands, Surface
from renderer.scene.picture import Picture


class SurfaceMaterial(pyrender.Material):
    """Our material and its maps, as a pyrender material.

    value: renderer.scene.material.Material; maps: as renderer.scene.model.Surface has them.
    """

    def __init__(self, value: Material, maps: dict[str, np.ndarray] | None = None):
        super().__init__(name=type(value).__name__)
        self.value = value
        self.maps = maps or {}

    @property
    def is_transparent(self) -> bool:
        return False

    def _compute_tex_flags(self) -> int:
        return 0


class SurfacePrimitive(pyrender.Primitive):
    """Triangles with masks, a mesh to bake light on, and the landmarks of a head if it is one."""

    def __init__(self, skin: Surface, material: SurfaceMaterial, landmarks: dict[str, np.ndarray]):
        super().__init__(skin.positions, skin.normals, None, skin.uvs, indices=skin.faces)
        self.material = material
        self.faces = skin.faces  # pyrender keeps indices as floats
        self.masks, self.proxy, self.scatters = skin.masks, skin.proxy, skin.scatters
        self.landmarks = landmarks


class EyePrimitive(pyrender.Primitive):
    """An eyeball; see renderer.scene.model.Eye."""

    def __init__(self, eye: Eye):
        super().__init__(eye.positions, eye.normals, indices=eye.faces)
        self.eye, self.faces = eye, eye.faces


class StrandPrimitive(pyrender.Primitive):
    """Hair: its points as lines; the strands stand on the surface of the same mesh."""

    def __init__(self, strands: Strands):
        self.strands = strands
        super().__init__(strands.points, mode=1)

    @property
    def indices(self) -> np.ndarray:
        """The lines (L, 2), made when pyrender asks for them to draw them itself."""
        start = np.delete(np.arange(len(self.strands.points)), self.strands.first[1:] - 1)
        return np.stack([start, start + 1], axis=1)

    @indices.setter
    def indices(self, given: None) -> None:
        """pyrender says that there are none."""


class DistantLamp(pyrender.DirectionalLight):
    """A distant light with an angular radius."""

    def __init__(self, value: DistantLight, name: str | None = None):
        super().__init__(*_colour(value), name=name)
        self.value = value


class PointLamp(pyrender.PointLight):
    """A point light with a radius and an attenuation."""

    def __init__(self, value: PointLight, name: str | None = None):
        super().__init__(*_colour(value), name=name)
        self.value = value


class SpotLamp(pyrender.SpotLight):
    """A spot light with a radius and an attenuation."""

    def __init__(self, value: SpotLight, name: str | None = None):
        cone = (np.radians(value.inner_deg), np.radians(value.outer_deg))
        super().__init__(*_colour(value), None, *cone, name=name)
        self.value = value


def _colour(value: Light) -> tuple[np.ndarray, float]:
    """pyrender's colour in [0, 1] and intensity of an irradiance."""
    strongest = max(*value.irradiance, 1e-12)
    return np.array(value.irradiance) / strongest, strongest


class SceneGraph(pyrender.Scene):
    """pyrender's scene with an environment, a picture and a subject.

    subject (3,): what cameras' targets are relative to, mm.
    """

    def __init__(
        self,
        environment: Environment | None = None,
        picture: Picture | None = None,
        subject: np.ndarray | None = None,
        camera: Camera | None = None,
    ):
        super().__init__(bg_color=np.zeros(4), ambient_light=np.zeros(3))
        self.environment = environment or Environment()
        self.picture = picture or Picture()
        self.subject = subject
        self.camera = camera

    def add_model(self, model: Model, pose: np.ndarray, name: str | None = None) -> None:
        """A head or another object: its surface, clothes, eyes and hair, in one mesh."""
        skin = model.surface
        material = SurfaceMaterial(model.material, skin.maps)
        parts: list[pyrender.Primitive] = [SurfacePrimitive(skin, material, model.landmarks)]
        for garment in model.garments:
            cloth = SurfaceMaterial(garment.material, garment.surface.maps)
            parts.append(SurfacePrimitive(garment.surface, cloth, {}))
        parts += [EyePrimitive(eye) for eye in model.eyes]
        if model.strands is not None and len(model.strands.points):
            parts.append(StrandPrimitive(model.strands))
        self.add(pyrender.Mesh(parts, name=name), pose=pose)

    def add_light(self, light: Light, name: str | None = None) -> None:
        """A lamp, at its place."""
        if isinstance(light, SpotLight):
            pose = look_at(light.place, light.place + light.along)
            self.add(SpotLamp(light, name), pose=pose)
        elif isinstance(light, PointLight):
            pose = np.eye(4)
            pose[:3, 3] = light.place
            self.add(PointLamp(light, name), pose=pose)
        else:
            self.add(DistantLamp(light, name), pose=look_at(light.towards, np.zeros(3)))


@dataclass(frozen=True)
class Item:
    """A primitive with its place: pose (4, 4), object to world; mesh: which primitives are one."""

    primitive: pyrender.Primitive
    pose: np.ndarray
    mesh: int

    def in_world(self, positions: np.ndarray) -> np.ndarray:
        """Positions (N, 3) of the object, in the world, mm."""
        return positions @ self.pose[:3, :3].T + self.pose[:3, 3]

    def turned(self, normals: np.ndarray) -> np.ndarray:
        """Normals (N, 3) of the object, in the world."""
        turned = np.asarray(normals, float) @ self.pose[:3, :3].T
        return turned / np.linalg.norm(self.pose[:3, 0])


@dataclass(frozen=True)
class Contents:
    """What the passes draw: everything of a graph, in the order in which it was added."""

    surfaces: list[Item] = field(default_factory=list)
    eyes: list[Item] = field(default_factory=list)
    strands: list[Item] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    environment: Environment = field(default_factory=Environment)


def contents(graph: pyrender.Scene) -> Contents:
    """The items and the lights of a graph; primitives of other kinds become opaque surfaces."""
    environment = getattr(graph, "environment", None)
    if environment is None:
        environment = Environment(tuple(float(v) for v in graph.ambient_light[:3]))
    items = Contents(environment=environment)
    order = [node for node in graph.get_nodes() if node.mesh is not None or node.light is not None]
    order.sort(key=lambda node: _added(graph, node))
    for k, node in enumerate(order):
        pose = graph.get_pose(node)
        if node.light is not None:
            items.lights.append(_light(node.light, pose))
            continue
        for primitive in node.mesh.primitives:
            if isinstance(primitive, EyePrimitive):
                items.eyes.append(Item(primitive, pose, k))
            elif isinstance(primitive, StrandPrimitive):
                items.strands.append(Item(primitive, pose, k))
            elif isinstance(primitive, SurfacePrimitive):
                items.surfaces.append(Item(primitive, pose, k))
            elif primitive.mode in (None, 4) and primitive.positions is not None:
                items.surfaces.append(Item(_opaque(primitive), pose, k))
    return items


def _added(graph: pyrender.Scene, node: pyrender.Node) -> int:
    """The place of a node in the order of adding: networkx keeps it, pyrender's sets do not."""
    return list(graph._digraph).index(node)


def _light(light: pyrender.Light, pose: np.ndarray) -> Light:
    """Our light of a pyrender light at a pose; lights shine along their own -z."""
    value = getattr(light, "value", None)
    irradiance = tuple(float(v) for v in np.asarray(light.color) * light.intensity)
    away = tuple(float(v) for v in -pose[:3, 2])
    place = tuple(float(v) for v in pose[:3, 3])
    if isinstance(light, pyrender.SpotLight):
        cone = {
            "inner_deg": min(float(np.degrees(light.innerConeAngle)), 89.0),
            "outer_deg": float(np.degrees(light.outerConeAngle)),
        }
        placed = {"irradiance": irradiance, "position_mm": place, "axis": away, **cone}
        return replace(value or SpotLight(radius_mm=0.0), **placed)
    if isinstance(light, pyrender.PointLight):
        base = value or PointLight(radius_mm=0.0)
        return replace(base, irradiance=irradiance, position_mm=place)
    towards = tuple(float(v) for v in pose[:3, 2])
    base = value or DistantLight(radius_deg=0.0)
    return replace(base, irradiance=irradiance, direction=towards)


def _opaque(primitive: pyrender.Primitive) -> SurfacePrimitive:
    """A plain pyrender primitive as a surface."""
    faces = primitive.indices
    if faces is None:
        faces = np.arange(len(primitive.positions)).reshape(-1, 3)
    faces = np.asarray(faces).reshape(-1, 3).astype(np.uint32)
    positions = primitive.positions.astype(np.float32)
    normals = primitive.normals
    if normals is None:
        from renderer.scene.shapes import vertex_normals

        normals = vertex_normals(positions, faces)
    value = _value(primitive.material)
    n = len(positions)
    uvs = primitive.texcoord_0
    skin = Surface(
        positions,
        np.asarray(normals, np.float32),
        np.zeros((n, 2), np.float32) if uvs is None else uvs[:, :2].astype(np.float32),
        faces,
        np.zeros((n, len(MASKS)), np.float32),
        Proxy.itself(positions, normals, faces, value.albedo),
        scatters=None if value.scatters else np.zeros(n),
    )
    return SurfacePrimitive(skin, SurfaceMaterial(value), {})


def _value(given: pyrender.Material | None) -> Material:
    """Our material of a pyrender material: its own, or an opaque one of its base colour."""
    if isinstance(given, SurfaceMaterial):
        return given.value
    factor = getattr(given, "baseColorFactor", np.array([0.5, 0.5, 0.5, 1.0]))
    roughness = float(getattr(given, "roughnessFactor", 0.5) or 0.0)
    albedo = tuple(float(v) for v in np.clip(factor[:3], 0, 1))
    return Material(medium="", albedo=albedo, roughness=float(np.clip(roughness**2, 0.05, 0.9)))


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Pose (4, 4) at `eye` that looks along its own -z at `target`, y up."""
    back = np.asarray(eye, float) - target
    back /= np.linalg.norm(back)
    up = np.array([0.0, 1.0, 0.0]) if abs(back[1]) < 0.999999 else np.array([0.0, 0.0, -1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(back, right), back, eye
    return pose
