"""Pseudo-isochromatic plates: dots among which a digit can be read by colour alone.

Drawn by us, from a model of dichromacy: figure and ground differ only in what a protanope (a
deuteranope, a tritanope) lacks, the excitation of the long (middle, short) wavelength cones, so
that to them both are one colour. Cones are those of Vienot, Brettel and Mollon 1999, "Digital video
colourmaps for checking the legibility of displays by dichromats", Color Research and Application
24(4), 243-252, doi:10.1002/(SICI)1520-6378(199908)24:4<243::AID-COL5>3.0.CO;2-3: sRGB phosphors,
Smith and Pokorny's fundamentals. Each dot's light is scaled at random, the figure's as the
ground's, so that brightness says nothing. The first plate is for everybody: its digit is lighter.

They tell apart who reads and who does not, on an uncalibrated screen; they are no diagnosis.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

#: Linear sRGB to long, middle and short cones (Vienot, Brettel and Mollon 1999).
CONES = np.array(
    [
        [17.8824, 43.5161, 4.11935],
        [3.45565, 27.1554, 3.86714],
        [0.0299566, 0.184309, 1.46709],
    ]
)
#: What a plate is for, and the cone in which figure and ground differ; of "everybody" none.
KINDS = {"everybody": None, "protan": 0, "deutan": 1, "tritan": 2}
#: Digits that are not taken for one another where a dot is missing.
DIGITS = "2345679"
#: Of the figure to either side of the mean colour, linear sRGB; what stays in gamut.
MEAN = np.array([0.36, 0.26, 0.14])
APART = {"protan": 0.17, "deutan": 0.17, "tritan": 0.11}
#: Each dot's light is scaled by a factor between these; the mean of a lighter figure's.
SCALES, LIGHTER = (0.55, 1.45), 1.6
SIZE, RADII = 440, (4.0, 9.0)  # CSS pixels
DENSITY = 2  # pixels of the file a CSS pixel


@dataclass(frozen=True)
class Plate:
    """kind: of `KINDS`; digit: what is to be read; seed: of places, sizes and light."""

    kind: str
    digit: str
    seed: tuple[int, ...]

    @cached_property
    def dots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(N, 3) x, y, radius in CSS pixels; (N,) bool, of the figure; (N, 3) linear sRGB."""
        rng = np.random.Generator(np.random.PCG64([*self.seed]))
        places = _packed(rng)
        mask = _mask(self.digit)
        x, y = places[:, :2].astype(int).T
        figure = mask[y, x]
        scale = rng.uniform(*SCALES, len(places))
        colours = np.tile(MEAN, (len(places), 1))
        cone = KINDS[self.kind]
        if cone is None:
            scale[figure] *= LIGHTER / scale[figure].mean()
            scale[~figure] *= 0.6 / scale[~figure].mean()
        else:
            direction = np.linalg.inv(CONES)[:, cone]
            direction = APART[self.kind] * direction / np.abs(direction).max()
            sign = 1.0 if direction[0] > 0 else -1.0  # the figure is the redder or yellower
            colours += np.where(figure[:, None], sign, -sign) * direction
        return places, figure, colours * scale[:, None]

    def png(self) -> bytes:
        """The plate as a PNG of `DENSITY` times `SIZE`, on the grey of paper."""
        from PIL import Image, ImageDraw

        finer = 2 * DENSITY
        picture = Image.new("RGB", (SIZE * finer, SIZE * finer), (235, 235, 235))
        draw = ImageDraw.Draw(picture)
        places, _, colours = self.dots
        for (x, y, radius), colour in zip(places * finer, _encoded(colours)):
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=tuple(colour))
        picture = picture.resize((SIZE * DENSITY, SIZE * DENSITY), Image.Resampling.BOX)
        file = io.BytesIO()
        picture.save(file, "PNG")
        return file.getvalue()


def plates(
    seed: int, count: int, kinds: tuple[str, ...] = ("protan", "deutan")
) -> tuple[Plate, ...]:
    """The plates of a study: the first for everybody, then of the kinds in turn; digits are drawn
    from its seed, neighbours differ.
    """
    rng = np.random.Generator(np.random.PCG64([seed, count]))
    made: list[Plate] = []
    for k in range(count):
        kind = kinds[(k - 1) % len(kinds)] if k else "everybody"
        known = [digit for digit in DIGITS if not made or digit != made[-1].digit]
        made.append(Plate(kind, known[int(rng.integers(len(known)))], (seed, count, k)))
    return tuple(made)


@lru_cache(maxsize=64)
def picture(seed: int, count: int, kinds: tuple[str, ...], number: int) -> bytes:
    """The PNG of a study's plate, from 1."""
    return plates(seed, count, kinds)[number - 1].png()


def read(given: list[str], seed: int) -> int:
    """How many plates were read as they are."""
    return sum(one == plate.digit for one, plate in zip(given, plates(seed, len(given))))


def _packed(rng: np.random.Generator) -> np.ndarray:
    """(N, 3): dots in a disc that do not touch, large ones first."""
    placed = np.empty((0, 3))
    middle, reach = SIZE / 2, SIZE / 2 - 6
    for radius in np.linspace(RADII[1], RADII[0], 13):
        for x, y in rng.uniform(0, SIZE, (700, 2)):
            if np.hypot(x - middle, y - middle) + radius > reach:
                continue
            apart = np.hypot(placed[:, 0] - x, placed[:, 1] - y) - placed[:, 2] - radius
            if not len(placed) or apart.min() > 1.2:
                placed = np.vstack([placed, (x, y, radius)])
    return placed


@lru_cache(maxsize=len(DIGITS))
def _mask(digit: str) -> np.ndarray:
    """(SIZE, SIZE) bool: where the digit is, in the middle."""
    from matplotlib.font_manager import FontProperties, findfont
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.truetype(
        findfont(FontProperties(family="DejaVu Sans", weight="bold")), round(0.8 * SIZE)
    )
    picture = Image.new("L", (SIZE, SIZE))
    ImageDraw.Draw(picture).text((SIZE / 2, SIZE / 2), digit, 255, font, anchor="mm")
    return np.asarray(picture) > 127


def _encoded(linear: np.ndarray) -> np.ndarray:
    """Linear sRGB, 0 to 1, as the file's bytes (IEC 61966-2-1)."""
    value = np.clip(linear, 0, 1)
    curve = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.rint(255 * curve).astype(int)
