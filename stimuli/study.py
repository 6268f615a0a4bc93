"""The definition of a study: what is shown, what is asked, how it is rendered.

A study is a TOML file (studies/thesis.toml is the one to copy): a scene, the factors whose levels
patch it, the conditions that are compared. What it asks (`question`, `scale`,
`familiarity`, `consent`) may be left out and is then asked as in the thesis; what it declares of
its analysis (`analysis`: margins, tests, exclusions) may be left out too. Nothing here renders, and
nothing here knows which techniques and framings there are: `stimuli.build` asks the renderer.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from analysis.declared import options
from analysis.manifest import WHOLE, read_region, read_self_rating
from stimuli.asking import (
    Ask,
    Assignment,
    Pages,
    Participants,
    Quality,
    Reason,
    Screen,
    read_asks,
    read_assignment,
    read_pages,
    read_participants,
    read_quality,
    read_reason,
    read_screen,
)
from stimuli.errors import InputError
from stimuli.languages import (
    CLOSER,
    CONSENT,
    PLACEHOLDERS,
    WHY,
    placeholders,
    read_languages,
    read_texts,
)
from stimuli.parts import read_toml
from stimuli.recruiting import Recruiting, read_recruiting
from stimuli.scenes import load_table, merge, person_table
from stimuli.table import Table, refuse_doubles
from stimuli.viewing import ONE_TO_ONE, Viewer, read_viewer

THESIS = Path(__file__).parent / "studies" / "thesis.toml"
FRAMING = "framing"
DEFAULT_HEAD = "default"
LONGEST_CELL = 100  # what a database keeps
#: The framing of a study that names none.
HEAD_SHOT = {"name": "head-shot", "label": "Head shot"}
#: Factors whose levels can go without `set`: where in the scene's table the level's name stands.
SHORTHANDS = {
    FRAMING: ("camera", "framing"),
    "angle": ("camera", "angle"),
    "light": ("rig",),
    "person": ("objects", "head", "person"),
}
#: Columns of the table of answers: no factor can have such a name.
RESERVED = frozenset(
    {"framing", "participant", "familiarity", "left", "right", "answer", "rt_ms", "timed_by"}
    | {"times_shown", "started_at", "answered_at", "order", "seed", "simulated", "study"}
    | {"study_version", "trial", "technique", "image_left_sha256", "image_right_sha256"}
    | {
        "completed",
        "viewport_width",
        "viewport_height",
        "device_pixel_ratio",
        "shown_width",
        "shown_height",
        "view",
        "beside_ms",
        "flicker_ms",
        "wipe_ms",
        "triplet_ms",
        "boosted_ms",
        "flips",
        "pixel_scale",
        "pixel_scale_largest",
        "seen_share",
        "away_ms",
        "rt_server_ms",
        "rt_reported_ms",
        "rt_flag",
        "kind",
        "expected",
        "pixels_per_mm",
        "pixels_per_degree",
        "display_gamma",
        "dark_steps_seen",
        "bright_steps_seen",
        "plates_read",
        "plates_given",
        "point",
        "reason_ticks",
        "reason_text",
        "language",
        "consent_language",
        "consent_sha256",
    }
)
#: Points of a scale at most, and up to how many all of them have words.
LONGEST_SCALE, WORDED = 11, 5
UNITS = ("mm", "cm", "m", "in")  # of a scan's coordinates
#: What [head] says of a scan besides its unit: fields of renderer.scene.objects.Scan and looks.
SAID_OF_HEAD = (
    "up",
    "forward",
    "yaw_deg",
    "head_mm",
    "mm_per_unit",
    "landmarks",
    "edge_mm",
    "licence",
    "credit",
    "albedo",
    "normal",
    "skin",
    "hair",
)
_WORDING = ("question", "scale", "familiarity", "consent")


@dataclass(frozen=True)
class Level:
    """A level of a factor: its name in files and tables, its label for people.

    patch: what it changes in the scene's table (stimuli.parts.merge); region: the part of the
    image that a framing is about, left, top, right, bottom from 0 to 1.
    """

    name: str
    label: str
    patch: dict = field(default_factory=dict)
    region: tuple[float, float, float, float] = WHOLE


@dataclass(frozen=True)
class Factor:
    """What a study varies beside the conditions: framing, angle, person, light, ..."""

    name: str
    label: str
    levels: tuple[Level, ...]


@dataclass(frozen=True)
class Cell:
    """One level of each factor: pairs are compared within it.

    levels: factor -> level, framing first; name: the levels' names joined by dots, so that it is
    the framing's own where a study varies nothing else.
    """

    levels: dict[str, str]

    @property
    def name(self) -> str:
        return ".".join(self.levels.values())

    @property
    def framing(self) -> str:
        return self.levels[FRAMING]


@dataclass(frozen=True)
class Condition:
    """What is compared within a cell: a technique of the renderer with its parameters."""

    name: str
    label: str
    technique: str
    parameters: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Question:
    """What is asked about the two images, and how they are called."""

    text: str
    left_label: str
    right_label: str


@dataclass(frozen=True)
class ScalePoint:
    """One answer of the scale: below 0 the left image, above 0 the right one, -5 to 5.

    counts: the strength as which the analysis takes it, -2 (strongly the left image) to 2
    label: "" where only the point's number stands
    """

    value: int
    label: str
    counts: int

    def record(self) -> dict:
        counts = {"counts": self.counts} if self.counts != self.value else {}
        return {"value": self.value, "label": self.label, **counts}


@dataclass(frozen=True)
class Familiarity:
    """The self-rating: labels[i] stands for the value levels[i]."""

    question: str
    labels: tuple[str, ...]
    levels: tuple[int, ...]


@dataclass(frozen=True)
class Render:
    """How the images are rendered: size (width, height) in pixels, samples a pixel along each
    axis.
    """

    size: tuple[int, int]
    supersample: int
    seed: int


@dataclass(frozen=True)
class Study:
    """A study.

    factors: framing first; cells: the combinations of their levels that are shown. `render` and
    `scene` (the table of the scene that levels patch) are None where the images are ready-made;
    `analysis` is what it declares of its analysis; `viewer` is how pairs are looked at;
    `recruiting` is what a recruiter's link says; `languages` are those in which people are asked,
    the first that of the texts here, and `texts` are those of the others (`stimuli.languages`).
    """

    name: str
    title: str
    version: int
    seed: int
    factors: tuple[Factor, ...]
    cells: tuple[Cell, ...]
    techniques: tuple[Condition, ...]
    question: Question
    scale: tuple[ScalePoint, ...]
    familiarity: Familiarity
    consent: str
    render: Render | None = None
    scene: dict | None = None
    analysis: dict = field(default_factory=dict)
    viewer: Viewer = Viewer()
    recruiting: Recruiting = Recruiting()
    participants: Participants = Participants()
    assignment: Assignment = Assignment()
    quality: Quality = Quality()
    before: tuple[Ask, ...] = ()
    after: tuple[Ask, ...] = ()
    reason: Reason = Reason()
    pages: Pages = Pages()
    screen: Screen = Screen()
    languages: tuple[str, ...] = ("en",)
    texts: dict[str, dict] = field(default_factory=dict)

    @property
    def framings(self) -> tuple[Level, ...]:
        """The levels of the factor framing, which every study has."""
        return self.factors[0].levels

    @property
    def questions(self) -> int:
        """How many a participant is asked: pairs, and those that tell how well people look."""
        return self.pairs_each + self.quality.questions

    @property
    def pairs(self) -> int:
        """How many there are: every two conditions once in each cell."""
        return len(self.cells) * len(self.techniques) * (len(self.techniques) - 1) // 2

    @property
    def pairs_each(self) -> int:
        """How many of them a participant is asked."""
        return self.assignment.pairs or self.pairs

    def factor(self, name: str) -> Factor:
        """A factor by its name; KeyError where the study has none such."""
        return {factor.name: factor for factor in self.factors}[name]

    def cell(self, name: str) -> Cell:
        """A cell by its name; KeyError where the study has none such."""
        return {cell.name: cell for cell in self.cells}[name]

    def cell_label(self, cell: Cell) -> str:
        """The labels of a cell's levels."""
        labels = []
        for factor in self.factors:
            known = {level.name: level.label for level in factor.levels}
            labels.append(known[cell.levels[factor.name]])
        return ", ".join(labels)

    def scene_of(self, cell: Cell) -> dict:
        """The scene's table with the patches of a cell's levels, in the order of the factors."""
        table = dict(self.scene or {})
        for factor in self.factors:
            patch = next(v.patch for v in factor.levels if v.name == cell.levels[factor.name])
            table = merge(table, patch)
        return table

    @property
    def strengths(self) -> dict[int, str]:
        """The strengths of answers, from the left, with the labels of the points that count so."""
        labels: dict[int, list[str]] = {}
        for place, point in enumerate(self.scale, 1):
            labels.setdefault(point.counts, []).append(point.label or str(place))
        return {counts: " / ".join(texts) for counts, texts in labels.items()}

    @property
    def own_texts(self) -> dict:
        """What people read of the study in its first language: the shape of the other languages'
        texts.
        """
        pages = {key: getattr(self.pages, key) for key in ("instructions", "debrief")}
        ticks = {"ticks": list(self.reason.ticks)} if self.reason.ticks else {}
        return {
            "title": self.title,
            "consent": self.consent,
            "question": dict(vars(self.question)),
            "scale": [point.label for point in self.scale],
            "familiarity": {
                "question": self.familiarity.question,
                "labels": list(self.familiarity.labels),
            },
            "reason": {"text": self.reason.text, **ticks} if self.reason.share else {},
            "pages": {key: text for key, text in pages.items() if text},
            "before": {ask.name: ask.texts for ask in self.before},
            "after": {ask.name: ask.texts for ask in self.after},
        }

    def translated(self, language: str) -> "Study":
        """The study with its texts in one of its languages."""
        if language == self.languages[0]:
            return self
        texts = self.texts[language]
        reason = {**texts["reason"], "ticks": tuple(texts["reason"].get("ticks", ()))}
        return replace(
            self,
            title=texts["title"],
            consent=texts["consent"],
            question=replace(self.question, **texts["question"]),
            scale=tuple(replace(p, label=text) for p, text in zip(self.scale, texts["scale"])),
            familiarity=replace(
                self.familiarity,
                question=texts["familiarity"]["question"],
                labels=tuple(texts["familiarity"]["labels"]),
            ),
            reason=replace(self.reason, **reason),
            pages=replace(self.pages, **texts["pages"]),
            before=tuple(ask.worded(texts["before"][ask.name]) for ask in self.before),
            after=tuple(ask.worded(texts["after"][ask.name]) for ask in self.after),
        )

    def record(self) -> dict:
        """What the manifest says of the study; `read_study` reads it back."""

        def named(level: Level) -> dict:
            region = {"region": list(level.region)} if level.region != WHOLE else {}
            return {"name": level.name, "label": level.label, **region}

        more = [
            {"name": f.name, "label": f.label, "levels": [named(level) for level in f.levels]}
            for f in self.factors[1:]
        ]
        listed = len(self.cells) < prod(len(f.levels) for f in self.factors)
        return {
            "name": self.name,
            "title": self.title,
            "version": self.version,
            "seed": self.seed,
            "framings": [named(level) for level in self.framings],
            **({"factors": more} if more else {}),
            **({"cells": [cell.levels for cell in self.cells]} if listed else {}),
            "techniques": [{"name": t.name, "label": t.label} for t in self.techniques],
            "question": vars(self.question),
            "scale": [point.record() for point in self.scale],
            "familiarity": {
                "question": self.familiarity.question,
                "labels": list(self.familiarity.labels),
                "levels": list(self.familiarity.levels),
            },
            "consent": self.consent,
            "viewer": self.viewer.record(),
            **({"recruiting": self.recruiting.record()} if self.recruiting != Recruiting() else {}),
            "participants": vars(self.participants),
            "assignment": self.assignment.record(),
            "quality": self.quality.record({cell.name: cell.levels for cell in self.cells}),
            "before": [ask.record() for ask in self.before],
            "after": [ask.record() for ask in self.after],
            "reason": self.reason.record(),
            "pages": self.pages.record(),
            "screen": self.screen.record(),
            **({"analysis": self.analysis} if self.analysis else {}),
            **({"languages": list(self.languages)} if self.languages != ("en",) else {}),
            **({"text": self.texts} if self.texts else {}),
        }


def load_study(path: str | Path) -> Study:
    """Read and validate a study's TOML file; InputError names the line or the dotted key at fault.

    A scene or a scan that is a file is looked for beside the study.
    """
    path = Path(path)
    table = Table(read_toml(path), str(path))
    render, head = table.table("render", default={}), table.table("head", default={})
    width, height = _size(render)
    scene = load_table(table.text("scene", default="thesis"), path.parent)
    study = read_study(
        table,
        render=Render(
            (width, height),
            render.number("supersample", 1, 4, default=2),
            render.number("seed", 0, 2**63 - 1, default=0),
        ),
        scene=with_head(scene, **_head(head, path.parent)),
    )
    for part in (table, render, head):
        part.end()
    return study


def with_head(scene: dict, name: str, said: Mapping[str, Any] | None = None) -> dict:
    """The scene with another head: "default" for its own, a person by name, by a .toml file or by
    a seed that draws one, or a scan's file.

    said: of a scan, `renderer.scene.objects.Scan`'s fields, and `albedo` and `normal` (images) and
    `skin` (a person) for what its file lacks; None values say nothing.
    """
    said = {key: value for key, value in (said or {}).items() if value is not None}
    is_scan = Path(name).suffix not in ("", ".toml")
    if not is_scan and said:
        raise InputError(
            f"{', '.join(sorted(said))} is for a scan's file, and the head is {name!r}"
        )
    if name == DEFAULT_HEAD:
        return scene
    subject = scene.get("subject", next(iter(scene.get("objects", {"head": {}}))))
    own = scene.get("objects", {}).get(subject, {})
    place = {key: own[key] for key in ("position_mm", "rotation_deg", "scale") if key in own}
    materials = dict(scene.get("materials", {}))
    if is_scan:
        looks = {f"{key}_map": said.pop(key) for key in ("albedo", "normal") if key in said}
        if "skin" in said:
            skin = {"kind": "skin", **person_table(said.pop("skin")).get("skin", {})}
            looks = {**skin, **looks}
        if looks:
            materials[subject] = merge(looks, materials.get(subject, {}))
        shape = {"shape": "scan", "file": name, **said}
    else:
        shape = {"shape": "person", "person": name}
        shape |= {key: own[key] for key in ("dressed", "expression") if key in own}
    objects = {**scene.get("objects", {}), subject: {**place, **shape}}
    return {**scene, "objects": objects, **({"materials": materials} if materials else {})}


def read_study(
    table: Table,
    render: Render | None = None,
    scene: dict | None = None,
    display: str = ONE_TO_ONE,
) -> Study:
    """The study in a table of a TOML file or of a manifest; without `render`, images are
    ready-made. display: of a study that says nothing of it.
    """
    languages = read_languages(table)
    rendered = render is not None
    techniques = table.tables("techniques", least=2)
    conditions = [entry.name("name") for entry in techniques]
    viewer = read_viewer(table.table("viewer", default={}), display, conditions, rendered)
    default = default_wording(languages[0], rendered, viewer.triplet)
    wording = Table({**default, **table.value}, table.source, table.key)
    factors = _factors(table, rendered)
    cells = _cells(table, factors)
    asks = []
    for key in ("before", "after"):
        table.take(key, list, "a list of tables", default=[])
        entries = table.tables(key, least=0) if key in table.value else []
        taken = [*RESERVED, *(factor.name for factor in factors), *(a.name for a in sum(asks, ()))]
        asks.append(read_asks(entries, taken))
    every = len(cells) * len(techniques) * (len(techniques) - 1) // 2
    assignment = read_assignment(table.table("assignment", default={}), every)
    shared = table.take("parameters", dict, default={}) if rendered else {}
    study = Study(
        name=table.name("name"),
        title=table.text("title"),
        version=table.number("version", 1, 2**31 - 1),
        seed=table.number("seed", 0, 2**63 - 1),
        factors=factors,
        cells=cells,
        techniques=tuple(_condition(t, rendered, shared) for t in techniques),
        question=_question(wording.table("question")),
        scale=_scale(wording),
        familiarity=_familiarity(wording.table("familiarity")),
        consent=_consent(wording),
        render=render,
        scene=scene,
        analysis=_analysis(table),
        viewer=viewer,
        before=asks[0],
        after=asks[1],
        reason=read_reason(table.table("reason", default={}), WHY[languages[0]]),
        screen=read_screen(table.table("screen", default={})),
        pages=read_pages(table.table("pages", default={})),
        recruiting=read_recruiting(table.table("recruiting", default={})),
        participants=read_participants(table.table("participants", default={})),
        quality=read_quality(
            table.table("quality", default={}),
            {cell.name: cell.levels for cell in cells},
            conditions,
            assignment.pairs or every,
        ),
        assignment=assignment,
        languages=languages,
    )
    study = replace(study, texts=_texts(table, study, rendered))
    refuse_doubles(techniques, "name")
    refuse_doubles(techniques, "label")
    for part in techniques:
        part.end()
    for key in _WORDING:
        table.take(key, object, default=None, expected="anything")
    return study


def _factors(table: Table, rendered: bool) -> tuple[Factor, ...]:
    """framing, from [[framings]], and those of [[factors]]."""
    framings = [Table(f, table.source, f"{table.at('framings')}[0]") for f in (HEAD_SHOT,)]
    if "framings" in table.value:
        framings = table.tables("framings", least=1)
    factors = [Factor(FRAMING, "Framing", _levels(framings, FRAMING, rendered))]
    entries = table.tables("factors", least=0) if "factors" in table.value else []
    for entry in entries:
        name = entry.name("name")
        if name in RESERVED:
            raise entry.fault("name", name, f"another name than {', '.join(sorted(RESERVED))}")
        levels = entry.tables("levels", least=1)
        factors.append(Factor(name, entry.text("label"), _levels(levels, name, rendered)))
        entry.end()
    refuse_doubles(entries, "name")
    return tuple(factors)


def _levels(tables: list[Table], factor: str, rendered: bool) -> tuple[Level, ...]:
    levels = []
    for table in tables:
        name, patch, region = table.name("name"), {}, WHOLE
        if rendered:
            patch = table.take("set", dict, "a table that is merged onto the scene's", default=None)
            patch = _shorthand(table, factor, name) if patch is None else patch
        if factor == FRAMING and "region" in table.value:
            given = table.take("region", list, "[left, top, right, bottom]")
            region = read_region(f"{table.source}: {table.at('region')}", given)
            patch = merge(patch, {"camera": {"region": given}}) if rendered else patch
        levels.append(Level(name, table.text("label"), patch, region))
        table.end()
    refuse_doubles(tables, "name")
    refuse_doubles(tables, "label")
    return tuple(levels)


def _shorthand(table: Table, factor: str, name: str) -> dict:
    """What a level without `set` changes: the value of its factor is its name."""
    if factor not in SHORTHANDS:
        raise InputError(
            f"{table.source}: {table.at('set')}: missing, expected a table that is merged onto "
            f"the scene's (only {', '.join(SHORTHANDS)} go without)"
        )
    value: object = name
    for key in reversed(SHORTHANDS[factor]):
        value = {key: value}
    return value


def _cells(table: Table, factors: tuple[Factor, ...]) -> tuple[Cell, ...]:
    """All combinations of the factors' levels, or those that `cells` lists."""
    cells = _crossed_or_listed(table, factors)
    for cell in cells:
        if len(cell.name) > LONGEST_CELL:
            raise InputError(
                f"{table.source}: {table.at('factors')}: the levels {cell.name} have "
                f"{len(cell.name)} letters together, expected {LONGEST_CELL} at most"
            )
    return cells


def _crossed_or_listed(table: Table, factors: tuple[Factor, ...]) -> tuple[Cell, ...]:
    names = [factor.name for factor in factors]
    if "cells" not in table.value:
        every = product(*((level.name for level in factor.levels) for factor in factors))
        return tuple(Cell(dict(zip(names, levels, strict=True))) for levels in every)
    cells = []
    for entry in table.tables("cells", least=1):
        levels = {}
        for factor in factors:
            known = [level.name for level in factor.levels]
            default = {"default": known[0]} if len(known) == 1 else {}
            levels[factor.name] = entry.one_of(factor.name, known, **default)
        entry.end()
        if any(cell.levels == levels for cell in cells):
            raise InputError(f"{entry.source}: {entry.key}: the same levels a second time")
        cells.append(Cell(levels))
    return tuple(cells)


def _texts(table: Table, study: Study, rendered: bool) -> dict[str, dict]:
    """The texts in the further languages; those of a wording that the study leaves out are the
    thesis's too.
    """
    defaults = {}
    for language in study.languages[1:]:
        wording = default_wording(language, rendered, study.viewer.triplet)
        texts = {
            "consent": wording["consent"],
            "question": wording["question"],
            "scale": [point["label"] for point in wording["scale"]],
            "familiarity": wording["familiarity"],
        }
        defaults[language] = {k: v for k, v in texts.items() if k not in table.value}
        asked = table.value.get("reason", {})
        if study.reason.share and not {"text", "ticks"} & asked.keys():
            defaults[language]["reason"] = {"text": WHY[language]}
    return read_texts(table, study.languages, study.own_texts, defaults)


def _consent(table: Table) -> str:
    text = table.text("consent")
    for word in placeholders(text):
        if word not in PLACEHOLDERS:
            known = ", ".join(f"{{{name}}}" for name in PLACEHOLDERS)
            raise table.fault("consent", f"{{{word}}}", f"one of {known}")
    return text


def default_wording(language: str, rendered: bool, triplet: bool = False) -> dict:
    """The thesis's wording in a language; ready-made images have a consent of their own, triplets
    a question.
    """
    thesis = _thesis()
    wording = {key: thesis[key] for key in _WORDING}
    if language != "en":
        texts = thesis["text"][language]
        points = zip(thesis["scale"], texts["scale"])
        scale = [{**point, "label": text} for point, text in points]
        wording = {**{key: texts[key] for key in _WORDING}, "scale": scale}
    if not rendered or triplet:
        wording = {**wording, "consent": CONSENT[language]}
    if triplet:
        labels = {key: wording["question"][key] for key in ("left_label", "right_label")}
        wording = {**wording, "question": {"text": CLOSER[language], **labels}}
    return wording


@cache
def _thesis() -> dict:
    return read_toml(THESIS)


def _condition(table: Table, rendered: bool, shared: dict) -> Condition:
    """A technique of the study; shared: the parameters that all of them are given."""
    name, label = table.name("name"), table.text("label")
    if not rendered:
        return Condition(name, label, name)
    return Condition(
        name,
        label,
        table.name("technique", default=name),
        {**shared, **table.take("parameters", dict, default={})},
    )


def _question(table: Table) -> Question:
    question = Question(table.text("text"), table.text("left_label"), table.text("right_label"))
    table.end()
    return question


def _scale(table: Table) -> tuple[ScalePoint, ...]:
    levels = table.tables("scale", least=2, most=LONGEST_SCALE)
    values = [level.number("value", -5, 5) for level in levels]
    if values != sorted({*values}) or values != [-value for value in reversed(values)]:
        raise table.fault(
            "scale",
            values,
            "values that ascend and are the same on both sides, such as -1, 1 for two alternatives "
            "or -2, -1, 0, 1, 2",
        )
    fine = values[-1] > 2  # more steps than the analysis has strengths
    counts = [
        level.number("counts", -2, 2, **({} if fine else {"default": value}))
        for level, value in zip(levels, values)
    ]
    signs = [(value > 0) - (value < 0) for value in values]
    if (
        counts != sorted(counts)
        or counts != [-count for count in reversed(counts)]
        or signs != [(count > 0) - (count < 0) for count in counts]
    ):
        raise table.fault(
            "scale",
            counts,
            "`counts` that ascend, are the same on both sides and have their values' signs, such "
            "as -2, -2, -1, 0, 1, 2, 2 for seven points",
        )
    ends = {0, len(levels) - 1}
    if len(levels) <= WORDED:
        ends = {*range(len(levels))}
    labels = [
        level.text("label") if k in ends else level.take("label", str, default="")
        for k, level in enumerate(levels)
    ]
    for level, label in zip(levels, labels):
        level.value = {**level.value, "label": label}
    refuse_doubles([level for level, label in zip(levels, labels) if label.strip()], "label")
    for level in levels:
        level.end()
    return tuple(map(ScalePoint, values, labels, counts))


def _familiarity(table: Table) -> Familiarity:
    labels, levels = read_self_rating(f"{table.source}: {table.key}", table.value)
    for key in ("labels", "levels"):
        table.take(key, list, default=None)
    familiarity = Familiarity(table.text("question"), labels, levels)
    table.end()
    return familiarity


def _analysis(table: Table) -> dict:
    """What the study declares of its analysis before anybody is asked, as it was written; checked
    by `analysis.declared.options`, which says what may be declared.
    """
    declared = table.take("analysis", dict, default={})
    options(declared, f"{table.source}: {table.at('analysis')}")
    return declared


def _size(table: Table) -> tuple[int, int]:
    def pixels(value: list) -> bool:
        return len(value) == 2 and all(type(side) is int and 16 <= side <= 8192 for side in value)

    return tuple(
        table.take(
            "size", list, "[width, height] in pixels, 16 to 8192 each", pixels, default=[1920, 1080]
        )
    )


def _head(table: Table, beside: Path) -> dict:
    """[head] of a study: its name and what is said of a scan, for `with_head`."""
    name = table.text("name", default=DEFAULT_HEAD)
    file = str(beside / name) if Path(name).suffix else name
    said = {"unit": table.one_of("unit", UNITS, default=None)}
    said |= {key: table.take(key, object, "a value") for key in SAID_OF_HEAD if key in table.value}
    for key in ("landmarks", "albedo", "normal", "skin"):
        if isinstance(said.get(key), str) and Path(said[key]).suffix:
            said[key] = str(beside / said[key])
    return {"name": file, "said": said}
