"""Environments for the passes: a map convolved by lobes of rising sharpness, and looked up."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from renderer import gl
from renderer.scene.lights import Environment
from renderer.scene.maps import convolve, directions, lookup, read_map, solid_angles, turn

LAYERS = 7  # sharpness 1, 4, 16, ... 4096


@lru_cache(maxsize=4)
def _layers(path: str) -> tuple[np.ndarray, ...]:
    pixels = read_map(path)
    return (*(convolve(pixels, 4.0**k) for k in range(LAYERS - 1)), pixels)


class Surroundings:
    """An environment as the passes use it: radiance for rays, and uniforms for lighting.glsl."""

    def __init__(self, environment: Environment):
        self.value = environment
        self._layers = _layers(environment.map) if environment.map else ()
        self._texture: gl.TextureArray | None = None

    def radiance(self, towards: np.ndarray, sharpness: float = 64.0) -> np.ndarray:
        """Radiance (N, 3) from unit directions (N, 3).

        The map is taken through a lobe of about `sharpness`: rays are few, and a small sun would
        be met by chance alone.
        """
        total = self.value.radiance_of_panels(towards)
        if self._layers:
            k = int(np.clip(round(np.log(max(sharpness, 1)) / np.log(4)), 0, LAYERS - 1))
            radiance = lookup(self._layers[k], towards @ turn(self.value).T)
            total = total + self.value.scale * radiance
        return total

    def content(self) -> tuple:
        """All that `radiance` follows from: the value without its file's name, and the map."""
        return (replace(self.value, map=""), *self._layers)

    def mean(self) -> np.ndarray:
        """Mean radiance (3,) over all directions: the ambient intensity I_a of local models."""
        total = np.array(self.value.ambient, float)
        for panel in self.value.panels.values():
            s = panel.sharpness
            total += np.array(panel.radiance) * (-np.expm1(-2 * s) / (2 * s) if s > 0 else 1.0)
        if self._layers:
            pixels = self._layers[-1]
            share = solid_angles(pixels.shape[0])[..., None] / (4 * np.pi)
            total += self.value.scale * (pixels * share).sum(axis=(0, 1))
        return total

    def defines(self) -> dict[str, int]:
        """Size of the shaders' arrays."""
        return {"PANELS": max(1, len(self.value.panels))}

    def uniforms(self) -> dict:
        """What lighting.glsl takes of the environment."""
        panels = list(self.value.panels.values())
        axis = [[*panel.towards, panel.sharpness] for panel in panels]
        if self._texture is None:
            self._texture = self._upload()
        return {
            "panel_count": len(panels),
            "panel_axis": np.array(axis or [[0.0, 0.0, 1.0, 1.0]]),
            "panel_radiance": np.array([panel.radiance for panel in panels] or [[0.0] * 3]),
            "ambient": self.value.ambient,
            "environment_map": self._texture,
            "environment_layers": float(len(self._layers)),
            "environment_turn": turn(self.value),
            "environment_scale": self.value.scale,
        }

    def _upload(self) -> gl.TextureArray:
        if not self._layers:
            return gl.TextureArray(1, 1, 1, gl.GL.GL_RGBA16F)
        height = max(layer.shape[0] for layer in self._layers)
        stack = np.ones((LAYERS, height, 2 * height, 4), np.float32)
        towards = directions(height).reshape(-1, 3)
        for k, layer in enumerate(self._layers):
            full = layer if layer.shape[0] == height else lookup(layer, towards)
            stack[k, ..., :3] = full.reshape(height, 2 * height, 3)[::-1]
        return gl.TextureArray(
            2 * height, height, LAYERS, gl.GL.GL_RGBA16F, data=stack, linear=True, repeat=True
        )

    def delete(self) -> None:
        if self._texture is not None:
            self._texture.delete()
            self._texture = None
