"""What stands before the camera, as arrays: skin, eyes, hair.

Lengths are millimetres, y is up, the head looks along +z, the crown is at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from renderer.scene import cornea
from renderer.scene.material import MASKS, Material, Skin

__all__ = ["MASKS", "Eye", "Garment", "Model", "Proxy", "Strands", "Surface"]


@dataclass(frozen=True)
class Surface:
    """The scattering surface.

    positions, normals (N, 3) float32; uvs (N, 2); faces (M, 3). masks: (N, 8) in [0, 1], columns
    MASKS. proxy: what rays are traced against. maps: by the names of MAPS, albedo (H, W, 3) uint8
    sRGB, normal (H, W, 3) uint8 tangent space, roughness and specular (H, W) uint8, height (H, W)
    float32 in [0, 1]; row 0 at the top.
    """

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    faces: np.ndarray
    masks: np.ndarray
    proxy: Proxy
    maps: dict[str, np.ndarray] = field(default_factory=dict)
    base_colour: tuple[float, float, float] | None = None  # linear albedo where there is no map
    scatters: np.ndarray | None = (
        None  # (N,) 1 where the material scatters, 0 for eyes and teeth of a scan; None: all of it
    )


@dataclass(frozen=True)
class Proxy:
    """A mesh of the skin's shape, coarser or the same, on which light is baked.

    positions, normals (P, 3); faces (Q, 3); albedo (P, 3) linear; to_full: sparse (N, P), carries
    values to the skin.
    """

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    albedo: np.ndarray
    to_full: object
    masks: np.ndarray | None = None
    smooth: int = 2

    @classmethod
    def itself(cls, positions, normals, faces, albedo, smooth: int = 2) -> Proxy:
        """The surface as its own proxy; albedo (3,) or (N, 3)."""
        from scipy import sparse

        count = len(positions)
        albedo = np.broadcast_to(np.asarray(albedo, float), (count, 3))
        to_full = sparse.identity(count, format="csr")
        at, towards = np.asarray(positions, float), np.asarray(normals, float)
        return cls(at, towards, faces, albedo, to_full, smooth=smooth)


#: Sizes and strengths of an eye: fields of stimuli.heads.person.Eyes by the same names.
EYE_VALUES = (
    "pupil_mm",
    "limbus_mm",
    "limbus",
    "veins",
    "redness",
    "lid_shade",
    "lid_shade_mm",
    "lid_shade_shares",
    "lash_veil",
    "meniscus_mm",
    "tears_rad",
)


@dataclass(frozen=True)
class Eye:
    """An eyeball with its cornea, and the tissue in the opening's inner corner.

    positions, normals (N, 3), faces (M, 3); tissue (N, 2): 1 where a vertex is not the ball's but
    the corner's, and how much of that is caruncle. centre, gaze (3,), radius, iris_radius mm;
    into_lens: whether it looks at the camera, as far as gaze_limit_deg from straight ahead, or
    along `gaze`. colours: linear albedo of iris, fibres, collarette and sclera; values: EYE_VALUES.
    edges (H, W, 2) float32: distance to the upper and to the lower lid's edge, mm, above 0 where
    the ball is seen, over edges_mm (width, height) about the centre, seen from the front, row 0 at
    the bottom; (1, 1, 2) where there are no lids. vessels (K, K) uint8: strength of the vessels of
    the sclera over angles of up to VESSELS_RAD from the gaze, row 0 at the bottom.
    """

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    centre: np.ndarray
    gaze: np.ndarray
    radius: float
    iris_radius: float
    colours: dict[str, tuple[float, float, float]]
    values: dict[str, float]
    tissue: np.ndarray
    edges: np.ndarray
    edges_mm: tuple[float, float]
    vessels: np.ndarray
    into_lens: bool = False
    gaze_limit_deg: float = 35.0

    VESSELS_RAD: ClassVar[float] = 1.75

    def towards(self, lens: np.ndarray) -> np.ndarray:
        """The gaze, a unit vector (3,), with the lens at (3,)."""
        away = np.asarray(lens, float) - self.centre
        away /= np.linalg.norm(away)
        within = away[2] >= np.cos(np.radians(self.gaze_limit_deg))
        return away if self.into_lens and within else np.asarray(self.gaze, float)

    def looking(self, gaze: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """positions, normals (N, 3) float32 with the cornea turned to a unit gaze (3,)."""
        positions, normals = self.positions.copy(), self.normals.copy()
        ball = self.tissue[:, 0] == 0
        unit = (positions[ball] - self.centre).astype(float)
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        away = cornea.reach(unit @ gaze, self.radius, self.iris_radius)
        positions[ball] = self.centre + away[:, None] * unit
        normals[ball] = cornea.normals(unit, gaze, self.radius, self.iris_radius)
        return positions, normals


@dataclass(frozen=True)
class Strands:
    """Hair as polylines of any number of points.

    points (N, 3) mm, strand by strand from root to tip; first (S + 1,) where each begins, and N;
    width_mm (S,) at the root, tip (S,) that at the end as a share of it; colour (S, 3) linear: what
    two ways through the fibre leave of light (absorption); cover (N,) in [0, 1], the share of the
    hair layer above each point; root_vertex (S,) index into Surface; sheen (S,) in [0, 1]: of what
    whole scales would mirror. leaves_mm: from there to there along a strand it leaves what lights
    its root. Of all fibres: tilt_deg of the
    cuticle's scales, spread_deg, the standard deviation of the primary highlight, and the
    refractive index (Marschner et al. 2003, table 1, doi:10.1145/882262.882345).
    """

    points: np.ndarray
    first: np.ndarray
    width_mm: np.ndarray
    tip: np.ndarray
    colour: np.ndarray
    cover: np.ndarray
    root_vertex: np.ndarray
    sheen: np.ndarray
    leaves_mm: tuple[float, float] = (40.0, 140.0)
    tilt_deg: float = 3.5
    spread_deg: float = 7.5
    index: float = 1.55


@dataclass(frozen=True)
class Garment:
    """Cloth over the skin, of a material of its own."""

    surface: Surface
    material: Material


@dataclass(frozen=True)
class Model:
    """Everything that stands before the camera.

    landmarks: name -> (3,) mm, at least eyes, eye_l, eye_r, mouth, nose.
    """

    surface: Surface
    eyes: tuple[Eye, ...]
    strands: Strands | None
    landmarks: dict[str, np.ndarray]
    material: Material = field(default_factory=Skin)
    garments: tuple[Garment, ...] = ()
