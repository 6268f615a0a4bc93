"""Differences of worths from all answers of a framing at once, beside the tests of single pairs.

The worths are those of a linear model of the answers, -2 to 2: answer = w_b - w_a + error, by least
squares, with people as clusters (Liang and Zeger 1986, doi:10.1093/biomet/73.1.13, with the factor
P/(P - 1) and Student's t with P - 1 degrees of freedom). Where worths add up, all pairs together
say more of a difference than the pair alone; `omnibus` tests whether they do.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from analysis.inference.people import holm_in_families
from analysis.options import FEWEST_PEOPLE, Options
from analysis.panel import Panel, panels, with_notes
from analysis.responses import Responses


def contrasts(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, a, b, estimate, low, high, p, holm_p: the difference in points, positive for b, from
    all answers of the framing; holm_p over the declared family.
    """
    rows, notes = [], []
    for name, panel in panels(responses).items():
        if panel.people < FEWEST_PEOPLE:
            notes.append(
                f"{name}: {panel.people} participants: no contrasts, which need {FEWEST_PEOPLE}"
            )
            continue
        chosen = list(combinations(range(len(panel.items)), 2))
        here = panel.chosen(panel.answered.any(axis=1))
        estimate, error = (
            one[0]
            for one in linear_contrasts(
                np.where(here.answered, here.preference, 0)[None],
                here.answered[None],
                ends(here),
                [(j, i) for i, j in chosen],
            )
        )
        if not (error > 0).any():
            notes.append(f"{name}: no contrasts: groups were never compared, or nobody differs")
        with np.errstate(divide="ignore", invalid="ignore"):
            p = np.where(
                error > 0, 2 * stats.t.sf(np.abs(estimate) / error, panel.people - 1), np.nan
            )
        half = stats.t.ppf((1 + options.level) / 2, panel.people - 1) * error
        values = np.stack([estimate, estimate - half, estimate + half, p], axis=1)
        values[~(error > 0)] = np.nan
        rows += [
            (name, panel.items[i], panel.items[j], *values[k], np.nan)
            for k, (i, j) in enumerate(chosen)
        ]
    table = with_notes(rows, ["framing", "a", "b", "estimate", "low", "high", "p", "holm_p"], notes)
    table["holm_p"] = holm_in_families(table, options)
    return table


def ends(panel: Panel) -> np.ndarray:
    """(K, n): the matrix that takes worths to each question's difference, second less first."""
    return np.eye(len(panel.items))[panel.second] - np.eye(len(panel.items))[panel.first]


def linear_contrasts(
    answers: np.ndarray, asked: np.ndarray, ends: np.ndarray, chosen: list[tuple[int, int]]
) -> tuple[np.ndarray, np.ndarray]:
    """answers (S, P, K) of S studies, 0 where not `asked` (S, P, K) bool; ends (K, n) -> estimate
    and standard error (S, len(chosen)) of worth i less worth j for each (i, j) chosen.

    The error is 0 where a study leaves some technique unreached from another.
    """
    n, people = ends.shape[1], answers.shape[1]
    counts = asked.sum(axis=1)
    laplace = np.einsum("sk,ki,kj->sij", counts.astype(float), ends, ends, optimize=True)
    whole = np.linalg.eigvalsh(laplace)[:, 1] > 1e-9 if n > 1 else np.ones(len(answers), bool)
    inverse = np.linalg.inv(laplace + 1 + (~whole)[:, None, None] * np.eye(n))
    worths = np.einsum("sij,sj->si", inverse, answers.sum(axis=1, dtype=np.int64) @ ends)
    fitted = worths @ ends.T  # (S, K)
    estimate = np.stack([worths[:, i] - worths[:, j] for i, j in chosen], axis=1)
    error = np.empty_like(estimate)
    shown, present = answers.astype(np.float32), asked.astype(np.float32)
    for place, (i, j) in enumerate(chosen):
        lever = (inverse[:, i] - inverse[:, j]) @ ends.T  # (S, K)
        parts = np.einsum("spk,sk->sp", shown, lever.astype(np.float32))
        parts -= np.einsum("spk,sk->sp", present, (lever * fitted).astype(np.float32))
        error[:, place] = np.sqrt(
            (parts.astype(float) ** 2).sum(axis=1) * people / max(people - 1, 1)
        )
    return estimate, np.where(whole[:, None], error, 0.0)
