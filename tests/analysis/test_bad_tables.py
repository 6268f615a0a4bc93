"""Tables that a method cannot answer for: the whole report is still made, and says in words what it
cannot say in numbers.
"""

import io
import re
from html import unescape
from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from analysis import read_responses
from analysis.options import Options
from analysis.report import report_responses


def text_of(html):
    return " ".join(unescape(re.sub(r"<[^>]+>", " ", html)).split())


def in_short(files):
    page = files["report.html"].decode()
    return text_of(page[page.index("<h2>In short") : page.index("</section>")])


def whole(files):
    return text_of(files["report.html"].decode())


def worths(files):
    return pd.read_csv(io.BytesIO(files["tables/worths.csv"]))


@pytest.fixture
def report(undrawn, write, answer):
    """report(people, names, give, pairs) -> files; give(rng, a, b) is the answer,
    negative for a.
    """

    def report(people, names, give, pairs=None, framings=("close-up",)):
        rng = np.random.default_rng(0)
        rows = []
        for person in range(people):
            for framing in framings:
                for a, b in pairs or combinations(names, 2):
                    value = give(rng, a, b)
                    left, right = (b, a) if person % 2 else (a, b)
                    value = -value if person % 2 else value
                    rated = 1 + person % 5
                    rows.append(answer(f"P{person}", framing, left, right, value, rated))
        return report_responses(
            read_responses(write(rows), order=names),
            options=Options(margin=0.25, margin_jod=0.5, resamples=100),
        )

    return report


def any_answer(rng, a, b):
    return int(rng.integers(-2, 3))


def test_one_participant_has_counts_and_no_tests(report):
    files = report(1, ["a", "b", "c"], any_answer)
    assert "too few people answered to test any pair" in in_short(files)
    assert pd.read_csv(io.BytesIO(files["tables/pairs.csv"])).wilcoxon_p.isna().all()
    assert "figures/scores.svg" in files


def test_fewer_people_than_a_test_needs(report):
    assert "too few people answered to test any pair" in in_short(
        report(4, ["a", "b", "c"], any_answer)
    )


def test_one_pair(report):
    files = report(8, ["a", "b"], any_answer)
    text = in_short(files)
    assert "close-up: the one pair is undecided" in text
    agreement = pd.read_csv(io.BytesIO(files["tables/agreement.csv"])).set_index("statistic").value
    assert np.isnan(agreement["krippendorff_alpha"])  # 0 by definition, whatever was answered
    assert "Krippendorff's alpha has no number for one pair alone" in text_of(
        files["report.html"].decode()
    )


def test_only_ties_have_no_worths_and_no_winner(report):
    framings = ("close-up", "head-shot", "half-length")
    files = report(8, ["a", "b", "c"], lambda *_: 0, framings=framings)
    text = in_short(files)
    concluded = text.split("What was counted")[0]
    assert "every answer is 'no difference'" in text and "preferred over" not in concluded
    assert "everyone gave the same answer about each of all 3 pairs" in concluded
    assert "0.5 JOD" not in concluded  # there is no JOD to set a margin against
    assert "familiarity" not in concluded  # nor a correlation of what never varies
    assert "no pair could be tested, since its mean preference is the same" in concluded
    assert "preferences do not change: on average an answer gave 0.00" in text
    assert worths(files).estimate.isna().all() and "figures/jod_ladder.svg" not in files
    table = pd.read_csv(io.BytesIO(files["tables/familiarity_interaction.csv"]))
    assert (
        table.spearman.isna().all() and table.p.isna().all() and (table.slope.dropna() == 0).all()
    )
    page = whole(files)
    assert "everybody's net score is the same for every technique" in page
    assert "no deviance: there is no fit" in page and "not maximum likelihood" not in page


def test_no_ties_at_all(report):
    result = worths(report(12, ["a", "b", "c"], lambda rng, a, b: int(rng.choice([-2, -1, 1, 2]))))
    assert result[result.model == "bradley_terry"].estimate.notna().all()


def test_an_unbeaten_technique_is_named_and_its_fit_is_marked(report):
    files = report(8, ["a", "b", "c"], lambda rng, a, b: -2 if a == "a" else any_answer(rng, a, b))
    text = in_short(files)
    assert "a was never beaten by b, c or tied with them" in text and "reduced bias" in text
    result = worths(files).query("model == 'thurstone_jod'")
    assert result.estimate.notna().all() and set(result.fit) == {"reduced bias"}


def test_groups_that_never_met_are_named(report):
    text = in_short(report(8, list("abcd"), any_answer, pairs=[("a", "b"), ("c", "d")]))
    assert (
        "were never compared, not even through others" in text
        and "No priorities: 4 pairs had no answer." in text
    )


def test_eleven_techniques(report):
    text = in_short(report(6, [f"t{k}" for k in range(11)], any_answer))
    assert (
        "there is no random index beyond 10 items" in text and "all 55 pairs are undecided" in text
    )


def test_everyone_excluded_leaves_nothing_to_conclude_again(report):
    assert "those who are left are too few" in in_short(report(6, list("abcdef"), lambda *_: 0))


def test_letters_without_a_glyph_are_said(write, answer):
    from analysis import figures

    picture = figures._picture(
        "x", "t", "c.", "a", lambda: figures.Figure(layout="constrained").text(0, 0, "日本").figure
    )
    assert "Some letters of its names are not in the figure's font" in picture.caption
