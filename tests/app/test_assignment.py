"""Who gets which list."""

import hashlib
import json
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from itertools import combinations

import pytest
from sqlalchemy import select

from app import create_app, export
from app.models import Participant, Response, Trial
from app.questionnaire import flow
from app.recruiting import exclude, record_of, set_state
from stimuli.design import adaptive_trials
from stimuli.errors import InputError
from tests.app.conftest import Person


def numbers(app):
    with app.extensions["database"].read() as db:
        query = select(Participant.list_number).order_by(Participant.id)
        return list(db.scalars(query))


def change(app, number, **values):
    with app.extensions["database"].write() as db:
        for name, value in values.items():
            setattr(db.get(Participant, number), name, value)


def test_at_once_everybody_gets_a_list_of_their_own(app):
    database, study = app.extensions["database"], app.extensions["study"]

    def enrol(visit):
        with database.write() as db:
            flow.enrol(db, study, str(visit))

    with ThreadPoolExecutor(8) as at_once:
        list(at_once.map(enrol, range(20)))
    assert sorted(numbers(app)) == list(range(1, 21))
    with database.read() as db:
        left = Counter(db.scalars(select(Trial.left)))
        right = Counter(db.scalars(select(Trial.right)))
    assert left == right  # nothing is left to chance


def test_the_list_of_who_does_not_count_is_given_anew(app, person):
    for _ in range(4):
        person().begin()
    assert numbers(app) == [1, 2, 3, 4]
    with app.extensions["database"].write() as db:
        exclude(db, db.get(Participant, 2), "asleep", who="somebody")
        flow.withdraw(db, db.get(Participant, 3))
        hours = timedelta(hours=5)
        db.get(Participant, 1).consented_at -= hours  # begun long ago, and nothing answered since
    person().begin(), person().begin(), person().begin(), person().begin()
    assert numbers(app) == [1, 2, 3, 4, 1, 2, 3, 5]


def test_who_still_answers_keeps_the_list(app, person):
    slow = person().begin()
    with app.extensions["database"].write() as db:
        db.get(Participant, 1).consented_at -= timedelta(hours=5)
    slow.answer(1)
    person().begin()
    assert numbers(app) == [1, 2]
    with app.extensions["database"].write() as db:
        for row in db.scalars(select(Response)):
            row.answered_at -= timedelta(hours=5)
    person().begin()
    assert numbers(app) == [1, 2, 1]


def test_lists_of_a_pilot_are_apart(app, person):
    with app.extensions["database"].write() as db:
        set_state(db, "pilot", who="somebody")
    person().begin(), person().begin()
    with app.extensions["database"].write() as db:
        set_state(db, "open", who="somebody")
    person().begin()
    assert numbers(app) == [1, 2, 1]


def test_participants_of_before_lists_hold_none(app, person):
    person().begin()
    change(app, 1, list_number=None)
    person().begin()
    assert numbers(app) == [None, 1]


def test_some_of_the_pairs_each(tmp_path, write_study, person):
    study = write_study(tmp_path / "some", assignment={"pairs": 15}, quality={"repeats": 2})
    app = create_app(study)
    Person = type(person())
    somebody = Person(app)
    assert "There are 17 questions" in somebody.get("/").text
    somebody.begin().answer(*[1] * 17)
    assert somebody.path == "/thanks"
    for _ in range(3):
        Person(app).begin()
    with app.extensions["database"].read() as db:
        main = db.execute(select(Trial.cell, Trial.left, Trial.right).where(Trial.kind == "main"))
        asked = Counter((cell, frozenset(sides)) for cell, *sides in main)
        assert len(asked) == 30 and {*asked.values()} == {2}
        assert record_of(db).content and '"assignment": {"pairs": 15}' in record_of(db).content


@pytest.mark.parametrize("assignment", [{"pairs": 31}, {"pairs": -1}, {"pair": 3}])
def test_nonsense_is_refused(tmp_path, write_study, assignment):
    with pytest.raises(InputError, match="assignment"):
        create_app(write_study(tmp_path / "wrong", assignment=assignment))
    with pytest.raises(InputError, match="half of a participant's pairs"):
        create_app(write_study(tmp_path / "w", assignment={"pairs": 6}, quality={"repeats": 4}))


def test_adaptive_pairs_are_chosen_from_what_was_answered_and_can_be_drawn_again(
    tmp_path, write_study
):
    """Two in five are dealt theirs beside; every other list follows from the state that is kept."""
    design = {"pairs": 6, "design": "adaptive", "least_share": 0.4, "beside": 0.4}
    app = create_app(write_study(tmp_path / "adaptive", assignment=design))
    study, database = app.extensions["study"], app.extensions["database"]
    for number in range(12):
        somebody = Person(app).begin()
        # a third stop half-way: what they were asked counts while they are at it
        somebody.answer(*[(-1, 1, 2, 0, -2, 1)[(number + k) % 6] for k in range(6 - number % 3)])
    seen = {cell: Counter() for cell in study.cells}
    with database.read() as db:
        people = db.scalars(select(Participant).order_by(Participant.id)).all()
        kinds = Counter(bool(person.design_state) for person in people)
        assert kinds[True] > 3 and kinds[False] > 1
        for person in people:
            drawn = [(t.order, t.cell, t.left, t.right, t.kind) for t in person.trials]
            if person.design_state:
                state = json.loads(person.design_state)
                for cell in study.cells:
                    asked = {
                        pair: sum(row[:2])
                        for pair, row in zip(combinations(study.techniques, 2), state[cell])
                        if sum(row[:2])
                    }
                    assert asked == seen[cell]
                digest = hashlib.sha256(person.design_state.encode()).hexdigest()[:12]
                assert {t.seed for t in person.trials} == {f"7/adaptive {person.id} {digest}"}
                definition = study.definition
                again = adaptive_trials(
                    study.cells,
                    study.techniques,
                    study.seed,
                    person.id,
                    definition.quality,
                    definition.assignment,
                    state,
                )
                assert [(t.order, t.cell, t.left, t.right, t.kind) for t in again] == drawn
            else:
                assert person.list_number and person.trials[0].seed.startswith("7/list ")
            for _, cell, left, right, _ in drawn:
                pair = sorted((left, right), key=study.techniques.index)
                seen[cell][tuple(pair)] += 1
        lines = [json.loads(line) for line in export.assignments_jsonl(db, study)]
    assert [line["participant"] for line in lines] == [p.code for p in people if p.design_state]
    last = lines[-1]["state"]
    answered = sum(sum(row[2:]) for rows in last.values() for row in rows)
    assert 0 < answered < sum(sum(row[:2]) for rows in last.values() for row in rows)


@pytest.mark.parametrize(
    ("design", "error"),
    [
        ({"design": "adaptive"}, "assignment.pairs: got 0, expected from 1 to 29"),
        ({"pairs": 30, "design": "adaptive"}, "asked all has no choice"),
        ({"pairs": 6, "least_share": 0.5}, "least_share.*unless design"),
        ({"pairs": 6, "design": "adaptive", "beside": 2}, "beside"),
        ({"pairs": 6, "design": "random"}, "one of dealt, adaptive"),
    ],
)
def test_an_adaptive_design_that_cannot_be_is_refused(tmp_path, write_study, design, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "wrong", assignment=design))
