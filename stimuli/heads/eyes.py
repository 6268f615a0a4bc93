"""Eyeballs: a sphere with the cornea's steeper cap, and the tissue in the opening's inner corner.

The caruncle is a lump of skin in the lake of tears, the plica semilunaris the fold between it and
the ball; here a sheet that is spanned between the lids and dives under the ball.
"""

from __future__ import annotations

import numpy as np

from renderer.scene import Eye
from renderer.scene.cornea import normals, reach
from renderer.scene.model import EYE_VALUES
from stimuli.heads.lids import MAP_MM, RIM_MM, Eyeball, Opening, depths
from stimuli.heads.person import Eyes
from stimuli.heads.smooth import smoothstep
from stimuli.heads.subdivide import vertex_normals
from stimuli.heads.vessels import vessel_map

RINGS, SEGMENTS = 96, 96
ACROSS, UP = 44, 30  # vertices of the sheet in the corner
REACH, FALL = 0.50, 0.135  # of the radius: how far the sheet goes from the corner, and back
UNDER_MM = 0.8  # its end lies so far under the ball at least
PLICA_MM, PALE = (0.0, 1.7), 0.02  # above the ball, where it pales; how much flesh is left there
LINED, LINING, ROWS = 0.42, 120, 6  # of the opening, from the nose: there it begins; vertices
BESIDE_MM = 0.6  # of the opening: there a lining begins, below the lids' rims
COLOURS = ("iris", "fibres", "collarette", "sclera")


def values_of(own: Eyes) -> dict[str, float | tuple[float, ...]]:
    """What the eye's shader takes of a person's fields."""
    return {name: getattr(own, name) for name in EYE_VALUES}


def eyeball(
    ball: Eyeball,
    own: Eyes | None = None,
    opening: Opening | None = None,
    seed: int = 0,
    rims: np.ndarray | None = None,
) -> Eye:
    """An eye before an opening, or behind none; seed: of its vessels. Rings crowd to the front.

    rims (LINING, 3): where a lining between lids and ball begins (`rims`), for lids that were not
    made for the ball.
    """
    own = own or Eyes()
    gaze = own.direction
    theta = np.pi * np.linspace(0, 1, RINGS) ** 1.5 * 0.999 + 1e-4
    phi = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    unit = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.outer(np.cos(theta), np.ones(SEGMENTS)),
        ],
        axis=2,
    ).reshape(-1, 3)
    positions = ball.centre + reach(unit @ gaze, ball.radius, own.iris_mm)[:, None] * unit
    normal = normals(unit, gaze, ball.radius, own.iris_mm)
    faces = _grid(RINGS, SEGMENTS, True)
    tissue = np.zeros((len(positions), 2))
    if opening is not None and own.caruncle:
        more, own_tissue = corner(ball, opening, own)
        sheet = _grid(ACROSS, UP, False)
        if ball.side < 0:
            sheet = sheet[:, ::-1]
        faces = np.vstack([faces, sheet + len(positions)])
        positions = np.vstack([positions, more])
        normal = np.vstack([normal, vertex_normals(more, sheet)])
        tissue = np.vstack([tissue, own_tissue])
    if rims is not None:
        more, own_tissue, wall = lining(ball, rims)
        faces = np.vstack([faces, wall + len(positions)])
        positions = np.vstack([positions, more])
        normal = np.vstack([normal, vertex_normals(more, wall)])
        tissue = np.vstack([tissue, own_tissue])
    return Eye(
        positions.astype(np.float32),
        normal.astype(np.float32),
        faces.astype(np.uint32),
        np.asarray(ball.centre, float),
        gaze,
        float(ball.radius),
        own.iris_mm,
        {name: getattr(own, name) for name in COLOURS},
        values_of(own),
        tissue.astype(np.float32),
        np.zeros((1, 1, 2), np.float32) if opening is None else opening.edge_map(),
        MAP_MM,
        vessel_map(seed, own.iris_mm / ball.radius, ball.side > 0),
        own.gaze == "lens",
    )


def _grid(rows: int, columns: int, closed: bool) -> np.ndarray:
    """Triangles (M, 3) of rows x columns vertices, rows joined to rings where closed."""
    i, j = np.meshgrid(
        np.arange(rows - 1), np.arange(columns if closed else columns - 1), indexing="ij"
    )
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    return np.concatenate(
        [np.stack([a, c, b], axis=2).reshape(-1, 3), np.stack([b, c, d], axis=2).reshape(-1, 3)]
    )


def corner(ball: Eyeball, opening: Opening, own: Eyes) -> tuple[np.ndarray, np.ndarray]:
    """The sheet in the inner corner: points (ACROSS UP, 3) mm, and of each (ACROSS UP, 2) how much
    is flesh, above 0, and how much caruncle. It goes over into the sclera where it meets the ball.
    """
    side = ball.side
    x_in = side * (opening.x[0] if side > 0 else opening.x[-1])  # the inner corner, below 0
    deep = opening.corners[0 if side > 0 else 1]
    # from behind the corner to where it is well inside the ball
    x = np.linspace(x_in - 0.8, x_in + REACH * ball.radius, ACROSS)
    low, high = opening.at(side * x)
    v = np.linspace(0, 1, UP)
    y = (low - 1.3)[:, None] + v[None] * (high - low + 2.6)[:, None]
    x = np.repeat(x[:, None], UP, axis=1)
    along = (x - x_in) / (REACH * ball.radius)
    flat = x[-1, 0] ** 2 + max(low[-1] ** 2, high[-1] ** 2)
    end = np.sqrt(max(ball.radius**2 - flat, 0.0)) - UNDER_MM
    z = deep - 1.2 - max(FALL * ball.radius, deep - 1.2 - end) * along
    z = z + 0.28 * np.sin(1.7 * y + 0.8) + 0.12 * np.sin(3.7 * y + 2.0)  # its border winds
    middle = np.interp(x_in, side * opening.x[:: int(side)], opening.lower[:: int(side)])
    size = 1.0 * own.caruncle
    # the caruncle, lumpy
    dx, dy = (x - x_in - 2.1 * size) / (1.75 * size), (y - middle - 0.15) / (1.15 * size)
    lump = np.exp(-(dx**2 + dy**2))
    bumps = (
        1 + 0.22 * np.sin(3.1 * x + 1.0) * np.sin(3.9 * y + 0.6) + 0.1 * np.sin(6.3 * x - 5.1 * y)
    )
    z = z + 1.15 * size * lump * bumps
    # the fold, a crescent about the ball; it ends where the sphere rises above the sheet
    flat = np.sqrt(np.maximum(ball.radius**2 - y**2, 0))
    front = np.sqrt(np.maximum(flat**2 - x**2, 0))
    above = z - front
    z = z + 0.5 * size * np.exp(-((above - 0.5) ** 2) / 0.30)
    local = np.stack([side * x, y, z], axis=2).reshape(-1, 3)
    flesh = PALE + (1 - PALE) * smoothstep(*PLICA_MM, z - front)
    lump = np.clip(1.2 * lump, 0, 1)
    tissue = np.stack([np.maximum(flesh, lump), lump], axis=2).reshape(-1, 2)
    return ball.centre + local, tissue


def rims(
    positions: np.ndarray, faces: np.ndarray, ball: Eyeball, opening: Opening
) -> np.ndarray | None:
    """Below the rims of a mesh's (N, 3), (M, 3) lids, from the upper one's middle round the outer
    corner to the lower one's: (LINING, 3) mm; None where its skin is not all there.
    """
    side = ball.side
    inner, outer = opening.x[:: int(side)][[0, -1]]
    t = np.abs(np.linspace(-1, 1, LINING))  # 0 at the corner
    x = outer + (1 - LINED) * (inner - outer) * t**2
    edge = np.where(np.arange(LINING) < LINING // 2, *opening.at(x)[::-1])
    along = np.gradient(np.column_stack([x, edge]), axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    size = ball.radius / Eyes().radius_mm
    beside = np.column_stack([x, edge]) + BESIDE_MM * size * side * along[:, ::-1] * [-1, 1]
    deep = depths(positions, faces, ball, *beside.T)
    if deep is None or not np.isfinite(deep).all():
        return None
    return ball.centre + np.column_stack([beside, deep - RIM_MM * size])


def lining(ball: Eyeball, rims: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What lines the outer half of an opening, from below the lids' rims (LINING, 3) into the ball,
    so that no gap is seen beside it: points (LINING ROWS, 3) mm, their tissue, triangles.
    """
    local = rims - ball.centre
    distance = np.linalg.norm(local, axis=1, keepdims=True)
    into = np.minimum(distance, ball.radius) - 0.5
    share = np.linspace(0, 1, ROWS)[None, :, None]
    points = (local / distance)[:, None] * (distance[:, None] + share * (into - distance)[:, None])
    faces = _grid(LINING, ROWS, False)
    flesh = np.repeat(PALE + (1 - PALE) * (1 - share[..., 0]), LINING, axis=0)
    tissue = np.stack([flesh, np.zeros_like(flesh)], axis=2).reshape(-1, 2)
    if ball.side > 0:
        faces = faces[:, ::-1]
    return ball.centre + points.reshape(-1, 3), tissue, faces
