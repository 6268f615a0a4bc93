"""ColorVideoVDP itself, where the extra is installed: make test-visibility."""

import numpy as np
import pytest

pytest.importorskip("pycvvdp", reason="the extra [visibility] is not installed")

import pycvvdp

from stimuli.experiment.visibility import ColorVideoVDP
from stimuli.viewing import Screen


@pytest.fixture(scope="module")
def pair():
    x = np.mgrid[:108, :192][1]
    one = np.repeat((120 + 40 * np.sin(x / 9))[..., None], 3, axis=2)
    other = one + np.random.default_rng(0).normal(0, 3, one.shape)
    return tuple(np.clip(np.rint(a), 0, 255).astype(np.uint8) for a in (one, other))


@pytest.fixture(scope="module")
def standard():
    return ColorVideoVDP(Screen())


def test_the_default_screen_is_its_standard_fhd(pair, standard):
    named = pycvvdp.cvvdp(display_name="standard_fhd", quiet=True, device=standard._metric.device)
    value, _ = named.predict(pair[1], pair[0], dim_order="HWC")
    assert standard.jod(*pair) == pytest.approx(float(value), abs=1e-5)
    assert standard.version.startswith("0.5")


def test_the_same_image_is_10_and_what_differs_less_from_farther_away(pair, standard):
    assert standard.jod(pair[0], pair[0]) == pytest.approx(10, abs=1e-5)
    far = ColorVideoVDP(Screen(distance_mm=3000))
    assert standard.jod(*pair) < far.jod(*pair) < 10
