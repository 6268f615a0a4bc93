"""Baked light against closed forms."""

import numpy as np
import pytest
import trimesh

from renderer.passes import bake as baking
from renderer.scene import DistantLight, Environment, PointLight

UNIFORM = Environment(ambient=(1.0, 0.5, 0.25))


def bake(mesh, lights=(), environment=UNIFORM, albedo=(0.5, 0.5, 0.5), rays=256):
    """(light and openness of a mesh, its normals); environment: a value or a function."""
    normals = np.asarray(mesh.vertex_normals)
    body = baking.Body(mesh.vertices, normals, mesh.faces, np.tile(albedo, (len(normals), 1)))
    radiance = getattr(environment, "radiance_of_panels", environment)
    return baking.bake([body], lights, radiance, rays, 0)[0], normals


def test_a_convex_body_in_uniform_light_gets_pi_times_the_radiance():
    baked, normals = bake(trimesh.creation.icosphere(3, 80.0))
    np.testing.assert_allclose(baked.openness, 1, atol=0.01)
    irradiance = np.einsum("nci,ni->nc", baked.light, normals)
    np.testing.assert_allclose(
        irradiance, np.tile(np.pi * np.array(UNIFORM.ambient), (len(normals), 1)), rtol=0.02
    )
    # the vector irradiance of uniform light is E n exactly
    np.testing.assert_allclose(baked.light[:, 0] / np.pi, normals, atol=0.12)


def test_a_half_lit_sky_gives_the_known_irradiance():
    """A clamped cosine of radiance about +y: E(up) = 2 pi / 3 (Ramamoorthi and Hanrahan 2001, A_1
    plus the mean).
    """

    def cosine(directions):
        return np.repeat(np.maximum(directions[:, 1:2], 0), 3, axis=1)

    baked, normals = bake(trimesh.creation.icosphere(3, 80.0), environment=cosine, rays=400)
    top = normals[:, 1].argmax()
    assert abs(baked.light[top, 0] @ normals[top] - 2 * np.pi / 3) < 0.05


def test_skin_lights_skin_and_colours_its_shadow():
    """Two parallel plates, a lamp on the lower one: the upper one's underside is lit by it, and
    takes its colour.
    """
    lower = trimesh.creation.box((200, 4, 200)).subdivide().subdivide().subdivide()
    upper = lower.copy()
    upper.apply_translation((0, 60, 0))
    upper.apply_translation((150, 0, 0))
    both = trimesh.util.concatenate([lower, upper])
    lamp = DistantLight((5.0, 5.0, 5.0), direction=(0.0, 1.0, 0.0), radius_deg=0.5)
    night = Environment()
    baked, normals = bake(both, [lamp], night, albedo=(0.8, 0.2, 0.1))
    under = (both.vertices[:, 1] > 50) & (normals[:, 1] < -0.9) & (both.vertices[:, 0] < 100)
    irradiance = np.einsum("nci,ni->nc", baked.light, normals)[under]
    assert irradiance[:, 0].min() > 0.05
    assert (irradiance[:, 0] > 3 * irradiance[:, 1]).all() and (
        irradiance[:, 1] > irradiance[:, 2]
    ).all()
    black, _ = bake(both, [lamp], night, albedo=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(black.light, 0, atol=1e-12)


def test_the_open_sky_leans_away_from_a_wall():
    """A floor before a wall sees the sky away from it; without one, along its normal, 2/3 long."""
    floor = trimesh.creation.box((400, 4, 100)).subdivide().subdivide().subdivide()
    wall = trimesh.creation.box((4, 120, 400))
    wall.apply_translation((-202, 60, 0))
    alone, normals = bake(floor)
    walled, _ = bake(trimesh.util.concatenate([floor, wall]))
    middle = (normals[:, 1] > 0.999) & (np.abs(floor.vertices[:, 2]) < 30)
    lean = walled.sky[: len(normals)] - alone.sky
    near, far = (
        lean[middle & side] for side in (floor.vertices[:, 0] < -90, floor.vertices[:, 0] > 90)
    )
    assert near[:, 0].mean() > 0.15 and np.abs(near[:, 2].mean()) < 0.03
    assert np.abs(far.mean(axis=0)).max() < 0.04
    inner = middle & (np.abs(floor.vertices[:, 0]) < 60)
    np.testing.assert_allclose(alone.sky[inner].mean(axis=0), [0, 2 / 3, 0], atol=0.03)


def test_the_bake_repeats_for_one_seed():
    mesh = trimesh.creation.icosphere(2, 50.0)
    first, _ = bake(mesh, rays=16)
    second, _ = bake(mesh, rays=16)
    np.testing.assert_array_equal(first.light, second.light)
    dimmer = Environment(ambient=(0.5, 0.5, 0.25))
    assert (bake(mesh, environment=dimmer, rays=16)[0].light != first.light).any()


def test_a_point_lamp_is_not_shaded_by_what_lies_behind_it():
    """A sheet lit from 100 mm: E = E1 / d^2 in metres; a second sheet behind the lamp changes
    nothing, one between takes the light.
    """
    sheet = trimesh.creation.box((20, 2, 20)).subdivide()
    lamp = PointLight((0.02, 0.02, 0.02), position_mm=(0.0, 101.0, 0.0), radius_mm=0.0)
    for height, expected in ((None, 2.0), (150.0, 2.0), (50.0, 0.0)):
        parts = [sheet]
        if height is not None:
            other = trimesh.creation.box((40, 2, 40))
            other.apply_translation((0, height, 0))
            parts.append(other)
        both = trimesh.util.concatenate(parts)
        tracer = baking.Tracer(both.vertices, both.faces, [lamp], lambda d: 0 * d, 0)
        got = tracer.lamps(np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]))
        np.testing.assert_allclose(got, expected, rtol=1e-6)


def test_without_embree_the_slower_tracer_gives_the_same_light_and_says_so(monkeypatch):
    ball, plate = trimesh.creation.icosphere(1, 20.0), trimesh.creation.box((80.0, 80.0, 2.0))
    ball.apply_translation((0.0, 0.0, 30.0))
    mesh = trimesh.util.concatenate([ball, plate.subdivide()])
    lamp = PointLight((1.0, 1.0, 1.0), position_mm=(60.0, 20.0, 120.0))
    by_embree, _ = bake(mesh, [lamp], rays=24)
    monkeypatch.setattr(trimesh.ray, "has_embree", False)  # as trimesh is where it found none
    with pytest.warns(UserWarning, match="embreex is not installed"):
        slower, _ = bake(mesh, [lamp], rays=24)
    np.testing.assert_allclose(slower.openness, by_embree.openness, atol=0.02)
    np.testing.assert_allclose(slower.light, by_embree.light, atol=0.05 * by_embree.light.max())
    assert by_embree.openness.min() < 0.7
