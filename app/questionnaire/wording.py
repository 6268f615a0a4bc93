"""What the pages' scripts say, and the names of the views; translated where they are shown."""

from functools import cache

from flask_babel import lazy_gettext

from app.catalogues import catalogue, message

#: Keys are those that app/static/question.js and pair.js use.
_QUESTION = {
    "loading": message("Loading the images …"),
    "trouble": message("An image could not be loaded, trying again …"),
    "sending": message("Saving the answer that was not sent yet …"),
    "unsaved": message("Not saved yet, trying again …"),
    "waiting": message("Saved. Waiting for the next question …"),
    "rejected": message("The answer was not accepted. Please reload the page and answer again."),
    "stale": message("That was not the current question; nothing was changed. Please go on here."),
    "refused": message(
        "That question was answered already, perhaps in another tab; the first answer was kept."
    ),
    "resampled": message("resampled, {percent} %"),
    "image": message("Image"),
}
MODES = {
    "beside": lazy_gettext("Side by side"),
    "flicker": lazy_gettext("Flicker"),
    "wipe": lazy_gettext("Wipe"),
}


@cache
def question(language: str) -> dict[str, str]:
    """What the script of a question says, in a language."""
    return {key: catalogue(language).gettext(text) for key, text in _QUESTION.items()}
