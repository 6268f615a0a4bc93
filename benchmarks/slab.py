"""Kernels against their medium: fit errors of every technique, and what a slab answers to an edge.

The first table is of curves and fits (no graphics): widths of a straight edge, and rms at it. The
second is drawn: a slab face-on at two distances and tilted by 30 and 60 degrees, defaults and the
papers' own forms. The third, `--only everything`, has every technique, over surfaces too.
"""

from __future__ import annotations

import argparse

import numpy as np

import renderer
from renderer.optics import media
from tests.renderer.slab import (
    Bare,
    edge,
    edge_response,
    left,
    left_of,
    rms,
    scatter,
    stripes,
    surface_response,
    width_mm,
)

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
#: What filters surfaces, fine enough to judge: texels of 0.07 mm, points half a millimetre apart.
SURFACE = {
    "borshukov_lewis": {"size": 1024},
    "gosselin": {"size": 1024},
    "deon_luebke": {"size": 1024, "texturing": 0.0, "translucency": "none"},
    "splat_dipole": {"spacing_mm": 0.5},
    "splat_multipole": {"spacing_mm": 0.5},
    "reference": {"walks": 256},
}
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


def faded(bare: Bare, technique, curve) -> np.ndarray:
    """What is left of stripes, face-on at 480 mm: (3,)."""
    x = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) * 480.0 / PIXELS_PER_MM
    light = np.tile(stripes(x, STRIPES_MM)[None, :, None], (SIZE[0], 1, 3))
    out, _ = scatter(technique, bare.flat(light, curve, 480.0, PIXELS_PER_MM))
    inside = np.abs(x) < np.abs(x).max() - 8
    return left(x[inside], out.mean(axis=0)[inside], STRIPES_MM)


def within(u: np.ndarray, miss: np.ndarray, reach_mm: float = 6.0) -> np.ndarray:
    """rms over distance: (3,)."""
    near = np.abs(u) < reach_mm
    return np.sqrt(np.trapezoid(miss[near] ** 2, u[near], axis=0) / np.ptp(u[near]))


def everything(bare: Bare) -> None:
    """A table over all techniques, what filters pictures and what filters surfaces, face-on."""
    curve = media.curve("deon_luebke")
    print("\nevery technique on a slab of deon_luebke, rms within 6 mm of an edge and stripes")
    print("| technique | edge: fit | edge: drawn | stripes: fit | stripes: drawn | even light |")
    print("|---|---|---|---|---|---|")
    true = triple(left_of(curve.edge, STRIPES_MM), ".3f")
    print(f"| the medium's curve | | | {true} | | |")
    for name, kind in renderer.TECHNIQUES.items():
        if name == "none":
            continue
        words = "".join(f" {k}={v}".lower() for k, v in SURFACE.get(name, {}).items())
        made = renderer.make(name, SURFACE.get(name))
        if kind.domain == "screen":
            u, got, _ = edge_response(bare, made, curve, PIXELS_PER_MM, 480.0)
            drawn, flat = faded(bare, made, curve), furnace(bare, made, curve)
        else:
            u, got, _ = surface_response(made, edge)
            drawn = left(*surface_response(made, stripes)[:2], STRIPES_MM)
            even = surface_response(made, lambda x: 1.7 + 0 * x)[1]
            flat = float(np.abs(even / 1.7 - 1).max())
        fit = triple(within(u, made.edge(curve, u) - curve.edge(u)), ".4f")
        fitted = triple(left_of(lambda x, m=made: m.edge(curve, x), STRIPES_MM), ".3f")
        miss, drawn = triple(rms(u, got, curve, 6.0), ".4f"), triple(drawn, ".3f")
        row = (f"`{name}{words}`", fit, miss, fitted, drawn, f"{flat:.0e}")
        print(f"| {' | '.join(row)} |", flush=True)


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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=("fits", "forms", "everything"))
    only = parser.parse_args().only
    drawing = Bare()
    if only in (None, "fits"):
        fits()
    if only in (None, "forms"):
        forms(drawing)
    if only in (None, "everything"):
        everything(drawing)
    drawing.context.close()


def fits() -> None:
    """Curves, and how far families stay from them."""
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


def forms(drawing: Bare) -> None:
    """Filters of the picture, their defaults and their papers' forms."""
    for name in ("deon_luebke", "skin_three_layers"):
        curve = media.curve(name)
        true = triple(curve.width(), ".2f")
        print(f"\n{name}, drawn: rms within 6 mm; width 10-90 %, mm; true {true}")
        whole = triple(curve.square_stripes(STRIPES_MM), ".3f")
        print(f"  stripes of {STRIPES_MM:g} mm: true {whole}")
        for technique, parameters in FORMS:
            words = ", ".join(f"{key}={value}" for key, value in parameters.items())
            print(f"  {technique} {words}")
            made = renderer.make(technique, parameters)
            for depth, tilt in PLACES:
                u, got, _ = edge_response(drawing, made, curve, PIXELS_PER_MM, depth, tilt)
                error, width = rms(u, got, curve, 6.0), width_mm(u, got)
                place = f"{depth:.0f} mm, {tilt:.0f} degrees"
                print(f"    {place:<20} {triple(error, '.4f')}   {triple(width, '.2f')}")
            faint, flat = faded(drawing, made, curve), furnace(drawing, made, curve)
            print(f"    stripes of 1 mm      {triple(faint, '.3f')}, even light within {flat:.0e}")
            for step in STEPS_MM:
                share = triple(crossing(drawing, made, curve, step), ".2f")
                print(f"    across {step:>4.0f} mm       {share}")


if __name__ == "__main__":
    main()
