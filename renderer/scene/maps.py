"""Environment maps as arrays: read, turned, looked up, and convolved by a lobe.

Maps are latitude and longitude: rows from the zenith down, columns once around; the middle column
is +z, where heads look, and x (the person's left) lies to its right.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from renderer.errors import InputError
from renderer.scene.lights import Environment

HEIGHT = 256  # rows of a map as it is used; a larger one is averaged down
SUFFIXES = (".hdr", ".exr")


def read_map(path: str | Path) -> np.ndarray:
    """Radiance (H, 2 H, 3) float32 of an .hdr or .exr file, at most HEIGHT rows."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: expected a file that ends in {' or '.join(SUFFIXES)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; expected an environment map")
    import OpenImageIO as oiio

    source = oiio.ImageBuf(str(path))
    if source.has_error:
        raise InputError(f"{path}: cannot be read: {' '.join(source.geterror().split())}")
    pixels = source.get_pixels(oiio.FLOAT)
    if pixels is None or pixels.ndim != 3 or pixels.shape[2] < 3:
        raise InputError(f"{path}: expected three channels of light")
    pixels = np.asarray(pixels[..., :3], np.float32)
    height, width = pixels.shape[:2]
    if width != 2 * height:
        raise InputError(f"{path} is {width}x{height}; expected twice as wide as high")
    if not np.isfinite(pixels).all() or pixels.min() < 0:
        pixels = np.nan_to_num(np.maximum(pixels, 0), nan=0.0, posinf=6.5e4)
    if not pixels.any():
        raise InputError(f"{path} is black; expected light")
    return shrink(pixels)


def shrink(pixels: np.ndarray) -> np.ndarray:
    """The map averaged down to at most HEIGHT rows, by whole factors."""
    factor = max(1, -(-pixels.shape[0] // HEIGHT))
    rows = pixels.shape[0] // factor * factor
    cut = pixels[:rows, : 2 * rows]
    parts = cut.reshape(rows // factor, factor, 2 * rows // factor, factor, 3)
    return parts.mean(axis=(1, 3), dtype=np.float64).astype(np.float32)


def directions(height: int) -> np.ndarray:
    """Unit vectors (H, 2 H, 3) of the texels of a map of that height."""
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2 * np.pi * ((np.arange(2 * height) + 0.5) / (2 * height) - 0.5)
    flat = np.sin(theta)[:, None]
    x, z = flat * np.sin(phi), flat * np.cos(phi)
    return np.stack([x, np.broadcast_to(np.cos(theta)[:, None], x.shape), z], axis=2)


def solid_angles(height: int) -> np.ndarray:
    """Solid angle (H, 1) of a texel of each row, sr; they sum to 4 pi over the map."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return ((edges[:-1] - edges[1:]) * 2 * np.pi / (2 * height))[:, None]


def convolve(pixels: np.ndarray, sharpness: float) -> np.ndarray:
    """The map (H, 2 H, 3) averaged by exp(sharpness (cos - 1)) around each direction.

    Row by row as a circular correlation in longitude: exact for every pair of rows.
    """
    height = pixels.shape[0]
    coarse = int(np.clip(8 * 2 ** np.ceil(np.log2(np.sqrt(max(sharpness, 1.0)))), 16, height))
    while height % coarse:
        coarse += 1
    step = height // coarse
    if step > 1:
        omega = solid_angles(height)[..., None]
        parts = (pixels * omega).reshape(coarse, step, 2 * coarse, step, 3).sum(axis=(1, 3))
        pixels = (parts / (solid_angles(coarse)[..., None])).astype(np.float32)
    d = directions(coarse)
    theta = np.pi * (np.arange(coarse) + 0.5) / coarse
    phi = np.pi * np.arange(2 * coarse) / coarse
    light = np.fft.rfft(pixels * solid_angles(coarse)[..., None], axis=1)
    result = np.empty_like(pixels)
    for row, angle in enumerate(theta):
        cosine = np.cos(angle) * np.cos(theta)[:, None]
        cosine = cosine + np.sin(angle) * np.sin(theta)[:, None] * np.cos(phi)
        lobe = np.exp(sharpness * (cosine - 1))
        total = (lobe * solid_angles(coarse)).sum()
        spectrum = (light * np.fft.rfft(lobe, axis=1)[..., None]).sum(axis=0)
        result[row] = np.fft.irfft(spectrum, 2 * coarse, axis=0) / total
    assert d.shape == result.shape
    return np.maximum(result, 0)


def lookup(pixels: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Radiance (N, 3) of a map from unit directions (N, 3), bilinear."""
    height, width = pixels.shape[:2]
    u = (0.5 + np.arctan2(towards[:, 0], towards[:, 2]) / (2 * np.pi)) * width - 0.5
    v = np.arccos(np.clip(towards[:, 1], -1, 1)) / np.pi * height - 0.5
    u0, v0 = np.floor(u).astype(int), np.floor(v).astype(int)
    fu, fv = (u - u0)[:, None], (v - v0)[:, None]
    rows = np.clip(np.stack([v0, v0 + 1]), 0, height - 1)
    columns = np.stack([u0, u0 + 1]) % width
    top = pixels[rows[0], columns[0]] * (1 - fu) + pixels[rows[0], columns[1]] * fu
    below = pixels[rows[1], columns[0]] * (1 - fu) + pixels[rows[1], columns[1]] * fu
    return top * (1 - fv) + below * fv


def turn(environment: Environment) -> np.ndarray:
    """World directions to the map's (3, 3): the map turned towards the person's left."""
    y = np.radians(environment.turn_deg)
    return np.array([[np.cos(y), 0, -np.sin(y)], [0, 1, 0], [np.sin(y), 0, np.cos(y)]])
