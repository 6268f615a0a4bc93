"""Splats: what a frame costs by their number, their size and the pixels they cover, beside the
published frame rates as ratios; and how the relaxation of points grows.

Rohat 2012, tables 6.1 and 6.3 to 6.8 (a Quadro 600, 512x512 pixels): only ratios can be compared,
of the scattering alone, on software OpenGL. The models are not ours to ship: a knot of marble or
jade stands for them. A grid's cells outside of the object are not splatted, here as there. Table
6.2, the size of the samples' map, has no counterpart: rays find what such a map would hold.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import renderer
from renderer.scene import shapes
from renderer.scene.relaxation import Mesh, relax
from renderer.techniques.samples import Body, spread
from stimuli import scenes
from stimuli.experiment.cost import medians

#: Frames a second, from the first row to the last.
NUMBER = {"dipole": (62.1, 48.9, 38.9, 30.5, 25.4), "multipole": (40.1, 30.7, 24.1, 19.6, 15.2)}
GRIDS = ((55, 38), (65, 45), (75, 52), (85, 60), (95, 67))
#: Tables 6.3 (bunny), 6.4 and 6.5 (Buddha, green jade and marble): medium, grids, both methods.
OTHERS = {
    "6.3": (
        "marble",
        ((30, 29), (35, 34), (40, 39), (45, 44), (50, 49), (55, 54)),
        {
            "dipole": (62.1, 48.8, 40.6, 31.2, 27.0, 21.5),
            "multipole": (39.2, 30.6, 25.2, 20.6, 16.5, 13.1),
        },
    ),
    "6.4": (
        "green_jade",
        ((40, 97), (55, 137), (70, 170), (85, 206), (100, 243)),
        {
            "dipole": (98.1, 60.9, 40.6, 28.4, 21.3),
            "multipole": (58.1, 34.8, 22.6, 15.8, 11.6),
        },
    ),
    "6.5": (
        "marble",
        ((20, 48), (25, 60), (30, 72), (35, 85), (40, 97)),
        {
            "dipole": (94.1, 67.5, 49.1, 38.5, 30.1),
            "multipole": (59.1, 41.8, 30.2, 23.3, 18.2),
        },
    ),
}
SIZES = {1.0: 24.0, 0.8: 34.9, 0.6: 54.9, 0.4: 96.1}  # table 6.6, 75 x 32 splats, multipole
EVEN = {1.0: 16.7, 0.8: 22.1, 0.6: 35.8, 0.4: 70.1}  # table 6.8, 5,789 splats, multipole
FAR = {"very close": 16.5, "moderate": 28.8, "far": 78.2}  # table 6.7, 50 x 49 splats
HEIGHTS = {"very close": 34.0, "moderate": 48.0, "far": 90.0}
NUMBER_EVEN = (5789, 6947, 8105, 9263)
FPS_EVEN = (16.7, 13.1, 11.1, 9.4)
TABLES = ("5.4", "6.1", *OTHERS, "6.6", "6.7", "6.8")


def knot(height_mm: float, medium: str) -> dict:
    """The scene: a knot under a lamp."""
    return {
        "objects": {"knot": {"shape": "knot", "radius_mm": 13.0, "tube_mm": 3.4}},
        "materials": {"knot": {"medium": medium, "albedo": [0.83, 0.79, 0.75]}},
        "lights": {"lamp": {"direction": [0.4, 0.5, 0.75], "irradiance": [3.0, 3.0, 3.0]}},
        "environment": {"ambient": [0.0, 0.0, 0.0]},
        "camera": {"framing": "knot", "height_mm": height_mm, "angle": "front"},
    }


def frame_of(height_mm: float, size: int, medium: str = "marble"):
    """A renderer and its frame."""
    graph = scenes.stage(scenes.read_scene(knot(height_mm, medium))).graph
    drawing = renderer.Renderer(graph, (size, size), 1, rays=1)
    return drawing, drawing.frame()


def spent(frame, techniques: dict, rounds: int) -> dict[str, float]:
    """CPU seconds of each, medians of rounds in turn."""
    return {name: cpu for name, (_, cpu) in medians(frame, techniques, rounds).items()}


def table(title: str, rows: list[tuple[str, float, float]], note: str = "") -> None:
    """Print CPU seconds of rows, and time over the first row's here and there."""
    print(f"\n{title}{note}")
    print(f"{'':<16}{'CPU s':>9}{'ratio':>9}{'published':>11}")
    for name, seconds, fps in rows:
        ratio, paper = seconds / rows[0][1], rows[0][2] / fps
        print(f"{name:<16}{seconds:>9.2f}{ratio:>9.2f}{paper:>11.2f}", flush=True)


def splat(kind: str, **parameters) -> renderer.Technique:
    """A technique as the document has it, by a grid or by points over the surface."""
    own = {"weights": "published", "blur": 0.0, "even": "harmonics", **parameters}
    return renderer.make(f"splat_{kind}", own)


def smaller(kind: str, scale: float, **parameters) -> renderer.Technique:
    """As `splat`, with splats of a share of the radius: that which holds so much less light."""
    from renderer.optics import fits, media

    curve = media.curve("marble")
    reach = scale * splat(kind).reach_mm(curve)
    share = float(fits.dipole(curve).cdf(np.array([reach])).min())
    low, high = 0.5, 0.9999
    for _ in range(40):  # the radius is the largest channel's
        share = 0.5 * (low + high)
        got = splat(kind, share=share).reach_mm(curve)
        low, high = (share, high) if got < reach else (low, share)
    return splat(kind, share=share, **parameters)


def numbers(frame, number: str, grids, published: dict, rounds: int, medium="marble") -> None:
    """A table of a frame's cost by the number of splats, by both methods."""
    times = {}
    for kind, rates in published.items():
        made = {f"{a} x {b}": splat(kind, grid=(a, b), samples="lights") for a, b in grids}
        times[kind] = spent(frame, made, rounds)
        rows = [(n, s, fps) for (n, s), fps in zip(times[kind].items(), rates, strict=True)]
        table(f"{kind}, {medium}, number of splats (table {number})", rows)
    ratio = np.median([times["multipole"][n] / times["dipole"][n] for n in times["dipole"]])
    paper = np.median(np.array(published["dipole"]) / np.array(published["multipole"]))
    print(f"\nmultipole over dipole: {ratio:.2f}; published {paper:.2f}", flush=True)


def frames(size: int, rounds: int, wanted: set[str]) -> None:
    """The tables of a frame's cost, those of `TABLES` that are wanted."""
    if wanted & {"6.1", "6.6", "6.8"}:
        drawing, frame = frame_of(34.0, size)
        if "6.1" in wanted:
            numbers(frame, "6.1", GRIDS, NUMBER, rounds)
        if "6.6" in wanted:
            grid = {"grid": (75, 32), "samples": "lights"}
            made = {f"{s:g}": smaller("multipole", s, **grid) for s in SIZES}
            got = spent(frame, made, rounds)
            rows = [(f"{s:g}", got[f"{s:g}"], fps) for s, fps in SIZES.items()]
            table("splat size, share of the radius (table 6.6, 75 x 32)", rows)
        if "6.8" in wanted:
            over_surface(frame, rounds)
        frame.close()
        drawing.close()
    for number, (medium, grids, published) in OTHERS.items():
        if number in wanted:
            drawing, frame = frame_of(34.0, size, medium)
            numbers(frame, number, grids, published, rounds, medium)
            frame.close()
            drawing.close()
    if "6.7" in wanted:
        distance(size, rounds)


def over_surface(frame, rounds: int) -> None:
    """Table 6.8: the size and the number of splats of points over the surface."""
    area = Body(frame.inputs(None).room.surfaces, 0).mesh.areas.sum()
    spacing_mm = float(np.sqrt(area / NUMBER_EVEN[0]))
    even = {f"{s:g}": smaller("multipole", s, spacing_mm=spacing_mm) for s in EVEN}
    got = spent(frame, even, rounds)
    rows = [(f"{s:g}", got[f"{s:g}"], fps) for s, fps in EVEN.items()]
    table("over the surface, splat size (table 6.8, 5,789 splats)", rows)
    more = {str(n): splat("multipole", spacing_mm=float(np.sqrt(area / n))) for n in NUMBER_EVEN}
    got = spent(frame, more, rounds)
    rows = [(n, s, fps) for (n, s), fps in zip(got.items(), FPS_EVEN, strict=True)]
    table("over the surface, number of splats (table 6.8)", rows)


def distance(size: int, rounds: int) -> None:
    """Table 6.7: the pixels that the object covers."""
    rows, covered = [], []
    for name, fps in FAR.items():
        drawing, frame = frame_of(HEIGHTS[name], size)
        covered.append(int((frame.surface.textures[3].read()[..., 0] > 0).sum()))
        one = {name: splat("multipole", grid=(50, 49), samples="lights")}
        rows.append((name, spent(frame, one, rounds)[name], fps))
        frame.close()
        drawing.close()
    note = "; pixels covered: " + ", ".join(f"{n:,}" for n in covered)
    table("distance (table 6.7, 50 x 49)", rows, note)


def relaxation() -> None:
    """How the relaxation of points grows, 10 rounds on a ball of 100,000 triangles."""
    ball = shapes.sphere(40.0, 158)
    start = time.process_time()
    mesh = Mesh(ball.positions, ball.faces)
    print(
        f"\nrelaxation, 10 rounds on {len(ball.faces):,} triangles (their neighbours: "
        f"{time.process_time() - start:.2f} s CPU, once); published: 10,000 points 4 s (table 5.4)"
    )
    print(f"{'points':>10}{'CPU s':>9}{'per point, us':>15}")
    for count in (1000, 3000, 10_000, 30_000, 100_000):
        triangles, weights = spread(mesh.areas, count, np.random.default_rng(0))
        start = time.process_time()
        relax(mesh, triangles, weights, 10)
        seconds = time.process_time() - start
        print(f"{count:>10,}{seconds:>9.2f}{1e6 * seconds / count:>15.0f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=512, help="pixels of a side")
    parser.add_argument("--rounds", type=int, default=3, help="of each, medians")
    parser.add_argument("--table", action="append", choices=TABLES, help="these alone; repeat")
    given = parser.parse_args()
    wanted = set(given.table or TABLES)
    if "5.4" in wanted:
        relaxation()
    frames(given.size, given.rounds, wanted)


if __name__ == "__main__":
    main()
