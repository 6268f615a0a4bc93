"""subdermal inspect: what would bias a study, found in its images."""

from pathlib import Path

import click


def _limits(_context, _parameter, values: tuple[str, ...]) -> dict[str, float]:
    limits = {}
    for item in values:
        name, equals, number = item.partition("=")
        try:
            limits[name] = float(number)
        except ValueError:
            equals = ""
        if not equals:
            raise click.BadParameter(f"got {item!r}; expected NAME=NUMBER, such as luminance=0.02")
    return limits


@click.command("inspect")
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path), metavar="DIR")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the page and its maps; DIR/inspection if not given.",
)
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="NAME=NUMBER",
    callback=_limits,
    help="What is flagged: luminance, colour, clipped, noise_levels, noise_ratio, outside_levels, "
    "alike, jod; repeat for more.",
)
def command(folder: Path, out: Path | None, limits: dict[str, float]) -> None:
    """Look at the images of the study in DIR: a page with the questionnaire's own viewer,
    difference maps, and flags for what would bias it.

    Flagged are conditions of one cell that are brighter, coloured or noisier than each other,
    clipped highlights, differences where nothing scatters, and pairs that nobody can tell apart.
    """
    from dataclasses import fields

    from app import inspection
    from stimuli.errors import InputError
    from stimuli.inspect import OUT, Limits, inspect
    from stimuli.manifest import load_manifest

    known = [field.name for field in fields(Limits)]
    for name in limits:
        if name not in known:
            raise InputError(f"no limit {name!r}; expected one of {', '.join(known)}")
    manifest = load_manifest(folder)
    out = out or folder / OUT
    out.mkdir(parents=True, exist_ok=True)
    found = inspect(manifest, out, Limits(**limits))
    page = inspection.write(manifest, found, out)
    for flag in found.flags:
        click.echo(f"{flag.cell}: {flag.words}")
    click.echo(inspection.fetched(manifest).words)
    click.echo(f"{page}: {len(manifest.images)} images, {len(found.flags)} flags")
