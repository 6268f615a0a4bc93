"""What keeps the pages safe: signed cookies, CSRF tokens, response headers. No address or user
agent is stored.

The content policy allows files of this server only, nothing inline; a page that needs another
policy (the report) sets its own, and it is left as it is.
"""

from __future__ import annotations

import threading
import time
from collections import defaultdict, deque
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

from flask import Flask, abort, current_app, request
from flask.sessions import SecureCookieSessionInterface
from flask_babel import gettext
from flask_wtf import CSRFProtect
from itsdangerous import SignatureExpired, URLSafeTimedSerializer
from werkzeug.sansio.utils import host_is_trusted
from werkzeug.wsgi import get_current_url

if TYPE_CHECKING:
    from _typeshed.wsgi import StartResponse, WSGIApplication, WSGIEnvironment

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


class _Signer(URLSafeTimedSerializer):
    """Takes what it signed itself in the future too: where the clock is set back, nobody loses
    their place.
    """

    def loads(
        self,
        signed: str | bytes,
        max_age: int | None = None,
        return_timestamp: bool = False,
        salt: str | bytes | None = None,
    ) -> Any:
        value, signed_at = super().loads(signed, return_timestamp=True, salt=salt)
        if max_age is not None and (datetime.now(UTC) - signed_at).total_seconds() > max_age:
            raise SignatureExpired("signed too long ago", payload=value, date_signed=signed_at)
        return (value, signed_at) if return_timestamp else value


class _Sessions(SecureCookieSessionInterface):
    """Signed cookies that are marked Secure exactly when the page came over https."""

    _signer: _Signer | None = None

    def get_signing_serializer(self, app: Flask) -> _Signer:
        if self._signer is None:  # the key of a database never changes
            made = super().get_signing_serializer(app)
            self._signer = _Signer(
                made.secret_keys,
                salt=made.salt,
                serializer=made.serializer,
                signer_kwargs=made.signer_kwargs,
            )
        return self._signer

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


def init(app: Flask, root: str) -> None:
    """root: what the addresses of the study begin with; cookies are for these alone."""
    record = app.extensions["database"].record()
    kind = "" if record.kind == "real" else f"_{record.kind}"
    app.config.update(
        SECRET_KEY=record.secret_key,
        STUDY_KIND=record.kind,
        SESSION_COOKIE_NAME=f"subdermal{kind}{root.replace('/', '_')}",
        SESSION_COOKIE_PATH=root + ("/simulated" if root and kind else "") or "/",
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
    app.wsgi_app = _Headers(app.wsgi_app)


def _refuse_other_hosts() -> None:
    hosts = current_app.config["HOSTS"]  # Flask's TRUSTED_HOSTS leaves no page to say so
    if hosts and not host_is_trusted(request.host, hosts):
        abort(400, gettext("This server is not asked under this name."))


def _refuse_nul() -> None:
    """PostgreSQL takes no NUL in a text, and no page of ours sends one."""
    if any("\0" in value for value in (*request.args.values(), *request.form.values())):
        abort(400, gettext("A field held a character that is none."))


class _Headers:
    """Adds to every answer the headers that it has not set by itself, outside of Flask, where they
    cost a fifth as much.
    """

    FIXED = (
        ("X-Content-Type-Options", "nosniff"),
        ("X-Frame-Options", "DENY"),  # frame-ancestors for browsers that do not know it
        ("Referrer-Policy", "same-origin"),
        ("Cross-Origin-Opener-Policy", "same-origin"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Permissions-Policy", "camera=(), geolocation=(), microphone=()"),
    )
    UNLESS_SET = (
        ("Content-Security-Policy", CONTENT_POLICY),
        # the server owns the position: no page is shown from a cache
        ("Cache-Control", "no-store"),
    )

    def __init__(self, application: WSGIApplication):
        self._application = application

    def __call__(self, environ: WSGIEnvironment, start_response: StartResponse) -> Iterable[bytes]:
        def start(status: str, headers: list[tuple[str, str]], exc_info=None):
            given = {name.lower(): value for name, value in headers}
            # what the visitor calls this server is not repeated: redirects within it have no host
            if place := given.get("location"):
                here = get_current_url(environ, host_only=True)
                if place.startswith(here):
                    headers = [one for one in headers if one[0].lower() != "location"]
                    headers.append(("Location", "/" + place.removeprefix(here)))
            headers = [*headers, *self.FIXED]
            headers += [one for one in self.UNLESS_SET if one[0].lower() not in given]
            return start_response(status, headers, exc_info)

        return self._application(environ, start)
