"""subdermal illumination: the gallery of local and global illumination models."""

from pathlib import Path

import click


def _pixel(_context, _parameter, value: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"got {value!r}; expected X,Y, such as 0.5,0.75") from None
    if not (0 <= x < 1 and 0 <= y < 1):
        raise click.BadParameter(f"got {value!r}; expected two shares from 0 to below 1")
    return x, y


@click.command("illumination")
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option(
    "--scene",
    default="box",
    show_default=True,
    help="The scene of the global methods: a name of stimuli/scenes, or a TOML file.",
)
@click.option(
    "--size",
    "size_px",
    type=click.IntRange(32, 2048),
    default=200,
    show_default=True,
    help="Pixels of each picture's side.",
)
@click.option(
    "--samples",
    type=click.IntRange(2),
    default=64,
    show_default=True,
    help="Paths a pixel of the Monte Carlo pictures.",
)
@click.option(
    "--patch",
    "patch_mm",
    type=click.FloatRange(0, min_open=True),
    default=62.5,
    show_default=True,
    metavar="MM",
    help="Side of radiosity's patches.",
)
@click.option(
    "--rays",
    type=click.IntRange(16),
    default=512,
    show_default=True,
    help="Rays from each patch for the form factors.",
)
@click.option(
    "--depth",
    type=click.IntRange(0, 20),
    default=6,
    show_default=True,
    help="How often a ray of the ray tracer is reflected or refracted.",
)
@click.option(
    "--pixel",
    default="0.3625,0.7375",
    show_default=True,
    metavar="X,Y",
    callback=_pixel,
    help="Whose tree of rays is drawn: shares of the picture from the left and the top.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Seed of form factors and paths.",
)
def command(folder, scene, size_px, samples, patch_mm, rays, depth, pixel, seed):
    """Draw the illumination models side by side into DIR: local ones on a ball (Lambert, Phong,
    Blinn-Phong, Cook-Torrance, ambient light, emission, attenuation), and one box by ray casting,
    ray tracing (Whitted), radiosity, radiosity with ray tracing, and Monte Carlo.

    gallery.png holds all, each picture is a PNG of its own, numbers.json and the printed table say
    how far radiosity and Monte Carlo agree. Run again, it goes on where it stopped.
    """
    from stimuli.illumination import Options, gallery

    options = Options(scene, size_px, samples, patch_mm, rays, depth, pixel, seed)
    path, numbers = gallery(folder, options, progress=True)
    for name, value in numbers.items():
        click.echo(f"{name:<46}{value:>12.6g}")
    click.echo(f"{path}: the gallery; {folder / 'numbers.json'}: the numbers")
