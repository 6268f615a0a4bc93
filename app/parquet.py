"""A table as Parquet, a group of rows at a time, so that memory does not grow with it.

pyarrow is an extra, `parquet`: it is a wheel of 55 MB, and pandas loads it, and keeps its texts in
it, wherever it is installed, asked or not.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow

    from app.export import Column

#: Rows of a group: some 10 MB as they are read, 200 kB as they are written.
GROUP_ROWS = 5000
MISSING = (
    "Parquet is written by pyarrow, which is not installed: "
    "pip install --no-deps -r requirements-parquet.lock"
)


def available() -> bool:
    """Whether the extra is installed."""
    return find_spec("pyarrow") is not None


def parquet(
    columns: Sequence[Column], rows: Iterable[Mapping[str, Any]], about: Mapping[str, str]
) -> Iterator[bytes]:
    """The rows as a Parquet file, in pieces. Types are those of the codebook (integer: 64
    bits, number: double, time: UTC, ms), what is empty is null; each column brings its description
    and unit, the file says what it is `about`.
    """
    from pyarrow.parquet import ParquetWriter

    schema, sink = _schema(columns, about), _Pieces()
    with ParquetWriter(sink, schema, compression="zstd") as writer:
        group: list[Mapping[str, Any]] = []
        for row in rows:
            group.append(row)
            if len(group) == GROUP_ROWS:
                writer.write_table(_table(group, columns, schema))
                group = []
                yield sink.taken()
        if group:
            writer.write_table(_table(group, columns, schema))
    yield sink.taken()


def _schema(columns: Sequence[Column], about: Mapping[str, str]) -> pyarrow.Schema:
    import pyarrow

    types = {
        "text": pyarrow.string(),
        "integer": pyarrow.int64(),
        "number": pyarrow.float64(),
        "time": pyarrow.timestamp("ms", tz="UTC"),
    }
    return pyarrow.schema(
        [
            pyarrow.field(
                column.name,
                types[column.type],
                metadata={"description": column.description, "values": column.values},
            )
            for column in columns
        ],
        metadata=dict(about),
    )


def _table(
    group: list[Mapping[str, Any]], columns: Sequence[Column], schema: pyarrow.Schema
) -> pyarrow.Table:
    import pyarrow

    arrays = []
    for column, field in zip(columns, schema, strict=True):
        values = [row[column.name] for row in group]
        if column.type == "time":
            values = [datetime.fromisoformat(value) if value else None for value in values]
        arrays.append(pyarrow.array(values, field.type))
    return pyarrow.Table.from_arrays(arrays, schema=schema)


class _Pieces(io.RawIOBase):
    """A file that hands on what was written into it."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data) -> int:
        self._parts.append(bytes(data))
        return len(data)

    def taken(self) -> bytes:
        """What was written since the last time."""
        data, self._parts = b"".join(self._parts), []
        return data
