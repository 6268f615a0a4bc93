"""From anatomy to the renderer's model: a generated person."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from renderer.scene import Model, Proxy, Surface
from renderer.scene.material import Skin
from stimuli.heads import eyes, hair, skin
from stimuli.heads.anatomy import Anatomy, Bust
from stimuli.heads.person import Person


def _split(bust: Bust) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices split along UV seams: index of the position (N,), of the uv (N,), and triangles (M,
    3) into them.
    """
    pairs = np.stack([bust.faces.ravel(), bust.uv_faces.ravel()], axis=1)
    unique, index = np.unique(pairs, axis=0, return_inverse=True)
    return unique[:, 0], unique[:, 1], index.reshape(-1, 3)


def default_model(
    anatomy: Anatomy, seed: int, hair_share: float = 1.0, person: Person | None = None
) -> Model:
    """The bust with skin, eyes and hair."""
    person = person or Person()
    lines = {"hairline_mm": person.hair.hairline_mm, "regions": person.regions}
    own = Skin.read(person.skin, "person.skin")
    fine, coarse = anatomy.fine, anatomy.coarse
    mask = skin.masks(anatomy, fine, **lines)
    where, uv, faces = _split(fine)
    coarse_mask = skin.masks(anatomy, coarse, **lines)
    pick = sparse.csr_matrix(
        (np.ones(len(where)), (np.arange(len(where)), where)), (len(where), len(fine.positions))
    )
    proxy = Proxy(
        coarse.positions,
        coarse.normals,
        coarse.faces,
        own.mean_albedo(coarse_mask),
        (pick @ anatomy.to_fine).tocsr(),
        coarse_mask,
    )
    surface = Surface(
        fine.positions[where].astype(np.float32),
        fine.normals[where].astype(np.float32),
        fine.uvs[uv].astype(np.float32),
        faces.astype(np.uint32),
        mask[where],
        proxy,
    )
    scalp = hair.Scalp(fine.positions[where], fine.normals[where], faces, mask[where])
    landmarks = dict(anatomy.landmarks, eye_l=anatomy.eyes[0].centre, eye_r=anatomy.eyes[1].centre)
    return Model(
        surface,
        tuple(
            eyes.eyeball(ball, person.eyes, opening, seed)
            for ball, opening in zip(anatomy.eyes, anatomy.openings, strict=True)
        ),
        hair.all_strands(anatomy, scalp, seed, hair_share, person.hair, person.lashes),
        landmarks,
        own,
    )
