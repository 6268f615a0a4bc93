"""The default head's anatomy: the base mesh morphed, posed, cropped to a bust and subdivided.

Millimetres; the crown is at y = 0, the face looks along +z.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import sparse

from stimuli.heads import lids, mouth, mpfb, nostrils, relief, subdivide
from stimuli.heads.lids import Eyeball, Opening
from stimuli.heads.person import Person

LEVELS = 2
CROP_BELOW_CROWN_MM = 520.0
EYES = ("helper-l-eye", "helper-r-eye")


@dataclass(frozen=True)
class Bust:
    """The morphed bust at one subdivision level, millimetres; crown at y = 0, x and z centred on
    the head.

    positions (N, 3); normals (N, 3); faces (F, 3); uvs (T, 2); uv_faces (F, 3); masks name -> (N,)
    in [0, 1]; plain (N, 3): where its vertices lie on the base mesh without targets, y above the
    eyes.
    """

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    uvs: np.ndarray
    uv_faces: np.ndarray
    masks: dict[str, np.ndarray]
    plain: np.ndarray


@dataclass(frozen=True)
class Anatomy:
    """What the generators of skin, hair and eyes need: the fine bust, a coarse one of some of its
    vertices, eyes and the openings before them.

    fine has a third level of subdivision where the form wants it. curves: the folds and rises of
    the form, on the skin before they moved it.
    """

    fine: Bust
    coarse: Bust
    to_fine: object  # sparse (N_fine, N_coarse)
    eyes: tuple[Eyeball, Eyeball]  # left of the person (x > 0), right
    landmarks: dict[str, np.ndarray]
    openings: tuple[Opening | None, ...]  # between the lids of each eye
    curves: list[relief.Curve]


def _sample_masks(
    images: dict[str, np.ndarray],
    uvs: np.ndarray,
    uv_faces: np.ndarray,
    faces: np.ndarray,
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
        mask[faces.ravel()] = at[uv_faces.ravel()]
        masks[name] = mask
    return masks


def build_anatomy(data: Path, person: Person, levels: int = LEVELS) -> Anatomy:
    """Morph, pose, crop and subdivide the base mesh, and give it the person's form.

    levels: of subdivision everywhere, 1 or more; from 2 on one more where the form is narrow.
    """
    base = mpfb.read_base(data)
    plain = mpfb.lower_arms(data, base, base.positions, person.arm_drop_deg) * mpfb.MM_PER_UNIT
    shaped = mpfb.morph(data, base.positions, person.targets)
    shaped = person.expression.shown(data, base.positions, shaped)
    shaped = mpfb.lower_arms(data, base, shaped, person.arm_drop_deg)
    shaped = mpfb.turn_torso(data, base, shaped, person.torso_yaw_deg, person.torso_roll_deg)
    shaped = shaped * mpfb.MM_PER_UNIT

    plain_eyes = [_ball(plain, base, name) for name in EYES]
    eyes = [_ball(shaped, base, name) for name in EYES]
    crown = shaped[base.quads.ravel(), 1].max()
    origin = np.array([0.5 * (eyes[0].centre[0] + eyes[1].centre[0]), crown, 0.0])
    shaped = shaped - origin
    balls = [Eyeball(ball.centre - origin, ball.radius) for ball in eyes]

    keep = (shaped[base.quads, 1] > -CROP_BELOW_CROWN_MM).any(axis=1)
    used, quads = np.unique(base.quads[keep], return_inverse=True)
    uv_used, uv_quads = np.unique(base.uv_quads[keep], return_inverse=True)
    quads, uv_quads = quads.reshape(-1, 4), uv_quads.reshape(-1, 4)
    # the person and the mesh without targets side by side: (V, 6)
    both, uvs = np.hstack([shaped[used], plain[used]]), base.uvs[uv_used]
    images = mpfb.mask_images(data)
    for _ in range(levels):
        smooth, new_quads = subdivide.catmull_clark(quads, len(both))
        split, new_uv_quads = subdivide.bilinear(uv_quads, len(uvs))
        before, count = quads, len(both)
        both, uvs, quads, uv_quads = smooth @ both, split @ uvs, new_quads, new_uv_quads

    middle = 0.5 * (plain_eyes[0].centre + plain_eyes[1].centre)
    points = both[:, :3]
    normals = subdivide.vertex_normals(points, subdivide.triangles(quads))
    reference = relief.Reference(both[:, 3:], quads, middle, points, normals)
    made = relief.curves(person.form, reference)
    masks = _sample_masks(images, uvs, uv_quads, quads, len(points))
    close = relief.narrow(made, points) | ((masks["lips"] > 0.05) & (masks["inside-mouth"] < 0.9))
    close |= nostrils.near(person.form, reference, points)
    close &= levels > 1

    # a level more where that is wanted; light is baked a level below
    fine_map, uv_map, faces, uv_faces, _ = subdivide.refined(
        quads, uv_quads, len(points), len(uvs), close[quads].any(axis=1)
    )
    both, uvs = fine_map @ both, uv_map @ uvs
    points = both[:, :3]
    masks = _sample_masks(images, uvs, uv_faces, faces, len(points))
    normals = subdivide.vertex_normals(points, faces)
    plain_normals = subdivide.vertex_normals(both[:, 3:], faces)
    upper = mouth.above(both[:, 3:], plain_normals, masks["lips"])
    if any(person.form.vermilion_mm):
        points = points + mouth.sized(
            points, normals, faces, masks["lips"], upper, person.form.vermilion_mm
        )
        normals = subdivide.vertex_normals(points, faces)
    if person.form.lips_mm:
        points = points + mouth.closed(
            points, normals, faces, masks["lips"], upper, person.form.lips_mm
        )
    normals = subdivide.vertex_normals(points, faces)
    moved = relief.offsets(made, points, normals)
    form = person.form
    moved += mouth.ridge(
        points, normals, faces, masks["lips"], form.lip_ridge_mm, form.lip_ridge_width_mm
    )
    bored, masks["nostrils"] = nostrils.opened(form, reference, points, normals)
    moved += bored
    points, (left, right), openings = lids.fitted(points + moved, faces, balls, person.eyes)
    balls = (left, right)
    normals = subdivide.vertex_normals(points, faces)
    plain = both[:, 3:] - middle * [0, 1, 0]
    fine = Bust(points, normals, faces, uvs, uv_faces, masks, plain)

    coarse, to_fine = _coarse(fine, before, smooth, fine_map, close, count)
    return Anatomy(fine, coarse, to_fine, balls, _landmarks(fine, balls), tuple(openings), made)


def _coarse(fine: Bust, quads, smooth, fine_map, close, count: int) -> tuple[Bust, object]:
    """The mesh that light is baked on: the level below the last of those that are whole, with some
    of the last one's vertices where the form is narrow; and the map from it to the fine one.

    quads: of that level; smooth: its map to the next; close: the next one's vertices that are kept;
    count: of its vertices. All its vertices are the fine mesh's too, in their places there.
    """
    wanted = close[:count][quads].any(axis=1)
    _, _, faces, _, kept = subdivide.refined(quads, quads, count, count, wanted)
    column = np.full(smooth.shape[0], -1)
    column[kept] = np.arange(len(kept))
    # what is not kept lies between the level's own vertices, which come first
    is_kept = column >= 0
    choose = sparse.csr_matrix(
        (np.ones(len(kept)), (kept, np.arange(len(kept)))), (smooth.shape[0], len(kept))
    )
    widened = sparse.csr_matrix(
        (smooth.data, smooth.indices, smooth.indptr), (smooth.shape[0], len(kept))
    )
    to_last = choose + sparse.diags((~is_kept).astype(float)) @ widened
    bust = Bust(
        fine.positions[kept],
        fine.normals[kept],
        faces,
        np.zeros((0, 2)),
        np.zeros((0, 3), int),
        {name: mask[kept] for name, mask in fine.masks.items()},
        fine.plain[kept],
    )
    return bust, (fine_map @ to_last).tocsr()


def _ball(points: np.ndarray, base: mpfb.Base, name: str) -> Eyeball:
    own = points[base.groups[name]]
    return Eyeball(0.5 * (own.min(axis=0) + own.max(axis=0)), float(0.5 * np.ptp(own[:, 0])))


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
