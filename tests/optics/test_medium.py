"""Media: derived coefficients, presets against the published table, and what is refused."""

import math

import numpy as np
import pytest

from renderer.errors import InputError
from renderer.optics.medium import (
    MARBLE_IMAGINARY_INDEX,
    MARBLE_WAVELENGTH_NM,
    MEDIA,
    SKIN_THREE_LAYERS,
    Layer,
    Medium,
    Stack,
    preset,
    sigma_a_from_index,
)


def test_derived_coefficients():
    m = Medium((0.1, 0.2, 0.3), (0.9, 0.8, 0.7), 1.4, g=0.5)
    np.testing.assert_allclose(m.sigma_s, (1.8, 1.6, 1.4))
    np.testing.assert_allclose(m.sigma_t, (1.9, 1.8, 1.7))
    np.testing.assert_allclose(m.sigma_t_prime, 1)
    np.testing.assert_allclose(m.mfp, 1)
    np.testing.assert_allclose(m.albedo_prime, (0.9, 0.8, 0.7))
    np.testing.assert_allclose(m.albedo, m.sigma_s / m.sigma_t)
    np.testing.assert_allclose(m.sigma_tr, np.sqrt([0.3, 0.6, 0.9]))
    np.testing.assert_allclose(m.dmfp * m.sigma_tr, 1)
    assert Medium.from_sigma_s((0.1,), (2.0,), 0.9).sigma_s_prime == pytest.approx((0.2,))


def test_complex_index_gives_table_4_3():
    """Rohat table 4.3: 2.1, 4.1 and 7.1 per metre, which are marble's of table 4.1."""
    got = sigma_a_from_index(MARBLE_IMAGINARY_INDEX, MARBLE_WAVELENGTH_NM)
    np.testing.assert_allclose(got * 1000, (2.1, 4.1, 7.1), atol=0.005)
    np.testing.assert_allclose(got, MEDIA["marble"].sigma_a, atol=5e-6)


def test_every_preset_names_its_source():
    assert {
        "apple",
        "chicken1",
        "chicken2",
        "cream",
        "ketchup",
        "marble",
        "potato",
        "skimmilk",
        "skin1",
        "skin2",
        "spectralon",
        "wholemilk",
    } <= set(MEDIA)
    assert all(m.source for m in MEDIA.values())
    assert all("chosen by eye" in MEDIA[name].source for name in ("green_jade", "chocolate_milk"))
    assert not any(
        "chosen by eye" in m.source
        for name, m in MEDIA.items()
        if name not in ("green_jade", "chocolate_milk")
    )
    assert preset("Green-Jade").layers[0].medium is MEDIA["green_jade"]
    assert MEDIA["apple"].sigma_a[2] == 0.046  # Rohat table 4.1 prints 0.46


def test_skin_has_three_layers_thicker_than_a_mean_free_path():
    assert len(SKIN_THREE_LAYERS.layers) == 3 and math.isinf(SKIN_THREE_LAYERS.thickness_mm)
    for layer in SKIN_THREE_LAYERS.layers[:-1]:
        assert layer.thickness_mm > layer.medium.mfp.max()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Medium((-0.1, 0, 0), (1, 1, 1)), "sigma_a is -0.1"),
        (lambda: Medium((0.1, 0.1, math.nan), (1, 1, 1)), "sigma_a"),
        (lambda: Medium((0.1,), (math.inf,)), "sigma_s_prime"),
        (lambda: Medium((), ()), "empty"),
        (lambda: Medium(("red",), (1,)), "expected numbers"),
        (lambda: Medium((0.1, 0.2), (1,)), "as many"),
        (lambda: Medium((0.0,), (0.0,)), "scatters or absorbs"),
        (lambda: Medium((0.1,), (1,), eta=0.9), "eta is 0.9"),
        (lambda: Medium((0.1,), (1,), eta=math.nan), "eta is nan"),
        (lambda: Medium((0.1,), (1,), g=1.0), "g is 1.0"),
        (lambda: Medium((0.1,), (1,), g=math.nan), "g is nan"),
        (lambda: Medium.from_sigma_s((0.1,), (1,), -1), "g is -1"),
        (lambda: Layer(Medium((0.1,), (1,)), 0), "thickness is 0"),
        (lambda: Layer(Medium((0.1,), (1,)), math.nan), "thickness is nan"),
        (lambda: Stack(()), "no layer"),
        (lambda: Stack((Layer(MEDIA["skin1"]), Layer(MEDIA["skin2"]))), "infinitely thick"),
        (
            lambda: Stack((Layer(Medium((0.1,), (1,)), 1), Layer(MEDIA["skin2"]))),
            "number of channels",
        ),
        (lambda: Stack.of(MEDIA["skin1"], n_below=0.5), "n_below is 0.5"),
        (lambda: Stack.of(MEDIA["skin1"], roughness=1.5), "roughness is 1.5"),
        (lambda: preset("butter"), "no medium 'butter'"),
        (lambda: sigma_a_from_index(-1, 500), "imaginary index"),
        (lambda: sigma_a_from_index(1e-7, 0), "wavelength"),
    ],
)
def test_bad_input_is_one_line(make, words):
    with pytest.raises(InputError, match=words) as error:
        make()
    assert "\n" not in str(error.value) and "expected" in str(error.value)
