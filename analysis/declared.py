"""What a study declared of its analysis before anybody was asked: `study.analysis` of its manifest,
as `Options`.

    "analysis": {"margin": 0.25, "margin_jod": 0.5, "test": "wilcoxon", "exclusions":
    {"median_rt_ms": 500, "zeta": false}, "posterior": {"prior_worth": 1.5}}

Keys are the fields of `options.Options`, `options.Exclusions` and `options.Sampling`; what is not
declared has their defaults; a rule that is false is off.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, replace
from difflib import get_close_matches

from analysis.errors import InputError
from analysis.options import Exclusions, Options, Sampling

#: Where margins and rules come from, when no study file declares any.
UNDECLARED = "no margin or rule was declared in a study file: the defaults of subdermal"

#: Choices that are numbers; a rule is a number or false.
NUMBERS = ("margin", "margin_jod", "level")
#: Choices that are tables of their own.
TABLES = {"exclusions": Exclusions, "posterior": Sampling}


def options(
    declared: Mapping[str, object], source: str = "study.analysis", **given: object
) -> Options:
    """Options from what a study declared, with what is `given` (None: not given) in its place.

    Raises InputError that names the key of `source` at fault, or the one that was given. This is
    the one check of `[analysis]`: studies, manifests and the command line all come here.
    """
    for name, choices in TABLES.items():
        if not isinstance(declared.get(name, {}), Mapping):
            raise InputError(f"{source}.{name} is {declared[name]!r:.60}, expected a table")
        _known(f"{source}.{name}", declared.get(name, {}), choices)
    rules, sampling = (declared.get(name, {}) for name in TABLES)
    values = {key: value for key, value in declared.items() if key not in TABLES}
    _known(source, values, Options)
    for key, value in {
        **values,
        **{f"exclusions.{key}": rule for key, rule in rules.items()},
        **{f"posterior.{key}": value for key, value in sampling.items()},
    }.items():
        rule, number = key.startswith("exclusions."), key in NUMBERS or "." in key
        if number and not (_is_number(value) or (rule and value is False)):
            expected = "a number or false" if rule else "a number"
            raise InputError(f"{source}.{key} is {value!r:.60}, expected {expected}")
    try:
        result = Options(
            **{key: tuple(v) if isinstance(v, list) else v for key, v in values.items()},
            exclusions=Exclusions(**{k: None if v is False else v for k, v in rules.items()}),
            posterior=Sampling(**sampling),
        )
    except InputError as error:
        raise InputError(f"{source}.{error}") from None
    chosen = {name: value for name, value in given.items() if value is not None}
    kept = [name for name in values if chosen.get(name, values[name]) == values[name]]
    named = (*kept, *(f"{table}.{name}" for table in TABLES for name in declared.get(table, {})))
    return replace(result, **chosen, declared=named)


def _known(source: str, table: Mapping[str, object], choices: type) -> None:
    """Refuse a key that `choices` does not have."""
    names = [one.name for one in fields(choices) if one.name not in (*TABLES, "declared")]
    for key in table:
        if key not in names:
            near = get_close_matches(str(key), names, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(names)}"
            raise InputError(f"{source} names the unknown {key}; {hint}")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


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
