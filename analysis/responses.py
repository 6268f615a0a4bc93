"""Reads a table of answers, one row a trial, and makes it tidy. Nothing is dropped in silence.

A row that cannot be used becomes a `Finding` with its line number and its reason; a fault of the
whole file is an InputError.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import codebook as codebooks
from analysis.codebook import FRAMING, Codebook
from analysis.errors import InputError
from analysis.options import FEWEST_PEOPLE

REQUIRED = (
    "participant",
    "familiarity",
    "framing",
    "left",
    "right",
    "answer",
    "order",
    "rt_ms",
    "started_at",
)
OPTIONAL = ("simulated", "study", "study_version")
REPEATS = ("participant", "framing", "a", "b", "preference", "first_preference")
#: Columns of an answer that no answers can be grouped by.
NO_FACTOR = ("participant", "left", "right", "answer", "order", "rt_ms", "started_at")
#: So many levels a factor may have; and a factor of numbers, beyond which it is a measurement and
#: no group.
MOST_LEVELS, MOST_NUMBERS = 30, 10

_INTEGER = r"[+-]?[0-9]{1,9}(?:\.0*)?"
_NUMBER = r"\+?[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]{1,2})?"


@dataclass(frozen=True)
class Finding:
    """A row that is not counted.

    `kind` is 'malformed' or 'duplicate'; `last_line` differs where a row spans several lines.
    """

    line: int
    last_line: int
    kind: str
    reason: str
    row: str

    def __str__(self) -> str:
        lines = (
            f"line {self.line}"
            if self.line == self.last_line
            else f"lines {self.line} to {self.last_line}"
        )
        return f"{lines}: {self.reason}"


@dataclass(frozen=True)
class Responses:
    """A tidy table of answers and what is known about it.

    frame has one row an answer:
        participant     category
        familiarity     int8, 1 to 5
        framing         ordered category, in the order of the codebook; with another factor than
                        'framing', its level
        image_framing   ordered category: the framing of the images, whatever the factor; with
                        the levels of the study's further factors, joined by dots
        a, b            ordered categories: the pair, a before b in the order of techniques
        preference      int8, -2 to 2, oriented to the pair: negative prefers a, positive prefers b
        strength        int8, 0 to 2: |preference|
        winner          ordered category: the preferred technique, missing where strength is 0
        a_left          bool: a was shown on the left
        answer          int8, -2 to 2, as given: negative prefers the left image
        order           int32, 1 is the first question
        rt_ms           float64, milliseconds
        started_at      datetime, UTC
        line            int64, where the row begins in the file

    grouping says, where the factor is not 'framing', what its levels hold; notes begin with it.

    repeats has one row for each question that a participant was asked again (the same pair under
    another `order`; it is not counted):
        participant, framing, a, b, preference (the later answer), first_preference (the one that
        counts)
    """

    frame: pd.DataFrame
    codebook: Codebook
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    simulated: bool = False
    rows: int = 0
    source: str = ""
    sha256: str = ""
    grouping: tuple[str, ...] = ()
    repeats: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=REPEATS))

    @cached_property
    def items(self) -> dict[str, tuple[str, ...]]:
        """Framing -> the techniques that have answers there, both in the order of the codebook."""
        items = {}
        for framing in self.codebook.framings:
            here = self.frame[self.frame.framing == framing]
            seen = set(here.a) | set(here.b)
            if seen:
                items[framing] = tuple(name for name in self.codebook.techniques if name in seen)
        return items

    @property
    def participants(self) -> int:
        return self.frame.participant.nunique()


def read_responses(
    path: str | Path,
    codebook: Codebook | None = None,
    order: Iterable[str] | None = None,
    factor: str = FRAMING,
) -> Responses:
    """Read responses.csv (UTF-8 with or without BOM, comma separated).

    See `Responses` for what comes out.

    codebook: the study's (`codebook.read_manifest`); without it names, labels and order come from
    the table. order: every technique once; overrides the order of the codebook. factor: the column
    that answers are grouped by, everywhere that a framing is meant without it: every table keeps
    its columns, and
        `framing` holds the factor's level. Which answers are duplicates depends on it: one pair at
        one framing counts once a level.
    """
    _allowed(factor)
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    further = codebook.factors if codebook else ()
    raw, lines, findings = _parse(str(path), data, factor, further)
    return _tidy(
        str(path), raw, lines, findings, codebook, order, factor, hashlib.sha256(data).hexdigest()
    )


def responses_from_records(
    records: Iterable[Mapping[str, object]],
    codebook: Codebook | None = None,
    order: Iterable[str] | None = None,
    factor: str = FRAMING,
) -> Responses:
    """The same from mappings with the columns of responses.csv, for answers that are not in a file;
    lines count from 1.
    """
    _allowed(factor)
    raw = pd.DataFrame.from_records(list(records))
    missing = [name for name in REQUIRED if name not in raw]
    if missing:
        raise InputError(f"the records lack {', '.join(missing)}; expected {', '.join(REQUIRED)}")
    if factor not in raw:
        raise InputError(_lacking(factor, raw))
    blank = raw[factor].isna() & (factor not in REQUIRED)
    further = codebook.factors if codebook else ()
    wanted = dict.fromkeys((*REQUIRED, *OPTIONAL, factor, *further))
    raw = raw[[name for name in wanted if name in raw]]
    raw = raw.map(lambda value: str(int(value)) if isinstance(value, bool) else str(value)).astype(
        object
    )
    raw["level"] = raw[factor].str.strip().mask(blank, "")
    raw["line"] = raw["last_line"] = np.arange(1, len(raw) + 1)
    lines = [",".join(values) for values in raw[list(REQUIRED)].to_numpy()]
    return _tidy("the records", raw, lines, [], codebook, order, factor, "")


def _allowed(factor: str) -> None:
    if factor in NO_FACTOR:
        raise InputError(
            f"the factor is {factor!r}, which no answers can be grouped by; expected a column "
            "like framing or familiarity"
        )


def _lacking(factor: str, columns: Iterable[str]) -> str:
    return (
        f"has no column {factor!r} to group answers by; expected one of "
        f"{', '.join(name for name in columns if name not in NO_FACTOR)}"
    )


def _parse(
    name: str, data: bytes, factor: str, further: tuple[str, ...] = ()
) -> tuple[pd.DataFrame, list[str], list[Finding]]:
    """The cells as text, with line and last_line; the lines of the file; findings for rows without
    the header's fields.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{name}: line {line}: byte 0x{data[error.start]:02x} is not UTF-8; save the "
            "table as 'CSV UTF-8'"
        ) from None
    if not text.strip():
        raise InputError(f"{name}: is empty, expected a header and one row an answer")
    lines = list(io.StringIO(text, newline=""))
    reader = csv.reader(iter(lines), strict=True)
    try:
        header = [cell.strip() for cell in next(reader)]
    except csv.Error as error:
        raise InputError(f"{name}: line 1: the header is no CSV: {error}") from None
    missing = [column for column in REQUIRED if column not in header]
    if missing:
        hint = next((f"; is it separated by {mark!r}?" for mark in ";\t" if mark in lines[0]), "")
        raise InputError(
            f"{name}: has no column {', '.join(missing)}{hint}; expected {','.join(REQUIRED)}"
        )
    if factor not in header:
        raise InputError(f"{name}: {_lacking(factor, header)}")
    wanted = [
        column
        for column in dict.fromkeys((*REQUIRED, *OPTIONAL, factor, *further))
        if column in header
    ]
    twice = [column for column in wanted if header.count(column) > 1]
    if twice:
        raise InputError(f"{name}: has the column {', '.join(twice)} twice")

    places = [header.index(column) for column in wanted]
    cells: list[tuple[str, ...]] = []
    spans: list[tuple[int, int]] = []
    findings: list[Finding] = []
    while True:
        first = reader.line_num + 1
        try:
            row = next(reader)
            fault = f"has {len(row)} fields, expected {len(header)} as in the header"
        except StopIteration:
            break
        except csv.Error as error:
            row, fault = None, f"is no CSV: {error}"
            if reader.line_num >= len(lines) and "unexpected end" in str(error):
                raise InputError(
                    f"{name}: line {first}: a quotation mark is opened and never closed"
                ) from None
        if row == []:
            continue
        if row is not None and len(row) == len(header):
            cells.append(tuple(row[place].strip() for place in places))
            spans.append((first, reader.line_num))
        else:
            findings.append(_finding(first, reader.line_num, "malformed", fault, lines))
    if not cells and not findings:
        raise InputError(f"{name}: has a header and no rows, expected one row an answer")
    raw = pd.DataFrame(cells, columns=wanted, dtype=object)
    raw["level"] = raw[factor]
    raw["line"], raw["last_line"] = np.array(spans, dtype=np.int64).reshape(-1, 2).T
    return raw, lines, findings


def _finding(first: int, last: int, kind: str, reason: str, lines: list[str]) -> Finding:
    return Finding(
        int(first), int(last), kind, reason, "".join(lines[first - 1 : last]).rstrip("\r\n")
    )


def _tidy(
    name: str,
    raw: pd.DataFrame,
    lines: list[str],
    findings: list[Finding],
    codebook: Codebook | None,
    order: Iterable[str] | None,
    factor: str,
    sha256: str,
) -> Responses:
    rows = len(raw) + len(findings)
    values, reasons = _checked(raw, codebook, factor)
    simulated = _one_kind(name, raw)
    findings = findings + [
        _finding(raw.line[at], raw.last_line[at], "malformed", _some(reasons[at], 3, "; "), lines)
        for at in sorted(reasons)
    ]
    raw["image"] = raw.framing
    for column in codebook.factors if codebook else ():
        if column in raw:
            raw["image"] = raw.image + "." + raw[column]
    frame = (
        raw[["participant", "framing", "image", "left", "right", "line", "last_line"]]
        .join(values)
        .drop(index=list(reasons))
    )
    if frame.empty:
        first = min(findings, key=lambda finding: finding.line)
        raise InputError(f"{name}: none of its {rows} rows can be used; {first}")

    if codebook is None:
        codebook = codebooks.from_table(frame.framing, frame[["left", "right"]].to_numpy().ravel())
    if order is not None:
        present = set(frame.left) | set(frame.right)
        codebook = codebook.ordered(
            order, [name for name in codebook.techniques if name in present]
        )

    frame = _oriented(frame, codebook)
    if factor != FRAMING:
        level = raw.level.drop(index=list(reasons))
        if factor == "familiarity":
            level = (
                frame.groupby("participant", observed=True)
                .familiarity.transform("first")
                .astype(str)
            )
        codebook = codebook.by(factor, *_levels(name, factor, level))
        frame["framing"] = pd.Categorical(level, codebook.framings, ordered=True)
    key = ["participant", "framing", "image_framing", "a", "b"]
    again = frame.duplicated(key)
    asked_again = {}
    if again.any():
        firsts = frame.drop_duplicates(key)[[*key, "line", "order", "preference"]]
        firsts = firsts.rename(
            columns={"line": "first", "order": "first_order", "preference": "first_preference"}
        )
        repeats = frame[again].merge(firsts, on=key)
        asked_again = {
            "repeats": repeats.loc[repeats.order != repeats.first_order, list(REPEATS)].reset_index(
                drop=True
            )
        }
        findings += [
            _finding(
                row.line,
                row.last_line,
                "duplicate",
                f"{row.participant!r} answered {_where(row, codebook)}, {row.a} against "
                f"{row.b}, on line {row.first} already, "
                "which is the one that counts",
                lines,
            )
            for row in repeats.itertuples()
        ]
        frame = frame[~again]
    frame = frame.drop(columns="last_line").reset_index(drop=True)
    crossed = frame.image_framing.nunique() > frame.framing.nunique()
    grouped = factor != FRAMING or crossed
    grouping = tuple(_grouping(frame, codebook)) if grouped else ()
    return Responses(
        frame=frame,
        codebook=codebook,
        findings=tuple(sorted(findings, key=lambda finding: finding.line)),
        notes=(*grouping, *_notes(frame, raw, codebook)),
        grouping=grouping,
        simulated=simulated,
        rows=rows,
        source=Path(name).name,
        sha256=sha256,
        **asked_again,
    )


def questions(frame: pd.DataFrame, codebook: Codebook) -> list[str]:
    """The columns that tell one question from another: the factor's level is one where somebody
    answered the same images at several.
    """
    key = ["image_framing", "a", "b"]
    within = codebook.factor != FRAMING and frame.duplicated(["participant", *key]).any()
    return ["framing", *key] if within else key


def _levels(name: str, factor: str, level: pd.Series) -> tuple[list[str], str]:
    """The levels of a factor in order, and the rule of the order; refuses a column that is no
    factor.
    """
    levels = list(pd.unique(level))
    numbers = pd.to_numeric(pd.Series(levels), errors="coerce")
    numeric = bool(np.isfinite(numbers).all())
    most = MOST_NUMBERS if numeric else MOST_LEVELS
    if len(levels) > most:
        got = (
            f"{len(levels)} numbers from {numbers.min():g} to {numbers.max():g}"
            if numeric
            else f"{len(levels)} levels"
        )
        raise InputError(
            f"{name}: the factor {factor!r} has {got}, expected at most {most}; put them into "
            "a few groups in a column of their own"
        )
    if not numeric:
        return levels, "first appearance in the table"
    return [
        levels[place] for place in np.argsort(numbers.to_numpy(), kind="stable")
    ], "from the lowest number to the highest"


def _where(row: object, codebook: Codebook) -> str:
    if codebook.factor == FRAMING:
        return row.image_framing
    return f"{codebook.framing_label(row.framing)}, {row.image_framing}"


def _grouping(frame: pd.DataFrame, codebook: Codebook) -> Iterable[str]:
    """What the levels of a factor hold, and how what they hold is taken."""
    held = frame.groupby("framing", observed=True).agg(
        people=("participant", "nunique"), answers=("answer", "size")
    )
    sizes = "; ".join(
        (
            f"{codebook.framing_label(row.Index)}: {_plural(row.people, 'participant')}, "
            f"{_plural(row.answers, 'answer')}"
        )
        for row in held.itertuples()
    )
    holds = (
        "" if codebook.factor == FRAMING else "; the column framing of every table holds its levels"
    )
    yield f"Answers are grouped by {codebook.spoken} ({sizes}){holds}."
    if len(held) == 1:
        yield f"There is one {codebook.level}: nothing is compared over it."
    few = [codebook.framing_label(level) for level in held.index[held.people < FEWEST_PEOPLE]]
    if few:
        yield (
            f"{_some(few)}: fewer than {FEWEST_PEOPLE} participants, which resampled "
            "intervals and tests on participants need."
        )
    here = (
        frame.drop_duplicates(["framing", "image_framing"])
        .groupby("framing", observed=True)
        .image_framing
    )
    several = here.nunique()
    if (several > 1).any():
        where = [codebook.framing_label(level) for level in several.index[several > 1]]
        names = [
            name
            for name in frame.image_framing.cat.categories
            if (frame.image_framing == name).any()
        ]
        pooled = "combinations of levels" if codebook.factors else "framings"
        yield (
            f"{'Every ' + codebook.level if len(where) == len(held) else _some(where)} pools "
            f"{pooled} ({_some(names)}). Answers of one "
            f"participant about one pair at several {pooled} are repeated measures: tests "
            "take the participant's mean, and intervals "
            "resample participants with all of their answers; counts, medians, worths and "
            "AHP take every answer."
        )
    if len(held) > 1 and "framing" not in questions(frame, codebook):
        yield (
            f"Nobody judged the same images at several {codebook.levels}: taken together, the "
            "answers are those of the study without "
            "this grouping."
        )


def _checked(
    raw: pd.DataFrame, codebook: Codebook | None, factor: str
) -> tuple[pd.DataFrame, dict[int, list[str]]]:
    """The numeric columns as numbers, and for each row that fails, by its position, why."""
    values = pd.DataFrame(index=raw.index)
    for column, pattern in (
        ("familiarity", _INTEGER),
        ("answer", _INTEGER),
        ("order", _INTEGER),
        ("rt_ms", _NUMBER),
    ):
        values[column] = pd.to_numeric(
            raw[column].where(raw[column].str.fullmatch(pattern)), errors="coerce"
        )
    values["started_at"] = pd.to_datetime(
        raw.started_at, format="ISO8601", utc=True, errors="coerce"
    )

    checks = [
        (column, raw[column] == "", "a name")
        for column in ("participant", "framing", "left", "right")
    ]
    checks += [
        ("familiarity", ~values.familiarity.between(1, 5), "an integer from 1 to 5"),
        ("answer", ~values.answer.between(-2, 2), "an integer from -2 to 2"),
        ("order", ~(values.order >= 1), "an integer from 1"),
        ("rt_ms", ~np.isfinite(values.rt_ms), "milliseconds, a number from 0"),
        ("started_at", values.started_at.isna(), "a time in ISO 8601"),
    ]
    if factor not in REQUIRED:
        checks.append(("level", raw.level == "", "a level to group answers by"))
    if "simulated" in raw:
        checks.append(("simulated", ~raw.simulated.isin(["0", "1"]), "0 or 1"))
    if codebook is not None:
        for column, names in (
            ("framing", codebook.framings),
            ("left", codebook.techniques),
            ("right", codebook.techniques),
        ):
            expected = f"one of the study's: {', '.join(names)}"
            checks.append((column, ~raw[column].isin(names) & (raw[column] != ""), expected))

    reasons: dict[int, list[str]] = {}
    for column, bad, expected in checks:
        for at in np.flatnonzero(bad):
            reasons.setdefault(at, []).append(
                f"{factor if column == 'level' else column} is {raw[column][at]!r:.60}, "
                f"expected {expected}"
            )
    for at in np.flatnonzero((raw.left == raw.right) & (raw.left != "")):
        reasons.setdefault(at, []).append(
            f"left and right are both {raw.left[at]!r:.60}, expected two techniques"
        )
    return values, reasons


def _one_kind(name: str, raw: pd.DataFrame) -> bool:
    """Whether the answers are simulated; refuses a table that mixes them with real ones."""
    if "simulated" not in raw:
        return False
    first = {
        flag: raw.line[raw.simulated == flag].min()
        for flag in ("0", "1")
        if (raw.simulated == flag).any()
    }
    if len(first) == 2:
        raise InputError(
            f"{name}: mixes real answers (first on line {first['0']}) and simulated ones "
            f"(first on line {first['1']}); "
            "expected one kind"
        )
    return "1" in first


def _oriented(frame: pd.DataFrame, codebook: Codebook) -> pd.DataFrame:
    """Adds pair, preference, strength and winner; see `Responses`."""
    techniques = pd.CategoricalDtype(codebook.techniques, ordered=True)
    left, right = (
        pd.Categorical(frame[side], dtype=techniques).codes for side in ("left", "right")
    )
    a_left = left < right
    preference = np.where(a_left, frame.answer, -frame.answer).astype(np.int8)
    a, b = np.minimum(left, right), np.maximum(left, right)
    winner = np.where(preference < 0, a, np.where(preference > 0, b, -1))
    return pd.DataFrame(
        {
            "participant": frame.participant.astype("category"),
            "familiarity": frame.familiarity.astype(np.int8),
            "framing": pd.Categorical(frame.framing, codebook.framings, ordered=True),
            "image_framing": pd.Categorical(frame.image, _images(frame, codebook), ordered=True),
            "a": pd.Categorical.from_codes(a, dtype=techniques),
            "b": pd.Categorical.from_codes(b, dtype=techniques),
            "preference": preference,
            "strength": np.abs(preference),
            "winner": pd.Categorical.from_codes(winner, dtype=techniques),
            "a_left": a_left,
            "answer": frame.answer.astype(np.int8),
            "order": frame.order.astype(np.int32),
            "rt_ms": frame.rt_ms.astype(float),
            "started_at": frame.started_at,
            "line": frame.line,
            "last_line": frame.last_line,
        },
        index=frame.index,
    )


def _images(frame: pd.DataFrame, codebook: Codebook) -> list[str]:
    """The cells of a study in its order: framings, or these with the levels of further factors."""
    if not codebook.factors:
        return list(codebook.framings)
    place = {framing: k for k, framing in enumerate(codebook.framings)}
    return sorted(frame.image.unique(), key=lambda name: (place[name.split(".")[0]], name))


def _notes(frame: pd.DataFrame, raw: pd.DataFrame, codebook: Codebook) -> Iterable[str]:
    """What a reader should know of rows that are counted all the same."""
    levels = frame.groupby("participant", observed=True).familiarity.nunique()
    unsure = list(levels.index[levels > 1])
    if unsure:
        yield (
            f"{_some(unsure)} rated their familiarity in more than one way; the first "
            "rating is used."
        )
    asked = len(frame[questions(frame, codebook)].drop_duplicates())
    answers = frame.participant.value_counts()
    short = sorted(answers.index[answers < asked])
    if short:
        yield (
            f"{_some(short)} answered fewer than the {asked} questions in the table; what "
            "they answered is counted."
        )
    for column in ("study", "study_version"):
        if column in raw:
            several = sorted(raw[column].unique())
            if len(several) > 1:
                yield (
                    f"The table pools answers with {len(several)} values of {column}: "
                    f"{_some(several)}."
                )
    present = set(frame.a) | set(frame.b)
    for framing in codebook.framings:
        here = frame[frame.framing == framing]
        absent = [
            name
            for name in codebook.techniques
            if name in present and name not in set(here.a) | set(here.b)
        ]
        if here.empty:
            yield f"No answers at {framing}."
        elif absent:
            yield f"No answers at {framing} for {_some(absent)}."
    absent = [name for name in codebook.techniques if name not in present]
    if absent:
        yield f"No answers at all for {_some(absent)}."


def _plural(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"


def _some(names: list[str], most: int = 6, mark: str = ", ") -> str:
    """The names in one phrase, cut after `most`."""
    shown = mark.join(map(str, names[:most]))
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
