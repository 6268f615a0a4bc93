"""Cost by pass and by size: the laws that are fitted, and that all is measured."""

import csv
import math

import numpy as np
import pytest

from app.cli import main
from stimuli.errors import InputError
from stimuli.experiment import cost
from tests.stimuli.test_experiment import BALL


def test_a_power_law_is_given_back_with_its_interval():
    x = np.array([100.0, 200.0, 400.0, 800.0])
    law = cost.power_law(x, 3e-6 * x**1.5)
    assert law.a == pytest.approx(3e-6) and law.b == pytest.approx(1.5)
    assert law.low == pytest.approx(1.5) and law.high == pytest.approx(1.5)
    noisy = cost.power_law(x, x * np.array([1.0, 1.2, 0.9, 1.1]))
    assert noisy.low < 1 < noisy.high and noisy.points == 4
    assert math.isnan(cost.power_law([1, 2], [1, 2]).low)  # of two points nothing is left
    with pytest.raises(InputError, match="two different positive sizes"):
        cost.power_law([5, 5], [1, 2])


def test_a_cards_time_is_taken_where_it_was_measured():
    row = {"axis": "samples", "x": 1.0, "technique": "golubev", "cpu_s": 1.0}
    assert cost.timed_by([row | {"card_s": 2.0}]) == "card_s"
    assert cost.timed_by([row | {"card_s": math.nan}]) == "cpu_s"
    shared = row | {"technique": cost.SHARED, "card_s": math.nan}
    assert cost.timed_by([row | {"card_s": 2.0}, shared]) == "card_s"


def test_balls_cover_the_same_area_and_have_more_triangles():
    for count in (1, 4):
        objects = cost.balls(count)["objects"].values()
        assert sum(ball["radius_mm"] ** 2 for ball in objects) == pytest.approx(900)
        assert len(objects) == count


def test_every_pass_and_an_axis_are_measured(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cost, "LAMPS", (1, 2))
    scene, out = tmp_path / "ball.toml", tmp_path / "out"
    scene.write_text(BALL.replace("[0.2, 0.2, 0.2]", "[0.0, 0.0, 0.0]"))
    given = ["-t", "golubev", "-t", "subdermal", "-s", "64x48", "--rounds", "1", "--walks", "2"]
    axes = ["--axis", "lights"]
    assert (
        main(["experiment", "cost", str(scene), "-f", "ball", "-o", str(out), *given, *axes]) == 0
    )
    shown = capsys.readouterr().out
    assert "techniques/subdermal_count.glsl" in shown and "x^" in shown
    passes = list(csv.DictReader((out / "passes.csv").open()))
    ours = [row["pass"] for row in passes if row["technique"] == "subdermal"]
    assert [name.rpartition("/")[2] for name in ours] == [
        *("subdermal_guard.glsl", "subdermal_tiles.glsl", "subdermal_count.glsl"),
        *("none.glsl", "subdermal.glsl", "all"),  # the first where nothing scatters
    ]
    every = {row["technique"]: float(row["cpu_s"]) for row in passes if row["pass"] == "all"}
    mine = [float(r["cpu_s"]) for r in passes if r["technique"] == "subdermal"]
    assert sum(mine[:-1]) < mine[-1] == every["subdermal"]
    rows = list(csv.DictReader((out / "growth.csv").open()))
    assert [float(r["x"]) for r in rows if r["technique"] == cost.SHARED] == [1, 2]
    quality = list(csv.DictReader((out / "quality.csv").open()))
    assert {row["technique"] for row in quality} == {"golubev", "subdermal"}
    assert any(row["front"] == "1" for row in quality) and (out / "growth.svg").is_file()


def test_the_steps_of_an_axis_grow_and_leave_the_scene_as_it_is():
    ball = {"framing": "ball", "height_mm": 100.0, "yaw_deg": 0.0}
    table, options = {"camera": ball}, cost.Options((64, 48))
    steps = {
        axis: list(cost._steps(axis, "", table, "ball", {}, options))
        for axis in ("resolution", "covered", "samples")
    }
    assert [x for x, *_ in steps["resolution"]][-1] == 64 * 48
    assert len({size for _, _, size, _ in steps["resolution"]}) == len(cost.SCALES)
    heights = [own["camera"]["height_mm"] for _, own, *_ in steps["covered"]]
    assert heights == sorted(heights) and heights[0] == 100
    ((_, own, _, made),) = steps["samples"]
    assert own == table and len(made) == 12


def test_without_a_clock_nothing_is_timed(bare_context):
    from renderer import gl

    clock = gl.Clock.of("llvmpipe (LLVM 15, 256 bits)")
    assert clock.software and not gl.Clock.of("NVIDIA H100").software
    with gl.timed(bare_context, "one"):
        pass
    bare_context.clock = clock
    with gl.timed(bare_context, "two"):
        pass
    assert [one.name for one in clock.passes] == ["two"] and math.isnan(clock.passes[0].card)


@pytest.fixture
def bare_context():
    from tests.renderer.slab import Bare

    made = Bare()
    yield made.context
    made.context.close()
