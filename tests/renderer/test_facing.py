"""What is not drawn adds nothing: pictures are the same with all lamps and over all tiles."""

import numpy as np
import pytest

import renderer
from renderer.frame import Frame
from renderer.passes import facing
from renderer.scene.lights import DistantLight, PointLight
from renderer.techniques.cover import ROUNDING_PX, TILE, Cover
from stimuli import scenes

SCENE = {
    "objects": {
        "ball": {"shape": "sphere", "radius_mm": 18.0},
        "far": {"shape": "sphere", "radius_mm": 6.0, "position_mm": [26.0, 8.0, -10.0]},
        "slab": {
            "shape": "slab",
            "size_mm": [12.0, 60.0, 3.0],
            "position_mm": [-24.0, 0.0, 0.0],
        },
    },
    "materials": {
        "ball": {"medium": "skin"},
        "far": {"medium": "deon_luebke"},
        "slab": {"medium": ""},
    },
    "lights": {
        "key": {"direction": [-0.6, 0.5, 0.7], "irradiance": [3.0, 3.0, 3.0]},
        "rim": {"direction": [0.5, 0.5, -0.9], "irradiance": [3.0, 2.0, 2.0]},
        "near": {
            "kind": "point",
            "position_mm": [60.0, 0.0, 20.0],
            "irradiance": [9000.0, 9000.0, 9000.0],
            "radius_mm": 12.0,
            "attenuation": [0.0, 0.0, 1.0],
        },
    },
    "camera": {"framing": "ball", "height_mm": 60.0, "yaw_deg": 10.0},
}
NAMES = ("none", "golubev", "golubev_plus", "jimenez_separable", "jimenez_gaussian", "subdermal")


def drawn():
    """Shared buffers, the light that comes through, and results of techniques, in two pieces."""
    graph = scenes.stage(scenes.read_scene(SCENE)).graph
    with (
        renderer.Renderer(graph, (128, 96), 2, rays=8, shadow_map=256) as drawing,
        drawing.frame() as frame,
    ):
        made = [texture.read().copy() for texture in frame.surface.textures]
        for name in NAMES:
            result = frame.render(renderer.make(name, {}))
            made += [result.image, result.samples]
        through = renderer.make("golubev", {}).transmission
        return [*made, frame.transmitted(through).read()[..., :3].copy()]


@pytest.fixture
def cut(monkeypatch):
    """Pictures in several pieces."""
    monkeypatch.setattr("renderer.passes.pieces.PIECE_PIXELS", 256 * 80)


def test_what_is_left_out_adds_nothing(cut, monkeypatch):
    grouped, found = [], facing.groups

    def watched(faces, can):
        made = found(faces, can)
        grouped.append(len(made))
        return made

    monkeypatch.setattr(facing, "groups", watched)
    little = drawn()
    assert max(grouped) > 3
    monkeypatch.setattr(facing, "groups", lambda faces, can: found(faces, np.ones_like(can)))
    monkeypatch.setattr(Frame, "_cover", lambda *_: None)
    for k, (one, all_of_it) in enumerate(zip(little, drawn(), strict=True)):
        np.testing.assert_array_equal(one, all_of_it, err_msg=str(k))
    assert little[-1].any()


def test_a_lamp_is_left_out_where_all_corners_turn_away():
    """A triangle that looks along +z, under lamps around it, and the angles at which they go."""
    at = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    corners = facing.Corners(at, np.tile([0.0, 0.0, 2.0], (3, 1)), np.array([[0, 1, 2]]))

    def lamp(degrees, radius_deg=0.0):
        turn = np.radians(degrees)
        towards = (float(np.sin(turn)), 0.0, float(np.cos(turn)))
        return DistantLight(direction=towards, radius_deg=radius_deg)

    lamps = [lamp(0), lamp(94), lamp(95), lamp(180), lamp(95, radius_deg=2.0)]
    assert corners.lit(lamps).ravel().tolist() == [True, True, False, False, True]
    assert corners.lit_through(lamps, 0.0).ravel().tolist() == [False, True, True, True, True]
    assert corners.lit_through([lamp(60), lamp(80)], 0.3).ravel().tolist() == [False, True]
    dark = DistantLight(direction=(0.0, 0.0, -1.0), shadow=False)
    assert not corners.lit_through([dark], 0.0).any()  # without a map nothing is known of thickness
    near = PointLight(irradiance=(1.0,) * 3, position_mm=(0.3, 0.3, -0.05), radius_mm=1.0)
    assert corners.lit([near]).all()
    assert corners.behind(np.array([0.0, 0.0, -5.0])).all()
    assert not corners.behind(np.array([0.0, 0.0, 5.0])).any()


def test_windows_hold_what_scatters_and_what_its_light_comes_from():
    tiles = np.zeros((4, 3), bool)
    tiles[1, 0] = tiles[1, 2] = tiles[2, 2] = True
    cover = Cover(tiles, 150, 140, 40, 90, 120, 2.0)
    assert cover.scattering(0.0) == [(0, 50, 64, 30), (128, 50, 22, 30)]
    low, high = 90 - 20 - ROUNDING_PX, 120 + 20 + ROUNDING_PX
    assert min(y for _, y, _, _ in cover.scattering(10.0)) == max(low, TILE) - 40
    assert max(y + h for _, y, _, h in cover.scattering(10.0)) == high - 40
    everything = np.zeros((140, 150), int)
    for x, y, width, height in [*cover.rest(), *cover.scattering(1e3)]:
        everything[y : y + height, x : x + width] += 1
    assert (everything == 1).all()
