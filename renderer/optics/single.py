"""Light that scatters exactly once in a half-space, normal incidence: what the better dipole and
quantized diffusion leave out.

R_1(r) = int sigma_s' exp(-sigma_t' z) (1 / 4 pi) exp(-sigma_t' d) (1 - F(mu)) mu / d^2 dz, d^2 =
r^2 + z^2, mu = z / d; total (alpha' / 2) int (1 - F(mu)) mu / (1 + mu) dmu. Isotropic phase
function with reduced coefficients, so it suits g = 0 best.
"""

from __future__ import annotations

import numpy as np

from renderer.optics import fresnel
from renderer.optics.medium import Stack
from renderer.optics.model import radii

NODES = 200


def _cosines(eta: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights over mu in (critical, 1)."""
    critical = np.sqrt(max(1 - 1 / eta**2, 0.0))
    t, w = np.polynomial.legendre.leggauss(NODES)
    t, w = 0.5 * (t + 1), 0.5 * w
    return critical + (1 - critical) * t**2, w * 2 * t * (1 - critical)


def reflectance(stack: Stack, r_mm) -> np.ndarray:
    """R_1(r), 1/mm^2: (N,) -> (N, C). By mu: z = r mu / sqrt(1 - mu^2), dz = r dmu / (1 -
    mu^2)^1.5, d = r / sqrt(1 - mu^2).
    """
    m, r = stack.layers[0].medium, radii(r_mm)
    mu, w = _cosines(m.eta / stack.n_above)
    sine = np.sqrt(1 - mu**2)
    weight = w * (1 - fresnel.reflectance(mu, m.eta / stack.n_above)) * mu / sine
    depth = (1 + mu) / sine  # (z + d) / r
    out = [
        np.exp(np.maximum(-s * r * depth, -700.0)) @ weight for s in m.sigma_t_prime
    ]  # below, exp is slow and nothing
    return np.stack(out, axis=-1) * np.array(m.sigma_s_prime) / (4 * np.pi * r)


def total(stack: Stack) -> np.ndarray:
    """int R_1 2 pi r dr: (C,)."""
    m = stack.layers[0].medium
    mu, w = _cosines(m.eta / stack.n_above)
    return (
        m.albedo_prime
        / 2
        * (w * (1 - fresnel.reflectance(mu, m.eta / stack.n_above)) * mu / (1 + mu)).sum()
    )
