"""What the verbs on profiles share: a medium by name or by numbers, and files to write."""

from __future__ import annotations

from pathlib import Path

import click


class Numbers(click.ParamType):
    """R,G,B, or one number for all three."""

    name = "R,G,B"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            self.fail(f"got {value!r}; expected three numbers such as 0.03,0.17,0.48", param, ctx)
        if len(numbers) not in (1, 3):
            self.fail(f"got {len(numbers)} numbers; expected 3, or 1 for all channels", param, ctx)
        return numbers * (3 // len(numbers))


NUMBERS = Numbers()

OPTIONS = (
    click.option(
        "--medium",
        metavar="NAME",
        help="A preset: skin1, marble, skin_three_layers, ...; an unknown name lists them all.",
    ),
    click.option(
        "--sigma-a", type=NUMBERS, help="Absorption in 1/mm per channel, instead of --medium."
    ),
    click.option(
        "--sigma-s-prime",
        type=NUMBERS,
        help="Reduced scattering in 1/mm per channel, instead of --medium.",
    ),
    click.option(
        "--eta",
        type=float,
        help="Index of refraction of the medium given by numbers; 1.3 if not given.",
    ),
    click.option(
        "--g",
        type=float,
        help=(
            "Mean cosine of scattering of the medium given by numbers, for montecarlo; 0 if "
            "not given."
        ),
    ),
    click.option(
        "--thickness",
        type=float,
        metavar="MM",
        help="Thickness of the slab in mm; a half-space if not given.",
    ),
    click.option(
        "--n-below",
        type=float,
        default=1.0,
        show_default=True,
        help="Index of refraction under the slab.",
    ),
    click.option(
        "--roughness",
        type=float,
        default=0.0,
        show_default=True,
        help="Beckmann slope of the lit face, 0 to 1 (dipole, multipole, layered, gaussian_sum).",
    ),
    click.option(
        "--layer",
        "layers",
        multiple=True,
        metavar='"sigma_a=R,G,B sigma_s_prime=R,G,B eta=N d=MM"',
        help=(
            "A layer, from the lit face down; repeat for more, instead of --medium. g=G may "
            "be added; without d it is infinite."
        ),
    ),
)


def medium_options(command):
    """The options that say which medium."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def _layer(text: str):
    from renderer.errors import InputError
    from renderer.optics.medium import Layer, Medium

    given = {}
    for item in text.split():
        name, equals, value = item.partition("=")
        if not equals or name not in ("sigma_a", "sigma_s_prime", "eta", "g", "d"):
            raise InputError(
                f"--layer: got {item!r}; expected sigma_a=, sigma_s_prime=, eta=, g= or d="
            )
        try:
            given[name] = (
                NUMBERS.convert(value, None, None) if name.startswith("sigma") else float(value)
            )
        except ValueError:
            raise InputError(f"--layer: {name} is {value!r}; expected a number") from None
    missing = [name for name in ("sigma_a", "sigma_s_prime") if name not in given]
    if missing:
        raise InputError(f"--layer {text!r}: there is no {missing[0]}")
    medium = Medium(
        given["sigma_a"],
        given["sigma_s_prime"],
        given.get("eta", 1.3),
        given.get("g", 0.0),
        name="layer",
    )
    return Layer(medium, given.get("d", float("inf")))


def stack_of(medium, sigma_a, sigma_s_prime, eta, g, thickness, n_below, roughness, layers):
    """The renderer.optics.medium.Stack that the options describe."""
    from dataclasses import replace

    from renderer.errors import InputError
    from renderer.optics.medium import Layer, Medium, Stack, preset

    by_numbers = {"--sigma-a": sigma_a, "--sigma-s-prime": sigma_s_prime, "--eta": eta, "--g": g}
    numbers = [name for name, value in by_numbers.items() if value is not None]
    ways = [
        way
        for way, used in (
            ("--medium", medium is not None),
            (", ".join(numbers), numbers),
            ("--layer", layers),
        )
        if used
    ]
    if len(ways) != 1:
        raise InputError(
            f"got {' and '.join(ways) or 'no medium'}; expected --medium NAME, or --sigma-a "
            "and --sigma-s-prime, or --layer"
        )
    if layers:
        stack = Stack(tuple(_layer(text) for text in layers), name="layers")
    elif medium is not None:
        stack = preset(medium)
    else:
        for name in ("--sigma-a", "--sigma-s-prime"):
            if by_numbers[name] is None:
                raise InputError(f"there is no {name}; expected it with {numbers[0]}")
        stack = Stack.of(
            Medium(
                sigma_a,
                sigma_s_prime,
                1.3 if eta is None else eta,
                0.0 if g is None else g,
                name="medium",
            )
        )
    if thickness is not None:
        if len(stack.layers) > 1 or layers:
            raise InputError("--thickness is for one medium; expected d= in each --layer")
        stack = replace(stack, layers=(Layer(stack.layers[0].medium, thickness),))
    return replace(stack, n_below=n_below, roughness=roughness)


def writable(path: Path, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that could not be written before anything is computed."""
    from renderer.errors import InputError

    if path.suffix.lower() not in suffixes:
        raise InputError(f"{path}: expected a file name that ends in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
