"""What stands before the camera, as arrays: skin, eyes, hair.

Lengths are millimetres, y is up, the head looks along +z, the crown is at y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from renderer.scene.material import MASKS, Material, Skin

__all__ = ["MASKS", "Eye", "Model", "Proxy", "Strands", "Surface"]


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


@dataclass(frozen=True)
class Eye:
    """An eyeball with its cornea.

    positions, normals (N, 3), faces (M, 3); centre, gaze (3,), radius, iris_radius mm; colours:
    linear albedo of iris, fibres, collarette and sclera.
    """

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    centre: np.ndarray
    gaze: np.ndarray
    radius: float
    iris_radius: float
    colours: dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Strands:
    """Hair as polylines: points (S, P, 3) mm; width_mm (S,); colour (S, 3) linear albedo; cover (S,
    P) in [0, 1], the share of the hair layer above each point; root_vertex (S,) index into Surface.
    """

    points: np.ndarray
    width_mm: np.ndarray
    colour: np.ndarray
    cover: np.ndarray
    root_vertex: np.ndarray


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
