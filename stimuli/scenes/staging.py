"""From a scene's values to the renderer's graph: heads are built, meshes read, shapes generated."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from renderer.memory import give_back_large
from renderer.scene import (
    MASKS,
    Material,
    Model,
    Proxy,
    Scene,
    Surface,
    objects,
    shapes,
)
from renderer.scene.graph import SceneGraph
from renderer.scene.material import MAPS, PERSON, Skin
from stimuli.errors import InputError
from stimuli.heads import load_person, load_scan
from stimuli.scenes import MM, Stage

GENERATED = {"what": "generated shape", "licence": "MIT", "source": "subdermal"}


def stage(scene: Scene, seed: int) -> Stage:
    """See stimuli.scenes.stage."""
    give_back_large()  # the making of a person frees some hundred megabytes
    made = {name: _model(thing, scene, seed) for name, thing in scene.objects.items()}
    subject = _subject(made[scene.subject][0], scene.objects[scene.subject].pose())
    graph = SceneGraph(scene.environment, scene.picture, subject, scene.camera)
    provenance, licences, notes = {}, [], []
    for name, (model, origin, terms, remarks) in made.items():
        graph.add_model(model, scene.objects[name].pose(), name)
        provenance[name] = origin
        licences += [entry for entry in terms if entry not in licences]
        notes += remarks
    for name, light in scene.lights.items():
        graph.add_light(light, name)
    return Stage(graph, provenance, licences, tuple(notes))


def _subject(model: Model, pose: np.ndarray) -> np.ndarray:
    """What cameras look at: a head's eyes, else the middle of an object (3,)."""
    points = model.surface.positions
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return pose[:3, :3] @ model.landmarks.get("eyes", middle) + pose[:3, 3]


def _model(thing: objects.Object, scene: Scene, seed: int):
    """(model, provenance, licences, notes) of an object."""
    material = scene.materials[thing.material]
    if isinstance(thing, objects.Person | objects.Scan):
        if isinstance(thing, objects.Person):
            head = load_person(thing.person, seed, thing.dressed, thing.expression)
        else:
            head = load_scan(thing, seed)
            own = head.model.surface.base_colour
            if own is not None and material.albedo == Material().albedo:
                material = replace(material, albedo=tuple(float(v) for v in own))
        model = replace(head.model, material=material)
        return _dressed(model), head.provenance, head.licences, list(head.notes)
    if isinstance(thing, objects.Mesh):
        model = _mesh(thing.file, thing.unit, thing.up, material)
        return _dressed(model), {"file": thing.file}, [], []
    model = _shape(_generated(thing, material), material)
    return _dressed(model), {"shape": thing.shape}, [GENERATED], []


def _dressed(model: Model) -> Model:
    """The model with its material's own maps and, where the surface brings none, masks."""
    material, surface = model.material, model.surface
    files = {name: getattr(material, name) for name in MAPS if getattr(material, name)}
    own = {name: _image(file, name) for name, file in files.items()}
    surface = replace(surface, maps={**surface.maps, **own})
    proxy = surface.proxy
    if isinstance(material, Skin) and not surface.masks.any():
        everywhere = np.array([[material.masks.get(name, 0.0) for name in MASKS]], np.float32)
        surface = replace(surface, masks=np.repeat(everywhere, len(surface.masks), axis=0))
        proxy = replace(proxy, masks=np.repeat(everywhere, len(proxy.positions), axis=0))
    if isinstance(material, Skin) and material.medium == PERSON:
        medium = material.own_medium(*face(surface, model.landmarks))
        model = replace(model, material=replace(material, medium=medium))
    if "albedo_map" in own:
        proxy = replace(proxy, albedo=_mean_albedo(own["albedo_map"], surface))
    return replace(model, surface=replace(surface, proxy=proxy))


#: How far from the middle between the eyes, and below it, a face reaches, mm.
FACE_MM, FACE_BELOW_MM = 95.0, 35.0


def face(surface: Surface, marks: dict) -> tuple[np.ndarray, np.ndarray]:
    """Masks (N, 8) and areas (N,) of a head's face, or of all of a surface that is no head.

    Hair and the mouth's inside do not count: it is the skin's colour that is meant.
    """
    masks, corners = surface.masks, surface.positions[surface.faces].astype(float)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    share = np.bincount(surface.faces.ravel(), np.repeat(area / 6, 3), len(masks))
    if "eyes" in marks:
        middle = marks["eyes"] - [0.0, FACE_BELOW_MM, 0.0]
        near = np.linalg.norm(surface.positions - middle, axis=1) < FACE_MM
        share = share * (near & (surface.normals[:, 2] > 0))
        for name in ("hair", "beard", "inside"):
            share = share * (1 - masks[:, MASKS.index(name)])
    return masks, share


def _image(file: str, name: str) -> np.ndarray:
    """A map's texels, see renderer.scene.model.Surface."""
    from PIL import Image

    try:
        with Image.open(file) as image:
            if name == "height_map":
                grey = np.asarray(image if image.mode.startswith("I") else image.convert("L"))
                return (grey / (65535 if image.mode.startswith("I") else 255)).astype(np.float32)
            coloured = name in ("albedo_map", "normal_map")
            return np.asarray(image.convert("RGB" if coloured else "L"))
    except OSError as error:
        words = "no such file" if isinstance(error, FileNotFoundError) else "cannot be read"
        raise InputError(f"{file}: {words}; expected an image for {name}") from error


def _mean_albedo(image: np.ndarray, surface: Surface, size: int = 64) -> np.ndarray:
    """Linear albedo (P, 3) at the proxy's vertices: of the map in size x size texels, since bounced
    light asks for no more.
    """
    from PIL import Image

    small = np.asarray(Image.fromarray(image).resize((size, size), Image.Resampling.BOX)) / 255
    linear = np.where(small <= 0.04045, small / 12.92, ((small + 0.055) / 1.055) ** 2.4)
    at = np.floor((surface.uvs % 1.0) * size).astype(int).clip(0, size - 1)
    shown = linear[size - 1 - at[:, 1], at[:, 0]]
    share = surface.proxy.to_full.T
    total = np.maximum(share @ np.ones(len(shown)), 1e-9)
    return (share @ shown) / total[:, None]


#: Generated shapes are finer than their light needs: noise is averaged over more neighbours.
GENERATED_SMOOTH = 16


def _generated(thing: objects.Object, material: Material) -> shapes.Shape:
    if isinstance(thing, objects.Sphere):
        return shapes.sphere(thing.radius_mm)
    if isinstance(thing, objects.Knot):
        return shapes.knot(thing.radius_mm, thing.tube_mm)
    if isinstance(thing, objects.Slab):
        return shapes.slab(thing.size_mm)
    if isinstance(thing, objects.Sheet):
        return shapes.slab((*thing.size_mm, thing.thickness_mm))
    if isinstance(thing, objects.Box):
        walls = (thing.left_albedo, thing.right_albedo, material.albedo)
        return shapes.room(thing.size_mm, *walls, thing.closed)
    raise TypeError(f"no shape for {type(thing).__name__}")


def _shape(shape: shapes.Shape, material: Material) -> Model:
    """A generated shape as a model; its own colours become an albedo map of one texel a face."""
    count = len(shape.positions)
    albedo = np.array(material.albedo) if shape.colours is None else shape.colours
    smooth = GENERATED_SMOOTH if shape.generated else 2
    proxy = Proxy.itself(shape.positions, shape.normals, shape.faces, albedo, smooth)
    surface = Surface(
        shape.positions.astype(np.float32),
        shape.normals.astype(np.float32),
        shape.uvs.astype(np.float32),
        shape.faces.astype(np.uint32),
        np.zeros((count, len(MASKS)), np.float32),
        proxy,
        maps={} if shape.colours is None else {"albedo_map": _atlas(shape)},
        scatters=None if material.scatters else np.zeros(count),
    )
    return Model(surface, (), None, {}, material)


def _atlas(shape: shapes.Shape, size: int = 96) -> np.ndarray:
    """The shape's own colours over its atlas of 3 x 2 cells: (size, size, 3) uint8 sRGB."""
    cell = np.floor(shape.uvs * [3, 2]).astype(int)
    image = np.zeros((2, 3, 3))
    image[1 - cell[:, 1], cell[:, 0]] = shape.colours
    srgb = np.where(image <= 0.0031308, image * 12.92, 1.055 * image ** (1 / 2.4) - 0.055)
    big = np.repeat(np.repeat(srgb, size // 2, axis=0), size // 3, axis=1)
    return np.rint(255 * big).astype(np.uint8)


@lru_cache(maxsize=4)
def _mesh_arrays(file: str, unit: str, up: str) -> tuple[np.ndarray, ...]:
    """positions (N, 3) mm centred on the origin, normals, uvs, faces of a mesh file."""
    import trimesh

    try:
        loaded = trimesh.load(file, force="mesh", process=False)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file; expected a mesh") from None
    except Exception as error:  # trimesh raises whatever its readers raise
        words = " ".join(str(error).split())[:120]
        raise InputError(f"{file}: cannot be read as a mesh: {words}") from error
    if not isinstance(loaded, trimesh.Trimesh) or not len(loaded.faces):
        raise InputError(f"{file}: has no triangles; expected a mesh")
    points = np.asarray(loaded.vertices, float) * MM[unit]
    normals = np.asarray(loaded.vertex_normals, float)
    if not np.isfinite(points).all():
        raise InputError(f"{file}: has coordinates that are not numbers; mend it first")
    if up == "z":
        points, normals = points[:, [0, 2, 1]] * [1, 1, -1], normals[:, [0, 2, 1]] * [1, 1, -1]
    points -= 0.5 * (points.min(axis=0) + points.max(axis=0))
    uvs = getattr(loaded.visual, "uv", None)
    uvs = np.zeros((len(points), 2)) if uvs is None else np.asarray(uvs, float)
    return points, normals, uvs, np.asarray(loaded.faces)


def _mesh(file: str, unit: str, up: str, material: Material) -> Model:
    return _shape(shapes.Shape(*_mesh_arrays(file, unit, up), generated=False), material)
