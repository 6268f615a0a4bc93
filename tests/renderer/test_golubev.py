"""Golubev: the disc, and the fallback below a pixel."""

import numpy as np

import renderer
from renderer.techniques.golubev import disc
from tests.renderer.test_techniques import scatter


def test_disc_is_drawn_by_area_of_energy():
    table = disc(22, 0.447)
    np.testing.assert_allclose(np.hypot(table[:, 0], table[:, 1]), table[:, 2], rtol=1e-12)
    from renderer.optics import burley

    np.testing.assert_allclose(
        burley.cdf(table[:, 2], 0.447), (np.arange(22) + 0.5) / 22, atol=1e-12
    )


def test_below_a_pixel_golubev_falls_back_to_the_diffuse_brdf(patch):
    rng = np.random.default_rng(6)
    light = rng.uniform(0.1, 2.0, (360, 640, 3))
    for name in ("golubev", "golubev_plus"):
        out, count = scatter(renderer.make(name), patch(light, depth_mm=40000.0))
        np.testing.assert_array_equal(out, light.astype(np.float32))
        assert (count[..., 0] == 1).all()
