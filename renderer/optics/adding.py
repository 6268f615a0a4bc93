"""Adding and doubling: what plane layers send back and let through, without noise.

Van de Hulst 1963; Prahl, van Gemert and Welch 1993, "Determining the optical properties of turbid
media by using the adding-doubling method", doi:10.1364/AO.32.000559. Scattering is isotropic (a
medium is given by its reduced coefficients), light is averaged over the azimuth, and everything is
batched: leading axes are any number of media.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from renderer.errors import InputError
from renderer.optics import fresnel

NODES = 8  # directions of a hemisphere, half of them within the critical angle
FIRST = 0.02  # optical depth below which a layer is taken at once
DEEP = 200.0  # optical depth that counts as infinite


@dataclass(frozen=True)
class Directions:
    """Cosines mu (Q,) of (0, 1) and their weights (Q,), parted at the critical angle of eta; mirror
    (Q,): what a smooth face of that relative index sends back inside.
    """

    mu: np.ndarray
    weight: np.ndarray
    mirror: np.ndarray
    critical: float

    @classmethod
    def of(cls, eta: float, nodes: int = NODES) -> Directions:
        """For a medium of the index `eta` below a clear half-space."""
        if not eta >= 1:
            raise InputError(f"eta is {eta!r}; expected an index of refraction of 1 or more")
        critical = float(np.sqrt(1 - 1 / eta**2))
        t, w = np.polynomial.legendre.leggauss(nodes // 2 if critical else nodes)
        ends = ((0.0, critical), (critical, 1.0)) if critical else ((0.0, 1.0),)
        mu = np.concatenate([a + (b - a) * 0.5 * (t + 1) for a, b in ends])
        weight = np.concatenate([(b - a) * 0.5 * w for a, b in ends])
        return cls(mu, weight, fresnel.reflectance(mu, eta), critical)


def _thin(directions: Directions, depth: np.ndarray, albedo: np.ndarray):
    """Reflection and transmission (..., Q, Q) of layers of a small optical depth (...): the diamond
    scheme of Prahl et al., sec. 2.
    """
    one = np.eye(len(directions.mu))
    step = (depth[..., None, None] / 2) / directions.mu[:, None]
    scattered = step * (albedo[..., None, None] / 2) * directions.weight
    a = one + step * one - scattered
    b = np.broadcast_to(scattered, a.shape)
    lost = np.linalg.solve(a, b)  # (E + A)^-1 B
    g = np.linalg.inv(a - b @ lost)
    return 2 * g @ b @ np.linalg.inv(a), 2 * g - one


def _doubled(r: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice a layer."""
    between = np.linalg.solve(np.eye(r.shape[-1]) - r @ r, np.concatenate([t, r @ t], axis=-1))
    through, back = np.split(between, 2, axis=-1)
    return r + t @ back, t @ through


def slab(directions: Directions, depth, albedo) -> tuple[np.ndarray, np.ndarray]:
    """Operators (..., Q, Q) of layers: radiance in each direction that goes in to radiance that is
    sent back, and that comes out below.

    depth (...): optical depth sigma_t' d, above 0; albedo (...): sigma_s' / sigma_t'. The faces are
    matched: `lit` adds a refracting one.
    """
    depth, albedo = np.broadcast_arrays(np.asarray(depth, float), np.asarray(albedo, float))
    if not (depth > 0).all():
        raise InputError(f"an optical depth is {depth.min():g}; expected more than 0")
    times = max(int(np.ceil(np.log2(depth.max() / FIRST))), 0) if depth.size else 0
    r, t = _thin(directions, depth / 2**times, albedo)
    for _ in range(times):
        r, t = _doubled(r, t)
    return r, t


def half_space(directions: Directions, albedo) -> np.ndarray:
    """The operator (..., Q, Q) of an infinitely deep medium (DEEP optical depths of it)."""
    return slab(directions, np.full(np.shape(albedo), DEEP), albedo)[0]


def over(r: np.ndarray, t: np.ndarray, below: np.ndarray) -> np.ndarray:
    """What a layer (r, t) over something that sends back `below` sends back: (..., Q, Q)."""
    return r + t @ np.linalg.solve(np.eye(r.shape[-1]) - below @ r, below @ t)


def lit(directions: Directions, back: np.ndarray, eta: float) -> np.ndarray:
    """The albedo (...): the share of even light, of what entered, that leaves again through the
    smooth face of a medium whose inside sends back `back`.
    """
    mu, weight, mirror = directions.mu, directions.weight, directions.mirror
    entering = np.where(mu > directions.critical, 1 - mirror, 0.0)
    one = np.eye(len(mu))
    up = np.linalg.solve(one - back * mirror, (back @ entering)[..., None])[..., 0]
    flux = weight * mu
    return (up @ (flux * (1 - mirror))) / (flux @ entering)
