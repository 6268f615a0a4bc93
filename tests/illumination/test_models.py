"""Local illumination models: the formulas, and the shader that draws them."""

import numpy as np
import pyrender
import pytest
import trimesh

import renderer
from renderer.errors import InputError
from renderer.illumination import models
from renderer.illumination.rays import World, picture
from renderer.illumination.whitted import trace
from renderer.optics import fresnel
from renderer.passes.environment import Surroundings
from renderer.scene import Environment, Panel, Shading
from renderer.scene.graph import SurfaceMaterial
from renderer.scene.maps import directions, solid_angles
from renderer.scene.material import MODELS

TINTED = {
    "albedo": [0.6, 0.4, 0.2],
    "k_s": [0.5, 0.4, 0.3],
    "k_a": [0.2, 0.3, 0.1],
    "emission": [0.01, 0.02, 0.03],
    "exponent": 20.0,
    "roughness": 0.3,
}


def radiance(frame):
    """(radiance (H, W, 3), where a surface is seen (H, W)) of a frame before any tone map."""
    light, specular, albedo, depth = (t.read().copy() for t in frame.surface.textures)
    return albedo[..., :3] * light[..., :3] / np.pi + specular[..., :3], depth[..., 0] > 0


def drawn(graph, size=(96, 72)):
    with (
        renderer.Renderer(graph, size, 1, rays=4, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        return *radiance(frame), frame.view


@pytest.mark.parametrize("model", MODELS)
def test_the_shader_draws_the_formulas(ball, model):
    """Two lamps, one with the three constants, ambient light and emission, pixel by pixel."""
    graph = ball(model=model, **TINTED)
    got, on, view = drawn(graph)
    want = picture(lambda o, d: trace(World(graph), o, d, depth=0), view, (96, 72))
    assert on.mean() > 0.3
    np.testing.assert_allclose(got[on], want[on], atol=2e-3, rtol=1e-3)
    dark = got[on][got[on][:, 0].argmin()]  # k_a I_a + emission, where no lamp shines
    np.testing.assert_allclose(dark, [0.05, 0.11, 0.04], rtol=2e-3)


@pytest.mark.parametrize("model", MODELS)
def test_a_pyrender_scene_is_lit_by_its_own_lights(model):
    """pyrender's meshes, camera and lights; only the material is ours."""
    scene = pyrender.Scene(ambient_light=[0.1, 0.1, 0.1])
    value = Shading(model=model, k_s=(0.4, 0.4, 0.4), roughness=0.4)
    ball = trimesh.creation.icosphere(5, 40.0)
    scene.add(pyrender.Mesh.from_trimesh(ball, material=SurfaceMaterial(value)))
    front, side = np.eye(4), np.eye(4)
    front[:3, 3] = [0, 0, 300]
    side[:3, 3] = [0, 0, 240]
    scene.add(pyrender.PerspectiveCamera(yfov=0.35), pose=front)
    scene.add(pyrender.DirectionalLight([1.0, 0.5, 0.5], 2.0), pose=front)
    scene.add(pyrender.PointLight([1.0, 1.0, 1.0], 0.1), pose=side)
    scene.add(pyrender.SpotLight([0.0, 1.0, 0.0], 0.1, None, 0.1, 0.2), pose=side)
    got, _, _ = drawn(scene, (65, 65))
    one = np.array([[0.0, 0.0, 1.0]])
    # at the middle all three face the surface; the lamps are 200 mm away
    light = np.array([[2.0, 1.0, 1.0]]) + 0.1 / 0.2**2 * np.array([[1.0, 2.0, 1.0]])
    want = models.reflected(models.Coefficients.of([value]), one, one, one, light) + 0.06
    np.testing.assert_allclose(got[32, 32], want[0], rtol=0.01)


def hemisphere(n=400):
    """Unit directions (N, 3) about +z and their solid angles (N,): equal steps of the cosine."""
    z, phi = np.meshgrid((np.arange(n) + 0.5) / n, 2 * np.pi * (np.arange(n) + 0.5) / n)
    z, phi = z.ravel(), phi.ravel()
    flat = np.sqrt(1 - z**2)
    towards = np.column_stack([flat * np.cos(phi), flat * np.sin(phi), z])
    return towards, np.full(len(z), 2 * np.pi / n**2)


def test_beckmann_is_a_density_of_slopes_only_with_the_pi_that_is_printed_away():
    towards, omega = hemisphere()
    c2 = towards[:, 2] ** 2
    for m in (0.2, 0.4):
        printed = np.exp(-(1 - c2) / c2 / m**2) / (m**2 * c2**2)
        assert (printed * towards[:, 2] * omega).sum() == pytest.approx(np.pi, rel=2e-3)
        whole = (models.beckmann(towards[:, 2], m) * towards[:, 2] * omega).sum()
        assert whole == pytest.approx(1, rel=2e-3)


def test_cook_torrance_keeps_energy_only_with_the_4_that_is_printed_away(monkeypatch):
    """What a white facet sends back of light from one direction, over all directions of view."""
    monkeypatch.setattr(models, "fresnel", lambda cosine, f0: np.ones_like(cosine))
    v, omega = hemisphere()
    n = np.tile([0.0, 0.0, 1.0], (len(v), 1))
    for angle in (0.0, 40.0, 70.0):
        a = np.radians(angle)
        l = np.tile([np.sin(a), 0.0, np.cos(a)], (len(v), 1))
        lobe = models.cook_torrance(n, l, v, 0.3, 0.04)
        share = (lobe * v[:, 2] * omega).sum() / np.cos(a)
        assert 0.85 < share <= 1.0
        # (n . l) / (n . v) F G D as printed, per irradiance (n . l) of the surface
        printed = (4 * np.cos(a) * lobe * v[:, 2] * omega).sum() / np.cos(a)
        assert printed > 1


def test_fresnel_is_the_exact_one():
    c = np.linspace(0.01, 1, 50)
    index = 1.4
    f0 = fresnel.normal_reflectance(1 / index)
    np.testing.assert_allclose(models.fresnel(c, f0), fresnel.reflectance(c, 1 / index), rtol=1e-9)


def test_phongs_and_blinns_reflection_is_not_reciprocal():
    """Divided by (n . l), which the texts do: light and eye cannot change places."""
    n, l, v = (np.array([unit]) for unit in ([0.0, 0, 1], [0.6, 0, 0.8], [-0.28, 0, 0.96]))
    for lobe in (models.phong, models.blinn_phong):
        there, back = lobe(n, l, v, 10)[0] / 0.8, lobe(n, v, l, 10)[0] / 0.96
        assert there / back == pytest.approx(0.96 / 0.8)
    # Cook and Torrance's is: F G D / (4 (n . l) (n . v))
    there, back = (models.cook_torrance(n, *pair, 0.3, 0.04)[0] for pair in ((l, v), (v, l)))
    assert there / 0.8 == pytest.approx(back / 0.96)


def test_ambient_light_is_the_mean_over_all_directions():
    panels = {"a": Panel((0, 1, 0), 3.0, (1, 2, 3)), "b": Panel((1, 0, 0), 0.0, (0.1, 0.1, 0.1))}
    around = Environment((0.2, 0.2, 0.2), panels)
    pixels = around.radiance_of_panels(directions(64).reshape(-1, 3)).reshape(64, 128, 3)
    want = (pixels * solid_angles(64)[..., None]).sum(axis=(0, 1)) / (4 * np.pi)
    np.testing.assert_allclose(Surroundings(around).mean(), want, rtol=1e-3)


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ({"medium": "skin"}, "material.medium is 'skin'; expected none"),
        ({"model": "gouraud"}, "material.model is 'gouraud'; expected one of 'lambert'"),
        ({"albedo": (0.6, 0.6, 0.6), "k_t": (0.5, 0, 0)}, "k_t is 1.1; expected at most 1"),
        ({"normal_map": "n.png"}, "expected albedo_map alone"),
    ],
)
def test_what_does_not_go_together_is_refused(field, message):
    with pytest.raises(InputError) as caught:
        Shading(**field)
    assert message in str(caught.value) and "\n" not in str(caught.value)
