"""Light that comes through: a slab lit from behind, by every model, in every domain."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics import transmittance as tr
from renderer.scene.material import read_material
from stimuli import scenes

THICKNESS_MM = 2.0
SLAB = {
    "objects": {"slab": {"shape": "slab", "size_mm": [60.0, 60.0, THICKNESS_MM]}},
    "materials": {"slab": {"medium": "deon_luebke", "albedo": [1.0, 1.0, 1.0]}},
    "lights": {"back": {"direction": [0.0, 0.0, -1.0], "irradiance": [3.0, 3.0, 3.0]}},
    "environment": {"ambient": [0.0, 0.0, 0.0]},
    "camera": {"framing": "slab", "height_mm": 30.0, "angle": "front"},
}


@pytest.fixture(scope="module")
def frame():
    graph = scenes.stage(scenes.read_scene(SLAB)).graph
    with renderer.Renderer(graph, (32, 32), 1, rays=8, shadow_map=256) as drawing:
        with drawing.frame() as found:
            yield found


def through(frame, name, **parameters):
    technique = renderer.make(name, parameters)
    with technique.scatter(frame.inputs(technique.transmission)).target as target:
        return target.textures[0].read()[16, 16, :3].copy()


@pytest.mark.parametrize("model", [model for model in tr.MODELS if model != "none"])
def test_a_slab_lit_from_behind_sends_what_its_model_lets_through(frame, model):
    expected = 3 * tr.curve_of("deon_luebke", model).at([THICKNESS_MM])[0]
    got = through(frame, "golubev", translucency=model)
    np.testing.assert_allclose(got, expected, rtol=5e-3, atol=1e-3)


def test_details_are_parameters(frame):
    plain = through(frame, "golubev")
    half = through(frame, "golubev", thickness_scale=0.5)
    expected = 3 * tr.curve_of("deon_luebke").at([0.5 * THICKNESS_MM])[0]
    np.testing.assert_allclose(half, expected, rtol=1e-2, atol=2e-3)
    wrapped = through(frame, "golubev", translucency_wrap=0.3)
    np.testing.assert_allclose(wrapped, plain, rtol=1e-6)  # it faces the lamp fully already
    published = {"translucency": "jimenez", "translucency_exponent": "published"}
    expected = 3 * tr.curve_of("deon_luebke", "jimenez", "published").at([THICKNESS_MM])[0]
    np.testing.assert_allclose(through(frame, "golubev", **published), expected, atol=2e-3)


def test_over_the_atlas_it_is_the_same(frame):
    same = {"size": 256, "texturing": 0.0}
    on_screen = through(frame, "golubev")
    np.testing.assert_allclose(through(frame, "borshukov_lewis", **same), on_screen, atol=2e-3)


def test_translucent_of_the_first_edition_still_reads():
    assert renderer.make("golubev", {"translucent": False}).transmission is None
    assert renderer.make("golubev", {"translucent": True}) == renderer.make("golubev")
    assert renderer.make("none", {"translucent": True}).translucency == "slab"
    for wrong in ({"translucent": 1}, {"translucent": True, "translucency": "beer"}):
        with pytest.raises(InputError, match="expected true or false, and no translucency"):
            renderer.make("golubev", wrong)
    with pytest.raises(InputError, match="expected the parameter translucency_wrap of a tech"):
        read_material({"transmission_wrap": 0.3}, "materials.head")


def test_a_lamp_at_an_angle_sees_a_slab_as_thick_as_it_is():
    """60 degrees off: half of the light falls on the face, through a thickness that stays."""
    table = {**SLAB, "lights": {"back": {**SLAB["lights"]["back"], "direction": [0.866, 0, -0.5]}}}
    thin = tr.curve_of("deon_luebke").at([THICKNESS_MM])[0]
    slanted = tr.curve_of("deon_luebke").at([2 * THICKNESS_MM])[0]
    graph = scenes.stage(scenes.read_scene(table)).graph
    with (
        renderer.Renderer(graph, (32, 32), 1, rays=8, shadow_map=1024) as drawing,
        drawing.frame() as frame,
    ):
        for how in ("corrected", "entry"):
            got = through(frame, "golubev", translucency_thickness=how)
            np.testing.assert_allclose(got, 1.5 * thin, rtol=0.05, atol=2e-3)
        got = through(frame, "golubev", translucency_thickness="along")
        assert 1.5 * slanted[0] < got[0] < 0.7 * 1.5 * thin[0]  # a point is moved inwards
