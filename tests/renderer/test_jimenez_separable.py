"""Separable: the published kernel's numbers, the pre-integrated one's property, its cross."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics.separable import demo_kernel
from tests.renderer.slab import scatter
from tests.renderer.test_jimenez_gaussian import spot
from tests.renderer.test_techniques import SKIN


# The tables printed in the published separable SSS demo: centre weight, first tap's weight.
@pytest.mark.parametrize(
    "taps, centre, first",
    [
        (11, (0.560479, 0.669086, 0.784728), (0.00471692, 1.84771e-4, 5.07566e-5)),
        (17, (0.536343, 0.624624, 0.748867), (0.00317394, 1.34823e-4, 3.77269e-5)),
        (25, (0.530605, 0.613514, 0.739601), (9.73794e-4, 1.11862e-5, 9.43437e-7)),
    ],
)
def test_demo_kernel_is_the_published_one(taps, centre, first):
    _, weights = demo_kernel(taps)
    np.testing.assert_allclose(weights[taps // 2], centre, rtol=2e-6)
    np.testing.assert_allclose(weights[0], first, rtol=2e-5)


def test_preintegrated_kernel_is_exact_for_separable_light():
    """E(x) = cos(k x): the kernel's response is the profile's Hankel transform."""
    technique = renderer.make("jimenez_separable", {"taps": 41, "reach_mm": 12.0})
    offsets, weights = technique.kernel_table(SKIN)
    for k in (0.3, 0.8):
        got = (weights * np.cos(k * offsets)[:, None]).sum(axis=0)
        np.testing.assert_allclose(got, SKIN.stripes([2 * np.pi / k])[0], atol=6e-3)


@pytest.mark.parametrize("kernel", ["guided", "svd", "artist"])
def test_every_kernel_of_the_paper_keeps_flat_light_and_has_its_own_error(kernel):
    """Jimenez 2015, sec. 4 and 5: pre-integration alone is exact along an edge."""
    technique = renderer.make("jimenez_separable", {"kernel": kernel})
    technique.self_check(SKIN)
    exact = renderer.make("jimenez_separable").fit_error(SKIN)
    own = technique.fit_error(SKIN)
    assert own[0] > 2 * exact[0], (own, exact)  # red's long tail is what they trade
    assert (own < 0.07).all()


def test_an_artist_may_choose_the_two_gaussians():
    """Sec. 5.2: a_m(x) = w G(x, near) + (1 - w) G(x, far), over each tap's interval."""
    chosen = {"near_mm": (0.2, 0.1, 0.1), "far_mm": (1.2, 0.5, 0.3), "near_weight": (0.4, 0.5, 0.6)}
    technique = renderer.make("jimenez_separable", {"kernel": "artist", "taps": 41, **chosen})
    technique.self_check(SKIN)
    offsets, weights = technique.kernel_table(SKIN)
    spread = np.sqrt((weights * offsets[:, None] ** 2).sum(axis=0))
    near, far, w = (np.array(values) for values in chosen.values())
    np.testing.assert_allclose(spread, np.sqrt(w * near**2 + (1 - w) * far**2), rtol=0.05)
    with pytest.raises(InputError, match="expected all three"):
        renderer.make("jimenez_separable", {"kernel": "artist", "near_mm": (0.1, 0.1, 0.1)})


def test_separable_shows_its_cross_unless_taps_are_turned(bare):
    """A small bright spot: the rank-one kernel spreads along the axes (Jimenez 2015, fig. 3); the
    rotation of its near taps hides that, and a disc of samples has none.
    """
    light = spot(5)

    def anisotropy(name, parameters):
        out, _ = scatter(renderer.make(name, parameters), bare.flat(light, SKIN, 120.0))
        red, c, r = out[..., 0], 90, 30
        d = round(r / np.sqrt(2))
        along = sum(
            red[c - 6 + y : c + 7 + y, c - 6 + x : c + 7 + x].mean() for y, x in ((0, r), (r, 0))
        )
        diagonal = red[c + d - 6 : c + d + 7, c + d - 6 : c + d + 7].mean() * 2
        return along / max(diagonal, 1e-9)

    star = anisotropy("jimenez_separable", {"jitter": False})
    assert star > 2.0
    assert anisotropy("jimenez_separable", {"near_share": 1.0, "frames": 8}) < 0.5 * star
    assert 0.5 < anisotropy("golubev", {"samples": 64}) < 1.6
