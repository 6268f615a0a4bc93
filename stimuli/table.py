"""Tables read from TOML or JSON that are checked key by key, so that an error can name the key at
fault.
"""

import difflib
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from stimuli.errors import InputError

_REQUIRED = object()
_KINDS = {str: "text", int: "an integer", list: "a list", dict: "a table"}


@dataclass
class Table:
    """A table, the file it came from and its dotted key in there ("" at the top)."""

    value: dict
    source: str
    key: str = ""
    _taken: set = field(default_factory=set)

    def at(self, key: str) -> str:
        """The dotted key of an entry of this table."""
        return f"{self.key}.{key}" if self.key else key

    def fault(self, key: str, got: Any, expected: str) -> InputError:
        """The error to raise for an entry: where, what was got, what was expected."""
        text = repr(got) if len(repr(got)) <= 60 else repr(got)[:57] + "..."
        return InputError(f"{self.source}: {self.at(key)}: got {text}, expected {expected}")

    def take(
        self,
        key: str,
        kind: type,
        expected: str = "",
        valid: Callable[[Any], bool] = lambda value: True,
        default: Any = _REQUIRED,
    ) -> Any:
        """The entry under `key`, of the given kind and for which `valid` holds."""
        self._taken.add(key)
        expected = expected or _KINDS[kind]
        if key not in self.value:
            if default is _REQUIRED:
                raise InputError(f"{self.source}: {self.at(key)}: missing, expected {expected}")
            return default
        value = self.value[key]
        if (
            not isinstance(value, kind)
            or (kind is int and isinstance(value, bool))
            or not valid(value)
        ):
            raise self.fault(key, value, expected)
        return value

    def text(self, key: str, **options) -> str:
        """A text that is not blank."""
        return self.take(
            key, str, "a text that is not blank", lambda value: bool(value.strip()), **options
        )

    def name(self, key: str, **options) -> str:
        """A name fit for file names, columns and keys."""
        pattern = r"[a-z0-9]([a-z0-9_-]*[a-z0-9])?"
        expected = "a name of small letters, digits, '-' and '_'"
        return self.take(
            key, str, expected, lambda value: re.fullmatch(pattern, value) is not None, **options
        )

    def one_of(self, key: str, values: Iterable[str], **options) -> str:
        """One of a few texts."""
        values = list(values)
        return self.take(
            key, str, f"one of {', '.join(values)}", lambda value: value in values, **options
        )

    def number(self, key: str, low: int, high: int, **options) -> int:
        """An integer from low to high, both included."""
        expected = str(low) if low == high else f"an integer from {low} to {high}"
        return self.take(key, int, expected, lambda value: low <= value <= high, **options)

    def table(self, key: str, **options) -> "Table":
        """The table under `key`."""
        return Table(self.take(key, dict, **options), self.source, self.at(key))

    def tables(self, key: str, least: int, most: int | None = None) -> list["Table"]:
        """The list of tables under `key`, `least` to `most` of them."""
        if most is None:
            expected = f"a list of at least {least} tables"
        else:
            expected = (
                f"a list of {least} tables"
                if least == most
                else f"a list of {least} to {most} tables"
            )
        values = self.take(
            key, list, expected, lambda value: least <= len(value) <= (most or len(value))
        )
        for i, value in enumerate(values):
            if not isinstance(value, dict):
                raise self.fault(f"{key}[{i}]", value, "a table")
        return [Table(value, self.source, self.at(f"{key}[{i}]")) for i, value in enumerate(values)]

    def end(self) -> None:
        """Refuse what nothing has taken: most likely it is misspelt."""
        for key in self.value:
            if key not in self._taken:
                near = difflib.get_close_matches(key, self._taken, 1)
                hint = (
                    f"did you mean {near[0]!r}?"
                    if near
                    else f"expected one of {', '.join(sorted(self._taken))}"
                )
                raise InputError(f"{self.source}: {self.at(key)}: unknown key, {hint}")


def refuse_doubles(tables: list[Table], key: str) -> None:
    """Refuse two tables with one value under `key`."""
    seen = {}
    for table in tables:
        value = table.value[key]
        if value in seen:
            raise table.fault(key, value, f"a value that differs from {seen[value].at(key)}")
        seen[value] = table
