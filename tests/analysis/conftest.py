"""Response tables for the tests of the analysis: tiny ones by hand, and a random study of the
thesis's shape.
"""

import csv
from itertools import combinations

import numpy as np
import pytest

HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")


@pytest.fixture
def write(tmp_path):
    """write(rows, header=..., name=...) -> path of a responses.csv; rows are lines of text or
    sequences of cells.
    """

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
        row = (
            participant,
            familiarity,
            framing,
            left,
            right,
            value,
            next(numbers),
            1500,
            "2024-05-01T09:00:00Z",
        )
        return ",".join(map(str, row))

    return answer


@pytest.fixture
def undrawn(monkeypatch):
    """Figures that are made and not rendered, which takes most of a report's time: for tests of
    words and tables.
    """
    from analysis import figures

    svg = (
        b'<svg xmlns="http://www.w3.org/2000/svg" '
        b'width="240pt" height="120pt" viewBox="0 0 240 120"/>'
    )

    def picture(name, title, caption, alt, draw, *args, simulated=False):
        draw(*args)
        return figures.Picture(
            name,
            title,
            caption,
            f"{figures.SIMULATED}. {alt}" if simulated else alt,
            svg,
            b"png",
            b"pdf",
        )

    monkeypatch.setattr(figures, "_picture", picture)


@pytest.fixture(scope="session")
def random_study():
    """random_study(people, seed) -> rows of a whole study: every pair at every framing, sides and
    order shuffled.
    """

    def rows(people, seed=0, framings=FRAMINGS, techniques=TECHNIQUES):
        rng = np.random.default_rng(seed)
        worth = {name: rng.normal(0, 0.7) for name in techniques}
        table = []
        for person in range(people):
            level = int(rng.integers(1, 6))
            trials = [
                (framing, *pair) for framing in framings for pair in combinations(techniques, 2)
            ]
            for order, place in enumerate(rng.permutation(len(trials)), start=1):
                framing, left, right = trials[place]
                if rng.random() < 0.5:
                    left, right = right, left
                felt = worth[right] - worth[left] + rng.normal(0, 1)
                value = int(np.digitize(felt, [-1.3, -0.4, 0.4, 1.3])) - 2
                rt = int(rng.lognormal(8.5, 0.5))
                table.append(
                    [
                        f"P{person:04d}",
                        level,
                        framing,
                        left,
                        right,
                        value,
                        order,
                        rt,
                        "2024-05-01T09:00:00.250Z",
                    ]
                )
        return table

    return rows


def _crowd(
    people,
    worth,
    seed=0,
    framing="close-up",
    taste=0.0,
    leaning=0.0,
    side=0.0,
    cuts=(0.6, 2.0),
    noise="logistic",
):
    """A panel of people who answer every pair of len(worth) techniques a, b, c, ...

    by the ordinal model of analysis.worth.
    """
    from analysis.panel import Panel

    rng = np.random.default_rng(seed)
    worth = np.asarray(worth, float)
    first, second = (
        np.array(column) for column in zip(*combinations(range(len(worth)), 2), strict=True)
    )
    left = rng.random((people, len(first))) < 0.5
    own = worth + rng.normal(0, taste, (people, len(worth)))
    lean = side + rng.normal(0, leaning, (people, 1))
    error = getattr(rng, noise)(size=left.shape)
    eta = own[:, second] - own[:, first] + np.where(left, 1, -1) * lean + error
    preference = (np.digitize(eta, [-cuts[1], -cuts[0], cuts[0], cuts[1]]) - 2).astype(np.int8)
    names = np.array([f"P{person:04d}" for person in range(people)], object)
    return Panel(
        framing, tuple("abcdefghijk"[: len(worth)]), names, first, second, preference, left
    )


@pytest.fixture(scope="session")
def crowd():
    """crowd(people, worth, seed=0, taste=0, leaning=0, side=0, cuts=(0.6, 2)) ->
    analysis.panel.Panel.
    """
    return _crowd


@pytest.fixture(scope="session")
def table():
    """table(*panels, familiarity=None, seed=0) -> Responses with the answers of the panels;
    familiarity: participant -> 1 to 5.
    """
    from analysis import responses_from_records

    def table(*panels, familiarity=None, seed=0, order=None):
        rng = np.random.default_rng(seed)
        records = []
        for panel in panels:
            for person, k in zip(*np.nonzero(panel.answered), strict=True):
                pair = panel.items[panel.first[k]], panel.items[panel.second[k]]
                left = bool(panel.first_left[person, k])
                value = int(panel.preference[person, k])
                records.append(
                    {
                        "participant": panel.participants[person],
                        "familiarity": 3
                        if familiarity is None
                        else familiarity[panel.participants[person]],
                        "framing": panel.framing,
                        "left": pair[0 if left else 1],
                        "right": pair[1 if left else 0],
                        "answer": value if left else -value,
                        "order": len(records) + 1,
                        "rt_ms": int(rng.lognormal(8.5, 0.5)),
                        "started_at": "2024-05-01T09:00:00Z",
                    }
                )
        return responses_from_records(records, order=order)

    return table


@pytest.fixture
def lines(write, answer):
    """lines("a<<b a=b b>c ...", ...) -> Responses at close-up: one text a participant, < and >
    point to the technique that lost ...; every second person sees the pairs the other way round.

    a>b: a slightly preferred, a>>b: strongly; a<b, a<<b: the other way; a=b: no difference.
    """
    import re

    from analysis import read_responses

    def lines(*people, framing="close-up"):
        values = {">>": -2, ">": -1, "=": 0, "<": 1, "<<": 2}
        rows = []
        for person, text in enumerate(people):
            for word in text.split():
                left, mark, right = re.fullmatch(r"(\w+)([<>=]+)(\w+)", word).groups()
                value = values[mark]
                if person % 2:
                    left, right, value = right, left, -value
                rows.append(answer(f"P{person:03d}", framing, left, right, value))
        names = sorted({name for text in people for name in re.findall(r"\w+", text)})
        return read_responses(write(rows), order=names)

    return lines


@pytest.fixture(scope="session")
def studies(tmp_path_factory, random_study):
    """simulated or not -> Responses of 8 people."""
    from analysis import read_responses

    result = {}
    for simulated in (False, True):
        path = tmp_path_factory.mktemp("study") / "responses.csv"
        lines = [",".join(map(str, (*row, int(simulated)))) for row in random_study(8, seed=4)]
        path.write_text("\n".join([HEADER + ",simulated", *lines]))
        result[simulated] = read_responses(path)
    return result


@pytest.fixture(scope="session")
def real(studies):
    """All files of a report of people's answers, with declared margins and milliseconds an image;
    drawn once for all tests.
    """
    import pandas as pd

    from analysis.objective import Measured
    from analysis.options import Options
    from analysis.report import report_responses

    answers = studies[False]
    rows = [
        (framing, name, "milliseconds", float(k), "manifest")
        for framing, items in answers.items.items()
        for k, name in enumerate(items)
    ]
    table = pd.DataFrame(rows, columns=["framing", "technique", "measure", "value", "source"])
    options = Options(margin=0.25, margin_jod=0.5, resamples=100, seed=3)
    return report_responses(
        answers,
        options=options,
        declared="declared in the study file",
        measured=Measured(table, ("The manifest holds no FLIP.",)),
    )


@pytest.fixture(scope="session")
def simulated(studies):
    """All files of a report of simulated answers, with nothing declared;
    drawn once for all tests.
    """
    from analysis.report import report_responses

    return report_responses(studies[True])
