"""Figures of what was estimated: worths, the JOD ladder, differences and their margin, the trend,
agreement, cost and power.

Where the thesis shows counts in bars these show estimates with their intervals, in the same palette
and at the same widths.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from analysis import figures
from analysis.codebook import FRAMING, Codebook
from analysis.figures import BLUE, GREEN, INK, NARROW_IN, ORANGE, SKY, VERMILLION, WIDTH_IN, Picture
from analysis.inference import alpha_of, verdict
from analysis.options import OVERALL, Options

#: Model -> its name and the unit of its worths.
MODELS = {
    "bradley_terry": ("Bradley-Terry", "log odds"),
    "davidson": ("Davidson, with ties", "log odds"),
    "thurstone_jod": ("Thurstone case V", "JOD"),
    "ordinal": ("Ordinal, all five answers", "latent units"),
}
#: What a comparison can come to: colour and marker, so that neither is needed alone.
VERDICTS = {
    "different": ("different", VERMILLION, "o"),
    "equivalent": ("as good as each other", BLUE, "s"),
    "both": ("different, and within the margin", GREEN, "D"),
    "undecided": ("undecided", "#8A8A8A", "x"),
}
#: Statistics of agreement.csv that are drawn: 1 is perfect, 0 is chance.
DRAWN = {
    "zeta": "consistency of people (zeta)",
    "zeta_guessed": "zeta, ties by a coin",
    "pooled_zeta": "zeta of the majority",
    "kendall_u": "agreement: Kendall's u",
    "krippendorff_alpha": "agreement: Krippendorff's alpha",
    "repeat_share": "same preference when asked again",
}


def framing_label(codebook: Codebook, name: str) -> str:
    if name == OVERALL:
        return "All framings" if codebook.factor == FRAMING else "All together"
    return codebook.framing_label(name)


def draw_results(
    tables: Mapping[str, pd.DataFrame],
    codebook: Codebook,
    options: Options,
    simulated: bool,
) -> list[Picture]:
    """The figures of `compute.everything`'s tables, without those that have nothing to show."""
    level, alpha = 100 * options.level, alpha_of(options)
    drawn = [
        draw_pairs(tables["pairs"], codebook, options.margin, alpha, simulated),
        draw_ladder(tables["worths"], codebook, simulated, options.ties, level),
        draw_worths(tables["worths"], codebook, simulated),
        draw_scores(tables["tallies"], codebook, simulated),
        draw_agreement(tables["agreement"], codebook, simulated),
        draw_triads(tables["participants"], simulated),
    ]
    return [picture for picture in drawn if picture is not None]


def draw_worths(
    worths: pd.DataFrame, codebook: Codebook, simulated: bool = False
) -> Picture | None:
    """Every model at every framing: estimates with intervals, each model in its unit."""
    found = worths[worths.estimate.notna()]
    if found.empty:
        return None
    return figures._picture(
        "worths",
        "Worths with their intervals",
        "Each technique's worth in four models, centred on 0 within a "
        + codebook.level
        + "; lines are intervals: over resampled "
        "participants, for the ordinal model by Wald. Models have units of their own: "
        "compare the order and the gaps against the intervals, not the numbers.",
        "; ".join(
            f"{framing_label(codebook, framing)}, {MODELS.get(model, (model, ''))[0]}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.estimate:z.2f}" for row in rows.itertuples()
            )
            for (framing, model), rows in found.groupby(["framing", "model"], sort=False)
        ),
        _worths,
        found,
        codebook,
        simulated=simulated,
    )


def _worths(worths: pd.DataFrame, codebook: Codebook) -> Figure:
    framings, models = (
        list(dict.fromkeys(worths.framing)),
        [name for name in MODELS if name in set(worths.model)],
    )
    techniques = [name for name in codebook.techniques if name in set(worths.technique)]
    labels = [figures._wrapped(codebook.label(name), 16) for name in techniques]
    height = 0.3 + figures._row_in(labels) * 0.85 * len(labels)
    figure = Figure(figsize=(WIDTH_IN, len(framings) * height + 0.5), layout="constrained")
    axes = figure.subplots(len(framings), len(models), squeeze=False, sharex="col", sharey=True)
    for row, framing in enumerate(framings):
        for column, model in enumerate(models):
            ax = axes[row, column]
            here = worths[(worths.framing == framing) & (worths.model == model)].set_index(
                "technique"
            )
            ax.axvline(0, color="#888888", linewidth=0.7, zorder=0)
            for place, technique in enumerate(techniques):
                if technique in here.index:
                    one = here.loc[technique]
                    _interval(ax, one.estimate, one.low, one.high, place)
            if here.empty:
                ax.text(
                    0.5,
                    0.5,
                    "no finite worths",
                    transform=ax.transAxes,
                    ha="center",
                    style="italic",
                    size=7,
                    color="#666666",
                )
            ax.set_yticks(range(len(labels)), labels)
            ax.set_ylim(len(labels) - 0.5, -0.5)
            ax.xaxis.set_major_locator(MaxNLocator(4))
            ax.grid(axis="x")
            name, unit = MODELS[model]
            if row == 0:
                ax.set_title(figures._wrapped(name, 24), loc="left", size=8)
            if row == len(framings) - 1:
                ax.set_xlabel(unit)
            if column == len(models) - 1:
                ax.annotate(
                    framing_label(codebook, framing),
                    (1.02, 0.5),
                    xycoords="axes fraction",
                    rotation=270,
                    va="center",
                    weight="bold",
                )
    return figure


def _interval(
    ax: Axes, value: float, low: float, high: float, y: float, colour: str = BLUE, marker: str = "o"
) -> None:
    if np.isfinite(low) and np.isfinite(high):
        ax.plot([low, high], [y, y], color=colour, linewidth=1.6, solid_capstyle="butt")
    ax.plot(
        value, y, marker, color=colour, markersize=4.5, markeredgewidth=1.3 if marker == "x" else 0
    )


def jod_meaning(ties: str) -> str:
    """What 1 JOD is under the declared handling of 'no difference', in a sentence."""
    if ties == "half":
        return (
            "1 JOD apart: the answers that prefer the upper one and half of those that see no "
            "difference are 75 % of all answers; the more ties, the fewer prefer it."
        )
    return (
        "1 JOD apart: of the answers that prefer one of the two, 75 % prefer the upper one; "
        "answers 'no difference' are left out."
    )


def stand_ins(found: pd.DataFrame, codebook: Codebook) -> str:
    """A sentence that names the framings whose fit is not maximum likelihood."""
    if "fit" not in found:
        return ""
    names = [
        framing_label(codebook, name)
        for name in dict.fromkeys(found.framing[~found.fit.isin(["maximum likelihood", ""])])
    ]
    if not names:
        return ""
    return (
        f" Marked with an asterisk: {', '.join(names)}, where maximum likelihood has no finite "
        "worths and a fit with reduced bias (or weak priors) stands in."
    )


def left_out(model: pd.DataFrame, codebook: Codebook) -> str:
    """A sentence that names the framings which have no worths at all."""
    drawn = set(model.framing[model.estimate.notna()])
    names = [
        framing_label(codebook, name) for name in dict.fromkeys(model.framing) if name not in drawn
    ]
    return f" Not drawn, since they have no worths: {', '.join(names)}." if names else ""


def starred(framing: str, found: pd.DataFrame, codebook: Codebook, width: int) -> str:
    """The framing's label, cut, with an asterisk where a stand-in was fitted."""
    here = found[found.framing == framing]
    star = "fit" in found and not here.fit.isin(["maximum likelihood", ""]).all()
    return figures._cut(framing_label(codebook, framing), width) + (" *" if star else "")


def draw_ladder(
    worths: pd.DataFrame,
    codebook: Codebook,
    simulated: bool = False,
    ties: str = "half",
    level: float = 95,
) -> Picture | None:
    """The JOD of all techniques on one vertical scale, one ladder a framing."""
    model = worths[worths.model == "thurstone_jod"]
    found = model[model.estimate.notna()]
    if found.empty:
        return None
    return figures._picture(
        "jod_ladder",
        "The JOD ladder",
        "Thurstone case V worths in just-objectionable differences. "
        + jod_meaning(ties)
        + f" Bars are intervals at {level:g} % over resampled participants, each of one technique "
        f"alone; 0 is the mean of the {codebook.level}."
        + stand_ins(found, codebook)
        + left_out(model, codebook),
        "; ".join(
            f"{framing_label(codebook, framing)}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.estimate:z.2f} JOD"
                for row in rows.itertuples()
            )
            for framing, rows in found.groupby("framing", sort=False)
        ),
        _ladder,
        found,
        codebook,
        simulated=simulated,
    )


def _ladder(found: pd.DataFrame, codebook: Codebook) -> Figure:
    framings = list(dict.fromkeys(found.framing))
    most = found.groupby("framing", sort=False).size().max()
    columns = min(4, len(framings))
    figure, panels = figures._panels(
        len(framings), columns, max(2.5, 0.19 * most), below_in=0.2, sharey=True
    )
    ends = found[["low", "high", "estimate"]].to_numpy()
    low, high = np.nanmin(ends), np.nanmax(ends)
    room = max(high - low, 0.1)
    for ax, framing in zip(panels, framings, strict=True):
        here = found[found.framing == framing].sort_values("estimate")
        gap = room * 1.1 / max(11, 1.15 * most)
        for row, y in zip(here.itertuples(), _apart(here.estimate.to_numpy(), gap), strict=True):
            if np.isfinite(row.low) and np.isfinite(row.high):
                ax.plot(
                    [0, 0],
                    [row.low, row.high],
                    color=SKY,
                    linewidth=5,
                    alpha=0.45,
                    solid_capstyle="butt",
                    zorder=1,
                )
            ax.plot([-0.12, 0.12], [row.estimate] * 2, color=BLUE, linewidth=2, zorder=3)
            ax.plot([0.14, 0.3], [row.estimate, y], color="#888888", linewidth=0.6)
            ax.text(
                0.33,
                y,
                figures._cut(codebook.label(row.technique), 18),
                va="center_baseline",
                size=7.5,
            )
        ax.axhline(0, color="#888888", linewidth=0.7, zorder=0)
        ax.set_title(starred(framing, found, codebook, 18), loc="left")
        ax.set_xlim(-0.25, 1.75)
        ax.set_xticks([])
        ax.spines["bottom"].set_visible(False)
        ax.set_ylim(low - 0.06 * room, high + 0.06 * room)
        ax.yaxis.set_major_locator(MaxNLocator(7))
        ax.tick_params(labelleft=True)
        ax.grid(axis="y")
    figure.supylabel("JOD, higher looks more real", size=8)
    return figure


def _apart(values: np.ndarray, gap: float) -> np.ndarray:
    """Places for labels near ascending `values`, at least `gap` apart, moved as little as blocks of
    neighbours allow.
    """
    blocks = [[float(value), 1] for value in values]  # middle, labels
    at = 0
    while at + 1 < len(blocks):
        (m0, n0), (m1, n1) = blocks[at], blocks[at + 1]
        if m1 - m0 < gap * (n0 + n1) / 2 - 1e-12:
            blocks[at : at + 2] = [[(m0 * n0 + m1 * n1) / (n0 + n1), n0 + n1]]
            at = max(at - 1, 0)
        else:
            at += 1
    return np.concatenate([middle + gap * (np.arange(n) - (n - 1) / 2) for middle, n in blocks])


def draw_pairs(
    pairs: pd.DataFrame,
    codebook: Codebook,
    margin: float | None,
    alpha: float = 0.05,
    simulated: bool = False,
) -> Picture | None:
    """Every pair's mean preference and interval beside the margin of equivalence."""
    found = pairs[pairs.mean_preference.notna()]
    if found.empty:
        return None
    verdicts = [verdict(row, alpha) for row in found.itertuples()]
    about = (
        (
            f"The band is the margin of equivalence, {margin:g} points, and the interval that of "
            "the equivalence test where there is one. "
        )
        if margin
        else (
            "No margin of equivalence was declared, so no pair can be called as good as "
            "each other. "
        )
    )
    return figures._picture(
        "pairs",
        "Every difference, with its interval" + (" and the margin" if margin else ""),
        (
            "Mean preference of each pair on the scale from \N{MINUS SIGN}2 to 2: left of 0 for "
            "the first technique, right for the second. "
        )
        + about
        + (
            "Colour and marker say what the tests come to after Holm's correction, for "
            "differences and for equivalence."
        ),
        "; ".join(
            f"{framing_label(codebook, row.framing)}: {codebook.label(row.a)} against "
            f"{codebook.label(row.b)} "
            f"{row.mean_preference:+z.2f}, {VERDICTS[one][0]}"
            for row, one in zip(found.itertuples(), verdicts, strict=True)
        ),
        _pairs,
        found.assign(verdict=verdicts),
        codebook,
        margin,
        simulated=simulated,
    )


def _pairs(found: pd.DataFrame, codebook: Codebook, margin: float | None) -> Figure:
    framings = list(dict.fromkeys(found.framing))
    names = list(dict.fromkeys(zip(found.a, found.b, strict=True)))
    labels = [
        f"{figures._cut(codebook.label(a), 16)} \N{EN DASH} {figures._cut(codebook.label(b), 16)}"
        for a, b in names
    ]
    columns = min(4, len(framings))
    figure, panels = figures._panels(
        len(framings), columns, 0.45 + 0.19 * len(names), below_in=0.45, sharex=True, sharey=True
    )
    for _place, (ax, framing) in enumerate(zip(panels, framings, strict=True)):
        if margin:
            ax.axvspan(-margin, margin, color=SKY, alpha=0.22, linewidth=0)
        ax.axvline(0, color=INK, linewidth=0.7)
        for row in found[found.framing == framing].itertuples():
            low, high = row.low, row.high
            if margin and np.isfinite(row.equivalence_low):
                low, high = row.equivalence_low, row.equivalence_high
            _, colour, marker = VERDICTS[row.verdict]
            _interval(
                ax, row.mean_preference, low, high, names.index((row.a, row.b)), colour, marker
            )
        ax.set_title(figures._cut(framing_label(codebook, framing), 18), loc="left")
        ax.set_yticks(range(len(labels)), labels, size=7)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.set_xlim(-2.05, 2.05)
        ax.set_xticks(range(-2, 3))
        ax.tick_params(labelbottom=True)
        ax.grid(axis="x")
    panels[(len(panels) - 1) // 2].set_xlabel(
        "\N{LEFTWARDS ARROW} first technique      mean preference      second technique "
        "\N{RIGHTWARDS ARROW}"
    )
    used = [one for one in VERDICTS if one in set(found.verdict)]
    keys = [
        Line2D(
            [], [], color=VERDICTS[one][1], marker=VERDICTS[one][2], markersize=4.5, linewidth=1.6
        )
        for one in used
    ]
    figure.legend(
        keys, [VERDICTS[one][0] for one in used], loc="outside lower center", ncols=len(used)
    )
    return figure


def draw_scores(
    scores: pd.DataFrame, codebook: Codebook, simulated: bool = False
) -> Picture | None:
    """The thesis's figure 5.3 with intervals: points as dots, so that overlap can be seen."""
    found = scores[scores.score.notna() & (scores.framing != OVERALL)]
    if found.empty:
        return None
    return figures._picture(
        "scores_intervals",
        "Scores with their intervals",
        "The points of figure 5.3 of the thesis with intervals over resampled participants: "
        "where intervals overlap widely, other people "
        "could have put the techniques in another order.",
        "; ".join(
            f"{codebook.framing_label(framing)}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.score:g} ({row.low:g} to {row.high:g})"
                for row in rows.itertuples()
            )
            for framing, rows in found.groupby("framing", sort=False)
        ),
        _scores,
        found,
        codebook,
        simulated=simulated,
    )


def _scores(found: pd.DataFrame, codebook: Codebook) -> Figure:
    framings = list(dict.fromkeys(found.framing))
    techniques = [name for name in codebook.techniques if name in set(found.technique)]
    labels = [figures._wrapped(codebook.label(name)) for name in techniques]
    figure, panels = figures._panels(
        len(framings),
        3,
        0.5 + figures._row_in(labels) * len(labels),
        below_in=0.25,
        sharex=True,
        sharey=True,
    )
    for ax, framing in zip(panels, framings, strict=True):
        for row in found[found.framing == framing].itertuples():
            _interval(ax, row.score, row.low, row.high, techniques.index(row.technique))
        ax.set_title(figures._cut(codebook.framing_label(framing), 24), loc="left")
        ax.set_yticks(range(len(labels)), labels)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.set_xlim(left=0)
        ax.xaxis.set_major_locator(MaxNLocator(4, integer=True))
        ax.tick_params(labelbottom=True)
        ax.grid(axis="x")
    figure.supxlabel("points", size=8)
    return figure


def draw_agreement(
    agreement: pd.DataFrame, codebook: Codebook, simulated: bool = False
) -> Picture | None:
    """Consistency within and agreement between people, framing by framing."""
    found = agreement[agreement.statistic.isin(DRAWN) & agreement.value.notna()]
    if found.empty:
        return None
    return figures._picture(
        "agreement",
        "Consistency and agreement",
        "1 is perfect. For zeta 0 is as many circular triads as there can be, for u and "
        "alpha 0 is what chance gives. "
        "Lines are intervals where there are any.",
        "; ".join(
            f"{framing_label(codebook, row.framing)}: {DRAWN[row.statistic]} {row.value:z.2f}"
            for row in found.itertuples()
        ),
        _agreement,
        found,
        codebook,
        simulated=simulated,
    )


def _agreement(found: pd.DataFrame, codebook: Codebook) -> Figure:
    framings, statistics = (
        list(dict.fromkeys(found.framing)),
        [name for name in DRAWN if name in set(found.statistic)],
    )
    labels = [figures._wrapped(framing_label(codebook, name), 16) for name in framings]
    figure, panels = figures._panels(
        len(statistics), 3, 0.62 + figures._row_in(labels) * len(labels), sharex=True, sharey=True
    )
    for ax, statistic in zip(panels, statistics, strict=True):
        for row in found[found.statistic == statistic].itertuples():
            _interval(ax, row.value, row.low, row.high, framings.index(row.framing))
        ax.axvline(0, color="#888888", linewidth=0.7, zorder=0)
        ax.set_title(figures._wrapped(DRAWN[statistic], 32), loc="left", size=8)
        ax.set_yticks(range(len(labels)), labels)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.set_xlim(min(-0.1, float(np.nanmin(found[["value", "low"]].to_numpy())) - 0.05), 1.05)
        ax.tick_params(labelbottom=True)
        ax.grid(axis="x")
    return figure


def draw_triads(participants: pd.DataFrame, simulated: bool = False) -> Picture | None:
    """How consistent and how fast each person was."""
    if participants.median_rt_ms.notna().sum() == 0:
        return None
    zeta = participants.zeta.dropna()
    return figures._picture(
        "participants",
        "How consistent and how fast each person was",
        "One dot a person: the coefficient of consistency (1: no circular triad) and the "
        "median time of an answer. "
        "Crosses: those whom a declared rule excludes in the second pass.",
        (
            f"{len(participants)} people; consistency from {zeta.min():.2f} to {zeta.max():.2f}, "
            f"median {zeta.median():.2f}"
        )
        if len(zeta)
        else f"{len(participants)} people; no consistency can be told",
        _participants,
        participants,
        simulated=simulated,
    )


def _participants(participants: pd.DataFrame) -> Figure:
    figure, (ax,) = figures._panels(1, 1, 2.4, NARROW_IN)
    out = participants.excluded.fillna("").astype(str).ne("").to_numpy()
    zeta = participants.zeta.to_numpy(float)
    seconds = participants.median_rt_ms.to_numpy(float) / 1000
    small = 2.2 if len(zeta) > 100 else 3.6
    ax.plot(
        seconds[~out],
        zeta[~out],
        "o",
        color=BLUE,
        markersize=small,
        alpha=0.7,
        markeredgewidth=0,
        label="counted",
    )
    if out.any():
        ax.plot(
            seconds[out],
            zeta[out],
            "x",
            color=VERMILLION,
            markersize=small + 2,
            label="excluded in the second pass",
        )
        ax.legend(loc="lower right", fontsize=7)
    if np.isfinite(zeta).any():
        ax.set_ylim(min(0.0, float(np.nanmin(zeta))) - 0.05, 1.06)
    else:
        ax.text(
            0.5,
            0.5,
            "no triads were asked",
            transform=ax.transAxes,
            ha="center",
            style="italic",
            color="#666666",
        )
    ax.set_xlim(left=0)
    ax.set_xlabel("median time of an answer, s")
    ax.set_ylabel("consistency (zeta)")
    ax.grid()
    return figure


def draw_objective(
    table: pd.DataFrame, measure: str, about: str, codebook: Codebook, simulated: bool = False
) -> Picture:
    """Worth against one objective measure, with the Pareto front where less of it is better.

    table: see `objective.against_worth`.
    """
    return figures._picture(
        f"objective_{measure}",
        f"Worth against {about}",
        "Thurstone case V worth with its interval. Ringed and joined: the Pareto front, "
        "techniques that no other one beats in worth "
        f"without having more {about}.",
        "; ".join(
            (
                f"{framing_label(codebook, row.framing)}, {codebook.label(row.technique)}: "
                f"{row.value:g}, {row.estimate:z.2f} JOD"
            )
            + (", on the front" if row.front else "")
            for row in table.itertuples()
        ),
        _objective,
        table,
        about,
        codebook,
        simulated=simulated,
    )


def _objective(table: pd.DataFrame, about: str, codebook: Codebook) -> Figure:
    framings = list(dict.fromkeys(table.framing))
    figure, panels = figures._panels(len(framings), 3, 2.3, below_in=0.2, sharey=True)
    room = max(float(table.value.max()), 1e-12)
    ends = table[["low", "high", "estimate"]].to_numpy()
    tall, end = max(float(np.nanmax(ends) - np.nanmin(ends)), 0.1), 1.12 * room
    for ax, framing in zip(panels, framings, strict=True):
        here = table[table.framing == framing].sort_values("value")
        front = here[here.front]
        ax.step(front.value, front.estimate, where="post", color=ORANGE, linewidth=1)
        for row in here.itertuples():
            if np.isfinite(row.low) and np.isfinite(row.high):
                ax.plot([row.value] * 2, [row.low, row.high], color=BLUE, linewidth=1.2)
            ax.plot(row.value, row.estimate, "o", color=BLUE, markersize=4.5)
            if row.front:
                ax.plot(
                    row.value,
                    row.estimate,
                    "o",
                    markerfacecolor="none",
                    markeredgecolor=ORANGE,
                    markersize=9,
                )
        labelled = here.sort_values("estimate")
        for row, y in zip(
            labelled.itertuples(), _apart(labelled.estimate.to_numpy(), 0.085 * tall), strict=True
        ):
            ax.plot([row.value, end], [row.estimate, y], color="#999999", linewidth=0.5, zorder=0)
            ax.text(
                end + 0.02 * room,
                y,
                figures._cut(codebook.label(row.technique), 14),
                va="center_baseline",
                size=7,
            )
        ax.axhline(0, color="#888888", linewidth=0.7, zorder=0)
        ax.set_title(figures._cut(framing_label(codebook, framing), 24), loc="left")
        ax.set_xlim(-0.04 * room, 1.62 * room)
        ax.set_xticks([tick for tick in MaxNLocator(4).tick_values(0, room) if tick <= 1.05 * room])
        ax.tick_params(labelleft=True)
        ax.grid()
    figure.supxlabel(about, size=8)
    figure.supylabel("JOD, higher looks more real", size=8)
    return figure


def draw_power(
    curves: pd.DataFrame, plan: object, names: Mapping[tuple[str, str], str], codebook: Codebook
) -> Picture:
    """Power against people: one row a goal, one panel a design.

    curves: one framing of `planning.plan_table`; plan: its plan; names: (test, correction) -> what
    it is called.
    """
    return figures._picture(
        "power",
        f"How many people find {plan.difference:g} JOD, or exclude {plan.margin:.3g} points",
        "Share of simulated studies that reach the goal; the dashed line is the wanted "
        f"power, {plan.power:g}; bands are 95 % intervals of the simulation, dots the closed form "
        "where there is one."
        + (
            ""
            if set(curves.framing) == {"any"}
            else f" Worths of {codebook.framing_label(curves.framing.iloc[0])}."
        ),
        "; ".join(
            f"{goal}, {design}, {test}, {correction}: "
            + ", ".join(
                f"{row.people} people {row.power:.2f}"
                for row in rows.iloc[:: max(1, len(rows) // 5)].itertuples()
            )
            for (goal, design, test, correction), rows in curves.groupby(
                ["goal", "design", "test", "correction"], sort=False
            )
        ),
        _power,
        curves,
        plan,
        names,
        simulated=True,
    )


#: (test, correction) -> colour and line.
POWER_STYLES = {
    ("declared", "family"): (BLUE, "-"),
    ("declared", "none"): (VERMILLION, "--"),
    ("contrast", "family"): ("#8A8A8A", ":"),
}


def _power(curves: pd.DataFrame, plan: object, names: Mapping[tuple[str, str], str]) -> Figure:
    designs, goals = list(dict.fromkeys(curves.design)), list(dict.fromkeys(curves.goal))
    figure = Figure(figsize=(WIDTH_IN, 1.75 * len(goals) + 0.75), layout="constrained")
    axes = figure.subplots(len(goals), len(designs), squeeze=False, sharex=True, sharey=True)
    aims = {
        "find": f"find {plan.difference:g} JOD",
        "exclude": f"exclude {plan.margin:.3g} points",
    }
    for row, goal in enumerate(goals):
        for column, design in enumerate(designs):
            ax = axes[row, column]
            ax.axhline(plan.power, color=INK, linewidth=0.7, linestyle="--")
            for (test, correction), (colour, line) in POWER_STYLES.items():
                here = curves[
                    (curves.goal == goal)
                    & (curves.design == design)
                    & (curves.test == test)
                    & (curves.correction == correction)
                ]
                if len(here):
                    ax.fill_between(
                        here.people, here.low, here.high, color=colour, alpha=0.15, linewidth=0
                    )
                    ax.plot(here.people, here.power, line, color=colour, linewidth=1.5)
                    ax.plot(here.people, here.closed_form, "o", color=colour, markersize=2.4)
            ax.set_xscale("log")
            ticks = [
                people
                for people in (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
                if people <= curves.people.max()
            ]
            ax.set_xticks(ticks, [str(people) for people in ticks])
            ax.minorticks_off()
            ax.set_ylim(0, 1.02)
            ax.set_title(f"{aims[goal]}, {design}", loc="left", size=8)
            ax.tick_params(labelbottom=True, labelleft=True)
            ax.grid()
            if row == len(goals) - 1:
                ax.set_xlabel("people")
    figure.supylabel("power", size=8)
    kinds = dict.fromkeys(zip(curves.test, curves.correction, strict=True))
    used = [kind for kind in POWER_STYLES if kind in kinds]
    keys = [
        Line2D([], [], color=POWER_STYLES[kind][0], linestyle=POWER_STYLES[kind][1], linewidth=1.5)
        for kind in used
    ]
    figure.legend(
        keys, [names[kind] for kind in used], loc="outside lower center", ncols=1, fontsize=7
    )
    return figure
