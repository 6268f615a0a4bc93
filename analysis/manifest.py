"""The file that says what a study shows: opened and its format checked here, for every reader.

`analysis.codebook` takes names and labels from it, `analysis.declared` what was declared, and
`analysis.objective` what its images cost; `stimuli.manifest` checks the rest, which only showing
the images needs. Standard library alone, so that the questionnaire can start without scipy.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from analysis.errors import InputError

NAME = "manifest.json"
#: What is read, the newest last; 1 had no factors beside framing, 2 no viewer.
FORMATS = tuple(f"subdermal-manifest/{number}" for number in (1, 2, 3))
#: Measure of an image -> what it is called, with its unit. Less of each is better or cheaper.
MEASURES = {
    "samples_per_pixel": "samples a scattering pixel",
    "milliseconds": "milliseconds an image",
    "dssim": "DSSIM to the reference",
    "flip": "FLIP to the reference",
}
#: What predicts which pairs can be told apart, `subdermal experiment visibility`.
VISIBILITY = "visibility"
#: Labels of the levels 1 to 5 of the self-rating, where the study names none.
FAMILIARITY = ("1, no familiarity", "2", "3", "4", "5, high familiarity")
#: What a question is for. `main` counts; `repeat` and `swapped` ask a main pair again, on the same
#: and on the other sides; `practice` comes first; `trap` has an obvious answer; `bias` shows one
#: image on both sides. Without a column that says so, all are `main`.
KINDS = ("main", "practice", "repeat", "swapped", "trap", "bias")
#: [left, top, right, bottom] of an image, from 0 to 1, where all of it is meant.
WHOLE = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class ManifestFile:
    """A manifest as it was read: `path` of the file, and its top table."""

    path: Path
    value: Mapping[str, object]

    @property
    def study(self) -> dict:
        """The table `study`; InputError where there is none."""
        study = self.value.get("study")
        if not isinstance(study, dict):
            raise InputError(
                f"{self.path}: study is {study!r:.60}, expected a table with framings and "
                "techniques"
            )
        return study

    @property
    def declared(self) -> dict:
        """`study.analysis`: what was declared of the analysis, empty where nothing was."""
        declared = self.study.get("analysis", {})
        if not isinstance(declared, dict):
            raise InputError(f"{self.path}: study.analysis is {declared!r:.60}, expected a table")
        return declared

    @property
    def images(self) -> list[dict]:
        """The tables of `images`; none where the manifest was written for names alone."""
        images = self.value.get("images", [])
        if not isinstance(images, list) or not all(isinstance(one, dict) for one in images):
            raise InputError(f"{self.path}: images is {images!r:.60}, expected a list of tables")
        return images

    @property
    def licences(self) -> list[dict]:
        """What the images were made from, each with `what`, `licence` and `source`, some with
        `credit`.
        """
        licences = self.value.get("licences", [])
        if not isinstance(licences, list) or not all(isinstance(one, dict) for one in licences):
            raise InputError(
                f"{self.path}: licences is {licences!r:.60}, expected a list of tables"
            )
        return licences

    def region(self, place: int) -> tuple[float, float, float, float]:
        """The part of an image that is compared and shown: its own `region`, else that of its
        framing, else all of it; left, top, right, bottom, 0 to 1.
        """
        image, study = self.images[place], self.value.get("study")
        framings = study.get("framings") if isinstance(study, dict) else None
        for one in framings if isinstance(framings, list) else ():
            if isinstance(one, dict) and one.get("name") == image.get("framing"):
                default = one.get("region")
                break
        else:
            default = None
        where = f"{self.path}: images[{place}].region"
        for region in (image.get("region"), default):
            if region is not None:
                return read_region(where, region)
        return WHOLE

    @property
    def visibility(self) -> dict:
        """What was predicted of each pair, empty where nothing was: `metric`, `version`, `display`
        and `pairs`, those alone whose images are still the same.
        """
        value = self.value.get(VISIBILITY)
        if value is None:
            return {}
        where = f"{self.path}: {VISIBILITY}"
        if not isinstance(value, dict) or not isinstance(value.get("pairs"), list):
            raise InputError(f"{where} is {value!r:.60}, expected a table with pairs")
        kept = {image.get("sha256") for image in self.images}
        pairs = []
        for place, pair in enumerate(value["pairs"]):
            names = ("cell", "a", "b", "sha256_a", "sha256_b")
            if not isinstance(pair, dict) or not all(isinstance(pair.get(k), str) for k in names):
                raise InputError(
                    f"{where}.pairs[{place}] is {pair!r:.60}, expected {', '.join(names)} and jod"
                )
            jod = pair.get("jod")
            if isinstance(jod, bool) or not isinstance(jod, int | float) or not jod <= 10.001:
                raise InputError(f"{where}.pairs[{place}].jod is {jod!r}, expected at most 10")
            if {pair["sha256_a"], pair["sha256_b"]} <= kept:
                pairs.append(pair)
        return {**value, "pairs": pairs}

    def measures(self, place: int) -> dict[str, float]:
        """What is measured of the image at a place; `null` and nothing are the same."""
        measures = self.images[place].get("measures")
        return read_measures(f"{self.path}: images[{place}].measures", measures or {})


def credit(licence: Mapping[str, object]) -> str:
    """What an entry of `licences` says: 'a bust (A. Maker, CC-BY-4.0)'."""
    of = ", ".join(str(licence[key]) for key in ("credit", "licence") if key in licence)
    return f"{licence.get('what')} ({of})"


def is_manifest(path: Path) -> bool:
    """Whether the file is a subdermal manifest of any version, whole or not; other tools write a
    `manifest.json` too.
    """
    return b'"subdermal-manifest/' in path.read_bytes()


def open_manifest(path: str | Path) -> ManifestFile:
    """Open a manifest.json, or that of a folder; InputError where it is none of a known format."""
    path = Path(path)
    if path.is_dir():
        path = path / NAME
    try:
        value = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read: {error.strerror}; expected a study's {NAME}, such as "
            f"`subdermal build STUDY.toml --out {path.parent}` writes"
        ) from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {' '.join(str(error).split())}") from None
    if not isinstance(value, dict) or value.get("format") not in FORMATS:
        got = value.get("format") if isinstance(value, dict) else type(value).__name__
        raise InputError(f"{path}: format is {got!r:.60}, expected one of {', '.join(FORMATS)}")
    return ManifestFile(path, value)


def read_measures(where: str, table: object) -> dict[str, float]:
    """The measures of an image, checked: names are those of `MEASURES`, values numbers from 0."""
    if not isinstance(table, dict):
        raise InputError(f"{where} is {table!r:.60}, expected a table of numbers")
    for name, value in table.items():
        if name not in MEASURES:
            raise InputError(f"{where} names {name!r}, expected one of {', '.join(MEASURES)}")
        if not _is_number(value) or not 0 <= value < math.inf:
            raise InputError(f"{where}.{name} is {value!r:.60}, expected a number from 0")
    return table


def read_region(where: str, value: object) -> tuple[float, float, float, float]:
    """The part of an image that a study is about, checked: [left, top, right, bottom], 0 to 1."""
    whole = isinstance(value, list | tuple) and len(value) == 4 and all(map(_is_number, value))
    if not whole or not (0 <= value[0] < value[2] <= 1 and 0 <= value[1] < value[3] <= 1):
        raise InputError(
            f"{where} is {value!r:.60}, expected [left, top, right, bottom] from 0 to 1, "
            "left < right and top < bottom"
        )
    return tuple(map(float, value))


def region_box(
    region: tuple[float, float, float, float], width: int, height: int
) -> tuple[int, int, int, int]:
    """A region in whole pixels of an image of that size: left, top, right, bottom, the last two
    one past its end.
    """
    left, top = round(region[0] * width), round(region[1] * height)
    right, bottom = round(region[2] * width), round(region[3] * height)
    left, top = min(left, width - 1), min(top, height - 1)
    return left, top, max(right, left + 1), max(bottom, top + 1)


def read_self_rating(where: str, table: Mapping) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Labels and levels of a study's self-rating: `labels`, two texts or more, and `levels`, whole
    numbers that ascend; without levels they count from 1, without labels levels are their own.
    """
    labels, levels = table.get("labels"), table.get("levels")
    if labels is None and levels is None:
        return FAMILIARITY, tuple(range(1, len(FAMILIARITY) + 1))
    if labels is not None and not (
        isinstance(labels, list | tuple)
        and len(labels) >= 2
        and all(isinstance(text, str) and text.strip() for text in labels)
    ):
        raise InputError(f"{where}.labels is {labels!r:.60}, expected texts, two or more")
    levels = list(range(1, len(labels) + 1)) if levels is None else levels
    labels = list(map(str, levels)) if labels is None and isinstance(levels, list) else labels
    if not (
        isinstance(levels, list)
        and all(isinstance(one, int) and not isinstance(one, bool) for one in levels)
        and levels == sorted(set(levels))
        and len(levels) == len(labels)
    ):
        raise InputError(
            f"{where}.levels is {levels!r:.60}, expected whole numbers that ascend, one for each "
            "label"
        )
    return tuple(labels), tuple(levels)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
