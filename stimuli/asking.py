"""What people are asked beside the pairs, and how they take part."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.adaptive import AS_GOOD, LEAST_SHARE
from stimuli.errors import InputError
from stimuli.table import Table, refuse_doubles

#: Letters of a text that a participant can write.
LONGEST_TEXT = 2000


@dataclass(frozen=True)
class Participants:
    """shared_device: several people answer one after the other in one browser, as in a laboratory:
    the last page lets another person begin. Otherwise one browser is for one person.
    """

    shared_device: bool = False


def read_participants(table: Table) -> Participants:
    """The table `[participants]` of a study, checked."""
    participants = Participants(
        shared_device=table.take("shared_device", bool, "true or false", default=False)
    )
    table.end()
    return participants


#: How pairs come to people: dealt evenly (`stimuli.design`), or those that tell most
#: (`analysis.adaptive`).
DEALT, ADAPTIVE = "dealt", "adaptive"


@dataclass(frozen=True)
class Assignment:
    """Which of the study's pairs a participant is asked.

    pairs       how many, 0 for all
    design      `DEALT` or `ADAPTIVE`
    least_share of an adaptive design: pairs that were asked less than this share of their mean come
                first, 0 to 1
    as_good     of an adaptive design: of pairs that tell at least this share of the most that one
                tells, the one that was asked least is taken, 0 to 1; 1: always what tells most
    beside      of an adaptive design: the share of people who are dealt theirs, 0 to 1
    """

    pairs: int = 0
    design: str = DEALT
    least_share: float = LEAST_SHARE
    as_good: float = AS_GOOD
    beside: float = 0.0

    def record(self) -> dict:
        return {
            key: value
            for key, value in vars(self).items()
            if key == "pairs" or self.design == ADAPTIVE
        }


def read_assignment(table: Table, pairs: int) -> Assignment:
    """The table `[assignment]` of a study of so many pairs, checked."""
    some = table.number("pairs", 0, pairs, default=0)
    design = table.one_of("design", (DEALT, ADAPTIVE), default=DEALT)
    adaptive = design == ADAPTIVE
    if adaptive and some in (0, pairs):
        raise table.fault("pairs", some, f"from 1 to {pairs - 1}: who is asked all has no choice")

    def part(key: str) -> float:
        expected = "a number from 0 to 1" if adaptive else f'nothing, unless design = "{ADAPTIVE}"'
        value = table.take(
            key,
            (int, float),
            expected,
            lambda value: adaptive and type(value) is not bool and 0 <= value <= 1,
            default=getattr(Assignment, key),
        )
        return float(value)

    assignment = Assignment(some, design, part("least_share"), part("as_good"), part("beside"))
    table.end()
    return assignment


@dataclass(frozen=True)
class Trap:
    """A pair with an obvious answer: `better` against `worse` within a cell."""

    cell: str
    better: str
    worse: str


@dataclass(frozen=True)
class Quality:
    """How many questions of each further kind a participant is asked (see
    `analysis.manifest.KINDS`).

    fastest_ms: quicker answers are flagged; a simple reaction to a light takes about 200 ms (Luce
    1986, Response Times, ch. 2). clocks_apart_ms: so much longer than by the server's clock a
    browser's may say that an answer took; more is taken for the server's and marked
    """

    practice: int = 0
    repeats: int = 0
    swapped: int = 0
    bias: int = 0
    traps: tuple[Trap, ...] = ()
    fastest_ms: int = 200
    clocks_apart_ms: int = 1000

    @property
    def questions(self) -> int:
        return self.practice + self.repeats + self.swapped + self.bias + len(self.traps)

    def expected(self, kind: str, cell: str, left: str, right: str) -> int | None:
        """The sign of the answer that is expected of a trial: -1 left, 1 right, 0 neither; None
        where none is.
        """
        if kind == "bias":
            return 0
        if kind == "trap":
            for trap in self.traps:
                if trap.cell == cell and {trap.better, trap.worse} == {left, right}:
                    return -1 if trap.better == left else 1
        return None

    def record(self, levels: dict[str, dict[str, str]]) -> dict:
        """As a study's table; levels: of each cell, by its name."""
        counts = {k: v for k, v in vars(self).items() if k != "traps"}
        traps = [
            {**levels[one.cell], "better": one.better, "worse": one.worse} for one in self.traps
        ]
        return {**counts, "traps": traps}


def read_quality(
    table: Table,
    cells: dict[str, dict[str, str]],
    techniques: Sequence[str],
    pairs: int,
) -> Quality:
    """The table `[quality]` of a study, checked. cells: the levels of each cell, by its name;
    pairs: how many a participant is asked.
    """
    counts = {
        name: table.number(name, 0, 1000, default=0)
        for name in ("practice", "repeats", "swapped", "bias")
    }
    if counts["repeats"] + counts["swapped"] > pairs // 2:
        raise InputError(
            f"{table.source}: {table.key}: repeats and swapped are "
            f"{counts['repeats'] + counts['swapped']} together, expected at most {pairs // 2}: "
            "half of a participant's pairs, since what is asked again was asked in the first half"
        )
    if counts["practice"] > pairs:
        raise table.fault("practice", counts["practice"], f"at most {pairs}, a participant's pairs")
    traps = []
    table.take("traps", list, "a list of tables", default=[])
    for entry in table.tables("traps", least=0) if "traps" in table.value else []:
        better, worse = entry.one_of("better", techniques), entry.one_of("worse", techniques)
        if better == worse:
            raise entry.fault("worse", worse, "another technique than better")
        given = {}
        for factor in next(iter(cells.values())):
            known = list(dict.fromkeys(levels[factor] for levels in cells.values()))
            only = {"default": known[0]} if len(known) == 1 else {}
            given[factor] = entry.one_of(factor, known, **only)
        entry.end()
        cell = next((name for name, levels in cells.items() if levels == given), None)
        if cell is None:
            raise InputError(f"{entry.source}: {entry.key}: {given} is no cell of the study")
        trap = Trap(cell, better, worse)
        if any({*vars(one).values()} == {*vars(trap).values()} for one in traps):
            raise InputError(f"{entry.source}: {entry.key}: the same pair a second time")
        traps.append(trap)
    limits = {
        name: table.number(name, 0, 60_000, default=getattr(Quality, name))
        for name in ("fastest_ms", "clocks_apart_ms")
    }
    table.end()
    return Quality(traps=tuple(traps), **counts, **limits)


@dataclass(frozen=True)
class Ask:
    """A question of the study's own, before or after the pairs; its answer is a column `name`.

    kind        "choice" of one of `options`, "scale" of as many points as there are options, whose
                ends at least have words, "text" that is written
    required    whether it must be answered; what is left out is an empty cell
    """

    name: str
    kind: str
    text: str
    options: tuple[str, ...] = ()
    required: bool = True

    def value(self, given: str) -> str | None:
        """What is stored of a form's field: the option's number from 1, or the text; "" where
        nothing was answered, None where it cannot stand.
        """
        given = given.strip()
        if not given:
            return None if self.required else ""
        if self.kind == "text":
            return given[:LONGEST_TEXT]
        known = [str(place) for place in range(1, len(self.options) + 1)]
        return given if given in known else None

    def record(self) -> dict:
        return {**vars(self), "options": list(self.options)}

    @property
    def texts(self) -> dict:
        """What people read of it."""
        return {"text": self.text, **({"options": list(self.options)} if self.options else {})}

    def worded(self, texts: dict) -> "Ask":
        """The same in other words."""
        return replace(self, text=texts["text"], options=tuple(texts.get("options", ())))


@dataclass(frozen=True)
class Reason:
    """What is asked about a choice, if anything: words to tick and a free text, both optional.

    share: of the questions, drawn by participant and question
    """

    share: float = 0.0
    text: str = "Why?"
    ticks: tuple[str, ...] = ()
    free: bool = True

    def applies(self, seed: str, order: int) -> bool:
        """Whether the question at a place of a participant's order (`seed` names both) asks it."""
        drawn = int.from_bytes(hashlib.sha256(f"reason/{seed}/{order}".encode()).digest()[:8])
        return drawn < self.share * 2**64

    def record(self) -> dict:
        return {**vars(self), "ticks": list(self.ticks)}


@dataclass(frozen=True)
class Pages:
    """Texts of the study's own, paragraphs apart by empty lines; "" for none.

    instructions    before the first question, on a page of their own
    debrief         after the last one
    break_every     so many questions are followed by a page that offers a rest; 0: none
    seconds         that most people take for a question, from and to: the thesis's 30 took 10 to 15
                    minutes; the consent's {minutes} follow from it
    """

    instructions: str = ""
    debrief: str = ""
    break_every: int = 0
    seconds: tuple[int, int] = (20, 30)

    def record(self) -> dict:
        return {**vars(self), "seconds": list(self.seconds)}


def read_asks(tables: list[Table], taken: Sequence[str]) -> tuple[Ask, ...]:
    """`[[before]]` or `[[after]]` of a study, checked. taken: names that other columns have."""
    asks = []
    for table in tables:
        name, kind = table.name("name"), table.one_of("kind", ("choice", "scale", "text"))
        if name in taken:
            raise table.fault("name", name, "a name that no other column has")
        options: tuple[str, ...] = ()
        if kind != "text":
            least = "a list of two texts or more"
            if kind == "scale":
                least += ", one a point; those between the ends may be empty"
            given = table.take("options", list, least, lambda v, k=kind: _labels(v, k == "scale"))
            options = tuple(given)
        required = table.take("required", bool, "true or false", default=True)
        if kind == "text" and "options" in table.value:
            table.take("options", list, "no options", lambda v: not v)
        asks.append(Ask(name, kind, table.text("text"), options, required))
        table.end()
    refuse_doubles(tables, "name")
    return tuple(asks)


def _labels(value: list, blanks: bool) -> bool:
    texts = len(value) >= 2 and all(isinstance(one, str) for one in value)
    shown = [value[0], value[-1]] if texts and blanks else value
    return texts and all(one.strip() for one in shown)


def read_reason(table: Table, why: str = Reason.text) -> Reason:
    """`[reason]` of a study, checked; `why` is asked where it does not say what."""
    share = table.take(
        "share", (int, float), "a number from 0 to 1", lambda v: 0 <= v <= 1, default=0.0
    )
    ticks = table.take("ticks", list, "a list of texts", lambda v: _ticks(v), default=[])
    reason = Reason(
        float(share),
        table.text("text", default=why),
        tuple(ticks),
        table.take("free", bool, "true or false", default=True),
    )
    table.end()
    if reason.share and not (reason.ticks or reason.free):
        raise table.fault("free", False, "true, where there are no ticks")
    return reason


def _ticks(value: list) -> bool:
    return all(isinstance(one, str) and one.strip() for one in value) and len(value) <= 20


def read_pages(table: Table) -> Pages:
    """`[pages]` of a study, checked."""
    pages = Pages(
        table.text("instructions", default="") if table.value.get("instructions") else "",
        table.text("debrief", default="") if table.value.get("debrief") else "",
        table.number("break_every", 0, 1000, default=0),
        tuple(
            table.take(
                "seconds",
                list,
                "[from, to] in whole seconds a question, 1 to 3600",
                lambda v: (
                    len(v) == 2 and all(type(s) is int for s in v) and 1 <= v[0] <= v[1] <= 3600
                ),
                default=list(Pages.seconds),
            )
        ),
    )
    for key in ("instructions", "debrief"):
        table.take(key, str, default="")
    table.end()
    return pages


#: What colour plates tell: who lacks the cones for long, middle or short wavelengths (red and green
#: are confused by the first two, blue and yellow by the third).
PLATE_KINDS = ("protan", "deutan", "tritan")


@dataclass(frozen=True)
class Screen:
    """A page that looks at the screen before the questions.

    check       whether there is one
    least_px    the smallest window, width and height in screen pixels
    otherwise   of a smaller one: "warn" says so and lets people go on, "refuse" does not
    card        measure the size of a pixel by a card (ISO/IEC 7810 ID-1)
    gamma       match a grey to fine stripes, and count the darkest and brightest steps
    distance_cm at which people are asked to sit; degrees of visual angle follow from it
    plates      so many plates of dots that tell who sees colours as most do, 0 to 12; 0: none
    plates_read who reads fewer of them is thanked and asked no further; 0: nobody is
    plate_kinds what those after the first can be read by, in turn: of `PLATE_KINDS`
    """

    check: bool = False
    least_px: tuple[int, int] = (0, 0)
    otherwise: str = "warn"
    card: bool = True
    gamma: bool = True
    distance_cm: int = 60
    plates: int = 0
    plates_read: int = 0
    plate_kinds: tuple[str, ...] = ("protan", "deutan")

    def record(self) -> dict:
        lists = {"least_px": list(self.least_px), "plate_kinds": list(self.plate_kinds)}
        return {**vars(self), **lists}


def read_screen(table: Table) -> Screen:
    """`[screen]` of a study, checked; the page is there where the table is."""

    def size(value: list) -> bool:
        return len(value) == 2 and all(type(side) is int and 0 <= side <= 20000 for side in value)

    def kinds(value: list) -> bool:
        return bool(value) and all(one in PLATE_KINDS for one in value)

    truth = {"kind": bool, "expected": "true or false"}
    known = f"a list of {', '.join(PLATE_KINDS)}"
    screen = Screen(
        table.take("check", default=bool(table.value), **truth),
        tuple(table.take("least_px", list, "[width, height] in pixels", size, default=[0, 0])),
        table.one_of("otherwise", ("warn", "refuse"), default="warn"),
        table.take("card", default=True, **truth),
        table.take("gamma", default=True, **truth),
        table.number("distance_cm", 10, 1000, default=60),
        plates := table.number("plates", 0, 12, default=0),
        table.number("plates_read", 0, plates, default=0),
        tuple(table.take("plate_kinds", list, known, kinds, default=list(Screen.plate_kinds))),
    )
    table.end()
    return screen
