"""Ray casting, recursive ray tracing and Monte Carlo against closed forms."""

import numpy as np
import pytest

import renderer
from renderer.illumination import paths
from renderer.illumination.models import unit
from renderer.illumination.rays import World, camera_rays, picture
from renderer.illumination.whitted import trace
from renderer.scene.picture import TONE_MAPS, Picture
from stimuli import scenes
from tests.illumination.test_models import radiance

PANELS = {
    "environment": {
        "panels": {
            "a": {"direction": [1, 1, 0], "sharpness": 2.0, "radiance": [1.0, 0.2, 0.1]},
            "b": {"direction": [-1, 0, -1], "sharpness": 1.0, "radiance": [0.1, 0.3, 1.0]},
        }
    }
}
WHITE = {"environment": {"ambient": [1.0, 1.0, 1.0]}}
BLACK = [0.0, 0.0, 0.0]


def world(scene, **material):
    """A ball of radius 50 mm of this material in this environment."""
    table = {
        "objects": {"ball": {"shape": "sphere", "radius_mm": 50.0}},
        "materials": {"ball": {"kind": "shading", **material}},
    }
    return World(scenes.stage(scenes.read_scene(scenes.merge(table, scene))).graph)


@pytest.fixture(scope="module")
def rays():
    """Parallel rays on a ball of 50 mm: (origins, directions, analytic points, normals)."""
    rng = np.random.default_rng(3)
    r, phi = 45 * np.sqrt(rng.random(2000)), rng.uniform(0, 2 * np.pi, 2000)
    x, y = r * np.cos(phi), r * np.sin(phi)
    points = np.column_stack([x, y, np.sqrt(50.0**2 - x**2 - y**2)])
    towards = np.tile([0.0, 0.0, -1.0], (2000, 1))
    return points + [0, 0, 400.0], towards, points, points / 50.0


def test_rays_meet_the_sphere_where_they_should(rays):
    origins, towards, points, normals = rays
    hits = world(PANELS).meet(origins, towards)
    assert len(hits.ray) == len(points)
    np.testing.assert_allclose(hits.points, points, atol=0.05)
    np.testing.assert_allclose(hits.normals, normals, atol=2e-3)
    assert not hits.behind.any()


def snell(d, n, eta):
    """Refraction by the angles themselves: the tangent part shrinks by eta."""
    along = d - (d * n).sum(axis=1, keepdims=True) * n
    bent = eta * along
    return bent - np.sqrt(1 - (bent**2).sum(axis=1, keepdims=True)) * n


def test_a_mirror_and_a_glass_ball_show_the_environment_where_optics_puts_it(rays):
    origins, towards, points, normals = rays
    mirror = world(PANELS, albedo=BLACK, k_s=BLACK, k_r=[1.0, 1.0, 1.0])
    seen = towards - 2 * (towards * normals).sum(axis=1, keepdims=True) * normals
    got = trace(mirror, origins, towards, depth=1)
    np.testing.assert_allclose(got, mirror.environment(seen), atol=5e-3)

    glass = world(PANELS, albedo=BLACK, k_s=BLACK, k_t=[1.0, 1.0, 1.0], index=1.5)
    inside = snell(towards, normals, 1 / 1.5)
    chord = -2 * (points * inside).sum(axis=1, keepdims=True)
    leaves = (points + chord * inside) / 50.0
    out = snell(inside, -leaves, 1.5)
    np.testing.assert_allclose(trace(glass, origins, towards), glass.environment(out), atol=0.02)
    # a tree that is cut off before the light gets out brings nothing
    assert not trace(glass, origins, towards, depth=1).any()


def test_in_even_light_what_loses_nothing_looks_like_its_surroundings(rays):
    """White furnace: k_d + k_r + k_t = 1 under a radiance of 1."""
    origins, towards, *_ = (part[:300] for part in rays)
    matt = world(WHITE, albedo=[0.7] * 3, k_r=[0.3] * 3, k_s=BLACK)
    np.testing.assert_allclose(trace(matt, origins, towards), 1, atol=1e-9)
    glass = world(WHITE, albedo=BLACK, k_s=BLACK, k_r=[0.2] * 3, k_t=[0.8] * 3)
    np.testing.assert_allclose(trace(glass, origins, towards, 25, least=0), 1, atol=1e-3)
    found = paths.trace(matt, origins, towards, np.random.default_rng(0))
    np.testing.assert_allclose(found, 1, atol=1e-9)


def test_a_shadow_ray_leaves_ambient_light_alone():
    table = {
        "objects": {
            "floor": {"shape": "slab", "size_mm": [400.0, 10.0, 400.0]},
            "ball": {"shape": "sphere", "radius_mm": 30.0, "position_mm": [0.0, 80.0, 0.0]},
        },
        "materials": {
            name: {"kind": "shading", "model": "lambert", "albedo": [0.5] * 3}
            for name in ("floor", "ball")
        },
        "lights": {"sun": {"direction": [0, 1, 0], "irradiance": [2.0] * 3}},
        "environment": {"ambient": [0.1] * 3},
    }
    room = World(scenes.stage(scenes.read_scene(table)).graph)
    x = np.array([0.0, 25.0, 35.0, 100.0])
    start = np.column_stack([x, np.full(4, 20.0), np.zeros(4)])
    got = trace(room, start, np.tile([0.0, -1.0, 0.0], (4, 1)), depth=0)[:, 0]
    lit = 0.05 + 0.5 * 2 / np.pi
    np.testing.assert_allclose(got, [0.05, 0.05, lit, lit], rtol=1e-6)


def test_monte_carlo_gathers_an_emitting_square():
    """A matt point below a square panel: its form factor in closed form (Howell, B-3)."""
    table = {
        "objects": {
            "floor": {"shape": "sheet", "size_mm": [10.0, 10.0], "thickness_mm": 1.0},
            "panel": {
                "shape": "sheet",
                "size_mm": [200.0, 200.0],
                "thickness_mm": 1.0,
                "position_mm": [0.0, 0.0, 101.0],
            },
        },
        "materials": {
            "floor": {"kind": "shading", "model": "lambert", "albedo": [0.5] * 3},
            "panel": {"kind": "shading", "albedo": BLACK, "k_s": BLACK, "emission": [2, 4, 6]},
        },
        "environment": {"ambient": [1e-9] * 3},
    }
    room = World(scenes.stage(scenes.read_scene(table)).graph)
    count = 20000
    start = np.tile([0.0, 0.0, 10.0], (count, 1))
    found = paths.trace(room, start, np.tile([0, 0, -1.0], (count, 1)), np.random.default_rng(1))
    s = 1 / np.sqrt(2)  # half a side over the height is 1
    factor = 4 / np.pi * s * np.arctan(s)
    error = found.std(axis=0) / np.sqrt(count)
    want = 0.5 * factor * np.array([2.0, 4.0, 6.0])
    assert (error < 0.01 * want).all()
    assert (np.abs(found.mean(axis=0) - want) < 4 * error).all()


def test_pictures_of_rays_are_developed_as_the_card_does(ball):
    graph = ball(model="phong", exponent=20.0)
    with renderer.Renderer(graph, (64, 48), 1, rays=4, shadow_map=64) as drawing:
        for k, tone_map in enumerate(TONE_MAPS):
            graded = {"saturation": 1.3, "power": 0.9} if k % 2 else {}
            own = Picture(exposure=1.2, tone_map=tone_map, **graded)
            with drawing.frame(picture=own) as frame:
                seen, on = radiance(frame)
                image = frame.render(renderer.make("none")).image
            away = np.abs(own.encode(seen)[on].astype(int) - image[on])
            assert away.max() <= 2 and (away <= 1).mean() > 0.99


def test_camera_rays_go_through_the_pixels_of_the_card(ball):
    """The silhouettes agree but for the rim."""
    graph = ball()
    with (
        renderer.Renderer(graph, (64, 48), 1, rays=4, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        _, on = radiance(frame)
        view = frame.view
    met = np.zeros(64 * 48, bool)
    met[World(graph).meet(*camera_rays(view, 64, 48)).ray] = True
    assert (met.reshape(48, 64) != on).sum() <= 4
    flat = picture(lambda o, d: np.repeat(unit(d)[:, :1], 3, axis=1), view, (64, 48), 2)
    assert (np.diff(flat[24, :, 0]) > 0).all()
