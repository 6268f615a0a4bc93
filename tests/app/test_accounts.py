"""Who may sign in, as what; what is kept of them; what was done and by whom."""

import csv
import io
import json
import re
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
from alembic import command
from alembic.config import Config
from sqlalchemy import delete, select, text, update
from sqlalchemy.exc import DatabaseError
from werkzeug.security import generate_password_hash

from app import accounts, archive, create_app, database, researchers
from app.cli import main
from app.errors import InputError
from app.models import Account, AccountEntry, LogEntry, Participant, SignIn, StudyRecord
from app.researchers import ATTEMPTS, COOKIE
from tests.app.conftest import PASSWORD, Person, researcher

#: That of the application; the tests have a faster one.
HASHER = accounts.HASHER


def kept(app):
    return app.extensions["database"]


def entries(app, table=AccountEntry):
    with kept(app).read() as db:
        rows = db.scalars(select(table).order_by(table.id))
        return [(row.who, row.action, row.detail) for row in rows]


def set_state(somebody, state):
    """Press one of the buttons of the dashboard."""
    form = somebody.form("csrf_token") | {"state": state}
    somebody.page = somebody.http.post("/dashboard/state", data=form, follow_redirects=True)
    return somebody.page


def sign_in(somebody, name, password):
    somebody.get("/dashboard/login")
    return somebody.send("password", name=name, password=password)


def test_a_password_is_kept_as_an_argon2id_hash_alone(app, monkeypatch):
    monkeypatch.setattr(accounts, "HASHER", HASHER)
    with kept(app).write() as db:
        secret = accounts.add_first(db)
        assert accounts.add_first(db) is None
    assert re.fullmatch(r"([a-z2-9]{4}-){3}[a-z2-9]{4}", secret)
    with kept(app).read() as db:
        account = db.scalars(select(Account)).one()
    assert account.password_hash.startswith("$argon2id$v=19$m=19456,t=2,p=1$")
    assert secret not in str(vars(account)) and account.role == "owner"
    assert accounts.verified(account.password_hash, f" {secret}\n")  # pasted
    for wrong in ("", secret[:-1], secret.upper(), "x" * 10_000):
        assert not accounts.verified(account.password_hash, wrong)
    assert not accounts.verified(None, "") and not accounts.verified("nonsense", "")


def test_one_password_in_two_spellings_of_unicode():
    assert accounts.verified(
        accounts.hashed("caffe\u0301 e caffe\u0301"), "caff\u00e9 e caff\u00e9"
    )


def test_without_an_account_nobody_gets_in(person):
    for name, password in (("owner", ""), ("owner", "None"), ("", ""), ("none", "None")):
        assert sign_in(person(), name, password).status_code == 401


def test_names_however_they_are_typed(app, person):
    with kept(app).write() as db:
        accounts.add(db, " Ada@Example.org", "viewer", PASSWORD, who="the test")
    somebody = person()
    sign_in(somebody, "ADA@example.org ", PASSWORD)
    assert somebody.path == "/dashboard/" and "Sign out ada@example.org" in somebody.page.text


def test_names_that_are_none(app):
    for name in ("", "=1+1", "-a", "a b", "a\0", "<b>", "x" * 65, "é"):
        with pytest.raises(InputError, match="expected letters, digits"), kept(app).write() as db:
            accounts.add(db, name, "viewer", PASSWORD, who="the test")


@pytest.mark.parametrize("password", ["", "eleven char", " " * 20, "x" * 1001])
def test_passwords_that_are_too_short_or_too_long(password):
    with pytest.raises(InputError, match="expected 12 to 1000"):
        accounts.hashed(password)


def test_who_is_sent_to_sign_in_comes_back_to_the_page(app, person, experimenter):
    person().begin()
    somebody = person()
    somebody.get("/dashboard/participants/P0001")
    assert somebody.path == "/dashboard/login"
    somebody.send("password", name="owner", password=PASSWORD)
    assert somebody.path == "/dashboard/participants/P0001"
    elsewhere = person().http.get("/dashboard//evil.example/", headers={"Host": "evil.example"})
    assert "evil" not in elsewhere.headers.get("Location", "")


# What a viewer may do.


def posts(app):
    rules = app.url_map.iter_rules()
    return {
        rule.rule.replace("<code>", "P0001")
        for rule in rules
        if "POST" in rule.methods and rule.rule.startswith("/dashboard/")
    }


def test_a_viewer_sees_and_changes_nothing(app, person, viewer):
    person().begin().answer(1)
    before = entries(app, LogEntry)
    seen = viewer.get("/dashboard/").text
    assert "Who may begin" in seen and 'name="state"' not in seen and 'name="quota"' not in seen
    assert 'name="reason"' not in viewer.get("/dashboard/participants/P0001").text
    for name in ("responses.csv", "participants.csv", "export.zip", "live.json", "participants"):
        assert viewer.get(f"/dashboard/{name}").status_code == 200
    assert viewer.get("/dashboard/log").status_code == viewer.get("/dashboard/log.csv").status_code
    assert viewer.page.status_code == 403 and "This is for owners" in viewer.page.text
    viewer.get("/dashboard/")
    form = viewer.form("code") | {"state": "closed", "quota": "1", "minutes": "1", "reason": "x"}
    form |= {"count": "3", "only": "yes", "code": "ABC"}
    looking = {f"/dashboard/{one}" for one in ("completion", "login", "logout", "password")}
    closed = posts(app) - looking
    assert {"/dashboard/state", "/dashboard/links", "/dashboard/participants/P0001"} <= closed
    for path in sorted(closed):
        assert viewer.http.post(path, data=form).status_code == 403, path
    assert "not given by this study" in viewer.send("code", code="ABC").text
    changes = [entry for entry in entries(app, LogEntry) if entry[1] != "download"]
    assert changes == before
    with kept(app).read() as db:
        assert db.get_one(StudyRecord, 1).state == "open"
        assert db.get_one(Participant, 1).excluded_at is None


def test_a_draft_lets_in_owners_and_not_viewers(app, experimenter, viewer):
    experimenter.get("/dashboard/")
    set_state(experimenter, "draft")
    assert viewer.get("/").status_code == 403
    assert experimenter.begin().path == "/question"


def test_a_role_changes_from_the_next_click_on(app, experimenter, viewer):
    with kept(app).write() as db:
        with pytest.raises(InputError, match="owner is the only owner"):
            accounts.set_role(db, accounts.named(db, "owner"), "viewer", who="the test")
        accounts.set_role(db, accounts.named(db, "viewer"), "owner", who="the test")
        accounts.set_role(db, accounts.named(db, "owner"), "viewer", who="the test")
    assert viewer.get("/dashboard/log").status_code == 200
    assert experimenter.get("/dashboard/log").status_code == 403


# Sessions.


def cookie(somebody):
    return somebody.http.get_cookie(COOKIE)


def test_a_sign_in_is_renewed_each_time_and_the_one_before_ends(app, person, experimenter):
    before = cookie(experimenter).value
    tokens = {experimenter.form("csrf_token")["csrf_token"]}
    sign_in_again = experimenter.http.get("/dashboard/login")
    assert sign_in_again.status_code == 303  # who is signed in needs no form
    experimenter.send("csrf_token")  # signs out
    assert experimenter.path == "/dashboard/login" and cookie(experimenter) is None
    experimenter.send("password", name="owner", password=PASSWORD)
    after = cookie(experimenter).value
    assert before != after
    tokens.add(experimenter.form("csrf_token")["csrf_token"])
    assert len(tokens) == 2
    thief = person()
    for value, path in ((before, "/dashboard/login"), (after, "/dashboard/")):
        thief.http.set_cookie(COOKIE, value)
        thief.get("/dashboard/")
        assert thief.path == path
    with kept(app).read() as db:
        stored = [row.token_sha256 for row in db.scalars(select(SignIn))]
    assert len(stored) == 1 and after not in stored


def test_the_cookie_of_a_researcher(app, experimenter):
    for base, secure in (("https://study.example", True), ("http://study.example", False)):
        http = app.test_client()
        page = http.get("/dashboard/login", base_url=base)
        token = re.search(r'name="csrf_token" value="([^"]+)"', page.text)[1]
        data = {"csrf_token": token, "name": "owner", "password": PASSWORD}
        headers = {"Referer": f"{base}/dashboard/login"}
        reply = http.post("/dashboard/login", data=data, base_url=base, headers=headers)
        (made,) = (c for c in reply.headers.getlist("Set-Cookie") if c.startswith(COOKIE))
        assert "HttpOnly" in made and "SameSite=Lax" in made and "Path=/;" in f"{made};"
        assert ("; Secure" in made) == secure
        assert int(re.search(r"Max-Age=(\d+)", made)[1]) == 12 * 3600


def test_cookies_that_somebody_planted_sign_nobody_else_in(app, person, experimenter):
    victim, attacker = person(), person()
    attacker.get("/dashboard/login")
    planted = attacker.http.get_cookie("subdermal").value
    known_token = attacker.form("password")["csrf_token"]
    victim.http.set_cookie("subdermal", planted)
    victim.http.set_cookie(COOKIE, "planted")
    sign_in(victim, "owner", PASSWORD)
    assert victim.path == "/dashboard/" and cookie(victim).value != "planted"
    attacker.http.set_cookie(COOKIE, "planted")
    attacker.get("/dashboard/")
    assert attacker.path == "/dashboard/login"
    # nor does the token against forged forms, which the attacker knows, work any longer
    forged = {"csrf_token": known_token, "state": "closed"}
    assert victim.http.post("/dashboard/state", data=forged).status_code == 400
    with kept(app).read() as db:
        assert db.get_one(StudyRecord, 1).state == "open"


def test_a_form_of_before_the_sign_in_is_refused_where_the_sign_in_was_elsewhere(app, experimenter):
    """Another study of the server knows of the sign-in by its cookie alone."""
    other = Person(app)
    other.get("/withdraw")
    token = other.form("csrf_token")["csrf_token"]
    other.http.set_cookie(COOKIE, cookie(experimenter).value)
    old = {"csrf_token": token, "state": "closed"}
    assert other.http.post("/dashboard/state", data=old).status_code == 400
    other.get("/dashboard/")
    assert set_state(other, "paused").status_code == 200


def test_a_viewer_gives_themself_another_password(app, viewer):
    def change(browser, present, wanted, again=None):
        browser.get("/dashboard/password")
        return browser.send("wanted", present=present, wanted=wanted, again=again or wanted).text

    elsewhere, new = researcher(app, "viewer"), "a new pass phrase"
    assert "not right" in change(viewer, "guessed", new)
    assert "two ways" in change(viewer, PASSWORD, new, "a new pass phrese")
    assert "expected 12 to 1000" in change(viewer, PASSWORD, "short")
    before = entries(app, AccountEntry)
    assert "was changed" in change(viewer, PASSWORD, new) and viewer.path == "/dashboard/"
    assert ("viewer", "password changed", "viewer") in entries(app, AccountEntry)[len(before) :]
    elsewhere.get("/dashboard/")
    assert elsewhere.path == "/dashboard/login"
    assert viewer.get("/dashboard/").status_code == 200 and viewer.path == "/dashboard/"
    other = Person(app)
    for secret, place in ((PASSWORD, "/dashboard/login"), (new, "/dashboard/")):
        other.get("/dashboard/login")
        other.send("password", name="viewer", password=secret)
        assert other.path == place
    for _ in range(ATTEMPTS):
        assert "not right" in change(viewer, "guessed", PASSWORD)
    viewer.get("/dashboard/password")
    assert viewer.send("wanted", present=new, wanted=PASSWORD, again=PASSWORD).status_code == 429


def test_another_password_and_a_removal_end_every_sign_in(app, experimenter, viewer):
    second = researcher(app, "owner")
    with kept(app).write() as db:
        owner = accounts.named(db, "owner")
        accounts.set_password(db, owner, "another password", who="the test")
        accounts.remove(db, accounts.named(db, "viewer"), who="the test")
    for somebody in (experimenter, second, viewer):
        assert somebody.http.get("/dashboard/").headers["Location"] == "/dashboard/login"
    assert sign_in(second, "owner", PASSWORD).status_code == 401
    sign_in(second, "owner", "another password")
    assert second.path == "/dashboard/"
    assert sign_in(viewer, "viewer", PASSWORD).status_code == 401


def test_a_sign_in_ends_by_itself(app, experimenter):
    for later, code in ((accounts.LIFETIME - timedelta(minutes=1), 200), (timedelta(hours=1), 303)):
        with kept(app).write() as db:
            for row in db.scalars(select(SignIn)):
                row.at -= later
        assert experimenter.http.get("/dashboard/").status_code == code
    reply = experimenter.http.get("/dashboard/live.json", headers={"Accept": "application/json"})
    assert reply.status_code == 401


# Guessing.


def test_guesses_lock_nobody_out(app, person, experimenter):
    somebody = person()
    codes = [sign_in(somebody, "owner", "wrong").status_code for _ in range(5)]
    form = somebody.form("password")
    assert codes == [401] * 5
    wrong = form | {"name": "owner", "password": "wrong"}
    assert somebody.http.post("/dashboard/login", data=wrong).status_code == 429
    right = form | {"name": "owner", "password": PASSWORD}
    assert somebody.http.post("/dashboard/login", data=right).status_code == 303


def test_guesses_come_one_at_a_time_and_a_crowd_of_them_is_sent_away(app, person, monkeypatch):
    """Many at once hold up two threads at most; a browser that was signed in has its own line."""
    known = researcher(app, "owner")
    known.send("csrf_token")
    assert known.path == "/dashboard/login"
    looked_at, at_once, most, go_on = [], [], [], threading.Event()
    verified = accounts.verified

    def slowly(stored, password):
        at_once.append(1)
        most.append(len(at_once))
        assert go_on.wait(20)
        at_once.pop()
        looked_at.append(password)
        return verified(stored, password)

    guessers = [person() for _ in range(8)]
    forms = [guesser.get("/dashboard/login") and guesser.form("password") for guesser in guessers]
    for _ in range(researchers.ATTEMPTS):
        app.extensions["doorkeeper"]._attempts.allow("127.0.0.1")
    monkeypatch.setattr(accounts, "verified", slowly)
    with ThreadPoolExecutor(8) as pool:
        replies = [
            pool.submit(
                g.http.post, "/dashboard/login", data=f | {"name": "owner", "password": "x"}
            )
            for g, f in zip(guessers, forms)
        ]
        while sum(reply.done() for reply in replies) < 6:  # all but those in line
            pass
        entering = pool.submit(known.send, "password", name="owner", password=PASSWORD)
        while len(at_once) < 2:  # it does not wait behind them
            pass
        go_on.set()
        entering.result()
        assert {reply.result().status_code for reply in replies} == {429}
    assert known.path == "/dashboard/"
    assert sorted(looked_at) == sorted([PASSWORD, "x", "x"]) and max(most) == 2


def test_a_flood_of_guesses_fills_no_log(app, person):
    somebody = person()
    somebody.get("/dashboard/login")
    form = somebody.form("password") | {"name": "owner", "password": "wrong"}
    for _ in range(30):
        somebody.http.post("/dashboard/login", data=form)
    failures = [entry for entry in entries(app) if entry[1] == "sign-in failed"]
    assert len(failures) == 6 and "many in a row" in failures[-1][2]


def test_a_name_that_is_none_is_hashed_for_too_and_is_not_kept(app, person, monkeypatch):
    """By neither time nor words it says which names there are; what was typed may be a password."""
    asked, verify = [], HASHER.verify
    monkeypatch.setattr(accounts, "HASHER", HASHER)
    monkeypatch.setattr(type(HASHER), "verify", lambda *a: asked.append(a[1]) or verify(*a[1:]))
    accounts._nobody.cache_clear()
    known, unknown = person(), person()
    researcher(app, "owner")
    asked.clear()
    texts = [
        re.sub(r'value="[^"]*"', "", sign_in(one, name, "wrong wrong wrong").text)
        for one, name in ((known, "owner"), (unknown, "my secret"))
    ]
    assert texts[0] == texts[1] and len(asked) == 2
    assert all(one.startswith("$argon2id$v=19$m=19456,t=2,p=1$") for one in asked)
    assert entries(app)[-1] == ("?", "sign-in failed", "there is no such name")
    assert "secret" not in str(entries(app))


# The log.


def test_who_did_what_is_in_the_log(app, person, experimenter, viewer):
    person().begin()
    experimenter.get("/dashboard/")
    set_state(experimenter, "paused")
    experimenter.send("count", count="2", label="class 3")
    experimenter.get("/dashboard/participants/P0001")
    experimenter.send("reason", reason="<script>alert(1)</script>")
    experimenter.send("reason", reason="=1+1")
    viewer.get("/dashboard/responses.csv")
    sign_in(person(), "viewer", "wrong")
    assert entries(app, LogEntry) == [
        ("owner", "state", "open to paused"),
        ("owner", "links", "2 made: class 3"),
        ("owner", "exclude", "P0001: <script>alert(1)</script>"),
        ("owner", "restore", "P0001: =1+1"),
        ("viewer", "download", "responses.csv, 0 answers"),
    ]
    page = experimenter.get("/dashboard/log").text
    assert "alert(1)" in page and "<script>alert" not in page
    shown = re.findall(r">([\w -]+)</td><td><strong>([\w -]+)</strong>", page)
    assert shown[:3] == [
        ("viewer", "sign-in failed"),
        ("viewer", "download"),
        ("owner", "restore"),
    ]
    assert len(shown) == 10
    rows = list(csv.DictReader(io.StringIO(experimenter.get("/dashboard/log.csv").text)))
    assert [(row["who"], row["action"]) for row in reversed(rows)] == shown
    assert rows[0]["who"] == "the test" and not rows[-3]["detail"].startswith("=")


def test_the_log_is_paged(app, experimenter, monkeypatch):
    monkeypatch.setattr("app.dashboard.views.ENTRIES", 3)
    experimenter.get("/dashboard/")
    for state in ("paused", "open", "pilot", "draft"):
        set_state(experimenter, state)
        experimenter.get("/dashboard/")
    seen, page = [], experimenter.get("/dashboard/log")
    while True:
        seen += re.findall(r"</strong> ([^<]*)</td>", page.text)
        more = re.search(r'href="([^"]+before=[^"]+)"', page.text)
        if not more:
            break
        page = experimenter.get(more[1].replace("&amp;", "&"))
    assert seen[:4] == ["pilot to draft", "open to pilot", "paused to open", "open to paused"]
    assert seen[4:] == ["owner", "owner, owner"]
    for wrong in ("before=", "before=x", "other=1", "before=9"):
        assert experimenter.get(f"/dashboard/log?{wrong}").status_code == 400


@pytest.mark.parametrize("table", [LogEntry, AccountEntry])
def test_the_database_refuses_to_change_the_log(app, experimenter, table):
    experimenter.get("/dashboard/")
    set_state(experimenter, "paused")
    before = entries(app, table)
    changes = [
        delete(table),
        update(table).values(who="nobody"),
        delete(table).where(table.id == 1),
    ]
    for change in changes:
        with pytest.raises(DatabaseError, match="only ever appended"), kept(app).write() as db:
            db.execute(change)
    assert before and entries(app, table) == before


def test_a_download_that_the_log_cannot_keep_is_not_handed_out(app, person, experimenter):
    person().begin().answer(1)
    refuse = "CREATE TRIGGER full BEFORE INSERT ON log BEGIN SELECT RAISE(ABORT, 'disk full'); END"
    with kept(app).write() as db:
        if db.bind.dialect.name != "sqlite":
            pytest.skip("a trigger of SQLite")
        db.execute(text(refuse))
    reply = experimenter.http.get("/dashboard/responses.csv")
    assert reply.status_code == 500 and b"P0001" not in reply.data


# The command.


def run(*arguments):
    return main(["account", *map(str, arguments)])


@pytest.mark.sqlite
def test_the_command(study_dir, person, app, capsys, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_PASSWORD", PASSWORD)
    assert run("add", study_dir, "ada", "--role", "owner") == 0
    assert run("add", study_dir, "bob") == 0
    monkeypatch.delenv("SUBDERMAL_PASSWORD")
    assert PASSWORD not in capsys.readouterr().out
    somebody = person()
    sign_in(somebody, "bob", PASSWORD)
    assert somebody.path == "/dashboard/"
    assert run("list", study_dir) == 0
    shown = [line.split("\t") for line in capsys.readouterr().out.splitlines()]
    assert [(line[0], line[1], line[3] == "never") for line in shown] == [
        ("ada", "owner", True),
        ("bob", "viewer", False),
    ]
    assert run("password", study_dir, "bob", "--generate") == 0
    made = re.search(r"password  (\S+) ", capsys.readouterr().out)[1]
    assert sign_in(somebody, "bob", PASSWORD).status_code == 401
    sign_in(somebody, "bob", made)
    assert run("role", study_dir, "bob", "owner") == 0
    assert somebody.get("/dashboard/log").status_code == 200
    assert run("remove", study_dir, "bob") == 0
    assert somebody.http.get("/dashboard/").status_code == 303
    capsys.readouterr()
    assert main(["log", str(study_dir)]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [(row["who"], row["action"], row["detail"]) for row in rows] == [
        ("command line", "account added", "ada, owner"),
        ("command line", "account added", "bob, viewer"),
        ("bob", "signed in", "viewer"),
        ("command line", "password changed", "bob"),
        ("bob", "sign-in failed", ""),
        ("bob", "signed in", "viewer"),
        ("command line", "role changed", "bob: viewer to owner"),
        ("command line", "account removed", "bob, owner"),
    ]


REFUSED = [
    (["add", "ada"], PASSWORD, "there is an account 'ada' already"),
    (["add", "ADA", "--role", "owner"], PASSWORD, "there is an account 'ada' already"),
    (["add", "=x"], PASSWORD, "the name is '=x'; expected"),
    (["add", "bob"], "short", "the password has 5 characters; expected 12 to 1000"),
    (["add", "bob"], None, "there is no terminal to ask for the password at"),
    (["add", "bob", "--role", "boss"], PASSWORD, "'boss' is not one of 'owner', 'viewer'"),
    (["password", "bob"], PASSWORD, "there is no account 'bob'; expected one of ada"),
    (["remove", "bob"], PASSWORD, "there is no account 'bob'; expected one of ada"),
    (["remove", "ada"], PASSWORD, "ada is the only owner; make another one first"),
    (["role", "ada", "viewer"], PASSWORD, "ada is the only owner; make another one first"),
]


@pytest.mark.sqlite
def test_what_the_command_refuses(study_dir, app, capsys, monkeypatch):
    with kept(app).write() as db:
        accounts.add(db, "ada", "owner", PASSWORD, who="the test")
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    for (verb, name, *rest), given, says in REFUSED:
        if given is None:
            monkeypatch.delenv("SUBDERMAL_PASSWORD")
        else:
            monkeypatch.setenv("SUBDERMAL_PASSWORD", given)
        assert run(verb, study_dir, name, *rest) == 2
        told = capsys.readouterr().err
        assert says in told and told.count("\n") == 1, told
    with kept(app).read() as db:
        assert [account.name for account in db.scalars(select(Account))] == ["ada"]


# What was there before.


@pytest.mark.sqlite
def test_the_password_of_before_is_that_of_the_owner(study_dir, monkeypatch):
    """A database of before there were accounts, with a hash as it was made then."""
    file, secret = study_dir / "study.sqlite3", "abcd-efgh-jkmn-pqrs"
    config = Config()
    config.set_main_option("script_location", f"{archive.__file__.rsplit('/', 1)[0]}/migrations")
    engine = database.connect(f"sqlite:///{file}")
    with engine.connect() as connection:
        config.attributes["connection"] = connection.execution_options(writes=True)
        command.upgrade(config, "0016")
    engine.dispose()
    design = (
        create_app(study_dir, f"sqlite:///{study_dir}/other.sqlite3").extensions["study"].design
    )
    with sqlite3.connect(file) as db:
        db.execute(
            "INSERT INTO study (id, kind, name, version, seed, design, secret_key, password_hash, "
            "state, reservation_minutes, links_only, created_at) VALUES "
            "(1, 'real', 'ready-made', 1, 7, ?, 'k', ?, 'open', 120, 0, '2026-01-02 03:04:05')",
            [design, generate_password_hash(secret, method="scrypt")],
        )
        db.execute(
            "INSERT INTO log (at, action, detail) VALUES ('2026-01-02 03:04:05', 'state', 'x')"
        )
    app = create_app(study_dir)
    with kept(app).write() as db:
        assert accounts.add_first(db) is None
    owner = Person(app)
    assert sign_in(owner, "owner", "wrong").status_code == 401
    sign_in(owner, "owner", secret)
    assert owner.path == "/dashboard/"
    with kept(app).read() as db:
        account = db.scalars(select(Account)).one()
    assert account.password_hash.startswith("$argon2id$") and account.made_at.year == 2026
    assert entries(app, LogEntry)[0] == (None, "state", "x")
    assert "2026-01-02T03:04:05+00:00,?,state,x" in owner.get("/dashboard/log.csv").text


def test_no_account_is_in_an_archive_and_an_old_one_is_read(app, study_dir, experimenter, tmp_path):
    from zipfile import ZipFile

    file = tmp_path / "study.zip"
    archive.write(file, app.extensions["study"], kept(app))
    with ZipFile(file) as made:
        names = made.namelist()
        everything = b"".join(made.read(name) for name in names)
    assert not {f"tables/{table.name}.jsonl" for table in archive.OF_THE_SERVER} & set(names)
    assert b"argon2" not in everything
    _with_old_hash(file)
    archive.read(file, tmp_path / "again", f"sqlite:///{tmp_path}/again.sqlite3")
    again = create_app(tmp_path / "again", f"sqlite:///{tmp_path}/again.sqlite3")
    with kept(again).write() as db:
        assert accounts.add_first(db)  # who restores it is shown a password


def _with_old_hash(file):
    """The archive as a release of before accounts wrote it."""
    import hashlib
    from zipfile import ZipFile

    with ZipFile(file) as made:
        members = {name: made.read(name) for name in made.namelist()}
    row = json.loads(members["tables/study.jsonl"]) | {"password_hash": "scrypt:32768:8:1$a$b"}
    members["tables/study.jsonl"] = json.dumps(row).encode() + b"\n"
    about = json.loads(members["archive.json"])
    about["tables"]["study"]["sha256"] = hashlib.sha256(members["tables/study.jsonl"]).hexdigest()
    members["archive.json"] = json.dumps(about).encode()
    with ZipFile(file, "w") as made:
        for name, content in members.items():
            made.writestr(name, content)
