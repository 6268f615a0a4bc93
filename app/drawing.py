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


def _whole_path(_context, _parameter, value: str | None) -> str | None:
    """A file named on the command line, whole: the scene may lie in another folder."""
    from pathlib import Path

    return None if value is None else str(Path(value).absolute())


_AXES = click.Choice(["x", "-x", "y", "-y", "z", "-z"])
#: What may be said of a scan: field -> (option, type, help); see stimuli.study.with_head.
_SAID = {
    "unit": ("--unit", click.Choice(["mm", "cm", "m", "in"]), "Unit of its coordinates."),
    "up": ("--up", _AXES, "Its upward axis."),
    "forward": ("--forward", _AXES, "The axis along which its face looks."),
    "yaw_deg": ("--yaw", click.FloatRange(-360, 360), "Degrees to turn it to its left."),
    "head_mm": ("--head-height", click.FloatRange(60, 900), "Millimetres, crown to chin."),
    "mm_per_unit": ("--scale", click.FloatRange(1e-6, 1e6), "Millimetres a unit of the file."),
    "landmarks": ("--landmarks", None, "TOML file of points: eye_l, eye_r, nose, mouth, chin."),
    "albedo": ("--albedo", None, "Image of its skin's albedo (sRGB), over its own."),
    "normal": ("--normal", None, "Normal map, tangent space, green up, over its own."),
    "skin": ("--skin", None, "Person whose skin it gets: pores, oil, redness, melanin."),
    "hair": ("--hair", None, "Person whose hair, brows, lashes and beard it gets."),
    "licence": ("--licence", None, "Its licence, for manifest and study."),
    "credit": ("--credit", None, "Who made it, for manifest and study."),
}
_FILES = ("landmarks", "albedo", "normal")


def said_of_scan(command: Callable) -> Callable:
    """The options that say how a scan stands and looks; the command gets them as `said`."""
    from functools import wraps

    @wraps(command)
    def gathered(**values):
        said = {name: values.pop(f"head_{name}") for name in _SAID}
        return command(**values, said=said)

    for name, (flag, kind, words) in reversed(_SAID.items()):
        gathered = click.option(
            flag,
            f"head_{name}",
            type=kind,
            callback=_whole_path if name in _FILES else None,
            help=f"Of a scan. {words}",
        )(gathered)
    return gathered


def head(default: str | None, what: str) -> Callable:
    """--head (or --identity) and what may be said of a scan: the command gets `head` and `said`."""

    def decorate(command: Callable) -> Callable:
        option = click.option(
            "--head", "--identity", "head", default=default, show_default=bool(default), help=what
        )
        return option(said_of_scan(command))

    return decorate
