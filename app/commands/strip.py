"""subdermal strip: the conditions of a study side by side in one picture."""

from pathlib import Path

import click


@click.command("strip")
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@click.option(
    "--framing",
    "-f",
    "framings",
    multiple=True,
    default=["close-up"],
    show_default=True,
    help="The framing to compare, by its name in the study; repeat for more rows.",
)
@click.option(
    "--crop",
    "crops",
    multiple=True,
    metavar="WxH+X+Y",
    help="The part to show, pixel for pixel; repeat for more rows. All of it if not given.",
)
@click.option(
    "--out",
    "-o",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="The PNG file to write.",
)
def command(folder: Path, framings: tuple[str, ...], crops: tuple[str, ...], out: Path) -> None:
    """Put every condition of the study in FOLDER side by side."""
    from stimuli.errors import InputError
    from stimuli.strip import parse_crop, strip

    if out.suffix.lower() != ".png" or not out.parent.is_dir():
        raise InputError(f"{out}: expected a file name that ends in .png in a folder that exists")
    sheet = strip(folder, framings, [parse_crop(text) for text in crops])
    sheet.save(out, optimize=True)
    click.echo(f"{out}: {sheet.width}x{sheet.height}")
