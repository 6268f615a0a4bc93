"""What a study of many people takes: peak memory and CPU of builds of 1, 2, 4 and 8 people, each at
three framings by five techniques.

    make bench BENCH=people
    PYTHONPATH=. .venv/bin/python benchmarks/people.py --size 1200x1500 --people 1 --people 8
    PYTHONPATH=. .venv/bin/python benchmarks/people.py --people 1 --among woman_old

Memory must not grow with the number of people: beside a build's peak stands that of the one among
them whose build alone takes most, since heads differ (long hair has three times the points of short
hair). A build of several people is measured before those of each alone, so that it is the one that
makes them where the caches have them not: run it twice for figures without their making.
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
    parser.add_argument(
        "--among", action="append", help="people to take; default: all that are known"
    )
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    known, counts = options.among or names(PEOPLE), options.people or [1, 2, 4, 8]
    if max(counts) > len(known):
        raise SystemExit(f"{max(counts)} people are asked for, {len(known)} are known")
    title = f"{'people':>6} {'images':>6} {'CPU s':>8} {'wall s':>8} {'peak MB':>8}"
    print(f"{title} {'most alone':>10} {'ratio':>6}  of")
    alone: dict[str, float] = {}

    def measured(people: list[str]) -> tuple[str, float]:
        """The words of a build's line, and its peak."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "many.toml"
            file.write_text(study(people, (width, height)), encoding="utf-8")
            out = Path(folder) / "built"
            cpu, wall, peak = run(ROOT, caches.folder(), "build", str(file), "--out", str(out))
            images = len(list(out.glob("images/*.png")))
        return f"{len(people):>6} {images:>6} {cpu:>8.1f} {wall:>8.1f} {peak:>8.0f}", peak

    def measure_alone(name: str) -> None:
        if name not in alone:
            words, alone[name] = measured([name])
            print(f"{words} {'':>17}  {name}", flush=True)

    for count in counts:
        people = known[:count]
        if count == 1:
            measure_alone(people[0])
            continue
        words, peak = measured(people)
        for name in people:
            measure_alone(name)
        most = max(people, key=alone.__getitem__)
        print(f"{words} {alone[most]:>10.0f} {peak / alone[most]:>6.2f}  {most}", flush=True)


if __name__ == "__main__":
    main()
