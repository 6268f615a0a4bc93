"""Which participant sees which pairs, in which order and on which side."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np


@dataclass(frozen=True)
class Trial:
    """One question: the images of `left` and `right` within `cell`; `order` counts from 1."""

    order: int
    cell: str
    left: str
    right: str


def trials(
    cells: Sequence[str], techniques: Sequence[str], seed: int, participant: int
) -> list[Trial]:
    """The trials of one participant: every pair of techniques once within each cell.

    The order is shuffled over all cells and the sides are drawn at random. Both come from the
    raw 64-bit words of PCG64 seeded by (seed, participant): unlike the distributions built on them,
    numpy promises never to change those (NEP 19), so a seed gives the same study under every
    version.

    Parameters
    ----------
    cells, techniques : names, in the order of the study
    seed : of the study, >= 0
    participant : running number of the participant, >= 0
    """
    pairs = [(cell, *pair) for cell in cells for pair in combinations(techniques, 2)]
    draw = np.random.PCG64([seed, participant]).random_raw
    order, sides = np.argsort(draw(len(pairs)), kind="stable"), draw(len(pairs)) >> np.uint64(63)
    shuffled = []
    for position, (pair, swap) in enumerate(zip(order, sides), start=1):
        cell, left, right = pairs[pair]
        shuffled.append(Trial(position, cell, *((right, left) if swap else (left, right))))
    return shuffled
