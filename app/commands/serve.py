"""`subdermal serve`: the questionnaire and the dashboard of a study folder."""

import os
import tomllib
from pathlib import Path

import click


def _read_config(ctx: click.Context, parameter: click.Parameter, value: Path | None) -> None:
    """Take the options of a TOML file for defaults; a name that is none is refused."""
    if value is None:
        return
    from app.errors import InputError

    try:
        settings = tomllib.loads(value.read_text("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{value}: is no TOML ({error})") from None
    options = {
        option.removeprefix("--").replace("-", "_"): one.name
        for one in ctx.command.params
        for option in one.opts
        if option.startswith("--") and one is not parameter
    }
    for name in settings:
        if name.replace("-", "_") not in options:
            raise InputError(f"{value}: {name} is no option; expected {', '.join(sorted(options))}")
    ctx.default_map = {options[name.replace("-", "_")]: value for name, value in settings.items()}


@click.command(context_settings={"auto_envvar_prefix": "SUBDERMAL_SERVE"})
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
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
    "--database",
    metavar="URL",
    help="Database of the answers, as an SQLAlchemy URL. Without it DIR/study.sqlite3.",
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
    directory: Path,
    host: str,
    port: int,
    workers: int,
    database: str | None,
    enrolments: int,
    trusted_hosts: tuple[str, ...],
    metrics_token: str | None,
    trusted_proxy: str | None,
) -> None:
    """Serve the questionnaire and the dashboard of the study in DIR (a folder with a
    manifest.json).

    Every option may also stand in the environment, --port as SUBDERMAL_SERVE_PORT, or in a file.
    At the first start an account `owner` is made and its password shown once; `subdermal account`
    makes others. Simulated participants of the same study, if there are any, are under /simulated/.
    """
    from werkzeug.middleware.dispatcher import DispatcherMiddleware

    from app import accounts, create_app, server

    settings = {"trusted_hosts": trusted_hosts, "metrics_token": metrics_token}
    app = create_app(directory, database, enrolments=enrolments, **settings)
    study, answers = app.extensions["study"], app.extensions["database"]
    application, simulated = app, (study.directory / "simulated.sqlite3").is_file()
    if simulated:
        doorkeeper = app.extensions["doorkeeper"]  # one sign-in is for both
        twin = create_app(directory, simulated=True, doorkeeper=doorkeeper, **settings)
        application = DispatcherMiddleware(app, {"/simulated": twin})
    proxy = {}
    if trusted_proxy:
        proxy = {
            "trusted_proxy": trusted_proxy,
            "trusted_proxy_headers": {"x-forwarded-for", "x-forwarded-proto", "x-forwarded-host"},
        }
    sockets = server.listen(host, port)
    with answers.write() as session:
        shown = accounts.add_first(session)

    address = (
        f"http://{'127.0.0.1' if host in ('0.0.0.0', '::') else host}:{server.port_of(sockets)}"
    )
    click.echo(f"questionnaire  {address}/")
    click.echo(f"dashboard      {address}/dashboard/")
    if shown:
        click.echo(f"password       {shown}   (of the account {accounts.FIRST}; shown only now)")
    if study.report(False).is_file():
        click.echo(f"report         {address}/dashboard/report/")
    if simulated:
        click.echo(f"simulated      {address}/simulated/dashboard/")
        if study.report(True).is_file():
            click.echo(f"               {address}/simulated/dashboard/report/")
    click.echo("Ctrl+C ends the server; every answer that was acknowledged is saved.")
    for one in (app, twin) if simulated else (app,):
        one.extensions["database"].close()  # each worker opens its own connections
    server.run(application, sockets, workers, **proxy)
