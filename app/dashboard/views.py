"""The pages and downloads of the dashboard. Everything but the login needs the password."""

from __future__ import annotations

import re
from contextlib import ExitStack
from tempfile import TemporaryFile

from flask import (
    Blueprint,
    Response,
    abort,
    current_app,
    flash,
    jsonify,
    redirect,
    render_template,
    request,
    send_file,
    send_from_directory,
    url_for,
)
from sqlalchemy import select
from sqlalchemy.orm import Session

from app import export, parquet, password, recruiting
from app.dashboard import live
from app.models import LogEntry, Participant, plain_code
from app.security import REPORT_POLICY
from app.web import database, simulated, study, wants_json

blueprint = Blueprint("dashboard", __name__, url_prefix="/dashboard")
#: Of the log, on the page; log.csv has all.
LATEST_ENTRIES = 10


@blueprint.before_request
def _require_login():
    if request.endpoint == "dashboard.login" or password.logged_in():
        return None
    if wants_json():
        abort(401, "The login has ended. Log in again.")
    return redirect(url_for(".login"), 303)


@blueprint.route("/login", methods=["GET", "POST"])
def login():
    if request.method == "GET":
        return (
            redirect(url_for(".index"), 303)
            if password.logged_in()
            else render_template("dashboard/login.html")
        )
    # The right password always lets in, whoever has been guessing: its 79 bits need no lock
    # against guesses, which are only told to stop.
    if not password.log_in(request.form.get("password", "")):
        if not current_app.extensions["logins"].allow(request.remote_addr):
            abort(429, "Too many passwords were tried. Wait five minutes and try again.")
        flash(
            "This is not the password. It was shown when the server first started; "
            "`subdermal serve --reset-password` sets a new one."
        )
        return render_template("dashboard/login.html"), 401
    current_app.extensions["logins"].forget(request.remote_addr)
    return redirect(url_for(".index"), 303)


@blueprint.post("/logout")
def logout():
    password.log_out()
    return redirect(url_for(".login"), 303)


@blueprint.get("/")
def index():
    with database().read() as db:
        record, entries = recruiting.record_of(db), _entries(db)[:LATEST_ENTRIES]
    return render_template(
        "dashboard/index.html",
        record=record,
        states=recruiting.STATES,
        log=entries,
        images=study().manifest.images,
        cell_labels={
            cell.name: study().definition.cell_label(cell) for cell in study().definition.cells
        },
        technique_labels={
            condition.name: condition.label for condition in study().definition.techniques
        },
        has_report=study().report(simulated()).is_file(),
        parquet_available=parquet.available(),
        **_numbers(),
    )


@blueprint.get("/live.json")
def live_json():
    """What changes, as numbers and as the piece of the page that shows them; nothing where the
    browser has this `version` already.
    """
    numbers = _numbers()
    if request.args.get("version") == numbers["version"]:
        return "", 204
    return jsonify(**numbers, html=render_template("dashboard/live.html", **numbers))


@blueprint.get("/responses.csv")
def responses_csv():
    """The table, streamed; X-Row-Count says how many answers it must hold."""
    with ExitStack() as opened:
        db = opened.enter_context(database().read())  # one snapshot for the count and the rows
        rows = export.count(db)
        body = export.responses_csv(db, study(), simulated=simulated())
        response = _download(body, "simulated_responses.csv" if simulated() else "responses.csv")
        response.headers["X-Row-Count"] = str(rows)
        response.call_on_close(opened.pop_all().close)
    return response


@blueprint.get("/completions.csv")
def completions_csv():
    """Which completion codes are real: for paying, without a word of the answers."""
    with database().read() as db:
        body = "".join(export.completions_csv(db))
    return _download(body, "completions.csv")


@blueprint.get("/responses.jsonl")
def responses_jsonl():
    """The same table, an object a line."""
    with ExitStack() as opened:
        db = opened.enter_context(database().read())
        body = export.responses_jsonl(db, study(), simulated=simulated())
        response = _download(
            body, "simulated_responses.jsonl" if simulated() else "responses.jsonl"
        )
        response.mimetype = "application/jsonl"
        response.headers["X-Row-Count"] = str(export.count(db))
        response.call_on_close(opened.pop_all().close)
    return response


@blueprint.get("/responses.parquet")
def responses_parquet():
    """The same table, with the types of the codebook, a group of rows at a time."""
    if not parquet.available():
        abort(404, parquet.MISSING)
    with ExitStack() as opened:
        db = opened.enter_context(database().read())
        body = export.responses_parquet(db, study(), simulated=simulated())
        name = "simulated_responses.parquet" if simulated() else "responses.parquet"
        response = _download(body, name)
        response.mimetype = "application/vnd.apache.parquet"
        response.headers["X-Row-Count"] = str(export.count(db))
        response.call_on_close(opened.pop_all().close)
    return response


@blueprint.get("/export.zip")
def export_zip():
    """Tables, codebook and manifest of one moment, with hashes and the number of answers."""
    file = TemporaryFile()  # noqa: SIM115 -- closed when it was sent
    with database().read() as db:
        export.write_zip(file, db, study(), simulated=simulated())
    file.seek(0)
    response = send_file(file, "application/zip", as_attachment=True, download_name="export.zip")
    response.headers["Cache-Control"] = "no-store"
    return response


@blueprint.get("/participants.csv")
def participants_csv():
    """Everybody with their state and the rules that they break."""
    with database().read() as db:
        people = live.participants(db, study(), live.responses(db, study()))
    body = "".join(export.table_csv(list(people[0]) if people else ["code"], people))
    return _download(body, "participants.csv")


@blueprint.get("/participants")
def everybody():
    """All of them, on a page that does not update itself."""
    with database().read() as db:
        people = live.participants(db, study(), live.responses(db, study()))
    return render_template("dashboard/everybody.html", participants=people)


@blueprint.get("/participants/<code>")
def participant(code: str):
    """One person: what they are flagged for, and leaving them out or letting them count again."""
    with database().read() as db:
        someone = _someone(db, code)
        answers = live.responses(db, study())
        people = live.participants(db, study(), answers)
        row = next(one for one in people if one["code"] == someone.code)
        entries = _entries(db, LogEntry.detail.startswith(f"{someone.code}: "))
    rules = live.judged_by(study(), live.quality(study(), answers).get(someone.code))
    return render_template(
        "dashboard/participant.html", person=someone, row=row, rules=rules, log=entries
    )


@blueprint.post("/participants/<code>")
def judge(code: str):
    """Exclude a participant, or restore one, for a reason."""
    reason = " ".join(request.form.get("reason", "").split())
    if not reason:
        flash("Please say why: the reason stays in the log.")
    else:
        with database().write() as db:
            someone = _someone(db, code)
            change = recruiting.restore if someone.excluded_at else recruiting.exclude
            change(db, someone, reason)
    return redirect(url_for(".participant", code=code), 303)


def _someone(db: Session, code: str) -> Participant:
    number = code.removeprefix("P")
    someone = db.get(Participant, int(number)) if re.fullmatch(r"[0-9]{4,9}", number) else None
    if someone is None or someone.code != code:
        abort(404, "There is no such participant.")
    return someone


@blueprint.post("/state")
def state():
    """Open, pause, close the study, or try it out."""
    chosen = request.form.get("state", "")
    if chosen not in recruiting.STATES:
        abort(400, f"The state is one of {', '.join(recruiting.STATES)}.")
    with database().write() as db:
        recruiting.set_state(db, chosen)
    flash(f"The study is {chosen}: {recruiting.STATES[chosen]}.")
    return redirect(url_for(".index"), 303)


@blueprint.post("/quota")
def quota():
    """How many complete participants are wanted, and how long a place is kept for who began."""
    wanted, minutes = (request.form.get(name, "").strip() for name in ("quota", "minutes"))
    good = re.fullmatch(r"[1-9][0-9]{0,6}|", wanted) and re.fullmatch(r"[1-9][0-9]{0,5}", minutes)
    if not good:
        flash("A quota is a whole number from 1, or nothing; a place is kept for minutes from 1.")
    else:
        with database().write() as db:
            recruiting.set_quota(db, int(wanted) if wanted else None, int(minutes))
    return redirect(url_for(".index"), 303)


@blueprint.post("/links")
def links():
    """Make single-use links, or say whether they are needed."""
    count, label = request.form.get("count", "").strip(), request.form.get("label", "").strip()
    only = request.form.get("only")
    if only in ("yes", "no"):
        with database().write() as db:
            recruiting.set_links_only(db, only == "yes")
        return redirect(url_for(".index"), 303)
    if not re.fullmatch(r"[1-9][0-9]{0,3}", count):
        flash("How many links is a whole number from 1 to 9999.")
        return redirect(url_for(".index"), 303)
    with database().write() as db:
        recruiting.make_links(db, int(count), label)
    flash(f"{count} links were made; links.csv has them: put each behind /?link=.")
    return redirect(url_for(".index"), 303)


@blueprint.get("/links.csv")
def links_csv():
    """Single-use links and whether each was used; without a word of the answers."""
    with database().read() as db:
        body = "".join(export.links_csv(db))
    return _download(body, "links.csv")


@blueprint.get("/log.csv")
def log_csv():
    """What was done here: states, quotas, exclusions with their reasons."""
    with database().read() as db:
        rows = [
            {"at": entry.at.isoformat(timespec="seconds"), "action": entry.action}
            | {"detail": entry.detail}
            for entry in _entries(db)
        ]
    return _download("".join(export.table_csv(["at", "action", "detail"], rows)), "log.csv")


def _entries(db: Session, *which) -> list[LogEntry]:
    return list(db.scalars(select(LogEntry).where(*which).order_by(LogEntry.id.desc())))


@blueprint.get("/recruits.csv")
def recruits_csv():
    """Who came by a recruiter's link, to pay; without a word of the answers."""
    with database().read() as db:
        body = "".join(export.recruits_csv(db, study()))
    return _download(body, "recruits.csv")


@blueprint.get("/pilot_responses.csv")
def pilot_responses_csv():
    """The answers of who tried the study out, which are in no other table."""
    with database().read() as db:
        body = "".join(export.pilot_csv(db, study(), simulated=simulated()))
    return _download(body, "pilot_responses.csv")


@blueprint.post("/completion")
def completion():
    """Whether a code that somebody shows was given here."""
    code = plain_code(request.form.get("code", ""))
    with database().read() as db:
        completed_on = export.completed_on(db, code)
    if completed_on is None:
        flash(f"{code or 'No code'}: not given by this study.")
    else:
        flash(f"{code}: completed on {completed_on:%Y-%m-%d}.")
    return redirect(url_for(".index"), 303)


@blueprint.get("/codebook.csv")
def codebook_csv():
    return _download(export.codebook_csv(study()), "codebook.csv")


@blueprint.get("/codebook.md")
def codebook_md():
    response = _download(export.codebook_md(study(), simulated=simulated()), "codebook.md")
    response.mimetype = "text/markdown"
    return response


@blueprint.get("/report/")
@blueprint.get("/report/<path:name>")
def report(name: str = "report.html"):
    """The report of `subdermal analyse` and what it links to, with a policy of its own: inline
    styles, no scripts.
    """
    page = study().report(simulated())
    if not page.is_file():
        abort(
            404,
            (
                "There is no report yet. Download responses.csv, then: subdermal analyse "
                f"responses.csv --out {page.parent.name}"
            ),
        )
    response = send_from_directory(page.parent, name)
    response.headers["Content-Security-Policy"] = REPORT_POLICY
    response.headers["Cache-Control"] = "no-store"
    return response


def _numbers() -> dict:
    period_s = current_app.config.get("LIVE_PERIOD_S", live.PERIOD_S)
    return live.shared(database(), study(), period_s)


def _download(body, name: str) -> Response:
    response = Response(body, mimetype="text/csv")
    response.headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return response
