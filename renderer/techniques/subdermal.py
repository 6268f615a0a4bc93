"""Our own: a pixel and a few fitted rings, means where the surface is whole, counts by tile.

It stands on four things that are known, put together. Taps are means over the part of the disc that
they stand for, read from a pyramid (Krivanek and Colbert 2008, "Real-time shading with filtered
importance sampling", doi:10.1111/j.1467-8659.2008.01252.x), but only where a guard says that no
step of depth and nothing that is not skin is in them. Their radii and weights are fitted to the
profile (renderer/optics/rings.py), a pixel's own light being the first. The pixels of a block share
a rotation and turn by even parts of it, so that a ring is met at even angles and what is linear in
its light cancels; those that face each other have the same radii and every pair its own where
rings are larger than a pixel, so that a block has more of them. How many taps a pixel takes is
decided for tiles of 8 x 8 pixels, from their means, before any tap is taken: no tap both decides
and estimates. docs/subdermal.md has what each part is worth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from renderer import gl
from renderer.gl import GL
from renderer.optics import burley, fits, rings
from renderer.optics.curve import Curve
from renderer.parameters import parameter
from renderer.techniques.base import Inputs
from renderer.techniques.cover import Window
from renderer.techniques.golubev import BurleyFilter
from renderer.techniques.rotated import GOLDEN
from renderer.techniques.screen import Canvas

#: Rings, and taps on each of them, of the sets that a tile chooses among: 1 + rings x taps in all.
SETS = ((2, 1), (3, 1), (4, 1), (5, 1), (6, 1), (4, 2), (5, 2), (5, 3), (5, 4), (6, 5))
COUNTS = tuple(1 + rings * taps for rings, taps in SETS)
TILE = 8  # pixels
LARGEST = 2.0  # widest distances: pixels that are larger ask for no more taps
LEVELS = 6  # of the pyramid: means over 64 x 64 pixels
PAD = 1 << LEVELS  # so that every mean is one of whole pixels
RUNG = 1.3  # between the sizes of a pixel for which sets are fitted
#: Taps of a ring are means over texels whose side falls with their number to this power.
NARROWER = 0.5
#: fewest, by_spread, by_unguarded of `preset`: golubev's error with 22 samples over the skin of the
#: thesis's scene; less than two thirds of it (docs/subdermal.md, where other media are too).
PRESETS = {"equal_error": (3.0, 4.0, 55.0), "safe": (6.0, 18.0, 100.0)}
LEAST = 1e-30  # of a profile: what lies farther out has no weight that floats can hold


@dataclass(frozen=True)
class Subdermal(BurleyFilter):
    """n = fewest + by_size p + by_spread s + by_unguarded sqrt(u) min(1, s / full_spread) / (1 + p)
    taps, of SETS'.

    p: a pixel's size over the widest distance, at most LARGEST: means of fewer pixels average less
    noise, and one that is refused takes less with it; s: relative spread of the irradiance of the
    widest channel about the tile; u: the share of skin there that the guard keeps from being
    averaged. Where a block is a single pixel n is `lone` times that, since none of its noise
    cancels. kernel "burley": rings are fitted to Burley's profile; "curve": to the medium's own
    curve, which few profiles of one parameter can be.
    """

    preset: str = parameter(
        "own", choices=("own", *PRESETS), source="own: the three numbers below; else PRESETS"
    )
    fewest: float = parameter(4.0, unit="taps", low=3.0, high=31.0, source="docs/subdermal.md")
    by_size: float = parameter(
        1.5,
        unit="taps, where a pixel is as large as the widest distance; twice at most",
        low=0.0,
        high=100.0,
        source="docs/subdermal.md",
    )
    by_spread: float = parameter(
        8.0, unit="taps, of a relative spread of 1", low=0.0, high=1e3, source="docs/subdermal.md"
    )
    by_unguarded: float = parameter(
        55.0, unit="taps, where all is unguarded", low=0.0, high=1e3, source="docs/subdermal.md"
    )
    full_spread: float = parameter(
        0.3, unit="relative spread", low=1e-6, high=10.0, source="docs/subdermal.md"
    )
    neighbourhood: float = parameter(
        2.2,
        unit="of the widest distance: sigma of the spread",
        low=0.0,
        high=20.0,
        source="1 mm of the six-Gaussian skin, docs/subdermal.md",
    )
    kernel: str = parameter(
        "burley", choices=("burley", "curve"), source="Golubev 2018; the medium's own"
    )
    texel: float = parameter(
        1.3, unit="of a tap's radius", low=0.0, high=4.0, source="docs/subdermal.md"
    )
    noise: float = parameter(
        0.005,
        unit="over the pixels of a block, see renderer.optics.rings.fit",
        low=0.0,
        high=1.0,
        source="docs/subdermal.md",
    )
    guard_px: float = parameter(
        3.0, unit="pixel widths that are a step of depth", low=0.0, high=1e6, source="Subdermal"
    )
    whole: float = parameter(
        0.85,
        unit="of a mean's pixels that the guard has to let in; large means ask for more",
        low=0.01,
        high=1.0,
        source="docs/subdermal.md",
    )
    sizes: int = parameter(
        2,
        unit="means of falling size that are tried before a pixel",
        low=1,
        high=6,
        source="docs/subdermal.md",
    )
    lone: float = parameter(
        1.7,
        unit="of n, where a block is one pixel",
        low=1.0,
        high=10.0,
        source="docs/subdermal.md",
    )
    radii: float = parameter(
        0.6,
        unit="natural logarithm of the range over which a block spreads a ring of two pixels up",
        low=0.0,
        high=2.0,
        source="docs/subdermal.md",
    )
    pyramid: bool = parameter(True, source="taps are means; false: single pixels")
    blocks: bool = parameter(True, source="the pixels of an output pixel share a rotation")

    name: ClassVar[str] = "subdermal"
    title: ClassVar[str] = "Subdermal"
    paper: ClassVar[str] = "ours, docs/subdermal.md"

    @property
    def counting(self) -> tuple[float, float, float]:
        """fewest, by_spread and by_unguarded, or the preset's."""
        own = (self.fewest, self.by_spread, self.by_unguarded)
        return PRESETS.get(self.preset, own)

    def block(self, inputs: Inputs) -> int:
        """Pixels that share a rotation, along one side."""
        return inputs.supersample if self.blocks else 1

    def factors(self, block: int) -> np.ndarray:
        """By what the pairs of a block's pixels that face each other multiply a large ring's radius
        (renderer.optics.rings.spread).
        """
        pairs = _pairs(block)
        return np.exp(self.radii * ((np.arange(pairs) + 0.5) / pairs - 0.5))

    def sets(self, curve: Curve, rung: int, block: int) -> list[rings.Rings]:
        """The fitted rings of every set, for pixels RUNG^rung mm wide in blocks of so many."""
        own = curve if self.kernel == "curve" else None
        distances, factors = tuple(self.distances(curve)), tuple(self.factors(block))
        noise = self.noise / block**2
        return [
            _fitted(own, distances, self.scale, count, self._texel(taps), rung, noise, factors)
            for count, taps in SETS
        ]

    def _texel(self, taps: int) -> float:
        return self.texel / taps**NARROWER if self.pyramid else 0.0

    def edge(self, curve: Curve, x_mm: np.ndarray) -> np.ndarray:
        if self.kernel == "curve":
            return curve.edge(np.asarray(x_mm) / self.scale)
        return super().edge(curve, x_mm)

    def taps(self, curve: Curve, rung: int, block: int) -> np.ndarray:
        """The taps of all sets (2 block^2, sum of COUNTS, 4), two rows for each pixel of a block:
        radius, mm, cosine and sine of the angle, logarithm (base 2) of the mean's side in mm; then
        each channel's weight over Burley's profile there, and the least radius by which depth is
        judged, mm.
        """
        d, pixel, factors = self.distances(curve), RUNG**rung, self.factors(block)
        sets = self.sets(curve, rung, block)
        table = []
        for part in range(block**2):
            # those that face each other are half of all even parts of a turn apart
            pair = part_of_block(part, block) % len(factors)
            rows: list[tuple[tuple[float, ...], tuple[float, ...]]] = []
            for (_, taps), fitted in zip(SETS, sets, strict=True):
                for k, (ring, weights) in enumerate(
                    zip(fitted.radius_mm, fitted.weights, strict=True)
                ):
                    r = float(rings.spread(ring, factors[pair if k % 2 else -1 - pair], pixel))
                    near = max(r, pixel)
                    profile = (np.exp(-near / d) + np.exp(-near / d / 3)) / (d * near)
                    number = taps if k else 1
                    share = weights / number / np.maximum(profile, LEAST)
                    side = max(self._texel(taps) * r, pixel)
                    for j in range(number):
                        turn = 2 * np.pi * (k * GOLDEN + j / number)
                        place = (r, np.cos(turn), np.sin(turn), np.log2(side))
                        rows.append((place, (*share, near)))
            table.append(np.array(rows).transpose(1, 0, 2))
        return np.concatenate(table)

    def passes(self, canvas: Canvas) -> None:
        inputs, d = canvas.inputs, self.distances(canvas.inputs.curve)
        block = self.block(inputs)
        x, y, *size = _box(inputs)
        tiled = [-(-side // TILE) for side in (inputs.width, inputs.height)]
        defines = {"TILE": TILE, "SETS": len(SETS), "LARGEST": LARGEST}
        floats = [GL.GL_RGBA32F]
        with (
            gl.Target(*size, floats, linear=True, mipmap=True) as guarded,
            gl.Target(*tiled, floats * 2) as tiles,
            gl.Target(*tiled, floats) as chosen,
        ):
            canvas.given["origin"] = np.array([x, y], float)
            for target in (guarded, tiles):
                target.bind(clear=(0.0, 0.0, 0.0, 0.0))
            canvas.draw(
                guarded,
                "techniques/subdermal_guard.glsl",
                windows=[(own[0] - x, own[1] - y, *own[2:]) for own in _windows(inputs, 1)],
                step_px=self.guard_px,
            )
            guarded.textures[0].reduce()
            canvas.given["guarded"] = guarded.textures[0]
            wide = np.eye(len(d))[int(np.argmax(d))]
            canvas.draw(
                tiles,
                "techniques/subdermal_tiles.glsl",
                defines,
                windows=_windows(inputs, TILE),
                widest=wide,
            )
            first, table = self._table(inputs, tiles.textures[1].read()[..., 0])
            try:
                canvas.draw(
                    chosen,
                    "techniques/subdermal_count.glsl",
                    defines,
                    tiles=tiles.textures[0],
                    tile_depths=tiles.textures[1],
                    sigma_mm=self.neighbourhood * float(d.max()),
                    by=np.array(self.counting) * (self.lone if block == 1 else 1.0),
                    full_spread=self.full_spread,
                    by_size=self.by_size * (self.lone if block == 1 else 1.0),
                    widest_mm=float(d.max()),
                    counts=np.array(COUNTS, float),
                    ladder=(first, np.log(RUNG)),
                )
                canvas.filter(
                    canvas.result,
                    "techniques/subdermal.glsl",
                    {**defines, "SIZES": self.sizes},
                    chosen=chosen.textures[0],
                    taps=table,
                    firsts=np.cumsum((0, *COUNTS))[:-1].astype(float),
                    on_ring=np.array([taps for _, taps in SETS], float),
                    shape=1 / d,
                    filter_radius_mm=self.filter_radius_mm(inputs.curve),
                    levels=float(LEVELS if self.pyramid else 0),
                    whole=self.whole,
                    block=block,
                )
            finally:
                table.delete()

    def _table(self, inputs: Inputs, depths: np.ndarray) -> tuple[int, gl.Texture]:
        """The first rung of the sizes of pixels in a picture, and the taps of all of them."""
        widest = self.filter_radius_mm(inputs.curve)  # coarser pixels are left as they are
        sizes = np.minimum(depths[depths > 0] / inputs.pixels_per_mm, widest)
        ends = (sizes.min(), sizes.max()) if len(sizes) else (1.0, 1.0)
        low, high = (int(np.floor(np.log(end) / np.log(RUNG) + 0.5)) for end in ends)
        block = self.block(inputs)
        rows = [_taps(self, inputs.curve, rung, block) for rung in range(low, high + 1)]
        data = np.concatenate(rows)
        return low, gl.Texture(data.shape[1], len(data), GL.GL_RGBA32F, data=data)

    def self_check(self, curve: Curve) -> None:
        widest = float(burley.inverse_cdf(0.9999, float(self.distances(curve).max())))
        rung = int(np.log(self.distances(curve).min()) / np.log(RUNG))
        for fitted in (one for block in (1, 2) for one in self.sets(curve, rung, block)):
            assert np.allclose(fitted.weights.sum(axis=0), 1, atol=1e-9)
            assert (fitted.weights >= 0).all() and np.isfinite(fitted.radius_mm).all()
            assert fitted.radius_mm[0] == 0 and (np.diff(fitted.radius_mm) > 0).all()
            assert fitted.radius_mm[-1] < 2 * widest


def _windows(inputs: Inputs, side: int) -> list[Window]:
    """Where anything scatters, in squares of so many pixels, a divisor of cover.TILE."""
    cover = inputs.cover
    whole = (0, 0, inputs.width, inputs.height)
    return [
        (x // side, y // side, -(-width // side), -(-height // side))
        for x, y, width, height in ([whole] if cover is None else cover.scattering(0.0))
    ]


def _box(inputs: Inputs) -> Window:
    """What means are made of: whole ones about all that scatters, and within the picture an empty
    one on each side, since a read beyond the edge finds the last.
    """
    windows = np.array(_windows(inputs, 1) or [(0, 0, 1, 1)])
    low = np.maximum(windows[:, :2].min(axis=0) // PAD - 1, 0)
    ends = -(-(windows[:, :2] + windows[:, 2:]).max(axis=0) // PAD) + 1
    high = np.minimum(ends, -(-np.array([inputs.width, inputs.height]) // PAD))
    x, y, width, height = (int(k) for k in PAD * np.concatenate([low, high - low]))
    return x, y, width, height


def part_of_block(pixel: int, block: int) -> int:
    """Which even part of the turn between two taps a pixel of a block takes, as in the shader."""
    return 7 * pixel % block**2


def _pairs(block: int) -> int:
    """Of a block's pixels that face each other; an odd block has none."""
    return block**2 if block % 2 else block**2 // 2


@lru_cache(maxsize=64)
def _taps(technique: Subdermal, curve: Curve, rung: int, block: int) -> np.ndarray:
    """`Subdermal.taps`, which takes as long as a pass."""
    return technique.taps(curve, rung, block)


@lru_cache(maxsize=512)
def _fitted(
    curve: Curve | None,
    distances: tuple[float, ...],
    scale: float,
    count: int,
    texel: float,
    rung: int,
    noise: float,
    factors: tuple[float, ...],
) -> rings.Rings:
    """Rings fitted to a curve, or to Burley's profile of these distances."""
    d = np.array(distances)
    burleys = fits.BurleyFit(d, np.zeros(len(d)))
    edge = burleys.edge if curve is None else lambda x: curve.edge(x / scale)
    return rings.fit(edge, d, count, texel, RUNG**rung, noise, factors)
