"""What thin parts let through, by Monte Carlo and by what is taken in its place."""

import numpy as np
import pytest
from scipy.special import expn

from renderer.errors import InputError
from renderer.optics import media
from renderer.optics import transmittance as tr
from renderer.optics.medium import SKIN_THREE_LAYERS, Medium, Stack
from renderer.reference.estimate import walked


def test_of_a_medium_that_only_absorbs_it_is_twice_the_third_exponential_integral():
    """Cosine light: T(d) = 2 E_3(sigma_a d)."""
    stack = Stack.of(Medium((0.5,), (1e-9,), eta=1.0))
    found = tr.slabs(stack, (1.0,), 20_000)
    d = np.array([0.0, 0.5, 2.0, 6.0])
    np.testing.assert_allclose(found.at(d)[:, 0], 2 * expn(3, 0.5 * d), atol=0.01)


def test_of_skin_it_is_what_a_random_walk_in_a_head_finds():
    """A walk of another program through 4 mm of d'Eon and Luebke's skin: 0.116 of the albedo, where
    the first edition's product was 0.282.
    """
    found = tr.curve_of("deon_luebke")
    assert found.at([4.0])[0, 0] == pytest.approx(0.116, rel=0.1)
    albedo = media.curve("deon_luebke").albedo
    np.testing.assert_allclose(found.at([0.0])[0] * albedo, 1, rtol=1e-6)  # nothing is in the way
    assert (np.diff(found.values, axis=0) <= 0).all()
    assert (found.table()[-1] == 0).all() and found.table().shape == (tr.TABLE, 3)


def test_a_part_has_the_bodys_layers_on_both_faces():
    thin, thick = tr.part(SKIN_THREE_LAYERS, 0.4), tr.part(SKIN_THREE_LAYERS, 6.0)
    assert [layer.thickness_mm for layer in thin.layers] == [0.4]
    assert [layer.thickness_mm for layer in thick.layers] == [0.25, 1.0, 3.5, 1.0, 0.25]
    assert thick.layers[0].medium == thick.layers[-1].medium == SKIN_THREE_LAYERS.layers[0].medium
    sheet = Stack.of(Medium((0.1,), (1.0,)), 2.0)
    assert tr.part(sheet, 50.0) is sheet


def test_a_sheet_lets_as_much_through_wherever_it_is():
    table = {"layers": [{"medium": "skin1", "thickness_mm": 2.0}]}
    found = tr.curve_of(table)
    np.testing.assert_allclose(found.at([0.1, 100.0]), found.at([2.0, 2.0]))


def test_layers_let_more_through_than_the_medium_nearest_to_their_curve():
    """What the reference walks in in their place (docs/techniques.md): 3 mm send as much red and
    three times the green and blue, since most of the absorption of that medium, which is spread
    evenly, lies in the layers' thin upper part."""
    layers, one = (
        slabs.at([3.0])[0]
        for slabs in (
            tr.curve_of("skin_three_layers"),
            tr.slabs(Stack.of(walked("skin_three_layers").medium), (0.517, 0.4995, 0.3762)),
        )
    )
    assert layers[0] == pytest.approx(one[0], rel=0.15)
    assert (layers[1:] > 2.5 * one[1:]).all() and (layers[1:] < 6 * one[1:]).all()
    assert walked("skin_three_layers").layered and not walked("skin1").layered


def test_formulas_are_what_their_papers_say():
    """Jimenez et al. 2010: the six Gaussians at 1 mm, exact and published; Beer; Burley."""
    exact, published = (tr.curve_of("deon_luebke", "jimenez", e).at([1.0])[0] for e in tr.EXPONENTS)
    np.testing.assert_allclose(exact, [0.4063, 0.0197, 0.0029], atol=2e-3)
    np.testing.assert_allclose(published, [0.3047, 0.0046, 0.0012], atol=2e-3)
    medium = tr.homogeneous("skin1")
    beer = tr.curve_of("skin1", "beer").at([0.8])[0]
    np.testing.assert_allclose(beer, np.exp(-0.8 * medium.sigma_t_prime), rtol=1e-3)
    for model in ("jimenez", "burley", "beer"):
        np.testing.assert_allclose(tr.curve_of("skin1", model).at([0.0]), 1)
    deep = [tr.curve_of("skin1", model).at([6.0])[0, 0] for model in ("multipole", "slab")]
    np.testing.assert_allclose(*deep, rtol=0.1)  # diffusion is right in the deep, for red
    with pytest.raises(InputError, match="expected one of none, slab"):
        tr.curve_of("skin1", "prism")
