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
@click.option(
    "--markdown", "as_markdown", is_flag=True, help="Parameters as docs/parameters.md has them."
)
def command(names: tuple[str, ...], medium: str, as_json: bool, as_markdown: bool) -> None:
    """List the techniques, or each NAME alone: paper, parameters with units, ranges, defaults and
    sources, fit error.

    The fit error is the rms difference, R, G, B, at a straight edge of light between a technique's
    kernel and the medium's reference curve; of the reference, that of the medium that is walked in.
    """
    import json

    import renderer
    from renderer.optics import media

    made = {name: renderer.make(name) for name in names or renderer.TECHNIQUES}
    if as_markdown:
        click.echo(_page(made), nl=False)
        return
    curve = media.curve(medium)
    descriptions = {name: _described(one, curve, medium) for name, one in made.items()}
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
    return {
        "title": technique.title,
        "paper": technique.paper,
        "domain": technique.domain,
        "fit_error": [round(float(v), 5) for v in technique.fit_error(curve)],
        "medium": medium,
        "parameters": _parameters(technique),
    }


def _parameters(technique) -> dict:
    """By name: default, unit, range, choices, source."""
    import dataclasses

    from renderer.parameters import plain

    return {
        field.name: {
            "default": plain(field.default),
            "unit": field.metadata["unit"],
            "low": field.metadata["low"],
            "high": field.metadata["high"],
            "choices": list(field.metadata["choices"]),
            "allowed": _allowed(field.metadata),
            "source": field.metadata["source"],
        }
        for field in dataclasses.fields(technique)
    }


PAGE = """# Parameters of the techniques

Made by `subdermal techniques --markdown > docs/parameters.md`; what they do is told in
[techniques.md](techniques.md). A technique's own table leaves out what it takes from the first one
as it stands there. `null` is a value that is worked out, as the source says.
"""


def _page(techniques: dict) -> str:
    """docs/parameters.md: a table of what all have, and one of what each has of its own."""
    from renderer.techniques.base import Technique

    common = _parameters(Technique)
    lines = [PAGE, "## Every technique\n", *_rows(common)]
    for name, technique in techniques.items():
        own = {k: v for k, v in _parameters(technique).items() if v != common.get(k)}
        lines += [f"\n## `{name}`\n", f"{technique.title}; {technique.paper}.\n"]
        lines += _rows(own) if own else ["No others."]
    return "\n".join(lines) + "\n"


def _rows(parameters: dict) -> list[str]:
    """The lines of a table."""
    import json

    rows = [("name", "default", "unit", "range", "source"), ("---",) * 5]
    for name, p in parameters.items():
        default = json.dumps(p["default"]).strip('"')
        rows.append((f"`{name}`", f"`{default}`", p["unit"], p["allowed"], p["source"]))
    return ["| " + " | ".join(c.replace("|", "\\|") for c in row) + " |" for row in rows]


def _allowed(meta) -> str:
    """What values a parameter can have, in words."""
    if meta["choices"]:
        return "one of " + ", ".join(map(str, meta["choices"]))
    if isinstance(meta["kind"], bool):
        return "true or false"
    if meta["low"] is None and meta["high"] is None:
        return "any"
    words = f"{_number(meta['low'])} to {_number(meta['high'])}"
    return f"{len(meta['kind'])} numbers, {words}" if isinstance(meta["kind"], tuple) else words


def _number(value) -> str:
    """Whole numbers whole."""
    return str(value) if isinstance(value, int) else f"{value:g}"
