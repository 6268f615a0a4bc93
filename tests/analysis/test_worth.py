"""Worths against published fits, against choix, statsmodels and plain optimisation; what must not
change them; what has none.
"""

from dataclasses import replace
from itertools import combinations, permutations

import choix
import numpy as np
import pytest
import statsmodels.api as sm
from scipy import optimize, special, stats
from statsmodels.miscmodels.ordinal_model import OrderedModel

from analysis import worth
from analysis.options import Options
from analysis.panel import MISSING, panels, tied, wins
from analysis.worth import (
    JOD_SIGMA,
    bradley_terry,
    davidson,
    davidson_sides,
    missing_fit,
    ordinal,
    thurstone_jod,
    worths,
)
from analysis.worth.ordinal import Likelihood, Quadrature

#: Wins of row over column: American League East 1987, in Agresti, "Categorical Data Analysis", 2nd
#: ed. 2002, table 10.10.
BASEBALL = np.array(
    [
        [0, 7, 9, 7, 7, 9, 11],
        [6, 0, 7, 5, 11, 9, 9],
        [4, 6, 0, 7, 7, 8, 12],
        [6, 8, 6, 0, 6, 7, 10],
        [6, 2, 6, 7, 0, 7, 12],
        [4, 4, 5, 6, 6, 0, 6],
        [2, 4, 1, 3, 1, 7, 0],
    ]
)
#: Chocolate puddings: brands i and j, preferences for i, for j, for neither; Davidson 1970, example
#: 2, as in R's PlackettLuce.
PUDDINGS = """1 2 19 22 16 | 1 3 16 19 12 | 2 3 19 19 10 | 1 4 18 23 13 | 2 4 23 19 9
              3 4 19 20 15 | 1 5 13 19 18 | 2 5 16 20 12 | 3 5 16 15 17 | 4 5 17 14 16
              1 6 18 21 12 | 2 6 22 20 12 | 3 6 13 18 10 | 4 6 14 19 18 | 5 6 11 21 12"""
MODELS = ("bradley_terry", "davidson", "thurstone_jod", "ordinal")


def puddings():
    won, level = np.zeros((6, 6)), np.zeros((6, 6))
    for text in PUDDINGS.replace("\n", "|").split("|"):
        i, j, first, second, ties = map(int, text.split())
        won[i - 1, j - 1], won[j - 1, i - 1] = first, second
        level[i - 1, j - 1] = level[j - 1, i - 1] = ties
    return won, level


def games(matrix):
    """The matrix as choix wants it: a list of (winner, loser)."""
    return [(i, j) for i, j in np.argwhere(matrix > 0) for _ in range(int(matrix[i, j]))]


def test_bradley_terry_gives_agrestis_baseball():
    """Published: Milwaukee 1.58, Detroit 1.44, Toronto 1.29, New York 1.25, Boston 1.11, Cleveland
    0.68, Baltimore 0.
    """
    result = bradley_terry(BASEBALL)
    assert result - result[-1] == pytest.approx([1.58, 1.44, 1.29, 1.25, 1.11, 0.68, 0], abs=0.005)
    assert result.sum() == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_bradley_terry_is_that_of_choix(seed):
    rng = np.random.default_rng(seed)
    matrix = rng.integers(1, 12, (3 + 2 * seed, 3 + 2 * seed)) * (
        1 - np.eye(3 + 2 * seed, dtype=int)
    )
    expected = choix.opt_pairwise(len(matrix), games(matrix), alpha=0, tol=1e-12)
    assert bradley_terry(matrix) == pytest.approx(expected - expected.mean(), abs=1e-5)


def test_half_a_win_for_a_tie_is_two_games_for_a_win_and_one_each_for_a_tie(crowd):
    panel = crowd(30, [0, 0.5, 1], seed=2)
    half = wins(panel, panel.counts)
    expected = choix.opt_pairwise(3, games(2 * half), alpha=0, tol=1e-12)
    assert worth.estimated(panel, "bradley_terry", Options()) == pytest.approx(
        expected - expected.mean(), abs=1e-5
    )
    dropped = wins(panel, panel.counts, "drop")
    assert worth.estimated(panel, "bradley_terry", Options(ties="drop")) == pytest.approx(
        bradley_terry(dropped)
    )
    assert not np.allclose(bradley_terry(dropped), bradley_terry(half), atol=1e-3)


def test_thurstone_is_a_probit_regression_and_one_jod_is_75_percent():
    i, j = np.triu_indices(7, 1)
    x = (np.eye(7)[i] - np.eye(7)[j])[:, :-1]
    fit = sm.GLM(
        np.column_stack([BASEBALL[i, j], BASEBALL[j, i]]),
        x,
        family=sm.families.Binomial(sm.families.links.Probit()),
    ).fit(tol=1e-12)
    expected = np.append(fit.params, 0) * JOD_SIGMA
    assert thurstone_jod(BASEBALL) == pytest.approx(expected - expected.mean(), abs=1e-6)
    assert np.diff(thurstone_jod([[0, 25], [75, 0]])) == pytest.approx([1])


def test_davidson_maximises_its_likelihood_of_the_puddings():
    won, level = puddings()
    i, j = np.triu_indices(6, 1)

    def loss(theta):
        pi, nu = np.exp(np.append(0, theta[:5])), np.exp(theta[5])
        bottom = pi[i] + pi[j] + nu * np.sqrt(pi[i] * pi[j])
        return -(
            won[i, j] * np.log(pi[i] / bottom)
            + won[j, i] * np.log(pi[j] / bottom)
            + level[i, j] * np.log(nu * np.sqrt(pi[i] * pi[j]) / bottom)
        ).sum()

    best = optimize.minimize(loss, np.zeros(6), method="BFGS", options={"gtol": 1e-8}).x
    result, log_nu = davidson(won, level)
    assert result - result[0] == pytest.approx(
        np.append(0, best[:5]), abs=1e-5
    ) and log_nu == pytest.approx(best[5], abs=1e-5)


def test_davidson_orders_a_balanced_design_by_points_and_is_bradley_terry_without_ties(crowd):
    """Davidson 1970: in a balanced experiment the order is that of two points for a win and one for
    a tie.
    """
    panel = crowd(40, [0, 0.3, 0.9, 0.5, 0.1], seed=5)
    won, level = wins(panel, panel.counts, "drop"), tied(panel, panel.counts)
    ranks = [
        stats.rankdata(np.round(one, 6))
        for one in (davidson(won, level)[0], (2 * won + level).sum(axis=1))
    ]
    assert np.array_equal(*ranks)
    result, log_nu = davidson(BASEBALL, np.zeros((7, 7)))
    assert result == pytest.approx(bradley_terry(BASEBALL)) and log_nu == -np.inf


def test_many_matrices_at_once_are_as_one_by_one():
    rng = np.random.default_rng(1)
    won = rng.integers(0, 6, (50, 4, 4)) * (1 - np.eye(4, dtype=int))
    level = np.triu(rng.integers(0, 4, (50, 4, 4)), 1)
    level = level + np.swapaxes(level, 1, 2)
    for together, one in (
        (bradley_terry(won), bradley_terry),
        (thurstone_jod(won), thurstone_jod),
        (davidson(won, level)[0], None),
    ):
        alone = [
            davidson(w, t)[0] if one is None else one(w) for w, t in zip(won, level, strict=True)
        ]
        assert together == pytest.approx(np.array(alone), nan_ok=True, abs=1e-8)
        assert np.isnan(together).any(axis=1).sum() < 50


@pytest.mark.parametrize("reduced", [False, True])
def test_tables_that_contradict_each_other_are_fitted_at_once_as_one_by_one(reduced):
    """Many tables begin where their sum ends, which here is far from most of them."""
    expected = special.expit(np.subtract.outer([2.5, 0, -2.5], [2.5, 0, -2.5]))
    strong = np.rint(400 * expected * (1 - np.eye(3)))
    won = np.stack([strong, strong.T, strong, strong.T[::-1, ::-1], np.ones((3, 3)) - np.eye(3)])
    won[2] *= 1000
    level = np.broadcast_to(5.0 * (1 - np.eye(3)), won.shape)
    at_once, log_nu = davidson(won, level, reduced)
    for k in range(len(won)):
        one, its_nu = davidson(won[k], level[k], reduced)
        assert at_once[k] == pytest.approx(one, abs=1e-7)
        assert log_nu[k] == pytest.approx(its_nu, abs=1e-7)
        for solve in (bradley_terry, thurstone_jod):
            assert solve(won, reduced)[k] == pytest.approx(solve(won[k], reduced), abs=1e-7)
    assert np.isfinite(at_once).all() and np.ptp(at_once[:, 0]) > 4


def test_ordinal_without_people_is_an_ordered_logit_of_answers_seen_from_both_sides(crowd):
    """Each answer twice, once mirrored, makes the thresholds of statsmodels' model symmetric and
    the side effect 0.
    """
    panel = crowd(60, [-0.8, 0.1, 0.3, 0.9], seed=3)
    x = np.eye(4)[panel.second] - np.eye(4)[panel.first]
    x = np.broadcast_to(x, (60, *x.shape)).reshape(-1, 4)[:, 1:]
    y = panel.preference.ravel().astype(int)
    fit = OrderedModel(np.concatenate([y, -y]), np.concatenate([x, -x]), distr="logit").fit(
        method="bfgs", gtol=1e-8, disp=False, maxiter=500
    )
    expected = np.append(0, fit.params[:3])
    # a side that is 0 by construction: every answer also with first and second shown the other way
    # round
    both = replace(
        panel,
        participants=np.concatenate([panel.participants, [f"Q{k}" for k in range(60)]]),
        preference=np.concatenate([panel.preference] * 2),
        first_left=np.concatenate([panel.first_left, ~panel.first_left]),
    )
    result = ordinal(both, mixed=False)
    assert result.worth == pytest.approx(expected - expected.mean(), abs=1e-4)
    assert result.side == pytest.approx(0, abs=1e-6)
    cuts = fit.model.transform_threshold_params(fit.params)[1:-1]
    assert result.thresholds == pytest.approx(cuts[2:], abs=1e-4)
    assert result.log_likelihood == pytest.approx(fit.llf, abs=1e-4)
    assert result.errors == pytest.approx(_centred_errors(fit, 4), rel=1e-3)


def _centred_errors(fit, n):
    covariance = np.zeros((n, n))
    covariance[1:, 1:] = np.asarray(fit.cov_params())[: n - 1, : n - 1]
    centring = np.eye(n) - 1 / n
    return np.sqrt(np.diag(centring @ covariance @ centring))


def test_the_gradient_of_the_ordinal_likelihood_is_its_derivative(crowd):
    panel = crowd(25, [-1, 0, 0.2, 0.8], seed=7, taste=0.8, leaning=0.4, side=0.3)
    answered = np.where(
        np.random.default_rng(0).random(panel.preference.shape) < 0.2, MISSING, panel.preference
    ).astype(np.int8)
    likelihood = Likelihood(replace(panel, preference=answered), mixed=True)
    theta = np.random.default_rng(1).normal(0, 0.4, len(likelihood.start()))
    _, slope = likelihood(theta)
    step = 1e-5
    numeric = [
        (likelihood(theta + step * e)[0] - likelihood(theta - step * e)[0]) / (2 * step)
        for e in np.eye(len(theta))
    ]
    assert slope == pytest.approx(numeric, abs=1e-8)


def test_the_fit_of_many_people_is_that_of_a_climb_from_nothing(crowd):
    """With many people the climb begins at the fit of some of them."""
    panel = crowd(420, [0, 0.4, 1.2, 1.0], seed=4, taste=0.4)
    one, problem = ordinal(panel), Likelihood(panel, True)
    value, slope = problem(
        optimize.minimize(problem, problem.start(), jac=True, options={"gtol": 1e-7}).x
    )
    assert one.log_likelihood == pytest.approx(-value * problem.answers, abs=1e-5)
    assert np.abs(slope).max() < 1e-6


def test_laplace_is_near_the_integral(crowd):
    """Three techniques: a taste of two dimensions and a leaning, by 30 x 30 x 30 Gauss-Hermite
    points.
    """
    panel = crowd(15, [-0.5, 0, 0.7], seed=9, taste=0.7, leaning=0.4)
    likelihood = Likelihood(panel, mixed=True)
    theta = np.array([0.4, -0.6, 0.1, np.log(0.6), np.log(1.4), 0.7, 0.4])
    node, weight = np.polynomial.hermite_e.hermegauss(30)
    grid = np.stack(np.meshgrid(node, node, node, indexing="ij"), axis=-1).reshape(-1, 3)
    mass = (
        np.prod(
            np.stack(np.meshgrid(weight, weight, weight, indexing="ij"), axis=-1).reshape(-1, 3),
            axis=1,
        )
        / (2 * np.pi) ** 1.5
    )
    tau = np.array([-np.inf, -2.0, -0.6, 0.6, 2.0, np.inf])
    total = 0.0
    for person in range(15):
        sign = np.where(panel.first_left[person], 1, -1)
        eta = (theta[:2] + 0.7 * grid[:, :2]) @ likelihood.x.T + sign * (0.1 + 0.4 * grid[:, 2:])
        y = panel.preference[person] + 2
        total += np.log(
            mass @ np.prod(special.expit(tau[y + 1] - eta) - special.expit(tau[y] - eta), axis=1)
        )
    laplace = -likelihood(theta)[0] * likelihood.answers
    assert laplace == pytest.approx(total, rel=5e-3) and laplace != pytest.approx(total, rel=1e-5)
    quadrature = Quadrature(likelihood, theta)
    assert -quadrature(theta)[0] * likelihood.answers == pytest.approx(total, rel=1e-5)
    away, step = theta + 0.05, 1e-5
    numeric = [
        (quadrature(away + step * e)[0] - quadrature(away - step * e)[0]) / (2 * step)
        for e in np.eye(len(theta))
    ]
    assert quadrature(away)[1] == pytest.approx(numeric, abs=1e-8)


def test_three_techniques_with_strong_tastes_are_recovered(crowd):
    """Laplace's approximation makes these worths 15 % small; quadrature does not (three answers a
    person, spreads 1 and 0.6).
    """
    fit = ordinal(crowd(300, [-0.6, 0, 0.6], seed=3, taste=1.0, leaning=0.6, side=0.3))
    assert np.abs(fit.worth - [-0.6, 0, 0.6]).max() < 2.5 * fit.errors.max()
    assert fit.sd_preference == pytest.approx(1.0, abs=0.35) and fit.side == pytest.approx(
        0.3, abs=3 * fit.side_error
    )


def test_people_with_tastes_are_found_and_widen_the_interval(crowd):
    panel = crowd(200, [-0.6, 0, 0.1, 0.2, 0.3], seed=4, taste=1.0, leaning=0.6, side=0.4)
    mixed, plain = ordinal(panel), ordinal(panel, mixed=False)
    # Laplace's approximation finds the spreads, some 10 to 25 % small with 10 answers a person
    assert 0.65 < mixed.sd_preference < 1.1 and 0.3 < mixed.sd_side < 0.7
    assert mixed.side == pytest.approx(0.4, abs=3 * mixed.side_error)
    assert (mixed.errors > plain.errors).all() and mixed.log_likelihood > plain.log_likelihood + 10


def test_one_answer_a_person_has_no_taste_and_six_have_a_caveat(crowd, table):
    notes = worths(table(crowd(40, [0, 0.5], seed=1)), Options(resamples=100)).attrs["notes"]
    assert any("nobody gave more than 1 answers" in note for note in notes)
    notes = worths(
        table(crowd(80, [0, 0.5, 0.2, 0.1], seed=1, taste=2.0)), Options(resamples=100)
    ).attrs["notes"]
    assert any(
        "Laplace's approximation makes worths a few per cent small" in note for note in notes
    )
    notes = worths(
        table(crowd(40, [0, 0.5, 0.2, 0.1, -0.3], seed=1, taste=0.5)), Options(resamples=100)
    ).attrs["notes"]
    assert not notes


@pytest.mark.parametrize(
    ("strengths", "names"),
    [
        ({0, 1, 2}, ("threshold_slight", "threshold_strong")),
        ({1, 2}, ("threshold_strong",)),
        ({0, 1}, ("threshold_slight",)),
        ({0, 2}, ("threshold_strong",)),
        ({1}, ()),
    ],
)
def test_ordinal_has_the_thresholds_of_the_answers_in_use(crowd, strengths, names):
    panel = crowd(60, [-0.5, 0, 0.5], seed=1)
    kept = np.isin(np.abs(panel.preference), list(strengths))
    fit = ordinal(
        replace(panel, preference=np.where(kept, panel.preference, MISSING).astype(np.int8)),
        mixed=False,
    )
    assert fit.threshold_names == names and fit.answers == kept.sum()
    assert (np.diff(fit.worth) > 0).all()
    if strengths == {1}:  # then it is Bradley-Terry but for the side effect
        sign = np.sign(panel.preference[kept])
        assert set(sign) == {-1, 1}


# --- what must not change
# -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study(crowd):
    return crowd(24, [-0.7, 0, 0.3, 0.9], seed=8, taste=0.4, side=0.3)


def estimates(responses, options=None):
    return worths(responses, options or Options(resamples=100)).set_index(
        ["framing", "model", "technique"]
    )[["estimate", "low", "high"]]


def test_worths_have_their_columns_and_centre_on_0_within_a_framing(study, table):
    result = worths(table(study, replace(study, framing="head-shot")), Options(resamples=100))
    assert list(result.columns) == [
        *("framing", "model", "technique", "estimate", "low", "high", "fit")
    ]
    assert set(result.fit) == {"maximum likelihood"}
    assert list(dict.fromkeys(result.model)) == list(MODELS)
    assert list(dict.fromkeys(result.framing)) == ["close-up", "head-shot", "overall"]
    assert result.groupby(["framing", "model"]).estimate.sum().abs().max() < 1e-8
    assert (result.low < result.estimate).all() and (result.estimate < result.high).all()


def test_other_sides_change_nothing_but_the_side_effect(study, table):
    turned = replace(study, first_left=~study.first_left)
    one, other = (estimates(table(panel, order="abcd")) for panel in (study, turned))
    np.testing.assert_allclose(one, other, atol=1e-6)
    assert ordinal(study).side == pytest.approx(-ordinal(turned).side, abs=1e-6)


def test_another_order_of_techniques_permutes_worths(study, table):
    one, other = (estimates(table(study, order=order)) for order in ("abcd", "cadb"))
    np.testing.assert_allclose(one, other.reindex(one.index), atol=1e-6)


def test_doubling_the_people_keeps_worths_and_narrows_intervals(study, table):
    twice = study.chosen(np.tile(np.arange(24), 2))
    twice = replace(twice, participants=np.array([f"P{k:04d}" for k in range(48)], object))
    one, other = (estimates(table(panel), Options(resamples=400)) for panel in (study, twice))
    np.testing.assert_allclose(one.estimate, other.estimate, atol=1e-5)
    ratio = (other.high - other.low) / (one.high - one.low)
    assert ratio.between(0.55, 0.85).all() and ratio.mean() == pytest.approx(
        1 / np.sqrt(2), abs=0.06
    )


@pytest.mark.parametrize("model", MODELS)
def test_a_known_truth_is_in_its_interval_as_often_as_claimed(crowd, model):
    """60 small studies of 30 people: of 180 95 % intervals at least 160 hold (binomial: fewer has a
    chance below 1e-4).
    """
    truth, options, hits, count = np.array([-0.5, 0.1, 0.4]), Options(resamples=200), 0, 60
    noise, scale = {"thurstone_jod": ("standard_normal", 1 / JOD_SIGMA)}.get(
        model, ("logistic", 1.0)
    )
    for seed in range(count):
        if model == "davidson":
            panel = _davidson_people(crowd, truth, seed)
        else:
            cuts = (0.6, 2.0) if model == "ordinal" else (0.0, 2.0)
            panel = crowd(30, truth * scale, seed=seed, noise=noise, cuts=cuts)
        one = worth.fit(panel, model, options)
        assert not any("no finite worths" in note for note in one.notes)
        hits += ((one.low <= truth) & (truth <= one.high)).sum()
    assert 160 <= hits <= 180


def _davidson_people(crowd, truth, seed):
    panel = crowd(30, truth, seed=seed)
    rng = np.random.default_rng(1000 + seed)
    d = truth[panel.second] - truth[panel.first]
    chance = special.softmax(np.stack([-d / 2, np.full(3, -0.4), d / 2]), axis=0)
    drawn = (rng.random((30, 3, 1)) > np.cumsum(chance, axis=0).T).sum(axis=2) - 1
    return replace(panel, preference=drawn.astype(np.int8))


# --- what has no worth
# -----------------------------------------------------------------------------

UNBEATEN = {
    "a was never beaten by b, c": ["a>b a>c b>c"] * 3 + ["a>>b a>c b<c"] * 3,
    "c was never preferred to a, b": ["a>c b>c a>b"] * 3 + ["a>c b>c a<b"] * 3,
    "a, b were never beaten by c, d": ["a>b a>c b>d c>d a>d b>c"] * 3
    + ["a<b a>c b>d c<d a>d b>c"] * 3,
}
REFUSED = {
    "a, b and c, d were never compared": ["a>b c>d"] * 3 + ["a<b c<d"] * 3,
    "every answer is 'no difference'": ["a=b b=c a=c"] * 6,
}


@pytest.mark.parametrize("reason", [*REFUSED, *UNBEATEN])
def test_a_fit_that_does_not_exist_is_named_and_not_invented(lines, reason):
    responses = lines(*(REFUSED | UNBEATEN)[reason])
    options = Options(resamples=100, fallback="none" if reason in UNBEATEN else "reduced_bias")
    result = worths(responses, options)
    assert result[["estimate", "low", "high"]].isna().all(axis=None) and len(result) == 4 * len(
        responses.items["close-up"]
    )
    assert all(
        any(
            f"close-up, {model}: no finite worths" in note and reason in note
            for note in result.attrs["notes"]
        )
        for model in MODELS
    )
    assert worth.parameters(responses, options).empty and set(result.fit) == {""}


@pytest.mark.parametrize("reason", UNBEATEN)
def test_an_unbeaten_technique_has_a_marked_fit_and_an_open_interval(lines, reason):
    """No panel disappears; and resampling a technique that always won must not make it certain."""
    responses = lines(*UNBEATEN[reason])
    result = worths(responses, Options(resamples=100))
    assert result[["estimate", "low", "high"]].notna().all(axis=None)
    assert set(result.fit) == {"reduced bias", "weak prior"}
    assert all(
        any(
            f"{model}: maximum likelihood has no finite worths" in note and reason in note
            for note in result.attrs["notes"]
        )
        for model in MODELS
    )
    assert ((result.high - result.estimate) > 0.3).all() and (result.high < 12).all()
    assert ((result.estimate - result.low) > 0.3).all() and (result.low > -12).all()


@pytest.mark.parametrize("seed", range(3))
def test_reduced_bias_is_the_maximum_of_jeffreys_penalised_likelihood(seed):
    """Firth 1993: for the logit link, and for Davidson's exponential family, against a general
    optimiser; with a technique that never won, where maximum likelihood has none.
    """
    rng = np.random.default_rng(seed)
    won = rng.integers(1, 6, (4, 4)) * (1 - np.eye(4, dtype=int))
    won[0] = 0
    level = np.triu(rng.integers(0, 4, (4, 4)), 1)
    level[0] = 0
    i, j = np.triu_indices(4, 1)
    basis = np.linalg.svd(np.eye(4) - 1 / 4)[0][:, :3]
    x = (np.eye(4)[i] - np.eye(4)[j]) @ basis
    for ties in (np.zeros((4, 4)), level + level.T):
        counts = np.stack([won[i, j], won[j, i], ties[i, j]], axis=1)
        size = 4 if ties.any() else 3

        def loss(theta, counts=counts, size=size):
            d = x @ theta[:3]
            tie = np.full_like(d, theta[3] if size == 4 else -np.inf)
            p = special.softmax(np.stack([d / 2, -d / 2, tie], axis=1), axis=1)
            information = np.zeros((size, size))
            for k in range(6):
                jacobian = np.zeros((2, size))
                jacobian[0, :3], jacobian[1, 3:] = x[k], 1
                features = np.array([[0.5, 0], [-0.5, 0], [0, 1]])
                mean = p[k] @ features
                spread = (features.T * p[k]) @ features - np.outer(mean, mean)
                information += counts[k].sum() * jacobian.T @ spread @ jacobian
            seen = counts > 0
            fit = (counts[seen] * np.log(p[seen])).sum()
            return -fit - 0.5 * np.linalg.slogdet(information)[1]

        best = optimize.minimize(loss, np.zeros(size), options={"gtol": 1e-7}).x
        result, log_nu = davidson(won, ties, reduced_bias=True)
        assert result == pytest.approx(basis @ best[:3], abs=1e-4)
        assert np.isnan(davidson(won, ties)[0]).all()
        if size == 4:
            assert log_nu == pytest.approx(best[3], abs=1e-4)


def test_reduced_bias_of_one_pair_is_half_an_answer_for_each():
    """One logit: Jeffreys' prior adds half a win on each side."""
    result = bradley_terry([[0, 20], [0, 0]], reduced_bias=True)
    assert result[0] - result[1] == pytest.approx(np.log(20.5 / 0.5))
    assert np.diff(thurstone_jod([[0, 0], [20, 0]], reduced_bias=True)) > 2


def test_a_tie_is_neither_a_defeat_nor_the_want_of_one(lines):
    """One rule: a was tied and never beaten, which half wins give a number and dropped ones do
    not.
    """
    responses = lines(*["a=b b>c a>c"] * 4, *["a>b b<c a=c"] * 4, *["a=b b=c a=c"] * 4)
    (panel,) = panels(responses).values()
    for model in ("bradley_terry", "thurstone_jod"):
        assert missing_fit(panel, model) is None
        assert missing_fit(panel, model, "drop") == "a was never beaten by b, c"
    assert missing_fit(panel, "davidson") is None and missing_fit(panel, "ordinal") is None
    result = worths(responses, Options(resamples=100)).set_index(["model", "technique"])
    assert result.estimate["davidson", "a"] > result.estimate["davidson", "b"]
    assert result.fit["bradley_terry", "a"] == "maximum likelihood"
    dropped = worths(responses, Options(resamples=100, ties="drop"))
    assert set(dropped[dropped.model == "bradley_terry"].fit) == {"reduced bias"}


def test_separated_answers_are_refused(lines):
    """Connected through ties, yet a can rise over b and c for ever while the threshold follows."""
    responses = lines(*["a>b b=c a=c"] * 6)
    (panel,) = panels(responses).values()
    for model in ("davidson", "ordinal"):
        assert "separated" in missing_fit(panel, model)
    won, level = wins(panel, panel.counts, "drop"), tied(panel, panel.counts)
    assert np.isnan(davidson(won, level)[0]).all() and np.isnan(davidson(won, level)[1])


def test_tastes_that_grow_without_end_are_refused(crowd, table):
    """Twenty people with strong tastes, three answers each: among 40 such studies one at least has
    no maximum.
    """
    result = next(
        worths(table(other), Options(resamples=100, models=("ordinal",)))
        for other in (
            crowd(20, [-1, -2, 2], seed=seed, taste=6.0, cuts=(2.0, 4.0)) for seed in range(40)
        )
        if ordinal(other) is None and missing_fit(other, "ordinal") is None
    )
    assert "can grow together without end" in result.attrs["notes"][0]
    assert set(result.fit) == {"weak prior"} and result.estimate.notna().all()


def test_two_techniques_have_the_log_odds(lines):
    result = (
        worths(lines(*["a>b"] * 12, *["a<<b"] * 4), Options(resamples=100))
        .set_index(["model", "technique"])
        .estimate
    )
    assert result["bradley_terry", "a"] - result["bradley_terry", "b"] == pytest.approx(np.log(3))
    assert result["davidson", "a"] - result["davidson", "b"] == pytest.approx(np.log(3))
    assert result["thurstone_jod", "a"] - result["thurstone_jod", "b"] == pytest.approx(1)


def test_few_people_get_no_interval_and_one_no_ordinal_model(lines):
    result = worths(lines("a>b b>c a<c"), Options(resamples=100))
    rest = result[result.model != "ordinal"]
    assert rest.estimate.notna().all() and result[["low", "high"]].isna().all(axis=None)
    assert result[result.model == "ordinal"].estimate.isna().all()
    assert any("needs 5" in note for note in result.attrs["notes"])


def test_intervals_survive_resamples_without_a_fit(lines):
    """a is beaten by one person in six: a third of the resamples leave that one out."""
    responses = lines(*["a>b b>c a>c"] * 2, *["a>b b<c a>c"] * 3, "a<b b<c a<c")
    result = worths(responses, Options(resamples=200, models=("bradley_terry",)))
    assert result[["estimate", "low", "high"]].notna().all(axis=None)
    assert (result.low > -6).all() and (result.high < 6).all()
    assert set(result.fit) == {"maximum likelihood"}
    assert any(
        "resamples: the interval is that of worths with reduced bias" in note
        for note in result.attrs["notes"]
    )
    refused = worths(responses, Options(resamples=200, models=("bradley_terry",), fallback="none"))
    assert refused[["low", "high"]].isna().all(axis=None)


def test_davidson_with_a_side_finds_it():
    """Counts drawn from the model of Davidson and Beaver 1977; without a side it is Davidson's."""
    rng = np.random.default_rng(2)
    truth, log_nu, side = np.array([-0.6, 0.1, 0.5]), -0.3, 0.4
    counts = np.zeros((3, 3, 3))
    for i, j in permutations(range(3), 2):
        d = truth[i] - truth[j] + side
        p = special.softmax([d / 2, -d / 2, log_nu])
        counts[i, j] = rng.multinomial(4000, p)
    result, found_nu, found_side = davidson_sides(counts)
    assert result == pytest.approx(truth, abs=0.05)
    assert found_nu == pytest.approx(log_nu, abs=0.05)
    assert found_side == pytest.approx(side, abs=0.05)
    both = counts + np.swapaxes(counts, 0, 1)[..., [1, 0, 2]]
    plain, nu = davidson(both[..., 0], both[..., 2])
    even, even_nu, none = davidson_sides(both)
    assert even == pytest.approx(plain, abs=1e-5) and none == pytest.approx(0, abs=1e-5)
    assert even_nu == pytest.approx(nu, abs=1e-5)


def test_standard_errors_are_statsmodels():
    i, j = np.triu_indices(7, 1)
    x = (np.eye(7)[i] - np.eye(7)[j])[:, :-1]
    fit = sm.GLM(
        np.column_stack([BASEBALL[i, j], BASEBALL[j, i]]), x, family=sm.families.Binomial()
    ).fit(tol=1e-12)
    covariance = np.zeros((7, 7))
    covariance[:6, :6] = fit.cov_params()
    centring = np.eye(7) - 1 / 7
    expected = np.sqrt(np.diag(centring @ covariance @ centring))
    assert worth.standard_errors(BASEBALL) == pytest.approx(expected, rel=1e-6)


def test_the_deviance_is_that_of_the_regression(crowd, table):
    panel = crowd(40, [-0.5, 0, 0.3, 0.6], seed=2, cuts=(0.0, 2.0))
    result = worth.goodness(table(panel, order="abcd"), Options()).set_index("model")
    i, j = np.triu_indices(4, 1)
    won = wins(panel, panel.counts)
    x = (np.eye(4)[i] - np.eye(4)[j])[:, :-1]
    fit = sm.GLM(np.column_stack([won[i, j], won[j, i]]), x, family=sm.families.Binomial()).fit()
    assert result.deviance["bradley_terry"] == pytest.approx(fit.deviance)
    assert result.df["bradley_terry"] == 3
    assert result.p["bradley_terry"] == pytest.approx(stats.chi2.sf(fit.deviance, 3))


def test_eleven_techniques(crowd, table):
    result = worths(table(crowd(12, np.linspace(-1, 1, 11), seed=1)), Options(resamples=100))
    assert len(result) == 44 and result.estimate.notna().all()


def test_strong_connection_is_a_chain_of_wins_between_any_two():
    rng = np.random.default_rng(3)
    matrices = (rng.random((200, 6, 6)) < 0.25) * (1 - np.eye(6))
    for matrix, result in zip(matrices, worth.strongly_connected(matrices), strict=True):
        reach = np.linalg.matrix_power(matrix + np.eye(6), 6) > 0
        assert result == all(reach[i, j] and reach[j, i] for i, j in combinations(range(6), 2))


def test_jod_sigma_is_the_textbooks():
    assert pytest.approx(1.4826, abs=1e-4) == JOD_SIGMA and stats.norm.cdf(
        1 / JOD_SIGMA
    ) == pytest.approx(0.75)
