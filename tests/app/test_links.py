"""Links that let one person begin each."""

import csv
import io
from concurrent.futures import ThreadPoolExecutor

import pytest

from app import recruiting
from app.cli import main
from app.models import Participant
from app.questionnaire import flow
from app.recruiting import Door


def make(app, count=1, *, only=True):
    with app.extensions["database"].write() as db:
        recruiting.set_links_only(db, only, who="the test")
        return recruiting.make_links(db, count, "class 3", who="the test")


def states(experimenter):
    table = csv.DictReader(io.StringIO(experimenter.get("/dashboard/links.csv").text))
    return [row["state"] for row in table]


def test_a_link_is_spent_by_consent_and_not_by_looking(app, person, experimenter):
    token, unused = make(app, 2)
    first, second, stranger = person(), person(), person()
    assert "come by the link" in stranger.get("/").text and stranger.page.status_code == 403
    assert person().get("/?link=" + "X" * 16).status_code == 403
    assert second.get(f"/?link={token}").status_code == 200  # a mail scanner, say
    first.get(f"/?link={token.lower()}")
    assert states(experimenter) == ["unused", "unused"]
    first.begin().answer(1)
    assert states(experimenter) == ["begun", "unused"]
    assert "was used already" in second.send("consent", consent="yes").text
    assert "was used already" in person().get(f"/?link={token}").text
    first.answer(*[0] * 29)
    assert states(experimenter) == ["completed", "unused"]
    assert "P0001" not in experimenter.get("/dashboard/links.csv").text
    second.get(f"/?link={unused}")
    second.begin()
    with app.extensions["database"].write() as db:
        flow.withdraw(db, db.get(Participant, 2))
    assert states(experimenter) == ["completed", "withdrawn"]
    assert person().get(f"/?link={unused}").status_code == 403


def test_of_many_at_once_a_link_lets_one_begin(app):
    database, study = app.extensions["database"], app.extensions["study"]
    tokens = make(app, 2)

    def enrol(number):
        with database.write() as db:
            return flow.enrol(db, study, str(number), token=tokens[number % 2])

    with ThreadPoolExecutor(8) as at_once:
        begun = list(at_once.map(enrol, range(24)))
    assert sum(isinstance(one, Participant) for one in begun) == 2
    assert begun.count(Door.SPENT) == 22


def test_who_has_begun_goes_on_by_their_link(app, person):
    (token,) = make(app)
    somebody = person()
    somebody.get(f"/?link={token}")
    somebody.begin().answer(1)
    somebody.get(f"/?link={token}")
    assert somebody.page.status_code == 200 and "used already" not in somebody.page.text


def test_a_link_that_nobody_needs_is_still_for_one(app, person):
    (token,) = make(app, only=False)
    somebody = person()
    somebody.get(f"/?link={token}")
    somebody.begin()
    assert person().get(f"/?link={token}").status_code == 403
    person().begin()


@pytest.mark.parametrize("count", ["", "0", "-1", "10000", "x"])
def test_the_dashboard_makes_them(experimenter, count):
    experimenter.get("/dashboard/")
    experimenter.send("count", count=count)
    assert states(experimenter) == []
    experimenter.get("/dashboard/")
    experimenter.send("count", count=3, label="=class")
    assert "3 links were made" in experimenter.page.text
    assert states(experimenter) == ["unused"] * 3
    assert "'=class" in experimenter.get("/dashboard/links.csv").text


@pytest.mark.sqlite
def test_the_command_makes_them(app, study_dir, person, capsys):
    assert main(["links", str(study_dir), "--count", "2", "--only", "--address", "https://x/"]) == 0
    one, two = capsys.readouterr().out.split()
    assert one.startswith("https://x/?link=") and one != two
    assert person().get("/").status_code == 403
    somebody = person()
    somebody.get(one.removeprefix("https://x"))
    somebody.begin()
