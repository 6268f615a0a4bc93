"""Tables of what a rough face sends back, against published integrals and direct quadrature."""

import numpy as np
import pytest

from renderer.optics import surface

COSINES = np.array([1.0, 0.7, 0.4, 0.1])


@pytest.mark.parametrize(
    ("roughness", "white"),
    [(0.3, (0.91, 0.863, 0.797, 0.806)), (0.5, (0.755, 0.716, 0.712, 0.813))],
)
def test_a_white_face_sends_back_what_independent_integrals_give(roughness, white):
    """F = 1: the two parts together; never more than all."""
    reflected = surface.specular_albedo(COSINES, [roughness]).sum(axis=2)[:, 0]
    np.testing.assert_allclose(reflected, white, atol=2e-3)
    assert reflected.max() <= 1


def test_skin_sends_back_little_until_it_is_grazed():
    reflected = surface.specular_albedo(COSINES, [0.3])[:, 0] @ [0.028, 1.0]
    np.testing.assert_allclose(reflected, [0.0255, 0.0289, 0.0672, 0.2428], atol=2e-4)


def test_the_table_agrees_with_a_quadrature_of_the_shader_s_own_formula():
    """Kelemen's model over a grid of directions of light, as passes/skin.frag evaluates it."""
    mu, m, f0 = 0.6, 0.4, 0.05
    n_l = ((np.arange(400) + 0.5) / 400)[:, None]
    phi = (2 * np.pi * (np.arange(400) + 0.5) / 400)[None, :]
    sin_v, sin_l = np.sqrt(1 - mu**2), np.sqrt(1 - n_l**2)
    h = np.stack([sin_v + sin_l * np.cos(phi), sin_l * np.sin(phi), mu + n_l + 0 * phi])
    hh = (h**2).sum(axis=0)
    c2 = h[2] ** 2 / hh
    d = np.exp((c2 - 1) / (m**2 * c2)) / (np.pi * m**2 * c2**2)
    v_h = (h[0] * sin_v + h[2] * mu) / np.sqrt(hh)
    value = d * (f0 + (1 - f0) * (1 - v_h) ** 5) / hh * n_l
    total = value.sum() * (1 / 400) * (2 * np.pi / 400)
    assert surface.specular_albedo([mu], [m])[0, 0] @ [f0, 1] == pytest.approx(total, rel=4e-3)


def test_disney_is_lambert_from_above_and_darker_or_brighter_at_the_rim():
    """Straight down the factor is 1; at the rim F90 = 0.5 + 2 roughness when seen from the lamp."""
    assert surface.disney(1.0, 1.0, 1.0, 0.4) == 1
    assert surface.disney(0.0, 0.0, 1.0, 0.4) == pytest.approx((0.5 + 0.8) ** 2)
    even = surface.disney_albedo([0.1], [0.1, 0.9])[0]
    assert even[0] < 0.8 and even[1] > 1.2
