"""How many people: against closed forms, statsmodels, scipy and published numbers; seeds, designs,
and what must be refused.
"""

import math
import re

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.stats.power import TTestPower

from analysis import InputError, read_responses, responses_from_records
from analysis.compute import everything
from analysis.conclusions import conclude
from analysis.inference import pairs, verdict
from analysis.inference.people import sign_counts, signed_rank_counts
from analysis.options import Options
from analysis.planning import (
    SIGMA,
    Answering,
    Plan,
    Studies,
    closed_form,
    fit_pilot,
    people_grid,
    plan_table,
    sign_power,
    t_power,
    tost_power,
)
from analysis.planning.words import _adaptive
from app.cli import main

THESIS = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")
PAIR = ("golubev", "golubev_plus")


def run_of(plan, design="full", difference=None):
    """Simulated studies and all that their people would answer."""
    rng = np.random.default_rng(plan.seed)
    apart = plan.difference if difference is None else difference
    run = Studies(plan, design, lambda _framing: apart, rng)
    return run, run.answers


def table_of(run, study, people):
    """The first people of a simulated study as a table of answers, read as `analyse` reads it."""
    plan, records = run.plan, []
    for person in range(people):
        for f, framing in enumerate(plan.framings):
            for k, (a, b) in enumerate(plan.pairs):
                if not run.asked[study, person, f, k]:
                    continue
                answer, turn = int(run.answers[study, person, f, k]), (person + k) % 2
                left, right = (b, a) if turn else (a, b)
                records.append(
                    {
                        "participant": f"P{person:04d}",
                        "framing": framing,
                        "left": plan.techniques[left],
                        "right": plan.techniques[right],
                        "answer": -answer if turn else answer,
                    }
                )
    return responses_from_records(records, order=plan.techniques)


def plan(**changes):
    return Plan(
        **{"techniques": THESIS, "pair": PAIR, "studies": 400, "most": 120, "difference": 0.8}
        | changes
    )


@pytest.fixture(scope="module")
def simulated():
    """curves and needed of one plan, without taste, so that the closed forms hold."""
    options = Options(test="sign", margin=0.6, resamples=100)
    return plan_table(
        plan(answering=Answering(taste=0.0), studies=1500, options=options), ("full",)
    )


def test_one_jod_is_preferred_by_three_of_four():
    assert stats.norm.cdf(1 / SIGMA) == pytest.approx(0.75)
    shares = Answering(slight=0.0, clear=0.0).shares(1.0)
    assert shares[:2].sum() == pytest.approx(0.25) and shares[3:].sum() == pytest.approx(0.75)
    for taste in (0.0, 1.0):  # taste is a part of the spread, not added to it
        assert Answering(taste=taste).shares(1.0) == pytest.approx(Answering().shares(1.0))


@pytest.mark.parametrize("effect", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("people", [5, 20, 60])
def test_the_power_of_the_t_test_is_that_of_statsmodels(effect, people):
    assert t_power(effect, people, 0.05) == pytest.approx(
        TTestPower().power(effect, people, 0.05), abs=1e-8
    )


def test_the_classic_sample_sizes_come_out():
    """Cohen 1988, table 2.3.5 and G*Power: a one-sample t test finds d = 0.5 with power 0.8 from 34
    people on, d = 0.2 from 199 on.
    """
    for effect, people in ((0.5, 34), (0.2, 199)):
        assert t_power(effect, people) >= 0.8 > t_power(effect, people - 1)


def test_noethers_sample_size_of_the_sign_test():
    """Noether 1987, JASA 82(398), doi:10.1080/01621459.1987.10478478: N = (z_alpha + z_beta)^2/(4
    (p - 1/2)^2), 31.4 for p = 0.75.
    """
    noether = (stats.norm.ppf(0.975) + stats.norm.ppf(0.8)) ** 2 / (4 * 0.25**2)
    assert noether == pytest.approx(31.4, abs=0.05)
    powers = {people: sign_power(0.75, 0.25, people) for people in range(25, 45)}
    enough = min(
        people
        for people in powers
        if all(powers[more] >= 0.75 for more in powers if more >= people)
    )
    assert abs(enough - noether) < 6


def test_the_sign_tests_power_is_the_binomials():
    forced = plan(difference=1.0, answering=Answering(0.0, 1.8, 0.0), options=Options(test="sign"))
    counts = np.arange(21)
    rejected = np.array([stats.binomtest(int(count), 20).pvalue <= 0.05 for count in counts])
    assert closed_form(forced, "full", "find", "declared", "none", 20) == pytest.approx(
        stats.binom.pmf(counts, 20, 0.75)[rejected].sum()
    )


def test_equivalences_power_is_that_of_a_simulation_and_of_no_margin():
    rng = np.random.default_rng(1)
    for effect, margin, people in ((0.0, 0.5, 40), (0.2, 0.5, 60), (0.0, 0.3, 20)):
        draws = rng.normal(effect, 1, (20_000, people))
        mean, error = draws.mean(axis=1), draws.std(axis=1, ddof=1) / math.sqrt(people)
        rejected = (margin - np.abs(mean)) / error >= stats.t.ppf(0.95, people - 1)
        assert tost_power(effect, margin, people) == pytest.approx(rejected.mean(), abs=0.012)


def test_simulation_and_closed_form_agree(simulated):
    curves, _ = simulated
    known = curves[curves.closed_form.notna()]
    assert set(known.test) == {"declared"} and set(known.goal) == {"find", "exclude"}
    exact = known[known.goal == "find"]
    error = np.sqrt(np.maximum(exact.closed_form * (1 - exact.closed_form), 1e-4) / 1500)
    assert (np.abs(exact.power - exact.closed_form) / error).max() < 4
    # five answers are not normal: close from thirty people on
    close = known[(known.goal == "exclude") & (known.people >= 30)]
    assert len(close) and np.abs(close.power - close.closed_form).max() < 0.05


def test_false_alarms_are_at_most_as_many_as_alpha_allows(simulated):
    _, needed = simulated
    assert (needed.false_alarms < 0.05 + 4 * math.sqrt(0.05 * 0.95 / 1500)).all()
    contrast = needed[(needed.test == "contrast") & (needed.correction == "none")]
    assert (contrast.false_alarms > 0.02).all()


def test_needed_people_reach_the_power_and_fewer_do_not(simulated):
    curves, needed = simulated
    for row in needed[needed.people.notna()].itertuples():
        here = curves[
            (curves.goal == row.goal)
            & (curves.test == row.test)
            & (curves.correction == row.correction)
        ]
        assert row.power >= 0.8
        below = here[here.people < row.people]
        assert below.empty or below.power.iloc[-1] < 0.8


def test_sign_and_wilcoxon_p_are_scipys():
    rng = np.random.default_rng(3)
    for place in range(60):
        counts = rng.integers(0, 9 if place % 2 else 40, 5)
        answers = np.repeat(np.arange(-2, 3), counts)
        if not (answers != 0).any() or len(answers) < 5:
            continue
        up, down = (answers > 0).sum(), (answers < 0).sum()
        assert sign_counts(counts) == pytest.approx(stats.binomtest(int(up), int(up + down)).pvalue)
        if up + down > 50:
            theirs = stats.wilcoxon(
                answers[answers != 0], zero_method="wilcox", correction=False, method="asymptotic"
            ).pvalue
            assert signed_rank_counts(counts) == pytest.approx(theirs)
    nothing = np.array([0, 0, 9, 0, 0])
    assert sign_counts(nothing) == signed_rank_counts(nothing) == 1


@pytest.mark.parametrize("design", ["full", "incomplete"])
@pytest.mark.parametrize("test", ["wilcoxon", "sign"])
@pytest.mark.parametrize("family", ["study", "framing"])
def test_power_decides_as_analyse_does(design, test, family):
    """The same simulated answers, once counted by the plan and once read as a table: the same
    verdict about the pair in every study, for the declared test, margin and family.
    """
    options = Options(test=test, family=family, margin=0.5, resamples=100, seed=5)
    for difference in (1.6, 0.0):
        run, _ = run_of(
            plan(
                techniques=("a", "b", "c"),
                pair=("a", "b"),
                framings=("close-up", "head-shot"),
                studies=50,
                most=60,
                options=options,
            ),
            design,
            difference,
        )
        for people in (12, 60):
            result, excluded = run.detected(people), run.excluded(people)
            for study in range(0, 50, 10 if people > 20 else 5):
                rows = pairs(table_of(run, study, people), options)
                about = rows[(rows.a == "a") & (rows.b == "b") & (rows.framing != "overall")]
                verdicts = [verdict(row, 0.05) for row in about.itertuples()]
                assert [one in ("different", "both") for one in verdicts] == list(result[study])
                assert [one in ("equivalent", "both") for one in verdicts] == list(excluded[study])
        if design == "full" and people == 60:
            assert (result if difference else excluded).any()


@pytest.mark.parametrize(("difference", "goal"), [(1.6, "find"), (0.0, "exclude")])
def test_the_whole_report_concludes_as_power_does(difference, goal):
    """All tables and sentences of simulated studies, not the pair's test alone: a pair that `power`
    counts as found, or excluded, is said to be so, and no other. `make bench BENCH=power` does it
    for the thesis's design, with other studies than those that `power` drew.
    """
    options = Options(margin=0.5, resamples=100, seed=5, models=("bradley_terry",))
    run, _ = run_of(
        plan(techniques=("a", "b", "c"), pair=("a", "b"), most=50, studies=50, options=options),
        difference=difference,
    )
    expected = (run.detected(50) if goal == "find" else run.excluded(50))[:, 0]
    both_kinds = [*np.flatnonzero(expected)[:2], *np.flatnonzero(~expected)[:1]]
    for study in both_kinds:
        responses = table_of(run, study, 50)
        results = everything(responses, options)
        row = next(r for r in results.tables["pairs"].itertuples() if (r.a, r.b) == ("a", "b"))
        assert (verdict(row, 0.05) in (VERDICTS[goal], "both")) == expected[study]
        said = conclude(results.tables, results.notes, responses.codebook, options, 50, False).can
        about = [one for one in said if re.search(SAID[goal], one)]
        assert bool(about) == expected[study], (said, expected[study])


VERDICTS = {"find": "different", "exclude": "equivalent"}
SAID = {
    "find": r"preferred .*(b over [^;(]*\ba\b|a over [^;(]*\bb\b)",
    "exclude": "a and b are as good",
}


def test_the_margin_is_the_declared_one():
    """0.5 JOD is 0.38 points, and the study declares 0.25: the people to exclude it are those of
    0.25 points.
    """
    declared = plan(difference=0.5, options=Options(margin=0.25, margin_jod=0.5))
    assert declared.margin == 0.25
    assert plan(difference=0.5).margin == pytest.approx(0.38, abs=0.01)
    assert declared.answering.mean(declared.answering.difference(0.25)) == pytest.approx(0.25)
    options = Options(margin=0.25, resamples=100)
    run, _ = run_of(plan(studies=300, most=200, difference=0.5, options=options), difference=0.0)
    # 84 people, as the difference in JOD would have it, are far too few: power .21
    assert run.excluded(84, "none").mean() == pytest.approx(0.21, abs=0.08)
    assert run.excluded(200, "none").mean() == pytest.approx(0.8, abs=0.08)


def test_the_first_step_asks_most_and_the_pair_alone_least():
    run, _ = run_of(plan(studies=200, most=60, framings=("x", "y", "z")))
    rates = [run.detected(60, one).mean() for one in ("first", "family", "none")]
    assert rates == sorted(rates) and rates[0] < rates[2]


def test_designs_ask_what_they_say_and_everyone_is_asked_so_many():
    for design, each in (("full", 10), ("incomplete", 4), ("adaptive", 4)):
        run, _ = run_of(plan(studies=50, most=40, answers_each=4), design)
        assert (run.asked.sum(axis=3) == each).all()
        assert run.asked.any(axis=(0, 1, 2)).all()


@pytest.mark.parametrize(("people", "said"), [(70, "70 people against 66"), (40, "")])
def test_an_adaptive_design_that_saves_nobody_is_said(people, said):
    needed = pd.DataFrame(
        [
            ("any", design, "find", "declared", "family", count)
            for design, count in (("adaptive", people), ("incomplete", 66))
        ],
        columns=["framing", "design", "goal", "test", "correction", "people"],
    )
    result = _adaptive(Plan(THESIS, PAIR), needed, None)
    assert len(result) == (1 if said else 0)
    assert all(f"no better than pairs drawn by lot: {said}" in sentence for sentence in result)


def test_the_adaptive_design_asks_near_pairs_more_often_than_far_ones():
    worths = {"here": dict(zip(THESIS, (-3.0, -1.5, 0.0, 0.2, 3.0), strict=True))}
    run, _ = run_of(
        plan(
            studies=50,
            most=60,
            answers_each=3,
            worths=worths,
            framings=("here",),
            difference=0.2,
        ),
        "adaptive",
    )
    asked = dict(zip(run.plan.pairs, run.asked.mean(axis=(0, 1, 2)), strict=True))
    assert asked[(2, 3)] > 1.5 * asked[(0, 4)]


def test_more_people_larger_differences_and_more_answers_give_more_power():
    people = people_grid(120)[8]
    curves, _ = plan_table(plan(), ("full", "incomplete"))
    result = (
        curves[
            (curves.goal == "find")
            & (curves.test == "contrast")
            & (curves.people == people)
            & (curves.correction == "none")
        ]
        .set_index("design")
        .power
    )
    assert result["full"] > result["incomplete"]
    larger, _ = plan_table(plan(difference=1.6), ("full",))
    more = larger[
        (larger.goal == "find")
        & (larger.test == "contrast")
        & (larger.people == people)
        & (larger.correction == "none")
    ].power.iloc[0]
    assert more > result["full"]


def test_the_same_seed_gives_the_same_numbers_and_another_one_others():
    one, two, other = (
        plan_table(plan(studies=80, seed=seed), ("incomplete",))[0] for seed in (1, 1, 2)
    )
    pd.testing.assert_frame_equal(one, two)
    assert not one.power.equals(other.power)


def test_a_pilot_gives_back_what_it_was_drawn_from(write):
    """A known truth, drawn by `analysis.planning`'s own model with 400 people: worths within
    0.25 JOD, cuts within 0.15 JOD.
    """
    worths = {"close-up": dict(zip(THESIS, (-1.0, -0.4, 0.4, 0.8, 0.2), strict=True))}
    truth = plan(
        studies=50,
        most=400,
        worths=worths,
        framings=("close-up",),
        difference=0.4,
        answering=Answering(0.6, 1.7, 0.3),
    )
    _, answers = run_of(truth, "full")
    rows = [
        (
            f"P{person}",
            3,
            "close-up",
            THESIS[a],
            THESIS[b],
            int(answers[0, person, 0, k]),
            k + 1,
            900,
            "2024-05-01T09:00:00Z",
        )
        for person in range(400)
        for k, (a, b) in enumerate(truth.pairs)
    ]
    result, answering = fit_pilot(read_responses(write(rows)))
    expected = truth.truth("close-up", 0.4)
    assert [result["close-up"][name] for name in THESIS] == pytest.approx(expected, abs=0.25)
    assert (answering.slight, answering.clear) == pytest.approx((0.6, 1.7), abs=0.15)


@pytest.mark.parametrize(
    ("answers", "message"),
    [
        ([("a", "b", 2)] * 6, "no finite worths"),
        ([("a", "b", 0)] * 6, "no finite worths"),
        ([("a", "b", 1), ("c", "d", -1)], "separate groups"),
    ],
)
def test_a_pilot_without_worths_is_refused(write, answer, answers, message):
    path = write([answer(f"P{person}", "close-up", *row) for person, row in enumerate(answers)])
    with pytest.raises(InputError, match=message) as error:
        fit_pilot(read_responses(path))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"difference": 0.0}, "difference is 0.0"),
        ({"difference": float("nan")}, "difference is nan"),
        ({"pair": ("golubev", "golubev")}, "two different ones"),
        ({"pair": ("golubev", "x")}, "two different ones"),
        ({"techniques": ("golubev",), "pair": ("golubev", "golubev_plus")}, "at least two"),
        ({"answers_each": 11}, "0 to 10"),
        ({"framings": ()}, "framings is"),
        ({"power": 0.01}, "above alpha"),
        ({"most": 3}, "5 to 5000"),
        ({"studies": 1}, "50 to 100000"),
        ({"seed": -1}, "seed is -1"),
        ({"worths": {"x": {"none": 0.0}}}, "the worth of 'jimenez_separable' at 'x' is None"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_in_one_line(changes, message):
    with pytest.raises(InputError, match=message) as error:
        plan(**changes)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("values", "message"),
    [((-1, 1, 0), "slight is -1"), ((2, 1, 0), "at least slight"), ((0, 1, 1.6), "taste is 1.6")],
)
def test_answering_that_cannot_be_is_refused(values, message):
    with pytest.raises(InputError, match=message):
        Answering(*values)


# The command


def test_the_command_writes_marked_tables_a_figure_and_a_page(tmp_path, capsys):
    arguments = [
        "power",
        "stimuli/studies/thesis.toml",
        "--design",
        "full",
        "--studies",
        "60",
        "--most",
        "40",
        "--worth",
        "none=-0.5",
    ]
    assert main([*arguments, "--out", str(tmp_path / "one")]) == 0
    out = capsys.readouterr().out
    assert re.search(
        (
            r"full design, 10 of 10 pairs a person and framing: to find 0\.5 JOD between Golubev "
            r"and Golubev Plus by the declared Wilcoxon's signed-rank test, corrected over the 30 "
            r"pairs .* within 0\.25 points by the declared equivalence test"
        ),
        " ".join(out.split()),
    )
    assert main([*arguments, "--out", str(tmp_path / "two")]) == 0
    files = {
        path.relative_to(tmp_path / "one").as_posix(): path.read_bytes()
        for path in (tmp_path / "one").rglob("*")
        if path.is_file()
    }
    assert set(files) == {
        "power.csv",
        "needed.csv",
        "power.md",
        *(f"figures/power.{kind}" for kind in ("pdf", "png", "svg")),
    }
    assert all((tmp_path / "two" / name).read_bytes() == content for name, content in files.items())
    for name in ("power.csv", "needed.csv"):
        assert (pd.read_csv(tmp_path / "one" / name).simulated == 1).all()
    page = files["power.md"].decode()
    assert (
        "SIMULATED ANSWERS" in page
        and "seed 1" in page
        and "No SSS \N{MINUS SIGN}0.40" in page.replace("-0.40", "\N{MINUS SIGN}0.40")
    )
    assert (
        "subdermal power thesis.toml --worth none=-0.5 --design full --most 40 --studies 60 "
        "--out DIR"
    ) in page
    assert b"SIMULATED ANSWERS" in files["figures/power.svg"]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["no.toml"], "no.toml"),
        (["{study}", "--worth", "x=1"], "--worth names x"),
        (["{study}", "--worth", "none"], "is no TECHNIQUE=JOD"),
        (["{study}", "--pair", "none"], "the pair is 'none'"),
        (["{study}", "--difference", "0"], "difference is 0.0"),
        (["{study}", "--pilot", "no.csv"], "no.csv: cannot be read"),
        (["{study}", "--worth", "none=1", "--pilot", "no.csv"], "either --worth or --pilot"),
        (["{study}", "--taste", "9"], "taste is 9"),
    ],
)
def test_what_the_command_cannot_do_is_one_line(tmp_path, capsys, options, expected):
    options = [option.format(study="stimuli/studies/thesis.toml") for option in options]
    code = main(["power", *options, "--out", str(tmp_path / "out")])
    done = capsys.readouterr()
    assert (
        code == 2
        and done.err.count("\n") == 1
        and expected in done.err
        and not (tmp_path / "out").exists()
    )
