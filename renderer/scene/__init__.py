"""What is drawn: objects, materials, lights and the camera, as frozen values read from tables."""

from renderer.scene.model import MASKS, Eye, Model, Proxy, Skin, Strands
from renderer.scene.studio import (
    FRAMINGS,
    STUDIO,
    Framing,
    Lamp,
    Lobe,
    Studio,
    View,
    lamp_matrix,
    look_at,
    resolve,
)

__all__ = [
    "FRAMINGS",
    "MASKS",
    "STUDIO",
    "Eye",
    "Framing",
    "Lamp",
    "Lobe",
    "Model",
    "Proxy",
    "Skin",
    "Strands",
    "Studio",
    "View",
    "lamp_matrix",
    "look_at",
    "resolve",
]
