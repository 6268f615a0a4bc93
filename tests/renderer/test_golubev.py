"""Golubev: the disc, where it lies, and the fallback below a pixel."""

import numpy as np
import pytest

import renderer
from renderer.optics import burley, chandrasekhar, media
from tests.renderer.slab import edge_response, scatter, width_mm
from tests.renderer.test_techniques import SKIN


@pytest.mark.parametrize("angles", ["fibonacci", "random"])
def test_disc_is_drawn_by_area_of_energy(angles):
    technique = renderer.make("golubev", {"angles": angles})
    table = technique.sample_set(SKIN, 22, 0)
    np.testing.assert_allclose(np.hypot(table[:, 0], table[:, 1]), table[:, 2], rtol=1e-12)
    shares = burley.cdf(table[:, 2], technique.distances(SKIN).max())
    np.testing.assert_allclose(shares, (np.arange(22) + 0.5) / 22, atol=1e-12)
    gaps = np.diff(np.sort(np.arctan2(table[:, 1], table[:, 0])))
    assert (gaps.max() < 0.5) == (angles == "fibonacci")  # thesis, fig. 3.9: even, or not


def test_below_a_pixel_golubev_falls_back_to_the_diffuse_brdf(bare):
    light = np.random.default_rng(6).uniform(0.1, 2.0, (90, 160, 3))
    for name in ("golubev", "golubev_plus"):
        inputs = bare.flat(light, SKIN, depth_mm=40000.0)
        out, count = scatter(renderer.make(name), inputs)
        np.testing.assert_array_equal(out, light.astype(np.float32))
        assert (count[..., 0] == 1).all()


def test_a_tangent_disc_keeps_its_millimetres_on_a_tilt(bare):
    """Thesis, fig. 3.11. Face-on both discs are one; at 60 degrees an edge's width stays."""
    own, tangent = (renderer.make("golubev", {"disc": disc}) for disc in ("camera", "tangent"))
    place = (SKIN, 9000.0, 480.0)
    flat = edge_response(bare, own, *place)[1]
    np.testing.assert_allclose(edge_response(bare, tangent, *place)[1], flat, atol=1e-3)
    tilted = edge_response(bare, tangent, *place, 60.0)
    np.testing.assert_allclose(width_mm(*tilted[:2])[:2], SKIN.width()[:2], rtol=0.08)
    light = np.full((90, 160, 3), 1.3)
    depth = 400.0 + 300.0 * (np.arange(160) > 80)  # a silhouette: no surface joins its sides
    out, _ = scatter(tangent, bare.flat(light, SKIN, depth))
    np.testing.assert_allclose(out, 1.3, rtol=1e-5)


def test_distances_by_every_parametrisation_are_near_the_fitted_ones():
    """d = length / s(A) of the medium nearest to the curve (eqs. 2.86, 2.88, 2.89): here by hand
    for the mean free path; none is more than a fifth off, and none is nearer than the fit."""
    made = {
        name: renderer.make("golubev", {"parametrisation": name, "scale": 2.0})
        for name in ("fitted", "mfp", "dmfp", "diffuse")
    }
    distances = {name: technique.distances(SKIN) / 2.0 for name, technique in made.items()}
    medium = media.invert(SKIN).medium
    albedo = chandrasekhar.searchlight_albedo(medium.albedo_prime)
    s = 1.85 - albedo + 7 * np.abs(albedo - 0.8) ** 3
    np.testing.assert_allclose(distances["mfp"], medium.mfp / s, rtol=1e-9)
    fitted = renderer.make("golubev").fit_error(SKIN)
    for name in ("mfp", "dmfp", "diffuse"):
        np.testing.assert_allclose(distances[name], distances["fitted"], rtol=0.2)
        own = renderer.make("golubev", {"parametrisation": name})
        assert (own.fit_error(SKIN) > fitted - 1e-6).all()
    given = renderer.make("golubev", {"parametrisation": "dmfp", "distance_mm": (1.0, 2.0, 3.0)})
    np.testing.assert_array_equal(given.distances(SKIN), [1.0, 2.0, 3.0])
