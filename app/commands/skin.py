"""`subdermal skin`: what colour people's pigments give, and whether their medium agrees."""

import click


@click.command()
@click.argument("people", nargs=-1, required=True, metavar="PERSON...")
@click.option(
    "--photons",
    default=100_000,
    show_default=True,
    type=click.IntRange(1000),
    help="Photons a channel.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def command(people: tuple[str, ...], photons: int, as_json: bool) -> None:
    """Compare the albedo that PERSONs show with that of the medium below it, by Monte Carlo.

    PERSON is a name of stimuli/people or a TOML file. The albedo shown is the mean over the face,
    in linear sRGB.
    """
    import json

    from stimuli.skin import agreement

    rows = [agreement(person, photons) for person in people]
    if as_json:
        plain = lambda value: value.tolist() if hasattr(value, "tolist") else value
        click.echo(json.dumps([{k: plain(v) for k, v in vars(row).items()} for row in rows]))
        return
    click.echo(
        f"{'person':<12}{'melanin':>9}{'blood':>8}{'albedo shown':>22}{'of the medium':>22}"
        f"{'off by, %':>20}{'radius, mm':>18}"
    )
    for row in rows:
        three = lambda values, form: " ".join(f"{value:{form}}" for value in values)
        click.echo(
            f"{row.person:<12}{row.melanin:>9.4f}{row.blood:>8.4f}{three(row.shown, '.3f'):>22}"
            f"{three(row.walked, '.3f'):>22}{three(100 * row.off, '+.2f'):>20}"
            f"{three(row.radius_mm, '.2f'):>18}"
        )
