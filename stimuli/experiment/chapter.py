"""Chapter 4 of the thesis as an experiment: how many samples are enough, and where.

Vuletic, master's thesis, sections 4.3 and 4.4: Golubev with few samples against 30 of them (figures
4.4 and 4.5), the contrast by which Golubev Plus spends its extra samples (figure 4.6), its
parameters, and samples at three framings from three sides (figure 4.7, table 4.1). Here each is
also set against a converged picture, over the skin as well as over the whole image.

Every measurement is a record of its own, named by all that it depends on: what is there is not
measured again, so that a run that was ended goes on.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from analysis.files import replacing
from stimuli.compare import chosen, framed, pooled
from stimuli.errors import InputError
from stimuli.experiment.samples import (
    CONVERGED,
    Distances,
    cached,
    digest,
    drawn_from,
    eight_bit,
    key,
    picture,
    regions,
    rms,
)
from stimuli.scenes import load_table, merge

#: Samples of figure 4.4, and of the picture that they are compared to.
LADDER = (1, 6, 12, 18, 24)
THIRTY = "golubev:samples=30"
#: Golubev Plus has a pixel take its extra samples from this contrast on: 0.5 - offset.
THRESHOLDS = (0.05, 0.15, 0.25, 0.35, 0.45)
BASES = (6, 9, 12)
EXTRAS = (5, 10, 20)
ANGLES = ("front", "three-quarter", "profile")
PARTS = ("ladder", "contrast", "sweep", "angles")
#: What the sweep's front is drawn against: one rule for all pixels, and other rules.
BESIDE = (
    *(f"golubev:samples={count}" for count in (6, 9, 12, 16, 22, 30)),
    "golubev_adaptive",
    "subdermal",
    "subdermal:preset=equal_error",
    "subdermal:preset=safe",
)
#: Table 4.1: samples of a picture, the mean over three angles.
PUBLISHED = {
    "close-up": (32_838_857, 19_924_226),
    "head-shot": (12_272_582, 7_161_584),
    "half-length": (4_972_325, 2_831_388),
}
MAP_PX = 640  # width at which maps are kept
MARGIN_PX = 40  # farther than DSSIM and FLIP look from a pixel


@dataclass(frozen=True)
class Options:
    """size (width, height) of the images; supersample: computed pixels in a pixel, along one side;
    thresholds, bases, extras: the grid of the sweep; beside: what its front is drawn with;
    converged: what is compared to; keep: whether converged pictures are cached.
    """

    size: tuple[int, int] = (1920, 1080)
    supersample: int = 2
    thresholds: tuple[float, ...] = THRESHOLDS
    bases: tuple[int, ...] = BASES
    extras: tuple[int, ...] = EXTRAS
    beside: tuple[str, ...] = BESIDE
    converged: str = CONVERGED
    edges_mm: float = 2.6
    jumps_mm: float = 1.0
    seed: int = 0
    keep: bool = True


@dataclass(frozen=True)
class Task:
    """One technique, drawn at a framing (NAME or NAME/ANGLE) and compared to each of `against`,
    over skin; maps: whether over the whole image too, its picture and maps kept for a figure.
    """

    part: str
    framing: str
    technique: str
    against: tuple[str, ...]
    maps: bool = False

    @property
    def name(self) -> str:
        """Of its files."""
        words = (self.part, self.framing, self.technique)
        return "-".join(words).replace("/", "-").replace(":", "-").replace("=", "")


def checked(options: Options) -> None:
    """InputError where a number of the sweep cannot be."""
    low, high = min(options.thresholds), max(options.thresholds)
    if low < 0 or high > 0.5:
        raise InputError(f"thresholds are from {low:g} to {high:g}; expected from 0 to 0.5")
    if min(options.bases) < 2 or max(options.bases) + max(options.extras) > 256:
        raise InputError("expected base samples of 2 or more, with the extra ones at most 256")
    if min(options.extras) < 1:
        raise InputError(f"extra samples are {min(options.extras)}; expected 1 or more")
    if len(chosen([options.converged])) != 1:
        raise InputError("expected one technique to compare to")


def tasks(framings: Sequence[str], parts: Sequence[str], options: Options) -> list[Task]:
    """All that is measured, view by view."""
    both = (THIRTY, options.converged)
    listed: list[Task] = []
    for framing in framings:
        if "ladder" in parts:
            rungs = [f"golubev:samples={count}" for count in LADDER]
            listed += [Task("ladder", framing, rung, both, True) for rung in rungs]
        if "contrast" in parts:
            for technique in ("golubev:samples=12", "golubev_plus"):
                listed.append(Task("contrast", framing, technique, both, True))
        if "sweep" in parts:
            grid = [
                f"golubev_plus:base_samples={b}:samples={b + e}:offset={round(0.5 - t, 4):g}"
                for b in options.bases
                for e in options.extras
                for t in options.thresholds
            ]
            own = (options.converged,)
            listed += [Task("sweep", framing, text, own) for text in (*options.beside, *grid)]
    if "angles" in parts:
        for framing in framings:
            for angle in ANGLES:
                for technique in ("golubev", "golubev_plus", "subdermal"):
                    view = f"{framing}/{angle}"
                    maps = technique == "golubev"
                    listed.append(Task("angles", view, technique, (options.converged,), maps))
    return listed


def run(
    scene: str | Path,
    patch: dict,
    listed: Sequence[Task],
    options: Options,
    distances: Distances,
    folder: Path,
) -> Iterator[tuple[int, Task, list[dict]]]:
    """(number done, task, its rows) of all tasks, as soon as each is measured or as it was kept."""
    table = merge(load_table(scene), patch)
    (folder / "records").mkdir(parents=True, exist_ok=True)
    (folder / "maps").mkdir(exist_ok=True)
    asked = {task: _asked(table, task, options) for task in listed}
    done, waiting = 0, {}
    for task in listed:
        rows = _record(folder, task, asked[task])
        if rows is None:
            waiting.setdefault(task.framing, []).append(task)
        else:
            done += 1
            yield done, task, rows
    for name, frame, lights in framed(scene, table, list(waiting), options) if waiting else ():
        goals: dict[str, np.ndarray] = {}
        skin = regions(frame, lights, options)["skin"]
        if not skin.any():
            raise InputError(f"{name}: no output pixel is all skin; expected a larger image")
        for task in waiting[name]:
            for text in task.against:
                if text not in goals:
                    (goal,) = chosen([text]).values()
                    goals[text] = picture(frame, goal, cached(table, name, goal, options))
            rows = _measured(frame, task, goals, skin, options, distances, folder)
            file = _file(folder, asked[task])
            with replacing(file) as part:
                part.write_text(json.dumps({"asked": asked[task], "rows": rows}, default=str))
            done += 1
            yield done, task, rows


def _asked(table: dict, task: Task, options: Options) -> dict:
    """All that a record depends on."""
    made = {text: chosen([text]) for text in (task.technique, *task.against)}
    pictures = [
        drawn_from(table, task.framing, technique, options)
        for text in made
        for technique in made[text].values()
    ]
    ours = digest("stimuli.experiment.chapter")
    return {"task": [task.part, task.framing, task.technique, list(task.against)], "ours": ours} | {
        "pictures": pictures
    }


def _file(folder: Path, asked: dict) -> Path:
    return folder / "records" / f"{key(asked)}.json"


def _record(folder: Path, task: Task, asked: dict) -> list[dict] | None:
    """The rows of a record, None where there is none."""
    file = _file(folder, asked)
    if not file.is_file() or (task.maps and not _maps(folder, task).is_file()):
        return None
    try:
        return json.loads(file.read_text())["rows"]
    except (ValueError, KeyError, TypeError):
        return None  # not ours, or cut short by another program: measured again


def _maps(folder: Path, task: Task) -> Path:
    return folder / "maps" / f"{task.name}.npz"


def _measured(frame, task, goals, skin, options, distances, folder) -> list[dict]:
    (technique,) = chosen([task.technique]).values()
    with frame.scatter(technique) as target:
        light, info = target.textures
        image = frame.develop(light, technique, rounded=False)
        info = info.read()
    counts, contrast = info[..., 0], info[..., 1] * technique.measures_contrast
    on = counts > 0
    framing, _, angle = task.framing.partition("/")
    rows, maps = [], {}
    for text in task.against:
        goal = goals[text]
        window = (slice(None),) * 2 if task.maps else _about(skin)
        both = eight_bit(goal)[window], eight_bit(image)[window]
        kinds = {name: distance(*both) for name, distance in distances.items()}
        taps = [t.samples * t.frames for t in chosen([text]).values() if hasattr(t, "samples")]
        for region, where in (("mask", skin), ("image", np.ones_like(skin)))[: 1 + task.maps]:
            row = {
                "part": task.part,
                "framing": framing,
                "angle": angle or "own",
                "technique": task.technique,
                "samples": float(counts[on].mean()),
                "output_samples": float(counts[on].mean()) * options.supersample**2,
                "all_samples": float(counts[on].sum()),
                "computed_pixels": int(on.sum()),
                "against": text,
                "against_output_samples": taps[0] * options.supersample**2 if taps else 0,
                "region": region,
                "rmse": rms(image - goal, where),
            }
            rows.append(row | {k: float(one[where[window]].mean()) for k, one in kinds.items()})
        maps[f"dssim {text}"] = kinds["dssim"] if "dssim" in kinds else kinds[min(kinds)]
    if task.maps:
        _keep(_maps(folder, task), image, pooled(contrast, options.supersample), skin, maps, goals)
    return rows


def _about(where: np.ndarray) -> tuple[slice, slice]:
    """The part of a picture that holds `where` and what a map of distance there looks at."""
    window = []
    for axis, side in enumerate(where.shape):
        on = np.flatnonzero(where.any(axis=1 - axis))
        window.append(slice(max(on[0] - MARGIN_PX, 0), min(on[-1] + 1 + MARGIN_PX, side)))
    return window[0], window[1]


def _keep(file: Path, image, contrast, skin, maps: Mapping[str, np.ndarray], goals) -> None:
    """A picture, its maps and the pictures that it is compared to, small enough to be shown."""
    kept = {f"map {name}": _smaller(one) for name, one in maps.items()}
    kept["contrast"] = _smaller(contrast)
    kept["skin"] = _smaller(skin * 1.0)
    kept["image"] = _levels(image)
    for text in goals:
        kept[f"goal {text}"] = _levels(goals[text])
    with replacing(file) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **kept)


def _levels(image: np.ndarray) -> np.ndarray:
    return np.rint(255 * image).astype(np.uint8)


def _smaller(values: np.ndarray) -> np.ndarray:
    """Means over blocks of pixels, at most MAP_PX wide: (h, w) float32."""
    block = max(1, -(-values.shape[1] // MAP_PX))
    height, width = (side // block * block for side in values.shape)
    return pooled(values[:height, :width], block).astype(np.float32)


def kept_maps(folder: Path, task: Task) -> Mapping[str, np.ndarray]:
    """What `run` kept of a task with maps."""
    with np.load(_maps(folder, task)) as file:
        return {name: file[name] for name in file.files}


def front(rows: Sequence[dict], cost: str, error: str) -> list[bool]:
    """Which rows no other one beats: fewer of one and no more of the other."""
    at = np.array([[row[cost], row[error]] for row in rows], float).reshape(-1, 2)
    no_worse = (at[None] <= at[:, None]).all(axis=2)
    better = (at[None] < at[:, None]).any(axis=2)
    return (~(no_worse & better).any(axis=1)).tolist()


def table_41(rows: Sequence[dict]) -> list[dict]:
    """Table 4.1 from measured samples, the mean over angles, beside the published one."""
    made = []
    mine = [r for r in rows if r["part"] == "angles" and r["region"] == "mask"]
    for framing in dict.fromkeys(r["framing"] for r in mine):
        here = [r for r in mine if r["framing"] == framing]

        def mean(technique: str, column: str, here=here) -> float:
            return float(np.mean([r[column] for r in here if r["technique"] == technique]))

        published = PUBLISHED.get(framing, (float("nan"),) * 2)
        first = mean("golubev", "all_samples")
        for technique, paper in zip(
            ("golubev", "golubev_plus", "subdermal"), (*published, float("nan")), strict=True
        ):
            total = mean(technique, "all_samples")
            made.append(
                {
                    "framing": framing,
                    "technique": technique,
                    "all_samples": total,
                    "saved_percent": 100 * (1 - total / first),
                    "samples": mean(technique, "samples"),
                    "output_samples": mean(technique, "output_samples"),
                    "published_all_samples": paper,
                    "published_saved_percent": 100 * (1 - paper / published[0]),
                    "rmse": mean(technique, "rmse"),
                    "dssim": mean(technique, "dssim"),
                }
            )
    return made


def lines_41(rows: Sequence[dict]) -> list[str]:
    """Table 4.1 in words, nothing where it was not measured."""
    table = table_41(rows)
    lines = [
        "table 4.1, mean of three angles: framing, technique, samples of the picture, saved "
        "(published)"
    ]
    for row in table:
        paper = row["published_saved_percent"]
        published = f" ({paper:.0f} %)" if np.isfinite(paper) else ""
        lines.append(
            f"  {row['framing']:<12} {row['technique']:<14} {row['all_samples']:>13,.0f} "
            f"{row['saved_percent']:>6.1f} %{published}"
        )
    return lines if table else []


def write_csv(rows: Sequence[Mapping[str, Any]], file: Path) -> None:
    """Rows as CSV, whole or not at all; six digits."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
    with replacing(file) as part:
        part.write_text(text.getvalue(), encoding="utf-8")


def busiest(values: np.ndarray, size: tuple[int, int]) -> tuple[int, int]:
    """(row, column) where a window of size (height, width) has the largest sum of values."""
    sums = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0, dtype=float).cumsum(axis=1)
    h, w = (min(one, side) for one, side in zip(size, values.shape))
    window = sums[h:, w:] - sums[:-h, w:] - sums[h:, :-w] + sums[:-h, :-w]
    return tuple(int(k) for k in np.unravel_index(np.argmax(window), window.shape))


def save_png(image: np.ndarray, file: Path) -> None:
    with replacing(file) as part:
        Image.fromarray(image).save(part, format="PNG", optimize=True)
