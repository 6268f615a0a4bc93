"""The Bayesian model: its likelihood, what it was drawn from, images as a sample, its files."""

import numpy as np
import pytest

pytest.importorskip("numpyro", reason="the extra [bayes] is not installed; see make test-bayes")

import numpyro
from numpyro import handlers
from scipy.special import expit

from analysis import responses_from_records
from analysis.options import Options, Sampling
from analysis.panel import panels
from analysis.posterior import model, posterior_files, sample
from analysis.worth import ordinal_fit
from analysis.worth.ordinal import Cells

TECHNIQUES = ("none", "golubev", "gaussian")
WORTH = np.array([-0.9, 0.6, 0.3])
CUTS = np.array([-2.0, -0.6, 0.6, 2.0])
SHORT = Options(posterior=Sampling(chains=2, draws=100, warmup=100))


def answers(people, gains, seed, taste=0.4, side=0.3, simulated=False):
    """Everyone's answers about all pairs at each image; gains (images, 3): added to WORTH there."""
    rng, records = np.random.default_rng(seed), []
    for person in range(people):
        own = rng.normal(0, taste, 3)
        for image, gained in enumerate(gains):
            value = WORTH + gained + own
            for i, j in ((0, 1), (0, 2), (1, 2)):
                left, right = (i, j) if rng.random() < 0.5 else (j, i)
                eta = value[right] - value[left] + side
                answer = int((rng.random() > expit(CUTS - eta)).sum()) - 2
                records.append(
                    {
                        "participant": f"P{person:03d}",
                        "framing": f"image{image}",
                        "left": TECHNIQUES[left],
                        "right": TECHNIQUES[right],
                        "answer": answer,
                        "simulated": int(simulated),
                    }
                )
    return responses_from_records(records, order=TECHNIQUES)


@pytest.fixture(scope="module")
def table():
    return answers(60, [[0.5, -0.2, -0.3], [-0.5, 0.2, 0.3]], 3)


@pytest.fixture(scope="module")
def drawn(table):
    return sample(table, Options(seed=1, posterior=Sampling(chains=2, draws=1600, warmup=600)))


def test_the_likelihood_is_that_of_the_ordinal_model(table):
    """At any parameters the factor equals the sum over `analysis.worth.ordinal.Cells`."""
    numpyro.enable_x64()
    data, rng = model._data(table), np.random.default_rng(0)
    values = {
        **{f"sd_{name}": rng.uniform(0.2, 1) for name in ("worth", "image", "taste")},
        "sd_person_side": 0.3,
        "worth": rng.normal(size=3),
        "image": rng.normal(size=(2, 3)),
        "taste": rng.normal(size=(60, 3)),
        "person_side": rng.normal(size=60),
        "side": 0.4,
        "step": np.array([0.5, 1.1]),
    }
    trace = handlers.trace(handlers.substitute(model._model, values)).get_trace(
        priors=Sampling().priors, **data
    )
    got = float(trace["answers"]["fn"].log_factor)
    who, where = data["person"], data["picture"]
    worth = (
        values["sd_worth"] * values["worth"]
        + values["sd_image"] * values["image"][where]
        + values["sd_taste"] * values["taste"][who]
    )
    at = np.arange(len(who))
    eta = worth[at, data["right"]] - worth[at, data["left"]] + 0.4
    eta += 0.3 * values["person_side"][who]
    expected = Cells(data["category"], eta, np.array([-1.6, -0.5, 0.5, 1.6])).value().sum()
    assert got == pytest.approx(expected, rel=1e-9)


def test_what_answers_were_drawn_from_comes_back(drawn):
    """Inside intervals of 99.9 %: worths, side, thresholds, taste."""
    assert not drawn.doubts()
    low, high = (np.quantile(drawn.worth, q, axis=(0, 1)) for q in (5e-4, 1 - 5e-4))
    assert (low < WORTH).all() and (high > WORTH).all()
    for values, truth in (
        (drawn.side, 0.3),
        (drawn.thresholds[..., 0], 0.6),
        (drawn.thresholds[..., 1], 2.0),
        (drawn.spread["taste"], 0.4),
    ):
        assert np.quantile(values, 5e-4) < truth < np.quantile(values, 1 - 5e-4)


def test_a_new_image_is_less_certain_than_those_seen(drawn):
    result = drawn.worths().assign(width=lambda rows: rows.high - rows.low)
    width = result.groupby("framing").width.mean()
    assert width["new image"] > width["overall"] > width["image0"]
    assert result.groupby("framing").p_best.sum().to_numpy() == pytest.approx(1)


def test_one_image_says_nothing_of_others_and_is_near_maximum_likelihood():
    """120 people: the priors pull by less than half of the fit's standard errors."""
    table = answers(120, [[0.0, 0.0, 0.0]], 5)
    result = sample(table, Options(posterior=Sampling(chains=2, draws=500, warmup=500)))
    worths = result.worths()
    assert set(worths.framing) == {"overall"} and "image" not in result.spread
    panel = panels(table)["image0"]
    fit = ordinal_fit(panel, Options())
    mine = worths.set_index("technique")["median"][list(panel.items)].to_numpy()
    assert (np.abs(mine - fit.worth) < 0.5 * fit.errors).all()


def test_too_few_draws_are_doubted_and_the_same_seed_gives_the_same_ones():
    table = answers(8, [[0.0, 0.0, 0.0]] * 2, 5)
    first, second = (sample(table, SHORT) for _ in range(2))
    np.testing.assert_array_equal(first.worth, second.worth)
    assert any("effective draws, fewer than 400" in one for one in first.doubts())
    _, sentences = posterior_files(first, table)
    assert sentences[0].startswith("These draws may not be those of the posterior: ")


@pytest.mark.parametrize("simulated", [False, True])
def test_the_command_writes_tables_draws_a_figure_and_a_page(run, tmp_path, simulated):
    table = answers(8, [[0.0, 0.0, 0.0]] * 2, 5, simulated=simulated).frame
    rows = table.assign(
        left=np.where(table.a_left, table.a, table.b),
        right=np.where(table.a_left, table.b, table.a),
        simulated=int(simulated),
    )
    columns = ["participant", "framing", "left", "right", "answer", "simulated"]
    rows[columns].to_csv(tmp_path / "responses.csv", index=False)
    out = tmp_path / "out"
    path, few = tmp_path / "responses.csv", ("--chains", 2, "--draws", 100, "--warmup", 100)
    few = (*few, "--prior", "worth=0.5", "--prior", "clear=1.5")
    code, said, _ = run("posterior", path, "--out", out, *map(str, few))
    assert code == 0 and "is the best with probability" in said
    page = (out / "posterior.md").read_text()
    assert ("SIMULATED" in page) == simulated
    assert (
        "subdermal posterior responses.csv --chains 2 --draws 100 --warmup 100 --prior worth=0.5 "
        "--prior clear=1.5 --out DIR"
    ) in page
    assert "the spread of worths 0.5, of images 1, of" in page and "thresholds 1 and 1.5" in page
    for name in ("worths", "pairs", "parameters"):
        header = (out / f"posterior_{name}.csv").read_text().splitlines()
        assert header[0].endswith(",simulated") and header[1].endswith(f",{int(simulated)}")
    with np.load(out / "posterior.npz") as draws:
        assert draws["worth"].shape == (2, 100, 3) and draws["image"].shape == (2, 100, 2, 3)
    assert (out / "figures/posterior.pdf").stat().st_size > 1000
