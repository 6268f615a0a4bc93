"""Heads to render: generated people, made from CC0 data, and a user's own scan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from renderer.scene import Model
from renderer.scene.objects import Scan
from stimuli.parts import merge, person_table


@dataclass(frozen=True)
class Head:
    """A model to render, and what the manifest says of it: where it came from, under which
    licences.
    """

    name: str
    model: Model
    provenance: dict
    licences: list[dict]
    notes: tuple[str, ...] = ()  # what the user should be told, one line each


def load_person(
    name_or_path: str = "man",
    seed: int = 0,
    dressed: bool = True,
    expression: Mapping[str, Any] | None = None,
) -> Head:
    """A generated person: one of stimuli/people by name, a TOML file of one's own, or a seed.

    seed: of the generated hair; dressed: in the person's clothes, if any; expression: what goes
    over the person's own (stimuli.heads.expression). The base data are fetched on first use.
    Raises stimuli.errors.InputError for a person that cannot be made, and without network and
    cache.
    """
    from stimuli.heads import fetch
    from stimuli.heads.kept import person_model
    from stimuli.heads.person import Person

    name = Path(name_or_path).stem
    table = person_table(name_or_path)
    if expression:
        table = merge(table, {"expression": expression})
    person = Person.read(table, name)
    if not dressed:
        person = replace(person, clothes=replace(person.clothes, kind="none"))
    origin = {
        "person": name,
        "data": f"{fetch.PACKAGE} {fetch.VERSION}",
        "sha256": fetch.SHA256,
    }
    return Head(name, person_model(person, seed), origin, [fetch.LICENCE])


def load_scan(scan: Scan, seed: int = 0) -> Head:
    """A user's scan: a .glb, .gltf, .obj, .ply or .stl file and what the scene says of it.

    How it stands is found out where the scene does not say (stimuli.heads.placing); the eyes are
    taken from parts named so, else from the face. seed: of the hair, where the scene asks for a
    person's. Raises stimuli.errors.InputError for a file that
    cannot be used.
    """
    from stimuli.heads.person import Person
    from stimuli.heads.placing import Asked, by_face
    from stimuli.heads.scan import read_scan
    from stimuli.heads.scan_model import scan_model

    asked = Asked(
        scan.unit,
        scan.up,
        scan.forward,
        scan.yaw_deg,
        scan.head_mm,
        scan.mm_per_unit,
        scan.landmarks,
    )
    read = read_scan(scan.file, asked, by_face)
    notes, terms = list(read.notes), {"what": read.name, "source": "the user's scan"}
    credit = scan.credit or read.copyright
    if scan.licence is None:
        notes.append(
            f"{read.name}: its licence is not said; give licence and credit, which are kept in the "
            "manifest and shown beside the study"
        )
    terms |= {"licence": scan.licence or "not said"}
    terms |= {"credit": credit} if credit else {}
    person = None
    if scan.hair is not None:
        person = Person.read(person_table(scan.hair), scan.hair)
    model = scan_model(read, scan.edge_mm, person, seed)
    if model.eyes and "eye" not in read.part_kinds:
        notes.append(f"{read.name}: its sockets are open and got eyes")
    before, after = len(read.positions_mm), len(model.surface.positions)
    if after > before:
        notes.append(f"{read.name}: it was subdivided smoothly, {before} points to {after}")
    origin = read.provenance() | ({"hair": scan.hair} if scan.hair is not None else {})
    return Head(read.name, model, origin, [terms], tuple(notes))
