"""Baked light against closed forms."""

from dataclasses import replace

import numpy as np
import trimesh

from renderer.bake import bake_model
from renderer.scene import Lamp, Studio

UNIFORM = Studio(lamps=(), lobes=(), ambient=(1.0, 0.5, 0.25))


def bake(mesh, studio, albedo=(0.5, 0.5, 0.5), rays=256):
    normals = mesh.vertex_normals
    return bake_model(
        mesh.vertices,
        normals,
        mesh.faces,
        np.tile(albedo, (len(mesh.vertices), 1)),
        (),
        studio,
        rays,
        0,
    )[0], normals


def test_a_convex_body_in_uniform_light_gets_pi_times_the_radiance():
    baked, normals = bake(trimesh.creation.icosphere(3, 80.0), UNIFORM)
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

    class Cosine(Studio):
        def radiance(self, directions):
            return np.repeat(np.maximum(directions[:, 1:2], 0), 3, axis=1)

    baked, normals = bake(trimesh.creation.icosphere(3, 80.0), Cosine(lamps=(), lobes=()), rays=400)
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
    dark = Studio(
        lamps=(Lamp("key", (0, 1, 0), (5.0, 5.0, 5.0), 0.5),), lobes=(), ambient=(0.0, 0.0, 0.0)
    )
    baked, normals = bake(both, dark, albedo=(0.8, 0.2, 0.1))
    under = (both.vertices[:, 1] > 50) & (normals[:, 1] < -0.9) & (both.vertices[:, 0] < 100)
    irradiance = np.einsum("nci,ni->nc", baked.light, normals)[under]
    assert irradiance[:, 0].min() > 0.05
    assert (irradiance[:, 0] > 3 * irradiance[:, 1]).all() and (
        irradiance[:, 1] > irradiance[:, 2]
    ).all()
    black, _ = bake(both, dark, albedo=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(black.light, 0, atol=1e-12)


def test_the_bake_repeats_for_one_seed():
    mesh = trimesh.creation.icosphere(2, 50.0)
    first, _ = bake(mesh, Studio(), rays=16)
    second, _ = bake(mesh, Studio(), rays=16)
    np.testing.assert_array_equal(first.light, second.light)
    dimmer = replace(Studio(), ambient=(0.0, 0.0, 0.0))
    assert (bake(mesh, dimmer, rays=16)[0].light != first.light).any()
