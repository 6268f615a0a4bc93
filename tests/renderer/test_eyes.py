"""Eyes: refraction against rays traced here, the lids' shade, the lamp in the tears, the gaze."""

from dataclasses import replace

import numpy as np
import pyrender
import pytest
import trimesh

import renderer
from renderer.passes import bake as baking
from renderer.scene import DistantLight, Environment
from renderer.scene.camera import Camera
from renderer.scene.graph import EyePrimitive, SceneGraph
from stimuli.heads.eyes import eyeball
from stimuli.heads.lids import Eyeball, Opening
from stimuli.heads.person import Eyes

SIZE = 128
FRAME_MM, FAR_MM = 26.0, 600.0
WHITE = (1.0, 1.0, 1.0)
PLAIN = Eyes(iris=WHITE, fibres=WHITE, collarette=WHITE, gaze="given", gaze_yaw_deg=0.0, caruncle=0)
SKY = Environment(ambient=WHITE)


def almond():
    """An opening of 24 by 10 mm about the middle of a ball."""
    x = np.linspace(-12, 12, 161)
    half = 5 * np.sqrt(np.maximum(1 - (x / 12) ** 2, 0))
    return Opening(x, -half, half, (9.0, 5.0))


def camera(yaw):
    fov = float(np.degrees(2 * np.arctan(0.5 * FRAME_MM / FAR_MM)))
    return Camera("eye", (0.0, 0.0, 0.0), FRAME_MM, yaw, 0.0, fov)


def seen(eye, yaw=0.0, lights=(), environment=SKY):
    """The buffers of a picture of one eye: irradiance, specular light, albedo (SIZE, SIZE, 4)."""
    graph = SceneGraph(environment, subject=np.zeros(3))
    graph.add(pyrender.Mesh([EyePrimitive(eye)]))
    away = trimesh.creation.box((1, 1, 1))
    away.apply_translation((0, 0, -400))
    graph.add(pyrender.Mesh.from_trimesh(away))
    for light in lights:
        graph.add_light(light)
    with renderer.Renderer(graph, (SIZE, SIZE), 1, rays=16, shadow_map=512) as drawing:
        with drawing.frame(camera(yaw)) as frame:
            return [texture.read() for texture in frame.surface.textures[:3]]


def pupil_by_rays(own, yaw, index):
    """Which pixels see the pupil (SIZE, SIZE): rays through a spherical cornea onto the iris.

    The iris: from 0.35 mm behind the limbus at its root to 3.65 mm behind the apex in its middle.
    """
    radius, iris, curve = own.radius_mm, own.iris_mm, 7.8
    limbus = np.sqrt(radius**2 - iris**2)
    cap = limbus - np.sqrt(curve**2 - iris**2)
    turn = np.radians(yaw)
    eye = FAR_MM * np.array([np.sin(turn), 0, np.cos(turn)])
    right, back = np.array([np.cos(turn), 0, -np.sin(turn)]), eye / FAR_MM
    at = (np.arange(SIZE) + 0.5) / SIZE - 0.5
    x, y = np.meshgrid(FRAME_MM * at, -FRAME_MM * at)
    ray = x[..., None] * right + y[..., None] * np.array([0, 1.0, 0]) - FAR_MM * back
    ray /= np.linalg.norm(ray, axis=2, keepdims=True)
    middle = np.array([0, 0, cap])
    b = ((eye - middle) * ray).sum(axis=2)
    under = b**2 - ((eye - middle) ** 2).sum() + curve**2
    hit = under > 0
    p = eye + (-b - np.sqrt(np.where(hit, under, 0)))[..., None] * ray
    hit &= (p[..., 2] > limbus) & (np.hypot(p[..., 0], p[..., 1]) < iris - 0.4)
    n = (p - middle) / curve
    cosine = -(n * ray).sum(axis=2, keepdims=True)
    ratio = 1 / index
    inner = np.sqrt(np.maximum(1 - ratio**2 * (1 - cosine**2), 0))
    bent = ratio * ray + (ratio * cosine - inner) * n  # Snell's law in vectors
    root, pupil = limbus - 0.35, cap + curve - 3.65
    z = np.full(x.shape, pupil)
    for _ in range(20):
        q = p + bent * ((z - p[..., 2]) / np.minimum(bent[..., 2], -1e-6))[..., None]
        t = np.clip(np.hypot(q[..., 0], q[..., 1]) / iris, 0, 1)
        z = pupil + (root - pupil) * t * t * (3 - 2 * t)
    return hit & (np.hypot(q[..., 0], q[..., 1]) < own.pupil_mm)


def beam_on_the_iris(own, towards, places):
    """Irradiance of the iris at (x, 0) mm for x in places, over a beam's own: its rays counted."""
    curve, index, side, half = 7.8, 1.336, np.linspace(-8, 8, 1600), 0.4
    limbus = np.sqrt(own.radius_mm**2 - own.iris_mm**2)
    cap = limbus - np.sqrt(curve**2 - own.iris_mm**2)
    towards = np.array(towards)
    a, b = np.meshgrid(side, side)
    across = np.array([towards[2], 0, -towards[0]])
    start = a[..., None] * across + b[..., None] * np.array([0, 1.0, 0]) + [0, 0, 3.0]
    along = (start * towards).sum(axis=2)  # of rays about the middle of the cornea's sphere
    under = along**2 - (start**2).sum(axis=2) + curve**2
    hit = under > 0
    p = start + (np.sqrt(np.where(hit, under, 0)) - along)[..., None] * towards
    n, cosine = p / curve, (p * towards).sum(axis=2, keepdims=True) / curve
    hit &= p[..., 2] > limbus - cap
    bent = n * (cosine / index - np.sqrt(1 - (1 - cosine**2) / index**2)) - towards / index
    z, root, pupil = curve - 3.65, limbus - cap - 0.35, curve - 3.65
    for _ in range(8):
        q = p + bent * ((z - p[..., 2]) / np.minimum(bent[..., 2], -0.1))[..., None]
        t = np.clip(np.hypot(q[..., 0], q[..., 1]) / own.iris_mm, 0, 1)
        z = pupil + (root - pupil) * t * t * (3 - 2 * t)
    cell = (side[1] - side[0]) ** 2
    near = [hit & (np.abs(q[..., 0] - x) < half) & (np.abs(q[..., 1]) < half) for x in places]
    return np.array([each.sum() * cell / (2 * half) ** 2 for each in near])


def overlap(a, b):
    return (a & b).sum() / (a | b).sum()


@pytest.mark.parametrize("yaw", [0.0, 40.0])
def test_the_pupil_is_where_snells_law_puts_it(yaw):
    own = replace(PLAIN, pupil_mm=2.2, veins=0.0)  # vessels are dark too
    eye = eyeball(Eyeball(np.zeros(3), own.radius_mm), own)
    _, _, albedo = seen(eye, yaw)
    inside = pupil_by_rays(own, yaw, 1.336)
    near = np.abs(np.add.outer(np.arange(SIZE) - SIZE / 2, np.zeros(SIZE))) < 40
    dark = (albedo[..., 1] < 0.16) & (albedo[..., 3] > 0) & near
    assert inside.sum() > 200
    assert overlap(dark, inside) > 0.90
    assert overlap(dark, inside) > overlap(dark, pupil_by_rays(own, yaw, 1.0)) + 0.1


@pytest.mark.parametrize("turn", [20.0, 45.0])
def test_a_lamp_at_the_side_lights_the_iris_most_on_the_other_side(turn):
    """Irradiance along the iris against rays of an even beam traced through the cornea."""
    own = replace(PLAIN, meniscus_mm=0.0, lid_shade=0.0)
    towards = (np.sin(np.radians(turn)), 0.0, np.cos(np.radians(turn)))
    lamp = DistantLight(WHITE, shadow=False, direction=towards, radius_deg=1.0)
    eye = eyeball(Eyeball(np.zeros(3), own.radius_mm), own)
    light = seen(eye, lights=[lamp], environment=Environment())[0][SIZE // 2, :, 1]
    # the cornea shows the iris larger by some 13 %
    drawn = np.interp([-3.0, 0.0, 3.0], (np.arange(SIZE) + 0.5) / SIZE * FRAME_MM - 13, light)
    traced = beam_on_the_iris(own, towards, [-2.65, 0.0, 2.65])
    np.testing.assert_allclose(drawn / drawn[1], traced / traced[1], rtol=0.2)
    assert drawn[0] > drawn[1] > drawn[2]


def test_the_upper_lid_shades_the_ball_less_and_less_away_from_it():
    own = replace(PLAIN, meniscus_mm=0.0, lid_shade=0.5, gaze_yaw_deg=-40.0)
    shaded, bare = (
        seen(eyeball(Eyeball(np.zeros(3), 12.0), o, almond()))[0]
        for o in (own, replace(own, lid_shade=0.0))
    )
    column = SIZE // 2 + 12  # of the sclera
    rows = np.arange(SIZE // 2 - 20, SIZE // 2 + 4)  # from below the upper edge to the middle
    share = shaded[rows, column, 1] / bare[rows, column, 1]
    assert (np.diff(share) > 0).all() and share[0] < 0.75 and 0.8 < share[-1] < 1


def test_lashes_keep_light_from_everywhere_off_the_ball_and_a_lamps_not():
    own = replace(PLAIN, meniscus_mm=0.0, lid_shade=0.0, lash_veil=0.3)
    lamp = DistantLight(WHITE, shadow=False, direction=(0.0, 0.0, 1.0), radius_deg=1.0)
    for light, left in (({}, 0.7), ({"lights": [lamp], "environment": Environment()}, 1.0)):
        veiled, bare = (
            seen(eyeball(Eyeball(np.zeros(3), 12.0), o), **light)[0][SIZE // 2, SIZE // 2, 1]
            for o in (own, replace(own, lash_veil=0.0))
        )
        assert bare > 0 and veiled / bare == pytest.approx(left, rel=0.01)


def test_each_share_of_the_lids_shade_darkens_the_ball_by_itself():
    none = replace(PLAIN, meniscus_mm=0.0, lid_shade=0.6, lid_shade_shares=(0.0,) * 4)
    shares = 0.9 * np.eye(4)
    light = [
        seen(eyeball(Eyeball(np.zeros(3), 12.0), o, almond()))[0][..., 1]
        for o in (none, *(replace(none, lid_shade_shares=tuple(row)) for row in shares))
    ]
    seen_ball = light[0] > 0
    lost = [np.where(seen_ball, 1 - own / np.maximum(light[0], 1e-9), 0) for own in light[1:]]
    assert all(each.max() > 0.2 and each.min() > -1e-3 for each in lost)
    middle = slice(SIZE // 2 - 4, SIZE // 2 + 4)
    assert all(each[middle, middle].max() < 0.2 for each in lost)


def test_the_catchlight_moves_with_the_lamp():
    eye = eyeball(Eyeball(np.zeros(3), 12.0), PLAIN)
    places = []
    for side in (-0.5, 0.0, 0.5):
        lamp = DistantLight((3.0, 3.0, 3.0), shadow=False, direction=(side, 0.3, 1), radius_deg=4)
        light = seen(eye, lights=[lamp], environment=Environment())[1][..., 1]
        assert light.max() > 1.0  # brighter than white, from a lamp of 4 degrees
        y, x = np.nonzero(light > 0.5 * light.max())
        places.append((x.mean(), y.mean()))
        # on a sphere of 7.8 mm the mirrored lamp stands where the normal halves the angle
        half = np.array([side, 0.3, 1]) / np.linalg.norm([side, 0.3, 1]) + [0, 0, 1]
        expected = 7.8 * half[:2] / np.linalg.norm(half) * SIZE / FRAME_MM
        np.testing.assert_allclose(
            places[-1], [SIZE / 2 + expected[0], SIZE / 2 - expected[1]], atol=1.6
        )
    assert places[0][0] < places[1][0] - 5 < places[2][0] - 10


def test_eyes_look_into_the_lens_as_far_as_they_turn():
    eye = eyeball(Eyeball(np.array([30.0, 0, 0]), 12.0), Eyes(gaze_yaw_deg=10.0))
    lens = np.array([330.0, 50.0, 900.0])
    away = (lens - eye.centre) / np.linalg.norm(lens - eye.centre)
    np.testing.assert_allclose(eye.towards(lens), away)
    given = [np.sin(np.radians(10)), 0, np.cos(np.radians(10))]
    np.testing.assert_allclose(eye.towards(np.array([900.0, 0, 100.0])), given)  # too far round
    np.testing.assert_allclose(replace(eye, into_lens=False).towards(lens), given)
    positions, normals = eye.looking(away)
    tip = np.linalg.norm(positions - eye.centre, axis=1).argmax()
    unit = (positions[tip] - eye.centre) / np.linalg.norm(positions[tip] - eye.centre)
    assert unit @ away > np.cos(np.radians(4))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    # normals are those of the mesh itself
    mesh = trimesh.Trimesh(positions, eye.faces, process=False)
    clear = (eye.positions - eye.centre)[:, 2] > 0
    agree = (mesh.vertex_normals * normals).sum(axis=1)[clear]
    assert np.quantile(np.abs(agree), 0.02) > 0.995


def test_vertices_under_a_lid_borrow_light_from_those_beside_it():
    ball = trimesh.creation.icosphere(3, 12.0)
    lid = trimesh.creation.box((60, 30, 30))
    lid.apply_translation((0, 15.4, 0))  # hides all above y = 0.4
    bodies = [
        baking.Body(ball.vertices, ball.vertex_normals, ball.faces, np.full((642, 3), 0.5), 0),
        baking.Body(lid.vertices, lid.vertex_normals, lid.faces, np.full((8, 3), 0.5), 0),
    ]
    sky = Environment(ambient=WHITE).radiance_of_panels
    black = baking.bake(bodies, [], sky, 64, 0)[0]
    bodies[0] = replace(bodies[0], hidden=np.full(642, baking.HIDDEN_BALL), ball=True)
    lent = baking.bake(bodies, [], sky, 64, 0)[0]
    under = ball.vertices[:, 1] > 3
    assert black.openness[under].max() < 0.05 and lent.openness[under].min() > 0.15
    beside = ball.vertices[:, 1] < -2
    np.testing.assert_array_equal(black.light[beside], lent.light[beside])
