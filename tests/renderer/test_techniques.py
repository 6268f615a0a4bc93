"""Kernels, parameters, and what each technique must do on a flat patch and on the head."""

import dataclasses

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.techniques.golubev import disc
from renderer.techniques.jimenez_separable import demo_kernel, preintegrated_kernel

NAMES = list(renderer.TECHNIQUES)
SCATTERING = [name for name in NAMES if name != "none"]


def scatter(technique, inputs):
    """Scattered irradiance (H, W, 3) and samples (H, W), row 0 at the top."""
    out = technique.scatter(inputs)
    light, count = (t.read().copy() for t in out.target.textures)
    out.target.delete()
    return light[..., :3], count


@pytest.mark.parametrize("name", NAMES)
def test_every_technique_documents_and_checks_itself(name):
    technique = renderer.make(name)
    technique.self_check()
    assert technique.name == name and technique.paper and technique.title
    for field in dataclasses.fields(technique):
        assert field.metadata["source"], f"{name}.{field.name} has no source"
        assert (
            field.metadata["choices"]
            or field.metadata["low"]
            <= np.min(field.default)
            <= np.max(field.default)
            <= field.metadata["high"]
        )


@pytest.mark.parametrize(
    "name, parameters, words",
    [
        ("golubev", {"samples": 0}, "golubev.samples is 0"),
        ("golubev", {"samples": 2.5}, "expected an integer"),
        ("golubev", {"samples": "many"}, "expected an integer"),
        ("golubev", {"samples": True}, "expected an integer"),
        ("golubev", {"distance_mm": (1, 1)}, "expected 3 numbers"),
        ("golubev", {"distance_mm": (1, 1, float("nan"))}, "expected a number"),
        ("golubev_plus", {"base_samples": 22}, "expected fewer than samples"),
        ("golubev_plus", {"offset": 0.6}, "expected 0.0 to 0.5"),
        ("jimenez_separable", {"taps": 12}, "expected an odd number"),
        ("jimenez_separable", {"kernel": "cubic"}, "expected one of 'preintegrated', 'demo'"),
        ("jimenez_gaussian", {"colour": 1}, "has no parameter 'colour'"),
        ("golub", {}, "no technique 'golub'"),
    ],
)
def test_bad_parameters_are_refused_in_one_line(name, parameters, words):
    with pytest.raises(InputError, match=".") as caught:
        renderer.make(name, parameters)
    assert words in str(caught.value) and "\n" not in str(caught.value)


# The tables printed in the published separable SSS demo: centre weight, first tap's weight.
@pytest.mark.parametrize(
    "taps, centre, first",
    [
        (11, (0.560479, 0.669086, 0.784728), (0.00471692, 1.84771e-4, 5.07566e-5)),
        (17, (0.536343, 0.624624, 0.748867), (0.00317394, 1.34823e-4, 3.77269e-5)),
        (25, (0.530605, 0.613514, 0.739601), (9.73794e-4, 1.11862e-5, 9.43437e-7)),
    ],
)
def test_demo_kernel_is_the_published_one(taps, centre, first):
    _, weights = demo_kernel(taps)
    np.testing.assert_allclose(weights[taps // 2], centre, rtol=2e-6)
    np.testing.assert_allclose(weights[0], first, rtol=2e-5)


def test_preintegrated_kernel_is_exact_for_separable_light():
    """E(x) = cos(k x): the kernel's response is the profile's Hankel transform, sum w exp(-v k^2 /
    2).
    """
    from renderer.profiles import gaussians

    offsets, weights = preintegrated_kernel(201, 12.0)
    for k in (0.3, 0.8):
        got = (weights * np.cos(k * offsets)[:, None]).sum(axis=0)
        np.testing.assert_allclose(
            got,
            np.exp(-gaussians.SKIN_VARIANCE_MM2 * k * k / 2) @ gaussians.SKIN_WEIGHTS,
            atol=2e-3,
        )


def test_disc_is_drawn_by_area_of_energy():
    table = disc(22, 0.447)
    np.testing.assert_allclose(np.hypot(table[:, 0], table[:, 1]), table[:, 2], rtol=1e-12)
    from renderer.profiles import burley

    np.testing.assert_allclose(
        burley.cdf(table[:, 2], 0.447), (np.arange(22) + 0.5) / 22, atol=1e-12
    )


@pytest.mark.parametrize("name", NAMES)
def test_constant_irradiance_stays_constant_on_a_patch(name, patch):
    light = np.tile(np.array([3.1, 1.7, 0.4]), (360, 640, 1))
    out, count = scatter(renderer.make(name), patch(light))
    np.testing.assert_allclose(out, light, rtol=1e-3)
    assert (count[..., 0] >= 1).all()


@pytest.mark.parametrize("framing", list(renderer.FRAMINGS))
@pytest.mark.parametrize("name", NAMES)
def test_constant_irradiance_stays_constant_on_the_head(name, framing, frames, drawing):
    """Also across silhouettes, eyes and folds: nothing leaks in from what is not skin."""
    frame = frames[framing]
    drawing.context.make_current()
    mask = frame.surface.textures[0].read()[..., 3]
    light = np.where(mask[..., None] > 0, [2.0, 1.0, 0.5], [50.0, 60.0, 70.0])
    from renderer import gl

    data = np.dstack([light, mask]).astype(np.float32)[::-1]
    texture = gl.Texture(frame.width, frame.height, gl.GL.GL_RGBA32F, data=data)
    out, count = scatter(renderer.make(name), frame.inputs(False, texture))
    np.testing.assert_allclose(
        out[mask > 0], np.tile([2.0, 1.0, 0.5], (int(mask.sum()), 1)), rtol=1e-3
    )
    assert ((count[..., 0] > 0) == (mask > 0)).all()


def spot(radius_px=3, size=(360, 640)):
    y, x = np.mgrid[: size[0], : size[1]]
    inside = (x - size[1] // 2) ** 2 + (y - size[0] // 2) ** 2 <= radius_px**2
    return inside[..., None] * np.array([5.0, 5.0, 5.0])


@pytest.mark.parametrize("name", ["jimenez_gaussian", "jimenez_separable"])
def test_a_spot_keeps_its_energy(name, patch):
    light = spot()
    out, _ = scatter(renderer.make(name), patch(light))
    np.testing.assert_allclose(out.sum(axis=(0, 1)), light.sum(axis=(0, 1)), rtol=0.03)


@pytest.mark.parametrize("name", SCATTERING)
def test_red_travels_farther_than_green_and_blue(name, patch):
    """A lit half-plane: beyond the edge the light is red, within it red is missing."""
    light = np.zeros((360, 640, 3))
    light[:, :320] = 1
    out, _ = scatter(renderer.make(name), patch(light, depth_mm=250.0))
    row = out.mean(axis=0)
    shadow, lit = row[326:336].mean(axis=0), row[304:314].mean(axis=0)
    assert shadow[0] > 1.5 * shadow[1] > 0 and shadow[1] >= shadow[2]
    assert lit[0] < lit[1]
    np.testing.assert_allclose(row[:40], 1, atol=2e-2)
    np.testing.assert_allclose(row[-40:], 0, atol=2e-2)


@pytest.mark.parametrize("name", SCATTERING)
def test_the_blur_keeps_its_millimetres(name, patch):
    """The edge's red profile, in mm, is the profile's own edge response, at every distance (within
    the filter's sampling).
    """
    from renderer.profiles import gaussians

    light = np.zeros((360, 640, 3))
    light[:, :320] = 1
    for depth in (200.0, 320.0):
        inputs = patch(light, depth_mm=depth)
        out, _ = scatter(renderer.make(name), inputs)
        row = out[..., 0].mean(axis=0)
        mm = (np.arange(640) + 0.5 - 320) * depth / inputs.pixels_per_mm
        expected = gaussians.line_integral(mm, np.full(640, np.inf))[:, 0]
        near = np.abs(mm) < 4
        assert np.abs(row - expected)[near].max() < 0.06, (
            name,
            depth,
            np.abs(row - expected)[near].max(),
        )


def test_golubev_plus_spends_where_contrast_is(patch):
    plus = renderer.make("golubev_plus")
    light = np.zeros((360, 640, 3))
    light[:, :320], light[:, 320:] = 1.0, 0.3
    _out, count = scatter(plus, patch(light, depth_mm=250.0))
    assert set(np.unique(count[..., 0])) == {12, 22}
    active = (count[..., 0] == 22).mean(axis=0)
    assert (
        active[300:340].max() > 0.5
        and active[300:340].mean() > 0.25
        and active[:100].max() == 0
        and active[-100:].max() == 0
    )
    contrast = count[..., 1]
    assert (
        (np.asarray(contrast) >= 0).all() and contrast.max() <= 1 and contrast[:, :100].max() < 1e-3
    )


def test_golubev_plus_with_every_pixel_active_is_golubev(patch):
    rng = np.random.default_rng(5)
    light = rng.uniform(0.1, 2.0, (360, 640, 3))
    all_on, count = scatter(renderer.make("golubev_plus", {"offset": 0.5}), patch(light))
    assert (count[..., 0] == 22).all()
    np.testing.assert_allclose(
        all_on, scatter(renderer.make("golubev"), patch(light))[0], rtol=2e-5
    )


def test_below_a_pixel_golubev_falls_back_to_the_diffuse_brdf(patch):
    rng = np.random.default_rng(6)
    light = rng.uniform(0.1, 2.0, (360, 640, 3))
    for name in ("golubev", "golubev_plus"):
        out, count = scatter(renderer.make(name), patch(light, depth_mm=40000.0))
        np.testing.assert_array_equal(out, light.astype(np.float32))
        assert (count[..., 0] == 1).all()


def test_separable_shows_its_cross_and_golubev_does_not(patch):
    """A small bright spot: the rank-one kernel spreads along the axes (Jimenez 2015, fig. 3)."""
    light = spot(5)

    def anisotropy(name, parameters):
        out, _ = scatter(renderer.make(name, parameters), patch(light, depth_mm=120.0))
        red, c = out[..., 0], (180, 320)
        r = 30
        along = (
            red[c[0] - 6 : c[0] + 7, c[1] + r - 6 : c[1] + r + 7].mean()
            + red[c[0] + r - 6 : c[0] + r + 7, c[1] - 6 : c[1] + 7].mean()
        )
        d = round(r / np.sqrt(2))
        diagonal = red[c[0] + d - 6 : c[0] + d + 7, c[1] + d - 6 : c[1] + d + 7].mean() * 2
        return along / max(diagonal, 1e-9)

    assert anisotropy("jimenez_separable", {"near_share": 0.0}) > 2.0
    assert 0.5 < anisotropy("golubev", {"samples": 64}) < 1.6
