"""Where what can be made again is kept."""

from __future__ import annotations

import os
from pathlib import Path


def folder() -> Path:
    """$SUBDERMAL_CACHE, else $XDG_CACHE_HOME/subdermal, else ~/.cache/subdermal."""
    if chosen := os.environ.get("SUBDERMAL_CACHE"):
        return Path(chosen).expanduser().absolute()
    # The XDG base directory specification has relative paths ignored.
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "subdermal"
