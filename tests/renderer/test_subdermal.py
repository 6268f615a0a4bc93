"""Subdermal: its counts, its guard, and its claim in small."""

from dataclasses import replace

import numpy as np

import renderer
from renderer.techniques.subdermal import COUNTS, RUNG, SETS, TILE, part_of_block
from tests.renderer.slab import scatter
from tests.renderer.test_techniques import SKIN

DEPTH, SCALE = 250.0, 2500.0  # a tenth of a millimetre a pixel


def relief(seed=3, shape=(192, 256)):
    """Light with soft and sharp changes and fine grain, as on skin."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]]
    light = 0.4 + 2.2 * (x + 12 * np.sin(y / 19) > 130) + 0.5 * np.sin(y / 31) ** 2
    light = light * (1 + 0.08 * rng.standard_normal(shape))
    return np.clip(light, 0.05, None)[..., None] * np.array([1.0, 0.8, 0.7])


def pooled(light):
    height, width, _ = light.shape
    return light.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))


def test_the_sets_are_in_order_and_count_their_taps(bare):
    assert list(COUNTS) == sorted(COUNTS) and COUNTS[0] == 3
    taps = renderer.make("subdermal").taps(SKIN, -8, 2)
    assert taps.shape == (8, sum(COUNTS), 4)
    firsts = np.cumsum((0, *COUNTS))[:-1]
    assert (taps[0, firsts, 0] == 0).all() and (np.delete(taps[0, :, 0], firsts) > 0).all()
    assert len(SETS) == len(COUNTS)


def test_the_pixels_of_a_block_that_face_each_other_have_the_same_radii(bare):
    """Half a turn apart; other pairs have radii of their own, whose geometric mean is the ring,
    but for rings that are no larger than a pixel.
    """
    technique = renderer.make("subdermal")
    radius = technique.taps(SKIN, -8, 2)[::2, :, 0]
    parts = [part_of_block(pixel, 2) for pixel in range(4)]
    assert sorted(parts) == [0, 1, 2, 3]
    by_part = radius[np.argsort(parts)]
    np.testing.assert_array_equal(by_part[0], by_part[2])
    np.testing.assert_array_equal(by_part[1], by_part[3])
    ringed = by_part[0] > 0
    mean = np.sqrt(by_part[0] * by_part[1])[ringed]
    share = np.clip(mean / RUNG**-8 - 1, 0, 1)
    ratio = by_part[0][ringed] / by_part[1][ringed]
    np.testing.assert_allclose(np.abs(np.log(ratio)), 0.5 * technique.radii * share, atol=1e-9)
    assert share.min() < 0.3 and share.max() == 1
    rings = [r for one in technique.sets(SKIN, -8, 2) for r in one.radius_mm[1:]]
    mean, rings = (np.unique(np.round(one, 9)) for one in (mean, rings))
    np.testing.assert_allclose(mean, rings)
    same = renderer.make("subdermal", {"radii": 0.0}).taps(SKIN, -8, 2)
    np.testing.assert_array_equal(same[0], same[2])


def test_a_block_of_one_pixel_takes_more_taps(bare):
    inputs = bare.flat(relief(), SKIN, DEPTH, SCALE)
    counts = {
        lone: scatter(renderer.make("subdermal", {"lone": lone}), inputs)[1][..., 0].mean()
        for lone in (1.0, 1.7)
    }
    _, block = scatter(renderer.make("subdermal"), replace(inputs, supersample=2))
    assert block[..., 0].mean() == counts[1.0]
    assert 1.4 < counts[1.7] / counts[1.0] < 2.0


def test_even_light_takes_the_fewest_taps_and_an_edge_more(bare):
    even = np.full((64, 256, 3), 1.3)
    flat = replace(bare.flat(even, SKIN, DEPTH, SCALE), supersample=2)
    _, count = scatter(renderer.make("subdermal"), flat)
    inner = count[TILE:-TILE, TILE:-TILE, 0]
    assert (inner == 4).all()
    edge = even.copy()
    edge[:, 128:] = 0.1
    flat = replace(bare.flat(edge, SKIN, DEPTH, SCALE), supersample=2)
    _, count = scatter(renderer.make("subdermal"), flat)
    columns = count[TILE:-TILE, :, 0]
    assert columns[:, 120:136].min() > 6 and columns[:, 16:40].max() == 4
    tiles = count[..., 0].reshape(64 // TILE, TILE, 256 // TILE, TILE)
    assert (tiles == tiles[:, :1, :, :1]).all()  # decided for tiles, before any tap


def test_at_a_third_of_the_samples_it_is_nearer_to_the_converged_than_golubev(bare):
    """The claim of docs/subdermal.md in small, over output pixels of 2x2."""
    inputs = replace(bare.flat(relief(), SKIN, DEPTH, SCALE), supersample=2)
    converged, _ = scatter(renderer.make("golubev", {"samples": 256, "frames": 4}), inputs)
    own, count = scatter(renderer.make("subdermal"), inputs)
    golubev, _ = scatter(renderer.make("golubev"), inputs)
    inner = (slice(8, -8), slice(8, -8))
    error = [
        np.sqrt(((pooled(out) - pooled(converged))[inner] ** 2).mean(axis=(0, 1)))
        for out in (own, golubev)
    ]
    assert count[..., 0].mean() < 0.4 * 22
    assert (error[0] < error[1]).all(), error


def test_without_pyramid_or_blocks_the_same_taps_are_noisier(bare):
    inputs = replace(bare.flat(relief(), SKIN, DEPTH, SCALE), supersample=2)
    converged, _ = scatter(renderer.make("golubev", {"samples": 256, "frames": 4}), inputs)
    errors = {}
    for name, part in {
        "all": {},
        "pyramid": {"pyramid": False},
        "blocks": {"blocks": False},
    }.items():
        out, _ = scatter(renderer.make("subdermal", part), inputs)
        errors[name] = np.sqrt(((pooled(out) - pooled(converged))[8:-8, 8:-8] ** 2).mean())
    assert errors["pyramid"] > 1.5 * errors["all"] and errors["blocks"] > 1.05 * errors["all"]


def test_the_guard_keeps_light_from_crossing_a_step_of_depth(bare):
    """A dark plane before a bright one, 30 mm apart: only means over the step could carry light."""
    light = np.full((128, 256, 3), 0.2)
    light[:, 128:] = 3.0
    depth = np.full((128, 256), DEPTH)
    depth[:, 128:] = DEPTH + 30.0
    inputs = replace(bare.flat(light, SKIN, depth, SCALE), supersample=2)
    leak = {}
    for name, given in {"guard": {}, "none": {"guard_px": 1e6}}.items():
        out, _ = scatter(renderer.make("subdermal", given), inputs)
        leak[name] = out[32:96, 100:124, 0].mean() - 0.2
    assert leak["guard"] < 3e-3 and leak["none"] > 0.03, leak


def test_rotations_of_a_block_are_even_parts_of_a_turn(bare):
    """A light that is linear over the disc is given back: opposite taps of a block cancel it."""
    x = np.arange(256)
    light = np.repeat((1 + 0.004 * x)[None, :, None], 192, axis=0) * np.ones(3)
    inputs = replace(bare.flat(light, SKIN, DEPTH, SCALE), supersample=2)
    out, _ = scatter(renderer.make("subdermal"), inputs)
    miss = np.abs(pooled(out) - pooled(light))[40:56, 50:78]
    single, _ = scatter(renderer.make("subdermal", {"blocks": False}), inputs)
    lone = np.abs(pooled(single) - pooled(light))[40:56, 50:78]
    assert miss[..., 0].mean() < 0.25 * lone[..., 0].mean()


def test_a_filter_narrower_than_a_pixel_leaves_light_as_it_is(bare):
    light = np.random.default_rng(2).uniform(0.1, 2.0, (48, 64, 3))
    out, count = scatter(renderer.make("subdermal"), bare.flat(light, SKIN, 40000.0, 1800.0))
    np.testing.assert_array_equal(out, light.astype(np.float32))
    assert (count[..., 0] == 1).all()


def test_coarser_pixels_take_more_taps_up_to_twice_the_widest_distance(bare):
    even = np.full((64, 256, 3), 1.3)
    distance = float(renderer.make("subdermal").distances(SKIN).max())
    counts = []
    for pixels in (0.2, 1.0, 2.0, 3.0):  # a pixel, in widest distances
        flat = replace(bare.flat(even, SKIN, SCALE * distance * pixels, SCALE), supersample=2)
        technique = renderer.make("subdermal", {"by_size": 2.8})
        counts.append(scatter(technique, flat)[1][TILE:-TILE, TILE:-TILE, 0].mean())
    assert counts == [5, 7, 9, 9]


def test_a_preset_is_its_three_numbers(bare):
    inputs = replace(bare.flat(relief(), SKIN, DEPTH, SCALE), supersample=2)
    counts = {}
    for name, given in {
        "safe": {"preset": "safe"},
        "numbers": {"fewest": 6.0, "by_spread": 18.0, "by_unguarded": 100.0},
        "equal": {"preset": "equal_error"},
        "own": {},
    }.items():
        out, count = scatter(renderer.make("subdermal", given), inputs)
        counts[name] = out, count[..., 0]
    np.testing.assert_array_equal(counts["safe"][0], counts["numbers"][0])
    means = [counts[name][1].mean() for name in ("equal", "own", "safe")]
    assert means == sorted(means) and len({*means}) == 3
