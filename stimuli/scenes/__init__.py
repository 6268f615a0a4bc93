"""Scenes: files of them, their named parts, patches, and the graph that the renderer draws.

A scene file is TOML (thesis.toml is the one to copy). `rig` names a file of lights and an
environment (stimuli/lights), `person` one of people (stimuli/people); what the scene itself says
goes over what they say. `[framings.NAME]` are cameras of the scene's own. A level of a study is a
patch of the scene's table: `stimuli.parts.merge`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stimuli.errors import InputError
from stimuli.parts import LIGHTS, SCENES, merge, part, person_table, read_toml

if TYPE_CHECKING:
    from renderer.scene import Camera, Scene
    from renderer.scene.graph import SceneGraph

MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
_FILES = (("environment", "map"),)
MAP_ENDING = "_map"  # of a material's keys that name files


@dataclass(frozen=True)
class Stage:
    """A scene ready to be drawn, and what there is to say of it.

    provenance: object -> where it came from; licences: of the data in it; notes: for the user.
    """

    graph: SceneGraph
    provenance: dict[str, dict]
    licences: list[dict]
    notes: tuple[str, ...] = ()


def load_table(name_or_path: str | Path, beside: Path | None = None) -> dict[str, Any]:
    """The raw table of a scene: one of stimuli/scenes by its name, or a file.

    beside: the folder that relative paths start from; files that the scene names are made absolute.
    """
    path = part(name_or_path, SCENES, "scene", beside)
    return _absolute(read_toml(path), path.parent)


def complete(table: Mapping[str, Any], where: str = "scene") -> dict[str, Any]:
    """The table with its named parts put in: the rig's lights, the people's own skin.

    An object that names no material has the one of its own name; a person's starts from their skin,
    that of a glTF file from the medium in it.
    """
    table = dict(table)
    rig = table.pop("rig", None)
    if rig is not None:
        path = part(rig, LIGHTS, f"{where}.rig")
        table = merge(_absolute(read_toml(path), path.parent), table)
    table = _framed(table, where)
    objects = table.get("objects", {})
    if not isinstance(objects, Mapping):
        raise InputError(f"{where}.objects is {objects!r:.60}; expected a table of named tables")
    objects, materials = dict(objects), dict(table.get("materials", {}))
    for name, entry in objects.items():
        if not isinstance(entry, Mapping):
            continue
        if "expression" in entry and entry.get("shape") == "person":
            from stimuli.heads.expression import Expression

            Expression.read(entry["expression"], f"{where}.objects.{name}.expression")
        if "material" in entry:
            continue
        own: dict[str, Any] = {}
        if entry.get("shape") == "person":
            person = entry.get("person", "man")
            own = merge({"kind": "skin"}, person_table(person).get("skin", {}))
        elif entry.get("shape") in ("mesh", "scan"):
            given = materials.get(name, {})
            if not isinstance(given, Mapping) or not {"medium", "kind"} & set(given):
                own = _own_medium(entry)
        objects[name] = {**entry, "material": name}
        materials[name] = merge(own, materials.get(name, {}))
    table = {**table, "objects": objects, "materials": materials}
    return _exposed(table, where)


def _exposed(table: dict[str, Any], where: str) -> dict[str, Any]:
    """The table with its picture's exposure times that of the person whom the camera looks at."""
    from renderer.scene import Picture

    objects, picture = table["objects"], table.get("picture", {})
    entry = objects.get(table.get("subject", next(iter(objects), "")), {})
    if not isinstance(entry, Mapping) or entry.get("shape") != "person":
        return table
    factor = person_table(entry.get("person", "man")).get("exposure", 1.0)
    if not isinstance(picture, Mapping) or factor == 1.0 or not isinstance(factor, int | float):
        return table
    exposure = Picture.read(picture, f"{where}.picture").exposure
    return {**table, "picture": {**picture, "exposure": exposure * factor}}


def framings(table: Mapping[str, Any]) -> list[str]:
    """Names that a scene's camera may go by: the scene's own, then the thesis's."""
    from renderer.scene import FRAMINGS

    own = table.get("framings", {})
    return list(dict.fromkeys([*(own if isinstance(own, Mapping) else ()), *FRAMINGS]))


def camera(table: Mapping[str, Any], framing: str = "") -> Camera:
    """The camera of a scene's table, or that of another of its framings."""
    from renderer.scene import Camera

    if framing:
        table = merge(table, {"camera": {"framing": framing}})
    return Camera.read(_framed(dict(table), "scene").get("camera", {}), "scene.camera")


def _framed(table: dict[str, Any], where: str) -> dict[str, Any]:
    """The table without its own framings; the one that its camera names is put into the camera."""
    own, camera = table.pop("framings", {}), table.get("camera", {})
    if not isinstance(own, Mapping):
        raise InputError(f"{where}.framings is {own!r:.60}; expected a table of named cameras")
    if not isinstance(camera, Mapping) or camera.get("framing") not in own:
        return table
    chosen = own[camera["framing"]]
    if not isinstance(chosen, Mapping):
        name = camera["framing"]
        raise InputError(f"{where}.framings.{name} is {chosen!r:.60}; expected a camera's table")
    chosen = {k: v for k, v in chosen.items() if not (k == "yaw_deg" and "angle" in camera)}
    return {**table, "camera": merge(chosen, camera)}


def read_scene(table: Mapping[str, Any], where: str = "scene") -> Scene:
    """The checked scene of a table; InputError names the dotted key at fault."""
    from renderer.scene import Scene

    return Scene.read(complete(table, where), where)


def _own_medium(entry: Mapping[str, Any]) -> dict[str, Any]:
    """What a glTF file says of the medium of its mesh: a table of a material, empty for others."""
    file = Path(str(entry.get("file", "")))
    unit = MM.get(entry.get("unit", "m" if entry["shape"] == "scan" else "mm"))
    if file.suffix.lower() not in (".glb", ".gltf") or not file.is_file() or unit is None:
        return {}  # what is wrong with it is said where it is read
    from stimuli.heads.formats import Source, gltf

    medium = gltf.medium(Source(file), unit)
    return {} if medium is None else {"medium": medium}


def stage(scene: Scene, seed: int = 0) -> Stage:
    """Objects, lights and environment of a scene in a graph; seed: of generated hair."""
    from stimuli.scenes.staging import stage as put

    return put(scene, seed)


def _absolute(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The table with the files that it names made absolute, from `folder`."""
    for holder, key in _file_keys(table):
        value = holder[key]
        if isinstance(value, str) and value and not Path(value).is_absolute():
            holder[key] = str((folder / value).resolve())
    return table


def _file_keys(table: dict[str, Any]) -> Iterator[tuple[dict, str]]:
    """Every (table, key) that holds a file's name."""
    for section, key in _FILES:
        if isinstance(table.get(section), dict) and key in table[section]:
            yield table[section], key
    for section in ("objects", "materials"):
        entries = table.get(section)
        for entry in entries.values() if isinstance(entries, dict) else ():
            if isinstance(entry, dict):
                yield from ((entry, key) for key in entry if _names_file(section, key))


def _names_file(section: str, key: str) -> bool:
    return key in ("file", "landmarks") if section == "objects" else key.endswith(MAP_ENDING)
