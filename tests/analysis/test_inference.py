"""Tests on participants against scipy, statsmodels and full enumeration; equivalence, trend and
familiarity; what has no test.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.weightstats import DescrStatsW

from analysis import tallies
from analysis.inference import (
    PAIRS,
    equivalence,
    familiarity_interaction,
    holm,
    net_scores,
    pairs,
    sign_test,
    signed_rank,
    trend,
)
from analysis.options import Options
from analysis.panel import MISSING

FAST = Options(resamples=200)


@pytest.fixture(scope="module")
def three(crowd):
    """Three framings of one group of 20 people, preferences weaker with distance."""
    worth = np.array([-0.9, 0.0, 0.2, 0.8])
    return [
        crowd(20, worth * scale, seed=seed, framing=name, taste=0.3, cuts=(cut, 2 * cut))
        for seed, (name, scale, cut) in enumerate(
            (("close-up", 1.5, 0.6), ("head-shot", 1.0, 1.0), ("half-length", 0.3, 1.8))
        )
    ]


# --- the tests themselves
# -----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_signed_ranks_are_those_of_every_change_of_sign(seed):
    values = np.random.default_rng(seed).integers(-2, 3, 9)
    seen = values[values != 0]
    ranks = stats.rankdata(np.abs(seen))
    every = np.array([(np.array(plus) * ranks).sum() for plus in product((0, 1), repeat=len(seen))])
    at = ranks[seen > 0].sum()
    expected = min(1, 2 * min((every <= at + 1e-9).mean(), (every >= at - 1e-9).mean()))
    p, method, biserial = signed_rank(values)
    assert p == pytest.approx(expected) and method == "exact"
    assert biserial == pytest.approx((at - (ranks.sum() - at)) / ranks.sum())


def test_signed_ranks_without_ties_are_scipys_exact_test():
    values = np.random.default_rng(0).normal(0.3, 1, 25)
    assert signed_rank(values)[0] == pytest.approx(stats.wilcoxon(values, method="exact").pvalue)


def test_signed_ranks_of_many_are_scipys_normal_approximation():
    values = np.random.default_rng(1).integers(-2, 3, 200)
    expected = stats.wilcoxon(
        values, zero_method="wilcox", correction=False, method="asymptotic"
    ).pvalue
    p, method, _ = signed_rank(values)
    assert p == pytest.approx(expected, rel=1e-9) and method == "normal"


def test_exact_and_normal_nearly_meet():
    values = np.random.default_rng(2).choice([-2, -1, 1, 2], 51)
    assert signed_rank(values)[1] == "normal" and signed_rank(values[:50])[1] == "exact"
    normal = stats.wilcoxon(values[:50], correction=False, method="asymptotic").pvalue
    assert signed_rank(values[:50])[0] == pytest.approx(normal, abs=0.03)


@pytest.mark.parametrize("seed", range(6))
def test_signs_are_scipys_binomial_test(seed):
    values = np.random.default_rng(seed).integers(-1, 3, 15)
    up, down = (values > 0).sum(), (values < 0).sum()
    assert sign_test(values) == pytest.approx(stats.binomtest(int(up), int(up + down)).pvalue)


def test_wilcoxons_own_example():
    """Darwin's plants, Fisher 1935, "The Design of Experiments": 15 differences; two-sided p 0.0413
    by signed ranks, 0.0074 by signs.
    """
    darwin = [49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48]
    assert signed_rank(darwin)[0] == pytest.approx(0.0413, abs=5e-5)
    assert sign_test(darwin) == pytest.approx(0.0074, abs=5e-5)


def test_holm_is_that_of_statsmodels_and_passes_over_what_was_not_tested():
    p = np.random.default_rng(3).random(12) ** 3
    assert holm(p) == pytest.approx(multipletests(p, method="holm")[1])
    gaps = np.array([0.01, np.nan, 0.04, 0.03])
    assert holm(gaps) == pytest.approx([0.03, np.nan, 0.06, 0.06], nan_ok=True)


def test_equivalence_is_the_tost_of_statsmodels():
    values = np.random.default_rng(4).integers(-2, 3, 40)
    assert equivalence(values, 0.5) == pytest.approx(DescrStatsW(values).ttost_mean(-0.5, 0.5)[0])
    assert (
        np.isnan(equivalence(values, None))
        and np.isnan(equivalence(np.zeros(20), 0.5))
        and np.isnan(equivalence(values[:4], 0.5))
    )


def test_nothing_to_test():
    assert np.isnan(signed_rank([1, 2, 1, 1])[0]) and np.isnan(sign_test([1, 2, 1, 1]))
    assert signed_rank(np.zeros(8)) == (1.0, "exact", 0.0) and sign_test(np.zeros(8)) == 1.0
    assert np.isnan(signed_rank(np.zeros(3))[0])


def test_a_true_null_is_rejected_no_more_often_than_alpha():
    rng = np.random.default_rng(5)
    p = np.array([[signed_rank(x)[0], sign_test(x)] for x in rng.integers(-2, 3, (400, 20))])
    assert ((p < 0.05).mean(axis=0) < 0.075).all()  # 0.05 and 2.3 standard errors


# --- pairs
# -----------------------------------------------------------------------------


def test_pairs_by_hand(lines):
    responses = lines("a>>b", "a>b", "a>b", "a=b", "a<b", "a>>b")
    row = pairs(responses, FAST).iloc[0]
    assert list(pairs(responses, FAST).columns) == list(PAIRS)
    assert row[
        ["a", "b", "n", "strong_a", "slight_a", "none", "slight_b", "strong_b"]
    ].tolist() == ["a", "b", 6, 2, 2, 1, 1, 0]
    # ranks of 2 1 1 -1 2: 4.5 2 2 2 4.5; for b 2 of 15: sums of plus of at most 2 are 1 + 3 of 32
    assert row.wilcoxon_p == pytest.approx(2 * 4 / 32) and row.rank_biserial == pytest.approx(
        2 * 2 / 15 - 1
    )
    assert row.sign_p == pytest.approx(2 * (1 + 5) / 32) and row.holm_p == row.wilcoxon_p
    assert row.mean_preference == pytest.approx(-5 / 6) and row.low <= -5 / 6 <= row.high
    assert np.isnan(row.tost_p) and np.isnan(row.equivalent)
    assert row.jod < 0


def test_families(three, table):
    responses = table(*three)
    study, framing = (pairs(responses, replace(FAST, family=one)) for one in ("study", "framing"))
    assert len(study) == 4 * 6
    within = study.framing != "overall"
    assert study.holm_p[within].to_numpy() == pytest.approx(
        multipletests(study.wilcoxon_p[within], method="holm")[1]
    )
    for _, rows in framing.groupby("framing"):
        assert rows.holm_p.to_numpy() == pytest.approx(
            multipletests(rows.wilcoxon_p, method="holm")[1]
        )
    sign = pairs(responses, replace(FAST, test="sign"))
    assert sign.holm_p[within].to_numpy() == pytest.approx(
        multipletests(sign.sign_p[within], method="holm")[1]
    )


def test_overall_takes_the_mean_of_a_person_over_framings(three, table):
    result = pairs(table(*three, order="abcd"), FAST)
    overall = result[result.framing == "overall"].iloc[0]
    mine = np.mean([panel.preference[:, 0] for panel in three], axis=0)
    assert (
        overall.n == 20
        and overall[["strong_a", "slight_a", "none", "slight_b", "strong_b"]].sum() == 60
    )
    assert overall.mean_preference == pytest.approx(
        mine.mean()
    ) and overall.sign_p == pytest.approx(sign_test(mine))
    assert overall.dz == pytest.approx(mine.mean() / mine.std(ddof=1))


def test_equivalent_needs_test_and_interval_within_the_margin(crowd, table):
    panel = crowd(80, [0, 0, 2], seed=1)
    result = pairs(table(panel, order="abc"), replace(FAST, margin=0.5, margin_jod=0.7)).set_index(
        ["a", "b"]
    )
    assert result.equivalent.to_dict() == {("a", "b"): 1, ("a", "c"): 0, ("b", "c"): 0}
    same = result.loc[("a", "b")]
    assert same.tost_p < 0.05 and -0.5 < same.equivalence_low < same.equivalence_high < 0.5
    assert same.low < same.equivalence_low and same.equivalence_high < same.high  # 95 % about 90 %
    assert same.jod_equivalent == 1 and result.jod_equivalent[("a", "c")] == 0
    strict = (
        pairs(table(panel, order="abc"), replace(FAST, margin=0.01))
        .set_index(["a", "b"])
        .loc[("a", "b")]
    )
    assert strict.equivalent == 0 and np.isnan(strict.jod_equivalent)


def test_other_sides_orders_and_twice_the_people(three, table):
    close = three[0]
    options = replace(FAST, margin=0.5, resamples=400)
    one = pairs(table(close, order="abcd"), options)
    side = pairs(table(replace(close, first_left=~close.first_left), order="abcd"), options)
    assert side.equals(one)
    turned = (
        pairs(table(close, order="dcba"), options)
        .set_index(["b", "a"])
        .reindex(list(zip(one.a, one.b, strict=True)))
    )
    for column in ("wilcoxon_p", "sign_p", "holm_p", "tost_p"):
        assert turned[column].to_numpy() == pytest.approx(one[column].to_numpy())
    for column in ("mean_preference", "rank_biserial", "dz", "jod"):
        assert turned[column].to_numpy() == pytest.approx(-one[column].to_numpy())
    assert (
        turned.low.to_numpy() == pytest.approx(-one.high.to_numpy())
        and (turned.strong_a.to_numpy() == one.strong_b).all()
    )
    twice = replace(
        close.chosen(np.tile(np.arange(20), 2)),
        participants=np.array([f"P{k:04d}" for k in range(40)], object),
    )
    double = pairs(table(twice, order="abcd"), options)
    assert double.mean_preference.to_numpy() == pytest.approx(one.mean_preference.to_numpy())
    assert double.jod.to_numpy() == pytest.approx(one.jod.to_numpy())
    assert ((double.high - double.low) < 0.85 * (one.high - one.low)).all()


def test_few_people_and_missing_answers(crowd, table):
    result = pairs(table(crowd(4, [0, 1, 2], seed=1)), replace(FAST, margin=0.5))
    assert result[["wilcoxon_p", "sign_p", "holm_p", "tost_p", "low", "high"]].isna().all(axis=None)
    assert (result.equivalent == 0).all()
    assert result.mean_preference.notna().all() and any(
        "4 participants, no test" in note for note in result.attrs["notes"]
    )
    panel = crowd(20, [0, 1, 2], seed=1)
    holes = panel.preference.copy()
    holes[:16, 0] = MISSING
    holes[:, 1] = MISSING
    result = pairs(table(replace(panel, preference=holes), order="abc"), FAST)
    assert result[["a", "b", "n"]].to_numpy().tolist() == [["a", "b", 4], ["b", "c", 20]]
    assert np.isnan(result.wilcoxon_p[0]) and result.holm_p[1] == result.wilcoxon_p[1]


def test_all_alike_has_no_tost(lines):
    result = pairs(lines(*["a=b"] * 8), replace(FAST, margin=0.5)).iloc[0]
    assert (
        np.isnan(result.tost_p)
        and result.equivalent == 0
        and result.wilcoxon_p == 1
        and result.mean_preference == 0
    )


# --- trend and familiarity
# -----------------------------------------------------------------------------


def test_the_trend_has_the_slope_of_the_tallies_and_scipys_page(three, table):
    responses = table(*three)
    result = trend(responses, FAST).set_index("statistic")
    assert result.value["slope_total"] == pytest.approx(
        tallies.trend(tallies.totals(responses)).slope
    )
    strength = np.array([np.abs(panel.preference).mean(axis=1) for panel in three]).T
    slopes = [np.polyfit([1, 2, 3], one, 1)[0] for one in strength]
    assert result.value["slope_strength"] == pytest.approx(np.mean(slopes)) and result.p[
        "slope_strength"
    ] == pytest.approx(signed_rank(slopes)[0])
    assert result.value["page_l"] == pytest.approx(
        stats.page_trend_test(-strength, method="asymptotic").statistic
    )
    assert result.p["page_l"] < 1e-4 and result.high["slope_total"] < 0


def test_two_framings_have_no_trend(three, table):
    result = trend(table(*three[:2]), FAST)
    assert result.empty and "needs 3" in result.attrs["notes"][0]


def test_familiarity_that_changes_preference_is_found(crowd, table):
    panel = crowd(60, [0, 0, 0], seed=2)
    level = {name: 1 + k % 5 for k, name in enumerate(panel.participants)}
    moved = panel.preference.copy()
    for person, name in enumerate(panel.participants):
        moved[person, 0] = np.clip(3 - level[name], -2, 2)  # novices prefer b, experts a
    result = familiarity_interaction(
        table(replace(panel, preference=moved), familiarity=level, order="abc"),
        replace(FAST, resamples=999),
    )
    result = result.set_index("technique")
    assert (
        result.p[""] < 0.01
        and result.p["a"] < 0.01
        and result.p["b"] < 0.01
        and result.p["c"] > 0.01
    )
    assert result.spearman["a"] > 0.4 > -0.4 > result.spearman["b"] and result.low["a"] > 0
    net, asked = net_scores(replace(panel, preference=moved))
    x = np.array([level[name] for name in panel.participants])
    assert result.spearman["a"] == pytest.approx(
        stats.spearmanr(x, net[:, 0] / asked[:, 0]).statistic
    )
    assert result.slope["a"] == pytest.approx(stats.linregress(x, net[:, 0] / asked[:, 0]).slope)
    assert result.p["c"] == pytest.approx(stats.spearmanr(x, net[:, 2]).pvalue, abs=0.05)


def test_familiarity_says_what_it_could_not_have_found(three, table):
    responses = table(
        *three, familiarity={name: 1 + k % 5 for k, name in enumerate(three[0].participants)}
    )
    result = familiarity_interaction(responses, FAST)
    # n for a correlation of 0.6 with a power of 0.8: 19 by G*Power's tables for Pearson; Spearman
    # needs some 6 % more beyond 3
    assert result.detectable.between(0.58, 0.62).all() and (result.n == 20).all()
    assert any(
        "0.3 with familiarity is found with a probability of 0.2" in note
        for note in result.attrs["notes"]
    )


def test_familiarity_that_does_not_vary_says_nothing(three, table):
    result = familiarity_interaction(table(*three), FAST)
    assert result.empty and any(
        "all rated their familiarity 3" in note for note in result.attrs["notes"]
    )
    few = familiarity_interaction(table(three[0].chosen(np.arange(3))), FAST)
    assert few.empty and any(
        "3 participants rated themselves and judged every technique" in note
        for note in few.attrs["notes"]
    )
