"""Fresnel averages against numbers of the papers; 'recomputed' = by an independent program."""

import numpy as np
import pytest
from scipy.integrate import quad

from renderer.errors import InputError
from renderer.optics import fresnel


def test_reflectance_of_a_dielectric():
    assert (
        fresnel.reflectance(1.0, 1.5) == pytest.approx(0.04) == fresnel.normal_reflectance(1.5)
    )  # ((n-1)/(n+1))^2
    assert fresnel.reflectance(1.0, 1 / 1.5) == pytest.approx(0.04)
    assert fresnel.reflectance(np.sqrt(1 - 0.6**2), 2.0) == 1  # beyond arcsin(1/2)
    # Reciprocity: the reflectance along one refracted path is the same from both sides.
    mu = 0.9
    mu_out = np.sqrt(1 - 1.4**2 * (1 - mu**2))
    assert fresnel.reflectance(mu, 1.4) == pytest.approx(
        float(fresnel.reflectance(mu_out, 1 / 1.4)), rel=1e-12
    )
    # Brewster: at tan = 1 / eta from inside only s remains, ((1 - e^2) / (1 + e^2))^2 / 2.
    eta = 1.5
    assert fresnel.reflectance(eta / np.hypot(1, eta), eta) == pytest.approx(
        0.5 * ((1 - eta**2) / (1 + eta**2)) ** 2, rel=1e-9
    )


@pytest.mark.parametrize(
    ("eta", "exact", "fit", "c2", "c2_fit"),
    [  # recomputed
        (1.3, 0.4445, 0.4448, 0.3003, 0.2974),
        (1.4, 0.5290, 0.5296, 0.3888, 0.3863),
        (1.5, 0.5963, 0.5968, 0.4644, 0.4626),
    ],
)
def test_diffuse_reflectance_and_moments(eta, exact, fit, c2, c2_fit):
    assert fresnel.diffuse_reflectance(eta) == pytest.approx(exact, abs=6e-5)
    assert fresnel.diffuse_reflectance_fit(eta) == pytest.approx(fit, abs=6e-5)
    assert 3 * fresnel.moment(2, eta) == pytest.approx(c2, abs=6e-5)
    assert fresnel.three_c2_fit(eta) == pytest.approx(c2_fit, abs=6e-5)


@pytest.mark.parametrize("eta", [1 / 1.6, 1 / 1.3, 1.0, 1.3, 1.6])
def test_moments_by_another_quadrature(eta):
    for i in (1, 2):
        critical = [np.sqrt(1 - 1 / eta**2)] if eta > 1 else None
        slow = (
            0.0
            if eta == 1
            else quad(
                lambda mu, i=i: float(fresnel.reflectance(mu, eta)) * mu**i,
                0,
                1,
                points=critical,
                limit=400,
            )[0]
        )
        assert fresnel.moment(i, eta) == pytest.approx(slow, abs=1e-9)


@pytest.mark.parametrize("eta", [1 / 1.5, 1 / 1.4, 1 / 1.3, 1.2, 1.3, 1.4, 1.5, 1.6])
def test_polynomials_stay_near_the_integrals(eta):
    assert fresnel.two_c1_fit(eta) == pytest.approx(2 * fresnel.moment(1, eta), abs=2e-3)
    assert fresnel.three_c2_fit(eta) == pytest.approx(3 * fresnel.moment(2, eta), abs=4e-3)
    assert fresnel.diffuse_reflectance_fit(eta) == pytest.approx(
        2 * fresnel.moment(1, eta), abs=4e-3
    )


@pytest.mark.parametrize(("eta", "A"), [(1.0, 1.0), (1.3, 2.603), (1.4, 3.251), (1.5, 3.960)])
def test_extrapolation_is_not_its_reciprocal(eta, A):
    """recomputed Rohat sec. 4.2.2 prints (1 - F_dr) / (1 + F_dr): 0.384 for 1.3."""
    assert fresnel.extrapolation(eta) == pytest.approx(A, abs=6e-4)


@pytest.mark.parametrize("eta", [0.2, 0.4, 0.5, 0.99, 1.01, 2.2, 2.5, 4.0])
def test_no_polynomial_is_used_where_it_runs_away(eta):
    """At 3, the one of 3 C_2 is off by 0.2 and the better dipole's total would be 817."""
    np.testing.assert_allclose(
        fresnel.exit_moments(eta),
        (2 * fresnel.moment(1, eta), 3 * fresnel.moment(2, eta)),
        atol=7e-3,
    )
    f = fresnel.diffuse_reflectance(eta)
    assert fresnel.extrapolation(eta) == pytest.approx((1 + f) / (1 - f), rel=0.012)


def test_rough_face_tends_to_the_smooth_one():
    smooth = fresnel.diffuse_reflectance(1.4)
    values = [fresnel.rough_diffuse_reflectance(1.4, m) for m in (0.01, 0.1, 0.3)]
    assert values[0] == pytest.approx(smooth, abs=1e-3)
    assert smooth > values[0] > values[1] > values[2] > 0.3
    assert fresnel.rough_diffuse_reflectance(1.4, 0) == smooth
    assert all(
        0 < fresnel.rough_directional_reflectance(mu, 1.4, 0.3) <= 1 for mu in (0.05, 0.4, 0.99)
    )


def test_rough_reflectance_is_the_integral_of_the_brdf():
    """rho(mu_o) in strata of the Beckmann density against f_r (n .

    w_i) summed over directions on a fine grid.
    """
    eta, m, mu_o = 1.4, 0.3, 0.6
    n = 700
    mu_i, phi = (np.arange(n) + 0.5) / n, np.pi * (np.arange(n) + 0.5) / n
    mu_i, phi = mu_i[:, None], phi[None, :]
    sin_i, sin_o = np.sqrt(1 - mu_i**2), np.sqrt(1 - mu_o**2)
    length = np.sqrt(
        (sin_i * np.cos(phi) + sin_o) ** 2 + (sin_i * np.sin(phi)) ** 2 + (mu_i + mu_o) ** 2
    )
    mu_h = (mu_i + mu_o) / length
    o_h = (sin_o * (sin_i * np.cos(phi) + sin_o) + mu_o * (mu_i + mu_o)) / length
    D = np.exp(-(1 - mu_h**2) / (mu_h * m) ** 2) / (
        np.pi * m**2 * mu_h**4
    )  # with the 1 / pi that GPU Gems notes eq. 15 lacks
    G = np.minimum(1, 2 * mu_h * np.minimum(mu_i, mu_o) / o_h)
    brdf = D * fresnel.reflectance(o_h, eta) * G / (4 * mu_i * mu_o)
    assert fresnel.rough_directional_reflectance(mu_o, eta, m) == pytest.approx(
        2 * np.pi * (brdf * mu_i).mean(), rel=5e-3
    )


def test_rough_face_returns_no_more_than_it_gets():
    """F = 1: what V-cavities keep of the light is lost, never gained."""
    values = [
        fresnel.rough_directional_reflectance(mu, 1e6, m)
        for m in (0.1, 0.3, 0.5)
        for mu in (0.1, 0.4, 0.7, 1.0)
    ]
    assert all(0.6 < value <= 1 for value in values)


@pytest.mark.parametrize("eta", [0, -1.3, np.nan, np.inf])
def test_bad_index(eta):
    with pytest.raises(InputError):
        fresnel.moment(1, eta)
