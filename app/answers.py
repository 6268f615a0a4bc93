"""What the verbs over a table of answers share: options, reading, what is said of the table."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from analysis.manifest import ManifestFile
    from analysis.responses import Responses

#: How many unusable rows are named on the terminal; tables/rejected_rows.csv holds all.
SHOWN_ROWS = 20


def names(
    ctx: click.Context, parameter: click.Parameter, value: str | tuple[str, ...] | None
) -> tuple[str, ...] | None:
    """'a, b,c' as ('a', 'b', 'c'); of an option that may be repeated, those of all its values."""
    if parameter.multiple:
        value = ",".join(value) if value else None
    return None if value is None else tuple(name.strip() for name in value.split(","))


def numbers(
    ctx: click.Context, parameter: click.Parameter, values: tuple[str, ...]
) -> dict[str, float]:
    """('a=0.3', 'b=-1') as {'a': 0.3, 'b': -1}."""
    values_by_name = {}
    for text in values:
        name, _, number = text.partition("=")
        try:
            values_by_name[name.strip()] = float(number)
        except ValueError:
            raise click.BadParameter(
                f"{text!r} is no {parameter.metavar}, such as golubev=0.4"
            ) from None
    return values_by_name


study_option = click.option(
    "--study",
    type=click.Path(path_type=Path),
    metavar="MANIFEST",
    help=(
        "The study's manifest.json, or its folder, for labels and order. Without it the "
        "manifest.json beside RESPONSES, if any."
    ),
)
varied_option = click.option(
    "--varied",
    multiple=True,
    callback=names,
    metavar="A,B",
    help=(
        "Columns that tell images apart beside framing, such as person,light, or one each time. "
        "Without it those of the study's manifest."
    ),
)


def read_answers(
    responses: Path,
    study: Path | None,
    order: tuple[str, ...] | None = None,
    factor: str | None = None,
    varied: tuple[str, ...] | None = None,
) -> tuple[Responses, ManifestFile | None, Path | None]:
    """The answers, with the study's manifest and its path: as given, or beside the table."""
    from analysis.codebook import FRAMING, read_manifest
    from analysis.manifest import is_manifest, open_manifest
    from analysis.responses import read_responses

    notes: tuple[str, ...] = ()
    beside = responses.parent / "manifest.json"
    if study is None and beside.is_file():
        if is_manifest(beside):
            study = beside
        else:
            notes = ("The manifest.json beside the table is not one of a study; it was not used.",)
    manifest = open_manifest(study) if study is not None else None
    codebook = read_manifest(manifest) if manifest else None
    answers = read_responses(responses, codebook, order, factor or FRAMING, varied or ())
    return replace(answers, notes=notes + answers.notes), manifest, study


def tell(path: Path, answers: Responses) -> None:
    """What is to be known of the table, on stderr: rows that cannot be used, and notes."""
    for finding in answers.findings[:SHOWN_ROWS]:
        click.echo(f"{path}: {finding}", err=True)
    for note in answers.notes:
        click.echo(f"{path}: {note}", err=True)


def written() -> str:
    """The command that runs as its output shows it: what was given, without folders and without
    --out, so that it says nothing of the machine and never changes.
    """
    context = click.get_current_context()
    words = ["subdermal", context.info_name]
    for parameter in context.command.params:
        source, value = context.get_parameter_source(parameter.name), context.params[parameter.name]
        if source is not click.core.ParameterSource.COMMANDLINE or parameter.name == "out":
            continue
        if isinstance(value, Mapping):
            value = tuple(f"{name}={one:g}" for name, one in value.items())
        elif isinstance(value, tuple) and not parameter.multiple:
            value = (",".join(value),)
        for one in value if isinstance(value, tuple) else (value,):
            words += [parameter.opts[0]] if isinstance(parameter, click.Option) else []
            words.append(one.name if isinstance(one, Path) else f"{one}")
    return shlex.join([*words, "--out", "DIR"])
