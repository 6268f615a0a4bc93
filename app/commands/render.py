"""subdermal render: one image of one technique."""

from pathlib import Path

import click

from app import drawing
from app import workers as working


def parameters_of(_context, _parameter, values: tuple[str, ...]) -> dict:
    import json

    chosen = {}
    for item in values:
        name, equals, text = item.partition("=")
        if not equals:
            raise click.BadParameter(f"got {item!r}; expected NAME=VALUE")
        try:
            chosen[name] = json.loads(text)
        except ValueError:
            chosen[name] = text
    return chosen


def _writable(path: Path, suffixes: tuple[str, ...]) -> None:
    from renderer.errors import InputError

    if path.suffix.lower() not in suffixes:
        raise InputError(f"{path}: expected a file name that ends in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")


@click.command("render")
@click.option(
    "--technique",
    "-t",
    required=True,
    help="The technique, by its name in studies (none, golubev, ...).",
)
@click.option(
    "--framing",
    "-f",
    help="close-up, head-shot or half-length; the scene's own camera without it.",
)
@drawing.size("1920x1080", "the image")
@click.option(
    "--out",
    "-o",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="The PNG file to write.",
)
@click.option(
    "--parameter",
    "-p",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    callback=parameters_of,
    help="A parameter of the technique, value in JSON; repeat for more.",
)
@click.option(
    "--scene",
    default="thesis",
    show_default=True,
    help="The scene: a name of stimuli/scenes, or a TOML file.",
)
@drawing.patches(
    "A value over the scene's, by its dotted key, in JSON or as text: rig=noon, "
    "camera.yaw_deg=0, lights.rim=false; repeat for more."
)
@drawing.head(
    "default",
    "The scene's own head, a person by name, .toml file or seed, or a scan: .glb, .gltf, .obj, "
    ".ply, .stl.",
)
@drawing.supersample(2, "Samples a pixel")
@drawing.seed("hair, skin noise and baked light")
@click.option(
    "--samples",
    type=click.Path(dir_okay=False, path_type=Path),
    help=(
        "Also write the samples of each pixel, .npy, uint16 at the resolution at which "
        "scattering is computed; 0 where nothing scatters."
    ),
)
@click.option(
    "--contrast",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Also write the local contrast as a grey PNG (golubev_plus).",
)
@working.options
def command(
    technique,
    framing,
    size,
    out,
    parameters,
    scene,
    patches,
    head,
    said,
    supersample,
    seed,
    samples,
    contrast,
    workers,
    cluster,
):
    """Render one technique in one scene.

    Prints where the image went and the mean number of samples over the pixels that scatter.
    """
    import numpy as np
    from PIL import Image

    import renderer
    from renderer.errors import InputError
    from stimuli.scenes import framings, load_table, merge, read_scene, stage
    from stimuli.study import with_head

    chosen = renderer.make(technique, parameters)
    if (workers or cluster) and technique != "reference":
        raise click.UsageError(f"{technique} is drawn by this process; expected no workers")
    table = merge(with_head(load_table(scene), head, said), patches)
    if framing:
        if framing not in (known := framings(table)):
            raise InputError(f"no framing {framing!r}; expected one of {', '.join(known)}")
        table = merge(table, {"camera": {"framing": framing}})
    definition = read_scene(table)
    _writable(out, (".png",))
    if samples:
        _writable(samples, (".npy",))
    if contrast:
        _writable(contrast, (".png",))
        if not chosen.measures_contrast:
            raise InputError(
                f"{technique} measures no contrast; expected golubev_plus with --contrast"
            )
    staged = stage(definition, seed)
    for note in staged.notes:
        click.echo(note, err=True)
    with (
        working.crew(workers, cluster) as crew,
        renderer.Renderer(
            staged.graph,
            size=size,
            supersample=supersample,
            seed=seed,
            executor=crew.executor,
            keep=("shadows", "views"),
        ) as drawing,
        drawing.frame() as frame,
    ):
        result = frame.render(chosen)
    Image.fromarray(result.image).save(out, compress_level=renderer.PNG_LEVEL)
    if samples:
        np.save(samples, result.samples)
    if contrast:
        grey = np.rint(np.clip(result.contrast, 0, 1) * 255).astype(np.uint8)
        Image.fromarray(grey).save(contrast)
    taken = result.samples[result.samples > 0]
    mean = "no scattering pixel is seen"
    if taken.size:
        mean = f"{taken.mean():.2f} samples a pixel over {taken.size} scattering pixels"
    click.echo(
        f"{out}: {technique}, {definition.camera.framing}, {size[0]}x{size[1]}; {mean} at "
        f"{supersample}x{supersample} supersampling"
    )
