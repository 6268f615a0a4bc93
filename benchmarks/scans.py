"""Twelve awkward heads (tests/heads/awkward.py) and any others: how each is understood, and a
portrait of each, in one picture.

    make bench BENCH=scans
    PYTHONPATH=. .venv/bin/python benchmarks/scans.py --scan head.obj --out docs/scans.jpg

Every head goes through the commands that a user takes: `subdermal head` and `subdermal render`.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import trimesh
from PIL import Image, ImageDraw, ImageFont

from tests.heads import awkward

ROOT = Path(__file__).resolve().parents[1]
ENDINGS = (".ply", ".stl", ".obj")
CELL = (700, 356)
PORTRAIT = (240, 300)


def subdermal(*args: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-m", "app.cli", *args],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return done.returncode, done.stdout.strip()


def cell(title: str, said: str, sheet: Path, portrait: Path) -> Image.Image:
    """One head's cell; where it was refused, the line alone."""
    image = Image.new("RGB", CELL, "white")
    pen = ImageDraw.Draw(image)
    pen.text((8, 6), title, "black", ImageFont.load_default(18))
    if portrait.exists():
        with Image.open(portrait) as seen:
            image.paste(seen, (8, 34))
        with Image.open(sheet) as drawn:
            width = CELL[0] - PORTRAIT[0] - 24
            part = drawn.crop((0, 40, drawn.width, int(0.80 * drawn.height)))
            image.paste(
                part.resize((width, part.height * width // part.width), Image.Resampling.LANCZOS),
                (PORTRAIT[0] + 16, 34),
            )
    pen.text((8, CELL[1] - 20), said[:130], "black", ImageFont.load_default(11))
    return image


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scan", action="append", default=[], help="another head's file")
    parser.add_argument("--skin", default="woman", help="person whose skin all of them get")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "scans.jpg")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    cells = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = {Path(file).stem: Path(file).resolve() for file in options.scan}
        for place, (title, case) in enumerate(awkward.HEADS.items()):
            file = folder / f"{place}{ENDINGS[place % len(ENDINGS)]}"
            trimesh.Trimesh(*case.mesh(), process=False).export(file)
            files[f"{title} ({file.suffix[1:]})"] = file
        for place, (title, file) in enumerate(files.items()):
            sheet, portrait = folder / f"sheet{place}.png", folder / f"portrait{place}.png"
            start = time.perf_counter()
            code, words = subdermal("head", str(file), "--out", str(sheet))
            if code == 0:
                code, drawn = subdermal(
                    *("render", "--scene", "portrait", "-t", "golubev", "-f", "head-shot"),
                    *("--size", "x".join(map(str, PORTRAIT)), "--head", str(file)),
                    *("--skin", options.skin, "--out", str(portrait)),
                )
                words = words if code == 0 else drawn
            line = words.splitlines()[0 if code == 0 else -1]
            print(f"{title}: {line}; {time.perf_counter() - start:.0f} s", flush=True)
            cells.append(cell(title, line, sheet, portrait))
    columns = 2
    rows = -(-len(cells) // columns)
    whole = Image.new("RGB", (columns * CELL[0], rows * CELL[1]), "white")
    for place, one in enumerate(cells):
        whole.paste(one, (place % columns * CELL[0], place // columns * CELL[1]))
    whole.save(options.out, quality=88)
    print(f"{options.out}: written")


if __name__ == "__main__":
    main()
