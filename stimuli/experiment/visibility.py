"""Which pairs of a study people can tell apart, predicted before anybody is asked.

Each image is taken as the page shows it (region, size, screen) and compared by ColorVideoVDP
(Mantiuk et al. 2024, "ColorVideoVDP: A visual difference predictor for image, video and display
distortions", doi:10.1145/3658144; package cvvdp, MIT) and by FLIP at the screen's pixels a degree.
A metric of visibility is not one of realism: that two images can be told apart says nothing of
which looks more real.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from PIL import Image

from analysis.files import replacing
from analysis.manifest import NAME, VISIBILITY
from renderer.optics.figures import pyplot, save
from stimuli.compare import parse_crop as parse_crop
from stimuli.errors import InputError
from stimuli.experiment.chapter import write_csv
from stimuli.manifest import Manifest
from stimuli.viewing import BOOSTED, Screen, Shown, shown_size

#: JOD below which a pair is warned of: 53 % of forced choices.
WARN_JOD = 0.1
IDENTICAL = 10.0  # JOD of the same image
#: Of forced choices that are right at a distance of 1 JOD: Phi(1 / SIGMA) = 0.75.
SIGMA = 1.4826

Resampled = Callable[[Image.Image, tuple[int, int]], Image.Image]


class Metric(Protocol):
    """jod(reference, other): of two images (H, W, 3) uint8 sRGB, 10 where they look the same."""

    name: str
    version: str

    def jod(self, reference: np.ndarray, other: np.ndarray) -> float: ...


class ColorVideoVDP:
    """The metric, for a screen; InputError where its package is not installed."""

    name = "ColorVideoVDP"

    def __init__(self, screen: Screen):
        try:
            import pycvvdp
            import torch
        except ImportError as error:
            raise InputError(
                f"ColorVideoVDP cannot be loaded ({error}); expected the extra visibility: "
                "`make test-visibility` installs it, or "
                "pip install --no-deps -r requirements-visibility.lock"
            ) from error
        from importlib.metadata import version

        self.version = version("cvvdp")
        photometry = pycvvdp.vvdp_display_photo_eotf(
            screen.luminance,
            contrast=screen.contrast,
            source_colorspace="sRGB",
            E_ambient=screen.ambient_lux,
        )
        geometry = pycvvdp.vvdp_display_geometry(
            (screen.width, screen.height),
            distance_m=screen.distance_mm / 1000,
            diagonal_size_inches=screen.diagonal_in,
        )
        self._metric = pycvvdp.cvvdp(
            display_photometry=photometry,
            display_geometry=geometry,
            heatmap=None,
            quiet=True,
            device=torch.device("cpu"),
        )

    def jod(self, reference: np.ndarray, other: np.ndarray) -> float:
        value, _ = self._metric.predict(other, reference, dim_order="HWC")
        return float(value)


@dataclass(frozen=True)
class Pair:
    """Two images of a cell as the page shows them.

    jod: ColorVideoVDP's, the mean of either as the reference, 10 where they look the same; flip:
    mean FLIP at the screen's pixels a degree; sha256 of both files, by which a change is noticed.
    """

    cell: str
    a: str
    b: str
    jod: float
    flip: float
    width: int
    height: int
    scale: float
    sha256_a: str
    sha256_b: str

    @property
    def apart(self) -> float:
        """How far apart, JOD."""
        return IDENTICAL - self.jod

    def cells(self) -> dict[str, Any]:
        """A row of the table."""
        from scipy.stats import norm

        told = float(norm.cdf(max(self.apart, 0.0) / SIGMA))
        return asdict(self) | {"apart_jod": self.apart, "told_apart": told}


@dataclass(frozen=True)
class Asked:
    """zoom: screen pixels an image pixel, 0: as the page begins; crop (x, y, width, height) of the
    image instead of its region of interest.
    """

    screen: Screen
    zoom: int = 0
    crop: tuple[int, int, int, int] | None = None


def screen_of(manifest: Manifest, **given: Any) -> Screen:
    """The study's screen, with what is given (None: not given) in its place."""
    own = asdict(manifest.study.viewer.screen or Screen())
    return Screen(**own | {key: value for key, value in given.items() if value is not None})


def predict(
    manifest: Manifest,
    asked: Asked,
    metric: Metric,
    flip: Callable[[np.ndarray, np.ndarray, float], float],
    resampled: Resampled,
) -> Iterator[Pair]:
    """Every pair of every cell, as soon as it is predicted."""
    study = manifest.study
    if study.viewer.modes[0] == BOOSTED:
        raise InputError(
            f"{study.name}: boosted triplets flicker, which is not predicted; expected another mode"
        )
    names = [condition.name for condition in study.techniques]
    for cell in study.cells:
        images = {name: manifest.image(cell.name, name) for name in names}
        box = _box(images[names[0]], asked.crop)
        size = (box[2] - box[0], box[3] - box[1])
        placed = shown_size(study.viewer, asked.screen, size, asked.zoom)
        shown = {name: show(one.path, box, placed, resampled) for name, one in images.items()}
        for a, b in combinations(names, 2):
            both = (shown[a], shown[b])
            jod = (metric.jod(*both) + metric.jod(*both[::-1])) / 2
            apart = flip(*(one.astype(np.float32) / 255 for one in both), asked.screen)
            yield Pair(
                cell.name,
                a,
                b,
                jod,
                apart,
                placed.width,
                placed.height,
                placed.scale,
                images[a].sha256,
                images[b].sha256,
            )


def _box(image, crop) -> tuple[int, int, int, int]:
    if crop is None:
        return image.box
    x, y, width, height = crop
    if x + width > image.width or y + height > image.height:
        raise InputError(
            f"the crop {width}x{height}+{x}+{y} does not fit; expected it inside "
            f"{image.width}x{image.height}"
        )
    return x, y, x + width, y + height


def show(path: Path, box, placed: Shown, resampled: Resampled) -> np.ndarray:
    """An image's box as it stands on the screen: (h, w, 3) uint8."""
    with Image.open(path) as picture:
        cut = picture.convert("RGB").crop(box)
    if placed.fitted:
        size = (placed.width, placed.height)
        return np.asarray(cut if cut.size == size else resampled(cut, size))
    times = int(placed.scale)
    large = np.asarray(cut).repeat(times, axis=0).repeat(times, axis=1)
    top, left = ((a - b) // 2 for a, b in zip(large.shape, (placed.height, placed.width)))
    return large[top : top + placed.height, left : left + placed.width]


def record(pairs: Sequence[Pair], metric: Metric, asked: Asked) -> dict[str, Any]:
    """What the manifest says of a prediction."""
    return {
        "metric": metric.name,
        "version": metric.version,
        "display": asdict(asked.screen),
        "zoom": asked.zoom,
        "crop": list(asked.crop) if asked.crop else None,
        "pairs": [
            {key: round(v, 5) if isinstance(v, float) else v for key, v in asdict(pair).items()}
            for pair in pairs
        ],
    }


def write(folder: Path, value: Mapping[str, Any]) -> None:
    """Put a prediction into the manifest of a study's folder, whole or not at all."""
    file = folder / NAME
    manifest = json.loads(file.read_text(encoding="utf-8"))
    manifest[VISIBILITY] = value
    with replacing(file) as part:
        part.write_text(json.dumps(manifest, indent=1, ensure_ascii=False), encoding="utf-8")


def warnings(pairs: Sequence[Pair]) -> list[str]:
    """One line where pairs are hardly told apart."""
    close = [pair for pair in pairs if pair.apart < WARN_JOD]
    if not close:
        return []
    named = ", ".join(f"{p.a}/{p.b} at {p.cell} ({p.apart:.2f})" for p in close)
    return [
        f"warning: {len(close)} of {len(pairs)} pairs are within {WARN_JOD:g} JOD as they are "
        f"shown, 53 % of forced choices: {named}"
    ]


def draw(pairs: Sequence[Pair], labels: Mapping[str, str], stem: Path) -> list[Path]:
    """The distances of every cell as a matrix, JOD as numbers: SVG, PNG and CSV."""
    plt = pyplot()
    cells = list(dict.fromkeys(pair.cell for pair in pairs))
    names = list(dict.fromkeys(name for pair in pairs for name in (pair.a, pair.b)))
    n, top = len(names), max(max(pair.apart for pair in pairs), WARN_JOD)
    across = min(3, len(cells))
    down = -(-len(cells) // across)
    size = (1.0 + across * (1.2 + 0.5 * n), 0.9 + down * (1.2 + 0.42 * n))
    figure, axes = plt.subplots(down, across, figsize=size, squeeze=False)
    for axis in axes.flat[len(cells) :]:
        axis.set_visible(False)
    for axis, cell in zip(axes.flat, cells):
        grid = np.full((n, n), np.nan)
        for pair in pairs:
            if pair.cell == cell:
                low, high = sorted((names.index(pair.a), names.index(pair.b)))
                grid[high, low] = pair.apart
        last = axis.imshow(grid, cmap="viridis", vmin=0.0, vmax=top)
        for row, column in zip(*np.nonzero(np.isfinite(grid)), strict=True):
            value = grid[row, column]
            ink = "white" if value < 0.6 * top else "black"
            weight = "bold" if value < WARN_JOD else "normal"
            text = f"{value:.2f}"
            axis.text(
                column, row, text, ha="center", va="center", color=ink, fontsize=8, weight=weight
            )
        shown = [labels.get(name, name) for name in names]
        axis.set_xticks(range(n - 1), shown[:-1], rotation=40, ha="right", fontsize=8)
        axis.set_yticks(range(1, n), shown[1:], fontsize=8)
        axis.set_xlim(-0.5, n - 1.5)
        axis.set_ylim(n - 0.5, 0.5)
        axis.grid(False)
        axis.set_title(labels.get(cell, cell), fontsize=9)
    figure.colorbar(last, ax=axes, label="JOD apart", shrink=0.8)
    figure.suptitle(
        f"Predicted by ColorVideoVDP as the page shows them; bold: within {WARN_JOD:g} JOD",
        fontsize=9,
    )
    files = [stem.with_name(f"{stem.name}.{kind}") for kind in ("svg", "png", "csv")]
    for file in files[:2]:
        save(figure, file)
    write_csv([pair.cells() for pair in pairs], files[2])
    return files
