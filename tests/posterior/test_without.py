"""What `subdermal posterior` says where its sampler is not installed, or its input is wrong."""

from importlib import util

import pytest

from analysis.errors import InputError
from analysis.posterior import Sampling

ROWS = "participant,framing,left,right,answer\nP1,front,a,b,1\nP2,front,b,a,-1\n"


def test_the_extra_is_named(run, tmp_path, monkeypatch):
    find = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name: None if name == "numpyro" else find(name))
    (tmp_path / "responses.csv").write_text(ROWS)
    code, _, err = run("posterior", tmp_path / "responses.csv", "--out", tmp_path / "out")
    assert code == 2 and "pip install subdermal[bayes]" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "message"),
    [(("--chains", "1"), "chains is 1"), (("--level", "1.5"), "level is 1.5")],
)
def test_what_cannot_be_drawn_is_one_line(run, tmp_path, option, message):
    (tmp_path / "responses.csv").write_text(ROWS)
    path = tmp_path / "responses.csv"
    code, _, err = run("posterior", path, "--out", tmp_path / "out", *option)
    assert code == 2 and message in err and err.count("\n") == 1


def test_sampling_is_checked():
    with pytest.raises(InputError, match="seed is -1; expected an integer from 0"):
        Sampling(seed=-1)
