"""The pages and downloads of the dashboard, for who is signed in; owners alone change something."""

from __future__ import annotations

import re
from contextlib import ExitStack
from datetime import datetime
from tempfile import TemporaryFile

from flask import (
    Blueprint,
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
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app import accounts, export, logs, monitoring, notes, parquet, recruiting, researchers
from app.dashboard import live
from app.models import LogEntry, Participant, Response, plain_code
from app.security import REPORT_POLICY
from app.web import database, download, hosted, simulated, study

blueprint = Blueprint("dashboard", __name__, url_prefix="/dashboard")
blueprint.add_app_template_filter(live.in_words)
#: Of the log, on the page; log.csv has all.
LATEST_ENTRIES = 10


#: Entries of the log on a page of its own.
ENTRIES = 200
#: What a viewer may send: it changes nothing.
LOOKING = ("dashboard.completion",)
#: Pages that are for owners.
FOR_OWNERS = ("dashboard.log", "dashboard.log_csv")


@blueprint.before_request
def _guard():
    looks = request.method in ("GET", "HEAD", "OPTIONS") or request.endpoint in LOOKING
    return researchers.guard(owners=not looks or request.endpoint in FOR_OWNERS)


blueprint.after_request(researchers.log_download)
blueprint.context_processor(researchers.of_page)


@blueprint.get("/")
def index():
    with database().read() as db:
        record, entries = recruiting.record_of(db), _entries(db)[:LATEST_ENTRIES]
        noted = notes.on(db, None)
    return render_template(
        "dashboard/index.html",
        record=record,
        states=recruiting.STATES,
        log=entries,
        notes=noted,
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
        response = download(body, "simulated_responses.csv" if simulated() else "responses.csv")
        response.headers["X-Row-Count"] = str(rows)
        response.call_on_close(opened.pop_all().close)
    return response


@blueprint.get("/completions.csv")
def completions_csv():
    """Which completion codes are real: for paying, without a word of the answers."""
    with database().read() as db:
        body = "".join(export.completions_csv(db))
    return download(body, "completions.csv")


@blueprint.get("/responses.jsonl")
def responses_jsonl():
    """The same table, an object a line."""
    with ExitStack() as opened:
        db = opened.enter_context(database().read())
        body = export.responses_jsonl(db, study(), simulated=simulated())
        response = download(body, "simulated_responses.jsonl" if simulated() else "responses.jsonl")
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
        response = download(body, name)
        response.mimetype = "application/vnd.apache.parquet"
        response.headers["X-Row-Count"] = str(export.count(db))
        response.call_on_close(opened.pop_all().close)
    return response


@blueprint.get("/assignments.jsonl")
def assignments_jsonl():
    """What the pairs of an adaptive design were chosen from."""
    with database().read() as db:
        body = "".join(export.assignments_jsonl(db, study()))
    response = download(body, "assignments.jsonl")
    response.mimetype = "application/jsonl"
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
        people, _ = _everybody(db)
    body = "".join(export.table_csv(list(people[0]) if people else ["code"], people))
    return download(body, "participants.csv")


@blueprint.get("/participants")
def everybody():
    """All of them, on a page that does not update itself."""
    with database().read() as db:
        people, _ = _everybody(db)
    return render_template("dashboard/everybody.html", participants=people)


@blueprint.get("/participants/<code>")
def participant(code: str):
    """One person: what they are flagged for, and leaving them out or letting them count again."""
    with database().read() as db:
        someone = _someone(db, code)
        people, judged = _everybody(db, someone.code)
        row = next(one for one in people if one["code"] == someone.code)
        entries = _entries(db, LogEntry.detail.startswith(f"{someone.code}: "))
        noted = notes.on(db, someone)
    rules = live.judged_by(study(), judged.get(someone.code))
    return render_template(
        "dashboard/participant.html",
        person=someone,
        row=row,
        rules=rules,
        log=entries,
        notes=noted,
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
            change(db, someone, reason, who=_who())
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
        recruiting.set_state(db, chosen, who=_who())
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
            number = int(wanted) if wanted else None
            recruiting.set_quota(db, number, int(minutes), who=_who())
    return redirect(url_for(".index"), 303)


@blueprint.post("/links")
def links():
    """Make single-use links, or say whether they are needed."""
    count, label = request.form.get("count", "").strip(), request.form.get("label", "").strip()
    only = request.form.get("only")
    if only in ("yes", "no"):
        with database().write() as db:
            recruiting.set_links_only(db, only == "yes", who=_who())
        return redirect(url_for(".index"), 303)
    if not re.fullmatch(r"[1-9][0-9]{0,3}", count):
        flash("How many links is a whole number from 1 to 9999.")
        return redirect(url_for(".index"), 303)
    with database().write() as db:
        recruiting.make_links(db, int(count), label, who=_who())
    place = f"{request.script_root}/?link="
    flash(f"{count} links were made; links.csv has them: put each behind {place}.")
    return redirect(url_for(".index"), 303)


@blueprint.get("/links.csv")
def links_csv():
    """Single-use links and whether each was used; without a word of the answers."""
    with database().read() as db:
        body = "".join(export.links_csv(db))
    return download(body, "links.csv")


@blueprint.get("/studies")
def studies():
    """All studies of the server, for who is signed in."""
    rows = []
    for one in hosted():
        with one.app.extensions["database"].read() as db:
            last = db.scalar(select(func.max(Response.answered_at)))
            row = {"record": recruiting.record_of(db), "last": last} | monitoring.counts(db)
        rows.append({"hosted": one, "title": one.app.extensions["study"].definition.title} | row)
    return render_template("dashboard/studies.html", rows=rows, states=recruiting.STATES)


@blueprint.get("/notes")
def all_notes():
    """The latest notes, on whatever; notes.csv has all."""
    with database().read() as db:
        noted = notes.latest(db, ENTRIES)
    return render_template("dashboard/notes.html", notes=noted)


@blueprint.post("/notes")
def add_note():
    """Note something about the study."""
    with database().write() as db:
        _note(db, None)
    return redirect(url_for(".index"), 303)


@blueprint.post("/participants/<code>/notes")
def add_note_on(code: str):
    """Note something about a participant."""
    with database().write() as db:
        _note(db, _someone(db, code))
    return redirect(url_for(".participant", code=code), 303)


def _note(db: Session, someone: Participant | None) -> None:
    text = request.form.get("note", "").replace("\r\n", "\n").strip()
    if not text or len(text) > notes.LONGEST:
        flash(f"A note has 1 to {notes.LONGEST} characters; this one has {len(text)}.")
    else:
        notes.add(db, someone, text, who=_who())


@blueprint.get("/notes.csv")
def notes_csv():
    """All notes, without a word of the answers."""
    with database().read() as db:
        body = "".join(notes.csv(db))
    return download(body, "notes.csv")


@blueprint.get("/log")
def log():
    """Who did what, the latest first."""
    try:
        before = datetime.fromisoformat(request.args["before"]) if request.args else None
    except (KeyError, ValueError):
        abort(400, "Expected ?before=TIME, as in the links of this page.")
    with database().read() as db, researchers.doorkeeper().database.read() as accounts_db:
        entries = logs.latest(db, accounts_db, ENTRIES + 1, before)
        people = accounts.everybody(accounts_db)
    return render_template(
        "dashboard/log.html",
        entries=entries[:ENTRIES],
        more=len(entries) > ENTRIES,
        accounts=people if before is None else [],
    )


@blueprint.get("/log.csv")
def log_csv():
    """All of it, the first first."""
    with database().read() as db, researchers.doorkeeper().database.read() as accounts_db:
        body = "".join(logs.csv(db, accounts_db))
    return download(body, "log.csv")


def _who() -> str:
    """The name of who is signed in."""
    return researchers.current().name


def _entries(db: Session, *which) -> list[LogEntry]:
    return list(db.scalars(select(LogEntry).where(*which).order_by(LogEntry.id.desc())))


@blueprint.get("/recruits.csv")
def recruits_csv():
    """Who came by a recruiter's link, to pay; without a word of the answers."""
    with database().read() as db:
        body = "".join(export.recruits_csv(db, study()))
    return download(body, "recruits.csv")


@blueprint.get("/pilot_responses.csv")
def pilot_responses_csv():
    """The answers of who tried the study out, which are in no other table."""
    with database().read() as db:
        body = "".join(export.pilot_csv(db, study(), simulated=simulated()))
    return download(body, "pilot_responses.csv")


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
    return download(export.codebook_csv(study()), "codebook.csv")


@blueprint.get("/codebook.md")
def codebook_md():
    response = download(export.codebook_md(study(), simulated=simulated()), "codebook.md")
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
    period_s = _period_s()
    return live.shared(database(), study(), period_s)


def _everybody(db: Session, code: str | None = None):
    return current_app.extensions["everybody"].seen(db, study(), _period_s(), code)


def _period_s() -> float:
    return current_app.config.get("LIVE_PERIOD_S", live.PERIOD_S)
