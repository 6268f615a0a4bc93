"""`subdermal person`: people to render: draw a new one, see those that there are."""

from pathlib import Path

import click

from app import drawing


@click.group(no_args_is_help=False)
def command() -> None:
    """People to render: a person is a TOML file, and a seed draws a new one."""


@command.command()
@click.argument("seed", type=click.IntRange(0))
@click.option("--sex", type=click.Choice(["female", "male"]), help="Without it either.")
@click.option(
    "--age",
    type=(click.FloatRange(16, 90), click.FloatRange(16, 90)),
    default=(20.0, 75.0),
    show_default=True,
    metavar="FROM TO",
    help="Bounds of the age in years.",
)
@click.option(
    "--tone",
    type=(click.FloatRange(0, 1), click.FloatRange(0, 1)),
    default=(0.0, 1.0),
    show_default=True,
    metavar="FROM TO",
    help="Bounds of the skin's tone, from 0, the lightest, to 1, the darkest.",
)
@click.option(
    "--ancestry",
    type=(click.FloatRange(0, 1), click.FloatRange(0, 1), click.FloatRange(0, 1)),
    default=(0.0, 0.0, 0.0),
    metavar="AFRICAN ASIAN CAUCASIAN",
    help="Weights of the data's three kinds of heads; without them drawn by the tone.",
)
@click.option(
    "--apart",
    type=click.FloatRange(0, 2),
    default=1.0,
    show_default=True,
    help="How far the face goes from the average.",
)
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="The person's file to write: .toml.",
)
def draw(seed, sex, age, tone, ancestry, apart, out) -> None:
    """Draw a person by SEED and write their file, to be rendered by --identity FILE or changed by
    hand. The same seed and bounds draw the same person.
    """
    from stimuli.person import Bounds, written

    if out.suffix != ".toml":
        raise click.BadParameter(f"{out}: expected a name that ends in .toml", param_hint="--out")
    text = written(seed, Bounds(sex or "", age, tone, ancestry, apart))
    out.write_text(text, encoding="utf-8")
    click.echo(f"{out}: {text.splitlines()[0].lstrip('# ')}")


@command.command()
@click.argument("names", nargs=-1, metavar="[PERSON]...")
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="The picture to write: .png or .jpg.",
)
@click.option("--scene", default="portrait", show_default=True, help="The scene they stand in.")
@click.option(
    "--technique", "-t", default="golubev", show_default=True, help="What scatters light in them."
)
@click.option(
    "--columns", type=click.IntRange(1, 20), default=4, show_default=True, help="People a row."
)
@drawing.patches("A value over the scene's, by its dotted key; repeat for more.")
@drawing.size("480x600", "each picture")
@drawing.supersample(2, "Samples a pixel")
@drawing.seed("hair, skin noise and baked light")
def sheet(names, out, scene, technique, columns, patches, size, supersample, seed) -> None:
    """Draw each PERSON, a name, a .toml file or a seed, side by side; all of stimuli/people where
    none is given.
    """
    from tqdm import tqdm

    from stimuli.person import everybody, portraits
    from stimuli.person import sheet as laid

    if out.suffix not in (".png", ".jpg"):
        raise click.BadParameter(f"{out}: expected .png or .jpg", param_hint="--out")
    names = names or everybody()
    drawn = portraits(names, scene, patches, technique, size, supersample, seed)
    pictures = list(tqdm(drawn, total=len(names), desc="people", leave=False))
    laid(pictures, min(columns, len(pictures))).save(out, quality=93)
    click.echo(f"{out}: {', '.join(names)}")
