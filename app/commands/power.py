"""`subdermal power`: how many people a study needs, before anybody is asked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from app import workers as working
from app.answers import names, numbers, written


@click.command()
@click.argument("study", metavar="STUDY.toml", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="Folder for power.csv, needed.csv, power.md and the figure.",
)
@click.option(
    "--difference",
    type=float,
    metavar="JOD",
    help=(
        "To find, or to exclude: at 1 JOD 75 % of answers prefer one of the two. Without it "
        "the study's margin_jod, or 0.5."
    ),
)
@click.option(
    "--visibility",
    "predicted",
    type=click.Path(path_type=Path),
    metavar="STUDY",
    help=(
        "The built study whose predicted visibility (`subdermal experiment visibility`) is the "
        "difference, framing by framing: as if all that can be seen were preferred."
    ),
)
@click.option(
    "--pair",
    callback=names,
    metavar="A,B",
    help=(
        "The two techniques. Without it golubev,golubev_plus where the study has both, else "
        "its first two."
    ),
)
@click.option(
    "--worth",
    "assumed",
    multiple=True,
    callback=numbers,
    metavar="TECHNIQUE=JOD",
    help=(
        "An assumed worth, repeated for each technique; what is not named is 0. The pair is "
        "set its difference apart about its middle."
    ),
)
@click.option(
    "--pilot",
    type=click.Path(path_type=Path),
    metavar="RESPONSES.csv",
    help="Take worths and thresholds from a pilot's answers instead, framing by framing.",
)
@click.option(
    "--design",
    "designs",
    multiple=True,
    type=click.Choice(["full", "incomplete", "adaptive"]),
    help=(
        "Repeated for several: every pair of everyone; some pairs by lot; those from which "
        "most is learnt. Without it all three."
    ),
)
@click.option(
    "--answers",
    default=0,
    type=int,
    metavar="N",
    help=(
        "Pairs that the incomplete and the adaptive design ask each person at a framing. "
        "Without it those of the study's [assignment], or half of them."
    ),
)
@click.option(
    "--slight",
    type=float,
    metavar="JOD",
    help="Below this a person sees no difference: 0.5 without it, or the pilot's.",
)
@click.option(
    "--clear",
    type=float,
    metavar="JOD",
    help="From here on a preference is a clear one: 1.8 without it, or the pilot's.",
)
@click.option(
    "--taste",
    type=float,
    metavar="JOD",
    help="Spread between people of what they feel of one difference: 0.5 without it.",
)
@click.option(
    "--alpha",
    type=float,
    help="Level of each test. Without it one less the study's level, or 0.05.",
)
@click.option(
    "--power", "wanted", default=0.8, show_default=True, type=float, help="The power to reach."
)
@click.option(
    "--margin",
    type=float,
    metavar="POINTS",
    help="To exclude: within so many points of 0, from -2 to 2. Without it as the study declares.",
)
@click.option(
    "--most", default=400, show_default=True, type=int, help="The most people to think of."
)
@click.option(
    "--studies",
    default=1000,
    show_default=True,
    type=int,
    help="Simulated studies for each design and framing.",
)
@click.option(
    "--seed",
    default=1,
    show_default=True,
    type=int,
    help="Draws the simulated people; the same seed gives the same files.",
)
@working.options
def command(
    study: Path,
    out: Path,
    difference: float | None,
    predicted: Path | None,
    pair: tuple[str, str] | None,
    assumed: dict[str, float],
    pilot: Path | None,
    designs: tuple[str, ...],
    answers: int,
    slight: float | None,
    clear: float | None,
    taste: float | None,
    alpha: float | None,
    wanted: float,
    margin: float | None,
    most: int,
    studies: int,
    seed: int,
    workers: int | None,
    cluster: str | None,
) -> None:
    """Say how many people the study in STUDY.toml needs to find, or to exclude, a difference.

    Participants are simulated from assumed worths or from a pilot, and their answers decided by the
    study's declared analysis, as `subdermal analyse` does. Nothing here is an answer of a person.
    """
    from stimuli.study import load_study

    definition = load_study(study)
    techniques = tuple(condition.name for condition in definition.techniques)
    if unknown := [name for name in assumed if name not in techniques]:
        raise click.UsageError(
            f"--worth names {', '.join(unknown)}; expected one of {', '.join(techniques)}"
        )
    if assumed and pilot:
        raise click.UsageError("expected either --worth or --pilot: the pilot gives the worths")

    from tqdm import tqdm

    from analysis import declared
    from analysis.codebook import Codebook
    from analysis.planning import DESIGNS, Answering, Plan, fit_pilot, plan_table, power_files
    from analysis.report import write_files
    from analysis.responses import read_responses

    cells = tuple(cell.name for cell in definition.cells)
    codebook = Codebook(
        cells,
        techniques,
        "the study's",
        "the study's",
        {("framing", cell.name): definition.cell_label(cell) for cell in definition.cells}
        | {("technique", condition.name): condition.label for condition in definition.techniques},
        title=definition.title,
    )
    answering, table = (
        Answering(),
        {"any": {name: assumed.get(name, 0.0) for name in techniques}} if assumed else {},
    )
    source = "assumed"
    if pilot is not None:
        responses = read_responses(pilot, codebook)
        for finding in responses.findings[:20]:
            click.echo(f"{pilot}: {finding}", err=True)
        table, answering = fit_pilot(responses)
        kind = "simulated participants" if responses.simulated else "participants"
        source = (
            f"fitted to the pilot {pilot.name}, {len(responses.frame)} answers of "
            f"{responses.participants} {kind}"
        )
    given = {"slight": slight, "clear": clear, "taste": taste}
    answering = replace(
        answering, **{name: value for name, value in given.items() if value is not None}
    )
    known = ("golubev", "golubev_plus")
    options = declared.options(
        definition.analysis,
        f"{study}: [analysis]",
        level=None if alpha is None else round(1 - alpha, 10),
        margin=margin,
    )
    known_pair = pair or (known if set(known) <= set(techniques) else techniques[:2])
    differences = {}
    if predicted is not None:
        if difference is not None:
            raise click.UsageError("expected either --difference or --visibility")
        differences = _predicted(predicted, known_pair, cells)
        source += f"; the pair's difference as predicted in {predicted.name}, all of it preference"
    plan = Plan(
        techniques=techniques,
        pair=known_pair,
        differences=differences,
        difference=definition.analysis.get("margin_jod", 0.5) if difference is None else difference,
        worths=table,
        answering=answering,
        framings=cells,
        answers_each=answers or definition.assignment.pairs // len(cells),
        least_share=definition.assignment.least_share,
        as_good=definition.assignment.as_good,
        options=options,
        power=wanted,
        most=most,
        studies=studies,
        seed=seed,
    )
    designs = designs or DESIGNS
    with working.crew(workers, cluster) as crew:
        curves, needed = plan_table(
            plan,
            designs,
            lambda steps: tqdm(steps, desc="simulated studies", unit="design", disable=None),
            crew.executor,
        )
    fingerprint = declared.fingerprint(definition.analysis)
    files, sentences = power_files(plan, curves, needed, codebook, source, written(), fingerprint)
    write_files(files, out)
    for sentence in sentences:
        click.echo(sentence)
    click.echo(
        f"the study asks each person {definition.pairs_each} of {definition.pairs} pairs: "
        f"{20 * definition.pairs_each / definition.pairs:.3g} answers a pair from 20 people"
    )
    if fingerprint:
        click.echo(f"sha256 of the study's [analysis]: {fingerprint}")
    click.echo(f"{out / 'power.md'}: {studies} simulated studies for each design, seed {seed}")


def _predicted(study: Path, pair: tuple[str, str], cells: tuple[str, ...]) -> dict[str, float]:
    """Cell -> JOD between the pair, as predicted; InputError where a cell has none."""
    from analysis.errors import InputError
    from analysis.manifest import open_manifest

    manifest = open_manifest(study)
    apart = {
        one["cell"]: round(max(10 - one["jod"], 0.0), 4)
        for one in manifest.visibility.get("pairs", [])
        if {one["a"], one["b"]} == set(pair)
    }
    lacking = [cell for cell in cells if cell not in apart]
    if lacking:
        raise InputError(
            f"{manifest.path}: visibility has no {' / '.join(pair)} at {', '.join(lacking)}; "
            f"expected what `subdermal experiment visibility {study}` writes"
        )
    return {cell: apart[cell] for cell in cells}
