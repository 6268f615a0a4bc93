"""Every address, asked with nonsense by a stranger, a participant and a researcher: nothing fails,
nothing comes back as markup, nothing that was answered changes.
"""

import random
import re
import socket
from pathlib import Path

import pytest
from sqlalchemy import func, select

from app import create_app, export, security
from app.models import Event, Participant, Response
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
#: What the application reads of forms, and what its pages send beside.
FIELDS = sorted(
    {
        "quota",
        "minutes",
        "rt_ms",
        "view",
        "beside_ms",
        "pixel_scale",
        "viewport_width",
        "device_pixel_ratio",
    }
    | {
        name
        for path in Path(security.__file__).parent.rglob("*.py")
        for name in re.findall(
            r'(?:form\.get\(|form\[|_integer\(|_number\()"(\w+)"', path.read_text()
        )
    }
)
HEADERS = ("Accept", "Accept-Language", "Referer", "Origin", "X-Forwarded-For", "Content-Type")
REQUESTS = 250


def addresses(app, draw):
    rule = draw.choice(list(app.url_map.iter_rules()))
    path = re.sub(r"<[^>]+>", lambda _: draw.choice(VALUES).replace("?", ""), rule.rule)
    return path, draw.choice(sorted(rule.methods - {"HEAD", "OPTIONS"}))


@pytest.mark.parametrize("who", ["stranger", "participant", "researcher"])
def test_nonsense_fails_nowhere(app, person, experimenter, who):
    finished = person().begin().answer(*[1, 0, -1] * 10)
    visitor = {"stranger": person(), "researcher": experimenter, "participant": person()}[who]
    visitor.begin().answer(2) if who == "participant" else visitor.get("/dashboard/login")
    page = visitor.get("/withdraw").text
    token = re.search(r'name="csrf_token" value="([^"]+)"', page)[1]
    draw = random.Random(who)
    before = rows(app)
    for _ in range(REQUESTS):
        path, method = addresses(app, draw)
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
    for name in ("responses", "participants", "completions", "log", "codebook", "recruits"):
        text = experimenter.get(f"/dashboard/{name}.csv").text
        assert not re.search(r'(?:^|,)"?(?:[=+@\t]|-1\+1)', text, re.M), name


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
