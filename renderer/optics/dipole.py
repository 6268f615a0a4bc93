"""Dipoles over a half-space: Jensen et al. 2001 and d'Eon 2012.

Jensen, Marschner, Levoy, Hanrahan 2001, doi:10.1145/383259.383319. d'Eon 2012, "A better dipole"
(technical report); Vuletic eq. 2.59, Rohat sec. 3.4.1, BSSRDF notes. The better dipole leaves out
single scattering (see single.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.optics import fresnel
from renderer.optics.model import Profile, radii


def pole(r: np.ndarray, z: np.ndarray, sigma_tr: np.ndarray) -> np.ndarray:
    """Flux density of a source of unit strength at depth z through the plane z = 0, odd in z: z (1
    + sigma_tr d) exp(-sigma_tr d) / (4 pi d^3), d^2 = r^2 + z^2. Its integral over the plane is
    sgn(z) exp(-sigma_tr |z|) / 2.
    """
    d = np.sqrt(r**2 + z**2)
    return z * (1 + sigma_tr * d) * np.exp(-sigma_tr * d) / (4 * np.pi * d**3)


def top_extrapolation(stack, medium) -> float:
    """A of the lit face, from the reflectance of a smooth or rough boundary."""
    eta = medium.eta / stack.n_above
    if stack.roughness:
        rho = fresnel.rough_diffuse_reflectance(eta, stack.roughness)
        return (1 + rho) / (1 - rho)
    return fresnel.extrapolation(eta)


@dataclass(frozen=True)
class Dipole(Profile):
    """Jensen 2001: D = 1 / (3 sigma_t'), z_r = 1 / sigma_t', z_v = z_r + 4 A D."""

    name: ClassVar[str] = "dipole"
    paper: ClassVar[str] = "Jensen et al. 2001"
    knows_roughness: ClassVar[bool] = True
    knows_thickness: ClassVar[bool] = False

    def reflectance(self, r_mm):
        m, r = self.medium, radii(r_mm)
        z_r = m.mfp
        z_v = z_r * (1 + 4 * top_extrapolation(self.stack, m) / 3)
        return m.albedo_prime * (pole(r, z_r, m.sigma_tr) + pole(r, z_v, m.sigma_tr))

    def totals(self):
        m = self.medium
        q = np.sqrt(3 * (1 - m.albedo_prime))
        return m.albedo_prime / 2 * (
            1 + np.exp(-4 / 3 * top_extrapolation(self.stack, m) * q)
        ) * np.exp(-q), None


def grosjean_D(sigma_a, sigma_s_prime) -> np.ndarray:
    """D = (2 sigma_a + sigma_s') / (3 (sigma_a + sigma_s')^2), mm (Grosjean 1956; d'Eon and Irving
    2011).
    """
    sigma_a, sigma_s_prime = (
        np.asarray(sigma_a, dtype=float),
        np.asarray(sigma_s_prime, dtype=float),
    )
    return (2 * sigma_a + sigma_s_prime) / (3 * (sigma_a + sigma_s_prime) ** 2)


@dataclass(frozen=True)
class BetterDipole(Profile):
    """d'Eon 2012: Grosjean's D, A = (1 + 3 C_2) / (1 - 2 C_1), exitance C_phi phi + C_E (-D grad
    phi), strength alpha'^2.
    """

    name: ClassVar[str] = "better_dipole"
    paper: ClassVar[str] = "d'Eon 2012"
    knows_thickness: ClassVar[bool] = False

    def reflectance(self, r_mm):
        m, r = self.medium, radii(r_mm)
        eta = m.eta / self.stack.n_above
        D = grosjean_D(m.sigma_a, m.sigma_s_prime)
        sigma_tr = np.sqrt(np.array(m.sigma_a) / D)
        c_phi, c_e = fresnel.exit_weights(eta)
        z_r = m.mfp
        z_v = -z_r - 4 * fresnel.better_extrapolation(eta) * D
        fluence = lambda z: (
            np.exp(-sigma_tr * np.sqrt(r**2 + z**2)) / (4 * np.pi * D * np.sqrt(r**2 + z**2))
        )
        return m.albedo_prime**2 * (
            c_e * (pole(r, z_r, sigma_tr) - pole(r, z_v, sigma_tr))
            + c_phi * (fluence(z_r) - fluence(z_v))
        )

    def totals(self):
        a, eta = self.medium.albedo_prime, self.medium.eta / self.stack.n_above
        A = fresnel.better_extrapolation(eta)
        c_phi, c_e = fresnel.exit_weights(eta)
        kappa = np.sqrt((1 - a) * (2 - a) / 3)  # sigma_tr D
        with np.errstate(invalid="ignore"):
            lost = np.where(
                kappa > 0, -np.expm1(-4 * A * kappa) / np.where(kappa > 0, kappa, 1), 4 * A
            )
        # an independent recomputation: alpha'^2 / 2 exp(-sqrt(3 (1-a) / (2-a))) [C_E (1 + exp(-4 A
        # k)) + C_phi / k (1 - exp(-4 A k))]
        return a**2 / 2 * np.exp(-np.sqrt(3 * (1 - a) / (2 - a))) * (
            c_e * (1 + np.exp(-4 * A * kappa)) + c_phi * lost
        ), None
