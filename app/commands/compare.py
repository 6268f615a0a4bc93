"""subdermal compare: techniques beside the reference, as a table and as a sheet of pictures."""

from pathlib import Path

import click

from app import drawing
from app import workers as working
from app.commands.media import writable

LAYERED = (
    "; layers are walked as that one medium, which lets other light through thin parts than they do"
)


def _crop(_context, _parameter, value: str | None):
    from stimuli.compare import parse_crop

    return None if value is None else parse_crop(value)


@click.command("compare")
@click.argument("scene")
@click.option(
    "--techniques",
    "-t",
    multiple=True,
    default=["all"],
    show_default=True,
    metavar="NAME[:KEY=VALUE...]",
    help="A technique with its parameters, golubev:samples=512, or all; repeat for more.",
)
@click.option(
    "--against",
    default="reference",
    show_default=True,
    metavar="NAME[:KEY=VALUE...]",
    help="What they are compared to: a technique of its own in the reference's place.",
)
@click.option(
    "--framing",
    "-f",
    "framings",
    multiple=True,
    help="close-up, head-shot or half-length, repeat for more; the scene's own camera without it.",
)
@drawing.size("960x540", "the whole image")
@click.option(
    "--crop",
    metavar="WxH+X+Y",
    callback=_crop,
    help="The part that is compared, pixel for pixel; all of the image if not given.",
)
@click.option(
    "--walks",
    type=click.IntRange(2, 4096),
    default=64,
    show_default=True,
    help="Random walks of the reference a computed pixel and channel; even.",
)
@click.option(
    "--pool",
    "pool_mm",
    type=click.FloatRange(0, 20),
    default=0.0,
    show_default=True,
    metavar="MM",
    help="Denoise the reference over so much, with a small bias; 0: no bias.",
)
@click.option(
    "--light",
    type=click.Choice(["given", "traced"]),
    default="given",
    show_default=True,
    help="The reference's: what techniques are given, or traced from the lamps on.",
)
@click.option(
    "--index",
    type=click.FloatRange(0, 3),
    default=0.0,
    show_default=True,
    help="Of refraction of the reference's face, 1.4 for skin; 0: the medium's own.",
)
@drawing.supersample(1, "Computed pixels in a pixel")
@drawing.patches("A value over the scene's, by its dotted key: lights.rim=false; repeat for more.")
@click.option(
    "--within",
    "within_mm",
    type=click.FloatRange(0.01, 1000),
    default=3.0,
    show_default=True,
    metavar="MM",
    help="How far from a cast shadow's edge still counts as beside it.",
)
@click.option(
    "--thin",
    "thin_mm",
    type=click.FloatRange(0.01, 1000),
    default=8.0,
    show_default=True,
    metavar="MM",
    help="How thick a part that is lit from behind may be.",
)
@drawing.seed("the walks, of hair, skin noise and baked light")
@click.option(
    "--out",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The PNG file for the sheet; with several framings, one a framing (NAME-close-up.png).",
)
@click.option(
    "--table",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The CSV file for the table, which is printed in any case.",
)
@click.option(
    "--columns",
    type=click.IntRange(1, 16),
    default=4,
    show_default=True,
    help="Techniques beside each other in the sheet.",
)
@click.option(
    "--zoom",
    type=click.IntRange(1, 8),
    default=1,
    show_default=True,
    help="Pixels of the sheet for a pixel, along each side.",
)
@working.options
def command(
    scene,
    techniques,
    against,
    framings,
    crop,
    patches,
    out,
    table,
    columns,
    zoom,
    workers,
    cluster,
    **options,
) -> None:
    """Say how far techniques are from the truth in SCENE, a name of stimuli/scenes or a TOML file.

    The truth is the technique `reference`: random walks of light through the same medium under the
    same irradiance. Errors of light are stated without its noise; those of pictures (DSSIM, FLIP)
    against one of half of the walks and one of all, so that the noise's share is seen. What takes
    long is kept, and goes on where it was interrupted.
    """
    from tqdm import tqdm

    from analysis.objective import MAPS
    from stimuli.compare import Options, chosen, compare, sheet, write_table
    from stimuli.errors import InputError

    if out:
        writable(out, (".png",))
    if table:
        writable(table, (".csv",))
    other = None if against == "reference" else chosen([against])
    if other and len(other) != 1:
        raise InputError(f"--against is {against!r}; expected one technique")
    settings = Options(crop=crop, **options)
    made, framings = chosen(techniques), framings or [""]
    with (
        working.crew(workers, cluster) as crew,
        tqdm(total=len(framings) * len({*made} - {*(other or ())}), disable=None) as bar,
    ):

        def advance(what: str) -> None:
            bar.set_description(what)
            bar.update()

        shots = compare(
            *(scene, patches, framings, made, settings, MAPS, other), crew.executor, advance
        )
    for shot in shots:
        if other:
            click.echo(f"{shot.framing}: against {shot.truth}")
            _print([row.cells() for row in shot.rows])
            continue
        noise = " / ".join(f"{v:.4f}" for v in shot.noise)
        residual = " / ".join(f"{v:.4f}" for v in shot.residual)
        click.echo(
            f"{shot.framing}: reference of {options['walks']} walks"
            f"{' (denoised)' if options['pool_mm'] else ''}, standard error {noise} a "
            f"computed pixel; its medium stays {residual} from the curve (rms at an edge)"
            f"{LAYERED if shot.layered else ''}"
        )
        _print([row.cells() for row in shot.rows])
    if table:
        write_table(shots, table)
        click.echo(f"{table}: {sum(len(shot.rows) for shot in shots)} rows")
    for shot in shots if out else ():
        several = f"-{shot.framing.replace(' ', '-')}" if len(shots) > 1 else ""
        file = out.with_name(f"{out.stem}{several}{out.suffix}")
        page = sheet(shot, columns, zoom)
        page.save(file, optimize=True)
        click.echo(f"{file}: {page.width}x{page.height}")


def _print(rows: list[dict]) -> None:
    """A table with aligned columns; what a framing has in common stands above it."""
    names = [name for name in rows[0] if name != "framing"] if rows else []
    lines = [names] + [
        [f"{row[n]:.4f}" if isinstance(row[n], float) else str(row[n]) for n in names]
        for row in rows
    ]
    widths = [max(map(len, column)) for column in zip(*lines)]
    for line in lines:
        left = "  ".join(text.ljust(w) for text, w in zip(line[:2], widths))
        right = "  ".join(text.rjust(w) for text, w in zip(line[2:], widths[2:]))
        click.echo(f"  {left}  {right}".rstrip())
