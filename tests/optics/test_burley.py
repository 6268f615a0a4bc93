"""Burley's profile: three parametrisations, two inversions, kernels along a line, and the Monte
Carlo of its own setting.
"""

import numpy as np
import pytest
from scipy.integrate import quad

from renderer.errors import InputError
from renderer.optics import burley, burley_reference, chandrasekhar
from renderer.optics.medium import MEDIA, Medium, Stack, preset


def test_both_inversions_agree_with_the_cdf():
    u = np.linspace(0, 1, 4001)[:-1]
    for inverse in (burley.inverse_cdf, burley.inverse_cdf_halley):
        np.testing.assert_allclose(burley.cdf(inverse(u, 0.7), 0.7), u, atol=1e-12)
    np.testing.assert_allclose(burley.inverse_cdf_halley(u), burley.inverse_cdf(u), atol=1e-12)


def test_the_printed_inverse_is_wrong():
    """Vuletic eq. 3.12 with both exponents -1/3 gives negative radii."""
    u = 1 - 0.1
    g = 1 + 4 * u * (2 * u + np.sqrt(1 + 4 * u * u))
    assert 3 * np.log((1 + 2 * g ** (-1 / 3)) / (4 * u)) < 0 < burley.inverse_cdf(0.1)


def test_cdf_is_the_integral_of_the_profile():
    for r in (0.1, 1.0, 6.0):
        assert burley.cdf(r, 0.8) == pytest.approx(
            quad(lambda x: 2 * np.pi * x * burley.reflectance(x, 0.8), 0, r)[0], abs=1e-12
        )


@pytest.mark.parametrize(
    ("fit", "at_02", "at_08"),
    [  # the formulas of Vuletic by hand
        (burley.s_searchlight_mfp, 1.85 - 0.2 + 7 * 0.216, 1.05),
        (burley.s_searchlight_dmfp, 3.5 + 100 * 0.13**4, 3.5 + 100 * 0.47**4),
        (burley.s_diffuse_mfp, 1.9 - 0.2 + 3.5 * 0.36, 1.1),
    ],
)
def test_fits(fit, at_02, at_08):
    assert fit(0.2) == pytest.approx(at_02) and fit(0.8) == pytest.approx(at_08)


def test_kernel_along_a_line():
    assert burley.line_kernel(1.0) == pytest.approx(0.1350914, abs=1e-7)  # recomputed
    across = quad(
        lambda y: burley.reflectance(np.hypot(0.4, y), 0.6), -60, 60, points=[0], limit=400
    )[0]
    assert burley.line_kernel(0.4, 0.6) == pytest.approx(across, rel=1e-8)
    assert burley.line_integral(-np.inf, np.inf, 0.6) == pytest.approx(1, abs=1e-12)
    assert burley.line_integral(0.2, 0.9, 0.6) == pytest.approx(
        quad(lambda x: burley.line_kernel(x, 0.6), 0.2, 0.9)[0], rel=1e-9
    )
    assert burley.line_integral(-0.1, 0.1) == pytest.approx(
        2 * quad(burley.line_kernel, 0, 0.1)[0], rel=1e-7
    )


def test_transmittance_of_a_slab():
    assert burley.transmittance(1.0, 1.0) == pytest.approx(0.6293683, abs=1e-7)  # recomputed
    through = quad(
        lambda r: 2 * np.pi * r * burley.reflectance(np.hypot(r, 0.5), 0.7), 0, 80, limit=400
    )[0]
    assert burley.transmittance(0.5, 0.7) == pytest.approx(through, rel=1e-8)


def test_albedo_is_part_of_the_profile():
    """Vuletic eqs. 2.83 and 2.84 lose it: as printed, the integral is 1 whatever the albedo."""
    assert quad(lambda r: 2 * np.pi * r * burley.reflectance(r, 0.3, 0.42), 0, 30, limit=200)[
        0
    ] == pytest.approx(0.42, rel=1e-6)


def test_parametrisations_of_a_medium():
    stack = Stack.of(Medium((0.1,), (0.9,), 1.0))
    A = chandrasekhar.searchlight_albedo(0.9)
    mfp, dmfp, diffuse = (
        burley.Burley(stack, p).distance_mm()[0] for p in ("mfp", "dmfp", "diffuse")
    )
    assert mfp == pytest.approx(1 / burley.s_searchlight_mfp(A))
    assert dmfp == pytest.approx(mfp, rel=0.1) and diffuse == pytest.approx(
        mfp, rel=0.15
    )  # three ways to one profile
    with pytest.raises(InputError, match="diffuse mean free path"):
        burley.Burley(preset("spectralon"), "dmfp").distance_mm()
    with pytest.raises(InputError, match="parametrisation"):
        burley.Burley(preset("skin1"), "mean")
    with pytest.raises(InputError, match="radius of 0"):
        burley.Burley(preset("skin1")).reflectance([0.0])
    slab = burley.Burley(Stack.of(MEDIA["skin1"], 0.4))
    assert (slab.totals()[1] < slab.totals()[0]).all() and slab.transmittance([0.0]).shape == (1, 3)


PHOTONS = 40_000


@pytest.mark.parametrize("diffuse", [False, True])
def test_walk_has_exact_totals(diffuse):
    """Against Chandrasekhar's H function, which no photon has seen; four standard errors."""
    table = burley_reference.walk(PHOTONS, 3, diffuse)
    for A in (0.05, 0.3, 0.6, 0.9, 0.98):
        total, error = table.total(chandrasekhar.albedo_of(A, diffuse))
        assert abs(total - A) < 4 * error and error < 0.01


def test_walk_is_reproducible():
    table = burley_reference.walk(PHOTONS, 3, False)
    burley_reference.walk.cache_clear()
    np.testing.assert_array_equal(burley_reference.walk(PHOTONS, 3, False).counts, table.counts)
    with pytest.raises(InputError, match="photons"):
        burley_reference.walk(0)


@pytest.mark.parametrize(
    ("parametrisation", "published"), [("mfp", 5.5), ("dmfp", 7.7), ("diffuse", 3.9)]
)
def test_fits_are_as_near_as_published(parametrisation, published):
    """Where a small run knows the curve: albedo 0.35 to 0.9, bins to 12 %. `subdermal redraw` has
    all albedos with many photons.
    """
    judged = burley_reference.judge(
        parametrisation, PHOTONS, 3, np.array([0.35, 0.5, 0.65, 0.8, 0.9]), known=0.12
    )
    assert 100 * judged.error_fit.mean() == pytest.approx(published, abs=3)
    assert (judged.error_best <= judged.error_fit + 1e-9).all()
    np.testing.assert_allclose(judged.s_best, judged.s_fit, rtol=0.2)
