"""Response tables for the tests of the analysis: tiny ones by hand, and a random study of the thesis's shape."""

import csv
from itertools import combinations

import numpy as np
import pytest

HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")


@pytest.fixture
def write(tmp_path):
    """write(rows, header=..., name=...) -> path of a responses.csv; rows are lines of text or sequences of cells."""

    def write(rows, header=HEADER, name="responses.csv"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8", newline="") as file:
            file.write(header + "\n")
            for row in rows:
                if isinstance(row, str):
                    file.write(row + "\n")
                else:
                    csv.writer(file, lineterminator="\n").writerow(row)
        return path

    return write


@pytest.fixture
def answer():
    """answer(participant, framing, left, right, answer) -> a whole row."""
    numbers = iter(range(1, 100_000))

    def answer(participant, framing, left, right, value, familiarity=3):
        row = (participant, familiarity, framing, left, right, value, next(numbers), 1500, "2024-05-01T09:00:00Z")
        return ",".join(map(str, row))

    return answer


@pytest.fixture(scope="session")
def random_study():
    """random_study(people, seed) -> rows of a whole study: every pair at every framing, sides and order shuffled."""

    def rows(people, seed=0, framings=FRAMINGS, techniques=TECHNIQUES):
        rng = np.random.default_rng(seed)
        worth = {name: rng.normal(0, 0.7) for name in techniques}
        table = []
        for person in range(people):
            level = int(rng.integers(1, 6))
            trials = [(framing, *pair) for framing in framings for pair in combinations(techniques, 2)]
            for order, place in enumerate(rng.permutation(len(trials)), start=1):
                framing, left, right = trials[place]
                if rng.random() < 0.5:
                    left, right = right, left
                felt = worth[right] - worth[left] + rng.normal(0, 1)
                value = int(np.digitize(felt, [-1.3, -0.4, 0.4, 1.3])) - 2
                rt = int(rng.lognormal(8.5, 0.5))
                table.append([f"P{person:04d}", level, framing, left, right, value, order, rt, "2024-05-01T09:00:00.250Z"])
        return table

    return rows
