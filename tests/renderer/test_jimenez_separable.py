"""Separable: the published kernel's numbers, the pre-integrated one's property, its cross."""

import numpy as np
import pytest

import renderer
from renderer.optics.separable import demo_kernel
from tests.renderer.test_jimenez_gaussian import spot
from tests.renderer.test_techniques import SKIN, scatter


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


def test_separable_shows_its_cross_and_golubev_does_not(patch):
    """A small bright spot: the rank-one kernel spreads along the axes (Jimenez 2015, fig. 3)."""
    light = spot(5)

    def anisotropy(name, parameters):
        out, _ = scatter(renderer.make(name, parameters), patch(light, depth_mm=120.0))
        red, c = out[..., 0], (180, 320)
        r = 30
        along = (
            red[c[0] - 6 : c[0] + 7, c[1] + r - 6 : c[1] + r + 7].mean()
            + red[c[0] + r - 6 : c[0] + r + 7, c[1] - 6 : c[1] + 7].mean()
        )
        d = round(r / np.sqrt(2))
        diagonal = red[c[0] + d - 6 : c[0] + d + 7, c[1] + d - 6 : c[1] + d + 7].mean() * 2
        return along / max(diagonal, 1e-9)

    assert anisotropy("jimenez_separable", {"near_share": 0.0}) > 2.0
    assert 0.5 < anisotropy("golubev", {"samples": 64}) < 1.6
