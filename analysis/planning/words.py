"""The files of a plan: tables marked as simulated, a figure, power.md; declared answers first."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from scipy import stats

from analysis.codebook import Codebook
from analysis.files import csv_bytes
from analysis.methods import versions
from analysis.planning.answering import SIGMA
from analysis.planning.plan import ANY, Plan

#: The tests that are told, in this order.
SHOWN = (
    ("declared", "family"),
    ("declared", "first"),
    ("declared", "none"),
    ("contrast", "family"),
)
#: An adaptive design is called better than lots where it needs at most this share of the people.
BETTER = 0.95


def power_files(
    plan: Plan,
    curves: pd.DataFrame,
    needed: pd.DataFrame,
    codebook: Codebook,
    source: str,
    command: str = "",
    fingerprint: str = "",
) -> tuple[dict[str, bytes], list[str]]:
    """The files of a plan and what they say in short, a sentence each.

    source: where worths come from; fingerprint: that of the study's declared analysis.
    """
    from analysis.worth_figures import draw_power

    first = curves.framing.iloc[0]
    names = {kind: test_name(plan, kind) for kind in SHOWN}
    picture = draw_power(curves[curves.framing == first], plan, names, codebook)
    sentences = [*_needs(plan, needed, codebook), *_adaptive(plan, needed, codebook)]
    files = {
        "power.csv": csv_bytes(curves.assign(simulated=1), 6),
        "needed.csv": csv_bytes(needed.assign(simulated=1), 6),
        "power.md": _page(plan, needed, sentences, codebook, source, command, fingerprint).encode(),
    } | picture.files
    return files, sentences


def test_name(plan: Plan, kind: tuple[str, str]) -> str:
    """What a test is called: the declared one, alone, and the contrast beside it."""
    test, correction = kind
    if test == "contrast":
        return f"contrast of all answers, Holm over {plan.family}"
    name = {"wilcoxon": "Wilcoxon test", "sign": "sign test"}[plan.options.test]
    corrected = {
        "family": f"Holm over {plan.family}",
        "first": f"Holm's first step, alpha/{plan.family}",
        "none": "alone",
    }[correction]
    return f"{name} of the pair (to exclude: TOST), {corrected}"


def _needs(plan: Plan, needed: pd.DataFrame, codebook: Codebook) -> list[str]:
    """A sentence for each goal, framing and design, the declared analysis first in each."""
    a, b = (codebook.label(name) for name in plan.pair)
    test = {"wilcoxon": "Wilcoxon's signed-rank test", "sign": "sign test"}[plan.options.test]
    sentences = []
    for (where, design, goal), rows in needed.groupby(["framing", "design", "goal"], sort=False):
        place = "" if where == ANY else f"{codebook.framing_label(where)}, "
        people = rows.set_index(["test", "correction"]).people
        aim = (
            f"to find {plan.to_find(where):g} JOD between {a} and {b} by the declared {test}"
            if goal == "find"
            else f"to put {a} and {b}, which do not differ, within {plan.margin:.3g} points by the "
            "declared equivalence test"
        )
        over = f", corrected over the {plan.family} pairs of the family," if plan.family > 1 else ""
        beside = []
        if plan.family > 1:
            first, uncorrected = (
                _people(people["declared", one], plan) for one in ("first", "none")
            )
            beside.append(f"{first} whatever the other pairs come to")
            beside.append(f"{uncorrected} were the pair the only one tested")
        if ("contrast", "family") in people.index:
            beside.append(
                f"{_people(people['contrast', 'family'], plan)} by the contrast of all answers, "
                "which analyse prints beside the declared test"
            )
        sentences.append(
            f"{place}{design} design, {int(rows.answers_each.iloc[0])} of {len(plan.pairs)} pairs "
            f"a person and framing: {aim}{over} with a power of {plan.power:g} takes "
            f"{_people(people['declared', 'family'], plan)} people"
            + (f" ({'; '.join(beside)})" if beside else "")
            + "."
        )
    return sentences


def _adaptive(plan: Plan, needed: pd.DataFrame, codebook: Codebook) -> list[str]:
    """Whether the adaptive design is worth its trouble, by the declared analysis."""
    declared = needed[(needed.test == "declared") & (needed.correction == "family")]
    counts = declared.pivot_table(
        index=["goal", "framing"], columns="design", values="people", dropna=False, sort=False
    )
    if not {"adaptive", "incomplete"} <= set(counts):
        return []
    sentences = []
    for (goal, framing), row in counts.iterrows():
        if not (row.adaptive <= BETTER * row.incomplete or math.isnan(row.incomplete)):
            where = "" if framing == ANY else f" at {codebook.framing_label(framing)}"
            sentences.append(
                f"To {goal}{where} the adaptive design is no better than pairs drawn by lot: "
                f"{_people(row.adaptive, plan)} people against {_people(row.incomplete, plan)}; it "
                "spends answers on every pair, and the declared test takes those of one."
            )
    return sentences


def _people(count: float, plan: Plan) -> str:
    return f"more than {plan.most}" if math.isnan(count) else f"{count:.0f}"


def _page(
    plan: Plan,
    needed: pd.DataFrame,
    sentences: list[str],
    codebook: Codebook,
    source: str,
    command: str,
    fingerprint: str,
) -> str:
    """The page to read: in short, what is needed, what was assumed."""
    lines = [
        "# How many people",
        "",
        "**SIMULATED ANSWERS.** Every participant on this page is a program.",
        "",
        *(f"- {sentence}" for sentence in sentences),
        "",
        "## People needed",
        "",
        "| framing | design | goal | test | people | power | false alarms |",
        "|---|---|---|---|--:|--:|--:|",
    ]
    order = {kind: place for place, kind in enumerate(SHOWN)}
    rows = [row for row in needed.itertuples() if (row.test, row.correction) in order]
    for row in sorted(rows, key=lambda row: order[row.test, row.correction]):
        where = row.framing if row.framing == ANY else codebook.framing_label(row.framing)
        lines.append(
            f"| {where} | {row.design} | {row.goal} | "
            f"{test_name(plan, (row.test, row.correction))} | {_people(row.people, plan)} | "
            f"{row.power:.3f} | {row.false_alarms:.3f} |"
        )
    lines += [
        "",
        "The first rows are the declared analysis, as `subdermal analyse` carries it out: its "
        "tests, its margin,",
        f"Holm's correction over {plan.family} "
        f"{'pair' if plan.family == 1 else 'pairs'} in every simulated study. `alone`: without "
        "the correction, for one comparison planned before.",
        "",
        "False alarms: how often a study of that size (of the largest one where more people are "
        "needed) finds a difference where the pair has none,",
        "or excludes one that is as large as the margin.",
        "",
        "![Power against people](figures/power.svg)",
        "",
        "## What was assumed",
        "",
        *_assumptions(plan, codebook, source),
        f"- {plan.studies} simulated studies for each design and truth; alpha {plan.alpha:g}, "
        f"power {plan.power:g}, seed {plan.seed}.",
        *([f"- sha256 of the study's [analysis]: {fingerprint}."] if fingerprint else []),
        "- " + ", ".join(f"{name} {version}" for name, version in versions().items()) + ".",
    ]
    if command:
        lines += ["", f"    {command}"]
    return "\n".join(lines) + "\n"


def _assumptions(plan: Plan, codebook: Codebook, source: str) -> list[str]:
    model = plan.answering
    lines = [
        f"- Worths in JOD, {source}; the pair set {plan.apart} apart about its middle, or 0 "
        "apart to exclude:"
    ]
    for framing in plan.reported:
        values = zip(plan.techniques, plan.truth(framing, plan.to_find(framing)), strict=True)
        worths = ", ".join(f"{codebook.label(name)} {worth:z.2f}" for name, worth in values)
        where = "every framing" if framing == ANY else codebook.framing_label(framing)
        lines.append(f"  - {where}: {worths}")
    share = stats.norm.cdf(plan.difference / SIGMA)
    tied = float(np.asarray(model.shares(plan.difference))[2])
    if plan.options.margin is not None:
        margin = f"the declared {plan.margin:g} points"
    else:
        jod = plan.options.margin_jod or plan.difference
        which = "the declared margin" if plan.options.margin_jod else "the difference"
        margin = (
            f"{plan.margin:.3g} points, which is what {which} of {jod:g} JOD is on the scale of "
            "the "
            "answers; no margin in points is declared, so that `analyse` goes by the interval in "
            "JOD, or by none"
        )
    return [
        *lines,
        f"- Were there no ties, {100 * share:.0f} % of answers would prefer the better one at "
        f"{plan.difference:g} JOD; {100 * tied:.0f} % see no difference.",
        f"- No difference is seen below {model.slight:.2f} JOD, a preference is clear from "
        f"{model.clear:.2f} JOD on; people's tastes for",
        f"  a difference spread by {model.taste:.2f} JOD (standard deviation).",
        f"- To exclude, the margin is {margin}.",
    ]
