"""Radiosity: form factors, energy, and Monte Carlo as its judge; and the gallery."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from renderer.errors import InputError
from renderer.illumination import paths, radiosity
from renderer.illumination.rays import World
from stimuli import illumination, scenes

COARSE = illumination.Options(size_px=40, samples=24, patch_mm=125.0, rays=256)


@pytest.fixture(scope="module")
def room():
    """The box with matt materials, solved with coarse patches."""
    return illumination.Room(illumination.matt(scenes.load_table("box")), COARSE)


def test_form_factors_of_a_cube_are_those_of_the_catalogue():
    found, cosines = illumination.cube(1 << 14, seed=1)
    opposite, beside = illumination.CUBE
    assert opposite + 4 * beside == pytest.approx(1, abs=2e-6)
    np.testing.assert_allclose(found.sum(axis=1), 1, atol=1e-12)
    want = np.where(cosines < -0.5, opposite, np.where(cosines > 0.5, 0, beside))
    assert np.abs(found - want).max() < 4 * np.sqrt(0.2 * 0.8 / (1 << 14))


def test_form_factors_are_reciprocal_and_their_rows_sum_to_one(room):
    made = room.solution.exchange
    seen = made.area > 0
    rows = (made.F.sum(axis=1) + made.open)[seen]
    np.testing.assert_allclose(rows, 1, atol=1e-8)
    sent = made.area[:, None] * made.F
    np.testing.assert_allclose(sent, sent.T, atol=1e-9 * sent.max())
    # by rays alone, reciprocity holds within the noise of a binomial count
    share = made.counted[seen][:, seen]
    area = made.area[seen]
    spread = area[:, None] ** 2 * share * (1 - share) / COARSE.rays
    off = (area[:, None] * share - (area[:, None] * share).T) / np.sqrt(spread + spread.T + 1e-9)
    often = (share * COARSE.rays > 9) & (share.T * COARSE.rays > 9)
    assert often.sum() > 100
    assert np.sqrt((off[often] ** 2).mean()) < 1.3


def test_few_rays_are_balanced_too():
    """Counts that no scaling makes reciprocal: energy is kept, nothing is negative."""
    rng = np.random.default_rng(2)
    area = rng.uniform(1, 100, 60)
    found = rng.multinomial(4, np.full(60, 1 / 90).tolist() + [1 / 3], 60)[:, :60] / 4
    F = radiosity.balanced(found, area)
    sent = area[:, None] * F
    np.testing.assert_allclose(sent, sent.T, atol=1e-12)
    np.testing.assert_allclose(F.sum(axis=1), found.sum(axis=1), atol=1e-12)
    assert (F >= 0).all() and np.isfinite(F).all()


def test_a_closed_room_keeps_its_light(room):
    """E = 1 and rho = 1/2 everywhere: B = E / (1 - rho); and the lamp's light is all absorbed."""
    made, count = room.solution.exchange, len(room.solution.exchange.area)
    seen = made.area > 0
    one = np.ones((count, 3))
    *_, B = radiosity.gauss_seidel(made.F, 0.5 * one, one, tolerance=1e-9)
    np.testing.assert_allclose(B[seen], 2, rtol=1e-6)
    comes, goes = room.solution.balance()
    np.testing.assert_allclose(goes, comes, rtol=1e-5)
    assert made.open.max() == 0


def test_an_open_room_loses_what_leaves():
    """Light from around comes in through the open side, and energy is still balanced."""
    table = {
        "objects": {"room": {"shape": "box", "size_mm": [100.0] * 3}},
        "materials": {"room": {"kind": "shading", "model": "lambert", "albedo": [0.6] * 3}},
        "environment": {"ambient": [0.5] * 3},
    }
    found = radiosity.solve(World(scenes.stage(scenes.read_scene(table)).graph), 50.0, 256, 1)
    comes, goes = found.balance()
    np.testing.assert_allclose(goes, comes, rtol=1e-5)
    back = found.patches.normals[:, 2] > 0.9  # faces the opening
    assert found.exchange.open[back].mean() == pytest.approx(illumination.CUBE[0], abs=0.03)


def test_gauss_seidel_is_the_solution_and_each_sweep_comes_nearer(room):
    s = room.solution
    M = np.eye(len(s.B)) - s.patches.albedo[:, :1] * s.exchange.F
    want = np.linalg.solve(M, s.sweeps[0][:, 0])
    away = [np.abs(B[:, 0] - want).max() for B in s.sweeps]
    assert away[-1] < 1e-5 * want.max() and (np.diff(away) < 0).all()


def test_radiosity_agrees_with_monte_carlo(room):
    """With ray-traced direct light nearly; by patches alone but for their size; no better without
    interreflection.
    """
    found, error = paths.picture(room.world, room.view, room.size, COARSE.samples, 7)
    assert error.mean() < 0.15 * found.mean()

    def away(image):
        square = ((image - found) ** 2).mean() - (error**2).mean()
        return np.sqrt(max(square, 0)) / found.mean()

    two_pass, patched = room.two_pass(), room.patched()
    assert two_pass.mean() == pytest.approx(found.mean(), rel=0.02)
    assert away(two_pass) < 0.08 < away(room.traced(0))
    assert away(two_pass) < away(patched) < 0.3


def test_too_many_patches_are_refused(room):
    with pytest.raises(InputError, match="patches of 2 mm; expected at most 6000"):
        radiosity.patches(room.world, 2.0)


def test_the_gallery_goes_on_where_it_stopped(tmp_path, monkeypatch, run):
    local = illumination.local_panels
    monkeypatch.setattr(illumination, "local_panels", lambda o: itertools.islice(local(o), 2))
    args = ["--size", 32, "--samples", 2, "--patch", 250, "--rays", 16, "--depth", 2]
    code, out, _ = run("illumination", tmp_path / "g", *args)
    assert code == 0 and "row sum, least" in out
    names = {path.stem for path in (tmp_path / "g").glob("*.png")}
    assert {"gallery", "tree", "ray_casting", "whitted", "radiosity", "monte_carlo"} <= names
    stamps = {n: (tmp_path / "g" / f"{n}.png").stat().st_mtime_ns for n in names}
    first = json.loads((tmp_path / "g/numbers.json").read_text())
    assert first["settings"]["seed"] == 0 and first["numbers"]["row sum, most"] <= 1 + 1e-6
    (tmp_path / "g/whitted.png").write_bytes(b"half")
    options = illumination.Options("box", 32, 2, 250.0, 16, 2)
    illumination.gallery(tmp_path / "g", replace(options))
    for name in names - {"gallery", "tree"}:
        again = (tmp_path / "g" / f"{name}.png").stat().st_mtime_ns != stamps[name]
        assert again == (name == "whitted"), name
    assert json.loads((tmp_path / "g/numbers.json").read_text()) == first


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--pixel", "1,0"], "expected two shares from 0 to below 1"),
        (["--scene", "bix"], "no scene 'bix'; did you mean 'box'?"),
        (["--patch", "0"], "--patch"),
    ],
)
def test_bad_input_is_one_line(run, args, message):
    code, _, err = run("illumination", "out", *args)
    assert code == 2 and message in err and "Traceback" not in err
