"""`subdermal posterior`: worths by a Bayesian multilevel model, with all draws."""

from __future__ import annotations

import signal
import sys
from dataclasses import replace
from pathlib import Path

import click

from app.answers import numbers, read_answers, study_option, tell, varied_option, written


@click.command()
@click.argument("responses", type=click.Path(path_type=Path))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for posterior.md, its tables, the figure and the draws.",
)
@study_option
@varied_option
@click.option("--chains", type=int, help="Chains, 2 or more. Without it as declared, or 4.")
@click.option("--draws", type=int, help="Draws of each chain. Without it as declared, or 1000.")
@click.option(
    "--warmup", type=int, help="Steps before the first draw. Without it as declared, or 1000."
)
@click.option(
    "--target-acceptance",
    type=float,
    help="The share of steps to accept; nearer to 1 the steps are smaller. Else declared, or 0.95.",
)
@click.option(
    "--prior",
    "priors",
    multiple=True,
    callback=numbers,
    metavar="NAME=LOGITS",
    help=(
        "The scale of a prior, repeated for several: worth, image, taste, person_side, side, "
        "slight, clear. Without it as declared in [analysis.posterior], or 1; worth and clear 2."
    ),
)
@click.option(
    "--seed",
    type=int,
    help="The same seed gives the same draws on one machine. Without it as declared, or 0.",
)
@click.option(
    "--level", type=float, help="Level of the intervals. Without it as declared, or 0.95."
)
def command(
    responses: Path,
    out: Path,
    study: Path | None,
    varied: tuple[str, ...] | None,
    priors: dict[str, float],
    seed: int | None,
    level: float | None,
    **sampling: float | None,
) -> None:
    """Draw the posterior of a multilevel model of RESPONSES, a responses.csv.

    People and images are both samples, so that it also says what would hold for another image of
    the same sort. Needs requirements-bayes.lock. Ctrl+C ends it at once; nothing is written
    before the last draw, and sampling that was interrupted begins anew.
    """
    from analysis import declared as declarations
    from analysis.options import Sampling
    from analysis.posterior import posterior_files, sample
    from analysis.report import write_files

    if unknown := [name for name in priors if name not in Sampling().priors]:
        raise click.UsageError(
            f"--prior names {', '.join(unknown)}; expected one of {', '.join(Sampling().priors)}"
        )
    answers, manifest, study = read_answers(responses, study, varied=varied)
    declared = manifest.declared if manifest else {}
    options = declarations.options(declared, f"{study}: study.analysis", level=level, seed=seed)
    given = {name: value for name, value in sampling.items() if value is not None}
    given |= {f"prior_{name}": value for name, value in priors.items()}
    options = replace(options, posterior=replace(options.posterior, **given))
    # all draws are one compiled call, in which Python sees no interrupt: the system's end holds
    handler = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        draws = sample(answers, options, progress=sys.stderr.isatty())
    finally:
        signal.signal(signal.SIGINT, handler)
    files, sentences = posterior_files(
        draws, answers, written(), declarations.fingerprint(declared)
    )
    write_files(files, out)
    tell(responses, answers)
    for sentence in sentences:
        click.echo(sentence)
    click.echo(f"{out / 'posterior.md'}")
