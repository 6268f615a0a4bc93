"""Objects: a shape, a material and a place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.parameters import Parameters, parameter

UNITS = ("mm", "cm", "m", "in")
UP_AXES = ("y", "z")
AXES = ("x", "-x", "y", "-y", "z", "-z")
#: Of a knot's radius: its strands come within 0.554 of it.
WIDEST_TUBE = 0.27


@dataclass(frozen=True)
class Object(Parameters):
    """What every object has: the name of its material, and its place.

    The shape's own coordinates are scaled, then turned about x, y and z (in that order), then
    moved. Persons keep their crown at y = 0; generated shapes are centred on the origin.
    """

    shape: ClassVar[str]
    called: ClassVar[str] = "object"

    material: str = parameter("skin", source="a name in the scene's materials")
    position_mm: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="mm", low=-1e5, high=1e5, source="the scene's"
    )
    rotation_deg: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="degrees", low=-360.0, high=360.0, source="the scene's"
    )
    scale: float = parameter(1.0, low=1e-3, high=1e3, source="the scene's")

    def plain(self) -> dict[str, Any]:
        return {"shape": self.shape, **super().plain()}

    def pose(self) -> np.ndarray:
        """Object to world (4, 4), mm."""
        x, y, z = np.radians(self.rotation_deg)
        turn = np.eye(3)
        for angle, (i, j) in ((x, (1, 2)), (y, (2, 0)), (z, (0, 1))):
            step = np.eye(3)
            step[i, i] = step[j, j] = np.cos(angle)
            step[j, i], step[i, j] = np.sin(angle), -np.sin(angle)
            turn = step @ turn
        pose = np.eye(4)
        pose[:3, :3] = turn * self.scale
        pose[:3, 3] = self.position_mm
        return pose


@dataclass(frozen=True)
class Person(Object):
    """A head to mid-chest, generated from a named set of parameters (stimuli/people); `expression`
    goes over the person's own table of that name.
    """

    shape: ClassVar[str] = "person"

    person: str = parameter("man", source="stimuli/people")
    dressed: bool = parameter(False, source="the thesis's people are bare")
    expression: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Scan(Object):
    """A user's head: .glb, .gltf, .obj, .ply or .stl. How it stands is found out where not given.

    `up` and `forward` are axes of the file; `yaw_deg` turns the head to its left after that.
    `head_mm` is its height from crown to chin, `mm_per_unit` scales the file's coordinates;
    `landmarks` names a TOML file of points in them. Coarse scans are subdivided smoothly until
    their edges are `edge_mm` long at most half of them. `hair` names the person whose generated
    hair, brows, lashes and beard it gets.
    """

    shape: ClassVar[str] = "scan"

    file: str = parameter("scan.glb", source="the user's")
    unit: str | None = parameter((None, "mm"), choices=(None, *UNITS), optional=True)
    up: str | None = parameter((None, "y"), choices=(None, *AXES), optional=True)
    forward: str | None = parameter((None, "z"), choices=(None, *AXES), optional=True)
    yaw_deg: float | None = parameter(
        (None, 0.0), unit="degrees", low=-360.0, high=360.0, optional=True
    )
    head_mm: float | None = parameter((None, 206.0), unit="mm", low=60.0, high=900.0, optional=True)
    mm_per_unit: float | None = parameter(
        (None, 1.0), unit="mm a unit of the file", low=1e-6, high=1e6, optional=True
    )
    landmarks: str | None = parameter((None, "landmarks.toml"), optional=True)
    edge_mm: float = parameter(
        2.5, unit="mm", low=0.2, high=1000.0, source="a pixel of a 1080p close-up is .13 mm"
    )
    hair: str | None = parameter((None, "woman"), optional=True)
    licence: str | None = parameter((None, "CC-BY-4.0"), optional=True)
    credit: str | None = parameter((None, "who made it"), optional=True)


@dataclass(frozen=True)
class Mesh(Object):
    """Any mesh that trimesh reads: .glb, .obj, .ply, .stl; it is centred on the origin."""

    shape: ClassVar[str] = "mesh"

    file: str = parameter("mesh.ply", source="the user's")
    unit: str = parameter("mm", choices=UNITS, source="the user's")
    up: str = parameter("y", choices=UP_AXES, source="the user's")


@dataclass(frozen=True)
class Sphere(Object):
    """A sphere about the origin."""

    shape: ClassVar[str] = "sphere"

    radius_mm: float = parameter(50.0, unit="mm", low=0.01, high=1e4, source="the scene's")


@dataclass(frozen=True)
class Knot(Object):
    """A tube in a trefoil knot about the z axis: thin parts before and behind each other."""

    shape: ClassVar[str] = "knot"

    radius_mm: float = parameter(
        15.0, unit="mm from the axis to the tube's middle", low=0.01, high=1e4, source="the scene's"
    )
    tube_mm: float = parameter(3.8, unit="mm, radius", low=0.01, high=1e4, source="the scene's")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tube_mm > WIDEST_TUBE * self.radius_mm:
            raise InputError(
                f"{self.where('tube_mm')} is {self.tube_mm:g}; expected at most "
                f"{WIDEST_TUBE * self.radius_mm:.3g}: a thicker tube would meet itself"
            )


@dataclass(frozen=True)
class Slab(Object):
    """A box of the given width, height and depth; its front faces +z."""

    shape: ClassVar[str] = "slab"

    size_mm: tuple[float, float, float] = parameter(
        (200.0, 200.0, 40.0), unit="mm", low=0.01, high=1e4, source="the scene's"
    )


@dataclass(frozen=True)
class Sheet(Object):
    """A thin sheet that faces +z: a slab whose thickness is its point."""

    shape: ClassVar[str] = "sheet"

    size_mm: tuple[float, float] = parameter(
        (200.0, 200.0), unit="mm", low=0.01, high=1e4, source="the scene's"
    )
    thickness_mm: float = parameter(2.0, unit="mm", low=0.01, high=1e3, source="the scene's")


@dataclass(frozen=True)
class Box(Object):
    """A room: the inner faces of a box, open towards +z unless it is `closed` (a camera is then
    inside); its left and right walls have colours.
    """

    shape: ClassVar[str] = "box"

    size_mm: tuple[float, float, float] = parameter(
        (500.0, 500.0, 500.0), unit="mm", low=0.1, high=1e5, source="the Cornell box's proportions"
    )
    left_albedo: tuple[float, float, float] = parameter(
        (0.63, 0.06, 0.05), low=0.0, high=1.0, source="red, as in Goral et al. 1984"
    )
    right_albedo: tuple[float, float, float] = parameter(
        (0.05, 0.06, 0.63), low=0.0, high=1.0, source="blue, as in Goral et al. 1984"
    )
    closed: bool = parameter(False, source="open, so that a camera sees in")


SHAPES: dict[str, type[Object]] = {
    kind.shape: kind for kind in (Person, Scan, Mesh, Sphere, Knot, Slab, Sheet, Box)
}


def read_object(table: Mapping[str, Any], where: str) -> Object:
    """An object from a table, by its `shape`."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {table!r:.60}; expected a table")
    shape = table.get("shape")
    if shape not in SHAPES:
        raise InputError(f"{where}.shape is {shape!r:.60}; expected one of {', '.join(SHAPES)}")
    return SHAPES[shape].read({k: v for k, v in table.items() if k != "shape"}, where)
