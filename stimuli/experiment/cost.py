"""What techniques cost and how it grows: time by pass, against what it could grow with.

On software OpenGL time is the processor's; on a card it is that of timer queries, with wall time
beside it. Growth is a power law, time = a x^b, fitted to logarithms by least squares with b's
interval at 95 % (Student's t); a cost with a part that does not grow has a b below its true one.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from renderer.optics.figures import pyplot, save
from stimuli.compare import chosen, framed
from stimuli.errors import InputError
from stimuli.experiment.chapter import front, write_csv
from stimuli.experiment.figures import MARKERS, OKABE, plain
from stimuli.scenes import camera, load_table, merge

AXES = ("resolution", "covered", "samples", "triangles", "lights", "splats")
ABOUT = {
    "resolution": "computed pixels",
    "covered": "pixels that scatter",
    "samples": "samples a pixel",
    "triangles": "triangles",
    "lights": "lamps",
    "splats": "splats",
}
#: Of the largest size; of the camera's height; samples; balls; lamps; mm between splats.
SCALES, NEARER = (0.25, 0.35, 0.5, 0.7, 1.0), (1.0, 1.4, 2.0, 2.8)
SAMPLES, BALLS, LAMPS, SPACINGS = (6, 12, 24, 48), (1, 2, 4, 8), (1, 2, 4, 8), (5.6, 4.0, 2.8, 2.0)
SHARED = "shared passes"


@dataclass(frozen=True)
class Options:
    """size (width, height) of the largest images; rounds: of each measurement, medians."""

    size: tuple[int, int] = (960, 540)
    supersample: int = 1
    rounds: int = 3
    seed: int = 0


def medians(frame, techniques: Mapping[str, Any], rounds: int) -> dict[str, tuple[float, float]]:
    """Seconds of scattering alone, wall and CPU: medians of rounds in turn."""
    return {
        name: tuple(map(float, np.median(spent, axis=0)))
        for name, spent in frame.time(dict(techniques), rounds).items()
    }


def grow(
    scene: str | Path,
    patch: dict,
    framing: str,
    techniques: Mapping[str, Any],
    axes: Sequence[str],
    options: Options,
) -> Iterator[dict[str, Any]]:
    """A row (axis, x, technique, wall, cpu, card) for every measurement, seconds."""
    table = merge(load_table(scene), patch)
    for axis in axes:
        for value, own, size, given in _steps(axis, scene, table, framing, techniques, options):
            sized = Options(size, options.supersample, options.rounds, options.seed)
            for _, frame, _ in framed(scene, own, [framing if axis != "triangles" else ""], sized):
                x = value if value is not None else _counted(frame, axis)
                if axis in ("triangles", "lights", "resolution", "covered"):
                    wall, cpu = _shared(frame)
                    yield _row(axis, x, SHARED, wall, cpu)
                for name, (wall, cpu) in medians(frame, given, options.rounds).items():
                    at = x
                    if axis == "samples":
                        at = _samples(frame, given[name])
                    elif axis == "splats":
                        at = _area(frame) / given[name].spacing_mm ** 2
                    card = frame.passes(given[name])[-1].card
                    yield _row(axis, at, name.partition(" ")[0], wall, cpu, card)


def _row(axis, x, name, wall, cpu, card=float("nan")) -> dict[str, Any]:
    return {
        "axis": axis,
        "x": float(x),
        "technique": name,
        "wall_s": wall,
        "cpu_s": cpu,
        "card_s": card,
    }


def _steps(axis, scene, table, framing, techniques, options):
    """(x or None where the frame says it, the scene's table, size, techniques) of an axis."""
    width, height = options.size
    if axis == "resolution":
        for share in SCALES:
            size = max(16, round(width * share)), max(16, round(height * share))
            yield size[0] * size[1] * options.supersample**2, table, size, techniques
    elif axis == "covered":
        own = camera(table, framing).height_mm
        for times in NEARER:
            level = {"camera": {"height_mm": own * times}}
            yield None, merge(table, level), options.size, techniques
    elif axis == "samples":
        made = chosen([f"golubev:samples={n}" for n in SAMPLES])
        made |= chosen([f"golubev_plus:base_samples={n // 2}:samples={n}" for n in SAMPLES])
        even = "by_size=0:by_spread=0:by_unguarded=0"
        made |= chosen([f"subdermal:fewest={n}:{even}" for n in (3, 6, 12, 24)])
        yield 0, table, options.size, made
    elif axis == "triangles":
        for count in BALLS:
            yield None, balls(count), options.size, {}
    elif axis == "lights":
        for count in LAMPS:
            lamps = {
                f"more{k}": {
                    "kind": "distant",
                    "direction": [float(np.sin(k + 1)), 0.4, float(abs(np.cos(k + 1)) + 0.2)],
                    "irradiance": [0.5, 0.5, 0.5],
                }
                for k in range(count)
            }
            own = {**table, "lights": lamps}
            if "rig" in own:  # its lamps would be more
                own = {**own, "lights": {**lamps, "key": False, "rim": False}}
            yield count, own, options.size, {}
    elif axis == "splats":
        made = chosen([f"splat_dipole:spacing_mm={mm}" for mm in SPACINGS])
        yield 0, table, options.size, made


def balls(count: int) -> dict[str, Any]:
    """A scene of so many balls in a row that cover the same area, whatever their number."""
    radius = 30.0 / np.sqrt(count)
    return {
        "objects": {
            f"ball{k}": {
                "shape": "sphere",
                "radius_mm": float(radius),
                "position_mm": [float(2.2 * radius * (k - (count - 1) / 2)), 0.0, 0.0],
                "material": "ball",
            }
            for k in range(count)
        },
        "materials": {"ball": {"medium": "deon_luebke"}},
        "lights": {"lamp": {"direction": [0.4, 0.5, 0.75], "irradiance": [3.0, 3.0, 3.0]}},
        "environment": {"ambient": [0.0, 0.0, 0.0]},
        "camera": {"framing": "balls", "height_mm": 220.0, "angle": "front"},
    }


def _counted(frame, axis: str) -> int:
    surfaces = frame.renderer.surfaces.surfaces
    if axis == "triangles":
        return sum(len(drawn.item.primitive.faces) for drawn in surfaces)
    return int((frame.surface.textures[0].read()[..., 3] > 0.5).sum())


def _shared(frame) -> tuple[float, float]:
    """Wall and CPU seconds of the shared passes of a view once more, shaders compiled."""
    renderer = frame.renderer
    start = time.perf_counter(), time.process_time()
    with type(frame)(renderer, frame.view, frame.picture):
        return time.perf_counter() - start[0], time.process_time() - start[1]


def _samples(frame, technique) -> float:
    counts = frame.render(technique).samples
    return float(counts[counts > 0].mean())


def _area(frame) -> float:
    from renderer.techniques.samples import Body

    return float(Body(frame.inputs(None).room.surfaces, 0).mesh.areas.sum())


def passes(
    scene: str | Path, patch: dict, framing: str, techniques: Mapping[str, Any], options: Options
) -> list[dict[str, Any]]:
    """A row for every pass of every technique and for all of it, seconds."""
    table, rows = merge(load_table(scene), patch), []
    for _, frame, _ in framed(scene, table, [framing], options):
        for name, technique in techniques.items():
            for one in frame.passes(technique):
                spent = {"wall_s": one.wall, "cpu_s": one.cpu, "card_s": one.card}
                rows.append({"technique": name, "pass": one.name} | spent)
    return rows


def quality(scene, patch, framing, techniques, walks, options: Options, spent) -> list[dict]:
    """Error of each technique to the reference over skin, beside what it took (`passes`)."""
    from stimuli import compare

    given = compare.Options(
        size=options.size, supersample=options.supersample, walks=walks, seed=options.seed
    )
    (shot,) = compare.compare(scene, patch, [framing], techniques, given, {})
    took = {row["technique"]: row for row in spent if row["pass"] == "all"}
    return [
        {
            "framing": row.framing,
            "technique": row.technique,
            "rmse": float(np.mean(row.rmse)),
            "error": float(np.mean(row.error)),
            "walks": walks,
        }
        | {name: took[row.technique][name] for name in ("wall_s", "cpu_s", "card_s")}
        for row in shot.rows
        if row.region == "skin"
    ]


@dataclass(frozen=True)
class Law:
    """seconds = a x^b; low, high: b's interval at 95 %, nan of two points; points: of the fit."""

    a: float
    b: float
    low: float
    high: float
    points: int


def power_law(x: Sequence[float], seconds: Sequence[float]) -> Law:
    """Fitted to logarithms; InputError of fewer than two different x."""
    from scipy import stats

    if len(set(x)) < 2 or min(*x, *seconds) <= 0:
        raise InputError("growth needs two different positive sizes and times; expected more")
    fit = stats.linregress(np.log(x), np.log(seconds))
    free = len(x) - 2
    reach = float(stats.t.ppf(0.975, free) * fit.stderr) if free > 0 else float("nan")
    slope = float(fit.slope)
    return Law(float(np.exp(fit.intercept)), slope, slope - reach, slope + reach, len(x))


def laws(rows: Sequence[Mapping[str, Any]], column: str) -> dict[tuple[str, str], Law]:
    """(axis, technique) -> its growth, where there are two sizes or more."""
    found = {}
    for axis, name in dict.fromkeys((row["axis"], row["technique"]) for row in rows):
        here = [r for r in rows if (r["axis"], r["technique"]) == (axis, name)]
        if len({r["x"] for r in here}) >= 2:
            found[axis, name] = power_law([r["x"] for r in here], [r[column] for r in here])
    return found


def timed_by(rows: Sequence[Mapping[str, Any]]) -> str:
    """The column that holds what a technique takes: the card's time where there is any."""
    measured = [row["card_s"] for row in rows if row["technique"] != SHARED]
    return "card_s" if measured and np.isfinite(measured).all() else "cpu_s"


def draw_growth(rows: Sequence[dict], stem: Path) -> list[Path]:
    """Time against each axis with its power law: SVG, PNG and CSV."""
    plt = pyplot()
    own, axes = timed_by(rows), list(dict.fromkeys(row["axis"] for row in rows))
    grown = laws([r for r in rows if r["technique"] != SHARED], own)
    grown |= laws([r for r in rows if r["technique"] == SHARED], "cpu_s")
    across = min(3, len(axes))
    down = -(-len(axes) // across)
    size = (3.6 * across, 3.7 * down)
    style = {name: k for k, name in enumerate(dict.fromkeys(row["technique"] for row in rows))}
    figure, panels = plt.subplots(down, across, figsize=size, squeeze=False)
    for panel in panels.flat[len(axes) :]:
        panel.set_visible(False)
    for panel, axis in zip(panels.flat, axes):
        names = [name for one, name in grown if one == axis]
        for name in names:
            k = style[name]
            here = [r for r in rows if (r["axis"], r["technique"]) == (axis, name)]
            column = "cpu_s" if name == SHARED else own
            x, law = np.array([r["x"] for r in here]), grown[axis, name]
            colour = OKABE[k % len(OKABE)]
            marker = MARKERS[k % len(MARKERS)]
            panel.plot(x, [r[column] for r in here], marker, color=colour, markersize=4)
            ends = np.array([x.min(), x.max()])
            label = f"{name}: {law.b:.2f} ({law.low:.2f} to {law.high:.2f})"
            panel.plot(ends, law.a * ends**law.b, color=colour, linewidth=1, label=label)
        panel.set_xscale("log")
        panel.set_yscale("log")
        plain(panel)
        panel.set_xlabel(ABOUT[axis])
        panel.set_ylabel("seconds")
        panel.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, -0.2))
    what = "timer queries" if own == "card_s" else "CPU time"
    figure.suptitle(f"Growth of cost: exponent of x (95 %), {what}", fontsize=9)
    files = [stem.with_name(f"{stem.name}.{kind}") for kind in ("svg", "png", "csv")]
    for file in files[:2]:
        save(figure, file)
    write_csv(rows, files[2])
    return files


def draw_quality(rows: Sequence[dict], cost: str, stem: Path) -> list[Path]:
    """Error to the reference against time, with the front: SVG, PNG and CSV.

    rows: framing, technique, `rmse` (mean of R, G, B) and the seconds of the column `cost`.
    """
    from matplotlib.ticker import MaxNLocator

    plt = pyplot()
    best = front(rows, cost, "rmse")
    figure, axis = plt.subplots(figsize=(6.0, 4.0))
    for k, (row, on) in enumerate(zip(rows, best)):
        axis.errorbar(
            1000 * row[cost],
            row["rmse"],
            row.get("error"),
            fmt=MARKERS[k % len(MARKERS)],
            ecolor="#bbbbbb",
            elinewidth=0.8,
            color=OKABE[k // len(MARKERS) % len(OKABE)],
            markersize=7 if on else 5,
        )
        axis.annotate(
            row["technique"],
            (1000 * row[cost], row["rmse"]),
            xytext=(5, 3),
            textcoords="offset points",
            fontsize=7,
            weight="bold" if on else "normal",
        )
    line = sorted((1000 * r[cost], r["rmse"]) for r, on in zip(rows, best) if on)
    axis.step(*zip(*line), where="post", color="#444444", linewidth=0.9)
    axis.set_xscale("log")
    plain(axis)
    axis.yaxis.set_major_locator(MaxNLocator(6))
    axis.set_xlabel("milliseconds of scattering")
    axis.set_ylabel("RMSE to the reference, of the strongest lamp")
    axis.set_title(
        "Quality per cost; bold: no other technique beats it in both;\nbars: standard error, of "
        "walks that all of them share",
        fontsize=9,
    )
    files = [stem.with_name(f"{stem.name}.{kind}") for kind in ("svg", "png", "csv")]
    for file in files[:2]:
        save(figure, file)
    write_csv([row | {"front": int(on)} for row, on in zip(rows, best)], files[2])
    return files
