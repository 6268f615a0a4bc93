"""From a user's scan to the renderer's model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from renderer.scene import MASKS, Eye, Material, Model, Proxy, Surface
from stimuli.errors import InputError
from stimuli.heads import eyes, template
from stimuli.heads.formats import decode_srgb
from stimuli.heads.lids import Eyeball, clear, opening, seated
from stimuli.heads.person import Eyes, Person
from stimuli.heads.scan_hair import grown
from stimuli.heads.subdivide import vertex_normals

PROXY_LIMIT = 60_000  # vertices: above it light is baked on a clustered mesh
CLUSTER_MM = 3.0
SKIN_COLOUR = (0.56, 0.38, 0.30)  # linear albedo of a scan without any colour of its own
EYES_BELOW_CROWN_MM = 112.0  # half an adult head's height: of a head whose face is not found
MATCH_MM = (
    12.0  # how far apart surfaces count that face a radian apart, where masks are carried over
)
EYE_MM = 12.0  # radius of a ball, for an average head
LOOK_DEG = (-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0)  # to where lids are kept off the cornea
DEEP_MM = 3.0  # what lies so far inside a ball is its socket, no lid
OPEN_MM = 4.0  # so far behind the face about it a socket is open
LEVELS = 3  # of subdivision, at most
FINE_LIMIT = 250_000  # faces: no finer above


def _clustered(
    positions: np.ndarray, normals: np.ndarray, faces: np.ndarray, albedo: np.ndarray
) -> Proxy:
    """A proxy of one vertex per CLUSTER_MM cell; each full vertex takes its light from the three
    nearest that face its way.
    """
    from scipy.spatial import cKDTree

    cell = np.floor(positions / CLUSTER_MM).astype(np.int64)
    _, of = np.unique(np.column_stack([cell, normals > 0]), axis=0, return_inverse=True)
    of = of.ravel()
    count = of.max() + 1
    mean = sparse.csr_matrix((np.ones(len(of)), (of, np.arange(len(of)))), (count, len(of)))
    mean = sparse.diags(1 / np.asarray(mean.sum(axis=1)).ravel()) @ mean
    small = of[faces]
    small = small[
        (small[:, 0] != small[:, 1]) & (small[:, 1] != small[:, 2]) & (small[:, 2] != small[:, 0])
    ]
    centre, normal = mean @ positions, mean @ normals
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    _, near = cKDTree(np.hstack([centre, 4 * CLUSTER_MM * normal])).query(
        np.hstack([positions, 4 * CLUSTER_MM * normals]), k=3
    )
    rows = np.repeat(np.arange(len(positions)), 3)
    return Proxy(
        centre,
        normal,
        small,
        mean @ albedo,
        sparse.csr_matrix(
            (np.full(rows.size, 1 / 3), (rows, near.ravel())), (len(positions), count)
        ),
    )


def _landmarks(scan, p: np.ndarray, eye_points, balls) -> dict[str, np.ndarray]:
    """Where eyes, nose and mouth of an upright head that looks along +z are: given ones, those of
    its eye parts (N, 3) or of the balls that it got, and of the face that was found, else its
    proportions.
    """
    fit = scan.placing.fit
    if fit is None:
        marks = _by_proportions(p)
    else:
        shape = template.load().landmarks
        marks = {name: scan.placing.place(fit.place(at)) for name, at in shape.items()}
        near = p[np.linalg.norm(p - marks["nose"], axis=1) < 12]
        if len(near):  # its tip is the foremost point about there
            marks["nose"] = near[near[:, 2].argmax()]
        about = p[np.linalg.norm((p - marks["crown"])[:, [0, 2]], axis=1) < 60]
        if len(about):
            marks["crown"] = about[about[:, 1].argmax()]
    if eye_points is not None:
        middle = marks["eyes"][0]
        apart = np.array([np.abs(eye_points[:, 0] - middle).mean(), 0, 0])
        eyes = np.array([middle, eye_points[:, 1].mean(), eye_points[:, 2].mean()])
        marks |= {"eyes": eyes, "eye_l": eyes + apart, "eye_r": eyes - apart}
    elif balls:
        both = [ball.centre for ball in balls]
        marks |= {"eyes": 0.5 * (both[0] + both[1]), "eye_l": both[0], "eye_r": both[1]}
    marks |= scan.placing.landmarks
    if {"eye_l", "eye_r"} & set(scan.placing.landmarks):
        marks["eyes"] = 0.5 * (marks["eye_l"] + marks["eye_r"])
    return marks


def _by_proportions(p: np.ndarray) -> dict[str, np.ndarray]:
    crown = p[:, 1].max()
    head = p[p[:, 1] > crown - 200]
    middle = 0.5 * (np.quantile(head[:, 0], 0.01) + np.quantile(head[:, 0], 0.99))
    face = head[(np.abs(head[:, 0] - middle) < 15) & (head[:, 1] < crown - 90)]
    nose = face[face[:, 2].argmax()] if len(face) else head[head[:, 2].argmax()]
    eyes = np.array([middle, crown - EYES_BELOW_CROWN_MM, nose[2] - 40])
    side = np.array([31.0, 0, 0])
    mouth = np.array([middle, eyes[1] - 70, nose[2] - 12])
    return {"eyes": eyes, "eye_l": eyes + side, "eye_r": eyes - side, "nose": nose, "mouth": mouth}


def _masks(scan, p: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Where the skin is what (N, len(MASKS)), from the average head; none without a face. Below
    the head it is as at its lower edge.
    """
    from scipy.spatial import cKDTree

    fit, placing = scan.placing.fit, scan.placing
    if fit is None:
        return np.zeros((len(p), len(MASKS)), np.float32)
    shape, turn = template.load(), fit.rotation.T @ placing.rotation.T
    own = fit.back(p @ placing.rotation / placing.mm_per_unit)
    facing = normals @ turn.T
    # a surface that faces the same way, among the near ones
    tree = cKDTree(np.hstack([shape.points, MATCH_MM * shape.normals]))
    distance, index = tree.query(np.hstack([own, MATCH_MM * facing]), k=4)
    weight = 1 / (distance + 1.0) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    return (shape.masks[index] * weight[..., None]).sum(axis=1).astype(np.float32)


def _bare(masks: np.ndarray, *grown: str) -> np.ndarray:
    """Masks (N, len(MASKS)) without what a scan brings itself or lacks, but for what was grown."""
    masks = masks.copy()
    for name in {"hair", "beard", "inside"} - set(grown):
        masks[:, MASKS.index(name)] = 0
    return masks


def _sockets(p, faces, marks, scale: float) -> tuple[Eyeball, ...]:
    """Roughly, the balls that open sockets want, left of the person first; none where one of both
    is closed.

    Looked at from the front, a socket is where nothing is met near the lids' depth. A ball lies
    in the opening's middle and behind its rim.
    """
    import trimesh
    from scipy.ndimage import binary_dilation, label

    mesh, balls, step = trimesh.Trimesh(p, faces, process=False), [], 0.5 * scale
    radius = EYE_MM * scale
    for name in ("eye_l", "eye_r"):
        across, down = np.meshgrid(np.arange(-44, 45) * step, np.arange(-32, 33) * step)
        starts = np.dstack([across, down, np.full_like(across, 150 * scale)]) + marks[name]
        rays = starts.reshape(-1, 3), np.tile([0.0, 0.0, -1.0], (across.size, 1))
        hit = mesh.ray.intersects_first(*rays)
        normal, corner = mesh.face_normals[hit], mesh.triangles[hit, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = ((corner - rays[0])[:, :2] * normal[:, :2]).sum(axis=1)
            depth = corner[:, 2] + flat / normal[:, 2]
        depth = np.where(hit >= 0, depth, -np.inf).reshape(across.shape)
        open_ = depth < _smooth(depth) - OPEN_MM * scale
        parts, _ = label(open_)
        middle = parts[24:41, 30:59]  # the opening near where the eye should be
        if not middle.any():
            return ()
        own = parts == np.bincount(middle[middle > 0]).argmax()
        if not 40 * scale**2 < own.sum() * step**2 < 500 * scale**2:
            return ()
        rim = binary_dilation(own, iterations=2) & ~open_ & np.isfinite(depth)
        tall = own.sum(axis=0)
        x = across[0, np.flatnonzero(tall > 0.3 * tall.max())[[0, -1]]].mean()
        y = down[own].mean()
        beside = (across[rim] - x) ** 2 + (down[rim] - y) ** 2
        near = beside < (0.95 * radius) ** 2
        if near.sum() < 10:
            return ()
        z = np.quantile(depth[rim][near] - np.sqrt(radius**2 - beside[near]), 0.25)
        place = np.array([marks[name][0] + x, marks[name][1] + y, z])
        balls.append(Eyeball(place, float(radius), name == "eye_l"))
    return tuple(balls)


def _smooth(depth: np.ndarray) -> np.ndarray:
    """The paraboloid (H, W) that most of a map of depths lies on, what is deeper left out."""
    y, x = np.indices(depth.shape) / np.array(depth.shape)[:, None, None] - 0.5
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    good = np.isfinite(depth)
    for _ in range(5):
        plane = terms @ np.linalg.lstsq(terms[good], depth[good])[0]
        off = np.where(np.isfinite(depth), depth - plane, -np.inf)
        good = off > np.quantile(off[np.isfinite(off)], 0.3)
    return plane


def _over_the_balls(
    positions: np.ndarray, normals: np.ndarray, faces: np.ndarray, balls: tuple[Eyeball, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals (N, 3) with the lids moved out of the balls and of the cornea."""
    own, turns = Eyes(), np.radians(LOOK_DEG)
    gazes = np.column_stack([np.sin(turns), np.zeros(len(turns)), np.cos(turns)])
    new = positions.copy()
    for ball in balls:
        lids = np.linalg.norm(new - ball.centre, axis=1) > ball.radius - DEEP_MM
        new[lids] = clear(new[lids], ball, own, gazes)
    moved = (new != positions).any(axis=1)
    if moved.any():
        # seams of the texture part no lid
        _, first, same = np.unique(positions, axis=0, return_index=True, return_inverse=True)
        welded = same.ravel()[faces]
        smooth = vertex_normals(new[first], welded)[same.ravel()]
        normals = np.where(moved[:, None], smooth, normals)
    return new, normals


def _eye(positions: np.ndarray, faces: np.ndarray, ball: Eyeball) -> Eye:
    """The default head's eye in a socket, lined where the lids do not touch it."""
    seen = opening(positions, faces, ball)
    rims = None if seen is None else eyes.rims(positions, faces, ball, seen)
    return eyes.eyeball(ball, None, seen, rims=rims)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)


def _finer(positions, normals, uvs, faces, edge_mm):
    """The surface with each face in four until half of its edges are `edge_mm` or shorter, and the
    matrix (new, old) that carries a value along. New points lie on the cubic of curved PN triangles
    (Vlachos et al. 2001, doi:10.1145/364338.364387), so old ones stay and silhouettes are round.
    """
    carry = sparse.identity(len(positions), format="csr")
    # one normal a place, or surfaces part at seams where they have several
    _, same = np.unique(positions, axis=0, return_inverse=True)
    bend = np.stack([np.bincount(same.ravel(), weights=axis) for axis in normals.T], axis=1)
    bend = _unit(bend[same.ravel()])
    for _ in range(LEVELS):
        ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, of = np.unique(ends, axis=0, return_inverse=True)
        a, b = edges.T
        along = positions[b] - positions[a]
        if np.median(np.linalg.norm(along, axis=1)) <= edge_mm or len(faces) > FINE_LIMIT:
            break
        n = len(positions)
        rise = (along * bend[a]).sum(axis=1, keepdims=True) * bend[a]
        rise -= (along * bend[b]).sum(axis=1, keepdims=True) * bend[b]
        middle = 0.5 * (positions[a] + positions[b]) - rise / 8
        between, curved = (_unit(field[a] + field[b]) for field in (normals, bend))
        rows = np.repeat(np.arange(len(edges)), 2)
        half = sparse.csr_matrix((np.full(rows.size, 0.5), (rows, edges.ravel())), (len(edges), n))
        carry = sparse.vstack([carry, half @ carry], format="csr")
        positions, normals = np.vstack([positions, middle]), np.vstack([normals, between])
        bend = np.vstack([bend, curved])
        uvs = np.vstack([uvs, 0.5 * (uvs[a] + uvs[b])])
        ab, bc, ca = (n + of.reshape(-1, 3)).T
        i, j, k = faces.T
        quarters = ((i, ab, ca), (ab, j, bc), (ca, bc, k), (ab, bc, ca))
        faces = np.stack([np.column_stack(q) for q in quarters], axis=1).reshape(-1, 3)
    return positions, normals, uvs, faces, carry


def _own_eyes(points: np.ndarray) -> tuple[Eyeball, ...]:
    """The balls that an uncoloured scan's eye parts (N, 3) take up, left of the person first."""
    middle = 0.5 * (points[:, 0].min() + points[:, 0].max())
    sides = [points[points[:, 0] > middle], points[points[:, 0] <= middle]]
    if min(map(len, sides)) < 8:
        return ()
    balls = []
    for left, side in zip((True, False), sides, strict=True):
        low, high = side.min(axis=0), side.max(axis=0)
        radius = 0.25 * ((high - low)[0] + (high - low)[1])
        centre = np.array([*(0.5 * (low + high))[:2], low[2] + radius])
        balls.append(Eyeball(centre, float(radius), left))
    return tuple(balls) if all(8 < ball.radius < 18 for ball in balls) else ()


def scan_model(scan, edge_mm: float = 2.5, person: Person | None = None, seed: int = 0) -> Model:
    """A user's scan, subdivided to edges of `edge_mm`: its own maps on its skin; eyes and teeth
    drawn without scattering; hair as surface. person: whose generated hair it gets, drawn from
    `seed`.

    Left out: clear shells over the eyes, and cards of lashes and brows, which are nothing without
    their alpha. Eyes without a texture are replaced by the default head's, which open sockets get.
    """
    kinds = [
        "card" if kind == "hair" and ("lash" in name.lower() or "brow" in name.lower()) else kind
        for name, kind in zip(scan.part_names, scan.part_kinds, strict=True)
    ]
    kind = np.array(kinds)[scan.parts]
    eye_faces = scan.faces[kind == "eye"]
    eye_points = scan.positions_mm[np.unique(eye_faces)].astype(float) if len(eye_faces) else None
    balls = _own_eyes(eye_points) if eye_points is not None and scan.albedo is None else ()
    kept = ~np.isin(kind, ["shell", "card", *(["eye"] if balls else [])])
    used, faces = np.unique(scan.faces[kept], return_inverse=True)
    faces = faces.reshape(-1, 3)
    positions, normals = scan.positions_mm[used].astype(float), scan.normals[used].astype(float)
    fit, placing = scan.placing.fit, scan.placing
    if eye_points is None and fit is not None:
        shape = template.load().landmarks
        near = {name: placing.place(fit.place(shape[name])) for name in ("eye_l", "eye_r")}
        balls = _sockets(positions, faces, near, fit.scale * placing.mm_per_unit)
    scatters = np.ones(len(used))
    scatters[faces[kind[kept] != "skin"].ravel()] = 0
    colour = scan.base_colour or SKIN_COLOUR
    if scan.albedo is not None:
        mean = scan.albedo.reshape(-1, 3)[:: max(1, scan.albedo.size // 300_000)] / 255
        colour = tuple(decode_srgb(mean).mean(axis=0))
    albedo = np.tile(np.array(colour), (len(used), 1))
    if len(used) > PROXY_LIMIT:
        proxy = _clustered(positions, normals, faces, albedo)
    else:
        proxy = Proxy(positions, normals, faces, albedo, sparse.identity(len(used), format="csr"))
    uvs = np.zeros((len(used), 2)) if scan.uvs is None else scan.uvs[used].astype(float)
    coarse = len(used)
    positions, normals, uvs, faces, carry = _finer(positions, normals, uvs, faces, edge_mm)
    if len(positions) > coarse:
        proxy = replace(proxy, to_full=(carry @ proxy.to_full).tocsr())
    if eye_points is None:
        balls = tuple(seated(positions, faces, ball) for ball in balls)
    positions, normals = _over_the_balls(positions, normals, faces, balls)
    masks = _masks(scan, positions, normals)
    near = _masks(scan, proxy.positions, proxy.normals)
    strands = None
    if person is not None:
        if "hair" in kinds:
            named = scan.part_names[kinds.index("hair")]
            raise InputError(
                f"{scan.name}: its part {named!r} is hair, and more was asked for; expected no hair"
            )
        strands = grown(scan.name, placing, positions, normals, faces, masks, balls, person, seed)
    own_hair = () if person is None else ("hair", "beard")
    masks, near = _bare(masks, *own_hair), _bare(near, *own_hair)
    own = {
        "albedo_map": scan.albedo,
        "normal_map": scan.normal_map,
        "roughness_map": scan.roughness,
    }
    surface = Surface(
        positions.astype(np.float32),
        normals.astype(np.float32),
        uvs.astype(np.float32),
        faces.astype(np.uint32),
        masks,
        replace(proxy, masks=near),
        {name: image for name, image in own.items() if image is not None},
        tuple(colour),
        carry @ scatters,
    )
    return Model(
        surface,
        tuple(_eye(positions, faces, ball) for ball in balls),
        strands,
        _landmarks(scan, positions, eye_points, balls),
        material=Material(albedo=tuple(float(v) for v in colour)),
    )
