"""A frame's picture in pieces: rows that are filtered and composited at once.

What that takes in memory then does not grow with the image.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Pixels of a piece: a technique with two targets of its own takes 70 bytes for each.
PIECE_PIXELS = 3_100_000


@dataclass(frozen=True)
class Piece:
    """Rows of a picture, counted from below: those from `first` on are drawn, `rows` of them; those
    from `low` up to `high` are right, since all that their light comes from is among the drawn.
    """

    first: int
    rows: int
    low: int
    high: int

    def own_rows(self) -> slice:
        """low to high among the drawn rows, with row 0 at the top."""
        last = self.first + self.rows
        return slice(last - self.high, last - self.low)

    def image_rows(self, height: int, supersample: int = 1) -> slice:
        """low to high among the rows of an image, with row 0 at the top."""
        return slice((height - self.high) // supersample, (height - self.low) // supersample)


def pieces(
    width: int, height: int, reach_px: float | None, supersample: int, most: int | None = None
) -> list[Piece]:
    """The pieces of a picture of width x height, lowest first.

    reach_px: how far a pixel's light comes from at most, None for anywhere: then the picture is one
    piece. most: pixels of a piece, by default PIECE_PIXELS; a reach that fills it all the same
    makes pieces of three times the reach. Pieces begin at whole pixels of the image and at even
    rows, as the 2x2 blocks over which drivers take derivatives do.
    """
    most = PIECE_PIXELS if most is None else most
    if reach_px is None or not math.isfinite(reach_px) or width * height <= most:
        return [Piece(0, height, 0, height)]
    step = math.lcm(2, supersample)
    apron = step * math.ceil(reach_px / step)
    own = max(most // width - 2 * apron, apron, step)
    count = math.ceil(height / own)
    own = step * math.ceil(height / count / step)
    cut = []
    for low in range(0, height, own):
        high = min(low + own, height)
        first, last = max(low - apron, 0), min(high + apron, height)
        cut.append(Piece(first, last - first, low, high))
    return cut
