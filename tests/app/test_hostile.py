"""Every address, asked with nonsense by a stranger, a participant and a researcher: nothing fails,
nothing comes back as markup, nothing that was answered changes.
"""

import json
import random
import re
import socket
from pathlib import Path

import pytest
from sqlalchemy import func, select

from app import create_app, export, security
from app.models import Event, Link, LogEntry, Note, Participant, Response, Statement
from app.server import running

VALUES = (
    "",
    "0",
    "1",
    "-1",
    "2147483648",
    "9" * 25,
    "1e309",
    "nan",
    "true",
    "\u0000",
    "\U0001f600",
    "\u202egnp",
    "a" * 3000,
    "<script>alert(1)</script>",
    "\"'><img src=x onerror=alert(1)>",
    "{{7*7}}",
    "=HYPERLINK(1)",
    "../../../etc/passwd",
    "%2e%2e%2f",
    "' OR 1=1 --",
    "a\r\nSet-Cookie: evil=1",
    "[]",
    '{"a": [1]}',
)
APP = Path(security.__file__).parent
#: What the application reads of forms, and what its pages send: a new one is tried by itself.
FIELDS = sorted(
    {"rt_ms", "view", "beside_ms", "pixel_scale", "viewport_width", "device_pixel_ratio"}
    | {
        name
        for paths, pattern in (
            (
                APP.rglob("*.py"),
                r'(?:form\.get\(|form\[|_(?:integer|number)\((?:[\w.]+, )?)"(\w+)"',
            ),
            ((APP / "templates").rglob("*.html"), r'\sname="(\w+)"'),
        )
        for path in paths
        for name in re.findall(pattern, path.read_text())
    }
    - {"csrf_token", "viewport"}
)
HEADERS = ("Accept", "Accept-Language", "Referer", "Origin", "X-Forwarded-For", "Content-Type")
#: To each address and method, so that a new one is tried by itself.
REQUESTS = 3


def addresses(app, draw):
    """Every address of the application with every method that it takes, in a random order."""
    rules = [
        (rule.rule, method)
        for rule in app.url_map.iter_rules()
        for method in sorted(rule.methods - {"HEAD", "OPTIONS"})
    ] * REQUESTS
    draw.shuffle(rules)
    for rule, method in rules:
        yield re.sub(r"<[^>]+>", lambda _: draw.choice(VALUES).replace("?", ""), rule), method


@pytest.mark.parametrize("who", ["stranger", "participant", "researcher"])
def test_nonsense_fails_nowhere(app, person, experimenter, who):
    finished = person().begin().answer(*[1, 0, -1] * 10)
    visitor = {"stranger": person(), "researcher": experimenter, "participant": person()}[who]
    visitor.begin().answer(2) if who == "participant" else visitor.get("/dashboard/login")
    page = visitor.get("/withdraw").text
    token = re.search(r'name="csrf_token" value="([^"]+)"', page)[1]
    draw = random.Random(who)
    before = rows(app)
    assert {"trial", "answer", "familiarity", "reason", "code", "state"} <= set(FIELDS)
    for path, method in addresses(app, draw):
        if path in ("/dashboard/logout", "/another"):
            continue
        form = {name: draw.choice(VALUES) for name in draw.sample(FIELDS, 6)}
        form["confirm"] = ""  # withdrawing is tested elsewhere
        headers = {
            name: draw.choice(VALUES).replace("\r\n", "").encode("ascii", "ignore").decode()
            for name in draw.sample(HEADERS, 2)
        }
        if method == "GET":
            reply = visitor.http.get(path, query_string=form, headers=headers)
        else:
            headers.pop("Content-Type", None)
            data = form | ({"csrf_token": token} if draw.random() < 0.9 else {})
            reply = visitor.http.post(path, data=data, headers=headers)
        asked = f"{method} {path!r} {form} {headers}: {reply.status}"
        assert reply.status_code < 500, asked
        assert "evil" not in str(reply.headers.get_all("Set-Cookie")), asked
        if "html" in (reply.content_type or ""):
            assert "<script>alert" not in reply.text and "<img src=x" not in reply.text, asked
    assert [row for row in rows(app) if row in before] == before  # nothing that was there changed
    assert finished.answers == [1, 0, -1] * 10
    with app.extensions["database"].read() as db:
        assert db.scalar(select(func.count(Event.id))) < 40  # nor is nonsense kept


def rows(app):
    columns = (Response.id, Response.participant_id, Response.trial_id, Response.answer)
    with app.extensions["database"].read() as db:
        return [tuple(row) for row in db.execute(select(*columns).order_by(Response.id))]


def test_what_no_database_takes_is_refused_before_it_gets_there(experimenter, person):
    person().begin()
    experimenter.get("/dashboard/participants/P0001")
    assert experimenter.send("reason", reason="a\0b").status_code == 400
    assert experimenter.http.get("/?PROLIFIC_PID=%00").status_code == 400


def test_ids_and_keys_of_others_open_nothing(app, person):
    one, two = person().begin().answer(1), person().begin()
    form = two.form("trial") | {"answer": "2"}
    for trial in range(1, 62):
        sent = form | {"trial": str(trial)}
        one.http.post("/question", data=sent, headers={"Accept": "application/json"})
    assert two.answers == []
    with app.extensions["database"].read() as db:
        visit = db.get(Participant, 2).visit
    forged = person()
    for cookie in (visit, f'{{"visit": "{visit}"}}', "eyJ2aXNpdCI6ICJ4In0.x.y", "." * 4000):
        forged.http.set_cookie("subdermal", cookie)
        forged.get("/question")
        assert forged.path == "/"


def test_no_cell_of_a_table_is_a_formula(app, person, experimenter):
    person().begin().answer(*[0] * 30)
    with app.extensions["database"].write() as db:
        for number, start in enumerate("=+-@\t", start=1):
            db.get(Response, number).reason_text = f"{start}1+1"
    assert '"reason_text": "=1+1"' in experimenter.get("/dashboard/responses.jsonl").text
    experimenter.get("/dashboard/participants/P0001")
    experimenter.send("reason", reason='=HYPERLINK("http://evil.example")')
    tables = {rule.rule for rule in app.url_map.iter_rules() if rule.rule.endswith(".csv")}
    assert {"/dashboard/responses.csv", "/dashboard/log.csv"} <= tables
    for table in tables:
        text = experimenter.get(table).text
        assert not re.search(r'(?:^|,)"?(?:[=+@\t]|-1\+1)', text, re.M), table


def test_markup_that_is_stored_comes_back_as_text(app, person, experimenter):
    """Whatever texts are in the database, every page of a researcher shows them as text."""
    markup = "<script>alert(1)</script><img src=x onerror=alert(1)>"
    somebody = person().begin().answer(*[0] * 30)
    experimenter.get("/dashboard/participants/P0001")
    experimenter.send("reason", reason=markup)
    with app.extensions["database"].write() as db:
        db.add_all(
            [Link(token="T" * 16, label=markup), Note(participant_id=1, who="a", text=markup)]
        )
        db.add(Statement(participant_id=1, name="own", value=markup))
        db.add(LogEntry(who=markup, action="a", detail=markup))
        for row in db.scalars(select(Response)):
            row.reason_text = markup
        db.get(Participant, 1).recruit = json.dumps({"PROLIFIC_PID": markup})
    shown = 0
    for rule in app.url_map.iter_rules():
        if "GET" not in rule.methods or rule.endpoint in ("static", "web.static"):
            continue
        path = rule.rule.replace("<code>", "P0001")
        for visitor in (experimenter, somebody):
            reply = visitor.http.get(path)
            if "html" in (reply.content_type or "") or path.endswith("live.json"):
                text = (
                    reply.json["html"]
                    if path.endswith("live.json") and reply.is_json and "html" in reply.json
                    else reply.text
                )
                assert "<script>alert" not in text and "<img src=x" not in text, path
                shown += "&lt;script&gt;alert" in text
    assert shown  # it was looked for where it is


def test_a_body_that_never_ends_and_one_that_is_too_long_cost_nobody_a_place(study_dir):
    app = create_app(study_dir)
    with running(app) as url:
        host, port = url.split("/")[2].split(":")
        head = f"POST / HTTP/1.1\r\nHost: {host}\r\nContent-Type: text/plain\r\n"
        slow = [socket.create_connection((host, int(port)), timeout=20) for _ in range(20)]
        for one in slow:
            one.sendall(f"{head}Content-Length: 1000\r\n\r\nx".encode())
        with socket.create_connection((host, int(port)), timeout=20) as other:
            other.sendall(f"GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
            assert other.recv(100).startswith(b"HTTP/1.1 200")
        for wrong in (
            f"{head}Content-Length: 99999999\r\n\r\n",
            f"{head}Content-Length: -1\r\n\r\n",
            f"{head}Transfer-Encoding: nonsense\r\n\r\n",
            f"{head}X: {'y' * 100_000}\r\n\r\n",
            "nonsense\r\n\r\n",
        ):
            with socket.create_connection((host, int(port)), timeout=20) as other:
                other.sendall(wrong.encode())
                assert re.match(rb"HTTP/1\.[01] (4\d\d|501)", other.recv(100)), wrong[:200]
        for one in slow:
            one.close()
    with app.extensions["database"].read() as db:
        assert export.count(db) == 0
