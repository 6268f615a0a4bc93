"""Which fits exist, and why one does not, in words."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from analysis.options import FEWEST_PEOPLE
from analysis.panel import Panel, tied, wins
from analysis.worth.binary import reachable
from analysis.worth.categories import recoded
from analysis.worth.ties import FEATURES

BINARY = ("bradley_terry", "thurstone_jod")


def missing_fit(panel: Panel, model: str, ties: str = "half") -> str | None:
    """Why the model has no finite maximum of the likelihood for this panel, in words; None where it
    has one. ties: how bradley_terry and thurstone_jod take 'no difference'.
    """
    return impossible(panel, model) or no_maximum(panel, model, ties)


def impossible(panel: Panel, model: str) -> str | None:
    """Why nothing can be estimated, not even with a penalty; None where something can."""
    strict, level = wins(panel, panel.counts, "drop"), tied(panel, panel.counts)
    if not strict.any():
        return "every answer is 'no difference'"
    compared = strict + level
    first = reachable((compared + compared.T)[None])[0, 0]
    if not first.all():
        return (
            f"{_names(panel, first)} and {_names(panel, ~first)} were never "
            "compared, not even through others"
        )
    if model == "ordinal" and panel.people < FEWEST_PEOPLE:
        return (
            f"{panel.people} participants; what they share and what is their own needs "
            f"{FEWEST_PEOPLE}"
        )
    return confounded_side(panel) if model == "ordinal" else None


def no_maximum(panel: Panel, model: str, ties: str = "half") -> str | None:
    """Why the likelihood grows without end, in words; None where it has a finite maximum.

    The rule is that of the declared handling of ties: where 'no difference' is half a win for each,
    a technique that was tied is neither unbeaten nor without a win. davidson and ordinal, which
    model ties, are checked exactly: no direction of the parameters may raise or keep the likelihood
    of every answer.
    """
    strict, level = wins(panel, panel.counts, "drop"), tied(panel, panel.counts)
    edges = wins(panel, panel.counts, ties) if model in BINARY else strict + level
    leads = reachable(edges[None])[0]
    if not leads.all():
        ends = [
            (inside.sum(), order, never, inside)
            for inside in np.unique(leads & leads.T, axis=0)
            for order, (never, matrix) in enumerate(
                (("beaten by", edges), ("preferred to", edges.T))
            )
            if not matrix[np.ix_(~inside, inside)].any()
        ]
        # a group at an end of the chain; the smallest is the one to name
        _, _, never, inside = min(ends, key=lambda one: one[:2])
        tie = "" if model in BINARY and ties == "drop" else " or tied with them"
        return (
            f"{_names(panel, inside)} {'was' if inside.sum() == 1 else 'were'} never "
            f"{never} {_names(panel, ~inside)}{tie}"
        )
    if model in ("davidson", "ordinal") and _separated(panel, model):
        return (
            "the answers are separated: worths and thresholds can grow together without "
            "end and only fit better"
        )
    return None


def confounded_side(panel: Panel) -> str | None:
    """Why a preference for a side cannot be told from one for a technique: every pair was shown one
    way round only. None where some pair was shown both ways, or nobody answered twice.
    """
    shown, first_left = panel.answered.sum(axis=0), (panel.first_left & panel.answered).sum(axis=0)
    if shown.max(initial=0) < 2 or ((first_left > 0) & (first_left < shown)).any():
        return None
    left = np.where(first_left > 0, panel.first, panel.second)
    right = np.where(first_left > 0, panel.second, panel.first)
    one_side = [
        f"{item} was always on the {'left' if at in left else 'right'}"
        for at, item in enumerate(panel.items)
        if (at in left) != (at in right)
    ]
    return "side is confounded with technique: every pair was always shown the same way round" + (
        f" ({'; '.join(one_side)})" if one_side else ""
    )


def _names(panel: Panel, chosen: np.ndarray) -> str:
    return ", ".join(name for name, one in zip(panel.items, chosen, strict=True) if one)


def _separated(panel: Panel, model: str) -> bool:
    """Whether a direction of recession exists: one that lowers the likelihood of no observed answer
    and raises that of some.
    """
    x = np.eye(len(panel.items))[panel.second] - np.eye(len(panel.items))[panel.first]
    if model == "davidson":
        sign = np.sign(np.arange(-2, 3))
        seen = {(k, int(sign[c])) for k, c in zip(*np.nonzero(panel.counts), strict=True)}
        if not any(answer == 0 for _, answer in seen):
            return False  # then it is Bradley-Terry, which is connected
        # Of e^(-d/2) : nu : e^(d/2) the observed one must not lose against either other.
        features = dict(zip((1, -1, 0), FEATURES, strict=True))
        rows = [
            [
                *(features[answer][0] - features[other][0]) * x[k],
                features[answer][1] - features[other][1],
            ]
            for k, answer in seen
            for other in features
            if other != answer
        ]
        size = len(panel.items) + 1
    else:
        rank, cuts, _ = recoded(panel)
        size = len(panel.items) + 1 + cuts.shape[1]
        rows = []
        for left in (True, False):
            for k in range(len(x)):
                eta = [*x[k], 1.0 if left else -1.0]
                for category in np.unique(
                    rank[:, k][panel.answered[:, k] & (panel.first_left[:, k] == left)]
                ):
                    if category < len(cuts):
                        rows.append([*(-np.array(eta)), *cuts[category]])
                    if category > 0:
                        rows.append([*eta, *(-cuts[category - 1])])
    rows = np.array(rows)
    solution = optimize.linprog(
        -rows.sum(axis=0),
        A_ub=-rows,
        b_ub=np.zeros(len(rows)),
        bounds=[(-1, 1)] * size,
        method="highs",
    )
    return bool(-solution.fun > 1e-7)
