"""Parameters: frozen dataclasses that know unit, range and source of every field, and check it.

Techniques, materials, lights and cameras are all written with `parameter`, read from the tables of
TOML and JSON files by `Parameters.read`, and written back by `Parameters.plain`.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, Self

from renderer.errors import InputError


def parameter(
    default: Any,
    *,
    unit: str = "",
    source: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple = (),
    optional: bool = False,
):
    """A dataclass field with its unit, its range or choices, and its source.

    The default says what values are allowed: a truth value, a whole number, a number, a text or a
    tuple of as many numbers. `optional`: None is allowed too; the default of such a field is given
    as (None, example), where the example says the kind.
    """
    metadata = {
        "unit": unit,
        "source": source,
        "low": low,
        "high": high,
        "choices": choices,
        "optional": optional,
        "kind": default[1] if optional else default,
    }
    return dataclasses.field(default=default[0] if optional else default, metadata=metadata)


def nested(kind: type | None = None, default: Any = dataclasses.MISSING, **options):
    """A field that holds other Parameters (`kind`) or anything that the class itself reads."""
    metadata = {"nested": kind}
    if default is dataclasses.MISSING and "default_factory" not in options:
        return dataclasses.field(metadata=metadata)
    if "default_factory" in options:
        return dataclasses.field(default_factory=options["default_factory"], metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@dataclasses.dataclass(frozen=True)
class Parameters:
    """Base of all checked values; InputError names `called` (or the class) and the field."""

    called: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            if "kind" in field.metadata:
                checked = _checked(self.where(field.name), getattr(self, field.name), field)
                object.__setattr__(self, field.name, checked)

    @classmethod
    def where(cls, field: str) -> str:
        """The name of a field in errors."""
        return f"{cls.called or cls.__name__.lower()}.{field}"

    @classmethod
    def names(cls) -> list[str]:
        """The fields, in order."""
        return [field.name for field in dataclasses.fields(cls)]

    @classmethod
    def read(cls, table: Mapping[str, Any], where: str) -> Self:
        """The value in a table of a file; `where` is the table's dotted key, for errors."""
        if not isinstance(table, Mapping):
            raise InputError(f"{where} is {table!r:.60}; expected a table")
        refuse_unknown(table, cls.names(), where)
        values = {}
        for field in dataclasses.fields(cls):
            if field.name not in table:
                needed = field.default is field.default_factory is dataclasses.MISSING
                if needed:
                    raise InputError(f"{where}.{field.name} is missing")
                continue
            value = table[field.name]
            kind = field.metadata.get("nested")
            if kind is not None and isinstance(value, Mapping):
                value = kind.read(value, f"{where}.{field.name}")
            values[field.name] = frozen(value)
        try:
            return cls(**values)
        except InputError as error:
            raise InputError(str(error).replace(cls.where(""), f"{where}.", 1)) from None

    def plain(self) -> dict[str, Any]:
        """The fields as JSON would give them back."""
        return {field.name: plain(getattr(self, field.name)) for field in dataclasses.fields(self)}


def frozen(value: Any) -> Any:
    """Lists as tuples, all the way down: what a frozen dataclass holds."""
    if isinstance(value, Mapping):
        return {key: frozen(entry) for key, entry in value.items()}
    return tuple(map(frozen, value)) if isinstance(value, list | tuple) else value


def plain(value: Any) -> Any:
    """A value of Parameters as JSON would give it back."""
    if isinstance(value, Parameters):
        return value.plain()
    if isinstance(value, Mapping):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    return value


def refuse_unknown(table: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    """InputError for the first key of `table` that is not `known`, with the nearest one that is."""
    known = list(known)
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
            raise InputError(f"{where}.{key} is unknown; {hint if known else 'expected none'}")


def weights(
    where: str, table: Any, of: str, low: float, high: float, known: Iterable[str] | None = None
) -> dict[str, float]:
    """A table of weights of `of`, each low to high; InputError otherwise, or for one not known."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {table!r:.60}; expected a table of {of}")
    if known is not None:
        refuse_unknown(table, known, where)
    for name, weight in table.items():
        number = isinstance(weight, int | float) and not isinstance(weight, bool)
        if not number or not low <= weight <= high:
            raise InputError(f"{where}.{name} is {weight!r:.60}; expected {low:g} to {high:g}")
    return {name: float(weight) for name, weight in table.items()}


def _checked(where: str, value: Any, field: dataclasses.Field) -> Any:
    meta, kind = field.metadata, field.metadata["kind"]
    if value is None and meta["optional"]:
        return None
    if meta["choices"]:
        if value not in meta["choices"]:
            known = ", ".join(map(repr, meta["choices"]))
            raise InputError(f"{where} is {value!r:.60}; expected one of {known}")
        return value
    if isinstance(kind, str):
        if not isinstance(value, str) or not value.strip():
            raise InputError(f"{where} is {value!r:.60}; expected a text that is not blank")
        return value
    if isinstance(kind, tuple):
        if not isinstance(value, tuple | list) or len(value) != len(kind):
            raise InputError(f"{where} is {value!r:.60}; expected {len(kind)} numbers")
        return tuple(_number(where, value, part, kind[0], meta) for part in value)
    return _number(where, value, value, kind, meta)


def _number(where: str, value: Any, part: Any, kind: Any, meta: Mapping[str, Any]) -> Any:
    """`part` of `value`, checked against the kind and the range."""
    if isinstance(kind, bool):
        if not isinstance(part, bool):
            raise InputError(f"{where} is {value!r:.60}; expected true or false")
        return part
    whole = isinstance(kind, int)
    number = isinstance(part, int | float) and not isinstance(part, bool) and math.isfinite(part)
    if not number or (whole and part != int(part)):
        expected = "an integer" if whole else "a number"
        raise InputError(f"{where} is {value!r:.60}; expected {expected}")
    low, high = meta["low"], meta["high"]
    if (low is not None and part < low) or (high is not None and part > high):
        expected = f"{low} to {high}" if None not in (low, high) else f"{low} or more"
        if low is None:
            expected = f"{high} or less"
        unit = f" {meta['unit']}" if meta["unit"] else ""
        raise InputError(f"{where} is {value!r:.60}{unit}; expected {expected}")
    return int(part) if whole else part
