"""What filters surfaces, atlases, points and walks, has the checks of those that filter pictures:
even light stays even, and stripes on a slab fade as the medium's curve and the fit's error say.
"""

import numpy as np
import pytest

import renderer
from tests.renderer.slab import (
    frame_of_ball,
    left,
    left_of,
    lit,
    places,
    scatter,
    stripes,
    surface_response,
)
from tests.renderer.test_techniques import SCATTERING, SKIN

#: Small atlases, few points and walks; how far stripes may be from their fit's, and why.
SURFACE = {
    "borshukov_lewis": ({"size": 512}, 0.012),  # texels of 0.15 mm
    "gosselin": ({"size": 512}, 0.012),
    "deon_luebke": ({"size": 512, "texturing": 0.0, "translucency": "none"}, 0.025),  # seven taps
    "splat_dipole": ({"spacing_mm": 0.5}, 0.012),
    "splat_multipole": ({"spacing_mm": 0.5}, 0.012),
    "reference": ({"walks": 32}, 0.035),  # three standard errors
}


def test_every_technique_has_the_checks():
    assert {*SURFACE, *SCATTERING, "none"} == set(renderer.TECHNIQUES)


@pytest.mark.parametrize("name", SURFACE)
def test_stripes_of_a_millimetre_fade_as_the_medium_says(name):
    parameters, bound = SURFACE[name]
    technique = renderer.make(name, parameters)
    u, got, _ = surface_response(technique, stripes, size=(160, 36))
    fit, curve = left_of(lambda x: technique.edge(SKIN, x)), left_of(SKIN.edge)
    np.testing.assert_allclose(curve, SKIN.square_stripes(1.0), atol=2e-3)
    miss = np.abs(left(u, got) - curve)
    assert (miss < np.abs(fit - curve) + bound).all(), f"off by {miss}, fit {np.abs(fit - curve)}"


@pytest.mark.parametrize("name", ["borshukov_lewis", "gosselin"])
def test_even_light_stays_even_to_the_silhouette(name):
    """As `deon_luebke` and the splats do, in files of their own; within 1e-3."""
    light = np.array([2.0, 1.0, 0.5])
    with frame_of_ball((80, 60)) as ball:
        given = lit(ball, lambda place: np.broadcast_to(light, place.shape))
        _, scatters = places(ball)
        for padding in (2, 4):
            technique = renderer.make(name, {"size": 256, "padding": padding})
            got, count = scatter(technique, given)
            np.testing.assert_allclose(got[scatters], np.tile(light, (scatters.sum(), 1)), 1e-3)
            assert ((count[..., 0] > 0) == scatters).all()
