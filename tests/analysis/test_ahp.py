"""AHP against the numbers that Vuletic's thesis printed, against power iteration, and where it must
refuse.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis import (
    InputError,
    comparisons,
    medians,
    priorities,
    priorities_table,
    read_matrices,
    read_responses,
)
from analysis.ahp import RANDOM_INDEX, judgements

MATRICES = Path(__file__).parent / "thesis_matrices.toml"
#: Vuletic's thesis, tables 5.2 and 5.4.
PUBLISHED = {
    "close-up": ([0.0841, 0.1208, 0.2766, 0.3562, 0.1623], 0.0476, 0.0425),
    "head-shot": ([0.1181, 0.1496, 0.2836, 0.2836, 0.1652], 0.0130, 0.0116),
    "half-length": ([0.2971, 0.1592, 0.1973, 0.1680, 0.1785], 0.0171, 0.0153),
}


@pytest.mark.parametrize("framing", PUBLISHED)
def test_the_published_matrices_give_the_published_numbers(framing):
    vector, ci, cr = PUBLISHED[framing]
    result = priorities(read_matrices(MATRICES)[framing].matrix)
    assert result.vector == pytest.approx(vector, abs=1e-4)
    assert result.ci == pytest.approx(ci, abs=1e-4) and result.cr == pytest.approx(cr, abs=1e-4)
    assert result.lambda_max == pytest.approx(5 + 4 * result.ci)


def test_judgements_are_the_scale_of_the_thesis():
    assert judgements([-2, -1, 0, 1, 2]) == pytest.approx([3, 2, 1, 1 / 2, 1 / 3])


def test_medians_are_taken_above_the_diagonal_and_inverted_below(write, answer):
    """The trap: two people, one without a preference, one slightly for a; 1.5 over the diagonal,
    1/1.5 under it, not 0.75.
    """
    path = write([answer("P1", "close-up", "a", "b", -1), answer("P2", "close-up", "a", "b", 0)])
    matrix = comparisons(read_responses(path, order=["a", "b"]))["close-up"].matrix
    assert matrix == pytest.approx(np.array([[1, 1.5], [1 / 1.5, 1]]))
    turned = comparisons(read_responses(path, order=["b", "a"]))["close-up"].matrix
    assert turned == pytest.approx(np.array([[1, 0.75], [1 / 0.75, 1]]))
    assert medians(read_responses(path)).to_dict("split")["data"] == [
        ["close-up", "a", "b", 2, -0.5, 1.5]
    ]


@pytest.mark.parametrize("n", range(3, 12))
def test_priorities_are_those_of_power_iteration(n):
    rng = np.random.default_rng(n)
    upper = np.triu(rng.choice([1 / 3, 1 / 2, 1, 2, 3], (n, n)), 1)
    matrix = upper + np.tril(1 / np.where(upper.T == 0, 1, upper.T), -1) + np.eye(n)
    vector = np.ones(n) / n
    for _ in range(500):
        vector = matrix @ vector / (matrix @ vector).sum()
    result = priorities(matrix)
    assert result.vector == pytest.approx(
        vector, abs=1e-10
    ) and result.vector.sum() == pytest.approx(1)
    assert result.lambda_max == pytest.approx((matrix @ vector).sum(), abs=1e-9)
    if n > 10:
        assert result.cr is None and "no random index beyond 10" in result.verdict
    else:
        assert result.cr == pytest.approx((result.lambda_max - n) / (n - 1) / RANDOM_INDEX[n - 1])


def test_a_consistent_matrix_gives_back_its_worths_and_is_coherent():
    worth = np.array([0.1, 0.2, 0.3, 0.4])
    result = priorities(worth[:, None] / worth)
    assert result.vector == pytest.approx(worth) and result.ci == 0 and result.verdict == "coherent"


def test_one_and_two_items_are_always_coherent():
    for matrix in ([[1.0]], [[1, 3], [1 / 3, 1]]):
        result = priorities(np.array(matrix))
        assert (result.ci, result.cr) == (0, 0)
    assert result.vector == pytest.approx([0.75, 0.25])
    words = "Two techniques have one judgement, which nothing can contradict: CR says nothing."
    assert result.sentence() == words


def test_a_circle_is_incoherent():
    circle = np.array([[1, 3, 1 / 3], [1 / 3, 1, 3], [3, 1 / 3, 1]])
    result = priorities(circle)
    assert (
        result.vector == pytest.approx([1 / 3] * 3)
        and result.cr > 0.1
        and result.verdict.startswith("incoherent")
    )


def test_pairs_that_nobody_compared_are_named_and_give_no_priorities(write, answer):
    rows = [answer("P1", "close-up", *pair, 1) for pair in ("ab", "bc", "cd")]
    rows += [answer("P1", "head-shot", "a", "b", 1)]
    result = comparisons(read_responses(write(rows), order="abcd"))
    assert result["close-up"].missing == [("a", "c"), ("a", "d"), ("b", "d")]
    assert result["head-shot"].items == ("a", "b") and not result["head-shot"].missing
    table = priorities_table(result)
    assert table[table.framing == "close-up"].iloc[:, 2:].isna().all(axis=None)
    assert table[table.framing == "head-shot"].priority.tolist() == pytest.approx([1 / 3, 2 / 3])
    with pytest.raises(InputError, match="complete"):
        priorities(result["close-up"].matrix)


def test_doubling_the_people_changes_no_median_and_no_priority(write, random_study):
    rows = random_study(6, seed=4)
    twice = rows + [["Q" + row[0], *row[1:]] for row in rows]
    before, after = read_responses(write(rows)), read_responses(write(twice))
    columns = ["framing", "a", "b", "median_preference", "median_judgement"]
    pd.testing.assert_frame_equal(medians(before)[columns], medians(after)[columns])
    pd.testing.assert_frame_equal(
        priorities_table(comparisons(before)), priorities_table(comparisons(after))
    )


def test_with_an_odd_number_of_people_the_order_only_permutes(write, random_study):
    path = write(random_study(7, seed=6))
    names = read_responses(path).codebook.techniques
    keys = ["framing", "technique"]
    one, other = (
        priorities_table(comparisons(read_responses(path, order=order)))
        .sort_values(keys)
        .reset_index(drop=True)
        for order in (names, names[::-1])
    )
    pd.testing.assert_frame_equal(one, other, rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("items = [", "not TOML"),
        ("", "items is None"),
        ("items = []", r"items is \[\]"),
        ('items = ["a", "a"]', "different names"),
        ('items = ["a", 1]', "different names"),
        ('items = ["a"]', "matrix is None"),
        ('items = ["a"]\n[matrix]', "matrix is {}"),
        ('items = ["a", "b"]\n[matrix.x]\nrow = 1', "matrix.x.rows is None, expected 2 rows"),
        ('items = ["a", "b"]\n[matrix.x]\nrows = [[1, 2]]', "matrix.x.rows is 1 rows"),
        (
            'items = ["a", "b"]\n[matrix.x]\nrows = [[1, 2], [0.5]]',
            r"rows\[1\] has 1 numbers, expected 2",
        ),
        ('items = ["a", "b"]\n[matrix.x]\nrows = [[1, 2], 3]', r"rows\[1\] has 3"),
        ('items = ["a", "b"]\n[matrix.x]\nrows = [[1, "2"], [0.5, 1]]', r"rows\[0\]\[1\] is '2'"),
        (
            'items = ["a", "b"]\n[matrix.x]\nrows = [[1, -2], [-0.5, 1]]',
            r"rows\[0\]\[1\] is -2, expected a positive",
        ),
        ('items = ["a", "b"]\n[matrix.x]\nrows = [[1, inf], [0, 1]]', r"rows\[0\]\[1\] is inf"),
        ('items = ["a", "b"]\n[matrix.x]\nrows = [[true, 1], [1, 1]]', r"rows\[0\]\[0\] is True"),
        (
            'items = ["a", "b"]\n[matrix.x]\nrows = [[1, 2], [2, 1]]',
            "not reciprocal: a over b is 2 and the other way 2",
        ),
        (
            'items = ["a", "b"]\n[matrix.x]\nrows = [[2, 1], [1, 1]]',
            "not reciprocal: a over a is 2",
        ),
    ],
)
def test_broken_matrices_are_refused_in_one_line(tmp_path, text, expected):
    path = tmp_path / "matrices.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=expected) as error:
        read_matrices(path)
    assert "\n" not in str(error.value) and str(path) in str(error.value)


def test_no_file_and_latin_1_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_matrices(tmp_path / "nothing.toml")
    (tmp_path / "latin.toml").write_bytes(b'items = ["\xe9"]')
    with pytest.raises(InputError, match="UTF-8"):
        read_matrices(tmp_path / "latin.toml")


@pytest.mark.parametrize("matrix", [[[1, 2], [3, 1]], [[2, 1], [1, 1]], np.full((3, 3), 0.5)])
def test_a_matrix_that_is_not_reciprocal_has_no_priorities(matrix):
    """Of such a matrix lambda_max may lie below n: CR -0.149 and 'coherent'."""
    with pytest.raises(InputError, match="the matrix is not reciprocal: .* expected 1 within 0.02"):
        priorities(matrix)
