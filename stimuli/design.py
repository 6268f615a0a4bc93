"""Which list of questions shows which pairs, in which order and on which side.

Lists are numbered from 1 and made two by two: the second of a couple asks the same pairs on the
other sides in the opposite order, so that over both every pair stood on each side once and its mean
place is the middle. Within a list, each technique stands on the left as often as on the right in
each cell, to one (pairs are given sides along an Euler tour). Where a list has
some of the pairs, couples are dealt from a shuffled sequence without end, so that no pair is ever
more than one couple of lists ahead of another.

Everything comes from the raw 64-bit words of PCG64 seeded by the study's seed and the list's
number: unlike the distributions built on them, numpy promises never to change those (NEP 19), so a
seed gives the same study under every version.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import gcd

import numpy as np

from analysis.adaptive import State, chosen
from stimuli.asking import Assignment, Quality, Trap

#: What a stream of random words is for; the first is followed by the list's number.
_QUALITY, _DEAL, _LIST, _TRAPS, _BIAS, _ADAPTIVE, _BESIDE = range(7)


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
    number: int,
    quality: Quality | None = None,
    pairs: int = 0,
) -> list[Trial]:
    """The trials of one list: pairs of techniques within cells, each at most once, and those that
    `quality` adds.

    Parameters
    ----------
    cells, techniques : names, in the order of the study
    seed : of the study, >= 0
    number : of the list, from 1
    quality : a pair that is asked again was asked in the first half and comes in the second;
        traps and pairs of one image stand anywhere; practice comes first, of pairs that are drawn
        from the list's. They are drawn after and leave the order of the others as it is. The better
        image of a trap is on the left in one list of a couple and on the right in the other, of
        half of a list's traps on the left, to one; images that stand against themselves are dealt
        in turn.
    pairs : how many of the study's pairs the list has; 0: all
    """
    couple, mirrored = divmod(number - 1, 2)
    share = _shares(seed, _LIST, couple)
    order = _shuffled(_dealt(cells, techniques, seed, couple, pairs), share)
    sided = _sided(order, share)
    if mirrored:
        sided = [(cell, right, left) for cell, left, right in reversed(sided)]
    main = [Trial(place, *one) for place, one in enumerate(sided, start=1)]
    if not quality or not quality.questions:
        return main
    return _completed(main, cells, techniques, quality, seed, number)


def adaptive_trials(
    cells: Sequence[str],
    techniques: Sequence[str],
    seed: int,
    number: int,
    quality: Quality | None,
    assignment: Assignment,
    state: State,
) -> list[Trial]:
    """The trials of one person under an adaptive design: `number`, the person's, and `state`, what
    was asked and answered before, give the same ones again.
    """
    share = _shares(seed, _ADAPTIVE, number)
    pairs = chosen(
        state,
        cells,
        techniques,
        assignment.pairs,
        assignment.least_share,
        assignment.as_good,
        share,
    )
    main = [Trial(place, *one) for place, one in enumerate(_shuffled(pairs, share), start=1)]
    if not quality or not quality.questions:
        return main
    return _completed(main, cells, techniques, quality, seed, number)


def dealt_beside(seed: int, number: int, beside: float) -> bool:
    """Whether a person of an adaptive design is one of those who are dealt their pairs."""
    return _shares(seed, _BESIDE, number)() < beside


def _completed(
    main: list[Trial],
    cells: Sequence[str],
    techniques: Sequence[str],
    quality: Quality,
    seed: int,
    number: int,
) -> list[Trial]:
    """With the questions that tell how well people look."""
    couple, mirrored = divmod(number - 1, 2)
    traps = _sided_traps(quality.traps, _shares(seed, _TRAPS, couple), mirrored)
    images = _against_itself(cells, techniques, seed, (number - 1) * quality.bias, quality.bias)
    return _with_quality(main, traps, images, quality, _shares(seed, _QUALITY, number))


def _shares(*words: int) -> Callable[[], float]:
    """Random numbers from 0, below 1."""
    draw = np.random.PCG64([*words]).random_raw
    return lambda: float(int(draw()) >> 11) * 2.0**-53


def _shuffled(of: Sequence, share: Callable[[], float]) -> list:
    of = list(of)
    return [of[k] for k in np.argsort([share() for _ in of], kind="stable")]


def _dealt(
    cells: Sequence[str], techniques: Sequence[str], seed: int, couple: int, pairs: int
) -> list[tuple[str, str, str]]:
    """The pairs of a couple of lists: the next ones of a sequence of all pairs, which is gone
    through again and again and shuffled anew when it ends where a couple does.
    """
    every = len(cells) * len(techniques) * (len(techniques) - 1) // 2
    some = pairs or every
    couples = every // gcd(some, every)  # until both end together
    deal, place = divmod(couple, couples)
    share = _shares(seed, _DEAL, deal)
    by_cell = [
        [(cell, *pair) for pair in _rounds(_shuffled(techniques, share), techniques, share)]
        for cell in _shuffled(cells, share)
    ]
    sequence = [pair for turn in zip(*by_cell) for pair in turn]  # a pair of each cell in turn
    return [sequence[(place * some + k) % every] for k in range(some)]


def _rounds(
    shuffled: list[str], techniques: Sequence[str], share: Callable[[], float]
) -> list[tuple[str, str]]:
    """All pairs, round by round of a tournament in which everybody plays once a round (the circle
    method; with an odd number one sits out): neighbours in it are of different techniques.
    """
    players: list[str | None] = [*shuffled, *([None] if len(shuffled) % 2 else [])]
    rounds = []
    for _ in range(len(players) - 1):
        half = len(players) // 2
        games = zip(players[:half], reversed(players[half:]))
        rounds.append([game for game in games if None not in game])
        players = [players[0], players[-1], *players[1:-1]]
    place = {name: k for k, name in enumerate(techniques)}
    return [
        tuple(sorted(game, key=place.get))
        for games in _shuffled(rounds, share)
        for game in _shuffled(games, share)
    ]


def _sided(
    order: list[tuple[str, str, str]], share: Callable[[], float]
) -> list[tuple[str, str, str]]:
    """The same pairs with sides: in each cell every technique is left as often as right, to one.

    In each cell the pairs are the edges of a graph. Where an odd number meets at a technique, an
    edge to nowhere is added; walking until there is no way on then ends where it began, and enters
    every technique as often as it leaves it.
    """
    sided = list(order)
    for cell in dict.fromkeys(cell for cell, *_ in order):
        edges = {k: one[1:] for k, one in enumerate(order) if one[0] == cell}
        meeting: dict[str | None, list[int]] = {}
        for k in _shuffled(edges, share):
            for end in edges[k]:
                meeting.setdefault(end, []).append(k)
        for k, end in enumerate([end for end, at in meeting.items() if len(at) % 2], start=1):
            edges[-k] = end, None
            meeting[end].append(-k)
            meeting.setdefault(None, []).append(-k)
        walked: set[int] = set()
        backwards = share() < 0.5
        for start in list(meeting):
            here = start
            while left := [k for k in meeting[here] if k not in walked]:
                k = left[0]
                walked.add(k)
                there = edges[k][1] if edges[k][0] == here else edges[k][0]
                if k >= 0:
                    sided[k] = (cell, there, here) if backwards else (cell, here, there)
                here = there
    return sided


def _sided_traps(traps: Sequence[Trap], share: Callable[[], float], mirrored: int) -> list[Trial]:
    """Every second one with its better image on the left, in a shuffled order; mirrored: 1 for the
    other sides.
    """
    first = int(share() < 0.5) + mirrored
    return [
        Trial(0, one.cell, *((one.better, one.worse)[:: 1 if (k + first) % 2 else -1]), "trap")
        for k, one in enumerate(_shuffled(traps, share))
    ]


def _against_itself(
    cells: Sequence[str], techniques: Sequence[str], seed: int, first: int, count: int
) -> list[Trial]:
    """So many pairs of one image on both sides, from `first` on in a sequence of all images that is
    shuffled anew when it ends.
    """
    every = [(cell, name) for cell in cells for name in techniques]
    trials = []
    for k in range(first, first + count):
        deal, place = divmod(k, len(every))
        cell, name = _shuffled(every, _shares(seed, _BIAS, deal))[place]
        trials.append(Trial(0, cell, name, name, "bias"))
    return trials


def _with_quality(
    main: list[Trial],
    traps: list[Trial],
    images: list[Trial],
    quality: Quality,
    share: Callable[[], float],
) -> list[Trial]:
    placed = [(float(trial.order), trial) for trial in main]
    half = len(main) / 2
    again = _shuffled(main[: len(main) // 2], share)[: quality.repeats + quality.swapped]
    for k, trial in enumerate(again):
        if k < quality.repeats:
            copy = replace(trial, kind="repeat")
        else:
            copy = replace(trial, left=trial.right, right=trial.left, kind="swapped")
        placed.append((half + 1 + share() * half, copy))
    for trial in (*traps, *images):
        placed.append((1 + share() * len(main), trial))
    for k, trial in enumerate(_shuffled(main, share)[: quality.practice]):
        placed.append((k / (1 + quality.practice), replace(trial, kind="practice")))
    placed.sort(key=lambda pair: pair[0])
    return [replace(trial, order=order) for order, (_, trial) in enumerate(placed, start=1)]
