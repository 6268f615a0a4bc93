"""Gaussian: energy, and the Gaussians of a medium."""

import numpy as np
import pytest

import renderer
from renderer.optics import media
from tests.renderer.slab import scatter
from tests.renderer.test_techniques import SKIN


def spot(radius_px=3, size=(180, 180)):
    y, x = np.mgrid[: size[0], : size[1]]
    inside = (x - size[1] // 2) ** 2 + (y - size[0] // 2) ** 2 <= radius_px**2
    return inside[..., None] * np.array([5.0, 5.0, 5.0])


@pytest.mark.parametrize("name", ["jimenez_gaussian", "jimenez_separable"])
def test_a_spot_keeps_its_energy(name, bare):
    light = spot()
    out, _ = scatter(renderer.make(name), bare.flat(light, SKIN))
    np.testing.assert_allclose(out.sum(axis=(0, 1)), light.sum(axis=(0, 1)), rtol=0.03)


def test_the_fit_of_the_six_gaussians_is_the_six_gaussians():
    """d'Eon and Luebke's curve: fitted and published kernels answer an edge alike."""
    fitted = renderer.make("jimenez_gaussian")
    published = renderer.make("jimenez_gaussian", {"kernel": "published"})
    assert fitted.fit_error(SKIN).max() < 1e-4 and published.fit_error(SKIN).max() < 1e-4
    marble = media.curve("marble", photons=20_000)
    assert fitted.fit_error(marble).max() < 0.01 < published.fit_error(marble).min()


def test_light_crosses_a_step_of_depth_in_the_paper_and_not_with_its_remedy(bare):
    """A lit cheek 30 mm in front of a dark one: most of red's light reaches it all the same."""
    light = np.zeros((64, 120, 3))
    light[:, :60] = 1
    flat, step = np.full((64, 120), 300.0), np.full((64, 120), 300.0)
    step[:, 60:] += 30

    def beyond(technique, depth):
        out, _ = scatter(technique, bare.flat(light, SKIN, depth, 6000.0))
        return out[8:-8, 60:].sum(axis=(0, 1))

    paper = renderer.make("jimenez_gaussian")
    remedy = renderer.make("jimenez_gaussian", {"depth_steps": "follow"})
    assert beyond(paper, step)[0] > 0.85 * beyond(paper, flat)[0]
    assert (beyond(remedy, step) < 1e-3 * beyond(remedy, flat)).all()
    np.testing.assert_allclose(beyond(remedy, flat), beyond(paper, flat), rtol=1e-5)
