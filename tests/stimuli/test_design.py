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
    for participant in range(1, 21):
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
    """Recorded from this implementation (PCG64 raw words, seed 1, lists 1 and 2): published lists
    must stay.
    """
    assert trials(("near", "far"), ("a", "b", "c"), 1, 1) == [
        Trial(1, "far", "c", "b"),
        Trial(2, "far", "a", "c"),
        Trial(3, "near", "c", "b"),
        Trial(4, "far", "b", "a"),
        Trial(5, "near", "a", "c"),
        Trial(6, "near", "b", "a"),
    ]
    assert trials(("near", "far"), ("a", "b", "c"), 1, 2, None, 4) == [
        Trial(1, "near", "a", "c"),
        Trial(2, "far", "a", "b"),
        Trial(3, "near", "c", "b"),
        Trial(4, "far", "c", "a"),
    ]


@pytest.mark.parametrize("count", [2, 3, 4, 5, 9])
@pytest.mark.parametrize("cells", [FRAMINGS[:n] for n in (1, 2, 3)])
@pytest.mark.parametrize("part", [1.0, 0.0, 0.34, 0.5, 0.9])
def test_any_first_lists_of_a_design_are_balanced(count, cells, part):
    """After every list, whatever the number of pairs in each: a pair is asked at most twice more
    than another, stood on each side as often to one, and after every second list exactly, with its
    mean place in the middle. Within each list cells are even to one, and each technique is left as
    often as right in each cell, to one.
    """
    items = [f"t{k}" for k in range(count)]
    every = [(cell, *pair) for cell in cells for pair in combinations(items, 2)]
    some = max(1, round(part * len(every)))
    asked, left, places = Counter(dict.fromkeys(every, 0)), Counter(), Counter()
    for number in range(1, 25):
        drawn = trials(cells, items, 11, number, None, 0 if part == 1 else some)
        assert len(drawn) == some
        here = Counter()
        for t in drawn:
            pair = (t.cell, *sorted((t.left, t.right)))
            here[pair] += 1
            left[pair] += 1 if t.left == pair[1] else -1
            places[pair] += 2 * t.order - (some + 1)
        asked += here
        assert max(here.values()) == 1
        counts = [asked[pair] for pair in every]
        assert max(counts) - min(counts) <= 2
        assert {*map(abs, left.values())} <= ({0} if number % 2 == 0 else {0, 1})
        assert number % 2 or not any(places.values())
        of_cells = Counter(t.cell for t in drawn)
        assert max(of_cells[c] for c in cells) - min(of_cells[c] for c in cells) <= 1
        sides = Counter()
        for t in drawn:
            sides[t.cell, t.left] += 1
            sides[t.cell, t.right] -= 1
        assert all(abs(side) <= 1 for side in sides.values())


def test_a_whole_deal_asks_every_pair_as_often():
    """45 of 135 pairs, 10 techniques at 3 framings: 3 couples of lists ask each pair twice."""
    items = [f"t{k}" for k in range(10)]
    asked = Counter()
    for number in range(1, 13):
        drawn = trials(FRAMINGS, items, 2, number, None, 45)
        of_items = Counter(name for t in drawn for name in (t.left, t.right))
        assert max(of_items.values()) - min(of_items.values()) <= 6  # 9 on average
        asked.update((t.cell, frozenset((t.left, t.right))) for t in drawn)
        assert number % 6 or {*asked.values()} == {number // 3}


def test_sides_are_fair_coins_over_couples_of_lists():
    """The first list of each couple: the first technique of a pair is left as often as a fair coin
    says (exact test, Bonferroni).
    """
    lists = range(1, 801, 2)
    left = Counter()
    for number in lists:
        for t in trials(FRAMINGS, TECHNIQUES, 20240601, number):
            pair = tuple(sorted((t.left, t.right), key=TECHNIQUES.index))
            left[t.cell, pair] += t.left == pair[0]
    assert len(left) == 30
    assert min(binomtest(count, len(lists)).pvalue for count in left.values()) > 0.001 / 30


def test_orders_are_uniform_over_participants():
    """Any one trial is equally likely at each of the 30 places (chi-squared)."""
    places = Counter()
    for number in range(1, 3001, 2):  # of a couple one is the other backwards
        drawn = trials(FRAMINGS, TECHNIQUES, 5, number)
        places[
            next(
                t.order
                for t in drawn
                if t.cell == "head-shot" and {t.left, t.right} == {"none", "golubev"}
            )
        ] += 1
    assert chisquare([places[order] for order in range(1, 31)]).pvalue > 0.001


def test_no_two_participants_share_a_list():
    lists = {tuple(trials(FRAMINGS, TECHNIQUES, 9, participant)) for participant in range(1, 501)}
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
    drawn = [t for p in range(1, 201) for t in trials(cells, items, 5, p, quality)]
    for cell, better in (("near", "a"), ("far", "b")):
        sides = Counter(t.left == better for t in drawn if t.kind == "trap" and t.cell == cell)
        assert sides == {True: 100, False: 100}  # in each couple of lists once on each side
    for p in range(1, 201):
        better = [t.left in "ab" for t in trials(cells, items, 5, p, quality) if t.kind == "trap"]
        assert sorted(better) == [False, True]  # of a list's two traps one on each side
    images = Counter((t.cell, t.left) for t in drawn if t.kind == "bias")
    assert len(images) == 8 and set(images.values()) == {50}  # each as often as the others
