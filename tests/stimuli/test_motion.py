"""Flicker and pops of a turntable: on errors made by hand, and a ball that is drawn small."""

import csv
import math

import numpy as np
import pytest

from app.cli import main
from stimuli.compare import _at
from stimuli.experiment import motion
from tests.stimuli.test_experiment import BALL


def test_noise_flickers_and_a_tile_pops():
    skin = np.ones((16, 16), bool)
    before = np.zeros((16, 16, 3)), skin
    noise = np.where(np.indices((16, 16)).sum(axis=0) % 2, 1, -1)[..., None] / 255 * np.ones(3)
    change = motion._change(noise, skin, before, 4)
    assert change["flicker"] == pytest.approx(1) and change["pop"] == pytest.approx(0, abs=1e-9)
    tile = np.zeros((16, 16, 3))
    tile[4:8, 8:12] = 2 / 255
    change = motion._change(tile, skin, before, 4)
    assert change["largest"] == pytest.approx(2) and change["pop"] == pytest.approx(0.5)
    none = motion._change(tile, ~skin, before, 4)
    assert math.isnan(none["flicker"]) and math.isnan(none["largest"])


def test_an_error_that_stays_neither_flickers_nor_pops():
    error, skin = np.random.default_rng(1).normal(size=(8, 8, 3)), np.ones((8, 8), bool)
    assert set(motion._change(error, skin, (error, skin), 4).values()) == {0.0}


def test_a_view_has_degrees_or_a_name():
    table = {"camera": {"yaw_deg": 5.0, "height_mm": 7.0}}
    assert _at(table, "ball/12.5")["camera"] == {
        "framing": "ball",
        "height_mm": 7.0,
        "yaw_deg": 12.5,
    }
    assert _at(table, "ball/front")["camera"] == {
        "framing": "ball",
        "height_mm": 7.0,
        "angle": "front",
    }


def test_fewer_samples_flicker_more(tmp_path, capsys):
    scene, out = tmp_path / "ball.toml", tmp_path / "out"
    scene.write_text(BALL.replace("[0.2, 0.2, 0.2]", "[0.0, 0.0, 0.0]"))
    names = ["-t", "golubev:samples=6", "-t", "golubev:samples=48", "-f", "ball"]
    given = ["-o", str(out), "-s", "96x72", "--frames", "3", "--converged", "golubev:samples=128"]
    assert main(["experiment", "motion", str(scene), *names, *given]) == 0
    rows = list(csv.DictReader((out / "motion.csv").open()))
    assert len(rows) == 6 and rows[0]["flicker"] == "nan" and float(rows[4]["yaw_deg"]) == 2
    few, many = motion.summary(
        [{k: v if k == "technique" else float(v) for k, v in row.items()} for row in rows]
    )
    assert few["flicker"] > 1.5 * many["flicker"] and few["rmse"] > many["rmse"]
    assert "3 frames" in capsys.readouterr().out and (out / "motion.svg").is_file()
