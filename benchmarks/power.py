"""Power and analyse agree: tables of simulated answers go through the whole of `analyse`, and its
report concludes what `power` decides of the same answers, study by study.

For the thesis's design (five techniques, three framings, 30 pairs) and what its study declares: as
many people as `power` names to find 0.5 JOD and to exclude 0.25 points, fresh answers, each table
read from a file of its own, every table of the analysis made, and the verdict and the sentence of
the report taken. The promised power itself is held to a thousand fresh studies. It ends with an
error where a verdict or a sentence differs from power's decision, or the fresh share is more than 4
standard errors of both simulations from the promise.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
from tqdm import tqdm

from analysis import read_responses
from analysis.compute import everything
from analysis.conclusions import conclude
from analysis.inference import verdict
from analysis.options import OVERALL, Options
from analysis.planning import Plan, Studies, plan_table

TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")
PAIR = ("golubev", "golubev_plus")
FRAMINGS = ("close-up", "head-shot", "half-length")
HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at,simulated"


def write_table(path: Path, run: Studies, study: int, people: int, seed: int) -> None:
    """responses.csv of the first people of one simulated study, sides and order shuffled."""
    rng, plan = np.random.default_rng([seed, study]), run.plan
    lines = [HEADER]
    for person in range(people):
        asked = np.argwhere(run.asked[study, person])
        for order, (framing, pair) in enumerate(rng.permutation(asked), start=1):
            a, b = plan.pairs[pair]
            answer, turn = int(run.answers[study, person, framing, pair]), rng.random() < 0.5
            left, right = (b, a) if turn else (a, b)
            lines.append(
                f"P{person:04d},{1 + person % 5},{plan.framings[framing]},"
                f"{plan.techniques[left]},{plan.techniques[right]},{-answer if turn else answer},"
                f"{order},{int(rng.lognormal(8.5, 0.5))},2024-05-01T09:00:00Z,1"
            )
    path.write_text("\n".join(lines) + "\n")


def decided(table: pd.DataFrame, goal: str) -> list[bool]:
    """Whether the table of pairs concludes it for the pair, at each framing."""
    about = table[(table.a == PAIR[0]) & (table.b == PAIR[1]) & (table.framing != OVERALL)]
    wanted = {"find": ("different", "both"), "exclude": ("equivalent", "both")}[goal]
    return [verdict(row, 0.05) in wanted for row in about.itertuples()]


def concluded(path: Path, options: Options, goal: str) -> tuple[list[bool], bool]:
    """Whether the report concludes it for the pair at each framing, and whether its sentences say
    so.
    """
    responses = read_responses(path, order=TECHNIQUES)
    results = everything(responses, options)
    words = conclude(
        results.tables, results.notes, responses.codebook, options, responses.participants, True
    )
    reached = decided(results.tables["pairs"], goal)
    if goal == "find":
        stated = [
            any(
                f"{name}: simulated participants preferred" in one and PAIR[1] in one.split(" (")[0]
                for one in words.can
            )
            for name in FRAMINGS
        ]
        return reached, all(there for here, there in zip(reached, stated, strict=True) if here)
    stated = [
        any(one.startswith(f"{name}: {PAIR[0]} and {PAIR[1]} are as good") for one in words.can)
        for name in FRAMINGS
    ]
    return reached, reached == stated


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--studies", type=int, default=40, help="tables through analyse, each goal")
    parser.add_argument("--goal", choices=["find", "exclude"], help="one of the two goals alone")
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    options = Options(margin=0.25, margin_jod=0.5)
    plan = Plan(TECHNIQUES, PAIR, framings=FRAMINGS, options=options, studies=1000, seed=1)
    begun = time.process_time()
    _, needed = plan_table(plan, ("full",))
    print(f"power: 1,000 simulated studies in {time.process_time() - begun:.1f} s of CPU")
    declared = needed[(needed.test == "declared") & (needed.correction == "family")]
    failed = []
    for goal, difference in {"find": 0.5, "exclude": 0.0}.items():
        if given.goal not in (None, goal):
            continue
        row = declared[declared.goal == goal].iloc[0]
        people = int(row.people)
        fresh = Plan(
            TECHNIQUES, PAIR, framings=FRAMINGS, options=options, studies=1000, most=people
        )
        truth = dict.fromkeys(FRAMINGS, difference)
        run = Studies(fresh, "full", truth.__getitem__, np.random.default_rng(given.seed))
        decisions = (run.detected if goal == "find" else run.excluded)(
            people
        )  # (studies, framings)
        begun, reached, agreed = time.process_time(), [], True
        with tempfile.TemporaryDirectory(prefix="subdermal-") as folder:
            path = Path(folder) / "responses.csv"
            for study in tqdm(range(given.studies), desc=goal, unit="study", disable=None):
                write_table(path, run, study, people, given.seed)
                one, same = concluded(path, options, goal)
                reached.append(one)
                agreed &= same
        differ = int((np.array(reached) != decisions[: given.studies]).sum())
        share = decisions.mean()
        error = math.hypot(
            decisions.mean(axis=1).std() / math.sqrt(len(decisions)), 0.4 / math.sqrt(plan.studies)
        )
        print(
            f"{goal}: {people} people promised {row.power:.3f}, in 1,000 fresh studies "
            f"{share:.3f} (+-{error:.3f}); of {np.size(reached)} verdicts of {given.studies} whole "
            f"analyses {differ} differ from power's decisions, sentences "
            f"{'agree' if agreed else 'DISAGREE'} with verdicts; "
            f"{time.process_time() - begun:.0f} s of CPU"
        )
        if abs(share - row.power) > 4 * error or differ or not agreed:
            failed.append(goal)
    for goal in failed:
        print(f"missed: {goal}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
