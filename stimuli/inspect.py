"""What would bias a study, found in its images before anybody is asked.

Within a cell all conditions show one scene: they should differ where light scatters and nowhere
else, and be as bright, as coloured and as noisy as each other. Pictures are looked at as they will
be shown: the framing's region, sRGB.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import combinations
from pathlib import Path

import numpy as np
from PIL import Image

from analysis.manifest import open_manifest
from renderer.scene.picture import LUMA
from stimuli.compare import coloured
from stimuli.errors import InputError
from stimuli.experiment.visibility import IDENTICAL
from stimuli.heads.formats import decode_srgb
from stimuli.manifest import MASKS, Manifest
from stimuli.manifest import Image as ShownImage

OUT = "inspection"


@dataclass(frozen=True)
class Limits:
    """Above which something is flagged.

    luminance: share by which a condition's mean luminance over the skin differs from its cell's
    mean; colour: CIEDE2000 between mean colours; clipped: share of the skin's pixels with a channel
    at 255; noise_levels and noise_ratio: a condition's noise (levels of 255, standard deviation)
    over both the first and this many times the cell's quietest; outside_levels: largest difference
    of a pair where nothing scatters; alike: CIEDE2000 that the most different hundredth of the
    skin stays below; jod: predicted distance of a pair, where the study has predictions.
    """

    luminance: float = 0.01
    colour: float = 1.0
    clipped: float = 0.002
    noise_levels: float = 0.5
    noise_ratio: float = 1.5
    outside_levels: float = 1.0
    alike: float = 1.0
    jod: float = 0.1

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, int | float) or not 0 <= value < float("inf"):
                raise InputError(f"limit {field.name} is {value!r}; expected a number from 0")


@dataclass(frozen=True)
class Picture:
    """An image of a cell, over its skin: mean luminance (linear, 1 is white), mean L*, a*, b*,
    share of clipped pixels, noise in levels.
    """

    cell: str
    technique: str
    luminance: float
    lab: tuple[float, float, float]
    clipped: float
    noise: float


@dataclass(frozen=True)
class Pair:
    """Two conditions of a cell, over its skin: mean and 99th percentile of CIEDE2000, mean absolute
    difference in levels, share of pixels three levels or more apart; largest difference in levels
    where nothing scatters (None without a mask); jod: predicted distance (None without).
    """

    cell: str
    a: str
    b: str
    colour: float
    most: float
    levels: float
    share_of_3: float
    outside: float | None
    jod: float | None
    map: str  # the file of the difference map, beside the page


@dataclass(frozen=True)
class Flag:
    """Something that would bias the study: what kind, where, in words."""

    kind: str
    cell: str
    words: str


@dataclass(frozen=True)
class Inspection:
    pictures: tuple[Picture, ...]
    pairs: tuple[Pair, ...]
    flags: tuple[Flag, ...]
    top: float  # CIEDE2000 at the end of the maps' colours


def inspect(manifest: Manifest, out: Path, limits: Limits | None = None) -> Inspection:
    """Look at every image of a study, write its difference maps into `out`, and say what to mend.

    Raises InputError for images that cannot be read.
    """
    from skimage.color import deltaE_ciede2000, rgb2lab

    limits = limits or Limits()
    labels = {one.name: one.label for one in manifest.study.techniques}
    predicted = {}
    for one in open_manifest(manifest.directory).visibility.get("pairs", ()):
        predicted[one["cell"], frozenset((one["a"], one["b"]))] = IDENTICAL - one["jod"]
    pictures, flags, found, maps = [], [], [], []
    (out / "maps").mkdir(parents=True, exist_ok=True)
    shown: dict[str, dict[str, ShownImage]] = {}
    for image in manifest.images:
        shown.setdefault(image.cell, {})[image.technique] = image
    for cell, images in shown.items():
        pixels = {name: _pixels(image) for name, image in images.items()}
        mask = _mask(manifest.directory, cell, next(iter(images.values())))
        skin = np.ones(next(iter(pixels.values())).shape[:2], bool) if mask is None else mask
        labs = {name: rgb2lab((values / 255).astype(np.float32)) for name, values in pixels.items()}
        own = [_picture(cell, name, values, labs[name], skin) for name, values in pixels.items()]
        pictures += own
        flags += _flags_of_pictures(own, limits, labels)
        for a, b in combinations(pixels, 2):
            apart = deltaE_ciede2000(labs[a], labs[b]).astype(np.float32)
            levels = np.abs(pixels[a].astype(int) - pixels[b]).max(axis=2)
            outside = None
            if mask is not None and not mask.all():
                outside = float(levels[~_grown(mask)].max(initial=0))
            place = out / "maps" / f"{cell}_{a}_{b}.png"
            np.save(place.with_suffix(".npy"), apart)  # coloured when the largest is known
            maps.append(place)
            found.append(
                Pair(
                    cell,
                    a,
                    b,
                    float(apart[skin].mean()),
                    float(np.quantile(apart[skin], 0.99)),
                    float(np.abs(pixels[a].astype(float) - pixels[b])[skin].mean()),
                    float((levels[skin] >= 3).mean()),
                    outside,
                    predicted.get((cell, frozenset((a, b)))),
                    f"maps/{cell}_{a}_{b}.png",
                )
            )
    top = max(1.0, float(np.ceil(max((pair.most for pair in found), default=1.0))))
    for place in maps:
        values = place.with_suffix(".npy")
        Image.fromarray(coloured(np.load(values), top)).save(place)
        values.unlink()
    flags += [flag for pair in found for flag in _flags_of_pair(pair, limits, labels)]
    return Inspection(tuple(pictures), tuple(found), tuple(flags), top)


def _pixels(image) -> np.ndarray:
    """The region of an image that is shown: (h, w, 3) uint8."""
    try:
        with Image.open(image.path) as picture:
            return np.asarray(picture.convert("RGB").crop(image.box))
    except OSError as error:
        raise InputError(f"{image.path}: cannot be read as an image: {error}") from None


def _mask(folder: Path, cell: str, image) -> np.ndarray | None:
    """Where light scatters in a cell's region, None where the build kept no mask."""
    path = folder / MASKS / f"{cell}.png"
    if not path.is_file():
        return None
    with Image.open(path) as picture:
        if picture.size != (image.width, image.height):
            raise InputError(
                f"{path}: is {picture.width}x{picture.height}; expected the images' "
                f"{image.width}x{image.height}"
            )
        mask = np.asarray(picture.convert("L").crop(image.box)) > 127
    return mask if mask.any() else None


def _grown(mask: np.ndarray, pixels: int = 2) -> np.ndarray:
    """The mask and a rim about it: antialiased edges hold some of both."""
    from scipy.ndimage import binary_dilation

    return binary_dilation(mask, iterations=pixels)


def _picture(cell: str, name: str, pixels: np.ndarray, lab: np.ndarray, skin: np.ndarray):
    luminance = float((decode_srgb(pixels / 255) @ LUMA)[skin].mean())
    clipped = float((pixels == 255).any(axis=2)[skin].mean())
    return Picture(
        cell,
        name,
        luminance,
        tuple(map(float, lab[skin].mean(axis=0))),
        clipped,
        noise(pixels, skin),
    )


def noise(pixels: np.ndarray, where: np.ndarray) -> float:
    """Standard deviation of an image's noise in levels, by the Laplacian that is blind to planes
    and ramps (Immerkaer 1996, "Fast noise variance estimation", doi:10.1006/cviu.1996.0060); the
    median over the pixels stands for their mean, so that edges and pores do not count as noise.
    """
    from scipy.ndimage import convolve

    kernel = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], float)
    grey = pixels.astype(float) @ LUMA
    return float(np.median(np.abs(convolve(grey, kernel))[where]) / 0.6745 / 6)


def _flags_of_pictures(pictures: Sequence[Picture], limits: Limits, labels) -> list[Flag]:
    from skimage.color import deltaE_ciede2000

    flags = []
    mean = np.mean([one.luminance for one in pictures])
    middle = np.mean([one.lab for one in pictures], axis=0)
    quiet = min(one.noise for one in pictures)
    for one in pictures:
        label = labels[one.technique]
        off = one.luminance / mean - 1 if mean > 0 else 0.0
        if abs(off) > limits.luminance:
            flags.append(
                Flag(
                    "brightness",
                    one.cell,
                    f"{label} is {abs(off):.1%} {'brighter' if off > 0 else 'darker'} over the "
                    "skin than the conditions' mean; people may judge that instead",
                )
            )
        colour = float(deltaE_ciede2000(np.array(one.lab), middle))
        if colour > limits.colour:
            flags.append(
                Flag(
                    "colour",
                    one.cell,
                    f"{label}'s mean colour over the skin is {colour:.1f} CIEDE2000 from the "
                    "conditions' mean",
                )
            )
        if one.clipped > limits.clipped:
            flags.append(
                Flag(
                    "clipped",
                    one.cell,
                    f"{label} has {one.clipped:.2%} of the skin at 255: clipped highlights",
                )
            )
        if one.noise > max(limits.noise_levels, limits.noise_ratio * quiet):
            flags.append(
                Flag(
                    "noise",
                    one.cell,
                    f"{label} has noise of {one.noise:.1f} levels where the quietest condition has "
                    f"{quiet:.1f}",
                )
            )
    return flags


def _flags_of_pair(pair: Pair, limits: Limits, labels) -> list[Flag]:
    flags = []
    words = f"{labels[pair.a]} and {labels[pair.b]}"
    if pair.outside is not None and pair.outside > limits.outside_levels:
        flags.append(
            Flag(
                "outside",
                pair.cell,
                f"{words} differ by up to {pair.outside:.0f} levels where nothing scatters",
            )
        )
    if pair.jod is not None and pair.jod < limits.jod:
        flags.append(
            Flag("alike", pair.cell, f"{words} are predicted {pair.jod:.2f} JOD apart as shown")
        )
    elif pair.jod is None and pair.most < limits.alike:
        flags.append(
            Flag(
                "alike",
                pair.cell,
                f"{words}: all but a hundredth of the skin is within {pair.most:.2f} CIEDE2000; "
                "they can hardly be told apart",
            )
        )
    return flags
