"""Reads a table of answers, one row a trial, and makes it tidy. Nothing is dropped in silence.

Only what identifies or values an answer can cost it: participant, framing (and what the study
varies beside it), left, right, answer, simulated. Such a row becomes a `Finding` with its line
number and its reason. What is measured beside the answer (`MEASURED`) may be missing: the answer
counts, the value is a `Missing` with line and reason. A fault of the whole file is an InputError.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from analysis import codebook as codebooks
from analysis import delimited
from analysis.codebook import FRAMING, Codebook
from analysis.errors import InputError
from analysis.manifest import KINDS
from analysis.options import FEWEST_PEOPLE

#: Columns that identify an answer or value it; without them it cannot be counted.
IDENTIFYING = ("participant", "framing", "left", "right", "answer")
#: Columns of what was measured beside an answer; each may be empty, or not be there at all.
MEASURED = ("familiarity", "order", "rt_ms", "started_at")
#: The columns of responses.csv that the analysis reads, in their usual order.
REQUIRED = (
    *("participant", "familiarity", "framing", "left", "right", "answer"),
    *("order", "rt_ms", "started_at"),
)
OPTIONAL = ("simulated", "study", "study_version", "kind", "expected")
#: Those whose answers say how a person looks, and nothing of the techniques.
CHECKING = ("practice", "trap", "bias")
CHECKS = ("participant", "kind", "left", "right", "answer", "expected")
REPEATS = ("participant", "framing", "a", "b", "preference", "first_preference")
#: Columns of an answer that no answers can be grouped by.
NO_FACTOR = ("participant", "left", "right", "answer", "order", "rt_ms", "started_at")
#: So many levels a factor may have; and a factor of numbers, beyond which it is a measurement and
#: no group.
MOST_LEVELS, MOST_NUMBERS = 30, 10

#: Where no study declares the levels of its self-rating, these are taken for ratings.
UNDECLARED_RATINGS = (0, 10)


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
class Missing:
    """A value that is not there or not readable; its answer is counted all the same.

    `value` is the cell as written, '' where it is empty.
    """

    line: int
    column: str
    value: str
    expected: str


@dataclass(frozen=True)
class Responses:
    """A tidy table of answers and what is known about it.

    frame has one row an answer:
        participant     category
        familiarity     float64, one of `codebook.ratings`, NaN where it is missing
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
        order           float64, 1 is the first question, NaN where it is missing
        rt_ms           float64, milliseconds, NaN where it is missing
        started_at      datetime, UTC, NaT where it is missing
        line            int64, where the row begins in the file

    grouping says, where the factor is not 'framing', what its levels hold; notes begin with it.

    missing has one entry for each value of `MEASURED` that is not there; findings one for each row
    that is not counted.

    checks has one row for each answer of a kind in `CHECKING`, which is not counted:
        participant, kind, left, right, answer (-2 to 2), expected (its expected sign, NaN for none)

    repeats has one row for each question that a participant was asked again (the same pair under
    another `order`; it is not counted):
        participant, framing, a, b, preference (the later answer), first_preference (the one that
        counts)
    """

    frame: pd.DataFrame
    codebook: Codebook
    findings: tuple[Finding, ...] = ()
    missing: tuple[Missing, ...] = ()
    notes: tuple[str, ...] = ()
    simulated: bool = False
    rows: int = 0
    source: str = ""
    sha256: str = ""
    grouping: tuple[str, ...] = ()
    repeats: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=REPEATS))
    checks: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=CHECKS))

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

    @cached_property
    def ratings(self) -> pd.Series:
        """Participant -> their first self-rating of familiarity, NaN where they gave none."""
        return self.frame.groupby("participant", observed=True).familiarity.first()


def read_responses(
    path: str | Path,
    codebook: Codebook | None = None,
    order: Iterable[str] | None = None,
    factor: str = FRAMING,
    varied: Iterable[str] = (),
) -> Responses:
    """Read responses.csv, in any dialect that `analysis.delimited` knows.

    See `Responses` for what comes out.

    codebook: the study's (`codebook.read_manifest`); without it names, labels and order come from
    the table. order: every technique once; overrides the order of the codebook. factor: the column
    that answers are grouped by, everywhere that a framing is meant without it: every table keeps
    its columns, and
        `framing` holds the factor's level. Which answers are duplicates depends on it: one pair at
        one framing counts once a level. varied: columns that tell images apart beside framing,
        where no codebook says which do.
    """
    _allowed(factor)
    for column in varied:
        _allowed(column)
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    further = (codebook.factors if codebook else ()) or tuple(varied)
    raw, lines, findings, dialect = _parse(str(path), data, factor, further)
    absent = [column for column in varied if column not in raw]
    if absent:
        raise InputError(f"{path}: {_lacking(absent[0], dialect.header)}")
    digest = hashlib.sha256(data).hexdigest()
    return _tidy(str(path), raw, lines, findings, codebook, order, factor, digest, dialect, further)


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
    absent = [name for name in IDENTIFYING if name not in raw]
    if absent:
        raise InputError(f"the records lack {', '.join(absent)}; expected {', '.join(REQUIRED)}")
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
    there = [name for name in REQUIRED if name in raw]
    lines = [",".join(values) for values in raw[there].to_numpy()]
    return _tidy("the records", raw, lines, [], codebook, order, factor, "", None, further)


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
) -> tuple[pd.DataFrame, list[str], list[Finding], delimited.Rows]:
    """The cells as text, with line and last_line; the lines of the file; findings for rows without
    the header's fields; how the text was read.
    """
    rows = delimited.read(name, data, (*REQUIRED, *OPTIONAL, factor, *further))
    absent = [column for column in IDENTIFYING if column not in rows.header]
    if absent:
        raise InputError(
            f"{name}: has no column {', '.join(absent)}; expected {','.join(REQUIRED)}"
        )
    if factor not in rows.header:
        raise InputError(f"{name}: {_lacking(factor, rows.header)}")
    findings = [
        _finding(first, last, "malformed", reason, rows.lines)
        for first, last, reason in rows.faults
    ]
    if not rows.cells and not findings:
        raise InputError(f"{name}: has a header and no rows, expected one row an answer")
    raw = pd.DataFrame(rows.cells, columns=list(rows.columns), dtype=object)
    raw["level"] = raw[factor]
    raw["line"], raw["last_line"] = np.array(rows.spans, dtype=np.int64).reshape(-1, 2).T
    return raw, rows.lines, findings, rows


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
    dialect: delimited.Rows | None,
    further: tuple[str, ...],
) -> Responses:
    rows = len(raw) + len(findings)
    raw, checks = _apart(raw)
    columns = tuple(column for column in MEASURED if column not in raw)
    for column in columns:
        raw[column] = ""
    values, understood = _values(raw, dialect.separator if dialect else ",")
    ratings, rule = _ratings(values.familiarity, codebook)
    reasons, missing = _checked(raw, values, codebook, factor, ratings, rule, columns)
    simulated = _one_kind(name, raw)
    findings = findings + [
        _finding(raw.line[at], raw.last_line[at], "malformed", _some(reasons[at], 3, "; "), lines)
        for at in sorted(reasons)
    ]
    raw["image"] = raw.framing
    for column in further:
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
        codebook = codebooks.from_table(
            frame.framing, frame[["left", "right"]].to_numpy().ravel(), ratings
        )
        codebook = replace(codebook, factors=further)
    if order is not None:
        present = set(frame.left) | set(frame.right)
        codebook = codebook.ordered(
            order, [name for name in codebook.techniques if name in present]
        )

    frame = _oriented(frame, codebook)
    if factor != FRAMING:
        level = raw.level.drop(index=list(reasons))
        if factor == "familiarity":
            rated = frame.groupby("participant", observed=True).familiarity.transform("first")
            frame, rated, unrated = _without_level(frame, rated, lines)
            findings += unrated
            if frame.empty:
                raise InputError(f"{name}: nobody rated their familiarity; {unrated[0]}")
            level = rated.map("{:g}".format)
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
            "repeats": repeats.loc[
                (repeats.order != repeats.first_order)
                & repeats.order.notna()
                & repeats.first_order.notna(),
                list(REPEATS),
            ].reset_index(drop=True)
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
        missing=tuple(sorted(missing, key=lambda one: one.line)),
        notes=(
            *grouping,
            *(dialect.notes if dialect else ()),
            *([f"Understood in it: {'; '.join(understood)}."] if understood else []),
            *_check_notes(checks),
            *_missing_notes(missing, columns, len(frame)),
            *_crossed_note(int(again.sum()), rows, dialect, further, factor),
            *_notes(frame, raw, codebook),
        ),
        grouping=grouping,
        checks=checks,
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
    yield f"Answers are grouped by {codebook.factor_words} ({sizes}){holds}."
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
    apart = codebook.factor != FRAMING and len(held) > 1
    if apart and "framing" not in questions(frame, codebook):
        yield (
            f"Nobody judged the same images at several {codebook.levels}: taken together, the "
            "answers are those of the study without "
            "this grouping."
        )


def _values(raw: pd.DataFrame, separator: str) -> tuple[pd.DataFrame, list[str]]:
    """The columns of numbers and times, missing where a cell is none; what was understood."""
    values, understood = pd.DataFrame(index=raw.index), {}
    for column, pattern in (
        ("familiarity", delimited.INTEGER),
        ("answer", delimited.INTEGER),
        ("order", delimited.INTEGER),
        ("rt_ms", delimited.NUMBER),
    ):
        parsed = delimited.numbers(raw[column], pattern, separator)
        values[column] = parsed.values.where(np.isfinite(parsed.values))
        understood |= dict.fromkeys(parsed.notes)
    parsed = delimited.times(raw.started_at)
    values["started_at"] = parsed.values
    return values, [*understood, *parsed.notes]


def _ratings(familiarity: pd.Series, codebook: Codebook | None) -> tuple[tuple[int, ...], str]:
    """The levels of the self-rating, and what a rating must be, in words.

    Where no study declares them they are those of the table: 1 to 5, or as far as its whole
    numbers within `UNDECLARED_RATINGS` go.
    """
    if codebook is not None:
        levels = codebook.ratings
        return levels, f"a level of the study's self-rating, {levels[0]} to {levels[-1]}"
    low, high = UNDECLARED_RATINGS
    seen = familiarity[familiarity.between(low, high)]
    first = int(min(1, seen.min())) if len(seen) else 1
    last = int(max(5, seen.max())) if len(seen) else 5
    return tuple(range(first, last + 1)), f"a whole number from {low} to {high}"


def _checked(
    raw: pd.DataFrame,
    values: pd.DataFrame,
    codebook: Codebook | None,
    factor: str,
    ratings: tuple[int, ...],
    rating_rule: str,
    absent: tuple[str, ...],
) -> tuple[dict[int, list[str]], list[Missing]]:
    """For each row that fails, by its position, why; and the values that are missing in the others.

    Values outside their range become missing in place.
    """
    checks = [
        (column, raw[column] == "", "a name")
        for column in ("participant", "framing", "left", "right")
    ]
    checks.append(("answer", ~values.answer.between(-2, 2), "an integer from -2 to 2"))
    if factor not in REQUIRED:
        checks.append(("level", raw.level == "", "a level to group answers by"))
    if "kind" in raw:
        known = f"one of {', '.join(KINDS)}"
        checks.append(("kind", ~raw.kind.isin((*KINDS, "")), known))
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

    missing = []
    for column, readable, expected in (
        ("familiarity", values.familiarity.isin(ratings), rating_rule),
        ("order", values.order >= 1, "an integer from 1"),
        ("rt_ms", values.rt_ms >= 0, "milliseconds, a number from 0"),
        ("started_at", values.started_at.notna(), "a time in ISO 8601"),
    ):
        values[column] = values[column].where(readable)
        if column not in absent:
            missing += [
                Missing(int(raw.line[at]), column, f"{raw[column][at]:.60}", expected)
                for at in np.flatnonzero(~readable)
                if at not in reasons
            ]
    return reasons, missing


def _apart(raw: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows that are judged, and `Responses.checks`."""
    if "kind" not in raw or not (apart := raw.kind.isin(CHECKING)).any():
        return raw, pd.DataFrame(columns=CHECKS)
    checks = raw[apart].copy()
    for column in ("answer", "expected"):
        checks[column] = pd.to_numeric(checks.get(column, ""), errors="coerce")
    checks = checks[checks.answer.between(-2, 2)]
    return raw[~apart].reset_index(drop=True), checks[list(CHECKS)].reset_index(drop=True)


def _check_notes(checks: pd.DataFrame) -> Iterable[str]:
    """What the answers say that are not counted."""
    for kind in CHECKING:
        here = checks[checks.kind == kind]
        if here.empty:
            continue
        detail = ""
        if kind == "trap":
            right = int((np.sign(here.answer) == np.sign(here.expected)).sum())
            detail = f": {right} of them are the obvious one"
        elif kind == "bias":
            left, none = int((here.answer < 0).sum()), int((here.answer == 0).sum())
            detail = (
                f" (one image on both sides): {none} see no difference, {left} prefer the left, "
                f"{len(here) - none - left} the right"
            )
        count = _plural(len(here), "answer")
        yield f"{count} to {kind} pairs stand apart and count nowhere{detail}."


def _without_level(
    frame: pd.DataFrame, rated: pd.Series, lines: list[str]
) -> tuple[pd.DataFrame, pd.Series, list[Finding]]:
    """The answers of people who rated themselves; findings for the others, who have no level when
    answers are grouped by familiarity.
    """
    unrated = [
        _finding(
            row.line,
            row.last_line,
            "no level",
            f"{row.participant!r} rated no familiarity, expected a level to group answers by",
            lines,
        )
        for row in frame[rated.isna()].itertuples()
    ]
    return frame[rated.notna()], rated[rated.notna()], unrated


def _crossed_note(
    duplicates: int,
    rows: int,
    dialect: delimited.Rows | None,
    further: tuple[str, ...],
    factor: str,
) -> Iterable[str]:
    """A hint where many rows look like duplicates and other columns might tell them apart."""
    known = {*REQUIRED, *OPTIONAL, *further, factor}
    others = [name for name in dialect.header if name not in known] if dialect else []
    if duplicates > rows / 20 and others:
        yield (
            f"{duplicates} of {rows} rows ask a question again and are not counted. If a column "
            f"tells images apart ({_some(others)}), name it: --varied, or the study's manifest."
        )


def _missing_notes(missing: list[Missing], columns: tuple[str, ...], answers: int) -> Iterable[str]:
    """How many values are missing of each column, and why, a sentence a column."""
    for column in columns:
        yield f"The table has no column {column}: nothing is said of it, and every answer counts."
    for column in MEASURED:
        here = [one for one in missing if one.column == column]
        if not here:
            continue
        filled = [one for one in here if one.value]
        first = (
            f"the first is {filled[0].value!r} on line {filled[0].line}"
            if filled
            else f"the first is empty, on line {here[0].line}"
        )
        yield (
            f"{column} is missing in {_plural(len(here), 'answer')} of {answers}, which "
            f"{'is' if len(here) == 1 else 'are'} counted all the same: expected "
            f"{here[0].expected}, {first}."
        )


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
            "familiarity": frame.familiarity.astype(float),
            "framing": pd.Categorical(frame.framing, codebook.framings, ordered=True),
            "image_framing": pd.Categorical(frame.image, _images(frame, codebook), ordered=True),
            "a": pd.Categorical.from_codes(a, dtype=techniques),
            "b": pd.Categorical.from_codes(b, dtype=techniques),
            "preference": preference,
            "strength": np.abs(preference),
            "winner": pd.Categorical.from_codes(winner, dtype=techniques),
            "a_left": a_left,
            "answer": frame.answer.astype(np.int8),
            "order": frame.order.astype(float),
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
