"""`subdermal archive`: the whole of a study in one file."""

from pathlib import Path

import click

from app.opening import database_option, directory_argument, opened


@click.command()
@directory_argument
@click.option(
    "--out",
    required=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The archive, a zip that only its owner can read.",
)
@database_option
def command(directory: Path, out: Path, database: str | None) -> None:
    """Write the study in DIR into one file: manifest, images, every row of its database.

    The study may be running: the archive is of one moment. `subdermal restore` makes the study of
    it again, also over another kind of database. It holds keys and codes: keep it as safe as the
    database.
    """
    from app import archive, recruiting
    from app.accounts import COMMAND

    study, answers = opened(directory, database)
    rows = archive.write(out, study, answers)
    with answers.write() as session:
        recruiting.note(session, "archive", out.name, who=COMMAND)
    click.echo(f"{out}: {rows['participants']} participants, {rows['responses']} answers")
