"""What the names in a response table mean: which framings and techniques there are, in which order,
with which labels.

A codebook comes from a study's `manifest.json`, or, without one, from the table itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from analysis.errors import InputError
from analysis.manifest import (
    FAMILIARITY,
    ManifestFile,
    credit,
    open_manifest,
    read_self_rating,
)

#: The factor that answers are grouped by when none is chosen.
FRAMING = "framing"
#: From near to far. A randomised questionnaire shows them in any order, so that first appearance
#: says nothing.
KNOWN_FRAMINGS = ("close-up", "head-shot", "half-length")


@dataclass(frozen=True)
class Codebook:
    """Order and labels of a study's framings and techniques; `order_rule` and `framing_rule` say
    where the orders come from.

    familiarity: labels of the levels of the self-rating; ratings: the levels, as answered.
    factors: the columns of the levels that a study varies beside framing; images differ by them.
    made_from: what its images were made from, with whose it is and under which licence.
    factor: the column of the table that answers are grouped by. Where it is not 'framing',
    `framings` are its levels; see `by`.
    """

    framings: tuple[str, ...]
    techniques: tuple[str, ...]
    order_rule: str
    framing_rule: str
    labels: Mapping[tuple[str, str], str] = field(default_factory=dict)
    familiarity: tuple[str, ...] = FAMILIARITY
    ratings: tuple[int, ...] = (1, 2, 3, 4, 5)
    title: str = ""
    factor: str = FRAMING
    factors: tuple[str, ...] = ()
    made_from: tuple[str, ...] = ()

    @property
    def factor_words(self) -> str:
        """The factor in words."""
        return self.factor.replace("_", " ")

    @property
    def heading(self) -> str:
        return self.factor_words[:1].upper() + self.factor_words[1:]

    @property
    def level(self) -> str:
        """What one group of answers is called: 'framing', or 'level of lighting'."""
        return FRAMING if self.factor == FRAMING else f"level of {self.factor_words}"

    @property
    def levels(self) -> str:
        return "framings" if self.factor == FRAMING else f"levels of {self.factor_words}"

    def counted(self, number: int) -> str:
        """'3 framings', '1 level of lighting'."""
        return f"{number} {self.level if number == 1 else self.levels}"

    def by(self, factor: str, levels: Iterable[str], rule: str) -> Codebook:
        """The same study with the levels of another factor in the place of its framings: 'day', but
        '3 (familiarity)' for a number.
        """
        levels, words = tuple(levels), factor.replace("_", " ")
        order = [level for key, level in self.labels if key == factor]
        if set(levels) <= set(order):
            levels = tuple(level for level in order if level in levels)
            rule = self.framing_rule
        labels = {key: label for key, label in self.labels.items() if key[0] != "framing"}
        declared = {level: label for (key, level), label in self.labels.items() if key == factor}
        labels |= {
            ("framing", level): declared.get(level, f"{level} ({words})")
            for level in levels
            if level in declared or not any(map(str.isalpha, level))
        }
        return replace(self, framings=levels, framing_rule=rule, labels=labels, factor=factor)

    @property
    def near_to_far(self) -> bool:
        """Whether the framings are known ones, in order of distance."""
        return self.framings == tuple(name for name in KNOWN_FRAMINGS if name in self.framings)

    def framing_label(self, name: str) -> str:
        return self.labels.get(("framing", name), name)

    def label(self, technique: str) -> str:
        return self.labels.get(("technique", technique), technique)

    def ordered(self, order: Iterable[str], needed: Iterable[str]) -> Codebook:
        """The same codebook with the techniques in `order`, which must name each of `needed` once
        and nothing unknown.
        """
        order, needed = tuple(order), list(needed)
        twice = [name for name in dict.fromkeys(order) if order.count(name) > 1]
        missing = [name for name in needed if name not in order]
        unknown = [name for name in order if name not in self.techniques]
        for fault, names in (
            ("names twice", twice),
            ("lacks", missing),
            ("names the unknown", unknown),
        ):
            if names:
                raise InputError(
                    f"the order {','.join(order)!r} {fault} {', '.join(map(repr, names))}; "
                    f"expected each once: {','.join(needed)}"
                )
        return replace(self, techniques=order, order_rule="as given on the command line")


def from_table(
    framings: Iterable[str], techniques: Iterable[str], ratings: tuple[int, ...] = (1, 2, 3, 4, 5)
) -> Codebook:
    """The codebook of a table without a manifest; names come in order of first appearance and are
    their own labels. ratings: the levels of the self-rating.
    """
    seen = tuple(dict.fromkeys(framings))
    known = tuple(name for name in KNOWN_FRAMINGS if name in seen)
    rule = "from near to far, by their known names" if known else "first appearance in the table"
    if known and len(known) < len(seen):
        rule += ", then first appearance in the table"
    return Codebook(
        framings=known + tuple(name for name in seen if name not in known),
        techniques=tuple(dict.fromkeys(techniques)),
        order_rule="first appearance in the table",
        framing_rule=rule,
        familiarity=FAMILIARITY if ratings == (1, 2, 3, 4, 5) else tuple(map(str, ratings)),
        ratings=ratings,
    )


def read_manifest(path: str | Path | ManifestFile) -> Codebook:
    """The codebook of a study, from its `manifest.json` (or the folder that holds it).

    Images are not looked at.
    """
    manifest = path if isinstance(path, ManifestFile) else open_manifest(path)
    codebook = of_study(
        manifest.study, f"{manifest.path}: study", f"the study's ({manifest.path.name})"
    )
    return replace(codebook, made_from=tuple(dict.fromkeys(map(credit, manifest.licences))))


def of_study(study: Mapping, where: str = "study", rule: str = "the study's") -> Codebook:
    """The codebook of a study's record, as `study` in a manifest.

    where: what errors call it; rule: where the orders of framings and techniques come from.
    """
    framings, techniques = (
        _named(f"{where}.{key}", study.get(key)) for key in ("framings", "techniques")
    )
    labels, ratings = read_self_rating(f"{where}.familiarity", study.get("familiarity") or {})
    factors = {}
    entries = study.get("factors") or []
    for place, (name, entry) in enumerate(zip(_named(f"{where}.factors", entries, 0), entries)):
        factors[name] = _named(f"{where}.factors[{place}].levels", entry.get("levels"))
    return Codebook(
        framings=tuple(framings),
        techniques=tuple(techniques),
        order_rule=rule,
        framing_rule=rule,
        labels={
            (kind, name): label
            for kind, named in {FRAMING: framings, "technique": techniques, **factors}.items()
            for name, label in named.items()
        },
        factors=tuple(factors),
        familiarity=labels,
        ratings=ratings,
        title=str(study.get("title") or study.get("name") or ""),
    )


def _named(where: str, entries: object, least: int = 1) -> dict[str, str]:
    """Name -> label of a list of tables, checked; a name is its own label where none is given."""
    if not isinstance(entries, list) or len(entries) < least:
        raise InputError(f"{where} is {entries!r:.60}, expected a list of tables with a name")
    labels: dict[str, str] = {}
    for place, entry in enumerate(entries):
        name = entry.get("name") if isinstance(entry, dict) else None
        if not isinstance(name, str) or not name or name in labels:
            raise InputError(f"{where}[{place}].name is {name!r:.60}, expected a name of its own")
        label = entry.get("label")
        labels[name] = label if isinstance(label, str) and label else name
    return labels
