"""Agreement against published examples, evalica and counting by hand; exclusions; what changes
nothing and what has no number.
"""

from dataclasses import replace
from itertools import combinations, product

import evalica
import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis import InputError, declared, inference, read_responses, responses_from_records
from analysis.agreement import (
    PARTICIPANTS,
    agreement,
    kendall_test,
    kendall_u,
    krippendorff_alpha,
    participants,
    sensitivity,
    side_balance,
    triads,
    zeta,
)
from analysis.compute import everything
from analysis.conclusions import conclude
from analysis.options import Exclusions, Options
from analysis.panel import MISSING, panels
from analysis.worth_figures import draw_triads

FAST = Options(resamples=200, models=("bradley_terry",))
#: Krippendorff 2011, "Computing Krippendorff's Alpha-Reliability", example C: 4 observers, 12
#: units, values 1 to 5.
OBSERVERS = (
    "1 2 3 3 2 1 4 1 2 . . . | 1 2 3 3 2 2 4 1 2 5 . 3 | "
    ". 3 3 3 2 3 4 2 2 5 1 . | 1 2 3 3 2 4 4 1 2 5 1 ."
)


def counted(ratings):
    """ratings (observers, units), NaN where missing -> (units, 5) counts of 1 to 5."""
    return np.stack([(ratings == value).sum(axis=0) for value in range(1, 6)], axis=1).astype(float)


def values(result, framing="close-up"):
    return result[result.framing == framing].set_index("statistic")


# --- alpha, u, triads
# -----------------------------------------------------------------------------


def test_alpha_of_krippendorffs_example():
    """He prints 0.815 for ordinal data."""
    ratings = np.array(
        [[float(cell.replace(".", "nan")) for cell in row.split()] for row in OBSERVERS.split("|")]
    )
    assert krippendorff_alpha(counted(ratings)) == pytest.approx(0.815, abs=5e-4)


@pytest.mark.parametrize("seed", range(5))
def test_alpha_is_that_of_evalica(seed):
    rng = np.random.default_rng(seed)
    ratings = np.clip(rng.integers(1, 6, 12) + rng.integers(-1, 2, (7, 12)), 1, 5).astype(float)
    ratings[rng.random(ratings.shape) < 0.2] = np.nan
    expected = evalica.alpha(pd.DataFrame(ratings), distance="ordinal").alpha
    assert krippendorff_alpha(counted(ratings)) == pytest.approx(expected, abs=1e-9)


def test_alpha_of_perfect_agreement_and_of_none():
    perfect = np.zeros((4, 5))
    perfect[range(4), [0, 1, 3, 4]] = 6
    assert krippendorff_alpha(perfect) == pytest.approx(1)
    assert np.isnan(krippendorff_alpha(np.tile([0, 0, 6, 0, 0], (4, 1)).astype(float)))
    noise = np.random.default_rng(0).multinomial(100, np.full(5, 0.2), 300).astype(float)
    assert krippendorff_alpha(noise) == pytest.approx(0, abs=0.005)


def split(target, pairs, m):
    """How often each of `pairs` pairs prefers the first of m (odd) times, so that the agreements
    add up to target.

    With (m - 1)/2 - k against (m + 1)/2 + k a pair has its fewest agreements and k (k + 1) more.
    """
    fewest, more = ((m - 1) // 2) ** 2, []
    for _ in range(pairs):
        left = target - pairs * fewest - sum(k * (k + 1) for k in more)
        more.append(max(k for k in range((m + 1) // 2) if k * (k + 1) <= left))
    assert pairs * fewest + sum(k * (k + 1) for k in more) == target
    return (m - 1) // 2 - np.array(more)


def test_kendalls_u_of_the_school_subjects():
    """Kendall and Babington Smith 1940: 25 girls, 11 subjects. R's eba prints u 0.08218 and, taking
    1 from the agreements before, chi-square 180.12 with 62.38 degrees of freedom; those belong to
    8928 agreements.
    """
    first = split(8928, 55, 25)
    counts = np.zeros((55, 5))
    counts[:, 1], counts[:, 3] = first, 25 - first
    assert kendall_u(counts) == pytest.approx(0.08218, abs=5e-6)
    chi2, df, p = kendall_test(counts, 11)
    assert df == pytest.approx(62.38, abs=0.005) and chi2 - 4 / (25 - 2) == pytest.approx(
        180.12, abs=0.005
    )
    assert p == pytest.approx(stats.chi2.sf(chi2, df)) and p < 1e-12


@pytest.mark.parametrize(("m", "least"), [(4, -1 / 3), (5, -1 / 5), (20, -1 / 19), (21, -1 / 21)])
def test_u_runs_from_its_published_minimum_to_1(m, least):
    """Kendall and Babington Smith: -1/(m - 1) for even m, -1/m for odd."""
    apart, together = np.zeros((2, 6, 5))
    apart[:, 0], apart[:, 4] = m // 2, m - m // 2
    together[:, 3] = m
    assert kendall_u(apart) == pytest.approx(least) and kendall_u(together) == 1


@pytest.mark.parametrize("seed", range(4))
def test_u_counts_the_people_who_agree(seed, crowd):
    panel = crowd(9, [0, 0.5, 1, 1.2], seed=seed, cuts=(0, 1))
    sign = np.sign(panel.preference)
    alike = np.mean([(sign[p] == sign[q]).mean() for p, q in combinations(range(9), 2)])
    assert kendall_u(panel.counts) == pytest.approx(2 * alike - 1)


def test_coins_are_those_of_every_throw(crowd, table):
    """The exact null of 3 people and 3 pairs: all agree on all pairs with a chance of 1/64, on two
    of three with 9/64.
    """
    options = replace(FAST, resamples=20_000)
    for flips, chance in ((0, 1 / 64), (1, 10 / 64)):
        panel = crowd(3, [0, 0, 0], seed=1)
        preference = np.ones((3, 3), np.int8)
        preference[0, :flips] = -1
        result = values(agreement(table(replace(panel, preference=preference)), options))
        assert result.p["kendall_u_conditional"] == pytest.approx(chance, abs=0.01)


def brute_force(sign, n):
    """Circles counted from the wins of each item: Kendall's n (n - 1) (2n - 1)/12 - sum a^2/2,
    without ties.
    """
    wins = np.zeros(n)
    for (i, j), value in zip(combinations(range(n), 2), sign, strict=True):
        wins[i if value < 0 else j] += 1
    return n * (n - 1) * (2 * n - 1) / 12 - (wins**2).sum() / 2


@pytest.mark.parametrize("n", [3, 4, 5, 6, 9])
def test_circles_are_those_of_kendalls_formula(n, crowd):
    panel = crowd(40, np.zeros(n), seed=n, cuts=(0, 1))
    circular, decided, guessed = triads(panel)
    assert circular == pytest.approx([brute_force(one, n) for one in panel.preference])
    assert (decided == len(list(combinations(range(n), 3)))).all() and guessed == pytest.approx(
        circular
    )
    assert zeta(circular, n).min() >= 0 and zeta(0, n) == 1


def test_zeta_of_kendalls_dog():
    """Kendall and Babington Smith 1940: six foods, 3 circles of at most 8: zeta 0.625."""
    assert zeta(3, 6) == pytest.approx(0.625) and zeta(5, 5) == 0 and zeta(1, 3) == 0


def test_ties_make_no_circle_but_half_a_guess(lines):
    responses = lines("a>b b>c c>a", "a>b b>c c=a", "a>b a>c b=c", "a=b b=c a=c", "a=b b=c a>c")
    (panel,) = panels(responses).values()
    circular, decided, guessed = triads(panel)
    assert circular.tolist() == [1, 0, 0, 0, 0] and decided.tolist() == [1, 0, 0, 0, 0]
    for person, row in enumerate(panel.preference):
        free = [k for k in range(3) if row[k] == 0]
        settled = []
        for coins in product((-1, 1), repeat=len(free)):
            filled = np.sign(row).astype(int)
            filled[free] = coins
            settled.append(brute_force(filled, 3))
        assert guessed[person] == pytest.approx(np.mean(settled))


def test_fewer_circles_than_guessing_has_the_moments_of_moran(crowd):
    panel = crowd(4000, np.zeros(5), seed=1, cuts=(0, 1))
    circular, decided, _ = triads(panel)
    assert circular.mean() == pytest.approx(decided.mean() / 4, abs=0.06)
    assert circular.var() == pytest.approx(3 / 16 * decided.mean(), rel=0.08)


# --- the table
# -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study(crowd):
    return [
        crowd(20, [-0.8, 0, 0.3, 0.8], seed=seed, framing=name, side=0.9)
        for seed, name in enumerate(("close-up", "head-shot"))
    ]


def test_agreement_has_its_columns_and_every_statistic_for_every_framing(study, table):
    result = agreement(table(*study), replace(FAST, models=("ordinal",)))
    assert list(result.columns) == ["framing", "statistic", "value", "low", "high", "p"]
    names = result.groupby("framing").statistic.apply(set)
    assert (
        names["close-up"]
        == names["head-shot"]
        == names["overall"] | {"pooled_circular_triads", "pooled_zeta"}
    )
    inside = result.dropna(subset=["low"])
    assert len(inside) > 20 and ((inside.low <= inside.value) & (inside.value <= inside.high)).all()
    assert result.p.dropna().between(0, 1).all()


def test_sides_of_people_who_lean(study, table):
    result = values(agreement(table(*study), replace(FAST, models=("ordinal",))), "overall")
    responses = table(*study).frame
    decided = responses.answer[responses.answer != 0]
    assert (
        result.value["left_share"] == pytest.approx((decided < 0).mean())
        and result.p["left_share"] < 0.05
    )
    assert result.value["mean_answer"] == pytest.approx(responses.answer.mean())
    assert (
        result.value["side_effect"] == pytest.approx(0.9, abs=0.4)
        and result.p["side_effect"] < 0.05
    )


def test_times_are_medians_of_medians(study, table):
    responses = table(*study)
    result = values(agreement(responses, FAST), "overall").value
    frame = responses.frame
    assert (
        result["median_rt_ms"]
        == frame.groupby("participant", observed=True).rt_ms.median().median()
    )
    none = frame[frame.strength == 0].groupby("participant", observed=True).rt_ms.median().median()
    assert result["median_rt_ms_none"] == none


def test_other_sides_orders_and_twice_the_people(study, table):
    close = study[0]
    kept = [
        "circular_triads",
        "zeta",
        "zeta_guessed",
        "pooled_zeta",
        "kendall_u",
        "krippendorff_alpha_both_ways",
    ]
    one = values(agreement(table(close, order="abcd"), FAST))
    side = values(
        agreement(table(replace(close, first_left=~close.first_left), order="abcd"), FAST)
    )
    assert side.loc[[*kept, "krippendorff_alpha"], "value"].equals(
        one.loc[[*kept, "krippendorff_alpha"], "value"]
    )
    assert side.value["mean_answer"] == pytest.approx(-one.value["mean_answer"])
    other = values(agreement(table(close, order="cadb"), FAST))
    assert other.value[kept].to_numpy() == pytest.approx(one.value[kept].to_numpy())
    assert other.value["krippendorff_alpha"] != pytest.approx(
        one.value["krippendorff_alpha"], abs=1e-6
    )
    twice = replace(
        close.chosen(np.tile(np.arange(20), 2)),
        participants=np.array([f"P{k:04d}" for k in range(40)], object),
    )
    double = values(agreement(table(twice, order="abcd"), FAST))
    for name in ("circular_triads", "zeta"):
        assert double.value[name] == pytest.approx(one.value[name])
        assert double.high[name] - double.low[name] < 0.85 * (one.high[name] - one.low[name])


def test_u_and_alpha_hold_their_truth_as_often_as_claimed(crowd):
    """The truth from 20,000 people; of 100 studies of 25 people 95 % intervals hold it in 88 or
    more (binomial: fewer 1 %).
    """
    from analysis.agreement import _concordance

    worth, hits = [-0.8, 0, 0.3, 0.8], np.zeros(2)
    truth = crowd(20_000, worth, seed=99)
    truth = np.array([kendall_u(truth.counts), krippendorff_alpha(truth.counts)])
    for seed in range(100):
        rows = _concordance(
            "close-up", crowd(25, worth, seed=seed), replace(FAST, resamples=100), []
        )
        low, high = (np.array([rows[0][at], rows[2][at]]) for at in (2, 3))
        hits += (low <= truth) & (truth <= high)
    assert (hits >= 88).all()


def test_questions_asked_again(write):
    """P1 is asked twice three times: same, opposite, same direction but stronger; P2 once, without
    a preference then.
    """
    rows = [
        f"{person},3,close-up,{left},{right},{value},{order},1500,2024-05-01T09:00:00Z"
        for person, left, right, value, order in (
            ("P1", "a", "b", 1, 1),
            ("P1", "b", "c", 1, 2),
            ("P1", "a", "c", -1, 3),
            ("P1", "b", "a", -1, 4),
            ("P1", "b", "c", -1, 5),
            ("P1", "a", "c", -2, 6),
            ("P2", "a", "b", 1, 1),
            ("P2", "a", "b", 0, 2),
            ("P2", "a", "c", 1, 3),
            ("P2", "a", "c", 1, 3),
        )
    ]
    responses = read_responses(write(rows), order="abc")
    assert len(responses.frame) == 5 and len(responses.findings) == 5
    assert responses.repeats[["preference", "first_preference"]].to_numpy().tolist() == [
        [1, 1],
        [-1, 1],
        [-2, -1],
        [0, 1],
    ]
    result = values(agreement(responses, FAST)).value
    assert result["repeat_share"] == pytest.approx(2 / 3) and result[
        "repeat_same_answer"
    ] == pytest.approx(1 / 4)
    people = participants(responses, FAST).set_index("participant")
    assert people.repeats.to_dict() == {"P1": 3, "P2": 1} and people.repeat_share[
        "P1"
    ] == pytest.approx(2 / 3)
    assert np.isnan(people.repeat_share["P2"])


def test_nothing_asked_again_and_one_participant_are_said(lines):
    result = agreement(lines("a>b b>c a>c"), FAST)
    notes = " ".join(result.attrs["notes"])
    assert "no question was asked again" in notes and "one participant: no agreement" in notes
    assert (
        values(result)
        .loc[["kendall_u", "krippendorff_alpha", "repeat_share"], "value"]
        .isna()
        .all()
    )
    assert values(result).value["zeta"] == 1 and result[["low", "high"]].isna().all(axis=None)


def test_two_techniques_and_incomplete_answers_have_no_circles(lines):
    assert any(
        "fewer than three techniques" in note
        for note in agreement(lines(*["a>b"] * 6), FAST).attrs["notes"]
    )
    result = agreement(lines(*["a>b b>c"] * 6), FAST)
    assert any("nobody answered every pair" in note for note in result.attrs["notes"])
    assert np.isnan(values(result).value["zeta"]) and np.isnan(values(result).value["pooled_zeta"])


# --- participants and exclusions
# -----------------------------------------------------------------------------


def test_participants_by_hand(lines):
    result = participants(lines("a>b b>>c a=c", "a>b b>c a>c", "a<b b<c a<c"), FAST)
    assert list(result.columns) == list(PARTICIPANTS)
    first = result.iloc[0]
    assert first[
        ["answers", "left", "none", "right", "circular_triads", "zeta", "repeats"]
    ].tolist() == [3, 2, 1, 0, 0, 1, 0]
    assert (
        first.side_p == pytest.approx(0.5)
        and first.same_answer_share == pytest.approx(1 / 3)
        and first.median_rt_ms == 1500
    )
    # the others cancel out in all three pairs
    assert np.isnan(first.agreement_with_others)
    assert result.agreement_with_others[2] == pytest.approx(-(2 + 3 + 1) / np.sqrt(3 * (4 + 9 + 1)))


def faulty(study, table):
    """20 people; P0000 always goes left, P0001 always says 'no difference', P0002 stops after two
    answers.
    """
    spoilt = []
    for panel in study:
        preference = panel.preference.copy()
        preference[0] = np.where(panel.first_left[0], -1, 1)
        preference[1] = 0
        preference[2, 1:] = MISSING
        spoilt.append(replace(panel, preference=preference))
    return table(*spoilt, order="abcd")


def test_declared_exclusions_name_their_rule(study, table):
    result = participants(faulty(study, table), FAST).set_index("participant").excluded
    assert (
        result["P0000"] == "one_side_share; same_answer_share"
        and result["P0001"] == "same_answer_share"
        and result["P0002"] == "answered_share"
    )
    assert (result.iloc[3:] == "").all()
    none = Exclusions(
        answered_share=None, one_side_share=None, median_rt_ms=None, same_answer_share=None
    )
    assert (participants(faulty(study, table), replace(FAST, exclusions=none)).excluded == "").all()
    slow = participants(
        faulty(study, table), replace(FAST, exclusions=replace(none, median_rt_ms=1e7))
    )
    enough = slow.answers >= 5
    assert (slow.excluded == np.where(enough, "median_rt_ms", "")).all() and not enough.all()


def test_a_rule_needs_enough_answers_to_fire(lines):
    """One pair, one answer each: the default rule of the same answer excluded everybody."""
    responses = lines("a>b", "a<b", "a=b", "a>b", "a>>b", "a<<b")
    result = participants(responses, Options())
    assert (result.same_answer_share == 1).all() and (result.excluded == "").all()
    assert any("same_answer_share can fire for nobody" in one for one in result.attrs["notes"])
    ten = lines(*["a=b a=c a=d a=e b=c b=d b=e c=d c=e d=e"] * 6)
    assert (participants(ten, Options()).excluded == "same_answer_share").all()


def test_declared_rules_are_told_from_defaults(lines):
    chosen = declared.options({"exclusions": {"zeta": 0.2, "one_side_share": False}})
    (note, *_) = participants(lines("a>b", "a<b"), chosen).attrs["notes"]
    assert "zeta under 0.2 (declared by the study)" in note and "one side" not in note
    assert "median answer under 500 ms" in note.split("declared by the study")[1]
    assert "(defaults of subdermal, not declared)" in note


def test_sensitivity_takes_the_reports_verdicts(study, table):
    """Each conclusion with everyone is the verdict that the table of pairs comes to."""
    options = replace(FAST, margin=0.9)
    responses = faulty(study, table)
    result = sensitivity(responses, options).set_index(["framing", "conclusion", "a", "b"])
    rows = inference.pairs(responses, options)
    verdicts = [inference.verdict(row, 0.05) for row in rows.itertuples()]
    unadjusted = rows.equivalent == 1
    assert sum(one in ("equivalent", "both") for one in verdicts) < unadjusted.sum()
    for row, one in zip(rows.itertuples(), verdicts, strict=True):
        equal = result.everyone[row.framing, "equivalent", row.a, row.b]
        assert equal == str(int(one in ("equivalent", "both")))


def test_sides_that_follow_the_technique_are_named(write, answer):
    rng = np.random.default_rng(0)
    fixed, shuffled = [], []
    for person in range(12):
        for a, b in ("ab", "ac", "bc"):
            value = int(rng.integers(-2, 3))
            turn = rng.random() < 0.5
            fixed.append(answer(f"P{person}", "close-up", a, b, value))
            shuffled.append(answer(f"P{person}", "close-up", *((b, a) if turn else (a, b)), value))
    result = side_balance(read_responses(write(fixed)), FAST).set_index("technique")
    assert result.left.tolist() == [24, 12, 0] and result.holm_p["a"] < 1e-5
    assert "a was always on the left; c was always on the right" in result.attrs["notes"][0]
    fine = side_balance(read_responses(write(shuffled)), FAST)
    assert (fine.holm_p > 0.05).all() and not fine.attrs["notes"]
    assert (fine.left + fine.right).tolist() == [24, 24, 24]
    responses, options = read_responses(write(fixed)), Options(resamples=100)
    results = everything(responses, options)
    words = conclude(results.tables, results.notes, responses.codebook, options, 12, False)
    assert not any("shuffled against that" in one for one in words.can)
    refused = [one for one in words.cannot if "no worths by the ordinal model" in one]
    assert "side is confounded with technique" in refused[0]


def test_sensitivity_compares_with_and_without(study, table):
    responses = faulty(study, table)
    result = sensitivity(responses, FAST)
    assert list(result.columns) == [
        "framing",
        "conclusion",
        "a",
        "b",
        "everyone",
        "without_excluded",
        "changed",
    ]
    assert result.attrs["notes"][0].startswith("3 of 20 participants are excluded")
    assert set(result.conclusion) == {"preferred", "first"} and len(result) == 3 * (6 + 1)
    assert (
        result.changed == (result.everyone != result.without_excluded)
    ).all() and responses.participants == 20
    alone = table(*(panel.chosen(np.arange(3, 20)) for panel in study), order="abcd")
    clean = sensitivity(alone, FAST)
    assert (
        clean.everyone.to_numpy() == result.without_excluded.to_numpy()
    ).all() and not clean.changed.any()
    everyone = sensitivity(responses, replace(FAST, exclusions=Exclusions(0.99, median_rt_ms=1e9)))
    assert everyone.empty and "nobody is left" in everyone.attrs["notes"][1]
    margin = sensitivity(responses, replace(FAST, margin=0.5))
    assert set(margin.conclusion) == {"preferred", "equivalent", "first"}


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"resamples": 10}, "resamples is 10"),
        ({"seed": -1}, "seed is -1"),
        ({"level": 1.0}, "level is 1.0"),
        ({"margin": 0.0}, "margin is 0.0"),
        ({"margin_jod": float("nan")}, "margin_jod is nan"),
        ({"test": "t"}, "test is 't'"),
        ({"family": "all"}, "family is 'all'"),
        ({"ties": "win"}, "ties is 'win'"),
        ({"models": ("elo",)}, "unknown elo"),
    ],
)
def test_choices_are_checked(wrong, words):
    with pytest.raises(InputError, match=words) as error:
        Options(**wrong)
    assert "\n" not in str(error.value) and "expected" in str(error.value)
    with pytest.raises(InputError, match="exclusions.zeta"):
        Exclusions(zeta=2)


def alike(answer):
    """Six people who give one and the same answer to every pair."""
    return responses_from_records(
        {"participant": f"P{k}", "framing": "f", "left": a, "right": b, "answer": answer}
        for k in range(6)
        for a, b in combinations("abc", 2)
    )


def test_ties_alone_make_nobody_consistent():
    """No triad without a tie: zeta has no number, rather than the 1 of a person without circles."""
    responses = alike(0)
    result = values(agreement(responses, FAST), "f").value
    assert result[["circular_triads", "zeta", "pooled_zeta"]].isna().all()
    assert result["zeta_guessed"] == pytest.approx(0.75 * 1 + 0.25 * 0)
    assert participants(responses, FAST).zeta.isna().all()
    assert participants(alike(1), FAST).zeta.eq(1).all()


def test_two_techniques_have_no_tastes_no_circles_and_nothing_to_contradict():
    """One answer a person: the model has no tastes, so that none of 0.00 is reported."""
    given = (1, 1, -1, 0, 2, 1, -1, 0, 1)
    responses = responses_from_records(
        {"participant": f"P{k}", "framing": "f", "left": "ab"[k % 2], "right": "ba"[k % 2]}
        | {"answer": answer}
        for k, answer in enumerate(given)
    )
    results = everything(responses, replace(FAST, models=("bradley_terry", "ordinal")))
    models = results.tables["worth_models"].set_index("parameter").estimate
    assert np.isnan(models["sd_preference"]) and np.isnan(models["sd_side"])
    words = conclude(results.tables, results.notes, responses.codebook, FAST, 9, False)
    assert not any("tastes" in one for one in words.can)
    assert draw_triads(results.tables["participants"]) is None


def test_lists_of_a_part_of_the_questions_exclude_nobody(lines):
    """Where everybody is given a third of the pairs, nobody answers half of the questions: the
    longest list is what there was to do, and who leaves it early is excluded as before.
    """
    pairs = [f"{a}{sign}{b}" for (a, b), sign in zip(combinations("abcdef", 2), "><=" * 5)]
    people = [" ".join(pairs[(k + 3 * j) % 15] for j in range(5)) for k in range(9)]
    result = participants(lines(*people, " ".join(pairs[:2])), FAST)
    assert list(result.excluded) == [""] * 9 + ["answered_share"]
