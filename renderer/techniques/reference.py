"""The truth that techniques are held to: random walks through the medium itself.

From each pixel's point on the surface light is walked back through the mesh, scattered and absorbed
by the medium's coefficients, to where it entered; what falls in there is the irradiance that every
technique is given, drawn at that very point by the same shading. So it differs from a technique by
the transport alone. No term is left out and none is approximated but by noise, which is independent
between the two halves of the walks (`halves`), so that errors can be stated without it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from renderer import gl
from renderer.errors import InputError
from renderer.gl import GL
from renderer.optics import media
from renderer.optics.curve import Curve
from renderer.optics.medium import Stack
from renderer.parameters import parameter
from renderer.passes.surfaces import Drawn
from renderer.techniques.base import Inputs, Room, Scattered, Technique
from renderer.techniques.drawing import result

if TYPE_CHECKING:
    from renderer.reference.estimate import Halves, Walked
    from renderer.reference.walk import Part, Solid

NEAR_MM = 0.5  # a ray towards a pixel's point starts so far before it


@dataclass(frozen=True)
class Reference(Technique):
    """Walks a pixel and channel, at the resolution at which scattering is computed: with 2 x 2
    samples an output pixel has four times as many. Light comes through thin parts by walking.
    With pool_mm above 0 the picture is a denoised one, with less noise and a small bias.

    light "given": the irradiance that every technique is given, which isolates the transport;
    "traced": rays and walks from the lamps and the surroundings on (renderer.reference.traced), so
    many of them as there are walks, wherever they end. index: of refraction of the medium over that
    outside; above 1 the face is a smooth dielectric; 0: the medium's own, 1 for what is inverted.
    """

    walks: int = parameter(
        64, unit="a computed pixel", low=2, high=4096, source="noise falls as 1 / sqrt(walks)"
    )
    seed: int = parameter(0, low=0, high=2**31 - 1, source="of the walks")
    light: str = parameter(
        "given", choices=("given", "traced"), source="given: transport alone is judged"
    )
    index: float = parameter(
        0.0, unit="within over outside (0: the medium's)", low=0.0, high=3.0, source="1.4: skin"
    )
    pool_mm: float = parameter(
        0.0,
        unit="mm (0: no bias)",
        low=0.0,
        high=20.0,
        source="denoised: what even light gives is averaged over so much, docs/reference.md",
    )
    translucency: str = parameter(
        "none", choices=("none",), source="walks go through thin parts: nothing is to be added"
    )

    domain: ClassVar[str] = "walks"
    name: ClassVar[str] = "reference"
    title: ClassVar[str] = "Reference"
    paper: ClassVar[str] = "Wang et al. 1995, doi:10.1016/0169-2607(95)01640-F, in a mesh"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.walks % 2:
            raise InputError(f"reference.walks is {self.walks}; expected an even number")
        if 0 < self.index < 1:
            raise InputError(f"reference.index is {self.index}; expected 0, or 1 or more")
        if self.light == "traced" and self.pool_mm:
            raise InputError(
                f"reference.pool_mm is {self.pool_mm}; expected 0 where light is traced"
            )

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        """That of the medium that is walked in for a preset's curve; for others the curve's own."""
        from renderer.reference.estimate import walked

        if curve.name not in media.names():
            return curve.edge(x_mm)
        made = walked(curve.name, self.index)
        if not made.residual.any():
            return curve.edge(x_mm)
        return media.simulated(Stack.of(made.medium)).edge(x_mm)

    def scatter(self, inputs: Inputs) -> Scattered:
        where = inputs.irradiance.read()[..., 3] > 0.5
        scattered = np.zeros((inputs.height, inputs.width, 4), np.float32)
        scattered[where, :3] = self.halves(inputs, where).mean
        texture = gl.Texture(inputs.width, inputs.height, GL.GL_RGBA32F, data=scattered[::-1])
        try:
            with result(inputs) as target:
                target.bind()
                inputs.programs("techniques/reference.glsl").use(
                    irradiance=inputs.irradiance, walked=texture, walks=float(self.walks)
                )
                gl.draw_fullscreen(inputs.context)
        finally:
            texture.delete()
        return Scattered(target)

    def halves(self, inputs: Inputs, where: np.ndarray) -> Halves:
        """Scattered irradiance at the pixels `where` (H, W), row 0 at the top, in their order."""
        from renderer.reference.estimate import Halves, estimate
        from renderer.reference.walk import Solid

        room = inputs.needed_room(self.name)
        solid = Solid([part_of(drawn) for drawn in room.surfaces])
        medium = medium_of(room, self.index)
        if medium.medium.channels != 3:
            raise InputError(f"the medium has {medium.medium.channels} channels; expected 3")
        if self.light == "traced":
            return self._traced(inputs, where, solid, medium)
        depths = inputs.depths.read()[..., 0]
        points, normals, seen = visible(solid, room.camera, depths, where)
        own = inputs.irradiance.read()[where][:, :3]
        # the size of a pixel on the surface: relief as fine as the picture's
        point_mm = float(np.median(depths[depths > 0])) / inputs.pixels_per_mm
        halves = estimate(
            solid,
            medium,
            points[seen],
            normals[seen],
            np.flatnonzero(where)[seen],
            lambda triangles, weights: self._light(room, solid, triangles, weights, point_mm),
            self.walks,
            self.seed,
            executor=inputs.executor,
        )
        if self.pool_mm:
            halves = halves.pooled(points[seen], own[seen], self.pool_mm)
        values = np.repeat(own[None].astype(float), 2, axis=0)
        carried = np.ones_like(values)
        values[:, seen], carried[:, seen] = halves.values, halves.carried
        return Halves(values, carried, halves.walks)

    def _traced(self, inputs: Inputs, where: np.ndarray, solid: Solid, medium: Walked) -> Halves:
        """By light that is traced from where it comes from."""
        from renderer.reference import traced

        room = inputs.needed_room(self.name)
        point_mm = float(np.ptp(solid.corners)) / 1000

        def tint(triangles, weights, channel):
            _, albedo = self._at(room, solid, triangles, weights, point_mm)
            return albedo[:, channel]

        parts = [part_of(drawn) for drawn in room.surfaces]
        own = {id(drawn) for drawn in room.surfaces}
        others = [part_of(drawn) for drawn in room.bodies if id(drawn) not in own]
        scene = traced.World.of(parts, others, room.lights, room.surroundings.radiance, tint)
        eye = traced.Eye.of(room.camera, where, inputs.pixels_per_mm, scene)
        photons = self.walks // 2 * int(where.sum())
        walks = {"executor": inputs.executor}
        return traced.trace(scene, medium, eye, photons, self.seed, **walks)

    def _light(
        self, room: Room, solid: Solid, triangles: np.ndarray, weights: np.ndarray, point_mm: float
    ) -> np.ndarray:
        """The irradiance (K, 3) that the scene gives at points of a solid's triangles, as
        texturing has it."""
        light, own = self._at(room, solid, triangles, weights, point_mm)
        return light * np.maximum(own, 1e-6) ** self.texturing if self.texturing else light

    def _at(
        self, room: Room, solid: Solid, triangles: np.ndarray, weights: np.ndarray, point_mm: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance (K, 3) where the medium is, else 0, and albedo (K, 3) there."""
        light, own = np.zeros((len(triangles), 3)), np.zeros((len(triangles), 3))
        owner = np.searchsorted(solid.starts, triangles, side="right") - 1
        for k, drawn in enumerate(room.surfaces):
            mine = np.flatnonzero(owner == k)
            if not mine.size:
                continue
            points = room.points(drawn, triangles[mine] - solid.starts[k], weights[mine])
            placed = room.placed(
                drawn, "POINTS", points.size, points, point_mm, only_irradiance=True
            )
            try:
                e, _, albedo, *_ = placed.textures
                given = _listed(e, len(mine))
                light[mine] = given[:, :3] * (np.abs(given[:, 3:] - room.medium) < 0.5)
                own[mine] = _listed(albedo, len(mine))[:, :3]
            finally:
                placed.delete()
                points.delete()
        return light, own


def medium_of(room: Room, index: float = 0.0) -> Walked:
    """The medium that is walked in for a room's; index: see `walked`."""
    from renderer.reference.estimate import walked

    return walked(room.surfaces[0].item.primitive.material.value.layered(), index)


def visible(
    solid: Solid, camera: dict, depths: np.ndarray, where: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (N, 3) mm on a solid that the pixels `where` (H, W) show, the outward normals of
    their triangles (N, 3), and which were met (N,): not those whose surface is seen from within.

    camera: camera_position, view, projection; depths (H, W): along the view, mm, row 0 at the top.
    """
    height, width = depths.shape
    rows, columns = np.nonzero(where)
    plane = np.column_stack([(columns + 0.5) / width * 2 - 1, 1 - (rows + 0.5) / height * 2])
    turn, lens = np.asarray(camera["view"])[:3, :3].T, np.asarray(camera["projection"])
    ahead = (plane + lens[:2, 2]) / lens[[0, 1], [0, 1]]
    rays = np.column_stack([ahead, -np.ones(len(plane))]) @ turn.T
    # single precision holds a short ray better than one from the eye
    place = np.asarray(camera["camera_position"], float) + rays * depths[where][:, None]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    triangle, far, _, _ = solid.hits(place - NEAR_MM * rays - solid.middle, rays, 2 * NEAR_MM)
    normals = solid.normals[triangle]
    seen = (triangle >= 0) & (np.einsum("ni,ni->n", normals, rays) < 0)
    return place + rays * (far.astype(float) - NEAR_MM)[:, None], normals, seen


def part_of(drawn: Drawn) -> Part:
    """A surface's triangles in the world, as walks take them."""
    from renderer.reference.walk import Part

    part = drawn.item.primitive
    return Part(drawn.item.in_world(part.positions), part.faces)


def _listed(texture: gl.Texture, count: int) -> np.ndarray:
    """The texels of points, in their order: (count, 4)."""
    return texture.read()[::-1].reshape(-1, 4)[:count].astype(float)
