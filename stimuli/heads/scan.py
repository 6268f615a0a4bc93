"""A user's own head: one triangle mesh in millimetres from a file (`READERS`), or one line that
says why not.

What is asked of a file, for shading and occlusion to be right:

* Finite positions, triangles (polygons are fanned) with an area, at least one.
* A surface: no edge with more than two faces. Vertices count as one where they lie at exactly one
  place, so seams of the texture do not matter; open borders are fine, scans have them. Real scans
  also have a few bad edges. At each of them the smooth normal mixes sheets that face apart, a flaw
  the size of a triangle; the file is refused when more than `NON_MANIFOLD_LIMIT` of all edges are
  bad, else they are told of. The same holds for neighbouring faces that disagree about which side
  is out, unless the file has normals. Hair and films over the eye, by their names, are cards and
  exempt.
* How it is to stand (unit, upward axis, turn) is for stimuli.heads.placing to find out.
"""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from stimuli.heads.atlas import combine
from stimuli.heads.formats import Part, Source, gltf, obj, soup
from stimuli.heads.placing import Asked, Placing, by_size

Place = Callable[[Source, np.ndarray, np.ndarray, Asked, bool], Placing]

READERS = {
    ".glb": gltf.read,
    ".gltf": gltf.read,
    ".obj": obj.read,
    ".ply": soup.read,
    ".stl": soup.read,
}
KNOWN = "expected a head as .glb, .gltf, .obj, .ply or .stl"
ELSEWHERE = (".fbx", ".blend", ".usd", ".usda", ".usdc", ".usdz", ".dae", ".ztl", ".max", ".3ds")
NON_MANIFOLD_LIMIT = 0.005
"""Fraction of all edges that may have more than two faces, or (without normals) two faces that
disagree.
"""
WITHOUT_AREA_LIMIT = 0.1  # of all faces: with more of them the file is broken

KINDS = {
    "hair": (
        "lash lashes eyelash eyelashes brow brows eyebrow eyebrows hair hairs beard "
        "moustache mustache stubble fur"
    ),
    "shell": "occlusion blend lacrimal tear tears tearline fluid wet",
    "mouth": "teeth tooth gum gums tongue",
    "eye": "eye eyes eyeball eyeballs iris irises sclera pupil pupils cornea",
}
"""What a part is by the words of its name, the first that fits; `shell`: clear films over the eye
that hide it if drawn opaque.
"""


@dataclass(frozen=True, eq=False)
class Scan:
    """A head as read.

    All vertex arrays have one length; all images are optional and of their own sizes.
    """

    name: str  # the file's, without suffix
    positions_mm: np.ndarray  # (N, 3) float32, y up
    faces: np.ndarray  # (M, 3) int32, counter-clockwise from outside
    normals: (
        np.ndarray
    )  # (N, 3) float32, of unit length: given, or area-weighted and smooth across texture seams
    uvs: np.ndarray | None  # (N, 2) float32, v up (OpenGL's convention); textures repeat
    albedo: np.ndarray | None  # (H, W, 3) uint8, sRGB
    base_colour: (
        tuple[float, float, float] | None
    )  # linear, 0..1: the material's, where there is no albedo texture
    normal_map: np.ndarray | None  # (H, W, 3) uint8, tangent space, green up
    roughness: np.ndarray | None  # (H, W) uint8, perceptual roughness, 255 is 1
    parts: np.ndarray  # (M,) int32: which part each face belongs to
    part_names: tuple[str, ...]  # of the material, else of the mesh or group
    part_kinds: tuple[
        str, ...
    ]  # skin, eye, mouth, hair or shell: by the name, skin where it says nothing
    placing: Placing  # from the file's coordinates to these
    copyright: str | None  # what the file says of it (glTF's asset.copyright)
    files: dict[str, str]  # sha256 of each file that was read, by the name it was referred to
    notes: tuple[str, ...]  # what the user should be told, one line each

    def provenance(self) -> dict:
        """What a manifest records: the files by their sha256, and how they were understood. No path
        of the machine.
        """
        return {
            "files": self.files,
            **self.placing.provenance(),
            "parts": dict(zip(self.part_names, self.part_kinds, strict=True)),
        }


@np.errstate(
    over="ignore", invalid="ignore"
)  # what is not finite is refused, and needs no warning besides
def read_scan(path: str | Path, asked: Asked | None = None, place: Place = by_size) -> Scan:
    """Read a head from a file with its textures (`READERS`).

    asked: what the user says of how it stands; place: what finds out the rest, and says so in the
    notes. Whatever keeps the head from being used raises one line (`InputError`).
    """
    asked = asked or Asked()
    source = Source(Path(path))
    reader = READERS.get(source.path.suffix.lower())
    if not os.path.isfile(source.path):
        raise source.error(f"is not a file; {KNOWN}")
    if reader is None:
        suffix = source.path.suffix
        if suffix.lower() in ELSEWHERE:
            raise source.error(
                f"has the suffix {suffix!r}, which is not read; export it as .glb from the program "
                "that wrote it (Blender: File, Export, glTF 2.0)"
            )
        raise source.error(f"has the suffix {suffix!r}; {KNOWN}")
    if not source.path.stat().st_size:
        raise source.error(f"is empty; {KNOWN}")

    parts = [part for part in reader(source) if len(part.faces)]
    if not parts:
        raise source.error("has no faces; expected a triangle mesh")
    for part in parts:
        _check_finite(source, part)
    parts, material = combine(source, parts)
    names = tuple(dict.fromkeys(part.name for part in parts))
    kinds = tuple(map(part_kind, names))
    if "skin" not in kinds:
        source.note(
            "all of it was taken as skin, since its only parts are named "
            f"{', '.join(map(repr, names[:4]))}"
        )
        kinds = ("skin",) * len(names)
    mesh = _join(parts, names, kinds)
    _turn_outside_out(source, mesh)

    skin = np.array([kind == "skin" for kind in kinds])[mesh.part_of_face]
    placing = place(source, mesh.positions, mesh.faces[skin], asked, reader is gltf.read)
    mesh.positions = placing.place(mesh.positions).astype(np.float32)
    mesh.normals = mesh.normals @ placing.rotation.T

    _drop_faces_without_use(source, mesh)
    _check_surface(source, mesh, kinds)
    _complete_normals(mesh)

    used, faces = np.unique(mesh.faces, return_inverse=True)
    return Scan(
        name=source.path.stem,
        positions_mm=mesh.positions[used],
        faces=faces.reshape(-1, 3).astype(np.int32),
        normals=mesh.normals[used].astype(np.float32),
        uvs=None if mesh.uvs is None else mesh.uvs[used].astype(np.float32),
        albedo=material.albedo,
        base_colour=material.base_colour if material.albedo is None else None,
        normal_map=material.normal_map,
        roughness=material.roughness,
        parts=mesh.part_of_face.astype(np.int32),
        part_names=names,
        part_kinds=kinds,
        placing=placing,
        copyright=source.copyright,
        files=dict(source.files),
        notes=tuple(source.notes),
    )


def part_kind(name: str) -> str:
    """What a part is, by the words of its name: skin, eye, mouth, hair or shell (see `KINDS`)."""
    words = {word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
    return next((kind for kind, listed in KINDS.items() if words & set(listed.split())), "skin")


@dataclass(eq=False)
class _Mesh:
    """All parts in one, while it is put in order. `points` needs final positions (float32)."""

    positions: np.ndarray  # (n, 3)
    faces: np.ndarray  # (m, 3) int64
    normals: np.ndarray  # (n, 3), of any length; not finite where none were given
    uvs: np.ndarray | None  # (n, 2)
    part_of_face: np.ndarray  # (m,)
    group: (
        np.ndarray
    )  # (n,) int32: vertices are welded within it; all skin is one group, each other part its own

    def extents(self) -> np.ndarray:
        """The sides (3,) of the bounding box of all faces."""
        return np.ptp(self.positions[self.faces.reshape(-1)], axis=0)

    @cached_property
    def points(self) -> np.ndarray:
        """An index (n,) for each vertex, the same where vertices of one group lie at exactly one
        place.
        """
        keys = np.empty((len(self.positions), 4), np.int32)
        keys[:, :3] = (self.positions + np.float32(0)).view(np.int32)  # adding 0 makes -0 and 0 one
        keys[:, 3] = self.group
        return np.unique(keys.view("V16").ravel(), return_inverse=True)[1]

    def area_vectors(self) -> np.ndarray:
        """Each face's outward normal (m, 3) times twice its area."""
        a, b, c = np.moveaxis(self.positions.astype(np.float64)[self.faces], 1, 0)
        return np.cross(b - a, c - a)

    def keep(self, which: np.ndarray) -> None:
        self.faces, self.part_of_face = self.faces[which], self.part_of_face[which]


def _join(parts: list[Part], names: tuple[str, ...], kinds: tuple[str, ...]) -> _Mesh:
    """One mesh of all parts; those of one name become one part."""
    counts = [len(part.positions) for part in parts]
    starts = np.cumsum(counts) - counts
    index = np.array([names.index(part.name) for part in parts])
    group = np.where([kinds[i] == "skin" for i in index], -1, index)
    normals = np.concatenate(
        [
            np.full_like(part.positions, np.nan) if part.normals is None else part.normals
            for part in parts
        ]
    )
    return _Mesh(
        positions=np.concatenate([part.positions for part in parts]),
        faces=np.concatenate(
            [part.faces + start for part, start in zip(parts, starts, strict=True)]
        ),
        normals=np.where(np.abs(normals) < 1e30, normals, np.nan),
        uvs=None
        if any(part.uvs is None for part in parts)
        else np.concatenate([part.uvs for part in parts]),
        part_of_face=np.repeat(index, [len(part.faces) for part in parts]),
        group=np.repeat(group, counts).astype(np.int32),
    )


def _check_finite(source: Source, part: Part) -> None:
    for what, values in (("positions", part.positions), ("texture coordinates", part.uvs)):
        if values is not None and not (usable := (np.abs(values) < 1e30).all(axis=1)).all():
            raise source.error(
                f"the part {part.name!r} has {(~usable).sum()} {what} that are not finite or "
                "absurdly large, "
                "the first "
                f"({', '.join(f'{value:g}' for value in values[np.argmin(usable)])}); "
                "expected numbers"
            )


def _drop_faces_without_use(source: Source, mesh: _Mesh) -> None:
    """Drop faces without area, and all but the first of those over the same three points."""
    a, b, c = np.sort(mesh.points[mesh.faces], axis=1).T
    twice_area = np.linalg.norm(mesh.area_vectors(), axis=1)
    whole = (a != b) & (b != c) & (twice_area > 1e-12 * mesh.extents().max() ** 2)
    if not whole.any():
        raise source.error(f"has {len(whole)} faces, all without area; expected a surface")
    if (~whole).mean() > WITHOUT_AREA_LIMIT:
        raise source.error(
            f"is broken: {(~whole).sum()} of its {len(whole)} faces have no area; expected at most "
            f"{WITHOUT_AREA_LIMIT:.0%}"
        )
    if not whole.all():
        source.note(f"{(~whole).sum()} of its {len(whole)} faces have no area and were left out")
    order = np.lexsort((c, b, a))  # stable: the first of equals stays
    same = (
        (a[order][1:] == a[order][:-1])
        & (b[order][1:] == b[order][:-1])
        & (c[order][1:] == c[order][:-1])
    )
    double = np.zeros(len(whole), bool)
    double[order[1:][same]] = True
    double &= whole
    if double.any():
        source.note(f"{double.sum()} of its {len(whole)} faces lie upon others and were left out")
    mesh.keep(whole & ~double)


def _check_surface(source: Source, mesh: _Mesh, kinds: tuple[str, ...]) -> None:
    """Refuse what is no surface: see the head of this module."""
    judged = np.array([kind not in ("hair", "shell") for kind in kinds])[mesh.part_of_face]
    faces = mesh.faces[judged]
    welded = mesh.points[faces]
    begin, end = welded.reshape(-1), np.roll(welded, -1, axis=1).reshape(-1)
    count = len(mesh.positions)
    keys, first, edge, uses = np.unique(
        np.minimum(begin, end) * count + np.maximum(begin, end),
        return_index=True,
        return_inverse=True,
        return_counts=True,
    )

    def judge(bad: np.ndarray, what: str, refuse: bool) -> None:
        if not bad.any():
            return
        corner = first[np.argmax(bad)]
        ends = mesh.positions[
            [faces.flat[corner], faces.flat[corner - corner % 3 + (corner + 1) % 3]]
        ]
        places = " and ".join(f"({x:.1f}, {y:.1f}, {z:.1f})" for x, y, z in ends)
        flaw = f"{bad.sum()} of its {len(keys)} edges {what}, one of them between {places} mm"
        if refuse and bad.sum() > NON_MANIFOLD_LIMIT * len(keys):
            raise source.error(
                f"is not a manifold surface: {flaw}; expected at most "
                f"{NON_MANIFOLD_LIMIT:.2%}, mend it first"
            )
        source.note(flaw)

    judge(uses > 2, "have more than two faces", refuse=True)
    forward = np.bincount(edge, weights=begin < end, minlength=len(keys))
    without_normals = not np.isfinite(mesh.normals[faces]).all()
    judge(
        (uses == 2) & (forward != 1),
        "have two faces that disagree about which side is out",
        refuse=without_normals,
    )


def _turn_outside_out(source: Source, mesh: _Mesh) -> None:
    """Turn all faces round when they wind against the given normals or, without these, when they
    enclose a negative volume.
    """
    area, corners = mesh.area_vectors(), mesh.positions[mesh.faces]
    given = mesh.normals[mesh.faces].sum(axis=1)
    if (known := np.isfinite(given).all(axis=1)).any():
        inverted = (area[known] * given[known]).sum() < 0
    else:
        centre = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
        volume = (area * (corners.mean(axis=1) - centre)).sum() / 6
        inverted = volume < -0.01 * mesh.extents().prod()
    if inverted:
        source.note("its faces are inside out and were turned")
        mesh.faces = mesh.faces[:, ::-1]


def _complete_normals(mesh: _Mesh) -> None:
    """Unit normals: the given ones, and area-weighted over all faces at a point where there is none
    (or none of any length).
    """
    area, points = mesh.area_vectors(), mesh.points[mesh.faces.reshape(-1)]
    sums = np.stack(
        [np.bincount(points, weights=np.repeat(area[:, axis], 3)) for axis in range(3)], axis=1
    )
    smooth = np.empty(mesh.normals.shape)
    smooth[mesh.faces.reshape(-1)] = sums[points]
    # Where the faces at a point cancel out, take one of them.
    flat = (
        np.linalg.norm(smooth[mesh.faces], axis=2) <= 1e-9 * np.linalg.norm(area, axis=1)[:, None]
    )
    smooth[mesh.faces[flat]] = np.broadcast_to(area[:, None], (*flat.shape, 3))[flat]
    length = np.linalg.norm(mesh.normals, axis=1)
    mesh.normals = np.where((np.isfinite(length) & (length > 1e-6))[:, None], mesh.normals, smooth)
    used = np.unique(mesh.faces)
    mesh.normals[used] /= np.linalg.norm(mesh.normals[used], axis=1, keepdims=True)
