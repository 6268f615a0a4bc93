"""Burley's normalised diffusion: R(r) = A s (exp(-s r) + exp(-s r / 3)) / (8 pi r), s = 1 / d.

Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface scattering",
Pixar technical memo 15-04; inverse CDF in closed form: Golubev 2018, "Sampling Burley's normalized
diffusion profiles".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics.model import Profile, radii

MEAN_RADIUS = 2.5  # <r> = 2.5 d
HALLEY_STEPS = 60


def reflectance(r_mm, d_mm, albedo=1.0):
    """R(r) in 1/mm^2, singular at 0. Vuletic eqs. 2.83 and 2.84 leave out the albedo."""
    r, s = np.asarray(r_mm, dtype=float), 1 / np.asarray(d_mm, dtype=float)
    return albedo * s * (np.exp(-s * r) + np.exp(-s * r / 3)) / (8 * np.pi * r)


def cdf(r_mm, d_mm=1.0):
    """P(r), the share of the energy within r: 1 - exp(-sr)/4 - 3 exp(-sr/3)/4."""
    x = np.asarray(r_mm, dtype=float) / d_mm
    return 1 - 0.25 * np.exp(-x) - 0.75 * np.exp(-x / 3)


def inverse_cdf(u, d_mm=1.0):
    """r with P(r) = u, u in [0, 1).

    The thesis's eq. 3.12 prints both exponents as -1/3; one is +1/3.
    """
    u = 1 - np.asarray(u, dtype=float)
    g = 1 + 4 * u * (2 * u + np.sqrt(1 + 4 * u * u))
    return 3 * np.log((1 + g ** (-1 / 3) + g ** (1 / 3)) / (4 * u)) * d_mm


def inverse_cdf_halley(u, d_mm=1.0, tolerance: float = 1e-14):
    """The same r by Halley's iteration (Vuletic eq.

    3.11), the way before the closed form was known; raises if it does not converge.

    In y = exp(-x / 3), 1 - P is the polynomial (y^3 + 3 y) / 4: smooth, monotone, with one root in
    (0, 1]; so the iteration is done there, to a relative `tolerance` in y.
    """
    share = 1 - np.asarray(u, dtype=float)
    y = share.copy()
    for _ in range(HALLEY_STEPS):
        f, f1, f2 = (y**3 + 3 * y) / 4 - share, (3 * y**2 + 3) / 4, 1.5 * y
        step = 2 * f * f1 / (2 * f1**2 - f * f2)
        y = y - step
        if (np.abs(step) <= tolerance * y).all():
            return -3 * np.log(y) * d_mm
    raise ArithmeticError(f"Halley's iteration did not converge in {HALLEY_STEPS} steps")


def from_mean_radius(mean_radius_mm):
    """The scatter distance d, mm, of the Burley profile with this mean radius."""
    return np.asarray(mean_radius_mm, dtype=float) / MEAN_RADIUS


def transmittance(thickness_mm, d_mm, albedo=1.0):
    """Light through a slab by Jimenez 2010's argument: int R(sqrt(r^2 + t^2)) 2 pi r dr = A
    (exp(-st) + 3 exp(-st/3)) / 4.
    """
    return albedo * (1 - cdf(thickness_mm, d_mm))


def line_kernel(x_mm, d_mm=1.0):
    """a_p(x) = int R(sqrt(x^2 + y^2)) dy = (s / 4 pi) (K0(s |x|) + K0(s |x| / 3)), 1/mm,
    logarithmic at 0; A = 1.
    """
    from scipy.special import k0

    x = np.abs(np.asarray(x_mm, dtype=float)) / d_mm
    return (k0(x) + k0(x / 3)) / (4 * np.pi * d_mm)


def line_integral(a_mm, b_mm, d_mm=1.0):
    """int_a^b of the line kernel, exact: the integral of K0 has a closed form; a <= b, infinite
    ends allowed.
    """
    from scipy.special import iti0k0

    def primitive(x):  # odd; int_0^inf K0 = pi / 2
        z = np.abs(x)
        value = np.where(z > 600, np.pi / 2, iti0k0(np.minimum(z, 600))[1])
        return np.sign(x) * value

    a, b = np.asarray(a_mm, dtype=float) / d_mm, np.asarray(b_mm, dtype=float) / d_mm
    return (primitive(b) - primitive(a) + 3 * (primitive(b / 3) - primitive(a / 3))) / (4 * np.pi)


# The memo's three fits: A -> s for d = length / s. Vuletic eqs. 2.86, 2.88 and 2.89.
def s_searchlight_mfp(albedo):
    """Light straight down, length = mean free path: s = 1.85 - A + 7 |A - 0.8|^3."""
    return 1.85 - albedo + 7 * np.abs(albedo - 0.8) ** 3


def s_searchlight_dmfp(albedo):
    """Light straight down, length = diffuse mean free path: s = 3.5 + 100 (A - 0.33)^4."""
    return 3.5 + 100 * (albedo - 0.33) ** 4


def s_diffuse_mfp(albedo):
    """Light from everywhere, length = mean free path: s = 1.9 - A + 3.5 (A - 0.8)^2."""
    return 1.9 - albedo + 3.5 * (albedo - 0.8) ** 2


PARAMETRISATIONS = {"mfp": s_searchlight_mfp, "dmfp": s_searchlight_dmfp, "diffuse": s_diffuse_mfp}


@dataclass(frozen=True)
class Burley(Profile):
    """Burley's profile of a medium.

    parametrisation: "mfp", "dmfp" (both searchlight) or "diffuse" (diffuse transmission, mfp).

    The fits were made for a half-space of isotropic scatterers without a boundary, so the shape is
    taken from the albedo that the medium would have there (Chandrasekhar, exact), and the height
    from the albedo behind its real boundary (Saunderson). T(r) = R(sqrt(r^2 + thickness^2)), which
    is what transmittance by thickness assumes.
    """

    parametrisation: str = "mfp"

    name: ClassVar[str] = "burley"
    paper: ClassVar[str] = "Christensen and Burley 2015"
    knows_thickness: ClassVar[bool] = False

    def __post_init__(self):
        super().__post_init__()
        if self.parametrisation not in PARAMETRISATIONS:
            raise InputError(
                f"parametrisation is {self.parametrisation!r}; expected one of "
                f"{', '.join(PARAMETRISATIONS)}"
            )

    def distance_mm(self) -> np.ndarray:
        """d = length / s(A), mm: (C,)."""
        from renderer.optics import chandrasekhar
        from renderer.optics.dipole import grosjean_D

        m = self.medium
        albedo = (
            chandrasekhar.diffuse_albedo
            if self.parametrisation == "diffuse"
            else chandrasekhar.searchlight_albedo
        )(m.albedo_prime)
        if self.parametrisation == "dmfp":
            if min(m.sigma_a) == 0:
                raise InputError(
                    "sigma_a is 0: there is no diffuse mean free path; expected the "
                    "parametrisation mfp or diffuse"
                )
            length = np.sqrt(
                grosjean_D(m.sigma_a, m.sigma_s_prime) / np.array(m.sigma_a)
            )  # Vuletic eq. 2.87
        else:
            length = m.mfp
        return length / PARAMETRISATIONS[self.parametrisation](albedo)

    def albedo(self) -> np.ndarray:
        """A, the reflected share of the flux that has entered: (C,)."""
        from renderer.optics import chandrasekhar

        return chandrasekhar.surface_albedo(
            self.medium.albedo_prime, self.medium.eta / self.stack.n_above
        )

    def reflectance(self, r_mm):
        r = radii(r_mm)
        if (r == 0).any():
            raise InputError("burley is infinite at a radius of 0; expected more than 0 mm")
        return reflectance(r, self.distance_mm(), self.albedo())

    def transmittance(self, r_mm):
        if np.isinf(self.thickness_mm):
            return np.zeros((len(radii(r_mm)), self.medium.channels))
        return reflectance(
            np.hypot(radii(r_mm), self.thickness_mm), self.distance_mm(), self.albedo()
        )

    def totals(self):
        return self.albedo(), transmittance(self.thickness_mm, self.distance_mm(), self.albedo())
