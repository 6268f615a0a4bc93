"""The study that is asked: a manifest and the handful of look-ups that the web needs."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from babel.support import NullTranslations

from analysis.manifest import credit
from app.catalogues import catalogue, message
from stimuli.manifest import Image, Manifest, load_manifest
from stimuli.study import Study as Definition

#: What app.models stores of a person, in words; tests hold it to the tables.
RECORDED = (
    message("your self-rating"),
    message("your answers"),
    message("the times at which you began, answered and ended"),
    message("how often a question was opened"),
    message("the size of your window and of the images on it, and its scaling"),
    message("how you looked at each pair (views, zoom, how long)"),
    message("how long the page was out of sight"),
    message("the language of the pages"),
)

#: The words of a sentence before a colon that nothing follows.
_LEAD = re.compile(r"(?:^|(?<=[.!?。！？]))\s*(?P<words>[^.!?。！？:：]+?)\s*[:：]\s*$")


def minutes(definition: Definition) -> tuple[int, int]:
    """How many minutes most people need, from and to."""
    low, high = (
        max(1, round(definition.questions * seconds / 60)) for seconds in definition.pages.seconds
    )
    return low, high


def box_name(image: Image) -> str:
    """The pixels of an image's region of interest, as in its address."""
    return "-".join(map(str, image.box))


@dataclass(frozen=True)
class Study:
    """A study folder: DIR/manifest.json, its images, and the databases and reports beside it."""

    manifest: Manifest

    @classmethod
    def open(cls, study_dir: str | Path) -> Study:
        """Load and verify a study folder; every image's size and sha256 are checked."""
        return cls(load_manifest(study_dir))

    @property
    def directory(self) -> Path:
        return self.manifest.directory.resolve()

    @property
    def definition(self) -> Definition:
        """The definition: title, question, scale, familiarity, consent, labels."""
        return self.manifest.study

    @property
    def name(self) -> str:
        return self.definition.name

    @property
    def version(self) -> int:
        return self.definition.version

    @property
    def seed(self) -> int:
        return self.definition.seed

    @cached_property
    def framings(self) -> tuple[str, ...]:
        return tuple(level.name for level in self.definition.framings)

    @cached_property
    def cells(self) -> tuple[str, ...]:
        """The names of the cells: the framings' own where the study varies nothing else."""
        return tuple(cell.name for cell in self.definition.cells)

    @cached_property
    def techniques(self) -> tuple[str, ...]:
        return tuple(condition.name for condition in self.definition.techniques)

    @cached_property
    def design(self) -> str:
        """The names, in the order of the study: what must stay for answers to belong together
        (JSON).
        """
        # the key is that of the first databases, in which a cell was a framing
        return json.dumps({"framings": self.cells, "techniques": self.techniques})

    @property
    def credits(self) -> tuple[str, ...]:
        """Whose the images' sources are, of those that ask to be named."""
        named = (one for one in self.manifest.licences if "credit" in one)
        return tuple(dict.fromkeys(map(credit, named)))

    def content(self, *, images: bool) -> dict:
        """What participants see: the study's words and levels, and its images by their hashes."""
        seen = {
            key: value
            for key, value in self.definition.record().items()
            if key not in ("analysis", "recruiting")
        }
        if images:
            seen["images"] = {f"{i.cell} {i.technique}": i.sha256 for i in self.manifest.shown}
        return json.loads(json.dumps(seen))

    @cached_property
    def made(self) -> dict[Hashable, Any]:
        """What pages keep for the next ones, by what it depends on."""
        return {}

    @cached_property
    def images_by_sha256(self) -> dict[str, Image]:
        return {image.sha256: image for image in self.manifest.shown}

    @cached_property
    def shown(self) -> dict[tuple[str, str], Image]:
        """By the sha256 and the box in the address of what a question shows of an image."""
        return {(image.sha256, box_name(image)): image for image in self.manifest.shown}

    @cached_property
    def boosted(self) -> dict[tuple[str, str, str], tuple[Image, Image]]:
        """Images with their references, by the hashes of both and the box in the address of what
        a boosted triplet shows of an image; empty where there are none.
        """
        if self.definition.viewer.boost is None:
            return {}
        pairs = [(image, self.manifest.reference(image.cell)) for image in self.manifest.images]
        return {(one.sha256, two.sha256, box_name(one)): (one, two) for one, two in pairs}

    def image(self, cell: str, technique: str) -> Image:
        return self.manifest.image(cell, technique)

    @cached_property
    def _translated(self) -> dict[str, Definition]:
        return {name: self.definition.translated(name) for name in self.definition.languages}

    def in_language(self, language: str) -> Definition:
        """The definition with its texts in a language, or as they are where it has none such."""
        return self._translated.get(language, self.definition)

    def consent(self, language: str) -> tuple[str, ...]:
        """The paragraphs of the consent text in a language, with what is asked and stored filled
        in.
        """
        recorded = self._recorded(catalogue(language))
        return tuple(text.replace("{recorded}", recorded) for text in self._consent(language))

    def consent_parts(self, language: str) -> tuple[tuple[str, str | tuple[str, ...]], ...]:
        """The same words as a page shows them: ("text", a paragraph); where a sentence is a few
        words, a colon and `{recorded}`, those words as ("heading", text) and ("list", what is
        stored, one thing after the other).
        """
        result = []
        for text in self._consent(language):
            before, _, after = text.partition("{recorded}")
            lead = _LEAD.search(before)
            if lead is None or after[:1] not in ("", ".", "。") or "{recorded}" in after:
                filled = text.replace("{recorded}", self._recorded(catalogue(language)))
                result.append(("text", filled))
                continue
            if first := before[: lead.start()].strip():
                result.append(("text", first))
            result.append(("heading", lead["words"]))
            result.append(("list", self._stored(catalogue(language))))
            if last := after[1:].strip():
                result.append(("text", last))
        return tuple(result)

    def _consent(self, language: str) -> list[str]:
        """The paragraphs with `{recorded}` as it stands."""
        words = catalogue(language)
        low, high = minutes(self.definition)
        filled = {
            "questions": str(self.definition.questions),
            "minutes": str(low)
            if low == high
            else words.gettext("%(low)s to %(high)s") % {"low": low, "high": high},
        }
        text = self.in_language(language).consent
        for name, value in filled.items():
            text = text.replace(f"{{{name}}}", value)
        return text.split("\n\n")

    def consent_sha256(self, language: str) -> str:
        """The hash of the consent text in a language as the page shows it; the same hash is the
        same text.
        """
        return hashlib.sha256("\n\n".join(self.consent(language)).encode()).hexdigest()

    def _stored(self, words: NullTranslations) -> tuple[str, ...]:
        """What is stored of a participant, with what this study asks beside the pairs."""
        definition, parts = self.definition, [words.gettext(part) for part in RECORDED]
        if own := len(definition.before) + len(definition.after):
            text = words.ngettext(
                "your answers to %(num)s other question",
                "your answers to %(num)s other questions",
                own,
            )
            parts.append(text % {"num": own})
        if definition.screen.check:
            parts.append(words.gettext("the size of your screen's pixels, its greys and the zoom"))
        if definition.screen.plates:
            parts.append(words.gettext("which colour plates you read"))
        if definition.reason.share:
            parts.append(words.gettext("the reasons that you give for a choice"))
        if names := ", ".join(definition.recruiting.parameters):
            text = words.gettext("what your recruiter's link says of you (%(names)s)")
            parts.append(text % {"names": names})
        return tuple(parts)

    def _recorded(self, words: NullTranslations) -> str:
        """The same as a part of a sentence."""
        *several, last = self._stored(words)
        several = words.gettext("; ").join(several)
        return words.gettext("%(several)s; and %(last)s") % {"several": several, "last": last}

    def database_url(self, simulated: bool) -> str:
        return (
            f"sqlite:///{self.directory / ('simulated.sqlite3' if simulated else 'study.sqlite3')}"
        )

    def report(self, simulated: bool) -> Path:
        """Where the report on the answers of this kind is looked for."""
        return self.directory / ("simulated/report" if simulated else "report") / "report.html"
