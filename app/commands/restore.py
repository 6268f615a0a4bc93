"""`subdermal restore`: a study out of its archive."""

from pathlib import Path

import click


@click.command()
@click.argument("archive", metavar="FILE", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--out",
    required=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="The study's folder, which must be new or empty.",
)
@click.option(
    "--database",
    metavar="URL",
    help="An empty database for the answers, as an SQLAlchemy URL. Without it DIR/study.sqlite3.",
)
def command(archive: Path, out: Path, database: str | None) -> None:
    """Make a study out of the archive FILE, with everything that participants and researchers did.

    Every file and table is checked by its hash; nothing is made where one is damaged.
    """
    from app.archive import read

    rows = read(archive, out, database)
    click.echo(f"{out}: {rows['participants']} participants, {rows['responses']} answers")
