"""Splats: points that stand for equal areas, their sum, and what they converge to."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics import fits
from renderer.scene import shapes
from renderer.techniques.samples import spread
from tests.renderer.slab import (
    behind_cartilage,
    drawn,
    frame_of_ball,
    lit,
    places,
    surface_edge_response,
)
from tests.renderer.test_techniques import SKIN


@pytest.fixture(scope="module")
def ball():
    with frame_of_ball((96, 72)) as frame:
        yield frame


def run(technique, frame, light):
    """(scattered (H, W, 3), splats a pixel (H, W))."""
    with technique.scatter(lit(frame, light)).target as target:
        got, count = (texture.read().copy() for texture in target.textures)
    return got[..., :3], count[..., 0]


def test_points_stand_for_equal_areas():
    """Two triangles of areas 1 and 3: a fourth of the points, and centroids at the corners' mean;
    a coordinate's mean over 4,000 points errs by less than 0.03 (4 standard errors)."""
    positions = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 5], [6, 0, 5], [0, 1, 5]], float)
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    rng = np.random.default_rng(1)
    areas = shapes.triangle_areas(positions, faces)
    assert areas.sum() == pytest.approx(4.0)
    triangles, weights = spread(areas, 4000, rng)
    assert (triangles == 0).mean() == pytest.approx(0.25, abs=1e-3)
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.mean(axis=0), 1 / 3, atol=0.03)


def test_constant_light_stays_constant(ball):
    """Divided by what arrives, exactly; as the paper's sum within 2 % of the share that a splat
    holds, on a ball of 40 mm, whose curvature brings far points nearer."""
    light = np.array([2.0, 1.0, 0.5])
    _, scatters = places(ball)
    spaced = {"spacing_mm": 2.0}
    technique = renderer.make("splat_dipole", spaced)
    got, count = run(technique, ball, lambda place: np.broadcast_to(light, place.shape))
    np.testing.assert_allclose(got[scatters], np.tile(light, (scatters.sum(), 1)), rtol=1e-3)
    assert ((count > 0) == scatters).all()
    paper = renderer.make("splat_dipole", {**spaced, "weights": "published"})
    got, _ = run(paper, ball, lambda place: np.broadcast_to(light, place.shape))
    np.testing.assert_allclose(got[scatters].mean(axis=0) / light, paper.share, atol=0.02)


def test_more_points_give_the_same_brightness(ball):
    def light(place):
        return np.repeat(np.clip(0.5 + place[..., :1] / 40, 0, 1), 3, axis=-1)

    made = [
        renderer.make("splat_dipole", {"spacing_mm": s, "weights": "published", "blur": 1.05 / s})
        for s in (1.5, 0.75)
    ]
    _, scatters = places(ball)
    few, many = (run(technique, ball, light) for technique in made)
    assert many[1][scatters].mean() == pytest.approx(4 * few[1][scatters].mean(), rel=0.02)
    np.testing.assert_allclose(
        many[0][scatters].mean(axis=0), few[0][scatters].mean(axis=0), rtol=0.02
    )


def test_a_slab_answers_as_its_profile():
    """Half a millimetre between points: an edge is that of the dipole, widened where the spacing
    asks for it, to .12 where blue's falls within one spacing, and .02 rms."""
    technique = renderer.make("splat_dipole", {"spacing_mm": 0.5})
    u, got, _ = surface_edge_response(technique, size=(160, 160), height_mm=18.0)
    np.testing.assert_allclose(got, technique.edge(SKIN, u), atol=0.12)
    miss = np.sqrt(((got - technique.edge(SKIN, u)) ** 2).mean(axis=0))
    assert (miss < [0.008, 0.012, 0.017]).all()


def test_the_fit_error_says_what_the_spacing_costs():
    dense, coarse = (renderer.make("splat_dipole", {"spacing_mm": s}) for s in (0.02, 0.5))
    assert (dense.fit_error(SKIN) < [0.009, 0.003, 0.003]).all()
    assert (coarse.fit_error(SKIN) > 2 * dense.fit_error(SKIN)).all()


def test_the_papers_radius_clips_more():
    technique = renderer.make("splat_dipole")
    paper = renderer.make("splat_dipole", {"radius": "published"})
    assert paper.reach_mm(SKIN) < 0.7 * technique.reach_mm(SKIN)
    assert technique.clipped(SKIN).max() == pytest.approx(0.01, abs=1e-3)
    assert paper.clipped(SKIN)[0] > 0.08


def test_too_many_points_are_refused(ball):
    with pytest.raises(InputError, match="spacing_mm is 0.05.* at most 4000000 points"):
        ball.render(renderer.make("splat_dipole", {"spacing_mm": 0.05}))


def behind_a_sheet(thickness_mm, medium="deon_luebke"):
    """A frame's table: a sheet that a lamp behind it lights, seen from its dark side."""
    return {
        "objects": {
            "sheet": {"shape": "sheet", "size_mm": [40.0, 40.0], "thickness_mm": thickness_mm}
        },
        "materials": {"sheet": {"medium": medium, "albedo": [0.8, 0.8, 0.8]}},
        "lights": {"lamp": {"direction": [0.0, 0.0, -1.0], "irradiance": [1.0, 1.0, 1.0]}},
        "environment": {"ambient": [0.0, 0.0, 0.0]},
        "camera": {"framing": "sheet", "height_mm": 20.0, "angle": "front"},
    }


def test_the_blur_does_not_reach_through_a_sheet():
    """Behind 2 mm a dipole by the distance itself sends 1 - P(2 mm) of the light (its shell),
    however far apart points are."""
    with drawn(behind_a_sheet(2.0)) as frame:
        for spacing in (0.7, 2.0):
            technique = renderer.make("splat_dipole", {"spacing_mm": spacing})
            with frame.scatter(technique) as target:
                got = target.textures[0].read()[..., :3].mean(axis=(0, 1))
            shell = 1 - fits.dipole(SKIN).cdf(np.array([2.0]))[0]
            np.testing.assert_allclose(got, shell, atol=0.01)


@pytest.mark.parametrize("name", ["splat_dipole", "splat_multipole"])
def test_flesh_stops_what_comes_through_and_nothing_else(name):
    """An ear's cartilage that stops half, about the sheet's middle: half of the light behind it is
    left, and all of the light in front."""
    technique = renderer.make(name, {"spacing_mm": 1.0})

    def light(inputs):
        with technique.scatter(inputs).target as target:
            return target.textures[0].read()[..., :3].copy()

    for thickness_mm, towards, kept in ((2.0, -1.0, 0.5), (30.0, 1.0, 1.0)):
        table = behind_a_sheet(thickness_mm)
        table["lights"]["lamp"]["direction"] = [0.0, 0.0, towards]
        with drawn(table, (24, 24)) as frame:
            inputs = frame.inputs(None)
            whole = light(inputs)
            assert whole[..., 0].min() > 0.1
            np.testing.assert_allclose(
                light(behind_cartilage(inputs, 0.5)), kept * whole, rtol=1e-4
            )
