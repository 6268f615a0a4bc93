"""`subdermal head`: a picture of how a scan is understood, before anything is rendered of it."""

from pathlib import Path

import click

from app import drawing


@click.command()
@click.argument("file", type=click.Path(dir_okay=False))
@drawing.said_of_scan
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Picture to write: .png, .pdf or .svg.",
)
def command(file: str, said: dict, out: Path) -> None:
    """Draw the scan in FILE from front and side with scale bar and landmarks, and say how it was
    understood.

    What is wrong in the picture is put right by the options; the same ones are taken by `render`
    and `build`, and by a study's [head].
    """
    from stimuli.head import understand

    for line in understand(file, said, out):
        click.echo(line)
    click.echo(f"{out}: written")
