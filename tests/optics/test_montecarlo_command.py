"""`subdermal montecarlo`: tables, JSON and bad input."""

import json

import numpy as np
import pytest

from app import cli
from renderer.optics.montecarlo import Layer, simulate

SLAB = ("--layer", "mu_a=1 mu_s=9 g=0.75 d=0.2", "--photons", "6400", "--seed", "3")


@pytest.fixture
def run(capfd, monkeypatch, tmp_path):
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path))

    def run(*args):
        code = cli.main(["montecarlo", *args])
        return code, *capfd.readouterr()

    return run


def test_tables(run, tmp_path):
    code, out, err = run(*SLAB, "--bins", "5")
    assert code == 0 and not err
    totals, curves = (part.splitlines() for part in out.split("\n\n"))
    shares = {line[:24].strip(): tuple(map(float, line[24:].split())) for line in totals[1:]}
    expected = simulate([Layer(1, 1, 9, 0.75, 0.2)], 6400, 3, bins=5)
    for name in ("diffuse_reflectance", "transmittance", "absorbed", "ballistic"):
        assert shares[name] == pytest.approx(
            (getattr(expected, name), getattr(expected, f"{name}_error")), abs=1e-6
        )
    assert shares["absorbed in layer 1"] == shares["absorbed"]
    assert shares["specular"][0] + shares["diffuse_reflectance"][0] + shares["transmittance"][
        0
    ] + shares["absorbed"][0] == pytest.approx(1, abs=3e-6)
    rows = np.array([line.split() for line in curves[1:-1]], dtype=float)
    assert rows.shape == (5, 5) and rows[:, 1] == pytest.approx(expected.R, rel=1e-5)
    assert curves[-1].split()[0] == "beyond"
    assert len(list((tmp_path / "montecarlo").iterdir())) == 1


def test_json(run, tmp_path):
    code, out, err = run(
        *SLAB,
        "--layer",
        "n=1.4 mu_a=1 mu_s=2",
        "--n-above",
        "1.1",
        "--illumination",
        "diffuse",
        "--r-max",
        "2",
        "--json",
        "--no-cache",
    )
    record = json.loads(out)
    assert code == 0 and not err and list(tmp_path.iterdir()) == []
    assert (
        record["photons"] == 6400
        and record["seed"] == 3
        and record["illumination"] == "diffuse"
        and record["n_above"] == 1.1
    )
    assert record["layers"] == [
        {"n": 1, "mu_a": 1, "mu_s": 9, "g": 0.75, "d": 0.2},
        {"n": 1.4, "mu_a": 1, "mu_s": 2, "g": 0},
    ]  # infinite: no d
    assert (
        record["edges_mm"][-1] == 2
        and len(record["R"]) == len(record["R_error"]) == len(record["r_mm"]) == 120
    )
    assert record["specular"] + record["diffuse_reflectance"] + record["transmittance"] + record[
        "absorbed"
    ] == pytest.approx(1, abs=1e-12)
    assert record["transmittance"] == 0


@pytest.mark.parametrize(
    "args",
    [
        (),
        ("--layer", ""),
        ("--layer", "mu_a=-1 mu_s=1"),
        ("--layer", "mu_a=1 mu_s=nan"),
        ("--layer", "mu_a=1 mu_s=1 g=1"),
        ("--layer", "n=0.5 mu_a=1 mu_s=1"),
        ("--layer", "mu_a=1 mu_s=1 d=0"),
        ("--layer", "mu_a=0 mu_s=1"),
        (*SLAB, "--photons", "1"),
        (*SLAB, "--n-below", "0"),
        (*SLAB, "--n-above", "nan"),
        (*SLAB, "--r-max", "0"),
        (*SLAB, "--illumination", "sun"),
    ],
    ids=" ".join,
)
def test_bad_input_gives_one_line_and_exit_code_2(run, args):
    code, out, err = run(*args)
    assert code == 2 and not out
    assert err.startswith("subdermal: ") and err.count("\n") == 1
