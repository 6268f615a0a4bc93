"""What the pages' scripts say, and the names of the views."""

#: Keys are those that app/static/question.js and pair.js use.
QUESTION = {
    "loading": "Loading the images …",
    "trouble": "An image could not be loaded, trying again …",
    "sending": "Saving the answer that was not sent yet …",
    "unsaved": "Not saved yet, trying again …",
    "waiting": "Saved. Waiting for the next question …",
    "rejected": "The answer was not accepted. Please reload the page and answer again.",
    "stale": "That was not the current question; nothing was changed. Please go on here.",
    "refused": "That question was answered already, perhaps in another tab; the first answer was "
    "kept.",
    "resampled": "resampled, {percent} %",
    "image": "Image",
}
MODES = {"beside": "Side by side", "flicker": "Flicker", "wipe": "Wipe"}
