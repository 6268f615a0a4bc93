"""PLY and STL, by trimesh: triangles without materials; normals where a PLY file has them."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from stimuli.heads.formats import UNNAMED, Material, Part, Source


def read(source: Source) -> list[Part]:
    """The one part of a PLY or STL file."""
    import trimesh

    data, kind = source.content(), source.path.suffix.lower().lstrip(".")
    try:
        loaded = trimesh.load(BytesIO(data), file_type=kind, process=False)
    except MemoryError:
        raise
    except Exception as error:  # trimesh raises whatever its readers raise
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise source.error(f"is not valid {kind.upper()}: {words}") from None
    if not isinstance(loaded, trimesh.Trimesh):
        raise source.error("has no faces; expected a triangle mesh, not points")
    positions = np.array(loaded.vertices, float)
    faces = np.array(loaded.faces, np.int64).reshape(-1, 3)
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(positions):
        raise source.error(f"has vertex index {faces.max()}, expected 0 to {len(positions) - 1}")
    if kind == "stl":  # three corners a face: one where they are at one place
        positions, same = np.unique(positions, axis=0, return_inverse=True)
        faces = same.reshape(-1)[faces]
    given = kind == "ply" and b" nx" in data.partition(b"end_header")[0]
    if loaded.visual.kind in ("vertex", "face"):
        source.note("its colours per vertex are not used; give an albedo image or a person's skin")
    normals = np.array(loaded.vertex_normals, float) if given else None
    return [Part(UNNAMED, positions, faces, normals, None, Material())]
