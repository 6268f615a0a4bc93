"""Who the simulated participants are: their worths at each cell, their tastes, how long they take.

How they turn what they see into answers is `analysis.planning.answering`, the model that `subdermal
power` plans with; thresholds grow with distance, since differences are harder to see from farther
away. Worths are the centred natural logarithms of the AHP priorities that the thesis published
(study.md), in JOD: in the thesis's design they come out near the published findings: golubev and
golubev_plus ahead at close-up, all flatter with distance. They say how simulated answers were made,
and nothing about people.
"""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

from analysis.planning.answering import Answering
from app.study import Study
from stimuli.asking import Ask
from stimuli.study import Cell

#: Published priorities (Vuletic, tables 5.2 to 5.4).
PUBLISHED_PRIORITIES = {
    "close-up": {
        "none": 0.0841,
        "jimenez_separable": 0.1208,
        "golubev": 0.2766,
        "golubev_plus": 0.3562,
        "jimenez_gaussian": 0.1623,
    },
    "head-shot": {
        "none": 0.1181,
        "jimenez_separable": 0.1496,
        "golubev": 0.2836,
        "golubev_plus": 0.2836,
        "jimenez_gaussian": 0.1652,
    },
    "half-length": {
        "none": 0.2971,
        "jimenez_separable": 0.1592,
        "golubev": 0.1973,
        "golubev_plus": 0.1680,
        "jimenez_gaussian": 0.1785,
    },
}
#: JOD that a natural logarithm of priorities counts.
GAIN_JOD = 2.5
#: At the first framing; at each after it both thresholds are by so large a share of these higher.
ANSWERING = Answering(slight=0.95, clear=2.85, taste=0.5)
RELUCTANCE_STEP = 0.3
#: Spread of the worths, JOD, of a technique or framing that the thesis did not have, drawn from the
#: seed.
UNKNOWN_SPREAD_JOD = 1.0
#: Spread that each combination of further levels (person, light, ...) adds, JOD.
LEVEL_SPREAD_JOD = 0.4
#: Of five levels; of another number, each is as likely.
FAMILIARITY_SHARES = (0.15, 0.25, 0.3, 0.2, 0.1)
MEDIAN_RT_MS, RT_SPREAD = 6500, 0.5  # log-normal


class Crowd:
    """The simulated participants of a study; what each answers depends on (seed, participant,
    question) alone.
    """

    def __init__(self, study: Study, seed: int):
        self._seed, self._levels = seed, study.definition.familiarity.levels
        self._cells = {cell.name: cell for cell in study.definition.cells}
        place = {framing: k for k, framing in enumerate(study.framings)}
        self._worths, self._answering = {}, {}
        for cell in self._cells.values():
            self._worths[cell.name] = self._cell_worths(study, cell)
            step = 1 + RELUCTANCE_STEP * place[cell.framing]
            self._answering[cell.name] = replace(
                ANSWERING, slight=step * ANSWERING.slight, clear=step * ANSWERING.clear
            )

    def familiarity(self, participant: int) -> int:
        """One of the study's levels."""
        five = len(self._levels) == len(FAMILIARITY_SHARES)
        draw = self._random(participant, "familiarity")
        return draw.choices(self._levels, FAMILIARITY_SHARES if five else None)[0]

    def statement(self, participant: int, ask: Ask) -> str:
        """The answer to a question of the study's own: any option, or a text that says what it
        is.
        """
        if not ask.options:
            return "simulated"
        return str(self._random(participant, "own", ask.name).randint(1, len(ask.options)))

    def answer(
        self, participant: int, order: int, cell: str, left: str, right: str
    ) -> tuple[int, int]:
        """The answer, -2 to 2 (negative: left), and the time it took, ms."""
        draw, model = self._random(participant, order), self._answering[cell]
        better = self._own_worth(participant, cell, right) - self._own_worth(
            participant, cell, left
        )
        answer = int(model.answer(better + draw.gauss(0, model.noise)))
        return answer, round(MEDIAN_RT_MS * math.exp(draw.gauss(0, RT_SPREAD)))

    def _own_worth(self, participant: int, cell: str, technique: str) -> float:
        """What a participant feels of a technique, JOD: a taste goes with a framing."""
        draw = self._random("taste", participant, self._cells[cell].framing, technique)
        spread = self._answering[cell].taste / math.sqrt(2)  # of one of the two in a difference
        return self._worths[cell][technique] + draw.gauss(0, spread)

    def _cell_worths(self, study: Study, cell: Cell) -> dict[str, float]:
        """Those of the cell's framing, moved a little by its other levels, JOD."""
        published = PUBLISHED_PRIORITIES.get(cell.framing, {})
        logs = {name: math.log(priority) for name, priority in published.items()}
        centre = sum(logs.values()) / len(logs) if logs else 0.0
        worths = {}
        for name in study.techniques:
            if name in logs:
                worths[name] = GAIN_JOD * (logs[name] - centre)
            else:
                worths[name] = self._random(cell.framing, name).gauss(0, UNKNOWN_SPREAD_JOD)
            if len(cell.levels) > 1:
                worths[name] += self._random(cell.name, name).gauss(0, LEVEL_SPREAD_JOD)
        return worths

    def _random(self, *key: object) -> Random:
        return Random(
            "/".join(map(str, (self._seed, *key)))
        )  # a text seeds by its SHA-512: the same everywhere
