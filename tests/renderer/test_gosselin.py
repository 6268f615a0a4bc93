"""Poisson blurs: what twelve taps and their middle do, once and several times."""

import numpy as np
import pytest

import renderer
from renderer.techniques import gosselin
from tests.renderer.slab import surface_edge_response, width_mm
from tests.renderer.test_techniques import SKIN

TECHNIQUE = renderer.make("gosselin", {"size": 1024})


def test_the_taps_moments():
    """Computed from the printed list: off the middle, and wider along u than along v."""
    np.testing.assert_allclose(gosselin.MEAN, (0.0281, -0.0966), atol=1e-4)
    np.testing.assert_allclose((gosselin.POISSON**2).sum() / 13, 0.6464, atol=1e-4)
    np.testing.assert_allclose(gosselin.VARIANCE, (0.352, 0.285), atol=1e-3)


def test_a_slab_answers_as_the_gaussian_that_the_blurs_tend_to():
    u, got, _ = surface_edge_response(TECHNIQUE)
    tends_to = TECHNIQUE.edge(SKIN, u)
    np.testing.assert_allclose(got, tends_to, atol=0.035)  # four passes of a few taps
    np.testing.assert_allclose(got, got[:, :1].repeat(3, axis=1), atol=1e-6)  # one blur for all
    assert (TECHNIQUE.fit_error(SKIN) > 0.02).all()  # what one Gaussian cannot follow


def test_taps_as_printed_move_the_light_and_widen_it_unevenly():
    """Along u, by blurs times the mean of the taps; the variance is that along u alone."""
    printed = renderer.make("gosselin", {"size": 1024, "turned": False})
    u, turned, _ = surface_edge_response(TECHNIQUE)
    v, moved, _ = surface_edge_response(printed)
    radius = TECHNIQUE.radius_mm(SKIN)

    def middle(x, response):
        return np.interp(-0.5, -np.minimum.accumulate(response[:, 0]), x)

    shift = 4 * gosselin.MEAN[0] * radius
    assert abs(middle(u, turned)) < 0.02
    assert middle(v, moved) == pytest.approx(-shift, abs=0.03)
    wider = np.sqrt(gosselin.VARIANCE[0] / gosselin.VARIANCE.mean())
    assert width_mm(v, moved)[0] / width_mm(u, turned)[0] == pytest.approx(wider, abs=0.03)


def test_a_radius_in_texels_follows_the_atlas():
    fine, coarse = (
        width_mm(
            *surface_edge_response(
                renderer.make("gosselin", {"kernel": "texels", "radius_texels": 12.0, "size": size})
            )[:2]
        )[0]
        for size in (1024, 512)
    )
    assert coarse / fine == pytest.approx(2.0, rel=0.1)
