"""`subdermal posterior`: worths by a Bayesian multilevel model, with all draws."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from app.answers import read_answers, study_option, tell, varied_option, written


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
@click.option("--chains", default=4, show_default=True, type=int, help="Chains, 2 or more.")
@click.option("--draws", default=1000, show_default=True, type=int, help="Draws of each chain.")
@click.option(
    "--warmup", default=1000, show_default=True, type=int, help="Steps before the first draw."
)
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=int,
    help="The same seed gives the same draws on one machine.",
)
@click.option(
    "--level", default=0.95, show_default=True, type=float, help="Level of the intervals."
)
def command(
    responses: Path,
    out: Path,
    study: Path | None,
    varied: tuple[str, ...] | None,
    level: float,
    **sampling: int,
) -> None:
    """Draw the posterior of a multilevel model of RESPONSES, a responses.csv.

    People and images are both samples, so that it also says what would hold for another image of
    the same sort. Needs the extra `subdermal[bayes]`.
    """
    from analysis.options import Options
    from analysis.posterior import Sampling, posterior_files, sample
    from analysis.report import write_files

    level = Options(level=level).level  # checked
    drawing = Sampling(**sampling)
    answers, _, study = read_answers(responses, study, varied=varied)
    found = sample(answers, drawing, progress=sys.stderr.isatty())
    words = [(f"--{name}", str(value)) for name, value in {**sampling, "level": level}.items()]
    words += [("--varied", ",".join(varied))] if varied else []
    words += [("--study", study.name)] if study else []
    line = written("posterior", (responses.name,), *words)
    files, sentences = posterior_files(found, answers, level, line)
    write_files(files, out)
    tell(responses, answers)
    for sentence in sentences:
        click.echo(sentence)
    click.echo(f"{out / 'posterior.md'}")
