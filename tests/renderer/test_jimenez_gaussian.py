"""Gaussian: energy, and the Gaussians of a medium."""

import numpy as np
import pytest

import renderer
from renderer.optics import media
from tests.renderer.test_techniques import SKIN, scatter


def spot(radius_px=3, size=(360, 640)):
    y, x = np.mgrid[: size[0], : size[1]]
    inside = (x - size[1] // 2) ** 2 + (y - size[0] // 2) ** 2 <= radius_px**2
    return inside[..., None] * np.array([5.0, 5.0, 5.0])


@pytest.mark.parametrize("name", ["jimenez_gaussian", "jimenez_separable"])
def test_a_spot_keeps_its_energy(name, patch):
    light = spot()
    out, _ = scatter(renderer.make(name), patch(light))
    np.testing.assert_allclose(out.sum(axis=(0, 1)), light.sum(axis=(0, 1)), rtol=0.03)


def test_the_fit_of_the_six_gaussians_is_the_six_gaussians():
    """d'Eon and Luebke's curve: fitted and published kernels answer an edge alike."""
    fitted = renderer.make("jimenez_gaussian")
    published = renderer.make("jimenez_gaussian", {"kernel": "published"})
    assert fitted.fit_error(SKIN).max() < 1e-4 and published.fit_error(SKIN).max() < 1e-4
    marble = media.curve("marble", photons=20_000)
    assert fitted.fit_error(marble).max() < 0.01 < published.fit_error(marble).min()
