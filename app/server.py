"""The web server, waitress, in the foreground (`serve`) or beside other work (`simulate`)."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from waitress import create_server, wasyncore
from waitress.server import BaseWSGIServer, MultiSocketServer

from app.errors import InputError

THREADS = 8


def bind(
    application: Callable, host: str, port: int, **settings
) -> BaseWSGIServer | MultiSocketServer:
    """A server that holds its port; `.run()` serves until it is interrupted. Port 0 takes a free
    one.
    """
    try:
        return create_server(
            application,
            host=host,
            port=port,
            threads=THREADS,
            ident=None,
            clear_untrusted_proxy_headers=True,
            **settings,
        )
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"cannot listen on {host} port {port}: {reason}; expected an address of this "
            "machine and a free port"
        ) from None


def port_of(server: BaseWSGIServer | MultiSocketServer) -> int:
    """The port that a server holds (a name such as localhost may stand for several sockets)."""
    return (
        server.effective_listen[0][1]
        if isinstance(server, MultiSocketServer)
        else server.effective_port
    )


@contextmanager
def running(application: Callable) -> Iterator[str]:
    """Serve on a free port of this machine meanwhile; gives the address."""
    sockets: dict = {}
    server = bind(application, "127.0.0.1", 0, map=sockets)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{port_of(server)}/"
    finally:
        server.task_dispatcher.shutdown()  # waits for the requests that are being answered
        # The loop ends when it has no sockets left; they are closed from within it, so that none is
        # waited on.
        server.trigger.pull_trigger(lambda: wasyncore.close_all(sockets, ignore_all=True))
        thread.join()
