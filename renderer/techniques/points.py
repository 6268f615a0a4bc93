"""The base of techniques that gather light at points on the surface and splat it over the screen.

Shah, Konttinen and Pattanaik 2009, doi:10.1109/TVCG.2008.200; Rohat 2012, ch. 5.3: points spread
over the mesh by area, lit by the scene, each drawn as a square that covers all pixels to which its
light can come; what every point sends is added up. The base spreads and lights the points, expands
and adds the squares; a technique is its parameters and `profile`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.passes.given import draw_given
from renderer.passes.surfaces import Drawn
from renderer.scene.shapes import points_on, triangle_areas
from renderer.techniques.base import Inputs, Room, Scattered, Technique
from renderer.techniques.drawing import result

MOST_POINTS = 4_000_000
TABLE = 512  # texels of a profile, 256 to 512 in Rohat 2012, sec. 5.1


def spread(
    areas: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (count,) and barycentric weights (count, 3) of points that each stand for the same
    area: one in every stratum of the running sum of the triangles' areas (M,) (Rohat 2012, sec.
    5.3.2).
    """
    return points_on(areas, (np.arange(count) + rng.random(count)) / count, rng)


@dataclass(frozen=True)
class PointsTechnique(Technique):
    """Splats of points. Override `profile`.

    spacing_mm: a point stands for its square. weights "normalised": what arrives is divided by what
    would arrive of light of 1, so that neither the number of points nor a silhouette changes the
    brightness; "published": the sum itself, times the area of a point. share: of the profile's
    light that lies within a splat's radius. blur: the profile's light is never nearer together than
    this share of the spacing, so that single points are not seen; 0: as the profile is.
    """

    domain: ClassVar[str] = "points"

    spacing_mm: float = parameter(
        0.7,
        unit="mm",
        low=0.02,
        high=100.0,
        source="Jensen and Buhler 2002 ask for a mean free path; see docs/techniques.md",
    )
    weights: str = parameter(
        "normalised", choices=("normalised", "published"), source="Rohat 2012, eq. 4.4: the sum"
    )
    share: float = parameter(
        0.99, unit="of the light", low=0.5, high=0.9999, source="Rohat 2012, sec. 4.3"
    )
    blur: float = parameter(0.7, unit="of the spacing", low=0.0, high=4.0, source="by eye")
    seed: int = parameter(0, low=0, high=2**31 - 1, source="of the points' places")

    def profile(self, curve: Curve, r_mm: np.ndarray) -> np.ndarray:
        """Share of the light that leaves per mm2 at a distance: (N,) -> (N, C)."""
        raise NotImplementedError(f"{self.name} has no profile")

    def reach_mm(self, curve: Curve) -> float:
        """The radius of a splat, mm."""
        raise NotImplementedError(f"{self.name} has no reach")

    def table(self, curve: Curve) -> np.ndarray:
        """The profile over sqrt(r / reach), (TABLE, 3), its last entry 0."""
        where = (np.arange(TABLE) + 0.5) / TABLE
        values = self.profile(curve, self.reach_mm(curve) * where**2)
        values[-1] = 0
        return values

    def scatter(self, inputs: Inputs) -> Scattered:
        room = inputs.needed_room(self.name)
        both = [GL.GL_RGBA32F, GL.GL_RGBA32F]
        table = np.ones((1, TABLE, 4), np.float32)
        table[0, :, :3] = self.table(inputs.curve)
        profile = gl.Texture(TABLE, 1, GL.GL_RGBA32F, linear=True, data=table)
        try:
            with (
                result(inputs) as target,
                gl.Target(inputs.width, inputs.height, both) as sums,
            ):
                sums.bind(clear=(0.0, 0.0, 0.0, 0.0))
                for drawn in room.surfaces:
                    self._splat(inputs, room, drawn, profile, sums)
                target.bind()
                inputs.programs("techniques/splat_sum.glsl").use(
                    sent=sums.textures[0],
                    arrived=sums.textures[1],
                    irradiance=inputs.irradiance,
                    normalised=int(self.weights == "normalised"),
                )
                gl.draw_fullscreen(inputs.context)
        finally:
            profile.delete()
        return Scattered(target)

    def _splat(
        self, inputs: Inputs, room: Room, drawn: Drawn, profile: gl.Texture, sums: gl.Target
    ) -> None:
        """Add one surface's points to the sums."""
        part = drawn.item.primitive
        areas = triangle_areas(drawn.item.in_world(part.positions), part.faces)
        area = areas.sum()
        count = max(1, round(area / self.spacing_mm**2))
        if count > MOST_POINTS:
            raise InputError(
                f"{self.name}.spacing_mm is {self.spacing_mm:g}, {count} points on {area:.0f} mm2; "
                f"expected at most {MOST_POINTS} points"
            )
        rng = np.random.default_rng([self.seed, drawn.item.mesh])
        points = room.points(drawn, *spread(areas, count, rng))
        size = points.size
        placed = room.placed(drawn, "POINTS", size, points, self.spacing_mm)
        try:
            irradiance, _, albedo, _, transmitted, places = placed.textures
            with gl.Target(*size, [GL.GL_RGBA32F]) as light:
                from_scene = (irradiance, transmitted, albedo, room.medium)
                draw_given(
                    inputs.context,
                    inputs.programs,
                    light,
                    *from_scene,
                    self.texturing,
                )
                sums.bind(blend="add")
                reach = self.reach_mm(inputs.curve)
                program = inputs.programs(
                    "techniques/splat.frag",
                    vertex="techniques/splat.vert",
                    geometry="techniques/splat.geom",
                )
                program.use(
                    light=light.textures[0],
                    places=places,
                    depths=inputs.depths,
                    irradiance=inputs.irradiance,
                    profile=profile,
                    view=room.camera["view"],
                    projection=room.camera["projection"],
                    reach_mm=reach,
                    area=area / count,
                )
                points.draw()
        finally:
            placed.delete()
            points.delete()
