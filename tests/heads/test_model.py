"""The default head's geometry, and the model made of a user's scan."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import renderer
from renderer.scene import MASKS, Environment, Eye, cornea
from renderer.scene.graph import SceneGraph
from stimuli.heads import anatomy as anatomies
from stimuli.heads import fetch, lashes, subdivide
from stimuli.heads.default_head import default_model
from stimuli.heads.lids import MAP_MM
from stimuli.heads.person import Hair, Lashes, Person
from stimuli.heads.scan_model import scan_model
from stimuli.heads.vessels import vessel_map
from stimuli.parts import PEOPLE, read_toml

MAN = Person.read(read_toml(PEOPLE / "man.toml"), "man")


@pytest.fixture(scope="module")
def anatomy():
    return anatomies.build_anatomy(fetch.mpfb_data(), MAN)


@pytest.fixture(scope="module")
def model(anatomy):
    return default_model(anatomy, seed=3, hair_share=0.05)


def cube():
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    return points, quads


def test_catmull_clark_of_a_cube():
    """First level of the cube, by hand: face points 1, edge points 3/4, corners 5/9 of the half
    edge.
    """
    points, quads = cube()
    smooth, children = subdivide.catmull_clark(quads, 8)
    new = smooth @ points
    np.testing.assert_allclose(np.asarray(smooth.sum(axis=1)).ravel(), 1)
    assert new.shape == (26, 3) and children.shape == (24, 4)
    np.testing.assert_allclose(np.abs(new[:8]), 5 / 9, atol=1e-12)
    np.testing.assert_allclose(
        np.sort(np.abs(new[8:20]), axis=1), np.tile([0, 0.75, 0.75], (12, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.abs(new[20:]).sum(axis=1), 1)


def test_catmull_clark_keeps_a_flat_border():
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(16)])
    quads = np.array([[i, i + 1, i + 5, i + 4] for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)])
    smooth, children = subdivide.catmull_clark(quads, 16)
    new = smooth @ points
    np.testing.assert_allclose(new[:, 2], 0)
    assert new[:, 0].min() >= 0 and new[:, 0].max() <= 3 and len(children) == 36


def test_the_default_head_is_an_adult_head_in_millimetres(anatomy):
    mark = anatomy.landmarks
    apart = np.linalg.norm(anatomy.eyes[0].centre - anatomy.eyes[1].centre)
    assert 54 < apart < 70  # adults: 51 to 77, mean 63 (Dodgson 2004, doi:10.1117/12.529999)
    assert 200 < -mark["chin"][1] < 250  # crown to chin; adult men about 232
    assert all(ball.radius == MAN.eyes.radius_mm for ball in anatomy.eyes)
    assert (
        mark["nose"][1] > mark["mouth"][1] > mark["chin"][1]
        and mark["ear_l"][0] > 60
        and mark["ear_r"][0] < -60
    )


def test_model_parts_fit_together(model):
    skin = model.surface
    assert (
        skin.masks.shape == (len(skin.positions), len(MASKS))
        and skin.masks.min() >= 0
        and skin.masks.max() <= 1
    )
    assert all(skin.masks[:, k].max() > 0.5 for k in range(len(MASKS)))
    np.testing.assert_allclose(np.linalg.norm(skin.normals, axis=1), 1, atol=1e-5)
    assert skin.faces.max() < len(skin.positions) and len(skin.faces) > 150_000
    carried = skin.proxy.to_full @ skin.proxy.positions
    assert np.linalg.norm(carried - skin.positions, axis=1).max() < 6.0
    strands = model.strands
    assert np.isfinite(strands.points).all() and strands.root_vertex.max() < len(skin.positions)
    roots = np.linalg.norm(
        strands.points[strands.first[:-1]] - skin.positions[strands.root_vertex], axis=1
    )
    assert np.quantile(roots, 0.99) < 8 and strands.cover.min() >= 0 and strands.cover.max() <= 1
    for eye in model.eyes:
        ball = eye.tissue[:, 0] == 0
        reach = np.linalg.norm(eye.positions[ball] - eye.centre, axis=1)
        assert reach.min() >= eye.radius - 1e-3 and 0.8 < reach.max() - eye.radius < 3.0
        assert 0 < (~ball).sum() < len(ball)  # the cornea stands out, and a corner has its tissue


def test_eyes_have_the_size_of_eyes_and_lids_that_fit(anatomy, model):
    """Adults: Bekerman et al. 2014 (balls of 24 mm), Rufer et al. 2005 (irises of 11.7 mm); the
    opening is what the person asks for.
    """
    own = MAN.eyes
    for ball, opening, eye in zip(anatomy.eyes, anatomy.openings, model.eyes, strict=True):
        assert 11.5 < ball.radius < 12.5 and 5.4 < eye.iris_radius <= 5.9
        uneven = 0.5 * np.sign(ball.centre[0]) * own.lid_asymmetry_mm
        assert abs(opening.width_mm - own.opening_width_mm) < 0.5
        assert abs(opening.height_mm - own.opening_height_mm - uneven) < 0.3
        upper_mm, lower_mm = opening.reflex_mm  # MRD1 and MRD2
        assert abs(upper_mm - own.mrd1_mm - uneven) < 0.2
        # the upper lid covers 1 to 3 mm of the iris, the lower one touches it
        assert 1 < own.iris_mm - upper_mm < 3 and 0 < own.iris_mm - lower_mm < 1
        # the outer corner stands higher than the inner one
        ends = (opening.lower + opening.upper)[[0, -1]] / 2
        assert 0.5 < np.sign(ball.centre[0]) * (ends[1] - ends[0]) < 2.5
        # the ball is seen to both sides of the iris, less of it above than below
        lower, upper = opening.at(np.zeros(1))
        assert 2 < upper[0] < own.iris_mm and -own.iris_mm < lower[0] < -2
        away = anatomy.fine.positions - ball.centre  # no skin inside the ball or the cornea
        distance = np.linalg.norm(away, axis=1)
        front = cornea.reach(away @ own.direction / distance, ball.radius, own.iris_mm)
        assert (distance > front).all()
        # beside the inner corner the nose's wall is no cliff that would hide it from beside
        side = np.sign(ball.centre[0])
        inner = side * opening.x[0 if side > 0 else -1]
        x = np.arange(inner - 9, inner - 1.5, 0.5)
        start = np.column_stack([side * x, np.full(len(x), -1.0), np.full(len(x), 60.0)])
        mesh = trimesh.Trimesh(away, anatomy.fine.faces, process=False)
        face = mesh.ray.intersects_first(start, np.tile([0.0, 0.0, -1.0], (len(x), 1)))
        n = mesh.face_normals[face]
        z = start[:, 2] + ((mesh.triangles[face, 0] - start) * n).sum(axis=1) / n[:, 2]
        assert (face >= 0).all() and np.abs(np.diff(z) / 0.5).max() < 2.2
        # the corner's tissue lies behind the lids' corner and reaches the ball
        sheet = eye.positions[eye.tissue[:, 0] > 0] - ball.centre
        side = np.sign(ball.centre[0])
        corner = side * opening.x[0 if side > 0 else -1]
        assert (side * sheet[:, 0]).min() < corner < (side * sheet[:, 0]).max()
        hidden = np.linalg.norm(sheet, axis=1) < ball.radius
        # where it dives under the ball it has the ball's colour: no edge is seen
        flesh = eye.tissue[eye.tissue[:, 0] > 0, 0]
        assert hidden.any() and np.median(flesh[hidden]) < 0.05 and flesh.max() > 0.9


def test_the_upper_lids_fold_hangs_over_its_crease():
    bare = replace(MAN, eyes=replace(MAN.eyes, fold_mm=0.0, crease_depth_mm=0.0))
    plain, folded = (
        anatomies.build_anatomy(fetch.mpfb_data(), person, levels=1) for person in (bare, MAN)
    )
    own, ball, opening = MAN.eyes, folded.eyes[0], folded.openings[0]
    moved = folded.fine.positions - plain.fine.positions
    local = plain.fine.positions - ball.centre
    above = local[:, 1] - opening.at(local[:, 0])[1]
    middle = (np.abs(local[:, 0]) < 4) & (local[:, 2] > 8) & (np.linalg.norm(local, axis=1) < 24)
    fold = middle & (np.abs(above - own.crease_mm - 2) < 0.7)
    assert fold.sum() > 5
    # forwards by about the fullness, and down; the brow and the lid's edge stay
    assert (moved[fold, 2] > 0.4 * own.fold_mm).all() and (moved[fold, 2] < own.fold_mm).all()
    assert (moved[fold, 1] < 0).all()
    still = middle & ((above < own.crease_mm - 1.5) | (above > own.crease_mm + 14))
    assert still.sum() > 5 and np.abs(moved[still]).max() < 0.1


def test_no_pocket_lies_beside_the_outer_corners(anatomy):
    """A lamp outwards, above and before lights all skin between the corner and the brow's end."""
    for ball, opening in zip(anatomy.eyes, anatomy.openings, strict=True):
        side = np.sign(ball.centre[0])
        x, y, _ = ((anatomy.fine.positions - ball.centre) * [side, 1, 1]).T
        z = anatomy.fine.positions[:, 2] - ball.centre[2]
        end = -1 if side > 0 else 0
        x, y = x - side * opening.x[end], y - opening.upper[end]
        beside = (np.hypot(x - 4.5, y - 5.0) < 2.5) & (z > -2)
        facing = anatomy.fine.normals[beside] @ [side * 0.57, 0.57, 0.59]
        assert beside.sum() > 20 and facing.min() > 0.15


def test_edge_maps_are_distances_to_the_lids(anatomy):
    opening = anatomy.openings[0]
    edges = opening.edge_map()
    height, width = edges.shape[:2]
    x = (np.arange(width) + 0.5) / width * MAP_MM[0] - 0.5 * MAP_MM[0]
    y = (np.arange(height) + 0.5) / height * MAP_MM[1] - 0.5 * MAP_MM[1]
    column = np.abs(x).argmin()
    lower, upper = opening.at(x[column : column + 1])
    inside = (y > lower) & (y < upper)
    np.testing.assert_array_equal(edges[:, column, 0] > 0, y < upper)
    np.testing.assert_array_equal(edges[:, column, 1] > 0, y > lower)
    assert (edges[inside, column, 0] <= upper - y[inside] + 2e-3).all()  # edges have points
    assert (np.diff(edges[inside, column, 0]) < 0).all()  # nearer and nearer to the upper lid


def test_lashes_stand_on_the_lids_in_tufts(anatomy, model):
    skin = model.surface
    own = Lashes(upper=120, lower=50)
    lids = lashes.grown(
        anatomy, skin.positions, skin.faces, np.random.default_rng(1), own, Hair(), 7
    )
    assert [len(lid["points"]) for lid in lids] == [120, 50, 120, 50]
    for lid, ball, opening in zip(
        lids, np.repeat(anatomy.eyes, 2), np.repeat(anatomy.openings, 2), strict=True
    ):
        roots = lid["points"][:, 0] - ball.centre
        lower, upper = opening.at(roots[:, 0])
        above = np.maximum(roots[:, 1] - upper, lower - roots[:, 1])
        row = (0.2, 0.6) if lid is lids[0] or lid is lids[2] else (0.7, 1.15)
        assert above.min() > row[0] and above.max() < row[1] and (roots[:, 2] > 3).all()
        nearest = skin.positions[lid["root_vertex"]] - ball.centre
        assert np.linalg.norm(nearest - roots, axis=1).max() < 1.0
        along = np.linalg.norm(np.diff(lid["points"], axis=1), axis=2).sum(axis=1)
        assert along.min() > 1 and along.max() < 12
    (up, down) = lids[:2]
    assert (up["points"][:, -1, 1] > up["points"][:, 0, 1]).all()
    assert (down["points"][:, -1, 1] < down["points"][:, 0, 1]).all()
    none = lashes.grown(anatomy, skin.positions, skin.faces, None, Lashes(0, 0), Hair(), 7)
    assert none == []


def test_vessels_leave_the_cornea_free_and_follow_their_seed():
    one, again, other = (vessel_map(seed, 5.9 / 12, True) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert (one != other).any()
    half = 0.5 * len(one)
    y, x = np.indices(one.shape) + 0.5 - half
    angle = np.hypot(x, y) / half * Eye.VESSELS_RAD
    assert not one[angle < np.arcsin(5.9 / 12)].any()
    white = (angle > 0.8) & (angle < 1.5)
    assert 0.03 < (one[white] > 20).mean() < 0.5  # lines, not a surface


def test_hair_repeats_for_one_seed_and_changes_with_it(anatomy, model):
    again, other = (default_model(anatomy, seed=s, hair_share=0.05) for s in (3, 4))
    np.testing.assert_array_equal(again.strands.points, model.strands.points)
    one, two = again.strands.points, other.strands.points
    assert one.shape != two.shape or (one != two).any()


def test_a_scan_renders(tmp_path):
    import trimesh

    from stimuli.heads.placing import Asked
    from stimuli.heads.scan import read_scan

    ball = trimesh.creation.icosphere(5, 0.5)
    ball.apply_scale((160, 235, 200))
    file = tmp_path / "ball.obj"
    ball.export(file)
    scan = read_scan(file, Asked(unit="mm"))
    model = scan_model(scan)
    graph = SceneGraph(Environment((0.5, 0.5, 0.5)), subject=model.landmarks["eyes"])
    graph.add_model(model, np.eye(4))
    with renderer.Renderer(graph, size=(160, 90), supersample=1, rays=16) as drawing:
        frame = drawing.frame(renderer.FRAMINGS["head-shot"])
        result = frame.render(renderer.make("golubev"))
    assert (result.samples > 0).mean() > 0.05 and result.image[result.samples > 0].mean() > 40


def test_an_open_socket_gets_a_ball_where_its_lids_lie():
    """On a head whose balls are known, cut off by what a file keeps: its surface."""
    from stimuli.heads import eyes, scan_model, subdivide
    from stimuli.heads.lids import Eyeball, opening, seated
    from tests.heads import awkward

    positions, faces, marks = awkward.head("woman")
    near = np.linalg.norm(positions - marks["eye_r"], axis=1) < 45
    used, faces = np.unique(faces[near[faces].all(axis=1)], return_inverse=True)
    positions, faces = positions[used], faces.reshape(-1, 3)
    normals = subdivide.vertex_normals(positions, faces)
    positions, normals, _, faces, _ = scan_model._finer(
        positions, normals, np.zeros((len(used), 2)), faces, 2.5
    )
    rough = Eyeball(marks["eye_r"] + [2.5, -3.5, -1.0], 12.0)
    ball = seated(positions, faces, rough)
    assert np.abs(ball.centre - marks["eye_r"]).max() < 0.5
    before = positions.copy()
    positions, normals = scan_model._over_the_balls(positions, normals, faces, (ball,))
    moved = np.linalg.norm(positions - before, axis=1)
    away = np.linalg.norm(before - ball.centre, axis=1)
    assert 0.1 < moved.max() < 2.5 and not moved[away > ball.radius + 8].any()
    # wherever the eye looks no lid lies within the cornea
    eye = scan_model._eye(positions, faces, ball)
    local = positions - ball.centre
    away = np.linalg.norm(local, axis=1)
    lids = away > ball.radius - scan_model.DEEP_MM
    for gaze in ([0.0, 0.0, 1.0], [0.5, 0.0, np.sqrt(0.75)]):
        front = cornea.reach(local @ gaze / away, ball.radius, eye.iris_radius)
        assert (away > front)[lids].all()
    # beside the ball nobody looks into the socket: what is met first is met from the front too
    bare = eyes.eyeball(ball, None, opening(positions, faces, ball))
    assert _socket_seen(positions, faces, bare) > 20
    assert _socket_seen(positions, faces, eye) == 0


def _socket_seen(positions, faces, eye):
    """How many of some rays from the nose's side end deep behind the lids of a right eye; the
    undersides of their rims lie less than 2.5 mm behind.
    """
    skin = trimesh.Trimesh(positions - eye.centre, faces, process=False)
    ball = trimesh.Trimesh(eye.positions - eye.centre, eye.faces, process=False)
    away = np.array([np.sin(np.radians(40)), 0.0, -np.cos(np.radians(40))]) * [-1, 1, 1]
    y, x = np.mgrid[-6:5:0.4, -14:4:0.4]
    through = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 6.0)])
    start = through - 100 * away
    hits, index, _ = skin.ray.intersects_location(
        start, np.tile(away, (len(start), 1)), multiple_hits=False
    )
    first = np.full(len(start), np.inf)
    first[index] = ((hits - start[index]) * away).sum(axis=1)
    met, index_eye, _ = ball.ray.intersects_location(
        start, np.tile(away, (len(start), 1)), multiple_hits=False
    )
    nearer = np.full(len(start), np.inf)
    nearer[index_eye] = ((met - start[index_eye]) * away).sum(axis=1)
    seen = hits[(first < nearer)[index]]
    seen = seen[np.linalg.norm(seen, axis=1) < 1.5 * eye.radius]
    lid, index, _ = skin.ray.intersects_location(
        seen + [0, 0, 0.3], np.tile([0, 0, 1.0], (len(seen), 1)), multiple_hits=False
    )
    return int(((lid - seen[index])[:, 2] > 2.5).sum())


def placed_scan(tmp_path, points, faces, marks):
    """A scan that is placed by landmarks, its groups' names of the file."""
    from stimuli.heads.placing import Asked, by_face
    from stimuli.heads.scan import read_scan

    write_parts(tmp_path / "head.obj", [("Face", trimesh.Trimesh(points, faces, process=False))])
    names = ("eye_l", "eye_r", "nose", "mouth", "chin")
    text = "".join(f"{name} = {marks[name].tolist()}\n" for name in names)
    (tmp_path / "marks.toml").write_text(text, encoding="utf-8")
    asked = Asked(unit="mm", landmarks=str(tmp_path / "marks.toml"))
    return read_scan(tmp_path / "head.obj", asked, by_face)


def test_a_scan_gets_a_persons_hair_and_its_roots_lie_on_it(tmp_path):
    from stimuli.errors import InputError
    from tests.heads import awkward

    few = Hair(scalp=900, brows=40, stubble=60, vellus=60)
    person = replace(MAN, hair=replace(few, style=MAN.hair.style), lashes=Lashes(40, 20))
    moved = awkward.turn("y", 30)  # and away from where the average head stands
    points, faces, marks = awkward.head("woman")
    points = points @ moved.T + [40.0, 300.0, -70.0]
    marks = {name: at @ moved.T + [40.0, 300.0, -70.0] for name, at in marks.items()}
    scan = placed_scan(tmp_path, points, faces, marks)
    assert scan_model(scan, edge_mm=1000).strands is None
    model = scan_model(scan, 1000, person, seed=3)
    strands, skin = model.strands, model.surface
    again = scan_model(scan, 1000, person, seed=3).strands
    np.testing.assert_array_equal(strands.points, again.points)
    surface = trimesh.Trimesh(skin.positions, skin.faces, process=False)
    roots = strands.points[strands.first[:-1]]
    assert trimesh.proximity.closest_point(surface, roots[::3])[1].max() < 0.05
    # scalp above the eyes or behind them, nothing far from the head
    eyes = model.landmarks["eyes"]
    away = trimesh.proximity.closest_point(surface, strands.points[::17])[1]
    assert away.max() < 40 and (roots[:, 1] - eyes[1]).max() > 80
    for ball in model.eyes:  # brows and lashes over each eye
        local = roots - ball.centre
        over = (np.abs(local[:, 0]) < 16) & (local[:, 2] > 0) & (local[:, 1] > 7)
        lids = np.linalg.norm(local, axis=1) < ball.radius + 4
        assert (over & (local[:, 1] < 24)).sum() > 20 and lids.sum() > 50
    assert skin.masks[:, MASKS.index("hair")].max() > 0.5  # its scalp is a scalp
    # hair of its own, as geometry, and no face
    dome = awkward._under_hair(awkward.head("woman")[0]) @ moved.T + [40.0, 300.0, -70.0]
    with pytest.raises(InputError, match="mm off a bare head, so it has hair of its own"):
        scan_model(placed_scan(tmp_path, dome, faces, marks), 1000, person)
    with pytest.raises(InputError, match="'Hair' is hair, and more was asked for"):
        named = replace(scan, part_names=("Face", "Hair"), part_kinds=("skin", "hair"))
        scan_model(named, 1000, person)
    with pytest.raises(InputError, match="no face was found in it, so hair cannot be placed"):
        scan_model(replace(scan, placing=replace(scan.placing, fit=None)), 1000, person)


def write_parts(file, parts):
    """An OBJ of named groups (name, mesh)."""
    lines, start = [], 1
    for name, mesh in parts:
        lines += [
            f"g {name}",
            *(f"v {x} {y} {z}" for x, y, z in mesh.vertices),
            *(f"f {a} {b} {c}" for a, b, c in mesh.faces + start),
        ]
        start += len(mesh.vertices)
    file.write_text("\n".join(lines), encoding="utf-8")


def test_an_uncoloured_scan_gets_eyes_and_loses_cards_and_shells(tmp_path):
    import trimesh

    from stimuli.heads.placing import Asked
    from stimuli.heads.scan import read_scan

    skull = trimesh.creation.icosphere(4, 0.5)
    skull.apply_scale((160, 235, 200))
    ball = trimesh.creation.icosphere(2, 12.0)
    parts = [("Face", skull)]
    for name, side in (("EyeLeft", 1), ("EyeRight", -1)):
        moved = ball.copy()
        moved.apply_translation((31.0 * side, 4.0, 88.0))
        parts.append((name, moved))
    shell = parts[1][1].copy()
    shell.apply_scale(1.02)
    parts += [("EyeOcclusion", shell), ("Eyelashes", shell.copy())]
    write_parts(tmp_path / "head.obj", parts)
    model = scan_model(read_scan(tmp_path / "head.obj", Asked(unit="mm")), edge_mm=1000)
    # eyes replaced, shell and cards gone
    assert len(model.surface.positions) == len(skull.vertices)
    assert [round(float(eye.centre[0])) for eye in model.eyes] == [31, -31]
    assert all(abs(eye.radius - 12.0) < 0.2 for eye in model.eyes)
    np.testing.assert_allclose(model.landmarks["eyes"], [0, 4, 88], atol=0.5)


def test_a_large_scan_is_baked_on_a_cluster(monkeypatch, tmp_path):
    import trimesh

    from stimuli.heads import scan_model as module
    from stimuli.heads.placing import Asked
    from stimuli.heads.scan import read_scan

    ball = trimesh.creation.icosphere(5, 120.0)
    file = tmp_path / "ball.obj"
    ball.export(file)
    monkeypatch.setattr(module, "PROXY_LIMIT", 1000)
    monkeypatch.setattr(module, "CLUSTER_MM", 12.0)
    proxy = scan_model(read_scan(file, Asked(unit="mm")), edge_mm=1000).surface.proxy
    assert len(proxy.positions) < 5000 and proxy.faces.max() < len(proxy.positions)
    assert (
        np.linalg.norm(
            proxy.to_full @ proxy.positions - ball.vertices[: proxy.to_full.shape[0]], axis=1
        ).max()
        < 260
    )  # same size of body
    np.testing.assert_allclose(np.asarray(proxy.to_full.sum(axis=1)).ravel(), 1)
