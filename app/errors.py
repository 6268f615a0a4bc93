"""Errors that a user causes: one line that says what was wrong, what was got and what was
expected.
"""


class InputError(ValueError):
    """Bad input; `subdermal` prints the message alone and exits with `exit_code`."""

    exit_code = 2
