"""Resampling of participants against drawing them one by one; intervals against a formula and
numpy; refusals.
"""

import numpy as np
import pytest
from scipy import stats

from analysis import bootstrap
from analysis.bootstrap import (
    BLOCK,
    interval,
    median,
    median_intervals,
    medians,
    score_intervals,
    totals,
    weights,
)
from analysis.options import Options
from analysis.panel import PREFERENCES
from analysis.tallies import scores


def test_every_resample_draws_as_many_people_as_there_are():
    drawn = weights(17, 300, seed=1)
    assert drawn.shape == (300, 17) and (drawn.sum(axis=1) == 17).all()
    assert np.array_equal(drawn, weights(17, 300, seed=1)) and not np.array_equal(
        drawn, weights(17, 300, seed=2)
    )
    # a participant is drawn Binomial(17, 1/17) times
    seen = np.bincount(drawn.astype(int).ravel(), minlength=5)[:5] / drawn.size
    assert seen == pytest.approx(stats.binom.pmf(range(5), 17, 1 / 17), abs=0.02)


def test_draws_hang_on_their_number_alone(monkeypatch):
    """Not on how many are drawn, what is kept, or where drawing begins."""
    whole = weights(50, 200, seed=3)
    assert np.array_equal(weights(50, BLOCK + 5, seed=3), whole[: BLOCK + 5])
    monkeypatch.setattr(bootstrap, "KEPT", 0)
    assert np.array_equal(weights(50, 200, seed=3), whole)
    spawned = np.random.SeedSequence([3, 50]).spawn(2)[1]
    people = np.random.default_rng(spawned).integers(0, 50, (BLOCK, 50), dtype=np.int32)
    assert np.array_equal(np.bincount(people[0], minlength=50), whole[BLOCK])


def test_counts_of_some_resamples_are_those_of_all(crowd):
    panel, options = crowd(12, [0, 0.4, 1], seed=1), Options(resamples=100, seed=5)
    some = bootstrap.counts_between(panel, options, 2 * BLOCK, 200)
    assert some.tobytes() == bootstrap.counts(panel, options)[2 * BLOCK :].tobytes()


def test_counts_are_those_of_the_people_drawn(crowd):
    panel, options = crowd(12, [0, 0.4, 1], seed=1), Options(resamples=100, seed=5)
    result = bootstrap.counts(panel, options)
    for resample, drawn in enumerate(weights(12, 100, 5)[:20]):
        people = panel.preference[np.repeat(np.arange(12), drawn.astype(int))]
        assert np.array_equal(result[resample], (people[:, :, None] == PREFERENCES).sum(axis=0))


def test_counts_of_thousands_are_whole_numbers(crowd):
    panel = crowd(3000, [0, 1], seed=1)
    result = bootstrap.counts(panel, Options(resamples=100))
    assert np.array_equal(result, np.rint(result)) and (result.sum(axis=(1, 2)) == 3000).all()


def test_the_interval_of_a_mean_is_students(crowd):
    """What the expansion is for: with 10 people the bootstrap of a mean is as wide as Student's
    interval, not sqrt(9/10) z/t of it.
    """
    values = np.random.default_rng(0).normal(0, 1, 10)
    draws = totals(values, Options(resamples=20_000)) / 10
    low, high = interval(draws, 10, 0.95)
    student = stats.t.interval(0.95, 9, values.mean(), stats.sem(values))
    assert high - low == pytest.approx(student[1] - student[0], rel=0.05)
    plain = np.quantile(draws, [0.025, 0.975])
    assert (plain[1] - plain[0]) / (student[1] - student[0]) == pytest.approx(
        np.sqrt(9 / 10) * 1.96 / stats.t.ppf(0.975, 9), rel=0.04
    )


def test_the_interval_of_many_is_the_percentile_interval():
    draws = np.random.default_rng(1).normal(size=(5000, 2))
    low, high = interval(draws, 10**7, 0.9)
    assert np.array([low, high]) == pytest.approx(
        np.quantile(draws, [0.05, 0.95], axis=0), abs=1e-3
    )


def test_resamples_without_an_estimate_are_left_out_or_refuse_the_interval():
    draws = np.random.default_rng(2).normal(size=(1000, 3))
    draws[:49, 0] = np.nan
    draws[:51, 1] = np.inf
    low, high = interval(draws, 40, 0.95)
    assert (
        np.isfinite([low[0], high[0], low[2], high[2]]).all() and np.isnan([low[1], high[1]]).all()
    )
    assert low[0] == interval(draws[49:, 0], 40, 0.95)[0]
    assert low[2] == interval(draws[:, 2], 40, 0.95)[0]
    assert np.isnan(interval(draws, 4, 0.95)).all()


def test_medians_of_counts_are_numpys():
    rng = np.random.default_rng(3)
    for n in (1, 2, 3, 8, 9):
        answers = rng.integers(-2, 3, (40, n))
        counts = (answers[:, :, None] == np.arange(-2, 3)).sum(axis=1)
        assert median(counts) == pytest.approx(np.median(answers, axis=1))
        judged = np.array([3, 2, 1, 1 / 2, 1 / 3])
        assert median(counts, judged) == pytest.approx(np.median(judged[answers + 2], axis=1))
    assert np.isnan(median(np.zeros(5)))


def test_medians_of_resampled_people_are_numpys():
    values, options = np.sort(np.random.default_rng(4).random(9)), Options(resamples=150, seed=2)
    drawn = weights(9, 150, 2).astype(int)
    assert medians(values, options) == pytest.approx(
        [np.median(np.repeat(values, row)) for row in drawn]
    )


def test_scores_are_the_tallies_with_an_interval(crowd, table):
    responses = table(
        crowd(15, [0, 0.4, 1], seed=1), crowd(15, [0, 0.2, 0.2], seed=2, framing="head-shot")
    )
    result = score_intervals(responses, Options(resamples=200))
    each = result[result.framing != "overall"].reset_index(drop=True)
    assert each[["framing", "technique", "score"]].equals(scores(responses))
    assert ((result.low <= result.score) & (result.score <= result.high)).all()
    total = result[result.framing == "overall"].set_index("technique").score
    assert total.to_dict() == each.groupby("technique").score.sum().to_dict()
    middle = median_intervals(responses, Options(resamples=200))
    assert (middle.n == 15).all() and (
        (middle.low <= middle.median_preference) & (middle.median_preference <= middle.high)
    ).all()
