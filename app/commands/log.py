"""`subdermal log`: who did what with a study."""

from pathlib import Path

import click

from app.opening import database_option, directory_argument, opened


@click.command()
@directory_argument
@database_option
def command(directory: Path, database: str | None) -> None:
    """Print who did what with the study in DIR, as CSV.

    Sign-ins and failures, states, exclusions, links, downloads; where several studies are served,
    sign-ins and accounts stand with the first. Nothing in it can be changed or deleted: the
    database refuses to.
    """
    from app import logs

    _, answers = opened(directory, database)
    with answers.read() as session, answers.read() as accounts_session:
        for line in logs.csv(session, accounts_session):
            click.echo(line, nl=False)
