"""Simulated participants: reproducible, marked, apart from people, through the real pages."""

import csv

import numpy as np
import pytest
from sqlalchemy import func, select

from app import create_app
from app.cli import main
from app.models import Participant, Response
from app.server import running
from app.simulation.client import Visitor
from app.simulation.designs import compare
from app.simulation.people import ANSWERING, GAIN_JOD, PUBLISHED_PRIORITIES, Crowd
from app.study import Study

VARYING = {"started_at", "answered_at", "rt_server_ms"}


def rows(study_dir):
    with (study_dir / "simulated" / "responses.csv").open(newline="") as file:
        return [{k: v for k, v in row.items() if k not in VARYING} for row in csv.DictReader(file)]


def simulate(study_dir, *options):
    return main(["simulate", str(study_dir), *map(str, options)])


def test_the_same_seed_gives_the_same_answers_and_another_seed_others(tmp_path, write_study):
    tables = []
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        study = write_study(tmp_path / name)
        assert simulate(study, "--participants", 2, "--seed", seed) == 0
        tables.append(rows(study))
    assert len(tables[0]) == 60 and tables[0] == tables[1]
    assert [r["answer"] for r in tables[0]] != [r["answer"] for r in tables[2]]


def test_running_again_tops_up_and_goes_on_half_way(tmp_path, write_study, capsys):
    whole, parts = write_study(tmp_path / "whole"), write_study(tmp_path / "parts")
    assert simulate(whole, "--participants", 3) == 0
    assert simulate(parts, "--participants", 1) == 0
    app = create_app(parts, simulated=True)  # participant 2 stops after 11 answers
    study = app.extensions["study"]
    with running(app) as address:
        answering = Visitor(address, study, Crowd(study, 1), 1).take_part(2)
        assert [next(answering) for _ in range(11)] == list(range(1, 12))
        answering.close()
    assert simulate(parts, "--participants", 3) == 0
    ignored = {"times_shown"}
    tables = [
        [{k: v for k, v in row.items() if k not in ignored} for row in rows(study)]
        for study in (whole, parts)
    ]
    assert len(tables[0]) == 90 and tables[0] == tables[1]
    assert simulate(parts, "--participants", 3) == 0
    assert "90 simulated answers, 0 participants new" in capsys.readouterr().out


def test_every_row_and_page_is_marked(study_dir):
    assert simulate(study_dir, "--participants", 1) == 0
    assert {row["simulated"] for row in rows(study_dir)} == {"1"} and {
        row["completed"] for row in rows(study_dir)
    } == {"1"}
    assert "All answers are simulated" in (study_dir / "simulated" / "codebook.md").read_text()
    http = create_app(study_dir, simulated=True).test_client()
    for path in ("/", "/withdraw", "/dashboard/login", "/simulation/", "/nowhere"):
        page = http.get(path).text
        assert "<title>SIMULATED" in page and "come from a program" in page, path


def test_people_cannot_take_part_in_the_simulated_study(study_dir):
    app = create_app(study_dir, simulated=True)
    page = app.test_client().get("/").text
    assert "People cannot take part here" in page and 'name="consent"' not in page


def test_a_real_study_has_no_door_for_programs_and_is_left_alone(study_dir, capsys):
    app = create_app(study_dir)
    with running(app) as address:
        assert simulate(study_dir, "--url", address) == 2
    assert "real databases take no simulated participants" in capsys.readouterr().err
    with app.extensions["database"].read() as db:
        assert db.scalar(select(func.count()).select_from(Participant)) == 0


def test_a_running_simulated_study_takes_participants_by_its_address(study_dir, capsys):
    app = create_app(study_dir, simulated=True)
    with running(app) as address:
        assert simulate(study_dir, "--participants", 1, "--url", address.rstrip("/")) == 0
    assert len(rows(study_dir)) == 30


def test_wrong_addresses_and_seeds_get_one_line(tmp_path, write_study, study_dir, capsys):
    assert simulate(study_dir, "--participants", 1, "--seed", 1) == 0
    other = write_study(tmp_path / "other", name="other")
    with running(create_app(other, simulated=True)) as address:
        failures = [
            (["--seed", 2], "begun with the seed 1"),
            (["--url", "http://127.0.0.1:9/"], "no answer"),
            (["--url", "nonsense"], "no answer"),
            (["--url", address], "serves other version 1, expected ready-made version 1"),
            (["--participants", 0], "0 is not in the range"),
        ]
        capsys.readouterr()
        for options, says in failures:
            assert simulate(study_dir, *options) == 2
            err = capsys.readouterr().err
            assert says in err and err.count("\n") == 1, err


def test_answers_follow_the_published_findings(study_dir):
    """200 participants of the thesis's design: close-up prefers golubev_plus then golubev, and
    points fall with distance.
    """
    study = Study.open(study_dir)
    crowd = Crowd(study, 1)
    points = {framing: dict.fromkeys(study.techniques, 0) for framing in study.framings}
    sides = []
    from stimuli.design import trials

    for number in range(1, 201):
        for trial in trials(study.framings, study.techniques, study.seed, number):
            answer, rt_ms = crowd.answer(number, trial.order, trial.cell, trial.left, trial.right)
            assert -2 <= answer <= 2 and rt_ms > 0
            points[trial.cell][trial.left if answer < 0 else trial.right] += abs(answer)
            sides.append(answer)
    close, half = points["close-up"], points["half-length"]
    assert sorted(close, key=close.get) == [
        "none",
        "jimenez_separable",
        "jimenez_gaussian",
        "golubev",
        "golubev_plus",
    ]
    assert max(half, key=half.get) == "none"
    totals = [sum(points[framing].values()) for framing in study.framings]
    assert totals[0] > 1.3 * totals[1] > 1.3 * totals[2]
    assert abs(sum(sides)) < 0.03 * len(sides)


def test_answers_are_those_of_the_model_that_power_plans_with(study_dir):
    """4,000 people about one pair: shares of the five answers are those of the model, to 3 standard
    errors of a share, 3 sqrt(p (1 - p)/4000) < 0.024.
    """
    study = Study.open(study_dir)
    crowd = Crowd(study, 3)
    given = [crowd.answer(n, 1, "close-up", "none", "jimenez_gaussian")[0] for n in range(4000)]
    log = {name: np.log(PUBLISHED_PRIORITIES["close-up"][name]) for name in study.techniques}
    difference = GAIN_JOD * (log["jimenez_gaussian"] - log["none"])
    shares = [given.count(answer) / len(given) for answer in range(-2, 3)]
    assert shares == pytest.approx(list(ANSWERING.shares(difference)), abs=0.024)


def test_a_rating_has_the_levels_of_the_study(tmp_path, write_study):
    rating = {"question": "?", "labels": ["never", "daily"], "levels": [0, 7]}
    study = write_study(tmp_path / "rated", familiarity=rating)
    assert simulate(study, "--participants", 4) == 0
    assert {row["familiarity"] for row in rows(study)} <= {"0", "7"}
    book = (study / "simulated" / "codebook.md").read_text()
    assert "- familiarity 0: never" in book and "- familiarity 7: daily" in book


def test_published_priorities_sum_to_one():
    for priorities in PUBLISHED_PRIORITIES.values():
        assert sum(priorities.values()) == pytest.approx(1, abs=5e-4)


def test_a_study_that_the_thesis_did_not_have_is_simulated_too(tmp_path, write_study):
    study = Study.open(
        write_study(
            tmp_path / "new",
            framings=[{"name": n, "label": n} for n in ("close-up", "head-shot", "half-length")],
        )
    )
    crowd = Crowd(study, 1)
    assert set(crowd._worths["close-up"]) == set(study.techniques)


def test_answers_sent_are_answers_stored(study_dir):
    assert simulate(study_dir, "--participants", 1, "--seed", 9) == 0
    app = create_app(study_dir, simulated=True)
    study, crowd = app.extensions["study"], Crowd(app.extensions["study"], 9)
    with app.extensions["database"].read() as db:
        for response in db.scalars(select(Response)):
            trial = response.trial
            assert (response.answer, response.rt_ms) == crowd.answer(
                1, trial.order, trial.cell, trial.left, trial.right
            )
        assert db.get(Participant, 1).familiarity == crowd.familiarity(1)
    assert study.seed == 7


def test_both_designs_of_pairs_are_compared_on_the_same_people():
    """The comparison of both designs: the same sums of answers, the same seed the same numbers."""
    one = compare(items=8, spread=6.0, people=12, pairs=9, studies=6, seed=1)
    assert one == compare(items=8, spread=6.0, people=12, pairs=9, studies=6, seed=1)
    mean = 12 * 9 / 28
    assert 0.5 * mean - 2 <= one.least < mean < one.most
    assert one.gain[1] <= one.gain[0] <= one.gain[2]
    assert all(0.5 < share <= 1 for share in one.order)
