"""What a user can get wrong, as one exception."""


class InputError(ValueError):
    """One line: what was wrong, what was got, what was expected. The command line ends with
    `exit_code`.
    """

    exit_code = 2
