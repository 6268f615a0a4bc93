"""From a user's scan to the renderer's model."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from renderer.scene import MASKS, Material, Model, Proxy, Surface
from stimuli.heads import eyes
from stimuli.heads.anatomy import Eyeball

PROXY_LIMIT = 60_000  # vertices: above it light is baked on a clustered mesh
CLUSTER_MM = 3.0
SKIN_COLOUR = (0.56, 0.38, 0.30)  # linear albedo of a scan without any colour of its own
EYES_BELOW_CROWN_MM = 112.0  # half an adult head's height


def _clustered(
    positions: np.ndarray, normals: np.ndarray, faces: np.ndarray, albedo: np.ndarray
) -> Proxy:
    """A proxy of one vertex per CLUSTER_MM cell; each full vertex takes its light from the three
    nearest that face its way.
    """
    from scipy.spatial import cKDTree

    cell = np.floor(positions / CLUSTER_MM).astype(np.int64)
    _, of = np.unique(np.column_stack([cell, normals > 0]), axis=0, return_inverse=True)
    of = of.ravel()
    count = of.max() + 1
    mean = sparse.csr_matrix((np.ones(len(of)), (of, np.arange(len(of)))), (count, len(of)))
    mean = sparse.diags(1 / np.asarray(mean.sum(axis=1)).ravel()) @ mean
    small = of[faces]
    small = small[
        (small[:, 0] != small[:, 1]) & (small[:, 1] != small[:, 2]) & (small[:, 2] != small[:, 0])
    ]
    centre, normal = mean @ positions, mean @ normals
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    _, near = cKDTree(np.hstack([centre, 4 * CLUSTER_MM * normal])).query(
        np.hstack([positions, 4 * CLUSTER_MM * normals]), k=3
    )
    rows = np.repeat(np.arange(len(positions)), 3)
    return Proxy(
        centre,
        normal,
        small,
        mean @ albedo,
        sparse.csr_matrix(
            (np.full(rows.size, 1 / 3), (rows, near.ravel())), (len(positions), count)
        ),
    )


def _scan_landmarks(p: np.ndarray, eye_points: np.ndarray | None) -> dict[str, np.ndarray]:
    """Where the eyes, nose and mouth of an upright head that looks along +z must be: from its eye
    parts, else its proportions.
    """
    crown = p[:, 1].max()
    head = p[p[:, 1] > crown - 200]
    middle = 0.5 * (np.quantile(head[:, 0], 0.01) + np.quantile(head[:, 0], 0.99))
    face = head[(np.abs(head[:, 0] - middle) < 15) & (head[:, 1] < crown - 90)]
    nose = face[face[:, 2].argmax()] if len(face) else head[head[:, 2].argmax()]
    if eye_points is None:
        eyes = np.array([middle, crown - EYES_BELOW_CROWN_MM, nose[2] - 40])
        apart = 31.0
    else:
        eyes = np.array([middle, eye_points[:, 1].mean(), eye_points[:, 2].mean()])
        apart = np.abs(eye_points[:, 0] - middle).mean()
    side = np.array([apart, 0, 0])
    return {
        "eyes": eyes,
        "eye_l": eyes + side,
        "eye_r": eyes - side,
        "nose": nose,
        "mouth": np.array([middle, eyes[1] - 70, nose[2] - 12]),
    }


def _own_eyes(points: np.ndarray) -> tuple[Eyeball, ...]:
    """The balls that an uncoloured scan's eye parts (N, 3) take up, left of the person first."""
    middle = 0.5 * (points[:, 0].min() + points[:, 0].max())
    sides = [points[points[:, 0] > middle], points[points[:, 0] <= middle]]
    if min(map(len, sides)) < 8:
        return ()
    balls = []
    for side in sides:
        low, high = side.min(axis=0), side.max(axis=0)
        radius = 0.25 * ((high - low)[0] + (high - low)[1])
        balls.append(Eyeball(np.array([*(0.5 * (low + high))[:2], low[2] + radius]), float(radius)))
    return tuple(balls) if all(8 < ball.radius < 18 for ball in balls) else ()


def scan_model(scan) -> Model:
    """A user's scan: its own maps on its skin; eyes and teeth drawn without scattering; hair as
    surface.

    Left out: clear shells over the eyes, and cards of lashes and brows, which are nothing without
    their alpha. Eyes without a texture are replaced by the default head's.
    """
    kinds = [
        "card" if kind == "hair" and ("lash" in name.lower() or "brow" in name.lower()) else kind
        for name, kind in zip(scan.part_names, scan.part_kinds, strict=True)
    ]
    kind = np.array(kinds)[scan.parts]
    eye_faces = scan.faces[kind == "eye"]
    eye_points = scan.positions_mm[np.unique(eye_faces)].astype(float) if len(eye_faces) else None
    balls = _own_eyes(eye_points) if eye_points is not None and scan.albedo is None else ()
    kept = ~np.isin(kind, ["shell", "card", *(["eye"] if balls else [])])
    used, faces = np.unique(scan.faces[kept], return_inverse=True)
    faces = faces.reshape(-1, 3)
    positions, normals = scan.positions_mm[used].astype(float), scan.normals[used].astype(float)
    scatters = np.ones(len(used))
    scatters[faces[kind[kept] != "skin"].ravel()] = 0
    colour = scan.base_colour or SKIN_COLOUR
    if scan.albedo is not None:
        mean = scan.albedo.reshape(-1, 3)[:: max(1, scan.albedo.size // 300_000)] / 255
        colour = tuple(
            np.where(mean <= 0.04045, mean / 12.92, ((mean + 0.055) / 1.055) ** 2.4).mean(axis=0)
        )
    albedo = np.tile(np.array(colour), (len(used), 1))
    if len(used) > PROXY_LIMIT:
        proxy = _clustered(positions, normals, faces, albedo)
    else:
        proxy = Proxy(positions, normals, faces, albedo, sparse.identity(len(used), format="csr"))
    uvs = np.zeros((len(used), 2)) if scan.uvs is None else scan.uvs[used]
    own = {
        "albedo_map": scan.albedo,
        "normal_map": scan.normal_map,
        "roughness_map": scan.roughness,
    }
    surface = Surface(
        positions.astype(np.float32),
        normals.astype(np.float32),
        uvs.astype(np.float32),
        faces.astype(np.uint32),
        np.zeros((len(used), len(MASKS)), dtype=np.float32),
        proxy,
        {name: image for name, image in own.items() if image is not None},
        tuple(colour),
        scatters,
    )
    return Model(
        surface,
        tuple(eyes.eyeball(ball) for ball in balls),
        None,
        _scan_landmarks(positions, eye_points),
        material=Material(albedo=tuple(float(v) for v in colour)),
    )
