"""The tables that are read: the same rows and words on the page, in the PDF and in LaTeX.

Numbers are formatted here, once; what does not exist is an en dash. `tables/*.csv` hold every
digit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from analysis.codebook import Codebook
from analysis.inference import alpha_of, verdict
from analysis.options import Options
from analysis.responses import Responses
from analysis.worth import stood_in
from analysis.worth_figures import DRAWN, MODELS, VERDICTS, framing_label

#: Statistics of agreement.csv that are read, with their names.
STATISTICS = DRAWN | {
    "circular_triads": "circular triads a person",
    "kendall_u_conditional": "Kendall's u, ties kept",
    "krippendorff_alpha_both_ways": "Krippendorff's alpha, pairs both ways",
    "left_share": "share of preferences for the left image",
    "side_effect": "side effect of the ordinal model, logits to the right",
    "repeat_same_answer": "same answer when asked again",
    "median_rt_ms": "median time of an answer, ms",
    "median_rt_ms_decided": "the same, one preferred",
    "median_rt_ms_none": "the same, no difference seen",
}
NOTHING = "\N{EN DASH}"
#: So many rows of a table are read on the page, in the PDF and in LaTeX.
MOST_ROWS = 400
MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class Shown:
    """A table to read.

    columns: headings; numeric: which of them are numbers, set to the right; rows: cells as text.
    """

    name: str
    caption: str
    columns: tuple[str, ...]
    numeric: tuple[bool, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def number(value: float | None, digits: int = 2, sign: bool = False) -> str:
    """1.234 as '1.23', with a true minus; an en dash where there is none."""
    if value is None or not np.isfinite(value):
        return NOTHING
    return f"{value:{'+' if sign else ''}z.{digits}f}".replace("-", MINUS)


def interval(value: float, low: float, high: float, digits: int = 2) -> str:
    """'1.23 [0.90, 1.56]', without brackets where there is no interval."""
    if not np.isfinite(low) or not np.isfinite(high):
        return number(value, digits)
    return f"{number(value, digits)} [{number(low, digits)}, {number(high, digits)}]"


def probability(p: float | None) -> str:
    """A p value as journals print it: '<0.001', '0.012', '0.34', '>0.99'."""
    if p is None or not np.isfinite(p):
        return NOTHING
    if p < 0.001:
        return "<0.001"
    if p > 0.99:
        return ">0.99"
    return f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def worths(table: pd.DataFrame, codebook: Codebook, options: Options) -> Shown:
    models = [name for name in MODELS if name in set(table.model)]
    marked = stood_in(table.fit)
    cells = table.assign(marked=marked).set_index(["framing", "technique", "model"])
    rows = []
    for framing in dict.fromkeys(table.framing):
        here = table[table.framing == framing]
        for technique in dict.fromkeys(here.technique):
            values = []
            for model in models:
                if (framing, technique, model) not in cells.index:
                    values.append(NOTHING)
                    continue
                one = cells.loc[(framing, technique, model)]
                star = "*" if one.marked else ""
                values.append(interval(one.estimate, one.low, one.high) + star)
            rows.append((framing_label(codebook, framing), codebook.label(technique), *values))
    return Shown(
        "worths",
        f"Worths, centred on 0 within a {codebook.level}, with {100 * options.level:g} % intervals",
        (
            codebook.heading,
            "Technique",
            *(f"{MODELS[model][0]} ({MODELS[model][1]})" for model in models),
        ),
        (False, False, *[True] * len(models)),
        tuple(rows),
        "Intervals are those of one technique alone, by resampling participants; those of the "
        "ordinal model by Wald from its information."
        + (
            " *: maximum likelihood has no finite worths; a fit with reduced bias (Firth), for the "
            "ordinal model one with weak priors, stands in."
            if marked.any()
            else ""
        ),
    )


def pairs(table: pd.DataFrame, codebook: Codebook, options: Options) -> Shown:
    alpha, level = alpha_of(options), 100 * options.level
    rows = [
        (
            framing_label(codebook, row.framing),
            codebook.label(row.a),
            codebook.label(row.b),
            f"{row.n:g}",
            " / ".join(
                f"{count:g}"
                for count in (row.strong_a, row.slight_a, row.none, row.slight_b, row.strong_b)
            ),
            interval(row.mean_preference, row.low, row.high),
            bounds(row.simultaneous_low, row.simultaneous_high),
            probability(getattr(row, f"{options.test}_p")),
            probability(row.holm_p),
            probability(row.tost_p),
            probability(row.tost_holm_p),
            interval(row.jod, row.jod_low, row.jod_high),
            bounds(row.jod_simultaneous_low, row.jod_simultaneous_high),
            VERDICTS[verdict(row, alpha)][0],
        )
        for row in table.itertuples()
    ]
    test = {"wilcoxon": "Wilcoxon", "sign": "Sign"}[options.test]
    return Shown(
        "pairs",
        "Every pair: answers, tests and what they come to",
        (
            codebook.heading,
            "A",
            "B",
            "n",
            "Answers",
            "Mean preference for B",
            "adjusted",
            f"{test} p",
            "Holm p",
            "TOST p",
            "TOST Holm p",
            "JOD, B less A",
            "adjusted",
            "Verdict",
        ),
        (False, False, False, *[True] * 10, False),
        tuple(rows),
        "Answers: strong for A / slight for A / no difference / slight for B / strong for B. "
        "Positive numbers favour B. "
        f"Intervals in brackets after a number are at {level:g} % for that pair alone; adjusted "
        "ones hold together for all pairs of the family. "
        f"Holm's correction is of the {_test(options)} and of the two one-sided tests (TOST), "
        f"over the pairs of {_family(options, codebook)}; "
        f"the verdict is at {alpha:g}.",
    )


def bounds(low: float, high: float) -> str:
    """'[0.90, 1.56]', an en dash where there is no interval."""
    if not np.isfinite(low) or not np.isfinite(high):
        return NOTHING
    return f"[{number(low)}, {number(high)}]"


def effects(
    table: pd.DataFrame, contrasts: pd.DataFrame, codebook: Codebook, options: Options
) -> Shown:
    """Effect sizes of each pair, and the contrast that all answers of a framing give."""
    other = {(row.framing, row.a, row.b): row for row in contrasts.itertuples()}
    rows = []
    for row in table.itertuples():
        one = other.get((row.framing, row.a, row.b))
        rows.append(
            (
                framing_label(codebook, row.framing),
                codebook.label(row.a),
                codebook.label(row.b),
                interval(row.rank_biserial, row.rank_biserial_low, row.rank_biserial_high),
                interval(row.dz, row.dz_low, row.dz_high),
                NOTHING if one is None else interval(one.estimate, one.low, one.high),
                NOTHING if one is None else probability(one.p),
                NOTHING if one is None else probability(one.holm_p),
            )
        )
    return Shown(
        "effects",
        "Effect sizes, and contrasts of all answers",
        (
            *(codebook.heading, "A", "B", "Rank-biserial", "Standardised mean"),
            *("Contrast, points", "p", "Holm p"),
        ),
        (False, False, False, *[True] * 5),
        tuple(rows),
        f"Intervals at {100 * options.level:g} % for each number alone. The contrast is the "
        "difference of worths in a linear model of all answers of the framing, with people as "
        "clusters; it stands beside the declared test and decides nothing.",
    )


def omnibus(table: pd.DataFrame, codebook: Codebook) -> Shown:
    names = {
        "techniques": "is any technique preferred?",
        "additivity": "do differences of worths fail to add up?",
        "interaction": f"does what is preferred depend on the {codebook.level}?",
    }
    rows = [
        (
            framing_label(codebook, row.framing),
            names.get(row.question, row.question),
            f"{row.people:g}",
            number(row.size, 3),
            probability(row.p),
        )
        for row in table.itertuples()
    ]
    return Shown(
        "omnibus",
        "Before any pair is singled out",
        (codebook.heading, "Question", "People", "Size, points", "p"),
        (False, False, True, True, True),
        tuple(rows),
        "By flipping the sign of each person's answers by a fair coin.",
    )


def by_images(table: pd.DataFrame, codebook: Codebook) -> Shown:
    rows = [
        (
            codebook.label(row.a),
            codebook.label(row.b),
            f"{row.images:g}",
            interval(row.mean_preference, row.low, row.high),
            f"{number(row.least)} to {number(row.most)}",
            probability(row.p),
            probability(row.holm_p),
        )
        for row in table.itertuples()
    ]
    return Shown(
        "by_images",
        "Kinds of images as a sample",
        ("A", "B", "Images", "Mean preference for B", "From to", "p", "Holm p"),
        (False, False, *[True] * 5),
        tuple(rows),
        "One number a kind of image (framing, and what else is varied), Student's t test over "
        "them: whether a difference would hold for other images of that sort.",
    )


def goodness(table: pd.DataFrame, codebook: Codebook) -> Shown:
    rows = [
        (
            framing_label(codebook, row.framing),
            MODELS.get(row.model, (row.model,))[0],
            f"{row.parameters:g}",
            number(row.log_likelihood, 1),
            number(row.deviance, 1),
            NOTHING if np.isnan(row.df) else f"{row.df:g}",
            probability(row.p),
        )
        for row in table.itertuples()
    ]
    return Shown(
        "goodness",
        "How well the models describe the pairs",
        (
            *(codebook.heading, "Model", "Parameters", "Log-likelihood"),
            *("Deviance", "df", "p"),
        ),
        (False, False, *[True] * 5),
        tuple(rows),
        "Deviance from the saturated model, which has parameters of its own for each pair, against "
        "chi-square; answers are taken as independent, which those of one person are not, and ties "
        "as half wins make it small.",
    )


def order_effects(table: pd.DataFrame) -> Shown:
    names = {
        "strength_slope": "strength of an answer, points over 10 questions",
        "side_slope": "answer, points to the right over 10 questions",
        "time_slope": "logarithm of the time of an answer over 10 questions",
        "carry_over": "same side as the question before, above chance",
    }
    rows = [
        (
            names.get(row.statistic, row.statistic),
            f"{row.people:g}",
            interval(row.value, row.low, row.high, 3),
            probability(row.p),
        )
        for row in table.itertuples()
    ]
    return Shown(
        "order_effects",
        "Order, fatigue and carry-over",
        ("What changes", "People", "Mean over people", "p"),
        (False, True, True, True),
        tuple(rows),
    )


def models(table: pd.DataFrame, codebook: Codebook) -> Shown:
    names = {
        "log_nu": "ties, log nu (Davidson)",
        "side": "side, logits to the right (ordinal)",
        "threshold_slight": "threshold of a slight preference, logits",
        "threshold_strong": "threshold of a strong preference, logits",
        "sd_preference": "spread of people's tastes, logits",
        "sd_side": "spread of people's leaning to a side, logits",
    }
    rows = [
        (
            framing_label(codebook, row.framing),
            names[row.parameter],
            interval(row.estimate, row.low, row.high),
        )
        for row in table.itertuples()
        if row.parameter in names
    ]
    return Shown(
        "worth_models",
        "What the models have beside worths",
        (codebook.heading, "Parameter", "Estimate"),
        (False, False, True),
        tuple(rows),
        "Spreads are standard deviations over people; they and thresholds have no intervals.",
    )


def agreement(table: pd.DataFrame, codebook: Codebook) -> Shown:
    rows = [
        (
            framing_label(codebook, row.framing),
            STATISTICS[row.statistic],
            interval(row.value, row.low, row.high, 0 if "_rt_" in row.statistic else 3),
            probability(row.p),
        )
        for row in table.itertuples()
        if row.statistic in STATISTICS and np.isfinite(row.value)
    ]
    return Shown(
        "agreement",
        "Agreement and quality",
        (codebook.heading, "Statistic", "Value", "p"),
        (False, False, True, True),
        tuple(rows),
    )


def priorities(table: pd.DataFrame, codebook: Codebook) -> Shown:
    kinds = list(dict.fromkeys(zip(table.aggregation, table.method, strict=True)))
    cells = table.set_index(["framing", "technique", "aggregation", "method"])
    rows = []
    for framing, technique in dict.fromkeys(zip(table.framing, table.technique, strict=True)):
        values = [
            interval(*cells.loc[(framing, technique, *kind), ["priority", "low", "high"]], 3)
            if (framing, technique, *kind) in cells.index
            else NOTHING
            for kind in kinds
        ]
        rows.append((framing_label(codebook, framing), codebook.label(technique), *values))
    names = {
        "median": "median",
        "geometric_mean": "geometric mean",
        "eigenvector": "eigenvector",
        "row_geometric_mean": "row mean",
    }
    return Shown(
        "ahp_intervals",
        "AHP priorities by how people are put together and how priorities are found",
        (
            codebook.heading,
            "Technique",
            *(f"{names.get(one, one)}, {names.get(other, other)}" for one, other in kinds),
        ),
        (False, False, *[True] * len(kinds)),
        tuple(rows),
        "Row mean: geometric mean of the rows. Intervals by resampling participants.",
    )


def consistency(table: pd.DataFrame, codebook: Codebook) -> Shown:
    names = {"median": "median", "geometric_mean": "geometric mean"}
    rows = [
        (
            framing_label(codebook, row.framing),
            names.get(row.aggregation, row.aggregation),
            interval(row.ci, row.ci_low, row.ci_high, 3),
            interval(row.cr, row.cr_low, row.cr_high, 3),
            f"{codebook.label(row.a)} over {codebook.label(row.b)}"
            if isinstance(row.a, str) and row.a
            else NOTHING,
            number(row.judgement),
            number(row.consistent),
            number(row.chance_cr, 3),
            NOTHING if np.isnan(row.chance_share) else f"{100 * row.chance_share:.0f} %",
        )
        for row in table.itertuples()
    ]
    return Shown(
        "ahp_consistency",
        "Consistency of the AHP matrices, and the judgement to look at again",
        (
            codebook.heading,
            "People by",
            "CI",
            "CR",
            "Look again at",
            "Judgement",
            "The others imply",
            "CR by chance",
            "As low by chance",
        ),
        (False, False, True, True, False, *[True] * 4),
        tuple(rows),
        "By chance: studies with the same answers' strengths, their directions settled by a coin; "
        "their median CR, and how many of them have one as low as this study's.",
    )


def trend(table: pd.DataFrame) -> Shown:
    names = {
        "slope_total": "slope of the total, points a framing",
        "slope_strength": "slope of a person's mean strength, points an answer and framing",
        "page_l": "Page's L",
    }
    rows = [
        (
            names.get(row.statistic, row.statistic),
            interval(row.value, row.low, row.high, 3),
            probability(row.p),
        )
        for row in table.itertuples()
        if np.isfinite(row.value)
    ]
    return Shown(
        "trend",
        "Preference against distance",
        ("Statistic", "Value", "p"),
        (False, True, True),
        tuple(rows),
    )


def familiarity(table: pd.DataFrame, codebook: Codebook) -> Shown:
    rows = [
        (
            framing_label(codebook, row.framing),
            codebook.label(row.technique) if row.technique else "all together",
            f"{row.n:g}",
            interval(row.slope, row.low, row.high),
            number(row.spearman),
            probability(row.p),
            probability(row.holm_p),
            number(row.detectable),
        )
        for row in table.itertuples()
    ]
    return Shown(
        "familiarity_interaction",
        "Does familiarity change preference?",
        (
            codebook.heading,
            "Technique",
            "n",
            "Slope a level",
            "Spearman",
            "p",
            "Holm p",
            "Found with power 0.8 from",
        ),
        (False, False, *[True] * 6),
        tuple(rows),
        "Slope: change of a technique's mean preference for each level of familiarity. The "
        "last column is the smallest correlation "
        "that so many people find with a power of 0.8: smaller ones would mostly be missed.",
    )


def sensitivity(table: pd.DataFrame, codebook: Codebook) -> Shown:
    rows = [
        (
            framing_label(codebook, row.framing),
            {
                "preferred": "preferred",
                "equivalent": "as good as each other",
                "first": "highest worth",
            }.get(row.conclusion, row.conclusion),
            _pair(row, codebook),
            _verdict_of(row.everyone, codebook),
            _verdict_of(row.without_excluded, codebook),
        )
        for row in table.itertuples()
        if row.changed
    ]
    return Shown(
        "sensitivity",
        "Conclusions that change without the excluded participants",
        (codebook.heading, "Conclusion", "Pair", "With everyone", "Without the excluded"),
        (False,) * 5,
        tuple(rows),
    )


def sides(table: pd.DataFrame, codebook: Codebook) -> Shown:
    rows = [
        (
            framing_label(codebook, row.framing),
            codebook.label(row.technique),
            f"{row.left:g}",
            f"{row.right:g}",
            f"{100 * row.left_share:.0f} %",
            probability(row.p),
            probability(row.holm_p),
        )
        for row in table.itertuples()
    ]
    return Shown(
        "side_balance",
        "On which side each technique stood",
        (codebook.heading, "Technique", "Left", "Right", "Left share", "p", "Holm p"),
        (False, False, *[True] * 5),
        tuple(rows),
        "Exact binomial tests of as often left as right; where sides are shuffled only chance "
        "makes them uneven.",
    )


def not_counted(responses: Responses, most: int = 100) -> tuple[Shown, Shown]:
    """Rows that are not counted, and values that are missing beside answers that are."""

    def note(number: int, name: str) -> str:
        return f"The first {most} of {number}; all are in tables/{name}.csv." * (number > most)

    findings, missing = responses.findings, responses.missing
    rows = Shown(
        "rejected_rows",
        f"Rows that are not counted: {len(findings)} of {responses.rows}",
        ("Line", "Kind", "Reason"),
        (True, False, False),
        tuple((str(one.line), one.kind, one.reason) for one in findings[:most]),
        note(len(findings), "rejected_rows"),
    )
    values = Shown(
        "missing_values",
        f"Values that are missing beside answers that are counted: {len(missing)}",
        ("Line", "Column", "As written", "Expected"),
        (True, False, False, False),
        tuple(
            (str(one.line), one.column, one.value or NOTHING, one.expected)
            for one in missing[:most]
        ),
        note(len(missing), "missing_values"),
    )
    return rows, values


def all_shown(
    tables: Mapping[str, pd.DataFrame], codebook: Codebook, options: Options
) -> dict[str, Shown]:
    """Every table of `compute.everything` that is read, by name, without empty ones."""
    tables_read: Sequence[Shown] = (
        worths(tables["worths"], codebook, options),
        pairs(tables["pairs"], codebook, options),
        effects(tables["pairs"], tables["contrasts"], codebook, options),
        omnibus(tables["omnibus"], codebook),
        by_images(tables["by_images"], codebook),
        goodness(tables["goodness"], codebook),
        models(tables["worth_models"], codebook),
        priorities(tables["ahp_intervals"], codebook),
        consistency(tables["ahp_consistency"], codebook),
        trend(tables["trend"]),
        order_effects(tables["order_effects"]),
        agreement(tables["agreement"], codebook),
        sides(tables["side_balance"], codebook),
        familiarity(tables["familiarity_interaction"], codebook),
        sensitivity(tables["sensitivity"], codebook),
    )
    return {one.name: shortened(one) for one in tables_read if one.rows}


def shortened(one: Shown) -> Shown:
    """The table without what is beyond `MOST_ROWS`, which is said; tables/*.csv hold every row."""
    if len(one.rows) <= MOST_ROWS:
        return one
    file = {"effects": "pairs.csv and contrasts.csv"}.get(one.name, f"{one.name}.csv")
    note = f"The first {MOST_ROWS} of {len(one.rows)} rows; all are in tables/{file}. {one.note}"
    return replace(one, rows=one.rows[:MOST_ROWS], note=note)


def _pair(row: object, codebook: Codebook) -> str:
    names = [codebook.label(name) for name in (row.a, row.b) if isinstance(name, str) and name]
    return ", ".join(names) or NOTHING


def _verdict_of(value: object, codebook: Codebook) -> str:
    if isinstance(value, str):
        return codebook.label(value) if value in codebook.techniques else value
    return (
        NOTHING if value is None or (isinstance(value, float) and np.isnan(value)) else str(value)
    )


def _test(options: Options) -> str:
    return {"wilcoxon": "Wilcoxon test", "sign": "sign test"}[options.test]


def _family(options: Options, codebook: Codebook) -> str:
    return {"study": f"all {codebook.levels} together", "framing": f"each {codebook.level}"}[
        options.family
    ]
