"""What an image costs and how far it is from the reference, beside how real people found it.

Measures stand in the manifest, one table an image: `"measures": {"samples_per_pixel": 14.2,
"milliseconds": 3.1, "dssim": 0.004}`. DSSIM and FLIP to a reference are computed from the images
themselves where the study has a condition of that name and the files are there. What is not in the
manifest is said and never made up: a technique's parameters are no measurement.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from analysis.codebook import Codebook
from analysis.conclusions import listed
from analysis.errors import InputError

#: Measure -> what it is called, with its unit. Less of each is better or cheaper.
MEASURES = {
    "samples_per_pixel": "samples a scattering pixel",
    "milliseconds": "milliseconds an image",
    "dssim": "DSSIM to the reference",
    "flip": "FLIP to the reference",
}
REFERENCE = "reference"


@dataclass(frozen=True)
class Measured:
    """table: framing, technique, measure, value, source; notes: what is not there, and why."""

    table: pd.DataFrame
    notes: tuple[str, ...]


def read_measures(path: str | Path, reference: str = REFERENCE) -> Measured:
    """The measures of a manifest.json (or of the folder that holds it), distances to the condition
    `reference` among them.
    """
    path = Path(path)
    path = path / "manifest.json" if path.is_dir() else path
    try:
        images = json.loads(path.read_bytes()).get("images")
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read: {error.strerror}; expected a study's manifest.json"
        ) from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {' '.join(str(error).split())}") from None
    rows, notes = [], []
    images = [one for one in images or [] if isinstance(one, dict)]
    for place, image in enumerate(images):
        measures = image.get("measures") or {}
        if not isinstance(measures, dict):
            raise InputError(
                f"{path}: images[{place}].measures is {measures!r:.60}, expected a table of numbers"
            )
        for name, value in measures.items():
            if name not in MEASURES:
                raise InputError(
                    f"{path}: images[{place}].measures names {name!r}, expected one of "
                    f"{', '.join(MEASURES)}"
                )
            if (
                isinstance(value, bool)
                or not isinstance(value, int | float)
                or not 0 <= value < float("inf")
            ):
                raise InputError(
                    f"{path}: images[{place}].measures.{name} is {value!r:.60}, expected a "
                    "number from 0"
                )
            rows.append(
                (image.get("framing"), image.get("technique"), name, float(value), "manifest")
            )
    held = sorted({name for _, _, name, _, _ in rows})
    if wanted := [name for name in DISTANCES if name not in held]:
        found, why = _to_reference(path.parent, images, reference, wanted)
        rows += found
        notes += why
    for name in held:
        missing = len(images) - sum(row[2] == name for row in rows)
        if missing:
            notes.append(
                f"{missing} of {len(images)} images in the manifest have no {MEASURES[name]}."
            )
    absent = [
        MEASURES[name]
        for name in MEASURES
        if name not in {row[2] for row in rows} and name not in DISTANCES
    ]
    if absent:
        notes.append(f"The manifest holds no {' and no '.join(absent)}; nothing is said of that.")
    return Measured(
        pd.DataFrame(rows, columns=["framing", "technique", "measure", "value", "source"]),
        tuple(notes),
    )


def _to_reference(
    folder: Path, images: list[dict], reference: str, wanted: list[str]
) -> tuple[list[tuple], list[str]]:
    """The `wanted` distances of every image to the reference of its framing."""
    references = {
        image.get("framing"): image for image in images if image.get("technique") == reference
    }
    if not references:
        return [], [
            f"No condition is called {reference!r}, so that no image is compared to a reference."
        ]
    if not all((folder / str(image.get("file"))).is_file() for image in images):
        return [], [
            "The images are not beside the manifest, so that none is compared to the reference."
        ]
    from PIL import Image

    def pixels(image: dict) -> np.ndarray:
        file = image.get("file")
        try:
            with Image.open(folder / str(file)) as picture:
                return np.asarray(picture.convert("RGB"), np.float32) / 255
        except OSError as error:
            raise InputError(f"{folder / str(file)}: cannot be read as an image: {error}") from None

    rows, notes = [], []
    for framing, chosen in references.items():
        against = pixels(chosen)
        for image in images:
            if image.get("framing") == framing and image.get("technique") != reference:
                other = pixels(image)
                if other.shape != against.shape:
                    notes.append(
                        f"{image.get('technique')} at {framing} differs in size from the "
                        "reference and is not compared."
                    )
                    continue
                rows += [
                    (
                        framing,
                        image.get("technique"),
                        name,
                        DISTANCES[name](against, other),
                        "images",
                    )
                    for name in wanted
                ]
    return rows, notes


def dssim(x: np.ndarray, y: np.ndarray) -> float:
    """(1 - SSIM)/2 of the luma of two images (H, W, 3) in [0, 1], sRGB: 0 for the same one, at most
    1.

    Mean SSIM in an 11 x 11 Gaussian window of 1.5 pixels with K1 = 0.01 and K2 = 0.03, where the
    window lies inside the image (Wang et al. 2004, "Image quality assessment: from error visibility
    to structural similarity", doi:10.1109/TIP.2003.819861, eq. 13), by scikit-image.
    """
    from skimage.metrics import structural_similarity

    if min(x.shape[:2]) < 11:
        raise InputError(
            f"an image of {x.shape[1]} x {x.shape[0]} pixels is too small for DSSIM, expected "
            "11 x 11 or more"
        )
    one, other = (np.asarray(image, float) @ LUMA for image in (x, y))
    similarity = structural_similarity(
        one,
        other,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        K1=0.01,
        K2=0.03,
    )
    return float((1 - similarity) / 2)


def flip(x: np.ndarray, y: np.ndarray) -> float:
    """Mean FLIP of two images (H, W, 3) in [0, 1], sRGB: 0 for the same one, at most 1; x is the
    reference.

    Andersson et al. 2020, "FLIP: a difference evaluator for alternating images",
    doi:10.1145/3406183, by its authors' package, at their 67 pixels a degree.
    """
    import flip_evaluator

    return float(
        flip_evaluator.evaluate(
            np.ascontiguousarray(x, np.float32),
            np.ascontiguousarray(y, np.float32),
            "LDR",
            applyMagma=False,
        )[1]
    )


#: Distances to the reference that are computed from the images.
DISTANCES = {"dssim": dssim, "flip": flip}
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
    said = []
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
        said.append(words + ".")
    return said + list(notes)
