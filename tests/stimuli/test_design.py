"""Who sees what: properties of the trials, over many seeds and participants."""

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import binomtest, chisquare

from stimuli.asking import Quality, Trap
from stimuli.design import Trial, trials

FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")


@pytest.mark.parametrize("framings", [FRAMINGS[:n] for n in (1, 2, 3)])
@pytest.mark.parametrize("techniques", [TECHNIQUES[:n] for n in (2, 3, 5)])
def test_every_pair_once_within_each_framing(framings, techniques):
    expected = Counter(
        (framing, frozenset(pair)) for framing in framings for pair in combinations(techniques, 2)
    )
    for participant in range(20):
        drawn = trials(framings, techniques, 3, participant)
        assert Counter((t.cell, frozenset((t.left, t.right))) for t in drawn) == expected
        assert [t.order for t in drawn] == list(range(1, len(drawn) + 1))


def test_thesis_asks_thirty_questions():
    assert len(trials(FRAMINGS, TECHNIQUES, 0, 1)) == 30


def test_seed_and_participant_alone_decide():
    np.random.seed(1)
    first = trials(FRAMINGS, TECHNIQUES, 42, 7)
    np.random.seed(2)
    assert trials(list(FRAMINGS), list(TECHNIQUES), 42, 7) == first
    others = [
        trials(FRAMINGS, TECHNIQUES, 42, 8),
        trials(FRAMINGS, TECHNIQUES, 43, 7),
        trials(FRAMINGS, TECHNIQUES, 7, 42),
    ]
    assert first not in others


def test_trials_stay_the_same_over_versions():
    """Recorded from this implementation (PCG64 raw words, seed 1, participant 1): published lists
    must stay.
    """
    assert trials(("near", "far"), ("a", "b", "c"), 1, 1) == [
        Trial(1, "far", "b", "c"),
        Trial(2, "far", "a", "b"),
        Trial(3, "near", "b", "a"),
        Trial(4, "near", "c", "b"),
        Trial(5, "near", "a", "c"),
        Trial(6, "far", "c", "a"),
    ]


def test_sides_are_balanced_over_participants():
    """Per pair and framing, the first technique is left as often as a fair coin says (exact test,
    Bonferroni).
    """
    participants = 400
    left = Counter()
    for participant in range(participants):
        for t in trials(FRAMINGS, TECHNIQUES, 20240601, participant):
            pair = tuple(sorted((t.left, t.right), key=TECHNIQUES.index))
            left[t.cell, pair] += t.left == pair[0]
    assert len(left) == 30
    assert min(binomtest(count, participants).pvalue for count in left.values()) > 0.001 / 30


def test_orders_are_uniform_over_participants():
    """Any one trial is equally likely at each of the 30 places (chi-squared)."""
    places = Counter()
    for participant in range(3000):
        drawn = trials(FRAMINGS, TECHNIQUES, 5, participant)
        places[
            next(
                t.order
                for t in drawn
                if t.cell == "head-shot" and {t.left, t.right} == {"none", "golubev"}
            )
        ] += 1
    assert chisquare([places[order] for order in range(1, 31)]).pvalue > 0.001


def test_no_two_participants_share_a_list():
    lists = {tuple(trials(FRAMINGS, TECHNIQUES, 9, participant)) for participant in range(500)}
    assert len(lists) == 500


def test_what_tells_how_well_people_look_leaves_the_order_of_the_others():
    traps = (Trap("near", "a", "d"), Trap("far", "b", "c"))
    quality = Quality(practice=2, repeats=3, swapped=2, bias=2, traps=traps)
    cells, items = ("near", "far"), ("a", "b", "c", "d")
    for participant in range(1, 30):
        plain = trials(cells, items, 5, participant)
        found = trials(cells, items, 5, participant, quality)
        assert [t.order for t in found] == list(range(1, 12 + quality.questions + 1))
        assert Counter(t.kind for t in found) == {
            "main": 12,
            "practice": 2,
            "repeat": 3,
            "swapped": 2,
            "bias": 2,
            "trap": 2,
        }
        main = [t for t in found if t.kind == "main"]
        strip = lambda some: [(t.cell, t.left, t.right) for t in some]
        assert strip(main) == strip(plain)
        assert {t.kind for t in found[:2]} == {"practice"}
        for trial in found:
            if trial.kind in ("repeat", "swapped"):
                sides = (trial.left, trial.right)[:: 1 if trial.kind == "repeat" else -1]
                (first,) = (t for t in main if (t.cell, t.left, t.right) == (trial.cell, *sides))
                assert first.order < trial.order and main.index(first) < 6
            if trial.kind == "bias":
                assert trial.left == trial.right
            if trial.kind == "trap":
                sign = quality.expected("trap", trial.cell, trial.left, trial.right)
                better = trial.left if sign == -1 else trial.right
                assert better == {"near": "a", "far": "b"}[trial.cell]
    drawn = [t for p in range(200) for t in trials(cells, items, 5, p, quality)]
    lefts = Counter(t.left for t in drawn if t.kind == "trap" and t.cell == "near")
    assert 70 < lefts["a"] < 130  # either side
