"""Powers that have a formula, to check the simulation against."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy import stats


def sign_power(up: float, down: float, people: int, alpha: float = 0.05) -> float:
    """Power of the exact two-sided sign test where each of so many people prefers one with
    probability `up`, the other with `down`, else neither; a binomial over how many see a
    difference (Gibbons and Chakraborti 2011, section 5.4).
    """
    power = 0.0
    for count in range(1, people + 1):
        critical = _sign_critical(count, alpha)
        if critical >= 0:
            share = up / (up + down)
            rejected = stats.binom.cdf(critical, count, share) + stats.binom.sf(
                count - critical - 1, count, share
            )
            power += stats.binom.pmf(count, people, up + down) * rejected
    return float(power)


def t_power(effect: float, people: int, alpha: float = 0.05) -> float:
    """Power of the two-sided one-sample t test for a mean of `effect` standard deviations."""
    critical, shift = stats.t.ppf(1 - alpha / 2, people - 1), effect * math.sqrt(people)
    return float(
        stats.nct.sf(critical, people - 1, shift) + stats.nct.cdf(-critical, people - 1, shift)
    )


def tost_power(effect: float, margin: float, people: int, alpha: float = 0.05) -> float:
    """Power of two one-sided t tests to put a true mean of `effect` within +-`margin`, all in
    standard deviations (Phillips 1990).
    """
    df, root = people - 1, math.sqrt(people)
    critical = stats.t.ppf(1 - alpha, df)
    widest = (
        margin * root / critical
    )  # with a larger sample standard deviation the tests never reject both
    spread = np.linspace(0, widest, 2001)[1:]
    density = stats.chi2.pdf(spread**2 * df, df) * 2 * spread * df
    inside = stats.norm.cdf((margin - effect) * root - critical * spread) - stats.norm.cdf(
        (-margin - effect) * root + critical * spread
    )
    return float(np.trapezoid(np.clip(inside, 0, None) * density, spread))


@lru_cache(maxsize=4096)
def _sign_critical(count: int, alpha: float) -> int:
    """The most people in the minority with which the exact two-sided sign test of `count` people
    rejects; -1 if it never does.
    """
    tails = 2 * stats.binom.cdf(np.arange(count // 2 + 1), count, 0.5)
    return int((np.minimum(tails, 1) <= alpha).sum()) - 1
