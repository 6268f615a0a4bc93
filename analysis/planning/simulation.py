"""Simulated studies of a plan, decided by the functions that decide a table in `analyse`.

The designs: `full` asks every pair of everyone; `incomplete` asks each person so many pairs drawn
at random; `adaptive` asks as many, those from which most is expected to be learnt, by the rule of
the questionnaire (`analysis.adaptive`).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy import stats

from analysis import bootstrap
from analysis.adaptive import most_telling
from analysis.inference.contrasts import linear_contrasts
from analysis.inference.people import (
    decided,
    declared_p,
    equivalence_counts,
    equivalent,
    holm,
    within,
)
from analysis.planning.plan import Plan

#: Answers that are drawn at once, so that memory stays flat.
CHUNK = 4_000_000
ANSWERS = np.arange(-2, 3)


class Studies:
    """So many simulated studies (`plan.studies` by default) of one design and one truth, with
    `plan.most` people each; smaller ones are their first people.

    answers (studies, people, framings, pairs) int8: what everyone would answer; asked: bool, what
    they were asked.
    """

    def __init__(
        self,
        plan: Plan,
        design: str,
        difference: Callable[[str], float],
        rng: np.random.Generator,
        studies: int | None = None,
    ):
        self.plan, self.studies = plan, studies or plan.studies
        shape = (self.studies, plan.most, len(plan.framings), len(plan.pairs))
        self.answers = np.empty(shape, np.int8)
        self.asked = np.ones(shape, bool)
        step = max(1, CHUNK // (plan.most * len(plan.pairs)))
        for place, framing in enumerate(plan.framings):
            worths = plan.truth(framing, difference(framing))
            for first in range(0, self.studies, step):
                part = slice(first, min(first + step, self.studies))
                drawn = answers(plan, worths, part.stop - first, rng)
                self.answers[part, :, place] = drawn
                if design == "incomplete":
                    lots = rng.random(drawn.shape, np.float32)
                    self.asked[part, :, place] = lots.argsort(axis=2).argsort(axis=2) < plan.each
                elif design == "adaptive":
                    self.asked[part, :, place] = chosen(plan, drawn, rng)
        self._counts: dict[int, np.ndarray] = {}

    def counts(self, people: int) -> np.ndarray:
        """(studies, framings, pairs, 5): how often each answer was given by the first people."""
        if people not in self._counts:
            before = max((known for known in self._counts if known < people), default=0)
            part = slice(before, people)
            shown = np.where(self.asked[:, part], self.answers[:, part], np.int8(9))
            more = np.stack([(shown == value).sum(axis=1) for value in ANSWERS], axis=-1)
            more = more.astype(np.int32)
            self._counts[people] = more + self._counts[before] if before else more
        return self._counts[people]

    def detected(self, people: int, correction: str = "family") -> np.ndarray:
        """(studies, framings) bool: whether the declared test finds a difference of the pair."""
        p = declared_p(self.counts(people), self.plan.options)
        return decided(self._adjusted(p, correction), self.plan.alpha)

    def excluded(self, people: int, correction: str = "family") -> np.ndarray:
        """(studies, framings) bool: whether the declared test calls the pair equivalent."""
        plan = self.plan
        p = equivalence_counts(self.counts(people), plan.margin)
        uncorrected, adjusted = self._of_pair(p), self._adjusted(p, correction)
        with np.errstate(invalid="ignore"):
            candidates = (uncorrected < plan.alpha) & (adjusted <= plan.alpha)
        inside = np.zeros(candidates.shape)
        if candidates.any():
            inside[candidates] = self._inside(people, candidates)
        return equivalent(inside, uncorrected, adjusted, plan.alpha)

    def contrasted(self, people: int, correction: str = "family") -> np.ndarray:
        """(studies, framings) bool: whether the contrast of the linear model, which `analyse` sets
        beside the declared test, finds a difference of the pair.
        """
        plan = self.plan
        pairs = [(b, a) for a, b in plan.pairs]
        p = np.empty((self.studies, len(plan.framings), len(pairs)))
        step = max(1, CHUNK // (people * len(plan.pairs)))
        for place in range(len(plan.framings)):
            for first in range(0, self.studies, step):
                part = slice(first, first + step)
                asked = self.asked[part, :people, place]
                shown = np.where(asked, self.answers[part, :people, place], np.int8(0))
                estimate, error = linear_contrasts(shown, asked, plan.ends, pairs)
                with np.errstate(divide="ignore", invalid="ignore"):
                    tail = 2 * stats.t.sf(np.abs(estimate) / error, people - 1)
                p[part, place] = np.where(error > 0, tail, np.nan)
        return decided(self._adjusted(p, correction), plan.alpha)

    def _of_pair(self, values: np.ndarray) -> np.ndarray:
        return values[..., self.plan.target]

    def _adjusted(self, p: np.ndarray, correction: str) -> np.ndarray:
        """The pair's p at each framing after a correction: 'family', Holm over the declared family;
        'first', Holm's first step; 'none'.
        """
        if correction == "none":
            return self._of_pair(p)
        if correction == "first":
            return np.minimum(1, self._of_pair(p) * self.plan.family)
        if self.plan.options.family == "study":
            return self._of_pair(holm(p.reshape(len(p), -1)).reshape(p.shape))
        return self._of_pair(holm(p))

    def _inside(self, people: int, where: np.ndarray) -> np.ndarray:
        """For the studies and framings in `where`: 1 where the bootstrap interval at 1 - 2 alpha of
        the pair's mean answer is within the margin, else 0.
        """
        plan = self.plan
        study, framing = np.nonzero(where)
        given = self.answers[study, :people, framing, plan.target].T
        asked = self.asked[study, :people, framing, plan.target].T
        sums = bootstrap.totals(np.where(asked, given, 0), plan.options)
        n = people if asked.all() else bootstrap.totals(asked, plan.options)
        with np.errstate(divide="ignore", invalid="ignore"):
            draws = np.where(n > 0, sums / n, np.nan)
        result = np.empty(len(study))
        sizes = asked.sum(axis=0)
        for size in np.unique(sizes):
            here = sizes == size
            bounds = bootstrap.interval(draws[:, here], int(size), 1 - 2 * plan.alpha)
            result[here] = within(*bounds, plan.margin)
        return np.nan_to_num(result)


def answers(plan: Plan, worths: np.ndarray, studies: int, rng: np.random.Generator) -> np.ndarray:
    """(studies, people, pairs) int8: what everyone would answer about every pair."""
    model = plan.answering
    a, b = np.array(plan.pairs).T
    own = rng.standard_normal((studies, plan.most, len(worths)), np.float32) * np.float32(
        model.taste / math.sqrt(2)
    )
    own += worths.astype(np.float32)
    d = own[..., b] - own[..., a]
    d += np.float32(model.noise) * rng.standard_normal(d.shape, np.float32)
    return model.answer(d)


def chosen(plan: Plan, answers: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(studies, people, pairs) bool: the pairs that the adaptive design asks each person, given
    what those before answered. People come one after the other.
    """
    studies, people, pairs = answers.shape
    rows, asked = np.zeros((studies, pairs, 5), int), np.zeros(answers.shape, bool)
    worths = None
    for person in range(people):
        lots = rng.random((studies, pairs))
        places, worths = most_telling(
            rows, len(plan.techniques), plan.each, plan.least_share, plan.as_good, lots, worths
        )
        mine = asked[:, person]
        np.put_along_axis(mine, places, True, axis=1)
        given = answers[:, person]
        rows[..., 0] += mine  # sides make no difference here
        for column, preferred in ((2, given < 0), (3, given > 0), (4, given == 0)):
            rows[..., column] += mine & preferred
    return asked
