"""Light of every kind: it adds, it falls off, it is shaded; and the drivers agree on all of it."""

import os
import subprocess
import sys
from ctypes.util import find_library
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import renderer
from renderer.scene import (
    Camera,
    DistantLight,
    Environment,
    Material,
    Panel,
    PointLight,
    SpotLight,
)
from renderer.scene.graph import SceneGraph
from stimuli import scenes
from tests.renderer.conftest import small

FIVE = {
    "sun": DistantLight((1.5, 1.4, 1.2), direction=(-0.5, 0.6, 0.7), radius_deg=1.0),
    "back": DistantLight((0.5, 0.6, 0.9), direction=(0.6, 0.3, -0.8)),
    "near": PointLight((0.05, 0.03, 0.02), position_mm=(120.0, 90.0, 160.0), radius_mm=8.0),
    "spot": SpotLight(
        (0.10, 0.12, 0.10), position_mm=(-60.0, 200.0, 150.0), axis=(0.3, -0.9, -0.5)
    ),
    "bare": PointLight((0.02, 0.02, 0.03), position_mm=(0.0, -150.0, 200.0), shadow=False),
}
CAMERA = Camera("test", height_mm=130.0, yaw_deg=20.0, pitch_deg=15.0)


def table(lights, ambient=0.0):
    """A sphere and a slab of two media, under these lights."""
    return {
        "subject": "ball",
        "objects": {
            "ball": {"shape": "sphere", "radius_mm": 30.0},
            "block": {"shape": "slab", "size_mm": [30, 50, 30], "position_mm": [50, -5, 0]},
        },
        "materials": {
            "ball": {"medium": "deon_luebke", "albedo": [0.8, 0.7, 0.6]},
            "block": {"medium": "skin1", "albedo": [0.9, 0.9, 0.8]},
        },
        "lights": {name: light.plain() for name, light in lights.items()},
        "environment": {"ambient": [ambient] * 3},
    }


def drawn(scene_table, techniques, size=(128, 96)):
    """Irradiance (H, W, 4), and scattered light of each technique, of one frame."""
    staged = scenes.stage(scenes.read_scene(scene_table))
    options = {"size": size, "supersample": 1, "rays": 16, "shadow_map": 1024}
    with renderer.Renderer(staged.graph, **options) as drawing, drawing.frame(CAMERA) as frame:
        buffers = {"irradiance": frame.surface.textures[0].read().copy()}
        for name in techniques:
            # what comes through follows the range of depth that all maps share: left out
            technique = replace(small(name), translucency="none")
            with frame.scatter(technique) as target:
                buffers[name] = target.textures[0].read()[..., :3].copy()
        return buffers


#: Contrast decides (golubev_plus), or the light's spread about a tile (subdermal), or the lamp
#: towards which it is thinnest (deon_luebke's maps).
NOT_LINEAR = ("golubev_plus", "subdermal", "deon_luebke")


def test_light_adds_in_irradiance_and_through_every_linear_technique():
    """Five lamps are the sum of two parts of them, each of more than one kind."""
    linear = [n for n in renderer.TECHNIQUES if n not in NOT_LINEAR]
    together = drawn(table(FIVE), linear)
    parts = ("sun", "spot"), ("back", "near", "bare")
    assert sorted(name for part in parts for name in part) == sorted(FIVE)
    apart = [drawn(table({name: FIVE[name] for name in part}), linear) for part in parts]
    scatters = together["irradiance"][..., 3] > 0
    assert scatters.mean() > 0.2
    for key in ("irradiance", *linear):
        total = sum(one[key][..., :3] for one in apart)[scatters]
        miss = np.abs(together[key][..., :3][scatters] - total) / (total + 0.01)
        # maps share one range of depth: single taps at the rim of a shadow fall on the other side
        assert np.quantile(miss, 0.98) < 1e-3 and miss.max() < 0.05, (key, miss.max())


def test_two_media_in_one_picture_have_ids_of_their_own():
    buffers = drawn(table(FIVE), ["golubev"])
    assert set(np.unique(buffers["irradiance"][..., 3])) == {0.0, 1.0, 2.0}


def irradiance_on_a_sheet(light, **scene):
    """(E at the middle of a sheet that faces +z, E over it) under one lamp."""
    made = {
        "objects": {"sheet": {"shape": "sheet", "size_mm": [100.0, 100.0], **scene}},
        "materials": {"sheet": {"medium": "", "albedo": [0.0, 0.0, 0.0]}},
        "lights": {"lamp": light.plain()},
        "camera": {"framing": "flat", "height_mm": 90.0, "yaw_deg": 0.0, "pitch_deg": 0.0},
    }
    staged = scenes.stage(scenes.read_scene(made))
    with (
        renderer.Renderer(staged.graph, (64, 64), 1, rays=8, shadow_map=512) as drawing,
        drawing.frame() as frame,
    ):
        light_map = frame.surface.textures[0].read()[..., 0].copy()
    return light_map[32, 32], light_map


@pytest.mark.parametrize(
    ("light", "expected"),
    [
        (DistantLight((2.0,) * 3, direction=(0.0, 0.0, 1.0)), 2.0),
        (DistantLight((2.0,) * 3, direction=(0.0, np.sqrt(3), 1.0)), 1.0),
        (PointLight((2.0,) * 3, position_mm=(0.0, 0.0, 501.0)), 8.0),
        (PointLight((2.0,) * 3, position_mm=(0.0, 0.0, 501.0), attenuation=(1.0, 2.0, 4.0)), 2 / 3),
        (
            PointLight((2.0,) * 3, position_mm=(0.0, 0.0, 501.0), attenuation_limit=1.0),
            2.0,
        ),
        (SpotLight((2.0,) * 3, position_mm=(0.0, 0.0, 1001.0), axis=(0.0, 0.0, -1.0)), 2.0),
        (SpotLight((2.0,) * 3, position_mm=(0.0, 0.0, 1001.0), axis=(0.0, 1.0, -0.1)), 0.0),
    ],
)
def test_lamps_give_the_irradiance_of_their_law(light, expected):
    """Cosine law, inverse square law (irradiance is that at a metre), the three constants."""
    got, _ = irradiance_on_a_sheet(light)
    assert got == pytest.approx(expected, rel=4e-3, abs=1e-6)


@pytest.mark.parametrize("radius_deg", [2.0, 8.0, 20.0])
def test_a_large_lamp_lights_past_the_middle_of_a_ball(radius_deg):
    """The horizon cuts its disc, and the ball does not shade itself."""
    light = DistantLight((2.0,) * 3, direction=(1.0, 0.0, 0.0), radius_deg=radius_deg)
    made = {
        "objects": {"ball": {"shape": "sphere", "radius_mm": 40.0}},
        "materials": {"ball": {"medium": ""}},
        "lights": {"lamp": light.plain()},
        "camera": {
            "framing": "ball",
            "height_mm": 96.0,
            "yaw_deg": 0.0,
            "pitch_deg": 0.0,
            "fov_y_deg": 0.5,  # nearly parallel: a pixel is a millimetre
        },
    }
    staged = scenes.stage(scenes.read_scene(made))
    with (
        renderer.Renderer(staged.graph, (97, 97), 1, rays=8, shadow_map=1024) as drawing,
        drawing.frame() as frame,
    ):
        irradiance = frame.surface.textures[0].read()[48, :, 0].copy()
    x = np.arange(-36, 37) / 40 * 96 / 97
    row = np.column_stack([x, np.zeros_like(x), np.sqrt(1 - x * x)])
    got = irradiance[48 - 36 : 48 + 37]
    # a disc of even radiance: its projection on a facing plane is even, the solid angle 1 / cosine
    share, spin = np.meshgrid((np.arange(64) + 0.5) / 64, 2 * np.pi * np.arange(64) / 64)
    y, z = (np.sin(np.radians(radius_deg)) * np.sqrt(share) * f(spin) for f in (np.cos, np.sin))
    towards = np.column_stack([np.sqrt(1 - y * y - z * z).ravel(), y.ravel(), z.ravel()])
    expected = 2 * (np.maximum(row @ towards.T, 0) / towards[:, 0]).mean(axis=1)
    assert (expected[row[:, 0] < 0] > 0).any()
    np.testing.assert_allclose(got, expected, atol=0.03)


@pytest.mark.parametrize("shadow", [True, False])
def test_a_lamp_among_the_objects_casts_shadows_all_around(shadow):
    """A lamp inside a room: walls are lit on all sides, and dark behind a ball."""
    made = {
        "objects": {
            "room": {
                "shape": "box",
                "size_mm": [200.0, 200.0, 200.0],
                "left_albedo": [0.0, 0.0, 0.0],
                "right_albedo": [0.0, 0.0, 0.0],
            },
            "ball": {"shape": "sphere", "radius_mm": 20.0, "position_mm": [0.0, 0.0, -50.0]},
        },
        "materials": {
            "room": {"medium": "", "albedo": [0.0, 0.0, 0.0]},
            "ball": {"medium": "", "albedo": [0.0, 0.0, 0.0]},
        },
        "lights": {"lamp": PointLight((0.01,) * 3, position_mm=(0, 0, 0), shadow=shadow).plain()},
        "camera": {
            "framing": "in",
            "height_mm": 190.0,
            "yaw_deg": 0.0,
            "pitch_deg": 0.0,
            "fov_y_deg": 50.0,
        },
    }
    staged = scenes.stage(scenes.read_scene(made))
    with (
        renderer.Renderer(staged.graph, (96, 96), 1, rays=8, shadow_map=512) as drawing,
        drawing.frame() as frame,
    ):
        light = frame.surface.textures[0].read()[..., 0].copy()
        drawing.context.make_current()
        assert len(drawing.lamps.layers) == (6 if shadow else 0)
    left, right, top, bottom = light[48, 8], light[48, 88], light[8, 48], light[88, 48]
    assert min(left, right, top, bottom) > 0.2
    behind = light[48, 32:41].min()  # of the back wall beside the ball, where its shadow falls
    assert (behind < 0.02) == shadow


def test_an_environment_map_lights_as_the_constant_it_holds(tmp_path):
    """A white .hdr of radiance 0.5: E = pi / 2 on a convex body, turned or not."""
    import OpenImageIO as oiio

    file = tmp_path / "white.hdr"
    image = oiio.ImageBuf(oiio.ImageSpec(64, 32, 3, oiio.FLOAT))
    oiio.ImageBufAlgo.fill(image, (0.5, 0.5, 0.5))
    assert image.write(str(file))
    made = table({}) | {"environment": {"map": str(file), "turn_deg": 40.0}}
    made["objects"] = {"ball": made["objects"]["ball"]}
    light = drawn(made, [])["irradiance"]
    inside = light[..., 3] > 0
    np.testing.assert_allclose(light[inside][:, 0], np.pi / 2, rtol=0.05)


def test_a_map_is_turned_towards_the_persons_left(tmp_path):
    """A bright patch straight ahead (+z), turned by 90 degrees, shines from +x."""
    import OpenImageIO as oiio

    from renderer.passes.environment import Surroundings

    pixels = np.zeros((64, 128, 3), np.float32)
    pixels[28:36, 60:68] = 50.0
    file = tmp_path / "spot.exr"
    image = oiio.ImageBuf(oiio.ImageSpec(128, 64, 3, oiio.FLOAT))
    image.set_pixels(oiio.ROI(), pixels)
    assert image.write(str(file))
    for turn, axis in ((0.0, [0, 0, 1]), (90.0, [1, 0, 0]), (-90.0, [-1, 0, 0])):
        around = Surroundings(Environment(map=str(file), turn_deg=turn))
        directions = np.array([[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 0, -1]], float)
        radiance = around.radiance(directions, 64.0)[:, 0]
        np.testing.assert_array_equal(directions[radiance.argmax()], axis)


def test_convolved_maps_keep_their_light():
    """Each layer holds the power of the map."""
    from renderer.scene import maps

    panel = Environment(panels={"p": Panel((0.3, 0.5, 0.8), 40.0, (1.0, 2.0, 3.0))})
    towards = maps.directions(64)
    pixels = panel.radiance_of_panels(towards.reshape(-1, 3)).reshape(64, 128, 3)
    power = (pixels * maps.solid_angles(64)[..., None]).sum(axis=(0, 1))
    for sharpness in (1.0, 16.0, 256.0):
        wide = maps.convolve(pixels.astype(np.float32), sharpness)
        got = (wide * maps.solid_angles(wide.shape[0])[..., None]).sum(axis=(0, 1))
        np.testing.assert_allclose(got, power, rtol=0.02)
    assert maps.solid_angles(32).sum() * 64 == pytest.approx(4 * np.pi)


def test_a_plain_pyrender_scene_is_drawn():
    """Its meshes, its lights and its camera, without a word of ours."""
    import pyrender
    import trimesh

    scene = pyrender.Scene(ambient_light=[0.1, 0.1, 0.1])
    ball = trimesh.creation.icosphere(4, 40.0)
    material = pyrender.MetallicRoughnessMaterial(baseColorFactor=[0.8, 0.2, 0.1, 1.0])
    scene.add(pyrender.Mesh.from_trimesh(ball, material=material))
    pose = np.eye(4)
    pose[:3, 3] = [0, 0, 300]
    scene.add(pyrender.PerspectiveCamera(yfov=0.4), pose=pose)
    scene.add(pyrender.DirectionalLight([1.0, 1.0, 1.0], 2.0), pose=pose)
    with (
        renderer.Renderer(scene, (64, 64), 1, rays=8, shadow_map=256) as drawing,
        drawing.frame() as frame,
    ):
        result = frame.render(renderer.make("none"))
    red, green, blue = result.image[32, 32].astype(int)
    assert red > 150 > green > blue and not result.samples.any()


def test_light_over_an_atlas_and_at_points_is_that_of_the_screen():
    """The same shading: irradiance at a place of a sphere agrees between the three domains."""
    staged = scenes.stage(
        scenes.read_scene(table({"sun": replace(FIVE["sun"], shadow=False)}, 0.2))
    )
    with (
        renderer.Renderer(staged.graph, (128, 96), 1, rays=64, shadow_map=512) as drawing,
        drawing.frame(CAMERA) as frame,
    ):
        ball = drawing.surfaces.surfaces[0]
        screen = frame.surface.textures[0].read().copy()
        view = drawing.subject
        with drawing.placed(ball, "ATLAS", (256, 128)) as atlas:
            light, place = (atlas.textures[k].read().copy() for k in (0, 5))
        assert (place[..., 3] > 0).mean() > 0.99
        np.testing.assert_allclose(
            np.linalg.norm(place[..., :3] - view, axis=2)[place[..., 3] > 0], 30.0, rtol=2e-3
        )
        rng = np.random.default_rng(1)
        faces = ball.item.primitive.faces
        chosen = rng.integers(0, len(faces), 200)
        weights = rng.dirichlet([1, 1, 1], 200)
        listed = drawing.surfaces.points(ball, chosen, weights, 20)
        with drawing.placed(ball, "POINTS", (20, 10), listed) as points:
            at, where = (points.textures[k].read().copy() for k in (0, 5))
        # a point's neighbour in the atlas has its light
        flat = place[..., :3].reshape(-1, 3)
        nearest = [np.linalg.norm(flat - p, axis=1).argmin() for p in where.reshape(-1, 4)[:, :3]]
        np.testing.assert_allclose(
            at.reshape(-1, 4)[:, 0], light.reshape(-1, 4)[nearest, 0], atol=0.05
        )
        assert screen[..., 0].max() == pytest.approx(light[..., 0].max(), rel=0.02)


PROGRAM = """
import hashlib, sys
import renderer
from renderer.scene import Camera
from stimuli import scenes
from tests.renderer.conftest import small
staged = scenes.stage(scenes.read_scene(scenes.load_table(sys.argv[1])))
with renderer.Renderer(staged.graph, (96, 64), 2, rays=8, shadow_map=256) as drawing:
    with drawing.frame() as frame:
        for name in renderer.TECHNIQUES:
            result = frame.render(small(name))
            data = result.image.tobytes() + result.samples.tobytes()
            print(name, hashlib.sha256(data).hexdigest())
"""
SCENE = """
subject = "ball"
objects.ball = { shape = "sphere", radius_mm = 30.0 }
objects.block = { shape = "slab", size_mm = [30.0, 50.0, 30.0], position_mm = [50.0, -5.0, 0.0] }
materials.ball = { medium = "deon_luebke", albedo = [0.8, 0.7, 0.6] }
materials.block = { medium = "deon_luebke", kind = "skin" }
lights.sun = { direction = [-0.5, 0.6, 0.7], irradiance = [3.0, 3.0, 3.0] }
lights.near = { kind = "point", position_mm = [120.0, 90.0, 160.0], irradiance = [0.1, 0.1, 0.1] }
environment = { ambient = [0.1, 0.1, 0.1] }
camera = { framing = "test", height_mm = 130.0, yaw_deg = 20.0, pitch_deg = 15.0 }
"""


@pytest.fixture(scope="module")
def bytes_of(tmp_path_factory):
    """bytes_of(platform, threads): the hash of every technique's picture, drawn once each."""
    scene = tmp_path_factory.mktemp("scene") / "scene.toml"
    scene.write_text(SCENE)

    @cache
    def run(platform, threads):
        variables = {"PYOPENGL_PLATFORM": platform, "LP_NUM_THREADS": str(threads)}
        process = subprocess.run(
            [sys.executable, "-c", PROGRAM, scene],
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
        )
        assert process.returncode == 0, process.stderr
        return process.stdout

    return run


def test_every_technique_gives_the_same_bytes_with_1_2_and_4_threads(bytes_of):
    first = bytes_of("egl", 1)
    assert len(set(first.split())) == 2 * len(renderer.TECHNIQUES)
    assert first == bytes_of("egl", 2) == bytes_of("egl", 4)


@pytest.mark.skipif(
    find_library("OSMesa") is None,
    reason="this distribution has no libosmesa6 (Mesa dropped it in 25.1)",
)
def test_every_technique_gives_the_same_bytes_by_egl_and_osmesa(bytes_of):
    assert bytes_of("egl", 2) == bytes_of("osmesa", 2)


def test_a_scene_without_light_or_surface_is_refused():
    from renderer.errors import InputError

    with pytest.raises(InputError, match="is dark"):
        scenes.read_scene(table({}))
    graph = SceneGraph(Environment((1.0, 1.0, 1.0)))
    with pytest.raises(InputError, match="no surface"):
        renderer.Renderer(graph)
    assert Material(medium="").scatters is False
