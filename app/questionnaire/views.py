"""The pages of the questionnaire.

Each shows what the database says is due, whatever address was asked for.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Mapping

from flask import (
    Blueprint,
    abort,
    current_app,
    flash,
    jsonify,
    redirect,
    render_template,
    request,
    session,
    url_for,
)
from flask_babel import gettext
from markupsafe import Markup
from sqlalchemy import Row
from sqlalchemy.orm import Session

from app import language, plates, recruiting, researchers
from app.models import Participant
from app.questionnaire import flow, screen, wording
from app.questionnaire.flow import Answer, Outcome, Standing
from app.recruiting import Door
from app.web import database, kept, picture, side, simulated, study, wants_json
from stimuli.asking import LONGEST_TEXT, Ask
from stimuli.manifest import Image
from stimuli.viewing import REQUIRED, VIEWS

blueprint = Blueprint("questionnaire", __name__)

_LARGEST_RT_MS = 2**31 - 1
_LARGEST_SIZE = 100_000
#: How many questions ahead a page fetches images.
PRELOADED_QUESTIONS = 5
#: The view of a browser without scripts.
UNSCRIPTED = "unscripted"
#: What the page's script measures and sends with an answer: how each is read.
_MEASURED = {
    **dict.fromkeys(("viewport_width", "viewport_height"), (int, 1, _LARGEST_SIZE)),
    **dict.fromkeys(("shown_width", "shown_height"), (float, 0, _LARGEST_SIZE)),
    "device_pixel_ratio": (float, 0, 100),
    **dict.fromkeys(
        ("rt_ms", *(f"{mode}_ms" for mode in VIEWS), "away_ms", "flips"),
        (int, 0, _LARGEST_RT_MS),
    ),
    **dict.fromkeys(("pixel_scale", "pixel_scale_largest"), (float, 0, 1000)),
    "seen_share": (float, 0, 1),
}


@blueprint.context_processor
def _wording() -> dict:
    words = wording.question(language.current())
    return {"words": words, "mode_names": wording.MODES, "fixed": _fixed}


def _fixed(name: str, caller: Callable[[], Markup]) -> Markup:
    """For templates, as {% call fixed("NAME") %}: a part of a page that is the same for everybody
    who reads a language.
    """
    return kept(caller, "part", name, language.current())


@blueprint.get("/")
def welcome():
    """Consent; for somebody who has begun, the way back to where they were."""
    with database().read() as db:
        participant = _participant(db)
        if participant is None:
            if "visit" not in session:
                if simulated():  # programs come in by /simulation/, with a visit; people stay out
                    return render_template("questionnaire/simulated.html")
                session["visit"] = secrets.token_urlsafe(16)
                session.permanent = True
            if link_fields := recruiting.link_fields(study(), request.args):
                session["recruit"] = link_fields
            if token := request.args.get("link"):
                session["link"] = token[:20]
            record = recruiting.record_of(db)
            door = recruiting.door(db, record, insider=researchers.is_owner())
            if door is Door.OPEN:
                door = recruiting.admission(db, study(), session.get("recruit", {}))
            if door is Door.OPEN:
                link = recruiting.invitation(db, record, session.get("link"))
                door = link if isinstance(link, Door) else door
            if door is not Door.OPEN:
                return _closed(door)
            return render_template(
                "questionnaire/consent.html",
                parts=study().consent_parts(language.current()),
                # in no order that says anything: which are asked first is not drawn yet
                upcoming=[
                    side(image)
                    for image in sorted(study().manifest.images, key=lambda one: one.sha256)
                ][: 2 * PRELOADED_QUESTIONS],
            )
        place = _place(participant)
        if place in _ENDS:
            return redirect(url_for(place))
        return render_template("questionnaire/back.html", place=place, participant=participant)


@blueprint.post("/")
def consent():
    if "visit" not in session:
        abort(
            400,
            gettext(
                "Your browser keeps no cookies. Allow cookies for this site, reload and try again."
            ),
        )
    if request.form.get("consent") != "yes":
        flash(gettext("Please tick the box if you want to take part."))
        return redirect(url_for(".welcome"), 303)
    newcomers = current_app.extensions["newcomers"]
    if newcomers and not newcomers.allow(request.remote_addr):
        abort(
            429,
            gettext(
                "Very many people began from your network just now. Please wait some minutes and "
                "try again."
            ),
        )
    insider = researchers.is_owner()
    with database().write() as db:
        participant = flow.enrol(
            db,
            study(),
            session["visit"],
            insider=insider,
            link_fields=session.get("recruit", {}),
            token=session.get("link"),
            consent=_consented(),
        )
        if isinstance(participant, Door):
            return _closed(participant)
        place = _place(participant)
    return redirect(url_for(place), 303)


def _consented() -> tuple[str, str]:
    """The language of the consent that was agreed to, and the hash of its text."""
    read = request.form.get("language")
    read = read if read in study().definition.languages else language.current()
    return read, study().consent_sha256(read)


def _closed(door: Door):
    recruiter = study().definition.recruiting
    back = recruiter.back(recruiter.turned_away, session.get("recruit", {}))
    return render_template("questionnaire/door.html", message=gettext(door.value), back=back), 403


def _back(participant: Participant) -> str:
    """Where the recruiter wants who has finished to go; '' for nowhere."""
    recruiter = study().definition.recruiting
    link_fields = json.loads(participant.recruit or "{}")
    return recruiter.back(recruiter.completed, link_fields | {"code": participant.completion_code})


@blueprint.get("/closed")
def closed():
    """For who has begun, after the study was closed."""
    with database().read() as db:
        return _redirect_to_due(_participant(db)) or _closed(Door.CLOSED)


@blueprint.get("/familiarity")
def familiarity():
    with database().read() as db:
        participant = _participant(db)
        if redirection := _redirect_to_due(participant):
            return redirection
        return render_template(
            "questionnaire/familiarity.html",
            participant=participant,
            upcoming=_of(flow.upcoming(db, participant, PRELOADED_QUESTIONS)),
        )


@blueprint.post("/familiarity")
def rate():
    levels = study().definition.familiarity.levels
    value = _integer(request.form, "familiarity", levels[0], levels[-1])
    if value not in levels:
        flash(gettext("Please choose one of the levels."))
        return redirect(url_for(".familiarity"), 303)
    return _record("familiarity", lambda db, participant: flow.rate(db, participant, value))


@blueprint.get("/before")
def before():
    return _own("before")


@blueprint.post("/before")
def state_before():
    return _state("before", study().definition.before)


@blueprint.get("/screen")
def look_at_screen():
    with database().read() as db:
        participant = _participant(db)
        if redirection := _redirect_to_due(participant):
            return redirection
        return render_template(
            "questionnaire/screen.html",
            small=False,
            measured=screen.MEASURED,
            upcoming=_of(flow.upcoming(db, participant, PRELOADED_QUESTIONS)),
        )


@blueprint.get("/plate/<int:number>.png")
def plate(number: int):
    """A colour plate; its address says nothing of what can be read."""
    wanted = study().definition.screen
    if not 1 <= number <= wanted.plates:
        abort(404, gettext("This study has no such image."))
    data = plates.picture(study().seed, wanted.plates, wanted.plate_kinds, number)
    return current_app.response_class(data, mimetype="image/png")


@blueprint.get("/not-taken")
def not_taken():
    """For who read fewer colour plates than the study asks for."""
    with database().read() as db:
        return _redirect_to_due(_participant(db)) or _closed(Door.COLOURS)


@blueprint.post("/screen")
def keep_screen():
    wanted, measures = study().definition.screen, screen.read(request.form)
    small = not screen.large_enough(measures, wanted.least_px)
    if small and (wanted.otherwise == "refuse" or request.form.get("anyway") != "yes"):
        return render_template(
            "questionnaire/screen.html", small=True, measured=screen.MEASURED, upcoming=[]
        )
    measures |= screen.read_plates(request.form, wanted.plates, study().seed)
    kept = json.dumps(measures)

    def keep(db: Session, participant: Participant) -> None:
        flow.measure(participant, kept)
        if not screen.reads_enough(kept, wanted.plates_read):
            read = f"read {measures['plates_read']} of {wanted.plates} colour plates"
            reason = f"{read}, {wanted.plates_read} are needed"
            recruiting.exclude(db, participant, reason, who="rule of the study")

    return _record("look_at_screen", keep)


@blueprint.get("/after")
def after():
    return _own("after")


@blueprint.post("/after")
def state_after():
    return _state("after", study().definition.after)


def _own(page: str):
    """The page of questions of the study's own, `before` or `after` the pairs."""
    with database().read() as db:
        participant = _participant(db)
        if redirection := _redirect_to_due(participant):
            return redirection
        return render_template(
            "questionnaire/own.html",
            asks=getattr(study().in_language(language.current()), page),
            given=session.pop("given", {}),
            upcoming=_of(flow.upcoming(db, participant, PRELOADED_QUESTIONS)),
        )


def _state(page: str, asks: tuple[Ask, ...]):
    """Take the answers of that page, all of them or none."""
    values = {ask.name: ask.value(request.form.get(ask.name, "")) for ask in asks}
    if None in values.values():
        flash(gettext("Please answer the questions that are not marked as optional."))
        session["given"] = {ask.name: request.form.get(ask.name, "")[:200] for ask in asks}
        return redirect(url_for(f".{page}"), 303)
    return _record(page, lambda db, participant: flow.state(db, participant, values))


def _record(page: str, change: Callable[[Session, Participant], None]):
    """Commit what a page gave, if that page is due, and go to the one that is due then."""
    with database().write() as db:
        participant = _participant(db, lock=True)
        if participant and _place(participant) == f"questionnaire.{page}":
            change(db, participant)
            participant = _participant(db)
        place = _place(participant)
    return redirect(url_for(place), 303)


@blueprint.get("/question")
def question():
    with database().look() as db:
        participant = flow.standing(db, session.get("visit"))
        if redirection := _redirect_to_due(participant):
            return redirection
        trial, *following = flow.upcoming(db, participant, 1 + PRELOADED_QUESTIONS)
    if request.args.get("rested") == str(participant.answered):
        session["rested"] = participant.answered
    definition = study().in_language(language.current())
    if session.get("rested") != participant.answered and _pauses(participant.answered):
        return render_template(
            "questionnaire/pause.html",
            participant=participant,
            paragraphs=definition.pages.instructions.split("\n\n")
            if not participant.answered
            else [],
            upcoming=_of([trial, *following]),
        )
    shown = flow.Shown.again(flow.Shown.of_cookie(session.get("shown")), trial)
    session["shown"] = shown.cookie()
    return render_template(
        "questionnaire/question.html",
        participant=participant,
        trial=trial,
        cell=study().cells.index(trial.cell),
        images=_images(trial),
        reference=study().manifest.reference(trial.cell),
        upcoming=_of(following),
        measured=["view", *_MEASURED],
        reason=definition.reason if _asks_reason(participant, trial.order) else None,
    )


@blueprint.post("/question")
def answer():
    form = request.form.to_dict()
    trial, value = _integer(form, "trial", 1, 2**31 - 1), _integer(form, "answer", -5, 5)
    if trial is None:
        abort(400, gettext("The form did not say which question it answers. Reload the page."))
    point = next((one for one in study().definition.scale if one.value == value), None)
    if point is None:
        if wants_json():
            abort(400, gettext("The form held no answer of the study's scale."))
        flash(gettext("Please choose one of the answers."))
        return redirect(url_for(".question"), 303)
    given = Answer(
        value=point.counts,
        point=point.value,
        image_left_sha256=form.get("image_left", ""),
        image_right_sha256=form.get("image_right", ""),
        view=_view(form),
        language=language.current(),
        reason_ticks=_ticks(form),
        reason_text=form.get("reason_text", "").strip()[:LONGEST_TEXT] or None,
        **{
            name: (_integer if kind is int else _number)(form, name, low, high)
            for name, (kind, low, high) in _MEASURED.items()
        },
    )
    if given.view == UNSCRIPTED and study().definition.viewer.scripts == REQUIRED:
        abort(
            400,
            gettext(
                "This study shows images by JavaScript, which is switched off or was kept away."
            ),
        )
    shown = flow.Shown.of_cookie(session.get("shown"))
    visit, bound = session.get("visit", ""), not simulated()
    result = flow.answer(database(), study(), visit, trial, given, shown, bound=bound)
    if result is None:
        message = gettext("This browser has not begun the questionnaire, or lost its cookies.")
        if wants_json():
            return jsonify(error=message, lost=True), 400
        abort(400, message)
    outcome, here = result
    if here.answered == here.questions:
        # the answers are on the disk: now the committed ones can be counted
        with database().write() as db:
            flow.complete(db, study(), _participant(db, lock=True))
    place = _place(here)
    kept = outcome in (Outcome.RECORDED, Outcome.REPEATED)
    if wants_json():
        return jsonify(outcome=outcome.value, next=url_for(place)), 200 if kept else 409
    if outcome is Outcome.REFUSED:
        flash(gettext("That question was answered already; the first answer was kept."))
    elif outcome is Outcome.STALE:
        flash(gettext("That was not the current question; nothing was changed. Please go on here."))
    return redirect(url_for(place), 303)


@blueprint.get("/thanks")
def thanks():
    with database().read() as db:
        participant = _participant(db)
        if redirection := _redirect_to_due(participant):
            return redirection
    if participant.completion_code is None:
        # the server stopped between the last answer and the count
        with database().write() as db:
            flow.complete(db, study(), _participant(db, lock=True))
        with database().read() as db:
            participant = _participant(db)
    return render_template(
        "questionnaire/thanks.html",
        participant=participant,
        back=_back(participant),
        credits=study().credits,
    )


@blueprint.get("/withdraw")
def withdraw():
    with database().read() as db:
        return render_template("questionnaire/withdraw.html", participant=_participant(db))


@blueprint.post("/withdraw")
def withdraw_now():
    """Withdraw this browser's participant, or the one who was given a withdrawal key."""
    if request.form.get("confirm") != "yes":
        flash(gettext("Nothing was withdrawn. Please tick the box if you want to withdraw."))
        return redirect(url_for(".withdraw"), 303)
    with database().write() as db:
        if "code" in request.form:
            if not current_app.extensions["code_attempts"].allow(request.remote_addr):
                abort(429, gettext("Too many keys were tried. Wait five minutes and try again."))
            participant = flow.find_by_key(db, request.form["code"])
            if participant is None:
                flash(gettext("No participant was given this key. Please check it."))
                return redirect(url_for(".withdraw"), 303)
            own = _participant(db)
            if own is not None and own.id != participant.id:  # whose browser this is goes on
                flow.withdraw(db, participant)
                flash(gettext("The answers that belong to this key were withdrawn. Yours go on."))
                return redirect(url_for(_place(own)), 303)
            session["visit"] = participant.visit
        elif (participant := _participant(db, lock=True)) is None:
            return redirect(url_for(".withdraw"), 303)
        flow.withdraw(db, participant)
    return redirect(url_for(".withdrawn"), 303)


@blueprint.get("/withdrawn")
def withdrawn():
    with database().read() as db:
        return _redirect_to_due(_participant(db)) or render_template("questionnaire/withdrawn.html")


@blueprint.get("/resume/")
@blueprint.get("/resume/<code>")
def resume(code: str = ""):
    """Where somebody goes on who began in another browser, or whose cookies were cleared."""
    return render_template("questionnaire/resume.html", code=code)


@blueprint.post("/resume/")
def resume_now():
    if not current_app.extensions["code_attempts"].allow(request.remote_addr):
        abort(429, gettext("Too many codes were tried. Wait five minutes and try again."))
    with database().read() as db:
        participant = flow.find_by_resume_code(db, request.form.get("resume", ""))
        own = _participant(db)
        if participant is None:
            flash(gettext("Nobody was given this code. Please check it."))
            return redirect(url_for(".resume"), 303)
        if own is not None and own.id != participant.id and _place(own) in _UNFINISHED:
            flash(
                gettext(
                    "This browser is in the middle of another person's questions; they go on here."
                )
            )
            return redirect(url_for(_place(own)), 303)
        session["visit"] = participant.visit
        session.permanent = True
        session.setdefault("language", participant.consent_language)
        participant = _participant(db)
    current_app.extensions["code_attempts"].forget(request.remote_addr)
    return redirect(url_for(_place(participant)), 303)


@blueprint.post("/another")
def another():
    """Let another person begin in this browser, where the study's people share one."""
    if not study().definition.participants.shared_device:
        abort(403, gettext("In this study one browser is for one person."))
    session.pop("visit", None)
    return redirect(url_for(".welcome"), 303)


#: Pages after which nothing is asked.
_ENDS = tuple(f"questionnaire.{page}" for page in ("thanks", "withdrawn", "closed", "not_taken"))
#: Pages of somebody who has begun and has not finished.
_UNFINISHED = tuple(
    f"questionnaire.{page}"
    for page in ("familiarity", "before", "look_at_screen", "question", "after")
)


def _participant(db: Session, *, lock: bool = False) -> Participant | None:
    return flow.find(db, session.get("visit"), lock=lock)


def _place(here: Participant | Standing | None) -> str:
    """The page that is due."""
    if here is None:
        return "questionnaire.welcome"
    if here.withdrawn_at:
        return "questionnaire.withdrawn"
    definition = study().definition
    unfinished = here.answered < here.questions
    if unfinished and here.study_state == "closed":
        return "questionnaire.closed"
    if here.familiarity is None:
        return "questionnaire.familiarity"
    if here.stated < len(definition.before):
        return "questionnaire.before"
    if definition.screen.check and here.screen is None:
        return "questionnaire.look_at_screen"
    if not screen.reads_enough(here.screen, definition.screen.plates_read):
        return "questionnaire.not_taken"
    if unfinished:
        return "questionnaire.question"
    own = len(definition.before) + len(definition.after)
    return "questionnaire.after" if here.stated < own else "questionnaire.thanks"


def _redirect_to_due(participant: Participant | Standing | None):
    """A redirect to the page that is due, unless it is the one asked for."""
    place = _place(participant)
    return None if place == request.endpoint else redirect(url_for(place), 303)


def _of(trials: list[Row]) -> list[dict]:
    """The pictures of trials, each once, in the order in which they are shown."""
    pictures = []
    for trial in trials:
        pictures += [side(image) for image in _images(trial)]
        if reference := study().manifest.reference(trial.cell):
            pictures.append(picture(reference))
    return list({one["address"]: one for one in pictures}.values())


def _images(trial: Row) -> list[Image]:
    """The left and right image of a trial."""
    return [study().image(trial.cell, side) for side in (trial.left, trial.right)]


def _ticks(form: Mapping[str, str]) -> str | None:
    """The numbers of the words that were ticked for a reason, from 1."""
    count = len(study().definition.reason.ticks)
    ticked = [str(k) for k in range(1, count + 1) if form.get(f"reason_{k}") == "yes"]
    return ";".join(ticked) or None


def _asks_reason(participant: Standing, order: int) -> bool:
    return study().definition.reason.applies(f"{study().seed}/{participant.id}", order)


def _pauses(answered: int) -> bool:
    """Whether a page stands before the next question: instructions, or a rest."""
    pages = study().definition.pages
    if not answered:
        return bool(pages.instructions)
    return bool(pages.break_every) and answered % pages.break_every == 0


def _view(form: Mapping[str, str]) -> str | None:
    """The view in which an answer was given; a browser without scripts names none and no time."""
    modes, named = study().definition.viewer.modes, form.get("view", "")
    if not named and not form.get("rt_ms"):
        return UNSCRIPTED
    return named if named in modes else None


def _integer(form: Mapping[str, str], name: str, low: int, high: int) -> int | None:
    """A whole number in a field of the form; None where it is absent, not a number or out of
    range.
    """
    try:
        value = int(form.get(name, ""))
    except ValueError:
        return None
    return value if low <= value <= high else None


def _number(form: Mapping[str, str], name: str, low: float, high: float) -> float | None:
    try:
        value = float(form.get(name, ""))
    except ValueError:
        return None
    return value if low < value <= high else None
