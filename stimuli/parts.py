"""Named parts of scenes and studies: TOML files in folders of this package, or a user's own."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from stimuli.errors import InputError

ROOT = Path(__file__).resolve().parent
SCENES, LIGHTS, PEOPLE = ROOT / "scenes", ROOT / "lights", ROOT / "people"


def names(folder: Path) -> list[str]:
    """The parts that a folder offers by name."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def part(name: str | Path, folder: Path, what: str, beside: Path | None = None) -> Path:
    """The file of a named part, or the file itself where the name is a path."""
    if not isinstance(name, str | Path) or not str(name).strip():
        raise InputError(f"{what} is {name!r:.60}; expected a name or a file")
    path = Path(name)
    if path.suffix == ".toml" or len(path.parts) > 1:
        file = path if beside is None or path.is_absolute() else beside / path
        if not file.is_file():
            raise InputError(f"{what} {str(file)!r}: no such file")
        return file
    known = names(folder)
    if path.name not in known:
        near = get_close_matches(path.name, known, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
        raise InputError(f"no {what.rpartition('.')[2]} {path.name!r}; {hint}")
    return folder / f"{path.name}.toml"


def person_table(name: str) -> dict[str, Any]:
    """The table of a person: one of stimuli/people by name, a file, or a seed, which draws one."""
    if isinstance(name, str) and name.isascii() and name.isdigit():
        from stimuli.heads.identity import draw

        return draw(int(name))
    return read_toml(part(name, PEOPLE, "person"))


def read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise InputError(f"{path}: line {line}: not UTF-8 text") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not TOML: {error}") from error


def merge(table: Mapping[str, Any], patch: Mapping[str, Any]) -> dict[str, Any]:
    """`patch` over `table`: tables are merged, other values replace, false removes a table."""
    result = dict(table)
    for key, value in patch.items():
        old = result.get(key)
        if value is False and isinstance(old, Mapping):
            del result[key]
        elif isinstance(value, Mapping) and isinstance(old, Mapping):
            result[key] = merge(old, value)
        elif isinstance(value, Mapping):
            result[key] = merge({}, value)
        else:
            result[key] = value
    return result
