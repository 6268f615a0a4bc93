"""Lids that fit a ball of human size: the opening between them, measured and reshaped.

The base mesh's eyes are large (its balls have a radius of 14 to 15 mm, its openings end some 5 mm
before the inner corner). `fitted` measures the opening on the finest level, moves the skin about
it so that the opening has a person's width and height and its edges lie on a ball of a person's
radius, thins the lids and lays the upper one's fold over its crease. Coordinates called local are
those of the ball's frame: mm from its centre, axes of the head. Sizes of adults: opening 28 to 30
mm by 9 to 11, Read et al. 2006, "Influence of eyelid position on the optical characteristics of the
eye"; upper edge 4 to 4.5 mm above the pupil's middle, Putterman 2012, "Margin reflex distance (MRD)
1, 2, and 3"; radius of the ball 12 mm, Bekerman et al. 2014, doi:10.1155/2014/503645; thickness of
the margin 2 mm, Duke-Elder 1961.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from renderer.scene.cornea import reach
from stimuli.heads.person import Eyes
from stimuli.heads.smooth import smoothstep

STEP_MM = 0.15  # of the rays that an opening is measured with
BEHIND_MM = 3.0  # so far behind the ball's front a ray has to come for it to have gone between lids
CONTACT = 0.94  # of the base mesh's ball: where its lids' edges lie
LEAVES = -0.5  # of the radius: there edges leave the ball towards the inner corner
CORNER_MM = 0.5  # that the inner corner is set back
#: Where skin about the inner and the outer corner is smoothed: (x, y) mm from the corner, fully
#: within a radius, not beyond another, how often. Below the inner one folds are pushed together,
#: beside it the nose's wall; beside the outer one the upper lid's fold ends over a pocket.
EASED_INNER = (((-1.5, -3.0), 3.5, 9.0, 40), ((-5.0, 1.5), 3.5, 9.5, 320))
EASED_OUTER = (((3.5, 5.0), 3.0, 7.5, 90),)
CLEAR_MM = 0.05  # of skin from the ball
LATERAL_MM = 0.8  # of the outer corner from the ball's side
OUTWARD_MM = (0.5, 2.2)  # of the pupil from the opening's middle, least and most
SEATED = 0.1  # share of a lid's edges that may lie deeper than the ball's surface and their rim's
RIM_MM = 0.7  # of a lid's rim seen from the front, before what lies on the ball
BESIDE_MM = (0.15, 0.3, 0.45, 0.6, 0.75)  # of the opening: where its edges' depth is looked up
UPPER_SHARE = 0.62  # of the opening's height, above the line between the corners
UPPER, LOWER = (1.05, 1.0), (1.25, 0.95)  # powers of the distance from either corner, nose first
CREASE_SOFT_MM, CREASE_HALF_MM = 1.0, 0.4  # over which the fold rises; half the crease's width
FOLD_FADES_MM = 4.5  # above that, the fold's fullness falls by e
FOLD_DOWN = 0.45  # over the crease, a mm that it is full
REGION_MM = 32.0  # about the ball's centre, that is moved
MAP_MM = (40.0, 24.0)  # width and height of an edge map about the ball's centre
MAP_SIZE = (200, 120)  # its texels


@dataclass(frozen=True)
class Eyeball:
    """Centre (3,) and radius, mm; left: the person's left eye, by x > 0 where it is not said, as of
    heads that stand in the middle.
    """

    centre: np.ndarray
    radius: float
    left: bool | None = None

    @property
    def side(self) -> float:
        """1 for the left eye, -1 for the right one: where its temple is along x."""
        left = self.centre[0] > 0 if self.left is None else self.left
        return 1.0 if left else -1.0


@dataclass(frozen=True)
class Opening:
    """What lies between two lids, seen from the front, in the ball's frame.

    x (K,) mm from one corner to the other, rising; lower, upper (K,) mm: the lids' edges;
    corners: how far before the ball's centre the skin lies at the first and at the last of x, mm.
    """

    x: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    corners: tuple[float, float]

    @property
    def height_mm(self) -> float:
        return float((self.upper - self.lower).max())

    @property
    def reflex_mm(self) -> tuple[float, float]:
        """Margin reflex distances MRD1 and MRD2, mm: of the upper and of the lower edge from the
        middle of the pupil of an eye that looks straight ahead.
        """
        lower, upper = self.at(np.zeros(1))
        return float(upper[0]), float(-lower[0])

    @property
    def width_mm(self) -> float:
        return float(np.ptp(self.x))

    def at(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper edge at x; beyond a corner the corner's own height."""
        return np.interp(x, self.x, self.lower), np.interp(x, self.x, self.upper)

    def edge_map(self) -> np.ndarray:
        """Distance in mm to the upper and to the lower edge, (H, W, 2) float32 over MAP_MM, row 0
        at the bottom: above 0 where the ball is seen, below 0 under that lid.
        """
        from scipy.spatial import cKDTree

        width, height = MAP_SIZE
        x = (np.arange(width) + 0.5) / width * MAP_MM[0] - 0.5 * MAP_MM[0]
        y = (np.arange(height) + 0.5) / height * MAP_MM[1] - 0.5 * MAP_MM[1]
        across, up = np.meshgrid(x, y)
        lower, upper = self.at(across)
        fine = np.linspace(self.x[0], self.x[-1], 800)
        maps = []
        for edge, inside in zip(self.at(fine)[::-1], (upper - up, up - lower), strict=True):
            away, _ = cKDTree(np.column_stack([fine, edge])).query(np.dstack([across, up]))
            beyond = (across < self.x[0]) | (across > self.x[-1])
            maps.append(np.where((inside > 0) & ~beyond, away, -away))
        return np.stack(maps, axis=2).astype(np.float32)


def depths(
    positions: np.ndarray, faces: np.ndarray, ball: Eyeball, x: np.ndarray, y: np.ndarray
) -> np.ndarray | None:
    """How far before the ball's centre a mesh (N, 3), (M, 3) is first met from the front at x, y
    (...) of the ball's frame, mm; -inf where it is not, None where no mesh is near.
    """
    import trimesh

    near = np.linalg.norm(positions - ball.centre, axis=1) < 2.2 * ball.radius
    part = faces[near[faces].all(axis=1)]
    if not len(part):
        return None
    mesh = trimesh.Trimesh(positions - ball.centre, part, process=False, validate=False)
    start = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 4 * ball.radius)])
    hit = mesh.ray.intersects_first(start, np.tile([0.0, 0.0, -1.0], (len(start), 1)))
    normal, corner = mesh.face_normals[hit], mesh.triangles[hit, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = corner[:, 2] + ((corner - start)[:, :2] * normal[:, :2]).sum(axis=1) / normal[:, 2]
    return np.where(hit >= 0, depth, -np.inf).reshape(x.shape)


def opening(positions: np.ndarray, faces: np.ndarray, ball: Eyeball) -> Opening | None:
    """The opening before a ball in a mesh (N, 3), (M, 3); None where the lids are closed.

    Looked at from the front, the opening is where nothing is met near the ball's front.
    """
    from scipy.ndimage import label

    half = 1.5 * ball.radius
    axis = np.arange(-half, half + STEP_MM, STEP_MM)
    x, y = np.meshgrid(axis, axis)
    depth = depths(positions, faces, ball, x, y)
    if depth is None:
        return None
    front = np.sqrt(np.maximum(ball.radius**2 - x**2 - y**2, 0))
    parts, count = label(depth < front - BEHIND_MM)
    if not count:
        return None
    middle = parts[np.hypot(x, y) < 0.6 * ball.radius]
    if not middle.any():
        return None
    own = parts == np.bincount(middle[middle > 0]).argmax()
    if own[[0, -1]].any() or own[:, :2].any() or own[:, -2:].any():
        return None  # open to the side: no lids before this ball
    columns = np.flatnonzero(own.any(axis=0))
    low = axis[own[:, columns].argmax(axis=0)] - 0.5 * STEP_MM
    high = axis[len(axis) - 1 - own[::-1, columns].argmax(axis=0)] + 0.5 * STEP_MM
    if len(columns) < 20:
        return None
    ends = []
    for end, column in ((0, columns[0] - 2), (-1, columns[-1] + 2)):
        row = int(np.argmin(np.abs(axis - 0.5 * (low[end] + high[end]))))
        ends.append(float(depth[row, column]))
    if not np.isfinite(ends).all():
        return None
    return _smooth(axis[columns], low, high, (ends[0], ends[1]))


def seated(positions: np.ndarray, faces: np.ndarray, ball: Eyeball) -> Eyeball:
    """A ball that is roughly in its socket, moved so that the lids of a mesh (N, 3), (M, 3) lie on
    it as on a person's: its side at the outer corner, its pupil as far below the upper lid as the
    default eye's, its front behind the edges' rims. As it is where no opening is found.
    """
    own, radius = Eyes(), ball.radius
    size = radius / own.radius_mm
    for _ in range(3):
        found = opening(positions, faces, ball)
        if found is None:
            return ball
        side = ball.side
        outer, middle = found.x[-1 if side > 0 else 0], 0.5 * (found.x[0] + found.x[-1])
        x = side * outer - (radius - LATERAL_MM * size)
        x = side * np.clip(x - side * middle, *(size * mm for mm in OUTWARD_MM)) + middle
        lower, upper = (float(edge) for edge in found.at(x))
        y = upper - own.mrd1_mm / own.opening_height_mm * (upper - lower)
        # where both edges would touch a ball at x, y: from the pupil outwards, since the inner
        # corner lies off it
        across = x + side * np.linspace(-0.35, 0.7, 24) * radius
        touch = []
        for edge, away in zip(found.at(across), (-1, 1), strict=True):
            rows = edge + away * size * np.array(BESIDE_MM)[:, None]
            deep = depths(positions, faces, ball, np.broadcast_to(across, rows.shape), rows)
            flat = radius**2 - (across - x) ** 2 - (edge - y) ** 2
            touch.append(deep.min(axis=0) - np.sqrt(np.maximum(flat, 0)))
        touch = np.concatenate(touch)
        lids = touch[touch > -BEHIND_MM]  # what is deeper is the socket
        if not len(lids):
            return ball
        z = np.quantile(lids, SEATED) - RIM_MM * size
        ball = replace(ball, centre=ball.centre + [x, y, z])
    return ball


def _smooth(
    x: np.ndarray, lower: np.ndarray, upper: np.ndarray, corners: tuple[float, float]
) -> Opening:
    """The edges as polynomials of degree 6: their mean, and their distance, which grows as a root
    from either corner.
    """
    first, last = x[0] - 0.5 * STEP_MM, x[-1] + 0.5 * STEP_MM
    t = (x - first) / (last - first)
    root = np.sqrt(t * (1 - t))
    half = np.polyfit(t, 0.5 * (upper - lower) / root, 6, w=root)
    mean = np.polyfit(t, 0.5 * (upper + lower), 6)
    t = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 161))
    half = np.maximum(np.sqrt(t * (1 - t)) * np.polyval(half, t), 0)
    mean = np.polyval(mean, t)
    return Opening(first + t * (last - first), mean - half, mean + half, corners)


class _Shape:
    """How the skin about one eye is moved: from a measured opening to a person's."""

    def __init__(self, ball: Eyeball, measured: Opening, own: Eyes):
        self.old, self.own = ball, own
        side = ball.side
        self.side = side
        x, lower, upper = measured.x, measured.lower, measured.upper
        if side < 0:
            x, lower, upper = -x[::-1], lower[::-1], upper[::-1]
        self.measured = Opening(x, lower, upper, measured.corners)
        self.lateral = own.radius_mm - LATERAL_MM
        self.medial = self.lateral - own.opening_width_mm
        # one upper lid stands a little higher than the other
        uneven = 0.5 * side * own.lid_asymmetry_mm
        self.height = own.opening_height_mm + uneven
        # heights of the corners; there both edges meet
        raised = 0.5 * own.canthal_tilt_mm
        self.corners = lower[0] - raised, lower[-1] + raised
        # the pupil stands as far below the upper edge as the person asks
        self.line = float(self.goal(np.zeros(1))[1][0]) - own.mrd1_mm - uneven
        # the inner edges, which lie on the base mesh's ball made smaller, lie on the new one
        self.contact = CONTACT * ball.radius
        across = np.linspace(-0.3, 0.5, 9) * own.radius_mm
        places = []
        for old, new in zip(self._old_edges(across), self.goal(across), strict=True):
            flat = across**2 + (new - self.line) ** 2
            places.append(old - np.sqrt(np.maximum(own.radius_mm**2 - flat, 0)))
        self.centre = np.array([0.0, self.line, np.mean(places) + own.forward_mm])

    def _place(self, new_x: np.ndarray) -> np.ndarray:
        """Where along the measured opening what is wanted at new_x was: x (N,)."""
        was = self.measured
        t = np.clip((new_x - self.medial) / (self.lateral - self.medial), 0, 1)
        return was.x[0] + t * (was.x[-1] - was.x[0])

    def _old_edges(self, new_x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far before the old centre the edges lay that come to new_x: lower, upper (N,)."""
        x = self._place(new_x)
        low, high = (
            np.sqrt(np.maximum(self.contact**2 - x**2 - edge**2, 0)) for edge in self.measured.at(x)
        )
        return low, high

    def _depth(self, new_x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far forward the lower and the upper edge go at new_x (N,), to lie on the ball;
        towards the inner corner, where the ball falls away, they run straight.
        """
        leaves = LEAVES * self.own.radius_mm
        x = np.clip(new_x, leaves, self.lateral)
        share = np.clip((leaves - new_x) / (leaves - self.medial), 0, 1)
        moves = []
        for old, new, first in zip(
            self._old_edges(new_x),
            self.goal(x),
            self._old_edges(np.full(1, self.medial)),
            strict=True,
        ):
            flat = x**2 + (new - self.line) ** 2
            deep = self.centre[2] + np.sqrt(np.maximum(self.own.radius_mm**2 - flat, 0))
            deep = (1 - share) * deep + share * (first - CORNER_MM + 0.5 * self.own.forward_mm)
            moves.append(deep - old)
        return moves[0], moves[1]

    @property
    def ball(self) -> Eyeball:
        turned = self.centre * [self.side, 1, 1]
        return Eyeball(self.old.centre + turned, self.own.radius_mm, self.old.left)

    def goal(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper edge that are wanted at new x (N,): an almond, the upper one highest
        nearer to the nose, the lower one lowest nearer to the temple, over the line between the
        corners; mixed with what was measured.
        """
        own, was = self.own, self.measured
        t = np.clip((x - self.medial) / (self.lateral - self.medial), 0, 1)
        line = self.corners[0] + t * (self.corners[1] - self.corners[0])
        lower, upper = was.at(self._place(x))
        was_line = was.lower[0] + t * (was.lower[-1] - was.lower[0])
        size = self.height / was.height_mm
        edges = []
        for edge, power, share in ((lower, LOWER, -1 + UPPER_SHARE), (upper, UPPER, UPPER_SHARE)):
            a, b = power
            top = (a / (a + b)) ** a * (b / (a + b)) ** b
            almond = share * self.height * t**a * (1 - t) ** b / top
            edges.append(line + almond + (1 - own.almond) * (size * (edge - was_line) - almond))
        return edges[0], edges[1]

    def moved(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) mm of the head, moved."""
        local = (points - self.old.centre) * [self.side, 1, 1]
        near = np.linalg.norm(local, axis=1) < REGION_MM
        result = points.copy()
        turned = self._warped(local[near]) * [self.side, 1, 1]
        result[near] = self.old.centre + turned
        return result

    def _warped(self, p: np.ndarray) -> np.ndarray:
        from scipy.interpolate import PchipInterpolator

        was, own = self.measured, self.own
        x, y, z = p.T
        first, last = was.x[0], was.x[-1]
        edge = 1 - smoothstep(20.0, REGION_MM, np.linalg.norm(p, axis=1))
        # along: corners go to their new places, the nose's side and the temple stay
        knots = [-REGION_MM, first - 16.0, first, 2.0, last, last + 12.0, REGION_MM]
        goals = [*knots[:2], self.medial, 2.0, self.lateral, *knots[-2:]]
        beside = 1 - smoothstep(7.0, 17.0, np.abs(y - self.line))
        new_x = x + edge * beside * (PchipInterpolator(knots, goals, extrapolate=True)(x) - x)
        # up: edges go to theirs, in the height that is asked for
        lower, upper = was.at(x)
        low, high = self.goal(new_x)
        t = np.clip((y - lower) / np.maximum(upper - lower, 0.5), 0, 1)
        beyond = np.maximum(first - x, x - last)  # the corners
        above = np.maximum(y - upper, lower - y)  # the edges
        shift = (1 - t) * (low - lower) + t * (high - upper)
        shift *= (1 - smoothstep(0.0, 8.0, beyond)) * (1 - smoothstep(2.0, 9.0, above))
        new_y = y + edge * shift
        # depth: edges go on to the ball, and lids get thinner
        low, high = self._depth(new_x)
        forward = ((1 - t) * low + t * high) * (1 - smoothstep(0.0, 12.0, beyond))
        forward *= 1 - smoothstep(2.0, 13.0, above)
        height = np.maximum(np.linalg.norm(p, axis=1) - self.contact, 0)
        thin = (1 - own.lid_thickness) * (1 - smoothstep(3.0, 12.0, above))
        thin *= 0.3 + 0.7 * smoothstep(self.medial - 1, self.medial + 8, new_x)
        thin *= (1 - smoothstep(0.0, 10.0, beyond)) * (1 - smoothstep(3.5, 9.0, height))
        front = smoothstep(-3.0, 4.0, z)
        return np.column_stack([new_x, new_y, z + edge * front * (forward - thin * height)])


def _folded(points: np.ndarray, shape: _Shape, own: Eyes) -> np.ndarray:
    """Points (N, 3) with the upper lid's crease, and above it the fold of skin that hangs over it.

    The fold is fullest just above the crease and goes over into the brow.
    """
    local = (points - shape.ball.centre) * [shape.side, 1, 1]
    distance = np.linalg.norm(local, axis=1)
    near = np.flatnonzero((distance < 2.2 * own.radius_mm) & (local[:, 2] > 0))
    p, distance = local[near], distance[near]
    t = (p[:, 0] - shape.medial) / (shape.lateral - shape.medial)
    above = p[:, 1] + shape.line - shape.goal(p[:, 0])[1]  # the upper edge
    arch = np.sin(np.pi * np.clip(t, 0, 1))
    up = above - own.crease_mm * (0.35 + 0.65 * arch**0.8)
    share = smoothstep(0.05, 0.45, t) * (1 - smoothstep(0.70, 1.15, t))
    share *= smoothstep(0.7, 1.5, distance - own.radius_mm)  # the lid's outside
    full = smoothstep(-0.1, CREASE_SOFT_MM, up)
    full *= np.exp(-((np.maximum(up - CREASE_SOFT_MM, 0) / FOLD_FADES_MM) ** 2))
    groove = np.exp(-(((up + 0.1) / CREASE_HALF_MM) ** 2))
    towards = p / distance[:, None] * [1.0, 0.3, 1.0] - [0.0, FOLD_DOWN, 0.0]
    hangs = own.fold_mm * (share * full)[:, None] * towards
    sinks = own.crease_depth_mm * (share * groove / distance)[:, None] * p
    result = points.copy()
    result[near] += (hangs - sinks) * [shape.side, 1, 1]
    return result


def clear(points: np.ndarray, ball: Eyeball, own: Eyes, gaze: np.ndarray) -> np.ndarray:
    """Points (N, 3) of skin pushed out of the eye along its radii, so that a lid lies over the
    cornea too, in each gaze (..., 3); what is above moves with it and less.
    """
    local = points - ball.centre
    distance = np.linalg.norm(local, axis=1)
    near = distance < ball.radius + 8.0
    unit = local[near] / np.maximum(distance[near], 1e-9)[:, None]
    nearest = (unit @ np.atleast_2d(gaze).T).max(axis=1, initial=-1.0)
    surface = reach(nearest, ball.radius, own.iris_mm) + CLEAR_MM
    bulge = surface - CLEAR_MM - ball.radius
    height = distance[near] - ball.radius
    new = distance[near] + bulge * (1 - smoothstep(1.5, 8.0, height)) * (height > -2.0)
    result = points.copy()
    result[near] = ball.centre + unit * np.maximum(new, surface)[:, None]
    return result


def _eased(points: np.ndarray, faces: np.ndarray, shape: _Shape) -> np.ndarray:
    """Points (N, 3) with the skin beside both corners and below the inner one smoothed: folds of
    the base mesh are pushed together there.
    """
    local = (points - shape.ball.centre) * [shape.side, 1, 1]
    low, high = shape.goal(local[:, 0])
    above = np.maximum(local[:, 1] + shape.line - high, low - local[:, 1] - shape.line)
    beside = np.maximum(shape.medial - local[:, 0], local[:, 0] - shape.lateral)
    away = np.maximum(above, beside)  # from the opening
    corners = zip((shape.medial, shape.lateral), shape.corners, strict=True)
    result = points.copy()
    for (x, y), places in zip(corners, (EASED_INNER, EASED_OUTER), strict=True):
        for offset, full, none, rounds in places:
            place = np.array([x, y - shape.line]) + offset
            share = 1 - smoothstep(full, none, np.linalg.norm(local[:, :2] - place, axis=1))
            share *= smoothstep(1.0, 2.2, away) * (local[:, 2] > 0)
            result = _smoothed(result, faces, share, rounds)
    return result


def _smoothed(points: np.ndarray, faces: np.ndarray, share: np.ndarray, rounds: int) -> np.ndarray:
    """Points (N, 3) drawn to their neighbours' mean `rounds` times, by share (N,) in [0, 1]."""
    from scipy import sparse

    own = np.flatnonzero((share[faces] > 0).any(axis=1))
    used, part = np.unique(faces[own], return_inverse=True)
    part = part.reshape(-1, 3)
    i, j = part.ravel(), np.roll(part, 1, axis=1).ravel()
    ones = np.ones(2 * len(i))
    link = sparse.csr_matrix((ones, (np.append(i, j), np.append(j, i))), (len(used), len(used)))
    link = sparse.diags(1 / np.maximum(np.asarray(link.sum(axis=1)).ravel(), 1)) @ link
    moved, weight = points[used].copy(), 0.6 * share[used, None]
    for _ in range(rounds):
        moved += weight * (link @ moved - moved)
    result = points.copy()
    result[used] = moved
    return result


def fitted(
    points: np.ndarray, faces: np.ndarray, balls: Sequence[Eyeball], own: Eyes
) -> tuple[np.ndarray, list[Eyeball], list[Opening | None]]:
    """Skin (N, 3) with triangles (M, 3), moved so that its lids fit; the new balls; the openings
    that are seen then.

    balls: of the base mesh. A closed eye stays as it is, its opening None.
    """
    new = []
    for ball in balls:
        measured = opening(points, faces, ball)
        shape = None if measured is None else _Shape(ball, measured, own)
        if shape is not None:
            points = _folded(shape.moved(points), shape, own)
            points = _eased(points, faces, shape)
            points = clear(points, shape.ball, own, own.direction)
        new.append(ball if shape is None else shape.ball)
    return points, new, [opening(points, faces, ball) for ball in new]
