"""Rings that stand for a profile: what they answer to an edge, by another way of reckoning it."""

import numpy as np
import pytest

from renderer.optics import fits, media, rings

SKIN = media.curve("deon_luebke")
D = fits.burley_distance(SKIN).distance_mm
BURLEY = fits.BurleyFit(D, np.zeros(3)).edge


def drawn_answer(fitted, texel, pixel_mm, x, factors, count=200_000):
    """The answer to an edge by drawing points: angle, box and tent of each tap, (N, C)."""
    rng = np.random.default_rng(1)
    total = 0.0
    for r, w in zip(fitted.radius_mm, fitted.weights, strict=True):
        drawn = r * rng.choice(factors, count)
        side = np.maximum(texel * drawn, pixel_mm)
        at = drawn * np.cos(2 * np.pi * rng.random(count))
        if r:
            at += side * (rng.random(count) - 0.5 + rng.random(count) + rng.random(count) - 1)
        else:
            at += pixel_mm * (rng.random(count) - 0.5)
        share = np.searchsorted(np.sort(at), -x) / count  # of light that comes from x < 0
        total = total + share[:, None] * w
    return total


@pytest.mark.parametrize("count", [2, 4, 6])
@pytest.mark.parametrize(("pixel_mm", "factors"), [(0.05, (0.7, 1.4)), (0.2, (1.0,))])
def test_what_rings_answer_is_what_points_drawn_from_them_do(count, pixel_mm, factors):
    fitted = rings.fit(BURLEY, D, count, 1.3, pixel_mm, 0.005, factors)
    assert fitted.radius_mm[0] == 0 and (np.diff(fitted.radius_mm) > 0).all()
    np.testing.assert_allclose(fitted.weights.sum(axis=0), 1, atol=1e-9)
    assert (fitted.weights >= 0).all()
    x = np.linspace(0.3, 10.0, 60)
    got = drawn_answer(fitted, 1.3, pixel_mm, x, factors)
    rms = np.sqrt(np.trapezoid((got - BURLEY(x)) ** 2, x, axis=0) / np.ptp(x))
    assert (rms < fitted.error + 0.004).all(), (rms, fitted.error)


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
