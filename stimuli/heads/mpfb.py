"""The default head: MakeHuman/MPFB2's base mesh (CC0), morphed, posed, cropped to a bust and
subdivided.

The base mesh stands with its arms out, is measured in decimetres and looks along +z, y up.
Everything here leaves in millimetres.
"""

from __future__ import annotations

import gzip
import json
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from PIL import Image

from stimuli.errors import InputError
from stimuli.heads import subdivide
from stimuli.heads.person import Person

MM_PER_UNIT = 100.0

LEVELS = 2
CROP_BELOW_CROWN_MM = 520.0


@dataclass(frozen=True)
class Base:
    """The base mesh as stored: positions (V, 3) in units, uvs (T, 2), body quads (F,
    4) into each.
    """

    positions: np.ndarray
    uvs: np.ndarray
    quads: np.ndarray
    uv_quads: np.ndarray
    groups: dict[str, np.ndarray]  # vertex indices of each helper


def read_base(data: Path) -> Base:
    """Read `3dobjs/base.obj` and the vertex groups."""
    positions, uvs, quads, uv_quads, group = [], [], [], [], ""
    with open(data / "3dobjs" / "base.obj", encoding="utf-8") as lines:
        for line in lines:
            word, *rest = line.split() or [""]
            if word == "v":
                positions.append([float(x) for x in rest[:3]])
            elif word == "vt":
                uvs.append([float(x) for x in rest[:2]])
            elif word == "g":
                group = rest[0]
            elif word == "f" and group == "body":
                corners = [corner.split("/") for corner in rest]
                quads.append([int(c[0]) - 1 for c in corners])
                uv_quads.append([int(c[1]) - 1 for c in corners])
    ranges = json.loads(
        (data / "mesh_metadata" / "basemesh_vertex_groups.json").read_text(encoding="utf-8")
    )
    groups = {
        name: np.concatenate([np.arange(a, b + 1) for a, b in spans])
        for name, spans in ranges.items()
    }
    return Base(np.array(positions), np.array(uvs), np.array(quads), np.array(uv_quads), groups)


def _targets(data: Path) -> list[Path]:
    return sorted((data / "targets").rglob("*.target.gz"))


def morph(data: Path, positions: np.ndarray, weights: dict[str, float]) -> np.ndarray:
    """Add weighted targets (`index dx dy dz` a line, in units) to positions (V, 3)."""
    result = positions.copy()
    for name, weight in weights.items():
        file = data / "targets" / f"{name}.target.gz"
        if not file.is_file():
            known = (p.relative_to(data / "targets").as_posix() for p in _targets(data))
            near = get_close_matches(name, [k.removesuffix(".target.gz") for k in known], 1)
            hint = f"did you mean {near[0]!r}?" if near else "expected one below targets/"
            raise InputError(f"targets: no morph target {name!r}; {hint}")
        with gzip.open(file, "rt", encoding="utf-8") as lines:
            rows = [line.split() for line in lines if line.strip() and not line.startswith("#")]
        if not rows:
            continue  # some macro targets are empty by design: the base mesh is their shape
        table = np.array(rows, dtype=float)
        np.add.at(result, table[:, 0].astype(int), weight * table[:, 1:4])
    return result


def lower_arms(data: Path, base: Base, positions: np.ndarray, degrees: float) -> np.ndarray:
    """Turn both arms down about the shoulders by linear blend skinning with the standard rig's
    weights.
    """
    weights = json.loads(
        (data / "rigs" / "standard" / "weights.default.json").read_text(encoding="utf-8")
    )["weights"]
    rig = json.loads((data / "rigs" / "standard" / "rig.default.json").read_text(encoding="utf-8"))
    bones = rig.get("bones", rig)
    result = positions.copy()
    for side, sign in (("L", 1.0), ("R", -1.0)):
        # the clavicle takes a share, so that the shoulder slopes instead of folding
        for bone, angle in (
            (f"clavicle.{side}", 0.12 * degrees),
            (f"upperarm01.{side}", 0.88 * degrees),
        ):
            inside = {bone}
            while True:
                more = {name for name, b in bones.items() if b.get("parent") in inside} - inside
                if not more:
                    break
                inside |= more
            weight = np.zeros(len(positions))
            for name in inside & weights.keys():
                table = np.array(weights[name])
                np.add.at(weight, table[:, 0].astype(int), table[:, 1])
            cube = bones[bone]["head"]["cube_name"]
            pivot = result[base.groups[cube]].mean(axis=0)
            a = -sign * np.radians(angle)
            turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
            moved = (result - pivot) @ turn.T + pivot
            result += np.clip(weight, 0, 1)[:, None] * (moved - result)
    return result


@dataclass(frozen=True)
class Bust:
    """The morphed bust at one subdivision level, millimetres; crown at y = 0, x and z centred on
    the head.

    positions (N, 3); normals (N, 3); quads (F, 4); uvs (T, 2); uv_quads (F, 4); masks name -> (N,)
    in [0, 1].
    """

    positions: np.ndarray
    normals: np.ndarray
    quads: np.ndarray
    uvs: np.ndarray
    uv_quads: np.ndarray
    masks: dict[str, np.ndarray]


@dataclass(frozen=True)
class Eyeball:
    """Centre (3,) and radius, mm."""

    centre: np.ndarray
    radius: float


@dataclass(frozen=True)
class Anatomy:
    """What the generators of skin, hair and eyes need: busts per level (coarse to fine), eyes, lash
    curves.
    """

    levels: list[Bust]
    to_fine: object  # sparse (N_fine, N_coarse): from levels[1] to levels[-1]
    eyes: tuple[Eyeball, Eyeball]  # left of the person (x > 0), right
    landmarks: dict[str, np.ndarray]
    lashes: dict[str, np.ndarray]  # helper name -> (K, 3) points


def _mask_images(data: Path) -> dict[str, np.ndarray]:
    """MPFB's UV masks, softened by a texel: name -> (H, W) in [0, 1]."""
    from scipy.ndimage import gaussian_filter

    images = {}
    for name in ("lips", "ears", "eyelids", "face", "inside-mouth"):
        with Image.open(data / "textures" / f"mpfb_{name}.jpg") as file:
            images[name] = gaussian_filter(
                np.asarray(file.convert("L"), dtype=np.float32) / 255, 1.0
            )
    return images


def _sample_masks(
    images: dict[str, np.ndarray],
    uvs: np.ndarray,
    uv_quads: np.ndarray,
    quads: np.ndarray,
    count: int,
) -> dict[str, np.ndarray]:
    """The masks sampled (bilinear) at every vertex: name -> (count,) in [0, 1]."""
    from scipy.ndimage import map_coordinates

    masks = {}
    for name, image in images.items():
        h, w = image.shape
        at = map_coordinates(
            image, [(1 - uvs[:, 1]) * h - 0.5, uvs[:, 0] * w - 0.5], order=1, mode="nearest"
        )
        mask = np.zeros(count)
        mask[quads.ravel()] = at[uv_quads.ravel()]
        masks[name] = mask
    return masks


def build_anatomy(data: Path, person: Person, levels: int = LEVELS) -> Anatomy:
    """Morph, pose, crop and subdivide the base mesh."""
    base = read_base(data)
    shaped = morph(data, base.positions, person.targets)
    shaped = lower_arms(data, base, shaped, person.arm_drop_deg) * MM_PER_UNIT

    crown = shaped[base.quads.ravel(), 1].max()
    eyes, eye_vertices = [], ("helper-l-eye", "helper-r-eye")
    for name in eye_vertices:
        points = shaped[base.groups[name]]
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        eyes.append((centre, 0.5 * np.ptp(points[:, 0])))
    origin = np.array([0.5 * (eyes[0][0][0] + eyes[1][0][0]), crown, 0.0])
    shaped = shaped - origin

    keep = (shaped[base.quads, 1] > -CROP_BELOW_CROWN_MM).any(axis=1)
    used, quads = np.unique(base.quads[keep], return_inverse=True)
    uv_used, uv_quads = np.unique(base.uv_quads[keep], return_inverse=True)
    quads, uv_quads = quads.reshape(-1, 4), uv_quads.reshape(-1, 4)
    points, uvs = shaped[used], base.uvs[uv_used]

    busts, to_fine, images = [], None, _mask_images(data)
    for level in range(levels + 1):
        if level:
            smooth, new_quads = subdivide.catmull_clark(quads, len(points))
            split, new_uv_quads = subdivide.bilinear(uv_quads, len(uvs))
            points, uvs, quads, uv_quads = smooth @ points, split @ uvs, new_quads, new_uv_quads
            if level > 1:
                to_fine = smooth if to_fine is None else smooth @ to_fine
        normals = subdivide.vertex_normals(points, subdivide.triangles(quads))
        masks = _sample_masks(images, uvs, uv_quads, quads, len(points))
        busts.append(Bust(points, normals, quads, uvs, uv_quads, masks))

    lashes = {name: shaped[index] for name, index in base.groups.items() if "eyelashes" in name}
    balls = tuple(Eyeball(centre - origin, float(radius)) for centre, radius in eyes)
    return Anatomy(busts, to_fine, balls, _landmarks(busts[-1], balls), lashes)


def _landmarks(bust: Bust, eyes) -> dict[str, np.ndarray]:
    """Points (3,) mm found on the geometry itself, so that they follow any morph."""
    p, masks = bust.positions, bust.masks
    eye = 0.5 * (eyes[0].centre + eyes[1].centre)
    lips = p[masks["lips"] > 0.5]
    mouth = np.array(
        [lips[:, 0].mean(), 0.5 * (lips[:, 1].min() + lips[:, 1].max()), lips[:, 2].max()]
    )
    middle = np.abs(p[:, 0]) < 8
    between = middle & (p[:, 1] < eye[1] - 15) & (p[:, 1] > mouth[1] + 8)
    nose = p[between][p[between, 2].argmax()]
    below = middle & (p[:, 1] < mouth[1] - 15) & (p[:, 1] > mouth[1] - 65)
    chin = p[below][(p[below, 2] + 0.6 * -p[below, 1]).argmax()]
    ear_l = p[(masks["ears"] > 0.5) & (p[:, 0] > 0)].mean(axis=0)
    ear_r = p[(masks["ears"] > 0.5) & (p[:, 0] < 0)].mean(axis=0)
    return {
        "eyes": eye,
        "mouth": mouth,
        "nose": nose,
        "chin": chin,
        "ear_l": ear_l,
        "ear_r": ear_r,
        "mouth_l": lips[lips[:, 0].argmax()],
        "mouth_r": lips[lips[:, 0].argmin()],
    }
