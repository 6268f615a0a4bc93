"""`subdermal build`: from a study to its images and their manifest."""

from dataclasses import replace
from pathlib import Path

import click

from app import drawing
from app import workers as working


@click.command()
@click.argument("study", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--out",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the images and manifest.json; made when it is not there.",
)
@drawing.head(
    None,
    'Head to show instead of the scene\'s: "default" for its own, a person by name, or a scan: '
    ".glb, .gltf, .obj, .ply, .stl.",
)
@click.option(
    "--time",
    "rounds",
    type=click.IntRange(0, 100),
    default=0,
    show_default=True,
    help=(
        "Also time every technique so often and write the median milliseconds into the "
        "manifest; 0: do not."
    ),
)
@working.options
@click.option(
    "--force", is_flag=True, help="Render every image anew, also those that are up to date."
)
def command(
    study: Path,
    out: Path,
    head: str | None,
    said: dict,
    rounds: int,
    workers: int | None,
    cluster: str | None,
    force: bool,
) -> None:
    """Render the images of the study defined in STUDY, a TOML file, and write their manifest.

    Only what changed since the last build is rendered, and an interrupted build goes on where it
    stopped.
    """
    from stimuli.build import build
    from stimuli.study import DEFAULT_HEAD, load_study, with_head

    definition = load_study(study)
    if head or any(value is not None for value in said.values()):
        scene = with_head(definition.scene, head or DEFAULT_HEAD, said)
        definition = replace(definition, scene=scene)
    with working.crew(workers, cluster) as crew:
        built = build(definition, out, force, True, rounds, crew.executor, crew.workers)
    for note in built.notes:
        click.echo(note, err=True)
    click.echo(
        f"{out}: {built.rendered + built.kept} images, {built.rendered} rendered, "
        f"{built.kept} up to date"
    )
