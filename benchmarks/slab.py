"""Kernels against their medium: fit errors of every technique, and what a slab answers to an edge.

The first table is of curves and fits (no graphics): widths of a straight edge, and rms at it. The
second is drawn: a slab face-on at two distances and tilted by 30 and 60 degrees, defaults and the
papers' own forms.
"""

from __future__ import annotations

import numpy as np

import renderer
from renderer import gl
from renderer.optics import media
from tests.renderer.slab import edge_response, rms, width_mm

MEDIA = ("deon_luebke", "skin_three_layers", "skin1", "skin2", "marble", "wholemilk")
FORMS = (
    ("jimenez_gaussian", {}),
    ("jimenez_gaussian", {"stretch": "published", "first": "published"}),
    ("jimenez_separable", {}),
    ("jimenez_separable", {"follow": "published"}),
    ("golubev", {}),
    ("golubev", {"samples": 128}),
    ("golubev", {"weights": "published"}),
    ("golubev_plus", {}),
)
PLACES = ((480.0, 0.0), (240.0, 0.0), (480.0, 30.0), (480.0, 60.0))  # mm, degrees
PIXELS_PER_MM = 9000.0  # at 1 mm


class Drawing:
    """A context and its programs, without a scene."""

    def __init__(self) -> None:
        self.context = gl.Context()
        self._programs: dict = {}

    def program(self, fragment: str, defines: dict | None = None) -> gl.Program:
        key = (fragment, tuple(sorted((defines or {}).items())))
        if key not in self._programs:
            self._programs[key] = gl.Program(fragment, defines=defines)
        return self._programs[key]


def triple(values: np.ndarray, form: str) -> str:
    return " / ".join(f"{value:{form}}" for value in values)


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
    drawing = Drawing()
    for name in ("deon_luebke", "skin_three_layers"):
        curve = media.curve(name)
        true = triple(curve.width(), ".2f")
        print(f"\n{name}, drawn: rms within 6 mm; width 10-90 %, mm; true {true}")
        for technique, parameters in FORMS:
            words = ", ".join(f"{key}={value}" for key, value in parameters.items())
            print(f"  {technique} {words}")
            made = renderer.make(technique, parameters)
            for depth, tilt in PLACES:
                u, got, _ = edge_response(drawing, made, curve, PIXELS_PER_MM, depth, tilt)
                error, width = rms(u, got, curve, 6.0), width_mm(u, got)
                place = f"{depth:.0f} mm, {tilt:.0f} degrees"
                print(f"    {place:<20} {triple(error, '.4f')}   {triple(width, '.2f')}")
    drawing.context.close()


if __name__ == "__main__":
    main()
