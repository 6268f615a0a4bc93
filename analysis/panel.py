"""The answers of one framing as matrices, one row a participant and one column a question: what the
statistics compute on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from analysis.codebook import FRAMING
from analysis.errors import InputError
from analysis.options import OVERALL
from analysis.responses import Responses, questions

#: In `Panel.preference`, where a participant was not asked.
MISSING = -128
#: The five preferences, in the order of every array of counts: strong and slight for a, none,
#: slight and strong for b.
PREFERENCES = np.arange(-2, 3)


@dataclass(frozen=True)
class Panel:
    """One framing, or level of another factor, or all of them together.

    framing       its name, or 'overall'
    items         (n,) the techniques that have answers here, in the order of the codebook
    participants  (P,) the names of all participants of the study, the same rows in every panel; at
                  a level of another factor than 'framing' of those who answered there
    first, second (K,) int: the pair of each question as indices into items, first < second; a pair
    comes once a framing
    preference    (P, K) int8: -2 strong for first ... 2 strong for second, MISSING where not
                  answered
    first_left    (P, K) bool: first was shown on the left
    joined        the panels that this one puts side by side, none where a pair comes once
    """

    framing: str
    items: tuple[str, ...]
    participants: np.ndarray
    first: np.ndarray
    second: np.ndarray
    preference: np.ndarray
    first_left: np.ndarray
    joined: tuple[Panel, ...] = ()

    @property
    def parts(self) -> tuple[Panel, ...]:
        """Panels with the same rows in which a pair comes once."""
        return self.joined or (self,)

    @cached_property
    def answered(self) -> np.ndarray:
        """(P, K) bool."""
        return self.preference != MISSING

    @cached_property
    def people(self) -> int:
        """How many participants answered here."""
        return int(self.answered.any(axis=1).sum())

    @cached_property
    def kept(self) -> dict:
        """Results that several tables need, by what they depend on."""
        return {}

    @cached_property
    def indicators(self) -> np.ndarray:
        """(P, K, 5) float32: 1 at the answer given; sums over participants are counts."""
        return (self.preference[:, :, None] == PREFERENCES).astype(np.float32)

    @cached_property
    def counts(self) -> np.ndarray:
        """(K, 5) float: answers per question, in the order of `PREFERENCES`."""
        return np.stack(
            [(self.preference == value).sum(axis=0) for value in PREFERENCES], axis=1
        ).astype(float)

    def chosen(self, rows: np.ndarray) -> Panel:
        """The same panel of some participants, or of some several times: rows are indices or a
        mask.
        """
        return Panel(
            self.framing,
            self.items,
            self.participants[rows],
            self.first,
            self.second,
            self.preference[rows],
            self.first_left[rows],
            tuple(part.chosen(rows) for part in self.joined),
        )


def panels(responses: Responses, overall: bool = True) -> dict[str, Panel]:
    """Framing -> its panel, made once; with several framings and `overall`, 'overall' last. A
    framing of that name is refused.
    """
    made = vars(responses).setdefault(
        "_panels", {}
    )  # beside the cached properties of the frozen table
    if not made:
        made.update(_panels(responses))
    return {name: panel for name, panel in made.items() if overall or name != OVERALL}


def _panels(responses: Responses) -> dict[str, Panel]:
    frame, factor = responses.frame, responses.codebook.factor
    if OVERALL in responses.items:
        level, levels = responses.codebook.level, responses.codebook.levels
        raise InputError(
            f"a {level} is called {OVERALL!r}, the name of all {levels} together; expected "
            "another name"
        )
    names = frame.participant.cat.categories.to_numpy()
    rows, level, image, a, b = (
        frame[name].cat.codes.to_numpy()
        for name in ("participant", "framing", "image_framing", "a", "b")
    )
    techniques = responses.codebook.techniques

    def panel_of(name: str, here: np.ndarray) -> Panel:
        return _panel(
            name,
            techniques,
            names,
            rows[here],
            a[here].astype(int),
            b[here].astype(int),
            frame[here],
        )

    parts = {
        name: [
            panel_of(name, (level == place) & (image == one))
            for one in np.unique(image[level == place])
        ]
        for place, name in enumerate(responses.codebook.framings)
        if name in responses.items
    }
    result = {name: _joined(name, techniques, here) for name, here in parts.items()}
    if factor != FRAMING:
        result = {name: panel.chosen(panel.answered.any(axis=1)) for name, panel in result.items()}
    if len(result) > 1:
        every = [part for here in parts.values() for part in here]
        if factor != FRAMING and "framing" not in questions(frame, responses.codebook):
            every = [panel_of(OVERALL, image == one) for one in np.unique(image)]
        result[OVERALL] = _joined(OVERALL, techniques, every)
    return result


def _panel(name, techniques, names, rows, a, b, frame: pd.DataFrame) -> Panel:
    keys, column = np.unique(a * len(techniques) + b, return_inverse=True)
    first, second = np.divmod(keys, len(techniques))
    seen = np.union1d(first, second)
    preference = np.full((len(names), len(keys)), MISSING, np.int8)
    left = np.zeros((len(names), len(keys)), bool)
    preference[rows, column] = frame.preference.to_numpy()
    left[rows, column] = frame.a_left.to_numpy()
    items = tuple(techniques[place] for place in seen)
    return Panel(
        name,
        items,
        names,
        np.searchsorted(seen, first),
        np.searchsorted(seen, second),
        preference,
        left,
    )


def _joined(name: str, techniques: tuple[str, ...], parts: list[Panel]) -> Panel:
    """The questions of all parts side by side."""
    if len(parts) == 1:
        return replace(parts[0], framing=name)
    seen = {item for part in parts for item in part.items}
    items = tuple(item for item in techniques if item in seen)
    first, second = (
        np.concatenate(
            [[items.index(part.items[at]) for at in getattr(part, side)] for part in parts]
        )
        for side in ("first", "second")
    )
    preference = np.concatenate([part.preference for part in parts], axis=1)
    left = np.concatenate([part.first_left for part in parts], axis=1)
    return Panel(name, items, parts[0].participants, first, second, preference, left, tuple(parts))


def wins(panel: Panel, counts: np.ndarray, ties: str = "half") -> np.ndarray:
    """counts (..., K, 5) -> (..., n, n): how often item i was preferred to item j; ties are 'half'
    a win for each, or 'drop'ped.
    """
    half = 0.5 * counts[..., 2] if ties == "half" else 0.0
    over, under = counts[..., 0] + counts[..., 1] + half, counts[..., 3] + counts[..., 4] + half
    return _placed(panel, over) + np.swapaxes(_placed(panel, under), -1, -2)


def tied(panel: Panel, counts: np.ndarray) -> np.ndarray:
    """counts (..., K, 5) -> (..., n, n), symmetric: how often no difference was seen between i and
    j.
    """
    table = _placed(panel, counts[..., 2])
    return table + np.swapaxes(table, -1, -2)


def by_pair(panel: Panel, counts: np.ndarray) -> np.ndarray:
    """counts (..., K, 5) -> (..., n (n - 1)/2, 5): one row a pair i < j, in the order of
    numpy.triu_indices(n, 1); zeros if never asked.
    """
    n = len(panel.items)
    rank = np.zeros((n, n), int)
    rank[np.triu_indices(n, 1)] = range(n * (n - 1) // 2)
    places = np.zeros((n * (n - 1) // 2, len(panel.first)))
    places[rank[panel.first, panel.second], np.arange(len(panel.first))] = 1
    return np.einsum("pk,...kc->...pc", places, counts, optimize=True)


def _placed(panel: Panel, values: np.ndarray) -> np.ndarray:
    """values (..., K) added into (..., n, n) at (first, second)."""
    n = len(panel.items)
    places = np.zeros((len(panel.first), n * n))
    places[np.arange(len(panel.first)), panel.first * n + panel.second] = 1
    return (values @ places).reshape(*values.shape[:-1], n, n)


def with_notes(rows: Iterable, columns: Iterable[str], notes: Iterable[str] = ()) -> pd.DataFrame:
    """A table whose attrs['notes'] say, one line each, what was refused and why, and which variant
    was used.
    """
    table = pd.DataFrame(list(rows), columns=list(columns))
    table.attrs["notes"] = tuple(dict.fromkeys(notes))
    return table
