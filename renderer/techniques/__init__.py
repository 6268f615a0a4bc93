"""All techniques, in one literal table.

Technique number eleven: its two files, this table, its test.
"""

from __future__ import annotations

from renderer.errors import InputError
from renderer.techniques.base import Technique
from renderer.techniques.borshukov_lewis import BorshukovLewis
from renderer.techniques.deon_luebke import DeonLuebke
from renderer.techniques.golubev import Golubev
from renderer.techniques.golubev_plus import GolubevPlus
from renderer.techniques.gosselin import Gosselin
from renderer.techniques.jimenez_gaussian import JimenezGaussian
from renderer.techniques.jimenez_separable import JimenezSeparable
from renderer.techniques.none import NoScattering
from renderer.techniques.reference import Reference
from renderer.techniques.splat_dipole import SplatDipole

TECHNIQUES: dict[str, type[Technique]] = {
    "none": NoScattering,
    "jimenez_gaussian": JimenezGaussian,
    "jimenez_separable": JimenezSeparable,
    "golubev": Golubev,
    "golubev_plus": GolubevPlus,
    "borshukov_lewis": BorshukovLewis,
    "gosselin": Gosselin,
    "deon_luebke": DeonLuebke,
    "splat_dipole": SplatDipole,
    "reference": Reference,
}


def make(name: str, parameters: dict | None = None) -> Technique:
    """The technique `name` with `parameters`; an unknown name or parameter raises InputError."""
    if name not in TECHNIQUES:
        raise InputError(f"no technique {name!r}; expected one of {', '.join(TECHNIQUES)}")
    kind = TECHNIQUES[name]
    known = kind.names()
    for key in parameters or {}:
        if key not in known:
            raise InputError(
                f"{name} has no parameter {key!r}; expected one of "
                f"{', '.join(known) or 'none at all'}"
            )
    return kind(**(parameters or {}))
