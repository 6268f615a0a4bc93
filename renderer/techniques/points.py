"""The base of techniques that gather light at points on the surface and splat it over the screen.

Shah, Konttinen and Pattanaik 2009, doi:10.1109/TVCG.2008.200; Rohat 2012, ch. 5: points where light
enters, each drawn as a square that covers all pixels to which its light can come; what every point
sends is added up. The base places and lights the points, expands and adds the squares; a technique
is its parameters and its `tables`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.optics import fits
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.passes.given import draw_given
from renderer.passes.surfaces import Drawn
from renderer.scene.harmonics import COSINE, project
from renderer.scene.maps import directions
from renderer.techniques.base import Inputs, Room, Scattered, Technique
from renderer.techniques.drawing import draw_kept, result
from renderer.techniques.samples import Body, Samples

TABLE = 512  # texels of a profile along the distance, 256 to 512 in Rohat 2012, sec. 5.1
FARTHEST_MM = 1e6  # a depth without an end
HARMONICS_MAP = 64  # rows of the map that is projected
#: What the points of one run add up: near light and their number, near light of light of 1, far
#: light.
SUMS = (GL.GL_RGBA32F, GL.GL_RGBA32F, GL.GL_RGBA32F)


@dataclass(frozen=True, eq=False)
class Tables:
    """What splats look up, over sqrt(r / reach_mm) and, row by row, over the object's thickness.

    near (D, TABLE, 3): the density of what leaves on the face on which light entered, normalised;
    near_total (D, 3): its integral; far (D, TABLE, 3): the density on the opposite face, not
    normalised. The last entries are 0. thickness_mm (D,): of the rows, rising. deep: far is looked
    up by the distance along the face, else by the distance itself. mixed: near and far by the angle
    between normals; else far only where normals are opposed.
    """

    reach_mm: float
    near: np.ndarray
    near_total: np.ndarray
    far: np.ndarray
    thickness_mm: np.ndarray
    deep: bool
    mixed: bool

    def rows(self, thickness_mm: np.ndarray) -> np.ndarray:
        """Where in the rows thicknesses (K,) lie: their coordinate in a texture."""
        at = np.interp(thickness_mm, self.thickness_mm, np.arange(len(self.thickness_mm)))
        return (at + 0.5) / len(self.thickness_mm)


def blurred(fit: fits.DipoleFit, blur_mm: np.ndarray) -> fits.DipoleFit:
    """A dipole whose sources lie deeper by blur_mm (C,): as much light, spread wider."""
    moved = (fit.real_mm + blur_mm, fit.virtual_mm + blur_mm)
    return fits.DipoleFit(*moved, fit.sigma_tr, fit.error)


def distances(reach_mm: float) -> np.ndarray:
    """The distances of a table's entries, mm: (TABLE,)."""
    return reach_mm * ((np.arange(TABLE) + 0.5) / TABLE) ** 2


@dataclass(frozen=True)
class PointsTechnique(Technique):
    """Splats of points. Override `tables`.

    samples "surface": points over the whole mesh by area, relaxed, lit by everything (Rohat 2012,
    ch. 5.3); "lights": a grid in the view of each lamp over what the object takes up of it, and
    such points for the environment alone (ch. 5.1). spacing_mm: a point stands for its square;
    grid: columns and rows of the grid, (0, 0) for as many as the spacing asks for; jitter: of its
    points about the middles of its cells.

    weights "normalised": what leaves on the face where it entered is divided by what would leave of
    light of 1, so that neither the number of points nor a silhouette changes the brightness;
    grids have no points where no light falls, so that there a point counts by its footprint.
    "published": the sum itself, times the area of a point; of a grid, the visible sides of the
    bounding box over the number of cells.

    The dipole is fitted to the medium's curve and normalised: the albedo is the surface's own.
    radius "area": a splat holds `share` of its light; "published": of the integral over r alone,
    which is less of the light (sec. 4.3). blur: near light is never nearer together than this share
    of the spacing, so that single points are not seen; 0: as the profile is. stays: what light
    stays within, an object or all objects of one medium. even "baked": the environment with
    occlusion and what surfaces send each other; "harmonics": nine coefficients of it by the normal,
    as in the document.
    """

    domain: ClassVar[str] = "points"

    samples: str = parameter(
        "surface", choices=("surface", "lights"), source="Rohat 2012, ch. 5.3 and 5.1"
    )
    spacing_mm: float = parameter(
        0.7,
        unit="mm",
        low=0.02,
        high=100.0,
        source="Jensen and Buhler 2002 ask for a mean free path; see docs/techniques.md",
    )
    grid: tuple[int, int] = parameter(
        (0, 0), unit="cells", low=0, high=4096, source="Rohat 2012, table 6.1: 75 x 52; 0: spacing"
    )
    jitter: float = parameter(
        0.0,
        unit="of a cell",
        low=0.0,
        high=1.0,
        source="Rohat 2012, sec. 5.2.2: the middle, or near",
    )
    relaxation: int = parameter(
        10, unit="rounds", low=0, high=500, source="Turk 1991; Rohat 2012, table 5.4: 10 to 100"
    )
    weights: str = parameter(
        "normalised", choices=("normalised", "published"), source="Rohat 2012, eq. 4.6: the sum"
    )
    share: float = parameter(
        0.99, unit="of the light", low=0.5, high=0.9999, source="Rohat 2012, sec. 4.3"
    )
    radius: str = parameter(
        "area", choices=("area", "published"), source="Rohat 2012, sec. 4.3: over r alone"
    )
    blur: float = parameter(0.7, unit="of the spacing", low=0.0, high=4.0, source="by eye")
    stays: str = parameter(
        "object", choices=("object", "medium"), source="Rohat 2012, sec. 5.1.4: ids"
    )
    even: str = parameter(
        "baked", choices=("baked", "harmonics"), source="Rohat 2012, sec. 5.3.1: nine coefficients"
    )
    seed: int = parameter(0, low=0, high=2**31 - 1, source="of the points' places")

    #: Whether a point's depth is that along the light.
    depth_along_light: ClassVar[bool] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.grid[0] == 0) != (self.grid[1] == 0):
            raise InputError(
                f"{self.where('grid')} is {self.grid}; expected (0, 0), or columns and rows"
            )

    def tables(self, curve: Curve, medium: str | dict | None, spacing_mm: float) -> Tables:
        """What splats look up. medium: what the scene names it; None where only a curve is known.

        spacing_mm: between points, which `blur` is a share of.
        """
        raise NotImplementedError(f"{self.name} has no tables")

    def blur_mm(self, curve: Curve, spacing_mm: float) -> np.ndarray:
        """How much deeper sources lie so that single points are not seen, mm: (C,)."""
        return np.maximum(self.blur * spacing_mm - fits.dipole(curve).real_mm, 0)

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        return blurred(fits.dipole(curve), self.blur_mm(curve, self.spacing_mm)).edge(x_mm)

    def reach_mm(self, curve: Curve, spacing_mm: float | None = None) -> float:
        """The radius of a splat, mm, of points of a spacing; by default the technique's own."""
        fit = blurred(fits.dipole(curve), self.blur_mm(curve, spacing_mm or self.spacing_mm))
        if self.radius == "area":
            return float(fit.radius(self.share).max())
        r = np.geomspace(1e-3, fit.radius(0.9999).max(), 4000)
        inside = np.cumsum(fit.density(r) * np.gradient(r)[:, None], axis=0)
        inside /= inside[-1]
        return max(float(np.interp(self.share, inside[:, c], r)) for c in range(inside.shape[1]))

    def clipped(self, curve: Curve) -> np.ndarray:
        """The share of the light that leaves beyond a splat's radius: (C,)."""
        fit = blurred(fits.dipole(curve), self.blur_mm(curve, self.spacing_mm))
        return 1 - fit.cdf(np.array([self.reach_mm(curve)]))[0]

    def scatter(self, inputs: Inputs) -> Scattered:
        room = inputs.needed_room(self.name)
        size = (inputs.width, inputs.height)
        with result(inputs) as target:
            with (
                gl.Target(*size, [GL.GL_R32F], depth=room.depth()) as kept,
                gl.Target(*size, list(SUMS)) as sums,
            ):
                draw_kept(inputs, room, room.surfaces, kept)
                sums.bind(clear=(0.0, 0.0, 0.0, 0.0))
                for parts in self._bodies(room):
                    self._one(inputs, room, parts, sums)
                target.bind()
                inputs.programs("techniques/splat_sum.glsl").use(
                    near=sums.textures[0],
                    arrived=sums.textures[1],
                    far=sums.textures[2],
                    irradiance=inputs.irradiance,
                    kept=kept.textures[0],
                    normalised=int(self.weights == "normalised" and self.samples == "surface"),
                )
                gl.draw_fullscreen(inputs.context)
        return Scattered(target)

    def _bodies(self, room: Room) -> list[tuple[Drawn, ...]]:
        """The surfaces between which light travels, group by group."""
        if self.stays == "medium":
            return [room.surfaces] if room.surfaces else []
        meshes = dict.fromkeys(drawn.item.mesh for drawn in room.surfaces)
        return [tuple(d for d in room.surfaces if d.item.mesh == mesh) for mesh in meshes]

    def _samples(self, room: Room, body: Body) -> Iterator[tuple[Samples, str | int]]:
        """Points with the light that they get: "all", "environment", or that of one lamp."""
        over = (self.spacing_mm, self.relaxation, self.name)
        if self.samples == "surface":
            yield body.over_surface(*over), "all"
            return
        for k, light in enumerate(room.lights):
            options = (self.weights == "published", self.depth_along_light, self.name)
            seen = body.from_lamp(light, self.spacing_mm, self.grid, self.jitter, *options)
            if seen is not None:
                yield seen, k
        dark = not room.surroundings.mean().any()
        if self.even == "baked":  # what surfaces send each other too
            dark = not any(drawn.baked.light.any() for drawn in body.parts)
        if not dark:
            yield body.over_surface(*over), "environment"

    def _one(self, inputs: Inputs, room: Room, parts: tuple[Drawn, ...], sums: gl.Target) -> None:
        """Add one body's points to the sums."""
        body = Body(parts, self.seed)
        with gl.Target(inputs.width, inputs.height, [GL.GL_RGBA32F], depth=room.depth()) as seen:
            seen.bind(clear=(0.0, 0.0, 0.0, 0.0))
            seen.bind(depth_test=True)
            GL.glDepthMask(False)
            program = inputs.programs(
                "techniques/splat_seen.frag", {"DOMAIN": "SCREEN"}, vertex="passes/surface.vert"
            )
            for drawn in parts:
                own = {"depths": inputs.depths, "irradiance": inputs.irradiance}
                own |= {**room.camera, "model": drawn.item.pose}
                program.use(**program.accepts(own))
                drawn.mesh.draw()
            for samples, light in self._samples(room, body):
                tables = self.tables(inputs.curve, room.value, samples.spacing_mm)
                with _Textures(tables) as textures:
                    for k, drawn in enumerate(parts):
                        own = np.flatnonzero(samples.part == k)
                        if len(own):
                            self._splat(
                                inputs, room, drawn, samples, own, light, textures, seen, sums
                            )

    def _splat(
        self,
        inputs: Inputs,
        room: Room,
        drawn: Drawn,
        samples: Samples,
        own: np.ndarray,
        light: str | int,
        textures: _Textures,
        seen: gl.Target,
        sums: gl.Target,
    ) -> None:
        """Add the points of one surface, of those that are `own`."""
        tables = textures.tables
        points = room.points(drawn, samples.triangles[own], samples.weights[own])
        even = self.even == "harmonics" and light in ("all", "environment")
        placed = room.placed(
            drawn,
            "POINTS",
            points.size,
            points,
            samples.spacing_mm,
            only_irradiance=self.transmission is None,
            light="lamps" if even and light == "all" else "none" if even else light,
        )
        last, depth = tables.thickness_mm[-1], np.minimum(samples.depth_mm[own], FARTHEST_MM)
        deep = np.minimum(self.thickness_scale * depth, last)
        # what lies in between does not count; farther than the table goes nothing comes through
        inside = (
            np.where(self.thickness_scale * depth < last, depth, 0) if tables.deep else 0 * depth
        )
        columns = (samples.area_mm2[own], inside, tables.rows(deep), np.zeros(len(own)))
        data = np.zeros((points.size[0] * points.size[1], 4), np.float32)
        data[: len(own)] = np.column_stack(columns)
        about = gl.Texture(
            *points.size, GL.GL_RGBA32F, data=data.reshape(points.size[1], points.size[0], 4)
        )
        try:
            irradiance, _, albedo, normals, transmitted, places = placed.textures
            with gl.Target(*points.size, [GL.GL_RGBA32F]) as lit, _Even(inputs, points.size) as sky:
                if even:
                    irradiance = sky.added(irradiance, normals, room)
                from_scene = (irradiance, transmitted, albedo, room.medium, self.texturing)
                draw_given(inputs.context, inputs.programs, lit, *from_scene)
                sums.bind(blend="add")
                program = inputs.programs(
                    "techniques/splat.frag",
                    vertex="techniques/splat.vert",
                    geometry="techniques/splat.geom",
                )
                program.use(
                    light=lit.textures[0],
                    places=places,
                    normals=normals,
                    about=about,
                    depths=inputs.depths,
                    seen=seen.textures[0],
                    near_table=textures.near,
                    far_table=textures.far,
                    near_total=textures.total,
                    mixed=float(tables.mixed),
                    view=room.camera["view"],
                    projection=room.camera["projection"],
                    reach_mm=tables.reach_mm,
                )
                points.draw()
        finally:
            placed.delete()
            points.delete()
            about.delete()


class _Textures:
    """Tables on the graphics card; use it as a context manager."""

    def __init__(self, tables: Tables):
        self.tables = tables

        def texture(values: np.ndarray) -> gl.Texture:
            height, width = values.shape[:2]
            data = np.ones((height, width, 4), np.float32)
            data[..., :3] = values
            return gl.Texture(width, height, GL.GL_RGBA32F, linear=True, data=data)

        self.near, self.far = texture(tables.near), texture(tables.far)
        self.total = texture(tables.near_total[:, None])

    def __enter__(self) -> _Textures:
        return self

    def __exit__(self, *_) -> None:
        for each in (self.near, self.far, self.total):
            each.delete()


class _Even:
    """The environment's light by nine coefficients, added to what lamps give points."""

    def __init__(self, inputs: Inputs, size: tuple[int, int]):
        self._inputs, self._size = inputs, size
        self._target: gl.Target | None = None

    def added(self, irradiance: gl.Texture, normals: gl.Texture, room: Room) -> gl.Texture:
        towards = directions(HARMONICS_MAP)
        radiance = room.surroundings.radiance(towards.reshape(-1, 3), 4096.0)
        coefficients = project(radiance.reshape(*towards.shape[:2], 3)) * COSINE[:, None]
        self._target = gl.Target(*self._size, [GL.GL_RGBA32F])
        self._target.bind()
        self._inputs.programs("techniques/splat_even.glsl").use(
            irradiance=irradiance, normals=normals, coefficients=coefficients
        )
        gl.draw_fullscreen(self._inputs.context)
        return self._target.textures[0]

    def __enter__(self) -> _Even:
        return self

    def __exit__(self, *_) -> None:
        if self._target is not None:
            self._target.delete()
