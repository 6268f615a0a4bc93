"""`subdermal harmonics`: the nine spherical-harmonic coefficients of an environment map."""

import json
from pathlib import Path

import click


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--turn",
    "turn_deg",
    default=0.0,
    show_default=True,
    help="Degrees by which the map is turned towards the person's left.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def command(file: Path, turn_deg: float, as_json: bool) -> None:
    """Project FILE, an .hdr or .exr map of latitude and longitude onto nine spherical harmonics.

    Ramamoorthi and Hanrahan 2001: degree 0 to 2, red, green, blue; x is the person's left, y up, z
    where heads look. A constant radiance of 1 has L00 = sqrt(4 pi).
    """
    from renderer.scene import harmonics
    from renderer.scene.maps import read_map

    coefficients = harmonics.turned(harmonics.project(read_map(file)), turn_deg)
    if as_json:
        rows = dict(zip(harmonics.NAMES, coefficients.tolist(), strict=True))
        click.echo(json.dumps({"file": str(file), "turn_deg": turn_deg, "coefficients": rows}))
        return
    click.echo(f"{'':<6}{'red':>11}{'green':>11}{'blue':>11}")
    for name, row in zip(harmonics.NAMES, coefficients, strict=True):
        click.echo(f"{name:<6}" + "".join(f"{value:>11.5f}" for value in row))
    up, front = harmonics.irradiance(coefficients, [[0, 1, 0], [0, 0, 1]])
    for words, value in (("irradiance from above", up), ("irradiance from the front", front)):
        click.echo(f"{words}: {value[0]:.4f} / {value[1]:.4f} / {value[2]:.4f}")
