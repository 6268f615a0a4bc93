"""Questions about a whole framing, or all of them, before any pair is singled out.

techniques    whether any technique is preferred to another on average: each person's net points for
              every technique, against none
additivity    whether worths add up: what is left of each person's answers when the differences of
              worths that fit them best are taken off; a small p says that no scale of worths
              describes the pairs, whatever its link; over all framings, of a person's means
interaction   whether the order of techniques changes from framing to framing: each person's net
              points at each framing less their mean over framings

All by flipping the sign of a person's whole vector by a fair coin (Fisher's randomisation test for
one sample), so that answers of one person hang together as they did.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.inference.pairs import preferences
from analysis.inference.people import sign_flip
from analysis.options import FEWEST_PEOPLE, OVERALL, Options
from analysis.panel import Panel, panels, with_notes
from analysis.responses import Responses
from analysis.worth.binary import differences


def omnibus(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, question, people, size, p: see the module; size: the length of the mean vector,
    points an answer. The interaction stands at 'overall'.
    """
    rows, notes = [], []
    made = panels(responses)
    for name, panel in made.items():
        here = panel.answered.any(axis=1)
        if here.sum() < FEWEST_PEOPLE:
            notes.append(
                f"{name}: {here.sum()} participants: no omnibus test, which needs {FEWEST_PEOPLE}"
            )
            continue
        vectors = _net(panel)[here]
        rows.append((name, "techniques", here.sum(), *sign_flip(vectors, options, 11)))
        left = _unexplained(panel)[here]
        if np.abs(left).max(initial=0) > 1e-9:
            rows.append((name, "additivity", here.sum(), *sign_flip(left, options, 12)))
    parts = [panel for name, panel in made.items() if name != OVERALL]
    if len(parts) > 1:
        together = _interaction(parts)
        if together is None:
            notes.append(
                f"no test of the interaction of technique and {responses.codebook.level}: fewer "
                f"than {FEWEST_PEOPLE} participants answered at every one"
            )
        else:
            size, p = sign_flip(together, options, 13)
            rows.append((OVERALL, "interaction", len(together), size, p))
    return with_notes(rows, ["framing", "question", "people", "size", "p"], notes)


def _net(panel: Panel) -> np.ndarray:
    """(P, n): points for less points against each technique, an answer; 0 where never judged."""
    first, second = (np.eye(len(panel.items))[side] for side in (panel.first, panel.second))
    given = np.where(panel.answered, panel.preference, 0).astype(float)
    asked = panel.answered @ (first + second)
    return np.divide(
        given @ (second - first), asked, out=np.zeros(asked.shape, float), where=asked > 0
    )


def _unexplained(panel: Panel) -> np.ndarray:
    """(P, pairs): each person's answers, the mean where asked about a pair several times, less the
    differences of worths that fit them best.
    """
    x = differences(len(panel.items))
    given = preferences(panel)
    known = np.isfinite(given)
    left = np.zeros(given.shape)
    whole = known.all(axis=1)
    left[whole] = given[whole] - given[whole] @ (x @ np.linalg.pinv(x))
    for row in np.flatnonzero(~whole & known.any(axis=1)):
        here = known[row]
        left[row, here] = given[row, here] - given[row, here] @ (x[here] @ np.linalg.pinv(x[here]))
    return left


def _interaction(parts: list[Panel]) -> np.ndarray | None:
    """(P, framings * techniques): net points at each framing less their mean over framings, of
    those who answered at every one; of the techniques that all framings share.
    """
    common = [item for item in parts[0].items if all(item in part.items for part in parts)]
    people = set(parts[0].participants[parts[0].answered.any(axis=1)])
    for part in parts[1:]:
        people &= set(part.participants[part.answered.any(axis=1)])
    if len(people) < FEWEST_PEOPLE or len(common) < 2:
        return None
    nets = []
    for part in parts:
        rows = np.array([name in people for name in part.participants])
        nets.append(_net(part)[np.ix_(rows, [part.items.index(item) for item in common])])
    nets = np.stack(nets, axis=1)  # (P, framings, techniques)
    return (nets - nets.mean(axis=1, keepdims=True)).reshape(len(nets), -1)
