"""Predicted visibility beside answers, on tables made by hand."""

import json

import numpy as np
import pandas as pd
import pytest

from analysis import visibility
from analysis.codebook import Codebook
from analysis.manifest import open_manifest
from analysis.tallies import DISTRIBUTION
from analysis.worth_figures import draw_visibility
from app.cli import main

BOOK = Codebook(("near", "far"), ("a", "b", "c"), "here", "here")


@pytest.fixture
def manifest(tmp_path):
    images = [
        {"framing": f, "technique": t, "sha256": f"{k}{t}" * 32}
        for k, f in enumerate(("near", "far"))
        for t in "abc"
    ]
    pairs = [
        {"cell": image["framing"], "a": a, "b": b, "jod": jod, "flip": 0.01}
        | {"sha256_a": f"{k}{a}" * 32, "sha256_b": f"{k}{b}" * 32}
        for k, image in enumerate((images[0], images[3]))
        for (a, b), jod in zip(("ab", "ac", "bc"), (9.95, 9.0 - k, 8.5 - k))
    ]
    about = {"metric": "ColorVideoVDP", "version": "0.5.7", "pairs": pairs}
    value = {"format": "subdermal-manifest/3", "study": {}, "images": images, "visibility": about}
    (tmp_path / "manifest.json").write_text(json.dumps(value))
    return open_manifest(tmp_path)


def counts(noticed):
    """20 answers of each pair, both ways, of which so many saw a difference and preferred b."""
    rows = []
    for framing in ("near", "far"):
        for (a, b), seen in zip(("ab", "ac", "bc"), noticed):
            own = dict(zip(DISTRIBUTION, (0, 0, 20 - seen, seen, 0)))
            back = dict(zip(DISTRIBUTION, (0, seen, 20 - seen, 0, 0)))
            rows.append({"framing": framing, "technique": a, "opponent": b, **own, "n": 20})
            rows.append({"framing": framing, "technique": b, "opponent": a, **back, "n": 20})
    return pd.DataFrame(rows)


WORTHS = pd.DataFrame(
    [("near", "thurstone_jod", t, e) for t, e in zip("abc", (-0.2, -0.1, 0.3))],
    columns=["framing", "model", "technique", "estimate"],
)


def test_each_pair_is_set_beside_its_answers(manifest):
    predicted = visibility.read_visibility(manifest)
    assert predicted.attrs["metric"] == "ColorVideoVDP 0.5.7" and len(predicted) == 6
    table = visibility.beside_answers(predicted, counts((2, 12, 16)), WORTHS)
    near = table[table.framing == "near"].set_index(["technique", "opponent"])
    assert near.loc[("a", "c"), "predicted_jod"] == pytest.approx(1.0)
    assert near.loc[("a", "b"), "noticed"] == pytest.approx(0.1)
    assert near.loc[("b", "c"), "mean"] == pytest.approx(16 / 20)
    assert near.loc[("b", "c"), "observed_jod"] == pytest.approx(0.4)
    assert table[table.framing == "far"].observed_jod.isna().all()
    words = " ".join(visibility.sentences(table, BOOK, "ColorVideoVDP 0.5.7"))
    assert "2 of 6 pairs" in words and "10 % saw a difference" in words and "70 %" in words
    picture = draw_visibility(table, BOOK)
    assert picture.svg.startswith(b"<?xml") and "0.05 JOD, 10 % saw" in picture.alt


def test_a_study_that_predicts_nothing_has_no_table(tmp_path):
    value = {"format": "subdermal-manifest/3", "study": {}, "images": []}
    (tmp_path / "manifest.json").write_text(json.dumps(value))
    assert visibility.read_visibility(open_manifest(tmp_path)).empty


STUDY = """
name = "s"
title = "t"
version = 1
seed = 1
[[framings]]
name = "near"
label = "Near"
[[framings]]
name = "far"
label = "Far"
[[techniques]]
name = "a"
label = "A"
technique = "none"
[[techniques]]
name = "b"
label = "B"
technique = "golubev"
[[techniques]]
name = "c"
label = "C"
technique = "golubev_plus"
"""


def test_power_takes_the_prediction_as_its_assumption(manifest, tmp_path, capsys):
    study = tmp_path / "s.toml"
    study.write_text(STUDY)
    given = ["power", str(study), "--out", str(tmp_path / "out"), "--pair", "b,c"]
    small = ["--studies", "50", "--most", "20", "--design", "full"]
    assert main([*given, *small, "--visibility", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "Near, full design" in out and "find 1.5 JOD" in out and "find 2.5 JOD" in out
    curves = pd.read_csv(next((tmp_path / "out").rglob("power.csv")))
    found = curves[(curves.goal == "find") & (curves.test == "declared")]
    mean = found.groupby("framing").power.mean()
    assert np.isfinite(mean).all() and mean["far"] >= mean["near"]
    both = [*given, *small, "--visibility", str(tmp_path), "--difference", "1"]
    assert main(both) == 2
    lacks = ["power", str(study), "--out", str(tmp_path / "o"), "--visibility", str(tmp_path)]
    value = json.loads((tmp_path / "manifest.json").read_text())
    value["visibility"]["pairs"].pop()
    (tmp_path / "manifest.json").write_text(json.dumps(value))
    assert main([*lacks, "--pair", "b,c"]) == 2
    assert "has no b / c at far" in capsys.readouterr().err
