"""Lamps as the shaders take them, and their shadow maps: layers of depth, one or six a lamp."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.memory import parts
from renderer.scene.graph import look_at
from renderer.scene.lights import DistantLight, Light, PointLight, SpotLight

if TYPE_CHECKING:
    from renderer.passes.hair import Hair
    from renderer.passes.surfaces import Surfaces

STRAND_SHARE = 2  # the maps of hair have so many times fewer pixels a side
LEAST_MM = 0.03  # thinner strands, vellus, cast no shadow
MARGIN_MM = 2.0  # around what is seen from a distant lamp
NEAREST_MM = 1.0  # of a cone's depths
#: Uniforms that have one entry a lamp.
PER_LAMP = (
    "lamp_place",
    "lamp_irradiance",
    "lamp_falloff",
    "lamp_cone",
    "lamp_ramp",
    "lamp_size",
    "lamp_search",
    "lamp_layer",
    "lamp_faces",
    "strand_layer",
    "strand_faces",
)
AT_ONCE = 65536  # points that are turned at a time
_CUBE = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))


@dataclass(frozen=True)
class Layer:
    """One map: matrix (4, 4), world to xy over w and depth in mm; scale: uv per mm (at 1 mm)."""

    matrix: np.ndarray
    scale: float
    farthest_mm: float


#: Points (N, 3), mm, in as many arrays as there are.
Clouds = Sequence[np.ndarray]


def extremes(clouds: Clouds, of: Callable[[np.ndarray], np.ndarray]) -> tuple:
    """The least and the most of what `of` makes of points (K, 3), over all of them.

    They are gone through in parts: hair has some millions.
    """
    least, most = [], []
    for part in _parts(clouds):
        made = of(part)
        least.append(made.min(axis=0))
        most.append(made.max(axis=0))
    return np.min(least, axis=0), np.max(most, axis=0)


def _parts(clouds: Clouds) -> Iterator[np.ndarray]:
    for cloud in clouds:
        for part in parts(len(cloud), AT_ONCE):
            yield np.asarray(cloud[part], float)


def distant_layer(light: DistantLight, clouds: Clouds) -> Layer:
    """A box around all points, seen along the light; depth from its nearest point."""
    turn = look_at(light.towards, np.zeros(3))[:3, :3]
    low, high = extremes(clouds, lambda points: points @ turn)
    low, high = low - MARGIN_MM, high + MARGIN_MM
    half = 0.5 * (high - low)[:2].max()
    centre = 0.5 * (low + high)
    matrix = np.eye(4)
    matrix[0, :3], matrix[1, :3] = turn[:, 0] / half, turn[:, 1] / half
    matrix[:2, 3] = -centre[:2] / half
    matrix[2, :3], matrix[2, 3] = -turn[:, 2], high[2]
    return Layer(matrix, 0.5 / half, float(high[2] - low[2]))


def cone_layer(place: np.ndarray, axis: np.ndarray, half_deg: float, clouds: Clouds) -> Layer:
    """A cone of a half angle (of the square map) from a place along a unit axis."""
    pose = look_at(np.zeros(3), axis)
    turn = pose[:3, :3]
    _, farthest = extremes(clouds, lambda points: (points - place) @ -turn[:, 2])
    cotangent = 1 / np.tan(np.radians(half_deg))
    matrix = np.zeros((4, 4))
    matrix[0, :3], matrix[1, :3] = cotangent * turn[:, 0], cotangent * turn[:, 1]
    matrix[2, :3] = matrix[3, :3] = -turn[:, 2]
    matrix[:, 3] = -matrix[:, :3] @ place
    return Layer(matrix, 0.5 * cotangent, float(max(farthest, NEAREST_MM)) + MARGIN_MM)


def layers_of(light: Light, clouds: Clouds) -> list[Layer]:
    """The layers of a lamp over all points of the scene: none without shadow.

    A point lamp outside of the scene sees it in one cone, one among the objects in a cube of six.
    """
    if not light.shadow:
        return []
    if isinstance(light, DistantLight):
        return [distant_layer(light, clouds)]
    assert isinstance(light, PointLight)
    if isinstance(light, SpotLight) and light.outer_deg < 75:
        return [cone_layer(light.place, light.along, light.outer_deg + 1.0, clouds)]
    low, high = extremes(clouds, lambda points: points)
    nearest, _ = extremes(clouds, lambda points: np.linalg.norm(points - light.place, axis=1))
    axis = 0.5 * (low + high) - light.place
    length = np.linalg.norm(axis)
    if length > 0 and nearest > NEAREST_MM:
        axis = axis / length

        def off_axis(points: np.ndarray) -> np.ndarray:
            away = points - light.place
            return (away / np.linalg.norm(away, axis=1)[:, None]) @ axis

        cosine, _ = extremes(clouds, off_axis)
        if cosine > np.cos(np.radians(65)):
            half = float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))) + 1.0
            return [cone_layer(light.place, axis, half, clouds)]
    return [cone_layer(light.place, np.array(side, float), 45.0, clouds) for side in _CUBE]


class Lamps:
    """The lamps of a scene with their maps; `uniforms` gives what lighting.glsl takes.

    map_size: pixels of a map's side; clouds: points (N, 3) of all that is there, mm; strands:
    those of hair that casts shadows.
    """

    def __init__(self, lights: Sequence[Light], clouds: Clouds, strands: Clouds, map_size: int):
        self.lights = list(lights)
        self.layers: list[Layer] = []
        self.first: list[int] = []
        self.faces: list[int] = []
        for light in self.lights:
            layers = layers_of(light, clouds)
            self.first.append(len(self.layers) if layers else -1)
            self.faces.append(len(layers))
            self.layers += layers
        # hair has maps of its own, no wider than it is
        near = [
            layers_of(light, strands) if any(map(len, strands)) else [] for light in self.lights
        ]
        self.strand_first = [sum(map(len, near[:k])) if own else -1 for k, own in enumerate(near)]
        self.strand_faces = [len(own) for own in near]
        self.strand_layers = [layer for own in near for layer in own]
        farthest = [layer.farthest_mm for layer in (*self.layers, *self.strand_layers)]
        self.depth_range = 1.01 * max(farthest, default=1.0)
        size, count = (map_size, len(self.layers)) if self.layers else (1, 1)
        self.solid = gl.DepthArray(size, count)
        side, count = max(1, map_size // STRAND_SHARE), len(self.strand_layers)
        self.strand_size, count = (side, count) if count else (1, 1)
        self.strands = gl.DepthArray(self.strand_size, count)
        self.sums = gl.TextureArray(self.strand_size, self.strand_size, count, GL.GL_RGBA16F)

    def draw(self, programs: Callable[..., gl.Program], surfaces: Surfaces, hair: list[Hair]):
        """Draw all layers: the depth of surfaces, that of the first strand, and sums of opacity."""
        solid = programs("passes/shadow.frag", vertex="passes/shadow.vert")
        towards = {"defines": {"LAMP": 1}, "vertex": "passes/hair.vert"}
        first = programs("passes/hair_depth.frag", **towards)
        sums = programs("passes/hair_sums.frag", **towards)
        side = self.strand_size
        for index, layer in enumerate(self.layers):
            self.solid.bind_layer(index)
            shared = {"layer": layer.matrix, "depth_range": self.depth_range}
            surfaces.draw_depth(solid, shared)
        with gl.Target(side, side, [GL.GL_RGBA16F]) as target:
            for index, layer in enumerate(self.strand_layers):
                values = {
                    "matrix": layer.matrix,
                    "drawn_size": (side, side),
                    "depth_range": self.depth_range,
                    "strand_depth": self.strands.array,
                    "index_of_layer": index,
                }
                self.strands.bind_layer(index)
                for own in hair:
                    own.draw_shadows(first, values, LEAST_MM)
                target.bind(clear=(0.0, 0.0, 0.0, 0.0), blend="add")
                for own in hair:
                    own.draw_shadows(sums, values, LEAST_MM)
                self.sums.copy_layer(index)

    def maps(self) -> dict[str, gl.TextureArray]:
        """What `draw` fills."""
        return {"solid": self.solid.array, "strands": self.strands.array, "sums": self.sums}

    def defines(self) -> dict[str, int]:
        """Sizes of the shaders' arrays."""
        return {
            "LAMPS": max(1, len(self.lights)),
            "LAYERS": max(1, len(self.layers)),
            "STRAND_LAYERS": max(1, len(self.strand_layers)),
        }

    def uniforms(self) -> dict:
        """What lighting.glsl takes of lamps; arrays are padded to one entry where there is none."""
        lights = self.lights or [DistantLight(irradiance=(0.0, 0.0, 0.0), shadow=False)]
        layers = self.layers or [Layer(np.eye(4), 1.0, 1.0)]
        strand_layers = self.strand_layers or [Layer(np.eye(4), 1.0, 1.0)]
        positional = [isinstance(light, PointLight) for light in lights]
        place = [
            np.append(light.place if point else light.towards, float(point))
            for light, point in zip(lights, positional, strict=True)
        ]
        return {
            "lamps": len(self.lights),
            "lamp_place": np.array(place),
            "lamp_irradiance": np.array([light.irradiance for light in lights]),
            "lamp_falloff": np.array([_falloff(light) for light in lights]),
            "lamp_cone": np.array([_cone(light)[:4] for light in lights]),
            "lamp_ramp": np.array([_cone(light)[4] for light in lights]),
            "lamp_size": np.array([_size(light) for light in lights]),
            "lamp_search": np.array([light.search_mm for light in lights]),
            "lamp_layer": np.array(self.first or [-1]),
            "lamp_faces": np.array(self.faces or [0]),
            "layer_matrix": np.array([layer.matrix for layer in layers]),
            "layer_scale": np.array([layer.scale for layer in layers]),
            "strand_layer": np.array(self.strand_first or [-1]),
            "strand_faces": np.array(self.strand_faces or [0]),
            "strand_matrix": np.array([layer.matrix for layer in strand_layers]),
            "strand_scale": np.array([layer.scale for layer in strand_layers]),
            "depth_range": self.depth_range,
            "solid_depth": self.solid.array,
            "strand_depth": self.strands.array,
            "strand_sums": self.sums,
        }

    def delete(self) -> None:
        self.solid.delete()
        self.strands.delete()
        self.sums.delete()


def of_lamps(uniforms: dict, lamps: Sequence[int]) -> dict:
    """What of `Lamps.uniforms` changes so that just these lamps shine, by their numbers: the others
    are moved behind them, where shaders do not look.
    """
    count = len(uniforms["lamp_place"])
    order = [*lamps, *(k for k in range(count) if k not in lamps)]
    return {"lamps": len(lamps), **{name: uniforms[name][order] for name in PER_LAMP}}


def _falloff(light: Light) -> tuple[float, float, float, float]:
    if not isinstance(light, PointLight):
        return (1.0, 0.0, 0.0, 1e9)
    c1, c2, c3 = light.attenuation
    return (c1, c2 * 1e-3, c3 * 1e-6, light.attenuation_limit)


def _cone(light: Light) -> tuple[float, ...]:
    if not isinstance(light, SpotLight):
        return (0.0, 0.0, 0.0, -2.0, 1.0)
    inner, outer = np.cos(np.radians([light.inner_deg, light.outer_deg]))
    return (*light.along, float(outer), float(inner - outer))


def _size(light: Light) -> float:
    if isinstance(light, PointLight):
        return light.radius_mm
    assert isinstance(light, DistantLight)
    return float(np.tan(np.radians(light.radius_deg)))
