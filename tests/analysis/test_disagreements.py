"""Intervals that hold together, effect sizes with theirs, and a sentence for every disagreement of
models with the declared test.
"""

import numpy as np
import pytest
from scipy import stats

from analysis import inference
from analysis.compute import everything
from analysis.conclusions import conclude
from analysis.inference import contrasts, omnibus, order_effects, pairs, simultaneous
from analysis.inference.people import (
    equivalence_counts,
    sign_counts,
    sign_flip,
    signed_rank_counts,
)
from analysis.options import Options


def test_tests_of_counts_are_those_of_values():
    """What power counts in simulated studies is what analyse computes of a table."""
    rng = np.random.default_rng(0)
    for people in (3, 5, 12, 30, 55, 140):
        for _ in range(12):
            shares = rng.dirichlet(np.ones(5))
            values = rng.choice(np.arange(-2, 3), people, p=shares)
            counts = np.array([(values == value).sum() for value in range(-2, 3)])
            for of_counts, of_values in (
                (signed_rank_counts(counts), inference.signed_rank(values)[0]),
                (sign_counts(counts), inference.sign_test(values)),
                (equivalence_counts(counts, 0.4), inference.equivalence(values, 0.4)),
            ):
                assert of_counts == pytest.approx(of_values, rel=1e-9, nan_ok=True)


def test_holm_works_on_many_studies_at_once():
    p = np.random.default_rng(1).random((20, 7))
    p[3, 2] = np.nan
    together = inference.holm(p)
    for row, adjusted in zip(p, together, strict=True):
        assert inference.holm(row) == pytest.approx(adjusted, nan_ok=True)
    assert np.isnan(together[3, 2]) and np.isfinite(together[3]).sum() == 6


def test_simultaneous_intervals_hold_together_as_often_as_they_say():
    """200 studies of 25 people and 10 correlated means: all ten are held 95 % of the time."""
    held = unadjusted = 0
    rng, weights = np.random.default_rng(3), None
    for _ in range(200):
        values = rng.normal(0, 1, (25, 10)) + rng.normal(0, 0.7, (25, 1))
        drawn = rng.multinomial(25, np.full(25, 1 / 25), 300)
        weights = drawn @ values / 25
        low, high = simultaneous(values.mean(axis=0), weights, np.zeros(10), np.full(10, 25), 0.95)
        held += bool(((low < 0) & (high > 0)).all())
        half = stats.t.ppf(0.975, 24) * values.std(axis=0, ddof=1) / 5
        unadjusted += bool((np.abs(values.mean(axis=0)) < half).all())
    assert 178 <= held <= 199 and unadjusted < 160


def test_effect_sizes_have_intervals_that_hold_them(crowd, table):
    result = pairs(table(crowd(40, [0, 0.4, 0.8], seed=1)), Options(resamples=200))
    for name in ("rank_biserial", "dz"):
        assert (result[f"{name}_low"] <= result[name]).all()
        assert (result[name] <= result[f"{name}_high"]).all()
    wider = result.simultaneous_high - result.simultaneous_low
    assert (wider > result.high - result.low).all()


def test_a_contrast_is_a_cluster_regression(crowd, table):
    """Least squares with people as clusters, by statsmodels."""
    import statsmodels.api as sm

    panel = crowd(30, [-0.4, 0, 0.5, 0.2], seed=4, taste=0.5)
    result = contrasts(table(panel, order="abcd"), Options()).set_index(["a", "b"])
    x = np.tile((np.eye(4)[panel.second] - np.eye(4)[panel.first])[:, 1:], (30, 1))
    y = panel.preference.ravel().astype(float)
    clusters = np.repeat(np.arange(30), len(panel.first))
    fit = sm.OLS(y, x).fit(
        cov_type="cluster",
        cov_kwds={"groups": clusters, "use_correction": False, "df_correction": False},
    )
    assert result.estimate["a", "c"] == pytest.approx(fit.params[1])
    half = stats.t.ppf(0.975, 29) * fit.bse[1] * np.sqrt(30 / 29)
    assert result.high["a", "c"] - result.estimate["a", "c"] == pytest.approx(half, rel=1e-5)


def test_interaction_and_any_difference_are_found_and_not_invented(crowd, table):
    from dataclasses import replace

    here = crowd(30, [-0.6, 0, 0.6], seed=1)
    turned = replace(crowd(30, [0.6, 0, -0.6], seed=2), framing="head-shot")
    same = replace(crowd(30, [-0.6, 0, 0.6], seed=3), framing="head-shot")
    options = Options(resamples=400)
    for other, low, high in ((turned, 0, 0.01), (same, 0.02, 1)):
        result = omnibus(table(here, other, order="abc"), options).set_index(
            ["framing", "question"]
        )
        assert low <= result.p["overall", "interaction"] <= high
        assert result.p["close-up", "techniques"] < 0.01
    rng = np.random.default_rng(5)
    small = sum(sign_flip(rng.normal(size=(12, 4)), options, k)[1] <= 0.1 for k in range(200))
    assert 8 <= small <= 35  # of 200 true hypotheses 10 %


def test_worths_that_cannot_add_up_are_said(lines):
    """Everybody goes in a circle: no scale describes it."""
    result = omnibus(lines(*["a>b b>c c>a"] * 9, *["a>>b b>c c>a"] * 3), Options(resamples=200))
    by_question = result.set_index("question").p
    assert by_question["additivity"] < 0.01


def test_fatigue_and_carry_over_are_found(write):
    from analysis import read_responses

    rng, rows = np.random.default_rng(0), []
    for person in range(12):
        last = 1
        for order in range(1, 31):
            strong = rng.random() < 1 - order / 30
            last = last if rng.random() < 0.85 else -last
            value = last * (2 if strong else 1)
            a, b = [("a", "b"), ("a", "c"), ("b", "c")][order % 3]
            rows.append(
                f"P{person},3,f{order // 3},{a},{b},{value},{order},{4000 - 100 * order},2024-05-01"
            )
    result = order_effects(read_responses(write(rows)), Options(resamples=200))
    result = result.set_index("statistic")
    assert result.value["strength_slope"] < -0.2 and result.p["strength_slope"] < 0.01
    assert result.value["carry_over"] > 0.2 and result.p["carry_over"] < 0.01
    assert result.value["time_slope"] < 0 and result.p["side_slope"] > 0.001


def test_every_disagreement_has_its_sentence(crowd, table):
    """An undecided pair whose own interval excludes 0, and a margin in JOD that pairs meet."""
    for seed in range(20):
        responses = table(crowd(24, [0, 0.28, 0.5, 0.6, 0.2], seed=seed), order="abcde")
        options = Options(resamples=200, margin=0.25, margin_jod=0.8)
        results = everything(responses, options)
        rows = results.tables["pairs"]
        words = conclude(results.tables, results.notes, responses.codebook, options, 24, False)
        text = " | ".join(words.can + words.cannot)
        undecided = [
            row for row in rows.itertuples() if inference.verdict(row, 0.05) == "undecided"
        ]
        unadjusted = [row for row in undecided if row.low > 0 or row.high < 0]
        if unadjusted:
            assert "excludes 0 for" in text and "adjusted" in text
        meet = (rows.jod_equivalent == 1).sum()
        if meet:
            assert f"{meet} pair" in text and "the declared margin of 0.8 JOD" in text
        if unadjusted and meet:
            return
    raise AssertionError("no study of twenty had a disagreement")


def test_one_jod_means_what_the_fit_means(crowd, table):
    """With ties as half a win: those who prefer the upper one and half of the ties are 75 %."""
    from analysis import worth
    from analysis.worth_figures import jod_meaning

    panel = crowd(4000, [0, 0.9], seed=1, cuts=(0.8, 2.0))
    (low, high) = worth.estimated(panel, "thurstone_jod", Options())
    counts = panel.counts[0] / 4000
    upper, ties = counts[3:].sum(), counts[2]
    assert stats.norm.cdf((high - low) / worth.JOD_SIGMA) == pytest.approx(upper + ties / 2)
    assert upper < stats.norm.cdf((high - low) / worth.JOD_SIGMA) - 0.1
    assert "half of those that see no difference are 75 %" in jod_meaning("half")
    assert "answers 'no difference' are left out" in jod_meaning("drop")
