"""The answers of one framing as matrices, one row a participant and one column a question: what the statistics compute on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from .errors import InputError
from .options import OVERALL
from .responses import Responses

#: In `Panel.preference`, where a participant was not asked.
MISSING = -128
#: The five preferences, in the order of every array of counts: strong and slight for a, none, slight and strong for b.
PREFERENCES = np.arange(-2, 3)


@dataclass(frozen=True)
class Panel:
    """One framing, or all framings together.

    framing       its name, or 'overall'
    items         (n,) the techniques that have answers here, in the order of the codebook
    participants  (P,) the names of all participants of the study; the rows are the same in every panel
    first, second (K,) int: the pair of each question as indices into items, first < second; 'overall' has a pair once a framing
    preference    (P, K) int8: -2 strong for first ... 2 strong for second, MISSING where not answered
    first_left    (P, K) bool: first was shown on the left
    """

    framing: str
    items: tuple[str, ...]
    participants: np.ndarray
    first: np.ndarray
    second: np.ndarray
    preference: np.ndarray
    first_left: np.ndarray

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
        return np.stack([(self.preference == value).sum(axis=0) for value in PREFERENCES], axis=1).astype(float)

    def chosen(self, rows: np.ndarray) -> Panel:
        """The same panel of some participants, or of some several times: rows are indices or a mask."""
        return Panel(
            self.framing,
            self.items,
            self.participants[rows],
            self.first,
            self.second,
            self.preference[rows],
            self.first_left[rows],
        )


def panels(responses: Responses, overall: bool = True) -> dict[str, Panel]:
    """Framing -> its panel, made once; with several framings and `overall`, 'overall' last. A framing of that name is refused."""
    made = vars(responses).setdefault("_panels", {})  # beside the cached properties of the frozen table
    if not made:
        made.update(_panels(responses))
    return {name: panel for name, panel in made.items() if overall or name != OVERALL}


def _panels(responses: Responses) -> dict[str, Panel]:
    if OVERALL in responses.items:
        raise InputError(f"a framing is called {OVERALL!r}, the name of all framings together; expected another name")
    frame = responses.frame
    names = frame.participant.cat.categories.to_numpy()
    rows = frame.participant.cat.codes.to_numpy()
    a, b = frame.a.cat.codes.to_numpy().astype(int), frame.b.cat.codes.to_numpy().astype(int)
    place = {name: index for index, name in enumerate(responses.codebook.techniques)}
    result = {}
    for framing, items in responses.items.items():
        here = (frame.framing == framing).to_numpy()
        result[framing] = _panel(framing, items, place, names, rows[here], a[here], b[here], frame[here])
    if len(result) > 1:
        seen = {name for items in responses.items.values() for name in items}
        items = tuple(name for name in responses.codebook.techniques if name in seen)
        first, second = (
            np.concatenate([[items.index(one.items[at]) for at in getattr(one, side)] for one in result.values()])
            for side in ("first", "second")
        )
        preference = np.concatenate([one.preference for one in result.values()], axis=1)
        left = np.concatenate([one.first_left for one in result.values()], axis=1)
        result[OVERALL] = Panel(OVERALL, items, names, first, second, preference, left)
    return result


def _panel(framing, items, place, names, rows, a, b, frame: pd.DataFrame) -> Panel:
    width = max(place.values()) + 1
    keys, column = np.unique(a * width + b, return_inverse=True)
    index = np.full(width, -1)
    index[[place[name] for name in items]] = range(len(items))
    preference = np.full((len(names), len(keys)), MISSING, np.int8)
    left = np.zeros((len(names), len(keys)), bool)
    preference[rows, column] = frame.preference.to_numpy()
    left[rows, column] = frame.a_left.to_numpy()
    return Panel(framing, items, names, index[keys // width], index[keys % width], preference, left)


def wins(panel: Panel, counts: np.ndarray, ties: str = "half") -> np.ndarray:
    """counts (..., K, 5) -> (..., n, n): how often item i was preferred to item j; ties are 'half' a win for each, or 'drop'ped."""
    half = 0.5 * counts[..., 2] if ties == "half" else 0.0
    over, under = counts[..., 0] + counts[..., 1] + half, counts[..., 3] + counts[..., 4] + half
    return _placed(panel, over) + np.swapaxes(_placed(panel, under), -1, -2)


def tied(panel: Panel, counts: np.ndarray) -> np.ndarray:
    """counts (..., K, 5) -> (..., n, n), symmetric: how often no difference was seen between i and j."""
    table = _placed(panel, counts[..., 2])
    return table + np.swapaxes(table, -1, -2)


def by_pair(panel: Panel, counts: np.ndarray) -> np.ndarray:
    """counts (..., K, 5) -> (..., n (n - 1)/2, 5): one row a pair i < j, in the order of numpy.triu_indices(n, 1); zeros if never asked."""
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


def noted(rows: Iterable, columns: Iterable[str], notes: Iterable[str] = ()) -> pd.DataFrame:
    """A table whose attrs['notes'] say, one line each, what was refused and why, and which variant was used."""
    table = pd.DataFrame(list(rows), columns=list(columns))
    table.attrs["notes"] = tuple(dict.fromkeys(notes))
    return table
