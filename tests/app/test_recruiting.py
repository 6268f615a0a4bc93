"""Who may begin, what is frozen, who counts."""

import csv
import io
import json
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
from sqlalchemy import select

import stimuli.errors
from app import create_app, export, recruiting
from app.errors import InputError
from app.models import Participant, Response, StudyRecord
from app.questionnaire import flow
from app.recruiting import Door
from app.security import Limiter


def set_state(app, state):
    with app.extensions["database"].write() as db:
        recruiting.set_state(db, state, who="the test")


def set_quota(app, quota, minutes=120):
    with app.extensions["database"].write() as db:
        recruiting.set_quota(db, quota, minutes, who="the test")


def rows(response):
    return list(csv.DictReader(io.StringIO(response.text)))


def change(study_dir, **changes):
    path = study_dir / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["study"] |= changes
    path.write_text(json.dumps(manifest))


WORDS = {"text": "Which is brighter?", "left_label": "A", "right_label": "B"}


def test_what_participants_saw_cannot_be_changed_under_them(study_dir, person):
    create_app(study_dir)
    change(study_dir, title="Another title")  # nobody has begun
    Person = type(person())
    Person(create_app(study_dir)).begin()
    create_app(study_dir)
    change(study_dir, analysis={"margin": 0.3})  # that is not shown
    create_app(study_dir)
    change(study_dir, question=WORDS)
    with pytest.raises(InputError, match="question.text was .*, is 'Which is brighter.'") as told:
        create_app(study_dir)
    assert "raise `version`" in str(told.value) and "\n" not in str(told.value)


def test_images_are_part_of_what_participants_saw(study_dir, person):
    person().begin()
    path = study_dir / "manifest.json"
    manifest = json.loads(path.read_text())
    one, other = manifest["images"][:2]
    one["sha256"], other["sha256"] = other["sha256"], one["sha256"]
    one["file"], other["file"] = other["file"], one["file"]
    path.write_text(json.dumps(manifest))
    with pytest.raises(InputError, match="images.close-up none was"):
        create_app(study_dir)


def test_a_database_of_before_takes_what_is_there(study_dir, person, app):
    person().begin()
    with app.extensions["database"].write() as db:
        db.get(StudyRecord, 1).content = None
    change(study_dir, question=WORDS)
    create_app(study_dir)
    change(study_dir, title="Another title")
    with pytest.raises(InputError, match="title was"):
        create_app(study_dir)


@pytest.mark.parametrize(
    "state, begins, goes_on, counted",
    [
        ("draft", False, True, 2),
        ("pilot", True, True, 2),
        ("open", True, True, 3),
        ("paused", False, True, 2),
        ("closed", False, False, 1),
    ],
)
def test_states(app, person, experimenter, state, begins, goes_on, counted):
    half_way = person().begin().answer(1)
    experimenter.get("/dashboard/")
    if state != "open":
        token = experimenter.form("code")["csrf_token"]
        sent = {"csrf_token": token, "state": state}
        page = experimenter.http.post("/dashboard/state", data=sent, follow_redirects=True)
        assert f"The study is {state}" in page.text and f"open to {state}" in page.text
    half_way.get("/question")
    assert half_way.path == ("/question" if goes_on else "/closed")
    if goes_on:
        half_way.answer(2)
    newcomer = person()
    newcomer.get("/")
    if begins:
        newcomer.begin().answer(0)
    else:
        assert newcomer.page.status_code == 403 and "<form" not in newcomer.page.text
    exported = rows(experimenter.get("/dashboard/responses.csv"))
    pilots = rows(experimenter.get("/dashboard/pilot_responses.csv"))
    assert len(exported) == counted and len(pilots) == (state == "pilot")


def test_answers_and_forms_of_a_closed_study_are_not_taken(app, person):
    somebody, newcomer = person().begin(), person()
    newcomer.get("/")
    set_state(app, "closed")
    form = somebody.form("trial") | {"answer": "1"}
    reply = somebody.http.post("/question", data=form, headers={"Accept": "application/json"})
    assert (reply.status_code, reply.json) == (409, {"outcome": "stale", "next": "/closed"})
    assert somebody.answers == [] and newcomer.send("consent", consent="yes").status_code == 403
    somebody.get("/withdraw")  # that stays possible
    sent = {"csrf_token": somebody.form("csrf_token")["csrf_token"], "confirm": "yes"}
    somebody.http.post("/withdraw", data=sent)
    somebody.get("/")
    assert somebody.path == "/withdrawn"


def test_an_insider_tries_a_draft(app, experimenter):
    set_state(app, "draft")
    experimenter.begin().answer(1)
    assert rows(experimenter.get("/dashboard/responses.csv")) == []
    assert len(rows(experimenter.get("/dashboard/pilot_responses.csv"))) == 1


def test_the_last_place_is_given_once(app, person):
    set_quota(app, 3)
    database, study = app.extensions["database"], app.extensions["study"]

    def enrol(visit):
        with database.write() as db:
            return isinstance(flow.enrol(db, study, str(visit)), Participant)

    with ThreadPoolExecutor(8) as at_once:
        assert sum(at_once.map(enrol, range(24))) == 3
    late = person()
    assert "All places" in late.get("/").text


def test_places_of_who_stopped_expire_and_those_of_who_left_are_free(app, person):
    set_quota(app, 2, minutes=30)
    finished, slow = person().begin().answer(*[0] * 30), person().begin().answer(1)
    assert "All places" in person().get("/").text
    with app.extensions["database"].write() as db:
        one = db.get(Participant, 2)
        one.consented_at -= timedelta(hours=1)
    assert "All places" in person().get("/").text  # an answer came later
    with app.extensions["database"].write() as db:
        for row in db.scalars(select(Response).where(Response.participant_id == 2)):
            row.answered_at -= timedelta(hours=1)
    third = person().begin()
    slow.answer(1)  # who began may finish all the same
    assert slow.answers == [1, 1]
    with app.extensions["database"].write() as db:
        record = recruiting.record_of(db)
        assert recruiting.places(db, record) == 3
        recruiting.exclude(db, db.get(Participant, 1), "asleep", who="the test")
        assert recruiting.places(db, record) == 2
        db.get(Participant, 2).pilot = True
        assert recruiting.door(db, record, insider=False) is Door.OPEN
    assert finished.path == "/thanks" and third.path == "/question"


def test_excluding_and_restoring_has_a_reason_and_deletes_nothing(app, person, experimenter):
    person().begin().answer(1, 1)
    person().begin().answer(2)
    experimenter.get("/dashboard/participants/P0001")
    experimenter.send("reason", reason="  ")
    assert "Please say why" in experimenter.page.text
    experimenter.send("reason", reason="said that <b>they guessed</b>")
    assert "they guessed" in experimenter.page.text and "<b>they" not in experimenter.page.text
    numbers = experimenter.get("/dashboard/live.json").json
    assert numbers["summary"]["excluded"] == 1 and numbers["summary"]["answers"] == 1
    exported = rows(experimenter.get("/dashboard/responses.csv"))
    assert [row["participant"] for row in exported] == ["P0002"]
    experimenter.get("/dashboard/participants/P0001")
    experimenter.send("reason", reason="it was a mistake")
    assert len(rows(experimenter.get("/dashboard/responses.csv"))) == 3
    log = rows(experimenter.get("/dashboard/log.csv"))
    done = [(row["who"], row["action"], row["detail"]) for row in log]
    assert [one for one in done if one[1] in ("exclude", "restore")] == [
        ("owner", "exclude", "P0001: said that <b>they guessed</b>"),
        ("owner", "restore", "P0001: it was a mistake"),
    ]
    for _ in range(12):
        person().begin()
    assert "All 14 participants" in experimenter.get("/dashboard/").text
    assert experimenter.get("/dashboard/participants").text.count("/participants/P") == 14
    for nobody in ("P0099", "P1", "x", "P00001", "P" + "9" * 18):
        assert experimenter.get(f"/dashboard/participants/{nobody}").status_code == 404


@pytest.mark.parametrize(
    "quota, minutes", [("-1", "5"), ("0", "5"), ("3", "0"), ("3", ""), ("x", "1")]
)
def test_a_nonsense_quota_changes_nothing(app, experimenter, quota, minutes):
    experimenter.get("/dashboard/")
    experimenter.send("quota", quota=quota, minutes=minutes)
    assert "A quota is a whole number" in experimenter.page.text
    experimenter.send("quota", quota="7", minutes="60")
    assert "0 of 7 places" in experimenter.page.text and "none to 7" in experimenter.page.text
    experimenter.send("quota", quota="", minutes="60")
    with app.extensions["database"].read() as db:
        assert recruiting.record_of(db).quota is None


def test_a_class_behind_one_address_begins_and_a_flood_does_not(app, person):
    app.extensions["newcomers"] = Limiter(attempts=30, window_s=600)
    for _ in range(30):
        somebody = person()
        somebody.get("/")
        assert somebody.send("consent", consent="yes").status_code == 200
    late = person()
    late.get("/")
    form = late.form("consent") | {"consent": "yes"}
    assert late.send("consent", consent="yes").status_code == 429
    elsewhere = {"REMOTE_ADDR": "203.0.113.9"}
    assert late.http.post("/", data=form, environ_base=elsewhere).status_code == 303


def test_who_is_too_fast_for_a_person_or_says_nonsense_is_flagged(app, person, experimenter):
    bot, liar = person().begin(), person().begin()
    for _ in range(30):
        bot.send("trial", answer=0, rt_ms=0)
    liar.send("trial", answer=1, rt_ms=2**31 - 1)
    with app.extensions["database"].write() as db:
        db.get(Participant, 2).consented_at -= timedelta(minutes=3)
    people = experimenter.get("/dashboard/live.json").json["participants"]
    flags = {one["code"]: one["flags"] for one in people}
    assert "too_fast" in flags["P0001"] and "times_doubtful" not in flags["P0001"]
    assert flags["P0002"] == "times_doubtful"


PROLIFIC = {
    "panel": "prolific",
    "required": True,
    "completed": "https://panel.example/done?cc=X1&who={PROLIFIC_PID}&code={code}",
    "turned_away": "https://panel.example/out?who={PROLIFIC_PID}",
}


@pytest.fixture
def panel(tmp_path, write_study):
    return create_app(write_study(tmp_path / "panel", recruiting=PROLIFIC))


def test_a_recruiters_link_is_kept_and_leads_back(panel, person):
    Person = type(person())
    somebody = Person(panel)
    somebody.get("/?PROLIFIC_PID=%3D1%2B1%26x&STUDY_ID=s&SESSION_ID=t&other=secret")
    assert "PROLIFIC_PID" in somebody.page.text  # the consent says what is stored
    somebody.begin().answer(*[0] * 30)
    code = somebody.page.text.split('id="completion-code">')[1][:10]
    back = f"https://panel.example/done?cc=X1&amp;who=%3D1%2B1%26x&amp;code={code}"
    assert f'href="{back}"' in somebody.page.text
    with panel.extensions["database"].read() as db:
        [one] = db.scalars(select(Participant))
        assert json.loads(one.recruit) == {
            "PROLIFIC_PID": "=1+1&x",
            "STUDY_ID": "s",
            "SESSION_ID": "t",
        }
        listed = list(csv.DictReader(io.StringIO("".join(recruits(db, panel)))))
        answers = "".join(export.responses_csv(db, panel.extensions["study"], simulated=False))
    assert listed[0]["PROLIFIC_PID"] == "'=1+1&x" and listed[0]["completion_code"] == code
    assert "1+1" not in answers  # who answered what stays apart from who is paid


def recruits(db, app):
    return export.recruits_csv(db, app.extensions["study"])


def test_one_person_of_a_recruiter_takes_part_once(panel, person):
    Person = type(person())
    stranger, first, second = Person(panel), Person(panel), Person(panel)
    assert "come by the link" in stranger.get("/").text
    second.get("/?PROLIFIC_PID=a")
    first.get("/?PROLIFIC_PID=a")
    first.begin()
    assert "begun this study already" in second.send("consent", consent="yes").text
    assert second.page.status_code == 403
    assert 'href="https://panel.example/out?who=a"' in second.page.text
    assert "begun this study already" in Person(panel).get("/?PROLIFIC_PID=a").text
    Person(panel).get("/?PROLIFIC_PID=" + "b" * 5000)
    with panel.extensions["database"].read() as db:
        assert len(db.scalars(select(Participant)).all()) == 1


def test_a_study_that_declares_nothing_keeps_nothing_of_a_link(app, person):
    somebody = person()
    assert "recruiter" not in somebody.get("/?PROLIFIC_PID=a").text
    somebody.begin()
    with app.extensions["database"].read() as db:
        assert db.get(Participant, 1).recruit is None


@pytest.mark.parametrize(
    "declared, says",
    [
        ({"panel": "other"}, "panel"),
        ({"parameters": ["a b"]}, "parameters"),
        ({"completed": "javascript:alert(1)"}, "an https address"),
        ({"completed": "https://x.example/{nobody}"}, "an https address"),
        ({"turned_away": "https://x.example/{code}"}, "there is none yet"),
        ({"required": True}, "parameters that can be required"),
    ],
)
def test_nonsense_about_recruiting_gets_one_line(tmp_path, write_study, declared, says):
    study = write_study(tmp_path / "wrong", recruiting=declared)
    with pytest.raises(stimuli.errors.InputError, match=says) as told:
        create_app(study)
    assert "\n" not in str(told.value)
