"""What the verbs over a table of answers share: options, reading, what is said of the table."""

from __future__ import annotations

import shlex
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
    ctx: click.Context, parameter: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    """'a, b,c' as ('a', 'b', 'c')."""
    return None if value is None else tuple(name.strip() for name in value.split(","))


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
    callback=names,
    metavar="A,B",
    help=(
        "Columns that tell images apart beside framing, such as person,light. Without it those "
        "of the study's manifest."
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


def written(verb: str, *parts: tuple[str, ...]) -> str:
    """The command as it is shown in its output: without folders, so that it says nothing of the
    machine and never changes.
    """
    words = [word for part in parts for word in part]
    return shlex.join(["subdermal", verb, *words, "--out", "DIR"])
