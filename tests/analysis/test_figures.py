"""What is drawn where: lengths, sides and places of bars and dots, read back from the figures."""

import numpy as np
import pytest

from analysis import distributions, preferences, read_responses
from analysis.codebook import Codebook
from analysis.figures import ANSWERS, _bars, _pair, _preferences, _wrapped


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
    found = {}
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
            found.setdefault(round(patch.get_y() + patch.get_height() / 2), {})[answer] = (
                patch.get_x(),
                patch.get_width(),
            )
    return found


def test_preferences_for_the_panels_technique_lie_on_the_left(responses):
    panels = _preferences(distributions(responses), responses.codebook).axes
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
    for ax in _preferences(distributions(responses), responses.codebook).axes:
        for row in bars(ax).values():
            assert sum(width for _, width in row.values()) == pytest.approx(100)


def test_numbers_in_bars_count_answers(responses):
    ax = _preferences(distributions(responses), responses.codebook).axes[0]
    assert sorted(text.get_text() for text in ax.texts) == ["1", "1", "1", "2"]


def test_the_box_plot_has_one_dot_an_answer_on_its_side(responses):
    for pair, sign in ((("a", "b"), 1), (("b", "a"), -1)):
        ax = _pair(preferences(responses, pair), pair, responses.codebook).axes[0]
        dots = np.concatenate([line.get_xdata() for line in ax.lines if line.get_marker() == "o"])
        assert sorted(np.round(dots)) == sorted(sign * np.array([-2, -2, -1, 0, 2]))
        ends = [label.get_text().replace("\n", " ") for label in ax.get_xticklabels()]
        assert (ends[0], ends[-1]) == (f"strong for {pair[0]}", f"strong for {pair[1]}")


def test_a_technique_without_a_value_has_no_bar_and_says_so():
    values = {"near": {"a": 3, "b": 0}, "far": {"a": 1}}
    near, far = _bars(
        values, {"near": ("Near", "3"), "far": ("Far", "1")}, {"a": "A", "b": "B"}, "points", 0
    ).axes
    assert [patch.get_width() for patch in near.patches] == [3, 0]
    assert [patch.get_width() for patch in far.patches] == [1]
    assert "no value" in " ".join(text.get_text() for text in far.texts)


def test_long_names_are_wrapped_and_cut():
    assert _wrapped("jimenez_separable") == "jimenez_separable"
    lines = _wrapped("a_rather_long_technique_name with words and more words").split("\n")
    assert len(lines) == 2 and all(len(line) <= 21 for line in lines) and lines[1].endswith("…")
    assert _wrapped("x" * 90).count("\n") == 1


def test_a_known_order_of_framings_is_one_of_distance():
    for framings, expected in (
        (("close-up", "half-length"), True),
        (("half-length", "close-up"), False),
        (("x",), False),
    ):
        assert Codebook(framings, ("a", "b"), "", "").near_to_far is expected
