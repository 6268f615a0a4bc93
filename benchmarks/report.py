"""The whole report, from a table on disk to all files: CPU time against people. The aim: under a
minute for 1,000 people x 30 answers.

The answers are simulated by the model of analysis.planning, five techniques at three framings. Each
size runs in a process of its own, so that imports and the peak of memory count.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from analysis.planning import SIGMA

FRAMINGS = {
    "close-up": (-1.2, -0.5, 0.5, 1.0, 0.2),
    "head-shot": (-0.8, -0.3, 0.5, 0.5, 0.1),
    "half-length": (0.3, -0.2, 0.0, -0.1, 0.0),
}
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")
HEADER = (
    "participant",
    "familiarity",
    "framing",
    "left",
    "right",
    "answer",
    "order",
    "rt_ms",
    "started_at",
    "simulated",
)
ONE = """
import resource, sys, time
from analysis import read_responses
from analysis.report import report_responses, write_files
answers = read_responses(sys.argv[1])
read = time.process_time()
write_files(report_responses(answers), sys.argv[2])
print(time.process_time(), read, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def write_table(path: Path, people: int, seed: int) -> int:
    """A responses.csv of so many people; how many answers it has."""
    rng, answers = np.random.default_rng(seed), 0
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(HEADER)
        for person in range(people):
            trials = [
                (framing, a, b) for framing in FRAMINGS for a in range(5) for b in range(a + 1, 5)
            ]
            for order, place in enumerate(rng.permutation(len(trials)), start=1):
                framing, left, right = trials[place]
                if rng.random() < 0.5:
                    left, right = right, left
                d = FRAMINGS[framing][right] - FRAMINGS[framing][left] + rng.normal(0, SIGMA)
                answer = int(np.sign(d)) * (int(abs(d) >= 0.5) + int(abs(d) >= 1.8))
                row = (
                    f"P{person:05d}",
                    person % 5 + 1,
                    framing,
                    TECHNIQUES[left],
                    TECHNIQUES[right],
                    answer,
                    order,
                )
                table.writerow((*row, int(rng.lognormal(8.5, 0.5)), "2024-05-01T09:00:00Z", 1))
                answers += 1
    return answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument(
        "--people",
        type=int,
        nargs="+",
        default=[20, 100, 1000],
        help="how many people, a row of the table each",
    )
    parser.add_argument("--seed", type=int, default=1, help="draws the answers")
    given = parser.parse_args()
    print(
        "| people | answers | report, CPU s | of it reading, s | peak memory, MB "
        "|\n|--:|--:|--:|--:|--:|"
    )
    for people in given.people:
        with tempfile.TemporaryDirectory(prefix="subdermal-") as folder:
            path = Path(folder) / "responses.csv"
            answers = write_table(path, people, given.seed)
            done = subprocess.run(
                [sys.executable, "-c", ONE, path, Path(folder) / "out"],
                capture_output=True,
                text=True,
                check=True,
            )
            total, read, memory = map(float, done.stdout.split())
        print(f"| {people} | {answers} | {total:.1f} | {read:.1f} | {memory:.0f} |", flush=True)
        if people <= 1000 and total > 60:
            sys.exit(
                f"MISSED: the report of {people} people took {total:.1f} s of CPU, the aim is 60 s"
            )


if __name__ == "__main__":
    main()
