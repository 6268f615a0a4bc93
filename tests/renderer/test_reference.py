"""The random walk in a mesh: against photons in layers, energy, seeds, and being taken up again."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics import media, montecarlo
from renderer.optics.medium import Medium
from renderer.reference import estimate as estimates
from renderer.reference.estimate import Halves, estimate, rms_error, walked
from renderer.reference.walk import Part, Solid, walk
from renderer.scene import shapes
from renderer.techniques.reference import part_of, visible
from tests.renderer.slab import frame_of_ball, lit, places

MATCHED = {"sigma_a": [0.05, 0.6, 1.3], "sigma_s_prime": [1.5, 4.0, 4.8], "eta": 1.0}
GLASSY = {"sigma_a": [0.05, 0.6, 1.3], "sigma_s_prime": [1.5, 4.0, 4.8], "eta": 1.4, "g": 0.5}


def box(thickness_mm=200.0):
    """A box whose front lies at z = 0, and it as a solid."""
    shape = shapes.slab((400.0, 400.0, thickness_mm), cells=2)
    positions = shape.positions - [0, 0, thickness_mm / 2]
    return positions[shape.faces], Solid([Part(positions, shape.faces)])


def on_the_front(x):
    """Points (N, 3) at x, their normals and numbers."""
    points = np.column_stack([x, np.full(len(x), 3.0), np.zeros(len(x))])
    return points, np.tile([0.0, 0.0, 1.0], (len(x), 1)), np.arange(len(x))


def constant(triangles, _weights):
    return np.ones((len(triangles), 3))


@pytest.mark.parametrize("medium", [MATCHED, GLASSY], ids=["matched", "dielectric"])
def test_a_flat_slab_agrees_with_photons_in_layers(medium):
    """A straight edge of light, within 4.5 standard errors.

    A walk carries at most 1 / albedo, so that its variance is at most value / albedo.
    """
    corners, solid = box()
    curve = media.curve(medium)
    x = np.array([-4.0, -2.0, -1.0, -0.5, -0.25, -0.1, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0])

    def edge(triangles, weights):
        place = np.einsum("kc,kca->ka", weights, corners[triangles])
        return np.repeat((place[:, :1] < 0) * 1.0, 3, axis=1)

    found = estimate(solid, walked(medium), *on_the_front(x), edge, 8000, 1, keep=False)
    wanted = curve.edge(x)
    error = np.hypot(np.sqrt((wanted + 1e-3) / (8000 * curve.albedo)), curve.noise)
    np.testing.assert_array_less(np.abs(found.mean - wanted), 4.5 * error)
    assert (found.noise < 0.02).all()


@pytest.mark.parametrize("medium", [MATCHED, GLASSY], ids=["matched", "dielectric"])
def test_a_sheet_reflects_and_transmits_as_montecarlo(medium):
    """R and T of 1.5 mm, diffuse light: within 5 standard errors."""
    corners, solid = box(1.5)
    entered = media.read(medium).layers[0].medium
    count = 30_000
    points, normals, index = on_the_front(np.zeros(count))
    for c in range(3):
        w = walk(solid, entered, c, points, normals, index, [3])
        below = corners[w.triangle, :, 2].max(axis=1) < -1.0
        layer = montecarlo.Layer(
            n=entered.eta, mu_a=entered.sigma_a[c], mu_s=entered.sigma_s[c], g=entered.g, d=1.5
        )
        judge = montecarlo.simulate([layer], 100_000, 5, illumination="diffuse")
        for side, share in (("transmittance", below), ("diffuse_reflectance", ~below)):
            each = np.bincount(w.source, w.carried * share, count)
            # what photons send back unscattered through two faces is counted as mirrored there
            wanted = getattr(judge, side) / (1 - mirrored(entered.eta))
            error = 5 * np.hypot(each.std() / count**0.5, getattr(judge, f"{side}_error"))
            assert abs(each.mean() - wanted) < error + unscattered(judge, entered.eta), (c, side)


def mirrored(eta):
    """Diffuse light that a face sends back (renderer.optics.fresnel)."""
    from renderer.optics import fresnel

    return 0.0 if eta == 1 else fresnel.diffuse_reflectance(1 / eta)


def unscattered(judge, eta):
    return max(judge.specular - mirrored(eta), 0.0)


def test_nothing_is_lost_where_nothing_is_absorbed():
    ball = shapes.sphere(5.0, 24)
    solid = Solid([Part(ball.positions, ball.faces)])
    medium = Medium((0.0,), (2.0,), eta=1.3)
    sound = np.linalg.norm(Solid([Part(ball.positions, ball.faces)]).normals, axis=1) > 0.5
    k = np.flatnonzero(sound)[np.arange(3000) % sound.sum()]  # at the poles two corners are one
    points = ball.positions[ball.faces[k]].mean(axis=1)
    w = walk(solid, medium, 0, points, solid.normals[k], np.arange(3000), [0])
    assert len(w.carried) == 3000 and (w.carried == 1).all()


def test_constant_light_stays_constant_on_a_slab_and_gains_at_an_edge():
    _, solid = box()
    x = np.array([-50.0, 0.0, 30.0])
    made = walked(MATCHED)
    found = estimate(solid, made, *on_the_front(x), constant, 8000, 2, keep=False)
    np.testing.assert_allclose(found.mean, 1.0, atol=5 * found.noise.max())
    near_rim = estimate(
        solid, made, *on_the_front(np.array([199.8])), constant, 8000, 2, keep=False
    )
    assert (near_rim.mean > 1.05).all()  # a corner has less medium to be absorbed in


def test_seeds_and_halves():
    _, solid = box()
    made, at = walked(MATCHED), on_the_front(np.linspace(-1, 1, 400))

    def run(seed, walks=8):
        return estimate(solid, made, *at, constant, walks, seed, keep=False)

    first, again, other = run(1), run(1), run(2)
    np.testing.assert_array_equal(first.values, again.values)
    assert (first.values != other.values).mean() > 0.9
    for c in range(3):
        assert abs(np.corrcoef(first.values[0, :, c], first.values[1, :, c])[0, 1]) < 0.2
    # a point's walks are its own, whatever else is walked beside it
    points, normals, index = at
    part = estimate(solid, made, points[::7], normals[::7], index[::7], constant, 8, 1, keep=False)
    np.testing.assert_allclose(part.values, first.values[:, ::7], rtol=1e-12)


def test_pooling_takes_noise_away_and_keeps_what_it_found():
    """Even light has hardly any noise left; an edge's value stays within its own."""
    corners, solid = box()
    made = walked(MATCHED)
    points, normals, index = on_the_front(np.tile(np.linspace(-6, 6, 200), 4))
    points[:, 1] += np.repeat(np.linspace(0, 1, 4), 200)

    def edge(triangles, weights):
        place = np.einsum("kc,kca->ka", weights, corners[triangles])
        return np.repeat((place[:, :1] < 0) * 1.0, 3, axis=1)

    found = estimate(solid, made, points, normals, index, edge, 64, 1, keep=False)
    own = np.repeat((points[:, :1] < 0) * 1.0, 3, axis=1)
    pooled = found.pooled(points, own, 1.0)
    far = np.abs(points[:, 0]) > 4
    rough, smooth = (np.ptp(h.values[:, far], axis=0).mean(axis=0) for h in (found, pooled))
    assert (smooth[1:] < 0.4 * rough[1:]).all()
    off = (pooled.mean - found.mean).mean(axis=0)
    assert (np.abs(off) < 4 * found.noise / np.sqrt(len(points))).all()


def test_noise_is_not_counted_as_error():
    rng = np.random.default_rng(0)
    truth = rng.random((200_000, 3))
    halves = truth + rng.normal(0, 0.3, (2, 200_000, 3))
    off = truth + rng.normal(0, 0.05, truth.shape)
    rms, error = rms_error(off, halves)
    assert (np.abs(rms - 0.05) < 4 * error).all() and (error < 0.005).all()
    np.testing.assert_allclose(Halves(halves, halves, 1).noise, 0.3 / np.sqrt(2), rtol=0.02)
    dark = np.zeros((2, 4, 3))  # of a lamp without green, say
    np.testing.assert_array_equal(rms_error(dark[0], dark), np.zeros((2, 3)))


class Interrupting:
    """Light that stops the run at its n-th call."""

    def __init__(self, calls):
        self.left = calls

    def __call__(self, triangles, weights):
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt
        return constant(triangles, weights)


def test_a_run_taken_up_again_equals_one_that_was_not_interrupted(tmp_path, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path))
    monkeypatch.setattr(estimates, "SAVE_EVERY_S", 0.0)
    monkeypatch.setattr(estimates, "BLOCK", 1000)  # two blocks a step
    _, solid = box()
    made, at = walked(MATCHED), on_the_front(np.linspace(-1, 1, 700))
    whole = estimate(solid, made, *at, constant, 24, 1, keep=False)
    with pytest.raises(KeyboardInterrupt):
        estimate(solid, made, *at, Interrupting(6), 24, 1)  # within the third step
    kept = list((tmp_path / "reference").glob("*.npz"))
    assert len(kept) == 1
    again = Interrupting(100)
    taken_up = estimate(solid, made, *at, again, 24, 1)
    np.testing.assert_array_equal(taken_up.values, whole.values)
    fewer = 100 - again.left
    from_nothing = Interrupting(100)
    estimate(solid, made, *at, from_nothing, 24, 9)
    assert fewer < 100 - from_nothing.left
    # all of it is kept, but for other light nothing is
    at_once = Interrupting(1)
    np.testing.assert_array_equal(estimate(solid, made, *at, at_once, 24, 1).values, whole.values)
    dark = estimate(solid, made, *at, lambda t, w: 0 * constant(t, w), 24, 1)
    assert not dark.values.any()


def test_a_curve_without_coefficients_is_walked_in_the_nearest_medium():
    """docs/techniques.md: the six Gaussians' inversion stays 0.006, 0.009 and 0.017 away."""
    made = walked("deon_luebke")
    np.testing.assert_allclose(made.residual, [0.006, 0.009, 0.017], atol=0.002)
    np.testing.assert_allclose(made.albedo, [0.66, 0.42, 0.33], atol=1e-6)
    assert made.medium.eta == 1
    own = walked("skin1")
    assert not own.residual.any() and own.medium.eta == 1.3


@pytest.fixture(scope="module")
def ball():
    with frame_of_ball((64, 48)) as frame:
        yield frame


def test_walks_start_at_what_the_pixels_show(ball):
    inputs = ball.inputs(False)
    where, scatters = places(ball)
    solid = Solid([part_of(drawn) for drawn in inputs.room.surfaces])
    depths = inputs.depths.read()[..., 0]
    points, normals, seen = visible(solid, inputs.room.camera, depths, scatters)
    assert seen.all()
    np.testing.assert_allclose(points, where[scatters], atol=5e-3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    assert (
        np.einsum("ni,ni->n", normals, points - inputs.room.camera["camera_position"]) < 0
    ).all()


def test_the_technique_walks_where_the_medium_is(ball):
    """A ball of 40 mm under constant light has a little more, for there is less medium below it."""
    technique = renderer.make("reference", {"walks": 32})
    light = np.array([2.0, 1.0, 0.5])
    _, scatters = places(ball)
    given = lit(ball, lambda place: np.broadcast_to(light, place.shape))
    with technique.scatter(given).target as target:
        got, count = (texture.read().copy() for texture in target.textures)
    share = got[scatters][:, :3].mean(axis=0) / light
    assert (share > 0.99).all() and (share < 1.05).all()
    assert set(np.unique(count[..., 0])) == {0, 32}
    assert ((count[..., 0] > 0) == scatters).all()


def test_bad_parameters():
    with pytest.raises(InputError, match="walks is 3; expected an even number"):
        renderer.make("reference", {"walks": 3})
    with pytest.raises(InputError, match="translucency is 'slab'; expected one of 'none'"):
        renderer.make("reference", {"translucent": True})
