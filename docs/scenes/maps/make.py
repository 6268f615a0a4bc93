"""The maps of maps.toml: blotches of two skin tones, rings that stand out, bands that are wet.

.venv/bin/python docs/scenes/maps/make.py
"""

from pathlib import Path

import numpy as np
from PIL import Image

SIZE = 512
HERE = Path(__file__).parent


def srgb(linear: np.ndarray) -> np.ndarray:
    """8-bit sRGB of linear values in [0, 1]."""
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.rint(255 * encoded).astype(np.uint8)


v, u = np.meshgrid(*2 * [(np.arange(SIZE) + 0.5) / SIZE], indexing="ij")
angle = 2 * np.pi * u
field = np.sin(5 * angle + 7 * v) + np.sin(3 * angle - 11 * v + 1) + np.sin(2 * angle + 17 * v + 2)
dark = 1 / (1 + np.exp(-(field - 0.6) / 0.06))[..., None]
albedo = np.array([0.60, 0.41, 0.33]) * (1 - dark) + np.array([0.30, 0.17, 0.12]) * dark
ring = np.exp(-(((12 * v) % 1 - 0.5) ** 2) / (2 * 0.08**2))
wet = 0.05 + 0.95 / (1 + np.exp(-np.sin(10 * angle + 14 * v) / 0.1))

Image.fromarray(srgb(albedo)).save(HERE / "albedo.png")
Image.fromarray(np.rint(65535 * ring).astype(np.uint16)).save(HERE / "height.png")
Image.fromarray(np.rint(255 * wet).astype(np.uint8)).save(HERE / "specular.png")
