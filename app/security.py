"""What keeps the pages safe: signed cookies, CSRF tokens, response headers. No address or user
agent is stored.

The content policy allows files of this server only, nothing inline; a page that needs another
policy (the report) sets its own, and it is left as it is.
"""

from __future__ import annotations

import threading
import time
from collections import defaultdict, deque
from datetime import timedelta

from flask import Flask, Response, abort, current_app, request
from flask.sessions import SecureCookieSessionInterface
from flask_babel import gettext
from flask_wtf import CSRFProtect
from werkzeug.sansio.utils import host_is_trusted

CONTENT_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self'",
        "connect-src 'self'",
        "form-action 'self'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
    )
)
#: For the report: one page with its styles and pictures inside, and no script.
REPORT_POLICY = "; ".join(
    (
        "default-src 'none'",
        "style-src 'unsafe-inline'",
        "img-src 'self' data:",
        "font-src data:",
        "form-action 'none'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
    )
)
#: A participant may come back to withdraw within this time from the same browser (later by the
#: withdrawal key).
COOKIE_LIFETIME = timedelta(days=60)


class _Sessions(SecureCookieSessionInterface):
    """Signed cookies that are marked Secure exactly when the page came over https."""

    def get_cookie_secure(self, app: Flask) -> bool:
        return request.is_secure


class Limiter:
    """At most `attempts` within `window_s` seconds for a key, and ten times that for all keys
    together.

    Kept in memory alone: the keys may be addresses, which are never stored.
    """

    def __init__(self, attempts: int, window_s: float):
        self._attempts, self._window_s = attempts, window_s
        self._times: dict[str, deque[float]] = defaultdict(deque)
        self._lock = threading.Lock()

    def allow(self, key: str | None) -> bool:
        """Count an attempt; whether it may be made."""
        with self._lock:
            start = time.monotonic() - self._window_s
            for old in [name for name, times in self._times.items() if times[-1] < start]:
                del self._times[old]
            times, total = self._times[key or ""], sum(map(len, self._times.values()))
            while times and times[0] < start:
                times.popleft()
            if len(times) >= self._attempts or total >= 10 * self._attempts:
                if not times:
                    del self._times[key or ""]
                return False
            times.append(time.monotonic())
            return True

    def forget(self, key: str | None) -> None:
        """Clear the count of a key, after it has proved itself."""
        with self._lock:
            self._times.pop(key or "", None)


def init(app: Flask) -> None:
    record = app.extensions["database"].record()
    app.config.update(
        SECRET_KEY=record.secret_key,
        STUDY_KIND=record.kind,
        SESSION_COOKIE_NAME="subdermal" if record.kind == "real" else f"subdermal_{record.kind}",
        SESSION_COOKIE_HTTPONLY=True,
        SESSION_COOKIE_SAMESITE="Lax",
        PERMANENT_SESSION_LIFETIME=COOKIE_LIFETIME,
        SESSION_REFRESH_EACH_REQUEST=False,  # each question changes it anyway
        # a question may stay open for hours: the token lives as long as the cookie
        WTF_CSRF_TIME_LIMIT=None,
        MAX_CONTENT_LENGTH=64 * 1024,
    )
    app.session_interface = _Sessions()
    # before anything else looks at the request
    app.before_request(_refuse_other_hosts)
    app.before_request(_refuse_nul)
    CSRFProtect(app)
    app.after_request(_headers)


def _refuse_other_hosts() -> None:
    hosts = current_app.config["HOSTS"]  # Flask's TRUSTED_HOSTS leaves no page to say so
    if hosts and not host_is_trusted(request.host, hosts):
        abort(400, gettext("This server is not asked under this name."))


def _refuse_nul() -> None:
    """PostgreSQL takes no NUL in a text, and no page of ours sends one."""
    if any("\0" in value for value in (*request.args.values(), *request.form.values())):
        abort(400, gettext("A field held a character that is none."))


def _headers(response: Response) -> Response:
    headers = response.headers
    # what the visitor calls this server is not repeated: redirects within it have no host
    place = response.location or ""
    if place.startswith(request.host_url):
        response.location = "/" + place.removeprefix(request.host_url)
    headers.setdefault("Content-Security-Policy", CONTENT_POLICY)
    headers["X-Content-Type-Options"] = "nosniff"
    headers["X-Frame-Options"] = "DENY"  # frame-ancestors for browsers that do not know it
    headers["Referrer-Policy"] = "same-origin"
    headers["Cross-Origin-Opener-Policy"] = "same-origin"
    headers["Cross-Origin-Resource-Policy"] = "same-origin"
    headers["Permissions-Policy"] = "camera=(), geolocation=(), microphone=()"
    if "Cache-Control" not in headers:
        headers["Cache-Control"] = (
            "no-store"  # the server owns the position: no page is shown from a cache
        )
    return response
