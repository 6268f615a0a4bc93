"""The web server, waitress, in the foreground (`serve`) or beside other work (`simulate`)."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from waitress import create_server
from waitress.server import BaseWSGIServer

from app.errors import InputError

THREADS = 8


def bind(application: Callable, host: str, port: int, **settings) -> BaseWSGIServer:
    """A server that holds its port; `.run()` serves until it is interrupted. Port 0 takes a free one."""
    try:
        return create_server(application, host=host, port=port, threads=THREADS, ident=None, clear_untrusted_proxy_headers=True, **settings)
    except (OSError, ValueError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot listen on {host} port {port}: {reason}") from None


@contextmanager
def running(application: Callable) -> Iterator[str]:
    """Serve on a free port of this machine meanwhile; gives the address."""
    server = bind(application, "127.0.0.1", 0)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.effective_port}/"
    finally:
        server.close()
        thread.join(timeout=10)
