"""How far people agree with themselves and with each other, and whose answers may be left out.

Everything on answers oriented to the pair.

Circular triads: a over b, b over c, c over a, counted over the triads in which all three answers
prefer one; zeta = 1 - d/d_max with d_max = (n^3 - n)/24 for odd n and (n^3 - 4n)/24 for even n
(Kendall and Babington Smith 1940, Biometrika 31, doi:10.2307/2332613). 'No difference' makes no
circle; the guessed variants settle each tie by a fair coin, in expectation, so that whoever sees no
difference is as consistent as whoever guesses.
Kendall's u: the pairs of participants who agree, over all, scaled to 1 for perfect agreement and
about 0 for chance; a tie is half a preference each way. Krippendorff's alpha with his ordinal
metric ("Content Analysis", 3rd ed. 2013, section 12.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import combinations, product
from math import comb

import numpy as np
import pandas as pd
from scipy import stats

from analysis import bootstrap, inference, worth
from analysis.codebook import FRAMING, Codebook
from analysis.errors import InputError
from analysis.options import FEWEST_PEOPLE, OVERALL, Exclusions, Options
from analysis.panel import Panel, by_pair, panels, with_notes
from analysis.responses import Responses

PARTICIPANTS = (
    *(
        "participant",
        "familiarity",
        "answers",
        "left",
        "none",
        "right",
        "side_p",
        "same_answer_share",
        "median_rt_ms",
    ),
    *("circular_triads", "zeta", "repeats", "repeat_share", "traps", "trap_share"),
    *("agreement_with_others", "excluded"),
)
#: Chance with which a one-sided person must be incompatible before `Exclusions.one_side_share`
#: applies.
ONE_SIDE_P = 0.001
#: To so many items the distribution of circular triads is exact.
MOST_EXACT_ITEMS = 10
#: What a person must have given before a rule can say anything of them: rule -> (how many, of
#: what). `one_side_share` needs eleven decided answers by its p alone.
ENOUGH = {
    "median_rt_ms": (5, "timed answers"),
    "same_answer_share": (10, "answers"),
    "zeta": (10, "triads answered in full"),
    "repeat_share": (5, "questions that prefer one both times they are asked"),
    "trap_share": (1, "trap pairs"),
}


def agreement(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, statistic, value, low, high, p; for each framing and 'overall':

    circular_triads             mean a participant, of those who answered every pair; p: fewer than
                                by guessing, one-sided: exact where no answer is a tie and there are
                                at most ten techniques, else a normal approximation with the exact
                                mean 1/4 and variance 3/16 of a decided triad (Moran 1947)
    zeta                        mean coefficient of consistency, at most 1
    circular_triads_guessed, zeta_guessed   the same with ties settled by a fair coin
    pooled_circular_triads, pooled_zeta     of the majority: whom more answers prefer; not for
                                            'overall'
    kendall_u                   p: chi-square of Kendall and Babington Smith, df = C(n,2) m (m -
                                1)/(m - 2)^2; only where everyone answered every pair and no answer
                                is a tie
    kendall_u_conditional       the same u; p: by flipping every decided answer by a fair coin, ties
                                kept
    krippendorff_alpha          ordinal; depends on the order in which pairs are listed, as every
                                ordinal alpha of preferences does
    krippendorff_alpha_both_ways    the same with every pair listed both ways, which no order
                                    changes
    left_share                  of decided answers, how many prefer the left image; p: signed ranks
                                of participants' right less left
    mean_answer                 -2 to 2, negative is left
    side_effect                 of the ordinal model, logits, positive is right; p: Wald's
    repeat_share                of questions asked again and preferring one both times, how many
                                prefer the same; not for 'overall'
    repeat_same_answer          of questions asked again, how many got the very same of the five
                                answers
    median_rt_ms                median of participants' medians, milliseconds; _decided and _none of
                                those answers alone

    Intervals: bootstrap over participants, but for u and alpha, where a person drawn twice would
    agree with themselves: those are jackknife intervals, one participant left out at a time, with
    Student's t; side_effect is Wald's.
    """
    rows, notes = [], bootstrap.few(responses)
    for name, panel in panels(responses).items():
        triads = [
            *_consistency(name, panel.parts, options, notes),
            *([] if name == OVERALL else _pooled(panel)),
            *_concordance(name, panel, options, notes),
            *_sides(name, panel, options, notes),
            *_repeats(name, responses, panel, options, notes),
            *_times(name, responses, panel, options),
        ]
        rows += [(name, *one) for one in triads]
    return with_notes(rows, ["framing", "statistic", "value", "low", "high", "p"], notes)


def consistency(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, statistic, value, low, high, p: of `agreement`, what is about circular triads, for
    each framing.
    """
    rows, notes = [], bootstrap.few(responses)
    for name, panel in panels(responses, overall=False).items():
        triads = [*_consistency(name, panel.parts, options, notes), *_pooled(panel)]
        rows += [(name, *one) for one in triads]
    return with_notes(rows, ["framing", "statistic", "value", "low", "high", "p"], notes)


def participants(responses: Responses, options: Options) -> pd.DataFrame:
    """One row a participant; see `PARTICIPANTS`.

    left, none, right       answers by side; side_p: two-sided binomial p of as many left as right
    same_answer_share       how often the most frequent of the five answers was given, 0 to 1
    circular_triads, zeta   over the framings that were answered in full: the sum and the mean;
                            empty where none was, or every answer is a tie
    repeats, repeat_share   questions asked again, and how many of those that prefer one both times
                            prefer the same
    agreement_with_others   cosine, -1 to 1, between the participant's preferences and the sums of
                            everyone else's
    excluded                the rules of `Options.exclusions` that apply, '' for none
    """
    frame = responses.frame
    grouped = frame.groupby("participant", observed=True)
    table = grouped.agg(
        familiarity=("familiarity", "first"),
        answers=("answer", "size"),
        median_rt_ms=("rt_ms", "median"),
    )
    given = (
        frame.groupby(["participant", "answer"], observed=True)
        .size()
        .unstack(fill_value=0)
        .reindex(columns=range(-2, 3), fill_value=0)
    )
    table["left"], table["none"], table["right"] = (
        given[-2] + given[-1],
        given[0],
        given[1] + given[2],
    )
    decided = table.left + table.right
    table["side_p"] = np.minimum(
        1, 2 * stats.binom.cdf(np.minimum(table.left, table.right), decided, 0.5)
    )
    table["same_answer_share"] = given.max(axis=1) / table.answers

    parts = list(panels(responses).values())[-1].parts  # of all framings or levels
    circles, zetas, whole = np.zeros(len(table)), np.zeros(len(table)), np.zeros(len(table), int)
    asked_triads = np.zeros(len(table), int)
    for panel in parts:
        full = _complete(panel)
        if full.any():
            circular, _, _ = triads(panel.chosen(full))
            circles[full] += circular
            zetas[full] += zeta(circular, len(panel.items))
            whole[full] += 1
            asked_triads[full] += comb(len(panel.items), 3)
    known = (whole > 0) & (decided > 0).to_numpy()  # whoever sees no difference makes no circle
    table["circular_triads"] = np.where(known, circles, np.nan)
    table["zeta"] = np.divide(zetas, whole, out=np.full(len(table), np.nan), where=known)

    again = responses.repeats
    table["repeats"] = (
        again.groupby("participant", observed=True).size().reindex(table.index, fill_value=0)
        if len(again)
        else 0
    )
    both = again[(again.preference != 0) & (again.first_preference != 0)]
    same = (
        np.sign(both.preference.astype(int)) == np.sign(both.first_preference.astype(int))
    ).groupby(both.participant, observed=True)
    table["repeat_share"] = same.mean().reindex(table.index).astype(float) if len(both) else np.nan
    given = {
        "median_rt_ms": grouped.rt_ms.count().to_numpy(),
        "same_answer_share": table.answers.to_numpy(),
        "zeta": asked_triads,
        "repeat_share": same.size().reindex(table.index, fill_value=0).to_numpy()
        if len(both)
        else np.zeros(len(table), int),
    }
    traps = responses.checks[responses.checks.kind == "trap"]
    obvious = np.sign(traps.answer.astype(float)) == np.sign(traps.expected.astype(float))
    right_traps = obvious.groupby(traps.participant.astype(str))
    table["traps"] = right_traps.size().reindex(table.index, fill_value=0).astype(int)
    table["trap_share"] = right_traps.mean().reindex(table.index).astype(float)
    given["trap_share"] = table.traps.to_numpy()

    preference = np.concatenate(
        [np.where(panel.answered, panel.preference, 0) for panel in parts], axis=1
    ).astype(float)
    asked = np.concatenate([panel.answered for panel in parts], axis=1)
    others = (preference.sum(axis=0) - preference) * asked
    length = np.sqrt((preference**2).sum(axis=1) * (others**2).sum(axis=1))
    table["agreement_with_others"] = np.divide(
        (preference * others).sum(axis=1), length, out=np.full(len(table), np.nan), where=length > 0
    )
    table = table.reset_index().astype({"participant": object})
    questions = _questions(parts, responses.codebook)
    table["excluded"] = _excluded(table, questions, options.exclusions, given)
    table = table[list(PARTICIPANTS)]
    table.attrs["notes"] = (
        f"rules of exclusion: {rules_in_words(options)}; they apply in the table of sensitivity "
        "alone",
        *_silent(options.exclusions, given),
    )
    return table


def side_balance(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, technique, left, right, left_share, p, holm_p: on which side each technique stood.

    p: two-sided exact binomial of as often left as right; holm_p over the declared family.
    Where sides were shuffled only chance makes them uneven; attrs['notes'] name the framings where
    side and technique are confounded, see `worth.confounded_side`.
    """
    frame = responses.frame
    rows, notes = [], []
    for name, items in responses.items.items():
        here = frame[frame.framing == name]
        left_name = np.where(here.a_left, here.a.astype(object), here.b.astype(object))
        right_name = np.where(here.a_left, here.b.astype(object), here.a.astype(object))
        left = np.array([(left_name == item).sum() for item in items])
        right = np.array([(right_name == item).sum() for item in items])
        p = np.minimum(1, 2 * stats.binom.cdf(np.minimum(left, right), left + right, 0.5))
        values = zip(items, left, right, left / (left + right), p, strict=True)
        rows += [(name, *value) for value in values]
        reason = worth.confounded_side(panels(responses)[name])
        if reason:
            notes.append(f"{name}: {reason}")
    table = with_notes(rows, ["framing", "technique", "left", "right", "left_share", "p"], notes)
    table["holm_p"] = inference.holm_in_families(table, options)
    return table


def sensitivity(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, conclusion, a, b, everyone, without_excluded, changed (0 or 1): what hangs on the
    declared exclusions.

    conclusion  'preferred': the technique of the pair that the declared test prefers after Holm's
                correction, '' for none
                'equivalent': '1' or '0', where a margin was declared, as `inference.verdict`
                'first': the technique with the highest bradley_terry worth, '' where there is no
                fit; a and b are empty

    Without anybody to exclude, and without enough people left, attrs['notes'] say so.
    """
    table = participants(responses, options)
    out = table.participant[table.excluded != ""]
    columns = ["framing", "conclusion", "a", "b", "everyone", "without_excluded", "changed"]
    lean = replace(options, models=("bradley_terry",))
    everyone = _conclusions(responses, lean)
    notes = [f"{len(out)} of {len(table)} participants are excluded: {rules_in_words(options)}"]
    if len(out) == len(table):
        return with_notes([], columns, [*notes, "nobody is left: no comparison"])
    rest = everyone
    if len(out):
        frame = responses.frame[~responses.frame.participant.isin(out)].reset_index(drop=True)
        frame = frame.assign(participant=frame.participant.cat.remove_unused_categories())
        rest = _conclusions(replace(responses, frame=frame), lean)
    rows = [
        (*key, value, rest.get(key, ""), int(value != rest.get(key, "")))
        for key, value in everyone.items()
    ]
    return with_notes(rows, columns, notes)


def _conclusions(responses: Responses, options: Options) -> dict[tuple[str, str, str, str], str]:
    """(framing, conclusion, a, b) -> what is concluded, by the verdicts of the report."""
    conclusions = {}
    for row in inference.pairs(responses, options).itertuples():
        verdict = inference.verdict(row, inference.alpha_of(options))
        preferred = row.b if row.mean_preference > 0 else row.a
        conclusions[row.framing, "preferred", row.a, row.b] = (
            preferred if verdict in ("different", "both") else ""
        )
        if options.margin is not None or options.margin_jod is not None:
            conclusions[row.framing, "equivalent", row.a, row.b] = str(
                int(verdict in ("equivalent", "both"))
            )
    for name, panel in panels(responses).items():
        worths = worth.estimated(panel, "bradley_terry", options)
        conclusions[name, "first", "", ""] = (
            "" if np.isnan(worths).any() else panel.items[int(np.argmax(worths))]
        )
    return conclusions


def _questions(parts: tuple[Panel, ...], codebook: Codebook) -> np.ndarray | int:
    """How many questions each participant had: all, but for a factor that varies within people,
    whose levels not everybody need meet.
    """
    if codebook.factor == FRAMING:
        return sum(len(part.first) for part in parts)
    levels = {part.framing: [one for one in parts if one.framing == part.framing] for part in parts}
    return sum(
        np.logical_or.reduce([one.answered.any(axis=1) for one in here])
        * sum(len(one.first) for one in here)
        for here in levels.values()
    )


def _excluded(
    table: pd.DataFrame,
    questions: np.ndarray | int,
    rules: Exclusions,
    given: Mapping[str, np.ndarray],
) -> list[str]:
    """The rules that apply to each participant, '' for none. given: rule -> how much of what
    `ENOUGH` asks for each gave.
    """
    decided = table.left + table.right
    # Where everybody was given a part of the questions, the longest list is what there was to do.
    given_at_most = np.minimum(questions, table.answers.max())
    checks = {
        "answered_share": rules.answered_share is not None
        and table.answers < (rules.answered_share or 0) * given_at_most,
        "one_side_share": rules.one_side_share is not None
        and (np.maximum(table.left, table.right) >= (rules.one_side_share or 0) * decided)
        & (table.side_p < ONE_SIDE_P),
        "median_rt_ms": rules.median_rt_ms is not None
        and table.median_rt_ms < (rules.median_rt_ms or 0),
        "same_answer_share": rules.same_answer_share is not None
        and table.same_answer_share >= (rules.same_answer_share or 0),
        "zeta": rules.zeta is not None and table.zeta < (rules.zeta or 0),
        "repeat_share": rules.repeat_share is not None
        and table.repeat_share < (rules.repeat_share or 0),
        "trap_share": rules.trap_share is not None and table.trap_share < (rules.trap_share or 0),
    }
    hits = {name: np.broadcast_to(np.asarray(hit), len(table)) for name, hit in checks.items()}
    hits |= {name: hits[name] & (given[name] >= least) for name, (least, _) in ENOUGH.items()}
    return ["; ".join(name for name, hit in hits.items() if hit[row]) for row in range(len(table))]


def _silent(rules: Exclusions, given: Mapping[str, np.ndarray]) -> list[str]:
    """A note for each rule that can fire for nobody, since nobody gave enough."""
    return [
        f"the rule {name} can fire for nobody: it needs {least} {what} of a person, and the most "
        f"that anybody gave is {given[name].max(initial=0)}"
        for name, (least, what) in ENOUGH.items()
        if getattr(rules, name) is not None and given[name].max(initial=0) < least
    ]


def rules(options: Options) -> dict[str, str]:
    """The rules of exclusion that are not off, by their names in `Exclusions`, in words."""
    words = {
        "answered_share": "answered under {:.0%} of the questions, or of the most that anybody did",
        "one_side_share": "at least {:.0%} on one side, and not by chance (p < 0.001)",
        "median_rt_ms": "median answer under {:g} ms",
        "same_answer_share": "the same answer at least {:.0%} of the time",
        "zeta": "zeta under {:g}",
        "repeat_share": "under {:.0%} alike when asked again",
        "trap_share": "under {:.0%} of the trap pairs answered as is obvious",
    }
    return {
        name: text.format(getattr(options.exclusions, name)).replace("%", " %")
        for name, text in words.items()
        if getattr(options.exclusions, name) is not None
    }


def rules_in_words(options: Options) -> str:
    """The rules of exclusion, those that the study declared apart from defaults."""
    texts = rules(options)
    if not texts:
        return "none"
    declared = [text for name, text in texts.items() if f"exclusions.{name}" in options.declared]
    default = [text for name, text in texts.items() if f"exclusions.{name}" not in options.declared]
    return "; ".join(
        f"{', or '.join(part)} ({source})"
        for part, source in (
            (declared, "declared by the study"),
            (default, "defaults of subdermal, not declared"),
        )
        if part
    )


# --- with oneself
# -----------------------------------------------------------------------------


def _complete(panel: Panel) -> np.ndarray:
    """(P,) bool: who answered all n (n - 1)/2 pairs of the panel, where there are at least three
    techniques.
    """
    n = len(panel.items)
    whole = n >= 3 and len(panel.first) == n * (n - 1) // 2
    return panel.answered.all(axis=1) if whole else np.zeros(len(panel.participants), bool)


def triads(panel: Panel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(P,) each: circular triads, triads without a tie, and circular triads expected when a fair
    coin settles ties.
    """
    n = len(panel.items)
    sign = np.zeros((len(panel.participants), n, n), np.int8)
    given = np.sign(np.where(panel.answered, panel.preference, 0))
    # 1: the row is preferred
    sign[:, panel.first, panel.second] = -given
    sign[:, panel.second, panel.first] = given
    return _count_triads(sign)


def _count_triads(sign: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`triads` of sign (P, n, n): 1 where the row is preferred, -1 where the column is, else 0."""
    n = sign.shape[1]
    circular, decided, guessed = (np.zeros(len(sign)) for _ in range(3))
    for i, j, k in combinations(range(n), 3):
        round_trip = np.stack([sign[:, i, j], sign[:, j, k], sign[:, k, i]])
        circular += np.abs(round_trip.sum(axis=0)) == 3
        decided += (round_trip != 0).all(axis=0)
        guessed += np.prod((1 + round_trip) / 2, axis=0) + np.prod((1 - round_trip) / 2, axis=0)
    return circular, decided, guessed


def zeta(circular: np.ndarray, n: int) -> np.ndarray:
    """The coefficient of consistency of n items, from the number of circular triads."""
    return 1 - np.asarray(circular) / most_triads(n)


def most_triads(n: int) -> int:
    """d_max: the most circular triads that n items can have (Kendall and Babington Smith 1940)."""
    return (n**3 - n if n % 2 else n**3 - 4 * n) // 24


def circular_triads(preferred: np.ndarray) -> int:
    """preferred (n, n): above 0 where i was preferred to j by one person, 0 where neither or never
    asked -> how many triads go in a circle.
    """
    sign = np.sign(np.asarray(preferred, float))
    sign = np.sign(sign - sign.T)
    return int(_count_triads(sign[None])[0][0])


@lru_cache(maxsize=16)
def triad_distribution(n: int) -> np.ndarray:
    """(d_max + 1,): the chance of 0, 1, ... circular triads when every answer about n items is
    settled by a fair coin, exact, for 3 to 10 items.

    By adding one item after another to the sorted scores (how often each item is preferred): d =
    C(n, 3) - sum of C(score, 2). Kendall and Babington Smith 1940, table I.
    """
    if not 3 <= n <= MOST_EXACT_ITEMS:
        raise InputError(f"n is {n}, expected 3 to {MOST_EXACT_ITEMS} items")
    states = {(0,): 1.0}
    for size in range(1, n):
        grown: dict[tuple[int, ...], float] = {}
        for scores, weight in states.items():
            for won in product((0, 1), repeat=size):  # whom the new item beats
                new = [score + 1 - one for score, one in zip(scores, won, strict=True)]
                key = tuple(sorted((*new, sum(won))))
                grown[key] = grown.get(key, 0.0) + weight
        states = grown
    chance = np.zeros(most_triads(n) + 1)
    for scores, weight in states.items():
        chance[comb(n, 3) - sum(comb(score, 2) for score in scores)] += weight
    return chance / chance.sum()


def few_triads(circular: int, people: int, n: int) -> float:
    """p of so few circular triads among so many people when all guess and no answer is a tie: the
    exact distribution of `triad_distribution`, people added up.
    """
    one = triad_distribution(n)
    size = people * (len(one) - 1) + 1
    padded = np.fft.rfft(one, 1 << (size - 1).bit_length())
    whole = np.clip(np.fft.irfft(padded**people)[:size], 0, None)
    return float(min(1.0, whole[: circular + 1].sum() / whole.sum()))


def _consistency(
    name: str, parts: tuple[Panel, ...], options: Options, notes: list[str]
) -> list[tuple]:
    labels = ("circular_triads", "zeta", "circular_triads_guessed", "zeta_guessed")
    full = [_complete(panel) for panel in parts]
    people = np.logical_or.reduce(full)
    if not people.any():
        why = (
            "fewer than three techniques"
            if all(len(panel.items) < 3 for panel in parts)
            else "nobody answered every pair"
        )
        notes.append(f"{name}: no circular triads: {why}")
        return [(label, np.nan, np.nan, np.nan, np.nan) for label in labels]
    sums = np.zeros((len(people), 4))
    framings, decided, seen = np.zeros(len(people)), 0.0, 0.0
    for panel, here in zip(parts, full, strict=True):
        if not here.any():
            continue
        n = len(panel.items)
        circular, settled, guessed = triads(panel.chosen(here))
        sums[here] += np.column_stack([circular, zeta(circular, n), guessed, zeta(guessed, n)])
        framings[here] += 1
        decided, seen = decided + settled.sum(), seen + circular.sum()
    if not decided:
        notes.append(f"{name}: no triad is answered without a tie: nothing can go in a circle")
        sums[:, :2] = np.nan
    sums[:, [1, 3]] /= np.maximum(framings, 1)[:, None]
    values = sums[people]
    draws = bootstrap.totals(values, options) / len(values)
    low, high = bootstrap.interval(draws, len(values), options.level)
    p = np.nan
    sizes = {len(panel.items) for panel, here in zip(parts, full, strict=True) if here.any()}
    triples = sum(
        comb(len(panel.items), 3) * int(here.sum()) for panel, here in zip(parts, full, strict=True)
    )
    if decided == triples and len(sizes) == 1 and max(sizes) <= MOST_EXACT_ITEMS:
        complete = sum(int(here.sum()) for here in full)
        p = few_triads(int(seen), complete, max(sizes))
    elif decided:
        p = float(stats.norm.cdf((seen - decided / 4) / np.sqrt(3 * decided / 16)))
    return [
        (label, values[:, k].mean(), low[k], high[k], p if label == "circular_triads" else np.nan)
        for k, label in enumerate(labels)
    ]


def _pooled(panel: Panel) -> list[tuple]:
    n = len(panel.items)
    counts = by_pair(panel, panel.counts)
    majority = np.sign(counts[:, 3:].sum(axis=1) - counts[:, :2].sum(axis=1))
    if n < 3 or not counts.any(axis=1).all() or not majority.any():
        return [
            (label, np.nan, np.nan, np.nan, np.nan)
            for label in ("pooled_circular_triads", "pooled_zeta")
        ]
    preferred = np.zeros((n, n))
    preferred[np.triu_indices(n, 1)] = -majority
    circular = circular_triads(preferred)
    return [
        ("pooled_circular_triads", circular, np.nan, np.nan, np.nan),
        ("pooled_zeta", zeta(circular, n), np.nan, np.nan, np.nan),
    ]


# --- with each other
# -----------------------------------------------------------------------------


def kendall_u(counts: np.ndarray) -> np.ndarray:
    """counts (..., K, 5) -> (...): Kendall's u, a tie counted as half a preference each way; NaN
    below two answers a pair.

    With m answers to every pair: u = 2 S/(C(m,2) C(n,2)) - 1, S the sum over pairs and directions
    of C(times preferred, 2).
    """
    half = counts[..., 2] / 2
    over, under = counts[..., 0] + counts[..., 1] + half, counts[..., 3] + counts[..., 4] + half
    m = over + under
    alike = (over * (over - 1) + under * (under - 1)) / 2
    share = np.divide(alike, m * (m - 1) / 2, out=np.full(m.shape, np.nan), where=m > 1)
    return (
        2 * np.nanmean(share, axis=-1) - 1
        if np.isfinite(share).any()
        else np.full(m.shape[:-1], np.nan)
    )


def kendall_test(counts: np.ndarray, items: int) -> tuple[float, float, float]:
    """counts (K, 5) without ties, the same number m > 2 of answers to each pair -> chi-square, its
    degrees of freedom, p.
    """
    over, under = counts[:, :2].sum(axis=1), counts[:, 3:].sum(axis=1)
    m, pairs = (over + under)[0], items * (items - 1) / 2
    alike = ((over * (over - 1) + under * (under - 1)) / 2).sum()
    chi2 = 4 / (m - 2) * (alike - pairs * m * (m - 1) / 4 * (m - 3) / (m - 2))
    df = pairs * m * (m - 1) / (m - 2) ** 2
    return float(chi2), float(df), float(stats.chi2.sf(chi2, df))


def krippendorff_alpha(
    counts: np.ndarray, metric: str = "ordinal", values: np.ndarray | None = None
) -> np.ndarray:
    """counts (..., K, C), answers of each of C values to each of K units -> (...): alpha; NaN where
    all answers are alike.

    metric: 'nominal', 'ordinal' (the values ascend) or 'interval' (of `values`, 0, 1, ... without
    them). Krippendorff 2013, "Content Analysis", 3rd ed., section 12.3.
    """
    counts = np.asarray(counts, float)
    size = counts.shape[-1]
    n = counts.sum(axis=-1)
    weight = np.divide(1.0, n - 1, out=np.zeros(n.shape), where=n > 1)
    pairs = np.einsum("...kc,...kd,...k->...cd", counts, counts, weight, optimize=True)
    pairs[..., range(size), range(size)] -= np.einsum("...kc,...k->...c", counts, weight)
    totals = pairs.sum(axis=-1)
    distance = _distance(totals, metric, values)
    observed = (pairs * distance).sum(axis=(-2, -1))
    expected = (totals[..., :, None] * totals[..., None, :] * distance).sum(axis=(-2, -1))
    whole = totals.sum(axis=-1)
    return 1 - (whole - 1) * np.divide(
        observed, expected, out=np.full(observed.shape, np.nan), where=expected > 0
    )


def _distance(totals: np.ndarray, metric: str, values: np.ndarray | None) -> np.ndarray:
    """(..., C, C): squared differences of the values in a metric."""
    size = totals.shape[-1]
    if metric == "nominal":
        return 1.0 - np.eye(size)
    if metric == "interval":
        place = np.arange(size, dtype=float) if values is None else np.asarray(values, float)
        return (place[:, None] - place) ** 2
    if metric != "ordinal":
        raise InputError(f"metric is {metric!r}, expected one of nominal, ordinal, interval")
    # mid-ranks: the sum from c to d, less half of each end, is their difference
    below = np.cumsum(totals, axis=-1) - totals / 2
    return (below[..., :, None] - below[..., None, :]) ** 2


def _concordance(name: str, panel: Panel, options: Options, notes: list[str]) -> list[tuple]:
    labels = (
        "kendall_u",
        "kendall_u_conditional",
        "krippendorff_alpha",
        "krippendorff_alpha_both_ways",
    )
    counts = panel.counts
    here = panel.answered.any(axis=1)
    if here.sum() < 2:
        notes.append(f"{name}: one participant: no agreement")
        return [(label, np.nan, np.nan, np.nan, np.nan) for label in labels]
    left_out = counts - panel.indicators[here]
    n = counts.sum(axis=1)
    p = np.nan
    if (n == here.sum()).all() and not counts[:, 2].any() and here.sum() > 2:
        # 'overall' has its pairs once a framing: C(n,2) of them in the formula are as many as there
        # are questions
        pairs = len(panel.first)
        p = kendall_test(counts, (1 + np.sqrt(1 + 8 * pairs)) / 2)[2]
    else:
        notes.append(
            f"{name}: kendall_u has no chi-square test with ties or missing answers; see "
            "kendall_u_conditional"
        )
    u = float(kendall_u(counts))
    bounds = _jackknife(u, kendall_u(left_out), options.level)
    both, both_out = (np.concatenate([one, one[..., ::-1]], axis=-2) for one in (counts, left_out))
    alpha, alpha_both = float(krippendorff_alpha(counts)), float(krippendorff_alpha(both))
    if len(panel.first) == 1:  # 0 by definition: one unit cannot differ from others
        alpha, left_out = np.nan, left_out[:0]
        notes.append(f"{name}: krippendorff_alpha has no number for one pair alone")
    elif np.isnan(alpha):
        notes.append(f"{name}: krippendorff_alpha has no number where all answers are alike")
    return [
        ("kendall_u", u, *bounds, p),
        ("kendall_u_conditional", u, *bounds, _coin_test(counts, u, options)),
        (
            "krippendorff_alpha",
            alpha,
            *_jackknife(alpha, krippendorff_alpha(left_out), options.level),
            np.nan,
        ),
        (
            "krippendorff_alpha_both_ways",
            alpha_both,
            *_jackknife(alpha_both, krippendorff_alpha(both_out), options.level),
            np.nan,
        ),
    ]


def _coin_test(counts: np.ndarray, u: float, options: Options) -> float:
    """How often u is as large when a fair coin decides every answer that prefers one."""
    decided = (counts[:, :2].sum(axis=1) + counts[:, 3:].sum(axis=1)).astype(int)
    if not decided.any() or np.isnan(u):
        return np.nan
    rng = np.random.default_rng([options.seed, 2])
    drawn = np.zeros((options.resamples, *counts.shape))
    drawn[..., 2] = counts[:, 2]
    drawn[..., 0] = rng.binomial(decided, 0.5, (options.resamples, len(decided)))
    drawn[..., 4] = decided - drawn[..., 0]
    return float((1 + (kendall_u(drawn) >= u - 1e-12).sum()) / (1 + options.resamples))


def _jackknife(value: float, left_out: np.ndarray, level: float) -> tuple[float, float]:
    m = len(left_out)
    if m < FEWEST_PEOPLE or not np.isfinite(left_out).all() or np.isnan(value):
        return np.nan, np.nan
    error = np.sqrt((m - 1) / m * ((left_out - left_out.mean()) ** 2).sum())
    half = float(stats.t.ppf((1 + level) / 2, m - 1) * error)
    return value - half, value + half


# --- sides, repeats, times
# -----------------------------------------------------------------------------


def _sides(name: str, panel: Panel, options: Options, notes: list[str]) -> list[tuple]:
    answer = np.where(
        panel.answered, np.where(panel.first_left, 1, -1) * panel.preference, 0
    ).astype(float)
    here = panel.answered.any(axis=1)
    left, right = (answer < 0).sum(axis=1), (answer > 0).sum(axis=1)
    columns = np.column_stack(
        [left, left + right, answer.sum(axis=1), panel.answered.sum(axis=1)]
    ).astype(float)[here]
    sums = np.vstack([columns.sum(axis=0), bootstrap.totals(columns, options)])
    share = np.divide(sums[:, 0], sums[:, 1], out=np.full(len(sums), np.nan), where=sums[:, 1] > 0)
    mean = sums[:, 2] / sums[:, 3]
    rows = [
        (
            "left_share",
            share[0],
            *bootstrap.interval(share[1:], len(columns), options.level),
            inference.signed_rank((right - left)[here])[0],
        ),
        (
            "mean_answer",
            mean[0],
            *bootstrap.interval(mean[1:], len(columns), options.level),
            np.nan,
        ),
    ]
    if "ordinal" not in options.models:
        return rows
    fit = None if worth.impossible(panel, "ordinal") else worth.ordinal_fit(panel, options)
    if fit is None:
        notes.append(f"{name}: no side_effect: the ordinal model has no fit, see worths")
        return [*rows, ("side_effect", np.nan, np.nan, np.nan, np.nan)]
    half = stats.norm.ppf((1 + options.level) / 2) * fit.side_error
    p = float(2 * stats.norm.sf(abs(fit.side) / fit.side_error))
    return [*rows, ("side_effect", fit.side, fit.side - half, fit.side + half, p)]


def _repeats(
    name: str, responses: Responses, panel: Panel, options: Options, notes: list[str]
) -> list[tuple]:
    again = responses.repeats
    again = again if name == OVERALL else again[again.framing == name]
    labels = ("repeat_share", "repeat_same_answer")
    if not len(again):
        notes.append(f"{name}: no question was asked again: nothing is known of repeat consistency")
        return [(label, np.nan, np.nan, np.nan, np.nan) for label in labels]
    later, first = again.preference.to_numpy(int), again.first_preference.to_numpy(int)
    both = (later != 0) & (first != 0)
    columns = np.column_stack(
        [both & (np.sign(later) == np.sign(first)), both, later == first, np.ones(len(later))]
    )
    people = (
        pd.DataFrame(columns.astype(float))
        .groupby(again.participant.astype(object).to_numpy())
        .sum()
        .to_numpy()
    )
    sums = np.vstack([people.sum(axis=0), bootstrap.totals(people, options)])
    rows = []
    for label, top, bottom in zip(labels, (0, 2), (1, 3), strict=True):
        share = np.divide(
            sums[:, top], sums[:, bottom], out=np.full(len(sums), np.nan), where=sums[:, bottom] > 0
        )
        rows.append(
            (label, share[0], *bootstrap.interval(share[1:], len(people), options.level), np.nan)
        )
    return rows


def _times(name: str, responses: Responses, panel: Panel, options: Options) -> list[tuple]:
    frame = responses.frame
    here = slice(None) if name == OVERALL else (frame.framing == name).to_numpy()
    table = pd.DataFrame(
        {"who": frame.participant.cat.codes.to_numpy(), "ms": frame.rt_ms.to_numpy()}
    )[here]
    none = (frame.strength == 0).to_numpy()[here]
    rows = []
    kinds: Mapping[str, object] = {
        "median_rt_ms": slice(None),
        "median_rt_ms_decided": ~none,
        "median_rt_ms_none": none,
    }
    for label, chosen in kinds.items():
        medians = np.sort(table[chosen].groupby("who").ms.median().dropna().to_numpy())
        if not len(medians):
            rows.append((label, np.nan, np.nan, np.nan, np.nan))
            continue
        draws = bootstrap.medians(medians, options)
        rows.append(
            (
                label,
                float(np.median(medians)),
                *bootstrap.interval(draws, len(medians), options.level),
                np.nan,
            )
        )
    return rows
