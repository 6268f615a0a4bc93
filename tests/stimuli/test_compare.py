"""`subdermal compare` and `subdermal techniques`: regions, tables, sheets, and what is refused."""

import csv
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from tqdm import tqdm

import renderer
from renderer.errors import InputError as RenderError
from renderer.reference.places import back_lit, near_shadow_edges
from renderer.reference.walk import Part, Solid
from renderer.scene import shapes
from stimuli.compare import chosen
from stimuli.errors import InputError

DOCS = Path(__file__).parents[2] / "docs"
SCENE = """
subject = "floor"
objects.floor = { shape = "slab", size_mm = [60.0, 60.0, 20.0] }
objects.bar = { shape = "slab", size_mm = [4.0, 30.0, 4.0], position_mm = [0.0, 0.0, 14.0] }
materials.floor = { medium = "deon_luebke", albedo = [0.8, 0.7, 0.6] }
materials.bar = { medium = "", albedo = [0.1, 0.1, 0.1] }
lights.sun = { direction = [0.6, 0.0, 0.8], irradiance = [3.0, 2.0, 1.0], radius_deg = 0.1 }
environment = { ambient = [0.01, 0.01, 0.01] }
camera = { framing = "floor", height_mm = 24.0, yaw_deg = 0.0, pitch_deg = 0.0 }
"""


def sheet(thickness_mm, towards):
    """back_lit of a point on the front of a slab, for a lamp in a direction."""
    shape = shapes.slab((100.0, 100.0, thickness_mm), cells=2)
    solid = Solid([Part(shape.positions, shape.faces)])
    lamp = renderer_light(towards)
    at = np.array([[3.0, 2.0, thickness_mm / 2]])
    return back_lit(solid, solid, [lamp], at, np.array([[0.0, 0.0, 1.0]]), 8.0)[0]


def renderer_light(towards):
    from renderer.scene.lights import DistantLight

    return DistantLight((1.0, 1.0, 1.0), direction=towards)


def test_thin_parts_are_those_that_a_lamp_behind_them_lights():
    assert sheet(4.0, (0.0, 0.1, -1.0))
    assert not sheet(4.0, (0.0, 0.1, 1.0))
    assert not sheet(12.0, (0.0, 0.1, -1.0))
    assert not sheet(6.0, (1.0, 0.0, -0.5))  # 6 mm through, but 13 mm along the light


def test_shadow_edges_are_found_to_the_pixel():
    """A bar above a plane, light at 45 degrees, one pixel a mm: its shadow's edges at x = 8, 12."""
    bar = shapes.slab((4.0, 400.0, 0.5), cells=2)
    ground = shapes.slab((400.0, 400.0, 1.0), cells=2)
    solid = Solid(
        [
            Part(bar.positions + [0, 0, 10.0], bar.faces),
            Part(ground.positions - [0, 0, 0.5], ground.faces),
        ]
    )
    x = np.arange(-20, 20) + 0.5
    points = np.stack(np.meshgrid(x, np.arange(4.0), [0.0], indexing="xy"), axis=-1).reshape(-1, 3)
    where, depths = np.ones((4, 40), bool), np.full((4, 40), 50.0)
    towards = renderer_light((-1.0, 0.0, 1.0))
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    found = near_shadow_edges(solid, [towards], points, up, where, depths, 50.0, 1.5)
    lit = [x[k] for k in np.flatnonzero(found[0])]
    np.testing.assert_allclose(lit, [6.5, 7.5, 8.5, 9.5, 10.5, 11.5, 12.5, 13.5], atol=1.01)


def test_what_techniques_are_named():
    found = chosen(["none", "golubev:samples=64:translucent=false"])
    assert list(found) == ["none", "golubev samples=64 translucent=false"]
    assert found["golubev samples=64 translucent=false"].samples == 64
    assert set(chosen(["all"])) == set(renderer.TECHNIQUES) - {"reference"}
    with pytest.raises(InputError, match="expected NAME or NAME:KEY=VALUE"):
        chosen(["golubev:samples"])
    with pytest.raises(InputError, match="is what techniques are compared to"):
        chosen(["reference"])
    with pytest.raises(RenderError, match="no technique 'golub'"):
        chosen(["golub"])


def test_a_table_and_a_sheet(run, tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    options = ("--size", "64x48", "--crop", "48x32+8+8", "--walks", 8)
    techniques = ("-t", "none", "-t", "golubev:samples=64")
    files = ("--out", "sheet.png", "--table", "table.csv")
    code, out, err = run("compare", "scene.toml", *techniques, *options, *files)
    assert code == 0, err
    rows = list(csv.DictReader((tmp_path / "table.csv").open()))
    assert {(row["technique"], row["region"]) for row in rows} == {
        (name, region)
        for name in ("none", "golubev samples=64")
        for region in ("skin", "shadow edges")
    }
    by = {(row["technique"], row["region"]): SimpleNamespace(**row) for row in rows}
    without, golubev = by["none", "shadow edges"], by["golubev samples=64", "shadow edges"]
    # the shadow of a sharp lamp: red spreads over millimetres, which `none` lacks
    assert float(without.rmse_r) > 0.05 > float(golubev.rmse_r)
    assert float(without.dssim) > float(golubev.dssim) > 0
    assert float(golubev.flip_half) > 0 and float(golubev.ratio_r) == pytest.approx(1, abs=0.05)
    assert "standard error" in out and "shadow edges" in out
    with Image.open(tmp_path / "sheet.png") as page:
        assert page.width == 3 * 48 + 2 * 4


def test_a_colour_without_light_is_no_error(run, tmp_path):
    """Nothing is nowhere wrong: errors of 0 and a ratio of 1, not nan."""
    (tmp_path / "scene.toml").write_text(SCENE)
    red = ("lights.sun.irradiance=[3,0,1]", "environment.ambient=[0,0,0]")
    options = ("--size", "64x48", "--crop", "48x32+8+8", "--walks", 2, "--table", "table.csv")
    patches = [part for value in red for part in ("--set", value)]
    code, out, err = run("compare", "scene.toml", "-t", "none", *options, *patches)
    assert code == 0, err
    for row in csv.DictReader((tmp_path / "table.csv").open()):
        assert [float(row[f"{name}_g"]) for name in ("rmse", "error", "ratio")] == [0, 0, 1]
        assert float(row["rmse_r"]) > 0
    assert "nan" not in out


def test_six_gaussians_over_the_atlas_and_over_the_screen_are_one_picture(
    run, tmp_path, monkeypatch
):
    """On a flat slab under the shadows of bars: DSSIM below 0.002 (0.0007 at 480x270,
    docs/techniques.md), a hundredth of what leaving scattering out makes."""
    techniques = ("-t", "none", "-t", "deon_luebke:texturing=0:size=1024")
    where = (DOCS / "scenes" / "bars.toml", "--size", "240x135", "--table", "table.csv")
    bars = []

    class Bar(tqdm):
        def __init__(self, *given, **options):
            super().__init__(*given, **options | {"disable": False})
            bars.append(self)

    monkeypatch.setattr("tqdm.tqdm", Bar)
    code, out, err = run(
        "compare", *where, *techniques, "--against", "jimenez_gaussian:texturing=0"
    )
    assert code == 0, err
    assert [(bar.n, bar.total) for bar in bars] == [(2, 2)]
    assert "against jimenez_gaussian texturing=0" in out and "standard error" not in out
    rows = {
        row["technique"]: row
        for row in csv.DictReader((tmp_path / "table.csv").open())
        if row["region"] == "skin"
    }
    without, atlas = rows["none"], rows["deon_luebke texturing=0 size=1024"]
    assert float(atlas["dssim"]) < 0.002 and float(without["dssim"]) > 0.05
    for channel in "rgb":
        assert float(atlas[f"rmse_{channel}"]) < 0.015
        assert float(atlas[f"ratio_{channel}"]) == pytest.approx(1, abs=0.005)
    assert atlas["dssim_half"] == atlas["dssim"] and float(atlas["error_r"]) < 1e-3


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--crop", "90x20+0+0"), "the crop 90x20+0+0 does not fit"),
        (("--crop", "20,20"), "expected WIDTHxHEIGHT+X+Y"),
        (("--walks", 3), "reference.walks is 3; expected an even number"),
        (("--against", "all"), "--against is 'all'; expected one technique"),
        (("--out", "sheet.gif"), "expected a file name that ends in .png"),
        (("--set", "objects.floor.material=bar"), "nothing scatters in it"),
    ],
)
def test_what_is_refused(run, tmp_path, more, words):
    (tmp_path / "scene.toml").write_text(SCENE)
    code, _, err = run("compare", "scene.toml", "-t", "none", "--size", "64x48", *more)
    assert code == 2 and words in err and err.count("\n") == 1


def test_techniques_are_listed(run):
    code, out, _ = run("techniques", "--json")
    found = json.loads(out)
    assert code == 0 and set(found) == set(renderer.TECHNIQUES)
    for name, entry in found.items():
        assert entry["paper"] and len(entry["fit_error"]) == 3
        assert set(entry["parameters"]) == set(renderer.TECHNIQUES[name].names())
    samples = found["golubev"]["parameters"]["samples"]
    assert samples["default"] == 22 and samples["source"]
    np.testing.assert_allclose(found["reference"]["fit_error"], [0.006, 0.009, 0.017], atol=2e-3)
    code, out, _ = run("techniques", "golubev")
    assert code == 0 and out.startswith("golubev: ") and "samples = 22" in out
    code, _, err = run("techniques", "golub")
    assert code == 2 and "no technique 'golub'" in err


def test_the_page_of_parameters_is_what_the_command_says(run):
    """Its tables hold every parameter of every technique; a change of one is a change of it."""
    code, out, _ = run("techniques", "--markdown")
    assert code == 0 and out == (DOCS / "parameters.md").read_text(encoding="utf-8")
    common, *sections = out.split("\n## ")[1:]
    for section, kind in zip(sections, renderer.TECHNIQUES.values(), strict=True):
        for name in kind.names():
            assert f"| `{name}` |" in section or f"| `{name}` |" in common
