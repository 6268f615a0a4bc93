"""What is measured of a participant's screen, and what follows from it."""

from __future__ import annotations

import json
import math
from typing import Any

from app import plates

#: Width of a card of ISO/IEC 7810 ID-1, mm.
CARD_MM = 85.60
#: What the page's script sends: lowest and highest value that can stand, CSS pixels where sizes.
MEASURED = {
    "window_width": (1, 100_000),
    "window_height": (1, 100_000),
    "device_pixel_ratio": (0.1, 100),
    "screen_width": (1, 100_000),
    "screen_height": (1, 100_000),
    "zoom": (0.1, 100),
    "card_width": (50, 5000),
    "grey": (1, 254),
    "dark_steps": (0, 4),
    "bright_steps": (0, 4),
}


def read(form: dict[str, str]) -> dict[str, float]:
    """The measures of a form that are numbers within their limits; the others are left out."""
    measures = {}
    for name, (low, high) in MEASURED.items():
        try:
            value = float(form.get(name, ""))
        except ValueError:
            continue
        if low <= value <= high:
            measures[name] = round(value, 4)
    return measures


def large_enough(measures: dict[str, float], least_px: tuple[int, int]) -> bool:
    """Whether a window has at least so many screen pixels; not where it was not measured."""
    ratio = measures.get("device_pixel_ratio", 0.0)
    sides = (measures.get("window_width", 0.0), measures.get("window_height", 0.0))
    return all(math.ceil(side * ratio) >= least for side, least in zip(sides, least_px))


def read_plates(form: dict[str, str], count: int, seed: int) -> dict[str, str | int]:
    """What was given for each plate of a study, and how many were read as they are."""
    if not count:
        return {}
    given = [form.get(f"plate_{k}", "").strip()[:1] for k in range(1, count + 1)]
    given = [one if one in "0123456789" else "" for one in given]
    return {"plates": ";".join(given), "plates_read": plates.read(given, seed)}


def reads_enough(kept: str | None, least: int) -> bool:
    """Whether somebody read as many plates as the study asks for."""
    return not least or not kept or json.loads(kept).get("plates_read", 0) >= least


def columns(kept: str | None, distance_cm: int) -> dict[str, Any]:
    """What responses.csv says of a screen; None where it was not measured.

    A grey that looks like fine stripes of black and white sends half of white's light:
    (grey/255)^gamma = 1/2.
    """
    measures = json.loads(kept) if kept else {}
    card, ratio = measures.get("card_width"), measures.get("device_pixel_ratio")
    per_mm = card * ratio / CARD_MM if card and ratio else None
    grey = measures.get("grey")
    degree_mm = 2 * 10 * distance_cm * math.tan(math.radians(0.5))
    return {
        "pixels_per_mm": per_mm and round(per_mm, 4),
        "pixels_per_degree": per_mm and round(per_mm * degree_mm, 3),
        "display_gamma": grey and round(math.log(0.5) / math.log(grey / 255), 3),
        "dark_steps_seen": measures.get("dark_steps"),
        "bright_steps_seen": measures.get("bright_steps"),
        "plates_read": measures.get("plates_read"),
        "plates_given": measures.get("plates"),
    }
