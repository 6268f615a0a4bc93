"""Rotations at random: frames of a still, and what shows without them."""

import numpy as np
import pytest

import renderer
from renderer.techniques.rotated import RotatedTechnique
from tests.renderer.slab import scatter
from tests.renderer.test_techniques import SKIN

ROTATED = [n for n, kind in renderer.TECHNIQUES.items() if issubclass(kind, RotatedTechnique)]


def edge(bare):
    light = np.zeros((64, 64, 3))
    light[:, :32] = 1
    return bare.flat(light, SKIN, 250.0, 6000.0)


@pytest.mark.parametrize("name", ROTATED)
def test_frames_have_the_same_mean_and_less_noise(name, bare):
    """Noise across the rows of an edge: its variance falls about as 1 / N, its mean stays."""
    inputs = edge(bare)
    found = {}
    for frames in (1, 4, 16):
        found[frames], count = scatter(renderer.make(name, {"frames": frames}), inputs)
    again, _ = scatter(renderer.make(name, {"frames": 4}), inputs)
    np.testing.assert_array_equal(again, found[4])
    rows = {n: out[8:-8, 20:44] for n, out in found.items()}
    variance = {n: r.var(axis=0).mean() for n, r in rows.items()}
    bias = np.abs(rows[16].mean(axis=(0, 1)) - rows[1].mean(axis=(0, 1)))
    assert (bias < 4e-3).all(), bias
    assert variance[4] < 0.5 * variance[1] and variance[16] < 2 / 16 * variance[1]
    assert count[..., 0].max() <= {"jimenez_separable": 50}.get(name, 80)  # of one frame


@pytest.mark.parametrize("name", ROTATED)
def test_without_jitter_all_rows_of_an_edge_are_one(name, bare):
    out, _ = scatter(renderer.make(name, {"jitter": False}), edge(bare))
    assert np.abs(out - out[32]).max() < 1e-5
