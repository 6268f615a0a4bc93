"""Where the skin is what: masks per vertex for the procedural skin shader, from the anatomy's
landmarks.
"""

from __future__ import annotations

import numpy as np

from renderer.scene import MASKS
from stimuli.heads.anatomy import Anatomy, Bust

HEAD_AXIS_Z = 45.0  # mm: the vertical axis of the skull that azimuths are measured about

# The hairline and the beard's upper line: azimuth in degrees from the face's middle -> height in mm
# relative to the eyes.
HAIRLINE = np.array(
    [
        (0, 61),
        (14, 62),
        (26, 66),
        (36, 62),
        (46, 46),
        (56, 34),
        (63, 8),
        (67, -24),
        (71, -44),
        (76, -46),
        (81, -30),
        (88, -6),
        (97, 2),
        (108, -20),
        (118, -45),
        (140, -62),
        (180, -70),
    ],
    dtype=float,
)
BEARD_TOP = np.array(
    [
        (0, -44),
        (14, -46),
        (24, -60),
        (38, -66),
        (52, -52),
        (62, -34),
        (70, -24),
        (78, -36),
        (90, -62),
        (110, -80),
        (180, -90),
    ],
    dtype=float,
)
BEARD_BOTTOM = np.array(
    [(0, -150), (30, -152), (60, -140), (80, -115), (95, -92), (180, -90)], dtype=float
)


def smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


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


def azimuth(p: np.ndarray) -> np.ndarray:
    """Degrees from the face's middle, 0 to 180, either side (N,)."""
    return np.degrees(np.arctan2(np.abs(p[:, 0]), p[:, 2] - HEAD_AXIS_Z))


def masks(anatomy: Anatomy, bust: Bust, hairline_mm: float = 0.0) -> np.ndarray:
    """(N, len(MASKS)) float32 in [0, 1]."""
    p, own, mark = bust.positions, bust.masks, anatomy.landmarks
    eyes, nose, mouth = mark["eyes"], mark["nose"], mark["mouth"]
    up = p[:, 1] - eyes[1]

    def blob(centre, radius):
        return np.exp(-((p - centre) ** 2).sum(axis=1) / (2 * radius**2))

    around = azimuth(p)
    wob = _wobble(p, 9.0)
    off_ear = 1 - smoothstep(0.15, 0.6, own["ears"])
    line = np.interp(around, HAIRLINE[:, 0], HAIRLINE[:, 1])
    line = line - hairline_mm * smoothstep(60, 30, around)
    hair = smoothstep(-5.0, 7.0, up - line + 2.8 * wob) * off_ear
    top = np.interp(around, BEARD_TOP[:, 0], BEARD_TOP[:, 1])
    bottom = np.interp(around, BEARD_BOTTOM[:, 0], BEARD_BOTTOM[:, 1])
    beard = (
        smoothstep(-3, 9, top - up + 3.0 * wob)
        * smoothstep(-14, 14, up - bottom + 5 * wob)
        * smoothstep(30, 60, p[:, 2] + 28)
    )
    beard *= 1 - smoothstep(0.02, 0.25, own["lips"])
    # the hollow below the lower lip and the cheeks' middle are thinner
    beard *= (
        1
        - 0.55 * blob(np.array([mouth[0] - 13, mouth[1] - 11, mouth[2]]), 5)
        - 0.55 * blob(np.array([mouth[0] + 13, mouth[1] - 11, mouth[2]]), 5)
    )
    beard *= (1 - hair) * off_ear
    inside = smoothstep(0.35, 0.8, own["inside-mouth"]) * (1 - smoothstep(0.05, 0.4, own["lips"]))

    surface = lambda x, y: p[
        np.argmin((p[:, 0] - x) ** 2 + (p[:, 1] - y) ** 2 + 1e3 * (p[:, 2] < 60))
    ]
    cheeks = [surface(side * 42.0, eyes[1] - 33.0) for side in (1, -1)]
    cheek = sum(blob(c, 17.0) for c in cheeks)
    tip = blob(nose, 11.0)
    wings = sum(blob(nose + [side * 13.0, -3.0, -14.0], 8.0) for side in (1, -1))
    forehead = smoothstep(20, 34, up) * smoothstep(66, 50, up) * smoothstep(55, 40, around)
    chin = blob(mark["chin"], 15.0)
    neck = smoothstep(-115, -170, up)
    chest = smoothstep(-170, -230, up) * smoothstep(110, 30, np.abs(p[:, 0])) * (p[:, 2] > 20)
    flush = (
        0.55 * cheek
        + 0.75 * tip
        + 0.5 * wings
        + 0.62 * own["ears"]
        + 0.28 * chin
        + 0.16 * forehead
        + 0.16 * chest
        + 0.10 * neck
    )
    flush += 0.20 * own["eyelids"]
    pores = (
        0.30
        + 0.62 * tip
        + 0.60 * wings
        + 0.42 * cheek
        + 0.30 * forehead
        + 0.30 * chin
        - 0.15 * neck
    )
    pores *= (1 - 0.85 * own["eyelids"]) * (1 - 0.6 * own["ears"])
    oil = (
        0.25 + 0.55 * tip + 0.45 * wings + 0.45 * forehead + 0.20 * cheek + 0.20 * chin - 0.2 * neck
    )
    columns = {
        "lips": own["lips"],
        "flush": flush,
        "hair": hair,
        "eyelid": own["eyelids"],
        "pores": pores,
        "oil": oil,
        "beard": beard,
        "inside": inside,
    }
    return np.clip(np.column_stack([columns[name] for name in MASKS]), 0, 1).astype(np.float32)
