"""Heads to render: generated people, made from CC0 data, and a user's own scan."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.scene import Model
from stimuli.parts import PEOPLE, part, read_toml


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


def load_person(name_or_path: str = "man", seed: int = 0) -> Head:
    """A generated person: one of stimuli/people by name, or a TOML file of one's own.

    seed: of the generated hair. The base data are fetched on first use. Raises
    stimuli.errors.InputError for a person that cannot be made, and without network and cache.
    """
    from stimuli.heads import fetch
    from stimuli.heads.kept import person_model
    from stimuli.heads.person import Person

    path = part(name_or_path, PEOPLE, "person")
    person = Person.read(read_toml(path), path.stem)
    origin = {
        "person": path.stem,
        "data": f"{fetch.PACKAGE} {fetch.VERSION}",
        "sha256": fetch.SHA256,
    }
    return Head(path.stem, person_model(person, seed), origin, [fetch.LICENCE])


def load_scan(path: str, unit: str | None = None, up: str | None = None) -> Head:
    """A user's scan: a .glb, .gltf or .obj file.

    unit: of its coordinates (mm, cm, m, in), up: its upward axis (y, z); None to find out. The
    eyes are taken from parts named so, else from proportions.
    Raises stimuli.errors.InputError for a file that cannot be used.
    """
    from stimuli.heads.scan import read_scan
    from stimuli.heads.scan_model import scan_model

    scan = read_scan(path, unit, up)
    return Head(scan.name, scan_model(scan), scan.provenance(), [], scan.notes)
