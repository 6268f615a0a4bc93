"""From anatomy to the renderer's model: a generated person."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from renderer.scene import Model, Proxy, Surface
from renderer.scene.material import Skin
from stimuli.heads import eyes, garment, hair, skin
from stimuli.heads.anatomy import Anatomy, Bust
from stimuli.heads.person import Clothes, Person


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
    """The bust with skin, eyes, hair and clothes."""
    person = person or Person()
    lines = {"hairline_mm": person.hair.hairline_mm, "regions": person.regions}
    own = Skin.read(person.skin, "person.skin")
    fine, coarse, to_fine = anatomy.fine, anatomy.coarse, anatomy.to_fine
    worn = person.clothes.kind != "none"
    if worn:
        fine, coarse, to_fine = _uncovered(anatomy, person.clothes)
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
        (pick @ to_fine).tocsr(),
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
        (garment.dressed(garment.shirt(anatomy, person.clothes), person.clothes),) if worn else (),
    )


def _uncovered(anatomy: Anatomy, clothes: Clothes) -> tuple[Bust, Bust, sparse.csr_matrix]:
    """The fine and the coarse bust without what a garment hides, and the map between them."""
    fine = _kept(anatomy.fine, garment.bare(anatomy.fine, clothes))
    rows = anatomy.to_fine[np.unique(fine.faces)]
    needed = np.zeros(len(anatomy.coarse.positions), bool)
    needed[rows.indices[rows.data != 0]] = True
    # the coarse one keeps all vertices that the fine one takes light from
    coarse = _kept(anatomy.coarse, needed[anatomy.coarse.faces].any(axis=1))
    used_fine, used_coarse = np.unique(fine.faces), np.unique(coarse.faces)
    return (
        _compact(fine, used_fine),
        _compact(coarse, used_coarse),
        anatomy.to_fine[used_fine][:, used_coarse].tocsr(),
    )


def _kept(bust: Bust, those: np.ndarray) -> Bust:
    """Some of a bust's triangles."""
    uv_faces = bust.uv_faces[those] if len(bust.uv_faces) else bust.uv_faces
    return replace(bust, faces=bust.faces[those], uv_faces=uv_faces)


def _compact(bust: Bust, used: np.ndarray) -> Bust:
    """A bust of its vertices `used` alone."""
    number = np.zeros(len(bust.positions), int)
    number[used] = np.arange(len(used))
    return replace(
        bust,
        positions=bust.positions[used],
        normals=bust.normals[used],
        plain=bust.plain[used],
        faces=number[bust.faces],
        masks={name: mask[used] for name, mask in bust.masks.items()},
    )
