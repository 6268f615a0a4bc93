"""The command line, `subdermal`: one verb a file in app/commands, loaded when it is asked for."""

import sys
from importlib import import_module

import click

VERBS = {
    "render": "app.commands.render",
    "techniques": "app.commands.techniques",
    "head": "app.commands.head",
    "person": "app.commands.person",
    "compare": "app.commands.compare",
    "experiment": "app.commands.experiment",
    "build": "app.commands.build",
    "study": "app.commands.study",
    "inspect": "app.commands.inspect",
    "strip": "app.commands.strip",
    "power": "app.commands.power",
    "serve": "app.commands.serve",
    "account": "app.commands.account",
    "log": "app.commands.log",
    "links": "app.commands.links",
    "simulate": "app.commands.simulate",
    "store": "app.commands.store",
    "archive": "app.commands.archive",
    "restore": "app.commands.restore",
    "analyse": "app.commands.analyse",
    "posterior": "app.commands.posterior",
    "profile": "app.commands.profile",
    "fit": "app.commands.fit",
    "redraw": "app.commands.redraw",
    "judge": "app.commands.judge",
    "montecarlo": "app.commands.montecarlo",
    "harmonics": "app.commands.harmonics",
    "skin": "app.commands.skin",
    "illumination": "app.commands.illumination",
    "cache": "app.commands.cache",
}


class LazyGroup(click.Group):
    """A group that imports a verb's module when the verb is looked up, and no other."""

    def list_commands(self, ctx):
        return list(VERBS)

    def get_command(self, ctx, name):
        return import_module(VERBS[name]).command if name in VERBS else None


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="subdermal", help="Show the version and end.")
@click.option(
    "--traceback", is_flag=True, help="Show where an error came from, not its one line alone."
)
def cli(traceback: bool) -> None:
    """Render skin with real-time subsurface scattering, ask people which picture looks more real,
    and turn their answers into tables and figures.
    """


def main(args: list[str] | None = None) -> int:
    """Run the command line and return its exit code.

    What a user can cause is said in one line on stderr: 2 for bad usage and bad input (any
    exception with an `exit_code`), 1 for a failing disk or network, 130 when interrupted. Anything
    else is a defect and keeps its traceback.
    """
    args = sys.argv[1:] if args is None else list(args)
    try:
        code = cli.main(args, prog_name="subdermal", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return error.exit_code
    except click.Abort:
        click.echo("subdermal: stopped", err=True)
        return 130
    except Exception as error:
        known = hasattr(error, "exit_code") or isinstance(error, OSError)
        if not known or args[:1] == ["--traceback"]:
            raise
        click.echo(f"subdermal: {one_line(error)}", err=True)
        return getattr(error, "exit_code", 1)


def one_line(error: Exception) -> str:
    """The message of an error on one line; usage errors also name the help to read."""
    if not isinstance(error, click.ClickException):
        return " ".join(str(error).split()) or type(error).__name__
    message = " ".join(error.format_message().split())
    ctx = getattr(error, "ctx", None)
    return f"{message} (see {ctx.command_path} --help)" if ctx else message


if __name__ == "__main__":
    sys.exit(main())
