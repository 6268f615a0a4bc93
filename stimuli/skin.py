"""Whether a person's colour and the medium below it agree: `subdermal skin`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from renderer.optics import media
from renderer.scene.material import Skin
from stimuli.heads import load_person
from stimuli.scenes.staging import face


@dataclass(frozen=True)
class Agreement:
    """Of a person's face: mean melanin (share of the epidermis) and blood (share of the dermis),
    the mean albedo that is shown, that of the person's medium by Monte Carlo (both linear sRGB) and
    the mean radius at which the medium's light comes back, mm: (3,) each.
    """

    person: str
    melanin: float
    blood: float
    shown: np.ndarray
    walked: np.ndarray
    radius_mm: np.ndarray

    @property
    def off(self) -> np.ndarray:
        """How far the medium's albedo is from the one shown, of the latter: (3,)."""
        return self.walked / self.shown - 1


def agreement(person: str, photons: int) -> Agreement:
    """Walk photons (a channel) in the medium of a person of stimuli/people, or of a TOML file."""
    model = load_person(person).model
    skin: Skin = model.material
    masks, share = face(model.surface, model.landmarks)
    curve = media.curve(skin.own_medium(masks, share), photons)
    share = share / share.sum()
    melanin, blood, _ = (float(share @ value) for value in skin.pigments(masks))
    shown = share @ skin.mean_albedo(masks)
    return Agreement(person, melanin, blood, shown, curve.albedo, curve.mean_radius())
