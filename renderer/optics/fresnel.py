"""Fresnel reflection of a smooth or rough dielectric and its averages over directions.

eta is the index on the side that light comes from over the index on the other: eta > 1 seen from
inside a denser medium (with total internal reflection), eta < 1 seen from outside. mu is the cosine
of the angle of incidence, 0 to 1.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from renderer.errors import InputError

NODES = 200
FIT_RANGE = (
    0.5,
    2.2,
)  # relative indices within which each polynomial is right to 0.007; outside they run away


def _check(eta: float) -> float:
    if not np.isfinite(eta) or eta <= 0:
        raise InputError(f"relative index is {eta}; expected more than 0")
    return float(eta)


def reflectance(mu, eta: float) -> np.ndarray:
    """Exact unpolarised reflectance F(mu) of a dielectric, 1 beyond the critical angle; shape of
    mu.
    """
    mu = np.clip(np.asarray(mu, dtype=float), 0, 1)
    sin2_t = _check(eta) ** 2 * (1 - mu**2)
    mu_t = np.sqrt(np.maximum(1 - sin2_t, 0))
    with np.errstate(invalid="ignore", divide="ignore"):
        s = (eta * mu - mu_t) / (eta * mu + mu_t)
        p = (mu - eta * mu_t) / (mu + eta * mu_t)
        return np.where(sin2_t >= 1, 1.0, np.where(mu == 0, 1.0, 0.5 * (s**2 + p**2)))


def normal_reflectance(eta: float) -> float:
    """F(1) = ((eta - 1) / (eta + 1))^2."""
    return ((_check(eta) - 1) / (eta + 1)) ** 2


@lru_cache(maxsize=256)
def moment(i: int, eta: float) -> float:
    """C_i = int_0^1 F(mu) mu^i dmu by quadrature (d'Eon and Irving 2011); F_dr = 2 C_1."""
    if _check(eta) == 1:
        return 0.0
    critical = np.sqrt(max(1 - 1 / eta**2, 0.0))
    t, w = np.polynomial.legendre.leggauss(NODES)
    t, w = 0.5 * (t + 1), 0.5 * w
    mu = critical + (1 - critical) * t**2  # F has a square root at the critical angle
    return float(
        critical ** (i + 1) / (i + 1)
        + (w * reflectance(mu, eta) * mu**i * 2 * t * (1 - critical)).sum()
    )


def diffuse_reflectance(eta: float) -> float:
    """F_dr = (1/pi) int F (n . w) dw = 2 int F mu dmu, exact. Rohat sec. 3.4.1 loses the 1/pi."""
    return 2 * moment(1, eta)


def diffuse_reflectance_fit(eta: float) -> float:
    """F_dr by Egan and Hilgeman 1979, as Jensen et al. 2001 print it; 0 where the indices match."""
    if _check(eta) == 1:
        return 0.0
    if eta > 1:
        return -1.4399 / eta**2 + 0.7099 / eta + 0.6681 + 0.0636 * eta
    return -0.4399 + 0.7099 / eta - 0.3319 / eta**2 + 0.0636 / eta**3


def two_c1_fit(eta: float) -> float:
    """2 C_1 by d'Eon and Irving 2011; 0 where the indices match."""
    if _check(eta) == 1:
        return 0.0
    if eta < 1:
        return float(np.polyval([-1.36881, 4.98554, -7.80989, 6.75335, -3.4793, 0.919317], eta))
    return float(np.polyval([0.254913, -2.54396, 10.2291, -20.9292, 22.2272, -9.23372], eta))


def three_c2_fit(eta: float) -> float:
    """3 C_2 by d'Eon and Irving 2011 (not printed in BSSRDF notes); 0 where the indices match."""
    if _check(eta) == 1:
        return 0.0
    if eta < 1:
        return float(np.polyval([0.145787, 0.236494, -1.95284, 3.36231, -2.62051, 0.828421], eta))
    return float(
        np.polyval(
            [1.91826, -27.0181, 164.798, -568.556, 1213.67, -1641.1, 1376.53, -656.175, 135.926],
            eta,
        )
        / eta**3
    )


def extrapolation(eta: float, fit: bool = True) -> float:
    """A = (1 + F_dr) / (1 - F_dr) of the classic boundary, by the polynomial where it holds.

    Rohat sec. 4.2.2 prints its reciprocal.
    """
    f = (
        diffuse_reflectance_fit(eta)
        if fit and FIT_RANGE[0] <= eta <= FIT_RANGE[1]
        else diffuse_reflectance(eta)
    )
    return (1 + f) / (1 - f)


def better_extrapolation(eta: float, fit: bool = True) -> float:
    """A = (1 + 3 C_2) / (1 - 2 C_1), d'Eon and Irving 2011."""
    c1, c2 = exit_moments(eta, fit)
    return (1 + c2) / (1 - c1)


def exit_moments(eta: float, fit: bool = True) -> tuple[float, float]:
    """(2 C_1, 3 C_2) by the polynomials where they hold, or exactly."""
    return (
        (two_c1_fit(eta), three_c2_fit(eta))
        if fit and FIT_RANGE[0] <= eta <= FIT_RANGE[1]
        else (2 * moment(1, eta), 3 * moment(2, eta))
    )


def exit_weights(eta: float, fit: bool = True) -> tuple[float, float]:
    """(C_phi, C_E) = ((1 - 2 C_1) / 4, (1 - 3 C_2) / 2); BSSRDF notes prints them without the 1/4
    and 1/2.
    """
    c1, c2 = exit_moments(eta, fit)
    return (1 - c1) / 4, (1 - c2) / 2


@lru_cache(maxsize=64)
def rough_directional_reflectance(mu_o: float, eta: float, roughness: float) -> float:
    """rho(mu_o) = int f_r (n . w_i) dw_i of Cook and Torrance's BRDF with Beckmann slopes, on the
    side that eta says.

    f_r = D F G / (4 (n.i)(n.o)), V-cavity G; the integral is over half vectors, drawn in strata of
    the Beckmann density D (n.h), so that D and 1/(4 (o.h)) cancel.
    """
    if not 0 < roughness <= 1:
        raise InputError(f"roughness is {roughness}; expected a Beckmann slope in (0, 1]")
    n_u, n_phi = 128, 128
    u = (np.arange(n_u) + 0.5) / n_u
    phi = np.pi * (np.arange(n_phi) + 0.5) / n_phi
    mu_h = (1 / np.sqrt(1 - roughness**2 * np.log(u)))[:, None]
    sin_h = np.sqrt(1 - mu_h**2)
    sin_o = np.sqrt(1 - mu_o**2)
    o_h = mu_o * mu_h + sin_o * sin_h * np.cos(phi)
    mu_i = 2 * o_h * mu_h - mu_o
    seen = (o_h > 0) & (mu_i > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        g = np.minimum(1, 2 * mu_h * np.minimum(mu_o, mu_i) / o_h)
        value = reflectance(o_h, eta) * g * o_h / (mu_o * mu_h)
    return float(np.where(seen, value, 0).mean())


@lru_cache(maxsize=64)
def rough_diffuse_reflectance(eta: float, roughness: float) -> float:
    """rho_d = 2 int rho(mu) mu dmu, which takes the place of F_dr at a rough face (Donner and
    Jensen 2005, sec. 5).
    """
    if roughness == 0:
        return diffuse_reflectance(eta)
    t, w = np.polynomial.legendre.leggauss(24)
    critical = np.sqrt(max(1 - 1 / eta**2, 0.0))  # where F of a smooth face jumps in slope
    total = 0.0
    for low, high in ((0.0, critical), (critical, 1.0)):
        for mu, weight in zip(low + (high - low) * 0.5 * (t + 1), w * (high - low), strict=True):
            total += (
                weight * mu * rough_directional_reflectance(float(mu), float(eta), float(roughness))
            )
    return float(total)
