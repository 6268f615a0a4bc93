"""`subdermal analyse`: from a table of answers to tables, figures and a report."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import click

from app import workers as working
from app.answers import names, read_answers, study_option, tell, varied_option, written

# matrices are small: a second thread of OpenBLAS adds a fifth of the CPU; read when numpy is loaded
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@click.command()
@click.argument("responses", required=False, type=click.Path(path_type=Path))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for tables/, figures/ and report.html; made when it is not there.",
)
@click.option(
    "--order",
    callback=names,
    metavar="A,B,C",
    help=(
        "Every technique once: the order in which medians are taken. Without it the "
        "study's, or that of first appearance."
    ),
)
@click.option(
    "--pair",
    callback=names,
    metavar="A,B",
    help=(
        "The two techniques of the box plot. Without it golubev,golubev_plus where both are "
        "there, else the first two."
    ),
)
@study_option
@click.option(
    "--matrices",
    type=click.Path(path_type=Path),
    metavar="FILE.toml",
    help=(
        "Instead of RESPONSES: `items = [names]` and for each framing `[matrix.NAME]` with "
        "`rows = [[1, 0.5, ...], ...]`."
    ),
)
@click.option(
    "--factor",
    metavar="COLUMN",
    help=(
        "Group the answers by this column of RESPONSES, such as lighting or familiarity. "
        "Without it by framing."
    ),
)
@varied_option
@click.option(
    "--reference",
    default="reference",
    show_default=True,
    help=(
        "The technique whose images are the reference: with a manifest, DSSIM to them is "
        "set beside worth."
    ),
)
@click.option(
    "--margin",
    type=float,
    help=(
        "As good as each other: within this many points of 0, on the scale from -2 to 2. "
        "Else as declared."
    ),
)
@click.option(
    "--margin-jod", type=float, help="The same in JOD. Without it as the study declares, or none."
)
@click.option(
    "--test",
    type=click.Choice(["wilcoxon", "sign"]),
    help="The declared test. Without it as the study declares, or wilcoxon.",
)
@click.option(
    "--family",
    type=click.Choice(["study", "framing"]),
    help="Pairs that Holm's correction guards together: of all framings, or of each.",
)
@click.option(
    "--resamples",
    type=int,
    help="How often participants are resampled. Without it as the study declares, or 1000.",
)
@click.option(
    "--seed",
    type=int,
    help="Draws the resamples; the same seed gives the same numbers. Without it as declared, or 0.",
)
@click.option(
    "--level",
    type=float,
    help="Level of the intervals, 0.95 without it; tests are at one less this level.",
)
@working.options
def command(
    responses: Path | None,
    out: Path,
    order: tuple[str, ...] | None,
    pair: tuple[str, str] | None,
    study: Path | None,
    matrices: Path | None,
    factor: str | None,
    varied: tuple[str, ...] | None,
    reference: str,
    workers: int | None,
    cluster: str | None,
    **choices: object,
) -> None:
    """Turn the answers in RESPONSES, a responses.csv, into tables, figures and a report to read.

    Rows that cannot be used are named with their line numbers, counted, and listed in the report.
    """
    from analysis import declared as declarations
    from analysis.ahp import read_matrices
    from analysis.codebook import FRAMING
    from analysis.objective import read_measures
    from analysis.report import report_matrices, report_responses, write_files
    from analysis.visibility import read_visibility

    if (responses is None) == (matrices is None):
        raise click.UsageError("expected either RESPONSES or --matrices FILE.toml")
    if matrices is not None:
        given = {f"--{name.replace('_', '-')}": value for name, value in choices.items()}
        given = {"--order": order, "--pair": pair, "--study": study, "--factor": factor, **given}
        given |= {"--varied": varied}
        unused = [option for option, value in given.items() if value is not None]
        if unused:
            raise click.UsageError(
                f"{', '.join(unused)} cannot go with --matrices, which has its own names and order"
            )
        judgements = read_matrices(matrices)
        files = report_matrices(judgements, matrices.name, written())
        write_files(files, out)
        click.echo(f"{out / 'report.html'}: priorities of {len(judgements)} matrices")
        return

    answers, manifest, study = read_answers(responses, study, order, factor, varied)
    declared = manifest.declared if manifest else {}
    chosen = declarations.options(declared, f"{study}: study.analysis", **choices)
    measures = read_measures(manifest, reference, factor or FRAMING) if manifest else None
    visible = read_visibility(manifest, factor or FRAMING) if manifest else None
    source = _source(declared, choices)
    with working.crew(workers, cluster) as crew:
        if crew.executor is not None:
            out.mkdir(parents=True, exist_ok=True)
        files = report_responses(
            *(answers, pair, written(), chosen, source, measures, visible),
            *(_progress, crew.executor, out),
        )
    write_files(files, out)

    tell(responses, answers)
    unused = len(answers.findings)
    kind = "simulated answers" if answers.simulated else "answers"
    click.echo(
        f"{out / 'report.html'}: {len(answers.frame)} {kind} of {answers.participants} participants"
        + (
            f"; {unused} of {answers.rows} rows not used, see {out / 'tables/rejected_rows.csv'}"
            if unused
            else ""
        )
    )


def _progress(steps: Iterable) -> Iterable:
    """A bar of the tables on the terminal, where they take more than two seconds."""
    from tqdm import tqdm

    return tqdm(steps, desc="tables", unit="table", delay=2, leave=False, disable=None)


def _source(declared: dict, choices: dict) -> str:
    """Where margins and rules come from, in words."""
    from analysis.declared import UNDECLARED, fingerprint

    given = [name.replace("_", " ") for name, value in choices.items() if value is not None]
    source = UNDECLARED
    if declared:
        source = f"declared in the study file, sha256 of its [analysis] {fingerprint(declared)}"
    return f"{source}; {', '.join(given)} as given on the command line" if given else source
