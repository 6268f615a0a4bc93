"""`subdermal montecarlo`: photons through layers, totals and radial curves."""

import click

from app import workers as working


@click.command()
@click.option(
    "--layer",
    "layers",
    multiple=True,
    required=True,
    metavar="TEXT",
    help='A layer, the top one first, as "n=1.4 mu_a=1 mu_s=10 g=0.9 d=1": 1/mm and mm. '
    "Left out, n is 1, g is 0 and d is infinite. Repeat it for more layers.",
)
@click.option(
    "--photons",
    default=1_000_000,
    show_default=True,
    type=click.IntRange(64),
    help="How many photons are walked.",
)
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=click.IntRange(0),
    help="Draws every photon's path; the same seed gives the same numbers.",
)
@click.option(
    "--illumination",
    default="searchlight",
    show_default=True,
    type=click.Choice(["searchlight", "diffuse"]),
    help="Light at one point: straight down, or cosine-distributed from above.",
)
@click.option(
    "--n-above", default=1.0, show_default=True, help="Index of refraction above the top layer."
)
@click.option(
    "--n-below", default=1.0, show_default=True, help="Index of refraction below the last layer."
)
@click.option(
    "--r-max",
    "r_max_mm",
    type=float,
    metavar="MM",
    help="Radius of the last ring, mm. Without it one that holds nearly all of the light.",
)
@click.option(
    "--bins",
    default=120,
    show_default=True,
    type=click.IntRange(1, 10_000),
    help="How many rings the radius is cut into, the finest in the middle.",
)
@working.options
@click.option(
    "--no-cache",
    is_flag=True,
    help="Walk anew and keep nothing; else results are kept and interrupted runs go on.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Write one JSON object with everything, instead of two tables.",
)
def command(
    layers,
    photons,
    seed,
    illumination,
    n_above,
    n_below,
    r_max_mm,
    bins,
    workers,
    cluster,
    no_cache,
    as_json,
) -> None:
    """Send photons through layers and say what is reflected, transmitted and absorbed, with
    standard errors.

    Shares are of the incident light. Specular is what leaves above without being scattered,
    ballistic the same below. R and T are what leaves scattered, per mm^2, on rings around the beam.
    """
    from renderer.optics.montecarlo import Layer, simulate

    with working.crew(workers, cluster) as crew:
        result = simulate(
            [Layer.parse(text) for text in layers],
            photons,
            seed,
            n_above,
            n_below,
            illumination,
            r_max_mm,
            bins,
            cache=not no_cache,
            progress=True,
            executor=crew.executor,
        )
    if as_json:
        import json

        click.echo(json.dumps(result.as_dict(), allow_nan=False))
        return
    click.echo(f"{'share of the light':<24}{'mean':>10}{'error':>10}")
    for name in (
        "specular",
        "diffuse_reflectance",
        "single_reflectance",
        "multiple_reflectance",
        "transmittance",
        "ballistic",
        "single_transmittance",
        "multiple_transmittance",
        "absorbed",
    ):
        click.echo(
            f"{name:<24}{getattr(result, name):>10.6f}{getattr(result, f'{name}_error'):>10.6f}"
        )
    for i, (share, error) in enumerate(
        zip(result.absorbed_by_layer, result.absorbed_by_layer_error, strict=True), 1
    ):
        click.echo(f"{f'absorbed in layer {i}':<24}{share:>10.6f}{error:>10.6f}")
    click.echo(f"\n{'r_mm':>12}{'R':>14}{'R_error':>14}{'T':>14}{'T_error':>14}")
    for row in zip(result.r_mm, result.R, result.R_error, result.T, result.T_error, strict=True):
        click.echo(f"{row[0]:>12.6g}" + "".join(f"{value:>14.6e}" for value in row[1:]))
    beyond = (result.R_beyond, result.R_beyond_error, result.T_beyond, result.T_beyond_error)
    click.echo(f"{'beyond':>12}" + "".join(f"{v:>14.6e}" for v in beyond) + "  (shares)")
