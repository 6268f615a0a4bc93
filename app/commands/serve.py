"""`subdermal serve`: the questionnaire and the dashboard of a study, or of several."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from app.hosting import Hosted

#: What is served, also in a file.
STUDIES = "studies"


def _read_config(ctx: click.Context, parameter: click.Parameter, value: Path | None) -> None:
    """Take the options of a TOML file for defaults; a name that is none is refused."""
    if value is None:
        return
    from app.errors import InputError

    try:
        settings = tomllib.loads(value.read_text("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{value}: is no TOML ({error})") from None
    options = {STUDIES: STUDIES} | {
        option.removeprefix("--").replace("-", "_"): one.name
        for one in ctx.command.params
        for option in one.opts
        if option.startswith("--") and one is not parameter
    }
    for name in settings:
        if name.replace("-", "_") not in options:
            raise InputError(f"{value}: {name} is no option; expected {', '.join(sorted(options))}")
    ctx.default_map = {options[name.replace("-", "_")]: value for name, value in settings.items()}


class _Place(click.ParamType):
    """DIR or NAME=DIR; a list of them in the environment is separated as in PATH."""

    name = "place"
    envvar_list_splitter = os.pathsep

    def convert(self, value, param, ctx):
        from app.hosting import named

        if not isinstance(value, str):
            return value
        name, rest = (None, value) if Path(value).is_dir() else named(value)
        if Path(rest).is_file():
            self.fail(f"{rest!r} is a file; expected a folder", param, ctx)
        return name, Path(rest)


@click.command(context_settings={"auto_envvar_prefix": "SUBDERMAL_SERVE"})
@click.argument(
    STUDIES,
    metavar="DIR...",
    nargs=-1,
    required=True,
    envvar="SUBDERMAL_SERVE_STUDIES",
    type=_Place(),
)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address to listen on; 0.0.0.0 for every network of this machine.",
)
@click.option(
    "--port",
    default=8000,
    show_default=True,
    type=click.IntRange(0, 65535),
    help="Port to listen on; 0 takes a free one.",
)
@click.option(
    "--workers",
    default=os.cpu_count() or 1,
    show_default="the number of cores",
    type=click.IntRange(1, 64),
    help="Processes that answer; each needs about 100 MB of memory of its own.",
)
@click.option(
    "--threads",
    default=8,
    show_default=True,
    type=click.IntRange(1, 256),
    help="Requests that a process answers at once; others wait.",
)
@click.option(
    "--connections",
    default=10_000,
    show_default=True,
    type=click.IntRange(1, 1_000_000),
    help="Connections that a process holds, where it may open so many files.",
)
@click.option(
    "--idle",
    default=60,
    show_default=True,
    type=click.IntRange(1, 86_400),
    help="Seconds after which a connection on which nothing happens is closed.",
)
@click.option(
    "--grace",
    default=10,
    show_default=True,
    type=click.IntRange(1, 3600),
    help="Seconds in which requests that are being answered may end when the server stops.",
)
@click.option(
    "--database",
    "databases",
    multiple=True,
    metavar="[NAME=]URL",
    help=(
        "Database of the answers, as an SQLAlchemy URL, without it DIR/study.sqlite3; of several "
        "studies one of each, by its name."
    ),
)
@click.option(
    "--enrolments",
    default=100,
    show_default=True,
    type=click.IntRange(min=0),
    help="People who may begin from one address within ten minutes; 0 for no limit.",
)
@click.option(
    "--trusted-host",
    "trusted_hosts",
    multiple=True,
    metavar="NAME",
    help="Name under which the server may be asked, such as study.example; others are refused.",
)
@click.option(
    "--metrics-token",
    metavar="TOKEN",
    help="Who sends it may read /metrics; best given as SUBDERMAL_SERVE_METRICS_TOKEN.",
)
@click.option(
    "--config",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    is_eager=True,
    expose_value=False,
    callback=_read_config,
    metavar="FILE",
    help="These options in TOML, without dashes: port = 80. Those given here go before.",
)
@click.option(
    "--trusted-proxy",
    metavar="ADDRESS",
    help=(
        "Address of a reverse proxy that ends https; its X-Forwarded-Proto, -Host and -For "
        "are believed."
    ),
)
def command(
    studies: tuple[tuple[str | None, Path], ...],
    host: str,
    port: int,
    workers: int,
    threads: int,
    connections: int,
    idle: int,
    grace: int,
    databases: tuple[str, ...],
    enrolments: int,
    trusted_hosts: tuple[str, ...],
    metrics_token: str | None,
    trusted_proxy: str | None,
) -> None:
    """Serve the questionnaire and the dashboard of the study in DIR (a folder with a
    manifest.json), or of several studies.

    One study stands at /. Of several the first stands there, so that its addresses stay, and each
    other one at /s/NAME/, where NAME is its own name, or another one where it is given as NAME=DIR.
    The accounts of the first are those of all.

    Every option may also stand in the environment, --port as SUBDERMAL_SERVE_PORT, or in a file.
    At the first start an account `owner` is made and its password shown once; `subdermal account`
    makes others. Simulated participants of the same study, if there are any, are under /simulated/.
    """
    from app import accounts, server
    from app.errors import InputError
    from app.hosting import assemble, named

    urls = dict(named(one) for one in databases)
    if len(urls) < len(databases):
        raise InputError("--database: expected one of each study, as NAME=URL")
    application, hosted = assemble(
        studies,
        urls,
        enrolments=enrolments,
        trusted_hosts=trusted_hosts,
        metrics_token=metrics_token,
    )
    proxy = {}
    if trusted_proxy:
        proxy = {
            "trusted_proxy": trusted_proxy,
            "trusted_proxy_headers": {"x-forwarded-for", "x-forwarded-proto", "x-forwarded-host"},
        }
    sockets = server.listen(host, port)
    with hosted[0].app.extensions["database"].write() as session:
        shown = accounts.add_first(session)

    address = (
        f"http://{'127.0.0.1' if host in ('0.0.0.0', '::') else host}:{server.port_of(sockets)}"
    )
    for one in hosted:
        if len(hosted) > 1:
            click.echo(f"study          {one.name}")
        _tell(one, address)
    if len(hosted) > 1:
        click.echo(f"all studies    {address}/dashboard/studies")
    if shown:
        click.echo(f"password       {shown}   (of the account {accounts.FIRST}; shown only now)")
    click.echo("Ctrl+C ends the server; every answer that was acknowledged is saved.")
    for one in hosted:
        for app in filter(None, (one.app, one.twin)):
            app.extensions["database"].close()  # each worker opens its own connections
    limits = server.Limits(threads, connections, idle, grace)
    server.run(application, sockets, workers, limits, **proxy)


def _tell(hosted: Hosted, address: str) -> None:
    """The addresses of a study."""
    root, study = address + hosted.root, hosted.app.extensions["study"]
    click.echo(f"questionnaire  {root}/")
    click.echo(f"dashboard      {root}/dashboard/")
    if study.report(False).is_file():
        click.echo(f"report         {root}/dashboard/report/")
    if hosted.twin:
        click.echo(f"simulated      {root}/simulated/dashboard/")
        if study.report(True).is_file():
            click.echo(f"               {root}/simulated/dashboard/report/")
