"""d'Eon and Luebke's filter over the atlas: kernels in millimetres, seams, coverage."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.scene import shapes
from stimuli import scenes
from stimuli.scenes import staging
from tests.renderer.slab import (
    BALL,
    behind_cartilage,
    frame_of_ball,
    lit,
    places,
    rms,
    surface_edge_response,
    width_mm,
)
from tests.renderer.test_techniques import SKIN

OPTIONS = {"size": 1024, "texturing": 0.0, "translucency": "none"}
TECHNIQUE = renderer.make("deon_luebke", OPTIONS)


@pytest.fixture(scope="module")
def ball():
    with frame_of_ball((120, 90)) as frame:
        yield frame


def test_a_slab_answers_as_the_medium_whatever_its_tilt():
    """Texels are 0.07 mm: within the fit's error and .01 of the curve, and the same at 60 degrees,
    since the filter lies in the surface; a pixel is 0.17 mm wide there.
    """
    u, got, _ = surface_edge_response(TECHNIQUE)
    fit = TECHNIQUE.edge(SKIN, u) - SKIN.edge(u)
    near = np.abs(u) < 6
    fitted = np.sqrt(np.trapezoid(fit[near] ** 2, u[near], axis=0) / np.ptp(u[near]))
    assert (rms(u, got, SKIN, 6.0) < fitted + 0.010).all()
    tilted_u, tilted, _ = surface_edge_response(TECHNIQUE, 60.0)
    np.testing.assert_allclose(width_mm(tilted_u, tilted), width_mm(u, got), atol=0.06)


def test_constant_light_stays_constant_to_the_silhouette(ball):
    light = np.array([2.0, 1.0, 0.5])
    given = lit(ball, lambda place: np.broadcast_to(light, place.shape))
    for technique in (
        TECHNIQUE,
        renderer.make("deon_luebke", {**OPTIONS, "size": 256, "padding": 4}),
    ):
        with technique.scatter(given).target as target:
            got, count = (texture.read().copy() for texture in target.textures)
        _, scatters = places(ball)
        np.testing.assert_allclose(got[scatters][:, :3], np.tile(light, (scatters.sum(), 1)), 1e-3)
        assert ((count[..., 0] == technique.taps()) == scatters).all()
    assert TECHNIQUE.taps() == 6 * 2 * 7


def test_seams_let_in_what_lies_beside_them_where_the_paper_does(ball):
    """At the meridian behind the ball the atlas ends; seen from in front only its poles are near
    foreign texels. A spot of light at one pole is not to be met at the other.
    """

    def spot(place):
        return np.repeat((place[..., 1:2] > 38.0) * 1.0, 3, axis=-1)

    where, scatters = places(ball)
    far = scatters & (where[..., 1] < -20)
    with TECHNIQUE.scatter(lit(ball, spot)).target as target:
        assert target.textures[0].read()[far][:, :3].max() < 1e-4


def test_published_gaussians_are_those_of_the_chapter(ball):
    """First Gaussian unblurred: an edge then has a step of its weight, .649 in blue."""
    published = renderer.make(
        "deon_luebke", {**TECHNIQUE.plain(), "kernel": "published", "first": "published"}
    )
    assert published.taps() == 5 * 2 * 7
    u, got, _ = surface_edge_response(published)
    row = got[:, 2]
    near = np.abs(u) < 0.25
    assert row[near].max() - row[near].min() == pytest.approx(0.649 + 0.344 * 0.75, abs=0.08)


def test_overlapping_texture_coordinates_are_refused(monkeypatch):
    one = shapes.slab((20.0, 20.0, 20.0), 4)
    flat = shapes.Shape(one.positions, one.normals, np.zeros_like(one.uvs), one.faces)
    monkeypatch.setattr(staging.shapes, "slab", lambda size: flat)
    table = {**BALL, "objects": {"ball": {"shape": "slab", "size_mm": [20.0, 20.0, 20.0]}}}
    graph = scenes.stage(scenes.read_scene(table)).graph
    with (
        renderer.Renderer(graph, (64, 48), 1, rays=8, shadow_map=64) as drawing,
        drawing.frame() as frame,
        pytest.raises(InputError, match="texture coordinates of mesh 1 cover 0 of") as caught,
    ):
        frame.render(TECHNIQUE)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("thickness_mm", [1.0, 3.0])
def test_a_sheet_lit_from_behind_lets_the_widest_gaussians_through(thickness_mm):
    """Sum of w exp(-t^2 / 2v) of the last three, as in the chapter's listing; in front, where the
    lamp shines on the face itself, nothing is added. Of what comes through, cartilage of an ear
    about the sheet's middle stops its share."""
    technique = renderer.make("deon_luebke", {"size": 256, "texturing": 0.0})
    for towards, through in (-1.0, 1.0), (1.0, 0.0):
        table = {
            "objects": {"sheet": {"shape": "slab", "size_mm": [40.0, 40.0, thickness_mm]}},
            "materials": {"sheet": {"medium": "deon_luebke"}},
            "lights": {"sun": {"direction": [0.0, 0.0, towards], "irradiance": [1.0, 1.0, 1.0]}},
            "environment": {"ambient": [0.0, 0.0, 0.0]},
            "camera": {"framing": "sheet", "height_mm": 30.0, "angle": "front"},
        }
        graph = scenes.stage(scenes.read_scene(table)).graph
        with renderer.Renderer(graph, (48, 48), 1, rays=8, shadow_map=256) as drawing:
            with drawing.frame() as frame:
                whole, got = frame.inputs(False), []
                for given in (whole, behind_cartilage(whole, 0.25)):
                    with technique.scatter(given).target as target:
                        got.append(target.textures[0].read()[24, 24, :3].copy())
                lit_face = frame.surface.textures[0].read()[24, 24, :3]
        fit = technique.fit(SKIN)
        falling = fit.weights * np.exp(-(thickness_mm**2) / (2 * fit.variance_mm2[:, None]))
        wanted = through * falling[-3:].sum(0)
        np.testing.assert_allclose(got[0], lit_face + wanted, atol=3e-3)
        np.testing.assert_allclose(got[1], got[0] - 0.25 * wanted, atol=1e-3)


def test_a_blurred_stretch_map_is_the_map_itself_where_the_texture_is_even():
    _, got, _ = surface_edge_response(TECHNIQUE)
    blurred = renderer.make("deon_luebke", {**TECHNIQUE.plain(), "stretch": "blurred"})
    _, also, _ = surface_edge_response(blurred)
    np.testing.assert_allclose(also, got, atol=2e-3)
