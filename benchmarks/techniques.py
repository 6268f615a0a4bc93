"""What each technique costs: scattering alone, over the same shared buffers, in turn, so that drift
hits all alike.

Prints median wall and CPU milliseconds of one 1920x1080 frame at 2x2 supersampling, their ratio to
golubev within this run, samples per scattering pixel, and what the techniques share. Software
OpenGL is a processor's work: compare ratios. The reference, which takes hours at this size, is left
out.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

import renderer
from stimuli import scenes
from stimuli.experiment.cost import medians

ROUNDS = 5
#: Of what works on the surface and takes seconds: rounds, and points farther apart than by default.
SURFACE_ROUNDS = 1
SPACING_MM = 2.0
SURFACE = ("atlas", "points")  # walks are the truth, and as slow as it is


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--framing", action="append", choices=list(renderer.FRAMINGS))
    parser.add_argument("--technique", action="append", choices=list(renderer.TECHNIQUES))
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of filters of the screen")
    given = parser.parse_args()
    sparse = {"points": {"spacing_mm": SPACING_MM}}
    wanted = {*(given.technique or renderer.TECHNIQUES), "golubev"}
    kinds = {
        n: kind for n, kind in renderer.TECHNIQUES.items() if kind.domain != "walks" and n in wanted
    }
    techniques = {name: renderer.make(name, sparse.get(kinds[name].domain)) for name in kinds}
    screen = {name: made for name, made in techniques.items() if made.domain == "screen"}
    surface = {name: made for name, made in techniques.items() if made.domain in SURFACE}
    start = time.perf_counter(), time.process_time()
    staged = scenes.stage(scenes.read_scene(scenes.load_table("thesis")))
    loaded = time.perf_counter() - start[0], time.process_time() - start[1]
    with renderer.Renderer(staged.graph) as drawing:
        print(
            f"{drawing.info()['gl_renderer']}, 1920x1080, 2x2 supersampling, {given.rounds} "
            "rounds in turn, medians"
        )
        print(f"head: {loaded[0]:.1f} s wall, {loaded[1]:.1f} s CPU")
        for framing in given.framing or renderer.FRAMINGS:
            camera = renderer.FRAMINGS[framing]
            start = time.perf_counter(), time.process_time()
            frame = drawing.frame(camera)
            shared = time.perf_counter() - start[0], time.process_time() - start[1]
            samples = dict.fromkeys(surface, np.nan)
            for name, technique in screen.items():
                counts = frame.render(technique).samples
                samples[name] = counts[counts > 0].mean()
            median = {
                name: spent
                for timed, rounds in ((screen, given.rounds), (surface, SURFACE_ROUNDS))
                for name, spent in medians(frame, timed, rounds).items()
            }
            frame.close()
            print(
                f"\n{framing}: shared passes {shared[0]:.1f} s wall, {shared[1]:.1f} s CPU "
                "(once a framing)"
            )
            print(
                f"{'technique':<18}{'wall ms':>9}{'CPU ms':>9}{'wall/golubev':>14}"
                f"{'CPU/golubev':>13}{'samples':>9}"
            )
            for name, (wall, cpu) in median.items():
                print(
                    f"{name:<18}{1e3 * wall:>9.0f}{1e3 * cpu:>9.0f}"
                    f"{wall / median['golubev'][0]:>14.2f}{cpu / median['golubev'][1]:>13.2f}"
                    f"{samples[name]:>9.2f}"
                )
    print(f"\npeak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
