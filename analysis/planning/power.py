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

import numpy as np
import pandas as pd

from analysis.errors import InputError
from analysis.planning.closed_form import sign_power, tost_power
from analysis.planning.plan import ANY, DESIGNS, GOALS, Plan
from analysis.planning.simulation import Studies

#: Test -> goals that it has. 'declared' comes first, wherever results are told.
TESTS = {"declared": GOALS, "contrast": ("find",)}
#: Holm over the family as the simulated study has it; its first step, alpha over the number of
#: tests, which is what is left where no other pair helps; the pair's test alone.
CORRECTIONS = ("family", "first", "none")


def plan_table(
    plan: Plan,
    designs: Sequence[str] = DESIGNS,
    progress: Callable[[Iterable], Iterable] = lambda steps: steps,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate the plan. Returns the curves and what is needed.

    curves: framing, design, answers_each, goal, test ('declared' or 'contrast'), correction (see
    `CORRECTIONS`), people, power, low, high (95 % interval of the simulation, Wilson 1927),
    closed_form (where there is one, else NaN). needed: framing, design, answers_each, goal, test,
    correction, people (NaN where more than `most` are), power, false_alarms: how often, with that
    many people (with `most` where more are needed), a study in which the pair does not differ finds
    a difference (goal find), or one in which it differs by the margin excludes it (goal exclude).
    progress wraps the list of designs, as tqdm does.
    """
    for design in designs:
        if design not in DESIGNS:
            raise InputError(f"the design is {design!r}, expected one of {', '.join(DESIGNS)}")
    at_margin = plan.answering.difference(plan.margin)
    grid = people_grid(plan.most)
    curves, needed = [], []
    for step, design in enumerate(progress(list(designs))):
        each = len(plan.pairs) if design == "full" else plan.each
        by_truth = {
            "find": plan.to_find,
            "exclude": lambda _framing: 0.0,
            "margin": lambda _framing: at_margin,
        }
        studies = {
            truth: Studies(
                plan, design, difference, np.random.default_rng([plan.seed, step, place])
            )
            for place, (truth, difference) in enumerate(by_truth.items())
        }
        for goal in GOALS:
            false = studies["exclude"] if goal == "find" else studies["margin"]
            for test, goals in TESTS.items():
                if goal not in goals:
                    continue
                for correction in CORRECTIONS:
                    true = _Rates(plan, studies[goal], goal, test, correction)
                    alarms = _Rates(plan, false, goal, test, correction)
                    for place, framing in enumerate(plan.reported):
                        head = (framing, design, each, goal, test, correction)
                        powers = [true.at(people, place) for people in grid]
                        for people, power in zip(grid, powers, strict=True):
                            bounds = wilson(power, plan.studies)
                            closed = closed_form(
                                plan, design, goal, test, correction, people, framing
                            )
                            curves.append((*head, people, power, *bounds, closed))
                        count = _needed(plan, true, place, grid, powers)
                        at = plan.most if count is None else count
                        needed.append(
                            (*head, math.nan if count is None else count)
                            + (true.at(at, place), alarms.at(at, place))
                        )
    columns = ["framing", "design", "answers_each", "goal", "test", "correction", "people"]
    return (
        pd.DataFrame(curves, columns=[*columns, "power", "low", "high", "closed_form"]),
        pd.DataFrame(needed, columns=[*columns, "power", "false_alarms"]),
    )


class _Rates:
    """Shares of studies that reach their goal, kept for each number of people."""

    def __init__(self, plan: Plan, studies: Studies, goal: str, test: str, correction: str):
        self.plan, self.correction = plan, correction
        self.decide = studies.contrasted
        if test == "declared":
            self.decide = studies.detected if goal == "find" else studies.excluded
        self.known: dict[int, np.ndarray] = {}

    def at(self, people: int, place: int) -> float:
        """The share with so many people, at the framing in this place of `plan.reported`."""
        if people not in self.known:
            self.known[people] = self.decide(people, self.correction).mean(axis=0)
        rates = self.known[people]
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
    plan: Plan, rates: _Rates, place: int, grid: Sequence[int], powers: Sequence[float]
) -> int | None:
    """The fewest people from which on the power is reached on the whole grid; None where `most` are
    too few.
    """
    short = [at for at, power in enumerate(powers) if power < plan.power]
    if short and short[-1] == len(grid) - 1:
        return None
    if not short:
        return grid[0]
    low, high = grid[short[-1]], grid[short[-1] + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if rates.at(middle, place) >= plan.power:
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
