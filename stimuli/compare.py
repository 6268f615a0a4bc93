"""Techniques beside the truth: how far each is from `reference`, or from another technique, where,
and how it looks.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from analysis.files import replacing
from stimuli.errors import InputError
from stimuli.scenes import load_table, merge, read_scene, stage
from stimuli.strip import parse_crop as parse_crop

#: Maps (H, W) of the difference of two images (H, W, 3) in [0, 1], sRGB, the truth first.
Distances = Mapping[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]
FEWEST = 64  # output pixels of a region of which anything is said
COLOUR_MAP = "viridis"  # even steps of lightness: matplotlib's
GAP_PX, BAND_PX, BAR_PX = 4, 42, 40
BACKGROUND, INK = (24, 24, 26), (236, 236, 236)


@dataclass(frozen=True)
class Options:
    """size (width, height) of the images; crop (x, y, width, height) in them, None for all;
    walks: of the reference, a computed pixel; pool_mm, light, index: see there; within_mm: of a
    shadow's edge; thin_mm: what is thin.
    """

    size: tuple[int, int] = (960, 540)
    supersample: int = 1
    crop: tuple[int, int, int, int] | None = None
    walks: int = 64
    pool_mm: float = 0.0
    light: str = "given"
    index: float = 0.0
    seed: int = 0
    within_mm: float = 3.0
    thin_mm: float = 8.0


@dataclass(frozen=True)
class Row:
    """A technique in a region of a framing.

    rmse: of the scattered light against the truth's, R, G, B, as a share of the strongest lamp's
    irradiance, the truth's noise removed; error: its standard error (both
    renderer.reference.estimate.rms_error); ratio: of the mean light to the truth's; distances:
    means over the region to an image of half of the walks and to one of all, by name.
    """

    framing: str
    technique: str
    region: str
    pixels: int
    rmse: tuple[float, float, float]
    error: tuple[float, float, float]
    ratio: tuple[float, float, float]
    distances: dict[str, tuple[float, float]]

    def cells(self) -> dict[str, Any]:
        """The row of the table, by column."""
        cells = {k: getattr(self, k) for k in ("framing", "technique", "region", "pixels")}
        for name in ("rmse", "error", "ratio"):
            cells |= {f"{name}_{c}": v for c, v in zip("rgb", getattr(self, name), strict=True)}
        for name, (half, whole) in self.distances.items():
            cells |= {f"{name}_half": half, name: whole}
        return cells


@dataclass(frozen=True)
class Shot:
    """A framing: images (H, W, 3) uint8 of the crop by technique, the truth's under the name
    `truth`, another one of half of its walks; noise (3,): standard error of its light, of a
    computed pixel, in the unit of Row.rmse; residual (3,) and layered: see
    renderer.reference.estimate.Walked. Where the truth is a technique, half is its image, and noise
    and residual are 0.
    """

    framing: str
    truth: str
    images: dict[str, np.ndarray]
    half: np.ndarray
    rows: tuple[Row, ...]
    noise: np.ndarray
    residual: np.ndarray
    layered: bool


def chosen(specifications: Sequence[str]) -> dict[str, Any]:
    """Techniques by "all" or NAME:KEY=VALUE:..., values in JSON or as text; else InputError."""
    import renderer

    techniques: dict[str, Any] = {}
    for text in specifications:
        if text == "all":
            techniques |= {n: renderer.make(n) for n in renderer.TECHNIQUES if n != "reference"}
            continue
        name, *settings = text.split(":")
        parameters = {}
        for setting in settings:
            key, equals, value = setting.partition("=")
            if not equals:
                raise InputError(f"the technique is {text!r}; expected NAME or NAME:KEY=VALUE")
            try:
                parameters[key] = json.loads(value)
            except ValueError:
                parameters[key] = value
        if name == "reference":
            raise InputError("reference is what techniques are compared to; expected another one")
        label = " ".join([name, *settings])
        techniques[label] = renderer.make(name, parameters)
    return techniques


def compare(
    scene: str | Path,
    patch: dict,
    framings: Sequence[str],
    techniques: Mapping[str, Any],
    options: Options,
    distances: Distances,
    against: Mapping[str, Any] | None = None,
    executor: Executor | None = None,
    advance: Callable[[str], None] = lambda _: None,
) -> list[Shot]:
    """Every technique at every framing ("": the scene's own camera), beside the reference, or
    beside the one technique that is named in `against`. executor: walks for the reference;
    advance: called after each technique with its framing and name.
    """
    table = merge(load_table(scene), patch)
    return [
        _shot(name, frame, lights, techniques, options, distances, against, advance)
        for name, frame, lights in framed(scene, table, framings, options, executor)
    ]


def framed(
    scene: str | Path,
    table: dict,
    framings: Sequence[str],
    options,
    executor: Executor | None = None,
) -> Iterator[tuple[str, Any, list]]:
    """Each framing ("": the scene's own camera; FRAMING/ANGLE: from another side) of a scene's
    table, its frame while it is open, and the scene's lamps. options: its size, supersample and
    seed; InputError where nothing scatters.
    """
    import renderer
    from renderer.scene import graph as graphs

    scenes = {}
    for framing in framings:
        scenes[framing or "own camera"] = read_scene(_at(table, framing))
    staged = stage(next(iter(scenes.values())), options.seed)
    lights = graphs.contents(staged.graph).lights
    with renderer.Renderer(
        staged.graph,
        size=options.size,
        supersample=options.supersample,
        seed=options.seed,
        executor=executor,
    ) as drawing:
        if not drawing.media:
            raise InputError(f"{scene}: nothing scatters in it; expected a material with a medium")
        for name, definition in scenes.items():
            with drawing.frame(definition.camera, definition.picture) as frame:
                yield name, frame, lights


def _at(table: dict, framing: str) -> dict:
    """A scene's table with the camera at FRAMING or FRAMING/ANGLE, a name or degrees of yaw."""
    name, _, angle = framing.partition("/")
    level = {"framing": name} if name else {}
    if not angle:
        return merge(table, {"camera": level})
    try:
        level["yaw_deg"] = float(angle)
    except ValueError:
        level["angle"] = angle
    own = {k: v for k, v in table.get("camera", {}).items() if k not in ("yaw_deg", "angle")}
    return {**table, "camera": {**own, **level}}


def _shot(
    framing, frame, lights, techniques, options: Options, distances: Distances, against, advance
) -> Shot:
    from renderer import make
    from renderer.reference.estimate import rms_error

    s, (left, top, width, height) = options.supersample, _crop(options)
    window = (slice(top, top + height), slice(left, left + width))
    wide = tuple(slice(part.start * s, part.stop * s) for part in window)
    frame.renderer.context.make_current()
    own = {name: getattr(options, name) for name in ("walks", "pool_mm", "seed", "light", "index")}
    label, truth = next(iter((against or {"reference": make("reference", own)}).items()))
    inside = np.zeros((frame.height, frame.width), bool)
    inside[wide] = True
    halves, scatters, regions, residual, layered = _truth(frame, truth, lights, inside, options)
    if not scatters.any():
        raise InputError(f"{framing}: nothing that scatters is seen in the crop; expected some")
    own = frame.surface.textures[0].read()[..., :3]
    albedo = np.maximum(frame.surface.textures[2].read()[..., :3], 1e-6)
    strongest = np.max([light.irradiance for light in lights], axis=0) if lights else 0
    unit = np.where(strongest > 0, strongest, own[scatters].mean(axis=0))
    unit = np.where(unit > 0, unit, 1.0)  # a colour of which there is no light at all
    means = np.stack([pooled(half, s)[window] for half in halves])
    masks = {name: pooled(mask * 1.0, s)[window] == 1 for name, mask in regions.items()}
    masks = {name: mask for name, mask in masks.items() if mask.sum() >= FEWEST}
    if against:  # developed as it is, with the albedo that it has taken in
        with frame.scatter(truth) as target:
            half = frame.develop(target.textures[0], truth)[window]
        images = {label: half}
    else:
        images = {label: _developed(frame, halves.mean(axis=0), truth)[window]}
        half = _developed(frame, halves[0], truth)[window]
    truths, rows = (half, images[label]), []
    for name, technique in techniques.items():
        if name == label:
            continue
        with frame.scatter(technique) as target:
            light = _bare(target, albedo, technique)
            images[name] = frame.develop(target.textures[0], technique)[window]
        light = pooled(light, s)[window]
        maps = {
            key: tuple(distance(_unit(other), _unit(images[name])) for other in truths)
            for key, distance in distances.items()
        }
        for region, mask in masks.items():
            rmse, error = rms_error(light[mask] / unit, means[:, mask] / unit)
            ratio = _ratio(light[mask].mean(axis=0), means.mean(axis=0)[mask].mean(axis=0))
            measures = {k: tuple(float(m[mask].mean()) for m in both) for k, both in maps.items()}
            numbers = [tuple(map(float, part)) for part in (rmse, error, ratio)]
            rows.append(Row(framing, name, region, int(mask.sum()), *numbers, measures))
        advance(f"{framing} {name}")
    noise = np.sqrt(((halves[0] - halves[1])[scatters] ** 2).mean(axis=0)) / 2 / unit
    return Shot(framing, label, images, half, tuple(rows), noise, residual, layered)


def _ratio(light: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """light over truth (C,), 1 where neither has any."""
    return np.divide(light, truth, out=np.where(light > 0, np.inf, 1.0), where=truth > 0)


def _bare(target, albedo: np.ndarray, technique) -> np.ndarray:
    """Scattered light (H, W, 3) without the albedo that a technique has taken in."""
    return target.textures[0].read()[..., :3] / albedo**technique.texturing


def _crop(options: Options) -> tuple[int, int, int, int]:
    width, height = options.size
    if options.crop is None:
        return 0, 0, width, height
    x, y, w, h = options.crop
    if x + w > width or y + h > height or min(w, h) < 11:
        raise InputError(
            f"the crop {w}x{h}+{x}+{y} does not fit; expected 11 pixels a side or more, inside "
            f"{width}x{height}"
        )
    return options.crop


def _truth(frame, truth, lights, inside: np.ndarray, options: Options):
    """halves (2, H, W, 3) of scattered light, where it is (H, W), regions, residual, layered."""
    from renderer.reference import places
    from renderer.reference.walk import Solid
    from renderer.techniques.reference import medium_of, part_of, visible

    surfaces = frame.renderer.surfaces
    everything = Solid([part_of(drawn) for drawn in (*surfaces.surfaces, *surfaces.eyes)])
    halves = np.repeat(frame.surface.textures[0].read()[None, ..., :3].astype(float), 2, axis=0)
    shape = inside.shape
    names = ("skin", "shadow edges", "back-lit")
    regions = {name: np.zeros(shape, bool) for name in names}
    residual, layered = np.zeros(3), False
    walks = truth.domain == "walks"
    if not walks:
        albedo = np.maximum(frame.surface.textures[2].read()[..., :3], 1e-6)
        with frame.scatter(truth) as target:
            light = _bare(target, albedo, truth)
    for number in range(1, len(frame.renderer.media) + 1):
        inputs = frame.inputs(False, medium=number)
        where = (inputs.irradiance.read()[..., 3] > 0.5) & inside
        if not where.any():
            continue
        halves[:, where] = truth.halves(inputs, where).values if walks else light[where]
        if walks:
            medium = medium_of(inputs.room, options.index)
            residual, layered = np.maximum(residual, medium.residual), layered or medium.layered
        solid = Solid([part_of(drawn) for drawn in inputs.room.surfaces])
        depths = inputs.depths.read()[..., 0]
        points, normals, seen = visible(solid, inputs.room.camera, depths, where)
        where[where] = seen
        at = (points[seen], normals[seen])
        regions["skin"] |= where
        regions["shadow edges"] |= places.near_shadow_edges(
            everything, lights, *at, where, depths, inputs.pixels_per_mm, options.within_mm
        )
        regions["back-lit"][where] = places.back_lit(
            everything, solid, lights, *at, options.thin_mm
        )
    return halves, regions["skin"], regions, residual, layered


def pooled(values: np.ndarray, s: int) -> np.ndarray:
    """Means over s x s computed pixels: of output pixels."""
    height, width = values.shape[:2]
    return values.reshape(height // s, s, width // s, s, *values.shape[2:]).mean(axis=(1, 3))


def _developed(frame, light: np.ndarray, truth) -> np.ndarray:
    """The image of scattered light (H, W, 3), as a technique's is made."""
    from renderer import gl

    ids = frame.surface.textures[0].read()[..., 3:]
    data = np.concatenate([light, ids], axis=2).astype(np.float32)[::-1]
    texture = gl.Texture(frame.width, frame.height, gl.GL.GL_RGBA32F, data=data)
    try:
        return frame.develop(texture, truth)
    finally:
        texture.delete()


def _unit(image: np.ndarray) -> np.ndarray:
    return image.astype(np.float32) / 255


def write_table(shots: Sequence[Shot], file: Path) -> None:
    """The rows of all shots as CSV, whole or not at all."""
    rows = [row.cells() for shot in shots for row in shot.rows]
    text = io.StringIO()
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    for row in rows:
        short = {k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()}
        writer.writerow(short)
    with replacing(file) as part:
        part.write_text(text.getvalue(), encoding="utf-8")


def colour_difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """CIEDE2000 of two images (H, W, 3) uint8 sRGB: (H, W); 1 is about what can just be told."""
    from skimage.color import deltaE_ciede2000, rgb2lab

    return deltaE_ciede2000(rgb2lab(_unit(one)), rgb2lab(_unit(other)))


def coloured(values: np.ndarray, top: float) -> np.ndarray:
    """A map (h, w) over the colour map, 0 to top and all above it: (h, w, 3) uint8."""
    from matplotlib import colormaps

    return (255 * colormaps[COLOUR_MAP](values / top)[..., :3]).astype(np.uint8)


def sheet(shot: Shot, columns: int = 4, zoom: int = 1) -> Image.Image:
    """Every technique over its difference to the truth, all in one colour map; labelled.

    The last cell is the truth; below it, what half of its walks differ from all: its noise.
    """
    from matplotlib import colormaps

    truth = shot.images[shot.truth]
    maps = {
        name: colour_difference(truth, shot.half if name == shot.truth else image)
        for name, image in shot.images.items()
    }
    others = [maps[name] for name in maps if name != shot.truth]
    top = max(1.0, float(np.ceil(np.quantile(np.stack(others), 0.995)))) if others else 1.0
    order = [name for name in shot.images if name != shot.truth] + [shot.truth]
    height, width = (side * zoom for side in truth.shape[:2])
    columns = min(columns, len(order))
    lines = -(-len(order) // columns)
    cell = (width + GAP_PX, BAND_PX + 2 * height + 2 * GAP_PX)
    page = Image.new("RGB", (columns * cell[0] - GAP_PX, lines * cell[1] + BAR_PX), BACKGROUND)
    draw, font = ImageDraw.Draw(page), ImageFont.load_default(15)
    colours = colormaps[COLOUR_MAP]
    for k, name in enumerate(order):
        x, y = k % columns * cell[0], k // columns * cell[1]
        below = "its noise" if name == "reference" else "mean"
        for line, words in enumerate((name, f"{below} dE {maps[name].mean():.2f}")):
            while len(words) > 1 and draw.textlength(words, font=font) > width:
                words = f"{words[:-2]}…"
            place = (x + width / 2, y + BAND_PX * (0.28 + 0.46 * line))
            draw.text(place, words, font=font, fill=INK, anchor="mm")
        shown = (shot.images[name], coloured(maps[name], top))
        for row, picture in enumerate(shown):
            tile = Image.fromarray(picture).resize((width, height), Image.Resampling.NEAREST)
            page.paste(tile, (x, y + BAND_PX + row * (height + GAP_PX)))
    _bar(page, draw, font, colours, top, lines * cell[1], shot.truth)
    return page


def _bar(page, draw, font, colours, top: float, y: int, truth: str) -> None:
    """The colour map with its numbers, at the foot of a page."""
    words = f"CIEDE2000 to {'the ' if truth == 'reference' else ''}{truth}"
    start = int(draw.textlength(words, font=font)) + 24
    draw.text((8, y + BAR_PX / 2), words, font=font, fill=INK, anchor="lm")
    span = max(32, min(400, page.width - start - 60))
    ramp = (255 * colours(np.linspace(0, 1, span))[None, :, :3]).astype(np.uint8)
    page.paste(Image.fromarray(np.repeat(ramp, 12, axis=0)), (start + 18, y + BAR_PX // 2 - 6))
    draw.text((start + 12, y + BAR_PX / 2), "0", font=font, fill=INK, anchor="rm")
    draw.text((start + 24 + span, y + BAR_PX / 2), f"{top:g}", font=font, fill=INK, anchor="lm")
