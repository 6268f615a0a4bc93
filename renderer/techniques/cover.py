"""Where a picture scatters: the part of it that filters of the screen draw."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

#: Pixels of a side, as software drivers cut a picture; even, so that derivatives are whole.
TILE = 64
#: Of a reach: half a pixel for each of a technique's passes, and one of a derivative.
ROUNDING_PX = 8

Window = tuple[int, int, int, int]  # x, y, width, height: px, y from below


@dataclass(frozen=True)
class Cover:
    """Where the rows from `first` on of a picture scatter, as far as low to high are asked for.

    tiles (rows, columns): of the whole picture, whether anything scatters in a tile of TILE pixels,
    row 0 below; width, height: of what is drawn, px; px_per_mm: of the nearest surface.
    """

    tiles: np.ndarray
    width: int
    height: int
    first: int
    low: int
    high: int
    px_per_mm: float

    def scattering(self, reach_mm: float) -> list[Window]:
        """What a pass has to draw so that low to high are right, when passes after it take light
        from so far away.
        """
        reach = ROUNDING_PX + reach_mm * self.px_per_mm if reach_mm else 0
        return self._windows(self.tiles, self.low - reach, self.high + reach)

    def rest(self) -> list[Window]:
        """Where nothing scatters."""
        return self._windows(~self.tiles, self.first, self.first + self.height)

    def _windows(self, chosen: np.ndarray, low: float, high: float) -> list[Window]:
        """Tiles in rows from low to high of the picture, as windows of what is drawn."""
        low = max(2 * math.floor(low / 2), self.first)
        high = min(2 * math.ceil(high / 2), self.first + self.height)
        windows = []
        for k in range(low // TILE, -(-high // TILE)):
            below, above = max(k * TILE, low), min((k + 1) * TILE, high)
            edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen[k], [False]])))
            for x, end in TILE * edges.reshape(-1, 2):
                wide = min(int(end), self.width) - int(x)
                windows.append((int(x), below - self.first, wide, above - below))
        return windows
