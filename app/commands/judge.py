"""subdermal judge: the error of every profile model against Monte Carlo."""

from pathlib import Path

import click

from app.commands.media import writable


@click.command("judge")
@click.option(
    "--medium",
    "media",
    multiple=True,
    metavar="NAME",
    help="A preset; repeat for more. wholemilk, marble, skin1 and ketchup if not given.",
)
@click.option(
    "--thickness",
    type=float,
    metavar="MM",
    help="Judge slabs of this thickness in mm, R and T; half-spaces if not given.",
)
@click.option(
    "--photons",
    type=click.IntRange(1000),
    default=1_000_000,
    show_default=True,
    help="Photons a channel.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the photons."
)
@click.option(
    "--out",
    "-o",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="The table to write: .csv for every number, .md to read.",
)
def command(media, thickness, photons, seed, out):
    """Compare every profile model with Monte Carlo and say which of them are bad at which material.

    Errors are relative: of the total reflectance, and the mean over radii of 0.1 to 10 mean free
    paths. The verdict goes by the worse of the two: up to 10 % good, 25 % fair, 60 % poor, beyond
    it bad.
    """
    from renderer.optics import judge
    from renderer.optics.medium import preset

    writable(out, (".csv", ".md"))
    names = media or judge.MATERIALS
    for name in names:
        preset(name)
    verdicts = judge.judge_presets(names, thickness, photons, seed)
    out.write_text(
        (judge.to_csv if out.suffix.lower() == ".csv" else judge.to_markdown)(verdicts),
        encoding="utf-8",
    )
    worst = sorted({f"{v.model} at {v.material}" for v in verdicts if v.words == "bad"})
    click.echo(
        f"{out}: {len(verdicts)} comparisons with {photons} photons each; bad: "
        f"{', '.join(worst) or 'none'}"
    )
