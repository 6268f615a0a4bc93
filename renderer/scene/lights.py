"""Lights: lamps of three kinds, and an environment of soft panels or of a map.

Light is radiometric: a lamp gives irradiance E on a surface that faces it; the radiance of a
diffuse surface is albedo E / pi.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.parameters import Parameters, parameter, refuse_unknown

_COLOUR = {"unit": "relative irradiance", "low": 0.0, "high": 1e6, "source": "the scene's"}


@dataclass(frozen=True)
class Light(Parameters):
    """What every lamp has. `shadow`: it casts shadows and is seen through thin parts."""

    kind: ClassVar[str]
    called: ClassVar[str] = "light"

    irradiance: tuple[float, float, float] = parameter((1.0, 1.0, 1.0), **_COLOUR)
    shadow: bool = parameter(True, source="percentage-closer soft shadows, Fernando 2005")
    search_mm: float = parameter(
        28.0,
        unit="mm in front of a point that are searched for what shades it",
        low=0.1,
        high=1e4,
        source="a head's features, chosen by eye",
    )

    def plain(self) -> dict[str, Any]:
        return {"kind": self.kind, **super().plain()}


@dataclass(frozen=True)
class DistantLight(Light):
    """A lamp infinitely far away: `irradiance` falls on a surface that faces `direction`.

    `direction` points from the scene towards the lamp; `radius_deg` is its angular radius.
    """

    kind: ClassVar[str] = "distant"

    direction: tuple[float, float, float] = parameter(
        (0.0, 0.0, 1.0), low=-1e6, high=1e6, source="towards the lamp"
    )
    radius_deg: float = parameter(
        0.27, unit="degrees", low=0.0, high=20.0, source="the sun's angular radius"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.any(self.direction):
            raise InputError("light.direction is (0, 0, 0); expected a vector towards the lamp")

    @property
    def towards(self) -> np.ndarray:
        """Unit vector (3,) towards the lamp."""
        d = np.array(self.direction, dtype=float)
        return d / np.linalg.norm(d)


@dataclass(frozen=True)
class PointLight(Light):
    """A lamp at `position_mm`; `irradiance` is that at a distance of one metre.

    E(d) = irradiance / (c1 + c2 d + c3 d^2), d in metres: the inverse square law by default, and
    the three constants of the attenuation that teaching texts give (seeds' document 003, where
    the quotient is also cut off at 1: `attenuation_limit`).
    """

    kind: ClassVar[str] = "point"

    position_mm: tuple[float, float, float] = parameter(
        (0.0, 0.0, 1000.0), unit="mm", low=-1e6, high=1e6, source="the scene's"
    )
    radius_mm: float = parameter(5.0, unit="mm", low=0.0, high=1e4, source="a small lamp")
    attenuation: tuple[float, float, float] = parameter(
        (0.0, 0.0, 1.0), unit="1, 1/m, 1/m^2", low=0.0, high=1e9, source="the inverse square law"
    )
    attenuation_limit: float = parameter(
        1e9, low=0.0, high=1e9, source="1 in texts that cut the attenuation off near the lamp"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any(self.attenuation):
            raise InputError("light.attenuation is (0, 0, 0); expected one constant above 0")

    @property
    def place(self) -> np.ndarray:
        """Position (3,), mm."""
        return np.array(self.position_mm, dtype=float)

    def falloff(self, distance_mm: np.ndarray) -> np.ndarray:
        """The factor of `irradiance` at these distances, of the same shape."""
        d = np.asarray(distance_mm, dtype=float) / 1000.0
        c1, c2, c3 = self.attenuation
        return np.minimum(1 / np.maximum(c1 + c2 * d + c3 * d * d, 1e-12), self.attenuation_limit)


@dataclass(frozen=True)
class SpotLight(PointLight):
    """A point lamp with a cone about `axis`: full within `inner_deg`, nothing beyond `outer_deg`.

    Between them the light falls as the square of a linear ramp over the cosine, as in glTF's
    KHR_lights_punctual and pyrender.
    """

    kind: ClassVar[str] = "spot"

    axis: tuple[float, float, float] = parameter(
        (0.0, 0.0, -1.0), low=-1e6, high=1e6, source="from the lamp into the scene"
    )
    inner_deg: float = parameter(20.0, unit="degrees", low=0.0, high=89.0, source="the scene's")
    outer_deg: float = parameter(30.0, unit="degrees", low=0.1, high=90.0, source="the scene's")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.any(self.axis):
            raise InputError("light.axis is (0, 0, 0); expected the direction of the cone")
        if not self.inner_deg < self.outer_deg:
            raise InputError(
                f"light.inner_deg is {self.inner_deg:g} degrees; "
                f"expected less than outer_deg, {self.outer_deg:g}"
            )

    @property
    def along(self) -> np.ndarray:
        """Unit vector (3,) of the cone's axis, away from the lamp."""
        a = np.array(self.axis, dtype=float)
        return a / np.linalg.norm(a)

    def cone(self, from_lamp: np.ndarray) -> np.ndarray:
        """The cone's factor for unit directions (N, 3) away from the lamp: (N,)."""
        inner, outer = np.cos(np.radians([self.inner_deg, self.outer_deg]))
        t = np.clip((from_lamp @ self.along - outer) / max(inner - outer, 1e-6), 0, 1)
        return t * t


LIGHTS: dict[str, type[Light]] = {
    light.kind: light for light in (DistantLight, PointLight, SpotLight)
}


def read_light(table: Mapping[str, Any], where: str) -> Light:
    """A lamp from a table, by its `kind`."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {table!r:.60}; expected a table")
    kind = table.get("kind", "distant")
    if kind not in LIGHTS:
        raise InputError(f"{where}.kind is {kind!r:.60}; expected one of {', '.join(LIGHTS)}")
    return LIGHTS[kind].read({k: v for k, v in table.items() if k != "kind"}, where)


@dataclass(frozen=True)
class Panel(Parameters):
    """A soft panel: a spherical Gaussian of radiance, radiance exp(sharpness (direction . w - 1)).

    Tsai and Shih 2006, doi:10.1145/1141911.1141981.
    """

    called: ClassVar[str] = "panel"

    direction: tuple[float, float, float] = parameter(
        (0.0, 0.0, 1.0), low=-1e6, high=1e6, source="towards the panel"
    )
    sharpness: float = parameter(5.0, low=0.0, high=1e5, source="0: the same from everywhere")
    radiance: tuple[float, float, float] = parameter(
        (0.2, 0.2, 0.2), unit="relative radiance", low=0.0, high=1e6, source="the scene's"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.any(self.direction):
            raise InputError("panel.direction is (0, 0, 0); expected a vector towards the panel")

    @property
    def towards(self) -> np.ndarray:
        """Unit vector (3,) towards the panel's middle."""
        d = np.array(self.direction, dtype=float)
        return d / np.linalg.norm(d)


@dataclass(frozen=True)
class Environment(Parameters):
    """Light from all around: a constant, soft panels, and a map in latitude and longitude.

    map: an image file (.hdr or .exr), or "" for none; turned by `turn_deg` about the vertical axis
    (towards the person's left) and multiplied by `scale`.
    """

    called: ClassVar[str] = "environment"

    ambient: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="relative radiance", low=0.0, high=1e6, source="the scene's"
    )
    panels: dict[str, Panel] = field(default_factory=dict)
    map: str = ""
    turn_deg: float = parameter(0.0, unit="degrees", low=-360.0, high=360.0, source="the scene's")
    scale: float = parameter(1.0, low=0.0, high=1e6, source="the map's own radiance")

    @classmethod
    def read(cls, table: Mapping[str, Any], where: str) -> Environment:
        if not isinstance(table, Mapping):
            raise InputError(f"{where} is {table!r:.60}; expected a table")
        refuse_unknown(table, cls.names(), where)
        panels = table.get("panels", {})
        if not isinstance(panels, Mapping):
            raise InputError(f"{where}.panels is {panels!r:.60}; expected a table of panels")
        if not isinstance(table.get("map", ""), str):
            raise InputError(f"{where}.map is {table['map']!r:.60}; expected a file")
        read = {name: Panel.read(p, f"{where}.panels.{name}") for name, p in panels.items()}
        rest = {k: v for k, v in table.items() if k not in ("panels", "map")}
        made = super().read(rest, where)
        return cls(made.ambient, read, table.get("map", ""), made.turn_deg, made.scale)

    def radiance_of_panels(self, directions: np.ndarray) -> np.ndarray:
        """Radiance (N, 3) of the constant and the panels from unit directions (N, 3)."""
        total = np.tile(np.array(self.ambient, dtype=float), (len(directions), 1))
        for panel in self.panels.values():
            lobe = np.exp(panel.sharpness * (directions @ panel.towards - 1))
            total += lobe[:, None] * np.array(panel.radiance)
        return total
