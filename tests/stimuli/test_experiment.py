"""Samples on trial, on a ball that is drawn small."""

import csv

import numpy as np
import pytest

from app.cli import main
from stimuli import experiment

BALL = """
[objects.ball]
shape = "sphere"
radius_mm = 40.0
[materials.ball]
medium = "deon_luebke"
[objects.post]
shape = "sphere"
radius_mm = 8.0
position_mm = [18.0, 14.0, 48.0]
[materials.post]
medium = "deon_luebke"
[lights.sun]
direction = [0.5, 0.4, 0.8]
irradiance = [3.0, 3.0, 3.0]
[environment]
ambient = [0.2, 0.2, 0.2]
[camera]
framing = "ball"
height_mm = 100.0
angle = "front"
"""


@pytest.fixture
def ball(tmp_path, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "ball.toml"
    file.write_text(BALL)
    return file


def run(ball, *more):
    names = ("-t", "golubev:samples=16", "-t", "golubev:samples=64", "-t", "none")
    return main(["experiment", "samples", str(ball), "-f", "ball", "-s", "160x120", *names, *more])


def test_more_samples_are_nearer_to_the_converged_and_the_table_says_so(ball, tmp_path, capsys):
    table = tmp_path / "table.csv"
    more = ("--converged", "golubev:samples=256", "--rotations", "8", "--table", str(table))
    assert run(ball, *more) == 0
    rows = list(csv.DictReader(table.open()))
    assert [row["technique"] for row in rows] == [
        "golubev samples=16",
        "golubev samples=64",
        "none",
    ]
    few, many, none = rows
    assert float(few["samples"]) == 16 and float(few["output_samples"]) == 64
    for column in ("rmse", "edges", "dssim", "flip"):
        assert float(many[column]) < float(few[column]) < float(none[column]), column
    assert float(few["bias"]) < float(few["rmse"]) and none["bias"] == "nan"
    assert few["size"] == "160x120" and few["supersample"] == "2"
    kept = list((tmp_path / "cache" / "converged").glob("*.npy"))
    assert len(kept) == 1
    first = capsys.readouterr().out
    np.save(kept[0], np.load(kept[0]) + 0.1)  # what is kept is what is compared to
    assert run(ball, *more) == 0
    assert capsys.readouterr().out != first


def test_a_jump_of_depth_is_found_within_its_millimetres():
    depths = np.full((20, 40), 100.0)
    depths[:, 20:] = 105.0
    near = experiment._near_jumps(depths, 200.0, 1.0)  # half a millimetre a pixel
    assert near[:, 18:22].all() and not near[:, :17].any() and not near[:, 23:].any()
    assert not experiment._near_jumps(np.full((4, 4), 9.0), 200.0, 1.0).any()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--converged", "all"), "expected one technique"),
        (("--converged", "golub"), "no technique 'golub'"),
        (("--table", "x.txt"), ".csv"),
    ],
)
def test_bad_input_is_one_line(ball, more, words, capsys):
    assert run(ball, *more) == 2
    error = capsys.readouterr().err
    assert words in error and "Traceback" not in error
