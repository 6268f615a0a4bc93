"""Golubev Plus, and samples by contrast as an extension: where they go, and what they are."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.gl import program
from renderer.techniques.contrast import ByContrast
from renderer.techniques.screen import ScreenTechnique
from tests.renderer.slab import scatter
from tests.renderer.test_techniques import SKIN

PLUS = "golubev_plus"


def noise(seed, size=(90, 160)):
    return np.random.default_rng(seed).uniform(0.1, 2.0, (*size, 3))


def taken(bare, light, **parameters):
    out, count = scatter(renderer.make(PLUS, parameters), bare.flat(light, SKIN))
    return out, count[..., 0], count[..., 1]


def test_samples_are_spent_where_contrast_is(bare):
    light = np.full((90, 160, 3), 0.3)
    light[:, :80] = 1.0
    _, samples, contrast = taken(bare, light)
    assert set(np.unique(samples)) == {12, 22}
    active = (samples == 22).mean(axis=0)
    assert active[70:90].max() > 0.5 and active[:30].max() == active[-30:].max() == 0
    assert contrast.min() >= 0 and contrast.max() <= 1 and contrast[:, :30].max() < 1e-3


def test_the_extra_set_is_made_as_the_base_set_is():
    """Thesis, sec. 4.2: each set covers the profile alone, and no direction twice."""
    from renderer.optics import burley

    plus = renderer.make(PLUS)
    table, distance = plus.table(SKIN), plus.distances(SKIN).max()
    for rows, count in ((table[:12], 12), (table[12:], 10)):
        shares = burley.cdf(rows[:, 2], distance)
        np.testing.assert_allclose(shares, (np.arange(count) + 0.5) / count, atol=1e-12)
    angles = np.sort(np.arctan2(table[:, 1], table[:, 0]))
    assert np.diff(angles).min() > 0.1


def test_all_that_is_not_contrasts_is_the_techniques_own():
    plus, golubev = renderer.make(PLUS).plain(), renderer.make("golubev").plain()
    assert {key: plus[key] for key in golubev} == golubev


def test_nested_sets_with_every_pixel_active_are_golubevs(bare):
    light = noise(5)
    golubev, _ = scatter(renderer.make("golubev"), bare.flat(light, SKIN))
    nested, samples, _ = taken(bare, light, offset=0.5, sets="nested")
    assert (samples == 22).all()
    np.testing.assert_allclose(nested, golubev, rtol=2e-5)
    separate, samples, _ = taken(bare, light, offset=0.5)
    assert (samples == 22).all() and np.abs(separate - golubev).max() > 0.05


@pytest.mark.parametrize("sets", ["separate", "nested"])
def test_a_continuous_number_grows_with_contrast_and_keeps_flat_light(bare, sets):
    light = noise(6)
    _, samples, contrast = taken(bare, light, levels="continuous", sets=sets)
    assert set(np.unique(samples)) == set(range(12, 23))
    expected = 12 + np.floor(10 * np.minimum(contrast / 0.5, 1) + 0.5)
    assert np.mean(samples == expected) > 0.97  # contrast is stored in 16 bits
    flat, samples, _ = taken(bare, np.full_like(light, 1.7), levels="continuous", sets=sets)
    np.testing.assert_allclose(flat, 1.7, rtol=1e-6)
    assert (samples == 12).all()


def test_an_exponent_moves_the_threshold(bare):
    light = noise(7)
    _, samples, contrast = taken(bare, light, contrast_exponent=2.0)
    clear = np.abs(contrast - 0.5) > 1e-3
    np.testing.assert_array_equal((samples == 22)[clear], (contrast >= 0.5)[clear])


def test_more_sets_than_fit_are_refused():
    with pytest.raises(InputError, match="expected at most 30, or sets = 'nested'"):
        renderer.make(PLUS, {"samples": 60, "levels": "continuous"})
    renderer.make(PLUS, {"samples": 60, "levels": "continuous", "sets": "nested"})


DISC = """
#include "shaders/common.glsl"
uniform sampler2D irradiance; uniform sampler2D depths;
uniform vec4 samples[SAMPLES]; uniform float pixels_per_mm;
layout(location = 0) out vec4 scattered; layout(location = 1) out vec4 count;
struct Pixel { vec3 light; float scale; };
struct Sum { vec3 weight; vec3 light; };
bool begin(out Pixel p) {
    vec4 centre = texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0);
    scattered = centre; count = vec4(0.0);
    p = Pixel(centre.rgb, pixels_per_mm / texelFetch(depths, ivec2(gl_FragCoord.xy), 0).x);
    return centre.a > 0.5;
}
vec4 take(int k, Pixel p, inout Sum sum) {
    vec2 there = gl_FragCoord.xy + samples[k].xy * p.scale;
    vec4 e = texture(irradiance, there / vec2(textureSize(irradiance, 0)));
    sum.weight += e.a; sum.light += e.a * e.rgb;
    return vec4(e.rgb, e.a);
}
vec4 resolve(Pixel p, Sum sum) { return vec4(sum.light / sum.weight, 1.0); }
#include "shaders/contrast.glsl"
"""


@dataclass(frozen=True)
class GaussianDisc(ScreenTechnique):
    """Samples of a Gaussian, all of one weight: a filter of one pass that is not Golubev's."""

    samples: int = 24
    name: ClassVar[str] = "gaussian_disc"

    def sample_set(self, curve, count, first):
        k = np.arange(count)
        r = np.sqrt(-2 * np.log(1 - (k + 0.5) / count))
        phi = 2.39996323 * (first + k)
        return np.column_stack([r * np.cos(phi), r * np.sin(phi), r, np.ones(count)])


@dataclass(frozen=True)
class GaussianDiscPlus(ByContrast, GaussianDisc):
    pass


def test_any_filter_of_one_pass_takes_samples_by_contrast(bare, tmp_path, monkeypatch):
    folder = tmp_path / "renderer"
    (folder / "techniques").mkdir(parents=True)
    (folder / "techniques" / "gaussian_disc.glsl").write_text(DISC)
    (folder / "shaders").symlink_to(program.ROOT / "shaders")
    monkeypatch.setattr(program, "ROOT", folder)
    light = np.full((90, 160, 3), 0.02)
    light[:, :80] = 1.0
    for parameters in ({}, {"levels": "continuous"}, {"sets": "nested"}):
        technique = GaussianDiscPlus(**parameters)
        technique.self_check(SKIN)
        out, count = scatter(technique, bare.flat(light, SKIN))
        samples = count[..., 0]
        assert samples.min() == 12 and samples.max() > 20 and samples[:, :60].max() == 12
        np.testing.assert_allclose(out[:, :60], 1.0, rtol=1e-5)
