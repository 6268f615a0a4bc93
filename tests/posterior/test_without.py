"""What `subdermal posterior` says where its sampler is not installed, or its input is wrong."""

import signal
from importlib import util

import pytest

from analysis import declared
from analysis.errors import InputError
from analysis.options import Sampling

ROWS = "participant,framing,left,right,answer\nP1,front,a,b,1\nP2,front,b,a,-1\n"


def test_the_extra_is_named(run, tmp_path, monkeypatch):
    find = util.find_spec
    monkeypatch.setattr(util, "find_spec", lambda name: None if name == "numpyro" else find(name))
    (tmp_path / "responses.csv").write_text(ROWS)
    code, _, err = run("posterior", tmp_path / "responses.csv", "--out", tmp_path / "out")
    assert code == 2 and "requirements-bayes.lock" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--chains", "1"), "chains is 1"),
        (("--level", "1.5"), "level is 1.5"),
        (("--prior", "width=2"), "--prior names width; expected one of worth, image"),
        (("--prior", "worth"), "'worth' is no NAME=LOGITS"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(run, tmp_path, option, message):
    (tmp_path / "responses.csv").write_text(ROWS)
    path = tmp_path / "responses.csv"
    code, _, err = run("posterior", path, "--out", tmp_path / "out", *option)
    assert code == 2 and message in err and err.count("\n") == 1


def test_an_interrupt_ends_sampling_at_once(run, tmp_path, monkeypatch):
    """The compiled loop never looks for Python's handler, so the system's holds meanwhile."""
    before, during = signal.getsignal(signal.SIGINT), []

    def sample(*_, **__):
        during.append(signal.getsignal(signal.SIGINT))
        raise InputError("nothing is drawn here")

    monkeypatch.setattr("analysis.posterior.sample", sample)
    (tmp_path / "responses.csv").write_text(ROWS)
    code, _, err = run("posterior", tmp_path / "responses.csv", "--out", tmp_path / "out")
    assert code == 2 and "nothing is drawn here" in err
    assert during == [signal.SIG_DFL] and signal.getsignal(signal.SIGINT) is before


def test_sampling_and_priors_are_declared_and_checked():
    result = declared.options({"posterior": {"prior_worth": 1.5, "chains": 2}})
    assert result.posterior == Sampling(chains=2, prior_worth=1.5)
    assert result.posterior.priors["worth"] == 1.5 and result.posterior.priors["clear"] == 2
    assert result.declared == ("posterior.prior_worth", "posterior.chains")
    for wrong, words in (
        ({"prior_worth": 0}, r"posterior\.prior_worth is 0, expected a number above 0"),
        ({"target_acceptance": 1}, r"posterior\.target_acceptance is 1, expected .* below 1"),
        ({"draws": 7}, r"posterior\.draws is 7, expected an integer from 100"),
        ({"prior_taste": "wide"}, r"posterior\.prior_taste is 'wide', expected a number"),
        ({"prior": 1}, r"posterior names the unknown prior"),
    ):
        with pytest.raises(InputError, match=words):
            declared.options({"posterior": wrong})
