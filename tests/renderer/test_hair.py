"""Hair: what it covers, its shadow on itself, and strands left out because nobody sees them."""

from itertools import pairwise

import numpy as np
import pytest

import renderer
from renderer.passes import occlusion
from renderer.passes.hair import SEGMENTS, pieces, ribbon_faces
from renderer.scene import MASKS, Environment, Model, Proxy, Strands, Surface
from renderer.scene.camera import Camera
from renderer.scene.graph import SceneGraph
from renderer.scene.lights import DistantLight
from renderer.scene.material import Material


def stand_of(points, width_mm, back_mm=-200.0, lamp=3.0, sheen=0.5):
    """Strands (S, P, 3) of one width before a square of 400 mm, under a lamp along +z: a graph."""
    count = len(points)
    corners = 200.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    corners[:, 2] = back_mm
    normals, faces = np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]])
    surface = Surface(
        corners.astype(np.float32),
        normals.astype(np.float32),
        (0.5 + corners[:, :2] / 500).astype(np.float32),
        faces.astype(np.uint32),
        np.zeros((4, len(MASKS)), np.float32),
        Proxy.itself(corners, normals, faces, (0.5, 0.5, 0.5)),
    )
    ones = np.ones(count, np.float32)
    strands = Strands(
        points.reshape(-1, 3).astype(np.float32),
        points.shape[1] * np.arange(count + 1),
        width_mm * ones,
        ones,
        np.tile(np.float32([0.1, 0.06, 0.04]), (count, 1)),
        np.zeros(points.shape[0] * points.shape[1], np.float32),
        np.zeros(count, np.int64),
        np.full(count, sheen, np.float32),
    )
    graph = SceneGraph(Environment((0.1, 0.1, 0.1)), subject=np.zeros(3))
    graph.add_model(Model(surface, (), strands, {}, Material(medium="")), np.eye(4))
    graph.add_light(DistantLight(direction=(0.0, 0.0, 1.0), irradiance=(lamp, lamp, lamp)))
    return graph


def test_what_a_thin_strand_covers_is_its_width_at_every_distance():
    """The sum of opacity over the image is width times length, mm, where a strand is thinner than
    a pixel and where it is thicker, at two distances; a third of the way back it is hidden.
    """
    x = np.linspace(-15, 15, 9)
    points = np.stack([x, 0.31 * x, np.zeros(9)], axis=1)[None]
    length = np.linalg.norm(points[0, -1] - points[0, 0])
    for width in (0.03, 0.09, 2.0):
        with renderer.Renderer(stand_of(points, width), (128, 96), 1, 0, 4, 256) as drawing:
            for height in (60.0, 180.0):
                camera = Camera(height_mm=height, yaw_deg=0.0, pitch_deg=0.0)
                with drawing.frame(camera) as frame:
                    opacity = frame.surface.textures[1].read()[..., 3]
                covered = opacity.sum() * (height / 96) ** 2
                assert covered == pytest.approx(width * length, rel=0.09), (width, height)


def test_a_model_of_no_strands_is_one_without_hair():
    with renderer.Renderer(stand_of(np.zeros((0, 2, 3)), 0.1), (32, 24), 1, 0, 4, 256) as drawing:
        camera = Camera(height_mm=60.0, yaw_deg=0.0, pitch_deg=0.0)
        with drawing.frame(camera) as frame:
            assert (frame.render(renderer.make("none")).image > 0).any()


def test_strands_shade_those_behind_them_by_what_they_cover():
    """Light through sheets of parallel strands: each takes width / spacing of it; between the four
    depths of the map it is blended, so that it may be off by half a sheet.
    """
    depth, y, x = 3.0 * np.arange(6), np.arange(-8, 8, 0.25), np.linspace(-12, 12, 7)
    z, rows, across = np.meshgrid(depth, y, x, indexing="ij")
    rows = rows + np.random.default_rng(2).uniform(-1, 1, rows.shape[:2])[..., None]
    points = np.stack([across, rows, -z], axis=-1).reshape(-1, 7, 3)
    graph, width = stand_of(points, 0.06), 0.06
    with renderer.Renderer(graph, (64, 64), 1, rays=4, shadow_map=1024) as drawing:
        (hair,) = drawing.hair
        lit = hair._lit.read()[0, ::-1].reshape(-1, 2)[: len(hair.points)]
        with drawing.frame(Camera(height_mm=60.0, yaw_deg=0.0)) as frame:
            assert frame.surface.textures[1].read()[..., :3].max() > 0
    middle = (np.abs(hair.points[:, :2]) < 5).all(axis=1)
    sheets = [lit[middle & (hair.points[:, 2] == -z)] for z in depth]
    means = np.array([np.exp(-sheet[:, 0]).mean() for sheet in sheets])
    assert means[0] > 0.95 and (np.diff(means) < 0).all()
    np.testing.assert_allclose(means, (1 - width / 0.25) ** np.arange(6), atol=0.1)
    assert np.concatenate(sheets)[:, 1].min() == 1.0, "no surface stands before them"


@pytest.mark.parametrize("framing", ["close-up", "half-length"])
def test_leaving_out_what_is_hidden_changes_no_pixel(drawing, framing, monkeypatch):
    left_out, judge = [], occlusion.hidden

    def count(*bounds):
        left_out.append(judge(*bounds))
        return left_out[-1]

    def nothing(levels, points, *_):
        return np.zeros(len(points), bool)

    images = []
    for hidden in (count, nothing):
        monkeypatch.setattr(occlusion, "hidden", hidden)
        with drawing.frame(renderer.FRAMINGS[framing]) as frame:
            images.append(frame.surface.textures[1].read())
    np.testing.assert_array_equal(*images)
    assert left_out[0].mean() > 0.25, "most of the back of the head is not seen"


def test_what_is_said_to_be_hidden_is():
    """Random lines against a random relief: behind every pixel of their bounds, wherever hidden."""
    rng = np.random.default_rng(5)
    width, height = 96, 70
    depths = np.full((height, width), 300.0, np.float32)
    depths[20:50, 30:80] = rng.uniform(180, 220, (30, 50))
    depths[:, 85:] = 0  # the backdrop
    pixels_per_mm = 100.0  # at 1 mm
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = 2 * pixels_per_mm / width, 2 * pixels_per_mm / height
    projection[2, 2], projection[2, 3], projection[3, 2] = -1.2, -22.0, -1.0
    count = 4000
    depth = rng.uniform(150, 330, (count, 1)) + rng.normal(size=(count, 4))
    xy = rng.uniform(-0.7, 0.7, (count, 1, 2)) * [width, height]
    xy = xy + rng.uniform(1, 12, (count, 1, 1)) * rng.normal(size=(count, 4, 2))
    points = np.concatenate([xy * depth[..., None] / pixels_per_mm, -depth[..., None]], axis=2)
    half = np.full(count, 0.5)
    levels = occlusion.blocks([depths])
    hidden = occlusion.hidden(levels, points, projection, (width, height), half, 1.0)
    at = xy + np.array([width, height]) / 2
    for k in np.flatnonzero(hidden):
        # as wide as it is drawn, and half a pixel for the pixel's own middle
        reach = max(1.0, 0.5 * pixels_per_mm / depth[k].min()) + 0.5
        low = np.maximum(np.floor(at[k].min(axis=0) - reach), 0).astype(int)
        high = np.maximum(np.floor(at[k].max(axis=0) + reach), -1).astype(int)
        seen = depths[low[1] : high[1] + 1, low[0] : high[0] + 1]
        assert seen.size == 0 or (depth[k].min() > np.where(seen > 0, seen, np.inf)).all()
    clear = (depth.max(axis=1) < 170) & (np.abs(xy).max(axis=1) < [40, 30]).all(axis=1)
    assert clear.any() and not hidden[clear].any()
    assert 0.2 < hidden.mean() < 0.9


def test_what_passes_the_eye_is_never_hidden():
    levels = occlusion.blocks([np.full((16, 16), 10.0, np.float32)])
    projection = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1.2, -2.2], [0, 0, -1.0, 0]])
    points = np.array([[[0, 0, -50.0], [0, 0, 5.0]], [[0, 0, -50.0], [0, 0, -60.0]]])
    hidden = occlusion.hidden(levels, points, projection, (16, 16), np.full(2, 0.1), 0.5)
    assert hidden.tolist() == [False, True]


def test_pieces_hold_every_segment_once():
    counts = np.array([2, 5, 6, 14])
    first = np.concatenate([[0], np.cumsum(counts)])
    cut = pieces(first)
    assert cut.shape[1] == SEGMENTS + 1 and len(cut) == 1 + 1 + 2 + 4
    faces = ribbon_faces(cut)
    assert len(faces) == 2 * (counts - 1).sum()
    segments = {tuple(sorted(face)) for face in (faces // 2)[:, [0, 2]]}
    expected = {(k, k + 1) for a, b in pairwise(first) for k in range(a, b - 1)}
    assert segments == expected


def test_hair_that_hangs_far_from_its_root_is_lit_from_where_it_hangs():
    """Under an even sky a root on an open square has all of it, and what hangs 150 mm off 0.8."""
    y = np.linspace(0, -160, 17)
    points = np.stack([0 * y, y, 0 * y], axis=1)[None]
    graph = stand_of(points, 0.07, back_mm=-1.0, lamp=0.0)
    with renderer.Renderer(graph, (32, 32), 1, rays=64, shadow_map=256) as drawing:
        (hair,) = drawing.hair
        seen_from = {"camera_position": np.array([0.0, -80.0, 1e5])}
        passes = (drawing.context, drawing.program, drawing.lamps, drawing.surroundings)
        with hair.shade(*passes, seen_from) as target:
            radiance = target.textures[0].read()[::-1].reshape(-1, 4)[:17, 1]
    assert radiance[0] == pytest.approx(radiance[3], rel=0.02), "within 40 mm as at the root"
    assert (np.diff(radiance) < 1e-4).all()
    assert radiance[-1] == pytest.approx(0.8 * radiance[0], rel=0.05)


@pytest.mark.parametrize("lamp", [0.0, 2.0])
def test_sheen_is_the_share_of_what_a_fibre_mirrors(lamp):
    """Of a lamp behind the camera Marschner's R straight on; of an even sky of 0.1 a fifth."""
    points = np.stack([np.zeros(9), np.linspace(0, 40, 9), np.zeros(9)], axis=1)[None]
    seen = []
    for sheen in (0.0, 0.5, 1.0):
        graph = stand_of(points, 0.07, back_mm=-1.0, lamp=lamp, sheen=sheen)
        with renderer.Renderer(graph, (32, 32), 1, rays=16, shadow_map=256) as drawing:
            (hair,) = drawing.hair
            passes = (drawing.context, drawing.program, drawing.lamps, drawing.surroundings)
            with hair.shade(*passes, {"camera_position": np.array([0.0, 20.0, 1e5])}) as target:
                seen.append(target.textures[0].read()[::-1].reshape(-1, 4)[4, 1])
    mirrored = ((1.55 - 1) / (1.55 + 1)) ** 2
    tilt, spread = 2 * np.radians(3.5), 2 * np.radians(7.5)
    lobe = np.exp(-0.5 * (tilt / spread) ** 2) / (spread * np.sqrt(2 * np.pi))
    expected = mirrored * (0.2 * 0.1 + 0.25 * lobe * lamp)
    assert seen[2] - seen[0] == pytest.approx(expected, rel=0.05)
    assert seen[1] - seen[0] == pytest.approx(0.5 * (seen[2] - seen[0]), rel=0.05)
