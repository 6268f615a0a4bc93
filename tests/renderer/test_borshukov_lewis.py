"""The light-map blur: two Gaussians in millimetres, and what it does without stretch correction."""

import numpy as np

import renderer
from tests.renderer.slab import rms, surface_edge_response, width_mm
from tests.renderer.test_techniques import SKIN

TECHNIQUE = renderer.make("borshukov_lewis", {"size": 1024})


def test_a_slab_answers_as_two_gaussians():
    u, got, _ = surface_edge_response(TECHNIQUE)
    np.testing.assert_allclose(got, TECHNIQUE.edge(SKIN, u), atol=0.03)
    fit = TECHNIQUE.edge(SKIN, u) - SKIN.edge(u)
    near = np.abs(u) < 6
    fitted = np.sqrt(np.trapezoid(fit[near] ** 2, u[near], axis=0) / np.ptp(u[near]))
    assert (rms(u, got, SKIN, 6.0) < fitted + 0.010).all()
    six = renderer.make("deon_luebke").fit_error(SKIN)
    assert (TECHNIQUE.fit_error(SKIN) > 3 * six).all()  # what two Gaussians cannot follow


def test_without_stretch_correction_widths_follow_the_texture():
    """The slab's face takes 0.32 of the atlas's width and 0.48 of its height: along x a texel is
    1.5 times as far as along y, and red widens by the ratio of that to the mean."""
    plain = renderer.make("borshukov_lewis", {"size": 1024, "stretch": "none"})
    u, got, _ = surface_edge_response(TECHNIQUE)
    v, loose, _ = surface_edge_response(plain)
    ratio = width_mm(v, loose)[0] / width_mm(u, got)[0]
    along_x, along_y = 24 / (0.96 / 3), 24 / (0.96 / 2)
    assert ratio > 1.1
    assert abs(ratio - along_x / np.sqrt(along_x * along_y)) < 0.12
