"""The default head's anatomy: the base mesh morphed, posed, cropped to a bust and subdivided.

Millimetres; the crown is at y = 0, the face looks along +z.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stimuli.heads import mpfb, subdivide
from stimuli.heads.person import Person

LEVELS = 2
CROP_BELOW_CROWN_MM = 520.0


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
    base = mpfb.read_base(data)
    shaped = mpfb.morph(data, base.positions, person.targets)
    shaped = mpfb.lower_arms(data, base, shaped, person.arm_drop_deg) * mpfb.MM_PER_UNIT

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

    busts, to_fine, images = [], None, mpfb.mask_images(data)
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
