"""Rings that stand for a profile: what they answer to an edge, by another way of reckoning it."""

import numpy as np
import pytest

from renderer.optics import fits, media, rings

SKIN = media.curve("deon_luebke")
D = fits.burley_distance(SKIN).distance_mm
BURLEY = fits.BurleyFit(D, np.zeros(3)).edge


def read(light, at, level):
    """A level of the means of light (N,), read linearly at places in pixels."""
    side = 2**level
    means = light.reshape(-1, side).mean(axis=1)
    return np.interp(at, (np.arange(len(means)) + 0.5) * side, means)


def drawn_answer(fitted, texel, pixel_mm, count, factors):
    """What a pixel has of a step, `count` pixels beyond it on: rows of pixels that are lit before
    the step, which lies at many places of the pyramid, read at places all around: (count, C).
    """
    turns = np.cos(2 * np.pi * (np.arange(180) + 0.5) / 180)
    total = 0.0
    for step in range(512, 512 + 64, 3):
        light = np.zeros(1024)
        light[:step] = 1.0
        middles = step + 0.5 + np.arange(count)
        for r, w in zip(fitted.radius_mm[1:], fitted.weights[1:], strict=True):
            for factor in factors:
                ring = rings.spread(r, factor, pixel_mm)
                level = np.log2(max(texel * ring / pixel_mm, 1.0))
                low = int(level)
                at = middles[:, None] + ring / pixel_mm * turns
                below, above = (read(light, at, k).mean(axis=1) for k in (low, low + 1))
                total = total + (below + (level - low) * (above - below))[:, None] * w
    return total / len(range(512, 512 + 64, 3)) / len(factors)


@pytest.mark.parametrize("count", [2, 4, 6])
@pytest.mark.parametrize(
    ("pixel_mm", "factors"), [(0.05, (0.7, 1.4)), (0.2, (1.0,)), (0.5, (0.8, 1.25))]
)
def test_what_rings_answer_is_what_pixels_and_means_read_on_them_do(count, pixel_mm, factors):
    """Coarse pixels too: .5 mm is more than the core of any channel."""
    fitted = rings.fit(BURLEY, D, count, 1.3, pixel_mm, 0.005, factors)
    assert fitted.radius_mm[0] == 0 and (np.diff(fitted.radius_mm) > 0).all()
    np.testing.assert_allclose(fitted.weights.sum(axis=0), 1, atol=1e-9)
    assert (fitted.weights >= 0).all()
    beyond = int(10.0 / pixel_mm)
    x = (np.arange(beyond) + 0.5) * pixel_mm
    got = drawn_answer(fitted, 1.3, pixel_mm, beyond, factors)
    rms = np.sqrt(np.trapezoid((got - BURLEY(x)) ** 2, x, axis=0) / np.ptp(x))
    assert (rms < 1.15 * fitted.error + 0.001).all(), (rms, fitted.error)


def test_a_pixel_as_large_as_the_core_has_no_blur_of_its_own_to_repay():
    """The step lies between pixels: beside it green and blue, narrower than a pixel, are right."""
    fitted = rings.fit(BURLEY, D, 4, 1.3, 0.5, 0.0)
    got = drawn_answer(fitted, 1.3, 0.5, 4, (1.0,))
    np.testing.assert_allclose(got, BURLEY((np.arange(4) + 0.5) * 0.5), atol=0.006)


def test_rings_under_a_pixel_are_not_spread():
    np.testing.assert_allclose(rings.spread(np.array([0.1, 0.2]), 1.5, 0.2), [0.1, 0.2])
    np.testing.assert_allclose(rings.spread(np.array([0.4, 2.0]), 1.5, 0.2), [0.6, 3.0])


def test_more_rings_are_nearer_and_the_medians_of_equal_shares_are_farther():
    """Five taps by the inverse CDF, as importance sampling places them, cut red's far end off."""
    from renderer.optics import burley

    red = [rings.fit(BURLEY, D, n, 1.0, 0.05, 0.0).error[0] for n in (1, 2, 3, 4)]
    assert (np.diff(red) < 0).all()
    x = np.linspace(0, 12, 400)
    radii = burley.inverse_cdf((np.arange(5) + 0.5) / 5, D.max())
    turns = np.cos(2 * np.pi * (np.arange(720) + 0.5) / 720)
    medians = (x[:, None, None] + radii[:, None] * turns < 0).mean(axis=(1, 2))
    miss = np.sqrt(np.trapezoid((medians - BURLEY(x)[:, 0]) ** 2, x) / 12)
    assert red[-1] < 0.3 * miss


def test_noise_moves_weight_from_single_pixels_to_means():
    """A tap whose mean is as small as a pixel is noisy: the penalty takes weight off such taps."""
    alone, quiet = (rings.fit(BURLEY, D, 4, 1.3, 0.2, noise) for noise in (0.0, 0.01))
    variance = [
        (f.weights[1:] ** 2 * (0.2 / np.maximum(1.3 * f.radius_mm[1:], 0.2))[:, None] ** 2).sum()
        for f in (alone, quiet)
    ]
    assert variance[1] < 0.7 * variance[0]


def test_the_mediums_own_curve_can_be_the_goal():
    fitted = rings.fit(SKIN.edge, D, 5, 1.0, 0.05, 0.0)
    assert (fitted.error < 0.006).all()
