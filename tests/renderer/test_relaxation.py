"""Turk's relaxation: points that walk over a mesh, and spread evenly."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from renderer.errors import InputError
from renderer.scene import shapes
from renderer.scene.objects import WIDEST_TUBE, Knot
from renderer.scene.relaxation import Mesh, relax
from renderer.techniques.samples import spread


def test_every_triangle_of_a_closed_shape_has_its_neighbours():
    """Across the seams of the atlas too; a sphere's poles have triangles that are only edges."""
    box = shapes.slab((10.0, 20.0, 5.0))
    assert (Mesh(box.positions, box.faces).beyond >= 0).all()
    ball = shapes.sphere(10.0, 24)
    mesh = Mesh(ball.positions, ball.faces)
    whole = mesh.areas > 1e-9
    assert (mesh.beyond[whole] >= 0).all() and (~whole).sum() == 4 * 24
    for t in np.flatnonzero(whole)[:200]:
        assert all(t in mesh.beyond[other] for other in mesh.beyond[t])


def test_a_knot_is_a_closed_tube_that_does_not_meet_itself():
    """Its area and volume are those of a straight tube of its length (Pappus and Guldin)."""
    tube = 11.0 * WIDEST_TUBE
    shape = shapes.knot(11.0, tube)
    mesh = Mesh(shape.positions, shape.faces)
    assert (mesh.beyond >= 0).all()
    t = np.linspace(0, 2 * np.pi, 4001)
    wide = 2 + np.cos(3 * t)
    middle = 11 / 3 * np.column_stack([wide * np.cos(2 * t), wide * np.sin(2 * t), np.sin(3 * t)])
    length = np.linalg.norm(np.diff(middle, axis=0), axis=1).sum()
    volume = np.einsum("ki,ki->", mesh.corners[:, 0], mesh.normals * mesh.areas[:, None]) / 3
    assert np.isclose(mesh.areas.sum(), 2 * np.pi * tube * length, rtol=0.01)
    assert np.isclose(volume, np.pi * tube**2 * length, rtol=0.02)
    apart = np.linalg.norm(middle[::20, None] - middle[None, ::20], axis=-1)
    along = np.abs(np.subtract.outer(np.arange(201), np.arange(201)))
    far = np.minimum(along, 200 - along) > 40
    assert apart[far].min() > 2 * tube
    outward = np.einsum("ki,ki->k", mesh.normals, shape.normals[shape.faces[:, 0]])
    assert outward.min() > 0.9
    with pytest.raises(InputError, match="tube_mm is 3.5; expected at most 2.97"):
        Knot(radius_mm=11.0, tube_mm=3.5)


def test_a_walk_keeps_its_length_around_a_boxs_edges():
    """From the middle of the front over its edges: unrolled, a straight line; and back again."""
    box = shapes.slab((10.0, 10.0, 10.0), cells=6)
    mesh = Mesh(box.positions, box.faces)
    centre = np.array([[0.31, 0.17, 5.0]])
    start = np.array([np.argmin(np.linalg.norm(mesh.corners.mean(axis=1) - centre, axis=1))])
    at = mesh.at(start, mesh.weights(start, centre))
    triangle, place = mesh.walk(start, at, np.array([[9.0, 0.0, 0.0]]))
    np.testing.assert_allclose(place, [[5.0, at[0, 1], 5.0 - (at[0, 0] + 9.0 - 5.0)]], atol=1e-9)
    np.testing.assert_allclose(mesh.normals[triangle], [[1.0, 0.0, 0.0]], atol=1e-12)
    _, back = mesh.walk(triangle, place, np.array([[0.0, 0.0, 9.0]]))
    np.testing.assert_allclose(back, at, atol=1e-9)


def test_a_walk_stops_at_an_end_of_the_mesh():
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = Mesh(positions, np.array([[0, 1, 2], [0, 2, 3]]))
    at = np.array([[0.5, 0.2, 0.0]])
    triangle, place = mesh.walk(np.array([0]), at, np.array([[-0.2, 5.0, 0.0]]))
    assert triangle[0] == 1 and np.isclose(place[0, 1], 1.0)
    np.testing.assert_allclose(mesh.weights(triangle, place).sum(axis=1), 1)


def test_relaxed_points_are_even_and_on_the_surface():
    """Nearest neighbours: of random points .5 of the spacing with a spread of .52; after ten rounds
    of the even ones that a hexagonal grid would have, 1.07, less than a fifth is missing."""
    ball = shapes.sphere(20.0, 32)
    mesh = Mesh(ball.positions, ball.faces)
    triangles, weights = spread(mesh.areas, 1500, np.random.default_rng(3))
    unit = np.sqrt(mesh.areas.sum() / 1500)

    def near(t, w):
        d = cKDTree(mesh.at(t, w)).query(mesh.at(t, w), 2)[0][:, 1]
        return d.mean() / unit, d.std() / d.mean()

    before = near(triangles, weights)
    triangles, weights = relax(mesh, triangles, weights, 10)
    mean, deviation = near(triangles, weights)
    assert before[0] < 0.6 and before[1] > 0.35
    assert mean > 0.86 and deviation < 0.08
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    assert weights.min() >= 0
    radius = np.linalg.norm(mesh.at(triangles, weights), axis=1)
    assert radius.max() <= 20.0 + 1e-9 and radius.min() > 19.85


def test_points_on_the_faces_of_a_thin_sheet_do_not_push_each_other():
    """On each face they are as even as on a thick slab, where all would push."""
    spreads = {}
    for thickness in (0.2, 30.0):
        shape = shapes.slab((20.0, 20.0, thickness), cells=12)
        mesh = Mesh(shape.positions, shape.faces)
        count = round(mesh.areas.sum() / 2.0)
        triangles, weights = spread(mesh.areas, count, np.random.default_rng(1))
        triangles, weights = relax(mesh, triangles, weights, 20)
        places = mesh.at(triangles, weights)[mesh.normals[triangles][:, 2] > 0.5]
        inner = np.abs(places[:, :2]).max(axis=1) < 7.0
        d = cKDTree(places).query(places[inner], 2)[0][:, 1]
        spreads[thickness] = d.std() / d.mean()
        assert 0.85 < d.mean() / np.sqrt(2.0) < 1.08
    assert max(spreads.values()) < 0.1, spreads
