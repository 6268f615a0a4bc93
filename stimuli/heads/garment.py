"""A shirt generated from the body: cloth that hangs over it, with a band along its neckline."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from renderer.scene import MASKS, Garment, Material, Proxy, Surface
from stimuli.heads.anatomy import Anatomy, Bust
from stimuli.heads.person import Clothes
from stimuli.heads.subdivide import vertex_normals

#: All on the base mesh without targets, mm above the eyes: where the neckline hangs from, and where
#: the head begins.
NECKLINE_TOP_MM, HEAD_MM = -138.0, -100.0
BACK_Z_MM, FRONT_Z_MM = 15.0, 65.0
DRAPE = 300  # rounds of smoothing: how widely cloth spans hollows
SPAN_MM = 30.0  # at most
EVENED = 60  # rounds of smoothing: how fine the body is through cloth
SHARE = 0.45  # of the room to the next part of the body
HIDDEN_MM = 25.0  # below the neckline: skin farther under the cloth is left out
BAND_STEP_MM = 0.7
RIB_MM, RIB_DEPTH_MM = 2.0, 0.10
TILE = 8  # stitches of the weave's map


def under(plain: np.ndarray, own: Clothes) -> np.ndarray:
    """How far below the neckline points (N, 3) of the base mesh without targets lie: 0 on it,
    negative in its opening, about 1 at twice its depth.
    """
    x, y, z = plain.T
    t = np.clip((z - BACK_Z_MM) / (FRONT_Z_MM - BACK_Z_MM), 0, 1)
    deep = own.back_mm + (own.front_mm - own.back_mm) * t * t * (3 - 2 * t)
    down = np.maximum(NECKLINE_TOP_MM - y, 0) / deep
    radius = ((np.abs(x) / own.half_mm) ** own.power + down**own.power) ** (1 / own.power)
    return np.where(y > HEAD_MM, -1.0, radius - 1)


def _clipped(bust: Bust, value: np.ndarray):
    """The part of a mesh where value (N,) is above 0, cut along its border.

    Returns the map (V', N) to its vertices, triangles, and which vertices lie on the cut (V',).
    """
    faces = bust.faces
    inside = value > 0
    count = inside[faces].sum(axis=1)
    tri = [faces[count == 3]]
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    sides = sides[inside[sides[:, 0]] != inside[sides[:, 1]]]
    size = len(value)
    low, high = sides.min(axis=1).astype(np.int64), sides.max(axis=1)
    keys = np.unique(low * size + high)
    edges = np.stack(np.divmod(keys, size), axis=1)

    def cut(a, b):
        key = np.minimum(a, b).astype(np.int64) * size + np.maximum(a, b)
        return size + np.searchsorted(keys, key)

    for k in range(3):
        a, b, c = (faces[:, (k + j) % 3] for j in range(3))
        one = (count == 1) & inside[a]
        tri.append(np.stack([a, _where(a, b, one, cut), _where(a, c, one, cut)], axis=1)[one])
        two = (count == 2) & ~inside[a]
        ab, ac = _where(a, b, two, cut), _where(a, c, two, cut)
        tri.append(np.stack([ab, b, c], axis=1)[two])
        tri.append(np.stack([ab, c, ac], axis=1)[two])
    tri = np.concatenate(tri)
    used, tri = np.unique(tri, return_inverse=True)
    t = value[edges[:, 0]] / (value[edges[:, 0]] - value[edges[:, 1]])
    rows = np.arange(len(edges))
    between = sparse.csr_matrix(
        (np.concatenate([1 - t, t]), (np.tile(rows, 2), edges.T.ravel())), (len(edges), size)
    )
    whole = sparse.vstack([sparse.identity(size, format="csr"), between]).tocsr()
    return whole[used], tri.reshape(-1, 3), used >= size


def _where(a, b, where, cut):
    """Cut points of the edges (a, b) where asked for, anything elsewhere."""
    result = np.zeros(len(a), np.int64)
    result[where] = cut(a[where], b[where])
    return result


def _neighbours(faces: np.ndarray, count: int) -> sparse.csr_matrix:
    """Means over the vertices that share an edge: (count, count)."""
    i, j = faces.ravel(), np.roll(faces, 1, axis=1).ravel()
    ends = (np.append(i, j), np.append(j, i))
    link = sparse.csr_matrix((np.ones(2 * len(i)), ends), (count, count))
    link.data[:] = 1
    return sparse.diags(1 / np.maximum(np.asarray(link.sum(axis=1)).ravel(), 1)) @ link


def _waves(plain: np.ndarray) -> np.ndarray:
    """The folds of hanging cloth in about [-1, 1] (N,): long ones down from the shoulders, and
    pulls towards each armpit. Ridges are sharper than valleys.
    """
    x, y, z = plain.T
    down = np.clip((NECKLINE_TOP_MM - y) / 120, 0, 1)
    hang = np.sin(x / 15 + 0.9 * np.sin(y / 41 + x / 90) + z / 50 + 0.7)
    hang = down * (1 - np.abs(hang)) ** 1.5
    out, up = np.abs(x) - 128, y + 222
    arm, turn = np.hypot(out, up), np.arctan2(up, out)
    pull = np.sin(4.5 * turn + 0.9 * np.sin(arm / 22) + 0.6 * np.sign(x))
    pull = (1 - np.abs(pull)) ** 1.4 * np.exp(-(((arm - 50) / 48) ** 2))
    fine = np.sin(x / 6.1 + y / 23 + np.sin(y / 17)) * np.sin(y / 31 - x / 44)
    return 1.1 * hang + 2.0 * pull + 0.18 * fine - 0.6


def _room(points: np.ndarray, normals: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """How far it is along the normals (N, 3) to the next part of the same surface, mm (N,)."""
    import trimesh

    mesh = trimesh.Trimesh(points, faces, process=False, validate=False)
    rays = trimesh.ray.ray_pyembree.RayMeshIntersector(mesh)
    start = points + 0.2 * normals
    places, ray, _ = rays.intersects_location(start, normals, multiple_hits=False)
    room = np.full(len(points), np.inf)
    room[ray] = np.linalg.norm(places - start[ray], axis=1)
    # neighbours are as near: the least of them
    for _ in range(3):
        least = room.copy()
        for k in range(3):
            np.minimum.at(least, faces[:, k], room[faces[:, k - 1]])
        room = least
    return room


def _cloth(bust: Bust, own: Clothes):
    """Positions (V, 3), normals, triangles, which vertices lie on the neckline, and the map from
    the bust's vertices.
    """
    value = under(bust.plain, own)
    carry, faces, border = _clipped(bust, value)
    skin, plain = carry @ bust.positions, carry @ bust.plain
    mean = _neighbours(faces, len(skin))
    room = _room(skin, vertex_normals(skin, faces), faces)
    # what is fine on the body does not show through: cloth hangs over an evened one
    body = drape = skin
    for k in range(DRAPE):
        drape = np.where(border[:, None], skin, mean @ drape)
        body = drape if k < EVENED else body
    normals = vertex_normals(body, faces)
    for _ in range(6):
        normals = 0.5 * normals + 0.5 * (mean @ normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    out = ((skin - body) * normals).sum(axis=1)
    span = np.clip(((drape - body) * normals).sum(axis=1), 0, SPAN_MM)
    ease = own.ease_mm + span
    far = own.front_mm * (carry @ value)  # about mm below the neckline
    ease += own.loose_mm * (1 - np.exp(-((np.maximum(far, 0) / 70) ** 1.5)))
    ease += own.folds_mm * np.clip((far - 8) / 50, 0, 1) * (0.5 + 0.5 * _waves(plain))
    ease = np.maximum(ease, out + own.ease_mm)
    for _ in range(4):
        ease = np.where(border, own.ease_mm, 0.5 * ease + 0.5 * (mean @ ease))
    # arm and chest share the room between them
    above = np.minimum(np.maximum(ease - out, own.ease_mm), np.maximum(SHARE * room, 0.3))
    points = skin + above[:, None] * normals
    return points, vertex_normals(points, faces), faces, border, carry


def _loop(faces: np.ndarray, border: np.ndarray) -> np.ndarray:
    """The vertices of the border's longest ring, in order (K,)."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    sides = sides[border[sides].all(axis=1)]
    low, high = sides.min(axis=1).astype(np.int64), sides.max(axis=1)
    _, first, count = np.unique(
        low * (int(faces.max()) + 1) + high, return_index=True, return_counts=True
    )
    after = dict(sides[first[count == 1]].tolist())
    best: list[int] = []
    while after:
        start, ring = next(iter(after)), []
        while start in after:
            ring.append(start)
            start = after.pop(start)
        best = max(best, ring, key=len)
    return np.array(best)


def _band(points: np.ndarray, normals: np.ndarray, own: Clothes, cloth, cloth_normals):
    """The neckline's band: a strip along the ring (K, 3), rolled over its edge: positions (V, 3),
    triangles, (along, across) mm (V, 2).
    """
    ring = np.vstack([points, points[:1]])
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1)))
    count = int(length[-1] / BAND_STEP_MM)
    at = length[-1] * np.arange(count) / count
    # a seam is smoother than the triangles that it cuts
    line = np.column_stack([np.interp(at, length, ring[:, k]) for k in range(3)])
    up = np.vstack([normals, normals[:1]])
    up = np.column_stack([np.interp(at, length, up[:, k]) for k in range(3)])
    window = np.hanning(int(26 / BAND_STEP_MM) | 1)
    window /= window.sum()
    half = len(window) // 2

    def even(v):
        v = np.vstack([v[-half:], v, v[:half]])
        return np.column_stack([np.convolve(v[:, k], window, mode="valid") for k in range(3)])

    line, up = even(line), even(up)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    tangent = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    into = np.cross(up, tangent)
    tree = cKDTree(cloth)
    _, near = tree.query(line + 8 * into)
    _, far = tree.query(line - 8 * into)
    away = (np.linalg.norm(cloth[far] - line + 8 * into, axis=1)).mean()
    if away < (np.linalg.norm(cloth[near] - line - 8 * into, axis=1)).mean():
        into = -into
    thick, wide = own.hem_thick_mm, own.hem_mm
    low = 0.4 - own.ease_mm
    # across the band and above the cloth: from below, over the edge, to the stitches and down
    profile = [(4.0, low), (0.3, low), (-0.5, 0.5 * low), (-0.6, 0.3 * thick), (0.0, thick)]
    shares = (0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 0.97)
    profile += [(wide * t, (1.4 + 0.2 * t) * thick) for t in shares]
    profile += [(wide, 1.4 * thick), (wide + 0.3, -0.4)]
    rib = RIB_DEPTH_MM * np.sin(2 * np.pi * at / RIB_MM)
    rows = []
    for across, above in profile:
        spot = line + across * into
        _, which = tree.query(spot, k=4)
        normal = cloth_normals[which].mean(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        off = ((spot - cloth[which].mean(axis=1)) * normal).sum(axis=1)
        # near the ring its own surface, farther away the cloth's
        share = np.clip(across / 4, 0, 1)
        laid = spot - share * off[:, None] * normal
        # the nearest triangles change in steps along a row
        laid = even(laid)
        normal = even((1 - share) * up + share * normal)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        height = above + (rib if above > 0 and across > 0 else 0)
        rows.append(laid + (np.zeros(count) + height)[:, None] * normal)
    grid = np.array(rows)  # (R, K, 3)
    i, k = np.meshgrid(np.arange(len(rows) - 1), np.arange(count), indexing="ij")
    a, b = i * count + k, i * count + (k + 1) % count
    c, d = a + count, b + count
    faces = np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3), np.stack([b, d, c], axis=2).reshape(-1, 3)]
    )
    flat = grid.reshape(-1, 3)
    outward = vertex_normals(flat, faces).reshape(grid.shape)[6]
    if (outward * up).sum(axis=1).mean() < 0:
        faces = faces[:, ::-1]
    across = np.cumsum(np.append(0, np.linalg.norm(np.diff(grid, axis=0), axis=2).mean(axis=1)))
    place = np.stack(np.broadcast_arrays(at[None, :], across[:, None]), axis=2).reshape(-1, 2)
    return flat, faces, place


def weave(pixels: int = 128) -> np.ndarray:
    """A tile of TILE x TILE knitted stitches as a normal map, (pixels, pixels, 3) uint8."""
    v, u = np.meshgrid(*(2 * (np.arange(pixels) / pixels * TILE,)), indexing="ij")
    x = (u % 1) - 0.5
    # two legs of a V a stitch
    leg = np.abs(np.abs(x) - 0.25)
    height = 0.20 * np.cos(2 * np.pi * leg) + 0.16 * np.cos(2 * np.pi * (v + 1.6 * np.abs(x)))
    slope = [
        (np.roll(height, -1, axis) - np.roll(height, 1, axis)) * pixels / TILE / 2
        for axis in (1, 0)
    ]
    normal = np.stack([-0.35 * slope[0], 0.35 * slope[1], np.ones_like(height)], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.rint(255 * (0.5 + 0.5 * normal)).astype(np.uint8)


def material(own: Clothes) -> Material:
    """Cloth: nothing scatters below it."""
    return Material(
        medium="",
        albedo=own.colour,
        roughness=own.roughness,
        f0=0.04,
        specular=own.specular,
        lobe_share=0.0,
    )


def shirt(anatomy: Anatomy, own: Clothes) -> Surface:
    """The shirt of an anatomy as a surface; light is baked on one cut from the coarse bust."""
    points, normals, faces, border, carry = _cloth(anatomy.fine, own)
    ring = _loop(faces, border)
    band, band_faces, place = _band(points[ring], normals[ring], own, points, normals)
    coarse_points, coarse_normals, coarse_faces, _, _ = _cloth(anatomy.coarse, own)

    # texture coordinates: the skin's, scaled to stitches; along and across the band
    uv_of = np.zeros((len(anatomy.fine.positions), 2))
    uv_of[anatomy.fine.faces.ravel()] = anatomy.fine.uvs[anatomy.fine.uv_faces.ravel()]
    uvs = carry @ uv_of
    sides = faces[:, [0, 1]]
    on_map = np.linalg.norm(np.diff(uvs[sides], axis=1), axis=2).ravel()
    on_body = np.linalg.norm(np.diff(points[sides], axis=1), axis=2).ravel()
    scale = np.median(on_body / np.maximum(on_map, 1e-9)) / (TILE * own.weave_mm)
    uvs = np.vstack([uvs * scale, place / (TILE * own.weave_mm)])

    everything = np.vstack([points, band])
    towards = np.vstack([normals, vertex_normals(band, band_faces)])
    _, near = cKDTree(np.hstack([coarse_points, 8 * coarse_normals])).query(
        np.hstack([everything, 8 * towards]), k=3
    )
    rows = np.repeat(np.arange(len(everything)), 3)
    to_full = sparse.csr_matrix(
        (np.full(rows.size, 1 / 3), (rows, near.ravel())), (len(everything), len(coarse_points))
    )
    albedo = np.tile(np.array(own.colour, float), (len(coarse_points), 1))
    proxy = Proxy(coarse_points, coarse_normals, coarse_faces, albedo, to_full)
    return Surface(
        everything.astype(np.float32),
        towards.astype(np.float32),
        uvs.astype(np.float32),
        np.vstack([faces, band_faces + len(points)]).astype(np.uint32),
        np.zeros((len(everything), len(MASKS)), np.float32),
        proxy,
        scatters=np.zeros(len(everything)),
    )


def dressed(surface: Surface, own: Clothes) -> Garment:
    """A shirt with its cloth's material."""
    from dataclasses import replace

    return Garment(replace(surface, maps={"normal_map": weave()}), material(own))


def bare(bust: Bust, own: Clothes) -> np.ndarray:
    """Which triangles (F,) bool of a bust may be seen: not far below a garment."""
    hidden = under(bust.plain, own) > HIDDEN_MM / own.front_mm
    return ~hidden[bust.faces].all(axis=1)
