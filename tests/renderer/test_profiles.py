"""Profiles against numbers computed elsewhere; the source of each stands beside it."""

import numpy as np
import pytest
from scipy.integrate import quad

from renderer.optics import burley, gaussians


def test_six_gaussians_hold_all_energy():
    np.testing.assert_allclose(gaussians.SKIN_WEIGHTS.sum(axis=0), 1, atol=1e-12)
    for channel in range(3):
        total = quad(
            lambda r, c=channel: 2 * np.pi * r * gaussians.reflectance(np.array([r]))[0, c],
            0,
            40,
            limit=400,
            points=[0.1, 1, 5],
        )[0]
        assert total == pytest.approx(1, abs=1e-6)


def test_line_integral_is_the_integral_of_the_profile_across():
    x = 0.7
    across = quad(
        lambda y: gaussians.reflectance(np.array([np.hypot(x, y)]))[0, 0],
        -40,
        40,
        limit=800,
        points=[0],
    )[0]
    step = 1e-4
    got = gaussians.line_integral(np.array([x - step]), np.array([x + step]))[0, 0] / (2 * step)
    assert got == pytest.approx(across, rel=1e-5)


# an independent recomputation, recomputed there from the six Gaussians: published form and exact
# form.
@pytest.mark.parametrize(
    "thickness, published, exact",
    [
        (0.5, (0.4954, 0.0620, 0.0065), (0.5716, 0.1362, 0.0316)),
        (1.0, (0.3047, 0.0046, 0.0012), (0.4063, 0.0197, 0.0029)),
        (2.0, (0.0935, 0.0005, 0.0000), (0.1939, 0.0017, 0.0002)),
    ],
)
def test_transmittance_of_a_slab(thickness, published, exact):
    d = np.array([thickness])
    np.testing.assert_allclose(gaussians.transmittance(d, published=True)[0], published, atol=6e-5)
    np.testing.assert_allclose(gaussians.transmittance(d)[0], exact, atol=6e-5)


def test_exact_transmittance_is_the_integral_over_the_far_face():
    d = 0.8
    total = quad(
        lambda r: 2 * np.pi * r * gaussians.reflectance(np.array([np.hypot(r, d)]))[0, 0],
        0,
        40,
        limit=400,
    )[0]
    assert gaussians.transmittance(np.array([d]))[0, 0] == pytest.approx(total, rel=1e-8)
    assert (np.diff(gaussians.transmittance(np.linspace(0, 5, 50)), axis=0) <= 0).all()
    np.testing.assert_allclose(gaussians.transmittance(np.array([0.0]))[0], 1)


def test_burley_inverse_round_trip():
    u = np.linspace(0, 1, 4001)[:-1]
    np.testing.assert_allclose(burley.cdf(burley.inverse_cdf(u, 0.3), 0.3), u, atol=1e-12)


# Radii in units of d, computed for the closed form and checked against Unity's and Cycles'
# cut-offs.
@pytest.mark.parametrize(
    "u, x", [(0.5, 1.55218), (0.9, 6.06223), (0.99, 12.95264), (0.997, 16.5644), (0.99637901, 16.0)]
)
def test_burley_inverse_at_known_points(u, x):
    assert burley.inverse_cdf(u) == pytest.approx(x, abs=2e-4)


def test_burley_mean_radius_and_total():
    mean = quad(lambda r: 2 * np.pi * r * r * burley.reflectance(r, 0.4), 0, 40, limit=400)[0]
    assert mean == pytest.approx(burley.MEAN_RADIUS * 0.4, rel=1e-6)
    assert quad(lambda r: 2 * np.pi * r * burley.reflectance(r, 0.4, 0.7), 1e-12, 40, limit=400)[
        0
    ] == pytest.approx(0.7, rel=1e-6)


def test_both_profiles_are_the_same_skin():
    np.testing.assert_allclose(
        burley.from_mean_radius(gaussians.mean_radius()) * burley.MEAN_RADIUS,
        gaussians.mean_radius(),
    )
