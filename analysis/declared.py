"""What a study declared of its analysis before anybody was asked: `study.analysis` of its manifest,
as `Options`.

    "analysis": {"margin": 0.25, "margin_jod": 0.5, "test": "wilcoxon", "exclusions":
    {"median_rt_ms": 500, "zeta": false}}

Keys are the fields of `options.Options` and `options.Exclusions`; what is not declared has their
defaults; a rule that is false is off.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

from analysis.errors import InputError
from analysis.options import Exclusions, Options

#: Where margins and rules come from, when no study file declares any.
UNDECLARED = "no margin or rule was declared in a study file: the defaults of subdermal"


def read_declared(path: str | Path) -> dict:
    """`study.analysis` of a manifest.json (or of the folder that holds it); empty where it declares
    nothing.
    """
    path = Path(path)
    path = path / "manifest.json" if path.is_dir() else path
    try:
        declared = json.loads(path.read_bytes())["study"].get("analysis", {})
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read: {error.strerror}; expected a study's manifest.json"
        ) from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{path}: has no study, expected a study's manifest.json") from None
    if not isinstance(declared, dict):
        raise InputError(f"{path}: study.analysis is {declared!r:.60}, expected a table")
    return declared


def options(
    declared: Mapping[str, object], source: str = "study.analysis", **given: object
) -> Options:
    """Options from what a study declared, with what is `given` (None: not given) in its place."""
    values = {**declared, **{name: value for name, value in given.items() if value is not None}}
    rules = values.pop("exclusions", {})
    if not isinstance(rules, Mapping):
        raise InputError(f"{source}.exclusions is {rules!r:.60}, expected a table")
    names = [
        name
        for name in declared
        if name != "exclusions" and given.get(name) in (None, declared[name])
    ]
    named = (*names, *(f"exclusions.{name}" for name in rules))
    for name, table, known in (
        (source, values, Options),
        (f"{source}.exclusions", rules, Exclusions),
    ):
        names = [
            field.name for field in fields(known) if field.name not in ("exclusions", "declared")
        ]
        unknown = [key for key in table if key not in names]
        if unknown:
            raise InputError(
                f"{name} names the unknown {', '.join(map(str, unknown))}; expected some of "
                f"{', '.join(names)}"
            )
    for key, value in [
        *rules.items(),
        *(
            (key, value)
            for key, value in values.items()
            if key in ("margin", "margin_jod", "level")
        ),
    ]:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number and not (value is False and key in rules):
            raise InputError(f"{source}: {key} is {value!r:.60}, expected a number")
    if isinstance(values.get("models"), list):
        values["models"] = tuple(values["models"])
    rules = {key: None if value is False else value for key, value in rules.items()}
    return Options(**values, exclusions=Exclusions(**rules), declared=named)


def fingerprint(declared: Mapping[str, object]) -> str:
    """SHA-256 of what a study declares of its analysis, as hexadecimal digits.

    Of its JSON with sorted keys and no spaces, so that neither the order of the keys nor the layout
    of the file changes it: published before the data, it shows that the plan is the one that was
    carried out. '' where nothing is declared.
    """
    if not declared:
        return ""
    text = json.dumps(declared, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()
