"""Analytic Hierarchy Process with one criterion: from judgements of pairs to priorities and their
consistency.

T. L. Saaty, "The Analytic Hierarchy Process", McGraw-Hill 1980; as used in section 5.3 of Vuletic's
thesis.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import bootstrap
from analysis.errors import InputError
from analysis.options import Options
from analysis.panel import Panel, by_pair, panels, with_notes
from analysis.responses import Responses

#: Random index for matrices of 1 to 10 items; Saaty's, as in table 5.3 of the thesis. Other tools
#: hold others (n = 3: .525, .58).
RANDOM_INDEX = (0.0, 0.0, 0.52, 0.90, 1.12, 1.24, 1.32, 1.41, 1.45, 1.49)
#: How far a_ik * a_ki may be from 1 in a matrix that was printed with few digits.
RECIPROCAL_TOLERANCE = 0.02
#: How people's judgements of a pair become one: see `aggregated`.
AGGREGATIONS = ("median", "geometric_mean")


@dataclass(frozen=True)
class Comparison:
    """One framing's matrix (n, n): matrix[i, k] says how much items[i] is preferred to items[k].

    It is NaN where nobody compared the two.
    """

    items: tuple[str, ...]
    matrix: np.ndarray

    @property
    def missing(self) -> list[tuple[str, str]]:
        """The pairs that nobody compared."""
        return [
            (a, b)
            for (i, a), (k, b) in combinations(enumerate(self.items), 2)
            if np.isnan(self.matrix[i, k])
        ]


@dataclass(frozen=True)
class Priorities:
    """vector (n,) sums to 1; ci = (lambda_max - n)/(n - 1); cr = ci / RI, None beyond 10 items,
    where there is no RI.
    """

    vector: np.ndarray
    lambda_max: float
    ci: float
    cr: float | None

    @property
    def verdict(self) -> str:
        if self.cr is None:
            return "no consistency ratio: there is no random index beyond 10 items"
        if len(self.vector) < 3:
            return "one judgement, which nothing can contradict"
        if self.cr >= 0.1:
            return "incoherent: from 0.1 on, the method of asking should change"
        return "coherent" if self.cr < 0.01 else "acceptably coherent (below 0.1)"

    def sentence(self, chance: float = np.nan) -> str:
        """Saaty's verdict in words; chance: the share of answers without any preference that look
        as coherent, NaN where it is not known.
        """
        if self.cr is None:
            return f"There is {self.verdict}."
        if len(self.vector) < 3:
            return f"Two techniques have {self.verdict}: CR says nothing."
        words = f"The judgements are {self.verdict} by Saaty's rule, CR {self.cr:z.3f}"
        if np.isnan(chance):
            return words + "."
        return (
            f"{words}; of random answers of this design, directions settled by a coin, "
            f"{100 * chance:.0f} % have a CR as low"
            + (", so that it shows no coherence." if chance > 0.05 else ".")
        )


def judgements(preference: np.ndarray) -> np.ndarray:
    """Preferences, -2 (strong for a) to 2 (strong for b), as judgements of a over b: 3, 2, 1, 1/2,
    1/3.
    """
    preference = np.asarray(preference)
    scale = 1.0 + np.abs(preference)
    return np.where(preference > 0, 1 / scale, scale)


def medians(responses: Responses) -> pd.DataFrame:
    """framing, a, b, n, median_preference (-2 to 2, negative prefers a), median_judgement (of a
    over b), one row a pair.

    a comes before b in the order of techniques: this is the triangle above the diagonal.
    """
    frame = responses.frame
    frame = frame[["framing", "a", "b", "preference"]].assign(
        judgement=judgements(frame.preference)
    )
    table = frame.groupby(["framing", "a", "b"], observed=True).agg(
        n=("preference", "size"),
        median_preference=("preference", "median"),
        median_judgement=("judgement", "median"),
    )
    return table.reset_index().astype(dict.fromkeys(("framing", "a", "b"), object))


def comparisons(responses: Responses) -> dict[str, Comparison]:
    """Framing -> matrix of medians, taken above the diagonal in the order of techniques and
    inverted below.

    The order matters: the median of 1 and 2 is 1.5, and 0.75 the other way, which is not 1/1.5.
    """
    table = medians(responses)
    result = {}
    for framing, items in responses.items.items():
        matrix = np.full((len(items), len(items)), np.nan)
        np.fill_diagonal(matrix, 1.0)
        for row in table[table.framing == framing].itertuples():
            i, k = items.index(row.a), items.index(row.b)
            matrix[i, k], matrix[k, i] = row.median_judgement, 1 / row.median_judgement
        result[framing] = Comparison(items, matrix)
    return result


def priorities(matrix: np.ndarray) -> Priorities:
    """The principal eigenvector of a positive, reciprocal matrix (n, n), scaled to sum 1, and its
    consistency.

    Reciprocal: a_ik a_ki = 1 within `RECIPROCAL_TOLERANCE`, which a matrix printed with few digits
    keeps; of another one lambda_max may be below n and a consistency ratio means nothing.
    """
    matrix = np.asarray(matrix, float)
    n = len(matrix)
    if matrix.shape != (n, n) or n == 0 or not (np.isfinite(matrix) & (matrix > 0)).all():
        raise InputError(
            f"a matrix of shape {matrix.shape} has no priorities; expected it square, "
            "complete and positive"
        )
    refuse_unless_reciprocal("the matrix", matrix, range(1, n + 1))
    values, vectors = np.linalg.eig(matrix)
    principal = np.argmax(values.real)
    vector = np.abs(vectors[:, principal].real)
    lambda_max = float(values[principal].real)
    ci = (lambda_max - n) / (n - 1) if n > 2 and abs(lambda_max - n) > 1e-12 * n else 0.0
    if n > len(RANDOM_INDEX):
        cr = None
    else:
        cr = ci / RANDOM_INDEX[n - 1] if n > 2 else 0.0
    return Priorities(vector / vector.sum(), lambda_max, ci, cr)


def refuse_unless_reciprocal(name: str, matrix: np.ndarray, items: Sequence[object]) -> None:
    """An InputError that names the worst pair, where a_ik a_ki is not 1 or a diagonal is not 1."""
    off = np.abs(matrix * matrix.T - 1)
    if off.max() > RECIPROCAL_TOLERANCE:
        i, k = np.unravel_index(np.argmax(off), off.shape)
        raise InputError(
            f"{name} is not reciprocal: {items[i]} over {items[k]} is {matrix[i, k]:g} and "
            f"the other way {matrix[k, i]:g}, "
            f"their product is {matrix[i, k] * matrix[k, i]:g}, expected 1 within "
            f"{RECIPROCAL_TOLERANCE}"
        )


def priorities_table(comparisons: Mapping[str, Comparison]) -> pd.DataFrame:
    """framing, technique, priority, lambda_max, ci, cr; empty numbers where a framing's pairs are
    incomplete.
    """
    rows = []
    for framing, comparison in comparisons.items():
        if comparison.missing:
            rows += [(framing, name, np.nan, np.nan, np.nan, np.nan) for name in comparison.items]
            continue
        result = priorities(comparison.matrix)
        cr = np.nan if result.cr is None else result.cr
        rows += [
            (framing, name, priority, result.lambda_max, result.ci, cr)
            for name, priority in zip(comparison.items, result.vector, strict=True)
        ]
    return pd.DataFrame(
        rows, columns=["framing", "technique", "priority", "lambda_max", "ci", "cr"]
    )


def row_geometric_mean(matrix: np.ndarray) -> np.ndarray:
    """matrix (..., n, n) -> (..., n): the geometric mean of each row, scaled to sum 1 (Crawford and
    Williams 1985).
    """
    logs = np.log(np.asarray(matrix, float)).mean(axis=-1)
    weight = np.exp(logs - logs.max(axis=-1, keepdims=True))
    return weight / weight.sum(axis=-1, keepdims=True)


def look_again(comparison: Comparison) -> tuple[str, str, float, float] | None:
    """a, b, the judgement of a over b, and what the other judgements imply: the one that departs
    most from the priorities.

    The largest |log(a_ij w_j/w_i)| (Saaty 2003, doi:10.1016/S0377-2217(02)00227-8); None where all
    agree or a pair is missing.
    """
    if comparison.missing or len(comparison.items) < 3:
        return None
    vector = priorities(comparison.matrix).vector
    implied = vector[:, None] / vector
    off = np.triu(np.abs(np.log(comparison.matrix / implied)), 1)
    i, j = np.unravel_index(np.argmax(off), off.shape)
    if off[i, j] < 1e-9:
        return None
    return (
        comparison.items[i],
        comparison.items[j],
        float(comparison.matrix[i, j]),
        float(implied[i, j]),
    )


def aggregated(panel: Panel, counts: np.ndarray, aggregation: str) -> np.ndarray:
    """counts (..., K, 5) -> (..., n, n): matrices of 'median' or 'geometric_mean' judgements, NaN
    where a pair has no answer.

    The median is taken above the diagonal and inverted below, as in `comparisons`; the geometric
    mean needs no such rule.
    """
    counts = by_pair(panel, counts)
    scale = judgements(np.arange(-2, 3))
    if aggregation == "median":
        above = bootstrap.median(counts, scale)
    else:
        n = counts.sum(axis=-1)
        above = np.exp(
            np.divide(counts @ np.log(scale), n, out=np.full(n.shape, np.nan), where=n > 0)
        )
    items = len(panel.items)
    i, j = np.triu_indices(items, 1)
    matrix = np.ones((*above.shape[:-1], items, items))
    matrix[..., i, j], matrix[..., j, i] = above, 1 / above
    return matrix


def priority_intervals(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, aggregation, method, technique, priority, low, high; empty numbers where a pair has
    no answer.

    aggregation: 'median' (the thesis's) or 'geometric_mean' of people's judgements; method:
    'eigenvector' or 'row_geometric_mean'.
    """
    rows, notes = [], bootstrap.few(responses)
    for name, panel in panels(responses).items():
        for aggregation in AGGREGATIONS:
            matrix, drawn = _matrices(panel, aggregation, options)
            if np.isnan(matrix).any():
                notes.append(f"{name}: no priorities: a pair has no answer")
            for method, solve in (
                ("eigenvector", lambda one: _principal(one)[0]),
                ("row_geometric_mean", row_geometric_mean),
            ):
                low, high = bootstrap.interval(solve(drawn), panel.people, options.level)
                values = zip(panel.items, solve(matrix), low, high, strict=True)
                rows += [(name, aggregation, method, *value) for value in values]
    return with_notes(
        rows, ["framing", "aggregation", "method", "technique", "priority", "low", "high"], notes
    )


def consistency_intervals(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, aggregation, ci, ci_low, ci_high, cr, cr_low, cr_high, a, b, judgement, consistent,
    chance_cr, chance_share.

    chance_cr, chance_share: the median CR of studies of the same design and strengths whose
    directions are settled by a coin, and the share of them whose CR is as low; see `chance`.
    a, b, judgement, consistent: where CR is at least 0.1, the judgement to look at again and what
    the others imply; else empty. cr is empty beyond 10 techniques, where there is no random index.
    """
    columns = [
        "framing",
        "aggregation",
        "ci",
        "ci_low",
        "ci_high",
        "cr",
        "cr_low",
        "cr_high",
        "a",
        "b",
        "judgement",
        "consistent",
        "chance_cr",
        "chance_share",
    ]
    rows, notes = [], bootstrap.few(responses)
    for name, panel in panels(responses).items():
        n = len(panel.items)
        index = RANDOM_INDEX[n - 1] if n <= len(RANDOM_INDEX) else np.nan
        if n > len(RANDOM_INDEX):
            notes.append(
                f"{name}: no consistency ratio: there is no random index beyond "
                f"{len(RANDOM_INDEX)} items, got {n}"
            )
        by_chance = chance(panel, options)
        for aggregation in AGGREGATIONS:
            matrix, drawn = _matrices(panel, aggregation, options)
            ci = _index(matrix)
            bounds = bootstrap.interval(_index(drawn), panel.people, options.level)
            ratio = [float(one) / index if index else float(one) for one in (ci, *bounds)]
            drawn_ratio = _index(aggregated(panel, by_chance, aggregation)) / (index or 1.0)
            known = np.isfinite(drawn_ratio)
            random_cr = share = np.nan
            if n > 2 and known.any() and np.isfinite(ratio[0]):
                random_cr = float(np.median(drawn_ratio[known]))
                share = float((drawn_ratio[known] <= ratio[0] + 1e-12).mean())
            again = look_again(Comparison(panel.items, matrix)) if ratio[0] >= 0.1 else None
            rows.append(
                (
                    name,
                    aggregation,
                    float(ci),
                    *map(float, bounds),
                    *ratio,
                    *(again or ("", "", np.nan, np.nan)),
                    random_cr,
                    share,
                )
            )
    return with_notes(rows, columns, notes)


def chance(panel: Panel, options: Options) -> np.ndarray:
    """(resamples, K, 5): the panel's counts with the direction of every answer settled by a fair
    coin and its strength kept: studies of the same design in which nothing is preferred.

    On a scale that stops at 3 the medians of many such people lie near 1 and look coherent, so that
    a low CR alone says little.
    """
    counts = panel.counts.astype(int)
    rng = np.random.default_rng([options.seed, 21])
    drawn = np.zeros((options.resamples, *counts.shape))
    drawn[..., 2] = counts[:, 2]
    for low, high in ((1, 3), (0, 4)):
        total = counts[:, low] + counts[:, high]
        drawn[..., low] = rng.binomial(total, 0.5, (options.resamples, len(total)))
        drawn[..., high] = total - drawn[..., low]
    return drawn


def _matrices(panel: Panel, aggregation: str, options: Options) -> tuple[np.ndarray, np.ndarray]:
    return tuple(
        aggregated(panel, counts, aggregation)
        for counts in (panel.counts, bootstrap.counts(panel, options))
    )


def _principal(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """matrix (..., n, n) -> principal eigenvectors (..., n), sum 1, and eigenvalues (...); NaN
    where a matrix has one.
    """
    whole = np.isfinite(matrix).all(axis=(-2, -1))
    values, vectors = np.linalg.eig(np.where(whole[..., None, None], matrix, 1.0))
    top = np.argmax(values.real, axis=-1)[..., None]
    vector = np.abs(np.take_along_axis(vectors, top[..., None, :], axis=-1)[..., 0].real)
    vector = np.where(whole[..., None], vector / vector.sum(axis=-1, keepdims=True), np.nan)
    return vector, np.where(whole, np.take_along_axis(values.real, top, axis=-1)[..., 0], np.nan)


def _index(matrix: np.ndarray) -> np.ndarray:
    """matrix (..., n, n) -> (...): the consistency index, 0 for one or two items."""
    n = matrix.shape[-1]
    if n < 3:
        return np.where(np.isfinite(matrix).all(axis=(-2, -1)), 0.0, np.nan)
    return np.maximum((_principal(matrix)[1] - n) / (n - 1), 0.0)


def read_matrices(path: str | Path) -> dict[str, Comparison]:
    """Framing -> matrix, from a TOML file: `items = [names]`, then for each framing `[matrix.NAME]`
    with `rows = [[...]]`.
    """
    path = Path(path)
    try:
        table = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{path}: not TOML in UTF-8: {' '.join(str(error).split())}") from None
    items = table.get("items")
    if (
        not isinstance(items, list)
        or not items
        or not all(isinstance(name, str) and name for name in items)
        or len(set(items)) < len(items)
    ):
        raise InputError(f"{path}: items is {items!r:.60}, expected a list of different names")
    matrices = table.get("matrix")
    if not isinstance(matrices, dict) or not matrices:
        raise InputError(
            f"{path}: matrix is {matrices!r:.60}, expected a table [matrix.NAME] for each framing"
        )
    return {
        framing: Comparison(tuple(items), _matrix(f"{path}: matrix.{framing}", entry, items))
        for framing, entry in matrices.items()
    }


def _matrix(name: str, entry: object, items: Sequence[str]) -> np.ndarray:
    """The rows of one matrix, checked: square, numbers, positive, reciprocal."""
    rows = entry.get("rows") if isinstance(entry, dict) else None
    if not isinstance(rows, list) or len(rows) != len(items):
        got = f"{len(rows)} rows" if isinstance(rows, list) else f"{rows!r:.60}"
        raise InputError(
            f"{name}.rows is {got}, expected {len(items)} rows, one for each of the items"
        )
    for i, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != len(items):
            got = f"{len(row)} numbers" if isinstance(row, list) else f"{row!r:.60}"
            raise InputError(f"{name}.rows[{i}] has {got}, expected {len(items)}")
        for k, value in enumerate(row):
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not 0 < value < float("inf"):
                raise InputError(
                    f"{name}.rows[{i}][{k}] is {value!r:.60}, expected a positive number"
                )
    matrix = np.array(rows, float)
    refuse_unless_reciprocal(name, matrix, items)
    return matrix
