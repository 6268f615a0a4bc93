"""Errors that a user of the renderer causes: one line, shown without a traceback."""


class InputError(ValueError):
    """What was wrong, what was got, what was expected."""

    exit_code = 2
