"""`subdermal simulate`: participants that are programs, through the real questionnaire."""

from contextlib import nullcontext
from pathlib import Path

import click


@click.command()
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option(
    "--participants",
    default=20,
    show_default=True,
    type=click.IntRange(1, 100_000),
    help="How many there shall be; those already there count.",
)
@click.option(
    "--seed",
    default=1,
    show_default=True,
    type=click.IntRange(0, 2**63 - 1),
    help="Draws every participant's answers; the same seed gives the same ones.",
)
@click.option(
    "--url",
    help=(
        "Address of a running simulated study, such as http://127.0.0.1:8000/simulated/. "
        "Without it one is started meanwhile."
    ),
)
def command(directory: Path, participants: int, seed: int, url: str | None) -> None:
    """Send simulated participants through the questionnaire of the study in DIR.

    They answer over HTTP, as a browser would, into DIR/simulated.sqlite3, never into the answers of
    people. Then their answers are in DIR/simulated/: responses.csv and its codebook.
    """
    from tqdm import tqdm

    from app import create_app, export
    from app.errors import InputError
    from app.server import running
    from app.simulation.client import Visitor
    from app.simulation.people import Crowd

    app = create_app(directory, simulated=True)
    study, database = app.extensions["study"], app.extensions["database"]
    with nullcontext(url) if url else running(app) as address:
        visitor = Visitor(address, study, Crowd(study, seed), seed)
        done = {
            person["number"] for person in visitor.status()["participants"] if person["completed"]
        }
        missing = [number for number in range(1, participants + 1) if number not in done]
        for number in tqdm(missing, desc="simulated participants", unit="", disable=None):
            for _ in visitor.take_part(number):
                pass
        expected = visitor.status()["answers"]

    out = study.directory / "simulated"
    with database.read() as session:
        answers = export.count(session)
        if answers != expected:
            here = directory / "simulated.sqlite3"
            raise InputError(
                f"--url {url}: its {expected} answers are not the {answers} of {here}; "
                "download them from its dashboard"
            )
        export.write(out, session, study, simulated=True)
    click.echo(
        f"{directory / 'simulated' / 'responses.csv'}: {answers} simulated answers, "
        f"{len(missing)} participants new"
    )
