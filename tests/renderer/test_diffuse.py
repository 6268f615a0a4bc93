"""The diffuse models: how light passes a face, on the screen and over other domains."""

import numpy as np
import pytest

import renderer
from renderer.optics import surface
from stimuli import scenes
from tests.renderer.conftest import small

SHEET = {
    "objects": {"sheet": {"shape": "sheet", "size_mm": [100.0, 100.0], "thickness_mm": 40.0}},
    "materials": {
        "sheet": {
            "medium": "deon_luebke",
            "albedo": [1.0, 1.0, 1.0],
            "roughness": 0.4,
            "f0": 0.05,
            "lobe_share": 0.0,
            "lobe_roughness": [1.0, 1.0],
        }
    },
    "lights": {"sun": {"direction": [1.0, 0.0, 1.0], "irradiance": [2.0] * 3, "shadow": False}},
    "camera": {"framing": "flat", "height_mm": 20.0, "angle": "front"},
}


def irradiance(technique, **patch):
    """Scattered irradiance in the middle of a sheet that faces the camera: (3,)."""
    graph = scenes.stage(scenes.read_scene(scenes.merge(SHEET, patch))).graph
    with (
        renderer.Renderer(graph, (48, 48), 1, rays=64, shadow_map=64) as drawing,
        drawing.frame() as frame,
        frame.scatter(technique) as target,
    ):
        return target.textures[0].read()[24, 24, :3].astype(float)


@pytest.mark.parametrize("name", ["none", "golubev", "deon_luebke", "splat_dipole"])
def test_a_conserving_face_holds_back_what_it_reflects(name):
    """A lamp at 45 degrees: E (1 - rho), on the screen, over the atlas and at points."""
    parameters = {**small(name).plain(), "texturing": 0.0, "diffuse": "conserving"}
    back = surface.specular_albedo([np.sqrt(0.5)], [0.4])[0, 0] @ [0.05, 1.0]
    measured = irradiance(renderer.make(name, parameters))
    np.testing.assert_allclose(measured, 2 * np.sqrt(0.5) * (1 - back), rtol=5e-3)


def test_disney_follows_the_lamp_and_the_eye():
    """n.l = l.h's own: the camera looks straight down, so that only the lamp's factor is left."""
    made = renderer.make("none", {"diffuse": "disney"})
    half = np.array([np.sqrt(0.5), 1 + np.sqrt(0.5)])
    l_h = (half @ [np.sqrt(0.5), np.sqrt(0.5)]) / np.linalg.norm(half)
    expected = 2 * np.sqrt(0.5) * surface.disney(np.sqrt(0.5), 1.0, l_h, 0.4)
    np.testing.assert_allclose(irradiance(made), expected, rtol=2e-3)


def test_even_light_takes_the_mean_over_all_directions():
    sky = {"lights": {"sun": False}, "environment": {"ambient": [1.0, 1.0, 1.0]}}
    lambert = irradiance(renderer.make("none"), **sky)
    conserving = irradiance(renderer.make("none", {"diffuse": "conserving"}), **sky)
    mu = (np.arange(400) + 0.5) / 400
    back = surface.specular_albedo(mu, [0.4])[:, 0] @ [0.05, 1.0]
    np.testing.assert_allclose(conserving / lambert, 1 - (2 * mu * back).mean(), rtol=5e-3)


def test_the_picture_loses_it_on_the_way_out_too():
    graph = scenes.stage(scenes.read_scene(SHEET)).graph
    with (
        renderer.Renderer(graph, (48, 48), 1, rays=16, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        plain, held = (
            frame.render(renderer.make("none", {"diffuse": d})).image[24, 24].astype(int)
            for d in ("lambert", "conserving")
        )
        share = frame.surface.textures[2].read()[24, 24, 3]
    back = surface.specular_albedo([1.0], [0.4])[0, 0] @ [0.05, 1.0]
    assert share == pytest.approx(1 - back, abs=2e-3)
    assert (held < plain).all()
