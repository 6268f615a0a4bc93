"""Memory: an image is filtered in pieces that give the bytes of the whole, hair and triangles are
gone through in parts; nothing is kept.
"""

import tracemalloc

import numpy as np
import pytest

import renderer
from renderer.optics.transmittance import Translucency
from renderer.passes import facing
from renderer.passes import pieces as cutting
from renderer.passes.pieces import PIECE_PIXELS, Piece, pieces
from renderer.scene import shapes
from renderer.scene.camera import Camera
from renderer.scene.lights import DistantLight
from tests.renderer.slab import frame_of_ball
from tests.renderer.test_hair import stand_of

#: Bytes a pixel: irradiance 16, specular, albedo and, once it is asked for, transmitted light 8
#: each, depths and depth buffer 4 + 4; of a piece, light 16, depth 4, result 20, and two targets of
#: a filter.
FRAME_BYTES, PIECE_BYTES = 48, 72


@pytest.fixture(scope="module")
def small_ball():
    with frame_of_ball((32, 32)) as frame:
        yield frame


@pytest.mark.parametrize("supersample", [1, 2, 3, 4])
@pytest.mark.parametrize("reach", [0.0, 7.3, 60.0, 500.0])
def test_pieces_cover_every_row_once_with_all_that_their_light_comes_from(supersample, reach):
    height = 360 * supersample
    cut = pieces(640, height, reach, supersample, 640 * 150)
    assert [piece.low for piece in cut] == [0, *(piece.high for piece in cut[:-1])]
    assert cut[-1].high == height and (len(cut) > 1 or reach > height)
    for piece in cut:
        last = piece.first + piece.rows
        assert piece.first == 0 or piece.low - piece.first >= reach
        assert last == height or last - piece.high >= reach
        assert piece.first % 2 == 0 and piece.low % supersample == 0
    rows = [np.arange(height)[piece.image_rows(height)] for piece in reversed(cut)]
    np.testing.assert_array_equal(np.concatenate(rows), np.arange(height))


@pytest.mark.parametrize("reach", [None, float("inf")])
def test_light_from_anywhere_and_small_images_make_one_piece(reach):
    assert pieces(4000, 4000, reach, 2) == [Piece(0, 4000, 0, 4000)]
    assert pieces(640, 360, 10.0, 2) == [Piece(0, 360, 0, 360)]


def test_pieces_give_the_bytes_of_the_whole(frames, techniques, monkeypatch):
    frame = frames["close-up"]
    in_whole = {
        "subdermal"
    }  # the only filter of the screen whose means a piece's edge would change
    screen = {t: one for t, one in techniques.items() if one.domain == "screen"}
    wholes = {t: frame.render(one) for t, one in screen.items() if t not in in_whole}
    monkeypatch.setattr(cutting, "PIECE_PIXELS", 640 * 200)
    cut = {name: len(frame.pieces(technique)) for name, technique in techniques.items()}
    assert {name for name, count in cut.items() if count > 1} == wholes.keys()
    for name, whole in wholes.items():
        result = frame.render(techniques[name])
        np.testing.assert_array_equal(result.image, whole.image, err_msg=name)
        np.testing.assert_array_equal(result.samples, whole.samples, err_msg=name)
        if whole.contrast is not None:
            np.testing.assert_array_equal(result.contrast, whole.contrast, err_msg=name)


def test_a_frame_and_its_pieces_hold_what_is_reckoned_and_free_it(frames, drawing, monkeypatch):
    """So that 3840x2160 pixels take 630 MB of buffers at most, with the thesis's techniques."""
    assert FRAME_BYTES * 3840 * 2160 + PIECE_BYTES * PIECE_PIXELS < 630e6
    context, pixels = drawing.context, 640 * 360
    monkeypatch.setattr(cutting, "PIECE_PIXELS", pixels // 2)
    context.make_current()
    frames["close-up"].transmitted(Translucency())  # its table is kept with the scene
    before = context.held
    with drawing.frame(renderer.FRAMINGS["half-length"]) as frame:
        frame.transmitted(Translucency())
        shared = context.held
        assert shared - before <= FRAME_BYTES * pixels
        for name in ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian"):
            technique = renderer.make(name)
            largest = max(piece.rows for piece in frame.pieces(technique)) * frame.width
            assert largest < pixels
            context.most = context.held
            frame.render(technique)
            assert context.most - shared <= PIECE_BYTES * largest, name
            context.make_current()
            assert context.held == shared, name
    assert context.held == before


@pytest.mark.parametrize("name", ["gosselin", "deon_luebke", "splat_dipole"])
def test_techniques_over_surfaces_keep_nothing(name, techniques, small_ball):
    context, held = small_ball.renderer.context, []
    for _ in range(2):  # the first time makes what a surface is looked up by
        small_ball.scatter(techniques[name]).delete()
        context.make_current()
        held.append(context.held)
    assert held[0] == held[1]


@pytest.fixture
def traced():
    """traced() -> bytes of arrays that are held, and the most that were since the last call."""
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]

    def since():
        held, most = (value - before for value in tracemalloc.get_traced_memory())
        tracemalloc.reset_peak()
        return held, most

    yield since
    tracemalloc.stop()


def test_hair_takes_little_more_than_its_points(traced):
    """Bytes a point: 12 are its place, which the scene has; textures are made some rows at a time.

    A head of long hair has 3 million points, and 100 bytes more for each were 300 MB.
    """
    strands, points = 20_000, 20
    rng = np.random.default_rng(0)
    at = np.empty((strands, points, 3), np.float32)
    at[..., :2] = rng.uniform(-60, 60, (strands, 1, 2))
    at[..., 2] = np.linspace(0, 30, points)
    graph, count = stand_of(at, 0.07), strands * points
    before = traced()[0]
    with renderer.Renderer(graph, (32, 32), 1, rays=4, shadow_map=64) as drawing:
        (hair,) = drawing.hair
        held, most = traced()
        assert len(hair.points) == count and drawing.lamps.strand_layers
        assert held - before < 20 * count and most - before < 60 * count
        with drawing.frame(Camera(height_mm=200.0)) as frame:
            assert frame.surface.textures[1].read()[..., 3].max() > 0, "hair is seen"
        assert traced()[1] - before < 70 * count


def test_triangles_are_sorted_by_their_lamps_without_being_kept_as_corners(traced):
    """Bytes a triangle; nine corners' numbers and as many of normals were 144 for each."""
    ball = shapes.sphere(50.0, rings=200)
    count, before = len(ball.faces), traced()[0]
    corners = facing.Corners(ball.positions, ball.normals, ball.faces)
    can = corners.lit([DistantLight(), DistantLight(direction=(0.0, 0.0, -1.0))])
    can |= corners.behind(np.array([0.0, 0.0, 1e4]))
    held, most = traced()
    assert can[0].mean() > 0.4 and can.all(axis=0).any()
    assert held - before < 40 * count and most - before < 100 * count
