"""Golubev Adaptive: samples by the disc's pixels, Golubev's own where there are as many."""

import numpy as np

import renderer
from tests.renderer.slab import scatter
from tests.renderer.test_techniques import SKIN


def test_samples_follow_the_discs_pixels_up_to_the_budget(bare):
    """n = min(pi (r px/mm)^2 / 4, budget), budgets of 20, 40 and 80."""
    light = np.random.default_rng(8).uniform(0.1, 2.0, (48, 64, 3))
    for depth in (400.0, 1500.0, 2600.0, 40000.0):
        radius = renderer.make("golubev").filter_radius_mm(SKIN) * 1800.0 / depth
        for budget in (20, 40, 80):
            technique = renderer.make("golubev_adaptive", {"budget": budget})
            out, count = scatter(technique, bare.flat(light, SKIN, depth))
            expected = min(int(np.pi * radius**2 / 4), budget)
            assert technique.samples_at(SKIN, 1800.0 / depth) == expected
            assert (count[..., 0] == max(expected, 1)).all()
        if expected == 0:
            np.testing.assert_array_equal(out, light.astype(np.float32))


def test_with_the_whole_budget_it_is_golubev(bare):
    """Samples found in the shader are those of the table."""
    light = np.random.default_rng(9).uniform(0.1, 2.0, (48, 64, 3))
    inputs = bare.flat(light, SKIN, 250.0)
    own, _ = scatter(renderer.make("golubev_adaptive", {"budget": 22}), inputs)
    golubev, _ = scatter(renderer.make("golubev"), inputs)
    assert np.isclose(own, golubev, rtol=2e-3).mean() > 0.999  # but for taps at the picture's edge
