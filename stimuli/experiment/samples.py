"""Samples on trial: how many each technique takes, and how far its picture is from the converged.

What is converged is a technique with very many taps (Golubev's by default), not the truth: it says
what sampling costs, where `stimuli.compare` says what a kernel does.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from analysis.files import replacing
from stimuli import sources
from stimuli.compare import chosen as chosen
from stimuli.compare import framed, pooled
from stimuli.drawing import own_files
from stimuli.scenes import load_table, merge, read_scene

#: Maps (H, W) of the difference of two images (H, W, 3) in [0, 1], sRGB, the converged first.
Distances = Mapping[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]
CONVERGED = "golubev:samples=256:frames=4"
JUMP_MM = 2.0  # of depth, between neighbours
HAIR = 0.01  # of a pixel that hair may hide


@dataclass(frozen=True)
class Options:
    """size (width, height) of the images; supersample: computed pixels in a pixel, along one side;
    edges_mm: of a cast shadow's edge, jumps_mm: of a jump of depth; rotations: frames over which
    light is averaged for `bias`, 0 to leave it out; keep: whether the converged picture is cached.
    """

    size: tuple[int, int] = (1920, 1080)
    supersample: int = 2
    edges_mm: float = 2.6
    jumps_mm: float = 1.0
    rotations: int = 0
    seed: int = 0
    keep: bool = True


@dataclass(frozen=True)
class Row:
    """A technique at a framing, over skin that no hair hides.

    samples: a computed pixel of skin; output_samples: an output pixel. rmse, edges, jumps: root
    mean square difference of sRGB before it is rounded, in levels of 255: over all of it, near the
    edges of cast shadows, near jumps of depth. bias: the same, over all of it, of the mean over
    rotations, without what is left of their noise; nan where it was not asked for or the technique
    has no rotations. distances: mean maps of the rounded image by name.
    """

    framing: str
    technique: str
    pixels: int
    samples: float
    output_samples: float
    rmse: float
    edges: float
    jumps: float
    bias: float
    distances: dict[str, float]

    def cells(self) -> dict[str, Any]:
        """The row of the table, by column."""
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "distances"}
        return own | self.distances


def samples(
    scene: str | Path,
    patch: dict,
    framings: Sequence[str],
    techniques: Mapping[str, Any],
    converged: Any,
    options: Options,
    distances: Distances,
) -> Iterator[Row]:
    """A row for every technique at every framing, as soon as it is measured."""
    table = merge(load_table(scene), patch)
    for name, frame, lights in framed(scene, table, framings, options):
        goal = picture(frame, converged, cached(table, name, converged, options))
        where = regions(frame, lights, options)
        for label, technique in techniques.items():
            yield _row(name, label, frame, technique, goal, where, options, distances)


def _row(framing, label, frame, technique, goal, where, options, distances) -> Row:
    image, counts = drawn(frame, technique)
    skin = where["skin"]
    bias = float("nan")
    if options.rotations and hasattr(technique, "frames"):
        mean, _ = drawn(frame, replace(technique, frames=options.rotations))
        noise = rms(image - mean, skin) ** 2 / max(options.rotations - 1, 1)
        bias = float(np.sqrt(max(rms(mean - goal, skin) ** 2 - noise, 0.0)))
    taken = float(counts[counts > 0].mean()) if (counts > 0).any() else 0.0
    rounded = [eight_bit(one) for one in (goal, image)]
    return Row(
        framing,
        label,
        int(skin.sum()),
        taken,
        taken * options.supersample**2,
        *(rms(image - goal, where[part]) for part in ("skin", "edges", "jumps")),
        bias,
        {name: float(distance(*rounded)[skin].mean()) for name, distance in distances.items()},
    )


def eight_bit(image: np.ndarray) -> np.ndarray:
    """A picture in [0, 1] as it is shown: rounded to levels of 255, float32."""
    return np.rint(255 * image).astype(np.float32) / 255


def rms(difference: np.ndarray, where: np.ndarray) -> float:
    """Root mean square over pixels and channels, in levels of 255; nan where there are none."""
    return 255 * float(np.sqrt((difference[where] ** 2).mean())) if where.any() else float("nan")


def drawn(frame, technique) -> tuple[np.ndarray, np.ndarray]:
    """The picture (H, W, 3) sRGB in [0, 1] before it is rounded, and samples a computed pixel."""
    with frame.scatter(technique) as target:
        light, counted = target.textures
        return frame.develop(light, technique, rounded=False), counted.read()[..., 0].copy()


def drawn_from(table: dict, framing: str, technique, options) -> dict:
    """All that a picture depends on: its scene with the person and the user's files in it, view,
    technique, size, seed and source code.
    """
    return {
        "scene": table,
        "files": own_files(read_scene(table)),
        "framing": framing,
        "technique": [technique.name, technique.parameters()],
        "drawn": [options.size, options.supersample, options.seed],
        "sources": digest(type(technique).__module__),
    }


digest = lru_cache(maxsize=64)(sources.digest)  # of a module's own files: they do not change


def key(asked: dict) -> str:
    """A name for what was asked for: 32 hexadecimal digits."""
    text = json.dumps(asked, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def cached(table: dict, framing: str, technique, options) -> Path | None:
    """Where the converged picture of this scene by this technique is kept."""
    from renderer.caches import folder

    if not options.keep:
        return None
    return folder() / "converged" / f"{key(drawn_from(table, framing, technique, options))}.npy"


def picture(frame, technique, file: Path | None) -> np.ndarray:
    """The converged picture, drawn or as it was kept."""
    if file is not None and file.is_file():
        return np.load(file)
    image, _ = drawn(frame, technique)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replacing(file) as part, part.open("wb") as stream:
            np.save(stream, image)
    return image


def regions(frame, lights, options: Options) -> dict[str, np.ndarray]:
    """Output pixels (H, W): of skin, of its shadows' edges, of its jumps of depth."""
    from renderer.reference import places
    from renderer.reference.walk import Solid
    from renderer.techniques.reference import part_of, visible

    light, glossy, _, depth = (texture.read() for texture in frame.surface.textures)
    where, depths = light[..., 3] > 0.5, depth[..., 0]
    surfaces = frame.renderer.surfaces
    everything = Solid([part_of(drawn) for drawn in (*surfaces.surfaces, *surfaces.eyes)])
    camera = frame.inputs(None).room.camera
    points, normals, seen = visible(everything, camera, depths, where)
    on = where.copy()
    on[where] = seen
    pixels_per_mm = frame.view.pixels_per_mm
    edges = places.near_shadow_edges(
        everything,
        lights,
        points[seen],
        normals[seen],
        on,
        depths,
        pixels_per_mm,
        options.edges_mm,
    )
    s = options.supersample
    skin = pooled(where * 1.0, s) == 1
    skin &= pooled(glossy[..., 3], s) < HAIR
    jumps = _near_jumps(depths, pixels_per_mm, options.jumps_mm)
    near = {"edges": edges, "jumps": jumps}
    return {"skin": skin} | {k: skin & (pooled(v * 1.0, s) > 0) for k, v in near.items()}


def _near_jumps(depths: np.ndarray, pixels_per_mm: float, within_mm: float) -> np.ndarray:
    """Computed pixels (H, W) within so many mm, across the screen, of a jump of depth."""
    from scipy.ndimage import distance_transform_edt

    jumps = np.zeros(depths.shape, bool)
    for axis in (0, 1):
        one, other = [slice(None)] * 2, [slice(None)] * 2
        one[axis], other[axis] = slice(None, -1), slice(1, None)
        jump = np.abs(depths[tuple(one)] - depths[tuple(other)]) > JUMP_MM
        jumps[tuple(one)] |= jump
        jumps[tuple(other)] |= jump
    if not jumps.any():
        return jumps
    return distance_transform_edt(~jumps) * depths / pixels_per_mm <= within_mm


def write_table(rows: Sequence[Row], options: Options, file: Path) -> None:
    """The rows as CSV with the options in columns of their own, whole or not at all."""
    own = asdict(options)
    own["size"] = "{}x{}".format(*options.size)
    del own["keep"]
    cells = [row.cells() | own for row in rows]
    text = io.StringIO()
    writer = csv.DictWriter(text, cells[0], lineterminator="\n")
    writer.writeheader()
    for row in cells:
        writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
    with replacing(file) as part:
        part.write_text(text.getvalue(), encoding="utf-8")
