"""The light-map blur: two Gaussians in millimetres, and what it does without stretch correction."""

import numpy as np

import renderer
from tests.renderer.slab import (
    drawn,
    lit,
    places,
    rms,
    slab_table,
    surface_edge_response,
    width_mm,
)
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


def teeth_mm(frame, coarse_mm):
    """How far (rms, mm) blue's edge of light, which crosses texels of 1.2 mm x 0.8 mm aslant, lies
    from a straight line.
    """
    made = renderer.make("borshukov_lewis", {"size": 64, "coarse_mm": coarse_mm})

    def given(place):
        ramp = np.clip(0.5 - (place[..., :1] - 1.5 * place[..., 1:2]) / 1.2, 0, 1)
        return np.repeat(ramp, 3, axis=-1)

    with made.scatter(lit(frame, given)).target as target:
        got = target.textures[0].read()[..., 2].astype(float)
    where, _ = places(frame)
    near = np.abs(where[:, 60, 1]) < 3
    y = where[near, 60, 1]
    rows = zip(got[near], where[near, :, 0], strict=True)
    at = np.array([np.interp(-0.5, -row, x) for row, x in rows])
    return float(np.sqrt(np.mean((at - np.polyval(np.polyfit(y, at, 1), y)) ** 2)))


def test_edges_that_cross_long_texels_have_no_teeth():
    with drawn(slab_table(12.0), (120, 120)) as frame:
        linear, spline = teeth_mm(frame, 1000.0), teeth_mm(frame, 0.6)
    assert linear > 0.03
    assert spline < 0.3 * linear
