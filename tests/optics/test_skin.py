"""Adding and doubling against exact solutions and photons, and the spectral model of skin."""

import numpy as np
import pytest

from renderer.errors import InputError
from renderer.optics import adding, chandrasekhar, media, skin
from renderer.optics.medium import Layer, Medium, Stack

LIGHT, MEDIUM, DARK = 0.024, 0.08, 0.3  # melanin


@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99])
def test_a_half_space_sends_back_what_chandrasekhar_says(albedo):
    directions = adding.Directions.of(1.0)
    back = adding.lit(directions, adding.half_space(directions, np.array([albedo])), 1.0)
    np.testing.assert_allclose(back, chandrasekhar.diffuse_albedo(np.array([albedo])), rtol=1e-4)


def test_layers_send_back_what_photons_say():
    """Two layers below a refracting face; 0.6 %: four standard errors of the photons, or eight
    directions."""
    above, below = Medium((0.5, 3.0), (6.0, 9.0), 1.4), Medium((0.05, 0.6), (2.6, 4.6), 1.4)
    walked = media.simulated(Stack((Layer(above, 0.25), Layer(below))), 60_000).albedo
    directions = adding.Directions.of(1.4)
    r, t = adding.slab(directions, 0.25 * above.sigma_t_prime, above.albedo_prime)
    back = adding.over(r, t, adding.half_space(directions, below.albedo_prime))
    np.testing.assert_allclose(adding.lit(directions, back, 1.4), walked, rtol=6e-3)


def test_a_clear_slab_keeps_all_light():
    directions = adding.Directions.of(1.0)
    r, t = adding.slab(directions, np.array([0.3, 5.0]), 1.0)
    flux = directions.mu * directions.weight
    kept = np.einsum("i,bij->bj", flux, r + t) / flux
    np.testing.assert_allclose(kept, 1.0, atol=2e-3)


def test_white_is_white_and_the_observer_is_that_of_daylight():
    np.testing.assert_allclose(skin.weights().sum(axis=0), 1.0)
    green = np.exp(-0.5 * ((skin.WAVELENGTH_NM - 540) / 15) ** 2) @ skin.weights()
    assert green[1] > 0 and green[1] > max(green[0], green[2])


def test_the_table_is_the_model_between_its_nodes():
    rng = np.random.default_rng(3)
    melanin, blood, share = 0.3 * rng.uniform(0, 1, (3, 40)) ** 2 * [[1], [0.5], [0]]
    share = share + rng.uniform(0.3, 1.0, 40)
    layers = skin.Layers()
    expected = skin.colour(layers, melanin, blood, share)
    np.testing.assert_allclose(skin.shown(layers, melanin, blood, share), expected, rtol=0.03)


def test_melanin_darkens_and_blood_reddens():
    layers = skin.Layers()
    melanin = skin.shown(layers, np.array([0.0, LIGHT, MEDIUM, DARK]), 0.012)
    assert (np.diff(melanin, axis=0) < 0).all()
    blood = skin.shown(layers, LIGHT, np.array([0.004, 0.02, 0.06]))
    assert (np.diff(blood[:, 0] / blood[:, 1]) > 0.1).all()
    thin = skin.shown(
        layers, LIGHT, 0.08, np.array([0.3, 1.0])
    )  # lips: blood shows, less blue veil
    assert thin[0, 2] / thin[0, 0] < thin[1, 2] / thin[1, 0]


@pytest.mark.parametrize("melanin", [LIGHT, MEDIUM, DARK])
def test_the_persons_medium_has_the_albedo_that_is_shown(melanin):
    """Photons in three channels of layers against the spectrum's colour: 5 % a channel."""
    layers = skin.Layers(eumelanin=0.6)
    shown = skin.shown(layers, melanin, 0.015)
    made = skin.medium(layers, shown, melanin, 0.015)
    walked = media.curve(made, photons=20_000)
    np.testing.assert_allclose(walked.albedo, shown, rtol=0.05)
    red, green, blue = walked.mean_radius()
    assert red > green > blue > 0


def test_dark_skin_is_not_orange():
    """As much redder than green as light skin at most, within a tenth."""
    light = skin.shown(skin.Layers(), LIGHT, 0.012)
    dark = skin.shown(skin.Layers(eumelanin=0.75, epidermis_mm=0.1), 0.25, 0.016)
    assert dark[1] < 0.3 * light[1] and dark[0] / dark[1] < 2.5


def test_what_cannot_be_is_refused_in_one_line():
    with pytest.raises(InputError, match="optical depth is 0; expected more than 0"):
        adding.slab(adding.Directions.of(1.0), 0.0, 0.5)
    with pytest.raises(InputError, match=r"eta is 0.5; expected an index"):
        adding.Directions.of(0.5)
    with pytest.raises(InputError, match=r"layers.eumelanin is 2.*expected 0.0 to 1.0"):
        skin.Layers(eumelanin=2)
