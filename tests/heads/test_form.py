"""The form of a person: folds as deep as they are said to be, lips that meet, two like sides."""

import numpy as np
import pytest
import trimesh

from renderer.errors import InputError
from stimuli import scenes
from stimuli.heads import anatomy as anatomies
from stimuli.heads import fetch, garment, mouth, mpfb, subdivide
from stimuli.heads.expression import Expression
from stimuli.heads.form import PLACES, Form
from stimuli.heads.person import Clothes, Person

FOLD = {"height_mm": -1.5, "width_mm": 2.2, "bulge_mm": 0.0}


def build(form: Form, levels: int = 2):
    return anatomies.build_anatomy(fetch.mpfb_data(), Person(form=form), levels)


@pytest.fixture(scope="module")
def folded():
    """One fold alone, on both sides, and closed lips."""
    even = {"folds": 0.0, "bones": 0.0, "asymmetry": 0.0, "wander_mm": 0.0}
    return build(Form(**even, relief={"nasolabial": FOLD}))


def first(bust, origins, towards):
    """How far the rays go until they meet the skin (N,)."""
    mesh = trimesh.Trimesh(bust.positions, bust.faces, process=False, validate=False)
    rays = trimesh.ray.ray_pyembree.RayMeshIntersector(mesh)
    place, ray, _ = rays.intersects_location(origins, towards, multiple_hits=False)
    distance = np.full(len(origins), np.inf)
    distance[ray] = np.linalg.norm(place - origins[ray], axis=1)
    return distance


def test_a_fold_is_as_deep_and_as_wide_as_its_field(folded):
    for curve in (c for c in folded.curves if c.name == "nasolabial"):
        middle = (curve.along > 0.35) & (curve.along < 0.45)
        points, normals = curve.points[middle], curve.normals[middle]
        across = np.cross(normals, curve.tangents[middle])
        depth = lambda at: first(folded.fine, at + 5 * normals, -normals) - 5  # noqa: B023
        np.testing.assert_allclose(depth(points), 1.5, atol=0.12)
        # the skin is curved: what lies on both sides is its mean
        wide = FOLD["width_mm"]
        aside = 0.5 * (depth(points + wide * across) + depth(points - wide * across))
        far = 0.5 * (depth(points + 3 * wide * across) + depth(points - 3 * wide * across))
        np.testing.assert_allclose(aside - far / 9, 1.5 / np.e, atol=0.2)


def test_closed_lips_lie_over_each_other(folded):
    bust = folded.fine
    x, upper, lower = mouth.seam(bust.positions, bust.normals, bust.masks["lips"])
    inner = np.abs(x - x.mean()) < 0.85 * np.abs(x - x.mean()).max()
    assert (lower - upper)[inner].min() > 0.2
    gap = np.column_stack([x, 0.5 * (lower + upper), np.full(len(x), 400.0)])[inner]
    front = bust.positions[bust.masks["lips"] > 0.5][:, 2].max()
    depth = 400 - first(bust, gap, np.tile([0.0, 0.0, -1.0], (len(gap), 1)))
    assert depth.min() > front - 18  # a ray between the lips does not pass them


def test_the_vermilion_is_as_high_as_its_field(folded):
    sized = build(Form(folds=0.0, bones=0.0, vermilion_mm=(5.0, 8.0))).fine
    for bust, tolerance in ((sized, 0.35), (folded.fine, None)):
        shape = (bust.positions, bust.normals, bust.faces, bust.masks["lips"])
        x, _, upper, lower = mouth.heights(*shape)
        middle = 0.5 * (x[0] + x[-1])
        own = np.interp(middle, x, upper), np.interp(middle, x, lower)
        if tolerance:
            np.testing.assert_allclose(own, (5.0, 8.0), atol=tolerance)
        else:  # the mesh's own lips are fuller
            assert own[0] > 6 and own[1] > 9


def test_nostrils_are_open_and_as_deep_as_their_field(folded):
    closed = build(Form(folds=0.0, bones=0.0, wander_mm=0.0, nostril_mm=0.0)).fine
    p, dark = folded.fine.positions, folded.fine.masks["nostrils"]
    bore = np.array([0.0, 0.94, -0.34]) / np.hypot(0.94, 0.34)
    for side in (1, -1):
        lining = p[(dark > 0.9) & (side * p[:, 0] > 0)]
        below = lining[(lining @ bore).argmax()] - 10 * bore
        origins = below + np.outer(np.linspace(-1.5, 1.5, 7), [0.0, 0.0, 1.0])
        up = np.tile(bore, (7, 1))
        deeper = first(folded.fine, origins, up) - first(closed, origins, up)
        np.testing.assert_allclose(deeper.max(), Form().nostril_mm, atol=0.8)
    assert not closed.masks["nostrils"].any()
    # only what faces down is lining: the wings' outer skin is not
    assert dark[folded.fine.normals @ bore > 0.75].max() == 0


def test_nostrils_with_a_wide_floor_have_steep_walls(folded):
    """Vertices between the floor and the rim lie deeper, those of the floor and the rim do not."""
    wide = build(Form(folds=0.0, bones=0.0, asymmetry=0.0, wander_mm=0.0, nostril_wall=0.6)).fine
    same = build(Form(folds=0.0, bones=0.0, asymmetry=0.0, wander_mm=0.0)).fine
    bore = np.array([0.0, 0.94, -0.34]) / np.hypot(0.94, 0.34)
    deeper = (wide.positions - same.positions) @ bore
    dark = same.masks["nostrils"]
    between = (dark > 0.4) & (dark < 0.9)
    assert deeper[between].max() > 0.8 and deeper.min() > -1e-9
    assert np.abs(deeper[dark == 0]).max() < 0.2


def test_an_expression_moves_its_side_by_its_millimetres():
    data = fetch.mpfb_data()
    base = mpfb.read_base(data).positions
    moved = lambda **own: (Expression(**own).shown(data, base, base) - base) * mpfb.MM_PER_UNIT
    none, smile = moved(), moved(kind="slight_smile")
    assert not none.any()
    left, right = base[:, 0] > 0.15, base[:, 0] < -0.15
    high = lambda way, side: np.abs(way[side, 1]).max()
    assert 1.5 < high(smile, left) < 4 and high(smile, left) == pytest.approx(high(smile, right))
    one = moved(kind="slight_smile", uneven=1.0)
    assert high(one, left) > 1.5 * high(smile, left) and high(one, right) < 0.3 * high(smile, right)
    twice = moved(kind="slight_smile", strength=2.0)
    np.testing.assert_allclose(twice, 2 * smile, atol=1e-9)
    # a movement of one's own goes over the kind's
    np.testing.assert_allclose(
        moved(kind="slight_smile", movements={"smile": 0.0, "mouth_wide": 0.0}), none, atol=1e-12
    )
    up, down = moved(kind="raised_brows"), moved(kind="frown")
    brow = np.linalg.norm(up, axis=1).argmax()
    assert up[brow, 1] > 1.5 and down[np.linalg.norm(down, axis=1).argmax(), 1] < -1.5


def test_a_scene_gives_a_person_another_expression():
    head = {"shape": "person", "expression": {"kind": "frown"}}
    table = {"rig": "studio", "objects": {"head": head}}
    assert scenes.read_scene(table).objects["head"].expression == {"kind": "frown"}
    for wrong, words in (
        ({"kind": "grin"}, "head.expression.kind is 'grin'"),
        ({"movements": {"wink": 1.0}}, "head.expression.movements.wink is unknown"),
        ("frown", "head.expression is 'frown'"),
    ):
        table["objects"] = {"head": {"shape": "person", "expression": wrong}}
        with pytest.raises(InputError, match=words):
            scenes.read_scene(table)


def test_a_shirt_lies_over_the_skin_and_hides_what_is_left_out(folded):
    from scipy.spatial import cKDTree

    own = Clothes()
    cloth, skin = garment.shirt(folded, own), folded.fine
    _, near = cKDTree(skin.positions).query(cloth.positions)
    above = ((cloth.positions - skin.positions[near]) * skin.normals[near]).sum(axis=1)
    # the band's turned-in edge, which nobody sees, may dip into hollows; in the armpits the nearest
    # skin is the arm's
    chest = np.abs(cloth.positions[:, 0]) < 105
    assert np.quantile(above[chest], 0.01) > 0 and above[chest].min() > -0.9
    # rays from outside meet the cloth before the skin wherever skin was left out
    gone = np.setdiff1d(skin.faces, skin.faces[garment.bare(skin, own)])
    gone = gone[skin.positions[gone, 1] > -450][::7]
    points, normals = skin.positions[gone], skin.normals[gone]
    mesh = trimesh.Trimesh(cloth.positions, cloth.faces, process=False, validate=False)
    rays = trimesh.ray.ray_pyembree.RayMeshIntersector(mesh)
    assert rays.intersects_any(points + 0.01 * normals, normals).mean() > 0.995
    assert np.isfinite(cloth.positions).all() and len(cloth.faces) > 20_000
    np.testing.assert_allclose(np.asarray(cloth.proxy.to_full.sum(axis=1)).ravel(), 1)


def test_the_torso_turns_and_the_face_stays():
    data = fetch.mpfb_data()
    base = mpfb.read_base(data)
    turned = mpfb.turn_torso(data, base, base.positions, 20.0, 0.0)
    eye, wrist = base.groups["helper-l-eye"], base.groups["joint-l-hand"]
    np.testing.assert_allclose(turned[eye], base.positions[eye], atol=1e-9)
    before, after = base.positions[wrist].mean(axis=0), turned[wrist].mean(axis=0)
    pivot = np.linalg.norm(after[[0, 2]]) - np.linalg.norm(before[[0, 2]])
    assert after[2] < before[2] and abs(pivot) < 0.5 and after[1] == pytest.approx(before[1])


def test_both_sides_are_alike_without_asymmetry(folded):
    from scipy.spatial import cKDTree

    p, lips = folded.fine.positions, folded.fine.masks["lips"]
    face = (p[:, 2] > 60) & (p[:, 1] > -230)
    for ball in folded.eyes:  # lids are fitted to each ball by itself
        face &= np.linalg.norm(p - ball.centre, axis=1) > 30
    apart, _ = cKDTree(p).query(p * [-1, 1, 1])
    assert np.quantile(apart[face & (lips < 0.05)], 0.99) < 0.05
    assert np.quantile(apart[face], 0.99) < 0.25  # the mask of the lips itself is not quite even


def test_what_strays_is_drawn_from_the_seed():
    one, same, other = (build(Form(seed=s, wander_mm=2.0), 1).fine.positions for s in (5, 5, 6))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 0.1


def test_a_partly_split_mesh_has_no_gaps():
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    quads = np.array([[i, i + 1, i + 6, i + 5] for i in range(19) if i % 5 < 4])
    for seed in range(8):
        chosen = np.random.default_rng(seed).random(len(quads)) < 0.4
        new, _, faces, uv_faces, _ = subdivide.refined(quads, quads, 25, 25, chosen)
        mesh = trimesh.Trimesh(new @ points, faces, process=False)
        np.testing.assert_array_equal(faces, uv_faces)
        _, shared = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
        # a disc: a gap would be one more border
        assert shared.max() == 2 and mesh.euler_number == 1
        assert (mesh.face_normals[:, 2] > 0.99).all()


def test_older_people_have_deeper_folds_and_the_same_bones():
    young, old = Form(age_years=22), Form(age_years=70)
    for name, place in PLACES.items():
        a, b = abs(young.of(name).height_mm), abs(old.of(name).height_mm)
        assert (a <= b) if place.fold else a == b
    assert abs(old.of("nasolabial").height_mm) > 2 * abs(young.of("nasolabial").height_mm)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"age_years": 3}, "person.form.age_years is 3 years; expected 15.0 to 95.0"),
        ({"relief": {"larinx": {}}}, "person.form.relief.larinx is unknown"),
        ({"relief": {"larynx": {"height": 1}}}, "relief.larynx.height is unknown"),
        ({"relief": {"larynx": {"height_mm": 90}}}, "larynx.height_mm is 90 mm; expected -15.0"),
        ({"relief": {"larynx": 2}}, "person.form.relief.larynx is 2; expected a table"),
        ({"weaker": "both"}, "expected one of 'left', 'right'"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(table, words):
    with pytest.raises(InputError) as caught:
        Person.read({"form": table}, "person")
    assert words in str(caught.value) and "\n" not in str(caught.value)
