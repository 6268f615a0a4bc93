"""`subdermal head`: a picture of how a scan is understood, before anything is rendered of it."""

from pathlib import Path

import click

from app import drawing


@click.command()
@click.argument("file", type=click.Path(dir_okay=False))
@drawing.said_of_scan
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Picture to write: .png, .pdf or .svg.",
)
def command(file: str, said: dict, out: Path) -> None:
    """Draw a scan from front and side with scale bar and landmarks, and say how it was understood.

    What is wrong in the picture is put right by the options; the same ones are taken by `render`
    and `build`, and by a study's [head].
    """
    from renderer.scene.objects import Scan
    from stimuli.errors import InputError
    from stimuli.heads import load_scan, sheet
    from stimuli.study import with_head

    if out.suffix not in (".png", ".pdf", ".svg"):
        raise InputError(f"{out}: has the suffix {out.suffix!r}; expected .png, .pdf or .svg")
    table = with_head({"objects": {"head": {}}}, file, said)["objects"]["head"]
    if table.pop("shape") != "scan":
        raise InputError(f"{file}: is no file of a scan; expected .glb, .gltf, .obj, .ply or .stl")
    head = load_scan(Scan.read(table, "head"))
    known = head.provenance
    lines = [
        f"{len(head.model.surface.positions)} points; {known['mm_per_unit']:.6g} mm a unit "
        f"({known['unit']}, {known['unit_source']}); {known['up']} up ({known['up_source']}); "
        f"turned by {known['turned_deg']:g} degrees ({known['turned_source']})"
    ]
    if "face" in known:
        face = known["face"]
        lines.append(
            f"face: {face['crown_to_chin_mm']:g} mm from crown to chin; the average head fits it "
            f"to {face['error_mm']:g} mm, with {face['relief']:.0%} of its relief"
        )
    lines += [note for note in head.notes if note not in lines]
    sheet.draw(head.model, head.name, lines, out)
    for line in lines:
        click.echo(line)
    click.echo(f"{out}: written")
