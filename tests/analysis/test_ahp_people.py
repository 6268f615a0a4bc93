"""AHP beside itself: row geometric means, geometric-mean aggregation, intervals, and the judgement
to look at again.
"""

from pathlib import Path

import numpy as np
import pytest

from analysis import comparisons, priorities, read_matrices
from analysis.ahp import (
    Comparison,
    aggregated,
    consistency_intervals,
    judgements,
    look_again,
    priority_intervals,
    row_geometric_mean,
)
from analysis.options import Options
from analysis.panel import panels

FAST = Options(resamples=200)
MATRICES = Path(__file__).parent / "thesis_matrices.toml"


def test_row_geometric_means_are_the_least_squares_fit_of_the_logarithms():
    """Crawford and Williams 1985: they minimise the sum of (log a_ij - log w_i + log w_j)^2."""
    rng = np.random.default_rng(0)
    matrix = np.exp(np.triu(rng.normal(0, 1, (5, 5)), 1))
    matrix = np.triu(matrix, 1) + np.tril(1 / matrix.T, -1) + np.eye(5)
    i, j = np.triu_indices(5, 1)
    fit = np.linalg.lstsq(
        np.vstack([np.eye(5)[i] - np.eye(5)[j], np.ones(5)]),
        np.append(np.log(matrix[i, j]), 0),
        rcond=None,
    )[0]
    assert row_geometric_mean(matrix) == pytest.approx(np.exp(fit) / np.exp(fit).sum())


def test_both_methods_agree_on_a_consistent_matrix_and_on_three_items():
    """For three items the eigenvector is the row geometric mean (Saaty 1980); for consistent
    judgements both are the worths.
    """
    worth = np.array([0.1, 0.2, 0.3, 0.4])
    assert row_geometric_mean(worth[:, None] / worth) == pytest.approx(worth)
    three = np.array([[1, 3, 1 / 2], [1 / 3, 1, 2], [2, 1 / 2, 1]])
    assert row_geometric_mean(three) == pytest.approx(priorities(three).vector)


def test_geometric_means_of_judgements_know_no_order(crowd, table):
    panel = crowd(10, [0, 0.5, 1], seed=1)
    matrix = aggregated(panel, panel.counts, "geometric_mean")
    expected = np.exp(np.log(judgements(panel.preference)).mean(axis=0))
    assert matrix[np.triu_indices(3, 1)] == pytest.approx(
        expected
    ) and matrix * matrix.T == pytest.approx(np.ones((3, 3)))
    one, other = (
        priority_intervals(table(panel, order=order), FAST).set_index(
            ["aggregation", "method", "technique"]
        )
        for order in ("abc", "cab")
    )
    columns = ["priority", "low", "high"]
    assert other.loc["geometric_mean", columns].reindex(
        one.loc["geometric_mean"].index
    ).to_numpy() == pytest.approx(one.loc["geometric_mean", columns].to_numpy())


def test_the_medians_are_those_of_the_first_report(crowd, table):
    responses = table(crowd(10, [0, 0.5, 1, 0.2], seed=1))
    (panel,) = panels(responses).values()
    assert aggregated(panel, panel.counts, "median") == pytest.approx(
        comparisons(responses)["close-up"].matrix
    )
    result = (
        priority_intervals(responses, FAST)
        .set_index(["aggregation", "method", "technique"])
        .sort_index(sort_remaining=False)
    )
    published = priorities(comparisons(responses)["close-up"].matrix)
    assert result.priority["median", "eigenvector"].to_numpy() == pytest.approx(published.vector)
    consistency = consistency_intervals(responses, FAST).set_index("aggregation")
    assert consistency.ci["median"] == pytest.approx(published.ci) and consistency.cr[
        "median"
    ] == pytest.approx(published.cr)
    assert result.groupby(["aggregation", "method"]).priority.sum().to_numpy() == pytest.approx(1)
    assert ((result.low <= result.high) & (result.low > 0)).all() and (
        consistency.ci_low <= consistency.ci_high
    ).all()


def test_twice_the_people_narrow_the_intervals(crowd, table):
    panel = crowd(20, [0, 0.5, 1], seed=1)
    twice = panel.chosen(np.tile(np.arange(20), 2))
    object.__setattr__(twice, "participants", np.array([f"P{k:04d}" for k in range(40)], object))
    one, two = (
        priority_intervals(table(each, order="abc"), FAST)
        .set_index("aggregation")
        .sort_index()
        .loc["geometric_mean"]
        for each in (panel, twice)
    )
    assert two.priority.to_numpy() == pytest.approx(one.priority.to_numpy())
    assert ((two.high - two.low) < 0.85 * (one.high - one.low)).all()


def test_the_judgement_to_look_at_again_is_the_one_that_was_turned():
    worth = np.array([0.1, 0.15, 0.3, 0.45])
    matrix = worth[:, None] / worth
    assert look_again(Comparison(tuple("abcd"), matrix)) is None
    matrix[0, 3], matrix[3, 0] = 1 / matrix[0, 3], 1 / matrix[3, 0]
    a, b, given, implied = look_again(Comparison(tuple("abcd"), matrix))
    assert (a, b) == ("a", "d") and given == pytest.approx(4.5) and implied < 1.5
    again = look_again(read_matrices(MATRICES)["close-up"])
    assert (
        again[:2] == ("golubev", "jimenez_gaussian") and again[2] == 3
    )  # the thesis's 3 beside 0.2766/0.1623


def test_an_incoherent_circle_is_named_in_the_table(lines):
    result = consistency_intervals(lines(*["a>>b b>>c a<<c"] * 6), FAST).iloc[0]
    assert (
        result.cr > 0.1
        and {result.a, result.b} <= set("abc")
        and result.judgement in (3, pytest.approx(1 / 3))
    )
    fine = consistency_intervals(lines(*["a>b b>c a>>c"] * 6), FAST).iloc[0]
    assert fine.cr < 0.1 and fine.a == "" and np.isnan(fine.judgement)


def test_missing_pairs_and_eleven_items_are_said(crowd, table, lines):
    result = priority_intervals(lines(*["a>b b>c"] * 6), FAST)
    assert (
        result[["priority", "low", "high"]].isna().all(axis=None)
        and "a pair has no answer" in result.attrs["notes"][0]
    )
    eleven = consistency_intervals(table(crowd(8, np.linspace(-1, 1, 11), seed=1)), FAST)
    assert (
        eleven.ci.notna().all()
        and eleven.cr.isna().all()
        and "beyond 10 items, got 11" in eleven.attrs["notes"][0]
    )
    two = consistency_intervals(lines(*["a>b"] * 6), FAST)
    assert (two.ci == 0).all() and (two.cr == 0).all()
