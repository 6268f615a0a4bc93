"""Whether a technique pops while the camera goes round: how its error changes from frame to frame.

A turntable about the subject. Of each frame the error of a technique to the converged picture of
the same frame; its change to the next frame is what flickers, and its means over tiles are what
pops: noise from pixel to pixel cancels in them, a tile that takes other taps does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from renderer.optics.figures import pyplot, save
from stimuli.compare import chosen as chosen
from stimuli.compare import framed, pooled
from stimuli.experiment.chapter import write_csv
from stimuli.experiment.figures import MARKERS, OKABE
from stimuli.experiment.samples import HAIR, drawn, rms
from stimuli.scenes import load_table, merge


@dataclass(frozen=True)
class Options:
    """size (width, height); supersample; frames of the turntable; degrees between two of them;
    first: yaw of the first; tile: output pixels of a side of what may pop.
    """

    size: tuple[int, int] = (640, 360)
    supersample: int = 2
    frames: int = 60
    degrees: float = 1.0
    first: float = 0.0
    tile: int = 4
    seed: int = 0


def turn(
    scene: str | Path,
    patch: dict,
    framing: str,
    techniques: Mapping[str, Any],
    converged: Any,
    options: Options,
) -> Iterator[dict[str, Any]]:
    """A row for every frame and technique, levels of 255 over skin that no hair hides: rmse: of
    its error; flicker: of the change of its error from the frame before, where both are skin;
    pop: the same of means over tiles; largest: of one tile. The first frame has no change: nan.
    """
    table = merge(load_table(scene), patch)
    before: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    yaws = [options.first + number * options.degrees for number in range(options.frames)]
    views = [f"{framing}/{yaw:.10g}" for yaw in yaws]
    for number, (_, frame, _) in enumerate(framed(scene, table, views, options)):
        goal, _ = drawn(frame, converged)
        light, glossy = (texture.read() for texture in frame.surface.textures[:2])
        skin = pooled((light[..., 3] > 0.5) * 1.0, options.supersample) == 1
        skin &= pooled(glossy[..., 3], options.supersample) < HAIR
        for name, technique in techniques.items():
            image, counts = drawn(frame, technique)
            error, on = image - goal, counts > 0
            row = {"frame": number, "yaw_deg": yaws[number], "technique": name}
            row["samples"] = float(counts[on].mean()) if on.any() else 0.0
            row["rmse"] = rms(error, skin)
            yield row | _change(error, skin, before.get(name), options.tile)
            before[name] = error, skin


def _change(error, skin, before, tile: int) -> dict[str, float]:
    """flicker, pop and largest of an error (H, W, 3) against that of the frame before."""
    if before is None:
        return dict.fromkeys(("flicker", "pop", "largest"), float("nan"))
    change, both = error - before[0], skin & before[1]
    height, width = (side // tile * tile for side in both.shape)
    whole = pooled(both[:height, :width] * 1.0, tile) == 1
    means = pooled(change[:height, :width], tile)
    most = 255 * float(np.abs(means[whole]).max()) if whole.any() else float("nan")
    return {"flicker": rms(change, both), "pop": rms(means, whole), "largest": most}


def summary(rows: list[dict]) -> list[dict[str, Any]]:
    """Of each technique over all frames: root mean squares, and the largest pop."""
    made = []
    for name in dict.fromkeys(row["technique"] for row in rows):
        here = [row for row in rows if row["technique"] == name]
        own = {"technique": name, "samples": float(np.mean([row["samples"] for row in here]))}
        for column in ("rmse", "flicker", "pop"):
            values = np.array([row[column] for row in here])
            values = values[np.isfinite(values)]
            own[column] = float(np.sqrt((values**2).mean())) if len(values) else float("nan")
        largest = [row["largest"] for row in here if np.isfinite(row["largest"])]
        made.append(own | {"largest": max(largest, default=float("nan"))})
    return made


def draw(rows: list[dict], stem: Path) -> list[Path]:
    """Error, flicker and pop over the turntable: SVG, PNG and CSV."""
    plt = pyplot()
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.0))
    for axis, column in zip(axes, ("rmse", "flicker", "pop")):
        for k, name in enumerate(dict.fromkeys(row["technique"] for row in rows)):
            here = [row for row in rows if row["technique"] == name]
            x, y = ([row[key] for row in here] for key in ("yaw_deg", column))
            style = {"color": OKABE[k % len(OKABE)], "marker": MARKERS[k % len(MARKERS)]}
            axis.plot(x, y, markersize=3, linewidth=1, label=name, **style)
        axis.set_xlabel("yaw, degrees")
        axis.set_ylabel(f"{column}, levels of 255")
        axis.set_ylim(bottom=0)
    axes[0].legend(fontsize=7)
    figure.suptitle("A turntable: error, and its change from frame to frame", fontsize=9)
    files = [stem.with_name(f"{stem.name}.{kind}") for kind in ("svg", "png", "csv")]
    for file in files[:2]:
        save(figure, file)
    write_csv(rows, files[2])
    return files
