"""Sockets that say nothing cost nothing; those that close, or speak too much, are noticed."""

import socket
import threading
from contextlib import ExitStack, contextmanager

import pytest
from waitress.channel import HTTPChannel

from app import polling, server
from app.polling import Watched

ASKING = b"GET / HTTP/1.1\r\nHost: here\r\n\r\n"


@contextmanager
def serving(application, **limits):
    """The port of a server in a thread, and what it holds its sockets in."""
    sockets, watched = server.listen("127.0.0.1", 0), Watched()
    made = server._server(application, sockets, server.Limits(**limits), watched)
    thread = threading.Thread(target=watched.run, daemon=True)
    thread.start()
    try:
        yield server.port_of(sockets), watched
    finally:
        made.task_dispatcher.shutdown()
        made.trigger.pull_trigger(lambda: server.wasyncore.close_all(watched, ignore_all=True))
        thread.join(10)
        assert not thread.is_alive() and not watched


def hello(environ, start_response):
    start_response("200 OK", [("Content-Length", "5")])
    return [b"hello"]


def heard(connection, times=1):
    """So many bodies of `hello`, with their heads."""
    text = b""
    while text.count(b"hello") < times:
        part = connection.recv(65536)
        assert part, text
        text += part
    return text


def test_sockets_that_say_nothing_are_not_asked(monkeypatch):
    """How often the one that is answered is asked depends on which thread is ahead."""
    asked, readable = [], HTTPChannel.readable
    note = lambda self: (asked.append(self.addr), readable(self))[1]
    monkeypatch.setattr(HTTPChannel, "readable", note)
    monkeypatch.setattr(polling, "ASKED_EVERY_S", 3600)
    silent, requests = 100, 50
    with serving(hello) as (port, watched), ExitStack() as opened:
        for _ in range(silent):
            opened.enter_context(socket.create_connection(("127.0.0.1", port)))
        one = opened.enter_context(socket.create_connection(("127.0.0.1", port)))
        one.sendall(ASKING)
        heard(one)
        assert sum(isinstance(some, HTTPChannel) for some in watched.values()) == silent + 1
        asked.clear()
        for _ in range(requests):
            one.sendall(ASKING)
            heard(one)
        assert set(asked) == {one.getsockname()}


def test_who_asks_on_while_being_answered_gets_each_answer_and_busies_nobody(monkeypatch):
    """Bytes that wait to be read are not said to be there again and again."""
    goes_on, handled, handle = threading.Event(), [], Watched._handle

    def slow(environ, start_response):
        goes_on.wait(10)
        return hello(environ, start_response)

    monkeypatch.setattr(
        Watched, "_handle", lambda self, *event: (handled.append(1), handle(self, *event))[1]
    )
    with serving(slow) as (port, _), socket.create_connection(("127.0.0.1", port)) as one:
        one.sendall(ASKING)
        threading.Event().wait(0.1)
        one.sendall(ASKING + ASKING)
        threading.Event().wait(0.3)
        assert len(handled) < 20
        goes_on.set()
        assert heard(one, 3).count(b"200 OK") == 3


@pytest.mark.parametrize("size", [1, 3_000_000])
def test_a_large_answer_arrives_whole_and_the_connection_that_is_to_close_closes(size):
    body = b"x" * size

    def large(environ, start_response):
        start_response("200 OK", [("Content-Length", str(size))])
        return [body]

    with serving(large) as (port, _), socket.create_connection(("127.0.0.1", port)) as one:
        one.sendall(ASKING.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
        threading.Event().wait(0.05)  # longer than what a socket takes at once
        text = b"".join(iter(lambda: one.recv(65536), b""))
        assert text.endswith(body) and text.count(b"x") >= size


def test_who_leaves_is_forgotten():
    with serving(hello) as (port, watched):
        first = len(watched)
        with socket.create_connection(("127.0.0.1", port)) as one:
            one.sendall(ASKING)
            heard(one)
            assert len(watched) == first + 1
        with socket.create_connection(("127.0.0.1", port)) as other:
            other.sendall(ASKING)
            heard(other)
            other.sendall(ASKING)  # by the second answer the end of the first was read
            heard(other)
            assert len(watched) == first + 1
