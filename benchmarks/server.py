"""How many answers a second the questionnaire takes, at which CPU, beside a bare Flask view.

The bare view does one committed insert and says ok: same server, processes, database and settings,
in the same run. Both are asked over connections that stay open, from this machine:

- flat out: 64 at once post answers as fast as they are taken; then each answer with the page of the
  next question, as a browser asks for it;
- a crowd: 500 participants at once, each with three connections of which two idle, thinking a few
  seconds between answers;
- 1,000 sockets that say nothing: how long the next visitor waits.

PostgreSQL: `--database postgresql+pg8000://...`, an empty one that this may fill.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
from PIL import Image
from sqlalchemy import text

FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")
JSON = {"Accept": "application/json"}
THINKING_S = 6.0  # mean, exponential, in the crowd


def write_study(directory: Path) -> Path:
    """A study of 15 small images: this measures answers, not pictures."""
    (directory / "images").mkdir(parents=True)
    images = []
    for f, framing in enumerate(FRAMINGS):
        for t, technique in enumerate(TECHNIQUES):
            file = directory / "images" / f"{framing}_{technique}.png"
            Image.fromarray(np.full((36, 64, 3), (40 * t, 90, 60 * f), np.uint8)).save(file)
            digest = hashlib.sha256(file.read_bytes()).hexdigest()
            place = {"framing": framing, "technique": technique, "file": f"images/{file.name}"}
            images.append(place | {"sha256": digest, "width": 64, "height": 36})
    study = {"name": "load", "title": "Load", "version": 1, "seed": 1}
    study |= {"framings": [{"name": name, "label": name} for name in FRAMINGS]}
    study |= {"techniques": [{"name": name, "label": name} for name in TECHNIQUES]}
    manifest = {"format": "subdermal-manifest/1", "study": study, "images": images}
    (directory / "manifest.json").write_text(json.dumps(manifest))
    return directory


def serve_bare(url: str, workers: int) -> None:
    """The view to compare with, under the same server and over the same kind of database."""
    from flask import Flask, request

    from app import server
    from app.database import connect

    engine, bare = connect(url), Flask("bare")
    with engine.begin() as db:
        db.execute(
            text("CREATE TABLE IF NOT EXISTS bare (who TEXT, trial INTEGER, answer INTEGER)")
        )
    statement = text("INSERT INTO bare VALUES (:who, :trial, :answer)")
    writer = engine.execution_options(writes=True)

    @bare.post("/")
    def insert():
        with writer.begin() as db:
            db.execute(statement, dict(request.form))
        return "ok"

    engine.dispose()
    sockets = server.listen("127.0.0.1", 0)
    print(f"questionnaire http://127.0.0.1:{server.port_of(sockets)}/\nCtrl+C", flush=True)
    server.run(bare, sockets, workers)


class Served:
    """A server in processes of its own, and the CPU that they used."""

    def __init__(self, *command: str):
        self.process = subprocess.Popen(
            [sys.executable, "-u", *command], stdout=subprocess.PIPE, text=True
        )
        printed = ""
        for line in self.process.stdout:
            printed += line
            if line.startswith("Ctrl+C"):
                break
        self.port = int(re.search(r"questionnaire\s+http://[\d.]+:(\d+)", printed)[1])

    def cpu_s(self) -> float:
        main = self.process.pid
        children = Path(f"/proc/{main}/task/{main}/children").read_text().split()
        ticks = 0
        for one in (main, *children):
            fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()


@contextmanager
def served(*command: str) -> Iterator[Served]:
    server = Served(*command)
    try:
        yield server
    finally:
        server.end()


class Connection:
    """One kept-alive HTTP connection with a cookie, as little of a client as there can be."""

    def __init__(self, port: int):
        self.port, self.cookie, self.streams = port, "", None

    async def open(self) -> Connection:
        self.streams = await asyncio.open_connection("127.0.0.1", self.port)
        return self

    async def ask(self, path: str, form: dict | None = None, **headers: str) -> tuple[int, str]:
        body = urlencode(form or {})
        lines = [f"{'GET' if form is None else 'POST'} {path} HTTP/1.1", "Host: 127.0.0.1"]
        lines += [f"{name}: {value}" for name, value in headers.items()]
        if self.cookie:
            lines.append(f"Cookie: {self.cookie}")
        if form is not None:
            lines += ["Content-Type: application/x-www-form-urlencoded"]
            lines += [f"Content-Length: {len(body)}"]
        if self.streams is None or self.streams[0].at_eof():  # the server closes what is idle
            await self.open()
        reader, writer = self.streams
        writer.write(("\r\n".join(lines) + "\r\n\r\n" + body).encode())
        head = (await reader.readuntil(b"\r\n\r\n")).decode()
        length = int(re.search(r"content-length: (\d+)", head, re.I)[1])
        answer = (await reader.readexactly(length)).decode()
        if cookie := re.search(r"set-cookie: ([^;]+)", head, re.I):
            self.cookie = cookie[1]
        if re.search(r"connection: close", head, re.I):
            self.close()
        return int(head.split()[1]), answer

    def close(self) -> None:
        if self.streams:
            self.streams[1].close()
            self.streams = None


def fields(page: str) -> dict[str, str]:
    """The form of a question, with an answer."""
    inputs = re.findall(r'name="(csrf_token|trial|image_left|image_right)" value="([^"]+)"', page)
    return dict(inputs) | {"answer": "1", "rt_ms": "4321"}


async def begun(port: int) -> tuple[Connection, dict[str, str]]:
    """A participant at the first question."""
    one = await Connection(port).open()
    token = fields((await one.ask("/"))[1])["csrf_token"]
    await one.ask("/", {"csrf_token": token, "consent": "yes"})
    await one.ask("/familiarity", {"csrf_token": token, "familiarity": "3"})
    return one, fields((await one.ask("/question"))[1])


async def crowd_of(port: int, count: int) -> list:
    people = []
    for start in range(0, count, 16):
        people += await asyncio.gather(*(begun(port) for _ in range(start, min(start + 16, count))))
    return people


def percentile(times: list[float], share: float) -> float:
    return float(np.quantile(times, share)) * 1000


async def timed(job: Awaitable, times: list[float]):
    start = time.perf_counter()
    result = await job
    times.append(time.perf_counter() - start)
    return result


async def answer(person: Connection, form: dict[str, str], times: list[float]) -> None:
    status, body = await timed(person.ask("/question", form, **JSON), times)
    if status != 200 or '"recorded"' not in body:
        raise RuntimeError(f"an answer was not taken: {status} {body[:200]}")


async def insert(person: Connection, times: list[float]) -> None:
    form = {"who": "somebody", "trial": "1", "answer": "1"}
    status, _ = await timed(person.ask("/", form), times)
    if status != 200:
        raise RuntimeError(f"the bare view said {status}")


async def flat_out(
    server: Served, jobs: list[Callable[[list[float]], Awaitable]], each: int
) -> tuple[float, float, float]:
    """Answers a second, CPU an answer in ms, 95th percentile in ms."""
    times: list[float] = []

    async def work(job) -> None:
        for _ in range(each):
            await job(times)

    cpu, start = server.cpu_s(), time.perf_counter()
    await asyncio.gather(*map(work, jobs))
    took, cpu = time.perf_counter() - start, server.cpu_s() - cpu
    return len(times) / took, 1000 * cpu / len(times), percentile(times, 0.95)


def posting(person: Connection, form: dict[str, str], ahead: list[dict[str, str]] | None):
    """A job that answers once more: by the forms known beforehand, or by the page that follows."""
    forms = iter(ahead or ())
    state = {"form": form}

    async def job(times: list[float]) -> None:
        if ahead is not None:
            await answer(person, form | next(forms), times)
        else:
            await answer(person, state["form"], times)
            state["form"] = fields((await person.ask("/question"))[1])

    return job


def known(url: str, study: Path, number: int, participants: int) -> dict[int, list[dict]]:
    """The forms of each participant's coming questions, out of the database."""
    from app.database import connect
    from app.study import Study

    opened, engine = Study.open(study), connect(url)
    query = text('SELECT id, participant_id, cell, "left", "right" FROM trials ORDER BY id')
    forms: dict[int, list[dict]] = {}
    with engine.connect() as db:
        for trial, person, cell, left, right in db.execute(query):
            hashes = [opened.image(cell, side).sha256 for side in (left, right)]
            named = dict(zip(("image_left", "image_right"), hashes)) | {"trial": str(trial)}
            forms.setdefault(person, []).append(named)
    engine.dispose()
    return {person: forms[person] for person in range(number, number + participants)}


async def crowd(
    server: Served, jobs: list[Callable], idle: int, each: int, seed: int
) -> tuple[float, float, float, int]:
    """Median and 95th percentile in ms, CPU an answer in ms, connections open."""
    times: list[float] = []
    rng = random.Random(seed)
    silent = [await Connection(server.port).open() for _ in range(idle)]

    async def work(job) -> None:
        for _ in range(each):
            await asyncio.sleep(rng.expovariate(1 / THINKING_S))
            await job(times)

    cpu = server.cpu_s()
    await asyncio.gather(*map(work, jobs))
    cpu = server.cpu_s() - cpu
    for one in silent:
        one.close()
    connections = idle + len(jobs)
    return percentile(times, 0.5), percentile(times, 0.95), 1000 * cpu / len(times), connections


async def silent_thousand(server: Served) -> float:
    """How long a new visitor waits for the first page beside 1,000 sockets that say nothing, s."""
    silent = [await Connection(server.port).open() for _ in range(1000)]
    visitor, times = Connection(server.port), []
    status, _ = await timed(visitor.ask("/"), times)
    if status != 200:
        raise RuntimeError(f"the visitor after 1,000 silent sockets got {status}")
    for one in silent:
        one.close()
    return times[0]


async def measure(options, study: Path, url: str, bare: Served, ours: Served) -> None:
    if options.turns:
        await measure_flat_out(options, study, url, bare, ours)
    await measure_crowd(options, bare, ours)


async def measure_flat_out(options, study: Path, url: str, bare: Served, ours: Served) -> None:
    at_once, each = options.at_once, options.answers
    connections = [await Connection(bare.port).open() for _ in range(at_once)]
    inserting = [lambda times, one=one: insert(one, times) for one in connections]
    taking = await crowd_of(ours.port, at_once)
    forms = list(known(url, study, 1, at_once).values())
    # participants are numbered as they came, not as their connections stand: find each one's own
    by_trial = {form["trial"]: some for some in forms for form in some}
    first = [posting(one, form, by_trial[form["trial"]]) for one, form in taking]
    paging = [posting(*begun, None) for begun in await crowd_of(ours.port, at_once)]

    rows = []
    for _ in range(options.turns):  # in turn, so that a busy machine is busy for all
        for name, server, jobs in (
            ("bare insert", bare, inserting),
            ("answer", ours, first),
            ("answer and next page", ours, paging),
        ):
            rows.append((name, *await flat_out(server, jobs, each)))
    print(
        f"\n{at_once} at once, flat out, {options.workers} workers, {options.turns} turns of {each}"
    )
    print(f"{'':22}{'a second':>10}{'CPU ms':>10}{'p95 ms':>10}")
    medians = {}
    for name in dict.fromkeys(row[0] for row in rows):
        some = np.array([row[1:] for row in rows if row[0] == name])
        medians[name] = np.median(some, axis=0)
        print(f"{name:22}{medians[name][0]:10.0f}{medians[name][1]:10.2f}{medians[name][2]:10.0f}")
    base = medians["bare insert"]
    for name in ("answer", "answer and next page"):
        rate, cpu = medians[name][0] / base[0], medians[name][1] / base[1]
        print(f"{name}: {rate:.2f} of the bare view's rate at {cpu:.2f} times its CPU")


async def measure_crowd(options, bare: Served, ours: Served) -> None:
    people = options.people
    print(f"\n{people} at once, thinking {THINKING_S:g} s, three connections each")
    print(f"{'':22}{'p50 ms':>10}{'p95 ms':>10}{'CPU ms':>10}{'sockets':>10}")
    for name, server in (("bare insert", bare), ("answer and next page", ours)):
        # begun right before: a connection on which nothing happens for a minute is closed
        if server is bare:
            opened = [await Connection(bare.port).open() for _ in range(people)]
            jobs = [lambda times, one=one: insert(one, times) for one in opened]
        else:
            jobs = [posting(*begun, None) for begun in await crowd_of(ours.port, people)]
        p50, p95, cpu, sockets = await crowd(server, jobs, 2 * people, options.crowd_answers, 1)
        print(f"{name:22}{p50:10.0f}{p95:10.0f}{cpu:10.2f}{sockets:10d}")
    waited = await silent_thousand(ours)
    print(f"\nthe visitor after 1,000 silent sockets waited {1000 * waited:.0f} ms")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--database", help="an SQLAlchemy URL; by default SQLite in a new folder")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--at-once", type=int, default=64)
    parser.add_argument("--answers", type=int, default=8, help="each, in a turn")
    parser.add_argument("--turns", type=int, default=3, help="0 for the crowd alone")
    parser.add_argument("--people", type=int, default=500)
    parser.add_argument("--crowd-answers", type=int, default=4)
    parser.add_argument("--bare", metavar="URL", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.bare:
        return serve_bare(options.bare, options.workers)
    if options.answers * options.turns > 29:
        parser.error("a participant has 30 questions: --answers times --turns is at most 29")
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(8192, most), most))
    with tempfile.TemporaryDirectory() as folder:
        study = write_study(Path(folder) / "study")
        url = options.database or f"sqlite:///{study}/study.sqlite3"
        other = options.database or f"sqlite:///{folder}/bare.sqlite3"
        workers = "--workers", str(options.workers)
        ours = ("-m", "app.cli", "serve", str(study), "--port", "0", "--database", url, *workers)
        ours += ("--enrolments", "0")
        with served(__file__, "--bare", other, *workers) as bare, served(*ours) as studied:
            asyncio.run(measure(options, study, url, bare, studied))


if __name__ == "__main__":
    main()
