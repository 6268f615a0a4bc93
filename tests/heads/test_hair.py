"""Generated hair: styles as data, lengths, and strands that stay out of the head."""

import tracemalloc

import numpy as np
import pytest
import trimesh

from renderer.scene import MASKS
from stimuli.heads import growth, hair
from stimuli.heads.person import Hair
from stimuli.heads.styles import HAIRSTYLES, Style
from stimuli.parts import names

EYES = np.array([0.0, -112.0, 120.0])


@pytest.fixture(scope="module")
def scalp():
    """A ball for a head, haired above its equator and behind."""
    ball = trimesh.creation.icosphere(5, 92.0)
    normals = np.array(ball.vertices) / 92.0
    positions = normals * 92.0 + [0.0, -100.0, 45.0]
    masks = np.zeros((len(positions), len(MASKS)))
    masks[:, MASKS.index("hair")] = np.clip(0.5 + normals[:, 1] * 3 - normals[:, 2], 0, 1)
    return hair.Scalp(positions, normals, np.array(ball.faces), masks)


def grown(scalp, own, seed=1):
    return hair.scalp_hair(scalp, EYES, np.random.default_rng(seed), 0.01, own)


def off_the_ball(points):
    return np.linalg.norm(points - [0.0, -100.0, 45.0], axis=-1) - 92.0


@pytest.mark.parametrize("name", names(HAIRSTYLES))
def test_every_style_stays_out_of_the_head_and_within_its_lengths(scalp, name):
    own = Hair.read({"style": name}, "hair")
    styled, *_ = grown(scalp, own)
    points = styled["points"].astype(float)
    off = off_the_ball(points)
    assert off[:, 2:].min() > -0.35, "the ball's facets lie 0.1 mm below it, a cell is 4 mm"
    assert np.isfinite(points).all() and 0 <= styled["cover"].min() <= styled["cover"].max() <= 1
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    rows = np.array(own.style.anchors)
    # waves and pushes make the line longer than it was grown
    assert np.median(steps.sum(axis=1)) < 1.5 * rows[:, 2].max()
    assert np.median(steps.sum(axis=1)) > 0.25 * rows[:, 2].min()


def test_the_same_bytes_for_one_seed(scalp):
    own = Hair()
    first, again, other = (grown(scalp, own, seed)[0]["points"] for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes() and first.tobytes() != other.tobytes()


def test_a_parting_shows_skin_and_parts_the_strands(scalp):
    own = Hair()
    style = own.style
    points = grown(scalp, own)[0]["points"]
    near = growth.parting_nearness(style, points[:, 0], EYES) > 0.9
    off = points[:, 0, 0] - style.part_mm
    gap = np.abs(off) < 0.5 * style.part_gap_mm
    assert (near & gap).sum() < 0.5 * (near & (np.abs(off) < 4)).sum() / 8 + 3
    beside = near & (np.abs(off) < 10)
    moved = points[:, 4, 0] - points[:, 0, 0]
    assert moved[beside & (off < -1)].mean() < 0 < moved[beside & (off > 1)].mean()


def test_cover_is_the_hair_outwards_of_a_point():
    """A slab of strands along x, 12 mm thick: 1 - exp(-2 / pi of what lies above, 13 mm far)."""
    rng = np.random.default_rng(3)
    width, count, thick = 0.07, 6000, 12.0
    y, z = rng.uniform(-20, 20, count), rng.uniform(0, thick, count)
    x = np.linspace(-20, 20, 30)
    curves = np.stack(np.broadcast_arrays(x, y[:, None], z[:, None]), axis=-1)
    out = np.tile([0.0, 0.0, 1.0], (curves.size // 3, 1))
    cover = growth.covered(curves, np.full(count, width), out)
    means, expected = [], []
    for low, high in ((1, 4), (5, 8), (9, 11)):  # cells blur by 3 mm
        layer = (np.abs(y) < 12) & (low < z) & (z < high)
        above = count * 40 * width / (40 * 40 * thick) * (thick - z[layer])
        means.append(cover[layer, 15].mean())
        expected.append((1 - np.exp(-2 / np.pi * above)).mean())
    assert (np.diff(means) < 0).all()
    np.testing.assert_allclose(means, expected, atol=0.25)


def test_grey_strands_have_no_pigment():
    own = Hair.read({"grey": 1.0, "lightness": 0.0}, "hair")
    colours = hair.pigmented(own, np.zeros(3), np.linspace(0, 1, 3), 1.0)
    np.testing.assert_allclose(colours, np.tile(own.grey_colour, (3, 1)))
    colours = hair.pigmented(own, np.zeros(3), np.linspace(0, 1, 3), 0.0)
    np.testing.assert_allclose(colours, np.tile(own.colour, (3, 1)))


@pytest.mark.parametrize("mixed", [0.02, 0.8, 20.0])
def test_strands_lose_the_share_of_their_pigment_that_is_asked_for(mixed):
    """By Beer's law, on average; of two minds or of one."""
    own = Hair.read({"grey": 0.7, "lightness": 0.0, "grey_mixed": mixed}, "hair")
    drawn = (np.arange(4000) + 0.5) / 4000
    colours = hair.pigmented(own, np.zeros(4000), drawn, own.grey)
    full, bare = np.log(own.colour[1]), np.log(own.grey_colour[1])
    held = (np.log(colours[:, 1]) - bare) / (full - bare)
    assert held.mean() == pytest.approx(0.3, abs=0.005)
    between = ((held > 0.1) & (held < 0.9)).mean()
    assert between < 0.1 if mixed < 0.1 else between > (0.3 if mixed < 2 else 0.95)


@pytest.mark.parametrize(
    ("field", "value"),
    [("fly_width", 0.05), ("width_uneven", 0.6), ("spread_deg", 1.0), ("grey_mixed", 0.0)],
)
def test_how_strands_differ_has_bounds(field, value):
    with pytest.raises(ValueError, match=rf"hair\.{field} is {value}"):
        Hair.read({field: value}, "hair")


@pytest.mark.parametrize(
    ("style", "message"),
    [
        ("side_prat", "did you mean 'side_part'"),
        ({"anchors": [[0, 1, 2]]}, "expected degrees, up, length"),
        ({"anchors": [[0, 60, 900, 5, 1, 0, 1, 0]]}, "length is 900; expected 0 to 700"),
        ({"anchors": [[0, 60, 20, 5, 1, 0, 0, 0]]}, "a row without a direction"),
        ({"like": "side_part", "locks": 0}, "hair.style.locks is 0"),
    ],
)
def test_a_style_that_cannot_be_is_refused(style, message):
    with pytest.raises(ValueError, match="style") as error:
        Style.read(style, "hair.style")
    assert message in str(error.value)


def test_a_hair_alone_before_the_face_is_left_out_and_a_bundle_is_not():
    rng = np.random.default_rng(4)
    down = np.linspace(0, -60, 12)
    forward = EYES + [0.0, 10.0, 20.0]
    strand = forward + np.stack([0 * down, down, 0 * down], axis=1)
    bundle = strand + [30.0, 0.0, 0.0] + rng.uniform(-1.5, 1.5, (60, 1, 3))
    behind = strand - [0.0, 0.0, 200.0]
    curves = np.concatenate([strand[None], bundle, behind[None]])
    alone = hair.alone_before_the_face(curves, EYES, share=1.0)
    assert alone[0] and not alone[1:].any()


def test_roots_are_denser_beside_a_parting_and_rise_off_it(scalp):
    plain = {"like": "side_part", "part_dense": 0.0, "part_lift_deg": 0.0}
    shares, lifts = [], []
    for style in (plain, "side_part"):
        own = Hair.read({"style": style}, "hair")
        points = hair.scalp_hair(scalp, EYES, np.random.default_rng(1), 0.06, own)[0]["points"]
        roots, way = points[:, 0], points[:, 1] - points[:, 0]
        away = np.abs(roots[:, 0] - own.style.part_mm)
        beside = (growth.parting_nearness(own.style, roots, EYES) > 0.9) & (away < 6)
        out = (roots - [0.0, -100.0, 45.0]) / 92.0
        rise = (way * out).sum(axis=1) / np.linalg.norm(way, axis=1)
        shares.append(beside.mean())
        lifts.append(np.degrees(np.arcsin(rise[beside & (away > 1)])).mean())
    assert shares[1] > 1.3 * shares[0]
    assert lifts[1] > lifts[0] + 5


def test_brows_differ_fade_at_the_tail_and_follow_what_is_said():
    """On a plane before two eyes 64 mm apart."""
    grid = np.linspace(-90, 90, 91)
    x, y = (values.ravel() for values in np.meshgrid(grid, grid, indexing="ij"))
    positions = np.column_stack([x, y, np.full(len(x), 100.0)])
    corner = np.arange(91 * 91).reshape(91, 91)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    normals = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    plane = hair.Scalp(positions, normals, faces, np.zeros((len(x), len(MASKS))))
    eyes = np.array([[32.0, 0.0, 90.0], [-32.0, 0.0, 90.0]])
    for uneven in (0.0, 2.0):
        own = Hair.read({"brow_uneven": uneven, "brow_fine": 1.0}, "hair")
        left, right = hair.brows(plane, eyes, np.random.default_rng(2), 600, own)
        assert len(left["points"]) == 1200, "a fine hair for each"
        middle = [np.median(brow["points"][:, 0, 1]) for brow in (left, right)]
        assert (abs(middle[0] - middle[1]) > 0.3) == bool(uneven)
        u = (left["points"][:, 0, 0] - 32.0 - own.brow_inner_mm) / own.brow_length_mm
        tail, body = (u > 0.85).sum() / 0.15, ((u > 0.3) & (u < 0.5)).sum() / 0.2
        assert 0.1 < tail / body < 0.5
        way = left["points"][:, 1] - left["points"][:, 0]
        assert np.median(way[u < 0.05, 1]) > 2 * abs(np.median(way[u < 0.05, 0])), "up at the nose"
        assert np.median(way[u > 0.85, 0]) > 0 > np.median(way[u > 0.85, 1])
        widths = left["width_mm"]
        assert np.quantile(widths, 0.9) < 0.12 and np.quantile(widths, 0.1) < 0.04
        assert (left["sheen"] == own.brow_sheen).all() and own.brow_sheen < own.sheen
    ends = []
    for said in (0.0, 1.0):
        own = Hair.read({"brow_tail": said, "brow_uneven": 0.0}, "hair")
        left, _ = hair.brows(plane, eyes, np.random.default_rng(2), 600, own)
        u = (left["points"][:, 0, 0] - 32.0 - own.brow_inner_mm) / own.brow_length_mm
        ends.append((u > 0.9).mean() / (np.abs(u - 0.4) < 0.05).mean())
    assert ends[0] < 0.15 and ends[1] == pytest.approx(1.0, abs=0.25)


def test_long_strands_are_waved_and_covered_some_at_a_time(monkeypatch):
    """In at most a few times what they take themselves, and as if all were at once."""
    count, points = 24_000, 20
    rng = np.random.default_rng(4)
    start = rng.uniform(-60, 60, (count, 1, 3))
    curves = start + np.linspace(0, 200, points)[:, None] * [0.0, -0.9, 0.4]
    low, high = curves.min(axis=(0, 1)) - 10, curves.max(axis=(0, 1)) + 10
    shape = np.ceil((high - low) / 20).astype(int) + 1
    skin = growth.Grid(low, 20.0, rng.random((*shape, 4)))
    style, length = Style.read("long", "style"), rng.uniform(100, 200, count)

    out = np.broadcast_to([0.0, 0.0, 1.0], (count * points, 3))

    def made():
        drawn = np.random.default_rng(2)
        draw = lambda a, b, c, *shape: drawn.normal(size=(count, *shape))
        waved = hair._waved(curves.copy(), style, length, draw, drawn, skin)
        return waved, growth.covered(waved, np.full(count, 0.07), out)

    tracemalloc.start()
    try:
        waved, cover = made()
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 5 * curves.nbytes
    assert np.abs(waved - curves).max() > 1.0 and 0 < cover.max() <= 1
    monkeypatch.setattr(growth, "parts", lambda whole, *_: [slice(0, whole)])
    for some, all_at_once in zip((waved, cover), made(), strict=True):
        np.testing.assert_array_equal(some, all_at_once)
