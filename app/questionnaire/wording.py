"""What the pages' scripts say, and the names of the views; translated where they are shown."""

from flask_babel import lazy_gettext

#: Keys are those that app/static/question.js and pair.js use.
QUESTION = {
    "loading": lazy_gettext("Loading the images …"),
    "trouble": lazy_gettext("An image could not be loaded, trying again …"),
    "sending": lazy_gettext("Saving the answer that was not sent yet …"),
    "unsaved": lazy_gettext("Not saved yet, trying again …"),
    "waiting": lazy_gettext("Saved. Waiting for the next question …"),
    "rejected": lazy_gettext(
        "The answer was not accepted. Please reload the page and answer again."
    ),
    "stale": lazy_gettext(
        "That was not the current question; nothing was changed. Please go on here."
    ),
    "refused": lazy_gettext(
        "That question was answered already, perhaps in another tab; the first answer was kept."
    ),
    "resampled": lazy_gettext("resampled, {percent} %"),
    "image": lazy_gettext("Image"),
}
MODES = {
    "beside": lazy_gettext("Side by side"),
    "flicker": lazy_gettext("Flicker"),
    "wipe": lazy_gettext("Wipe"),
}
