"""What an image costs and how far it is from the reference, beside how real people found it.

Measures stand in the manifest, one table an image: `"measures": {"samples_per_pixel": 14.2,
"milliseconds": 3.1, "dssim": 0.004}`. DSSIM and FLIP to a reference are computed from the images
themselves where the study has a condition of that name and the files are there. What is not in the
manifest is said and never made up: a technique's parameters are no measurement.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from analysis.codebook import FRAMING, Codebook
from analysis.conclusions import listed
from analysis.errors import InputError
from analysis.manifest import MEASURES, ManifestFile, open_manifest, region_box

REFERENCE = "reference"
COLUMNS = ["framing", "technique", "measure", "value", "source"]


@dataclass(frozen=True)
class Measured:
    """table: framing, technique, measure, value, source; notes: what is not there, and why."""

    table: pd.DataFrame
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Image:
    """What is read of an image: `cell`, the levels of all factors that it has; `level`, that of the
    factor which answers are grouped by.
    """

    cell: tuple
    level: str
    technique: str
    file: Path
    region: tuple[float, float, float, float]
    measures: dict[str, float]

    @property
    def name(self) -> str:
        return f"{self.technique} at {', '.join(map(str, self.cell))}"


def read_measures(
    path: str | Path | ManifestFile, reference: str = REFERENCE, factor: str = FRAMING
) -> Measured:
    """The measures of a manifest.json (or of the folder that holds it), distances to the condition
    `reference` among them.

    factor: what answers are grouped by; the column `framing` holds its levels. A technique's value
    at a level is the mean over the images that it has there; an image is compared to the reference
    of its own cell, over the region of interest where it has one.
    """
    manifest = path if isinstance(path, ManifestFile) else open_manifest(path)
    images = _images(manifest, factor)
    if not images:
        label = factor.replace("_", " ")
        why = f"Images have no {label}: cost and fidelity are not set beside worths by it."
        return Measured(pd.DataFrame(columns=COLUMNS), (why,))
    rows, notes = defaultdict(list), []
    for image in images:
        for name, value in image.measures.items():
            rows[image.level, image.technique, name, "manifest"].append(float(value))
    held = sorted({name for _, _, name, _ in rows})
    if wanted := [name for name in DISTANCES if name not in held]:
        distances, notes = _to_reference(images, reference, wanted)
        rows |= distances
    for name in held:
        missing = sum(name not in image.measures for image in images)
        if missing:
            notes.append(
                f"{missing} of {len(images)} images in the manifest have no {MEASURES[name]}."
            )
    absent = [MEASURES[name] for name in MEASURES if name not in held and name not in DISTANCES]
    if absent:
        notes.append(f"The manifest holds no {' and no '.join(absent)}; nothing is said of that.")
    table = [(*key[:3], float(np.mean(values)), key[3]) for key, values in rows.items()]
    return Measured(pd.DataFrame(table, columns=COLUMNS), tuple(notes))


def _images(manifest: ManifestFile, factor: str) -> list[_Image]:
    """The images that have a level of the factor."""
    images = []
    for place, entry in enumerate(manifest.images):
        where = f"{manifest.path}: images[{place}]"
        further = entry.get("levels") or {}
        if not isinstance(further, dict):
            raise InputError(f"{where}.levels is {further!r:.60}, expected a table of levels")
        levels = {FRAMING: entry.get("framing"), **further}
        if factor in levels:
            images.append(
                _Image(
                    cell=tuple(levels[name] for name in sorted(levels, key=_framing_first)),
                    level=levels[factor],
                    technique=entry.get("technique"),
                    file=manifest.path.parent / str(entry.get("file")),
                    region=manifest.region(place),
                    measures=manifest.measures(place),
                )
            )
    return images


def _framing_first(name: str) -> tuple[bool, str]:
    return name != FRAMING, name


def _to_reference(
    images: list[_Image], reference: str, wanted: list[str]
) -> tuple[dict[tuple, list[float]], list[str]]:
    """The `wanted` distances of every image to the reference of its cell:
    (level, technique, measure, "images") -> values, one a cell.
    """
    references = {image.cell: image for image in images if image.technique == reference}
    if not references:
        return {}, [
            f"No condition is called {reference!r}, so that no image is compared to a reference."
        ]
    if not all(image.file.is_file() for image in images):
        return {}, [
            "The images are not beside the manifest, so that none is compared to the reference."
        ]
    rows, notes = defaultdict(list), []
    for cell, chosen in references.items():
        against = _pixels(chosen)
        for image in images:
            if image.cell != cell or image.technique == reference:
                continue
            other = _pixels(image)
            if other.shape != against.shape:
                notes.append(
                    f"{image.name} differs in size from the reference and is not compared."
                )
                continue
            for name in wanted:
                distance = DISTANCES[name](against, other)
                rows[image.level, image.technique, name, "images"].append(distance)
    return rows, notes


def _pixels(image: _Image) -> np.ndarray:
    """The image's region of interest, (H, W, 3) in [0, 1], sRGB."""
    from PIL import Image

    try:
        with Image.open(image.file) as picture:
            pixels = np.asarray(picture.convert("RGB"), np.float32) / 255
    except OSError as error:
        raise InputError(f"{image.file}: cannot be read as an image: {error}") from None
    height, width = pixels.shape[:2]
    left, top, right, bottom = region_box(image.region, width, height)
    return pixels[top:bottom, left:right]


def dssim(x: np.ndarray, y: np.ndarray) -> float:
    """(1 - SSIM)/2 of the luma of two images (H, W, 3) in [0, 1], sRGB: 0 for the same one, at most
    1.

    Mean SSIM in an 11 x 11 Gaussian window of 1.5 pixels with K1 = 0.01 and K2 = 0.03, where the
    window lies inside the image (Wang et al. 2004, "Image quality assessment: from error visibility
    to structural similarity", doi:10.1109/TIP.2003.819861, eq. 13), by scikit-image.
    """
    pad = WINDOW // 2
    return float(dssim_map(x, y)[pad:-pad, pad:-pad].mean())


def dssim_map(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(1 - SSIM)/2 about each pixel (H, W), see `dssim`; mirrored where the window is cut."""
    from skimage.metrics import structural_similarity

    if min(x.shape[:2]) < WINDOW:
        raise InputError(
            f"an image of {x.shape[1]} x {x.shape[0]} pixels is too small for DSSIM, expected "
            "11 x 11 or more"
        )
    one, other = (np.asarray(image, float) @ LUMA for image in (x, y))
    _, similarity = structural_similarity(
        one,
        other,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        K1=0.01,
        K2=0.03,
        full=True,
    )
    return (1 - similarity) / 2


def flip(x: np.ndarray, y: np.ndarray, pixels_per_degree: float = 67.0) -> float:
    """Mean FLIP of two images (H, W, 3) in [0, 1], sRGB: 0 for the same one, at most 1; x is the
    reference.

    Andersson et al. 2020, "FLIP: a difference evaluator for alternating images",
    doi:10.1145/3406183, by its authors' package, at their 67 pixels a degree unless told.
    """
    return float(flip_map(x, y, pixels_per_degree).mean())


def flip_map(x: np.ndarray, y: np.ndarray, pixels_per_degree: float = 67.0) -> np.ndarray:
    """FLIP of each pixel (H, W), see `flip`."""
    import flip_evaluator

    both = (np.ascontiguousarray(image, np.float32) for image in (x, y))
    own = {"ppd": pixels_per_degree}
    return flip_evaluator.evaluate(*both, "LDR", applyMagma=False, parameters=own)[0][..., 0]


#: Distances to the reference that are computed from the images, and where in them.
DISTANCES = {"dssim": dssim, "flip": flip}
MAPS = {"dssim": dssim_map, "flip": flip_map}
WINDOW = 11  # pixels a side
LUMA = np.array([0.299, 0.587, 0.114])  # Rec. 601


def against_worth(
    measured: pd.DataFrame, worths: pd.DataFrame, model: str = "thurstone_jod"
) -> pd.DataFrame:
    """framing, technique, measure, value, estimate, low, high, front: on the Pareto front, where
    less of a measure and more worth is better.
    """
    worth = worths[(worths.model == model) & worths.estimate.notna()][
        ["framing", "technique", "estimate", "low", "high"]
    ]
    table = measured.merge(worth, on=["framing", "technique"], how="inner")
    front = np.zeros(len(table), bool)
    for _, rows in table.groupby(["framing", "measure"], sort=False):
        value, estimate = rows.value.to_numpy(), rows.estimate.to_numpy()
        no_worse = (value[:, None] <= value) & (estimate[:, None] >= estimate)
        better = (value[:, None] < value) | (estimate[:, None] > estimate)
        front[table.index.get_indexer(rows.index)] = ~(no_worse & better).any(axis=0)
    return table.assign(front=front)[
        ["framing", "technique", "measure", "value", "estimate", "low", "high", "front"]
    ]


def correlations(table: pd.DataFrame) -> pd.DataFrame:
    """framing, measure, n, spearman, p: rank correlation of worth and measure; p by all
    permutations up to 8 techniques, else by t.

    NaN where all values are one, or with fewer than 4 techniques, of which no order can be
    unlikely.
    """
    rows = []
    for (framing, measure), here in table.groupby(["framing", "measure"], sort=False):
        rho = p = np.nan
        if len(here) >= 4 and here.value.nunique() > 1 and here.estimate.nunique() > 1:
            rho = float(stats.spearmanr(here.value, here.estimate).statistic)
            p = (
                _permutation(here.value.to_numpy(), here.estimate.to_numpy(), rho)
                if len(here) <= 8
                else float(stats.spearmanr(here.value, here.estimate).pvalue)
            )
        rows.append((framing, measure, len(here), rho, p))
    return pd.DataFrame(rows, columns=["framing", "measure", "n", "spearman", "p"])


def _permutation(x: np.ndarray, y: np.ndarray, rho: float) -> float:
    from itertools import permutations

    a, b = stats.rankdata(x), stats.rankdata(y)
    a, b = (a - a.mean()) / a.std(), (b - b.mean()) / b.std()
    orders = np.array(list(permutations(range(len(b)))))
    return float((np.abs(b[orders] @ a) / len(a) >= abs(rho) - 1e-12).mean())


def sentences(
    table: pd.DataFrame, correlated: pd.DataFrame, notes: tuple[str, ...], codebook: Codebook
) -> list[str]:
    """What is to be said of cost and fidelity beside worth."""
    lines = []
    for row in correlated.itertuples():
        here = table[(table.framing == row.framing) & (table.measure == row.measure)]
        where, what = codebook.framing_label(row.framing), MEASURES[row.measure]
        front = [
            codebook.label(one.technique)
            for one in here[here.front].sort_values("value").itertuples()
        ]
        words = f"{where}, {what} against worth: no other technique beats {listed(front)} in both"
        if np.isfinite(row.spearman):
            shown = f"{row.spearman:+z.2f}".replace("-", "\N{MINUS SIGN}")
            words += (
                f"; rank correlation with worth {shown} over {row.n} techniques (p = {row.p:.2f})"
            )
        lines.append(words + ".")
    return lines + list(notes)
