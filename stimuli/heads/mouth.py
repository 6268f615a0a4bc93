"""Closed lips and the border of their vermilion."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

LIPS = 0.5  # of the mask: what is lip
BIN_MM = 1.0  # across the mouth
DECAY_MM = 2.6  # from the seam: what is farther from it by more hardly moves
EVENING = 6
FOLLOWS_MM = 9.0  # beyond the vermilion's border: how far the skin follows it
DEEP_MM = 30.0  # behind the foremost point of the lips: no lip any more


def seam(points: np.ndarray, normals: np.ndarray, lips: np.ndarray) -> tuple[np.ndarray, ...]:
    """The lips' edges towards each other: x, height of the lower edge of the upper lip, and of the
    upper edge of the lower lip, (K,) mm. lips (N,): the mask.

    The surface of the upper lip that faces down and that of the lower lip that faces up are told
    by their normals.
    """
    own = points[lips > LIPS]
    middle, half = 0.5 * (own[:, 0].min() + own[:, 0].max()), 0.5 * np.ptp(own[:, 0])
    count = int(2 * half / BIN_MM)
    x = middle + half * np.linspace(-0.97, 0.97, count)
    region = (lips > 0.3) & (points[:, 2] > own[:, 2].max() - DEEP_MM)
    upper, lower = np.full(count, np.nan), np.full(count, np.nan)
    p, n = points[region], normals[region]
    which = np.clip(np.rint((p[:, 0] - x[0]) / (x[1] - x[0])).astype(int), 0, count - 1)
    for k in range(count):
        here = which == k
        down, up = p[here & (n[:, 1] < -0.35), 1], p[here & (n[:, 1] > 0.35), 1]
        # of each lip's two faces that look up or down the ones at the seam
        if len(down) and len(up):
            pairs = down[:, None] - up[None]
            at = np.unravel_index(np.abs(pairs).argmin(), pairs.shape)
            upper[k] = down[np.abs(down - down[at[0]]) < 1.5].min()
            lower[k] = up[np.abs(up - up[at[1]]) < 1.5].max()
    known = np.isfinite(upper)
    if known.sum() < 4:
        raise ValueError("no seam between the lips was found; the mask does not fit this head")
    kernel = np.array([0.25, 0.5, 0.25])
    edges = []
    for edge in (upper, lower):
        edge = np.interp(x, x[known], edge[known])
        edges.append(np.convolve(np.pad(edge, 1, mode="edge"), kernel, mode="valid"))
    return x, *edges


def above(points, normals, lips) -> np.ndarray:
    """Which vertices (N,) bool lie above the seam of open lips, as the base mesh's are."""
    x, upper, lower = seam(points, normals, lips)
    return points[:, 1] > np.interp(points[:, 0], x, 0.5 * (upper + lower))


def closed(points, normals, faces, lips, upper_lip, overlap_mm: float) -> np.ndarray:
    """How far vertices are moved (N, 3) so that the lips lie over each other by overlap_mm.

    upper_lip (N,) bool: which belong to it, see `above`. Heights are compressed
    towards the seam, so that the lips' outer shape stays.
    """
    x, upper, lower = seam(points, normals, lips)
    result = np.zeros_like(points)
    half = 0.5 * np.ptp(x)
    middle = 0.5 * (x[0] + x[-1])
    out = np.abs(points[:, 0] - middle) / half
    share = np.clip((1.06 - out) / 0.08, 0, 1)
    share = share * share * (3 - 2 * share)
    front = points[lips > LIPS][:, 2].max()
    share = share * np.clip((points[:, 2] - front + DEEP_MM) / 8, 0, 1)
    top, bottom = np.interp(points[:, 0], x, upper), np.interp(points[:, 0], x, lower)
    need = 0.5 * np.maximum(top - bottom + overlap_mm, 0)
    for above, edge, way in ((True, top, -1), (False, bottom, 1)):
        own = upper_lip == above
        away = np.maximum(-way * (points[:, 1] - edge), 0)
        result[own, 1] += (way * share * need * np.exp(-((away / DECAY_MM) ** 2)))[own]
    result[:, 1] = _evened(result[:, 1], faces)
    return result


def _crossings(faces, lips) -> tuple[np.ndarray, np.ndarray]:
    """Edges (K, 2) that the mask's border crosses, and where along each, (K, 1)."""
    value = lips - LIPS
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ends = ends[(value[ends[:, 0]] < 0) != (value[ends[:, 1]] < 0)]
    a, b = value[ends[:, 0]], value[ends[:, 1]]
    return ends, (a / (a - b))[:, None]


def border(points, faces, lips) -> np.ndarray:
    """Points (K, 3) on the border of the mask lips (N,), between the vertices."""
    return _along(points, *_crossings(faces, lips))


def _along(points, ends, t) -> np.ndarray:
    return points[ends[:, 0]] * (1 - t) + points[ends[:, 1]] * t


def outer_border(points, normals, faces, lips) -> np.ndarray:
    """Points (K, 3) on the border of the vermilion with the skin, as seen from the front."""
    ends, t = _crossings(faces, lips)
    line = _along(points, ends, t)
    return line[(line[:, 2] > line[:, 2].max() - DEEP_MM) & (normals[ends[:, 0], 2] > 0.1)]


def heights(points, normals, faces, lips) -> tuple[np.ndarray, ...]:
    """x (K,), the seam's height there and the vermilion's above and below it, (K,) mm each."""
    return _heights(points, normals, lips, outer_border(points, normals, faces, lips))


def _heights(points, normals, lips, line) -> tuple[np.ndarray, ...]:
    x, upper, lower = seam(points, normals, lips)
    between = 0.5 * (upper + lower)
    over = line[:, 1] - np.interp(line[:, 0], x, between)
    found = []
    for way in (1, -1):
        own = way * over > 0
        order = np.argsort(line[own, 0])
        at, high = line[own, 0][order], way * over[own][order]
        # the mean about each place; the border is a dense cloud of points
        near = np.exp(-(((x[:, None] - at) / BIN_MM) ** 2))
        found.append((near @ high) / np.maximum(near.sum(axis=1), 1e-9))
    return x, between, *found


def sized(points, normals, faces, lips, upper_lip, wanted_mm) -> np.ndarray:
    """How far vertices are moved (N, 3) so that the vermilion is as high in the middle as
    wanted_mm, (upper, lower), says; 0 leaves a lip as it is.

    Heights above the seam are scaled, and what a lip stands out before its border by the same
    factor; the skin beyond follows over FOLLOWS_MM.
    """
    line = outer_border(points, normals, faces, lips)
    x, between, *found = _heights(points, normals, lips, line)
    middle = 0.5 * (x[0] + x[-1])
    front = points[lips > LIPS][:, 2].max()
    deep = np.clip((points[:, 2] - front + DEEP_MM) / 8, 0, 1)
    off = points[:, 1] - np.interp(points[:, 0], x, between)
    edge = 0.5 * np.ptp(x) / 0.97
    out = np.append(np.append(middle - edge, x), middle + edge)
    result = np.zeros_like(points)
    for way, own, high, wanted in (
        (1, upper_lip, found[0], wanted_mm[0]),
        (-1, ~upper_lip, found[1], wanted_mm[1]),
    ):
        if not wanted:
            continue
        factor = wanted / np.interp(middle, x, high)
        high = np.interp(points[:, 0], out, np.pad(high, 1))
        from_seam = np.maximum(way * off, 0)
        beyond = np.maximum(from_seam - high, 0)
        change = (factor - 1) * np.minimum(from_seam, high) * np.exp(-((beyond / FOLLOWS_MM) ** 2))
        result[own, 1] += (way * deep * change)[own]
        rim = line[way * (line[:, 1] - np.interp(line[:, 0], x, between)) > 0]
        near = np.exp(-(((x[:, None] - rim[:, 0]) / BIN_MM) ** 2))
        base = np.interp(points[:, 0], x, near @ rim[:, 2] / np.maximum(near.sum(axis=1), 1e-9))
        stands = np.maximum(points[:, 2] - base, 0) * np.clip((high - from_seam) / 1.0, 0, 1)
        result[own, 2] += ((factor - 1) * deep * stands)[own]
    for axis in (1, 2):
        result[:, axis] = _evened(result[:, axis], faces)
    return result


def ridge(points, normals, faces, lips, height_mm: float, width_mm: float) -> np.ndarray:
    """How far vertices are moved (N, 3) by the roll along the border of the vermilion, just outside
    it.
    """
    if height_mm == 0:
        return np.zeros_like(points)
    line = outer_border(points, normals, faces, lips)
    distance, _ = cKDTree(line).query(points, distance_upper_bound=4 * width_mm)
    near = np.isfinite(distance) & (normals[:, 2] > 0)
    signed = np.where(lips > LIPS, -distance, distance)[near]
    height = height_mm * np.exp(-(((signed - 0.35 * width_mm) / width_mm) ** 2))
    # none where the lips end in the corners of the mouth
    middle, half = 0.5 * (line[:, 0].min() + line[:, 0].max()), 0.5 * np.ptp(line[:, 0])
    out = np.abs(points[near, 0] - middle) / half
    height *= np.clip((0.96 - out) / 0.25, 0, 1)
    rise = np.zeros(len(points))
    rise[near] = height
    return _evened(rise, faces)[:, None] * normals


def _evened(values: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Values (N,) as means over neighbours, EVENING times: what mask and seam say is angular."""
    i, j = faces.ravel(), np.roll(faces, 1, axis=1).ravel()
    count = len(values)
    link = sparse.csr_matrix(
        (np.ones(2 * len(i)), (np.append(i, j), np.append(j, i))), (count,) * 2
    )
    link = sparse.diags(1 / np.maximum(np.asarray(link.sum(axis=1)).ravel(), 1)) @ link
    for _ in range(EVENING):
        values = 0.5 * values + 0.5 * (link @ values)
    return values
