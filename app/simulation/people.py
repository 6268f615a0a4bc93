"""How simulated participants judge: latent worths for each framing, noise, and a reluctance to see
a difference.

A participant looks at d = GAIN (worth of right - worth of left) + SIDE_BIAS + noise, noise ~ N(0,
NOISE), and answers 0 where |d| is below `SLIGHT` times the framing's reluctance, +-2 where it is
above `CLEAR` times it, else +-1.

Worths are the centred natural logarithms of the AHP priorities that the thesis published
(study.md): in the thesis's design they come out near the published findings: golubev and
golubev_plus ahead at close-up, all flatter with distance. They say how simulated answers were made,
and nothing about people.
"""

from __future__ import annotations

import math
from random import Random

from app.study import Study
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
GAIN = 1.2
NOISE = 0.7
SIDE_BIAS = 0.0
SLIGHT, CLEAR = 0.45, 1.35
RELUCTANCE_STEP = (
    0.3  # added for each framing after the first: differences are harder to see from farther away
)
#: Spread of the worths of a technique or framing that the thesis did not have, drawn from the seed.
UNKNOWN_SPREAD = 0.4
#: Spread that each combination of further levels (person, light, ...) adds.
LEVEL_SPREAD = 0.15
FAMILIARITY_SHARES = (0.15, 0.25, 0.3, 0.2, 0.1)
MEDIAN_RT_MS, RT_SPREAD = 6500, 0.5  # log-normal


class Crowd:
    """The simulated participants of a study; what each answers depends on (seed, participant,
    question) alone.
    """

    def __init__(self, study: Study, seed: int):
        self._seed = seed
        place = {framing: k for k, framing in enumerate(study.framings)}
        self._worths, self._reluctance = {}, {}
        for cell in study.definition.cells:
            self._worths[cell.name] = self._cell_worths(study, cell)
            self._reluctance[cell.name] = 1 + RELUCTANCE_STEP * place[cell.framing]

    def familiarity(self, participant: int) -> int:
        """1 to 5."""
        return self._random(participant, "familiarity").choices(range(1, 6), FAMILIARITY_SHARES)[0]

    def answer(
        self, participant: int, order: int, cell: str, left: str, right: str
    ) -> tuple[int, int]:
        """The answer, -2 to 2 (negative: left), and the time it took, ms."""
        random = self._random(participant, order)
        worths, reluctance = self._worths[cell], self._reluctance[cell]
        d = GAIN * (worths[right] - worths[left]) + SIDE_BIAS + random.gauss(0, NOISE)
        strength = (abs(d) > SLIGHT * reluctance) + (abs(d) > CLEAR * reluctance)
        rt_ms = round(MEDIAN_RT_MS * math.exp(random.gauss(0, RT_SPREAD)))
        return int(math.copysign(strength, d)), rt_ms

    def _cell_worths(self, study: Study, cell: Cell) -> dict[str, float]:
        """Those of the cell's framing, moved a little by its other levels."""
        published = PUBLISHED_PRIORITIES.get(cell.framing, {})
        logs = {name: math.log(priority) for name, priority in published.items()}
        centre = sum(logs.values()) / len(logs) if logs else 0.0
        worths = {}
        for name in study.techniques:
            if name in logs:
                worths[name] = logs[name] - centre
            else:
                worths[name] = self._random(cell.framing, name).gauss(0, UNKNOWN_SPREAD)
            if len(cell.levels) > 1:
                worths[name] += self._random(cell.name, name).gauss(0, LEVEL_SPREAD)
        return worths

    def _random(self, *key: object) -> Random:
        return Random(
            "/".join(map(str, (self._seed, *key)))
        )  # a text seeds by its SHA-512: the same everywhere
