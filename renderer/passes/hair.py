"""Hair: strands as ribbons towards the camera, far ones first, and towards a lamp."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.passes import occlusion
from renderer.passes.environment import Surroundings
from renderer.passes.lamps import Lamps
from renderer.passes.surfaces import Drawn
from renderer.scene.graph import Item
from renderer.scene.lights import DistantLight, Light

EXTINCTION = 1.5  # of the whole layer of hair along its normal
SHADOW_WIDTH_MM = 0.16  # of a strand in a lamp's map: finer ones would fall between its texels
MINIMUM_PX = 1.3
COLUMNS = 2048  # texels of a row of points
CHUNK = 8192  # strands that are put on the graphics card at a time


class Hair:
    """The strands of one mesh, on the surface that they stand on."""

    def __init__(self, item: Item, on: Drawn):
        self.strands, pose = item.primitive.strands, item.pose
        self.points = (self.strands.points @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)
        self.size = float(np.linalg.norm(pose[:3, 0]))
        root = self.strands.root_vertex
        turned = on.item.primitive.normals[root] @ pose[:3, :3].T / self.size
        self.normals = turned.astype(np.float32)
        light = on.baked.light[root]
        self.environment = np.maximum(np.einsum("nci,ni->nc", light, self.normals), 0)
        self._lit: gl.TextureArray | None = None

    def light(
        self,
        context: gl.Context,
        programs: Callable[..., gl.Program],
        lamps: Lamps,
        surroundings: Surroundings,
    ) -> None:
        """Find what of each lamp's light reaches each point, by the lamps' maps: for all views."""
        count = self.points.shape[0] * self.points.shape[1]
        rows = -(-count // COLUMNS)
        normals = np.repeat(self.normals, self.points.shape[1], axis=0)
        size = (COLUMNS, rows)

        def texels(xyz: np.ndarray, w: np.ndarray | float) -> gl.Texture:
            data = np.zeros((rows * COLUMNS, 4), np.float32)
            data[:count, :3], data[:count, 3] = xyz, w
            return gl.Texture(*size, GL.GL_RGBA32F, data=data.reshape(rows, COLUMNS, 4))

        places = texels(self.points.reshape(-1, 3), self.strands.cover.ravel())
        values = {
            **lamps.uniforms(),
            **surroundings.uniforms(),
            "places": places,
            "normals": texels(normals, 0.0),
            "extinction": EXTINCTION,
        }
        program = programs("passes/hair_lit.frag", {**lamps.defines(), **surroundings.defines()})
        lit = np.zeros((max(1, len(lamps.lights)), rows, COLUMNS, 1), np.float32)
        with gl.Target(*size, [GL.GL_R32F]) as target:
            for k in range(len(lamps.lights)):
                target.bind()
                program.use(**program.accepts({**values, "lamp": k}))
                gl.draw_fullscreen(context)
                lit[k] = target.textures[0].read()[::-1]
        for texture in (places, values["normals"]):
            texture.delete()
        self._lit = gl.TextureArray(*size, len(lit), GL.GL_R32F, data=lit)

    def draw_shadows(self, light: Light) -> None:
        """Flat ribbons that face a lamp, with the program in use."""
        for start in range(0, len(self.points), CHUNK):
            _draw_and_free(self._shadow_ribbons(light, self.points[start : start + CHUNK]))

    def _shadow_ribbons(self, light: Light, points: np.ndarray) -> gl.Mesh:
        tangent = np.gradient(points, axis=1)
        facing = light.towards if isinstance(light, DistantLight) else light.place - points
        across = np.cross(tangent, np.asarray(facing, np.float32))
        across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-6)
        taper = np.linspace(1.0, 0.4, points.shape[1], dtype=np.float32)[None, :, None]
        half = 0.5 * SHADOW_WIDTH_MM * self.size * taper * across
        both = np.stack([points - half, points + half], axis=2)
        return gl.Mesh({0: both.reshape(-1, 3)}, ribbon_faces(*points.shape[:2]))

    def draw(
        self,
        programs: Callable[..., gl.Program],
        lamps: Lamps,
        surroundings: Surroundings,
        shared: dict,
        pixels_per_mm: float,
        size: tuple[int, int],
        depths: list[np.ndarray],
    ) -> None:
        """Blend all strands that can be seen into the bound target.

        shared: camera_position, view, projection; size: of the target in pixels; depths: what
        `occlusion.blocks` makes of the view depths of surfaces.
        """
        half_mm = 0.5 * self.size * self.strands.width_mm
        matrix = shared["projection"] @ shared["view"]
        bounds = (self.points, matrix, size, half_mm, 0.5 * MINIMUM_PX)
        seen = np.flatnonzero(~occlusion.hidden(depths, *bounds))
        distance = np.linalg.norm(
            self.points[seen].mean(axis=1) - shared["camera_position"], axis=1
        )
        # far strands first: blended back to front
        order = seen[np.argsort(-distance, kind="stable")]
        defines = {**lamps.defines(), **surroundings.defines()}
        program = programs("passes/hair.frag", defines, vertex="passes/hair.vert")
        values = {
            **shared,
            **lamps.uniforms(),
            **surroundings.uniforms(),
            "pixels_per_mm": pixels_per_mm,
            "minimum_px": MINIMUM_PX,
            "extinction": EXTINCTION,
            "lit_map": self._lit,
        }
        program.use(**program.accepts(values))
        for start in range(0, len(order), CHUNK):
            _draw_and_free(self._ribbons(order[start : start + CHUNK]))

    def _ribbons(self, chosen: np.ndarray) -> gl.Mesh:
        """These strands (S,), in their order, as what hair.vert takes."""
        strands, points = self.strands, self.points[chosen]
        n, p = points.shape[:2]
        tangent = np.gradient(points, axis=1)
        tangent /= np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), 1e-6)

        def twice(array: np.ndarray) -> np.ndarray:
            return np.repeat(array.reshape(n * p, -1).astype(np.float32), 2, axis=0)

        def per_strand(array: np.ndarray) -> np.ndarray:
            return twice(np.repeat(array[chosen][:, None, :], p, axis=1))

        strand = np.empty((2 * n * p, 4), np.float32)
        strand[:, 0] = np.tile([-1.0, 1.0], n * p)
        strand[:, 1:2] = twice(np.repeat(self.size * strands.width_mm[chosen][:, None], p, axis=1))
        strand[:, 2:3] = twice(strands.cover[chosen])
        strand[:, 3:4] = twice(np.tile(np.linspace(0, 1, p), (n, 1)))
        attributes = {
            0: twice(points),
            1: twice(tangent),
            2: strand,
            3: per_strand(strands.colour),
            4: per_strand(self.environment),
            5: twice(chosen[:, None] * p + np.arange(p)),
        }
        return gl.Mesh(attributes, ribbon_faces(n, p))


def _draw_and_free(mesh: gl.Mesh) -> None:
    """Draw and wait: a software driver keeps what is still to be drawn, deleted or not."""
    mesh.draw()
    gl.finish()
    mesh.delete()


def ribbon_faces(strands: int, points: int) -> np.ndarray:
    """Triangles (2 S (P - 1), 3) of S ribbons of P point pairs, strand by strand."""
    base = (np.arange(strands)[:, None] * points + np.arange(points - 1)[None]).ravel() * 2
    corners = [base, base + 1, base + 2, base + 1, base + 3, base + 2]
    return np.stack(corners, axis=1).reshape(-1, 3)
