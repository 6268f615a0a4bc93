"""Adaptive pairs: what they are expected to tell, and the bounds within which they are chosen."""

import json
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

from analysis.adaptive import PRIOR, chosen, information, most_telling, nothing, posterior, written
from analysis.planning import Plan
from analysis.planning.simulation import chosen as planned
from stimuli.asking import ADAPTIVE, Assignment, Quality, Trap
from stimuli.design import adaptive_trials

CELLS, ITEMS = ("near", "far"), ("a", "b", "c", "d", "e")
PLACE = {pair: k for k, pair in enumerate(combinations(ITEMS, 2))}


def taken_part(state, trials, worth, rng):
    """The state after somebody answered by Bradley and Terry's model."""
    after = json.loads(json.dumps(state))
    for trial in trials:
        if trial.kind != "main":
            continue
        first = (trial.left, trial.right) in PLACE
        pair = (trial.left, trial.right) if first else (trial.right, trial.left)
        row = after[trial.cell][PLACE[pair]]
        row[0 if first else 1] += 1
        d = worth[ITEMS.index(pair[0])] - worth[ITEMS.index(pair[1])]
        row[2 if rng.random() < 1 / (1 + np.exp(-d)) else 3] += 1
    return after


def test_the_posterior_is_the_mode_and_its_curvature():
    """Of two items by a grid; and of a thousand answers it is the logarithm of the odds."""
    rows = [[2, 2, 3, 0, 1]]  # 3.5 wins against 0.5
    worth, covariance = posterior(rows, 2)
    d = np.linspace(-6, 6, 200_001)
    # two worths of variance PRIOR^2 are as far apart as sqrt(2) PRIOR
    log = -3.5 * np.log1p(np.exp(-d)) - 0.5 * np.log1p(np.exp(d)) - d**2 / (4 * PRIOR**2)
    assert worth[0] - worth[1] == pytest.approx(d[log.argmax()], abs=1e-4)
    variance = covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]
    at = log.argmax()
    curvature = -(log[at + 100] - 2 * log[at] + log[at - 100]) / (d[100] - d[0]) ** 2
    assert variance == pytest.approx(1 / curvature, rel=1e-3)
    worth, _ = posterior([[0, 0, 75_000, 25_000, 0]], 2)
    assert worth[0] - worth[1] == pytest.approx(np.log(3), abs=1e-3)


def test_information_is_that_of_an_integral_and_of_a_sure_thing_none():
    mean, variance = np.array([0.0, 0.7, 0.0, 12.0]), np.array([1.0, 2.5, 1e-12, 0.1])
    d = np.linspace(-15, 15, 40_001)
    for got, m, v in zip(information(mean, variance)[:2], mean, variance):
        density = np.exp(-((d - m) ** 2) / (2 * v)) / np.sqrt(2 * np.pi * v)
        p = 1 / (1 + np.exp(-d))
        entropy = lambda q: -q * np.log(q) - (1 - q) * np.log(1 - q)
        expected = entropy(np.trapezoid(p * density, d)) - np.trapezoid(entropy(p) * density, d)
        assert got == pytest.approx(expected, abs=1e-5)
    assert np.abs(information(mean, variance)[2:]).max() < 1e-4  # known already; foreseen


def test_lists_keep_the_bounds_and_are_drawn_again_from_what_they_were_chosen_from():
    """60 people, worths far apart: no pair twice a person, cells even to one, each pair on each
    side as often to one, none left behind, and near pairs more often than far ones.
    """
    quality = Quality(repeats=1, bias=1, traps=(Trap("near", "a", "e"),))
    assignment = Assignment(7, ADAPTIVE, least_share=0.5)
    worth, rng = np.array([2.0, 1.9, 0.0, -1.9, -2.0]), np.random.default_rng(1)
    state, firsts = nothing(CELLS, ITEMS), set()
    for number in range(1, 61):
        trials = adaptive_trials(CELLS, ITEMS, 9, number, quality, assignment, state)
        again = adaptive_trials(
            CELLS, ITEMS, 9, number, quality, assignment, json.loads(written(state))
        )
        assert trials == again
        main = [t for t in trials if t.kind == "main"]
        kinds = Counter(t.kind for t in trials)
        assert kinds == {"main": 7, "repeat": 1, "bias": 1, "trap": 1}
        assert len({(t.cell, frozenset((t.left, t.right))) for t in main}) == 7
        assert sorted(Counter(t.cell for t in main).values()) == [3, 4]
        firsts.add((main[0].cell, main[0].left, main[0].right))
        state = taken_part(state, trials, worth, rng)
        for cell in CELLS:
            rows = np.array(state[cell])
            assert np.abs(rows[:, 0] - rows[:, 1]).max() <= 1
            counts = rows[:, :2].sum(axis=1)
            assert counts.min() >= np.floor(0.5 * counts.mean()) - 1
    totals = [np.array(state[cell])[:, :2].sum() for cell in CELLS]
    assert abs(totals[0] - totals[1]) <= 1 and len(firsts) > 10
    for cell in CELLS:
        near, other, far = (sum(state[cell][PLACE[tuple(pair)]][:2]) for pair in ("ab", "de", "ae"))
        assert min(near, other) > 1.5 * far
        sides = Counter()
        for (a, b), row in zip(PLACE, state[cell]):
            sides[a] += row[0] - row[1]
            sides[b] += row[1] - row[0]
        assert max(map(abs, sides.values())) <= 4  # every technique as often on each side


def test_the_share_of_the_mean_is_what_bounds_lopsided_counts():
    worth, shares = np.array([3.0, 2.9, 0.0, -2.9, -3.0]), {}
    for least in (0.0, 1.0):
        state, rng = nothing(CELLS, ITEMS), np.random.default_rng(2)
        for number in range(1, 41):
            assignment = Assignment(6, ADAPTIVE, least_share=least)
            trials = adaptive_trials(CELLS, ITEMS, 3, number, None, assignment, state)
            state = taken_part(state, trials, worth, rng)
        counts = np.array(state["near"])[:, :2].sum(axis=1)
        shares[least] = counts.min() / counts.max()
    assert shares[0.0] < 0.4 < 0.6 < shares[1.0]


def test_techniques_that_are_alike_are_asked_evenly():
    """The noise of few answers does not steer; always what tells most would let it."""
    spans = {}
    for as_good in (0.8, 1.0):
        state, rng = nothing(CELLS, ITEMS), np.random.default_rng(4)
        for number in range(1, 31):
            design = Assignment(8, ADAPTIVE, as_good=as_good)
            trials = adaptive_trials(CELLS, ITEMS, 5, number, None, design, state)
            state = taken_part(state, trials, np.zeros(5), rng)
        counts = np.array([state[cell] for cell in CELLS])[..., :2].sum(axis=2)
        spans[as_good] = np.ptp(counts, axis=1).max()
    assert spans[0.8] <= 2 < spans[1.0]


def test_many_studies_at_once_are_each_as_alone():
    rng = np.random.default_rng(6)
    rows = rng.integers(0, 9, (20, 10, 5))
    rows[:5, 3] = 0  # one that fell behind
    lots = rng.random((20, 10))
    places, means = most_telling(rows, 5, 6, 0.5, 0.8, lots)
    for some, lot, place, mean in zip(rows, lots, places, means):
        alone, own = most_telling(some, 5, 6, 0.5, 0.8, lot)
        assert alone.tolist() == place.tolist() and own == pytest.approx(mean, abs=1e-9)
        assert len(set(alone.tolist())) == 6
    assert (places[:5] == 3).any(axis=1).all()


@pytest.mark.parametrize(("least_share", "as_good"), [(0.5, 0.8), (0.9, 0.8), (0.0, 1.0)])
def test_power_simulates_the_rule_of_the_questionnaire(least_share, as_good):
    """Person after person the same pairs, from the same answers and the same lots."""
    plan = Plan(
        ITEMS,
        ("a", "b"),
        answers_each=4,
        most=25,
        studies=50,
        least_share=least_share,
        as_good=as_good,
    )
    answers = np.random.default_rng(3).integers(-2, 3, (1, plan.most, len(PLACE))).astype(np.int8)
    asked = planned(plan, answers, np.random.default_rng(4))[0]
    rng, state = np.random.default_rng(4), nothing(("near",), ITEMS)
    for mine, given in zip(asked, answers[0]):
        share = iter([0.0, *rng.random(len(PLACE)), *[0.5] * 100]).__next__
        pairs = chosen(state, ("near",), ITEMS, 4, least_share, as_good, share)
        places = [PLACE[min((a, b), (b, a))] for _, a, b in pairs]
        assert sorted(places) == np.flatnonzero(mine).tolist()
        for k in places:
            state["near"][k][0] += 1
            state["near"][k][2 if given[k] < 0 else 3 if given[k] > 0 else 4] += 1
