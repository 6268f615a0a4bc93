"""How many people a study needs: the share of simulated studies that reach a goal, by the declared
analysis.

Two goals for one pair. To *find* a difference D: the truth is D, and the declared test, corrected
by Holm's procedure over the declared family, rejects equality. To *exclude* one: the truth is 0,
and the declared equivalence test (two one-sided t tests, corrected likewise, and the bootstrap
interval) puts the mean preference within the declared margin. Both are decided by the functions
that `analyse` decides a table with. Beside the declared test stand the same test uncorrected, for
one comparison that was planned before, and the contrast of the linear model, which `analyse` prints
beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from analysis.errors import InputError
from analysis.planning.closed_form import sign_power, tost_power
from analysis.planning.plan import ANY, DESIGNS, GOALS, MOST_ANSWERS, Plan
from analysis.planning.simulation import Studies

#: Test -> goals that it has. 'declared' comes first, wherever results are told.
TESTS = {"declared": GOALS, "contrast": ("find",)}
#: Holm over the family as the simulated study has it; its first step, alpha over the number of
#: tests, which is what is left where no other pair helps; the pair's test alone.
CORRECTIONS = ("family", "first", "none")
#: Simulated studies of a part, and answers that a process keeps of its parts: 2 bytes each.
PART, KEPT_ANSWERS = 125, MOST_ANSWERS


@dataclass(frozen=True)
class Part:
    """Some of a plan's simulated studies, drawn and decided together, in whatever process.

    count: how many; differences: the truth at each framing, JOD; entropy, number: the part's
    seed is the child of that number of `SeedSequence(entropy)`, so that what it draws depends on
    neither the other parts nor who draws them.
    """

    plan: Plan
    design: str
    differences: tuple[float, ...]
    count: int
    entropy: tuple[int, ...]
    number: int

    def studies(self) -> Studies:
        rng = np.random.default_rng(np.random.SeedSequence(self.entropy, spawn_key=(self.number,)))
        truth = dict(zip(self.plan.framings, self.differences, strict=True))
        return Studies(self.plan, self.design, truth.__getitem__, rng, self.count)


#: What decides (a method of `Studies`), after which correction, with so many people.
Question = tuple[str, str, int]

_drawn: dict[str, Studies] = {}


def decide(part: Part, questions: Sequence[Question]) -> np.ndarray:
    """(questions, framings): how many of the part's studies are decided for the goal.

    What was drawn is kept for the next questions, in each process, as far as `KEPT_ANSWERS` go.
    """
    name = repr(part)
    if name not in _drawn:
        size = part.count * part.plan.most * len(part.plan.framings) * len(part.plan.pairs)
        while _drawn and (len(_drawn) + 1) * size > KEPT_ANSWERS:
            del _drawn[next(iter(_drawn))]
        _drawn[name] = part.studies()
    studies = _drawn[name]
    return np.array([getattr(studies, how)(people, c).sum(axis=0) for how, c, people in questions])


def plan_table(
    plan: Plan,
    designs: Sequence[str] = DESIGNS,
    progress: Callable[[Iterable], Iterable] = lambda steps: steps,
    executor: Executor | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate the plan. Returns the curves and what is needed.

    curves: framing, design, answers_each, goal, test ('declared' or 'contrast'), correction (see
    `CORRECTIONS`), people, power, low, high (95 % interval of the simulation, Wilson 1927),
    closed_form (where there is one, else NaN). needed: framing, design, answers_each, goal, test,
    correction, people (NaN where more than `most` are), power, false_alarms: how often, with that
    many people (with `most` where more are needed), a study in which the pair does not differ finds
    a difference (goal find), or one in which it differs by the margin excludes it (goal exclude).
    progress wraps the list of designs, as tqdm does. executor: simulates, `PART` studies a task;
    the numbers do not depend on it.
    """
    for design in designs:
        if design not in DESIGNS:
            raise InputError(f"the design is {design!r}, expected one of {', '.join(DESIGNS)}")
    run = map if executor is None else executor.map
    at_margin = plan.answering.difference(plan.margin)
    grid = people_grid(plan.most)
    curves, needed = [], []
    for step, design in enumerate(progress(list(designs))):
        each = len(plan.pairs) if design == "full" else plan.each
        truths = {
            "find": tuple(map(plan.to_find, plan.framings)),
            "exclude": (0.0,) * len(plan.framings),
            "margin": (at_margin,) * len(plan.framings),
        }
        rates = {
            truth: _Rates(plan, design, differences, (plan.seed, step, place), run)
            for place, (truth, differences) in enumerate(truths.items())
        }
        for goal in GOALS:
            kinds = [
                (test, correction)
                for test, goals in TESTS.items()
                if goal in goals
                for correction in CORRECTIONS
            ]
            true, false = rates[goal], rates["exclude" if goal == "find" else "margin"]
            true.learn([(_method(test, goal), c, n) for test, c in kinds for n in grid])
            for test, correction in kinds:
                how = (_method(test, goal), correction)
                for place, framing in enumerate(plan.reported):
                    head = (framing, design, each, goal, test, correction)
                    powers = [true.at(*how, people, place) for people in grid]
                    for people, power in zip(grid, powers, strict=True):
                        bounds = wilson(power, plan.studies)
                        closed = closed_form(plan, design, goal, test, correction, people, framing)
                        curves.append((*head, people, power, *bounds, closed))
                    count = _needed(plan, partial(true.at, *how, place=place), grid, powers)
                    at = plan.most if count is None else count
                    needed.append(
                        (*head, math.nan if count is None else count)
                        + (true.at(*how, at, place), false.at(*how, at, place))
                    )
    columns = ["framing", "design", "answers_each", "goal", "test", "correction", "people"]
    return (
        pd.DataFrame(curves, columns=[*columns, "power", "low", "high", "closed_form"]),
        pd.DataFrame(needed, columns=[*columns, "power", "false_alarms"]),
    )


def _method(test: str, goal: str) -> str:
    """What of `Studies` decides."""
    if test == "contrast":
        return "contrasted"
    return "detected" if goal == "find" else "excluded"


class _Rates:
    """Shares of the studies of one design and truth that are decided for the goal, by question."""

    def __init__(
        self,
        plan: Plan,
        design: str,
        differences: tuple[float, ...],
        entropy: tuple[int, ...],
        run: Callable,
    ):
        self.plan, self.run = plan, run
        self.parts = [
            Part(plan, design, differences, min(PART, plan.studies - first), entropy, first // PART)
            for first in range(0, plan.studies, PART)
        ]
        self.known: dict[Question, np.ndarray] = {}

    def learn(self, questions: Sequence[Question]) -> None:
        """Ask all at once, of every part."""
        counts = sum(self.run(decide, self.parts, [questions] * len(self.parts)))
        self.known |= dict(zip(questions, counts / self.plan.studies, strict=True))

    def at(self, method: str, correction: str, people: int, place: int) -> float:
        """The share with so many people, at the framing in this place of `plan.reported`."""
        question = (method, correction, people)
        if question not in self.known:
            self.learn([question])
        rates = self.known[question]
        return float(rates.mean() if self.plan.reported == (ANY,) else rates[place])


def people_grid(most: int) -> list[int]:
    """Numbers of people for a curve: about evenly far apart in logarithm, from 5 to `most`."""
    return sorted({round(value) for value in np.geomspace(5, most, 18)})


def closed_form(
    plan: Plan,
    design: str,
    goal: str,
    test: str,
    correction: str,
    people: int,
    framing: str = ANY,
) -> float:
    """The power of the full design and one uncorrected test from a formula, NaN where there is
    none: the sign test's is exact; equivalence by the noncentral t, integrated over the standard
    deviation (Phillips 1990, doi:10.1007/BF01063556), which is close with thirty people or more,
    since answers are no normal numbers.
    """
    model = plan.answering
    if design != "full" or test != "declared" or correction != "none":
        return math.nan
    if goal == "find" and plan.options.test == "sign":
        shares = model.shares(plan.to_find(framing))
        return sign_power(shares[3] + shares[4], shares[0] + shares[1], people, plan.alpha)
    if goal == "exclude":
        return tost_power(0.0, plan.margin / model.sd(0.0), people, plan.alpha)
    return math.nan


def _needed(
    plan: Plan, rate: Callable[[int], float], grid: Sequence[int], powers: Sequence[float]
) -> int | None:
    """The fewest people from which on the power is reached on the whole grid; None where `most` are
    too few. rate: the power with so many people.
    """
    short = [at for at, power in enumerate(powers) if power < plan.power]
    if short and short[-1] == len(grid) - 1:
        return None
    if not short:
        return grid[0]
    low, high = grid[short[-1]], grid[short[-1] + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if rate(middle) >= plan.power:
            high = middle
        else:
            low = middle
    return high


def wilson(share: float, n: int, z: float = 1.959964) -> tuple[float, float]:
    """95 % interval of a share of n (Wilson 1927)."""
    middle, half = (
        share + z * z / (2 * n),
        z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n)),
    )
    return max(0.0, (middle - half) / (1 + z * z / n)), min(1.0, (middle + half) / (1 + z * z / n))
