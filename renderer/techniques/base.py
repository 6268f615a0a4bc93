"""What every technique is: frozen, checked parameters and one pure pass, light in, light out."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics.curve import Curve, edge_error
from renderer.optics.surface import DIFFUSE
from renderer.optics.transmittance import EXPONENTS, MODELS, THICKNESS, Translucency
from renderer.parameters import Parameters, parameter

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from renderer import gl
    from renderer.passes.environment import Surroundings
    from renderer.passes.lamps import Lamps
    from renderer.passes.points import Points
    from renderer.passes.surfaces import Drawn
    from renderer.scene.lights import Light
    from renderer.techniques.cover import Cover


@dataclass(frozen=True)
class Inputs:
    """The shared buffers, all (height, width) at the resolution at which scattering is computed.

    They hold the whole image, or a piece of it if the technique says how far it reaches
    (`support_mm`): the rows from first_row on, counted from below, of image_height.

    irradiance: RGBA32F, rgb = E, alpha = 1 where the medium at hand scatters. depths: R32F, view
    depth in mm (0 where nothing is). pixels_per_mm: pixels of this resolution per mm at 1 mm
    distance. supersample: pixels of this resolution per output pixel, along one side. curve: the
    medium's reference curve. room: the surfaces of the medium themselves, for techniques that work
    over another domain than the screen. executor: for work that does not draw, None: this process.
    cover: where anything scatters, None: anywhere.
    """

    context: object
    programs: object
    irradiance: object
    depths: object
    width: int
    height: int
    pixels_per_mm: float
    supersample: int
    curve: Curve
    room: Room | None = None
    first_row: int = 0
    image_height: int = 0
    executor: Executor | None = None
    cover: Cover | None = None

    @property
    def image_size(self) -> tuple[int, int]:
        """(width, height) of the whole image, px."""
        return self.width, self.image_height or self.height

    def needed_room(self, technique: str) -> Room:
        """The room, for techniques that work over another domain than the screen."""
        if self.room is None:
            raise ValueError(f"{technique} needs surfaces, not a picture of them alone")
        return self.room


@dataclass(frozen=True)
class Room:
    """Where a medium's surfaces are, and their light over their atlases or at points on them.

    surfaces: those of the medium at hand; medium: its id; value: what the scene names it.
    placed(drawn, domain, size, points, point_mm): a surface's light over "ATLAS" or "POINTS", see
    Renderer.placed. points(drawn, faces, weights): points on it. camera: the uniforms
    camera_position, view and projection; depth(): the target whose depth buffer holds what is seen;
    lamps(): with the layers of their maps; both are drawn when they are first asked for, which has
    to be before a target is bound; lights: the lamps as values; surroundings: the environment;
    bodies: all surfaces and eyes of the scene; flesh(drawn): the uniforms of passes/lids.glsl.
    """

    surfaces: tuple[Drawn, ...]
    medium: int
    placed: Callable[..., gl.Target]
    points: Callable[..., Points]
    camera: dict[str, Any]
    depth: Callable[[], gl.Target]
    lamps: Callable[[], Lamps]
    lights: Sequence[Light]
    value: str | dict | None
    surroundings: Surroundings
    bodies: tuple[Drawn, ...]
    flesh: Callable[[Drawn], dict[str, Any]]


@dataclass(frozen=True)
class Scattered:
    """What a technique returns.

    target.textures[0]: RGBA32F scattered irradiance; [1]: RG16F, x = samples taken, y = contrast
    (where it is measured).
    """

    target: gl.Target


@dataclass(frozen=True)
class Technique(Parameters):
    """Base of all techniques.

    translucency: the transmittance of thin parts by which light that comes through them is reckoned
    (renderer.optics.transmittance); it is added before scattering (Jimenez et al. 2010).
    translucency_exponent, translucency_thickness, translucency_wrap and thickness_scale are its
    details. texturing: the
    share of the albedo's exponent that is applied before scattering: 0 post-scatter, 1 pre-scatter,
    0.5 both; each technique's default is its authors'. diffuse: how light passes the rough face on
    its way in and out. `measures_contrast`: it writes contrast. Kernels are fitted to the medium's
    curve: `edge` is what the kernel for a curve answers to a straight edge, and `fit_error` how far
    that is from the curve's own answer.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    paper: ClassVar[str]
    translucency: str = parameter(
        "slab",
        choices=MODELS,
        source="Monte Carlo of slabs of the medium; Jimenez et al. 2010, Burley 2015, Donner and "
        "Jensen 2005, Green 2004",
    )
    translucency_exponent: str = parameter(
        "exact", choices=EXPONENTS, source="Jimenez et al. 2010, eq. 3: published, exp(-s^2 / v)"
    )
    translucency_thickness: str = parameter(
        "corrected",
        choices=THICKNESS,
        source="d'Eon and Luebke 2007, sec. 14.5.3; along: Jimenez et al. 2010",
    )
    translucency_wrap: float = parameter(
        0.0,
        unit="added to the cosine",
        low=0.0,
        high=1.0,
        source="0 is exact; 0.3 in the shader of Jimenez et al. 2010",
    )
    thickness_scale: float = parameter(
        1.0,
        unit="mm of the medium per mm of thickness in a depth map",
        low=0.0,
        high=100.0,
        source="1 is exact for a flat part",
    )
    texturing: float = parameter(
        0.0,
        unit="of the albedo's exponent before scattering",
        low=0.0,
        high=1.0,
        source="d'Eon and Luebke 2007, sec. 14.4.5: post (0), pre (1), or both (0.5)",
    )
    diffuse: str = parameter(
        "lambert",
        choices=DIFFUSE,
        source="how light passes the face, renderer/optics/surface.py: Lambert for all",
    )

    measures_contrast: ClassVar[bool] = False
    #: What it filters: the picture ("screen"), texture atlases ("atlas"), points ("points").
    domain: ClassVar[str] = "screen"

    @property
    def transmission(self) -> Translucency | None:
        """What light through thin parts the passes are asked for; None for none."""
        if self.translucency not in MODELS or self.translucency == "none":
            return None
        details = (self.translucency_exponent, self.translucency_wrap, self.thickness_scale)
        return Translucency(self.translucency, *details, self.translucency_thickness)

    @classmethod
    def where(cls, field: str) -> str:
        return f"{cls.name}.{field}"

    def parameters(self) -> dict[str, Any]:
        """The parameters as plain values, for the manifest."""
        return self.plain()

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        """The kernel's own answer to a straight edge, light where x < 0: (N,) mm -> (N, C)."""
        raise NotImplementedError(f"{self.name} has no kernel")

    def fit_error(self, curve: Curve) -> np.ndarray:
        """rms at a straight edge between the technique's kernel and the curve: (C,)."""
        return edge_error(curve, lambda x: self.edge(curve, x))

    def self_check(self, curve: Curve) -> None:
        """Raise AssertionError if the kernel for a curve is not what the paper says."""

    def support_mm(self, curve: Curve) -> float | None:
        """How far from a point its light comes from at most; None: from anywhere.

        A filter of the screen that knows is given the image in pieces, which takes less memory; its
        shader takes places in the image from shaders/screen.glsl.
        """
        return None

    @property
    def specular_white(self) -> float | None:
        """The luminance of scattered light, over that of the strongest lamp, that leaves highlights
        as they are; less dims them. None: highlights are their own.
        """
        return None

    def scatter(self, inputs: Inputs) -> Scattered:
        """Run the technique."""
        raise NotImplementedError(f"{self.name} has no pass")


def odd(where: str, value: int) -> None:
    """InputError unless the value is odd."""
    if value % 2 == 0:
        raise InputError(f"{where} is {value}; expected an odd number")
