"""What a study is to find out, and the declared tests that will decide it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np

from analysis.adaptive import AS_GOOD, LEAST_SHARE
from analysis.errors import InputError
from analysis.inference import alpha_of
from analysis.options import Options
from analysis.planning.answering import Answering

DESIGNS = ("full", "incomplete", "adaptive")
GOALS = ("find", "exclude")
#: The name of framings that all have the same assumed worths.
ANY = "any"
#: So many simulated answers are held at most.
MOST_ANSWERS = 1_500_000_000


@dataclass(frozen=True)
class Plan:
    """What is to be found out, and by which declared analysis.

    techniques  their names; pair: the two of them that it is about
    difference  JOD between the pair, to find
    differences framing -> the same, where it is not the same at all
    worths      framing -> technique -> assumed worth in JOD; `ANY` for all framings alike
    framings    the framings (or cells) of the study, whose pairs Holm's correction guards together
    answering   how people answer
    answers_each    pairs that the incomplete and the adaptive design ask each person at a framing
    options     the declared analysis: test, family, level, margin, resamples
    least_share, as_good    of the adaptive design (`analysis.adaptive.chosen`), 0 to 1
    power       to be reached; most: people to think of; studies: simulated ones; seed
    """

    techniques: tuple[str, ...]
    pair: tuple[str, str]
    difference: float = 0.5
    worths: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    framings: tuple[str, ...] = (ANY,)
    answering: Answering = Answering()
    answers_each: int = 0
    options: Options = field(default_factory=Options)
    power: float = 0.8
    most: int = 400
    studies: int = 1000
    seed: int = 1
    differences: Mapping[str, float] = field(default_factory=dict)
    least_share: float = LEAST_SHARE
    as_good: float = AS_GOOD

    def __post_init__(self) -> None:
        pairs = len(self.techniques) * (len(self.techniques) - 1) // 2
        if len(self.techniques) < 2 or len(set(self.techniques)) < len(self.techniques):
            raise InputError(
                f"the techniques are {','.join(self.techniques)!r}, expected at least two "
                "different ones"
            )
        if (
            len(self.pair) != 2
            or self.pair[0] == self.pair[1]
            or not set(self.pair) <= set(self.techniques)
        ):
            raise InputError(
                f"the pair is {','.join(self.pair)!r}, expected two different ones of "
                f"{', '.join(self.techniques)}"
            )
        checks = (
            ("difference", self.difference, 0.01 <= self.difference <= 10, "JOD from 0.01 to 10"),
            *(
                (f"the difference at {name}", value, 0.0 <= value <= 10, "JOD from 0 to 10")
                for name, value in self.differences.items()
            ),
            (
                "answers_each",
                self.answers_each,
                0 <= self.answers_each <= pairs,
                f"0 to {pairs}, the pairs of a framing",
            ),
            ("framings", self.framings, len(self.framings) > 0, "one or more"),
            (
                "power",
                self.power,
                self.alpha < self.power < 1,
                "a probability above alpha and below 1",
            ),
            ("least_share", self.least_share, 0 <= self.least_share <= 1, "a number from 0 to 1"),
            ("as_good", self.as_good, 0 <= self.as_good <= 1, "a number from 0 to 1"),
            ("most", self.most, 5 <= self.most <= 5000, "people from 5 to 5000"),
            (
                "studies",
                self.studies,
                50 <= self.studies <= 100_000,
                "simulated studies from 50 to 100000",
            ),
            ("seed", self.seed, 0 <= self.seed < 2**63, "an integer from 0 to 2^63 - 1"),
        )
        for name, value, valid, expected in checks:
            if not valid:
                raise InputError(f"{name} is {value!r}, expected {expected}")
        answers = self.studies * self.most * pairs * len(self.framings)
        if answers > MOST_ANSWERS:
            raise InputError(
                f"{self.studies} studies of {self.most} people are {answers:,} answers, expected "
                f"at most {MOST_ANSWERS:,}; ask for fewer people or studies"
            )
        for framing, worths in self.worths.items():
            for name in self.techniques:
                if not math.isfinite(worths.get(name, math.nan)):
                    raise InputError(
                        f"the worth of {name!r} at {framing!r} is {worths.get(name)!r}, "
                        "expected JOD, a number"
                    )

    @property
    def alpha(self) -> float:
        return alpha_of(self.options)

    @property
    def margin(self) -> float:
        """The margin of equivalence in points: the declared one, or what the declared margin in
        JOD, or the difference, is on the scale of the answers.
        """
        if self.options.margin is not None:
            return self.options.margin
        return float(self.answering.mean(self.options.margin_jod or self.difference))

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """The pairs of a framing, as places in `techniques`."""
        return list(combinations(range(len(self.techniques)), 2))

    @property
    def family(self) -> int:
        """How many tests Holm's correction guards together."""
        framings = len(self.framings) if self.options.family == "study" else 1
        return len(self.pairs) * framings

    @cached_property
    def target(self) -> int:
        """The place of `pair` in `pairs`."""
        return self.pairs.index(tuple(sorted(self.techniques.index(name) for name in self.pair)))

    @cached_property
    def ends(self) -> np.ndarray:
        """(pairs, techniques): takes worths to the difference of each pair, second less first."""
        matrix = np.eye(len(self.techniques))
        a, b = np.array(self.pairs).T
        return matrix[b] - matrix[a]

    @property
    def each(self) -> int:
        """Pairs that the incomplete and the adaptive design ask each person at a framing: half of
        them where nothing is said.
        """
        return self.answers_each or max(1, (len(self.pairs) + 1) // 2)

    @property
    def reported(self) -> tuple[str, ...]:
        """The framings that results are told for: all as one, where their worths are the same."""
        own = {*self.worths, *self.differences}
        return self.framings if set(self.framings) & own else (ANY,)

    @property
    def apart(self) -> str:
        """JOD between the pair, in words: one number, or the range over framings."""
        every = [self.to_find(framing) for framing in self.framings]
        low, high = min(every), max(every)
        return f"{low:g}" if low == high else f"{low:.2g} to {high:.2g}"

    def to_find(self, framing: str) -> float:
        """JOD between the pair at a framing."""
        return self.differences.get(framing, self.difference)

    def truth(self, framing: str, difference: float) -> np.ndarray:
        """The worths at a framing with the pair set `difference` apart about its middle, in JOD,
        centred on 0.
        """
        assumed = self.worths.get(framing, self.worths.get(ANY, {}))
        worths = np.array([assumed.get(name, 0.0) for name in self.techniques])
        a, b = self.pairs[self.target]
        middle = (worths[a] + worths[b]) / 2
        worths[a], worths[b] = middle - difference / 2, middle + difference / 2
        return worths - worths.mean()
