"""What is drawn where: lengths, sides and places of bars and dots, read back from the figures."""

from itertools import combinations, pairwise

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from analysis import distributions, preferences, read_responses
from analysis.codebook import Codebook
from analysis.figures import (
    ANSWERS,
    _bars,
    _cut,
    _pair,
    _preferences,
    _wrapped,
    grouped_quantiles,
)


@pytest.fixture
def responses(write, answer):
    given = {
        "a": [-2, -2, -1, 0, 2],
        "b": [1, 1, 2, 2, 0],
    }  # five people: about a and b, about b and c
    rows = [
        answer(f"P{person}", "close-up", "a", "b", value) for person, value in enumerate(given["a"])
    ]
    rows += [
        answer(f"P{person}", "close-up", "c", "b", -value)
        for person, value in enumerate(given["b"])
    ]
    return read_responses(write(rows), order=["a", "b", "c"])


def bars(ax):
    """Row -> answer (0 to 4) -> (left, width) of the bars that have a width."""
    result = {}
    colours = [
        tuple(int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)) for colour in ANSWERS
    ]
    for patch in ax.patches:
        if patch.get_width() > 0:
            answer = int(
                np.argmin(
                    [
                        np.abs(np.subtract(patch.get_facecolor()[:3], colour)).sum()
                        for colour in colours
                    ]
                )
            )
            result.setdefault(round(patch.get_y() + patch.get_height() / 2), {})[answer] = (
                patch.get_x(),
                patch.get_width(),
            )
    return result


def test_preferences_for_the_panels_technique_lie_on_the_left(responses):
    panels = _preferences(list("abc"), distributions(responses), responses.codebook).axes
    assert [ax.get_title("left") for ax in panels] == ["a", "b", "c"]
    row = bars(panels[0])[
        0
    ]  # a against b: 2 strong and 1 slight for a, 1 none, 1 strong for b; one answer is 20 %
    assert row == {
        0: pytest.approx((-70, 40)),
        1: pytest.approx((-30, 20)),
        2: pytest.approx((-10, 20)),
        4: pytest.approx((10, 20)),
    }
    mirrored = bars(panels[1])[0]  # b against a
    assert mirrored[4] == pytest.approx((30, 40)) and mirrored[0] == pytest.approx((-30, 20))
    assert [label.get_text() for label in panels[1].get_yticklabels()] == ["a", "c"]


def test_every_bar_adds_up_to_all_answers(responses):
    for ax in _preferences(list("abc"), distributions(responses), responses.codebook).axes:
        for row in bars(ax).values():
            assert sum(width for _, width in row.values()) == pytest.approx(100)


def test_numbers_in_bars_count_answers(responses):
    ax = _preferences(list("abc"), distributions(responses), responses.codebook).axes[0]
    assert sorted(text.get_text() for text in ax.texts) == ["1", "1", "1", "2"]


def test_the_box_plot_has_one_dot_an_answer_on_its_side(responses):
    for pair, sign in ((("a", "b"), 1), (("b", "a"), -1)):
        values = preferences(responses, pair)
        ax = _pair(list(values), values, pair, responses.codebook).axes[0]
        dots = np.concatenate([line.get_xdata() for line in ax.lines if line.get_marker() == "o"])
        assert sorted(np.round(dots)) == sorted(sign * np.array([-2, -2, -1, 0, 2]))
        ends = [label.get_text().replace("\n", " ") for label in ax.get_xticklabels()]
        assert (ends[0], ends[-1]) == (f"strong for {pair[0]}", f"strong for {pair[1]}")


def test_a_technique_without_a_value_has_no_bar_and_says_so():
    values = {"near": {"a": 3, "b": 0}, "far": {"a": 1}}
    near, far = _bars(
        ["near", "far"],
        values,
        {"near": ("Near", "3"), "far": ("Far", "1")},
        {"a": "A", "b": "B"},
        "points",
        0,
    ).axes
    assert [patch.get_width() for patch in near.patches] == [3, 0]
    assert [patch.get_width() for patch in far.patches] == [1]
    assert "no value" in " ".join(text.get_text() for text in far.texts)


def test_titles_of_panels_lie_within_the_figure_and_beside_each_other(write, answer):
    names = [f"technique_number_{k}_of_many" for k in range(3)]
    rows = [answer("P1", "close-up", a, b, 1) for a, b in combinations(names, 2)]
    responses = read_responses(write(rows))
    figure = _preferences(names, distributions(responses), responses.codebook)
    figure.draw_without_rendering()
    titles = [ax._left_title.get_window_extent() for ax in figure.axes]
    assert all(a.x1 < b.x0 for a, b in pairwise(titles))
    assert titles[-1].x1 <= figure.bbox.x1


def test_long_names_are_wrapped_and_cut():
    assert _wrapped("jimenez_separable") == "jimenez_separable"
    lines = _wrapped("a_rather_long_technique_name with words and more words").split("\n")
    assert len(lines) <= 3 and all(len(line) <= 21 for line in lines) and "…" in "".join(lines)
    assert _wrapped("golubev_plus", 11) == "golubev_\nplus"
    assert _wrapped("x" * 90).count("\n") <= 2
    # two that differ at their ends alone stay told apart
    names = [_cut(f"a_rather_long_technique_name_{k}", 16) for k in (1, 2)]
    assert names[0] != names[1] and all(len(name) <= 16 for name in names)


def test_a_box_does_not_collapse_where_many_gave_one_answer():
    """16 of 20 saw no difference: the quartiles of grouped data lie within that answer."""
    answers = np.repeat([-1, 0, 1], [3, 16, 1])
    low, middle, high = grouped_quantiles(answers, (0.25, 0.5, 0.75))
    assert (low, middle, high) == pytest.approx((-0.375, -0.0625, 0.25))
    assert grouped_quantiles(np.array([-2, -2, 2, 2]), (0.5,)) == pytest.approx(0, abs=1e-6)
    assert grouped_quantiles(np.repeat(1, 9), (0.25, 0.75)) == pytest.approx((0.75, 1.25))


@pytest.mark.parametrize(("techniques", "framings"), [(2, 1), (11, 1), (30, 1), (5, 12)])
def test_no_figure_is_taller_than_a_page_and_no_letter_below_7_points(
    undrawn, techniques, framings, write, monkeypatch
):
    """Every figure that a report draws, for 2 to 30 conditions and 1 to 30 levels, long labels."""
    from analysis import figures, read_responses, worth_figures
    from analysis.ahp import Priorities
    from analysis.report import file_names

    rng, seen = np.random.default_rng(1), []
    names = [f"a technique whose name is long, {k}" for k in range(techniques)]
    levels = [f"a level with a long name, {k}" for k in range(framings)]
    rows = []
    for person in range(6):
        for level in levels:
            for k, (a, b) in enumerate(combinations(names, 2)):
                if techniques < 20 or (k + person) % 7 == 0:
                    left, right = (a, b) if rng.random() < 0.5 else (b, a)
                    rows.append(
                        [f"P{person}", 3, level, left, right, int(rng.integers(-2, 3))]
                        + [k + 1, 900, "2024-05-01"]
                    )
    responses = read_responses(write(rows), order=names)

    def picture(name, title, caption, alt, draw, *args, simulated=False):
        figure = draw(*args)
        seen.append((name, figure))
        return figures.Picture(name, title, caption, alt, b"", b"", b"")

    monkeypatch.setattr(figures, "_picture", picture)
    book, items = responses.codebook, responses.items
    pairs = pd.DataFrame(
        [
            {"framing": level, "a": a, "b": b, "mean_preference": 0.1, "low": -0.2, "high": 0.4}
            | {"holm_p": 0.3, "equivalent": np.nan, "jod_equivalent": np.nan}
            | {"equivalence_low": np.nan, "simultaneous_low": -0.5, "simultaneous_high": 0.7}
            for level in levels
            for a, b in combinations(names, 2)
        ]
    )
    worths = pd.DataFrame(
        [
            (level, model, name, 0.1, -0.2, 0.4, "maximum likelihood")
            for level in levels
            for model in worth_figures.MODELS
            for name in names
        ],
        columns=["framing", "model", "technique", "estimate", "low", "high", "fit"],
    )
    tallies_table = worths[worths.model == "davidson"].rename(columns={"estimate": "score"})
    agreement = pd.DataFrame(
        [(level, one, 0.5, 0.2, 0.7) for level in levels for one in worth_figures.DRAWN],
        columns=["framing", "statistic", "value", "low", "high"],
    )
    result = {
        level: Priorities(np.full(len(items[level]), 1 / len(items[level])), 5.0, 0.0, None)
        for level in items
    }
    figures.draw_responses(responses, result, tuple(names[:2]), file_names(items))
    worth_figures.draw_pairs(pairs, book, 0.25)
    worth_figures.draw_ladder(worths, book)
    worth_figures.draw_worths(worths, book)
    worth_figures.draw_scores(tallies_table, book)
    worth_figures.draw_agreement(agreement, book)
    assert {"scores", "pairs", "jod_ladder", "worths", "agreement", "priorities"} <= {
        name for name, _ in seen
    }
    for name, figure in seen:
        width, height = figure.get_size_inches()
        assert height <= 9.0 and width <= figures.WIDTH_IN + 1e-6, (name, height)
        texts = [text for text in figure.findobj(Text) if text.get_text().strip()]
        assert min(text.get_size() for text in texts) >= 7, name


def test_a_known_order_of_framings_is_one_of_distance():
    for framings, expected in (
        (("close-up", "half-length"), True),
        (("half-length", "close-up"), False),
        (("x",), False),
    ):
        assert Codebook(framings, ("a", "b"), "", "").near_to_far is expected
