"""Scans that stand awkwardly: each is understood, or one line says why not."""

from __future__ import annotations

import numpy as np
import pytest

from renderer.scene.objects import Scan
from stimuli.errors import InputError
from stimuli.heads import fetch, load_scan, mpfb, register, template
from stimuli.heads.formats import Source
from stimuli.heads.placing import Asked, by_face, by_size
from stimuli.heads.subdivide import triangles
from tests.heads import awkward
from tests.heads.awkward import person, turn

pytestmark = pytest.mark.network

ORDER = ("eye_l", "eye_r", "nose", "mouth", "chin")


@pytest.fixture(scope="module")
def heads():
    """Name -> points (N, 3) mm, faces, true landmarks; no hair and no eyes."""
    return {name: awkward.head(name) for name in ("woman", "man_dark")}


@pytest.fixture
def source(tmp_path):
    return Source(tmp_path / "scan.obj")


@pytest.mark.parametrize("name", awkward.HEADS)
def test_an_awkward_head_is_put_upright_and_to_its_size(source, name):
    case = awkward.HEADS[name]
    marks = awkward.head(case.who)[2]
    file, faces = case.mesh()
    placed = by_face(source, file, faces, Asked(), name == "as it should be")
    assert (placed.unit, placed.up) == (case.unit, case.up)
    assert placed.turned_deg == pytest.approx(case.turned_deg, abs=4)
    height = placed.fit.height * placed.mm_per_unit
    true = -marks["chin"][1]
    if case.unit == "scaled":
        assert height == pytest.approx(template.load().height_mm)
        true = true * height / true
    else:
        assert height == pytest.approx(true, rel=0.04)
    # landmarks within a centimetre; upright, looking along +z
    found = placed.place(placed.fit.place(np.array([template.load().landmarks[n] for n in ORDER])))
    shrunk = placed.mm_per_unit * case.units_per_mm
    wanted = np.array([marks[n] for n in ORDER]) * shrunk
    assert np.linalg.norm(found - wanted, axis=1).mean() < 10
    assert found[0, 0] > 0 > found[1, 0] and found[2, 2] > found[:2, 2].max()
    silent = placed.unit_source == "format" and case.turned_deg == 0
    assert bool(source.notes) != silent


def test_bodies_and_children_have_their_heads_found(source):
    data = fetch.mpfb_data()
    base = mpfb.read_base(data)
    child = {
        "macrodetails/african-female-child": 1.0,
        "macrodetails/universal-female-child-averagemuscle-averageweight": 1.0,
    }
    for targets in (person("woman").targets, child):
        points = mpfb.morph(data, base.positions, targets) * mpfb.MM_PER_UNIT
        faces = triangles(base.quads)
        fit = register.fit(points @ turn("y", 140).T, faces)
        assert fit.found and 165 < fit.height < 215
        assert np.degrees(np.arccos(fit.forward @ turn("y", 140)[:, 2])) < 5


def test_shapes_without_a_face_are_said_to_have_none(source, monkeypatch):
    import trimesh

    ball = trimesh.creation.icosphere(3)
    shapes = {
        "egg": (ball.vertices * [75, 110, 95], ball.faces),
        "box": (lambda b: (b.vertices, b.faces))(
            trimesh.creation.box((150, 220, 190)).subdivide().subdivide().subdivide()
        ),
    }
    assert not register.fit(*map(np.asarray, shapes["box"])).found
    egg = shapes["egg"]
    fitted = register.fit(*map(np.asarray, egg))
    assert not fitted.found
    monkeypatch.setattr(register, "fit", lambda *_: fitted)  # of one surface, found once
    placed = by_face(source, np.asarray(egg[0]), np.asarray(egg[1]), Asked(), False)
    assert placed.fit is None and placed.unit == "mm"
    assert any("no face was found" in note for note in source.notes)
    with pytest.raises(InputError, match="no face that could be found.*give a scale or landmarks"):
        by_face(source, np.asarray(egg[0]), np.asarray(egg[1]), Asked(head_mm=200), False)


def test_one_triangle_is_no_head(source):
    triangle = np.array([[0, 0, 0], [100.0, 0, 0], [0, 200, 0]])
    with pytest.raises(InputError, match="1 faces.*expected the surface of a head"):
        by_face(source, triangle, np.array([[0, 1, 2]]), Asked(), False)


def test_what_is_given_goes_over_what_is_found(heads, source, tmp_path):
    points, faces, marks = heads["woman"]
    placed = by_face(source, points, faces, Asked(head_mm=250.0, yaw_deg=30.0), False)
    assert placed.fit.height * placed.mm_per_unit == pytest.approx(250)
    ahead = placed.rotation @ [0, 0, 1]
    assert np.degrees(np.arctan2(ahead[0], ahead[2])) == pytest.approx(30)
    file = tmp_path / "marks.toml"
    file.write_text("".join(f"{n} = {marks[n].tolist()}\n" for n in ORDER), encoding="utf-8")
    given = by_face(source, points, faces, Asked(landmarks=str(file), unit="mm"), False)
    np.testing.assert_allclose(given.landmarks["nose"], marks["nose"], atol=1e-9)
    side = by_face(source, points, faces, Asked(forward="x", unit="mm"), False)
    np.testing.assert_allclose(side.rotation @ [1, 0, 0], [0, 0, 1], atol=1e-12)
    with pytest.raises(InputError, match="mm high from crown to chin if its unit is m"):
        by_face(source, points, faces, Asked(unit="m"), False)
    with pytest.raises(InputError, match="cannot look along y with y up"):
        by_size(source, points, faces, Asked(forward="y", up="y"), False)
    for text, words in (
        ("nose = [1, 2, 3]\n", "three or more"),
        ("noze = [1, 2, 3]\n", "'noze'"),
        ("nose = 1\nchin = [0,0,0]\nmouth = [0,1,0]\n", r"nose is 1; expected \[x, y, z\]"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            by_face(source, points, faces, Asked(landmarks=str(file)), False)


def test_the_shipped_template_is_the_one_that_is_made():
    made = template.make(fetch.mpfb_data())
    with np.load(template.FILE) as kept:
        assert set(kept.files) == set(made)
        for name in ("points", "faces", "names", "landmarks"):
            np.testing.assert_array_equal(kept[name], made[name])


@pytest.fixture
def coarse(heads, tmp_path):
    """A coarse head in an STL file: no names, no normals, no colours."""
    import trimesh

    points, faces, _ = heads["woman"]
    file = tmp_path / "coarse.stl"
    trimesh.Trimesh(points, faces, process=False).export(file)
    return file


def test_a_scan_gets_masks_landmarks_eyes_and_a_smooth_surface(coarse, heads):
    from renderer.scene import MASKS

    marks_of_woman = heads["woman"][2]

    head = load_scan(Scan(file=str(coarse), licence="CC0-1.0", credit="MakeHuman"))
    surface, marks = head.model.surface, head.model.landmarks
    lips = surface.positions[surface.masks[:, MASKS.index("lips")] > 0.5]
    assert len(lips) > 50 and np.linalg.norm(lips.mean(axis=0) - marks["mouth"]) < 15
    nose = surface.masks[np.linalg.norm(surface.positions - marks["nose"], axis=1).argmin()]
    chest = surface.masks[surface.positions[:, 1].argmin()]
    assert nose[MASKS.index("oil")] > chest[MASKS.index("oil")]
    # the sockets of this head are open: balls lie within them, behind the lids
    assert len(head.model.eyes) == 2 and any("got eyes" in note for note in head.notes)
    for eye, side in zip(head.model.eyes, ("eye_l", "eye_r"), strict=True):
        assert np.linalg.norm(eye.centre - marks_of_woman[side]) < 0.8
        assert eye.radius == pytest.approx(12, abs=0.3)
    np.testing.assert_allclose(marks["eyes"], 0.5 * (marks["eye_l"] + marks["eye_r"]))
    # finer than the file, whose points all stay, but for lids that are moved out of the cornea
    assert any("subdivided" in note for note in head.notes)
    from scipy.spatial import cKDTree

    plain = load_scan(Scan(file=str(coarse), edge_mm=1000.0, licence="CC0-1.0")).model.surface
    assert len(surface.positions) > 10 * len(plain.positions)
    off = cKDTree(surface.positions).query(plain.positions)[0]
    balls = cKDTree([eye.centre for eye in head.model.eyes])
    lids = balls.query(plain.positions)[0] < 20.5
    assert off[~lids].max() < 1e-4 and off[lids].max() < 0.5
    assert head.licences == [
        {
            "what": "coarse",
            "source": "the user's scan",
            "licence": "CC0-1.0",
            "credit": "MakeHuman",
        }
    ]


def test_sockets_that_are_closed_get_no_eyes():
    import trimesh

    from stimuli.heads.scan_model import _sockets

    ball = trimesh.creation.icosphere(4, 100.0)
    marks = {"eye_l": np.array([30.0, 0, 85]), "eye_r": np.array([-30.0, 0, 85])}
    assert _sockets(np.array(ball.vertices), np.array(ball.faces), marks, 1.0) == ()


def test_a_ball_is_rounder_for_being_subdivided(tmp_path):
    import trimesh

    from stimuli.heads.scan_model import _finer

    ball = trimesh.creation.icosphere(2, 100.0)
    points, normals = np.array(ball.vertices), np.array(ball.vertices) / 100
    fine, across, _, faces, carry = _finer(points, normals, points[:, :2], ball.faces, 10.0)
    assert len(faces) == 16 * len(ball.faces) and carry.shape == (len(fine), len(points))
    assert np.abs(np.linalg.norm(fine, axis=1) - 100).max() < 0.1  # flat ones: 1.5 mm inside
    np.testing.assert_allclose(across, fine / 100, atol=0.01)
    np.testing.assert_allclose(carry @ np.ones(len(points)), 1)


def test_head_draws_a_sheet(coarse, tmp_path, capsys):
    from PIL import Image

    from app.cli import main

    out = tmp_path / "sheet.png"
    assert main(["head", str(coarse), "--out", str(out)]) == 0
    words = capsys.readouterr().out
    assert "mm from crown to chin" in words and "licence is not said" in words
    with Image.open(out) as image:
        assert min(image.size) > 600 and np.asarray(image).std() > 10
    assert main(["head", str(coarse), "--out", str(tmp_path / "sheet.xyz")]) != 0
    assert "expected .png, .pdf, .svg" in capsys.readouterr().err
