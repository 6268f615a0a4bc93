"""subdermal fit: sums of Gaussians and separable kernels for the profile of a medium."""

from pathlib import Path

import click

from app.commands.media import medium_options, stack_of, writable

METHODS = ("svd", "guided", "preintegrated", "artist")


@click.command("fit")
@click.argument("kind", metavar="KIND", type=click.Choice(["gaussians", "separable"]))
@medium_options
@click.option(
    "--model",
    default="dipole",
    show_default=True,
    help="The profile to fit, by its name in `subdermal profile`; layered for several layers.",
)
@click.option(
    "--skin", is_flag=True, help="Fit d'Eon and Luebke's six Gaussians of skin instead of a medium."
)
@click.option(
    "--terms", type=click.IntRange(1, 20), default=6, show_default=True, help="Gaussians a channel."
)
@click.option(
    "--free",
    is_flag=True,
    help="Let the weights of the Gaussians sum to what fits best, not to the total reflectance.",
)
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="preintegrated",
    show_default=True,
    help="How to find the separable kernel.",
)
@click.option(
    "--k",
    type=float,
    default=2.0,
    show_default=True,
    help="Exponent of the guide function: 0 for the peak, 2 for the tail.",
)
@click.option(
    "--taps",
    type=click.IntRange(3, 41),
    default=25,
    show_default=True,
    help="Taps of the separable kernel, odd.",
)
@click.option(
    "--reach",
    type=float,
    metavar="MM",
    help="Half width of the separable kernel in mm; chosen to hold 97 % of the light if not given.",
)
@click.option(
    "--out",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Also write the fit as .json.",
)
def command(kind, model, skin, terms, free, method, k, taps, reach, out, **medium):
    """Fit KIND, gaussians or separable, to a diffusion profile and report it with its error.

    Gaussians: variance in mm^2 and weight of each, E of eq. 3.1 (relative, radial). Separable:
    offsets in mm and weights of the taps, and the RMS error of the product a(x) a(y) against the
    profile.
    """
    import json

    import numpy as np

    from renderer.errors import InputError
    from renderer.optics import figures, gaussians, models, separable
    from renderer.optics.medium import fit_radii
    from renderer.optics.table import CHANNELS

    if out:
        writable(out, (".json",))
    if taps % 2 == 0:
        raise InputError(f"--taps is {taps}; expected an odd number")
    if skin:
        if medium["medium"] is not None or medium["sigma_a"] is not None or medium["layers"]:
            raise InputError("got --skin and a medium; expected one of them")
        name, of_channel = (
            "skin of d'Eon and Luebke",
            lambda c: lambda r: gaussians.reflectance(r)[:, c],
        )
        total, radius = np.ones(3), lambda c: np.geomspace(1e-3, 14, 400)
        far = 3 * float(np.sqrt(gaussians.SKIN_VARIANCE_MM2[-1]))
    else:
        stack = stack_of(**medium)
        profile = models.make(model, stack)
        name, total, radius = (
            f"{model} of {stack.name}",
            profile.totals()[0],
            lambda c: fit_radii(stack, c),
        )
        of_channel = lambda c: lambda r: profile.reflectance(np.maximum(r, 1e-6))[:, c]
        far = reach or figures.shown_reach(profile)
    if reach is not None and not (np.isfinite(reach) and reach > 0):
        raise InputError(f"--reach is {reach:g}; expected more than 0 mm")
    report = {"fit": kind, "profile": name, "channels": {}}
    lines = [f"{kind} for {name}"]
    for c, channel in enumerate(CHANNELS):
        if kind == "gaussians":
            r = radius(c)
            fitted = gaussians.fit(r, of_channel(c)(r), terms, None if free else float(total[c]))
            channel_report = {
                "variance_mm2": fitted.variance_mm2.tolist(),
                "weights": fitted.weights.tolist(),
                "error": fitted.error,
            }
            lines.append(
                f"{channel}: E = {100 * fitted.error:.3f} %, weights sum to "
                f"{fitted.weights.sum():.5f}"
            )
            for v, w in zip(fitted.variance_mm2, fitted.weights, strict=True):
                lines.append(f"   v {v:.6g} mm^2  w {w:.6g}")
        else:
            half = reach or far
            extra = {}
            if method == "guided":
                kernel = separable.guided(of_channel(c), half, k)
            elif method == "artist":
                kernel, (near, wide, share) = separable.artist_fit(of_channel(c), half)
                extra = {"sigma_near_mm": near, "sigma_far_mm": wide, "near_weight": share}
            else:
                kernel = (separable.svd if method == "svd" else separable.preintegrated)(
                    of_channel(c), half
                )
            offsets = separable.tap_offsets(taps, half)
            weights = kernel.taps(offsets)
            channel_report = {
                "method": kernel.method,
                "offsets_mm": offsets.tolist(),
                "weights": weights.tolist(),
                "energy_kept": kernel.total**2,
                "rms_error": kernel.rms_error,
                **extra,
            }
            more = "".join(f", {key} {value:.4g}" for key, value in extra.items())
            lines.append(
                f"{channel}: {kernel.method}, RMS error {100 * kernel.rms_error:.2f} %, keeps "
                f"{100 * kernel.total**2:.2f} % of the energy{more}"
            )
            for offset, weight in zip(offsets[taps // 2 :], weights[taps // 2 :], strict=True):
                lines.append(f"   x {offset:8.4f} mm  w {weight:.6g}")
        report["channels"][channel] = channel_report
    click.echo("\n".join(lines))
    if out:
        out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
        click.echo(f"{out}: written")
