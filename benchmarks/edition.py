"""This edition against an earlier one, in turn on one machine: CPU, wall clock and peak memory.

    make bench BENCH=edition              against the commit 65e2347, the first edition
    PYTHONPATH=. .venv/bin/python benchmarks/edition.py --build --commit COMMIT

`render` draws the thesis scene's head-shot by golubev at 1920x1080, 2x2; the first time from empty
caches (but for the fetched head data), then again, then by another technique. --build also builds
the 15 images of the thesis study. The earlier edition is checked out into a worktree and run with
this one's packages. Images of both are compared in levels of 255.
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
    options = ask.parse_args()
    fetch.mpfb_data()
    with tempfile.TemporaryDirectory(prefix="subdermal-edition-") as scratch:
        work = Path(scratch)
        old = work / "old"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", old, options.commit], check=True)
        try:
            compare(work, old, options)
        finally:
            subprocess.run([*git, "remove", "--force", old], check=True)


def compare(work: Path, old: Path, options: argparse.Namespace) -> None:
    """Print the table."""
    cache = work / "cache"
    cache.mkdir()
    for data in caches.folder().glob("mpfb2-*"):
        (cache / data.name).symlink_to(data)
    asked = ["render", "-f", "head-shot", "--size", options.size]
    rows = [
        ("render, first", [*asked, "-t", "golubev"]),
        ("render, again", [*asked, "-t", "golubev"]),
        ("render, other technique", [*asked, "-t", "jimenez_separable"]),
    ]
    if options.build:
        rows.append(("build, 15 images", ["build", "stimuli/studies/thesis.toml"]))
    print(f"{'':<26}{'CPU s':>16}{'ratio':>8}{'wall s':>18}{'peak MB':>16}")
    for k, (title, args) in enumerate(rows):
        made = []
        for edition, tree in (("old", old), ("new", ROOT)):
            out = work / f"{edition}{k}{'' if args[0] == 'build' else '.png'}"
            made.append((out, run(tree, cache, *args, "--out", str(out))))
        (_, (c0, w0, p0)), (_, (c1, w1, p1)) = made
        numbers = f"{c0:>7.1f} {c1:>8.1f}{c1 / c0:>8.2f}{w0:>9.1f} {w1:>8.1f}{p0:>8.0f} {p1:>7.0f}"
        print(f"{title:<26}{numbers}", flush=True)
        if args[0] == "render":
            print(f"{'':<26}{difference(made[0][0], made[1][0])}", flush=True)


if __name__ == "__main__":
    main()
