"""Multipole for a slab: Donner and Jensen 2005, "Light diffusion in multi-layered translucent
materials", doi:10.1145/1073204.1073308.

z points down, the slab is 0..d, l = 1 / sigma_t', z_b = 2 A D at each face; images i = -n..n at
z_r,i = 2 i P + l and z_v,i = 2 i P - l - 2 z_b(0), with the half period P = d + z_b(0) + z_b(d).
Errors of the documents (Vuletic eqs. 2.65 to 2.67, Rohat eq. 3.6 and sec. 4.2.2) are listed in
docs/profiles.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics import fresnel
from renderer.optics.dipole import pole, top_extrapolation
from renderer.optics.model import Profile, radii

MOST_IMAGES = 500
THIN = 1.0  # in l: below, the source lies under the far face


def image_sum(z, sigma_tr, P) -> np.ndarray:
    """Sum over all images of sgn(z + 2 i P) exp(-sigma_tr |z + 2 i P|), in closed form:
    sinh(sigma_tr (P - z)) / sinh(sigma_tr P), z mod 2P.
    """
    z = np.mod(z, 2 * P)
    near = np.minimum(z, 2 * P - z)  # the sum is odd about P
    k = np.maximum(sigma_tr, 1e-9 / P)
    return (
        np.where(z <= P, 1, -1)
        * np.exp(-k * near)
        * np.expm1(-2 * k * (P - near))
        / np.expm1(-2 * k * P)
    )


@dataclass(frozen=True)
class Multipole(Profile):
    """R_d(r) and T_d(r) of one slab with its own index above and below; a half-space is Jensen's
    dipole.

    images: pairs on each side, 0 for as many as the radius and the absorption ask for.
    """

    images: int = 0

    name: ClassVar[str] = "multipole"
    paper: ClassVar[str] = "Donner and Jensen 2005"
    knows_roughness: ClassVar[bool] = True

    def __post_init__(self):
        super().__post_init__()
        if self.images < 0:
            raise InputError(f"images is {self.images}; expected 0 (as many as needed) or more")
        if self.thickness_mm <= THIN * self.medium.mfp.max():
            raise InputError(
                f"{self.name}: the slab of {self.thickness_mm:g} mm is thinner than its mean "
                "free path of "
                f"{self.medium.mfp.max():.3g} mm; expected a thicker slab, or "
                "quantized_diffusion or montecarlo for this one"
            )

    def geometry(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """z_b above, z_b below and P, mm: (C,) each."""
        m = self.medium
        z_above = 2 / 3 * m.mfp * top_extrapolation(self.stack, m)
        z_below = 2 / 3 * m.mfp * fresnel.extrapolation(m.eta / self.stack.n_below)
        return z_above, z_below, self.thickness_mm + z_above + z_below

    def _sum(self, r_mm, depth: float) -> np.ndarray:
        """Flux through the plane z = depth (0 or d), upwards at 0 and downwards at d."""
        m, r = self.medium, radii(r_mm)
        z_above, _, P = self.geometry()
        out = np.zeros((len(r), m.channels))
        # Enough for the farthest radius, and for the share that reaches the last image.
        with np.errstate(divide="ignore"):
            n = self.images or int(
                np.clip(min((18 / (m.sigma_tr * P)).max(), 400), 10, None)
                + np.ceil(min(r.max() / P.min(), 100))
            )
        for i in range(-n, n + 1):
            z_r, z_v = 2 * i * P + m.mfp, 2 * i * P - m.mfp - 2 * z_above
            if depth:
                out += pole(r, depth - z_r, m.sigma_tr) - pole(r, depth - z_v, m.sigma_tr)
            else:
                out += pole(r, z_r, m.sigma_tr) - pole(r, z_v, m.sigma_tr)
        if not self.images:
            # The images beyond, 2 i P >> r: each pair is the slope of a pole along z, -2 (1 + x +
            # x^2 / 2) exp(-x) / (4 pi z^3), x = sigma_tr z.
            x = m.sigma_tr * 2 * P * (n + 0.5)
            rest = (
                (m.mfp + z_above)
                * (1 + x + x**2 / 2)
                * np.exp(-x)
                / (8 * np.pi * P**3 * (n + 0.5) ** 2)
            )
            out += rest if depth else -rest
        return m.albedo_prime * out

    def reflectance(self, r_mm):
        if np.isinf(self.thickness_mm):
            m, r = self.medium, radii(r_mm)
            return m.albedo_prime * (
                pole(r, m.mfp, m.sigma_tr)
                + pole(r, m.mfp + 4 / 3 * m.mfp * top_extrapolation(self.stack, m), m.sigma_tr)
            )
        return self._sum(r_mm, 0.0)

    def transmittance(self, r_mm):
        if np.isinf(self.thickness_mm):
            return np.zeros((len(radii(r_mm)), self.medium.channels))
        return self._sum(r_mm, self.thickness_mm)

    def totals(self):
        return self.spectrum(0.0)

    def spectrum(self, k) -> tuple[np.ndarray, np.ndarray]:
        """Two-dimensional Fourier transforms of R_d and T_d at angular frequency k, 1/mm, exact:
        (..., 1) or scalar -> (..., C).

        A source's flux pole transforms to sgn(z) exp(-sqrt(sigma_tr^2 + k^2) |z|) / 2, so the sum
        over images is the one of the totals with that root in the place of sigma_tr.
        """
        m = self.medium
        root = np.sqrt(m.sigma_tr**2 + np.asarray(k, dtype=float) ** 2)
        d, half = self.thickness_mm, m.albedo_prime / 2
        z_above, _, P = self.geometry()
        if np.isinf(d):
            R = half * (np.exp(-root * m.mfp) + np.exp(-root * (m.mfp + 2 * z_above)))
            return R, np.zeros_like(R)
        R = half * (image_sum(m.mfp, root, P) - image_sum(-m.mfp - 2 * z_above, root, P))
        T = half * (image_sum(d - m.mfp, root, P) - image_sum(d + m.mfp + 2 * z_above, root, P))
        return R, T
