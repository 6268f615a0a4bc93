"""Whether every answer that was acknowledged is in the database, once, whatever fails meanwhile.

People answer all their questions as the page's script does: an answer is kept and sent again
until the server has acknowledged it, and a browser that lost its cookies is let in by its code.
Meanwhile, again and again and in turn:

- worker: kill -9 of one of the server's processes;
- server: kill -9 of the first of them, with which all end; it is started again;
- database: kill -9 of PostgreSQL, which is started again (with SQLite it is part of the worker);
- cut: all connections are broken off, those too whose request went out and whose answer did not
  come back yet, and none are taken for half a second;
- slow: for two seconds, every packet comes 50 ms late and in pieces;
- full: the disk under the database is filled to the last byte for a second;
- clock: the server's clock is set forward or back by an hour;
- cookies: a third of all browsers lose their cookies.

Then what was acknowledged is compared with what is in the database. It must run as root (for a
disk of its own) where there is a C compiler (for a clock of its own); without `full` and `clock`
among --faults it needs neither.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from sqlalchemy import text

from benchmarks.server import JSON, Connection, fields, write_study

KINDS = ("worker", "server", "database", "cut", "slow", "full", "clock", "cookies")
QUESTIONS = 30
#: What a failed try may raise in a browser: nothing came back, or not all of it.
BROKEN = (OSError, EOFError, asyncio.IncompleteReadError, asyncio.TimeoutError, TypeError)
TRY_S = 15.0  # as long a browser waits, as in app/static/question.js


class Network:
    """Stands between browsers and server; breaks and slows what goes through."""

    def __init__(self, port: int):
        self.to, self.port, self.delay_s, self.down = port, 0, 0.0, False
        self._open: set[asyncio.StreamWriter] = set()

    async def start(self) -> Network:
        self._server = await asyncio.start_server(self._take, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self.down:
            return writer.transport.abort()
        try:
            other_reader, other = await asyncio.open_connection("127.0.0.1", self.to)
        except OSError:
            return writer.transport.abort()
        self._open |= {writer, other}
        await asyncio.gather(self._carry(reader, other), self._carry(other_reader, writer))
        self._open -= {writer, other}

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while data := await reader.read(65536):
                pieces = [data]
                if self.delay_s:
                    await asyncio.sleep(self.delay_s)
                    pieces = [data[at : at + 700] for at in range(0, len(data), 700)]
                for piece in pieces:
                    writer.write(piece)
                    await writer.drain()
        except OSError:
            pass
        finally:
            writer.close()

    async def cut(self, seconds: float) -> int:
        """Break all connections off; how many there were."""
        self.down = True
        broken = list(self._open)
        for one in broken:
            one.transport.abort()
        await asyncio.sleep(seconds)
        self.down = False
        return len(broken) // 2

    async def stop(self) -> None:
        self.down = True
        self._server.close()
        for one in list(self._open):
            one.transport.abort()
        await asyncio.sleep(0.1)

    async def slow(self, delay_s: float, seconds: float) -> None:
        self.delay_s = delay_s
        await asyncio.sleep(seconds)
        self.delay_s = 0.0


class Server:
    """`subdermal serve` on one port, however often it is started; its clock can be set."""

    def __init__(self, study: Path, url: str, workers: int, clock: Path | None):
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self._command = [sys.executable, "-u", "-m", "app.cli", "serve", str(study)]
        self._command += ["--port", str(self.port), "--database", url, "--enrolments", "0"]
        self._command += ["--workers", str(workers)]
        self._environment = os.environ | (_clocked(clock) if clock else {})
        self._log = (study.parent / "log").open("w+")
        self.start()

    def start(self) -> None:
        self._process = subprocess.Popen(
            self._command,
            stdout=subprocess.DEVNULL,
            stderr=self._log,
            env=self._environment,
        )

    def workers(self) -> list[int]:
        main = self._process.pid
        return [int(one) for one in Path(f"/proc/{main}/task/{main}/children").read_text().split()]

    def kill_worker(self, draw: random.Random) -> bool:
        if not (workers := self.workers()):
            return False
        os.kill(draw.choice(workers), signal.SIGKILL)
        return True

    def kill(self) -> None:
        workers = self.workers()
        self._process.kill()
        self._process.wait()
        deadline = time.monotonic() + 20
        while any(Path(f"/proc/{one}").exists() for one in workers):
            if time.monotonic() > deadline:
                raise RuntimeError("a worker outlived its server")
            time.sleep(0.02)

    def has_ended(self) -> bool:
        """Whether it ended; an error where it was asked for what it cannot do."""
        if self._process.poll() == 2 and "cannot be opened" not in (said := self._said()):
            raise SystemExit(f"the server does not start: {said}")
        return self._process.poll() is not None

    def _said(self) -> str:
        self._log.seek(0)
        return self._log.read()[-2000:]


def _set(clock: Path, seconds: int) -> None:
    """Set the clock of the programs that run in `_clocked`; it is read where it stands."""
    with clock.open("r+b" if clock.exists() else "wb") as file:
        file.write(struct.pack("=q", seconds))


def _clocked(clock: Path) -> dict[str, str]:
    """The environment in which a program's clock is the machine's plus what stands in a file."""
    library = clock.with_suffix(".so")
    source = Path(__file__).with_name("clock.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", library, source, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library), "CLOCK_OFFSET": str(clock)}


class Postgres:
    """The PostgreSQL of tools/with-postgres, which can be killed."""

    def __init__(self, url: str):
        self.url, self._data = url, Path(os.environ["POSTGRES_DATA"])

    def kill_and_start(self) -> None:
        """Kill all its processes at once; recovery follows at the start."""
        first = int((self._data / "postmaster.pid").read_text().split()[0])
        children = Path(f"/proc/{first}/task/{first}/children").read_text().split()
        for one in (first, *map(int, children)):
            os.kill(one, signal.SIGKILL)
        while any(Path(f"/proc/{one}").exists() for one in (first, *children)):
            time.sleep(0.02)
        self.start()

    def start(self) -> bool:
        """Start it where it does not run; whether it runs then (on a full disk it cannot)."""
        control = [os.environ["POSTGRES_BIN"] + "/pg_ctl", "-D", str(self._data), "-w"]
        if os.getuid() == 0:
            control = ["runuser", "-u", "postgres", "--", *control]
        done = subprocess.run(
            [*control, "-l", str(self._data.parent / "log"), "restart", "-m", "immediate"],
            cwd="/",
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        return done.returncode == 0

    def runs(self) -> bool:
        address = urlsplit(self.url)
        try:
            socket.create_connection((address.hostname, address.port), timeout=5).close()
        except OSError:
            return False
        return True


@dataclass
class Disk:
    """A file system of its own that can be filled to the last byte."""

    folder: Path

    def fill(self) -> None:
        with (self.folder / "filler").open("ab", buffering=0) as file:
            for size in (1 << 20, 1 << 12, 1):
                try:
                    while file.write(b"\0" * size):
                        pass
                except OSError:
                    continue

    def empty(self) -> None:
        (self.folder / "filler").unlink(missing_ok=True)


@contextmanager
def disk(megabytes: int) -> Iterator[Disk]:
    folder = Path(tempfile.mkdtemp())
    command = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(folder)]
    if os.getuid() != 0 or subprocess.run(command).returncode:
        raise SystemExit("a disk that can be filled needs root (or leave full out of --faults)")
    try:
        yield Disk(folder)
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)
        shutil.rmtree(folder)


@dataclass
class Tally:
    """What browsers were told: answers that were acknowledged, by question, and what they went
    through.
    """

    acknowledged: dict[int, int] = field(default_factory=dict)
    tries: Counter = field(default_factory=Counter)


class Browser:
    """One person: answers every question, and keeps what was not acknowledged."""

    def __init__(self, port: int, number: int, tally: Tally):
        self.connection, self.tally = Connection(port), tally
        self.draw, self.resume = random.Random(number), ""
        self.forgets = self.ended = False

    async def run(self) -> None:
        token = fields((await self._insist("/"))[1])["csrf_token"]
        await self._insist("/", {"csrf_token": token, "consent": "yes"})
        await self._insist("/familiarity", {"csrf_token": token, "familiarity": "3"})
        while True:
            page = (await self._insist("/question"))[1]
            if "data-trial" not in page:
                if "csrf_token" in page and await self._let_in():
                    continue  # its cookies were cleared: it was shown the first page
                self.ended = True
                return
            self.resume = re.search(r'data-resume="([^"]+)"', page)[1]
            form = fields(page) | {"answer": str(self.draw.randint(-2, 2))}
            await self._deliver(form)

    async def _deliver(self, form: dict[str, str]) -> None:
        while True:
            if self.forgets:
                self.connection.cookie, self.forgets = "", False
                self.tally.tries["without cookies"] += 1
            status, body = await self._insist("/question", form, **JSON)
            if status == 200:
                self._keep(int(form["trial"]), int(form["answer"]))
                return
            if '"lost":true' not in body.replace(" ", ""):
                raise RuntimeError(f"an answer was refused: {status} {body[:300]}")
            if token := await self._let_in():
                form = form | {"csrf_token": token}

    def _keep(self, trial: int, answer: int) -> None:
        if self.tally.acknowledged.setdefault(trial, answer) != answer:
            raise RuntimeError(f"two answers to question {trial} were acknowledged")

    async def _let_in(self) -> str:
        """A token of this person's again, by the code that the page showed; '' without one."""
        if not self.resume:
            return ""
        door = (await self._insist(self.resume))[1]
        code = re.search(r'name="resume"[^>]*value="([^"]+)"', door)[1]
        form = {"csrf_token": fields(door)["csrf_token"], "resume": code}
        await self._insist("/resume/", form)
        return fields((await self._insist("/question"))[1]).get("csrf_token", "")

    async def _insist(self, path: str, form: dict | None = None, **headers) -> tuple[int, str]:
        """Ask until something other than a passing failure comes back."""
        pause = 0.1
        while True:
            try:
                asking = self.connection.ask(path, form, **headers)
                status, body = await asyncio.wait_for(asking, TRY_S)
                if status < 500 and status != 429:
                    return status, body
                self.tally.tries[f"answered {status}"] += 1
            except BROKEN:
                self.connection.close()
                self.tally.tries["broken off"] += 1
            await asyncio.sleep(pause * self.draw.uniform(0.5, 1.5))
            pause = min(2 * pause, 2.0)


@dataclass
class Run:
    """What a run is made of."""

    server: Server
    network: Network
    postgres: Postgres | None
    disk: Disk | None
    clock: Path | None
    browsers: list[Browser]
    draw: random.Random

    async def inject(self, kind: str) -> bool:
        """Let something fail, and mend it; whether it did fail."""
        match kind:
            case "worker":
                return self.server.kill_worker(self.draw)
            case "server":
                await asyncio.to_thread(self.server.kill)
                self.server.start()
            case "database":
                await asyncio.to_thread(self.postgres.kill_and_start)
            case "cut":
                return bool(await self.network.cut(0.5))
            case "slow":
                await self.network.slow(0.05, 2.0)
            case "full":
                self.disk.fill()
                full = shutil.disk_usage(self.disk.folder).free == 0
                await asyncio.sleep(1.0)
                self.disk.empty()
                return full
            case "clock":
                _set(self.clock, self.draw.choice((-3600, 3600)))
            case "cookies":
                at_it = [one for one in self.browsers if one.resume and not one.ended]
                for one in self.draw.sample(at_it, -(-len(at_it) // 3)):
                    one.forgets = True
                return bool(at_it)
        return True

    async def mend(self) -> None:
        """Start again what a fault ended for good, as systemd would."""
        if self.server.has_ended():
            self.server.start()
        if self.postgres and not await asyncio.to_thread(self.postgres.runs):
            await asyncio.to_thread(self.postgres.start)


async def run(
    study: Path,
    url: str,
    kinds: tuple[str, ...],
    people: int,
    at_once: int,
    rounds: int,
    workers: int = 2,
    room: Disk | None = None,
    seed: int = 1,
) -> tuple[Tally, Counter]:
    """Let people answer everything while each kind of fault comes `rounds` times, evenly over the
    answers; what they were told, and how often each fault was there.
    """
    clock = study.parent / "clock" if "clock" in kinds else None
    if clock:
        _set(clock, 0)
    tally, count, draw = Tally(), Counter(), random.Random(seed)
    server = Server(study, url, workers, clock)
    try:
        network = await Network(server.port).start()
        browsers = [Browser(network.port, number, tally) for number in range(people)]
        postgres = Postgres(url) if "database" in kinds else None
        parts = Run(server, network, postgres, room, clock, browsers, draw)
        places = asyncio.Semaphore(at_once)

        async def take_part(browser: Browser) -> None:
            async with places:
                await browser.run()

        async def fail() -> None:
            faults = [kind for _ in range(rounds) for kind in kinds]
            for number, kind in enumerate(faults, start=1):
                while len(tally.acknowledged) < number * people * QUESTIONS / (len(faults) + 1):
                    await asyncio.sleep(0.05)
                    await parts.mend()
                count[kind] += await parts.inject(kind)
            while True:
                await asyncio.sleep(0.5)
                await parts.mend()

        failing = asyncio.create_task(fail())
        answering = asyncio.gather(*map(take_part, browsers))
        await asyncio.wait([failing, answering], return_when=asyncio.FIRST_COMPLETED)
        if failing.done():
            answering.cancel()
            failing.result()  # it never ends by itself: this raises what ended it
        failing.cancel()
        await answering
        for one in browsers:
            one.connection.close()
        await network.stop()
        return tally, count
    finally:
        server.kill()


def compare(url: str, acknowledged: dict[int, int]) -> Counter:
    """How many answers are there; how many were lost, doubled, changed or never acknowledged."""
    from app.database import connect

    engine, found = connect(url), Counter()
    with engine.connect() as db:
        rows = db.execute(text("SELECT trial_id, answer FROM responses")).all()
    engine.dispose()
    stored = dict(map(tuple, rows))
    found["answers"], found["doubled"] = len(rows), len(rows) - len(stored)
    found["lost"] = len(acknowledged.keys() - stored.keys())
    found["changed"] = sum(stored.get(key, value) != value for key, value in acknowledged.items())
    found["not acknowledged"] = len(stored.keys() - acknowledged.keys())
    return found


def measure(database: str | None, kinds: tuple[str, ...], options: argparse.Namespace) -> bool:
    """Run over one database and print; whether nothing was lost."""
    with ExitStack() as opened:
        room = None
        folder = Path(opened.enter_context(tempfile.TemporaryDirectory()))
        if "full" in kinds:
            # PostgreSQL's own disk is that of tools/with-postgres, which is given below
            room = Disk(Path(os.environ["POSTGRES_DATA"]).parent) if database else None
            room = room or opened.enter_context(disk(64))
        study = write_study(folder / "study")
        url = database or f"sqlite:///{room.folder if room else study}/study.sqlite3"
        people = -(-options.answers // QUESTIONS)
        began = time.perf_counter()
        asked = (people, options.at_once, options.rounds, options.workers, room, options.seed)
        tally, count = asyncio.run(run(study, url, kinds, *asked))
        found = compare(url, tally.acknowledged)
    print(
        f"\n{'PostgreSQL' if database else 'SQLite'}: {people} people, {options.at_once} at once,"
    )
    print(f"{len(tally.acknowledged)} answers acknowledged in {time.perf_counter() - began:.0f} s")
    print("faults: " + ", ".join(f"{kind} {count[kind]}" for kind in kinds))
    print("tries: " + ", ".join(f"{what} {n}" for what, n in sorted(tally.tries.items())))
    print("in the database: " + ", ".join(f"{what} {n}" for what, n in found.items()), flush=True)
    wrong = found["lost"] + found["doubled"] + found["changed"]
    return not wrong and len(tally.acknowledged) == people * QUESTIONS


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--answers", type=int, default=10_000)
    parser.add_argument("--at-once", type=int, default=48)
    parser.add_argument("--rounds", type=int, default=5, help="how often each fault comes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faults", default=",".join(KINDS), metavar="A,B")
    parser.add_argument("--only", choices=("sqlite", "postgresql"))
    options = parser.parse_args()
    kinds = tuple(options.faults.split(","))
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"--faults: {', '.join(sorted(unknown))}; expected some of {', '.join(KINDS)}")
    if (server := os.environ.get("POSTGRES_URL")) and os.environ.get("POSTGRES_OF_FAULTS"):
        raise SystemExit(not measure(server, kinds, options))
    good = True
    if options.only != "postgresql":
        good = measure(None, tuple(kind for kind in kinds if kind != "database"), options)
    if options.only != "sqlite":
        # anew, beside a PostgreSQL of its own on a disk of its own
        command = ["tools/with-postgres", sys.executable, *sys.argv]
        with ExitStack() as opened:
            environment = os.environ | {"POSTGRES_OF_FAULTS": "1"}
            if "full" in kinds:
                environment["TMPDIR"] = str(opened.enter_context(disk(400)).folder)
            good &= subprocess.run(command, env=environment).returncode == 0
    raise SystemExit(not good)


if __name__ == "__main__":
    main()
