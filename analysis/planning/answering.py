"""How simulated people turn what they see into answers.

A person compares a and b at a framing by d = w_b - w_a + (u_b - u_a) + e, in JOD: w are the worths,
u the person's own taste, normal, so that tastes for a difference spread by `taste`, and e the noise
of one question. Taste and noise together have the standard deviation SIGMA = 1/Phi^-1(0.75), so
that over people 1 JOD is preferred by 75 % (Perez-Ortiz and Mantiuk 2017, arXiv:1712.03686). The
answer is 0 where |d| < slight, +-2 where |d| >= clear, else +-1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from analysis.errors import InputError

#: Standard deviation of a comparison's noise in JOD: 1 JOD is preferred by 75 %.
SIGMA = 1 / stats.norm.ppf(0.75)


@dataclass(frozen=True)
class Answering:
    """How people turn what they see into answers.

    slight, clear: thresholds in JOD; taste: spread of people's differences in JOD.
    """

    slight: float = 0.5
    clear: float = 1.8
    taste: float = 0.5

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and 0 <= value <= 20):
                raise InputError(f"{name} is {value!r}, expected JOD from 0 to 20")
        if self.taste >= SIGMA:
            raise InputError(
                f"taste is {self.taste:g} JOD, expected less than {SIGMA:.3f}, the spread of "
                "taste and noise together"
            )
        if self.clear < self.slight:
            raise InputError(
                f"clear is {self.clear:g} and slight {self.slight:g}; expected clear to be at "
                "least slight"
            )

    @property
    def noise(self) -> float:
        """Standard deviation of the noise of one question, in JOD."""
        return math.sqrt(SIGMA**2 - self.taste**2)

    def answer(self, felt: float | np.ndarray) -> np.ndarray:
        """The answer, -2 to 2, to a difference as it is felt, taste and noise included, in JOD."""
        size = np.abs(felt)
        strength = (size >= self.slight).astype(np.int8) + (size >= self.clear)
        return (np.sign(felt) * strength).astype(np.int8)

    def shares(self, difference: float | np.ndarray) -> np.ndarray:
        """(..., 5): how often each of the answers -2 to 2 is given about a pair with that true
        difference in JOD.
        """
        cuts = np.array([-self.clear, -self.slight, self.slight, self.clear])
        below = stats.norm.cdf((cuts - np.asarray(difference, float)[..., None]) / SIGMA)
        edges = [np.zeros(below.shape[:-1])[..., None], below, np.ones(below.shape[:-1])[..., None]]
        return np.diff(np.concatenate(edges, axis=-1), axis=-1)

    def mean(self, difference: float | np.ndarray) -> np.ndarray:
        """The expected answer, -2 to 2: what a difference in JOD is on the scale of the answers."""
        return self.shares(difference) @ np.arange(-2, 3)

    def sd(self, difference: float) -> float:
        """Standard deviation of an answer, one a person."""
        shares = self.shares(difference)
        return float(np.sqrt(shares @ np.arange(-2, 3) ** 2 - (shares @ np.arange(-2, 3)) ** 2))

    def difference(self, points: float) -> float:
        """The difference in JOD whose mean answer is so many points, at least 0."""
        if points >= float(self.mean(40.0)):
            raise InputError(
                f"a mean answer of {points:g} points is more than any difference gives, expected "
                f"less than {float(self.mean(40.0)):.2f}"
            )
        return float(optimize.brentq(lambda one: float(self.mean(one)) - points, 0.0, 40.0))
