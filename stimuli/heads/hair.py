"""Generated strands: scalp, brows, stubble and the fine hair of the cheeks. Every draw comes from
one seed. Lashes: stimuli/heads/lashes.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from scipy.special import betaincinv

from renderer.memory import parts
from renderer.scene import MASKS, Strands
from renderer.scene.shapes import points_on, triangle_areas
from stimuli.heads import growth, lashes
from stimuli.heads.person import Hair, Lashes
from stimuli.heads.skin import azimuth
from stimuli.heads.smooth import smoothstep
from stimuli.heads.styles import Style

POINTS = 7
TIP = 0.35  # of the width at the root, where a hair was never cut
LONG_MM = 60.0  # longer hair meets the body
PART_BESIDE_MM = 8.0  # how far a parting is felt, falling by e
FACE_DEG, FACE_UP_MM = 62.0, (-110.0, 35.0)  # azimuths and heights over the eyes of the face
ALONE_MM, ALONE = 5.0, 30  # with fewer points of other strands so near a strand hangs alone


@dataclass(frozen=True)
class Scalp:
    """The fine triangles that roots are drawn on."""

    positions: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    masks: np.ndarray

    def column(self, name: str) -> np.ndarray:
        return self.masks[:, MASKS.index(name)]


@dataclass(frozen=True)
class Roots:
    """points, normals (S, 3); vertex (S,) nearest corner; weight (S, 3) and corner (S, 3) of the
    triangle.
    """

    points: np.ndarray
    normals: np.ndarray
    vertex: np.ndarray
    corners: np.ndarray
    weights: np.ndarray

    def at(self, values: np.ndarray) -> np.ndarray:
        """Per-vertex values (N, ...) interpolated at the roots."""
        return np.einsum("sk,sk...->s...", self.weights, values[self.corners])


def scatter_roots(scalp: Scalp, density: np.ndarray, count: int, rng: np.random.Generator) -> Roots:
    """`count` roots with probability proportional to area times density (N,)."""
    shares = triangle_areas(scalp.positions, scalp.faces) * density[scalp.faces].mean(axis=1)
    triangles, weights = points_on(shares, rng.random(count), rng)
    return _roots(scalp, scalp.faces[triangles], weights)


def _roots(scalp: Scalp, corners: np.ndarray, weights: np.ndarray) -> Roots:
    points = np.einsum("sk,skj->sj", weights, scalp.positions[corners])
    normals = np.einsum("sk,skj->sj", weights, scalp.normals[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertex = corners[np.arange(len(corners)), weights.argmax(axis=1)]
    return Roots(points, normals, vertex, corners, weights)


def _tangential(vector: np.ndarray, normals: np.ndarray) -> np.ndarray:
    flat = vector - normals * (vector * normals).sum(axis=1, keepdims=True)
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-6)


def straight(
    roots: Roots,
    flow: np.ndarray,
    length: np.ndarray,
    lift: np.ndarray,
    bend: np.ndarray,
    rng: np.random.Generator,
    frizz: float = 0.0,
    points: int = POINTS,
    towards: np.ndarray | None = None,
) -> np.ndarray:
    """Short strands (S, points, 3): start `lift` radians above the skin along `flow` (S, 3), and
    lie down by `bend` radians; `towards` (S, 3): where along the skin their tips point, else as
    they start.
    """
    s = np.linspace(0, 1, points)
    angle = lift[:, None] - bend[:, None] * s[None]
    along = flow[:, None]
    if towards is not None:
        along = (1 - s)[:, None] * along + s[:, None] * towards[:, None]
        along = along / np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-6)
    step = np.cos(angle)[..., None] * along + np.sin(angle)[..., None] * roots.normals[:, None]
    if frizz:
        step += (
            frizz * np.cumsum(rng.normal(size=(len(length), points, 3)), axis=1) / np.sqrt(points)
        )
    step *= (length / (points - 1))[:, None, None]
    offsets = np.concatenate(
        [np.zeros((len(length), 1, 3)), np.cumsum(step[:, :-1], axis=1)], axis=1
    )
    return roots.points[:, None] + offsets


def _noise(p: np.ndarray, scale: float, phase: float) -> np.ndarray:
    """Smooth vector field (N, 3) in about [-1, 1]."""
    q = p / scale + phase
    return (
        np.stack(
            [
                np.sin(q @ [1.0, 1.7, -0.6]) + 0.7 * np.sin(q @ [-2.1, 0.9, 1.4] + 1),
                np.sin(q @ [0.8, -1.2, 1.9] + 2) + 0.7 * np.sin(q @ [1.9, 1.6, 0.4]),
                np.sin(q @ [1.5, 0.7, 1.1] + 4) + 0.7 * np.sin(q @ [-0.6, 2.3, -1.3] + 3),
            ],
            axis=1,
        )
        / 1.5
    )


def _pack(points, width, colour, cover, vertex) -> dict:
    return {
        "points": points,
        "width_mm": width,
        "colour": colour,
        "cover": cover,
        "root_vertex": vertex,
    }


def pigmented(own: Hair, tone: np.ndarray, drawn: np.ndarray, grey: float) -> np.ndarray:
    """Colours (S, 3): the person's, lighter or darker by exp(tone) (S,), of which strands lack
    their pigment by the share `grey` on average; drawn (S,): evenly in [0, 1].

    Follicles cease one by one and over years, so that strands between full and bare are found
    beside both: what a strand holds has a beta distribution, the more of one mind the larger
    grey_mixed. A fibre absorbs by Beer's law: half the pigment leaves the root of the light.
    """
    full = np.array(own.colour) * np.exp(tone)[:, None]
    bare = np.array(own.grey_colour) * np.exp(own.grey_lightness * tone)[:, None]
    if not 0 < grey < 1:
        return np.clip(bare if grey else full, 0.0, 0.95)
    held = betaincinv(own.grey_mixed * (1 - grey), own.grey_mixed * grey, drawn)[:, None]
    return np.clip(full**held * np.minimum(bare, 0.95) ** (1 - held), 0.0, 0.95)


def scalp_hair(
    scalp: Scalp, eyes: np.ndarray, rng: np.random.Generator, share: float, own: Hair
) -> list[dict]:
    """The hair of the scalp by the person's style, and the fine short hair of the hairline."""
    style, mask = own.style, scalp.column("hair")
    if not own.scalp or not mask.any():
        return []
    around = scalp.positions
    rough = mask + 0.22 * _noise(around, 2.6, 0.3)[:, 0] + 0.20 * _noise(around, 6.0, 1.0)[:, 1]
    rough += 0.14 * _noise(around, 15.0, rng.uniform(0, 6))[:, 2]
    sides = np.where(around[:, 0] < style.part_mm, -1.0, 1.0)
    says = growth.combed(style, around, eyes, sides)
    density = smoothstep(0.10, 0.95, rough) * (mask > 0.02) * says.density
    # beside a parting few strands lie over the scalp: there roots are denser
    density *= 1 + style.part_dense * _beside_parting(style, around, eyes)
    roots = scatter_roots(scalp, density, int(own.scalp * share), rng)
    skin, longest = _around(scalp, mask, own), own.scalp_length
    groups = [_styled(roots, skin, scalp, eyes, rng, share, own)]
    baby = np.clip(1 - np.abs(rough - 0.22) / 0.22, 0, 1) * (mask > 0.004) * says.density
    count = int(style.baby_hairs * share)
    if count and baby.sum() > 0:
        roots = scatter_roots(scalp, baby, count, rng)
        at = growth.combed(style, roots.points, eyes, _sides(style, roots.points))
        flow = at.comb + 0.35 * rng.normal(size=(count, 3))
        length = np.minimum(rng.gamma(3.0, 2.6, count) + 1.5, 0.8 * longest * at.length + 1.0)
        lift = np.radians(rng.uniform(6, 28, count))
        points = straight(
            roots, _tangential(flow, roots.normals), length, lift, 1.4 * lift, rng, frizz=0.10
        )
        tone = own.lightness * rng.normal(size=count) + 0.35
        groups.append(
            _pack(
                points,
                own.width_mm * rng.uniform(0.35, 0.65, count),
                pigmented(own, tone, rng.random(count), own.grey),
                np.full((count, POINTS), 0.1),
                roots.vertex,
            )
        )
    return groups


def _sides(style: Style, points: np.ndarray) -> np.ndarray:
    wander = 0.7 * _noise(points, 6.0, 2.0)[:, 0]
    return np.where(points[:, 0] + wander < style.part_mm, -1.0, 1.0)


def _around(scalp: Scalp, mask: np.ndarray, own: Hair) -> growth.Grid:
    """Distances from the skin wherever the hair may hang."""
    haired = scalp.positions[mask > 0.02]
    longest = own.scalp_length * max(row[2] for row in own.style.anchors)
    pad = np.minimum(longest, 45.0) + 8.0
    low, high = haired.min(axis=0) - pad, haired.max(axis=0) + pad
    low[1] -= max(longest - 60.0, 0.0)
    near = ((scalp.positions > low - 40) & (scalp.positions < high + 40)).all(axis=1)
    return growth.distances(scalp.positions[near], scalp.normals[near], low, high)


def _styled(roots: Roots, skin, scalp: Scalp, eyes, rng, share: float, own: Hair) -> dict:
    style, p, n = own.style, roots.points, roots.normals
    if style.part_reach_mm:  # skin shows in the parting
        off = (p[:, 0] + 0.7 * _noise(p, 6.0, 2.0)[:, 0] - style.part_mm) / style.part_gap_mm
        bare = np.exp(-(off**2)) * growth.parting_nearness(style, p, eyes)
        kept = rng.random(len(p)) >= bare
        fields = (roots.points, roots.normals, roots.vertex, roots.corners, roots.weights)
        roots = Roots(*(values[kept] for values in fields))
        p, n = roots.points, roots.normals
    count, sides = len(p), _sides(style, p)
    says, whole = growth.combed(style, p, eyes, sides), roots.at(scalp.column("hair"))
    # draws of locks, tufts and strands
    tuft = growth.nearest_of(p, sides, max(1, int(style.tufts * share)), rng)
    tufts, own_tuft = np.unique(tuft, return_inverse=True)
    many = max(1, int(style.locks * share))
    lock = growth.nearest_of(p[tufts], sides[tufts], many, rng)[own_tuft]

    def draw(a: float, b: float, c: float, *shape: int) -> np.ndarray:
        """Normal, with so much of locks, tufts and strands (S, ...)."""
        one, two = (rng.normal(size=(len(tufts), *shape)) for _ in range(2))
        return a * one[lock] + b * two[own_tuft] + c * rng.normal(size=(count, *shape))

    fly = rng.random(count) < style.flyaways
    turn = np.tan(np.radians(style.stray_deg)) * draw(0.45, 0.45, 0.40, 3)
    turn[fly] *= 2.5
    edge = style.edge + (1 - style.edge) * smoothstep(0.05, 0.8, whole)
    spread = np.clip(0.5 + 0.28 * draw(0.35, 0.5, 0.8), 0, 1)
    length = own.scalp_length * says.length * edge
    length = np.maximum(length * (style.shortest + (1.12 - style.shortest) * spread), 0.3)
    deep = rng.random(count)  # where in the layer
    height = says.height * np.clip(0.15 + 0.85 * deep + 0.16 * draw(0.8, 0.6, 0.0), 0.05, 1.3)
    height = np.where(fly, says.height * rng.uniform(0.9, 1.9, count) + 1.0, height)
    height *= 0.35 + 0.65 * smoothstep(0.1, 0.9, whole)
    beside = style.part_lift_deg * _beside_parting(style, p, eyes)
    lift = style.lift_deg + beside + 9 * draw(0.5, 0.5, 0.7)
    lift = np.radians(np.clip(lift, 3, 88))
    points = style.points
    curves = growth.grow(style, skin, eyes, p, n, sides, length, height, turn, lift, points)
    # tufts gather in locks, strands in tufts
    s = np.linspace(0, 1, points)
    led, of_lock = curves[tufts], np.searchsorted(tufts, tufts[lock])
    first_of = np.zeros(len(tufts), int)
    first_of[own_tuft] = of_lock
    apiece = smoothstep(3.0, 34.0, length) if not style.coil else np.ones(count)
    drawn = style.gather_locks * apiece[tufts][:, None] * s**1.2
    led = growth.gather(led, p[tufts], first_of, drawn)
    share_of = style.gather_tufts * apiece[:, None, None] * (s**0.8)[None, :, None]
    loose = np.where(fly, 0.25, 1.0)[:, None, None]
    for part in parts(count, growth.STRANDS):
        leader, some = own_tuft[part], curves[part]
        apart = (p[part] - p[tufts][leader])[:, None] * (1 - 0.7 * s)[None, :, None]
        some += loose[part] * share_of[part] * (led[leader] + apart - some)
    curves = _waved(curves, style, length, draw, rng, skin)
    curves, at = _out_of_the_head(curves, skin, 4)
    if length.max() > LONG_MM:  # what met the body has corners
        del at
        for part in parts(count, growth.STRANDS):
            some = curves[part]
            for _ in range(3):
                some[:, 2:-1] += 0.25 * (some[:, 1:-2] - 2 * some[:, 2:-1] + some[:, 3:])
        curves, at = _out_of_the_head(curves, skin, 2)
    curves[:, 0] = p
    width = own.width_mm * np.clip(1 + own.width_uneven * rng.normal(size=count), 0.4, 1.6)
    width *= 0.6 + 0.4 * smoothstep(0.05, 0.6, whole)
    width[fly] *= own.fly_width  # they are the new and the broken ones
    tone = own.lightness * draw(0.35, 0.45, 0.8)
    colours = pigmented(own, tone, rng.random(count), own.grey)
    cover = growth.covered(curves, width / share, at[:, 1:])
    del at
    tip = np.full(count, 0.8 if length.mean() < 15 else 0.5)
    kept = ~alone_before_the_face(curves, eyes, share)
    whole_lot = {**_pack(curves, width, colours, cover, roots.vertex), "tip": tip}
    return {name: values[kept] for name, values in whole_lot.items()}


def _out_of_the_head(curves: np.ndarray, skin: growth.Grid, times: int):
    """Curves (S, P, 3) pushed along the skin's slopes, which turn on the way, and what the grid
    says of their points (S P, 4).
    """
    s = np.linspace(0, 1, curves.shape[1])
    flat = curves.reshape(-1, 3)
    keep_off = np.tile(growth.CLEAR_MM * np.minimum(8 * s, 1.0), len(curves))
    at, deep = skin.at(flat), np.arange(len(flat))
    for _ in range(times):
        deep = deep[at[deep, 0] < keep_off[deep] - 0.02]
        flat[deep] += (keep_off[deep] - at[deep, 0])[:, None] * at[deep, 1:]
        at[deep] = skin.at(flat[deep])
    return flat.reshape(curves.shape), at


def _beside_parting(style: Style, p: np.ndarray, eyes: np.ndarray) -> np.ndarray:
    """How much of the parting points (N, 3) feel, (N,) in [0, 1]."""
    away = np.abs(p[:, 0] - style.part_mm)
    return growth.parting_nearness(style, p, eyes) * np.exp(-away / PART_BESIDE_MM)


def alone_before_the_face(curves: np.ndarray, eyes: np.ndarray, share: float) -> np.ndarray:
    """Which strands (S, P, 3) pass before the face with few others beside them (S,): a bundle may
    hang there, a single hair reads as a wire.
    """
    flat = curves.reshape(-1, 3)
    up = flat[:, 1] - eyes[1]
    before = (azimuth(flat) < FACE_DEG) & (up < FACE_UP_MM[1]) & (up > FACE_UP_MM[0])
    alone = np.zeros(len(flat), bool)
    if before.any():
        there = flat[before]
        beside = cKDTree(there).query_ball_point(there, ALONE_MM, return_length=True)
        alone[before] = beside < max(2.0, ALONE * share)
    return alone.reshape(curves.shape[:2]).any(axis=1)


def _waved(curves, style: Style, length, draw, rng, skin) -> np.ndarray:
    """Waves across the strands, coils, and each strand's own wandering, added to curves."""
    count, points = curves.shape[:2]
    s = np.linspace(0, 1, points)
    phase = 2 * np.pi * length[:, None] * s / style.wave_length_mm
    phase = phase * (1 + 0.12 * draw(0.4, 0.6, 0.5))[:, None] + draw(3.0, 1.0, 0.35)[:, None]
    size = style.wave_mm * np.clip(1 + 0.3 * draw(0.5, 0.6, 0.5), 0.2, 2.0)
    size = size * np.minimum(length / (1.5 * style.wave_length_mm), 1.0)
    size = size[:, None] * np.minimum(s * length[:, None] / (0.5 * style.wave_length_mm), 1.0)
    swing = size * (np.cos(phase) - np.cos(phase[:, :1]))
    coil = style.coil * size * (np.sin(phase) - np.sin(phase[:, :1]))
    wander, turn = rng.normal(size=(count, 1, 3)), rng.uniform(0, 2 * np.pi, (count, 1, 3))
    for part in parts(count, growth.STRANDS):
        some = curves[part]
        along = np.gradient(some, axis=1)
        along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-9)
        out = skin.at(some.reshape(-1, 3))[:, 1:].reshape(some.shape)
        across = np.cross(along, out)
        across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)
        off = np.cross(across, along)
        own = style.frizz_mm * s[:, None] * wander[part]
        own = own * (0.6 + np.sin(turn[part] + 5.0 * s[None, :, None]))
        curves[part] = some + swing[part, :, None] * across + coil[part, :, None] * off + own
    return curves


class Projector:
    """Drops points of the face plane (x, y) onto the skin along -z."""

    def __init__(self, scalp: Scalp):
        self._scalp = scalp
        self._mesh = trimesh.Trimesh(scalp.positions, scalp.faces, process=False, validate=False)
        self._rays = trimesh.ray.ray_pyembree.RayMeshIntersector(self._mesh)

    def roots(self, xy: np.ndarray) -> Roots:
        origin = np.column_stack([xy, np.full(len(xy), 400.0)])
        face = self._rays.intersects_first(origin, np.tile([0.0, 0.0, -1.0], (len(xy), 1)))
        if (face < 0).any():
            raise ValueError("a brow root misses the face; the landmarks do not fit this head")
        corners = self._scalp.faces[face]
        a, b, c = (self._scalp.positions[corners[:, k], :2] for k in range(3))
        area = lambda p, q, r: (
            (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])
        )
        whole = area(a, b, c)
        weights = (
            np.column_stack([area(xy, b, c), area(a, xy, c), area(a, b, xy)])
            / np.where(np.abs(whole) < 1e-12, 1e-12, whole)[:, None]
        )
        return _roots(self._scalp, corners, np.clip(weights, 0, 1))


def brows(scalp: Scalp, eye_centres, rng: np.random.Generator, count: int, own: Hair) -> list[dict]:
    """Each brow follows an arc over its eye: tapered hairs that stand up at the nose, turn outwards
    along the body, lean down from the upper edge and up from the lower, so that they meet in a
    ridge, and grow fewer towards the tail; between them fine, short, pale ones. Both differ.
    """
    project, out = Projector(scalp), []
    for centre in eye_centres:
        side = np.sign(centre[0])
        uneven = own.brow_uneven * rng.normal(size=5)
        low, arch = own.brow_low_mm + 0.5 * uneven[0], own.brow_arch_mm * (1 + 0.10 * uneven[1])
        long, peak = own.brow_length_mm * (1 + 0.03 * uneven[2]), own.brow_peak + 0.04 * uneven[3]
        turn = 0.07 * uneven[4]
        phase = rng.uniform(0, 2 * np.pi, 3)

        def arc(u, low=low, arch=arch, peak=peak):
            """Height of the brow's middle, mm: up to the peak, and down from it."""
            rise = 1.1 * smoothstep(-0.30, peak, u) - 0.10
            return low + arch * rise - (0.5 * arch + 4.0) * smoothstep(peak - 0.08, 1.15, u)

        fine = rng.random(count + int(own.brow_fine * count)) >= 1 / (1 + own.brow_fine)
        many = len(fine)
        u = rng.uniform(-0.03, 1.0, 8 * many)
        there = smoothstep(-0.04, 0.16, u) * (1 - (1 - own.brow_tail) * smoothstep(0.60, 1.0, u))
        u = u[rng.random(len(u)) < there][:many]
        half = own.brow_half_mm * (1 - 0.60 * smoothstep(0.42, 1.0, u))
        half = half * (0.70 + 0.30 * smoothstep(-0.05, 0.30, u))
        half = half * (1 + 0.09 * np.sin(9 * u + phase[0]) + 0.07 * np.sin(23 * u + phase[1]))
        v = rng.normal(size=many) * np.where(fine, 0.60, 0.46)
        v = np.clip(np.where(rng.random(many) < 0.05, 1.9 * v, v), -1.6, 1.6)
        x = own.brow_inner_mm + long * u
        roots = project.roots(
            np.column_stack([centre[0] + side * x, centre[1] + arc(u) + half * v])
        )
        along = np.arctan2(arc(u + 0.02) - arc(u - 0.02), 0.04 * long)
        head, tail = 1 - smoothstep(0.0, 0.34, u), smoothstep(0.55, 1.0, u)
        tilt = along + turn + np.radians(14 + 58 * head - 28 * tail)
        tilt = tilt - np.radians(30) * (1 - 0.6 * head) * (1 - 0.4 * tail) * v
        tilt = tilt + 0.10 * np.sin(31 * u + 4 * v + phase[2]) + 0.16 * rng.normal(size=many)
        ends = tilt - np.radians(rng.uniform(4, 34, many)) * (0.5 + head) * np.sign(v + 0.6)

        def on_skin(angle, roots=roots, side=side):
            flat = np.column_stack([side * np.cos(angle), np.sin(angle), 0 * angle])
            return _tangential(flat, roots.normals)

        length = own.brow_hair_mm * np.clip(0.80 + 0.16 * rng.normal(size=many), 0.4, 1.2)
        length = length * (0.62 + 0.38 * smoothstep(-0.02, 0.30, u)) * (1 - 0.40 * tail)
        length = length * np.where(fine, rng.uniform(0.30, 0.62, many), 1.0)
        length = length * (1 - 0.30 * np.clip(np.abs(v) - 0.7, 0, 1))
        lift = np.radians(np.where(fine, rng.uniform(4, 14, many), rng.uniform(9, 24, many)))
        points = straight(
            roots, on_skin(tilt), length, lift, 1.3 * lift, rng, frizz=0.05, towards=on_skin(ends)
        )
        width = own.brow_width_mm * np.clip(1 + 0.18 * rng.normal(size=many), 0.6, 1.5)
        width = width * (1 - 0.35 * np.clip(np.abs(v) - 0.6, 0, 1)) * (1 - 0.40 * tail)
        tone = np.log(own.brow_light) + own.lightness * rng.normal(size=many) + 0.5 * fine
        packed = _pack(
            points,
            width * np.where(fine, 0.42, 1.0),
            pigmented(own, tone, rng.random(many), own.brow_grey * own.grey),
            np.where(fine, 0.6, 0.3)[:, None] * np.ones(POINTS),
            roots.vertex,
        )
        out.append({**packed, "tip": np.full(many, 0.12), "sheen": np.full(many, own.brow_sheen)})
    return out


def stubble(scalp: Scalp, rng: np.random.Generator, count: int, own: Hair) -> dict:
    """A beard of any length: cut hairs that leave the skin at a slant, down and outwards."""
    roots = scatter_roots(scalp, scalp.column("beard") ** 1.3, count, rng)
    p, shortest_longest = roots.points, own.stubble_mm
    out = np.sign(p[:, 0]) * smoothstep(4.0, 40.0, np.abs(p[:, 0]))
    flow = np.column_stack([0.45 * out, np.full(count, -1.0), np.full(count, 0.1)])
    flow += 0.35 * _noise(p, 14, 1.0) + 0.30 * rng.normal(size=p.shape)
    thick = roots.at(scalp.column("beard"))
    length = rng.uniform(*shortest_longest, count) * (0.55 + 0.45 * thick)
    flat = smoothstep(1.0, 8.0, length)
    lift = np.radians(rng.uniform(25, 62, count)) * (1 - 0.45 * flat)
    points = straight(
        roots, _tangential(flow, roots.normals), length, lift, 0.9 * lift * flat, rng, frizz=0.12
    )
    drawn = rng.random(count)
    packed = _pack(
        points,
        rng.uniform(0.055, 0.095, count),
        pigmented(own, np.log(1.2) + 1.2 * own.lightness * rng.normal(size=count), drawn, own.grey),
        np.clip(0.7 * flat[:, None] * (1 - np.linspace(0, 1, POINTS)), 0, 1),
        roots.vertex,
    )
    return {**packed, "tip": np.full(count, 0.9), "sheen": np.full(count, own.brow_sheen)}


def vellus(scalp: Scalp, eyes: np.ndarray, rng: np.random.Generator, count: int, own: Hair) -> dict:
    """Fine hair of the face, the ears and the neck: seen against the light, along the contour."""
    p = scalp.positions
    density = (
        (1 - scalp.column("hair"))
        * (1 - scalp.column("lips"))
        * (1 - scalp.column("inside"))
        * (1 - scalp.column("eyelid"))
        * smoothstep(-175, -120, p[:, 1] - eyes[1])
    )
    roots = scatter_roots(scalp, density, count, rng)
    out = np.sign(roots.points[:, 0]) * smoothstep(4.0, 40.0, np.abs(roots.points[:, 0]))
    flow = np.column_stack([0.5 * out, np.full(count, -1.0), np.full(count, -0.3)])
    flow += 0.4 * _noise(roots.points, 18, 7.0) + 0.3 * rng.normal(size=flow.shape)
    lift = np.radians(rng.uniform(20, 55, count))
    points = straight(
        roots,
        _tangential(flow, roots.normals),
        rng.uniform(*own.vellus_mm, count),
        lift,
        np.radians(np.full(count, 24.0)),
        rng,
        frizz=0.10,
        points=4,
    )
    colours = np.array(own.vellus_colour) * np.exp(0.25 * rng.normal(size=(count, 1)))
    width = own.vellus_width_mm * rng.uniform(0.8, 1.2, count)
    packed = _pack(points, width, colours, np.zeros((count, 4)), roots.vertex)
    return {**packed, "tip": np.full(count, 0.25)}


def all_strands(
    head: lashes.Lidded,
    scalp: Scalp,
    seed: int,
    share: float = 1.0,
    own: Hair | None = None,
    lash: Lashes | None = None,
) -> Strands:
    """Every strand of the head; share scales the numbers (tests use few)."""
    own, lash = own or Hair(), lash or Lashes()
    rng = np.random.default_rng([seed, 11])
    eyes = head.landmarks["eyes"]
    balls = [ball.centre for ball in head.eyes]
    parts = [
        *scalp_hair(scalp, eyes, rng, share, own),
        *brows(scalp, balls, rng, int(own.brows * share), own),
        *lashes.grown(head, scalp.positions, scalp.faces, rng, lash, own, POINTS),
        stubble(scalp, rng, int(own.stubble * share), own),
        vellus(scalp, eyes, rng, int(own.vellus * share), own),
    ]
    return joined(parts, own)


def joined(parts: list[dict], own: Hair) -> Strands:
    """Strands of several growths: points (S, P, 3), P one for each, and cover (S, P); what they do
    not say themselves is the person's.
    """
    counts = np.concatenate([np.full(len(p["points"]), p["points"].shape[1]) for p in parts])
    flat = {
        "points": [p["points"].reshape(-1, 3) for p in parts],
        "cover": [p["cover"].ravel() for p in parts],
        "tip": [p.get("tip", np.full(len(p["points"]), TIP)) for p in parts],
        "sheen": [p.get("sheen", np.full(len(p["points"]), own.sheen)) for p in parts],
        **{key: [p[key] for p in parts] for key in ("width_mm", "colour")},
    }
    return Strands(
        **{
            key: np.concatenate(each, dtype=np.float32, casting="same_kind")
            for key, each in flat.items()
        },
        first=np.concatenate([[0], np.cumsum(counts)]),
        root_vertex=np.concatenate([p["root_vertex"] for p in parts]).astype(np.int64),
        leaves_mm=own.leaves_mm,
        spread_deg=own.spread_deg,
    )
