"""Where what can be made again is kept, and how arrays are kept there by what they are made from.

A cache of arrays holds one .npz a key. The key is a hash of everything that the arrays follow from,
code and versions of libraries among it, so that nothing stale is ever used; a file that cannot be
read is made anew. Each is held below LIMIT_MB: what was not used for longest goes first.
"""

from __future__ import annotations

import hashlib
import os
import warnings
import zipfile
from collections.abc import Callable, Iterable
from functools import cache
from importlib import metadata
from pathlib import Path

import numpy as np

#: Megabytes of a cache of arrays, unless $SUBDERMAL_CACHE_MB says otherwise; 0: nothing is kept.
LIMIT_MB = 1024

Arrays = dict[str, np.ndarray]


def folder() -> Path:
    """$SUBDERMAL_CACHE, else $XDG_CACHE_HOME/subdermal, else ~/.cache/subdermal."""
    if chosen := os.environ.get("SUBDERMAL_CACHE"):
        return Path(chosen).expanduser().absolute()
    # The XDG base directory specification has relative paths ignored.
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "subdermal"


def limit_bytes() -> int:
    """What a cache of arrays may hold, from $SUBDERMAL_CACHE_MB."""
    from renderer.errors import InputError

    text = os.environ.get("SUBDERMAL_CACHE_MB", str(LIMIT_MB))
    if not text.isdecimal():
        raise InputError(f"SUBDERMAL_CACHE_MB is {text!r}; expected whole megabytes, 0 for none")
    return int(text) << 20


@cache
def _versions(packages: tuple[str, ...]) -> str:
    def of(package: str) -> str:
        try:
            return metadata.version(package)
        except metadata.PackageNotFoundError:
            return "none"

    return " ".join(f"{package}={of(package)}" for package in packages)


def key(parts: Iterable, files: Iterable[Path], packages: tuple[str, ...]) -> str:
    """The name of what follows from `parts` by the code in `files` and by the versions of packages.

    parts: arrays, by dtype, shape and content, and anything else by a repr that says all of it.
    """
    sha256 = hashlib.sha256(_versions(packages).encode())
    for file in sorted(files):
        sha256.update(file.name.encode() + b"\0" + file.read_bytes())
    for part in parts:
        if isinstance(part, np.ndarray):
            sha256.update(f"\0{part.dtype.str}{part.shape}".encode())
            sha256.update(np.ascontiguousarray(part))
        else:
            sha256.update(f"\0{part!r}".encode())
    return sha256.hexdigest()[:32]


def kept(name: str, key: str, make: Callable[[], Arrays]) -> Arrays:
    """The arrays of a key from the cache `name`, or as `make` returns them, which are then kept.

    A cache that cannot be written is said in a warning, and the arrays are returned all the same.
    """
    most = limit_bytes()
    file = folder() / name / f"{key}.npz"
    if most:
        try:
            with np.load(file, allow_pickle=False) as stored:
                arrays = {one: stored[one] for one in stored.files}
            os.utime(file)
            return arrays
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            pass  # not there, or not whole
    arrays = make()
    if most and sum(array.nbytes for array in arrays.values()) <= most:
        try:
            _write(file, arrays)
            _prune(file.parent, most)
        except OSError as error:
            warnings.warn(f"nothing is kept in {file.parent}: {error}", stacklevel=2)
    return arrays


def _write(file: Path, arrays: Arrays) -> None:
    """The file is there whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as stream:
            np.savez(stream, **arrays)
        os.replace(part, file)
    finally:
        part.unlink(missing_ok=True)


def _prune(cache: Path, most: int) -> None:
    """Remove what was not used for longest until `most` bytes are left."""
    entries = []
    for path in cache.glob("*.npz"):
        try:
            status = path.stat()
        except FileNotFoundError:
            continue  # another process was there first
        entries.append((status.st_mtime_ns, status.st_size, path))
    left = sum(size for _, size, _ in entries)
    for _, size, path in sorted(entries):
        if left <= most:
            return
        path.unlink(missing_ok=True)
        left -= size
