"""Pairs from whose answers most is expected to be learnt, given all answers so far.

Worths of a cell have a normal prior, answers come by Bradley and Terry's model, the posterior is
Laplace's approximation. What an answer about a pair is expected to tell is its mutual information
with the pair's difference d ~ N(m, v), H(E[p(d)]) - E[H(p(d))] with p the logistic function, by
Gauss-Hermite quadrature: Li et al. 2018, "Hybrid-MST: a hybrid active sampling strategy for
pairwise preference aggregation", NeurIPS 31, arXiv:1810.08851; Mikhailiuk et al. 2021, "Active
sampling for pairwise comparisons via approximate message passing and information gain
maximization", ICPR, arXiv:2004.05691. Both choose batches by a spanning tree; here a batch is one
person's list, and after each of its pairs the covariance is as if the pair had been answered, so
that the next one tells something else. Users of theirs report repeated pairs and lopsided counts
(gfxdisp/asap, issues 9 and 13): here no person meets a pair twice, pairs that fell behind
`least_share` of the mean come first, and of pairs that tell nearly as much as the best one the one
that was asked least, so that the noise of few answers does not steer: among near-equal techniques
the greatest information alone costs a quarter of all answers (`benchmarks/pairs.py`).

No package is used: theirs is published as notebooks and MATLAB, without releases.

The questionnaire chooses by this when somebody begins (`stimuli.design.adaptive_trials`), and
`subdermal power` in the studies that it simulates.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

#: Standard deviation of a worth before anybody answered, logits: one in twenty differences is so
#: large that 98 % prefer one.
PRIOR = 1.5
NODES, WEIGHTS = np.polynomial.hermite.hermgauss(24)
#: What a study that says nothing else takes (`stimuli.asking.Assignment`).
LEAST_SHARE, AS_GOOD = 0.5, 0.8
#: Newton's steps end where none is longer, logits.
CLOSE = 1e-10

#: Of each pair of a cell, in the order of `combinations`: how often it was asked with its first
#: and with its second technique on the left, how often the first, the second and neither was
#: preferred.
State = Mapping[str, Sequence[Sequence[int]]]


def nothing(cells: Sequence[str], techniques: Sequence[str]) -> dict[str, list[list[int]]]:
    """The state in which nobody was asked."""
    pairs = len(techniques) * (len(techniques) - 1) // 2
    return {cell: [[0] * 5 for _ in range(pairs)] for cell in cells}


def written(state: State) -> str:
    """As text, the same for the same state."""
    return json.dumps(state, separators=(",", ":"), sort_keys=True)


def posterior(
    rows: Sequence | np.ndarray, items: int, start: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Mean (..., n) and covariance (..., n, n) of the worths of a cell, logits, from its counts
    (..., K, 5); 'no difference' is half a win for each. start: (..., n), worths near the mean.
    """
    ends = _ends(items)
    counts = np.asarray(rows, float)
    won, lost = counts[..., 2] + counts[..., 4] / 2, counts[..., 3] + counts[..., 4] / 2
    worth = np.zeros((*counts.shape[:-2], items)) if start is None else start
    outer, prior = ends[:, :, None] * ends[:, None, :], np.eye(items) / PRIOR**2
    for _ in range(100):
        p = _logistic(worth @ ends.T)
        gradient = (won * (1 - p) - lost * p) @ ends - worth / PRIOR**2
        precision = np.tensordot((won + lost) * p * (1 - p), outer, 1) + prior
        step = np.linalg.solve(precision, gradient[..., None])[..., 0]
        longest = np.abs(step).max(axis=-1, keepdims=True)
        worth = worth + step / np.maximum(1.0, longest)
        if longest.max() < CLOSE:
            break
    return worth, np.linalg.inv(precision)


def information(mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """(...), nats: what an answer about each pair is expected to tell, of the mean and the variance
    of its difference, logits.
    """
    weights = WEIGHTS / np.sqrt(np.pi)
    d = mean[..., None] + np.sqrt(2 * variance)[..., None] * NODES
    size = np.abs(d)
    entropy = np.exp(-size)  # in place from here on: there are studies by the thousand
    less = entropy / (1 + entropy)  # the probability of the less probable answer
    np.log1p(entropy, out=entropy)
    size *= less
    entropy += size
    np.subtract(0.5, less, out=less)
    p = np.copysign(less, d, out=d)
    p += 0.5
    return _entropy(p @ weights) - entropy @ weights


def most_telling(
    rows: Sequence | np.ndarray,
    items: int,
    some: int,
    least_share: float,
    as_good: float,
    lots: np.ndarray,
    start: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(..., some): the pairs of a cell for the next person, by their places among `combinations`,
    from its counts (..., K, 5); and the means (..., n) of the worths, logits.

    lots: (..., K), which of equal ones. The rest as in `chosen` and `posterior`.
    """
    count = np.asarray(rows)[..., :2].sum(axis=-1)
    least = np.floor(least_share * (count.sum(axis=-1) + some) / count.shape[-1])
    order = np.lexsort((lots, count), axis=-1)
    mean, covariance = posterior(rows, items, start)
    ends = _ends(items)
    d, places = mean @ ends.T, np.empty((*count.shape[:-1], some), int)
    taken = np.zeros(count.shape, bool)
    for turn in range(some):
        k = order[..., turn]  # of those that fell behind, the next
        behind = _at(count, k) < least
        if not behind.all():
            spread = np.einsum("...ij,ki,kj->...k", covariance, ends, ends, optimize=True)
            gain = np.where(taken, -np.inf, information(d, np.maximum(spread, 0)))
            worse = gain < as_good * gain.max(axis=-1, keepdims=True)
            best = np.lexsort((lots, -np.round(gain, 9), count, worse), axis=-1)[..., 0]
            k = np.where(behind, k, best)
        places[..., turn] = k
        np.put_along_axis(taken, k[..., None], True, axis=-1)
        p = _logistic(_at(d, k))
        along = np.einsum("...ij,...j->...i", covariance, ends[k])
        weight = p * (1 - p)
        weight = weight / (1 + weight * np.einsum("...i,...i->...", ends[k], along))
        covariance = (
            covariance - weight[..., None, None] * along[..., :, None] * along[..., None, :]
        )
    return places, mean


def chosen(
    state: State,
    cells: Sequence[str],
    techniques: Sequence[str],
    pairs: int,
    least_share: float,
    as_good: float,
    share: Callable[[], float],
) -> list[tuple[str, str, str]]:
    """So many pairs (cell, left, right) for the next person: each at most once, of all cells as
    many to one, those first that fell behind, then those that tell most.

    Sides: of each pair the one that was seldomer on the left; of even ones that of the technique
    that was. least_share: 0 to 1, of a cell's mean count of a pair; as_good: 0 to 1, of the most
    that a pair tells. share: random numbers, 0 to 1.
    """
    known = list(combinations(range(len(techniques)), 2))
    asked = {cell: np.asarray(state[cell])[:, :2].sum() for cell in cells}
    by_need = sorted(cells, key=lambda cell: (asked[cell], share()))
    result = []
    for place, cell in enumerate(by_need):
        some = pairs // len(cells) + (place < pairs % len(cells))
        lots = np.array([share() for _ in known])
        places, _ = most_telling(state[cell], len(techniques), some, least_share, as_good, lots)
        result += _sided(cell, state[cell], [(k, *known[k]) for k in places], techniques, share)
    return result


def _sided(
    cell: str,
    rows: Sequence[Sequence[int]],
    pairs: list[tuple[int, int, int]],
    techniques: Sequence[str],
    share: Callable[[], float],
) -> list[tuple[str, str, str]]:
    lefts = np.zeros(len(techniques))  # times on the left less times on the right
    for (i, j), row in zip(combinations(range(len(techniques)), 2), rows):
        lefts[i] += row[0] - row[1]
        lefts[j] += row[1] - row[0]
    result = []
    for k, i, j in pairs:
        seldomer = (rows[k][0] - rows[k][1], lefts[i] - lefts[j], share() - 0.5)
        if next(one for one in (*seldomer, 1) if one) > 0:
            i, j = j, i
        lefts[i] += 1
        lefts[j] -= 1
        result.append((cell, techniques[i], techniques[j]))
    return result


def _ends(items: int) -> np.ndarray:
    """(K, n): takes worths to the differences of pairs, the first less the second."""
    first, second = np.array(list(combinations(range(items), 2))).T
    ends = np.zeros((len(first), items))
    ends[np.arange(len(first)), first], ends[np.arange(len(first)), second] = 1, -1
    return ends


def _at(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(...): of values (..., K) those at places (...)."""
    return np.take_along_axis(values, places[..., None], axis=-1)[..., 0]


def _logistic(d: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(d, -40, 40)))


def _entropy(p: np.ndarray) -> np.ndarray:
    """Of a yes or no, nats."""
    q = np.clip(p, 1e-15, 1 - 1e-15)
    return -(q * np.log(q) + (1 - q) * np.log1p(-q))
