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
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from analysis import figures
from analysis.codebook import FRAMING, Codebook
from analysis.figures import BLUE, GREEN, INK, NARROW_IN, ORANGE, SKY, VERMILLION, WIDTH_IN, Picture
from analysis.inference import alpha_of, verdict
from analysis.options import OVERALL, Options
from analysis.worth import stood_in

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
    worths = tables["worths"]
    triads = draw_triads(tables["participants"], simulated)
    return [
        *draw_pairs(tables["pairs"], codebook, options.margin, alpha, simulated),
        *draw_ladder(worths, codebook, simulated, options.ties, level),
        *draw_worths(worths, codebook, simulated, level),
        *draw_scores(tables["tallies"], codebook, simulated, level),
        *draw_agreement(tables["agreement"], codebook, simulated, level),
        *([] if triads is None else [triads]),
    ]


def draw_worths(
    worths: pd.DataFrame, codebook: Codebook, simulated: bool = False, level: float = 95
) -> list[Picture]:
    """Every model at every framing: estimates with intervals, each model in its unit."""
    table = worths[worths.estimate.notna()]
    if table.empty:
        return []
    framings = list(dict.fromkeys(table.framing))
    most = table.groupby("framing").technique.nunique().max()
    height = 0.3 + 0.21 * most + 0.12
    return figures._paged(
        "worths",
        "Worths with their intervals",
        "Each technique's worth in four models, centred on 0 within a "
        + codebook.level
        + f"; lines are intervals at {level:g} %, each of one technique alone: over resampled "
        "participants, for the ordinal model by Wald. Models have units of their own: "
        "compare the order and the gaps against the intervals, not the numbers."
        + stand_ins(table, codebook)
        + left_out(worths, codebook),
        figures._chunks(framings, figures._rows_that_fit(height, 0.5)),
        lambda page: "; ".join(
            f"{framing_label(codebook, framing)}, {MODELS.get(model, (model, ''))[0]}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.estimate:z.2f}" for row in rows.itertuples()
            )
            for (framing, model), rows in table[table.framing.isin(page)].groupby(
                ["framing", "model"], sort=False
            )
        ),
        _worths,
        table,
        codebook,
        simulated=simulated,
    )


def _worths(framings: list[str], worths: pd.DataFrame, codebook: Codebook) -> Figure:
    models = [name for name in MODELS if name in set(worths.model)]
    techniques = [name for name in codebook.techniques if name in set(worths.technique)]
    labels = [figures._cut(codebook.label(name), 20) for name in techniques]
    height = 0.3 + 0.21 * len(labels)
    figure = Figure(figsize=(WIDTH_IN, len(framings) * height + 0.5), layout="constrained")
    axes = figure.subplots(len(framings), len(models), squeeze=False, sharex="col", sharey=True)
    for row, framing in enumerate(framings):
        for column, model in enumerate(models):
            ax = axes[row, column]
            here = worths[(worths.framing == framing) & (worths.model == model)].set_index(
                "technique"
            )
            figures._zero(ax)
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
            ax.set_yticks(range(len(labels)), labels, size=7)
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
                    figures._wrapped(starred(framing, worths, codebook, 48), int(9 * height), 3),
                    (1.02, 0.5),
                    xycoords="axes fraction",
                    rotation=270,
                    va="center",
                    multialignment="center",
                    weight="bold",
                    size=7.5,
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


def stand_ins(table: pd.DataFrame, codebook: Codebook) -> str:
    """A sentence that names the framings whose fit is not maximum likelihood."""
    if "fit" not in table:
        return ""
    names = [
        framing_label(codebook, name) for name in dict.fromkeys(table.framing[stood_in(table.fit)])
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


def starred(framing: str, table: pd.DataFrame, codebook: Codebook, width: int) -> str:
    """The framing's label, cut, with an asterisk where a stand-in was fitted."""
    here = table[table.framing == framing]
    star = "fit" in table and stood_in(here.fit).any()
    return figures._cut(framing_label(codebook, framing), width) + (" *" if star else "")


def draw_ladder(
    worths: pd.DataFrame,
    codebook: Codebook,
    simulated: bool = False,
    ties: str = "half",
    level: float = 95,
) -> list[Picture]:
    """The JOD of all techniques, one ladder a framing, each rung a technique."""
    model = worths[worths.model == "thurstone_jod"]
    table = model[model.estimate.notna()]
    if table.empty:
        return []
    framings = list(dict.fromkeys(table.framing))
    height = 0.45 + 0.2 * table.groupby("framing").size().max()
    return figures._paged(
        "jod_ladder",
        "The JOD ladder",
        "Thurstone case V worths in just-objectionable differences, the highest on top. "
        + jod_meaning(ties)
        + f" Bars are intervals at {level:g} % over resampled participants, each of one technique "
        f"alone; 0 is the mean of the {codebook.level}."
        + stand_ins(table, codebook)
        + left_out(model, codebook),
        figures._chunks(framings, 2 * figures._rows_that_fit(height, 0.25)),
        lambda page: "; ".join(
            f"{framing_label(codebook, framing)}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.estimate:z.2f} JOD"
                for row in rows.itertuples()
            )
            for framing, rows in table[table.framing.isin(page)].groupby("framing", sort=False)
        ),
        _ladder,
        table,
        codebook,
        simulated=simulated,
    )


def rungs(ax: Axes, labels: list[str]) -> None:
    """A ladder's axes: a rung a label, the first on top, and a line at 0."""
    figures._zero(ax)
    labels = [figures._cut(label, 22) for label in labels]
    ax.set_yticks(range(len(labels)), labels, size=7.5)
    ax.set_ylim(len(labels) - 0.5, -0.5)
    ax.xaxis.set_major_locator(MaxNLocator(7))
    ax.tick_params(labelbottom=True)
    ax.grid(axis="x")


def _ladder(framings: list[str], table: pd.DataFrame, codebook: Codebook) -> Figure:
    most = table.groupby("framing", sort=False).size().max()
    figure, panels = figures._panels(
        len(framings), min(2, len(framings)), 0.45 + 0.2 * most, below_in=0.25, sharex=True
    )
    for ax, framing in zip(panels, framings, strict=True):
        here = table[table.framing == framing].sort_values("estimate", ascending=False)
        for place, row in enumerate(here.itertuples()):
            _interval(ax, row.estimate, row.low, row.high, place)
        rungs(ax, [codebook.label(name) for name in here.technique])
        ax.set_title(starred(framing, table, codebook, 34), loc="left")
    figure.supxlabel("JOD, to the right looks more real", size=8)
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
) -> list[Picture]:
    """Every pair's mean preference and intervals beside the margin of equivalence; a matrix where
    there are too many pairs to draw one by one.
    """
    table = pairs[pairs.mean_preference.notna()]
    if table.empty:
        return []
    verdicts = [verdict(row, alpha) for row in table.itertuples()]
    table = table.assign(verdict=verdicts)
    framings = list(dict.fromkeys(table.framing))
    names = list(dict.fromkeys(zip(table.a, table.b, strict=True)))
    title = "Every difference, with its interval" + (" and the margin" if margin else "")
    about = (
        "Mean preference of each pair on the scale from \N{MINUS SIGN}2 to 2: left of 0 for "
        "the first technique, right for the second. "
    )
    verdict_words = (
        "Colour and marker say what the tests come to after Holm's correction, for "
        "differences and for equivalence."
    )

    def alt(rows: pd.DataFrame) -> str:
        return "; ".join(
            f"{framing_label(codebook, row.framing)}: {codebook.label(row.a)} against "
            f"{codebook.label(row.b)} "
            f"{row.mean_preference:+z.2f}, {VERDICTS[row.verdict][0]}"
            for row in rows.itertuples()
        )

    if len(names) > MOST_PAIRS:
        return figures._paged(
            "pairs",
            "Every difference",
            "Mean preference of each pair on the scale from \N{MINUS SIGN}2 to 2: blue where the "
            "row is preferred to the column, orange the reverse. A dot: the declared test finds a "
            "difference after Holm's correction; a square: as good as each other. Intervals are in "
            "the table.",
            [[framing] for framing in framings],
            lambda page: alt(table[table.framing.isin(page)]),
            _pair_matrix,
            table,
            codebook,
            simulated=simulated,
        )
    level = 100 * (1 - alpha)
    lines = (
        f"Thin lines are intervals at {level:g} % that hold for all pairs of the family together"
        + (
            f"; thick ones are those at {100 * (1 - 2 * alpha):g} %, of one pair alone, that the "
            f"equivalence test takes. The band is the margin of equivalence, {margin:g} points. "
            if margin
            else f"; thick ones at {level:g} % of one pair alone. No margin of equivalence was "
            "declared, so no pair can be called as good as each other. "
        )
    )
    runs = figures._chunks(names, MOST_PAIR_ROWS)
    per_row = 0.45 + 0.19 * max(map(len, runs))
    pages = [
        (part, run)
        for part in figures._chunks(framings, 4 * figures._rows_that_fit(per_row, 0.45))
        for run in runs
    ]
    return figures._paged(
        "pairs",
        title,
        about + lines + verdict_words,
        pages,
        lambda page: alt(
            table[
                table.framing.isin(page[0])
                & np.array([pair in page[1] for pair in zip(table.a, table.b, strict=True)])
            ]
        ),
        _pairs,
        table,
        codebook,
        margin,
        simulated=simulated,
    )


#: So many pairs have a row each in a figure, and so many on one page; more are drawn as a matrix.
MOST_PAIRS, MOST_PAIR_ROWS = 66, 36


def _pairs(
    page: tuple[list[str], list[tuple[str, str]]],
    table: pd.DataFrame,
    codebook: Codebook,
    margin: float | None,
) -> Figure:
    framings, names = page
    labels = [
        f"{figures._cut(codebook.label(a), 16)} \N{EN DASH} {figures._cut(codebook.label(b), 16)}"
        for a, b in names
    ]
    columns = min(4, len(framings))
    figure, panels = figures._panels(
        len(framings), columns, 0.45 + 0.19 * len(names), below_in=0.45, sharex=True, sharey=True
    )
    place = {pair: at for at, pair in enumerate(names)}
    for ax, framing in zip(panels, framings, strict=True):
        if margin:
            ax.axvspan(-margin, margin, color=SKY, alpha=0.22, linewidth=0)
        ax.axvline(0, color=INK, linewidth=0.7)
        for row in table[table.framing == framing].itertuples():
            if (row.a, row.b) not in place:
                continue
            y, (_, colour, marker) = place[row.a, row.b], VERDICTS[row.verdict]
            low, high = row.low, row.high
            if margin and np.isfinite(row.equivalence_low):
                low, high = row.equivalence_low, row.equivalence_high
            if np.isfinite(row.simultaneous_low):
                ends = [max(row.simultaneous_low, -2), min(row.simultaneous_high, 2)]
                ax.plot(ends, [y, y], color=colour, linewidth=0.6)
            _interval(ax, row.mean_preference, low, high, y, colour, marker)
        ax.set_title(figures._wrapped(framing_label(codebook, framing), 20), loc="left", size=8)
        ax.set_yticks(range(len(labels)), labels, size=7)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.set_xlim(-2.05, 2.05)
        ax.set_xticks(range(-2, 3))
        ax.tick_params(labelbottom=True)
        ax.grid(axis="x")
    last = panels[-columns:] if len(panels) % columns == 0 else panels[-(len(panels) % columns) :]
    last[(len(last) - 1) // 2].set_xlabel(
        "\N{LEFTWARDS ARROW} first technique      mean preference      second technique "
        "\N{RIGHTWARDS ARROW}"
    )
    used = [one for one in VERDICTS if one in set(table.verdict)]
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


def _pair_matrix(framings: list[str], table: pd.DataFrame, codebook: Codebook) -> Figure:
    """One framing as a matrix: how much the row is preferred to the column."""
    (framing,) = framings
    here = table[table.framing == framing]
    items = [name for name in codebook.techniques if name in set(here.a) | set(here.b)]
    place, n = {name: at for at, name in enumerate(items)}, len(items)
    values, marks = np.full((n, n), np.nan), {}
    for row in here.itertuples():
        i, k = place[row.a], place[row.b]
        values[i, k], values[k, i] = -row.mean_preference, row.mean_preference
        marks[i, k] = marks[k, i] = row.verdict
    size = min(WIDTH_IN, 1.6 + 0.19 * n)
    figure = Figure(figsize=(WIDTH_IN, size + 0.2), layout="constrained")
    ax = figure.subplots()
    colours = LinearSegmentedColormap.from_list("preference", [VERMILLION, "#FFFFFF", BLUE])
    drawn = ax.imshow(values, cmap=colours, vmin=-2, vmax=2)
    for (i, k), one in marks.items():
        if one != "undecided":
            marker = "s" if one == "equivalent" else "o"
            ax.plot(k, i, marker, color=INK, markersize=2.4, markeredgewidth=0)
    labels = [figures._cut(codebook.label(name), 18) for name in items]
    ax.set_yticks(range(n), labels, size=7)
    ax.set_xticks(range(n), labels, size=7, rotation=90)
    ax.tick_params(length=0)
    ax.set_title(figures._cut(framing_label(codebook, framing), 60), loc="left")
    bar = figure.colorbar(drawn, ax=ax, shrink=0.6, ticks=range(-2, 3))
    bar.set_label("mean preference for the row", size=7.5)
    bar.ax.tick_params(labelsize=7)
    return figure


def draw_scores(
    scores: pd.DataFrame, codebook: Codebook, simulated: bool = False, level: float = 95
) -> list[Picture]:
    """The thesis's figure 5.3 with intervals: points as dots, so that overlap can be seen."""
    table = scores[scores.score.notna() & (scores.framing != OVERALL)]
    if table.empty:
        return []
    framings = list(dict.fromkeys(table.framing))
    labels = [codebook.label(name) for name in table.technique.unique()]
    height = 0.5 + figures._row_in(figures._row_labels(labels)) * len(labels)
    return figures._paged(
        "scores_intervals",
        "Scores with their intervals",
        "The points of figure 5.3 of the thesis with intervals at "
        f"{level:g} % over resampled participants, each of one technique alone: "
        "where intervals overlap widely, other people "
        "could have put the techniques in another order.",
        figures._chunks(framings, 3 * figures._rows_that_fit(height, 0.25)),
        lambda page: "; ".join(
            f"{codebook.framing_label(framing)}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.score:g} ({row.low:g} to {row.high:g})"
                for row in rows.itertuples()
            )
            for framing, rows in table[table.framing.isin(page)].groupby("framing", sort=False)
        ),
        _scores,
        table,
        codebook,
        simulated=simulated,
    )


def _scores(framings: list[str], table: pd.DataFrame, codebook: Codebook) -> Figure:
    techniques = [name for name in codebook.techniques if name in set(table.technique)]
    labels = figures._row_labels([codebook.label(name) for name in techniques])
    figure, panels = figures._panels(
        len(framings),
        3,
        0.5 + figures._row_in(labels) * len(labels),
        below_in=0.25,
        sharex=True,
        sharey=True,
    )
    for ax, framing in zip(panels, framings, strict=True):
        for row in table[table.framing == framing].itertuples():
            _interval(ax, row.score, row.low, row.high, techniques.index(row.technique))
        ax.set_title(figures._wrapped(codebook.framing_label(framing), 28), loc="left", size=8)
        ax.set_yticks(range(len(labels)), labels, size=7)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.set_xlim(0, max(1, ax.get_xlim()[1]))
        ax.xaxis.set_major_locator(MaxNLocator(4, integer=True))
        ax.tick_params(labelbottom=True)
        ax.grid(axis="x")
    figure.supxlabel("points", size=8)
    return figure


def draw_agreement(
    agreement: pd.DataFrame, codebook: Codebook, simulated: bool = False, level: float = 95
) -> list[Picture]:
    """Consistency within and agreement between people, framing by framing."""
    table = agreement[agreement.statistic.isin(DRAWN) & agreement.value.notna()]
    if table.empty:
        return []
    statistics = [name for name in DRAWN if name in set(table.statistic)]
    height = 0.62 + 0.32 * table.framing.nunique()
    return figures._paged(
        "agreement",
        "Consistency and agreement",
        "1 is perfect. For zeta 0 is as many circular triads as there can be, for u and "
        "alpha 0 is what chance gives. "
        f"Lines are intervals at {level:g} % where there are any.",
        figures._chunks(statistics, 3 * figures._rows_that_fit(height)),
        lambda page: "; ".join(
            f"{framing_label(codebook, row.framing)}: {DRAWN[row.statistic]} {row.value:z.2f}"
            for row in table[table.statistic.isin(page)].itertuples()
        ),
        _agreement,
        table,
        codebook,
        simulated=simulated,
    )


def _agreement(statistics: list[str], table: pd.DataFrame, codebook: Codebook) -> Figure:
    framings = list(dict.fromkeys(table.framing))
    labels = [figures._wrapped(framing_label(codebook, name), 16) for name in framings]
    figure, panels = figures._panels(
        len(statistics), 3, 0.62 + figures._row_in(labels) * len(labels), sharex=True, sharey=True
    )
    for ax, statistic in zip(panels, statistics, strict=True):
        for row in table[table.statistic == statistic].itertuples():
            _interval(ax, row.value, row.low, row.high, framings.index(row.framing))
        figures._zero(ax)
        ax.set_title(figures._wrapped(DRAWN[statistic], 30), loc="left", size=8)
        ax.set_yticks(range(len(labels)), labels, size=7)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.set_xlim(min(-0.1, float(np.nanmin(table[["value", "low"]].to_numpy())) - 0.05), 1.05)
        ax.tick_params(labelbottom=True)
        ax.grid(axis="x")
    return figure


def draw_triads(participants: pd.DataFrame, simulated: bool = False) -> Picture | None:
    """How consistent and how fast each person was; None where nobody's consistency is known."""
    if not (participants.median_rt_ms.notna() & participants.zeta.notna()).any():
        return None
    zeta = participants.zeta.dropna()
    return figures._picture(
        "participants",
        "How consistent and how fast each person was",
        "One dot a person: the coefficient of consistency (1: no circular triad) and the "
        "median time of an answer. "
        "Crosses: those whom a rule excludes in the second pass.",
        f"{len(participants)} people; consistency from {zeta.min():.2f} to {zeta.max():.2f}, "
        f"median {zeta.median():.2f}",
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
    ax.set_ylim(min(0.0, float(np.nanmin(zeta))) - 0.05, 1.06)
    ax.set_xlim(left=0)
    ax.set_xlabel("median time of an answer, s")
    ax.set_ylabel("consistency (zeta)")
    ax.grid()
    return figure


def draw_objective(
    table: pd.DataFrame,
    measure: str,
    about: str,
    codebook: Codebook,
    simulated: bool = False,
    level: float = 95,
) -> list[Picture]:
    """Worth against one objective measure, with the Pareto front where less of it is better.

    table: see `objective.against_worth`.
    """
    framings = list(dict.fromkeys(table.framing))
    return figures._paged(
        f"objective_{measure}",
        f"Worth against {about}",
        f"Thurstone case V worth with its interval at {level:g} %. Ringed and joined: the Pareto "
        f"front, techniques that no other one beats in worth without having more {about}.",
        figures._chunks(framings, 3 * figures._rows_that_fit(2.3, 0.2)),
        lambda page: "; ".join(
            f"{framing_label(codebook, row.framing)}, {codebook.label(row.technique)}: "
            f"{row.value:g}, {row.estimate:z.2f} JOD" + (", on the front" if row.front else "")
            for row in table[table.framing.isin(page)].itertuples()
        ),
        _objective,
        table,
        about,
        codebook,
        simulated=simulated,
    )


def _objective(framings: list[str], table: pd.DataFrame, about: str, codebook: Codebook) -> Figure:
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


def draw_visibility(table: pd.DataFrame, codebook: Codebook, simulated: bool = False) -> Picture:
    """Predicted visibility of each pair against the share of answers that saw a difference.

    table: see `visibility.beside_answers`.
    """
    return figures._picture(
        "visibility",
        "Predicted visibility beside answers",
        "Each point is a pair: how far apart its images are predicted to look as they were shown, "
        "and which share of its answers was not 'no difference'. Left of the line, within 0.1 JOD, "
        "53 of 100 forced choices tell them apart. A prediction of visibility, not of realism.",
        "; ".join(
            f"{framing_label(codebook, row.framing)}, {codebook.label(row.technique)} and "
            f"{codebook.label(row.opponent)}: {row.predicted_jod:.2f} JOD, "
            f"{100 * row.noticed:.0f} % saw a difference"
            for row in table.itertuples()
        ),
        _visibility,
        table,
        codebook,
        simulated=simulated,
    )


def _visibility(table: pd.DataFrame, codebook: Codebook) -> Figure:
    figure, (ax,) = figures._panels(1, 1, 3.0)
    colours, markers = (BLUE, ORANGE, GREEN, VERMILLION, SKY), "os^Dv"
    for k, framing in enumerate(dict.fromkeys(table.framing)):
        here = table[table.framing == framing]
        ax.plot(
            here.predicted_jod.clip(lower=1e-3),
            100 * here.noticed,
            markers[k % 5],
            color=colours[k % 5],
            markersize=5,
            label=figures._cut(framing_label(codebook, framing), 24),
        )
    ax.axvline(0.1, color="#888888", linewidth=0.8, zorder=0)
    ax.set_xscale("log")
    ax.set_ylim(-3, 103)
    ax.set_xlabel("predicted, JOD apart")
    ax.set_ylabel("answers that saw a difference, %")
    ax.legend(loc="best")
    ax.grid()
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
        f"How many people find {plan.apart} JOD, or exclude {plan.margin:.3g} points",
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
        "find": f"find {plan.apart} JOD",
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
