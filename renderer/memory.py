"""Memory that is freed and memory that is given back are two things."""

import ctypes
from collections.abc import Iterator

M_MMAP_THRESHOLD = -3  # of glibc's malloc.h
LARGE = 1 << 20


def give_back_large() -> None:
    """From now on, blocks above 1 MB go back to the system as soon as they are freed.

    glibc keeps those below 32 MB for later once it has met one; between frames that is 200 MB of
    buffers. Other C libraries have no such call and are left alone.
    """
    choose = getattr(ctypes.CDLL(None), "mallopt", None)
    if choose is not None:
        choose(M_MMAP_THRESHOLD, LARGE)


def give_back() -> None:
    """Give what was freed so far back to the system: the making of a head leaves 100 MB of it."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def parts(count: int, at_once: int) -> Iterator[slice]:
    """`count` things, so many at once: what is reckoned of each is never there for all."""
    for start in range(0, count, at_once):
        yield slice(start, min(start + at_once, count))
