"""Memory that is freed and memory that is given back are two things."""

import ctypes


def give_back() -> None:
    """Give what was freed back to the system.

    glibc keeps freed blocks below 32 MB for later; the making of a head leaves 100 MB of them.
    Other C libraries have no such call and are left alone.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
