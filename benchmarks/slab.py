"""Kernels against their medium: fit errors of every technique, and what a slab answers to an edge.

The first table is of curves and fits (no graphics): widths of a straight edge, and rms at it. The
second is drawn: a slab face-on at two distances and tilted by 30 and 60 degrees, defaults and the
papers' own forms.
"""

from __future__ import annotations

import numpy as np

import renderer
from renderer.optics import media
from tests.renderer.slab import Bare, edge_response, rms, scatter, width_mm

MEDIA = ("deon_luebke", "skin_three_layers", "skin1", "skin2", "marble", "wholemilk")
FORMS = (
    ("jimenez_gaussian", {}),
    ("jimenez_gaussian", {"stretch": "published", "first": "published"}),
    ("jimenez_gaussian", {"depth_steps": "follow"}),
    ("jimenez_separable", {}),
    ("jimenez_separable", {"follow": "published"}),
    ("jimenez_separable", {"kernel": "guided"}),
    ("jimenez_separable", {"kernel": "svd"}),
    ("jimenez_separable", {"kernel": "artist"}),
    ("jimenez_separable", {"kernel": "published"}),
    ("golubev", {}),
    ("golubev", {"samples": 128}),
    ("golubev", {"weights": "published"}),
    ("golubev", {"disc": "tangent"}),
    ("golubev_plus", {}),
    ("golubev_plus", {"sets": "nested"}),
    ("golubev_adaptive", {}),
    ("subdermal", {}),
    ("subdermal", {"kernel": "curve"}),
)
PLACES = ((480.0, 0.0), (240.0, 0.0), (480.0, 30.0), (480.0, 60.0))  # mm, degrees
PIXELS_PER_MM = 9000.0  # at 1 mm


STEPS_MM = (3.0, 30.0)  # of depth, behind a lit surface 300 mm away
STRIPES_MM = 1.0
SIZE = (120, 640)


def triple(values: np.ndarray, form: str) -> str:
    return " / ".join(f"{value:{form}}" for value in values)


def furnace(bare: Bare, technique, curve) -> float:
    """The largest relative error on light that is the same everywhere."""
    light = np.full((*SIZE, 3), 1.7)
    out, _ = scatter(technique, bare.flat(light, curve, 480.0, PIXELS_PER_MM))
    return float(np.abs(out / 1.7 - 1).max())


def stripes(bare: Bare, technique, curve) -> np.ndarray:
    """Amplitude left at the middles of bright and dark stripes, face-on at 480 mm: (3,)."""
    x = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) * 480.0 / PIXELS_PER_MM
    phase = np.mod(x / STRIPES_MM, 2.0)
    light = np.repeat((phase < 1)[None, :, None], SIZE[0], axis=0) * np.ones(3)
    out, _ = scatter(technique, bare.flat(light, curve, 480.0, PIXELS_PER_MM))
    row, inside = out.mean(axis=0), np.abs(x) < np.abs(x).max() - 8
    middle = np.abs(np.mod(phase, 1.0) - 0.5) < 0.03
    return row[inside & middle & (phase < 1)].mean(0) - row[inside & middle & (phase >= 1)].mean(0)


def crossing(bare: Bare, technique, curve, step_mm: float) -> np.ndarray:
    """Light beyond the edge of a lit surface, over what a flat one sends there: (3,)."""
    light = np.zeros((*SIZE, 3))
    light[:, : SIZE[1] // 2] = 1

    def beyond(step: float) -> np.ndarray:
        depth = np.full(SIZE, 300.0)
        depth[:, SIZE[1] // 2 :] += step
        out, _ = scatter(technique, bare.flat(light, curve, depth, PIXELS_PER_MM))
        return out[10:-10, SIZE[1] // 2 :].sum(axis=(0, 1))

    return beyond(step_mm) / beyond(0.0)


def main() -> None:
    print("medium: albedo; edge 10-90 % and 2-98 %, mm; noise; rms of the fits (R / G / B)")
    for name in MEDIA:
        curve = media.curve(name)
        print(
            f"\n{name}: albedo {triple(curve.albedo, '.3f')}, edge {triple(curve.width(), '.2f')}"
        )
        far = triple(curve.width(0.02, 0.98), ".2f")
        print(f"  tail {far}, noise {triple(curve.noise, '.4f')}")
        for technique in ("jimenez_gaussian", "jimenez_separable", "golubev"):
            error = renderer.make(technique).fit_error(curve)
            print(f"  {technique:<18} {triple(error, '.4f')}")
        published = renderer.make("jimenez_gaussian", {"kernel": "published"}).fit_error(curve)
        print(f"  {'published six':<18} {triple(published, '.4f')}")
    drawing = Bare()
    for name in ("deon_luebke", "skin_three_layers"):
        curve = media.curve(name)
        true = triple(curve.width(), ".2f")
        print(f"\n{name}, drawn: rms within 6 mm; width 10-90 %, mm; true {true}")
        left = triple(curve.square_stripes(STRIPES_MM), ".3f")
        print(f"  stripes of {STRIPES_MM:g} mm: true {left}")
        for technique, parameters in FORMS:
            words = ", ".join(f"{key}={value}" for key, value in parameters.items())
            print(f"  {technique} {words}")
            made = renderer.make(technique, parameters)
            for depth, tilt in PLACES:
                u, got, _ = edge_response(drawing, made, curve, PIXELS_PER_MM, depth, tilt)
                error, width = rms(u, got, curve, 6.0), width_mm(u, got)
                place = f"{depth:.0f} mm, {tilt:.0f} degrees"
                print(f"    {place:<20} {triple(error, '.4f')}   {triple(width, '.2f')}")
            left, flat = stripes(drawing, made, curve), furnace(drawing, made, curve)
            print(f"    stripes of 1 mm      {triple(left, '.3f')}, even light within {flat:.0e}")
            for step in STEPS_MM:
                share = triple(crossing(drawing, made, curve, step), ".2f")
                print(f"    across {step:>4.0f} mm       {share}")
    drawing.context.close()


if __name__ == "__main__":
    main()
