"""This edition against an earlier one, in turn on one machine: CPU, wall clock and peak memory.

    make bench BENCH=edition              against the commit 65e2347, the first edition
    PYTHONPATH=. .venv/bin/python benchmarks/edition.py --build --commit COMMIT
    PYTHONPATH=. .venv/bin/python benchmarks/edition.py --build --alone

`render` draws the thesis scene's head-shot by golubev at 1920x1080, 2x2; the first time from empty
caches (but for the fetched head data), then again, then by another technique. --build also builds
the 15 images of the thesis study, once with the head and the light that `render` has made and once
from empty caches.
The earlier edition is checked out into a worktree and run with this one's packages. Images of both
are compared in levels of 255. --alone measures this edition and no other.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from renderer import caches
from stimuli.heads import fetch

ROOT = Path(__file__).resolve().parents[1]
FIRST = "65e2347"
WHAT = ("CPU s", "wall s", "peak MB")


def run(tree: Path, cache: Path, *args: str) -> tuple[float, float, float]:
    """CPU s, wall s and peak MB of one command of an edition in a process of its own."""
    code = (
        "import resource, subprocess, sys; "
        "code = subprocess.run([sys.executable, '-m', 'app.cli', *sys.argv[1:]], "
        "stdout=subprocess.DEVNULL).returncode; "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss); sys.exit(code)"
    )
    environment = {**os.environ, "PYTHONPATH": str(tree), "SUBDERMAL_CACHE": str(cache)}
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", code, *args],
        cwd=tree,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, wall, int(done.stdout) / 1024


def difference(one: Path, other: Path) -> str:
    """How far two images are from each other, in levels of 255."""
    a, b = (np.asarray(Image.open(path), int) for path in (one, other))
    off = np.abs(a - b).max(axis=2)
    share = 100 * (off > 0).mean()
    return f"largest {off.max()}, mean {off.mean():.3f}, {share:.1f} % of pixels differ"


def main() -> None:
    ask = argparse.ArgumentParser(description="this edition against an earlier one")
    ask.add_argument("--commit", default=FIRST, help="the earlier edition")
    ask.add_argument("--build", action="store_true", help="also build the thesis study")
    ask.add_argument("--size", default="1920x1080", help="of the images that `render` draws")
    ask.add_argument("--alone", action="store_true", help="without the earlier edition")
    options = ask.parse_args()
    fetch.mpfb_data()
    with tempfile.TemporaryDirectory(prefix="subdermal-edition-") as scratch:
        work = Path(scratch)
        old = work / "old"
        if options.alone:
            compare(work, None, options)
            return
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", old, options.commit], check=True)
        try:
            compare(work, old, options)
        finally:
            subprocess.run([*git, "remove", "--force", old], check=True)


def emptied(work: Path, name: str) -> Path:
    """A folder of caches with nothing in it but the fetched head data."""
    cache = work / name
    cache.mkdir()
    for data in caches.folder().glob("mpfb2-*"):
        (cache / data.name).symlink_to(data)
    return cache


def compare(work: Path, old: Path | None, options: argparse.Namespace) -> None:
    """Print the table."""
    cache = emptied(work, "cache")
    asked = ["render", "-f", "head-shot", "--size", options.size]
    rows = [
        ("render, first", cache, [*asked, "-t", "golubev"]),
        ("render, again", cache, [*asked, "-t", "golubev"]),
        ("render, other technique", cache, [*asked, "-t", "jimenez_separable"]),
    ]
    if options.build:
        build = ["build", "stimuli/studies/thesis.toml"]
        rows.append(("build, head and light kept", cache, build))
        rows.append(("build, from empty caches", emptied(work, "empty"), build))
    editions = {"old": old, "new": ROOT} if old else {"new": ROOT}
    titles = "".join(f"{f'{what}, {edition}':>14}" for what in WHAT for edition in editions)
    print(f"{'':<28}{titles}{'CPU, ratio':>12}" if old else f"{'':<28}{titles}")
    for k, (title, kept, args) in enumerate(rows):
        images, spent = [], []
        for edition, tree in editions.items():
            images.append(work / f"{edition}{k}{'' if args[0] == 'build' else '.png'}")
            spent.append(run(tree, kept, *args, "--out", str(images[-1])))
        numbers = "".join(f"{one:>14.1f}" for of_one in zip(*spent, strict=True) for one in of_one)
        ratio = f"{spent[-1][0] / spent[0][0]:>12.2f}" if old else ""
        print(f"{title:<28}{numbers}{ratio}", flush=True)
        if old and args[0] == "render":
            print(f"{'':<28}{difference(*images)}", flush=True)


if __name__ == "__main__":
    main()
