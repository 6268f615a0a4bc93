"""Expressions: how a person holds brows and mouth, by name or by weights of single movements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np

from renderer.parameters import Parameters, parameter, weights
from stimuli.heads import mpfb

_FOLDER = "expression/units/caucasian"
#: Movements, and the targets below targets/ that make them; at a weight of 1 the mouth's corners
#: move by 9 to 13 mm, its middle by 3 to 8, brows by 5 to 8.
MOVEMENTS: dict[str, tuple[str, ...]] = {
    "smile": ("mouth-corner-puller",),
    "corners_down": ("mouth-depression",),
    "lips_pressed": ("mouth-compression",),
    "mouth_wide": ("mouth-retraction",),
    "lip_raised": ("mouth-elevation",),
    "brows_up": ("eyebrows-left-up", "eyebrows-right-up"),
    "inner_brows_up": ("eyebrows-left-inner-up", "eyebrows-right-inner-up"),
    "outer_brows_up": ("eyebrows-left-extern-up", "eyebrows-right-extern-up"),
    "brows_down": ("eyebrows-left-down", "eyebrows-right-down"),
    "nose_wrinkled": ("nose-compression",),
}
#: What an expression by name is made of.
KINDS: dict[str, dict[str, float]] = {
    "neutral": {},
    "relaxed": {"smile": 0.05, "inner_brows_up": 0.10, "corners_down": 0.04},
    "slight_smile": {"smile": 0.20, "mouth_wide": 0.08},
    "raised_brows": {"brows_up": 0.55, "inner_brows_up": 0.45, "outer_brows_up": 0.25},
    "frown": {"brows_down": 0.45, "nose_wrinkled": 0.5, "corners_down": 0.15},
}
#: mm from the middle over which one side's share turns into the other's.
SIDE_MM = 14.0


@dataclass(frozen=True)
class Expression(Parameters):
    """An expression.

    kind: one of KINDS; strength: a factor of its movements; uneven: how much more the person's left
    side moves than the right (1: the right stays as it is, -1: the left), as most faces do a
    little; movements: weights of MOVEMENTS over those of the kind. What a person's targets say of
    the same movements comes to it.
    """

    called: ClassVar[str] = "expression"

    kind: str = parameter("neutral", choices=tuple(KINDS), source="by eye")
    strength: float = parameter(1.0, low=0.0, high=3.0, source="1 is KINDS as it stands")
    uneven: float = parameter(0.0, low=-1.0, high=1.0, source="by eye")
    movements: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where("movements")
        own = weights(where, self.movements, "weights", -1.0, 1.5, MOVEMENTS)
        object.__setattr__(self, "movements", own)

    def weights(self) -> dict[str, float]:
        """Of targets: name below targets/ -> weight, none that is 0."""
        kind = {name: self.strength * weight for name, weight in KINDS[self.kind].items()}
        moved: Mapping[str, float] = {**kind, **self.movements}
        return {
            f"{_FOLDER}/{target}": weight
            for name, weight in moved.items()
            if weight
            for target in MOVEMENTS[name]
        }

    def shown(self, data: Path, base: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Positions (V, 3) of a head with this expression, in the base mesh's units.

        base (V, 3): the mesh without targets, on which the sides are told.
        """
        chosen = self.weights()
        if not chosen:
            return positions
        moved = mpfb.morph(data, positions, chosen) - positions
        side = np.tanh(base[:, 0] * mpfb.MM_PER_UNIT / SIDE_MM)
        return positions + moved * (1 + np.clip(self.uneven * side, -1, 1))[:, None]
