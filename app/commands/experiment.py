"""subdermal experiment: the documents' claims as experiments that anyone can run again."""

from pathlib import Path

import click

from app import drawing
from app.commands.media import writable


def _numbers(kind):
    """A callback: numbers of a kind with commas between them, as a tuple."""

    def read(_context, _parameter, value: str):
        try:
            return tuple(kind(part) for part in value.split(","))
        except ValueError:
            raise click.BadParameter(
                f"got {value!r}; expected numbers with commas between them"
            ) from None

    return read


@click.group("experiment", no_args_is_help=False)
def command() -> None:
    """Put a claim on trial: samples, the thesis's chapter 4, motion, cost, visibility."""


@command.command("samples")
@click.argument("scene", default="thesis")
@click.option(
    "--techniques",
    "-t",
    multiple=True,
    default=["golubev", "golubev_plus", "golubev_adaptive", "subdermal"],
    show_default=True,
    metavar="NAME[:KEY=VALUE...]",
    help="A technique with its parameters, golubev:samples=12; the first is what the others are "
    "set against; repeat for more.",
)
@click.option(
    "--framing",
    "-f",
    "framings",
    multiple=True,
    default=["close-up", "head-shot", "half-length"],
    show_default=True,
    help="A framing of the scene, repeat for more.",
)
@click.option(
    "--converged",
    metavar="NAME[:KEY=VALUE...]",
    help="What pictures are compared to; golubev with 256 samples in 4 frames if not given.",
)
@drawing.size("1920x1080", "the image")
@drawing.supersample(2, "Computed pixels in a pixel")
@click.option(
    "--edges",
    "edges_mm",
    type=click.FloatRange(0.01, 1000),
    default=2.6,
    show_default=True,
    metavar="MM",
    help="How far from a cast shadow's edge still counts as beside it.",
)
@click.option(
    "--jumps",
    "jumps_mm",
    type=click.FloatRange(0.01, 1000),
    default=1.0,
    show_default=True,
    metavar="MM",
    help="How far from a jump of depth of 2 mm still counts as beside it.",
)
@click.option(
    "--rotations",
    type=click.IntRange(0, 1024),
    default=0,
    show_default=True,
    help="Also the bias of techniques with rotations, from the mean of so many frames; 0: not.",
)
@drawing.patches("A value over the scene's, by its dotted key: lights.rim=false; repeat for more.")
@drawing.seed("hair, skin noise and baked light")
@click.option(
    "--keep/--no-keep",
    default=True,
    show_default=True,
    help="Keep the converged pictures, which take minutes, in the cache.",
)
@click.option(
    "--table",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The CSV file for the table, which is printed in any case.",
)
@click.option(
    "--out",
    "-o",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the whole of the thesis's chapter 4: records, samples.csv and figures.",
)
@click.option(
    "--part",
    "-p",
    "parts",
    multiple=True,
    type=click.Choice(["ladder", "contrast", "sweep", "angles"]),
    help="Of chapter 4: ladder, few samples against 30 (figures 4.4, 4.5); contrast (4.6); sweep, "
    "threshold, base and extra samples; angles (4.7, table 4.1). Repeat for more; without it all.",
)
@click.option(
    "--thresholds",
    default="0.05,0.15,0.25,0.35,0.45",
    show_default=True,
    callback=_numbers(float),
    help="Of contrast, from which a pixel takes its extra samples.",
)
@click.option(
    "--bases",
    default="6,9,12",
    show_default=True,
    callback=_numbers(int),
    help="Samples that every pixel takes.",
)
@click.option(
    "--extras",
    default="5,10,20",
    show_default=True,
    callback=_numbers(int),
    help="Samples beside them.",
)
def samples(
    scene,
    techniques,
    framings,
    converged,
    patches,
    table,
    out,
    parts,
    thresholds,
    bases,
    extras,
    **options,
) -> None:
    """Say how many samples techniques take in SCENE and how far their pictures are from converged
    ones, over skin: a row as soon as it is measured.

    Under supersampling an output pixel has several computed pixels: 22 samples at 2x2 are 88.
    Differences are root mean squares of sRGB levels (of 255) before they are rounded; each is
    followed by its ratio to the first technique's.

    With --out it measures what chapter 4 of the thesis says instead: few samples against 30 and
    against the converged, over skin and over the whole image; the contrast that spends samples; a
    grid of its parameters beside the techniques of -t; three framings from three sides. Tables, and
    figures as the thesis has them and better ones, each with its CSV. A run that was ended goes on.
    """
    from analysis.objective import MAPS
    from stimuli.experiment.samples import CONVERGED, Options, chosen, write_table
    from stimuli.experiment.samples import samples as measured

    if table:
        writable(table, (".csv",))
    if converged == "all":
        raise click.BadParameter("got all; expected one technique", param_hint="--converged")
    if out:
        if table or options.pop("rotations"):
            raise click.UsageError("--table and --rotations are not of --out; expected one of them")
        grid = {"thresholds": thresholds, "bases": bases, "extras": extras}
        beside = _explicit("techniques") and {"beside": techniques}
        options |= {"converged": converged or CONVERGED} | grid | (beside or {})
        _chapter(scene, patches, framings, parts, options, out)
        return
    if parts:
        raise click.UsageError("--part is of --out DIR; expected both")
    (goal,) = chosen([converged or CONVERGED]).values()
    options = Options(**options)
    rows: list = []
    shown = ("rmse", "edges", "jumps", *MAPS)
    click.echo(f"against {converged or CONVERGED}; levels of 255, ratios to {techniques[0]}")
    click.echo(
        f"{'framing':<12} {'technique':<32} {'samples':>8} {'output px':>9} {'saved':>6}"
        + "".join(f"{name:>16}" for name in shown)
        + (f"{'bias':>8}" if options.rotations else "")
    )
    for row in measured(scene, patches, framings, chosen(techniques), goal, options, MAPS):
        rows.append(row)
        first = next(one for one in rows if one.framing == row.framing)
        own, other = row.cells(), first.cells()
        saved = 1 - row.samples / first.samples if first.samples else 0.0
        parts = "".join(f"{own[k]:>9.3g} ({_ratio(own[k], other[k])})" for k in shown)
        bias = f"{row.bias:>8.3f}" if options.rotations else ""
        click.echo(
            f"{row.framing:<12} {row.technique:<32} {row.samples:>8.2f} {row.output_samples:>9.1f} "
            f"{100 * saved:>5.1f}%{parts}{bias}"
        )
        if table:  # after each row: an interrupted run keeps what it has measured
            write_table(rows, options, table)
    if table:
        click.echo(f"{table}: {len(rows)} rows")


def _ratio(value: float, other: float) -> str:
    return f"{value / other:.2f}" if other else " -  "


def _explicit(name: str) -> bool:
    """Whether an option was given, and is not its default."""
    source = click.get_current_context().get_parameter_source(name)
    return source is not click.core.ParameterSource.DEFAULT


def _chapter(scene, patches, framings, parts, options: dict, out: Path) -> None:
    """The thesis's chapter 4 into a folder."""
    from tqdm import tqdm

    from analysis.objective import MAPS
    from stimuli.experiment import chapter as chapters
    from stimuli.experiment import figures

    options = chapters.Options(**options)
    chapters.checked(options)
    listed = chapters.tasks(framings, parts or chapters.PARTS, options)
    found: dict[chapters.Task, list[dict]] = {}
    made = chapters.run(scene, patches, listed, options, MAPS, out)
    with tqdm(total=len(listed), unit="picture", disable=None) as bar:
        for done, task, own in made:
            found[task] = own
            bar.set_description(f"{task.part} {task.framing} {task.technique}")
            bar.update(done - bar.n)
    rows = [row for task in listed for row in found[task]]  # whatever was kept of an ended run
    chapters.write_csv(rows, out / "samples.csv")
    files = list(figures.draw(out, listed, rows, options))
    s = options.supersample
    click.echo(
        f"samples are those of a computed pixel; an output pixel has {s * s}: 22 are {22 * s * s}"
    )
    for line in chapters.lines_41(rows):
        click.echo(line)
    click.echo(f"{out / 'samples.csv'}: {len(rows)} rows of {len(listed)} pictures")
    click.echo(f"{out / 'figures'}: {len(files)} files")


@command.command("visibility")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--screen", metavar=drawing.SIZE, help="Pixels of the screen.")
@click.option(
    "--diagonal",
    "diagonal_in",
    type=click.FloatRange(1, 200),
    metavar="INCHES",
    help="Of the screen; without it and the like, the study's [viewer.screen].",
)
@click.option(
    "--distance",
    "distance_mm",
    type=click.FloatRange(50, 20000),
    metavar="MM",
    help="Of the eyes from it.",
)
@click.option(
    "--luminance", type=click.FloatRange(1, 10000), metavar="CD/M2", help="Of the screen's white."
)
@click.option(
    "--ambient",
    "ambient_lux",
    type=click.FloatRange(0, 1e5),
    metavar="LUX",
    help="Light that falls on the screen.",
)
@click.option(
    "--zoom",
    type=click.IntRange(0, 16),
    default=0,
    show_default=True,
    help="Screen pixels an image pixel; 0: as the page begins.",
)
@click.option(
    "--crop",
    metavar="WxH+X+Y",
    help="This part of the images instead of the study's region of interest.",
)
@click.option(
    "--write/--no-write",
    default=True,
    show_default=True,
    help="Write it into the study's manifest; what is not as the page begins never is.",
)
@click.option(
    "--out",
    "-o",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for visibility.csv, .svg and .png; the study's own if not given.",
)
def visibility(study, screen, zoom, crop, write, out, **given) -> None:
    """Predict which pairs of the built STUDY people can tell apart, as the page shows them.

    ColorVideoVDP's JOD (10: they look the same; 1 less: three of four can tell) and FLIP, for the
    screen of the study's [viewer.screen] or of the options. The extra `visibility` is needed.
    """
    import json

    from tqdm import tqdm

    from analysis.objective import flip
    from app.renditions import resampled
    from stimuli.experiment import visibility as seen
    from stimuli.manifest import load_manifest

    folder = study.parent if study.suffix == ".json" else study
    manifest = load_manifest(folder)
    if screen:
        given |= dict(zip(("width", "height"), drawing.size_of(None, None, screen), strict=True))
    box = seen.parse_crop(crop) if crop else None
    asked = seen.Asked(seen.screen_of(manifest, **given), zoom, box)
    metric = seen.ColorVideoVDP(asked.screen)
    count = len(manifest.study.techniques)
    total = len(manifest.study.cells) * count * (count - 1) // 2
    predicted = seen.predict(
        manifest,
        asked,
        metric,
        lambda one, other, display: flip(one, other, display.pixels_per_degree),
        resampled,
    )
    pairs = list(tqdm(predicted, total=total, unit="pair", disable=None))
    click.echo(
        f"{metric.name} {metric.version}, {asked.screen.width}x{asked.screen.height}, "
        f"{asked.screen.diagonal_in:g} inches at {asked.screen.distance_mm:g} mm: "
        f"{asked.screen.pixels_per_degree:.1f} pixels a degree"
    )
    click.echo(f"{'':<28}{'pair':<36}{'shown':>10}{'JOD':>8}{'apart':>8}{'FLIP x 100':>12}")
    for pair in sorted(pairs, key=lambda one: (one.cell, one.apart)):
        click.echo(
            f"{pair.cell:<28}{pair.a + ' / ' + pair.b:<36}{f'{pair.width}x{pair.height}':>10}"
            f"{pair.jod:>8.3f}{pair.apart:>8.3f}{100 * pair.flip:>12.3f}"
        )
    for line in seen.warnings(pairs):
        click.echo(line, err=True)
    labels = {one.name: one.label for one in manifest.study.techniques}
    labels |= {cell.name: manifest.study.cell_label(cell) for cell in manifest.study.cells}
    folder_out = out or folder
    folder_out.mkdir(parents=True, exist_ok=True)
    for file in seen.draw(pairs, labels, folder_out / "visibility"):
        click.echo(f"{file}")
    if write and not zoom and box is None:
        seen.write(folder, json.loads(json.dumps(seen.record(pairs, metric, asked))))
        click.echo(f"{folder / 'manifest.json'}: {len(pairs)} pairs under visibility")


@command.command("cost")
@click.argument("scene", default="thesis")
@click.option(
    "--out",
    "-o",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for passes.csv, growth.* and quality.*.",
)
@click.option(
    "--techniques",
    "-t",
    multiple=True,
    default=["golubev", "golubev_plus", "subdermal", "jimenez_separable", "jimenez_gaussian"],
    show_default=True,
    metavar="NAME[:KEY=VALUE...]",
    help="A technique with its parameters; repeat for more.",
)
@click.option("--framing", "-f", default="close-up", show_default=True, help="Of the scene.")
@click.option(
    "--axis",
    "axes",
    multiple=True,
    type=click.Choice(["resolution", "covered", "samples", "triangles", "lights", "splats"]),
    help="What cost may grow with; repeat for more; without it all.",
)
@drawing.size("960x540", "the largest images")
@drawing.supersample(1, "Computed pixels in a pixel")
@click.option(
    "--rounds",
    type=click.IntRange(1, 100),
    default=3,
    show_default=True,
    help="Of each measurement, in turn; medians.",
)
@click.option(
    "--walks",
    type=click.IntRange(0, 4096),
    default=0,
    show_default=True,
    help="Of the reference, for quality per cost; 0: without it.",
)
@drawing.patches("A value over the scene's, by its dotted key: lights.rim=false; repeat for more.")
@drawing.seed("hair, skin noise and baked light")
def cost(scene, out, techniques, framing, axes, walks, patches, **options) -> None:
    """Measure what techniques cost in SCENE, pass by pass, how it grows, and quality per cost.

    Timer queries on a graphics card; CPU time on software OpenGL, which is a processor's work.
    Growth is a power law with the interval of its exponent.
    """
    from tqdm import tqdm

    from stimuli.experiment import cost as costs
    from stimuli.experiment.chapter import write_csv

    out.mkdir(parents=True, exist_ok=True)
    made, options = costs.chosen(techniques), costs.Options(**options)
    table = costs.passes(scene, patches, framing, made, options)
    write_csv(table, out / "passes.csv")
    click.echo(f"{'technique':<34}{'pass':<44}{'wall ms':>9}{'CPU ms':>9}{'card ms':>9}")
    for row in table:
        spent = "".join(f"{1000 * row[name]:>9.1f}" for name in ("wall_s", "cpu_s", "card_s"))
        click.echo(f"{row['technique']:<34}{row['pass']:<44}{spent}")
    rows = []
    growth = costs.grow(scene, patches, framing, made, axes or costs.AXES, options)
    for row in tqdm(growth, unit="time", disable=None):
        rows.append(row)
        write_csv(rows, out / "growth.csv")  # a run that is ended keeps what it has measured
    for (axis, name), law in costs.laws(rows, costs.timed_by(rows)).items():
        click.echo(
            f"{axis:<12}{name:<34} x^{law.b:.2f} ({law.low:.2f} to {law.high:.2f}, "
            f"{law.points} points)"
        )
    files = costs.draw_growth(rows, out / "growth")
    if walks:
        best = costs.quality(scene, patches, framing, made, walks, options, table)
        files += costs.draw_quality(best, costs.timed_by(best), out / "quality")
    for file in files:
        click.echo(f"{file}")


@command.command("motion")
@click.argument("scene", default="thesis")
@click.option(
    "--out",
    "-o",
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for motion.csv, .svg and .png.",
)
@click.option(
    "--techniques",
    "-t",
    multiple=True,
    default=["golubev", "golubev_plus", "subdermal"],
    show_default=True,
    metavar="NAME[:KEY=VALUE...]",
    help="A technique with its parameters; repeat for more.",
)
@click.option("--framing", "-f", default="close-up", show_default=True, help="Of the scene.")
@click.option(
    "--converged",
    default="golubev:samples=256",
    show_default=True,
    metavar="NAME[:KEY=VALUE...]",
    help="What each frame is compared to.",
)
@drawing.size("640x360", "the frames")
@drawing.supersample(2, "Computed pixels in a pixel")
@click.option(
    "--frames",
    type=click.IntRange(2, 3600),
    default=60,
    show_default=True,
    help="Of the turntable.",
)
@click.option(
    "--degrees",
    type=click.FloatRange(-180, 180),
    default=1.0,
    show_default=True,
    help="Between two frames.",
)
@click.option("--first", type=float, default=0.0, show_default=True, help="Yaw of the first frame.")
@drawing.patches("A value over the scene's, by its dotted key: lights.rim=false; repeat for more.")
@drawing.seed("hair, skin noise and baked light")
def motion(scene, out, techniques, framing, converged, patches, **options) -> None:
    """Measure whether techniques flicker or pop while the camera goes round SCENE.

    The error to the converged picture of each frame, its change from frame to frame (flicker), and
    that of its means over 4x4 pixels, where noise cancels and a tile that takes other taps shows.
    """
    from tqdm import tqdm

    from stimuli.experiment import motion as motions
    from stimuli.experiment.chapter import write_csv

    if converged == "all":
        raise click.BadParameter("got all; expected one technique", param_hint="--converged")
    (goal,) = motions.chosen([converged]).values()
    made, options = motions.chosen(techniques), motions.Options(**options)
    out.mkdir(parents=True, exist_ok=True)
    rows: list[dict] = []
    turned = motions.turn(scene, patches, framing, made, goal, options)
    for row in tqdm(turned, total=options.frames * len(made), unit="picture", disable=None):
        rows.append(row)
        write_csv(rows, out / "motion.csv")  # a run that is ended keeps what it has measured
    click.echo(f"{options.frames} frames, {options.degrees:g} degrees apart, to {converged}")
    click.echo(
        f"{'technique':<34}{'samples':>9}{'rmse':>8}{'flicker':>9}{'pop':>8}{'largest pop':>13}"
    )
    for row in motions.summary(rows):
        click.echo(
            f"{row['technique']:<34}{row['samples']:>9.2f}{row['rmse']:>8.3f}{row['flicker']:>9.3f}"
            f"{row['pop']:>8.3f}{row['largest']:>13.2f}"
        )
    for file in motions.draw(rows, out / "motion"):
        click.echo(f"{file}")
