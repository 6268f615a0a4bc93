"""What the verbs that draw a scene share: their options of size, sampling, seed and patches."""

from collections.abc import Callable

import click

SIZE = "WIDTHxHEIGHT"


def size_of(_context, _parameter, value: str) -> tuple[int, int]:
    width, cross, height = value.lower().partition("x")
    if not (cross and width.isdigit() and height.isdigit()):
        raise click.BadParameter(f"got {value!r}; expected {SIZE}, such as 1920x1080")
    return int(width), int(height)


def patch_of(_context, _parameter, values: tuple[str, ...]) -> dict:
    """--set a.b=1 --set c=text as {"a": {"b": 1}, "c": "text"}."""
    import json

    patch: dict = {}
    for item in values:
        keys, equals, text = item.partition("=")
        if not equals or not all(keys.split(".")):
            raise click.BadParameter(f"got {item!r}; expected KEY=VALUE, such as rig=noon")
        try:
            value = json.loads(text)
        except ValueError:
            value = text
        *parents, last = keys.split(".")
        holder = patch
        for key in parents:
            holder = holder.setdefault(key, {})
            if not isinstance(holder, dict):
                raise click.BadParameter(f"got {item!r} after a value for {key}; expected one")
        holder[last] = value
    return patch


def size(default: str, what: str) -> Callable:
    """--size of `what`."""
    return click.option(
        "--size",
        "-s",
        default=default,
        show_default=True,
        metavar=SIZE,
        callback=size_of,
        help=f"Size of {what} in pixels.",
    )


def supersample(default: int, what: str) -> Callable:
    """--supersample: how many of `what` a pixel has."""
    return click.option(
        "--supersample",
        type=click.IntRange(1, 4),
        default=default,
        show_default=True,
        help=f"{what} along each side.",
    )


def patches(what: str) -> Callable:
    """--set, as often as wanted."""
    return click.option(
        "--set", "patches", multiple=True, metavar="KEY=VALUE", callback=patch_of, help=what
    )


def seed(what: str) -> Callable:
    """--seed of `what`."""
    return click.option(
        "--seed", type=click.IntRange(0), default=0, show_default=True, help=f"Seed of {what}."
    )
