"""Vessels of the sclera: branching curves, drawn on a map about the gaze.

Conjunctival and episcleral vessels come from the fornices and the corners, run towards the cornea,
wind, branch at angles of 30 to 60 degrees into finer ones and end a millimetre or two before the
limbus (Meyer and Watson 1987, doi:10.1136/bjo.71.1.2). Widths are 0.02 to 0.2 mm.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from renderer.scene import Eye

SIZE, FINER = 512, 4  # texels of the map's side; it is drawn so many times finer
STEP_RAD = 0.018
ROOTS = 46


def vessel_map(seed: int, iris: float, left: bool) -> np.ndarray:
    """The map (SIZE, SIZE) uint8 of renderer.scene.Eye; iris: its radius over the ball's."""
    rng = np.random.default_rng([seed, 29, int(left)])
    image = Image.new("L", (SIZE * FINER, SIZE * FINER))
    pen = ImageDraw.Draw(image)
    half = 0.5 * SIZE * FINER
    scale = half / Eye.VESSELS_RAD
    limbus = float(np.arcsin(iris))
    # (azimuth, angle from the gaze, heading, width mm, darkness, depth of branching)
    todo = []
    for _ in range(ROOTS):
        # from the corners more than from above and below
        side = rng.integers(2) * np.pi
        azimuth = side + rng.normal() * 0.75
        width = 0.05 + 0.12 * rng.random() ** 2.5
        todo.append((azimuth, 1.55, np.pi, width, rng.uniform(0.45, 1.0), 0))
    while todo:
        azimuth, angle, heading, width, dark, depth = todo.pop()
        end = limbus + rng.uniform(0.04, 0.30)
        wind, steps = 0.0, int(rng.uniform(25, 70))
        place = np.array([np.cos(azimuth), np.sin(azimuth)]) * angle
        for _ in range(steps):
            away = np.hypot(*place)
            if away < end or away > 1.72 or width < 0.016:
                break
            inward = np.arctan2(place[1], place[0]) + heading
            wind = 0.80 * wind + 0.33 * rng.normal()
            course = inward + wind
            step = STEP_RAD * np.array([np.cos(course), np.sin(course)])
            new = place + step
            pixels = [tuple(half + scale * p * [1, -1]) for p in (place, new)]
            wide = max(1, round(width / 12.0 * scale))
            fade = min(1.0, (away - end) / 0.15 + 0.15)
            shade = int(255 * min(1.0, dark * fade * (0.5 + 3.0 * width)))
            pen.line(pixels, fill=shade, width=wide)
            place, width = new, width * 0.992
            if depth < 4 and rng.random() < 0.045:
                turn = rng.choice([-1, 1]) * rng.uniform(0.4, 1.0)
                start = float(np.arctan2(place[1], place[0])), float(np.hypot(*place))
                share = rng.uniform(0.45, 0.8)
                todo.append((*start, heading + turn, width * share, dark * 0.9, depth + 1))
                width *= np.sqrt(1 - 0.5 * share**2)
            heading = np.pi + (heading - np.pi) * 0.97
    small = image.resize((SIZE, SIZE), Image.Resampling.BOX)
    return np.asarray(small)[::-1].copy()
