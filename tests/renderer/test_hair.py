"""Hair: its light against a closed form, and strands that are left out because nobody sees them."""

from dataclasses import replace

import numpy as np
import pytest

import renderer
from renderer.passes import occlusion
from renderer.passes.hair import COLUMNS, EXTINCTION
from renderer.passes.lamps import Lamps


def test_unshadowed_light_on_strands_is_that_of_the_layer(drawing):
    """exp(-extinction cover / cosine) of the root's normal, and nothing where it faces away."""
    drawing.context.make_current()
    (hair,) = drawing.hair
    lights = [replace(light, shadow=False) for light in drawing.lamps.lights]
    before = hair._lit
    try:
        lamps = Lamps(lights, hair.points.reshape(-1, 3), 16)
        hair.light(drawing.context, drawing.program, lamps, drawing.surroundings)
        count = hair.points.shape[0] * hair.points.shape[1]
        lit = hair._lit.read()[:, ::-1].reshape(len(lights), -1)[:, :count]
        assert hair._lit.width == COLUMNS
    finally:
        hair._lit = before
    normals = np.repeat(hair.normals, hair.points.shape[1], axis=0)
    for k, light in enumerate(lights):
        facing = normals @ light.towards
        t = np.clip((facing + 0.35) / 0.6, 0, 1)
        path = EXTINCTION * hair.strands.cover.ravel() / np.maximum(facing, 0.22)
        np.testing.assert_allclose(lit[k], np.exp(-path) * t * t * (3 - 2 * t), atol=2e-5)
    shadowed = before.read()[:, ::-1].reshape(len(lights), -1)[:, :count]
    assert (shadowed <= lit + 2e-5).all() and shadowed.mean() < 0.9 * lit.mean()


@pytest.mark.parametrize("framing", ["close-up", "half-length"])
def test_leaving_out_what_is_hidden_changes_no_pixel(drawing, framing, monkeypatch):
    left_out, judge = [], occlusion.hidden

    def count(*bounds):
        left_out.append(judge(*bounds))
        return left_out[-1]

    def nothing(levels, points, *_):
        return np.zeros(len(points), bool)

    images = []
    for hidden in (count, nothing):
        monkeypatch.setattr(occlusion, "hidden", hidden)
        with drawing.frame(renderer.FRAMINGS[framing]) as frame:
            images.append(frame.surface.textures[1].read())
    np.testing.assert_array_equal(*images)
    assert left_out[0].mean() > 0.25, "most of the back of the head is not seen"


def test_what_is_said_to_be_hidden_is():
    """Random lines against a random relief: behind every pixel of their bounds, wherever hidden."""
    rng = np.random.default_rng(5)
    width, height = 96, 70
    depths = np.full((height, width), 300.0, np.float32)
    depths[20:50, 30:80] = rng.uniform(180, 220, (30, 50))
    depths[:, 85:] = 0  # the backdrop
    pixels_per_mm = 100.0  # at 1 mm
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = 2 * pixels_per_mm / width, 2 * pixels_per_mm / height
    projection[2, 2], projection[2, 3], projection[3, 2] = -1.2, -22.0, -1.0
    count = 4000
    depth = rng.uniform(150, 330, (count, 1)) + rng.normal(size=(count, 4))
    xy = rng.uniform(-0.7, 0.7, (count, 1, 2)) * [width, height]
    xy = xy + rng.uniform(1, 12, (count, 1, 1)) * rng.normal(size=(count, 4, 2))
    points = np.concatenate([xy * depth[..., None] / pixels_per_mm, -depth[..., None]], axis=2)
    half = np.full(count, 0.5)
    levels = occlusion.blocks(depths)
    hidden = occlusion.hidden(levels, points, projection, (width, height), half, 1.0)
    at = xy + np.array([width, height]) / 2
    for k in np.flatnonzero(hidden):
        # as wide as it is drawn, and half a pixel for the pixel's own middle
        reach = max(1.0, 0.5 * pixels_per_mm / depth[k].min()) + 0.5
        low = np.maximum(np.floor(at[k].min(axis=0) - reach), 0).astype(int)
        high = np.maximum(np.floor(at[k].max(axis=0) + reach), -1).astype(int)
        seen = depths[low[1] : high[1] + 1, low[0] : high[0] + 1]
        assert seen.size == 0 or (depth[k].min() > np.where(seen > 0, seen, np.inf)).all()
    clear = (depth.max(axis=1) < 170) & (np.abs(xy).max(axis=1) < [40, 30]).all(axis=1)
    assert clear.any() and not hidden[clear].any()
    assert 0.2 < hidden.mean() < 0.9


def test_what_passes_the_eye_is_never_hidden():
    levels = occlusion.blocks(np.full((16, 16), 10.0, np.float32))
    projection = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1.2, -2.2], [0, 0, -1.0, 0]])
    points = np.array([[[0, 0, -50.0], [0, 0, 5.0]], [[0, 0, -50.0], [0, 0, -60.0]]])
    hidden = occlusion.hidden(levels, points, projection, (16, 16), np.full(2, 0.1), 0.5)
    assert hidden.tolist() == [False, True]
