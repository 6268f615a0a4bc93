"""subdermal profile: diffusion profiles of one medium, side by side."""

from pathlib import Path

import click

from app.commands.media import medium_options, stack_of, writable


@click.command("profile")
@click.argument("models", nargs=-1, required=True, metavar="MODEL...")
@medium_options
@click.option(
    "--out",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The file to write: .csv for a table, .svg or .png for a figure.",
)
@click.option(
    "--totals",
    is_flag=True,
    help="Print total reflectance and transmittance of each model and channel instead.",
)
@click.option(
    "--r-max",
    type=float,
    metavar="MM",
    help="The largest radius in mm; chosen to hold 99.9 % of the light if not given.",
)
@click.option(
    "--points",
    type=click.IntRange(2, 100_000),
    default=400,
    show_default=True,
    help="Radii, evenly spread over their logarithm.",
)
@click.option(
    "--terms",
    type=click.IntRange(1, 20),
    default=6,
    show_default=True,
    help="Gaussians of gaussian_sum.",
)
@click.option(
    "--parametrisation",
    type=click.Choice(["mfp", "dmfp", "diffuse"]),
    default="mfp",
    show_default=True,
    help="Which of burley's three curve fits.",
)
@click.option(
    "--photons",
    type=click.IntRange(1),
    default=1_000_000,
    show_default=True,
    help="Photons a channel of montecarlo.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of montecarlo."
)
def command(models, out, totals, r_max, points, terms, parametrisation, photons, seed, **medium):
    """Plot or tabulate MODEL... for one medium: R_d(r) and T_d(r) in 1/mm^2, per unit of flux that
    has entered.

    Models: dipole, better_dipole, multipole, layered, quantized_diffusion, burley, gaussian_sum,
    montecarlo.
    """
    import numpy as np

    from renderer.errors import InputError
    from renderer.optics import models as table_of_models
    from renderer.optics import table
    from renderer.optics.medium import finest_mm, reach_mm

    stack = stack_of(**medium)
    parameters = {
        "gaussian_sum": {"terms": terms},
        "burley": {"parametrisation": parametrisation},
        "montecarlo": {"photons": photons, "seed": seed},
    }
    chosen = [
        table_of_models.make(name, stack, **parameters.get(name, {}))
        for name in dict.fromkeys(models)
    ]
    for profile in chosen:
        if np.isfinite(stack.thickness_mm) and not profile.knows_thickness:
            click.echo(
                f"{profile.name} knows no thickness: its R is that of a half-space", err=True
            )
    if totals:
        if out:
            raise InputError("got --totals and --out; expected one of them (totals are printed)")
        click.echo(table.totals_csv(chosen), nl=False)
        return
    if out is None:
        raise InputError(
            "there is no --out FILE; expected one that ends in .csv, .svg or .png, or --totals"
        )
    writable(out, (".csv", ".svg", ".png"))
    if r_max is not None and not (np.isfinite(r_max) and r_max > 0):
        raise InputError(f"--r-max is {r_max:g}; expected more than 0 mm")
    r = np.geomspace(
        min(finest_mm(stack) / 1000, (r_max or np.inf) / 1000),
        r_max or reach_mm(stack),
        points,
    )
    if out.suffix.lower() == ".csv":
        out.write_text(table.profiles_csv(chosen, r), encoding="utf-8")
    else:
        from renderer.optics import figures

        figures.save(figures.compare(chosen, r_max), out)
    click.echo(
        f"{out}: {', '.join(profile.name for profile in chosen)} of {stack.name}, {points} "
        f"radii to {r[-1]:.3g} mm"
    )
