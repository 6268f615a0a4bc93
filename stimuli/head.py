"""How a scan is understood, in words and a picture: front and side, with its landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from renderer.scene import Model
from renderer.scene.objects import Scan
from stimuli.errors import InputError
from stimuli.heads import load_scan
from stimuli.study import with_head

BAR_MM = 50.0
#: Views: (name, axis to the right, axis towards the eye); the head's left is +x.
VIEWS = (
    ("front", np.array([1.0, 0, 0]), np.array([0, 0, 1.0])),
    ("from its left", np.array([0, 0, -1.0]), np.array([1.0, 0, 0])),
)


ENDINGS = (".png", ".pdf", ".svg")


def understand(file: str, said: Mapping[str, Any], out: Path) -> list[str]:
    """Write the sheet of a scan's file to `out` and return what is to be said of it.

    said: see stimuli.study.with_head. Raises InputError for a file that cannot be used.
    """
    if out.suffix not in ENDINGS:
        raise InputError(f"{out}: has the suffix {out.suffix!r}; expected {', '.join(ENDINGS)}")
    table = with_head({"objects": {"head": {}}}, file, said)["objects"]["head"]
    if table.pop("shape") != "scan":
        raise InputError(f"{file}: is no file of a scan; expected .glb, .gltf, .obj, .ply or .stl")
    head = load_scan(Scan.read(table, "head"))
    known = head.provenance
    lines = [
        f"{len(head.model.surface.positions)} points; {known['mm_per_unit']:.6g} mm a unit "
        f"({known['unit']}, {known['unit_source']}); {known['up']} up ({known['up_source']}); "
        f"turned by {known['turned_deg']:g} degrees ({known['turned_source']})"
    ]
    if "face" in known:
        face = known["face"]
        lines.append(
            f"face: {face['crown_to_chin_mm']:g} mm from crown to chin; the average head fits it "
            f"to {face['error_mm']:g} mm, with {face['relief']:.0%} of its relief"
        )
    lines += head.notes
    _draw(head.model, head.name, lines, out)
    return lines


def _seen(model: Model, right, towards, left_mm, top_mm, size, step_mm) -> np.ndarray:
    """Grey (height, width) of the surface under a lamp beside the eye, nan where there is none."""
    import trimesh

    mesh = trimesh.Trimesh(model.surface.positions, model.surface.faces, process=False)
    width, height = size
    x = left_mm + step_mm * (np.arange(width) + 0.5)
    y = top_mm - step_mm * (np.arange(height) + 0.5)
    far = np.abs(mesh.bounds).max() * 2
    across, down = np.meshgrid(x, y)
    start = across[..., None] * right + down[..., None] * [0, 1.0, 0] + far * towards
    starts = start.reshape(-1, 3)
    hit = mesh.ray.intersects_first(starts, np.broadcast_to(-towards, starts.shape))
    lamp = towards + 0.5 * np.array([0, 1.0, 0]) - 0.4 * right
    shade = np.clip(np.abs(mesh.face_normals) @ np.abs(towards) * 0.4, 0, 1)
    shade += 0.6 * np.clip(mesh.face_normals @ lamp / np.linalg.norm(lamp), 0, 1)
    grey = np.where(hit >= 0, shade[hit], np.nan)
    return grey.reshape(height, width)


def _draw(model: Model, name: str, lines: list[str], out: Path, step_mm: float = 0.5) -> None:
    """Write the sheet of a model to a picture; lines: what else is said of it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    points = model.surface.positions.astype(float)
    eyes = np.asarray(model.landmarks["eyes"])
    crown = points[np.abs(points - eyes).max(axis=1) < 260][:, 1].max()
    top, bottom = crown + 25, max(points[:, 1].min() - 10, eyes[1] - 220)
    figure = Figure(figsize=(11, 7.4), dpi=120, facecolor="white", layout="none")
    FigureCanvasAgg(figure)
    colours = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"]
    for place, (title, right, towards) in enumerate(VIEWS):
        axes = figure.add_axes((0.05 + 0.47 * place, 0.22, 0.45, 0.70))
        middle = float(eyes @ right) + (0 if place == 0 else 45)
        half = 0.5 * (top - bottom) * (0.45 * 11) / (0.70 * 7.4)
        size = int(2 * half / step_mm), int((top - bottom) / step_mm)
        grey = _seen(model, right, towards, middle - half, top, size, step_mm)
        extent = (middle - half, middle + half, bottom, top)
        axes.imshow(grey, cmap="gray", vmin=0, vmax=1, extent=extent, interpolation="none")
        for index, (mark, at) in enumerate(sorted(model.landmarks.items())):
            colour = colours[index % len(colours)]
            x, y = float(np.asarray(at) @ right), float(at[1])
            if place == 1 and (mark.endswith("_r") or mark == "eyes"):
                continue  # behind the others
            axes.plot(x, y, "+", color=colour, markersize=11, markeredgewidth=1.8)
            beside = (-6, 4) if mark.endswith("_r") or (place == 1 and x < middle - 60) else (6, 4)
            axes.annotate(
                mark,
                (x, y),
                (0, -13) if mark in ("eyes", "mouth") and place == 0 else beside,
                textcoords="offset points",
                ha="center"
                if mark in ("eyes", "mouth") and place == 0
                else "right"
                if beside[0] < 0
                else "left",
                color=colour,
                fontsize=9,
                fontweight="bold",
            )
        start = middle - half + 12
        axes.plot([start, start + BAR_MM], [bottom + 12] * 2, color="black", linewidth=3)
        axes.text(start, bottom + 17, f"{BAR_MM:.0f} mm", fontsize=9)
        axes.set(title=title, xlim=extent[:2], ylim=extent[2:], xlabel="mm")
        axes.tick_params(labelsize=8)
    figure.suptitle(name, fontsize=12)
    text = "\n".join(part for line in lines for part in wrap(line, 150))
    figure.text(0.05, 0.155, text, fontsize=8.5, va="top", linespacing=1.35)
    figure.savefig(out)
