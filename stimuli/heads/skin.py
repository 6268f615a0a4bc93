"""Where the skin is what: masks per vertex for the procedural skin shader, from the anatomy's
landmarks.
"""

from __future__ import annotations

import numpy as np

from renderer.scene import MASKS
from stimuli.heads import mouth as mouths
from stimuli.heads.anatomy import Anatomy, Bust
from stimuli.heads.regions import Regions
from stimuli.heads.smooth import smoothstep

HEAD_AXIS_Z = 45.0  # mm: the vertical axis of the skull that azimuths are measured about


def _wobble(p: np.ndarray, scale: float) -> np.ndarray:
    """A smooth, fixed, zero-mean field in about [-1, 1] from a few incommensurate waves (N,)."""
    q = p / scale
    waves = [
        (1.0, 1.7, 0.6, 0.3),
        (-1.3, 0.8, 1.9, 1.1),
        (2.3, -1.1, 1.2, 2.0),
        (0.7, 2.9, -1.6, 4.0),
        (3.1, 1.3, 2.2, 5.0),
    ]
    return sum(np.sin(q @ np.array(w[:3]) + w[3]) for w in waves) / len(waves) * 1.6


def _ring(p: np.ndarray, eye: np.ndarray, regions: Regions) -> np.ndarray:
    """The soft spot below an eye (N,)."""
    inwards, below = regions.rings_place_mm
    across, along = regions.rings_mm
    x = p[:, 0] - eye[0] + np.sign(eye[0]) * inwards
    y = p[:, 1] - eye[1] + below - 0.012 * x**2  # it curves up to the corners
    return np.exp(-0.5 * ((x / across) ** 2 + (y / along) ** 2)) * (p[:, 2] > eye[2])


def _rim(p: np.ndarray, ear: np.ndarray, regions: Regions) -> np.ndarray:
    """The rim and the lobe of the ear about `ear`, of what is ear (N,)."""
    high, deep = regions.rims_mm
    off = p - ear
    out = np.hypot(off[:, 1] / high, off[:, 2] / deep)
    lobe = smoothstep(-0.45 * high, -0.8 * high, off[:, 1])
    return np.maximum(smoothstep(0.7, 1.0, out), lobe) * (np.abs(off[:, 0]) < 40)


#: Over how many mm the vermilion fades into the skin outside of its border.
BORDER_MM = 1.4


def _lips(p: np.ndarray, faces: np.ndarray, own: dict[str, np.ndarray]) -> np.ndarray:
    """Lips (N,): 0 outside, 0.5 at their border, 1 at the seam, where the mouth's inside begins."""
    from scipy.spatial import cKDTree

    inside = own["inside-mouth"] > 0.5
    lip = (own["lips"] > 0.5) & ~inside
    out = np.zeros(len(p))
    if not lip.any():
        return out
    skin = ~lip & ~inside
    reach = 15.0

    def distance(of: np.ndarray, to: np.ndarray) -> np.ndarray:
        if not to.any():
            return np.full(of.sum(), reach)
        return np.minimum(cKDTree(p[to]).query(p[of], distance_upper_bound=reach)[0], reach)

    line = mouths.border(p, faces, own["lips"])

    def border_distance(of: np.ndarray) -> np.ndarray:
        return np.minimum(cKDTree(line).query(p[of], distance_upper_bound=reach)[0], reach)

    border, seam = border_distance(lip), distance(lip, inside)
    out[lip] = 0.5 + 0.5 * border / (border + seam)
    out[skin] = 0.5 * (1 - smoothstep(0.0, BORDER_MM, border_distance(skin)))
    out[inside] = 1 - smoothstep(0.0, 4.0, distance(inside, lip))
    return out


def azimuth(p: np.ndarray) -> np.ndarray:
    """Degrees from the face's middle, 0 to 180, either side (N,)."""
    return np.degrees(np.arctan2(np.abs(p[:, 0]), p[:, 2] - HEAD_AXIS_Z))


HEAD_MM = 80.0  # radius that azimuths are unrolled with


def _within_line(around, up, regions: Regions, hairline_mm: float) -> np.ndarray:
    """How far within the hairline a place is, mm (N,), negative outside: across the line, which is
    steep at temple and sideburn. around (N,) degrees; up (N,) mm above the eyes.
    """
    from scipy.spatial import cKDTree

    def height(degrees):
        line = np.interp(degrees, *np.transpose(regions.hairline))
        return line - hairline_mm * smoothstep(*regions.hairline_deg, degrees)

    fine = np.linspace(0, 180, 721)
    unrolled = np.radians(HEAD_MM)
    line = cKDTree(np.column_stack([unrolled * fine, height(fine)]))
    away = line.query(np.column_stack([unrolled * around, up]))[0]
    return np.sign(up - height(around)) * away


def masks(
    anatomy: Anatomy, bust: Bust, hairline_mm: float = 0.0, regions: Regions | None = None
) -> np.ndarray:
    """(N, len(MASKS)) float32 in [0, 1]; hairline_mm: lower on the forehead; regions: where."""
    regions = regions or Regions()
    p, own, mark = bust.positions, bust.masks, anatomy.landmarks
    eyes, nose, mouth = mark["eyes"], mark["nose"], mark["mouth"]
    up = p[:, 1] - eyes[1]

    def blob(centre, radius):
        return np.exp(-((p - centre) ** 2).sum(axis=1) / (2 * radius**2))

    around = azimuth(p)
    wander = _wobble(p, regions.line_noise_scale_mm)
    noise_line, noise_top, noise_bottom = regions.line_noise_mm
    off_ear = 1 - smoothstep(0.15, 0.6, own["ears"])
    within = _within_line(around, up, regions, hairline_mm)
    hair = smoothstep(*regions.hairline_soft_mm, within + noise_line * wander) * off_ear
    top = np.interp(around, *np.transpose(regions.beard_top))
    bottom = np.interp(around, *np.transpose(regions.beard_bottom))
    beard = (
        smoothstep(*regions.beard_top_soft_mm, top - up + noise_top * wander)
        * smoothstep(*regions.beard_bottom_soft_mm, up - bottom + noise_bottom * wander)
        * smoothstep(*regions.beard_front_mm, p[:, 2])
    )
    beard *= 1 - smoothstep(0.02, 0.25, own["lips"])
    # the hollow below the lower lip and the cheeks' middle are thinner
    out, below = regions.beard_thin_place_mm
    thin = [blob(mouth + [side * out, -below, 0.0], regions.beard_thin_mm) for side in (-1, 1)]
    beard *= 1 - regions.beard_thin * thin[0] - regions.beard_thin * thin[1]
    # densest about mouth and chin, sparser on cheeks and neck, and nowhere even
    around_mouth = blob(0.5 * (mouth + mark["chin"]), regions.beard_dense_mm)
    beard *= 1 - regions.beard_sparse * (1 - around_mouth)
    beard *= 1 + regions.beard_patchy * _wobble(p[:, [2, 0, 1]], regions.beard_patch_mm)
    beard *= (1 - hair) * off_ear
    inside = smoothstep(0.35, 0.8, own["inside-mouth"]) * (1 - smoothstep(0.05, 0.4, own["lips"]))
    inside = np.maximum(inside, own["nostrils"])

    surface = lambda x, y: p[
        np.argmin((p[:, 0] - x) ** 2 + (p[:, 1] - y) ** 2 + 1e3 * (p[:, 2] < 60))
    ]
    across, down = regions.cheek_place_mm
    cheeks = [surface(side * across, eyes[1] - down) for side in (1, -1)]
    forehead = smoothstep(*regions.forehead_mm[:2], up) * smoothstep(*regions.forehead_mm[2:], up)
    forehead = forehead * smoothstep(*regions.forehead_deg, around)
    chest = smoothstep(*regions.chest_mm, up) * (p[:, 2] > 20)
    chest = chest * smoothstep(*regions.chest_half_mm, np.abs(p[:, 0]))
    wing = np.array(regions.wings_place_mm) * [1, -1, -1]
    places = {
        "everywhere": np.ones(len(p)),
        "cheeks": sum(blob(c, regions.cheek_mm) for c in cheeks),
        "nose": blob(nose, regions.nose_mm),
        "wings": sum(blob(nose + wing * [side, 1, 1], regions.wings_mm) for side in (1, -1)),
        "ears": own["ears"],
        "chin": blob(mark["chin"], regions.chin_mm),
        "forehead": forehead,
        "chest": chest,
        "neck": smoothstep(*regions.neck_mm, up),
        "eyelids": own["eyelids"],
        "rings": sum(_ring(p, ball.centre, regions) for ball in anatomy.eyes),
        "rims": own["ears"]
        * np.maximum(_rim(p, mark["ear_l"], regions), _rim(p, mark["ear_r"], regions)),
        "knuckle": blob(
            nose + [0.0, regions.knuckle_place_mm[0], -regions.knuckle_place_mm[1]],
            regions.knuckle_mm,
        ),
    }

    def over(weights):
        return sum(weight * places[name] for name, weight in weights.items())

    flush, pores, oil = over(regions.flush), over(regions.pores), over(regions.oil)
    thin = np.maximum(over(regions.thin), 0)
    for name, share in regions.smooth.items():
        pores *= 1 - share * places[name]
    columns = {
        "lips": _lips(p, bust.faces, own),
        "flush": flush,
        "hair": hair,
        "eyelid": thin,
        "pores": pores,
        "oil": oil,
        "beard": beard,
        "inside": inside,
    }
    return np.clip(np.column_stack([columns[name] for name in MASKS]), 0, 1).astype(np.float32)
