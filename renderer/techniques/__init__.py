"""All techniques, in one literal table.

Technique number eleven: its two files, this table, its test.
"""

from __future__ import annotations

from renderer.errors import InputError
from renderer.techniques.base import Technique
from renderer.techniques.borshukov_lewis import BorshukovLewis
from renderer.techniques.deon_luebke import DeonLuebke
from renderer.techniques.golubev import Golubev
from renderer.techniques.golubev_adaptive import GolubevAdaptive
from renderer.techniques.golubev_plus import GolubevPlus
from renderer.techniques.gosselin import Gosselin
from renderer.techniques.jimenez_gaussian import JimenezGaussian
from renderer.techniques.jimenez_separable import JimenezSeparable
from renderer.techniques.none import NoScattering
from renderer.techniques.reference import Reference
from renderer.techniques.splat_dipole import SplatDipole
from renderer.techniques.splat_multipole import SplatMultipole
from renderer.techniques.subdermal import Subdermal

TECHNIQUES: dict[str, type[Technique]] = {
    "none": NoScattering,
    "jimenez_gaussian": JimenezGaussian,
    "jimenez_separable": JimenezSeparable,
    "golubev": Golubev,
    "golubev_plus": GolubevPlus,
    "golubev_adaptive": GolubevAdaptive,
    "borshukov_lewis": BorshukovLewis,
    "gosselin": Gosselin,
    "deon_luebke": DeonLuebke,
    "splat_dipole": SplatDipole,
    "splat_multipole": SplatMultipole,
    "subdermal": Subdermal,
    "reference": Reference,
}


def make(name: str, parameters: dict | None = None) -> Technique:
    """The technique `name` with `parameters`; an unknown name or parameter raises InputError."""
    if name not in TECHNIQUES:
        raise InputError(f"no technique {name!r}; expected one of {', '.join(TECHNIQUES)}")
    kind = TECHNIQUES[name]
    parameters = _of_first_edition(kind, parameters or {})
    known = kind.names()
    for key in parameters:
        if key not in known:
            raise InputError(
                f"{name} has no parameter {key!r}; expected one of "
                f"{', '.join(known) or 'none at all'}"
            )
    return kind(**parameters)


def _of_first_edition(kind: type[Technique], parameters: dict) -> dict:
    """`translucent = true | false`, as studies of the first edition have it, as translucency."""
    if "translucent" not in parameters:
        return parameters
    on, others = parameters["translucent"], {**parameters}
    del others["translucent"]
    if not isinstance(on, bool) or "translucency" in parameters:
        raise InputError(
            f"{kind.name}.translucent is {on!r:.60}; expected true or false, and no translucency "
            "beside it"
        )
    usual = kind().translucency
    return {**others, "translucency": (usual if usual != "none" else "slab") if on else "none"}
