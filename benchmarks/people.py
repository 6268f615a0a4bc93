"""What a study of many people takes: peak memory and CPU of builds of 1, 2, 4 and 8 people, each at
three framings by five techniques.

    make bench BENCH=people
    PYTHONPATH=. .venv/bin/python benchmarks/people.py --size 1200x1500 --people 1 --people 8

Memory must not grow with the number of people. Builds start from an empty folder; people and light
may come from the caches: run it twice for figures without their making.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from benchmarks.edition import run
from renderer import caches
from stimuli.parts import PEOPLE, names

ROOT = Path(__file__).resolve().parents[1]
TECHNIQUES = ("none", "jimenez_gaussian", "jimenez_separable", "golubev", "golubev_plus")
FRAMINGS = ("close-up", "head-shot", "half-length")


def study(people: list[str], size: tuple[int, int]) -> str:
    """A study's text: these people at three framings by five techniques."""
    lines = [
        'name = "many"',
        'title = "Many people"',
        "version = 1",
        "seed = 1",
        'scene = "portrait"',
        'consent = "{questions} {minutes} {recorded}"',
        f"[render]\nsize = [{size[0]}, {size[1]}]\nsupersample = 2\nseed = 0",
    ]
    lines += [f'[[framings]]\nname = "{name}"\nlabel = "{name}"' for name in FRAMINGS]
    lines += ['[[factors]]\nname = "person"\nlabel = "Person"']
    lines += [f'[[factors.levels]]\nname = "{name}"\nlabel = "{name}"' for name in people]
    lines += [f'[[techniques]]\nname = "{name}"\nlabel = "{name}"' for name in TECHNIQUES]
    return "\n".join([*lines, '[analysis]\nmargin = 0.25\ntest = "wilcoxon"', ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="480x600")
    parser.add_argument("--people", type=int, action="append", help="default: 1, 2, 4 and 8")
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    known = names(PEOPLE)
    print(f"{'people':>6} {'images':>6} {'CPU s':>8} {'wall s':>8} {'peak MB':>8} {'of one':>7}")
    first = None
    for count in options.people or [1, 2, 4, 8]:
        if count > len(known):
            raise SystemExit(f"{count} people are asked for, {len(known)} are known")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "many.toml"
            file.write_text(study(known[:count], (width, height)), encoding="utf-8")
            out = Path(folder) / "built"
            cpu, wall, peak = run(ROOT, caches.folder(), "build", str(file), "--out", str(out))
            images = len(list(out.glob("**/*.png"))) - len(list(out.glob("masks/*.png")))
        first = first or peak
        print(
            f"{count:>6} {images:>6} {cpu:>8.1f} {wall:>8.1f} {peak:>8.0f} {peak / first:>7.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
