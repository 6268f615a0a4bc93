"""The public face alone suffices: single statistics of plain numbers, against published values and
other packages; what a study declares has a fingerprint.
"""

from itertools import combinations, product

import evalica
import numpy as np
import pandas as pd
import pytest
from scipy import stats

import analysis
from analysis import (
    InputError,
    circular_triads,
    declared,
    holm,
    kendall_u,
    krippendorff_alpha,
    sign_test,
    signed_rank,
    triad_distribution,
)
from analysis.agreement import few_triads
from analysis.ahp import consistency_intervals
from analysis.compute import TABLES, everything
from analysis.inference import by_images, pairs, verdict
from analysis.options import Options


def test_every_public_name_is_there_and_documented():
    for name in analysis.__all__:
        one = getattr(analysis, name)
        assert one.__doc__ and name in (analysis.__doc__ + " ".join(analysis.__all__))
    for name in ("davidson_sides", "standard_errors", "triad_distribution", "tost_power"):
        assert name in analysis.__doc__


def test_circular_triads_of_guessing_are_kendalls_table():
    """Kendall and Babington Smith 1940, table I: how many of the tournaments have d triads."""
    for n, counts in (
        (3, [6, 2]),
        (4, [24, 16, 24]),
        (5, [120, 120, 240, 240, 280, 24]),
    ):
        chance = triad_distribution(n)
        assert chance * 2 ** (n * (n - 1) // 2) == pytest.approx(counts)
    for n in range(3, 9):  # Moran 1947: mean C(n, 3)/4, variance 3 C(n, 3)/16
        chance, d = triad_distribution(n), np.arange(len(triad_distribution(n)))
        triples = n * (n - 1) * (n - 2) / 6
        assert chance @ d == pytest.approx(triples / 4)
        assert chance @ d**2 - (chance @ d) ** 2 == pytest.approx(3 * triples / 16)
    with pytest.raises(InputError, match="n is 11, expected 3 to 10 items"):
        triad_distribution(11)


def test_circular_triads_are_counted_and_their_p_is_exact():
    circle = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    assert circular_triads(circle) == 1 and circular_triads(np.triu(np.ones((5, 5)), 1)) == 0
    drawn = np.random.default_rng(0).integers(0, 2, (400, 10)).astype(bool)
    seen = []
    for row in drawn:
        matrix = np.zeros((5, 5))
        for (i, j), won in zip(combinations(range(5), 2), row, strict=True):
            matrix[(i, j) if won else (j, i)] = 1
        seen.append(circular_triads(matrix))
    assert np.bincount(seen, minlength=6) / 400 == pytest.approx(triad_distribution(5), abs=0.08)
    one = triad_distribution(4)
    two = sum(one[a] * one[b] for a, b in product(range(3), repeat=2) if a + b <= 2)
    assert few_triads(2, 2, 4) == pytest.approx(two)


@pytest.mark.parametrize("metric", ["nominal", "ordinal", "interval"])
def test_alpha_in_three_metrics_is_evalicas(metric):
    rng = np.random.default_rng(3)
    ratings = rng.integers(1, 5, (4, 12)).astype(float)
    ratings[rng.random(ratings.shape) < 0.2] = np.nan
    counts = np.stack([(ratings == value).sum(axis=0) for value in range(1, 5)], axis=1)
    expected = evalica.alpha(pd.DataFrame(ratings), metric).alpha
    assert float(krippendorff_alpha(counts, metric)) == pytest.approx(expected)


def test_small_statistics_of_plain_numbers():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    values = np.array([1, 2, -1, 2, 1, 1, 2])
    ranks = stats.rankdata(np.abs(values))
    assert signed_rank(values)[2] == pytest.approx(2 * ranks[values > 0].sum() / ranks.sum() - 1)
    assert sign_test(values) == pytest.approx(stats.binomtest(1, 7).pvalue)
    assert kendall_u(np.array([[4.0, 0, 0, 0, 0]])) == 1


def test_a_low_cr_is_set_against_chance(crowd, table):
    """20 coin-flippers look coherent nearly always: CR below .1 says nothing of them."""
    rng, low, shares = np.random.default_rng(0), 0, []
    for seed in range(12):
        panel = crowd(20, [0, 0, 0, 0, 0], seed=seed)
        result = consistency_intervals(table(panel, order="abcde"), Options(resamples=200))
        row = result[result.aggregation == "median"].iloc[0]
        low += row.cr < 0.1
        shares.append(row.chance_share)
    assert low >= 10 and 0.2 < np.mean(shares) < 0.9
    sure = consistency_intervals(
        table(crowd(20, [-2, -1, 0, 1, 2], seed=1), order="abcde"), Options(resamples=200)
    )
    assert sure.chance_cr.notna().all() and rng is not None


def test_no_interval_means_no_equivalence(lines):
    """A margin in points was declared and four people answered: nothing is called as good."""
    responses = lines(*["a=b a>c b<c", "a=b a<c b>c"] * 2)
    options = Options(margin=0.25, margin_jod=5.0, resamples=100)
    rows = pairs(responses, options)
    assert (rows.equivalent == 0).all()
    assert {verdict(row, 0.05) for row in rows.itertuples()} == {"undecided"}


def test_images_are_a_sample_too(crowd, table):
    from dataclasses import replace

    framings = ("close-up", "head-shot", "half-length", "aerial")
    panels = [
        replace(crowd(30, [-0.8, 0, 0.1 * k], seed=k), framing=name)
        for k, name in enumerate(framings)
    ]
    result = by_images(table(*panels, order="abc"), Options()).set_index(["a", "b"])
    means = [
        pairs(table(one, order="abc"), Options(resamples=100)).set_index(["a", "b"])
        for one in panels
    ]
    values = [one.mean_preference["a", "b"] for one in means]
    test = stats.ttest_1samp(values, 0)
    assert result.p["a", "b"] == pytest.approx(test.pvalue)
    assert result.images["a", "b"] == 4 and result.least["a", "b"] == pytest.approx(min(values))
    assert by_images(table(panels[0]), Options()).empty


def test_a_plan_has_a_fingerprint_that_only_its_content_changes():
    one = declared.fingerprint({"margin": 0.25, "exclusions": {"zeta": 0.2, "median_rt_ms": 500}})
    other = declared.fingerprint({"exclusions": {"median_rt_ms": 500, "zeta": 0.2}, "margin": 0.25})
    assert one == other and len(one) == 64 and declared.fingerprint({}) == ""
    assert declared.fingerprint({"margin": 0.3}) != declared.fingerprint({"margin": 0.25})


def test_progress_is_told_table_by_table(lines):
    steps = []

    def bar(names):
        for name in names:
            steps.append(name)
            yield name

    everything(lines(*["a>b", "a<b"] * 3), Options(resamples=100), bar)
    assert steps == list(TABLES)
