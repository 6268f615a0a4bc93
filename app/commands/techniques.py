"""subdermal techniques: papers, parameters, and how well each fits a medium."""

import click


@click.command("techniques")
@click.argument("names", nargs=-1, metavar="[NAME...]")
@click.option(
    "--medium",
    default="deon_luebke",
    show_default=True,
    metavar="NAME",
    help="The medium that fit errors are for: a preset of `subdermal profile --help`.",
)
@click.option("--json", "as_json", is_flag=True, help="Everything, as JSON.")
def command(names: tuple[str, ...], medium: str, as_json: bool) -> None:
    """List the techniques, or each NAME alone: paper, parameters with units, ranges, defaults and
    sources, fit error.

    The fit error is the rms difference, R, G, B, at a straight edge of light between a technique's
    kernel and the medium's reference curve; of the reference, that of the medium that is walked in.
    """
    import json

    import renderer
    from renderer.optics import media

    for name in names:
        renderer.make(name)
    curve = media.curve(medium)
    descriptions = {
        name: _described(renderer.make(name), curve, medium)
        for name in names or renderer.TECHNIQUES
    }
    if as_json:
        click.echo(json.dumps(descriptions, indent=2))
        return
    for name, entry in descriptions.items():
        error = " / ".join(f"{v:.4f}" for v in entry["fit_error"])
        click.echo(f"{name}: {entry['title']}")
        click.echo(f"    {entry['paper']}")
        click.echo(f"    filters: {entry['domain']}; fit error on {medium}: {error}")
        for key, value in entry["parameters"].items():
            unit = f" {value['unit']}" if value["unit"] else ""
            click.echo(f"    {key} = {json.dumps(value['default'])}{unit}, {value['allowed']}")
            click.echo(f"        {value['source']}")


def _described(technique, curve, medium: str) -> dict:
    """A technique's face, plain enough for JSON."""
    import dataclasses

    from renderer.parameters import plain

    return {
        "title": technique.title,
        "paper": technique.paper,
        "domain": technique.domain,
        "fit_error": [round(float(v), 5) for v in technique.fit_error(curve)],
        "medium": medium,
        "parameters": {
            field.name: {
                "default": plain(getattr(technique, field.name)),
                "unit": field.metadata["unit"],
                "low": field.metadata["low"],
                "high": field.metadata["high"],
                "choices": list(field.metadata["choices"]),
                "allowed": _allowed(field.metadata),
                "source": field.metadata["source"],
            }
            for field in dataclasses.fields(technique)
        },
    }


def _allowed(meta) -> str:
    """What values a parameter can have, in words."""
    if meta["choices"]:
        return "one of " + ", ".join(map(str, meta["choices"]))
    if isinstance(meta["kind"], bool):
        return "true or false"
    if meta["low"] is None and meta["high"] is None:
        return "any"
    words = f"{meta['low']:g} to {meta['high']:g}"
    return f"{len(meta['kind'])} numbers, {words}" if isinstance(meta["kind"], tuple) else words
