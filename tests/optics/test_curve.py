"""Reference curves: rings against formulas, media as scenes name them, fits, inversion."""

import numpy as np
import pytest
from scipy.special import erf

from renderer.errors import InputError
from renderer.optics import curve as curves
from renderer.optics import fits, gaussians, media
from renderer.optics.burley import cdf, line_integral
from renderer.optics.medium import STACKS, Medium, Stack

SKIN = media.curve("deon_luebke")
MARBLE = media.curve("marble", photons=20_000)


def test_rings_answer_as_the_gaussians_they_stand_for():
    """Edge, stripes, mean radius and share within a radius have closed forms for Gaussians."""
    x = np.linspace(-6, 6, 101)
    scale = np.sqrt(2 * gaussians.SKIN_VARIANCE_MM2)
    edge = 0.5 * (1 - erf(x[:, None] / scale)) @ gaussians.SKIN_WEIGHTS
    np.testing.assert_allclose(SKIN.edge(x), edge, atol=2e-4)
    k = 2 * np.pi / np.array([0.5, 2.0, 8.0])
    wave = np.exp(-np.outer(k**2, gaussians.SKIN_VARIANCE_MM2) / 2) @ gaussians.SKIN_WEIGHTS
    np.testing.assert_allclose(SKIN.stripes(2 * np.pi / k), wave, atol=1e-3)
    np.testing.assert_allclose(SKIN.mean_radius(), gaussians.mean_radius(), rtol=2e-3)
    np.testing.assert_allclose(SKIN.transmittance([1.0]), gaussians.transmittance([1.0]), atol=5e-3)


def test_widths_are_those_that_independent_scripts_measured():
    """10 to 90 % of a straight edge, mm (measured.md): the six Gaussians 2.46 / 0.51 / 0.32."""
    np.testing.assert_allclose(SKIN.width(), [2.46, 0.51, 0.32], atol=0.01)


def test_monte_carlo_agrees_with_the_profile_it_was_made_for():
    """Burley's curve as rings: its own line integral comes back."""
    tabulated = curves.from_cdf("burley", lambda r: cdf(np.asarray(r))[:, None], 60.0, 1e-3)
    x = np.linspace(0.05, 8, 40)
    expected = line_integral(x, np.full_like(x, np.inf), 1.0)
    np.testing.assert_allclose(tabulated.edge(x)[:, 0], expected, atol=3e-4)


def test_simulated_marble_has_its_albedo_and_its_noise_is_known():
    """R_d of marble under diffuse light by the dipole is 0.83, 0.79, 0.75 within 5 %."""
    np.testing.assert_allclose(MARBLE.albedo, [0.83, 0.79, 0.75], rtol=0.05)
    assert (MARBLE.noise > 0).all() and MARBLE.noise.max() < 0.01
    again = media.simulated(media.read("marble"), photons=20_000)
    np.testing.assert_array_equal(again.weights, MARBLE.weights)


def test_a_medium_scaled_in_length_has_a_curve_scaled_in_length():
    base = Stack.of(Medium((0.1,), (0.9,), eta=1.0))
    wide = Stack.of(Medium((0.05,), (0.45,), eta=1.0))
    one, two = (media.simulated(stack, photons=20_000) for stack in (base, wide))
    x = np.linspace(-4, 4, 21)
    np.testing.assert_allclose(one.edge(x), two.edge(2 * x), atol=0.01)


def test_fits_find_their_own_family_again():
    """Six Gaussians from the six Gaussians, Burley's distance from Burley's curve."""
    six = fits.gaussian_sum(SKIN, 6)
    assert six.error.max() < 1e-4
    np.testing.assert_allclose(six.weights.sum(axis=0), 1)
    own = curves.from_cdf(
        "burley", lambda r: cdf(np.asarray(r), 0.7)[:, None], 40.0, 1e-3, albedo=np.array([0.5])
    )
    fit = fits.burley_distance(own)
    assert fit.distance_mm[0] == pytest.approx(0.7, rel=2e-3) and fit.error[0] < 1e-3


def test_more_gaussians_fit_better():
    errors = [fits.gaussian_sum(MARBLE, terms).error.max() for terms in (2, 4, 6)]
    assert errors[0] > errors[1] > 0.8 * errors[2] and errors[2] < 0.01


def test_inversion_finds_a_medium_again_and_says_what_it_leaves():
    """An index-matched medium comes back; the six Gaussians are no medium's, and keep a rest."""
    true = Medium((0.1, 0.2, 0.4), (1.0, 1.0, 1.0), eta=1.0)
    back = media.invert(media.simulated(Stack.of(true), photons=40_000), photons=40_000)
    np.testing.assert_allclose(back.medium.sigma_t_prime, true.sigma_t_prime, rtol=0.08)
    np.testing.assert_allclose(back.medium.albedo_prime, true.albedo_prime, rtol=0.03)
    skin = media.invert(SKIN, photons=40_000)
    assert skin.residual.max() > 2 * back.residual.max()


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("marbel", "medium is 'marbel'; expected one of skin, deon_luebke, apple"),
        ({}, "medium has nothing; expected sigma_a and sigma_s_prime"),
        ({"sigma_a": [1, 1, 1]}, "expected sigma_a and sigma_s_prime"),
        ({"sigma_a": [1], "sigma_s_prime": [1], "etta": 1}, "medium.etta is unknown; did you mean"),
        ({"gaussians": {"variance_mm2": [1], "weights": [1]}}, "expected variance_mm2 (K,) above"),
        (7, "medium is 7; expected a preset's name or a table"),
    ],
)
def test_media_at_fault_are_named(value, message):
    with pytest.raises(InputError) as caught:
        media.read(value)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_media_by_coefficients_index_and_layers():
    stack = media.read({"sigma_a": [0.1] * 3, "sigma_s": [10.0] * 3, "g": 0.9, "eta": 1.4})
    np.testing.assert_allclose(stack.layers[0].medium.sigma_s_prime, 1.0)
    marble = media.read({"imaginary_index": [1e-7] * 3, "sigma_s_prime": [2.0] * 3})
    assert marble.layers[0].medium.sigma_a[0] == pytest.approx(4 * np.pi * 1e-7 / 700e-6)
    layered = media.read(
        {"layers": [{"medium": "epidermis", "thickness_mm": 0.2}, {"medium": "upper_dermis"}]}
    )
    assert layered.layers[0].medium == STACKS["epidermis"].layers[0].medium
    assert np.isinf(layered.thickness_mm)
