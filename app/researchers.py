"""Researchers in the browser: signing in and out, who it is that asks, what each may do.

One sign-in is for all studies of a server. The browser has a random token in a cookie of its own,
which is new with every sign-in; the token against forged forms is new with it, in each study.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256

from flask import (
    Blueprint,
    Response,
    abort,
    current_app,
    flash,
    g,
    redirect,
    render_template,
    request,
    session,
    url_for,
)
from flask_wtf.csrf import CSRFError
from werkzeug.http import parse_options_header

from app import accounts, recruiting
from app.accounts import Researcher
from app.database import Database
from app.errors import InputError
from app.models import Account
from app.security import Limiter
from app.web import database, hosted, wants_json

COOKIE = "subdermal_researcher"
#: Names and passwords tried from one address within `WINDOW_S`; further ones wait in line.
ATTEMPTS, WINDOW_S = 5, 300
#: In line one attempt is looked at every `PAUSE_S`, and so many wait at once: of the threads of a
#: process few are ever held up.
PAUSE_S, IN_LINE = 0.5, 2
#: Characters of an address to which somebody is led back after signing in.
LONGEST_PAGE = 200

blueprint = Blueprint("researchers", __name__, url_prefix="/dashboard")


class Doorkeeper:
    """The accounts of a server in one process: their database, and who has tried how often.

    The right password lets in whoever has been guessing. Guesses beyond the first few wait in
    line, and are sent away where it is long; who has signed in before in the same browser has a
    line of their own, which no stranger can fill.
    """

    def __init__(self, database: Database):
        self.database = database
        self._attempts = Limiter(ATTEMPTS, WINDOW_S)
        self.changes = Limiter(ATTEMPTS, WINDOW_S)  # of passwords, by account
        self._told = Limiter(1, WINDOW_S)
        self._strangers, self._known = _Line(), _Line()

    def admit(
        self, name: str, password: str, address: str | None, known_by: str | None, old: str | None
    ) -> str | None:
        """The token of a new sign-in, which ends the `old` one; None for a wrong name or password.
        `Crowded` where so many guess that this one was not looked at.

        known_by: `mark_of` an account, of a browser in which it signed in.
        """
        with self.database.read() as db:
            account = accounts.find(db, name)
            stored = account and account.password_hash
        few = self._attempts.allow(address)
        if few:
            right = accounts.verified(stored, password)
        else:
            known = account is not None and known_by == mark_of(account)
            with (self._known if known else self._strangers).place():
                right = accounts.verified(stored, password)
        with self.database.write() as db:
            account = accounts.find(db, name)
            # the password was not changed meanwhile
            if right and account and account.password_hash == stored:
                self._attempts.forget(address)
                accounts.refresh_hash(account, password)
                return accounts.sign_in(db, account, ending=old)
            if few:
                who, detail = (account.name, "") if account else ("?", "there is no such name")
                accounts.note(db, "sign-in failed", detail, who=who)
            elif self._told.allow("all"):
                detail = "many in a row: no more are listed for five minutes"
                accounts.note(db, "sign-in failed", detail, who="?")
        if not few:
            raise Crowded
        return None


class Crowded(Exception):
    """Too many names and passwords were tried."""


class _Line:
    """One at a time, each after a pause; `Crowded` where the line is full."""

    def __init__(self):
        self._places, self._first = threading.BoundedSemaphore(IN_LINE), threading.Lock()

    @contextmanager
    def place(self) -> Iterator[None]:
        if not self._places.acquire(blocking=False):
            raise Crowded
        try:
            with self._first:
                time.sleep(PAUSE_S)
                yield
        finally:
            self._places.release()


def doorkeeper() -> Doorkeeper:
    """That of the running server."""
    return current_app.extensions["doorkeeper"]


def mark_of(account: Account) -> str:
    """What a browser keeps, signed, to show that it knew the account's password."""
    return sha256(account.password_hash.encode()).hexdigest()[:16]


def current() -> Researcher | None:
    """Who is signed in in the browser that asks; looked up once a request, and only for a browser
    that has such a cookie.
    """
    if "researcher" not in g:
        g.researcher = None
        if token := request.cookies.get(COOKIE):
            with doorkeeper().database.read() as db:
                g.researcher = accounts.signed_in(db, token)
    return g.researcher


def of_page() -> dict:
    """For the templates of pages for researchers."""
    return {"researcher": current(), "several": len(hosted()) > 1}


def is_owner() -> bool:
    researcher = current()
    return researcher is not None and researcher.owner


def guard(*, owners: bool) -> Response | None:
    """Before a page for researchers: let nobody in who is not signed in, nor a viewer where it is
    for owners.
    """
    researcher = current()
    if researcher is None:
        if wants_json():
            abort(401, "The sign-in has ended. Sign in again.")
        page = request.full_path.rstrip("?")
        if request.method == "GET" and len(page) <= LONGEST_PAGE:
            session["wanted"] = page
        return redirect(url_for("researchers.login"), 303)
    if session.get("signed_in") != researcher.mark:
        # the token against forged forms is of before the sign-in: somebody may have planted it
        if request.method not in ("GET", "HEAD", "OPTIONS"):
            raise CSRFError("The form is of before the sign-in.")
        session.pop("csrf_token", None)
        session["signed_in"] = researcher.mark
        session.permanent = True
    if owners and not researcher.owner:
        abort(403, f"This is for owners; {researcher.name} may look, and change nothing.")
    return None


def log_download(response: Response) -> Response:
    """After a page for researchers: who took which file goes into the study's log."""
    _, named = parse_options_header(response.headers.get("Content-Disposition"))
    if request.method == "GET" and response.status_code == 200 and "filename" in named:
        rows = response.headers.get("X-Row-Count")
        detail = named["filename"] + (f", {rows} answers" if rows else "")
        try:
            with database().write() as db:
                recruiting.note(db, "download", detail, who=current().name)
        except Exception:
            response.close()  # nothing is handed out that the log does not know
            raise
    return response


@blueprint.before_request
def _guard() -> Response | None:
    if request.endpoint == "researchers.login":
        return None
    return guard(owners=False)


blueprint.context_processor(of_page)


@blueprint.route("/login", methods=["GET", "POST"])
def login():
    if request.method == "GET":
        if current():
            return redirect(url_for("dashboard.index"), 303)
        return render_template("dashboard/login.html", name="")
    name, password = request.form.get("name", ""), request.form.get("password", "")
    try:
        token = doorkeeper().admit(
            name, password, request.remote_addr, session.get("known"), request.cookies.get(COOKIE)
        )
    except Crowded:
        page = "Too many names and passwords were tried. Wait a little and try again."
        abort(429, page)
    if token is None:
        flash("The name or the password is not right.")
        return render_template("dashboard/login.html", name=name[:64]), 401
    with doorkeeper().database.read() as db:
        session["known"] = mark_of(accounts.named(db, name))
    session.pop("csrf_token", None)
    session.permanent = True
    response = redirect(_wanted(), 303)
    _set_cookie(response, token)
    return response


def _wanted() -> str:
    """The page from which somebody was sent to sign in, one of this study's own."""
    otherwise = url_for("dashboard.studies" if len(hosted()) > 1 else "dashboard.index")
    wanted = session.pop("wanted", None)
    return request.script_root + wanted if wanted else otherwise


def _set_cookie(response: Response, token: str) -> None:
    response.set_cookie(
        COOKIE,
        token,
        max_age=accounts.LIFETIME,
        path="/",
        secure=request.is_secure,
        httponly=True,
        samesite="Lax",
    )


@blueprint.route("/password", methods=["GET", "POST"])
def password():
    """Another password for the account that is signed in, by who knows the present one."""
    if request.method == "GET":
        lengths = {"shortest": accounts.SHORTEST, "longest": accounts.LONGEST}
        return render_template("dashboard/password.html", **lengths)
    name, here = current().name, redirect(url_for(".password"), 303)
    if not doorkeeper().changes.allow(name):
        abort(429, "Too many passwords were tried. Wait five minutes and try again.")
    with doorkeeper().database.read() as db:
        stored = accounts.named(db, name).password_hash
    if not accounts.verified(stored, request.form.get("present", "")):
        flash("The present password is not right; nothing was changed.")
        return here
    if request.form.get("wanted") != request.form.get("again"):
        flash("The new password was typed in two ways; nothing was changed.")
        return here
    try:
        with doorkeeper().database.write() as db:
            account = accounts.named(db, name)
            accounts.set_password(db, account, request.form.get("wanted", ""), who=name)
            token = accounts.sign_in(db, account, ending=None)
            session["known"] = mark_of(account)
    except InputError as error:
        flash(f"Nothing was changed: {error}.")
        return here
    doorkeeper().changes.forget(name)
    session.pop("csrf_token", None)
    flash("The password was changed.")
    response = redirect(url_for("dashboard.index"), 303)
    _set_cookie(response, token)
    return response


@blueprint.post("/logout")
def logout():
    with doorkeeper().database.write() as db:
        accounts.sign_out(db, request.cookies[COOKIE])
    session.pop("signed_in", None)
    session.pop("csrf_token", None)
    response = redirect(url_for(".login"), 303)
    response.delete_cookie(COOKIE, path="/")
    return response
