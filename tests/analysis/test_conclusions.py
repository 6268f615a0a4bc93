"""The sentences of the report, against hand-made tables: each number comes from its cell, and
nothing more is claimed.
"""

import numpy as np
import pandas as pd
import pytest

from analysis.codebook import Codebook
from analysis.conclusions import conclude
from analysis.inference import PAIRS, verdict
from analysis.options import Options

BOOK = Codebook(
    ("close-up",),
    ("a", "b", "c"),
    "",
    "",
    {("technique", "a"): "Ay", ("framing", "close-up"): "Close-up"},
)
EQUAL = {
    "equivalent": 1.0,
    "tost_p": 0.001,
    "tost_holm_p": 0.01,
    "equivalence_low": -0.1,
    "equivalence_high": 0.12,
}


def pair(a, b, **changes):
    row = dict.fromkeys(PAIRS, 0.0) | {
        "framing": "close-up",
        "a": a,
        "b": b,
        "n": 20,
        "mean_preference": 0.05,
    }
    row |= {
        "holm_p": 0.5,
        "tost_p": 0.4,
        "tost_holm_p": 0.9,
        "equivalent": 0.0,
        "jod_equivalent": np.nan,
    }
    return row | changes


def tables(*pairs, **changes):
    data = {
        "pairs": pd.DataFrame(pairs, columns=[*PAIRS]),
        "trend": pd.DataFrame([], columns=["statistic", "value", "low", "high", "p"]),
        "agreement": pd.DataFrame(
            [], columns=["framing", "statistic", "value", "low", "high", "p"]
        ),
        "familiarity_interaction": pd.DataFrame(
            [], columns=["framing", "technique", "slope", "holm_p", "detectable"]
        ),
        "participants": pd.DataFrame({"excluded": ["", ""]}),
        "side_balance": pd.DataFrame(
            [], columns=["framing", "technique", "left", "right", "left_share", "p", "holm_p"]
        ),
        "sensitivity": pd.DataFrame({"changed": [0, 0]}),
    }
    return data | changes


def sentences(data, options=None, notes=(), simulated=False, people=20):
    options = options or Options(margin=0.25)
    result = conclude(data, {"worths": tuple(notes)}, BOOK, options, people, simulated)
    return " | ".join(result.can), " | ".join(result.cannot)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"holm_p": 0.05}, "different"),
        ({"holm_p": 0.0501}, "undecided"),
        (EQUAL, "equivalent"),
        (EQUAL | {"tost_holm_p": 0.06}, "undecided"),
        (EQUAL | {"equivalent": 0.0}, "undecided"),
        (EQUAL | {"holm_p": 0.01}, "both"),
        ({"equivalent": np.nan, "jod_equivalent": 1.0}, "equivalent"),
        ({"equivalent": np.nan, "jod_equivalent": np.nan, "holm_p": np.nan}, "undecided"),
    ],
)
def test_what_a_pair_comes_to(changes, expected):
    row = next(pd.DataFrame([pair("a", "b", **changes)]).itertuples())
    assert verdict(row, 0.05) == expected


def test_differences_name_winner_loser_and_the_largest_p():
    can, cannot = sentences(
        tables(
            pair("a", "b", holm_p=0.031, mean_preference=-0.7),
            pair("a", "c", holm_p=0.0004, mean_preference=-0.9),
            pair("b", "c", mean_preference=0.3),
        )
    )
    assert (
        "Close-up: people preferred Ay over b and c (Wilcoxon's signed-rank test, p at most "
        "0.031 after Holm's correction; 2 of 3 pairs)."
    ) in can
    assert (
        "Close-up: 1 of 3 pairs is undecided: neither a difference nor equality is shown for "
        "b and c."
    ) in cannot
    assert "as good as each other" not in can


def test_pairs_that_all_answer_alike_are_not_called_undecided_without_a_reason():
    """12 of 12 see no difference: t tests need spread, and the report says so."""
    alike = {"mean_preference": 0.0, "tost_p": np.nan, "tost_holm_p": np.nan, "holm_p": 1.0}
    _, cannot = sentences(tables(pair("a", "b", **alike), pair("b", "c")))
    assert (
        "Close-up: everyone gave the same answer about Ay and b: answers without spread allow no "
        "test of equality."
    ) in cannot
    _, cannot = sentences(tables(pair("a", "b", **alike)), Options())
    assert "without spread" not in cannot  # no margin: no test of equality was asked for


def test_pairs_that_were_not_tested_are_in_no_sentence_about_undecided_ones():
    """An interval of three people's answers excludes 0: the pair was never tested."""
    untested = {"holm_p": np.nan, "n": 3, "low": 0.4, "high": 1.2, "equivalent": np.nan}
    _, cannot = sentences(tables(pair("a", "b", **untested), pair("b", "c", low=-0.2, high=0.4)))
    assert "too few people answered to test Ay and b" in cannot
    assert "of the undecided pairs" not in cannot


def test_many_undecided_pairs_are_counted_not_listed():
    names = [f"t{k}" for k in range(6)]
    rows = [pair(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
    _, cannot = sentences(tables(*rows, pair("a", "b", holm_p=0.01)))
    assert "15 of 16 pairs are undecided" in cannot
    assert "is shown for them; the table of every pair names them." in cannot
    assert "t0 and t1" not in cannot


def test_a_preference_for_the_second_turns_the_sentence():
    can, _ = sentences(
        tables(pair("a", "b", holm_p=0.0001, mean_preference=0.7)),
        Options(margin=0.25, test="sign"),
    )
    assert (
        "people preferred b over Ay (sign test, p < 0.001 after Holm's correction; the one pair)"
        in can
    )


def test_equality_is_claimed_after_correction_only_and_with_its_interval():
    can, _ = sentences(tables(pair("a", "b", **EQUAL)))
    assert (
        "Close-up: Ay and b are as good as each other within the declared margin of 0.25 "
        "points: the mean preference for b is +0.05, "
        "interval \N{MINUS SIGN}0.10 to +0.12 (two one-sided tests, p = 0.010 after Holm's "
        "correction)." in can
    )
    can, cannot = sentences(tables(pair("a", "b", **EQUAL | {"tost_holm_p": 0.3})))
    assert (
        "as good" not in can
        and "when taken alone (two one-sided tests, p = 0.001)" in cannot
        and "(p = 0.30)" in cannot
    )


def test_without_a_margin_nothing_is_equal_and_that_is_said():
    can, cannot = sentences(tables(pair("a", "b", equivalent=np.nan)), Options())
    assert "as good" not in can
    assert (
        "No margin of equivalence was declared" in cannot
        and "which does not make them equal" in cannot
    )


def test_too_few_people_are_not_called_undecided():
    _, cannot = sentences(tables(pair("a", "b", holm_p=np.nan), pair("a", "c", holm_p=np.nan)))
    assert "too few people answered to test any pair" in cannot and "undecided" not in cannot


@pytest.mark.parametrize(("p", "where"), [(0.01, 0), (0.2, 1), (np.nan, 1)])
def test_the_trend_is_concluded_with_its_p_only(p, where):
    trend = pd.DataFrame(
        [("slope_strength", -0.3, -0.4, -0.2, p)],
        columns=["statistic", "value", "low", "high", "p"],
    )
    both = sentences(tables(pair("a", "b"), trend=trend))
    words = "change by \N{MINUS SIGN}0.300 a framing"
    assert words in both[where] and words not in both[1 - where]
    assert ("get weaker" in both[0]) == (where == 0)


def test_familiarity_names_what_would_have_been_found():
    columns = ["framing", "technique", "slope", "holm_p", "detectable"]
    none = pd.DataFrame([("close-up", "a", 0.1, 0.9, 0.6)], columns=columns)
    _, cannot = sentences(tables(pair("a", "b"), familiarity_interaction=none))
    assert "only a correlation of 0.60 or more would be found four times in five" in cannot
    hit = pd.DataFrame([("close-up", "a", 0.1, 0.02, 0.6)], columns=columns)
    can, _ = sentences(tables(pair("a", "b"), familiarity_interaction=hit))
    assert "changes the preference for Ay at Close-up (+0.10 points a level, p = 0.020)" in can


@pytest.mark.parametrize(
    ("excluded", "changed", "where", "words"),
    [
        (["", ""], [0, 0], 0, "fire for none of 2 participants"),
        (
            ["x", ""],
            [0, 0],
            0,
            "Without the 1 participant whom the rules exclude, 0 of 2 conclusions would change",
        ),
        (["x", ""], [1, 0], 1, "1 of 2 conclusions would change; see the table"),
        (["x", "x"], [], 1, "those who are left are too few"),
    ],
)
def test_exclusions_say_what_hangs_on_them(excluded, changed, where, words):
    data = tables(
        pair("a", "b"),
        participants=pd.DataFrame({"excluded": excluded}),
        sensitivity=pd.DataFrame({"changed": np.array(changed, int)}),
    )
    assert words in sentences(data, people=2)[where]


def test_contrasts_that_differ_from_the_declared_test_are_all_named():
    """Every undecided pair whose contrast differs, also one that another sentence names already;
    and every pair that is found different where the contrast is not, or points the other way.
    """
    spread = {"simultaneous_low": 0.1, "simultaneous_high": 0.9}
    contrasts = pd.DataFrame(
        [("a", "b", 0.4, 0.001), ("a", "c", 0.4, 0.002), ("b", "c", 0.1, 0.4)],
        columns=["a", "b", "estimate", "holm_p"],
    ).assign(framing="close-up")
    data = tables(pair("a", "b", **spread), pair("a", "c"), pair("b", "c"), contrasts=contrasts)
    _, cannot = sentences(data)
    assert "an adjusted interval" in cannot and "excludes 0 for Ay and b, where" in cannot
    assert "differs from 0 after Holm's correction for Ay and b; Ay and c, where" in cannot
    different = {"holm_p": 0.01, "mean_preference": -0.4}
    rows = pair("a", "b", **different), pair("b", "c", **different)
    can, _ = sentences(tables(*rows, contrasts=contrasts))
    assert "for Ay and b; b and c the declared test finds a difference that the contrast" in can


def test_many_pairs_are_counted_and_not_listed():
    book = Codebook(("close-up",), tuple("abcdefghijkl"), "", "")
    meets = {"jod": 0.1, "jod_equivalent": 1.0, "jod_simultaneous_low": -1.0}
    lost = {"holm_p": 0.001, "mean_preference": -1.0, "jod_equivalent": 0.0}
    rows = [pair("a", other, **lost) for other in "bcdefghijk"]
    rows += [pair("l", other, **meets) for other in "bcdefghij"]
    options = Options(margin=0.25, margin_jod=0.5)
    data = conclude(tables(*rows), {}, book, options, 20, False)
    assert any("people preferred a over 10 others (" in one for one in data.can)
    (words,) = (one for one in data.cannot if "0.5 JOD" in one)
    assert "9 pairs of 19 meet" in words and "(tables/pairs.csv has them); adjusted" in words
    assert words.endswith("The declared tests in points call none of them equal, and they stand.")


def test_fits_that_do_not_exist_are_named_once_with_labels():
    notes = [
        f"close-up, {model}: no finite worths: a was never beaten by b"
        for model in ("bradley_terry", "thurstone_jod")
    ]
    _, cannot = sentences(
        tables(pair("a", "b")),
        notes=[*notes, "close-up, davidson: 3 resamples have no finite worths"],
    )
    assert (
        "Close-up: there are no worths by Bradley and Terry's model and Thurstone's case V: "
        "Ay was never beaten by b."
    ) in cannot
    assert "Davidson" not in cannot


def test_simulated_answers_say_nothing_of_people():
    can, cannot = sentences(
        tables(pair("a", "b", holm_p=0.001, mean_preference=-1)), simulated=True
    )
    assert (
        "simulated participants preferred" in can
        and "people" not in can
        and "since a program answered" in cannot
    )
