"""The thesis's figures 5.3 to 5.9, for any response table, at the widths of a journal's columns.

Okabe-Ito palette (safe for colour-blind readers), outlined fonts in SVG and embedded ones in PDF,
the same bytes on every run. Every figure of simulated answers carries a mark that says so.
"""

from __future__ import annotations

import io
import textwrap
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from analysis import tallies
from analysis.ahp import Priorities
from analysis.codebook import FRAMING, Codebook
from analysis.responses import Responses

SIMULATED = "SIMULATED ANSWERS"
#: M. Okabe and K. Ito, "Color Universal Design", 2002.
BLUE, SKY, ORANGE, VERMILLION, GREEN = "#0072B2", "#56B4E9", "#E69F00", "#D55E00", "#009E73"
GREY, INK = "#C8C8C8", "#222222"
#: One colour for each of the five answers, from strong for the first to strong for the second, and
#: for the text on it.
ANSWERS = (BLUE, SKY, GREY, ORANGE, VERMILLION)
ON_ANSWERS = ("white", INK, INK, INK, "white")

#: One and two columns of a journal page: ACM's two-column format; the text of its one-column
#: journals is between the two.
SINGLE_MM, DOUBLE_MM = 84.7, 177.8
WIDTH_IN, NARROW_IN = DOUBLE_MM / 25.4, SINGLE_MM / 25.4
BANNER_IN = 0.26
#: No figure is taller than this, without the banner: an A4 page with margins and a caption.
TALLEST_IN = 8.2
#: Up to so many techniques each one's answers against each other one are drawn.
MOST_PREFERENCES = 12
#: From so many rows on a label has one line.
MANY_ROWS = 16
RC = {
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#666666",
    "axes.axisbelow": True,
    "text.color": INK,
    "text.parse_math": False,
    "axes.labelcolor": INK,
    "xtick.color": "#444444",
    "ytick.color": INK,
    "ytick.major.size": 0,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "svg.hashsalt": "subdermal",
    "figure.dpi": 100,
    "savefig.dpi": 300,
}


@dataclass(frozen=True)
class Picture:
    """A figure as bytes; `name` is its file name without suffix, `alt` what it shows, for those who
    cannot see it. kind: the name that the pages of one figure share.
    """

    name: str
    title: str
    caption: str
    alt: str
    svg: bytes
    png: bytes
    pdf: bytes
    kind: str = ""

    @property
    def files(self) -> dict[str, bytes]:
        """The picture in every form: path inside the output folder -> content."""
        return {
            f"figures/{self.name}.{kind}": getattr(self, kind) for kind in ("pdf", "png", "svg")
        }


def _picture(
    name: str,
    title: str,
    caption: str,
    alt: str,
    draw: Callable[..., Figure],
    *args: object,
    simulated: bool = False,
) -> Picture:
    """Draw with our style and save; nothing global changes. Letters that the font lacks are said in
    the caption.
    """
    with (
        matplotlib.rc_context({**matplotlib.rcParamsDefault, "backend": "agg", **RC}),
        warnings.catch_warnings(record=True) as warned,
    ):
        warnings.simplefilter("always")
        figure = draw(*args)
        if simulated:
            _mark(figure)
        about = f"{SIMULATED}. {title}" if simulated else title
        # laid out once, at the resolution of the PNG, and then drawn once for each form: savefig
        # would do both three times
        figure.dpi = matplotlib.rcParams["savefig.dpi"]
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        png, svg, pdf = io.BytesIO(), io.BytesIO(), io.BytesIO()
        FigureCanvasAgg(figure).print_png(png, metadata={"Title": about})
        FigureCanvasSVG(figure).print_svg(svg, metadata={"Date": None, "Title": about})
        FigureCanvasPdf(figure).print_pdf(pdf, metadata={"CreationDate": None, "Title": about})
    lacking = [one for one in warned if "missing from" in str(one.message)]
    if lacking:
        caption += (
            " Some letters of its names are not in the figure's font and show as "
            "boxes; the tables have them."
        )
    for one in warned:
        if one not in lacking:
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
    alt = f"{SIMULATED}. {alt}" if simulated else alt
    return Picture(name, title, caption, alt, svg.getvalue(), png.getvalue(), pdf.getvalue())


def _paged(
    name: str,
    title: str,
    caption: str,
    chunks: Sequence[object],
    alt: Callable[[object], str],
    draw: Callable[..., Figure],
    *args: object,
    simulated: bool = False,
) -> list[Picture]:
    """A figure of several pages, one for each chunk, which `draw` gets first."""
    pictures = []
    for place, chunk in enumerate(chunks, start=1):
        one = len(chunks) == 1
        picture = _picture(
            name if place == 1 else f"{name}_{place}",
            title if one else f"{title} ({place} of {len(chunks)})",
            caption,
            alt(chunk),
            draw,
            chunk,
            *args,
            simulated=simulated,
        )
        pictures.append(replace(picture, kind=name))
    return pictures


def _chunks(values: Sequence, most: int) -> list[list]:
    """The values in runs of about the same length, of at most so many."""
    values, most = list(values), max(1, most)
    count = max(1, -(-len(values) // most))
    size = -(-len(values) // count)
    return [values[start : start + size] for start in range(0, len(values), max(1, size))]


def _rows_that_fit(height_in: float, below_in: float = 0.0) -> int:
    """How many rows of panels of that height a page takes."""
    return max(1, int((TALLEST_IN - below_in) / height_in))


def _mark(figure: Figure) -> None:
    """A strip across the top, in room added for it, that says that no person gave these answers."""
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + BANNER_IN)
    strip = BANNER_IN / (height + BANNER_IN)
    figure.get_layout_engine().set(rect=(0, 0, 1, 1 - 1.2 * strip))
    figure.add_artist(
        Rectangle((0, 1 - strip), 1, strip, facecolor=VERMILLION, transform=figure.transFigure)
    )
    figure.text(
        0.5,
        1 - strip / 2,
        SIMULATED,
        color="white",
        weight="bold",
        size=11,
        ha="center",
        va="center_baseline",
    )


def _panels(
    count: int,
    columns: int,
    height_in: float,
    width_in: float = WIDTH_IN,
    below_in: float = 0,
    **share: object,
) -> tuple[Figure, list[Axes]]:
    """A figure with so many panels of that height, and room below them for a key."""
    columns = min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(width_in, rows * height_in + below_in), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **share).ravel()
    for spare in axes[count:]:
        spare.remove()
    return figure, list(axes[:count])


def _zero(ax: Axes) -> None:
    """A line at 0, over the grid and under what is drawn."""
    ax.axvline(0, color="#888888", linewidth=0.7, zorder=1.6)


def _cut(label: str, width: int) -> str:
    """The label in so many letters: its beginning and its end, which tells one from another."""
    if len(label) <= width:
        return label
    end = (width - 1) // 2
    return f"{label[: width - 1 - end].rstrip()}…{label[-end:].lstrip()}" if end else label[:width]


def _wrapped(label: str, width: int = 20, most: int = 2) -> str:
    """The label on at most so many lines."""
    if len(label) <= width:
        return label
    # a vertical tab is white space to textwrap and in no label: a place to break behind '_'
    lines = textwrap.wrap(label.replace("_", "_\v"), width, replace_whitespace=False)
    lines = [line.replace("\v", "") for line in lines]
    if len(lines) > most:
        return _wrapped(_cut(label, most * width - most), width, most + 1)
    return "\n".join(lines)


def _row_in(labels: Sequence[str]) -> float:
    """The height in inches that a row needs for the tallest of its wrapped labels."""
    row = 0.25 if all("\n" not in label for label in labels) else 0.32
    return min(row, (TALLEST_IN - 1.2) / max(len(labels), 1))


def _row_labels(names: Sequence[str], width: int = 20) -> list[str]:
    """Labels of rows: wrapped, or cut to one line where there are many."""
    return [_wrapped(name, width) if len(names) <= MANY_ROWS else _cut(name, 24) for name in names]


def _bars(
    chosen: Sequence[str],
    values: Mapping[str, Mapping[str, float]],
    titles: Mapping[str, tuple[str, str]],
    labels: Mapping[str, str],
    axis: str,
    digits: int,
) -> Figure:
    """One panel a framing, one bar a technique; a technique without a value there gets no bar and
    says so.
    """
    rows = _row_labels(list(labels.values()))
    height = _bars_in(labels)
    figure, panels = _panels(len(chosen), 3, height, below_in=0.3, sharex=True, sharey=True)
    top = max((value for one in values.values() for value in one.values()), default=0) or 1
    for ax, framing in zip(panels, chosen, strict=True):
        one = values[framing]
        for place, technique in enumerate(labels):
            value = one.get(technique)
            if value is None:
                ax.text(0, place, " no value", va="center", size=7, style="italic", color="#666666")
            else:
                ax.barh(place, value, height=0.66, color=BLUE)
                _value(ax, value, place, f"{value:.{digits}f}")
        label, note = titles[framing]
        ax.set_title(f"{_wrapped(label, 26)}\n({note})", loc="left", size=8)
        ax.set_xlim(0, top * 1.25)
        ax.xaxis.set_major_locator(MaxNLocator(4, integer=digits == 0))
        ax.grid(axis="x")
        ax.set_yticks(range(len(rows)), rows)
        ax.set_ylim(len(labels) - 0.5, -0.5)
        ax.tick_params(labelbottom=True)
    figure.supxlabel(axis, size=8)
    return figure


def _bars_in(labels: Mapping[str, str]) -> float:
    """The height of one panel of `_bars`."""
    rows = _row_labels(list(labels.values()))
    return 0.68 + _row_in(rows) * len(rows)


def _value(ax: Axes, x: float, y: float, text: str) -> None:
    """The number at the end of a bar, clear of grid lines."""
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    ax.annotate(
        text,
        (x, y),
        xytext=(3, 0),
        textcoords="offset points",
        size=7.5,
        va="center_baseline",
        bbox=box,
    )


def _familiarity(table: pd.DataFrame) -> Figure:
    figure, (ax,) = _panels(1, 1, 0.6 + 0.28 * len(table), NARROW_IN)
    places = range(len(table))
    ax.barh(places, table.participants, height=0.66, color=BLUE)
    for place, count in zip(places, table.participants, strict=True):
        _value(ax, count, place, f"{count}")
    ax.set_yticks(places, [_wrapped(label, 18) for label in table.label])
    ax.set_ylim(len(table) - 0.5, -0.5)
    ax.set_xlim(0, max(table.participants.max(), 1) * 1.15)
    ax.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    ax.grid(axis="x")
    ax.set_xlabel("participants")
    return figure


def _total_by_distance(
    table: pd.DataFrame, labels: Sequence[str], axis: str, line: tallies.Trend | None
) -> Figure:
    many = len(table) > 5
    figure, (ax,) = _panels(1, 1, 3.0 if many else 2.7, WIDTH_IN if many else NARROW_IN)
    distance = np.arange(1, len(table) + 1)
    if line is not None:
        ends = np.array([0.75, len(table) + 0.25])
        fit = f"line: {line.slope:+.1f} points a framing".replace("-", "\N{MINUS SIGN}")
        fit += f", R² = {line.r2:.2f}" if np.isfinite(line.r2) else ""
        ax.plot(
            ends,
            line.intercept + line.slope * ends,
            "--",
            color=VERMILLION,
            linewidth=1.2,
            label=fit,
        )
    ax.plot(distance, table.total, "o", markersize=6, color=BLUE, label="total of all techniques")
    for x, total in zip(distance, table.total, strict=True):
        below = line is not None and total < line.intercept + line.slope * x
        place = {
            "xytext": (0, -8 if below else 7),
            "textcoords": "offset points",
            "va": "top" if below else "bottom",
        }
        ax.annotate(f"{total}", (x, total), ha="center", size=7.5, **place)
    if many:
        turned = {"rotation": 35, "ha": "right", "rotation_mode": "anchor", "size": 7}
        ax.set_xticks(distance, [_cut(label, 24) for label in labels], **turned)
    else:
        ax.set_xticks(
            distance, [_wrapped(label, max(6, min(14, 40 // len(labels)))) for label in labels]
        )
    ax.set_xlim(0.6, len(table) + 0.4)
    ax.set_ylim(0, max(table.total.max(), 1) * 1.18)
    ax.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    ax.grid(axis="y")
    ax.set_ylabel("points")
    ax.set_xlabel(axis)
    ax.legend(loc="best", fontsize=7, handlelength=1.6)
    return figure


def _preferences(techniques: list[str], table: pd.DataFrame, codebook: Codebook) -> Figure:
    """One panel for each of the techniques, one bar an opponent; the answers 'no difference'
    straddle the middle.
    """
    shares = 100 * table[list(tallies.DISTRIBUTION)].to_numpy() / table.n.to_numpy()[:, None]
    starts = -(shares[:, 0] + shares[:, 1] + shares[:, 2] / 2)
    opponents = {name: _wrapped(codebook.label(name), 15) for name in dict.fromkeys(table.opponent)}
    titles = {name: _wrapped(codebook.label(name), 18) for name in techniques}
    most = table.groupby("technique").size().max()
    above_in = 0.42 + 0.13 * max(title.count("\n") for title in titles.values())
    figure, panels = _panels(
        len(techniques),
        3,
        above_in + _row_in(list(opponents.values())) * most,
        below_in=0.5,
        sharex=True,
    )
    for ax, technique in zip(panels, techniques, strict=True):
        rows = table.technique == technique
        about, share = table[rows], shares[rows]
        left = starts[rows]
        for answer, column in enumerate(tallies.DISTRIBUTION):
            style = {
                "height": 0.74,
                "color": ANSWERS[answer],
                "edgecolor": "white",
                "linewidth": 0.4,
            }
            ax.barh(range(len(about)), share[:, answer], left=left, **style)
            for place, count in enumerate(about[column]):
                # a digit of 7 points needs about 6 % of a panel's width
                if share[place, answer] >= 6 * len(str(count)):
                    middle = left[place] + share[place, answer] / 2
                    ax.text(
                        middle,
                        place,
                        f"{count}",
                        size=7,
                        color=ON_ANSWERS[answer],
                        ha="center",
                        va="center_baseline",
                    )
            left = left + share[:, answer]
        ax.axvline(0, color=INK, linewidth=0.7, zorder=0)
        ax.set_title(titles[technique], loc="left", size=8)
        ax.set_yticks(range(len(about)), [opponents[name] for name in about.opponent])
        ax.set_ylim(len(about) - 0.5, -0.5)
        ax.set_xlim(-100, 100)
        ax.xaxis.set_major_locator(MultipleLocator(50))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{abs(share):g}"))
        ax.tick_params(labelsize=7)
        ax.tick_params(labelbottom=True)
    keys = [Rectangle((0, 0), 1, 1, facecolor=colour) for colour in ANSWERS]
    figure.legend(
        keys,
        ("strong", "slight", "no difference", "slight", "strong"),
        title=(
            "←  the panel's technique is preferred      share of answers, %      the row's "
            "technique is preferred  →"
        ),
        title_fontsize=8,
        loc="outside lower center",
        ncols=5,
        handlelength=1.4,
        columnspacing=2.4,
    )
    return figure


def grouped_quantiles(answers: np.ndarray, shares: Sequence[float]) -> np.ndarray:
    """Quantiles of grouped answers: each of the five stands for an interval of width 1 about it,
    over which those who gave it are spread evenly, so that half of them lie to either side.
    """
    edges = np.arange(-2.5, 3.0)
    below = np.concatenate([[0], np.cumsum([(answers == value).sum() for value in range(-2, 3)])])
    rising = below + 1e-9 * np.arange(len(below))  # np.interp wants places that ascend
    at = np.asarray(shares) * len(answers)
    # the middle of an answer that nobody gave between two that share the people evenly
    lower, upper = (np.interp(at + step, rising, edges) for step in (-1e-6, 1e-6))
    return np.clip((lower + upper) / 2, -2, 2)


def _pair(
    chosen: Sequence[str],
    values: Mapping[str, np.ndarray],
    pair: tuple[str, str],
    codebook: Codebook,
) -> Figure:
    """Box plot of one pair at each framing over all its points; whiskers reach the extremes."""
    values = {name: values[name] for name in chosen}
    figure, (ax,) = _panels(1, 1, 1.15 + 0.62 * len(values), NARROW_IN)
    places = range(len(values))
    _zero(ax)
    boxes = []
    for answers in values.values():
        q1, median, q3 = grouped_quantiles(answers, (0.25, 0.5, 0.75))
        ends = {"whislo": min(answers.min(), q1), "whishi": max(answers.max(), q3)}
        boxes.append({"q1": q1, "med": median, "q3": q3, "fliers": [], **ends})
    ax.bxp(
        boxes,
        orientation="horizontal",
        positions=places,
        widths=0.62,
        showfliers=False,
        patch_artist=True,
        boxprops={"facecolor": "#DCEBF5", "edgecolor": BLUE, "linewidth": 0.9},
        medianprops={"color": VERMILLION, "linewidth": 2.4, "solid_capstyle": "butt"},
        whiskerprops={"color": BLUE, "linewidth": 0.9},
        capprops={"color": BLUE, "linewidth": 0.9},
    )
    for place, answers in zip(places, values.values(), strict=True):
        for value, count in zip(*np.unique(answers, return_counts=True), strict=True):
            x, y, gap = _lattice(int(count))
            ax.plot(
                value + x,
                place + 2 * y,
                "o",
                color=INK,
                markersize=min(3.2, 36 * gap),
                markeredgewidth=0,
                zorder=5,
            )
    a, b = (codebook.label(name) for name in pair)
    ax.set_yticks(
        places,
        [
            f"{_wrapped(codebook.framing_label(name), 12)}\n(n = {len(values[name])})"
            for name in values
        ],
    )
    ax.set_ylim(len(values) - 0.5, -0.5)
    ax.set_xlim(-2.45, 2.45)
    ax.set_xticks(
        range(-2, 3),
        [
            f"strong for\n{_wrapped(a, 11)}",
            "slight",
            "none",
            "slight",
            f"strong for\n{_wrapped(b, 11)}",
        ],
        size=7,
    )
    ax.grid(axis="x")
    return figure


def _lattice(count: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Places for `count` dots around the origin, x and y within 0.2, and the gap between them."""
    columns = int(np.ceil(np.sqrt(count)))
    gap = min(0.085, 0.34 / columns)
    place = np.arange(count)
    rows = -(-count // columns)
    return (
        ((place % columns) - (columns - 1) / 2) * gap,
        ((place // columns) - (rows - 1) / 2) * gap,
        gap,
    )


def draw_responses(
    responses: Responses,
    priorities: Mapping[str, Priorities],
    pair: tuple[str, str],
    slugs: Mapping[str, str],
) -> list[Picture]:
    """All figures of a response table.

    priorities: of the framings that have them; slugs: file names of the framings.
    """
    codebook, simulated = responses.codebook, responses.simulated
    used = [
        name
        for name in codebook.techniques
        if any(name in items for items in responses.items.values())
    ]
    labels = {name: codebook.label(name) for name in used}
    scores, totals = tallies.scores(responses), tallies.totals(responses)
    total = dict(zip(totals.framing, totals.total, strict=True))
    points = {
        framing: dict(zip(rows.technique, rows.score, strict=True))
        for framing, rows in scores.groupby("framing", sort=False)
    }
    framings = [codebook.framing_label(name) for name in totals.framing]
    pages = _chunks(points, 3 * _rows_that_fit(_bars_in(labels), 0.3))
    pictures = _paged(
        "scores",
        f"Scores per {codebook.level}",
        "Points of each technique (thesis, figure 5.3): a strong preference gives two, a "
        "slight one gives one, "
        "no difference gives none.",
        pages,
        lambda page: "; ".join(
            f"{codebook.framing_label(framing)}: "
            + ", ".join(f"{labels[name]} {score}" for name, score in points[framing].items())
            for framing in page
        ),
        _bars,
        points,
        {name: (codebook.framing_label(name), f"total {total[name]}") for name in points},
        labels,
        f"points (total of the {codebook.level} in brackets)",
        0,
        simulated=simulated,
    )

    levels = tallies.familiarity(responses)
    pictures.append(
        _picture(
            "familiarity",
            "Familiarity with computer graphics",
            f"Self-rating of the {responses.participants} participants (thesis, figure 5.4)"
            + (
                f"; {int(responses.ratings.isna().sum())} gave none."
                if responses.ratings.isna().any()
                else "."
            ),
            "; ".join(f"{row.label}: {row.participants}" for row in levels.itertuples()),
            _familiarity,
            levels,
            simulated=simulated,
        )
    )

    by_framing = codebook.factor == FRAMING
    line = tallies.trend(totals) if by_framing else None
    if line:
        fitted = ", with the least-squares line; the framings are taken as equally far apart."
    else:
        fitted = (
            ". Fewer than three framings: no line is fitted."
            if by_framing
            else "; its levels are no distances, and no line is fitted."
        )
    pictures.append(
        _picture(
            "total_by_distance",
            "Total of points against distance"
            if by_framing
            else f"Total of points at each {codebook.level}",
            f"Points given at each {codebook.level} (thesis, figure 5.5)" + fitted,
            "; ".join(
                f"{label}: {points}" for label, points in zip(framings, totals.total, strict=True)
            ),
            _total_by_distance,
            totals,
            framings,
            "framing, from near to far" if codebook.near_to_far else codebook.factor_words,
            line,
            simulated=simulated,
        )
    )

    if len(used) <= MOST_PREFERENCES:
        pictures += _draw_preferences(responses, slugs)

    values = tallies.preferences(responses, pair)
    if values:
        a, b = (codebook.label(name) for name in pair)
        pictures += _paged(
            "pair",
            f"{a} against {b} at each {codebook.level}",
            "Box plot of all answers (thesis, figure 5.7b): box from the lower to the "
            "upper quartile, median in orange, whiskers to the extremes, one dot an answer. "
            "Quartiles are those of grouped data: each answer stands for an interval of width 1 "
            "about it, so that a box does not collapse where many gave the same one.",
            _chunks(values, 11),
            lambda page: "; ".join(
                f"{codebook.framing_label(framing)}: {(values[framing] < 0).sum()} for {a}, "
                f"{(values[framing] == 0).sum()} none, {(values[framing] > 0).sum()} for {b}, "
                f"median {np.median(values[framing]):g}"
                for framing in page
            ),
            _pair,
            values,
            tuple(pair),
            codebook,
            simulated=simulated,
        )
    if priorities:
        shares = {
            framing: dict(zip(responses.items[framing], one.vector, strict=True))
            for framing, one in priorities.items()
        }
        without = [
            codebook.framing_label(name) for name in responses.items if name not in priorities
        ]
        pictures += draw_priorities(shares, priorities, codebook, simulated, without)
    return pictures


def _draw_preferences(responses: Responses, slugs: Mapping[str, str]) -> list[Picture]:
    """How the answers about each pair divide, a figure a framing."""
    codebook, pictures = responses.codebook, []
    distributions = tallies.distributions(responses)
    for framing, table in distributions.groupby("framing", sort=False):
        where = codebook.framing_label(framing)
        techniques = list(dict.fromkeys(table.technique))
        height = 0.42 + _row_in([_wrapped(codebook.label(name), 15) for name in techniques]) * (
            len(techniques) - 1
        )
        place = {name: at for at, name in enumerate(codebook.techniques)}
        pictures += _paged(
            f"preferences_{slugs[framing]}",
            f"Each technique against each other one: {where}",
            "How the answers divide (thesis, figures 5.6, 5.7a and 5.9). Bars to the "
            "left: the technique in the "
            "panel's title was preferred; to the right: the one in the row. Numbers in "
            "the bars count answers.",
            _chunks(techniques, 3 * _rows_that_fit(height, 0.5)),
            lambda page, table=table, place=place: "; ".join(
                f"{codebook.label(row.technique)} against {codebook.label(row.opponent)}: "
                f"{row.strong_technique} strong and {row.slight_technique} slight for the "
                f"first, {row.none} none, "
                f"{row.slight_opponent} slight and {row.strong_opponent} strong for the second"
                for row in table[table.technique.isin(page)].itertuples()
                if place[row.technique] < place[row.opponent]
            ),
            _preferences,
            table,
            codebook,
            simulated=responses.simulated,
        )
    return pictures


def draw_priorities(
    shares: Mapping[str, Mapping[str, float]],
    priorities: Mapping[str, Priorities],
    codebook: Codebook,
    simulated: bool = False,
    without: Sequence[str] = (),
) -> list[Picture]:
    """AHP priorities, one panel a framing. shares: framing -> technique -> priority.

    without: labels of the framings that have none.
    """
    used = [name for name in codebook.techniques if any(name in one for one in shares.values())]
    labels = {name: codebook.label(name) for name in used}
    titles = {
        framing: (
            codebook.framing_label(framing),
            "no CR" if one.cr is None else f"CR {one.cr:z.3f}",
        )
        for framing, one in priorities.items()
    }
    return _paged(
        "priorities",
        f"AHP priorities per {codebook.level}",
        "Principal eigenvector of the matrix of judgements, scaled to sum 1 (thesis, table "
        "5.2), with the consistency ratio."
        + (f" Not drawn, since a pair has no answer: {', '.join(without)}." if without else ""),
        _chunks(shares, 3 * _rows_that_fit(_bars_in(labels), 0.3)),
        lambda page: "; ".join(
            f"{' '.join(titles[framing])}: "
            + ", ".join(f"{labels[name]} {share:.3f}" for name, share in shares[framing].items())
            for framing in page
        ),
        _bars,
        shares,
        titles,
        labels,
        f"priority (sums to 1 within a {codebook.level})",
        3,
        simulated=simulated,
    )
