"""A person: the named set of parameters that a head is generated from (stimuli/people/*.toml)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from renderer.parameters import Parameters, parameter, refuse_unknown, weights
from stimuli.heads.form import Form
from stimuli.heads.regions import Regions

_COLOUR = {"unit": "linear albedo", "low": 0.0, "high": 1.0}


@dataclass(frozen=True)
class Eyes(Parameters):
    """Iris and sclera; `iris` is its colour between the fibres."""

    called: ClassVar[str] = "eyes"

    iris_mm: float = parameter(6.2, unit="mm, radius", low=4.5, high=7.5, source="Gullstrand")
    iris: tuple[float, float, float] = parameter((0.11, 0.145, 0.135), source="by eye", **_COLOUR)
    fibres: tuple[float, float, float] = parameter((0.20, 0.215, 0.17), source="by eye", **_COLOUR)
    collarette: tuple[float, float, float] = parameter(
        (0.26, 0.16, 0.065), source="by eye", **_COLOUR
    )
    sclera: tuple[float, float, float] = parameter((0.50, 0.445, 0.415), source="by eye", **_COLOUR)
    gaze_yaw_deg: float = parameter(
        17.0, unit="degrees to the person's left", low=-40.0, high=40.0, source="to the camera"
    )


@dataclass(frozen=True)
class Hair(Parameters):
    """Numbers of strands, the fibre's colour, and the lengths' scales; 0 strands: none."""

    called: ClassVar[str] = "hair"

    colour: tuple[float, float, float] = parameter(
        (0.055, 0.032, 0.019), source="dark brown, by eye", **_COLOUR
    )
    scalp: int = parameter(78000, unit="strands", low=0, high=400000, source="by eye")
    scalp_length: float = parameter(1.0, unit="of 4.5 to 28 mm", low=0.1, high=4.0, source="by eye")
    hairline_mm: float = parameter(
        0.0, unit="mm lower on the forehead", low=-40.0, high=30.0, source="by eye"
    )
    brows: int = parameter(820, unit="hairs a brow", low=0, high=5000, source="by eye")
    brow_width: float = parameter(1.0, unit="of 4 mm", low=0.2, high=3.0, source="by eye")
    lashes: float = parameter(1.0, unit="of their length", low=0.0, high=2.0, source="by eye")
    stubble: int = parameter(9000, unit="hairs", low=0, high=100000, source="a day's beard")
    vellus: int = parameter(16000, unit="hairs", low=0, high=200000, source="by eye")
    vellus_colour: tuple[float, float, float] = parameter(
        (0.22, 0.15, 0.10), source="by eye", **_COLOUR
    )


@dataclass(frozen=True)
class Person(Parameters):
    """A person.

    targets: weight of each of MakeHuman's morph targets, by its path below targets/; skin: what
    their skin says over renderer.scene.Skin's defaults (read with the scene's materials).
    """

    called: ClassVar[str] = "person"

    targets: dict[str, float] = field(default_factory=dict)
    form: Form = field(default_factory=Form)
    arm_drop_deg: float = parameter(32.0, unit="degrees", low=0.0, high=80.0, source="by eye")
    eyes: Eyes = field(default_factory=Eyes)
    hair: Hair = field(default_factory=Hair)
    regions: Regions = field(default_factory=Regions)
    skin: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, table: Mapping[str, Any], where: str) -> Person:
        refuse_unknown(table, cls.names(), where)
        targets = weights(f"{where}.targets", table.get("targets", {}), "weights", -1, 1.5)
        arm = super().read({k: v for k, v in table.items() if k == "arm_drop_deg"}, where)
        return cls(
            targets,
            Form.read(table.get("form", {}), f"{where}.form"),
            arm.arm_drop_deg,
            Eyes.read(table.get("eyes", {}), f"{where}.eyes"),
            Hair.read(table.get("hair", {}), f"{where}.hair"),
            Regions.read(table.get("regions", {}), f"{where}.regions"),
            dict(table.get("skin", {})),
        )
