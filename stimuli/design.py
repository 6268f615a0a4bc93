"""Which participant sees which pairs, in which order and on which side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from stimuli.asking import Quality


@dataclass(frozen=True)
class Trial:
    """One question: the images of `left` and `right` within `cell`; `order` counts from 1; `kind`
    is one of `analysis.manifest.KINDS`.
    """

    order: int
    cell: str
    left: str
    right: str
    kind: str = "main"


def trials(
    cells: Sequence[str],
    techniques: Sequence[str],
    seed: int,
    participant: int,
    quality: Quality | None = None,
) -> list[Trial]:
    """The trials of one participant: every pair of techniques once within each cell, and those that
    `quality` adds.

    The order is shuffled over all cells and the sides are drawn at random. Both come from the
    raw 64-bit words of PCG64 seeded by (seed, participant): unlike the distributions built on them,
    numpy promises never to change those (NEP 19), so a seed gives the same study under every
    version. What is added is drawn after, so that it leaves the order of the others as it is.

    Parameters
    ----------
    cells, techniques : names, in the order of the study
    seed : of the study, >= 0
    participant : running number of the participant, >= 0
    quality : a pair that is asked again was asked in the first half and comes in the second;
        traps and pairs of one image stand anywhere; practice comes first, of pairs that are drawn
        from the study's
    """
    pairs = [(cell, *pair) for cell in cells for pair in combinations(techniques, 2)]
    draw = np.random.PCG64([seed, participant]).random_raw
    order, sides = np.argsort(draw(len(pairs)), kind="stable"), draw(len(pairs)) >> np.uint64(63)
    main = []
    for position, (pair, swap) in enumerate(zip(order, sides), start=1):
        cell, left, right = pairs[pair]
        main.append(Trial(position, cell, *((right, left) if swap else (left, right))))
    return (
        _with_quality(main, cells, techniques, quality, draw)
        if quality and quality.questions
        else main
    )


def _with_quality(main, cells, techniques, quality: Quality, draw) -> list[Trial]:
    def share() -> float:  # from 0, below 1
        return float(int(draw()) >> 11) * 2.0**-53

    def sided(cell: str, one: str, other: str, kind: str) -> Trial:
        left, right = (one, other) if share() < 0.5 else (other, one)
        return Trial(0, cell, left, right, kind)

    def some(of: list, count: int) -> list:
        return [of[k] for k in np.argsort([share() for _ in of], kind="stable")[:count]]

    placed = [(float(trial.order), trial) for trial in main]
    half = len(main) / 2
    again = some(main[: len(main) // 2], quality.repeats + quality.swapped)
    for k, trial in enumerate(again):
        if k < quality.repeats:
            copy = replace(trial, kind="repeat")
        else:
            copy = replace(trial, left=trial.right, right=trial.left, kind="swapped")
        placed.append((half + 1 + share() * half, copy))
    for trap in quality.traps:
        trial = sided(trap.cell, trap.better, trap.worse, "trap")
        placed.append((1 + share() * len(main), trial))
    for _ in range(quality.bias):
        cell, one = cells[int(share() * len(cells))], techniques[int(share() * len(techniques))]
        placed.append((1 + share() * len(main), Trial(0, cell, one, one, "bias")))
    for k, trial in enumerate(some(main, quality.practice)):
        placed.append((k / (1 + quality.practice), replace(trial, kind="practice")))
    placed.sort(key=lambda pair: pair[0])
    return [replace(trial, order=order) for order, (_, trial) in enumerate(placed, start=1)]
