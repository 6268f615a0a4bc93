"""Tables of text as people's programs write them: encoding, separator, decimal mark and dates are
detected, and what was understood is said.

Comma-separated UTF-8 with ISO 8601 times is what `subdermal` writes. A spreadsheet saves other
dialects: semicolons and decimal commas, dates as 04.03.2024, Windows-1252, UTF-16, a first line
`sep=;`. Nothing is guessed where two readings are possible: such a value is missing.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from operator import itemgetter

import pandas as pd

from analysis.errors import InputError

#: Separators that are tried, with their names.
SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "vertical bars"}
INTEGER = r"[+-]?[0-9]{1,9}(?:\.0*)?"
NUMBER = r"\+?[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]{1,2})?"
#: Times with the day first, as spreadsheets of German and many other tongues write them.
DAY_FIRST = ("%d.%m.%Y %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S", "%d.%m.%Y %H:%M", "%d.%m.%Y")


@dataclass(frozen=True)
class Rows:
    """header: every name in it; columns: those that were kept, in the order of `cells`.

    cells: rows with as many fields as the header; spans: the first and the last line of each;
    faults: (first line, last line, reason) of the other rows; lines: the text of the file;
    separator; notes: what is unlike the table that subdermal writes.
    """

    header: tuple[str, ...]
    columns: tuple[str, ...]
    cells: list[tuple[str, ...]]
    spans: list[tuple[int, int]]
    faults: list[tuple[int, int, str]]
    lines: list[str]
    separator: str
    notes: tuple[str, ...]


def decode(name: str, data: bytes) -> tuple[str, str | None]:
    """The text, and its encoding in words where it is not UTF-8.

    A byte order mark decides; then zeros in every other byte (UTF-16), then whether it is UTF-8;
    everything else is read as Windows-1252, the superset of Latin-1.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding, words = "utf-16", "UTF-16"
    elif data[1:400:2].count(0) > len(data[1:400:2]) // 2:
        encoding, words = "utf-16-le", "UTF-16"
    elif data[0:400:2].count(0) > len(data[0:400:2]) // 2:
        encoding, words = "utf-16-be", "UTF-16"
    else:
        encoding, words = "utf-8-sig", None
    try:
        return data.decode(encoding), words
    except UnicodeDecodeError as error:
        if words:
            raise InputError(
                f"{name}: begins as UTF-16 and byte {error.start} does not go on so; save the "
                "table as 'CSV UTF-8'"
            ) from None
    try:
        return data.decode("cp1252"), "Windows-1252 (Latin-1)"
    except UnicodeDecodeError:
        return data.decode("latin-1"), "Latin-1"


def read(name: str, data: bytes, columns: Sequence[str]) -> Rows:
    """The rows of a table, of these columns where they are there; the separator is the one that
    finds most of them in the header.
    """
    text, encoding = decode(name, data)
    if not text.strip():
        raise InputError(f"{name}: is empty, expected a header and one row an answer")
    lines = list(io.StringIO(text, newline=""))
    start = 1 if lines[0].strip().lower()[:4] == "sep=" and len(lines) > 1 else 0
    separator, header = _header(name, lines[start:], columns)
    wanted = [column for column in dict.fromkeys(columns) if column in header]
    twice = [column for column in wanted if header.count(column) > 1]
    if twice:
        raise InputError(f"{name}: has the column {', '.join(twice)} twice")
    places, width = [header.index(column) for column in wanted], len(header)
    chosen = itemgetter(*places) if len(places) > 1 else lambda row: [row[k] for k in places]
    reader = csv.reader(iter(lines[start:]), strict=True, delimiter=separator)
    next(reader)
    cells, spans, faults = [], [], []
    while True:
        first = reader.line_num + 1 + start
        try:
            row = next(reader)
        except StopIteration:
            break
        except csv.Error as error:
            if reader.line_num + start >= len(lines) and "unexpected end" in str(error):
                raise InputError(
                    f"{name}: line {first}: a quotation mark is opened and never closed"
                ) from None
            faults.append((first, reader.line_num + start, f"is no CSV: {error}"))
            continue
        if not row or (len(row) > 1 and not any(map(str.strip, row))):
            continue  # an empty line, or one of separators alone, as spreadsheets leave them
        if len(row) == width:
            cells.append(tuple([cell.strip() for cell in chosen(row)]))
            spans.append((first, reader.line_num + start))
        else:
            reason = f"has {len(row)} fields, expected {width} as in the header"
            faults.append((first, reader.line_num + start, reason))
    notes = []
    if encoding or separator != ",":
        parts = ([f"encoded as {encoding}"] if encoding else []) + (
            [f"separated by {SEPARATORS[separator]}"] if separator != "," else []
        )
        notes.append(f"The table was read as {' and '.join(parts)}.")
    return Rows(tuple(header), tuple(wanted), cells, spans, faults, lines, separator, tuple(notes))


def _header(name: str, lines: list[str], columns: Sequence[str]) -> tuple[str, list[str]]:
    """Separator and names of the columns."""
    best, fault = None, None
    for separator in SEPARATORS:
        try:
            row = next(csv.reader(iter(lines), strict=True, delimiter=separator))
        except csv.Error as error:
            fault = fault or f"the header is no CSV: {error}"
            continue
        names = [cell.strip() for cell in row]
        known = sum(column in names for column in columns)
        if best is None or known > best[0]:
            best = known, separator, names
    if best is None:
        raise InputError(f"{name}: line 1: {fault}")
    return best[1], best[2]


@dataclass(frozen=True)
class Numbers:
    """values: floats, NaN where a cell is no number; notes: what was understood."""

    values: pd.Series
    notes: tuple[str, ...] = ()


def numbers(cells: pd.Series, pattern: str, separator: str = ",") -> Numbers:
    """Cells of text as numbers that match `pattern` (`INTEGER` or `NUMBER`).

    A comma is the decimal mark where the table is not separated by commas, or where some number
    has another count than three digits behind it; '1,500' alone may also be a thousand and a half,
    and is missing. A true minus sign is a minus.
    """
    codes, different = pd.factorize(cells, use_na_sentinel=False)  # each text is read once
    text, notes = pd.Series(different, dtype=object), []
    minus = text.str.startswith("\N{MINUS SIGN}")
    if minus.any():
        text = text.str.replace("\N{MINUS SIGN}", "-", n=1)
    comma = text.str.fullmatch(r"[+-]?[0-9]+,[0-9]+")
    if comma.any():
        sure = separator != "," or not text[comma].str.fullmatch(r"[+-]?[0-9]{1,3},[0-9]{3}").all()
        if sure:
            text = text.mask(comma, text.str.replace(",", ".", n=1))
            notes.append("decimal commas")
    values = pd.to_numeric(text.where(text.str.fullmatch(pattern)), errors="coerce")
    return Numbers(pd.Series(values.to_numpy(float)[codes], index=cells.index), tuple(notes))


def times(cells: pd.Series) -> Numbers:
    """Cells of text as times in UTC, NaT where a cell is none: ISO 8601, or 04.03.2024 09:15:00
    with the day first; without an offset they are taken as UTC.
    """
    values = pd.to_datetime(cells, format="ISO8601", utc=True, errors="coerce")
    rest = values.isna() & (cells != "")
    notes = ()
    if rest.any():
        for form in DAY_FIRST:
            here = pd.to_datetime(cells[rest], format=form, utc=True, errors="coerce")
            if here.notna().any():
                values = values.fillna(here)
                notes = ("dates with the day first, as in 04.03.2024",)
                rest = values.isna() & (cells != "")
                if not rest.any():
                    break
    return Numbers(values, notes)
