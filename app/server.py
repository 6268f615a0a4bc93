"""The web server, waitress: in several processes (`serve`) or beside other work (`simulate`).

Waitress reads a request whole before a thread takes it up and sends the answer when the visitor can
take it, so that slow and idle visitors cost a socket each and no thread. It is one process; the
others, and those that replace what died, are forked here. (gunicorn, which manages processes,
gives a thread to each new connection: see docs/serving.md.)
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from waitress import create_server, wasyncore

from app.errors import InputError
from app.polling import Watched

#: Files that a process opens beside its connections, at most.
OTHER_FILES = 200
#: Larger than anything a page of ours sends.
LARGEST_HEADER, LARGEST_BODY = 64 * 1024, 256 * 1024
#: A process that ends sooner than this is not started anew before it has passed.
SHORTEST_LIFE_S = 1.0
#: A thread that waited for the database goes on within that of its answer, whatever the other
#: threads compute: by the interpreter's own 5 ms, each round trip could cost so much.
SWITCH_S = 0.0005


@dataclass(frozen=True)
class Limits:
    """What each process holds and waits for."""

    threads: int = 8  # requests that are answered at once
    connections: int = 10_000  # at most, where the system lets a process open so many files
    idle_s: int = 60  # a connection on which nothing happens is closed; browsers open it anew
    grace_s: int = 10  # to end the requests that are being answered when the server stops

    def __post_init__(self):
        for name, value in vars(self).items():
            if type(value) is not int or value < 1:
                raise ValueError(f"{name} is {value!r}; expected a whole number from 1")


USUAL = Limits()


def listen(host: str, port: int) -> list[socket.socket]:
    """Sockets that hold a port of this machine (a name such as localhost may stand for several
    addresses). Port 0 takes a free one.
    """
    sockets: list[socket.socket] = []
    try:
        addresses = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        for family, *_, address in dict.fromkeys(addresses):
            here = (address[0], port_of(sockets) if sockets else port)
            sockets.append(socket.create_server(here, family=family, backlog=1024))
            sockets[-1].setblocking(False)
    except (OSError, ValueError) as error:
        for opened in sockets:
            opened.close()
        reason = os.strerror(error.errno) if getattr(error, "errno", 0) else str(error)
        raise InputError(
            f"cannot listen on {host} port {port}: {reason}; expected an address of this "
            "machine and a free port"
        ) from None
    return sockets


def port_of(sockets: list[socket.socket]) -> int:
    return sockets[0].getsockname()[1]


def run(
    application: Callable,
    sockets: list[socket.socket],
    workers: int,
    limits: Limits = USUAL,
    **settings,
) -> None:
    """Serve until interrupted or told to end, in `workers` processes; one that dies is replaced.

    The application must hold no connection and no thread when this is called.
    """
    if workers == 1:
        signal.signal(signal.SIGTERM, _end)
        _serve(application, sockets, limits, **settings)
        return
    closes_with_us, _held = os.pipe()

    def work() -> None:
        os.close(_held)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C reaches us all; the parent decides
        signal.signal(signal.SIGTERM, _end)
        threading.Thread(target=_end_with, args=[closes_with_us], daemon=True).start()
        _serve(application, sockets, limits, **settings)

    signal.signal(signal.SIGTERM, _end)
    began: dict[int, float] = {}
    try:
        for _ in range(workers):
            began[_fork(work)] = time.monotonic()
        while True:
            ended, status = os.wait()
            if ended in began:
                lived = time.monotonic() - began.pop(ended)
                print(f"a worker ended ({status}); another takes its place", file=sys.stderr)
                time.sleep(max(0.0, SHORTEST_LIFE_S - lived))
                began[_fork(work)] = time.monotonic()
    finally:
        _stop(list(began), limits.grace_s)


def _serve(application: Callable, sockets: list[socket.socket], limits: Limits, **settings):
    """Serve in this process until it is told to end."""
    sys.setswitchinterval(SWITCH_S)
    watched = Watched()
    server = _server(application, sockets, limits, watched, **settings)
    try:
        watched.run()
    except (SystemExit, KeyboardInterrupt):
        server.task_dispatcher.shutdown()  # waits for the requests that are being answered


def _server(
    application: Callable,
    sockets: list[socket.socket],
    limits: Limits,
    watched: Watched,
    **settings,
):
    # a line for each request that waits for a thread says nothing that a person could act on
    logging.getLogger("waitress.queue").setLevel(logging.ERROR)
    return create_server(
        application,
        map=watched,
        sockets=sockets,
        threads=limits.threads,
        ident=None,
        clear_untrusted_proxy_headers=True,
        connection_limit=_connections(limits.connections),
        channel_timeout=limits.idle_s,
        cleanup_interval=min(30, max(1, limits.idle_s // 2)),  # how often it looks for them
        max_request_header_size=LARGEST_HEADER,
        max_request_body_size=LARGEST_BODY,
        **settings,
    )


def _connections(most_connections: int) -> int:
    """How many connections this process may hold, with its limit of open files raised."""
    try:
        import resource
    except ImportError:  # no such limits on this system
        return most_connections
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = most_connections + OTHER_FILES
    files = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
    resource.setrlimit(resource.RLIMIT_NOFILE, (files, most))
    return max(files - OTHER_FILES, files // 2)


def _fork(work: Callable[[], None]) -> int:
    if child := os.fork():
        return child
    code = 1
    try:
        work()
        code = 0
    except SystemExit:
        code = 0
    finally:
        os._exit(code)


def _end(*_) -> None:
    raise SystemExit(0)


def _end_with(pipe: int) -> None:
    """End this process when the other end of the pipe is closed: its parent was killed."""
    os.read(pipe, 1)
    os._exit(1)


def _stop(processes: list[int], grace_s: float) -> None:
    for process in processes:
        os.kill(process, signal.SIGTERM)
    deadline = time.monotonic() + grace_s
    while processes and time.monotonic() < deadline:
        processes = [one for one in processes if os.waitpid(one, os.WNOHANG)[0] == 0]
        time.sleep(0.02)
    for process in processes:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


@contextmanager
def running(application: Callable) -> Iterator[str]:
    """Serve on a free port of this machine meanwhile, in a thread; gives the address."""
    opened = Watched()
    sockets = listen("127.0.0.1", 0)
    server = _server(application, sockets, USUAL, opened)
    thread = threading.Thread(target=opened.run, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{port_of(sockets)}/"
    finally:
        server.task_dispatcher.shutdown()  # waits for the requests that are being answered
        # The loop ends when it has no sockets left; they are closed from within it, so that none is
        # waited on.
        server.trigger.pull_trigger(lambda: wasyncore.close_all(opened, ignore_all=True))
        thread.join()
