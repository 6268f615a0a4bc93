"""The figures of chapter 4: as the thesis has them, and so that more can be read from them.

Colour maps are even in lightness and told apart by colour-blind readers (viridis, Okabe and Ito's
colours); no value is cut off, scales are shared within a figure, and beside each is its CSV.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from renderer.optics.figures import pyplot, save
from stimuli.experiment.chapter import (
    ANGLES,
    LADDER,
    THIRTY,
    Options,
    Task,
    busiest,
    front,
    kept_maps,
    save_png,
    table_41,
    write_csv,
)

COLOUR_MAP = "viridis"
OKABE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
GAMMA = 0.5  # small differences are seen and the largest are not cut off
CLOSE_SHARE = 6  # the picture's width over that of a detail of it


def draw(
    folder: Path, listed: Sequence[Task], rows: Sequence[dict], options: Options
) -> Iterator[Path]:
    """Every figure and table of what was measured, and the files that were written."""
    out = folder / "figures"
    out.mkdir(exist_ok=True)
    with_maps = [task for task in listed if task.maps]
    for framing in dict.fromkeys(t.framing for t in with_maps if t.part == "ladder"):
        ladder = [t for t in with_maps if (t.part, t.framing) == ("ladder", framing)]
        yield from _ladder(folder, out, framing, ladder, rows, options)
    for framing in dict.fromkeys(t.framing for t in with_maps if t.part == "contrast"):
        both = [t for t in with_maps if (t.part, t.framing) == ("contrast", framing)]
        yield from _contrast(folder, out, framing, both, rows, options)
    if any(row["part"] == "ladder" for row in rows):
        yield from _returns(out, rows, options)
    if any(row["part"] == "sweep" for row in rows):
        yield from _front(out, rows, options)
    angles = [t for t in with_maps if t.part == "angles"]
    if angles:
        yield from _angles(folder, out, angles)
        file = out / "table-4.1.csv"
        write_csv(table_41(rows), file)
        yield file


def _said(options: Options) -> str:
    s = options.supersample
    return f"an output pixel has {s * s} computed pixels: 22 samples are {22 * s * s}"


def _samples(count: int) -> str:
    return f"{count} sample{'s' if count > 1 else ''}"


def plain(axes) -> None:
    """Logarithmic axes, of what is drawn by now, with few plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    for one, fine in ((axes.xaxis, (1.0, 2.0, 5.0)), (axes.yaxis, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))):
        low, high = one.get_view_interval()
        subs = (1.0, 3.0) if high > 60 * low else (1.0, 2.0, 5.0) if high > 15 * low else fine
        few = one is axes.xaxis and high < 4 * low
        one.set_major_locator(MaxNLocator(4) if few else LogLocator(subs=subs))
        one.set_major_formatter(FuncFormatter(_plainly))
        one.set_minor_formatter(NullFormatter())


def _plainly(value: float, _=None) -> str:
    return f"{value:,.0f}" if value >= 1000 else f"{value:g}"


def _value(rows, task: Task, against: str, column: str, region: str = "mask") -> float:
    framing, _, angle = task.framing.partition("/")
    for row in rows:
        same = (row["part"], row["framing"], row["technique"]) == (
            task.part,
            framing,
            task.technique,
        )
        place = (row["angle"], row["against"], row["region"])
        if same and place == (angle or "own", against, region):
            return float(row[column])
    raise KeyError((task, against, region))


def _coloured(values: np.ndarray, top: float) -> np.ndarray:
    """A map (h, w) as RGB (h, w, 3) uint8, 0 to top over the colour map, nothing cut off."""
    from matplotlib import colormaps

    share = np.clip(values / max(top, 1e-12), 0, 1) ** GAMMA
    return np.rint(255 * colormaps[COLOUR_MAP](share)[..., :3]).astype(np.uint8)


def _beside(pictures: Sequence[np.ndarray], gap: int = 4) -> np.ndarray:
    """Pictures (h, w, 3) of one size beside each other on white."""
    height = pictures[0].shape[0]
    white = np.full((height, gap, 3), 255, np.uint8)
    parts = [part for one in pictures for part in (one, white)]
    return np.concatenate(parts[:-1], axis=1)


def _panel(axes, values: np.ndarray, title: str, norm=None) -> object:
    shown = axes.imshow(values, cmap=COLOUR_MAP, norm=norm, interpolation="nearest")
    axes.set_title(title, fontsize=8)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)
    for side in axes.spines.values():
        side.set_visible(False)
    return shown


def _legend(figure, axes: np.ndarray) -> None:
    """Below all axes, where it covers nothing: they have the same lines."""
    lines = axes[0, 0].get_legend_handles_labels()
    figure.legend(*lines, loc="outside lower center", ncols=-(-len(lines[0]) // 2), fontsize=7)


def _power(top: float):
    from matplotlib.colors import PowerNorm

    return PowerNorm(GAMMA, vmin=0.0, vmax=max(top, 1e-12))


def _ladder(folder, out, framing, tasks, rows, options) -> Iterator[Path]:
    """Figures 4.4 and 4.5."""
    plt = pyplot()
    kept = [kept_maps(folder, task) for task in tasks]
    names = [THIRTY, options.converged]
    tops = [max(float(one[f"map dssim {name}"].max()) for one in kept) for name in names]
    thesis = _beside([_coloured(one[f"map dssim {THIRTY}"], tops[0]) for one in kept])
    file = out / f"4.4-thesis-{framing}.png"
    save_png(thesis, file)
    yield file
    figure, axes = plt.subplots(2, len(tasks), figsize=(2.3 * len(tasks) + 0.6, 4.0), squeeze=False)
    table = []
    for line, (name, top) in enumerate(zip(names, (max(tops),) * 2, strict=True)):
        for k, (task, one) in enumerate(zip(tasks, kept, strict=True)):
            values = [_value(rows, task, name, "dssim", where) for where in ("mask", "image")]
            flips = [_value(rows, task, name, "flip", where) for where in ("mask", "image")]
            samples = _value(rows, task, name, "samples")
            title = (
                f"{_samples(LADDER[k])} ({LADDER[k] * options.supersample**2} an output pixel)\n"
                f"DSSIM {1e4 * values[0]:.3g}e-4 of skin,\n{1e4 * values[1]:.3g}e-4 of the image"
            )
            last = _panel(axes[line, k], one[f"map dssim {name}"], title, _power(top))
            table.append(
                {
                    "framing": framing,
                    "against": name,
                    "samples": samples,
                    "output_samples": samples * options.supersample**2,
                    "dssim_mask": values[0],
                    "dssim_image": values[1],
                    "flip_mask": flips[0],
                    "flip_image": flips[1],
                }
            )
        axes[line, 0].set_ylabel("against\n" + name.replace(":", "\n"), fontsize=7)
    figure.colorbar(last, ax=axes, label="DSSIM, all values shown", shrink=0.8)
    figure.suptitle(f"Golubev with few samples, {framing} ({_said(options)})", fontsize=9)
    yield from _saved(figure, out / f"4.4-{framing}", table)

    pictures = [one["image"] for one in kept]
    file = out / f"4.5-thesis-{framing}.png"
    save_png(_beside(pictures), file)
    yield file
    goal = kept[0][f"goal {options.converged}"]
    height, width = goal.shape[:2]
    size = (height // CLOSE_SHARE, width // CLOSE_SHARE)
    change = np.abs(pictures[0].astype(float) - goal).sum(axis=2)
    row, column = busiest(change, size)
    window = (slice(row, row + size[0]), slice(column, column + size[1]))
    figure, axes = plt.subplots(2, len(tasks) + 1, figsize=(2.0 * len(tasks) + 2.4, 2.9))
    for k, image in enumerate([*pictures, goal]):
        label = _samples(LADDER[k]) if k < len(pictures) else f"converged\n{options.converged}"
        _panel(axes[0, k], image[window], label)
        apart = np.abs(image[window].astype(float) - goal[window]).max(axis=2)
        if k == 0:
            top = float(apart.max())
        shown = _panel(axes[1, k], apart, f"largest {apart.max():.0f} levels", _power(top))
    figure.colorbar(shown, ax=axes, label="levels of 255", shrink=0.9)
    figure.suptitle(
        f"The same, {size[1]} x {size[0]} pixels where they differ most, {framing}", fontsize=9
    )
    place = [{"framing": framing, "left": column, "top": row, "width": size[1], "height": size[0]}]
    yield from _saved(figure, out / f"4.5-{framing}", place)


def _contrast(folder, out, framing, tasks, rows, options) -> Iterator[Path]:
    """Figure 4.6: contrast, and the difference of 12 samples less it; and what is really left."""
    plt = pyplot()
    base, plus = (kept_maps(folder, task) for task in tasks)
    before, contrast = base[f"map dssim {THIRTY}"], plus["contrast"]
    less = np.clip(before - contrast, 0, None)
    top = float(before.max())
    file = out / f"4.6-thesis-{framing}.png"
    save_png(_beside([_coloured(contrast, 1.0), _coloured(less, top)]), file)
    yield file
    after = plus[f"map dssim {THIRTY}"]
    figure, axes = plt.subplots(1, 4, figsize=(11.0, 2.5))
    first = _panel(axes[0], contrast, "(a) contrast of golubev_plus", _power(contrast.max()))
    figure.colorbar(first, ax=axes[0], shrink=0.7)
    _panel(axes[1], before, "(b) DSSIM of 12 samples to 30", _power(top))
    _panel(axes[2], less, "(c) b less a: the thesis's 4.6b", _power(top))
    last = _panel(axes[3], after, "(d) DSSIM of golubev_plus to 30", _power(top))
    figure.colorbar(last, ax=axes[3], shrink=0.7)
    skin = base["skin"] > 0.5
    active = skin & (contrast >= 0.25)
    table = [
        {
            "framing": framing,
            "dssim_12_mask": _value(rows, tasks[0], THIRTY, "dssim"),
            "dssim_plus_mask": _value(rows, tasks[1], THIRTY, "dssim"),
            "dssim_12_converged": _value(rows, tasks[0], options.converged, "dssim"),
            "dssim_plus_converged": _value(rows, tasks[1], options.converged, "dssim"),
            "active_share_of_skin": float(active.sum() / max(skin.sum(), 1)),
            "share_of_error_in_active": float(
                before[active].sum() / max(before[skin].sum(), 1e-12)
            ),
            "share_after_subtraction": float(less[skin].sum() / max(before[skin].sum(), 1e-12)),
            "share_really_left": float(after[skin].sum() / max(before[skin].sum(), 1e-12)),
        }
    ]
    figure.suptitle(
        f"Where contrast puts samples, {framing}: subtracting leaves "
        f"{100 * table[0]['share_after_subtraction']:.0f} % of the error, sampling leaves "
        f"{100 * table[0]['share_really_left']:.0f} %",
        fontsize=9,
    )
    yield from _saved(figure, out / f"4.6-{framing}", table)


def _returns(out, rows, options) -> Iterator[Path]:
    """DSSIM and FLIP against samples, to 30 samples and to the converged picture."""
    plt = pyplot()
    mine = [r for r in rows if r["part"] == "ladder" and r["region"] == "mask"]
    measures = [m for m in ("dssim", "flip") if m in mine[0]]
    figure, axes = plt.subplots(1, len(measures), figsize=(4.2 * len(measures), 3.1), squeeze=False)
    for axis, measure in zip(axes[0], measures, strict=True):
        for k, framing in enumerate(dict.fromkeys(r["framing"] for r in mine)):
            for against, line in ((THIRTY, "--"), (options.converged, "-")):
                here = [r for r in mine if (r["framing"], r["against"]) == (framing, against)]
                axis.plot(
                    [r["samples"] for r in here],
                    [r[measure] for r in here],
                    line,
                    color=OKABE[k],
                    marker=MARKERS[k],
                    markersize=4,
                    label=f"{framing}, to {'30' if against == THIRTY else 'the converged'}",
                )
        axis.set_yscale("log")
        axis.set_xlabel("samples a computed pixel")
        axis.set_ylabel(f"{measure.upper()} over skin")
    _legend(figure, axes)
    figure.suptitle(f"Golubev: what more samples bring ({_said(options)})", fontsize=9)
    yield from _saved(figure, out / "4.4-returns", mine)


def _front(out, rows, options) -> Iterator[Path]:
    """Threshold, base and extra samples: quality against samples, and the front."""
    plt = pyplot()
    mine = [r for r in rows if r["part"] == "sweep" and r["region"] == "mask"]
    framings = list(dict.fromkeys(r["framing"] for r in mine))
    measures = [m for m in ("rmse", "dssim", "flip") if m in mine[0]]
    size = (3.5 * len(measures), 2.9 * len(framings))
    figure, axes = plt.subplots(len(framings), len(measures), figsize=size, squeeze=False)
    table = []
    for line, framing in enumerate(framings):
        here = [r for r in mine if r["framing"] == framing]
        fronts = {m: front(here, "samples", m) for m in measures}
        for k, row in enumerate(here):
            best = {f"front_{m}": int(fronts[m][k]) for m in measures}
            table.append(row | _parameters(row["technique"]) | best)
        for axis, measure in zip(axes[line], measures, strict=True):
            for k, (name, some) in enumerate(_groups(here).items()):
                axis.plot(
                    [r["samples"] for r in some],
                    [r[measure] for r in some],
                    MARKERS[k],
                    color=OKABE[k],
                    markersize=4 if name == "golubev_plus" else 6,
                    alpha=0.45 if name == "golubev_plus" else 1.0,
                    label=name,
                )
            best = sorted((r["samples"], r[measure]) for r, on in zip(here, fronts[measure]) if on)
            axis.step(*zip(*best), where="post", color="#444444", linewidth=0.9, label="front")
            axis.set_xscale("log")
            axis.set_yscale("log")
            plain(axis)
            axis.set_xlabel("samples a computed pixel")
            axis.set_ylabel(f"{measure.upper()} over skin")
            axis.set_title(framing, fontsize=8)
    _legend(figure, axes)
    figure.suptitle(
        f"Quality against samples, to {options.converged} ({_said(options)})", fontsize=9
    )
    yield from _saved(figure, out / "sweep", table)


def _groups(rows: Sequence[dict]) -> dict[str, list[dict]]:
    groups: dict[str, list[dict]] = {}
    for row in rows:
        groups.setdefault(row["technique"].partition(":")[0], []).append(row)
    return groups


def _parameters(text: str) -> dict[str, object]:
    """Of Golubev Plus: threshold, base and extra samples; blank for others."""
    name, *settings = text.split(":")
    given = dict(setting.split("=") for setting in settings)
    if name != "golubev_plus":
        return {"threshold": "", "base": "", "extra": ""}
    base = int(given["base_samples"])
    return {
        "threshold": round(0.5 - float(given["offset"]), 4),
        "base": base,
        "extra": int(given["samples"]) - base,
    }


def _angles(folder, out, tasks: Sequence[Task]) -> Iterator[Path]:
    """Figure 4.7: the framings from each side."""
    plt = pyplot()
    framings = list(dict.fromkeys(task.framing.partition("/")[0] for task in tasks))
    size = (2.7 * len(ANGLES), 1.75 * len(framings))
    figure, axes = plt.subplots(len(framings), len(ANGLES), figsize=size, squeeze=False)
    for task in tasks:
        framing, _, angle = task.framing.partition("/")
        axis = axes[framings.index(framing), ANGLES.index(angle)]
        _panel(axis, _reduced(kept_maps(folder, task)["image"]), f"{framing}, {angle}")
    yield from _saved(figure, out / "4.7", None)


def _reduced(image: np.ndarray, width: int = 480) -> np.ndarray:
    from PIL import Image

    if image.shape[1] <= width:
        return image
    size = (width, round(image.shape[0] * width / image.shape[1]))
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))


def _saved(figure, stem: Path, table: Sequence[Mapping] | None) -> Iterator[Path]:
    """The figure as SVG and PNG, and its numbers."""
    figure.draw_without_rendering()  # laid out once
    figure.set_layout_engine("none")
    for suffix in (".svg", ".png"):
        file = stem.with_name(stem.name + suffix)
        save(figure, file)
        yield file
    if table is not None:
        file = stem.with_name(f"{stem.name}.csv")
        write_csv(table, file)
        yield file
