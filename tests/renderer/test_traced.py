"""Light traced whole: a flat slab by it, lit straight on, is what photons in layers say."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics import fresnel, media, montecarlo
from renderer.optics.medium import Stack
from renderer.reference import estimate as estimates
from renderer.reference import traced
from renderer.reference.estimate import walked
from renderer.reference.walk import Part
from renderer.scene import shapes
from renderer.scene.lights import DistantLight

MEDIUM = {"sigma_a": [0.05, 0.6, 1.3], "sigma_s_prime": [1.5, 4.0, 4.8]}
MATCHED, GLASSY = {**MEDIUM, "eta": 1.0}, {**MEDIUM, "eta": 1.4}
SIDE_MM, THICK_MM, PIXELS = 24.0, 2.0, 8
PHOTONS = 60_000
#: Straight above, far away: 8 x 8 pixels of 1 mm.
CAMERA = {
    "camera_position": np.array([0.0, 0.0, 1000.0]),
    "view": np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1000.0], [0, 0, 0, 1]]),
    "projection": np.diag([250.0, 250.0, -1.0, 1.0]),
}


def slab(towards, others=(), radiance=0.0):
    """A slab whose front lies at z = 0, under one lamp and even surroundings."""
    shape = shapes.slab((SIDE_MM, SIDE_MM, THICK_MM), cells=2)
    part = Part(shape.positions - [0, 0, THICK_MM / 2], shape.faces)
    lamps = [DistantLight(direction=towards, radius_deg=0.0)] if towards else []
    return traced.World.of(
        [part],
        list(others),
        lamps,
        lambda d: np.full((len(d), 3), radiance),
        lambda triangles, _weights, _channel: np.ones(len(triangles)),
    )


def radiosity(world, medium):
    """What leaves a pixel, its mean and standard error by the pixels, over the lamp's: (3,), (3,).

    `trace` divides by what a half-space sends back of even light, and lights are 1.
    """
    made = walked(medium)
    eta = made.medium.eta
    eye = traced.Eye.of(CAMERA, np.ones((PIXELS, PIXELS), bool), 1000.0, world)
    found = traced.trace(world, made, eye, PHOTONS, 3, keep=False)
    unit = made.albedo * (1 - fresnel.diffuse_reflectance(1 / eta))
    values = found.values.reshape(-1, 3) * unit
    return values.mean(axis=0), values.std(axis=0) / np.sqrt(len(values))


@pytest.mark.parametrize("medium", [MATCHED, GLASSY], ids=["matched", "dielectric"])
def test_a_sheet_lit_straight_on_reflects_and_transmits_as_montecarlo(medium):
    """Of collimated light, so that the angle at which it enters counts; within 4 errors."""
    stack = Stack.of(media.read(medium).layers[0].medium, THICK_MM)
    front, front_error = radiosity(slab((0.0, 0.0, 1.0)), medium)
    back, back_error = radiosity(slab((0.0, 0.0, -1.0)), medium)
    for c in range(3):
        run = montecarlo.simulate(montecarlo.layers_of(stack, c), 100_000, 1)
        for got, error, wanted, own in (
            (front, front_error, run.diffuse_reflectance, run.diffuse_reflectance_error),
            (back, back_error, run.transmittance, run.transmittance_error),
        ):
            assert abs(got[c] - wanted) < 4 * np.hypot(error[c], own) + 1e-4, (c, got, wanted)


def test_light_at_an_angle_falls_by_its_cosine_and_is_stopped_by_what_is_in_its_way():
    straight, _ = radiosity(slab((0.0, 0.0, 1.0)), MATCHED)
    slanted, _ = radiosity(slab((0.0, 0.6, 0.8)), MATCHED)
    assert 0.8 < slanted[0] / straight[0] < 0.95  # 0.8, and more comes back of slanted light
    lid = shapes.slab((60.0, 40.0, 1.0), cells=2)  # towards the lamp, not before the camera
    lid = Part(lid.positions + [0, 45.0, 60.0], lid.faces)
    dark, _ = radiosity(slab((0.0, 0.6, 0.8), [lid]), MATCHED)
    assert (dark == 0).all()
    lit, _ = radiosity(slab((0.0, 0.0, 1.0), [lid]), MATCHED)
    np.testing.assert_allclose(lit, straight, rtol=0.03)


def test_even_surroundings_give_what_diffuse_light_gives():
    """Irradiance pi x radiance; a sheet sends back and lets through."""
    stack = Stack.of(media.read(GLASSY).layers[0].medium, THICK_MM)
    got, error = radiosity(slab(None, radiance=1 / np.pi), GLASSY)
    for c in range(3):
        run = montecarlo.simulate(
            montecarlo.layers_of(stack, c), 100_000, 1, illumination="diffuse"
        )
        wanted = run.diffuse_reflectance + run.transmittance
        assert abs(got[c] - wanted) < 4 * error[c] + 3e-3, (c, got, wanted)


def test_a_curve_is_walked_behind_a_dielectric_face_too():
    """The coefficients then answer as the curve does, and are others than behind a matched one."""
    curve = media.curve("deon_luebke")
    glassy, matched = walked("deon_luebke", 1.4), walked("deon_luebke")
    assert glassy.medium.eta == 1.4 and glassy.medium.sigma_a != matched.medium.sigma_a
    np.testing.assert_allclose(glassy.albedo, curve.albedo, atol=0.01)
    assert (glassy.residual < 0.03).all()


def test_a_trace_taken_up_again_equals_one_that_was_not_interrupted(tmp_path, monkeypatch):
    """Ended within a step, as by a kill: what was kept is whole steps, and the numbers are those of
    a run from the first photon to the last."""
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path))
    monkeypatch.setattr(estimates, "SAVE_EVERY_S", 0.0)
    monkeypatch.setattr(traced, "BLOCK", 2000)
    world, made = slab((0.0, 0.0, 1.0), radiance=0.1), walked(MATCHED)
    eye = traced.Eye.of(CAMERA, np.ones((PIXELS, PIXELS), bool), 1000.0, world)
    whole = traced.trace(world, made, eye, 10_000, 3, keep=False)
    blocks, calls = traced._block, []

    def block(*args):
        calls.append(args)
        if len(calls) == 15:
            raise KeyboardInterrupt
        return blocks(*args)

    monkeypatch.setattr(traced, "_block", block)
    with pytest.raises(KeyboardInterrupt):
        traced.trace(world, made, eye, 10_000, 3)
    assert len(list((tmp_path / "reference").glob("*.npz"))) == 1
    taken_up = traced.trace(world, made, eye, 10_000, 3)
    assert len(calls) == 15 + 3 * 6  # of five steps of two halves and three channels two were kept
    np.testing.assert_array_equal(taken_up.values, whole.values)
    traced.trace(world, made, eye, 10_000, 3)  # all of it is kept, but for another seed nothing is
    assert len(calls) == 15 + 3 * 6
    traced.trace(world, made, eye, 10_000, 4)
    assert len(calls) == 15 + 3 * 6 + 5 * 6


def test_bad_parameters():
    for wrong, words in (
        ({"index": 0.5}, "expected 0, or 1 or more"),
        ({"light": "traced", "pool_mm": 1.0}, "expected 0 where light is traced"),
    ):
        with pytest.raises(InputError, match=words):
            renderer.make("reference", wrong)
