"""What a user of this package can do wrong."""


class InputError(ValueError):
    """Bad input: what was wrong, what was got and what was expected, in one line."""

    exit_code = 2
