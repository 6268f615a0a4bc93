"""Several studies on one server: each for itself, one sign-in for all."""

import json
import random
import re
from urllib.parse import urlsplit

import pytest
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from werkzeug.test import Client

from app import accounts, create_app, hosting
from app.errors import InputError
from app.models import AccountEntry, LogEntry, Participant, Response, StudyRecord
from app.researchers import COOKIE
from tests.app.conftest import PASSWORD, Person

RECRUITING = {
    "parameters": ["PID"],
    "required": False,
    "completed": "https://panel.example/done?who={PID}",
}


class Visitor(Person):
    """A browser that goes from study to study of a server."""

    def __init__(self, server):
        self.http, self.page = Client(server.application), None

    @property
    def path(self):
        return urlsplit(self.page.request.url).path

    def begin(self, root=""):
        self.get(f"{root}/")
        self.send("consent", consent="yes")
        self.send("familiarity", familiarity=3)
        assert self.path == f"{root}/question"
        return self

    def sign_in(self, name="owner", root=""):
        self.get(f"{root}/dashboard/login")
        self.send("password", name=name, password=PASSWORD)
        return self


class Server:
    def __init__(self, *places, databases=()):
        settings = {"enrolments": 0}
        self.application, self.hosted = hosting.assemble(places, dict(databases), **settings)
        self.first, self.second = (one.app for one in self.hosted)
        for app in (self.first, self.second):
            app.config["LIVE_PERIOD_S"] = 0
        with kept(self.first).write() as db:
            if not accounts.find(db, "owner"):
                accounts.add(db, "owner", "owner", PASSWORD, who="the test")
                accounts.add(db, "viewer", "viewer", PASSWORD, who="the test")


def kept(app):
    return app.extensions["database"]


@pytest.fixture
def folders(tmp_path, write_study):
    return (
        write_study(tmp_path / "a", name="faces", title="Faces"),
        write_study(
            tmp_path / "b", size=(48, 36), name="hands", title="Hands", recruiting=RECRUITING
        ),
    )


@pytest.fixture
def server(folders, app):
    """Faces at the root, hands beside it (`app` for the fast settings of tests alone)."""
    return Server((None, folders[0]), (None, folders[1]))


def answers(app):
    with kept(app).read() as db:
        return list(db.scalars(select(Response.answer).order_by(Response.id)))


def test_the_first_stands_where_it_stood_alone_and_the_others_beside_it(server):
    visitor = Visitor(server)
    assert "<title>" in visitor.get("/").text and "Faces" in visitor.page.text
    assert "Hands" in visitor.get("/s/hands/").text and "Faces" not in visitor.page.text
    assert visitor.get("/s/hands").status_code == 200
    assert visitor.get("/s/other/").status_code == visitor.get("/s/").status_code == 404
    # /s/NAME/ leads to the first too, with what a link said, and nowhere else
    for path, place in (
        ("/s/faces/", "/"),
        ("/s/faces/resume/AB%20C", "/resume/AB%20C"),
        ("/s/faces/?link=ABC&PID=a%26b", "/?link=ABC&PID=a%26b"),
        ("/s/faces//evil.example/", "/evil.example/"),
        ("/s/faces/\\evil.example", "/%5Cevil.example"),
        ("/s/faces/%0d%0aSet-Cookie:a=b", "/%0D%0ASet-Cookie%3Aa%3Db"),
    ):
        moved = visitor.http.get(path, headers={"Host": "evil.example"})
        assert (moved.status_code, moved.headers["Location"]) == (308, place)
    for path in ("/s/hands/question", "/s/hands/dashboard/"):
        moved = visitor.http.get(path, headers={"Host": "evil.example"})
        assert moved.headers["Location"].startswith("/s/hands/")


def test_one_browser_takes_part_in_both_and_neither_knows_of_the_other(server):
    visitor = Visitor(server)
    visitor.begin().answer(2, 2)
    visitor.begin("/s/hands").answer(-1)
    visitor.get("/question")
    visitor.answer(1)
    assert (answers(server.first), answers(server.second)) == ([2, 2, 1], [-1])
    names = {c.decoded_key: c.path for c in visitor.http._cookies.values()}
    assert names == {"subdermal": "/", "subdermal_s_hands": "/s/hands"}
    visitor.get("/s/hands/withdraw")
    visitor.send("confirm", confirm="yes")
    assert visitor.path == "/s/hands/withdrawn"
    assert visitor.get("/question").status_code == 200 and visitor.path == "/question"
    with kept(server.first).read() as db:
        assert db.get_one(Participant, 1).withdrawn_at is None


def test_what_one_study_gave_opens_nothing_in_another(server):
    one, two = Visitor(server).begin(), Visitor(server).begin("/s/hands")
    two.answer(1)
    with kept(server.first).read() as db:
        first = db.get_one(Participant, 1)
        visit, resume = first.visit, first.resume_code
    # cookies, whatever their name and place
    value = one.http.get_cookie("subdermal").value
    thief = Visitor(server)
    for name in ("subdermal", "subdermal_s_hands"):
        thief.http.set_cookie(name, value, path="/s/hands")
    thief.get("/s/hands/question")
    assert thief.path == "/s/hands/"
    # tokens against forged forms, with the cookies of both studies
    both = Visitor(server).begin().begin("/s/hands")
    token = both.get("/question") and both.form("trial")["csrf_token"]
    both.get("/s/hands/question")
    form = both.form("trial") | {"answer": "2", "csrf_token": token}
    assert both.http.post("/s/hands/question", data=form).status_code == 400
    # codes and keys
    other = Visitor(server)
    other.get("/s/hands/resume/")
    assert "Nobody was given this code" in other.send("resume", resume=resume).text
    one.answer(*[0] * 30)
    key = re.search(r'id="withdrawal-key">(\w+)<', one.page.text)[1]
    code = re.search(r'id="completion-code">(\w+)<', one.page.text)[1]
    other.get("/s/hands/withdraw")
    assert "No participant was given this key" in other.send("code", code=key, confirm="yes").text
    owner = Visitor(server).sign_in()
    owner.get("/s/hands/dashboard/")
    assert "not given by this study" in owner.send("code", code=code).text
    # images
    sha256 = next(iter(server.first.extensions["study"].images_by_sha256))
    assert other.get(f"/images/{sha256}").status_code == 200
    assert other.get(f"/s/hands/images/{sha256}").status_code == 404
    assert answers(server.second) == [1]
    with kept(server.second).read() as db:
        assert visit not in db.scalars(select(Participant.visit)).all()


def test_a_link_of_one_study_is_for_it_alone_and_recruiters_get_their_own_back(server):
    owner = Visitor(server).sign_in()
    owner.get("/dashboard/")
    owner.send("count", count="1")
    assert "behind /?link=" in owner.page.text
    owner.get("/s/hands/dashboard/")
    owner.send("count", count="1")
    assert "behind /s/hands/?link=" in owner.page.text
    token = owner.get("/dashboard/links.csv").text.splitlines()[1].split(",")[0]
    owner.get("/s/hands/dashboard/")
    form = owner.form("count") | {"only": "yes"}
    owner.http.post("/s/hands/dashboard/links", data=form)
    assert Visitor(server).get(f"/s/hands/?link={token}").status_code == 403
    assert Visitor(server).get(f"/?link={token}").status_code == 200
    form["only"] = "no"
    owner.http.post("/s/hands/dashboard/links", data=form)
    paid = Visitor(server)
    paid.get("/s/hands/?PID=one")
    paid.begin("/s/hands").answer(*[1] * 30)
    assert 'href="https://panel.example/done?who=one"' in paid.page.text


def test_one_sign_in_is_for_all_and_ends_in_all(server):
    owner, viewer = Visitor(server), Visitor(server)
    owner.get("/s/hands/dashboard/")
    assert owner.path == "/s/hands/dashboard/login"
    owner.send("password", name="owner", password=PASSWORD)
    assert owner.path == "/s/hands/dashboard/"  # where it was asked for
    assert owner.http.get_cookie(COOKIE, path="/")
    assert "Faces" in owner.get("/dashboard/").text and "All studies" in owner.page.text
    viewer.sign_in("viewer")
    assert viewer.path == "/dashboard/studies"
    for root in ("", "/s/hands"):
        viewer.get(f"{root}/dashboard/")
        form = viewer.form("code") | {"state": "closed"}
        assert viewer.http.post(f"{root}/dashboard/state", data=form).status_code == 403
        assert viewer.get(f"{root}/dashboard/log").status_code == 403
    owner.get("/s/hands/dashboard/")
    owner.http.post("/s/hands/dashboard/logout", data=owner.form("csrf_token"))
    for root in ("", "/s/hands"):
        owner.get(f"{root}/dashboard/")
        assert owner.path == f"{root}/dashboard/login"
    with kept(server.second).read() as db:  # nothing of accounts is there
        assert db.scalars(select(AccountEntry)).all() == []


def test_a_token_of_one_dashboard_forges_nothing_in_another(server):
    owner = Visitor(server).sign_in()
    owner.get("/dashboard/")
    token = owner.form("code")["csrf_token"]
    owner.get("/s/hands/dashboard/")
    own = owner.form("code")["csrf_token"]
    assert own != token
    forged = {"csrf_token": token, "state": "closed"}
    assert owner.http.post("/s/hands/dashboard/state", data=forged).status_code == 400
    assert owner.http.post("/s/hands/dashboard/state", data={"state": "closed"}).status_code == 400
    right = {"csrf_token": own, "state": "closed"}
    assert owner.http.post("/s/hands/dashboard/state", data=right).status_code == 303
    # each has a state, a quota and a log of its own
    with kept(server.first).read() as one, kept(server.second).read() as two:
        assert (one.get(StudyRecord, 1).state, two.get(StudyRecord, 1).state) == ("open", "closed")
        assert one.scalars(select(LogEntry)).all() == []
        (entry,) = two.scalars(select(LogEntry)).all()
    assert (entry.who, entry.detail) == ("owner", "open to closed")
    assert Visitor(server).get("/").status_code == 200
    assert Visitor(server).get("/s/hands/").status_code == 403
    log = owner.get("/s/hands/dashboard/log").text
    assert "open to closed" in log and "signed in" in log
    log = owner.get("/dashboard/log").text
    assert "open to closed" not in log and "signed in" in log


def test_people_of_one_study_cannot_be_judged_by_another(server):
    Visitor(server).begin()
    owner = Visitor(server).sign_in()
    assert owner.get("/dashboard/participants/P0001").status_code == 200
    assert owner.get("/s/hands/dashboard/participants/P0001").status_code == 404
    owner.get("/s/hands/dashboard/")
    form = owner.form("code") | {"reason": "no", "note": "no"}
    for path in ("", "/notes"):
        judged = owner.http.post(f"/s/hands/dashboard/participants/P0001{path}", data=form)
        assert judged.status_code == 404
    with kept(server.first).read() as db:
        assert db.get_one(Participant, 1).excluded_at is None
    owner.http.post("/s/hands/dashboard/notes", data=form | {"note": "of hands"})
    assert "of hands" in owner.get("/s/hands/dashboard/notes").text
    assert "of hands" not in owner.get("/dashboard/notes").text


def test_the_index_says_how_each_study_stands(server):
    Visitor(server).begin().answer(*[1] * 30)
    Visitor(server).begin("/s/hands").answer(1)
    stranger = Visitor(server)
    stranger.get("/dashboard/studies")
    assert stranger.path == "/dashboard/login"
    owner = Visitor(server).sign_in("viewer")
    owner.get("/s/hands/dashboard/studies")
    rows = re.findall(r"<tr>\s*<th scope=\"row\".*?</tr>", owner.page.text, re.S)
    assert [re.search(r">([^<>\s]+)</a>", row)[1] for row in rows] == ["Faces", "Hands"]
    numbers = [re.findall(r'class="number">(\w+)<', row) for row in rows]
    assert numbers == [["1", "1", "any", "30"], ["1", "0", "any", "1"]]
    assert [re.findall(r'href="([^"]+)"', row) for row in rows] == [
        ["/dashboard/", "/"],
        ["/s/hands/dashboard/", "/s/hands/"],
    ]


def test_what_people_saw_is_frozen_in_each(folders, server):
    Visitor(server).begin("/s/hands")
    manifest = folders[1] / "manifest.json"
    before = manifest.read_text()
    study = json.loads(before)
    study["study"]["title"] = "Other hands"
    manifest.write_text(json.dumps(study))
    for app in (server.first, server.second):
        kept(app).close()
    places = [(None, folder) for folder in folders]
    with pytest.raises(InputError, match="participants saw another study: title was 'Hands'"):
        Server(*places)
    # the other one is not held by it, and may change: nobody has begun
    study = json.loads((folders[0] / "manifest.json").read_text())
    study["study"]["title"] = "More faces"
    (folders[0] / "manifest.json").write_text(json.dumps(study))
    manifest.write_text(before)
    assert "More faces" in Visitor(Server(*places)).get("/").text


def test_a_new_version_stands_beside_the_old_one(tmp_path, write_study, folders, app):
    new = write_study(tmp_path / "new", name="faces", version=2, title="New faces")
    with pytest.raises(
        InputError, match=r"two studies are called faces, .*/a and .*/new; give"
    ) as e:
        Server((None, folders[0]), (None, new))
    assert f"faces-2={new}" in str(e.value) and "\n" not in str(e.value)
    server = Server((None, folders[0]), ("faces-2", new))
    assert "New faces" in Visitor(server).get("/s/faces-2/").text
    Visitor(server).begin("/s/faces-2").answer(1)
    assert (answers(server.first), answers(server.second)) == ([], [1])


@pytest.mark.sqlite
def test_each_study_has_a_database_of_its_own(folders, tmp_path, app):
    places, other = [(None, folder) for folder in folders], f"sqlite:///{tmp_path}/other.sqlite3"
    server = Server(*places, databases={"hands": other})
    Visitor(server).begin("/s/hands").answer(2)
    assert (tmp_path / "other.sqlite3").is_file() and not (folders[1] / "study.sqlite3").exists()
    with pytest.raises(InputError, match="holds answers of another study: name is 'hands'"):
        Server(*places, databases={"faces": other, "hands": other})
    for wrong in ({None: other}, {"feet": other}):
        with pytest.raises(InputError, match="expected NAME=URL, with one of faces, hands"):
            Server(*places, databases=wrong)


def test_names_of_places():
    assert hosting.named("faces-2=/srv/a=b") == ("faces-2", "/srv/a=b")
    assert hosting.named("/srv/a=b") == (None, "/srv/a=b")
    assert hosting.named("postgresql://h/db?a=b") == (None, "postgresql://h/db?a=b")
    assert hosting.named("a=postgresql://h/db?a=b") == ("a", "postgresql://h/db?a=b")


def test_simulated_people_of_each(folders, app):
    for folder in folders:
        (folder / "simulated.sqlite3").touch()
        kept(create_app(folder, simulated=True)).close()
    server = Server((None, folders[0]), (None, folders[1]))
    owner = Visitor(server).sign_in()
    for root, title in (("/simulated", "Faces"), ("/s/hands/simulated", "Hands")):
        page = owner.get(f"{root}/dashboard/").text
        assert "<title>SIMULATED" in page and title in page
    assert owner.get("/dashboard/studies").text.count("simulated</a>") == 2
    assert owner.http.get_cookie("subdermal_simulated_s_hands", path="/s/hands/simulated")


def test_health_is_that_of_all(server, monkeypatch):
    assert Visitor(server).get("/health").json == {"status": "ok"}
    second, read = kept(server.second), type(kept(server.second)).read

    def failing(self):
        if self is second:
            raise OperationalError("SELECT", {}, Exception("secret address"))
        return read(self)

    monkeypatch.setattr(type(second), "read", failing)
    for path in ("/health", "/s/hands/health"):
        reply = Visitor(server).get(path)
        assert (reply.status_code, reply.json) == (503, {"status": "no database"})


PARTS = ("s", "S", "faces", "hands", "simulated", "dashboard", "question", "static", "images", "")
ODD = (
    "..",
    ".",
    "%2e%2e",
    "%2f",
    "%00",
    "%ff",
    "\\",
    "//evil.example",
    "é",
    "a" * 3000,
    "?",
    "#",
    ";",
)


@pytest.mark.parametrize("who", ["stranger", "owner"])
def test_no_address_of_the_server_fails_or_leads_elsewhere(server, who):
    """What stands before the studies: which of them an address belongs to."""
    draw, visitor = random.Random(who), Visitor(server)
    if who == "owner":
        visitor.sign_in()
    for _ in range(300):
        parts = [draw.choice(draw.choice((PARTS, ODD))) for _ in range(draw.randint(1, 5))]
        path, query = (
            "/" + "/".join(parts),
            draw.choice(("", "?link=%0d%0aX", "?\u0301=1", "?" * 9)),
        )
        method = draw.choice(("GET", "GET", "POST", "PUT", "HEAD", "OPTIONS"))
        reply = visitor.http.open(path + query, method=method, headers={"Host": "evil.example"})
        asked = f"{method} {path[:99]!r}{query}: {reply.status}"
        assert reply.status_code < 500, asked
        place = reply.headers.get("Location", "/")
        assert place.startswith("/") and not place.startswith(("//", "/\\")), (asked, place)
        assert "\n" not in place and "X" not in reply.headers, asked
