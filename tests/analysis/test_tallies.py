"""Counts against a table counted by hand, and what must not change them."""

import numpy as np
import pandas as pd
import pytest

from analysis import (
    distributions,
    familiarity,
    preferences,
    read_responses,
    scores,
    sides,
    totals,
    trend,
)
from analysis.tallies import Trend


@pytest.fixture
def counted(write, answer):
    """Three participants, two framings, three techniques; every number below was counted by hand
    from these lines.
    """
    return read_responses(
        write(
            [
                answer("P1", "close-up", "none", "gol", 2, familiarity=1),  # gol +2
                answer("P1", "close-up", "none", "sep", 1, familiarity=1),  # sep +1
                answer("P1", "close-up", "gol", "sep", -1, familiarity=1),  # gol +1
                answer("P2", "close-up", "gol", "none", -2, familiarity=4),  # gol +2
                answer("P2", "close-up", "sep", "none", 2, familiarity=4),  # none +2
                answer("P2", "close-up", "sep", "gol", 0, familiarity=4),
                answer("P3", "close-up", "gol", "none", 0, familiarity=4),
                answer("P1", "head-shot", "none", "gol", 0, familiarity=1),
                answer("P2", "head-shot", "gol", "none", 1, familiarity=4),  # none +1
            ]
        )
    )


def test_scores_by_hand(counted):
    assert scores(counted).to_dict("split")["data"] == [
        ["close-up", "none", 2],
        ["close-up", "gol", 5],
        ["close-up", "sep", 1],
        ["head-shot", "none", 1],
        ["head-shot", "gol", 0],
    ]


def test_totals_by_hand(counted):
    table = totals(counted)
    assert table[["framing", "total", "answers"]].to_dict("split")["data"] == [
        ["close-up", 8, 7],
        ["head-shot", 1, 2],
    ]
    assert table.mean_strength.tolist() == pytest.approx([8 / 7, 1 / 2])


def test_sides_by_hand(counted):
    assert sides(counted).to_dict("split")["data"] == [
        ["close-up", 2, 2, 3],
        ["head-shot", 0, 1, 1],
    ]


def test_familiarity_counts_people(counted):
    assert familiarity(counted).participants.tolist() == [1, 0, 0, 2, 0]


def test_distributions_by_hand_and_both_ways(counted):
    table = distributions(counted).set_index(["framing", "technique", "opponent"])
    assert table.loc[("close-up", "none", "gol")].tolist() == [0, 0, 1, 0, 2, 3]
    assert table.loc[("close-up", "gol", "none")].tolist() == [2, 0, 1, 0, 0, 3]
    assert table.loc[("close-up", "none", "sep")].tolist() == [1, 0, 0, 1, 0, 2]
    assert len(table) == 6 + 2


def test_preferences_of_a_pair_turn_with_the_pair(counted):
    there, back = preferences(counted, ("none", "gol")), preferences(counted, ("gol", "none"))
    assert there["close-up"].tolist() == [2, 2, 0] and back["close-up"].tolist() == [-2, -2, 0]
    assert there["head-shot"].tolist() == [0, -1]
    assert list(preferences(counted, ("gol", "sep"))) == ["close-up"]


def test_the_trend_is_the_least_squares_line():
    # by hand: mean distance 2, mean total 190, slope (-1 * 50 + 1 * -60) / 2, residuals -5/3 10/3
    # -5/3 ... of 240 200 130
    line = trend(pd.DataFrame({"total": [240, 200, 130]}))
    assert (line.slope, line.intercept) == pytest.approx((-55.0, 300.0))
    assert line.r2 == pytest.approx(1 - 150 / 6200)
    assert trend(pd.DataFrame({"total": [240, 200]})) is None
    assert isinstance(line, Trend) and np.isnan(trend(pd.DataFrame({"total": [3, 3, 3]})).r2)


def test_turning_the_sides_of_answers_changes_nothing_but_the_sides(write, random_study):
    rows = random_study(7, seed=1)
    turned = [
        [*row[:3], row[4], row[3], -row[5], *row[6:]] if place % 3 else row
        for place, row in enumerate(rows)
    ]
    techniques = sorted({row[3] for row in rows})
    before = read_responses(write(rows), order=techniques)
    after = read_responses(write(turned), order=techniques)
    for count in (scores, totals, distributions, familiarity):
        assert count(before).equals(count(after))
    assert sides(before)["none"].equals(sides(after)["none"]) and not sides(before).equals(
        sides(after)
    )


def test_new_names_permute_scores(write, random_study):
    rows = random_study(7, seed=2)
    names = dict(zip(sorted({row[3] for row in rows}), ["e", "d", "c", "b", "a"], strict=True))
    renamed = [[*row[:3], names[row[3]], names[row[4]], *row[5:]] for row in rows]
    before = scores(read_responses(write(rows), order=sorted(names)))
    after = (
        scores(read_responses(write(renamed), order=sorted(names.values())))
        .set_index(["framing", "technique"])
        .score
    )
    assert all(after[row.framing, names[row.technique]] == row.score for row in before.itertuples())


def test_points_are_all_given_to_someone(write, random_study):
    responses = read_responses(write(random_study(5, seed=3)))
    given = scores(responses).groupby("framing").score.sum()
    assert given.to_dict() == totals(responses).set_index("framing").total.to_dict()
    assert given.sum() == sum(abs(row[5]) for row in random_study(5, seed=3))
