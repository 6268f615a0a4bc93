"""What cannot be seen: bounds against the farthest surface in front of them, so that pixels stay
the same to the bit when it is left out.

Greene, Kass and Miller 1993, "Hierarchical Z-buffer visibility", doi:10.1145/166117.166147: means
of four depths replaced by the farthest of them, level by level.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

#: Pixels of a side of the finest blocks.
BLOCK = 8
#: Pixels around a bound: an edge's own pixel, and rounding.
PADDING_PX = 2.0
#: Depths this much farther than a surface are hidden by it: far above a depth buffer's steps.
MARGIN_MM = 0.2


def blocks(bands: Iterable[np.ndarray]) -> list[np.ndarray]:
    """Farthest view depths of blocks of BLOCK, 2 BLOCK, ... pixels, infinite where one shows the
    backdrop.

    bands (H, W): rows of view depths in mm, 0 for the backdrop, the lowest first; all but the last
    are whole blocks high.
    """
    finest = [_farthest(np.where(band > 0, band, np.float32(np.inf)), BLOCK) for band in bands]
    levels = [np.vstack(finest)]
    while max(levels[-1].shape) > 1:
        levels.append(_farthest(levels[-1], 2))
    return levels


def _farthest(depths: np.ndarray, by: int) -> np.ndarray:
    height, width = depths.shape
    whole = np.pad(depths, ((0, -height % by), (0, -width % by)), constant_values=0.0)
    rows = whole.reshape(whole.shape[0] // by, by, -1).max(axis=1)
    return rows.reshape(rows.shape[0], -1, by).max(axis=2)


def hidden(
    levels: list[np.ndarray],
    points: np.ndarray,
    matrix: np.ndarray,
    size: tuple[int, int],
    half_mm: np.ndarray,
    half_px: float,
) -> np.ndarray:
    """Which polylines (S, P, 3) nothing can be seen of: outside the image, or behind surfaces (S,).

    matrix (4, 4): world to clip space, w being view depth; size: (width, height) of the image in
    pixels; half_mm (S,), half_px: half the width of what is drawn around them, whichever is more.
    """
    x, y, z = np.moveaxis(points, 2, 0).swapaxes(1, 2).astype(np.float32)  # each (P, S)
    # no matrix product: what that runs on several threads takes more of them than it saves
    across, up, depth = (
        a * x + b * y + c * z + d for a, b, c, d in matrix[[0, 1, 3]].astype(np.float32)
    )
    near = depth.min(axis=0)
    behind_the_eye = near <= 0
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 0.5 * size[1] * np.linalg.norm(matrix[1, :3]) / near
        around = PADDING_PX + np.maximum(half_px, half_mm * scale)
        low, high = np.empty((2, len(near), 2))
        for k, (side, along) in enumerate(zip(size, (across, up), strict=True)):
            at = 0.5 * side * (along / depth + 1.0)
            low[:, k], high[:, k] = at.min(axis=0) - around, at.max(axis=0) + around
    inside = ~behind_the_eye & (high > 0).all(axis=1) & (low < np.array(size)).all(axis=1)
    result = ~inside & ~behind_the_eye
    which = np.flatnonzero(inside)
    limit = np.array(size) - 1
    low = np.clip(np.floor(low[which]), 0, limit).astype(int)
    high = np.clip(np.floor(high[which]), 0, limit).astype(int)
    extent = (high - low).max(axis=1) // BLOCK
    level = np.ceil(np.log2(np.maximum(extent, 1) + 1)).astype(int)
    level = np.minimum(level, len(levels) - 1)
    # what is half the width wider may be as much nearer
    nearest = near[which] - MARGIN_MM - np.maximum(half_mm[which], half_px / scale[which])
    for k, farthest in enumerate(levels):
        own = np.flatnonzero(level == k)
        side = BLOCK << k
        a, b = low[own] // side, high[own] // side
        most = np.zeros(len(own), np.float32)
        for dy in range(2):  # a bound of a block's size meets two of them along each side
            for dx in range(2):
                x, y = np.minimum(a[:, 0] + dx, b[:, 0]), np.minimum(a[:, 1] + dy, b[:, 1])
                most = np.maximum(most, farthest[y, x])
        result[which[own]] = nearest[own] > most
    return result
