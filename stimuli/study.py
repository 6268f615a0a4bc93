"""The definition of a study: what is shown, what is asked, how it is rendered.

A study is a TOML file (studies/thesis.toml is the one to copy). What it asks (`question`, `scale`,
`familiarity`, `consent`) may be left out and is then asked as in the thesis; what it declares of
its analysis (`analysis`: margins, tests, exclusions) may be left out too. Nothing here renders, and
nothing here knows which techniques and framings there are: `stimuli.build` asks the renderer.
"""

import tomllib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from stimuli.errors import InputError
from stimuli.table import Table, refuse_doubles

THESIS = Path(__file__).parent / "studies" / "thesis.toml"
UNITS = ("mm", "cm", "m", "in")  # of a scan's coordinates
AXES = ("y", "z")  # that can point upwards in a scan
_ASKED = ("question", "scale", "familiarity", "consent")


@dataclass(frozen=True)
class Framing:
    """A distance to the head: its name in files and tables, its label for people."""

    name: str
    label: str


@dataclass(frozen=True)
class Condition:
    """What is compared within a framing: a technique of the renderer with its parameters."""

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
class Level:
    """One answer of the scale: -2 (strongly the left image) to 2 (strongly the right one)."""

    value: int
    label: str


@dataclass(frozen=True)
class Familiarity:
    """The self-rating; label i stands for the value i + 1."""

    question: str
    labels: tuple[str, ...]


@dataclass(frozen=True)
class Render:
    """How the images are rendered: size (width, height) in pixels, samples a pixel along each
    axis.
    """

    size: tuple[int, int]
    supersample: int
    seed: int


@dataclass(frozen=True)
class HeadChoice:
    """The head: "default" or the file of a scan; the unit of its coordinates and its upward axis,
    None to find out.
    """

    name: str
    unit: str | None = None
    up: str | None = None


@dataclass(frozen=True)
class Study:
    """A study.

    `render` and `head` are None where the images are ready-made; `analysis` is what it declares of
    its analysis.
    """

    name: str
    title: str
    version: int
    seed: int
    framings: tuple[Framing, ...]
    techniques: tuple[Condition, ...]
    question: Question
    scale: tuple[Level, ...]
    familiarity: Familiarity
    consent: str
    render: Render | None = None
    head: HeadChoice | None = None
    analysis: dict = field(default_factory=dict)

    def record(self) -> dict:
        """What the manifest says of the study; `read_study` reads it back."""
        return {
            "name": self.name,
            "title": self.title,
            "version": self.version,
            "seed": self.seed,
            "framings": [{"name": f.name, "label": f.label} for f in self.framings],
            "techniques": [{"name": t.name, "label": t.label} for t in self.techniques],
            "question": vars(self.question),
            "scale": [vars(level) for level in self.scale],
            "familiarity": {
                "question": self.familiarity.question,
                "labels": list(self.familiarity.labels),
            },
            "consent": self.consent,
            **({"analysis": self.analysis} if self.analysis else {}),
        }


def load_study(path: str | Path) -> Study:
    """Read and validate a study's TOML file; InputError names the line or the dotted key at fault.

    A head that is a file is looked for beside the study.
    """
    path = Path(path)
    table = Table(_read_toml(path), str(path))
    render, head = table.table("render", default={}), table.table("head", default={})
    width, height = _size(render)
    study = read_study(
        table,
        render=Render(
            (width, height),
            render.number("supersample", 1, 4, default=2),
            render.number("seed", 0, 2**63 - 1, default=0),
        ),
        head=_head(head, path.parent),
    )
    for part in (table, render, head):
        part.end()
    return study


def read_study(table: Table, render: Render | None = None, head: HeadChoice | None = None) -> Study:
    """The study in a table of a TOML file or of a manifest; without `render`, images are
    ready-made.
    """
    asked = Table({**_thesis_asks(), **table.value}, table.source, table.key)
    framings = table.tables("framings", least=1)
    techniques = table.tables("techniques", least=2)
    study = Study(
        name=table.name("name"),
        title=table.text("title"),
        version=table.number("version", 1, 2**31 - 1),
        seed=table.number("seed", 0, 2**63 - 1),
        framings=tuple(Framing(t.name("name"), t.text("label")) for t in framings),
        techniques=tuple(_condition(t, rendered=render is not None) for t in techniques),
        question=_question(asked.table("question")),
        scale=_scale(asked),
        familiarity=_familiarity(asked.table("familiarity")),
        consent=asked.text("consent"),
        render=render,
        head=head,
        analysis=_analysis(table.table("analysis", default={})),
    )
    for group in (framings, techniques):
        refuse_doubles(group, "name")
        refuse_doubles(group, "label")
        for part in group:
            part.end()
    for key in _ASKED:
        table.take(key, object, default=None, expected="anything")
    return study


def _read_toml(path: Path) -> dict:
    try:
        return tomllib.loads(path.read_bytes().decode())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise InputError(f"{path}: line {line}: not UTF-8 text") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not TOML: {error}") from error


@cache
def _thesis_asks() -> dict:
    thesis = _read_toml(THESIS)
    return {key: thesis[key] for key in _ASKED}


def _condition(table: Table, rendered: bool) -> Condition:
    name, label = table.name("name"), table.text("label")
    if not rendered:
        return Condition(name, label, name)
    return Condition(
        name,
        label,
        table.name("technique", default=name),
        table.take("parameters", dict, default={}),
    )


def _question(table: Table) -> Question:
    question = Question(table.text("text"), table.text("left_label"), table.text("right_label"))
    table.end()
    return question


def _scale(table: Table) -> tuple[Level, ...]:
    levels = table.tables("scale", least=5, most=5)
    for expected, level in zip(range(-2, 3), levels):
        level.number("value", expected, expected)
    scale = tuple(Level(level.value["value"], level.text("label")) for level in levels)
    refuse_doubles(levels, "label")
    for level in levels:
        level.end()
    return scale


def _familiarity(table: Table) -> Familiarity:
    def five_texts(value: list) -> bool:
        return len(value) == 5 and all(isinstance(text, str) and text.strip() for text in value)

    labels = table.take(
        "labels", list, "a list of 5 texts, from the lowest to the highest", five_texts
    )
    familiarity = Familiarity(table.text("question"), tuple(labels))
    table.end()
    return familiarity


def _analysis(table: Table) -> dict:
    """What the study declares of its analysis before anybody is asked, as `analysis.options` names
    it; a rule that is false is off.
    """

    def number(of: Table, key: str, low: float, high: float, off: bool = False) -> None:
        def valid(value: float | bool) -> bool:
            return (off and value is False) or (
                not isinstance(value, bool) and low <= value <= high
            )

        of.take(
            key,
            (int, float),
            f"a number from {low:g} to {high:g}" + (" or false" if off else ""),
            valid,
            default=0,
        )

    number(table, "margin", 0.001, 4)
    number(table, "margin_jod", 0.001, 20)
    number(table, "level", 0.501, 0.999)
    table.number("resamples", 100, 1_000_000, default=0)
    table.number("seed", 0, 2**63 - 1, default=0)
    for key, known in (
        ("test", ("wilcoxon", "sign")),
        ("family", ("study", "framing")),
        ("ties", ("half", "drop")),
    ):
        table.take(
            key,
            str,
            f"one of {', '.join(known)}",
            lambda text, known=known: text in known,
            default=known[0],
        )
    rules = table.table("exclusions", default={})
    for key in ("answered_share", "one_side_share", "same_answer_share", "repeat_share"):
        number(rules, key, 0, 1, off=True)
    number(rules, "median_rt_ms", 0, 1e9, off=True)
    number(rules, "zeta", -1, 1, off=True)
    rules.end()
    table.end()
    return table.value


def _size(table: Table) -> tuple[int, int]:
    def pixels(value: list) -> bool:
        return len(value) == 2 and all(type(side) is int and 16 <= side <= 8192 for side in value)

    return tuple(
        table.take(
            "size", list, "[width, height] in pixels, 16 to 8192 each", pixels, default=[1920, 1080]
        )
    )


def _head(table: Table, beside: Path) -> HeadChoice:
    name = table.text("name", default="default")
    file = str(beside / name) if Path(name).suffix else name
    return HeadChoice(
        file, table.one_of("unit", UNITS, default=None), table.one_of("up", AXES, default=None)
    )
