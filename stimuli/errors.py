"""What can end the work of this package other than a defect.

Bad input is the analysis's InputError, since both read the same studies and manifests.
"""

from analysis.errors import InputError

__all__ = ["InputError", "Stopped"]


class Stopped(Exception):
    """The user interrupted the work; the message says what is finished."""

    exit_code = 130
