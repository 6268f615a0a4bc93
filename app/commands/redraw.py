"""subdermal redraw: the documents' figures of diffusion profiles, drawn again."""

from pathlib import Path

import click


@click.command("redraw")
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option(
    "--figure",
    "-f",
    "wanted",
    multiple=True,
    metavar="NAME",
    help=(
        "One of 001-4.4, 001-4.5, 001-4.6, 001-5.1, 000-2.14, 000-2.15, 000-2.17, 000-3.3, "
        "000-3.4, 000-3.5, 000-3.6, 000-3.9, translucency, transmittance; repeat for more. All if "
        "not given."
    ),
)
@click.option(
    "--format",
    "suffix",
    type=click.Choice(["svg", "png"]),
    default="svg",
    show_default=True,
    help="Kind of the files.",
)
@click.option(
    "--photons",
    type=click.IntRange(1000),
    default=1_000_000,
    show_default=True,
    help="Photons of the three figures that need Monte Carlo.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the photons."
)
def command(folder, wanted, suffix, photons, seed):
    """Draw the documents' figures of profiles again into DIR: dipole and multipole of marble
    (Rohat), Burley's fits against Monte Carlo, separable kernels, discs of samples (Vuletic).

    With a million photons the three figures that need them take about a minute.
    """
    from renderer.errors import InputError
    from renderer.optics import figures

    for name in wanted:
        if name not in figures.FIGURES:
            raise InputError(f"no figure {name!r}; expected one of {', '.join(figures.FIGURES)}")
    folder.mkdir(parents=True, exist_ok=True)
    for name in wanted or figures.FIGURES:
        path = folder / f"{name}.{suffix}"
        figures.save(figures.FIGURES[name](photons, seed), path)
        click.echo(f"{path}: {' '.join(figures.FIGURES[name].__doc__.split())}")
