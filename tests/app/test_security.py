"""What strangers and hostile input must not achieve."""

import re
from datetime import UTC, datetime
from types import SimpleNamespace

import itsdangerous.timed
import pytest
from flask import url_for
from sqlalchemy.exc import OperationalError

from app import create_app
from app.security import Limiter
from tests.app.conftest import researcher

FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")

POSTS = [
    "/dashboard/links",
    "/language",
    "/",
    "/familiarity",
    "/before",
    "/screen",
    "/after",
    "/question",
    "/withdraw",
    "/resume/",
    "/another",
    "/dashboard/login",
    "/dashboard/logout",
    "/dashboard/password",
    "/dashboard/completion",
    "/dashboard/state",
    "/dashboard/quota",
    "/dashboard/participants/P0001",
    "/dashboard/participants/P0001/notes",
    "/dashboard/notes",
    "/simulation/",
]
CLOSED = [
    f"/dashboard/{name}"
    for name in (
        "",
        "password",
        "live.json",
        "responses.csv",
        "participants.csv",
        "responses.jsonl",
        "responses.parquet",
        "assignments.jsonl",
        "export.zip",
        "participants",
        "participants/P0001",
        "pilot_responses.csv",
        "recruits.csv",
        "log",
        "log.csv",
        "studies",
        "notes",
        "notes.csv",
        "links.csv",
        "completions.csv",
        "codebook.csv",
        "codebook.md",
        "report/",
        "report/report.html",
    )
]
OPEN = [
    "/",
    "/familiarity",
    "/before",
    "/screen",
    "/after",
    "/question",
    "/thanks",
    "/withdraw",
    "/withdrawn",
    "/resume/",
    "/resume/P0001",
    "/closed",
    "/not-taken",
    "/plate/1.png",
    "/study.css",
    "/health",
    "/metrics",
    "/dashboard/login",
    "/simulation/",
    "/simulation/status.json",
]


def addresses(app, method):
    """An address for every rule of the application that takes the method."""
    for rule in app.url_map.iter_rules():
        if method in rule.methods:
            sha256 = next(iter(app.extensions["study"].images_by_sha256))
            values = {"sha256": sha256, "filename": "style.css", "name": "report.html"}
            values |= {
                "box": "0-0-64-36",
                "width": 64,
                "number": 1,
                "code": "P0001",
                "amplify": 2,
                "reference": sha256,
            }
            with app.test_request_context():
                yield url_for(rule.endpoint, **{name: values[name] for name in rule.arguments})


@pytest.fixture
def twin(study_dir):
    """The application over simulated answers, which has every rule of the real one and a few of its
    own.
    """
    return create_app(study_dir, simulated=True)


def test_the_lists_above_are_complete(twin):
    assert set(addresses(twin, "POST")) == set(POSTS)
    rest = {
        path for path in addresses(twin, "GET") if not path.startswith(("/images/", "/static/"))
    }
    assert rest == {*CLOSED, *OPEN}


@pytest.mark.parametrize("path", POSTS)
def test_no_post_without_a_token(twin, path):
    for data in (
        {},
        {"csrf_token": "nonsense"},
        {"consent": "yes", "trial": 1, "answer": 1, "password": "x"},
    ):
        assert twin.test_client().post(path, data=data).status_code == 400


def test_a_token_of_another_browser_is_refused(person):
    one, two = person().begin(), person().begin()
    form = one.form("trial") | {"answer": "1", "csrf_token": two.form("trial")["csrf_token"]}
    reply = one.http.post("/question", data=form)
    assert reply.status_code == 400 and "reload" in reply.text and one.answers == []


@pytest.mark.parametrize("path", CLOSED)
def test_the_dashboard_is_closed_to_strangers(app, path):
    assert app.test_client().get(path).headers["Location"] == "/dashboard/login"
    assert app.test_client().get(path, headers={"Accept": "application/json"}).status_code == 401


@pytest.mark.parametrize("logged_in", [False, True])
def test_headers_on_every_page(twin, logged_in):
    http = twin.test_client()
    if logged_in:
        http = researcher(twin, "owner").http
    for path in [*addresses(twin, "GET"), "/nowhere", "/images/" + "0" * 64]:
        response = http.get(path)
        assert response.status_code in (200, 303, 404), path
        headers = response.headers
        policy = headers["Content-Security-Policy"]
        assert (
            "default-src 'none'" in policy
            and "frame-ancestors 'none'" in policy
            and "base-uri 'none'" in policy
        ), path
        assert "unsafe" not in policy, path
        assert (
            headers["X-Content-Type-Options"] == "nosniff"
            and headers["Referrer-Policy"] == "same-origin"
        ), path
        cache = headers["Cache-Control"]
        assert ("immutable" in cache) == (
            path.startswith("/images/") and response.status_code == 200
        ), path
        assert cache == "no-store" or path.startswith(("/images/", "/static/", "/study.css")), path


def test_no_page_has_anything_inline(person, experimenter):
    """What the content policy forbids must not be there either: it would silently not work."""
    somebody = person()
    pages = [
        somebody.get("/").text,
        somebody.begin().page.text,
        somebody.get("/withdraw").text,
        experimenter.get("/dashboard/").text,
    ]
    for page in pages:
        assert not re.search(r"<style|\sstyle=|\son[a-z]+=|javascript:", page)
        assert all("src=" in tag for tag in re.findall(r"<script[^>]*>", page))


def test_cookies(app, person):
    response = app.test_client().get("/")
    cookie = response.headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Lax" in cookie and "Secure" not in cookie
    assert (
        "; Secure"
        in app.test_client().get("/", base_url="https://study.example").headers["Set-Cookie"]
    )
    somebody = person().begin().answer(1)
    value = somebody.http.get_cookie("subdermal").value
    somebody.http.set_cookie(
        "subdermal", ("A" if value[0] != "A" else "B") + value[1:]
    )  # a forged one is nobody's
    somebody.get("/question")
    assert somebody.path == "/"


def test_hostile_labels_are_escaped(tmp_path, write_study, request):
    hostile = "<script>alert('x')</script>\"'><img src=x onerror=alert(1)>"
    study = write_study(
        tmp_path / "hostile",
        title=hostile,
        consent=hostile,
        question={"text": hostile, "left_label": hostile, "right_label": "B" + hostile},
        scale=[{"value": value, "label": f"{value}{hostile}"} for value in range(-2, 3)],
        familiarity={"question": hostile, "labels": [f"{i}{hostile}" for i in range(5)]},
        framings=[{"name": name, "label": name + hostile} for name in FRAMINGS],
        techniques=[{"name": name, "label": name + hostile} for name in TECHNIQUES],
    )
    app = create_app(study)
    Person = type(request.getfixturevalue("person")())
    somebody = Person(app)
    pages = [somebody.get("/").text]
    somebody.send("consent", consent="yes")
    pages += [
        somebody.page.text,
        somebody.send("familiarity", familiarity=1).text,
        somebody.answer(1).page.text,
    ]
    somebody = researcher(app, "owner")
    pages += [somebody.page.text, somebody.get("/dashboard/live.json").json["html"]]
    assert any("&lt;script&gt;" in page for page in pages)
    for page in pages:
        assert "<script>" not in page and "<img src=x" not in page and "alert('x')" not in page


def test_hostile_input_comes_back_escaped(person):
    somebody = person()
    somebody.get("/withdraw")
    assert "<b>x" not in somebody.send("code", code="<b>x", confirm="yes").text
    assert "<b>x" not in somebody.get("/resume/<b>x").text
    assert "<b>x" not in somebody.get("/<b>x").text


@pytest.mark.parametrize("path", ["/dashboard", "/dashboard/report", "/question", "/dashboard/"])
def test_redirects_do_not_repeat_the_host_that_a_visitor_names(app, path):
    found = app.test_client().get(path, headers={"Host": "evil.example"})
    assert found.status_code in (303, 308)
    assert found.headers["Location"].startswith("/") and "evil" not in str(found.headers)


def test_the_limiter_forgets_with_time_and_after_success(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr("app.security.time.monotonic", lambda: clock[0])
    limiter = Limiter(attempts=2, window_s=10)
    assert [limiter.allow("a"), limiter.allow("a"), limiter.allow("a"), limiter.allow("b")] == [
        True,
        True,
        False,
        True,
    ]
    clock[0] = 11
    assert limiter.allow("a") and limiter.allow("a") and not limiter.allow("a")
    limiter.forget("a")
    assert limiter.allow("a")


def test_the_limiter_also_counts_everybody_together():
    limiter = Limiter(attempts=2, window_s=10)
    assert [limiter.allow(str(i)) for i in range(21)] == [True] * 20 + [False]


def test_hosts_that_are_not_trusted_are_refused(study_dir):
    http = create_app(study_dir, trusted_hosts=["study.example"]).test_client()
    assert http.get("/", headers={"Host": "study.example"}).status_code == 200
    for host in ("evil.example", "study.example.evil.example", "127.0.0.1", ""):
        page = http.get("/", headers={"Host": host})
        assert page.status_code == 400 and "evil" not in page.text


def test_health_and_metrics_say_no_more_than_they_should(study_dir, person, app, monkeypatch):
    assert app.test_client().get("/metrics").status_code == 404
    person().begin().answer(1)
    http = create_app(study_dir, metrics_token="secret").test_client()
    assert http.get("/health").json == {"status": "ok"}
    for wrong in ({}, {"Authorization": "Bearer"}, {"Authorization": "Bearer s\u00e9cret"}):
        assert http.get("/metrics", headers=wrong).status_code == 401
    told = http.get("/metrics", headers={"Authorization": "Bearer secret"}).text
    assert "\nsubdermal_answers 1\n" in told and "\nsubdermal_participants_total 1\n" in told
    assert told.count("# TYPE") == 7 and "P0001" not in told

    def gone(*_):
        raise OperationalError("SELECT", {}, Exception("secret address"))

    monkeypatch.setattr("app.database.Database.read", gone)
    failed = app.test_client().get("/health")
    assert (failed.status_code, failed.json) == (503, {"status": "no database"})


@pytest.mark.sqlite
def test_nothing_says_who_the_visitor_is(app, person, study_dir):
    somebody = person()
    somebody.http.environ_base["REMOTE_ADDR"] = "203.0.113.77"
    somebody.http.environ_base["HTTP_USER_AGENT"] = "Tell-Tale/1.0"
    somebody.begin().answer(*[1] * 30)
    app.extensions["database"].close()
    stored = b"".join(path.read_bytes() for path in study_dir.glob("study.sqlite3*"))
    assert b"203.0.113.77" not in stored and b"Tell-Tale" not in stored


def test_a_failure_is_a_friendly_page_without_details(app, person, monkeypatch):
    somebody = person().begin()

    def fail(*_):
        raise RuntimeError("secret detail")

    monkeypatch.setattr("app.questionnaire.flow.upcoming", fail)
    page = somebody.get("/question")
    assert (
        page.status_code == 500
        and "saved are safe" in page.text
        and "secret detail" not in page.text
    )
    assert page.headers["Content-Security-Policy"].startswith("default-src 'none'")
    reply = somebody.http.get("/question", headers={"Accept": "application/json"})
    assert reply.status_code == 500 and "secret" not in reply.text


def test_images_are_served_only_as_their_hash_says(app, study_dir):
    http = app.test_client()
    sha256, image = next(iter(app.extensions["study"].images_by_sha256.items()))
    response = http.get(f"/images/{sha256}")
    assert response.data == image.path.read_bytes() and response.content_type == "image/png"
    assert response.headers["Cache-Control"] == "public, max-age=31536000, immutable"
    assert (
        http.get(
            f"/images/{sha256}", headers={"If-None-Match": response.headers["ETag"]}
        ).status_code
        == 304
    )
    image.path.write_bytes(image.path.read_bytes() + b"more")
    assert http.get(f"/images/{sha256}").status_code == 404


def test_a_clock_that_jumps_costs_nobody_their_place(app, person, monkeypatch):
    """Cookies are signed with a time: one of the future, as a clock that was set back leaves it, is
    as good as any, and one of more than sixty days ago is not.
    """
    now = itsdangerous.timed.time.time()
    clock = SimpleNamespace(time=lambda: now + 3600)
    monkeypatch.setattr("itsdangerous.timed.time", clock)  # what signs
    somebody = person().begin().answer(1)
    clock.time = lambda: now
    back = datetime.fromtimestamp(now - 3600, UTC)
    monkeypatch.setattr("app.questionnaire.flow.now", lambda: back)  # before the consent, too
    assert somebody.answer(2).answers == [1, 2]
    row = somebody.rows[1]
    assert (row.rt_ms, row.rt_server_ms, row.timed_by, row.answered_at) == (
        321,
        321,
        "browser",
        back,
    )
    with somebody.http.session_transaction() as session:
        kept = dict(session)
    for days, path in ((59, "/question"), (61, "/")):
        clock.time = lambda days=days: now - days * 86_400
        cookie = app.session_interface.get_signing_serializer(app).dumps(kept)
        clock.time = lambda: now
        old = person()
        old.http.set_cookie("subdermal", cookie)
        old.get("/question")
        assert old.path == path
