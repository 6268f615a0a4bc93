"""In which language a page speaks: what its visitor chose, else what the browser asks for, of those
that the study declares. Messages are translated by gettext catalogues in `translations`
(`make translations`), the study's texts by the study.
"""

from __future__ import annotations

from babel import negotiate_locale
from flask import Blueprint, Flask, current_app, g, redirect, request, session, url_for
from flask_babel import Babel
from werkzeug.exceptions import HTTPException
from werkzeug.routing import RequestRedirect

from app.catalogues import FOLDER, catalogue
from app.web import study
from stimuli.languages import LANGUAGES, TAGS

#: Pages for researchers speak English.
ENGLISH = ("/dashboard", "/simulation")

blueprint = Blueprint("language", __name__)


def init(app: Flask) -> None:
    app.config["BABEL_TRANSLATION_DIRECTORIES"] = str(FOLDER)
    Babel(app, locale_selector=current)
    # the same catalogues, without looking for them anew at every message of a page
    app.jinja_env.install_gettext_callables(_translated, _translated_number, newstyle=True)
    app.register_blueprint(blueprint)
    app.context_processor(_of_page)


def _translated(text: str) -> str:
    return catalogue(current()).gettext(text)


def _translated_number(one: str, several: str, number: int) -> str:
    return catalogue(current()).ngettext(one, several, number)


def current() -> str:
    """The language of the page that is being made."""
    if "language" not in g:
        g.language = _current()
    return g.language


def _current() -> str:
    offered = study().definition.languages
    if request.path.startswith(ENGLISH):
        return "en"
    if len(offered) == 1:
        return offered[0]
    chosen = session.get("language")
    if chosen in offered:
        return chosen
    wished = [name for name, quality in request.accept_languages if quality > 0]
    return negotiate_locale(wished, offered, sep="-") or offered[0]


def _of_page() -> dict:
    """For templates: `study` with its texts in the page's language, and what the page offers."""
    speaking, offered = current(), study().definition.languages
    if request.path.startswith(ENGLISH):
        offered = ()
    return {
        "study": study().in_language(speaking),
        "language": speaking,
        "language_tag": TAGS.get(speaking, speaking),
        "languages": [(name, LANGUAGES[name], TAGS.get(name, name)) for name in offered],
    }


@blueprint.post("/language")
def choose():
    """Speak another language from here on, on the page from which it was asked for."""
    wanted = request.form.get("language")
    if wanted in study().definition.languages:
        session["language"] = wanted
        session.permanent = True
    try:
        endpoint, values = current_app.url_map.bind("").match(request.form.get("at", ""), "GET")
    except (HTTPException, RequestRedirect):
        endpoint = ""
    if endpoint.split(".")[0] != "questionnaire":
        return redirect(url_for("questionnaire.welcome"), 303)
    return redirect(url_for(endpoint, **values), 303)
