"""The average head that a user's scan is laid over: points, where they face, what lies where.

template.npz holds it, so that a scan needs no network; it is made from the CC0 base mesh by
`tools/head-template`, of both sexes and three regions in equal parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from renderer.scene import MASKS

FILE = Path(__file__).with_name("template.npz")
BELOW_CHIN_MM = 25.0
#: Where a vertex sees less of the outside than this it is in a nostril, the mouth or behind a lid.
OPENNESS = 0.12
SKULL_WEIGHT = 0.15  # of what lies under the hair: there scans have hair, caps or nothing


@dataclass(frozen=True, eq=False)
class Template:
    """Crown at y = 0, face along +z, mm.

    points, normals (N, 3); faces (M, 3); weight (N,) in [0, 1]: how much a vertex says of where a
    face is; masks (N, len(MASKS)) in [0, 1]; landmarks: name -> (3,).
    """

    points: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    weight: np.ndarray
    masks: np.ndarray
    landmarks: dict[str, np.ndarray]

    @property
    def height_mm(self) -> float:
        """From crown to chin."""
        return float(-self.landmarks["chin"][1])


@lru_cache(maxsize=1)
def load() -> Template:
    from stimuli.heads.subdivide import vertex_normals

    with np.load(FILE) as kept:
        points = kept["points"].astype(np.float64) / 100
        faces = kept["faces"].astype(np.int64)
        marks = dict(zip(kept["names"].tolist(), kept["landmarks"].astype(float), strict=True))
        return Template(
            points,
            vertex_normals(points, faces),
            faces,
            kept["weight"] / 255.0,
            kept["masks"] / 255.0,
            marks,
        )


def make(data: Path) -> dict[str, np.ndarray]:
    """The arrays of template.npz from the base data (stimuli.heads.fetch.mpfb_data)."""
    import trimesh

    from stimuli.heads import anatomy, skin
    from stimuli.heads.form import Form
    from stimuli.heads.person import Person

    targets = {}
    for sex in ("female", "male"):
        for region in ("african", "asian", "caucasian"):
            targets[f"macrodetails/{region}-{sex}-young"] = 1 / 6
        body = f"macrodetails/universal-{sex}-young-averagemuscle-averageweight"
        targets[body] = 0.5
    made = anatomy.build_anatomy(data, Person(targets=targets, form=Form.none()), 1)
    bust, marks = made.coarse, dict(made.landmarks)
    marks |= {"eye_l": made.eyes[0].centre, "eye_r": made.eyes[1].centre}
    marks["crown"] = bust.positions[bust.positions[:, 1].argmax()]
    faces, points, normals = bust.faces, bust.positions, bust.normals

    # what is seen from outside: rays over the half-space above each vertex
    solid = trimesh.Trimesh(points, faces, process=False)
    spread = _sphere(96)
    origins = np.repeat(points + 0.5 * normals, len(spread), axis=0)
    out = np.tile(spread, (len(points), 1))
    above = (out * np.repeat(normals, len(spread), axis=0)).sum(axis=1) > 0.05
    free = np.zeros(len(out))
    free[above] = ~solid.ray.intersects_any(origins[above], out[above])
    openness = free.reshape(len(points), -1).sum(axis=1) / len(spread) * 2

    keep = (openness > OPENNESS) & (points[:, 1] > marks["chin"][1] - BELOW_CHIN_MM)
    faces = faces[keep[faces].all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    mask = skin.masks(made, bust)[used]
    at = points[used]
    # the face: in front of the ears, below the hair, above the chin's end
    front = skin.smoothstep(-10.0, 25.0, at[:, 2] - marks["ear_l"][2])
    low = skin.smoothstep(0.0, -8.0, at[:, 1] - marks["eyes"][1] - 50.0)
    end = skin.smoothstep(-20.0, -5.0, at[:, 1] - marks["chin"][1])
    weight = SKULL_WEIGHT + (1 - SKULL_WEIGHT) * front * low * end
    weight *= 1 - 0.8 * mask[:, MASKS.index("hair")] * (1 - front * low)
    names = sorted(marks)
    return {
        "points": np.rint(at * 100).astype(np.int16),
        "faces": faces.reshape(-1, 3).astype(np.uint16),
        "weight": np.rint(255 * np.clip(weight, 0, 1)).astype(np.uint8),
        "masks": np.rint(255 * mask).astype(np.uint8),
        "names": np.array(names),
        "landmarks": np.array([marks[name] for name in names]).round(2),
    }


def _sphere(count: int) -> np.ndarray:
    """Even directions (count, 3): a Fibonacci lattice."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])
