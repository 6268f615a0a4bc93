"""What the experimenter sees and downloads."""

import csv
import dataclasses
import hashlib
import io
import json
import re
import zipfile
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta

import pytest
from markupsafe import escape
from sqlalchemy import func, select

from analysis.agreement import consistency
from analysis.options import Options
from analysis.responses import read_responses
from analysis.worth import worths
from app.dashboard import live
from app.models import Event, Live, Participant, Response, Trial, now


def table(response):
    return list(csv.DictReader(io.StringIO(response.text)))


def withdraw(somebody):
    somebody.get("/withdraw")
    form = somebody.form("csrf_token")
    somebody.http.post("/withdraw", data=form | {"confirm": "yes"})


def test_the_export_has_one_row_for_each_answer(person, experimenter, app):
    person().begin(familiarity=5).answer(*[1, -2, 0] * 10)
    person().begin(familiarity=1).answer(2, 2)
    response = experimenter.get("/dashboard/responses.csv")
    rows = table(response)
    assert len(rows) == 32 == int(response.headers["X-Row-Count"])
    with app.extensions["database"].read() as db:
        columns = (Trial.cell, Trial.left, Trial.right, Trial.order, Response.answer)
        expected = db.execute(
            select(*columns).join(Response).order_by(Trial.participant_id, Trial.order)
        ).all()
    assert [
        (r["framing"], r["left"], r["right"], int(r["order"]), int(r["answer"])) for r in rows
    ] == [tuple(row) for row in expected]
    assert [
        (r["participant"], r["familiarity"], r["completed"], r["simulated"])
        for r in (rows[0], rows[-1])
    ] == [
        ("P0001", "5", "1", "0"),
        ("P0002", "1", "0", "0"),
    ]


def test_every_answer_names_the_images_that_were_shown(person, experimenter, app):
    person().begin().answer(1)
    row = table(experimenter.get("/dashboard/responses.csv"))[0]
    study = app.extensions["study"]
    for side in ("left", "right"):
        image = study.images_by_sha256[row[f"image_{side}_sha256"]]
        assert (image.framing, image.technique) == (row["framing"], row[side])


def test_the_export_is_what_the_analysis_reads(person, experimenter, tmp_path):
    person().begin().answer(*[1, -2, 0] * 10)
    (tmp_path / "responses.csv").write_bytes(experimenter.get("/dashboard/responses.csv").data)
    responses = read_responses(tmp_path / "responses.csv")
    assert len(responses.frame) == 30 and not responses.findings and not responses.simulated


def test_tables_as_lines_and_in_one_file_with_hashes(person, experimenter, study_dir):
    person().begin().answer(*[1, -2, 0] * 10)
    rows = table(experimenter.get("/dashboard/responses.csv"))
    response = experimenter.get("/dashboard/responses.jsonl")
    lines = [json.loads(line) for line in response.text.splitlines()]
    assert len(lines) == 30 == int(response.headers["X-Row-Count"])
    as_text = [{k: "" if v is None else str(v) for k, v in line.items()} for line in lines]
    assert as_text == rows
    with zipfile.ZipFile(io.BytesIO(experimenter.get("/dashboard/export.zip").data)) as archive:
        sums = dict(
            reversed(line.split("  ")) for line in archive.read("SHA256SUMS").decode().splitlines()
        )
        assert sums.keys() == set(archive.namelist()) - {"SHA256SUMS"}
        for name, digest in sums.items():
            assert hashlib.sha256(archive.read(name)).hexdigest() == digest
        assert archive.read("responses.jsonl") == response.data
        assert archive.read("manifest.json") == (study_dir / "manifest.json").read_bytes()
        assert json.loads(archive.read("counts.json")) == {"responses": 30, "simulated": False}


def test_withdrawn_answers_are_not_exported_nor_counted(person, experimenter):
    person().begin().answer(1, 1, 1)
    leaver = person().begin().answer(2, 2)
    withdraw(leaver)
    assert {row["participant"] for row in table(experimenter.get("/dashboard/responses.csv"))} == {
        "P0001"
    }
    live = experimenter.get("/dashboard/live.json").json
    assert live["summary"]["answers"] == 3 and live["summary"]["withdrawn"] == 1
    assert sum(framing["answers"] for framing in live["framings"]) == 3
    assert sum(given["count"] for given in live["sides"]["given"]) == 3
    assert sum(side["left"] for side in live["sides"]["shown"]) == 3


def test_the_codebook_describes_exactly_the_columns(person, experimenter):
    person().begin().answer(1)
    columns = list(table(experimenter.get("/dashboard/responses.csv"))[0])
    codebook = table(experimenter.get("/dashboard/codebook.csv"))
    assert [row["column"] for row in codebook] == columns
    assert all(row["description"] and row["type"] for row in codebook)
    text = experimenter.get("/dashboard/codebook.md").text
    for word in (
        *(f"| `{column}` |" for column in columns),
        "by golubev_plus",
        "at half-length",
        "A, clearly",
        "No familiarity",
    ):
        assert word in text


def test_an_empty_study_has_an_empty_table_and_a_calm_dashboard(experimenter):
    response = experimenter.get("/dashboard/responses.csv")
    assert (
        table(response) == []
        and response.text.startswith("participant,")
        and response.headers["X-Row-Count"] == "0"
    )
    assert "No answers yet" in experimenter.get("/dashboard/").text


def test_live_numbers_follow_the_answers(person, experimenter, app):
    somebody = person().begin()
    before = experimenter.get("/dashboard/live.json").json
    assert (before["summary"]["started"], before["summary"]["answers"], before["framings"]) == (
        1,
        0,
        [],
    )
    somebody.answer(2)
    after = experimenter.get("/dashboard/live.json").json
    with app.extensions["database"].read() as db:
        trial = db.scalars(select(Trial).order_by(Trial.order)).first()
    (framing,) = after["framings"]
    assert framing["name"] == trial.cell and framing["total"] == 2
    assert framing["coherence"] == "Some pairs have no answer yet."
    assert {t["name"]: t["score"] for t in framing["techniques"]} == {trial.right: 2, trial.left: 0}
    assert after["participants"][0]["answered"] == 1 and "at " + trial.cell in after["html"]
    assert "1 / 30" in " ".join(after["html"].split())


def test_numbers_are_made_once_for_all_who_look(person, experimenter, app, monkeypatch):
    made, database, study = [], app.extensions["database"], app.extensions["study"]
    numbers = live.numbers
    monkeypatch.setattr(live, "numbers", lambda *asked: made.append(1) or numbers(*asked))

    def look(period_s=0.0):
        return live.shared(database, study, period_s)

    somebody = person().begin().answer(1)
    with ThreadPoolExecutor(4) as tabs:
        list(tabs.map(look, [0.0] * 8))
    seen = look()
    assert len(made) <= 4 and seen["summary"]["answers"] == 1  # nothing there yet: four may begin
    made.clear()
    assert look() == look(1000) == seen and not made  # nothing has happened
    somebody.answer(2)
    assert look(1000)["summary"]["answers"] == 2 and len(made) == 1
    somebody.answer(2)
    assert look()["summary"]["answers"] == 2 and len(made) == 1  # not before 1000 s have passed
    with database.write() as db:
        db.get(Live, 1).next_at = now()
        db.get(Live, 1).claimed_until = now() + timedelta(minutes=1)
    assert look()["summary"]["answers"] == 2  # another worker makes them
    with database.write() as db:
        db.get(Live, 1).claimed_until = now()  # it was killed
    assert look()["summary"]["answers"] == 3
    version = experimenter.get("/dashboard/live.json").json["version"]
    again = experimenter.get(f"/dashboard/live.json?version={version}")
    assert (again.status_code, again.data) == (204, b"")
    assert f'data-version="{version}"' in experimenter.get("/dashboard/").text


def test_every_rule_of_exclusion_has_words():
    rules = {field.name for field in dataclasses.fields(Options().exclusions)}
    assert {*live.BREAKS} == rules | {live.TOO_FAST, live.TIMES_DOUBTFUL}
    words = live.in_words("zeta; trap_share, too_fast")
    assert words == "incoherent, traps missed, fast by the server's clock"


def test_who_breaks_a_rule_and_where_people_stop(person, experimenter, app):
    person().begin().answer(*[2] * 30)  # always the same side, and in 1,234 ms
    person().begin().answer(1, -1)
    with app.extensions["database"].write() as db:
        for row in db.scalars(select(Response).where(Response.participant_id == 2)):
            row.answered_at -= timedelta(hours=1)
    numbers = experimenter.get("/dashboard/live.json").json
    flags = {one["code"]: one["flags"] for one in numbers["participants"]}
    assert "one_side_share" in flags["P0001"] and "same_answer_share" in flags["P0001"]
    assert "answered_share" in flags["P0002"]
    said = {code: live.in_words(one) for code, one in flags.items()}
    assert {*said["P0001"].split(", ")} >= {"one side", "one answer"}
    assert all(escape(words) in numbers["html"] for words in said.values())
    assert "_share" not in numbers["html"]
    assert escape(said["P0001"]) in experimenter.get("/dashboard/participants/P0001").text
    assert numbers["stopped"] == [{"answered": 2, "people": 1}]
    assert "Stopped after 2 answers." in " ".join(numbers["html"].split())
    rows = table(experimenter.get("/dashboard/participants.csv"))
    assert [row["flags"] for row in rows] == [flags["P0002"], flags["P0001"]]


def test_priorities_appear_when_every_pair_is_answered(person, experimenter):
    """Equal judgements everywhere have equal priorities and a consistency ratio of 0."""
    person().begin().answer(*[0] * 30)
    for framing in experimenter.get("/dashboard/live.json").json["framings"]:
        assert [t["priority"] for t in framing["techniques"]] == pytest.approx([0.2] * 5)
        words = "The judgements are coherent by Saaty's rule, CR 0.000."  # as in the report
        assert framing["coherence"] == words


def test_states_of_participants(person, experimenter, app):
    for answers in (30, 2, 2, 2):
        person().begin().answer(*[0] * answers)
    with app.extensions["database"].write() as db:
        db.get(Participant, 3).withdrawn_at = now()
        for row in db.scalars(select(Response).where(Response.participant_id == 4)):
            row.answered_at -= timedelta(hours=1)
    live = experimenter.get("/dashboard/live.json").json
    assert [p["state"] for p in live["participants"]] == [
        "dropped out",
        "withdrawn",
        "in progress",
        "completed",
    ]


def test_the_report_is_served_behind_the_login_with_its_own_policy(person, experimenter, study_dir):
    assert experimenter.get("/dashboard/report/").status_code == 404
    (study_dir / "report").mkdir()
    (study_dir / "report" / "report.html").write_text(
        "<title>Report</title><style>p { color: red }</style>"
    )
    response = experimenter.get("/dashboard/report/")
    assert (
        "<title>Report" in response.text
        and "style-src 'unsafe-inline'" in response.headers["Content-Security-Policy"]
    )
    assert "script-src" not in response.headers["Content-Security-Policy"]
    assert 'href="/dashboard/report/"' in experimenter.get("/dashboard/").text
    assert experimenter.get("/dashboard/report/../../study.sqlite3").status_code == 404
    stranger = person()
    stranger.get("/dashboard/report/")
    assert stranger.path == "/dashboard/login"


def test_answers_about_images_that_were_rendered_anew_are_pointed_out(person, experimenter, app):
    person().begin().answer(1, 1, 1)
    assert experimenter.get("/dashboard/live.json").json["summary"]["about_other_images"] == 0
    with app.extensions["database"].write() as db:
        db.get(Response, 2).image_right_sha256 = "0" * 64
        db.delete(db.get(Live, 1))  # nothing that the questionnaire does changes an answer
    live = experimenter.get("/dashboard/live.json").json
    assert (
        live["summary"]["about_other_images"] == 1
        and "1 of these answers are about images" in live["html"]
    )


def test_the_dashboard_links_every_image_by_its_hash(experimenter, app):
    text = experimenter.get("/dashboard/").text
    for sha256 in app.extensions["study"].images_by_sha256:
        assert f'href="/images/{sha256}"' in text


def test_what_happened_is_kept_as_events(person, app):
    somebody = person().begin().answer(*[1] * 30)
    withdraw(somebody)
    with app.extensions["database"].read() as db:
        counts = dict(db.execute(select(Event.kind, func.count()).group_by(Event.kind)).all())
    assert counts == {"consented": 1, "rated": 1, "completed": 1, "withdrew": 1}


def test_completion_codes_can_be_checked_and_say_nothing_else(person, experimenter):
    somebody = person().begin().answer(*[0] * 30)
    person().begin().answer(0)
    code = re.search(r'id="completion-code">(\w+)<', somebody.page.text)[1]
    key = re.search(r'id="withdrawal-key">(\w+)<', somebody.page.text)[1]
    rows = experimenter.get("/dashboard/completions.csv").text.splitlines()
    today = datetime.now(UTC).date().isoformat()
    assert rows == ["completion_code,completed_on,withdrawn", f"{code},{today},0"]
    experimenter.get("/dashboard/")
    experimenter.send("code", code=f"{code[:4].lower()} {code[4:]}")
    assert f"{code}: completed on {today}." in experimenter.page.text
    for other in (key, "<script>"):
        experimenter.send("code", code=other)
        assert "not given by this study" in experimenter.page.text
    assert "<script>" not in experimenter.page.text and key not in "".join(rows)


def test_worths_and_triads_are_those_of_the_analysis(person, experimenter, tmp_path):
    """Of the downloaded table: the live numbers are what `analysis` makes of it."""
    for k in range(6):
        person().begin().answer(*[(i * (k + 2)) % 5 - 2 for i in range(30)])
    (tmp_path / "responses.csv").write_bytes(experimenter.get("/dashboard/responses.csv").data)
    answers, chosen = read_responses(tmp_path / "responses.csv"), Options()
    table = worths(answers, chosen)
    table = table[table.model == "thurstone_jod"].set_index(["framing", "technique"])
    circular = consistency(answers, chosen).set_index(["framing", "statistic"]).value
    numbers = experimenter.get("/dashboard/live.json").json
    for framing in numbers["framings"]:
        assert framing["unit"] == "JOD" and framing["level"] == "95"
        for one in framing["techniques"]:
            row = table.loc[framing["name"], one["name"]]
            assert [one["low"], one["worth"], one["high"]] == pytest.approx(
                [row.low, row.estimate, row.high], abs=1e-9
            )
            assert 0 <= one["from"] <= one["at"] <= one["to"] <= 100
        triads = framing["triads"]
        assert triads["mean"] == pytest.approx(circular[framing["name"], "circular_triads"])
        # five techniques have ten triads, each in a circle one time in four
        assert triads["guessing"] == 2.5
        assert framing["pairs"] == {"least": 6, "most": 6}
    assert "by guessing" in numbers["html"]


def test_numbers_that_do_not_exist_are_no_numbers(person, experimenter):
    """JSON has no NaN; nobody saw a difference, so there is no worth to estimate."""
    person().begin().answer(0, 0, 0)
    text = experimenter.get("/dashboard/live.json").text
    assert "NaN" not in text and "Infinity" not in text
    for framing in json.loads(text)["framings"]:
        assert {one["low"] for one in framing["techniques"]} == {None}
        assert framing["notes"]


def test_on_which_page_people_stop_and_how_long_they_take(person, experimenter, app):
    person().begin().answer(*[1] * 30)
    person().begin().answer(1, 1)
    person().begin()
    undecided = person()
    undecided.get("/")
    undecided.send("consent", consent="yes")
    with app.extensions["database"].write() as db:
        for one in db.scalars(select(Participant).where(Participant.id.in_([3, 4]))):
            one.consented_at -= timedelta(hours=1)
    numbers = experimenter.get("/dashboard/live.json").json
    pages = [(one["page"], one["came"], one["stopped"]) for one in numbers["pages"]]
    assert pages == [
        ("Self-rating", 4, 1),
        ("Questions 1 to 5", 3, 1),
        ("Questions 6 to 10", 1, 0),
        ("Questions 11 to 15", 1, 0),
        ("Questions 16 to 20", 1, 0),
        ("Questions 21 to 25", 1, 0),
        ("Questions 26 to 30", 1, 0),
        ("Finished", 1, 0),
    ]
    everything = numbers["times"][-1]
    assert (everything["label"], everything["median"]) == ("All", 0.32)  # 321 ms each


def test_a_person_is_held_to_each_declared_rule(person, experimenter):
    person().begin().answer(*[2] * 30)
    page = " ".join(experimenter.get("/dashboard/participants/P0001").text.split())
    assert "the same answer at least 95 % of the time" in page
    rows = re.findall(r'class="words">(.*?)</th><td class="number">(.*?)</td><td>(.*?)</td>', page)
    by_rule = {re.sub(" <.*", "", words): (value, broken) for words, value, broken in rows}
    assert by_rule["the same answer at least 95 % of the time"] == ("100 %", "yes")
    assert by_rule["at least 90 % on one side, and not by chance (p &lt; 0.001)"] == (
        "0 left, 30 right",
        "yes",
    )
    assert by_rule["median answer under 500 ms"] == ("321 ms", "yes")


def test_pages_about_people_share_what_was_made(app, person, experimenter, monkeypatch):
    made, judge = [], live.participants
    monkeypatch.setattr(live, "participants", lambda *a: made.append(1) or judge(*a))
    app.config["LIVE_PERIOD_S"] = 60
    somebody = person().begin().answer(1, 2)
    experimenter.get("/dashboard/participants/P0001")
    somebody.answer(0)
    for path in ("participants", "participants/P0001", "participants.csv"):
        assert "3 / 30" not in experimenter.get(f"/dashboard/{path}").text
    assert len(made) == 1
    experimenter.get("/dashboard/participants/P0001")
    experimenter.send("reason", reason="fell asleep")
    assert "excluded" in experimenter.get("/dashboard/participants").text  # at once
    before = len(made)
    person().begin()
    assert experimenter.get("/dashboard/participants/P0002").status_code == 200
    assert len(made) == before + 1
