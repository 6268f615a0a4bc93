"""In plain words, from the numbers: what can be concluded, what cannot. Every sentence holds a
number of the tables, or none.

A difference is concluded where Holm's p of the declared test is at most 1 - level; that two
techniques are as good as each other only where the interval and, after Holm's correction, both
one-sided tests put them within the declared margin. Everything else is undecided, and said to be.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from analysis.codebook import FRAMING, Codebook
from analysis.inference import alpha_of, verdict
from analysis.options import OVERALL, Options
from analysis.shown import number, probability
from analysis.worth_figures import framing_label

MODEL_NAMES = {
    "bradley_terry": "Bradley and Terry's model",
    "davidson": "Davidson's model",
    "thurstone_jod": "Thurstone's case V",
    "ordinal": "the ordinal model",
}
#: How many pairs one sentence names; of more it gives the number.
MOST = 8
#: The tables that name the others.
PAIRS, CONTRASTS = "the table of every pair", "the table of contrasts"


@dataclass
class Conclusions:
    """can: what the answers show; cannot: what they do not."""

    can: list[str] = field(default_factory=list)
    cannot: list[str] = field(default_factory=list)


def conclude(
    tables: Mapping[str, pd.DataFrame],
    notes: Mapping[str, tuple[str, ...]],
    codebook: Codebook,
    options: Options,
    people: int,
    simulated: bool,
) -> Conclusions:
    """The sentences of a report, in the order in which they are to be read."""
    conclusions, who = Conclusions(), "simulated participants" if simulated else "people"
    alpha = alpha_of(options)
    pairs = tables["pairs"]
    for framing, rows in pairs[pairs.framing != OVERALL].groupby("framing", sort=False):
        where = framing_label(codebook, framing)
        _about_pairs(conclusions, where, rows, codebook, options, alpha, who)
        _about_disagreements(
            conclusions, where, rows, _of(tables, "contrasts", framing), codebook, alpha
        )
        _about_jod_margin(conclusions, where, rows, codebook, options, alpha)
    _about_interaction(conclusions, tables, codebook, alpha)
    if not (options.margin or options.margin_jod):
        conclusions.cannot.append(
            "No margin of equivalence was declared before the data, so that no two "
            "techniques can be called as good as each other; "
            "that a test finds no difference does not make them equal."
        )
    _about_trend(conclusions, tables["trend"], codebook, alpha)
    _about_order(conclusions, tables, alpha)
    _about_images(conclusions, tables, codebook, alpha)
    _about_agreement(conclusions, tables["agreement"], codebook, alpha, who.capitalize())
    _about_sides(conclusions, tables, notes, codebook, alpha, who.capitalize())
    _about_familiarity(conclusions, tables["familiarity_interaction"], codebook, alpha)
    _about_exclusions(conclusions, tables["participants"], tables["sensitivity"], people)
    _about_fits(conclusions, notes.get("worths", ()), codebook)
    _about_spread(conclusions, tables, codebook)
    conclusions.cannot.append(
        "Nothing here says how people judge, since a program answered."
        if simulated
        else "These answers speak for people like those asked, on displays like theirs, and "
        f"{_images(codebook)}; for other ones they are a guess."
    )
    return conclusions


def _about_pairs(
    conclusions: Conclusions,
    where: str,
    rows: pd.DataFrame,
    codebook: Codebook,
    options: Options,
    alpha: float,
    who: str,
) -> None:
    by = {key: [] for key in ("different", "equivalent", "both", "undecided")}
    for row in rows.itertuples():
        by[verdict(row, alpha)].append(row)
    differing = by["different"] + by["both"]
    if differing:
        # preference is negative where a is preferred
        over: dict[str, list[str]] = {}
        for row in differing:
            winner, loser = (row.a, row.b) if row.mean_preference < 0 else (row.b, row.a)
            over.setdefault(winner, []).append(loser)
        order = sorted(over, key=lambda name: (-len(over[name]), codebook.techniques.index(name)))
        words = "; ".join(
            f"{codebook.label(name)} over "
            + (
                listed([codebook.label(one) for one in over[name]])
                if len(over[name]) <= MOST
                else f"{len(over[name])} others"
            )
            for name in order
        )
        most = _equals(max(row.holm_p for row in differing))
        most = most if len(differing) == 1 else most.replace("=", "at most")
        conclusions.can.append(
            f"{where}: {who} preferred {words} ({_test(options)}, p {most} after Holm's "
            "correction; "
            f"{_share(differing, rows)})."
        )
    for row in by["equivalent"] + by["both"]:
        a, b = codebook.label(row.a), codebook.label(row.b)
        if options.margin:
            words = (
                f"{where}: {a} and {b} are as good as each other within the declared "
                f"margin of {options.margin:g} points"
            )
            words += f": the mean preference for {b} is {number(row.mean_preference, sign=True)}"
            words += (
                f", interval {number(row.equivalence_low, sign=True)} to "
                f"{number(row.equivalence_high, sign=True)}"
            )
            words += (
                f" (two one-sided tests, p {_equals(row.tost_holm_p)} after Holm's correction)."
            )
        else:
            words = (
                f"{where}: {a} and {b} are as good as each other within the declared "
                f"margin of {options.margin_jod:g} JOD"
            )
            words += f": {b} is {number(row.jod, sign=True)} JOD above {a}."
        if row in by["both"]:
            words += " The difference is real, and small."
        conclusions.can.append(words)
    for row in by["undecided"] + by["different"]:
        if row.equivalent == 1:
            conclusions.cannot.append(
                f"{where}: {codebook.label(row.a)} and {codebook.label(row.b)} come within "
                f"the margin of {options.margin:g} points when "
                f"taken alone (two one-sided tests, p {_equals(row.tost_p)}), which holds "
                "only if this pair was singled out before the "
                "data; after Holm's correction over all pairs it does not (p "
                f"{_equals(row.tost_holm_p)})."
            )
    untested = [row for row in rows.itertuples() if not np.isfinite(row.holm_p)]
    if untested:
        which = "any pair" if len(untested) == len(rows) else _pairs(untested, codebook)
        conclusions.cannot.append(f"{where}: too few people answered to test {which}.")
    undecided = _undecided(rows, alpha)
    if undecided:
        tail = "neither a difference nor equality is shown"
        if not options.margin and not options.margin_jod:
            tail = "no difference is shown, which does not make them equal"
        if len(undecided) == len(rows) > 1:
            conclusions.cannot.append(
                f"{where}: all {len(rows)} pairs are undecided: {tail} for any of them."
            )
        else:
            them = _pairs(undecided, codebook)
            if len(undecided) > MOST:
                them = f"them; {PAIRS} names them"
            conclusions.cannot.append(
                f"{where}: {_share(undecided, rows)} {'is' if len(undecided) == 1 else 'are'} "
                f"undecided: {tail} for {them}."
            )
    alike = [row for row in undecided if np.isnan(row.tost_p)] if options.margin else []
    if alike:
        which = f"each of all {len(rows)} pairs" if len(alike) == len(rows) > 1 else None
        which = which or _pairs(alike, codebook)
        conclusions.cannot.append(
            f"{where}: everyone gave the same answer about {which}: answers without spread allow "
            "no test of equality."
        )


def _undecided(rows: pd.DataFrame, alpha: float) -> list:
    """The pairs that were tested and came to nothing."""
    tested = rows[np.isfinite(rows.holm_p)]
    return [row for row in tested.itertuples() if verdict(row, alpha) == "undecided"]


def _of(tables: Mapping[str, pd.DataFrame], name: str, framing: str) -> pd.DataFrame:
    """The rows of a table at a framing; none where the table was not made."""
    if name not in tables:
        return pd.DataFrame({"a": [], "b": []})
    return tables[name][tables[name].framing == framing]


def _about_disagreements(
    conclusions: Conclusions,
    where: str,
    rows: pd.DataFrame,
    contrasts: pd.DataFrame,
    codebook: Codebook,
    alpha: float,
) -> None:
    """Where an interval or another model says otherwise than the declared test: a sentence for each
    kind of disagreement.
    """
    level = f"{100 * (1 - alpha):g} %"
    undecided = _undecided(rows, alpha)
    other = {(row.a, row.b): row for row in contrasts.itertuples()}

    def excludes(row: object, low: str, high: str) -> bool:
        return getattr(row, low) > 0 or getattr(row, high) < 0

    unadjusted, together = [], []
    for row in undecided:
        if excludes(row, "jod_simultaneous_low", "jod_simultaneous_high") or excludes(
            row, "simultaneous_low", "simultaneous_high"
        ):
            together.append(row)
        elif excludes(row, "jod_low", "jod_high") or excludes(row, "low", "high"):
            unadjusted.append(row)
    if unadjusted:
        conclusions.cannot.append(
            f"{where}: of the undecided pairs, an interval at {level} of the mean preference or of "
            f"the JOD difference, which is that of one pair alone, excludes 0 for "
            f"{_pairs(unadjusted, codebook)}; adjusted for all pairs of the family it does not, so "
            "that no difference is concluded."
        )
    if together:
        conclusions.cannot.append(
            f"{where}: an adjusted interval, of the mean preference or of the JOD difference "
            f"(from answers about all pairs), excludes 0 for {_pairs(together, codebook)}, where "
            "the declared test does not decide; the declared test stands."
        )
    by_model = [
        row for row in undecided if (row.a, row.b) in other and other[row.a, row.b].holm_p <= alpha
    ]
    if by_model:
        conclusions.cannot.append(
            f"{where}: the contrast of the linear model, from the answers about all pairs, differs "
            f"from 0 after Holm's correction for {_pairs(by_model, codebook, CONTRASTS)}, where "
            "the declared test does not decide; the declared test stands."
        )
    not_by_model = [
        row
        for row in rows.itertuples()
        if verdict(row, alpha) in ("different", "both")
        and (one := other.get((row.a, row.b))) is not None
        and np.isfinite(one.holm_p)
        and not (one.holm_p <= alpha and one.estimate * row.mean_preference > 0)
    ]
    if not_by_model:
        conclusions.can.append(
            f"{where}: for {_pairs(not_by_model, codebook, CONTRASTS)} the declared test finds a "
            "difference that the contrast of the linear model, from the answers about all pairs, "
            "does not find after Holm's correction; the declared test stands."
        )
    against = [
        row
        for row in rows.itertuples()
        if verdict(row, alpha) in ("different", "both")
        and np.isfinite(row.simultaneous_low)
        and not excludes(row, "simultaneous_low", "simultaneous_high")
    ]
    if against:
        conclusions.can.append(
            f"{where}: for {_pairs(against, codebook)} the declared test finds a difference while "
            "the adjusted interval of the mean preference holds 0: it guards all pairs in one "
            "step, Holm's correction in several, and the declared test stands."
        )


def _about_jod_margin(
    conclusions: Conclusions,
    where: str,
    rows: pd.DataFrame,
    codebook: Codebook,
    options: Options,
    alpha: float,
) -> None:
    """Which pairs meet the margin in JOD, beside a margin in points that decides."""
    if not options.margin_jod or not options.margin:
        return
    if rows.jod.isna().all():  # no worths, which a sentence of its own says
        return
    margin = options.margin_jod
    meet = [row for row in rows.itertuples() if row.jod_equivalent == 1]
    inner = f"{100 * (1 - 2 * alpha):g} %"
    if not meet:
        conclusions.cannot.append(
            f"{where}: no pair meets the declared margin of {margin:g} JOD by the {inner} interval "
            "of its JOD difference."
        )
        return
    sure = [
        row
        for row in meet
        if -margin < row.jod_simultaneous_low and row.jod_simultaneous_high < margin
    ]
    differ = [row for row in meet if verdict(row, alpha) not in ("equivalent", "both")]
    file = "tables/pairs.csv"
    named = f": {_pairs(meet, codebook)}" if len(meet) <= MOST else f" ({file} has them)"
    words = (
        f"{where}: {count(len(meet), 'pair')} of {len(rows)} "
        f"{'meets' if len(meet) == 1 else 'meet'} the declared margin of {margin:g} JOD by "
        f"the {inner} interval of the JOD difference, which is not adjusted for the number of "
        f"pairs{named}; adjusted for all pairs, "
        f"{_pairs(sure, codebook, file) if sure else 'none'}."
    )
    if differ:
        them = f"do not call {_pairs(differ, codebook)} equal"
        if len(differ) == len(meet) > 1:
            them = "call none of them equal"
        elif len(differ) > MOST:
            them = f"do not call {len(differ)} of them equal"
        words += f" The declared tests in points {them}, and they stand."
    conclusions.cannot.append(words)


def _about_interaction(
    conclusions: Conclusions, tables: Mapping[str, pd.DataFrame], codebook: Codebook, alpha: float
) -> None:
    """Whether the order of techniques changes from framing to framing, and what pooling means."""
    if "omnibus" not in tables:
        return
    table = tables["omnibus"]
    for row in table[(table.question == "interaction") & table.p.notna()].itertuples():
        together = framing_label(codebook, OVERALL)
        if row.p <= alpha:
            conclusions.can.append(
                f"What is preferred depends on the {codebook.level} (interaction of technique and "
                f"{codebook.level}, sign flips of people, p {_equals(row.p)}): '{together}' "
                "averages over orders that differ, and is no order of its own."
            )
        else:
            conclusions.cannot.append(
                f"Whether what is preferred depends on the {codebook.level}: no interaction of "
                f"technique and {codebook.level} is shown (sign flips of people, p "
                f"{_equals(row.p)})."
            )
    apart = table[(table.question == "additivity") & (table.p <= alpha)]
    if len(apart):
        words = listed(
            [
                f"{framing_label(codebook, row.framing)} (p {_equals(row.p)})"
                for row in apart.itertuples()
            ]
        )
        conclusions.cannot.append(
            f"No scale of worths describes the pairs at {words}: their differences do not add up; "
            "read the pairs one by one there."
        )


def _about_order(
    conclusions: Conclusions, tables: Mapping[str, pd.DataFrame], alpha: float
) -> None:
    """Effects of the place in the order and of the question before."""
    if "order_effects" not in tables:
        return
    names = {
        "strength_slope": "the strength of an answer changes by {} points over ten questions",
        "side_slope": "answers drift by {} points to the right over ten questions",
        "time_slope": "the time of an answer changes by a factor of {} over ten questions",
        "carry_over": (
            "two questions in a row are answered for the same side more often than chance by {}"
        ),
    }
    words = []
    for row in tables["order_effects"].itertuples():
        if row.p <= alpha:
            value = (
                number(float(np.exp(row.value)))
                if row.statistic == "time_slope"
                else number(row.value, sign=True)
            )
            words.append(f"{names[row.statistic].format(value)} (p {_equals(row.p)})")
    if words:
        conclusions.can.append(
            f"The order of questions matters: {'; '.join(words)}. Orders are random for each "
            "person where the study shuffles them, so that this widens intervals and favours no "
            "technique."
        )


def _images(codebook: Codebook) -> str:
    """For which images answers speak: what was varied, and that the rest was not."""
    varied = [name.replace("_", " ") for name in codebook.factors]
    if codebook.factor not in (FRAMING, *codebook.factors):
        return "for the images that were shown"
    if len(codebook.framings) > 1 and codebook.factor == FRAMING:
        varied = ["framing", *varied]
    if not varied:
        return "for these images alone, of which nothing but the technique was varied"
    return (
        f"for the images that were shown, in which {listed(['technique', *varied])} were "
        "varied and nothing else was"
    )


def _about_images(
    conclusions: Conclusions, tables: Mapping[str, pd.DataFrame], codebook: Codebook, alpha: float
) -> None:
    """Whether differences hold beyond the images that were shown."""
    table = tables.get("by_images")
    if table is None or table.empty:
        return
    hold = [row for row in table.itertuples() if row.holm_p <= alpha]
    images = int(table.images.max())
    if table.holm_p.isna().all():
        conclusions.cannot.append(
            f"Whether differences hold for other images than these {images} kinds: no pair could "
            "be tested, since its mean preference is the same at every kind or it was asked at too "
            "few."
        )
    elif hold:
        conclusions.can.append(
            f"Taking the {images} kinds of images as a sample of others (t test over them, after "
            "Holm's correction), differences hold beyond them for "
            f"{_pairs(hold, codebook, 'the table of kinds of images')}."
        )
    else:
        conclusions.cannot.append(
            f"Whether differences hold for other images than these {images} kinds: taking them as "
            "a sample, no pair's difference does after Holm's correction; the intervals and tests "
            "of pairs take the images as they are."
        )


def _about_spread(
    conclusions: Conclusions, tables: Mapping[str, pd.DataFrame], codebook: Codebook
) -> None:
    """How far people differ in taste, beside how far techniques differ."""
    if "worth_models" not in tables:
        return
    models, worths = tables["worth_models"], tables["worths"]
    parts = []
    for row in models[(models.parameter == "sd_preference")].itertuples():
        here = worths[(worths.framing == row.framing) & (worths.model == "ordinal")].estimate
        if row.framing != OVERALL and np.isfinite(row.estimate) and len(here):
            parts.append(
                f"{number(row.estimate)} at {framing_label(codebook, row.framing)}, where "
                f"techniques' worths span {number(here.max() - here.min())}"
            )
    if parts:
        conclusions.can.append(
            "People's own tastes for a technique spread by so many logits (standard deviation, "
            f"ordinal model): {'; '.join(parts)}."
        )


def _about_trend(
    conclusions: Conclusions, trend: pd.DataFrame, codebook: Codebook, alpha: float
) -> None:
    slope = trend[trend.statistic == "slope_strength"]
    if slope.empty or not np.isfinite(slope.value.iloc[0]):
        return
    row = slope.iloc[0]
    path = (
        "from near to far"
        if codebook.near_to_far
        else "from framing to framing in the study's order"
    )
    words = (
        f"the points that an answer gives change by {number(row.value, 3, sign=True)} a "
        f"framing {path}"
    )
    if np.isfinite(row.low):
        words += f" (interval {number(row.low, 3, sign=True)} to {number(row.high, 3, sign=True)}"
        words += f", p {_equals(row.p)})" if np.isfinite(row.p) else ")"
    if np.isfinite(row.p) and row.p <= alpha:
        conclusions.can.append(
            f"Preferences get {'weaker' if row.value < 0 else 'stronger'} along the framings: "
            f"{words}."
        )
    else:
        conclusions.cannot.append(
            f"Whether preferences weaken or grow along the framings: {words}."
        )


def _about_agreement(
    conclusions: Conclusions, agreement: pd.DataFrame, codebook: Codebook, alpha: float, who: str
) -> None:
    rows = agreement[agreement.framing != OVERALL].set_index(["framing", "statistic"])
    agree: dict[bool, list[str]] = {True: [], False: []}
    for framing in dict.fromkeys(agreement.framing[agreement.framing != OVERALL]):
        values = [
            rows.loc[(framing, name)]
            for name in ("kendall_u", "kendall_u_conditional")
            if (framing, name) in rows.index
        ]
        tested = [one for one in values if np.isfinite(one.value) and np.isfinite(one.p)]
        if tested:
            words = (
                f"{number(tested[0].value)} at {framing_label(codebook, framing)} (p "
                f"{_equals(tested[0].p)})"
            )
            agree[bool(tested[0].p <= alpha)].append(words)
    if agree[True]:
        conclusions.can.append(
            f"{who} agree with each other more than chance would: Kendall's u is "
            f"{listed(agree[True])}; 1 would be full agreement."
        )
    if agree[False]:
        conclusions.cannot.append(
            f"Whether {who.lower()} agree with each other more than chance would: Kendall's u "
            f"is {listed(agree[False])}."
        )


def _about_sides(
    conclusions: Conclusions,
    tables: Mapping[str, pd.DataFrame],
    notes: Mapping[str, tuple[str, ...]],
    codebook: Codebook,
    alpha: float,
    who: str,
) -> None:
    """Whether people lean to one side, and whether sides were shuffled against it."""
    balance = tables["side_balance"]
    uneven = balance[balance.holm_p <= alpha]
    agreement = tables["agreement"]
    leaning = agreement[
        (agreement.statistic == "left_share")
        & (agreement.framing != OVERALL)
        & (agreement.p <= alpha)
    ]
    confounded = [line.partition(": ") for line in notes.get("side_balance", ())]
    for framing, _, reason in confounded:
        conclusions.cannot.append(
            f"{framing_label(codebook, framing)}: what is preferred and which side is preferred "
            f"cannot be told apart: {with_labels(reason, codebook)}."
        )
    if len(leaning):
        words = listed(
            [
                f"{100 * row.value:.0f} % at {framing_label(codebook, row.framing)} (p "
                f"{_equals(row.p)})"
                for row in leaning.itertuples()
            ]
        )
        words = f"{who} lean to one side: of their preferences, the left image got {words}"
        if uneven.empty:
            low, high = 100 * balance.left_share.min(), 100 * balance.left_share.max()
            conclusions.can.append(
                f"{words}; sides are balanced against that: each technique stood on the left in "
                f"{low:.0f} to {high:.0f} % of its answers."
            )
        elif not confounded:
            conclusions.can.append(f"{words}; sides are not balanced against that.")
    if len(uneven) and not confounded:
        named = listed(
            [
                f"{codebook.label(row.technique)} on the left in {100 * row.left_share:.0f} % at "
                f"{framing_label(codebook, row.framing)}"
                for row in uneven.head(MOST).itertuples()
            ]
        )
        more = f", and {len(uneven) - MOST} more" if len(uneven) > MOST else ""
        conclusions.cannot.append(
            f"Sides were not shuffled evenly (binomial tests, Holm's correction): {named}{more}; "
            "a preference for a side passes for one for a technique there."
        )


def _about_familiarity(
    conclusions: Conclusions, table: pd.DataFrame, codebook: Codebook, alpha: float
) -> None:
    tested = table[table.holm_p.notna()]
    if tested.empty:
        return
    hits = tested[tested.holm_p <= alpha]
    if len(hits):
        words = listed(
            [
                f"{codebook.label(row.technique)} at {framing_label(codebook, row.framing)} "
                f"({number(row.slope, sign=True)} points a level, p {_equals(row.holm_p)})"
                for row in hits.itertuples()
            ]
        )
        conclusions.can.append(
            f"Familiarity with computer graphics changes the preference for {words}."
        )
        return
    least = tested.detectable.min()
    words = "Whether familiarity with computer graphics changes preference: no change is shown"
    if np.isfinite(least):
        words += (
            f", and with so many people only a correlation of {number(least)} or more "
            "would be found four times in five"
        )
    conclusions.cannot.append(words + ".")


def _about_exclusions(
    conclusions: Conclusions, participants: pd.DataFrame, sensitivity: pd.DataFrame, people: int
) -> None:
    out = int(participants.excluded.fillna("").astype(str).ne("").sum())
    if not out:
        conclusions.can.append(
            f"The rules of exclusion fire for none of {count(people, 'participant')}: no "
            "conclusion hangs on them."
        )
        return
    if out == people or sensitivity.empty:
        conclusions.cannot.append(
            f"The rules exclude {out} of {count(people, 'participant')}: those who are left "
            "are too few to compute the conclusions again."
        )
        return
    changed = int(sensitivity.changed.fillna(False).astype(bool).sum())
    words = (
        f"Without the {count(out, 'participant')} whom the rules exclude, {changed} of "
        f"{count(len(sensitivity), 'conclusion')}"
    )
    if changed:
        conclusions.cannot.append(f"{words} would change; see the table of those.")
    else:
        conclusions.can.append(f"{words} would change: none hangs on them.")


def _test(options: Options) -> str:
    return {"wilcoxon": "Wilcoxon's signed-rank test", "sign": "sign test"}[options.test]


def _equals(p: float) -> str:
    text = probability(p)
    return text.replace("<", "< ").replace(">", "> ") if text[0] in "<>" else f"= {text}"


def _share(some: list, rows: pd.DataFrame) -> str:
    """'3 of 10 pairs', and where there is one alone 'the one pair'."""
    return f"{len(some)} of {len(rows)} pairs" if len(rows) > 1 else "the one pair"


def _pairs(rows: list, codebook: Codebook, table: str = PAIRS) -> str:
    """The pairs by name; of more than `MOST` the number, and the table that names them."""
    if len(rows) > MOST:
        return f"{len(rows)} pairs, which {table} has"
    return "; ".join(f"{codebook.label(row.a)} and {codebook.label(row.b)}" for row in rows)


def _about_fits(conclusions: Conclusions, notes: tuple[str, ...], codebook: Codebook) -> None:
    """Fits that do not exist, and those that another one stands in for, from the notes
    'FRAMING, MODEL: ...: REASON', models of one reason together.
    """
    refused: dict[tuple[str, str], list[str]] = {}
    replaced: dict[tuple[str, str], list[str]] = {}
    for line in notes:
        for mark, models in (
            (": no finite worths: ", refused),
            (": maximum likelihood has no finite worths, since ", replaced),
        ):
            head, here, reason = line.partition(mark)
            framing, _, model = head.rpartition(", ")
            if here:
                reason = reason.rpartition(": ")[0] if models is replaced else reason
                key = framing, reason.rstrip(".")
                models.setdefault(key, []).append(MODEL_NAMES.get(model, model))
    for (framing, reason), names in refused.items():
        conclusions.cannot.append(
            f"{framing_label(codebook, framing)}: there are no worths by {listed(names)}: "
            f"{with_labels(reason, codebook)}."
        )
    for (framing, reason), names in replaced.items():
        conclusions.cannot.append(
            f"{framing_label(codebook, framing)}: how far apart techniques are by {listed(names)} "
            f"is open on one side: {with_labels(reason, codebook)}, so that maximum likelihood "
            "has no finite worths; fits with reduced bias or weak priors stand in and are marked."
        )


def with_labels(text: str, codebook: Codebook) -> str:
    """The text with techniques' labels for their names."""
    labels = {name: codebook.label(name) for name in codebook.techniques}
    names = re.compile(
        "|".join(
            rf"(?<!\w){re.escape(name)}(?!\w)" for name in sorted(labels, key=len, reverse=True)
        )
    )
    return names.sub(lambda match: labels[match[0]], text)


def listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
