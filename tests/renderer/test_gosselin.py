"""Poisson blurs: what twelve taps and their middle do, once and several times."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.errors import InputError
from renderer.techniques import gosselin
from stimuli import scenes
from tests.renderer.slab import surface_edge_response, width_mm
from tests.renderer.test_techniques import SKIN

TECHNIQUE = renderer.make("gosselin", {"size": 1024})


def test_the_taps_moments():
    """Computed from the printed list: off the middle, and wider along u than along v."""
    np.testing.assert_allclose(gosselin.MEAN, (0.0281, -0.0966), atol=1e-4)
    np.testing.assert_allclose((gosselin.POISSON**2).sum() / 13, 0.6464, atol=1e-4)
    np.testing.assert_allclose(gosselin.VARIANCE, (0.352, 0.285), atol=1e-3)


def test_a_slab_answers_as_the_gaussian_that_the_blurs_tend_to():
    u, got, _ = surface_edge_response(TECHNIQUE)
    tends_to = TECHNIQUE.edge(SKIN, u)
    np.testing.assert_allclose(got, tends_to, atol=0.035)  # four passes of a few taps
    np.testing.assert_allclose(got, got[:, :1].repeat(3, axis=1), atol=1e-6)  # one blur for all
    assert (TECHNIQUE.fit_error(SKIN) > 0.02).all()  # what one Gaussian cannot follow


def test_taps_as_printed_move_the_light_and_widen_it_unevenly():
    """Along u, by blurs times the mean of the taps; the variance is that along u alone."""
    printed = renderer.make("gosselin", {"size": 1024, "turned": False})
    u, turned, _ = surface_edge_response(TECHNIQUE)
    v, moved, _ = surface_edge_response(printed)
    radius = TECHNIQUE.radius_mm(SKIN)

    def middle(x, response):
        return np.interp(-0.5, -np.minimum.accumulate(response[:, 0]), x)

    shift = 4 * gosselin.MEAN[0] * radius
    assert abs(middle(u, turned)) < 0.02
    assert middle(v, moved) == pytest.approx(-shift, abs=0.03)
    wider = np.sqrt(gosselin.VARIANCE[0] / gosselin.VARIANCE.mean())
    assert width_mm(v, moved)[0] / width_mm(u, turned)[0] == pytest.approx(wider, abs=0.03)


def test_a_radius_in_texels_follows_the_atlas():
    fine, coarse = (
        width_mm(
            *surface_edge_response(
                renderer.make("gosselin", {"kernel": "texels", "radius_texels": 12.0, "size": size})
            )[:2]
        )[0]
        for size in (1024, 512)
    )
    assert coarse / fine == pytest.approx(2.0, rel=0.1)


def test_an_artists_map_scales_the_kernel(tmp_path):
    """Half grey with scales (2, 1) is a radius of 2 x 128 / 255 + 1 everywhere (eq. 12)."""
    file = tmp_path / "kernel.png"
    Image.fromarray(np.full((4, 4), 128, np.uint8)).save(file)
    painted = {"kernel_map": str(file)}
    scaled = replace(TECHNIQUE, kernel_scale=(2.0, 1.0))
    _, got, _ = surface_edge_response(scaled, **painted)
    whole = replace(TECHNIQUE, kernel_scale=(0.0, 2 * 128 / 255 + 1))
    _, expected, _ = surface_edge_response(whole)
    np.testing.assert_allclose(got, expected, atol=2e-3)
    with pytest.raises(InputError, match=r"gosselin.kernel_scale is \(0, 0\); expected one of"):
        renderer.make("gosselin", {"kernel_scale": [0.0, 0.0]})


def linear(image):
    """Light in [0, 1] of an 8-bit sRGB image, IEC 61966-2-1."""
    x = image / 255.0
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def test_highlights_fade_with_the_luminance_of_the_blurred_light():
    """Eq. 18: of the picture with its own highlights exposure (1 - L / L_lamp) specular is gone."""
    table = {
        "objects": {"ball": {"shape": "sphere", "radius_mm": 20.0}},
        "materials": {"ball": {"medium": "deon_luebke", "roughness": 0.3, "specular": 6.0}},
        "lights": {"key": {"direction": [1.0, 0.0, 0.0], "irradiance": [2.0, 2.0, 2.0]}},
        "camera": {"framing": "ball", "height_mm": 50.0, "angle": "front"},
        "picture": {"tone_map": "linear", "exposure": 0.5},
    }
    graph = scenes.stage(scenes.read_scene(table)).graph
    technique = renderer.make("gosselin", {"size": 256})
    with (
        renderer.Renderer(graph, (48, 48), 1, rays=8, shadow_map=256) as drawing,
        drawing.frame() as frame,
    ):
        own, dimmed = (
            linear(frame.render(replace(technique, specular=kind)).image)
            for kind in ("own", "dimmed")
        )
        specular = frame.surface.textures[1].read()[..., :3].astype(float)
        with technique.scatter(frame.inputs(technique.transmission)).target as target:
            blurred = target.textures[0].read()[..., :3].astype(float)
    share = np.clip(blurred @ [0.2125, 0.7154, 0.0721] / 2.0, 0, 1)[..., None]
    expected = own - 0.5 * (1 - share) * specular
    shown = (own < 0.98).all(axis=-1) & (specular > 0).all(axis=-1)
    assert shown.sum() > 100 and (own - dimmed)[shown].max() > 0.05
    np.testing.assert_allclose(dimmed[shown], expected[shown], atol=8e-3)  # 8 bits
