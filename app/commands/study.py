"""`subdermal study`: a study of one's own images."""

import re
from pathlib import Path

import click


@click.group(no_args_is_help=False)
def command() -> None:
    """Make a study out of a folder of one's own images, without rendering anything."""


@command.command()
@click.argument("images", metavar="IMAGES", type=click.Path(path_type=Path))
@click.option(
    "--out",
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="The study's folder, which must be new or empty. Needed, but with --dry-run.",
)
@click.option(
    "--pattern",
    metavar="PATTERN",
    help=(
        "How names are read, without their endings, such as '{condition}/{level}' or "
        "'{person}/{light}_{condition}'. Without it guessed."
    ),
)
@click.option("--name", help="The study's name in tables and files; without it DIR's.")
@click.option("--title", help="What people see above the consent; without it the question.")
@click.option(
    "--question",
    metavar="TEXT",
    help="What is asked of a pair; without it which is more realistic.",
)
@click.option(
    "--seed",
    default=1,
    show_default=True,
    type=click.IntRange(0, 2**63 - 1),
    help="Draws orders and sides; it is recorded.",
)
@click.option("--dry-run", is_flag=True, help="Say what was understood and write nothing.")
def new(
    images: Path,
    out: Path | None,
    pattern: str | None,
    name: str | None,
    title: str | None,
    question: str | None,
    seed: int,
    dry_run: bool,
) -> None:
    """Make a study out of the images in the folder IMAGES.

    Their names say which condition each shows, at which level: close-up_golubev.png, or
    golubev/close-up.png in folders. A table says what was understood.
    """
    from app.study import minutes
    from stimuli import folder as folders

    if out is None and not dry_run:
        raise click.UsageError("expected --out DIR, or --dry-run")
    folder = folders.read_folder(images, pattern)
    for line in folders.understood(folder):
        click.echo(line)
    for note in folder.notes:
        click.echo(note, err=True)
    if dry_run:
        return
    slug = re.sub(r"[^a-z0-9_-]+", "-", (name or out.resolve().name).lower()).strip("-_")
    study = folders.create(
        folder,
        out,
        name=slug or "study",
        title=title or question or "Which image looks more realistic?",
        question=question,
        seed=seed,
    )
    for note in folders.remarks(study, out):
        click.echo(note, err=True)
    low, high = minutes(study)
    few = "[assignment] pairs = N asks each person fewer"
    click.echo(f"each person is asked {study.questions} questions: {low} to {high} minutes")
    click.echo(f"20 people give each of the {study.pairs} pairs 20 answers; {few}")
    click.echo(f"{out / folders.STUDY_FILE}: texts to look through; then")
    click.echo(f"subdermal study refresh {out}    # after each change")
    click.echo(f"subdermal serve {out}            # http://127.0.0.1:8000/")


@command.command()
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
def refresh(directory: Path) -> None:
    """Write the manifest of the study in DIR anew, after its study.toml or images were changed.

    Once somebody has taken part `subdermal serve` refuses another study: raise `version`.
    """
    from stimuli import folder

    study = folder.refresh(directory)
    images = len(study.cells) * len(study.techniques)
    click.echo(f"{directory}: {images} images, {study.questions} questions for each person")
