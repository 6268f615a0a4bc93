"""Where a mesh's face is, how large and which way round: the average head laid over it.

From many starts (axes, turns, sizes, places) the template is moved by iterated closest points
(Besl and McKay 1992, doi:10.1109/34.121791) with scale (Umeyama 1991, doi:10.1109/34.88573) and
trimmed pairs (Chetverikov et al. 2005, doi:10.1016/j.imavis.2004.05.007), the face counting more
than the skull, since hair and caps lie there. What fits best is then stretched along the head's
three axes, and landmarks are carried over.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from stimuli.heads import template

#: A face was found where the fit is nearer than this (mean distance, of a 206 mm head) ...
FIT_LIMIT_MM = 3.0
#: ... and where brow, nose, mouth and chin stand out as on the average head: see `_relief`.
RELIEF_LIMIT = 0.7
SAMPLES = 8_000
_SEED = 20  # of the points that are drawn on both surfaces
_SIZES = np.geomspace(0.09, 1.35, 22)  # head's height as a share of the mesh's
_TURNS = 18
_KEPT = 0.8  # share of pairs that count: hair, glasses and collars have none


@dataclass(frozen=True, eq=False)
class Fit:
    """A template's place in a mesh: file = scale * (template * stretch) @ rotation.T + offset.

    scale: units of the mesh a mm of the average head; stretch (3,) near 1 along the head's axes;
    error_mm: mean distance of the face's points, at the average head's size; relief: how alike
    the two faces' reliefs are, in [-1, 1].
    """

    scale: float
    rotation: np.ndarray
    offset: np.ndarray
    stretch: np.ndarray
    error_mm: float
    relief: float

    def place(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the template, mm, in the mesh."""
        return self.scale * (points * self.stretch) @ self.rotation.T + self.offset

    def back(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the mesh on the template, mm."""
        return ((points - self.offset) / self.scale) @ self.rotation / self.stretch

    @property
    def height(self) -> float:
        """From crown to chin, in units of the mesh."""
        return self.scale * self.stretch[1] * template.load().height_mm

    @property
    def up(self) -> np.ndarray:
        return self.rotation[:, 1]

    @property
    def forward(self) -> np.ndarray:
        return self.rotation[:, 2]

    @property
    def found(self) -> bool:
        return self.error_mm <= FIT_LIMIT_MM and self.relief >= RELIEF_LIMIT


def _sampled(points, faces, count, rng, weight=None):
    """Points and normals (count, 3) drawn evenly over the faces; weight (N,): of vertices."""
    a, b, c = np.moveaxis(points[faces], 1, 0)
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1)
    share = area if weight is None else area * weight[faces].mean(axis=1)
    which = rng.choice(len(faces), count, p=share / share.sum())
    u, v = rng.random((2, count, 1))
    over = (u + v) > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    at = a[which] + u * (b - a)[which] + v * (c - a)[which]
    return at, cross[which] / area[which, None]


class _Mesh:
    """Points drawn on a mesh, and the nearest of them."""

    def __init__(self, points: np.ndarray, normals: np.ndarray):
        from scipy.spatial import cKDTree

        self.points, self.normals, self.tree = points, normals, cKDTree(points)

    def nearest(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.tree.query(at)


def _cost(distance: np.ndarray, facing: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """mm a pair: distance, and more where the surfaces face apart."""
    return np.minimum(distance / scale, 40.0) + 12.0 * (1 - facing)


def _axes() -> list[np.ndarray]:
    """Rotations whose columns are the mesh's right, up and forward: each axis up once."""
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            up = np.zeros(3)
            up[axis] = sign
            forward = np.roll(np.abs(up), 1)
            found.append(np.column_stack([np.cross(up, forward), up, forward]))
    return found


def _about_up(degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _starts(points: np.ndarray, axes: list[np.ndarray]):
    """(scale (K,), rotation (K, 3, 3), offset (K, 3)) to try."""
    shape = template.load()
    chin = shape.landmarks["chin"][1]
    own = shape.points[shape.points[:, 1] > chin]
    middle = 0.5 * (own.min(axis=0) + own.max(axis=0))
    wide = 0.5 * np.hypot(*np.ptp(own[:, [0, 2]], axis=0))
    for axis in axes:
        turned = points @ axis
        top, low = np.quantile(turned[:, 1], 0.9995), turned[:, 1].min()
        for size in _SIZES:
            scale = size * (top - low) / shape.height_mm
            slab = turned[turned[:, 1] > top - size * (top - low)]
            if len(slab) < 30:
                continue
            ends = np.quantile(slab[:, [0, 2]], [0.02, 0.98], axis=0)
            spread = 0.5 * np.hypot(*np.ptp(ends, axis=0)) / scale
            if not 0.5 * wide < spread < 2.0 * wide:
                continue
            x, z = ends.mean(axis=0)
            for turn in 360 / _TURNS * np.arange(_TURNS):
                about = _about_up(turn)
                for ahead in (0.0, 45.0):  # a mask has no back of the head
                    for lower in (0.0, 25.0):  # hair above the crown
                        anchor = np.array([0.0, lower, middle[2] + ahead])
                        at = np.array([x, top, z]) - scale * about @ anchor
                        yield scale, axis @ about, axis @ at


def similarity(source, target, weight):
    """Scale, rotation, offset that bring source (N, 3) to target, weighted (Umeyama)."""
    share = weight / weight.sum()
    a, b = share @ source, share @ target
    u, s, vt = np.linalg.svd((target - b).T @ ((source - a) * share[:, None]))
    flip = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * flip) @ vt
    scale = (s * flip).sum() / (share @ ((source - a) ** 2).sum(axis=1))
    return scale, rotation, b - scale * rotation @ a


def _closest(mesh, points, normals, place, rounds, stretched=False):
    """Iterated closest points: (scale, rotation, offset, stretch) and the cost in mm."""
    scale, rotation, offset, stretch = place
    for step in range(rounds + 1):
        at = scale * (points * stretch) @ rotation.T + offset
        distance, index = mesh.nearest(at)
        facing = ((normals @ rotation.T) * mesh.normals[index]).sum(axis=1)
        cost = _cost(distance, facing, scale)
        pairs = cost <= np.quantile(cost, _KEPT)
        good = pairs & (facing > 0.2)
        total = np.minimum(cost, 60.0)[pairs].mean()
        if good.sum() < 20 or step == rounds:
            break
        weight = 1 / (1 + (distance[good] / scale / 4.0) ** 2)
        target = mesh.points[index[good]]
        # half a step to the plane, half to the point: along it only part of the way is known
        normal = mesh.normals[index[good]]
        gap = ((target - at[good]) * normal).sum(axis=1, keepdims=True)
        target = 0.5 * target + 0.5 * (at[good] + gap * normal)
        scale, rotation, offset = similarity(points[good] * stretch, target, weight)
        if stretched:
            local = (target - offset) @ rotation / scale
            own = points[good]
            middle = (weight @ own) / weight.sum()
            ratio = (weight @ ((local - middle) * (own - middle))) / (
                weight @ ((own - middle) ** 2)
            )
            stretch = np.clip(0.5 * stretch + 0.5 * ratio, 0.75, 1.33)
            stretch = stretch / stretch.prod() ** (1 / 3)
    return (scale, rotation, offset, stretch), float(total)


def _start_cost(mesh, own, facing, scale, rotation, offset, which) -> np.ndarray:
    """The mean cost (K,) of the pairs that count, at each of the starts `which`."""
    scale, rotation, offset = scale[which], rotation[which], offset[which]
    at = scale[:, None, None] * np.einsum("kij,nj->kni", rotation, own) + offset[:, None]
    distance, index = mesh.nearest(at.reshape(-1, 3))
    normals = np.einsum("kij,nj->kni", rotation, facing)
    match = (normals * mesh.normals[index].reshape(normals.shape)).sum(axis=2)
    cost = _cost(distance.reshape(match.shape), match, scale[:, None])
    return np.sort(cost, axis=1)[:, : int(_KEPT * cost.shape[1])].mean(axis=1)


def fit(points: np.ndarray, faces: np.ndarray, axes: list[np.ndarray] | None = None) -> Fit:
    """The average head laid over a mesh of points (N, 3) in any unit; axes: rotations to begin
    from (columns right, up, forward), all six axes up without them. The last ones are remembered.
    """
    given = (np.ascontiguousarray(values).tobytes() for values in (points, faces, axes or ()))
    key = sha256(b"|".join(given)).hexdigest()
    if key not in _LAST:
        if len(_LAST) >= 16:
            _LAST.pop(next(iter(_LAST)))
        _LAST[key] = _search(points, faces, axes)
    return _LAST[key]


_LAST: dict[str, Fit] = {}


def _search(points: np.ndarray, faces: np.ndarray, axes: list[np.ndarray] | None) -> Fit:
    rng = np.random.default_rng(_SEED)
    shape = template.load()
    mesh = _Mesh(*_sampled(points, faces, SAMPLES, rng))
    own, facing = _sampled(shape.points, shape.faces, 1200, rng, shape.weight)
    scale, rotation, offset = map(
        np.array, zip(*_starts(mesh.points, axes or _axes()), strict=True)
    )
    which = np.arange(len(scale))
    for count, kept in ((40, 500), (150, 30)):  # the worst are left out early
        cost = _start_cost(mesh, own[:count], facing[:count], scale, rotation, offset, which)
        which = which[np.argsort(cost, kind="stable")[:kept]]
    even = np.ones(3)
    tried = [
        _closest(mesh, own[:200], facing[:200], (scale[k], rotation[k], offset[k], even), 8)
        for k in which
    ]
    tried.sort(key=lambda entry: entry[1])
    best = min(
        (_closest(mesh, own[:500], facing[:500], place, 20) for place, _ in tried[:5]),
        key=lambda entry: entry[1],
    )[0]
    # points of the head alone, for the last steps
    inside = np.linalg.norm((points - best[2]) @ best[1] / best[0] - [0, -100, 60], axis=1) < 220
    some = faces[inside[faces].all(axis=1)]
    fine = _Mesh(*_sampled(points, some if len(some) > 50 else faces, 2 * SAMPLES, rng))
    place, _ = _closest(fine, own, facing, best, 15)
    place, _ = _closest(fine, own, facing, place, 20, stretched=True)
    scale, rotation, offset, stretch = place
    at = scale * (own * stretch) @ rotation.T + offset
    distance, index = fine.nearest(at)
    error = np.sort(distance / scale)[: int(_KEPT * len(own))].mean()
    found = ((fine.points[index] - offset) / scale) @ rotation / stretch
    return Fit(float(scale), rotation, offset, stretch, float(error), _relief(own, found))


def _relief(own: np.ndarray, found: np.ndarray) -> float:
    """How much of the average face's relief over its own paraboloid the other has: pairs of points
    (N, 3); 1 all of it, 0 none, as on an egg, negative against it.
    """
    eyes, chin = (template.load().landmarks[name] for name in ("eyes", "chin"))
    front = (np.abs(own[:, 0]) < 45) & (own[:, 1] < eyes[1] + 30) & (own[:, 1] > chin[1] - 5)
    front &= own[:, 2] > eyes[2] - 30
    depths = []
    for points in (own[front], found[front]):
        x, y = (points[:, :2] - own[front, :2].mean(axis=0)).T / 50
        terms = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y])
        depths.append(points[:, 2] - terms @ np.linalg.lstsq(terms, points[:, 2])[0])
    one, other = depths
    return float(one @ other / max(one @ one, other @ other))
