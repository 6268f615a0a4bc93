"""No scattering: light in, the same light out."""

import numpy as np

import renderer
from tests.renderer.slab import scatter
from tests.renderer.test_techniques import SKIN


def test_light_comes_out_as_it_went_in(patch):
    light = np.random.default_rng(1).uniform(0, 2, (360, 640, 3))
    out, count = scatter(renderer.make("none"), patch(light))
    np.testing.assert_array_equal(out, light.astype(np.float32))
    assert (count[..., 0] == 1).all()


def test_its_fit_error_is_that_of_a_step():
    """The wider the medium's edge, the more is missing without scattering."""
    error = renderer.make("none").fit_error(SKIN)
    assert (error > 0.05).all()
