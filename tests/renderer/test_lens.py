"""A thin lens: edges spread by the disc that its formula gives, and nothing else changes."""

import numpy as np
import pytest

import renderer
from renderer.passes.lens import confusion
from renderer.scene import Camera
from stimuli import scenes

CAMERA = {"height_mm": 100.0, "yaw_deg": 0.0, "pitch_deg": 0.0, "fov_y_deg": 10.0}


def edge(f_number, focus_mm, supersample=1):
    """The left edge of a bright sheet before a black backdrop, along a row: (left of, across)."""
    table = {
        "objects": {"sheet": {"shape": "sheet", "size_mm": [60.0, 90.0]}},
        "materials": {"sheet": {"medium": "", "albedo": [0.7] * 3, "specular": 0.0}},
        "environment": {"ambient": [1.0] * 3},
        "camera": {"framing": "flat", **CAMERA, "f_number": f_number, "focus_mm": focus_mm},
        "picture": {"tone_map": "linear", "exposure": 1.0, "centre": [0.0] * 3, "edge": [0.0] * 3},
    }
    staged = scenes.stage(scenes.read_scene(table))
    with (
        renderer.Renderer(staged.graph, (128, 128), supersample, rays=8, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        image = frame.render(renderer.make("none")).image.astype(float) / 255
    linear = np.where(image <= 0.04045, image / 12.92, ((image + 0.055) / 1.055) ** 2.4)
    return linear[40:90, :64, 1].mean(axis=0)


def spread(row):
    """Standard deviation in pixels of the edge's derivative."""
    steps = np.abs(np.diff(row))
    steps[steps < 0.004] = 0  # the dither
    at = np.arange(len(steps)) @ steps / steps.sum()
    return np.sqrt((np.arange(len(steps)) - at) ** 2 @ steps / steps.sum())


@pytest.mark.parametrize("supersample", [1, 2])
def test_an_edge_out_of_focus_is_spread_by_its_disc(supersample):
    sharp, far = edge(0.0, 0.0, supersample), edge(3.0, 60.0, supersample)
    camera = Camera("flat", **CAMERA, f_number=3.0, focus_mm=60.0)
    lens = confusion(camera, 128)
    radius = lens.spread * (1 - lens.focus_mm / camera.distance_mm)
    assert 2 < radius < 12
    assert spread(sharp) < 0.6
    assert spread(far) == pytest.approx(radius / 2, rel=0.12)  # a disc's, along an axis
    assert far[-1] == pytest.approx(sharp[-1], rel=0.01) and far[:4].max() < 0.01
    assert far.sum() == pytest.approx(sharp.sum(), rel=0.03)  # the light stays where it was


def test_an_edge_in_focus_stays_sharp():
    assert spread(edge(8.0, 0.0)) < 0.6


def test_the_disc_is_that_of_the_formula():
    """85 mm at f/8 from 1 m: half of f^2 / (N (s - f)) over the sensor's height."""
    fov = float(np.degrees(2 * np.arctan(12.0 / 85.0)))
    camera = Camera("x", height_mm=2000 * 12 / 85, yaw_deg=0.0, fov_y_deg=fov, f_number=8.0)
    assert camera.distance_mm == pytest.approx(1000.0)
    lens = confusion(camera, 2400)
    assert lens.spread == pytest.approx(0.5 * 85**2 / (8 * 915) / 24 * 2400)
    assert confusion(Camera("x", height_mm=100.0), 100) is None
