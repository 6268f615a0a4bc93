"""Golubev Plus: samples where contrast is, and golubev where all are taken."""

import numpy as np

import renderer
from tests.renderer.test_techniques import scatter


def test_golubev_plus_spends_where_contrast_is(patch):
    plus = renderer.make("golubev_plus")
    light = np.zeros((360, 640, 3))
    light[:, :320], light[:, 320:] = 1.0, 0.3
    _out, count = scatter(plus, patch(light, depth_mm=250.0))
    assert set(np.unique(count[..., 0])) == {12, 22}
    active = (count[..., 0] == 22).mean(axis=0)
    assert (
        active[300:340].max() > 0.5
        and active[300:340].mean() > 0.2
        and active[:100].max() == 0
        and active[-100:].max() == 0
    )
    contrast = count[..., 1]
    assert (
        (np.asarray(contrast) >= 0).all() and contrast.max() <= 1 and contrast[:, :100].max() < 1e-3
    )


def test_golubev_plus_with_every_pixel_active_is_golubev(patch):
    rng = np.random.default_rng(5)
    light = rng.uniform(0.1, 2.0, (360, 640, 3))
    all_on, count = scatter(renderer.make("golubev_plus", {"offset": 0.5}), patch(light))
    assert (count[..., 0] == 22).all()
    np.testing.assert_allclose(
        all_on, scatter(renderer.make("golubev"), patch(light))[0], rtol=2e-5
    )
