"""The five answers as ordered categories: only the strengths that were used have one."""

from __future__ import annotations

import numpy as np

from analysis.panel import Panel


def recoded(panel: Panel) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Only the strengths that were used have a category of their own.

    Category of each answer (P, K), counted from 0; cuts (categories - 1, m): the cuts as sums of m
    positive increments; their names.
    """
    used = np.unique(np.abs(panel.preference[panel.answered].astype(int)))
    labels = {1: "threshold_slight", 2: "threshold_strong"}
    positive = [strength for strength in used if strength > 0]
    rank = np.searchsorted(used, np.abs(panel.preference.astype(int)))
    sign = np.sign(panel.preference.astype(int))
    if used[0] == 0:
        category = sign * rank + len(positive)
        m = len(positive)
        upper = np.tril(np.ones((m, m)))
        return (
            np.where(panel.answered, category, 0),
            np.concatenate([-upper[::-1], upper]),
            tuple(labels[s] for s in positive),
        )
    m = len(positive) - 1
    category = np.where(sign > 0, rank + m + 1, m - rank)
    upper = np.tril(np.ones((m, m)))
    cuts = np.concatenate([-upper[::-1], np.zeros((1, m)), upper])
    return np.where(panel.answered, category, 0), cuts, tuple(labels[s] for s in positive[1:])
