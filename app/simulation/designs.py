"""Dealt against adaptive pairs, on simulated people: when is it worth choosing?

Both designs are those of the questionnaire (`stimuli.design`), person after person. People prefer
by Thurstone's case V; their worths are spaced evenly over so many JOD.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import stats

from analysis.adaptive import nothing
from analysis.worth import JOD_SIGMA, thurstone_jod
from stimuli.asking import ADAPTIVE, Assignment
from stimuli.design import adaptive_trials, trials

CELL = "cell"


@dataclass(frozen=True)
class Compared:
    """items, spread JOD, people, pairs each: what was simulated, `studies` times.

    error           root mean square error of the differences of all pairs, JOD: dealt, adaptive
    near_error      of neighbours alone, which settle the order
    order           share of neighbours in their right order
    gain            how many times as many answers the dealt design needs for the same error: the
                    ratio of squared errors; low, high: its interval at 95 % over studies
    least, most     how often a pair was asked by the adaptive design, on the mean
    """

    items: int
    spread: float
    people: int
    pairs: int
    studies: int
    error: tuple[float, float]
    near_error: tuple[float, float]
    order: tuple[float, float]
    gain: tuple[float, float, float]
    near_gain: tuple[float, float, float]
    least: float
    most: float


def compare(
    items: int,
    spread: float,
    people: int,
    pairs: int,
    studies: int,
    seed: int,
    least_share: float = Assignment.least_share,
    as_good: float = Assignment.as_good,
) -> Compared:
    """Both designs on the same truths; `least_share` and `as_good` are of the adaptive one."""
    truth = np.linspace(-spread / 2, spread / 2, items)
    designs = (Assignment(pairs), Assignment(pairs, ADAPTIVE, least_share, as_good))
    squared = np.empty((2, studies, 2))
    right, counted = np.empty((2, studies)), []
    for study in range(studies):
        rng = np.random.default_rng([seed, study])
        places = rng.permutation(items)  # which technique is the best has nothing to do with names
        for k, design in enumerate(designs):
            counts = _answered(design, truth[places], people, seed + study, rng.spawn(1)[0])
            wins = _wins(counts, items)
            worth = thurstone_jod(wins, reduced_bias=True)[np.argsort(places)]
            d = worth[None] - worth[:, None] - (truth[None] - truth[:, None])
            near = np.diff(worth)
            squared[k, study] = np.mean(d**2), np.mean((near - np.diff(truth)) ** 2)
            right[k, study] = np.mean(near > 0)
            if design.design == ADAPTIVE:
                asked = np.array(counts)[:, :2].sum(axis=1)
                counted.append((asked.min(), asked.max()))
    least, most = np.mean(counted, axis=0)
    error, near_error = np.sqrt(squared.mean(axis=1)).T
    return Compared(
        items,
        spread,
        people,
        pairs,
        studies,
        tuple(map(float, error)),
        tuple(map(float, near_error)),
        tuple(map(float, right.mean(axis=1))),
        _ratio(squared[..., 0]),
        _ratio(squared[..., 1]),
        float(least),
        float(most),
    )


def _answered(
    design: Assignment, worth: np.ndarray, people: int, seed: int, rng: np.random.Generator
) -> Sequence[Sequence[int]]:
    """What was asked and answered, as a state of the cell."""
    names = [f"t{k}" for k in range(len(worth))]
    place = {pair: k for k, pair in enumerate(combinations(names, 2))}
    value = dict(zip(names, worth))
    state = nothing([CELL], names)
    for number in range(1, people + 1):
        if design.design == ADAPTIVE:
            asked = adaptive_trials([CELL], names, seed, number, None, design, state)
        else:
            asked = trials([CELL], names, seed, number, None, design.pairs)
        state = json.loads(json.dumps(state))
        for trial in asked:
            first_left = (trial.left, trial.right) in place
            first, second = (trial.left, trial.right) if first_left else (trial.right, trial.left)
            row = state[CELL][place[first, second]]
            row[0 if first_left else 1] += 1
            d = (value[first] - value[second]) / JOD_SIGMA
            row[2 if rng.random() < stats.norm.cdf(d) else 3] += 1
    return state[CELL]


def _wins(rows: Sequence[Sequence[int]], items: int) -> np.ndarray:
    wins = np.zeros((items, items))
    for (i, j), row in zip(combinations(range(items), 2), rows):
        wins[i, j], wins[j, i] = row[2], row[3]
    return wins


def _ratio(squared: np.ndarray) -> tuple[float, float, float]:
    """Mean of the dealt over mean of the adaptive, and its interval by the delta method."""
    mean = squared.mean(axis=1)
    relative = squared / mean[:, None]
    error = np.std(relative[0] - relative[1], ddof=1) / np.sqrt(squared.shape[1])
    ratio = mean[0] / mean[1]
    return float(ratio), float(ratio * np.exp(-1.96 * error)), float(ratio * np.exp(1.96 * error))
