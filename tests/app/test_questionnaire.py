"""What a participant can do, and what must not happen: a lost, doubled or overwritten answer."""

import json
import re
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import select
from sqlalchemy.event import listen

from app import create_app
from app.models import Event, Participant, Trial
from stimuli.design import trials
from tests.app.conftest import Person


def test_thirty_answers_from_consent_to_code(person):
    somebody = person().begin(familiarity=4)
    values = [(i % 5) - 2 for i in range(30)]
    for done, value in enumerate(values):
        assert f"Question {done + 1} <span>of 30" in somebody.page.text
        somebody.answer(value)
        assert len(somebody.rows) == done + 1  # committed before the next page is sent
    assert somebody.path == "/thanks"
    assert re.search(r'id="completion-code">[A-Z2-9]{10}<', somebody.page.text)
    assert somebody.answers == values


def test_whose_the_images_sources_are_is_said_at_the_end(write_study, tmp_path):
    folder = write_study(tmp_path / "credited")
    record = json.loads((folder / "manifest.json").read_text())
    record["licences"] = [
        {"what": "a bust", "licence": "CC-BY-4.0", "source": "there", "credit": "<b>A. Maker</b>"},
        {"what": "a base mesh", "licence": "CC0-1.0", "source": "here"},
    ]
    (folder / "manifest.json").write_text(json.dumps(record))
    credited = create_app(folder)
    somebody = Person(credited).begin()
    while somebody.path == "/question":
        somebody.answer(0)
    assert "a bust (&lt;b&gt;A. Maker&lt;/b&gt;, CC-BY-4.0)." in somebody.page.text
    assert "base mesh" not in somebody.page.text


def test_trials_are_those_of_the_design_and_recorded(app, person):
    person().begin(), person().begin()
    study = app.extensions["study"]
    with app.extensions["database"].read() as db:
        for number in (1, 2):
            recorded = db.scalars(
                select(Trial).where(Trial.participant_id == number).order_by(Trial.order)
            ).all()
            expected = trials(study.framings, study.techniques, study.seed, number)
            lists = [
                [(t.order, t.cell, t.left, t.right) for t in some] for some in (recorded, expected)
            ]
            assert lists[0] == lists[1]
            assert {t.seed for t in recorded} == {f"7/list {number}"}


def test_the_page_does_not_tell_which_technique_is_shown(app, person):
    somebody = person().begin()
    text = somebody.page.text
    for name in app.extensions["study"].techniques:
        assert f"by {name}" not in text and (name == "none" or name not in text)
    assert 2 < text.count("/images/") <= 4 + 2 * 5  # two, and those of five questions ahead


def test_what_the_browser_measured_is_recorded(person):
    somebody = person().begin()
    measured = {
        "viewport_width": 1280,
        "viewport_height": 720,
        "device_pixel_ratio": 1.25,
        "shown_width": 630.5,
        "shown_height": 354.66,
        "view": "beside",
        "beside_ms": 400,
        "flicker_ms": 0,
        "wipe_ms": 0,
        "away_ms": 32,
        "flips": 0,
        "pixel_scale": 0.656,
        "pixel_scale_largest": 2.0,
        "seen_share": 1.0,
    }
    somebody.send("trial", answer=1, rt_ms=432, **measured)
    row = somebody.rows[0]
    assert (row.rt_ms, row.timed_by, row.times_shown) == (432, "browser", 1)
    assert row.rt_reported_ms is None and row.rt_server_ms >= 0
    assert {name: getattr(row, name) for name in measured} == measured


def test_without_scripts_the_server_takes_the_time(person):
    somebody = person().begin()
    somebody.send("trial", answer=1)
    row = somebody.rows[0]
    assert row.timed_by == "server" and row.viewport_width is None and row.view == "unscripted"
    assert row.rt_ms == round((row.answered_at - row.started_at).total_seconds() * 1000)


def test_a_time_that_the_servers_clock_does_not_allow_is_bounded_and_flagged(person, app):
    from app import export

    somebody = person().begin()
    somebody.send("trial", answer=1, rt_ms=2**31 - 1, view="beside")
    somebody.send("trial", answer=1, rt_ms=0, view="beside")
    long, short = somebody.rows
    assert long.rt_ms == long.rt_server_ms < 60_000 and long.timed_by == "server"
    assert long.rt_reported_ms == 2**31 - 1
    assert (short.rt_ms, short.timed_by, short.rt_reported_ms) == (0, "browser", None)
    with app.extensions["database"].read() as db:
        rows = list(export.records(db, app.extensions["study"], simulated=False))
    assert [row["rt_flag"] for row in rows] == ["impossible", "fast"]


def test_a_study_may_refuse_browsers_without_scripts(tmp_path, write_study):
    app = create_app(write_study(tmp_path / "strict", viewer={"scripts": "required"}))
    somebody = Person(app).begin()
    assert "Please allow it for this page" in somebody.page.text
    assert somebody.send("trial", answer=1).status_code == 400 and somebody.answers == []
    somebody.get("/question")
    somebody.send("trial", answer=1, rt_ms=300, view="flicker")
    assert [row.view for row in somebody.rows] == ["flicker"]


@pytest.mark.parametrize("nonsense", ["", "-1", "1e400", "nan", "inf", "9" * 40, "<b>"])
def test_a_nonsense_measurement_never_costs_the_answer(person, nonsense):
    somebody = person().begin()
    somebody.send(
        "trial",
        answer=-1,
        rt_ms=nonsense,
        viewport_width=nonsense,
        device_pixel_ratio=nonsense,
        shown_width=nonsense,
    )
    row = somebody.rows[0]
    assert (
        row.answer,
        row.timed_by,
        row.viewport_width,
        row.device_pixel_ratio,
        row.shown_width,
    ) == (-1, "server", None, None, None)


def test_reload_resumes_where_it_was(person):
    somebody = person().begin().answer(1, -2)
    trial = somebody.form("trial")["trial"]
    somebody.get("/question")
    somebody.get("/question")
    assert "Question 3 <span>" in somebody.page.text and somebody.form("trial")["trial"] == trial
    somebody.answer(0)
    assert [row.times_shown for row in somebody.rows] == [1, 1, 3]
    somebody.get("/")
    assert "3 of 30 questions are answered" in somebody.page.text


def test_looking_writes_nothing_and_an_answer_is_one_commit(app, person):
    somebody = person().begin()
    writes = []
    database = app.extensions["database"]
    listen(database._engine, "commit", lambda connection: writes.append(_writes(connection)))
    for path in ("/", "/question", "/question", "/withdraw", "/familiarity", "/thanks"):
        somebody.get(path)
    assert sum(writes) == 0
    for page in (somebody.form("trial") | {"answer": "1"},) * 2:
        somebody.http.post("/question", data=page, headers={"Accept": "application/json"})
    assert sum(writes) == 2 and somebody.answers == [1]  # the second found the first


def _writes(connection) -> bool:
    return connection.get_execution_options().get("writes", False)


def test_a_browser_that_lost_when_a_question_was_shown_can_still_answer(person):
    somebody = person().begin()
    with somebody.http.session_transaction() as session:
        del session["shown"]
    somebody.send("trial", answer=2, rt_ms=100)
    [row] = somebody.rows
    assert (row.answer, row.rt_ms, row.times_shown) == (2, 100, 1)
    assert row.started_at <= row.answered_at


@pytest.mark.parametrize("path", ["/question", "/familiarity", "/thanks", "/withdrawn"])
def test_every_address_leads_to_the_page_that_is_due(person, path):
    newcomer = person()
    newcomer.get(path)
    assert newcomer.path == "/"
    somebody = person().begin()
    somebody.get(path)
    assert somebody.path == "/question"


def test_the_same_answer_twice_is_one_answer(person):
    somebody = person().begin()
    first = somebody.form("trial") | {"answer": "2"}
    for _ in range(2):
        somebody.page = somebody.http.post("/question", data=first, follow_redirects=True)
    assert somebody.answers == [2] and "Question 2 <span>" in somebody.page.text
    reply = somebody.http.post("/question", data=first, headers={"Accept": "application/json"})
    assert (reply.status_code, reply.json) == (200, {"outcome": "repeated", "next": "/question"})


def test_going_back_cannot_change_an_answer(app, person):
    somebody = person().begin()
    first = somebody.form("trial")
    somebody.answer(2)
    somebody.page = somebody.http.post(
        "/question", data=first | {"answer": "-2"}, follow_redirects=True
    )
    assert somebody.answers == [2] and "the first answer was kept" in somebody.page.text
    for _ in range(3):  # what is repeated without end is stored once
        reply = somebody.http.post(
            "/question", data=first | {"answer": "-1"}, headers={"Accept": "application/json"}
        )
        assert (reply.status_code, reply.json["outcome"]) == (409, "refused")
    with app.extensions["database"].read() as db:
        details = db.scalars(
            select(Event.detail).where(Event.kind == "refused").order_by(Event.id)
        ).all()
    assert details == ["kept 2, refused -2", "kept 2, refused -1"]


def test_only_the_current_question_of_ones_own_can_be_answered(app, person):
    one, two = person().begin(), person().begin()
    form = one.form("trial")
    with app.extensions["database"].read() as db:
        ids = {
            owner: db.scalars(
                select(Trial.id).where(Trial.participant_id == owner).order_by(Trial.order)
            ).all()
            for owner in (1, 2)
        }
    for trial in (ids[1][1], ids[2][0], 10**6):
        reply = one.http.post(
            "/question",
            data=form | {"trial": trial, "answer": 1},
            headers={"Accept": "application/json"},
        )
        assert (reply.status_code, reply.json["outcome"]) == (409, "stale")
    assert one.answers == [] and two.answers == []


def test_an_answer_about_other_images_is_not_taken(person):
    somebody = person().begin()
    form = somebody.form("trial")
    somebody.send("trial", answer=1, image_left=form["image_right"], image_right=form["image_left"])
    assert somebody.answers == [] and "not the current question" in somebody.page.text


def test_a_question_that_was_never_shown_cannot_be_answered(person):
    somebody = person()
    somebody.get("/")
    token = somebody.form("consent")["csrf_token"]
    somebody.http.post("/", data={"csrf_token": token, "consent": "yes"})
    somebody.http.post("/familiarity", data={"csrf_token": token, "familiarity": "2"})
    reply = somebody.http.post(
        "/question",
        data={"csrf_token": token, "trial": 1, "answer": 1},
        headers={"Accept": "application/json"},
    )
    assert (reply.status_code, reply.json["outcome"]) == (409, "stale")


@pytest.mark.parametrize("answer", ["", "3", "-3", "1.5", "A", "--1"])
def test_an_answer_outside_the_scale_is_not_taken(person, answer):
    somebody = person().begin()
    form = somebody.form("trial") | {"answer": answer}
    assert (
        somebody.http.post(
            "/question", data=form, headers={"Accept": "application/json"}
        ).status_code
        == 400
    )
    somebody.send("trial", answer=answer)
    assert somebody.answers == [] and "choose one of the answers" in somebody.page.text


def test_consent_clicked_twice_is_one_participant(app, person):
    somebody = person()
    somebody.get("/")
    form = somebody.form("consent") | {"consent": "yes"}
    for _ in range(2):
        somebody.http.post("/", data=form)
    with app.extensions["database"].read() as db:
        assert len(db.scalars(select(Participant)).all()) == 1


def test_no_consent_no_participant(app, person):
    somebody = person()
    somebody.get("/")
    somebody.send("consent")
    assert "tick the box" in somebody.page.text
    with app.extensions["database"].read() as db:
        assert db.scalars(select(Participant)).all() == []


def test_the_first_familiarity_stays(app, person):
    somebody = person().begin(familiarity=2)
    token = somebody.form("trial")["csrf_token"]
    somebody.http.post("/familiarity", data={"csrf_token": token, "familiarity": "5"})
    with app.extensions["database"].read() as db:
        assert db.get(Participant, 1).familiarity == 2


def test_no_code_before_all_answers(app, person):
    somebody = person().begin().answer(*[1] * 29)
    somebody.get("/thanks")
    assert somebody.path == "/question"
    with app.extensions["database"].read() as db:
        assert db.get(Participant, 1).completion_code is None
    somebody.answer(1)
    with app.extensions["database"].read() as db:
        participant = db.get(Participant, 1)
    assert participant.completion_code in somebody.page.text and participant.completed_at
    code = participant.completion_code
    somebody.get("/thanks")
    somebody.get("/")
    assert (
        somebody.path == "/thanks" and code in somebody.page.text
    )  # the same code, however often it is looked at


def test_withdrawn_answers_stay_in_the_database_and_end_the_questions(person):
    somebody = person().begin().answer(1, 2)
    form = somebody.form("trial") | {"answer": "1"}
    somebody.get("/withdraw")
    somebody.page = somebody.http.post(
        "/withdraw",
        data={"csrf_token": somebody.form("csrf_token")["csrf_token"]},
        follow_redirects=True,
    )
    assert somebody.path == "/withdraw" and "Nothing was withdrawn" in somebody.page.text
    somebody.send("confirm", confirm="yes")
    assert somebody.path == "/withdrawn"
    somebody.get("/question")
    assert somebody.path == "/withdrawn"
    assert (
        somebody.http.post(
            "/question", data=form, headers={"Accept": "application/json"}
        ).status_code
        == 409
    )
    assert somebody.answers == [1, 2]


def test_withdrawing_by_code_from_another_device(app, person):
    somebody = person().begin().answer(*[0] * 30)
    paid = re.search(r'id="completion-code">(\w+)<', somebody.page.text)[1]
    code = re.search(r'id="withdrawal-key">(\w+)<', somebody.page.text)[1]
    elsewhere = person()
    elsewhere.get("/withdraw")
    for wrong in ("WRONGCODE2", paid):  # whoever pays sees the code, and cannot withdraw by it
        elsewhere.send("code", code=wrong, confirm="yes")
        assert "No participant was given this key" in elsewhere.page.text
    elsewhere.send("code", code=f" {code[:5].lower()}-{code[5:]} ", confirm="yes")
    assert elsewhere.path == "/withdrawn"
    somebody.get("/thanks")
    assert somebody.path == "/withdrawn"


def test_withdrawing_anothers_code_leaves_the_own_questions_where_they_were(person):
    finished = person().begin().answer(*[0] * 30)
    code = re.search(r'id="withdrawal-key">(\w+)<', finished.page.text)[1]
    somebody = person().begin().answer(1, 2)
    somebody.get("/withdraw")
    somebody.page = somebody.http.post(
        "/withdraw",
        data=somebody.form("confirm") | {"code": code, "confirm": "yes"},
        follow_redirects=True,
    )
    assert somebody.path == "/question" and "Yours go on" in somebody.page.text
    assert somebody.answer(2).answers == [1, 2, 2]
    finished.get("/thanks")
    assert finished.path == "/withdrawn"


def test_who_completed_before_there_were_keys_withdraws_by_the_code(app, person):
    somebody = person().begin().answer(*[0] * 30)
    with app.extensions["database"].write() as db:
        one = db.get(Participant, 1)
        one.withdrawal_key, code = None, one.completion_code
    somebody.get("/thanks")
    assert 'id="withdrawal-key"' not in somebody.page.text
    elsewhere = person()
    elsewhere.get("/withdraw")
    elsewhere.send("code", code=code, confirm="yes")
    assert elsewhere.path == "/withdrawn"


def test_another_person_on_a_shared_device(tmp_path, write_study, person):
    shared = write_study(tmp_path / "laboratory", participants={"shared_device": True})
    somebody = Person(create_app(shared)).begin().answer(*[0] * 30)
    somebody.send("csrf_token")
    assert somebody.path == "/" and "consent" in somebody.form("consent")
    assert somebody.begin().answers == []
    alone = person().begin().answer(*[0] * 30)
    assert "another person" not in alone.page.text  # unless the study says so
    alone.get("/withdraw")
    token = {"csrf_token": alone.form("confirm")["csrf_token"]}
    assert alone.http.post("/another", data=token).status_code == 403


def test_going_on_with_another_device(app, person):
    somebody = person().begin().answer(1, -1)
    somebody.get("/withdraw")
    code = re.search(r'id="resume-code">(\w+)<', somebody.page.text)[1]
    elsewhere = person()
    elsewhere.get("/resume/")
    elsewhere.send("resume", resume="WRONGCODE2")
    assert "Nobody was given this code" in elsewhere.page.text
    elsewhere.send("resume", resume=f"{code[:5].lower()} {code[5:]}")
    assert elsewhere.path == "/question" and "Question 3 <span>" in elsewhere.page.text
    assert elsewhere.answer(2).answers == [1, -1, 2]
    other = person().begin()
    other.get(f"/resume/{code}")
    other.send("resume")
    assert other.path == "/question" and other.answers == []  # their own, not the other's
    assert "in the middle of another" in other.page.text


def test_several_people_at_once_and_one_who_clicks_wildly(app, person):
    people = [person() for _ in range(6)]

    def take_part(somebody):
        somebody.begin()
        for i in range(30):
            form = somebody.form("trial") | {"answer": str(i % 5 - 2)}
            # three times the same click, each from a copy of the same browser
            with ThreadPoolExecutor(3) as clicks:
                cookie = somebody.http.get_cookie("subdermal").value
                list(clicks.map(click, [app] * 3, [cookie] * 3, [form] * 3))
            somebody.get("/question")
        return somebody.answers

    with ThreadPoolExecutor(len(people)) as pool:
        results = list(pool.map(take_part, people))
    assert results == [[i % 5 - 2 for i in range(30)]] * len(people)
    assert all(somebody.path == "/thanks" for somebody in people)


def click(app, cookie, form):
    browser = app.test_client()
    browser.set_cookie("subdermal", cookie)
    reply = browser.post("/question", data=form, headers={"Accept": "application/json"})
    assert reply.status_code == 200 and reply.json["outcome"] in ("recorded", "repeated")


def test_how_far_the_clocks_may_be_apart_is_the_studys(tmp_path, write_study):
    quality = {"clocks_apart_ms": 60_000}
    somebody = Person(create_app(write_study(tmp_path / "apart", quality=quality))).begin()
    somebody.send("trial", answer=1, rt_ms=30_000, view="beside")
    (row,) = somebody.rows
    assert (row.rt_ms, row.timed_by, row.rt_reported_ms) == (30_000, "browser", None)
