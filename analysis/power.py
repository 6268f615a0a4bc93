"""How many people a study needs, before it is run: simulated participants, the tests of the report,
a recorded seed.

A simulated person compares a and b at a framing by d = w_b - w_a + (u_b - u_a) + e, in JOD: w are
the worths, u the person's own taste, normal, so that tastes for a difference spread by `taste`, and
e the noise of one question. Taste and noise together have the standard deviation SIGMA =
1/Phi^-1(0.75), so that over people 1 JOD is preferred by 75 % (Perez-Ortiz and Mantiuk 2017,
arXiv:1712.03686). The answer is 0 where |d| < slight, +-2 where |d| >= clear, else +-1.

Two goals for one difference D: to *find* it (the truth is D, a two-sided test rejects equality) and
to *exclude* it (the truth is 0, two one-sided tests, Schuirmann 1987, doi:10.1007/BF01068419, put
the difference within +-D). The tests:

    sign      exact binomial test on the people who preferred one of the two
    wilcoxon  signed ranks of the pair's answers, zeros dropped, normal approximation with ties
              corrected, no continuity correction
    mean      one-sample t test on the pair's answers, one a person; with two one-sided t tests to
              exclude
    worths    least-squares worths of all techniques from all answers, t test on their difference
              with people as clusters

The designs: `full` asks every pair of everyone; `incomplete` asks each person so many pairs drawn
at random; `adaptive` asks as many, those from which most is expected to be learnt: log(1 + v I), v
the variance of the pair's difference given all answers so far and I the Fisher information of the
answer at its present estimate (a greedy D-optimal choice, as in Mikhailiuk et al. 2021,
arXiv:2004.05691).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import combinations

import numpy as np
import pandas as pd
from scipy import optimize, stats

from analysis.errors import InputError
from analysis.responses import Responses

#: Standard deviation of a comparison's noise in JOD: 1 JOD is preferred by 75 %.
SIGMA = 1 / stats.norm.ppf(0.75)
DESIGNS = ("full", "incomplete", "adaptive")
TESTS = ("sign", "wilcoxon", "mean", "worths")
GOALS = ("find", "exclude")
#: Prior standard deviation, in JOD, of the worths in the adaptive design: wide, so that the first
#: people meet all pairs.
PRIOR_JOD = 2.0
#: Answers that are held at once, so that memory stays flat.
CHUNK = 4_000_000


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


@dataclass(frozen=True)
class Plan:
    """What is to be found out.

    difference in JOD, between `pair`; worths: framing -> technique -> assumed worth in JOD.
    """

    techniques: tuple[str, ...]
    pair: tuple[str, str]
    difference: float = 0.5
    worths: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    answering: Answering = Answering()
    answers_each: int = 0
    alpha: float = 0.05
    power: float = 0.8
    family: int = 1
    most: int = 400
    studies: int = 1000
    seed: int = 1

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
            (
                "answers_each",
                self.answers_each,
                0 <= self.answers_each <= pairs,
                f"0 to {pairs}, the pairs of a framing",
            ),
            ("alpha", self.alpha, 0.0001 <= self.alpha <= 0.5, "a probability from 0.0001 to 0.5"),
            (
                "power",
                self.power,
                self.alpha < self.power < 1,
                "a probability above alpha and below 1",
            ),
            ("family", self.family, 1 <= self.family <= 100_000, "a number of tests from 1"),
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
        for framing, worths in self.worths.items():
            for name in self.techniques:
                if not math.isfinite(worths.get(name, math.nan)):
                    raise InputError(
                        f"the worth of {name!r} at {framing!r} is {worths.get(name)!r}, "
                        "expected JOD, a number"
                    )

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """The pairs of a framing, as places in `techniques`."""
        return list(combinations(range(len(self.techniques)), 2))

    @cached_property
    def target(self) -> int:
        """The place of `pair` in `pairs`."""
        return self.pairs.index(tuple(sorted(self.techniques.index(name) for name in self.pair)))

    @property
    def each(self) -> int:
        """Pairs that the incomplete and the adaptive design ask each person at a framing: half of
        them where nothing is said.
        """
        return self.answers_each or max(1, (len(self.pairs) + 1) // 2)

    def truth(self, framing: str, difference: float) -> np.ndarray:
        """The worths at a framing with the pair set `difference` apart about its middle, in JOD,
        centred on 0.
        """
        assumed = self.worths.get(framing, {})
        worths = np.array([assumed.get(name, 0.0) for name in self.techniques])
        a, b = self.pairs[self.target]
        middle = (worths[a] + worths[b]) / 2
        worths[a], worths[b] = middle - difference / 2, middle + difference / 2
        return worths - worths.mean()


def plan_table(
    plan: Plan,
    designs: Sequence[str] = DESIGNS,
    progress: Callable[[Iterable], Iterable] = lambda steps: steps,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Simulate the plan. Returns the curves and what is needed.

    curves: framing, design, answers_each, goal, test, correction (none or family), people, power,
    low, high (95 % interval of the simulation, Wilson 1927), closed_form (where there is one, else
    NaN). needed: framing, design, answers_each, goal, test, correction, people (NaN where more than
    `most` are), power, false_alarms: how often, with that many people (with `most` where more are
    needed) a study without any difference finds one (goal find), or a study with the difference D
    excludes it (goal exclude). progress wraps the list of steps, as tqdm does.
    """
    for design in designs:
        if design not in DESIGNS:
            raise InputError(f"the design is {design!r}, expected one of {', '.join(DESIGNS)}")
    steps = [(framing, design) for framing in (plan.worths or {"any": {}}) for design in designs]
    grid = people_grid(plan.most)
    levels = {"none": plan.alpha} | (
        {"family": plan.alpha / plan.family} if plan.family > 1 else {}
    )
    curves, needed = [], []
    for step, (framing, design) in enumerate(progress(steps)):
        runs = {
            truth: _Run(
                plan,
                design,
                plan.truth(framing, truth),
                np.random.default_rng([plan.seed, step, place]),
            )
            for place, truth in enumerate((plan.difference, 0.0))
        }
        each = len(plan.pairs) if design == "full" else plan.each
        for goal in GOALS:
            true, false = (plan.difference, 0.0) if goal == "find" else (0.0, plan.difference)
            for test in TESTS:
                if goal == "exclude" and test in ("sign", "wilcoxon"):
                    continue
                for correction, alpha in levels.items():
                    head = (framing, design, each, goal, test, correction)
                    powers = [runs[true].rate(goal, test, people, alpha) for people in grid]
                    for people, power in zip(grid, powers, strict=True):
                        low, high = _wilson(power, plan.studies)
                        closed = (
                            closed_form(plan, goal, test, people, alpha)
                            if design == "full"
                            else math.nan
                        )
                        curves.append((*head, people, power, low, high, closed))
                    count = _needed(plan, runs[true], goal, test, alpha, grid, powers)
                    at = plan.most if count is None else count
                    power, alarms = (
                        runs[true].rate(goal, test, at, alpha),
                        runs[false].rate(goal, test, at, alpha),
                    )
                    needed.append((*head, math.nan if count is None else count, power, alarms))
    columns = ["framing", "design", "answers_each", "goal", "test", "correction", "people"]
    return (
        pd.DataFrame(curves, columns=[*columns, "power", "low", "high", "closed_form"]),
        pd.DataFrame(needed, columns=[*columns, "power", "false_alarms"]),
    )


def people_grid(most: int) -> list[int]:
    """Numbers of people for a curve: about evenly far apart in logarithm, from 5 to `most`."""
    return sorted({round(value) for value in np.geomspace(5, most, 18)})


def closed_form(plan: Plan, goal: str, test: str, people: int, alpha: float) -> float:
    """The power of the full design from a formula, NaN where there is none.

    sign: exact, a binomial over how many people preferred one of the two (ties dropped), Gibbons
    and Chakraborti 2011, section 5.4. mean: the noncentral t with the true mean and standard
    deviation of an answer (Cohen 1988); to exclude, by integrating the normal mean over the
    standard deviation (Phillips 1990, doi:10.1007/BF01063556).
    Answers are no normal numbers, so that `mean` is close with twenty people or more and not exact.
    """
    model = plan.answering
    if goal == "find" and test == "sign":
        shares = model.shares(plan.difference)
        up, decided = shares[3] + shares[4], 1 - shares[2]
        power = 0.0
        for count in range(1, people + 1):
            critical = _sign_critical(count, alpha)
            if critical >= 0:
                rejected = stats.binom.cdf(critical, count, up / decided) + stats.binom.sf(
                    count - critical - 1, count, up / decided
                )
                power += stats.binom.pmf(count, people, decided) * rejected
        return float(power)
    if goal == "find" and test == "mean":
        return t_power(
            float(model.mean(plan.difference)) / model.sd(plan.difference), people, alpha
        )
    if goal == "exclude" and test == "mean":
        return tost_power(0.0, float(model.mean(plan.difference)) / model.sd(0.0), people, alpha)
    return math.nan


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


def fit_pilot(
    responses: Responses, most: int = 2_000
) -> tuple[dict[str, dict[str, float]], Answering]:
    """Assumptions from a pilot: worths in JOD at each framing and the thresholds, by maximum
    likelihood of the ordered probit P(answer) = Phi(cut - difference) pooled over people, symmetric
    cuts. The taste stays the default: a pilot is too small for it.
    """
    worths, cuts = {}, []
    for framing, items in responses.items.items():
        rows = responses.frame[responses.frame.framing == framing]
        place = {name: at for at, name in enumerate(items)}
        a, b = (rows[side].astype(object).map(place).to_numpy(int) for side in ("a", "b"))
        counts = np.zeros((len(items), len(items), 5))
        np.add.at(counts, (a, b, rows.preference.to_numpy(int) + 2), 1)
        if not _connected(counts.sum(axis=2)):
            raise InputError(
                f"the pilot at {framing!r} compares its techniques in separate groups; "
                "expected all to be connected"
            )
        found = _ordered_probit(counts, most)
        if found is None or not _strongly_connected(counts):
            raise InputError(
                f"the pilot at {framing!r} has no finite worths: a technique was never or "
                "always preferred, or every answer is 0; "
                "expected more people"
            )
        fitted, slight, clear = found
        worths[framing] = dict(zip(items, (fitted * SIGMA).tolist(), strict=True))
        cuts.append((slight * SIGMA, clear * SIGMA))
    slight, clear = np.mean(cuts, axis=0)
    return worths, Answering(float(slight), float(clear))


def _ordered_probit(counts: np.ndarray, most: int) -> tuple[np.ndarray, float, float] | None:
    """Worths (n,) centred, and the two cuts, in standard deviations; None where nobody preferred
    anything.

    A kind of answer that nobody gave has its cut at the end of the scale: no 'no difference',
    slight = 0; no clear one, clear = 10.
    """
    n = len(counts)
    i, k = np.nonzero(counts.sum(axis=2))
    about = counts[i, k]
    strong, slight, none = about[:, [0, 4]].sum(), about[:, [1, 3]].sum(), about[:, 2].sum()
    if not strong + slight:
        return None

    def cuts(x: np.ndarray) -> tuple[float, float]:
        first = np.exp(x[n]) if none else 0.0
        step = (np.exp(x[n + 1]) if slight else 0.0) if strong else 10.0
        return first, first + step

    def loss(x: np.ndarray) -> float:
        low, high = cuts(x)
        below = stats.norm.cdf(np.array([-high, -low, low, high]) - (x[k] - x[i])[:, None])
        shares = np.diff(below, axis=1, prepend=0, append=1)
        return (
            -(about * np.log(np.maximum(shares, 1e-300))).sum() + x[:n].sum() ** 2
        )  # the sum is free: 0

    start = np.r_[np.zeros(n), np.log([0.3, 0.9])]
    found = optimize.minimize(loss, start, method="BFGS", options={"maxiter": most, "gtol": 1e-3})
    return found.x[:n] - found.x[:n].mean(), *map(float, cuts(found.x))


def _connected(met: np.ndarray) -> bool:
    links = (met + met.T) > 0
    reach = np.linalg.matrix_power(links.astype(float) + np.eye(len(met)), len(met))
    return bool((reach > 0).all())


def _strongly_connected(counts: np.ndarray) -> bool:
    """Whether every technique is preferred, through others, to every other one, a tie counting both
    ways (Ford 1957).
    """
    won = counts[:, :, :3].sum(axis=2) + counts[:, :, 2:].sum(axis=2).T > 0
    reach = np.linalg.matrix_power(won.astype(float) + np.eye(len(won)), len(won))
    return bool((reach > 0).all())


class _Run:
    """`studies` simulated studies of one design and one truth, with `most` people each; smaller
    ones are their first people.
    """

    def __init__(self, plan: Plan, design: str, worths: np.ndarray, rng: np.random.Generator):
        self.plan = plan
        people, pairs = plan.most, len(plan.pairs)
        self.answers = np.empty((plan.studies, people, pairs), np.int8)
        self.asked = np.ones((plan.studies, people, pairs), bool)
        step = max(1, CHUNK // (people * pairs))
        for first in range(0, plan.studies, step):
            part = slice(first, min(first + step, plan.studies))
            self.answers[part] = _answers(plan, worths, part.stop - first, rng)
            if design == "incomplete":
                drawn = rng.random(self.asked[part].shape, np.float32)
                self.asked[part] = drawn.argsort(axis=2).argsort(axis=2) < plan.each
            elif design == "adaptive":
                self.asked[part] = _chosen(plan, self.answers[part], rng)
        a, b = np.array(plan.pairs).T
        self.ends = np.zeros((pairs, len(plan.techniques)))
        self.ends[np.arange(pairs), a], self.ends[np.arange(pairs), b] = -1, 1
        self._worths: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def rate(self, goal: str, test: str, people: int, alpha: float) -> float:
        """The share of studies that reach their goal with the first so many people."""
        plan = self.plan
        if test in ("sign", "wilcoxon"):
            return float((self._direct(test, people) <= alpha).mean())
        estimate, error, df = self._mean(people) if test == "mean" else self._least_squares(people)
        with np.errstate(divide="ignore", invalid="ignore"):
            if goal == "find":
                p = 2 * stats.t.sf(np.abs(estimate) / error, df)
            else:
                margin = (
                    float(plan.answering.mean(plan.difference)) if test == "mean" else self._margin
                )
                p = stats.t.sf((margin - np.abs(estimate)) / error, df)
        return float((np.where(error > 0, p, 1.0) <= alpha).mean())

    @cached_property
    def _margin(self) -> float:
        """The least-squares difference, on the scale of the answers, of two techniques D apart with
        the other ones about them.
        """
        plan, worths = self.plan, np.zeros(len(self.plan.techniques))
        a, b = plan.pairs[plan.target]
        worths[a], worths[b] = -plan.difference / 2, plan.difference / 2
        means = plan.answering.mean(self.ends @ worths)
        found = np.linalg.lstsq(self.ends, means, rcond=None)[0]
        return float(found[b] - found[a])

    def _counts(self, people: int) -> np.ndarray:
        """(studies, 5): the answers about the pair."""
        answers = self.answers[:, :people, self.plan.target]
        asked = self.asked[:, :people, self.plan.target]
        return np.stack(
            [((answers == value) & asked).sum(axis=1) for value in range(-2, 3)], axis=1
        )

    def _direct(self, test: str, people: int) -> np.ndarray:
        counts = self._counts(people)
        return sign_p(counts) if test == "sign" else wilcoxon_p(counts)

    def _mean(self, people: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        counts, values = self._counts(people), np.arange(-2, 3)
        n = counts.sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = counts @ values / n
            variance = (counts @ values**2 - n * mean**2) / (n - 1)
            return (
                np.nan_to_num(mean),
                np.where(n > 1, np.sqrt(np.clip(variance, 0, None) / n), 0),
                np.maximum(n - 1, 1),
            )

    def _least_squares(self, people: int) -> tuple[np.ndarray, np.ndarray, int]:
        """The pair's difference of least-squares worths, (studies,), and its standard error with
        people as clusters.
        """
        if people not in self._worths:
            plan, ends = self.plan, self.ends
            asked = self.asked[:, :people]
            n = asked.sum(axis=1)
            shown = np.where(asked, self.answers[:, :people], np.int8(0))
            laplace = np.einsum("sk,ki,kj->sij", n.astype(float), ends, ends)
            whole = (
                np.linalg.eigvalsh(laplace)[:, 1] > 1e-9
            )  # every technique is reached from every other one
            inverse = np.linalg.inv(laplace + 1 + (~whole)[:, None, None] * np.eye(len(ends.T)))
            worths = np.einsum("sij,sj->si", inverse, shown.sum(axis=1, dtype=np.int64) @ ends)
            lever = np.einsum("sij,j->si", inverse, ends[plan.target]) @ ends.T
            fitted = worths @ ends.T
            parts = np.einsum("spk,sk->sp", shown.astype(np.float32), lever) - np.einsum(
                "spk,sk->sp", asked.astype(np.float32), lever * fitted
            )
            error = np.sqrt((parts**2).sum(axis=1) * people / (people - 1))
            self._worths[people] = (worths @ ends[plan.target], np.where(whole, error, 0))
        return *self._worths[people], people - 1


def _answers(plan: Plan, worths: np.ndarray, studies: int, rng: np.random.Generator) -> np.ndarray:
    """(studies, people, pairs) int8: what everyone would answer about every pair."""
    model = plan.answering
    a, b = np.array(plan.pairs).T
    own = rng.standard_normal((studies, plan.most, len(worths)), np.float32) * np.float32(
        model.taste / math.sqrt(2)
    )
    own += worths.astype(np.float32)
    d = own[..., b] - own[..., a]
    d += np.float32(model.noise) * rng.standard_normal(d.shape, np.float32)
    size = np.abs(d)
    return (np.sign(d) * ((size >= model.slight).astype(np.int8) + (size >= model.clear))).astype(
        np.int8
    )


def _chosen(plan: Plan, answers: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(studies, people, pairs) bool: the pairs that the adaptive design asks each person, given
    what those before answered.
    """
    model, (studies, people, pairs), n = plan.answering, answers.shape, len(plan.techniques)
    a, b = np.array(plan.pairs).T
    ends = np.zeros((pairs, n))
    ends[np.arange(pairs), a], ends[np.arange(pairs), b] = -1, 1
    grid = np.linspace(-8, 8, 641)
    shares = model.shares(grid)
    slopes = np.gradient(shares, grid, axis=0)
    information = (slopes**2 / np.maximum(shares, 1e-12)).sum(
        axis=1
    )  # of one answer about d, 1/JOD^2
    expected = model.mean(grid)
    precision = np.broadcast_to(np.eye(n) / PRIOR_JOD**2, (studies, n, n)).copy()
    pull, outer = np.zeros((studies, n)), np.einsum("ki,kj->kij", ends, ends)
    asked = np.zeros(answers.shape, bool)
    slope = np.interp(0, grid, np.gradient(expected, grid))
    for person in range(people):
        variance = np.linalg.inv(precision)
        d = np.einsum("sij,sj->si", variance, pull) @ ends.T
        weight = np.interp(d, grid, information)
        gain = np.log1p(np.einsum("ki,sij,kj->sk", ends, variance, ends, optimize=True) * weight)
        gain += 1e-6 * rng.random(gain.shape)  # draws lots among equals
        places = np.argpartition(-gain, plan.each - 1, axis=1)[:, : plan.each]
        np.put_along_axis(asked[:, person], places, True, axis=1)
        used = weight * asked[:, person]
        # the answer as a measurement of d: one step of Fisher scoring from the present estimate
        seen = d + (answers[:, person] - np.interp(d, grid, expected)) / slope
        precision += np.einsum("sk,kij->sij", used, outer)
        pull += (used * seen) @ ends
    return asked


@lru_cache(maxsize=4096)
def _sign_critical(count: int, alpha: float) -> int:
    """The most people in the minority with which the exact two-sided sign test of `count` people
    rejects; -1 if it never does.
    """
    tails = 2 * stats.binom.cdf(np.arange(count // 2 + 1), count, 0.5)
    return int((np.minimum(tails, 1) <= alpha).sum()) - 1


def sign_p(counts: np.ndarray) -> np.ndarray:
    """(..., 5) counts of the answers -2 to 2 -> p of the exact two-sided sign test; 1 where nobody
    preferred one of the two.
    """
    down, up = counts[..., :2].sum(axis=-1), counts[..., 3:].sum(axis=-1)
    return np.minimum(2 * stats.binom.cdf(np.minimum(down, up), down + up, 0.5), 1.0)


def wilcoxon_p(counts: np.ndarray) -> np.ndarray:
    """(..., 5) counts of the answers -2 to 2 -> p of Wilcoxon's signed-rank test (zeros dropped,
    normal, ties corrected).
    """
    counts = np.asarray(counts, float)
    ones, twos = counts[..., 1] + counts[..., 3], counts[..., 0] + counts[..., 4]
    n = ones + twos
    statistic = counts[..., 3] * (ones + 1) / 2 + counts[..., 4] * (ones + (twos + 1) / 2)
    variance = n * (n + 1) * (2 * n + 1) / 24 - (ones**3 - ones + twos**3 - twos) / 48
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (statistic - n * (n + 1) / 4) / np.sqrt(variance)
    return np.where(n > 0, 2 * stats.norm.sf(np.abs(np.nan_to_num(z))), 1.0)


def _needed(
    plan: Plan,
    run: _Run,
    goal: str,
    test: str,
    alpha: float,
    grid: Sequence[int],
    powers: Sequence[float],
) -> int | None:
    """The fewest people from which on the power is reached on the whole grid; None where `most` are
    too few.
    """
    short = [place for place, power in enumerate(powers) if power < plan.power]
    if short and short[-1] == len(grid) - 1:
        return None
    if not short:
        return grid[0]
    low, high = grid[short[-1]], grid[short[-1] + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if run.rate(goal, test, middle, alpha) >= plan.power:
            high = middle
        else:
            low = middle
    return high


def _wilson(share: float, n: int, z: float = 1.959964) -> tuple[float, float]:
    """95 % interval of a share of n (Wilson 1927)."""
    middle, half = (
        share + z * z / (2 * n),
        z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n)),
    )
    return max(0.0, (middle - half) / (1 + z * z / n)), min(1.0, (middle + half) / (1 + z * z / n))


def power_files(
    plan: Plan,
    curves: pd.DataFrame,
    needed: pd.DataFrame,
    codebook: object,
    source: str,
    command: str = "",
) -> tuple[dict[str, bytes], list[str]]:
    """The files of a plan (tables marked as simulated, a figure, power.md) and what they say in
    short, a sentence each.
    """
    from analysis.worth_figures import TEST_STYLES, draw_power

    a, b = (codebook.label(name) for name in plan.pair)
    correction = "none"
    framing = curves.framing.iloc[0]
    picture = draw_power(
        curves[(curves.framing == framing) & (curves.correction == correction)],
        plan.power,
        plan.difference,
        correction,
        codebook,
    )
    sentences = []
    for (where, design, goal), rows in needed.groupby(["framing", "design", "goal"], sort=False):
        place = "" if where == "any" else f"{codebook.framing_label(where)}, "
        each = int(rows.answers_each.iloc[0])
        parts = []
        for test in [name for name in ("worths", "wilcoxon", "mean") if name in set(rows.test)]:
            if goal == "find" and test == "mean":
                continue
            counts = rows[rows.test == test].set_index("correction").people
            words = [
                f"more than {plan.most}" if math.isnan(count) else f"{count:.0f}"
                for count in counts
            ]
            parts.append(
                f"{words[0]} by {TEST_STYLES[test][0]}"
                + (f" ({words[1]} in the family)" if len(words) > 1 else "")
            )
        sentences.append(
            f"{place}{design} design, {each} of {len(plan.pairs)} pairs a person and framing: "
            f"to {goal} {plan.difference:g} JOD between "
            f"{a} and {b} with a power of {plan.power:g} takes this many people: "
            f"{', '.join(parts)}."
        )
    files = {
        "power.csv": _csv(curves.assign(simulated=1)),
        "needed.csv": _csv(needed.assign(simulated=1)),
        "power.md": _markdown(plan, needed, sentences, codebook, source, command).encode(),
    } | picture.files
    return files, sentences


def _csv(table: pd.DataFrame) -> bytes:
    return table.to_csv(index=False, float_format="%.6g", lineterminator="\n").encode()


def _markdown(
    plan: Plan,
    needed: pd.DataFrame,
    sentences: list[str],
    codebook: object,
    source: str,
    command: str,
) -> str:
    """The page to read: in short, what is needed, what was assumed."""
    from analysis.worth_figures import TEST_STYLES

    model = plan.answering
    lines = [
        "# How many people",
        "",
        "**SIMULATED ANSWERS.** Every participant on this page is a program.",
        "",
    ]
    lines += [f"- {sentence}" for sentence in sentences]
    lines += [
        "",
        "## People needed",
        "",
        "| framing | design | goal | test | correction | people | power | false alarms |",
    ]
    lines += ["|---|---|---|---|---|--:|--:|--:|"]
    for row in needed.itertuples():
        people = f"more than {plan.most}" if math.isnan(row.people) else f"{int(row.people)}"
        where = row.framing if row.framing == "any" else codebook.framing_label(row.framing)
        lines.append(
            f"| {where} | {row.design} | {row.goal} | {TEST_STYLES[row.test][0]} | "
            f"{row.correction} | {people} | {row.power:.3f} | "
            f"{row.false_alarms:.3f} |"
        )
    lines += [
        "",
        f"`none`: the test alone, at alpha {plan.alpha:g}, for one comparison planned before. "
        "`family`: Holm's first step for "
        f"{plan.family} tests, alpha/{plan.family};",
        "its later steps ask less, so that `family` needs at most so many people.",
        "",
        (
            "False alarms: how often a study of that size (of the largest one where more people "
            "are needed) reaches the goal when the truth"
        ),
        (
            "is the opposite: it finds a difference where there is none, or excludes one that is "
            "there."
        ),
        "",
        "![Power against people](figures/power.svg)",
        "",
        "## What was assumed",
        "",
        (
            f"- Worths in JOD, {source}; the pair set {plan.difference:g} apart about its middle, "
            "or 0 apart to exclude:"
        ),
    ]
    for framing in plan.worths or ("any",):
        worths = plan.truth(framing, plan.difference)
        listed = ", ".join(
            f"{codebook.label(name)} {worth:z.2f}"
            for name, worth in zip(plan.techniques, worths, strict=True)
        )
        lines.append(
            f"  - {'every framing' if framing == 'any' else codebook.framing_label(framing)}: "
            f"{listed}"
        )
    share = stats.norm.cdf(plan.difference / SIGMA)
    tied = model.shares(plan.difference)[2]
    lines += [
        f"- Were there no ties, {100 * share:.0f} % of answers would prefer the better one at "
        f"{plan.difference:g} JOD; "
        f"{100 * tied:.0f} % see no difference.",
        (
            f"- No difference is seen below {model.slight:.2f} JOD, a preference is clear from "
            f"{model.clear:.2f} JOD on; people's tastes for"
        ),
        f"  a difference spread by {model.taste:.2f} JOD (standard deviation).",
        (
            "- To exclude, the margin is the difference as it shows on the scale of the answers, "
            "and the test is two one-sided t tests."
        ),
        (
            "- The Wilcoxon test is the normal approximation here; `subdermal analyse` takes the "
            "exact one for up to 50 people."
        ),
        f"- {plan.studies} simulated studies for each framing, design and truth; alpha "
        f"{plan.alpha:g}, power {plan.power:g}, "
        f"seed {plan.seed}.",
        f"- numpy {np.__version__}, scipy {_version('scipy')}, subdermal {_version('subdermal')}.",
    ]
    if command:
        lines += ["", f"    {command}"]
    return "\n".join(lines) + "\n"


def _version(name: str) -> str:
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed as a package"
