"""`subdermal links`: links that let one person begin each."""

from pathlib import Path

import click

from app.opening import database_option, directory_argument, opened


@click.command()
@directory_argument
@click.option(
    "--count",
    default=0,
    show_default=True,
    type=click.IntRange(0, 9999),
    help="How many new links to make and print, one a line.",
)
@click.option("--label", default="", metavar="TEXT", help="For whom they are, in links.csv.")
@click.option(
    "--address",
    default="http://127.0.0.1:8000/",
    show_default=True,
    metavar="URL",
    help="Where the study is reached.",
)
@click.option(
    "--only/--anybody",
    default=None,
    help="Whether from now on a link is needed to begin; unchanged when not given.",
)
@database_option
def command(
    directory: Path,
    count: int,
    label: str,
    address: str,
    only: bool | None,
    database: str | None,
) -> None:
    """Make single-use links of the study in DIR, also while it is served.

    A link is spent when somebody gives consent, and then lets nobody else begin; looking at it
    spends nothing. links.csv on the dashboard says which were used.
    """
    from app import recruiting
    from app.accounts import COMMAND

    _, answers = opened(directory, database)
    with answers.write() as session:
        tokens = recruiting.make_links(session, count, label, who=COMMAND) if count else []
        if only is not None:
            recruiting.set_links_only(session, only, who=COMMAND)
    for token in tokens:
        click.echo(f"{address.rstrip('/')}/?link={token}")
