"""`subdermal serve` as a process: what it prints, what it refuses, what survives when it is
killed.
"""

import os
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import httpx
import pytest

from app import create_app
from app.cli import main
from app.server import Limits

pytestmark = (
    pytest.mark.sqlite
)  # processes of their own, which know nothing of the tests' databases
LINES = {"questionnaire": r"questionnaire\s+(\S+)", "password": r"password\s+(\S+)"}


class Server:
    """A `subdermal serve` on a free port, in a process of its own."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-m", "app.cli", "serve", *map(str, arguments), "--port", "0"],
            stdout=subprocess.PIPE,
            text=True,
        )
        self.printed = ""
        for line in self.process.stdout:
            self.printed += line
            if line.startswith("Ctrl+C"):
                break
        self.url = self.find("questionnaire")

    def find(self, what):
        found = re.search(LINES[what], self.printed)
        return found and found[1]

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


@pytest.fixture
def serve():
    servers = []

    def start(*arguments):
        servers.append(Server(*arguments))
        return servers[-1]

    yield start
    for server in servers:
        server.kill()
        server.process.stdout.close()


def token(page):
    return re.search(r'name="csrf_token" value="([^"]+)"', page.text)[1]


def log_in(http, url, secret, name="owner"):
    page = http.get(f"{url}dashboard/login")
    return http.post(
        f"{url}dashboard/login",
        data={"csrf_token": token(page), "name": name, "password": secret},
    ).url.path


def test_killed_between_an_answer_and_the_next_page_nothing_is_lost(study_dir, serve):
    server = serve(study_dir)
    with httpx.Client(follow_redirects=True) as http:
        page = http.get(server.url)
        page = http.post(server.url, data={"csrf_token": token(page), "consent": "yes"})
        page = http.post(
            f"{server.url}familiarity", data={"csrf_token": token(page), "familiarity": "3"}
        )
        fields = dict(
            re.findall(
                r'name="(csrf_token|trial|image_left|image_right)" value="([^"]+)"', page.text
            )
        )
        acknowledged = http.post(
            f"{server.url}question",
            data=fields | {"answer": "2"},
            headers={"Accept": "application/json"},
        )
        assert acknowledged.json()["outcome"] == "recorded"
        server.kill()  # no next page was asked for

        again = serve(study_dir)
        assert again.find("password") is None  # it was shown at the first start
        page = http.get(f"{again.url}question")  # cookies know no ports: the same browser
        assert "Question 2 <span>" in page.text
        repeated = http.post(
            f"{again.url}question",
            data=fields | {"answer": "2"},
            headers={"Accept": "application/json"},
        )
        assert repeated.json()["outcome"] == "repeated"


def test_a_thousand_idle_and_a_hundred_slow_visitors_stop_nobody(study_dir, serve):
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, most), most))
    server = serve(study_dir, "--workers", 2)
    address = "127.0.0.1", int(server.url.split(":")[-1].strip("/"))
    head = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    begun = [b""] * 1000 + [head] * 50 + [head + b"Content-Length: 9000\r\n\r\nconsent="] * 50
    with ExitStack() as opened:
        for sent in begun:
            opened.enter_context(socket.create_connection(address)).sendall(sent)
        with httpx.Client(follow_redirects=True, timeout=20) as http:
            page = http.get(server.url)
            page = http.post(server.url, data={"csrf_token": token(page), "consent": "yes"})
            assert page.url.path == "/familiarity"
            # far more than a page of ours sends is refused before it is read
            large = http.post(server.url, content=b"x" * 400_000)
            assert large.status_code == 413


def test_a_worker_that_is_killed_is_replaced_and_none_outlives_the_server(study_dir, serve):
    server = serve(study_dir, "--workers", 2)

    def workers():
        main = server.process.pid
        return set(Path(f"/proc/{main}/task/{main}/children").read_text().split())

    while len(before := workers()) < 2:  # the address is printed before they begin
        time.sleep(0.02)
    os.kill(int(min(before)), signal.SIGKILL)
    while len(now := workers()) < 2 or now == before:
        time.sleep(0.02)
    assert httpx.get(server.url).status_code == 200
    server.kill()
    with pytest.raises(httpx.ConnectError):
        for _ in range(500):
            with suppress(httpx.ReadError):  # it ends while it is asked
                httpx.get(server.url, timeout=20)
            time.sleep(0.02)


def test_a_connection_on_which_nothing_happens_is_closed_after_the_time_that_is_set(
    study_dir, serve
):
    server = serve(study_dir, "--workers", 1, "--idle", 1)
    address = "127.0.0.1", int(server.url.split(":")[-1].strip("/"))
    with socket.create_connection(address, timeout=60) as silent:
        began = time.monotonic()
        assert silent.recv(1) == b"" and time.monotonic() - began >= 1


@pytest.mark.parametrize("name", ["threads", "connections", "idle_s", "grace_s"])
def test_limits_are_whole_numbers_from_one(name):
    for wrong in (0, -1, 1.5, "8", True):
        with pytest.raises(ValueError, match=f"{name} is .*; expected a whole number from 1"):
            Limits(**{name: wrong})


def test_told_to_end_it_ends_its_workers(study_dir, serve):
    server = serve(study_dir, "--workers", 2)
    assert httpx.get(server.url).status_code == 200
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(timeout=20) == 0
    with pytest.raises(httpx.ConnectError):
        httpx.get(server.url)


def test_the_password_is_shown_once_and_one_sign_in_opens_both_dashboards(study_dir, serve):
    create_app(study_dir, simulated=True)
    server = serve(study_dir)
    secret = server.find("password")
    with httpx.Client(follow_redirects=True) as http:
        assert log_in(http, server.url, secret) == "/dashboard/"
        assert "<title>SIMULATED" in http.get(f"{server.url}simulated/dashboard/").text
        assert "SIMULATED" not in http.get(f"{server.url}dashboard/").text
        assert "server" not in http.get(server.url).headers
        server.kill()
        new = serve(study_dir, "--workers", 2)
        assert new.find("password") is None
        main(["account", "password", str(study_dir), "owner", "--generate"])
        ended = [http.get(f"{new.url}{at}dashboard/").url.path for at in ("", "simulated/")]
        assert ended == ["/dashboard/login", "/simulated/dashboard/login"]
        assert log_in(http, new.url, secret) == "/dashboard/login"


def test_options_stand_in_a_file_or_in_the_environment(study_dir, tmp_path, serve, monkeypatch):
    (tmp_path / "serve.toml").write_text('trusted-host = ["study.example"]\nworkers = 1\n')
    monkeypatch.setenv("SUBDERMAL_SERVE_METRICS_TOKEN", "of-the-environment")
    server = serve(study_dir, "--config", tmp_path / "serve.toml")
    headers = {"Host": "study.example", "Authorization": "Bearer of-the-environment"}
    assert httpx.get(f"{server.url}metrics", headers=headers).status_code == 200
    assert httpx.get(server.url).status_code == 400
    assert "of-the-environment" not in server.printed


def test_without_a_simulation_there_is_no_simulated_study(study_dir, serve):
    server = serve(study_dir)
    assert "simulated" not in server.printed
    assert httpx.get(f"{server.url}simulated/").status_code == 404


def test_what_cannot_be_served_gets_one_line(study_dir, tmp_path, capsys):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("prot = 80\n")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        failures = [
            ([study_dir, "--port", taken.getsockname()[1]], "Address already in use"),
            ([study_dir, "--host", "203.0.113.1", "--port", 0], "cannot listen on 203.0.113.1"),
            ([tmp_path], "manifest.json"),
            ([tmp_path / "nothing"], "manifest.json"),
            ([study_dir, "--database", "nonsense"], "expected an SQLAlchemy URL"),
            ([study_dir, "--database", "a=sqlite://"], "expected NAME=URL, with one of ready-made"),
            ([study_dir, "--database", "a", "--database", "b"], "expected one of each study"),
            ([study_dir, study_dir], "two studies are called ready-made"),
            ([], "Missing argument 'DIR...'"),
            ([study_dir / "manifest.json"], "is a file; expected a folder"),
            ([study_dir, "--port", "seven"], "'seven' is not a valid integer"),
            ([study_dir, "--config", wrong], "prot is no option; expected connections"),
            ([study_dir, "--config", study_dir / "manifest.json"], "is no TOML"),
        ]
        for arguments, says in failures:
            assert main(["serve", *map(str, arguments)]) == 2
            err = capsys.readouterr().err
            assert says in err and err.count("\n") == 1, err


def test_a_busy_port_does_not_use_up_the_password(study_dir, serve):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert main(["serve", str(study_dir), "--port", str(taken.getsockname()[1])]) == 2
    assert serve(study_dir).find("password")


def test_behind_a_proxy_that_ends_https_the_cookie_is_for_https_only(study_dir, serve):
    server = serve(study_dir, "--trusted-proxy", "127.0.0.1")
    forwarded = {"X-Forwarded-Proto": "https", "X-Forwarded-Host": "study.example"}
    page = httpx.get(server.url, headers=forwarded)
    cookie = page.headers["Set-Cookie"]
    assert "; Secure" in cookie and "; Secure" not in httpx.get(server.url).headers["Set-Cookie"]
    headers = forwarded | {"Cookie": cookie.split(";")[0]}
    data = {"csrf_token": token(page), "consent": "yes"}
    assert (
        httpx.post(
            server.url, data=data, headers=headers | {"Referer": "https://evil.example/"}
        ).status_code
        == 400
    )
    assert (
        httpx.post(
            server.url, data=data, headers=headers | {"Referer": "https://study.example/"}
        ).status_code
        == 303
    )
    plain = serve(study_dir)  # without the option, nobody is believed
    assert "; Secure" not in httpx.get(plain.url, headers=forwarded).headers["Set-Cookie"]


def test_several_studies_under_several_workers_behind_a_proxy(write_study, tmp_path, serve):
    """From a file: the first at the root, the second beside it, a sign-in that every worker of
    every study knows, cookies for https alone.
    """
    faces = write_study(tmp_path / "faces", name="faces", title="Faces")
    hands = write_study(tmp_path / "hands", name="hands", title="Hands")
    database = f"sqlite:///{tmp_path}/hands.sqlite3"
    (tmp_path / "serve.toml").write_text(
        f'studies = ["{faces}", "other={hands}"]\ndatabase = ["other={database}"]\n'
        'workers = 2\ntrusted-proxy = "127.0.0.1"\ntrusted-host = ["study.example"]\n'
    )
    server = serve("--config", tmp_path / "serve.toml")
    at = [line.split(None, 1) for line in server.printed.splitlines()]
    places = [place for what, place in at if what in ("study", "questionnaire")]
    assert places == ["faces", server.url, "other", f"{server.url}s/other/"]
    headers = {"X-Forwarded-Proto": "https", "X-Forwarded-Host": "study.example"}
    assert httpx.get(server.url).status_code == 400  # not asked under this name
    with httpx.Client(headers=headers) as http:
        pages = [http.get(f"{server.url}s/other{path}") for path in ("/", "/dashboard/studies")]
        assert "Hands" in pages[0].text and pages[1].headers["Location"].startswith("/s/other/")
        set_cookies = pages[0].headers.get_list("set-cookie")
        assert all("; Secure" in one and "; Path=/s/other" in one for one in set_cookies)
        # httpx sends nothing that is for https alone over http: a browser behind the proxy does
        kept = {}

        def ask(method, path, **sent):
            cookies = "; ".join(f"{name}={value}" for name, value in kept.items())
            sent["headers"] = {"Cookie": cookies, "Referer": "https://study.example/"}
            reply = http.request(method, f"{server.url.rstrip('/')}{path}", **sent)
            for one in reply.headers.get_list("set-cookie"):
                name, value = one.split(";")[0].split("=", 1)
                kept[name] = value
            return reply

        login = "/s/other/dashboard/login"
        data = {"csrf_token": token(ask("GET", login)), "name": "owner"}
        reply = ask("POST", login, data=data | {"password": server.find("password")})
        assert reply.headers["Location"] == "/s/other/dashboard/studies"
        for _ in range(4):
            for path in ("/dashboard/studies", "/s/other/dashboard/log", "/dashboard/"):
                assert ask("GET", path).status_code == 200
        assert ask("GET", "/s/faces/?PID=1").headers["Location"] == "/?PID=1"


def test_studies_stand_in_the_environment(write_study, tmp_path, serve, monkeypatch):
    folders = [write_study(tmp_path / name, name=name) for name in ("faces", "hands")]
    monkeypatch.setenv("SUBDERMAL_SERVE_STUDIES", os.pathsep.join(map(str, folders)))
    monkeypatch.setenv("SUBDERMAL_SERVE_WORKERS", "1")
    server = serve()
    assert httpx.get(f"{server.url}s/hands/").status_code == 200
