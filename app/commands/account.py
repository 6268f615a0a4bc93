"""`subdermal account`: who may sign in to the dashboard, as what."""

import os
import sys
from pathlib import Path

import click

from app.opening import database_option, directory_argument, opened

#: Where a password is taken from, in place of the terminal.
PASSWORD = "SUBDERMAL_PASSWORD"

name_argument = click.argument("name", metavar="NAME")
generate_option = click.option(
    "--generate", is_flag=True, help="Make a random password and show it once."
)


def _new_password(generate: bool) -> tuple[str, bool]:
    """A password, and whether it is to be shown."""
    from app.accounts import generated
    from app.errors import InputError

    if generate:
        return generated(), True
    if (given := os.environ.get(PASSWORD)) is not None:
        return given, False
    if not sys.stdin.isatty():
        raise InputError(
            f"there is no terminal to ask for the password at; expected {PASSWORD} in the "
            "environment, or --generate"
        )
    return click.prompt("Password", hide_input=True, confirmation_prompt=True), False


def _tell(done: str, password: str, show: bool) -> None:
    click.echo(done)
    if show:
        click.echo(f"password  {password}   (shown only now)")


@click.group(no_args_is_help=False)
def command() -> None:
    """Say who may sign in to the dashboard of the study in DIR, also while it is served.

    Owners see and change everything; viewers see the dashboard and its downloads, and change
    nothing. Where several studies are served, the accounts of the first are those of all. A
    password is asked for at the terminal, or taken from SUBDERMAL_PASSWORD in the environment.
    """


@command.command()
@directory_argument
@name_argument
@click.option(
    "--role",
    type=click.Choice(["owner", "viewer"]),
    default="viewer",
    show_default=True,
    help="What they may do.",
)
@generate_option
@database_option
def add(directory: Path, name: str, role: str, generate: bool, database: str | None) -> None:
    """Let NAME sign in to the dashboard of the study in DIR.

    The password has at least 12 characters.
    """
    from app import accounts

    _, answers = opened(directory, database)
    password, show = _new_password(generate)
    with answers.write() as session:
        account = accounts.add(session, name, role, password, who=accounts.COMMAND)
    _tell(f"{account.name} may sign in as {role}", password, show)


@command.command("list")
@directory_argument
@database_option
def list_all(directory: Path, database: str | None) -> None:
    """Print the accounts in DIR: name, role, when it was made and last signed in (UTC)."""
    from app import accounts

    _, answers = opened(directory, database)
    with answers.read() as session:
        for account, last in accounts.everybody(session):
            times = (f"{t:%Y-%m-%d %H:%M}" if t else "never" for t in (account.made_at, last))
            click.echo("\t".join((account.name, account.role, *times)))


@command.command()
@directory_argument
@name_argument
@generate_option
@database_option
def password(directory: Path, name: str, generate: bool, database: str | None) -> None:
    """Set another password for NAME in DIR, which ends every sign-in of theirs."""
    from app import accounts

    _, answers = opened(directory, database)
    with answers.read() as session:
        accounts.named(session, name)  # before anything is asked
    new, show = _new_password(generate)
    with answers.write() as session:
        account = accounts.named(session, name)
        accounts.set_password(session, account, new, who=accounts.COMMAND)
    _tell(f"{account.name} has another password; every sign-in of theirs has ended", new, show)


@command.command()
@directory_argument
@name_argument
@click.argument("role", metavar="ROLE", type=click.Choice(["owner", "viewer"]))
@database_option
def role(directory: Path, name: str, role: str, database: str | None) -> None:
    """Give NAME in DIR another ROLE, owner or viewer, from their next click on."""
    from app import accounts

    _, answers = opened(directory, database)
    with answers.write() as session:
        account = accounts.named(session, name)
        accounts.set_role(session, account, role, who=accounts.COMMAND)
    click.echo(f"{account.name} is {role}")


@command.command()
@directory_argument
@name_argument
@database_option
def remove(directory: Path, name: str, database: str | None) -> None:
    """Take the account NAME in DIR away, from their next click on.

    What they did stays in the log.
    """
    from app import accounts

    _, answers = opened(directory, database)
    with answers.write() as session:
        account = accounts.named(session, name)
        accounts.remove(session, account, who=accounts.COMMAND)
    click.echo(f"{account.name} is removed")
