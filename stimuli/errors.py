"""What can end the work of this package other than a defect."""


class InputError(ValueError):
    """Bad input: what was wrong, what was got and what was expected, in one line."""

    exit_code = 2


class Stopped(Exception):
    """The user interrupted the work; the message says what is finished."""

    exit_code = 130
