"""`subdermal archive`: the whole of a study in one file."""

from pathlib import Path

import click


@click.command()
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option(
    "--out",
    required=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The archive, a zip that only its owner can read.",
)
@click.option(
    "--database",
    metavar="URL",
    help="Database of the answers, as an SQLAlchemy URL. Without it DIR/study.sqlite3.",
)
def command(directory: Path, out: Path, database: str | None) -> None:
    """Write the study in DIR into one file: manifest, images, every row of its database.

    The study may be running: the archive is of one moment. `subdermal restore` makes the study of
    it again, also over another kind of database. It holds keys and codes: keep it as safe as the
    database.
    """
    from app import archive
    from app.database import Database
    from app.study import Study

    study = Study.open(directory)
    url = database or study.database_url(False)
    rows = archive.write(out, study, Database.open(url, study, simulated=False))
    click.echo(f"{out}: {rows['participants']} participants, {rows['responses']} answers")
