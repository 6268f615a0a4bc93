"""MakeHuman/MPFB2's base mesh (CC0) as its files hold it: mesh, morph targets, rig, masks.

The base mesh stands with its arms out, is measured in decimetres and looks along +z, y up.
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

MM_PER_UNIT = 100.0


@dataclass(frozen=True)
class Base:
    """The base mesh as stored: positions (V, 3) in units, uvs (T, 2), quads (F, 4) into each."""

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
            for name in sorted(inside & weights.keys()):  # a sum's last bit is its order's
                table = np.array(weights[name])
                np.add.at(weight, table[:, 0].astype(int), table[:, 1])
            cube = bones[bone]["head"]["cube_name"]
            pivot = result[base.groups[cube]].mean(axis=0)
            a = -sign * np.radians(angle)
            turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
            moved = (result - pivot) @ turn.T + pivot
            result += np.clip(weight, 0, 1)[:, None] * (moved - result)
    return result


NECK = {"neck03": 0.75, "neck02": 0.5, "neck01": 0.25}  # share of the head's stillness


def turn_torso(
    data: Path, base: Base, positions: np.ndarray, yaw_deg: float, roll_deg: float
) -> np.ndarray:
    """Turn the torso below a head that stays: yaw to the person's left about the neck's vertical
    axis, roll towards their right; the neck's bones share the way by their skinning weights.
    """
    if yaw_deg == 0 and roll_deg == 0:
        return positions
    rig = data / "rigs" / "standard"
    weights = json.loads((rig / "weights.default.json").read_text(encoding="utf-8"))["weights"]
    bones = json.loads((rig / "rig.default.json").read_text(encoding="utf-8"))
    bones = bones.get("bones", bones)
    still = np.zeros(len(positions))
    for name, table in weights.items():
        above = name
        while above is not None and above != "head" and above not in NECK:
            above = bones[above].get("parent") if above in bones else None
        if above and table:
            table = np.array(table)
            np.add.at(still, table[:, 0].astype(int), NECK.get(above, 1.0) * table[:, 1])
    angle = 1 - np.clip(still, 0, 1)
    pivot = positions[base.groups[bones["neck01"]["head"]["cube_name"]]].mean(axis=0)
    p = positions - pivot
    for axis, degrees in ((1, yaw_deg), (2, roll_deg)):
        i, j = ((2, 0), (0, 1))[axis - 1]
        a = np.radians(degrees) * angle
        turned = p.copy()
        turned[:, i] = np.cos(a) * p[:, i] - np.sin(a) * p[:, j]
        turned[:, j] = np.sin(a) * p[:, i] + np.cos(a) * p[:, j]
        p = turned
    return p + pivot


def mask_images(data: Path) -> dict[str, np.ndarray]:
    """MPFB's UV masks, softened by a texel: name -> (H, W) in [0, 1]."""
    from scipy.ndimage import gaussian_filter

    images = {}
    for name in ("lips", "ears", "eyelids", "face", "inside-mouth"):
        with Image.open(data / "textures" / f"mpfb_{name}.jpg") as file:
            images[name] = gaussian_filter(
                np.asarray(file.convert("L"), dtype=np.float32) / 255, 1.0
            )
    return images
