"""When adaptive pairs are worth it: against pairs that are dealt evenly, on simulated people.

One cell, techniques that are nearly equal and techniques that are far apart, half of the pairs (of
twenty techniques a sixth) from each person. The gain is how many times as many answers the dealt
design needs for the same squared error; below 1 the adaptive design loses.
"""

from __future__ import annotations

import argparse

from tqdm import tqdm

from app.simulation.designs import compare
from stimuli.asking import Assignment

#: Techniques, pairs a person, studies.
SIZES = ((5, 5, 200), (10, 22, 60), (20, 32, 20))
SPREADS = (0.5, 5.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--studies", type=int, help="of each row; by default 200, 60 and 20")
    parser.add_argument("--items", type=int, action="append", help="rows of these alone")
    parser.add_argument("--as-good", type=float, default=Assignment.as_good)
    given = parser.parse_args()
    rows = [
        (items, spread, pairs, given.studies or studies)
        for items, pairs, studies in SIZES
        for spread in SPREADS
        if not given.items or items in given.items
    ]
    print(
        "| techniques | from worst to best, JOD | pairs a person | error of all pairs, JOD | of "
        "neighbours | neighbours in order | gain, all pairs | gain, neighbours | answers a pair |\n"
        "|---|---|---|---|---|---|---|---|---|"
    )
    for items, spread, pairs, studies in tqdm(rows, disable=None):
        one = compare(
            items, spread, given.people, pairs, studies, given.seed, as_good=given.as_good
        )
        gains = ["{:.2f} ({:.2f} to {:.2f})".format(*gain) for gain in (one.gain, one.near_gain)]
        print(
            f"| {items} | {spread:g} | {pairs} | {one.error[0]:.2f}, {one.error[1]:.2f} | "
            f"{one.near_error[0]:.2f}, {one.near_error[1]:.2f} | "
            f"{100 * one.order[0]:.0f} %, {100 * one.order[1]:.0f} % | {' | '.join(gains)} | "
            f"{one.least:.0f} to {one.most:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
