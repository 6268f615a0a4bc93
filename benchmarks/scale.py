"""How a study grows, measured small: images, questions, answers, analysis; and what the growth says
of 100 techniques on 50 heads and 100,000 participants (docs/scale.md).

Each line is a process of its own: seconds of the processor, peak memory, bytes. The last column is
the exponent between the last two sizes: seconds ~ size^exponent.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from itertools import combinations
from pathlib import Path

import numpy as np

STUDY = """
name = "large"
title = "Which is softer?"
version = 1
seed = 1
scene = "thesis"
[assignment]
pairs = 30
"""


def study(techniques: int, heads: int, framings: int):
    """A study of so many parameters of one technique on so many skins."""
    from stimuli.study import load_study

    lines = [STUDY]
    for k, name in enumerate(("close-up", "head-shot", "half-length")[:framings]):
        lines.append(f'[[framings]]\nname = "{name}"\nlabel = "F{k}"')
    if heads > 1:
        lines.append('[[factors]]\nname = "skin"\nlabel = "Skin"')
    for k in range(heads if heads > 1 else 0):
        melanin = 0.02 + 0.3 * k / heads
        lines.append(f'[[factors.levels]]\nname = "s{k}"\nlabel = "S{k}"')
        lines.append(f"set = {{ materials = {{ head = {{ melanin = {melanin:.4f} }} }} }}")
    for k in range(techniques):
        lines.append(f'[[techniques]]\nname = "t{k}"\nlabel = "T{k}"\ntechnique = "golubev"')
        lines.append(f"parameters = {{ samples = {4 + k} }}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text("\n".join(lines))
        return load_study(path)


def images(techniques: int, heads: int, framings: int) -> dict:
    """The plan of a build, its records, its manifest; nothing is drawn."""
    from stimuli import build, drawing, manifest, records

    large = study(techniques, heads, framings)
    result, begun = {}, time.process_time()

    def lap(name: str) -> None:
        nonlocal begun
        result[name] = time.process_time() - begun
        begun = time.process_time()

    plan = build._plan(large, build.resolve(large))
    lap("plan s")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        records.upgrade(out, {})
        for s in plan:
            image = drawing.entry(s, large.render, "0" * 64, 20.0, {}, None, {})
            done = {"key": s.key, "image": image, "licences": [], "notes": []}
            records.write(out, s.file, done)
        lap("records s")
        entries = [one["image"] for one in records.read(out).values()]
        record = {"format": manifest.FORMAT, "study": large.record(), "images": entries}
        records.write_json(out / manifest.NAME, record | {"licences": []})
        lap("manifest s")
        result["manifest MB"] = (out / manifest.NAME).stat().st_size / 1e6
        manifest.load_manifest(out, verify=False)
        lap("open s")
    return result


def questions(techniques: int, heads: int, framings: int, number: int) -> dict:
    """One participant's list of 30 questions."""
    from stimuli import design

    cells = [f"c{k}" for k in range(heads * framings)]
    names = [f"t{k}" for k in range(techniques)]
    begun = time.process_time()
    design.trials(cells, names, 1, number, pairs=30)
    return {"list s": time.process_time() - begun}


def answers(people: int) -> dict:
    """Simulated participants through the real pages; the thesis study with images of 32x18."""
    from PIL import Image

    from stimuli import manifest
    from stimuli.study import THESIS, load_study

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        (out / "images").mkdir()
        thesis, entries = load_study(THESIS), []
        for k, (cell, one) in enumerate(
            (cell, one) for cell in thesis.cells for one in thesis.techniques
        ):
            file = f"images/{cell.name}_{one.name}.png"
            Image.new("RGB", (32, 18), (k, 90, 60)).save(out / file)
            entry = {"framing": cell.framing, "technique": one.name, "file": file}
            digest = manifest.sha256(out / file)
            entries.append(entry | {"width": 32, "height": 18, "sha256": digest})
        table = thesis.record()
        record = {"format": manifest.FORMAT, "study": table, "images": entries}
        (out / manifest.NAME).write_text(json.dumps(record))
        command = [sys.executable, "-m", "app.cli", "simulate", str(out)]
        begun = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run(
            [*command, "--participants", str(people), "--seed", "1"],
            check=True,
            capture_output=True,
        )
        spent = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begun
        csv = out / "simulated/responses.csv"
        rows = len(csv.read_text().splitlines()) - 1
        size = sum(p.stat().st_size for p in out.rglob("simulated.sqlite3*"))
        return {
            "simulate s": spent,
            "rows": rows,
            "database MB": size / 1e6,
            "csv MB": csv.stat().st_size / 1e6,
        }


def analysis(people: int, techniques: int) -> dict:
    """Reading and all tables: 30 answers a person, by lot among all pairs at one framing."""
    from analysis import read_responses
    from analysis.compute import everything
    from analysis.options import Options

    rng = np.random.default_rng(1)
    pairs = np.array(list(combinations(range(techniques), 2)))
    latent = np.linspace(-0.8, 0.8, techniques)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "responses.csv"
        with path.open("w") as file:
            file.write("participant,framing,left,right,answer\n")
            for person in range(people):
                own = latent + rng.normal(0, 0.4, techniques)
                each = rng.permutation(len(pairs))[:30]
                for a, b in pairs[each]:
                    felt = own[b] - own[a] + rng.logistic()
                    value = int(np.digitize(felt, [-2, -0.6, 0.6, 2])) - 2
                    file.write(f"P{person:06d},near,t{a:03d},t{b:03d},{value}\n")
        begun = time.process_time()
        responses = read_responses(path)
        read = time.process_time() - begun
        everything(responses, Options(models=("bradley_terry", "thurstone_jod")))
        return {"read s": read, "tables s": time.process_time() - begun - read}


#: What is measured at which sizes, and what it would be asked for.
CASES = {
    "images": ([(5, 1, 3), (10, 5, 3), (20, 10, 3)], (100, 50, 3)),
    "questions": ([(5, 1, 3, 9), (20, 10, 3, 9), (20, 10, 3, 9001)], (100, 50, 3, 100_000)),
    "answers": ([(4,), (16,)], (100_000,)),
    "analysis of people": ([(400, 5), (1600, 5), (6400, 5)], (100_000, 5)),
    "analysis of techniques": ([(200, 10), (200, 20), (200, 40)], (200, 100)),
}
WORK = {
    "images": images,
    "questions": questions,
    "answers": answers,
    "analysis of people": analysis,
    "analysis of techniques": analysis,
}


def measured(case: str, size: tuple[int, ...]) -> dict:
    """In a process of its own, with its peak memory in MB."""
    command = [sys.executable, __file__, "--one", case, json.dumps(size)]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(f"{case} {size}: {run.stderr[-2000:]}")
    return json.loads(run.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=CASES)
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        case, size = given.one
        result = WORK[case](*json.loads(size))
        result["peak MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(json.dumps(result))
        return
    for case, (sizes, wanted) in CASES.items():
        if given.only in (None, case):
            print(f"{case}: {WORK[case].__doc__.splitlines()[0]} Asked for: {wanted}")
            table = [measured(case, size) for size in sizes]
            for size, row in zip(sizes, table, strict=True):
                values = "  ".join(f"{name} {value:.4g}" for name, value in row.items())
                print(f"  {size!s:20} {values}")
            ratio = math.prod(sizes[-1]) / math.prod(sizes[-2])
            if ratio > 1:
                grows = {
                    name: math.log(table[-1][name] / table[-2][name]) / math.log(ratio)
                    for name in table[-1]
                    if table[-2][name] > 0 < table[-1][name]
                }
                print(
                    "  exponent             " + "  ".join(f"{n} {v:.2f}" for n, v in grows.items())
                )


if __name__ == "__main__":
    main()
