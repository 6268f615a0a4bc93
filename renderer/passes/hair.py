"""Hair: every point of a strand is shaded once a view, strands are ribbons between them, drawn far
ones first; and towards a lamp, where their opacity is summed over depth.

Deep opacity maps: Yuksel and Keyser 2008, doi:10.1111/j.1467-8659.2008.01165.x: a lamp's map holds
the depth of the first strand, and the opacity summed to some distances behind it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.memory import parts
from renderer.passes import occlusion
from renderer.passes.environment import Surroundings
from renderer.passes.lamps import Lamps
from renderer.passes.surfaces import Drawn
from renderer.scene.graph import Item

EXTINCTION = 1.5  # of the whole layer of hair along its normal, for light from everywhere
MINIMUM_PX = 1.3  # a thinner strand is drawn so wide, and its opacity is its width's share of it
FREE_MM = 6.0  # from its root a point keeps off the skin's own shadow by so much less
LONG_POINTS = 8  # strands of more points are the scalp's
MANY = 20000  # strands: of so many, half stand for all in a lamp's map
COLUMNS = 2048  # texels of a row of points
SEGMENTS = 4  # of a piece: what is left out or sorted as one
CHUNK = 32768  # pieces that are put on the graphics card at a time
ROWS = 64  # of points that are reckoned and put there at a time
#: What `Hair.fixed` makes.
FIXED = ("places", "tangents", "covers", "normals", "colours", "environments")


class Hair:
    """The strands of one mesh, on the surface that they stand on."""

    def __init__(self, item: Item, on: Drawn):
        self.strands, pose = item.primitive.strands, item.pose
        first = self.strands.first
        self.points = np.asarray(self.strands.points, np.float32)
        if not np.array_equal(pose, np.eye(4)):  # else they are the scene's own
            self.points = np.empty(self.points.shape, np.float32)
            for part in parts(len(self.points), ROWS * COLUMNS):
                self.points[part] = item.in_world(self.strands.points[part])
        self.size = float(np.linalg.norm(pose[:3, 0]))
        self.counts = np.diff(first)
        of = np.arange(len(self.counts), dtype=np.int32)
        self.of = np.repeat(of, self.counts)  # strand of each point
        root = self.strands.root_vertex
        turned = on.item.primitive.normals[root] @ pose[:3, :3].T / self.size
        self.normals = turned.astype(np.float32)
        light = on.baked.light[root]
        self.environment = np.maximum(np.einsum("nci,ni->nc", light, self.normals), 0)
        self.pieces = pieces(first)
        self.rows = -(-len(self.points) // COLUMNS)
        self._fixed: dict[str, gl.Texture] = {}
        self._lit: gl.TextureArray | None = None

    def _per_point(self, values: Callable[[slice, np.ndarray], tuple], channels=4) -> gl.Texture:
        """A texture of 4 channels or 1. values: makes them, (K,) or (K, C) side by side, for some
        points and their strands (K,).
        """
        form = {1: GL.GL_R32F, 4: GL.GL_RGBA32F}[channels]
        texture = gl.Texture(COLUMNS, self.rows, form)
        for part in parts(self.rows * COLUMNS, ROWS * COLUMNS):
            texels = np.zeros((part.stop - part.start, channels), np.float32)
            own = slice(part.start, min(part.stop, len(self.points)))
            first = 0
            for made in values(own, self.of[own]):
                made = made.reshape(len(made), -1)
                last = first + made.shape[1]
                texels[: len(made), first:last], first = made, last
            texture.write_rows(part.start // COLUMNS, texels.reshape(-1, COLUMNS, channels))
        return texture

    def _per_strand(self, xyz: np.ndarray, w: np.ndarray | float) -> gl.Texture:
        rows = -(-len(self.counts) // COLUMNS)
        data = np.zeros((rows * COLUMNS, 4), np.float32)
        data[: len(self.counts), :3], data[: len(self.counts), 3] = xyz, w
        return gl.Texture(COLUMNS, rows, GL.GL_RGBA32F, data=data.reshape(rows, COLUMNS, 4))

    def fixed(self, *names: str) -> dict[str, gl.Texture]:
        """What no view changes, on the graphics card: of points and of strands. names: of FIXED,
        which is what is made; none: all.
        """
        for name in names or FIXED:
            if name not in self._fixed:
                self._fixed[name] = getattr(self, f"_{name}")()
        return {name: self._fixed[name] for name in names or FIXED}

    def _places(self) -> gl.Texture:
        strands, width = self.strands, self.size * self.strands.width_mm

        def values(part: slice, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            along = (np.arange(part.start, part.stop) - strands.first[of]) / (self.counts[of] - 1)
            return self.points[part], width[of] * (1 + (strands.tip[of] - 1) * along**3)

        return self._per_point(values)

    def _tangents(self) -> gl.Texture:
        first = self.strands.first
        return self._per_point(lambda part, of: (tangents(self.points, first, part, of), of))

    def _covers(self) -> gl.Texture:
        return self._per_point(lambda part, of: (self.strands.cover[part],), channels=1)

    def _normals(self) -> gl.Texture:
        return self._per_strand(self.normals, 0.0)

    def _colours(self) -> gl.Texture:
        return self._per_strand(self.strands.colour, self.strands.sheen)

    def _environments(self) -> gl.Texture:
        return self._per_strand(self.environment, self.strands.first[:-1])

    def rest(self) -> None:
        """Free what `fixed` has put on the graphics card, 40 bytes a point: it is made anew at
        need.
        """
        for texture in self._fixed.values():
            texture.delete()
        self._fixed = {}

    def light(
        self,
        context: gl.Context,
        programs: Callable[..., gl.Program],
        lamps: Lamps,
        surroundings: Surroundings,
    ) -> None:
        """Find what of each lamp's light reaches each point, by the lamps' maps: for all views.

        Kept as (optical depth of the strands before it, share that surfaces let past).
        """
        roots, free_mm = self.points[self.strands.first[:-1]], FREE_MM * self.size

        def lifted(part: slice, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            away = np.linalg.norm(self.points[part] - roots[of], axis=1) / free_mm
            return self.normals[of], np.exp(-away)

        fixed, lift = self.fixed("places", "tangents"), self._per_point(lifted)
        values = {**lamps.uniforms(), **surroundings.uniforms(), **fixed, "normals": lift}
        program = programs("passes/hair_lit.frag", {**lamps.defines(), **surroundings.defines()})
        count = max(1, len(lamps.lights))
        self._lit = gl.TextureArray(COLUMNS, self.rows, count, GL.GL_RG16F)
        smooth = programs("passes/hair_smooth.frag")
        size, formats = (COLUMNS, self.rows), [GL.GL_RG16F]
        with gl.Target(*size, formats) as raw, gl.Target(*size, formats) as target:
            along = {"raw": raw.textures[0], "tangents": fixed["tangents"]}
            for k in range(len(lamps.lights)):
                raw.bind()
                program.use(**program.accepts({**values, "lamp": k}))
                gl.draw_fullscreen(context)
                target.bind()
                smooth.use(**along)
                gl.draw_fullscreen(context)
                self._lit.copy_layer(k)
        lift.delete()

    def lit(self) -> np.ndarray:
        """What `light` found, to be kept: (lamps, rows, COLUMNS, 2) float16."""
        if self._lit is None:
            raise RuntimeError("hair is not lit yet; expected light() before lit()")
        return self._lit.bits()

    def set_lit(self, kept: np.ndarray) -> None:
        """Take what `lit` gave in `light`'s stead."""
        self._lit = gl.TextureArray(COLUMNS, self.rows, len(kept), GL.GL_RG16F)
        self._lit.set_bits(kept)

    def casting(self, least_mm: float) -> np.ndarray:
        """Points (M, 3) of the strands that are at least so wide."""
        wide = self.size * self.strands.width_mm >= least_mm
        return self.points[np.repeat(wide, self.counts)]

    def draw_shadows(self, program: gl.Program, values: dict, least_mm: float) -> None:
        """Ribbons that face a lamp; strands thinner than least_mm cast no shadow.

        values: what passes/hair.vert takes for a lamp, and its fragment shader.
        """
        fixed = self.fixed("places", "tangents")
        casts = self.size * self.strands.width_mm >= least_mm
        # of the scalp's hair every second strand stands for two
        many = (self.counts > LONG_POINTS) & (len(self.counts) > MANY)
        odd = np.arange(len(self.counts)) % 2 == 1
        for which, widened in ((casts & ~many, 1.0), (casts & many & odd, 2.0)):
            shared = {"minimum_px": MINIMUM_PX, "widened": widened}
            program.use(**program.accepts({**values, **fixed, **shared}))
            chosen = np.flatnonzero(which[self.of[self.pieces[:, 0]]])
            for start in range(0, len(chosen), CHUNK):
                _draw_and_free(self.pieces[chosen[start : start + CHUNK]])

    def shade(
        self,
        context: gl.Context,
        programs: Callable[..., gl.Program],
        lamps: Lamps,
        surroundings: Surroundings,
        shared: dict,
    ) -> gl.Target:
        """Radiance of every point towards the camera; the caller frees it."""
        defines = {**lamps.defines(), **surroundings.defines()}
        program = programs("passes/hair_shade.frag", defines)
        strands = self.strands
        values = {
            **shared,
            **lamps.uniforms(),
            **surroundings.uniforms(),
            **self.fixed(),
            "lit_map": self._lit,
            "extinction": EXTINCTION,
            "leaves": tuple(self.size * mm for mm in strands.leaves_mm),
            "tilt": float(np.radians(strands.tilt_deg)),
            "spread": float(np.radians(strands.spread_deg)),
            "index": strands.index,
        }
        target = gl.Target(COLUMNS, self.rows, [GL.GL_RGBA16F])
        target.bind()
        program.use(**program.accepts(values))
        gl.draw_fullscreen(context)
        return target

    def draw(
        self,
        context: gl.Context,
        programs: Callable[..., gl.Program],
        lamps: Lamps,
        surroundings: Surroundings,
        shared: dict,
        surface: gl.Target,
        depths: list[np.ndarray],
    ) -> None:
        """Blend all strands that can be seen over the specular light of a frame.

        shared: camera_position, view, projection; surface: the frame's buffers; depths: what
        `occlusion.blocks` makes of the view depths of surfaces.
        """
        matrix = shared["projection"] @ shared["view"]
        size = (surface.width, surface.height)
        found = []  # of chunks: what can be seen, and how far it is
        for start in range(0, len(self.pieces), CHUNK):
            pieces = self.pieces[start : start + CHUNK]
            half_mm = 0.5 * self.size * self.strands.width_mm[self.of[pieces[:, 0]]]
            points = self.points[pieces]
            bounds = (points, matrix, size, half_mm, 0.5 * MINIMUM_PX)
            seen = np.flatnonzero(~occlusion.hidden(depths, *bounds))
            away = points[seen, SEGMENTS // 2] - shared["camera_position"]
            found.append((start + seen, np.linalg.norm(away, axis=1)))
        seen, distance = (np.concatenate(each) for each in zip(*found, strict=True))
        if not len(seen):
            return
        order = seen[np.argsort(-distance, kind="stable")]  # far ones first: blended back to front
        with self.shade(context, programs, lamps, surroundings, shared) as shaded:
            surface.bind(depth_test=True, blend="over", only=1)
            program = programs("passes/hair.frag", {"LAMP": 0}, vertex="passes/hair.vert")
            values = {
                "matrix": matrix,
                "drawn_size": size,
                "minimum_px": MINIMUM_PX,
                "widened": 1.0,
                "radiances": shaded.textures[0],
                **self.fixed(),
            }
            program.use(**program.accepts(values))
            for start in range(0, len(order), CHUNK):
                _draw_and_free(self.pieces[order[start : start + CHUNK]])


def _draw_and_free(chosen: np.ndarray) -> None:
    """Draw pieces (K, SEGMENTS + 1) and wait: a software driver keeps what is still to be drawn,
    deleted or not.
    """
    mesh = gl.Mesh({}, ribbon_faces(chosen))
    mesh.draw()
    gl.finish()
    mesh.delete()


def tangents(points: np.ndarray, first: np.ndarray, part: slice, of: np.ndarray) -> np.ndarray:
    """Unit tangents (K, 3) at some of the points (N, 3) of polylines that begin at first[:-1]. of
    (K,): the polylines of these.
    """
    here = np.arange(part.start, part.stop)
    before, after = np.maximum(here - 1, first[of]), np.minimum(here + 1, first[of + 1] - 1)
    tangent = points[after] - points[before]
    return tangent / np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-6)


def pieces(first: np.ndarray) -> np.ndarray:
    """The strands cut into runs of SEGMENTS segments (K, SEGMENTS + 1): indices of points, the last
    one again where a strand ends.
    """
    segments = np.diff(first) - 1
    runs = -(-segments // SEGMENTS)
    of = np.repeat(np.arange(len(runs)), runs)
    number = np.arange(len(of)) - np.repeat(np.cumsum(runs) - runs, runs)
    start = first[:-1][of] + SEGMENTS * number
    ends = first[1:][of] - 1
    cut = np.empty((len(of), SEGMENTS + 1), np.uint32)
    for k in range(SEGMENTS + 1):
        cut[:, k] = np.minimum(start + k, ends)
    return cut


def ribbon_faces(chosen: np.ndarray) -> np.ndarray:
    """Triangles (2 K SEGMENTS, 3) of ribbons along pieces: vertex 2 k + side of point k."""
    base = 2 * chosen
    a, b = base[:, :-1].ravel(), base[:, 1:].ravel()
    real = a != b
    a, b = a[real], b[real]
    return np.stack([a, a + 1, b, a + 1, b + 1, b], axis=1).reshape(-1, 3)
