"""The scene: objects, materials, lights, environment, camera and picture, as one frozen value.

In files everything of which there can be several is a named table (`[objects.head]`,
`[lights.key]`), so that a level of a study is a patch: a table that is merged key by key onto the
scene's own. Reading files, named parts and patches is `stimuli.scenes`' work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from renderer.errors import InputError
from renderer.optics import media
from renderer.parameters import plain, refuse_unknown
from renderer.scene.camera import Camera
from renderer.scene.lights import Environment, Light, read_light
from renderer.scene.material import PERSON, Material, Skin, read_material
from renderer.scene.objects import Object, read_object
from renderer.scene.picture import Picture


@dataclass(frozen=True)
class Scene:
    """What is drawn. Lengths are millimetres, y is up, heads look along +z with the crown at 0.

    `subject` names the object that the camera looks at: its eyes if it has any, else its centre.
    """

    objects: dict[str, Object]
    materials: dict[str, Material]
    lights: dict[str, Light] = field(default_factory=dict)
    environment: Environment = field(default_factory=Environment)
    camera: Camera = field(default_factory=Camera)
    picture: Picture = field(default_factory=Picture)
    subject: str = ""

    @classmethod
    def read(cls, table: Mapping[str, Any], where: str = "scene") -> Scene:
        """The scene in a table; InputError names the dotted key at fault."""
        if not isinstance(table, Mapping):
            raise InputError(f"{where} is {table!r:.60}; expected a table")
        known = ("objects", "materials", "lights", "environment", "camera", "picture", "subject")
        refuse_unknown(table, known, where)
        objects = _named(table, "objects", where, read_object)
        materials = _named(table, "materials", where, read_material)
        if not objects:
            raise InputError(f"{where}.objects is empty; expected at least one object")
        for name, thing in objects.items():
            if thing.material not in materials:
                known = ", ".join(materials) or "a material of the scene"
                raise InputError(
                    f"{where}.objects.{name}.material is {thing.material!r}; expected {known}"
                )
        for name, material in materials.items():
            own = isinstance(material, Skin) and material.medium == PERSON
            if material.scatters and not own:
                medium = media.read(material.layered(), f"{where}.materials.{name}.medium")
                if medium.channels != 3:
                    raise InputError(
                        f"{where}.materials.{name}.medium has {medium.channels} channels; "
                        "expected 3, red, green and blue"
                    )
        subject = table.get("subject", next(iter(objects)))
        if subject not in objects:
            raise InputError(
                f"{where}.subject is {subject!r:.60}; expected one of {', '.join(objects)}"
            )
        scene = cls(
            objects,
            materials,
            _named(table, "lights", where, read_light),
            Environment.read(table.get("environment", {}), f"{where}.environment"),
            Camera.read(table.get("camera", {}), f"{where}.camera"),
            Picture.read(table.get("picture", {}), f"{where}.picture"),
            subject,
        )
        around = scene.environment
        if not (scene.lights or around.panels or around.map or any(around.ambient)):
            raise InputError(f"{where} is dark; expected a light or an environment")
        return scene

    def plain(self) -> dict[str, Any]:
        """The scene as JSON would give it back; `read` takes it again."""
        return {name: plain(getattr(self, name)) for name in self.__dataclass_fields__}


def _named(table: Mapping, key: str, where: str, read: Callable[[Any, str], Any]) -> dict:
    """The values of a table of named tables."""
    entries = table.get(key, {})
    if not isinstance(entries, Mapping):
        raise InputError(f"{where}.{key} is {entries!r:.60}; expected a table of named tables")
    return {name: read(entry, f"{where}.{key}.{name}") for name, entry in entries.items()}
