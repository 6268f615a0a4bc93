"""What is drawn: objects, materials, lights and the camera, as frozen values read from tables."""

from renderer.scene.camera import ANGLES, FRAMINGS, Camera
from renderer.scene.lights import (
    DistantLight,
    Environment,
    Light,
    Panel,
    PointLight,
    SpotLight,
)
from renderer.scene.material import Material, Shading, Skin
from renderer.scene.model import MASKS, Eye, Garment, Model, Proxy, Strands, Surface
from renderer.scene.picture import Picture
from renderer.scene.scene import Scene

__all__ = [
    "ANGLES",
    "FRAMINGS",
    "MASKS",
    "Camera",
    "DistantLight",
    "Environment",
    "Eye",
    "Garment",
    "Light",
    "Material",
    "Model",
    "Panel",
    "Picture",
    "PointLight",
    "Proxy",
    "Scene",
    "Shading",
    "Skin",
    "SpotLight",
    "Strands",
    "Surface",
]
