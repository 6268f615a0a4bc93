"""Files that are there whole or not at all. Standard library alone."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


#: Names of files that are being written by `replacing`.
PARTS = ".*.part"


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to, beside `path`; it takes its place when the block ends without an error.

    Whatever ends the block, nothing else stays: what was at `path` before is there until then. What
    a process leaves that is killed meanwhile matches `PARTS`.
    """
    part = path.with_name(f".{path.name}.{uuid.uuid4().hex}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def csv_bytes(table: pd.DataFrame, digits: int) -> bytes:
    """A table as CSV in UTF-8, numbers to so many digits."""
    text = table.to_csv(index=False, float_format=f"%.{digits}g", lineterminator="\n")
    return text.encode()
