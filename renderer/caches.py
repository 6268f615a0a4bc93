"""Where what can be made again is kept, and how arrays are kept there by what they are made from.

A cache of arrays holds one .npz a key. The key is a hash of everything that the arrays follow from,
code and versions of libraries among it, so that nothing stale is ever used; a file that cannot be
read is made anew. Each is held below LIMIT_MB: what was not used for longest goes first.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import os
import time
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TypeVar

import numpy as np

#: Megabytes of a cache of arrays, unless $SUBDERMAL_CACHE_MB says otherwise; 0: nothing is kept.
LIMIT_MB = 1024
STALE_S = 3600.0  # a half written file that is older was left by a process that ended

Arrays = dict[str, np.ndarray]
T = TypeVar("T")


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


def parts(value: object) -> Iterator:
    """All that a value says, for `key`: its arrays one by one, and the repr of all else.

    Dataclasses, mappings, lists and tuples are gone through, sparse matrices as their arrays.
    """
    if isinstance(value, np.ndarray):
        yield value
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield type(value).__name__
        for one in dataclasses.fields(value):
            yield one.name
            yield from parts(getattr(value, one.name))
    elif isinstance(value, Mapping):
        yield f"{len(value)} by name"
        for name, one in value.items():
            yield name
            yield from parts(one)
    elif isinstance(value, list | tuple):
        yield f"{len(value)} in order"
        for one in value:
            yield from parts(one)
    elif hasattr(value, "tocsr"):
        sparse = value.tocsr()
        yield from (sparse.shape, sparse.data, sparse.indices, sparse.indptr)
    else:
        yield repr(value)


#: What reading a file that is not there or not whole raises.
UNREADABLE = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile)


def read(name: str, key: str, use: Callable[[np.lib.npyio.NpzFile], T]) -> T | None:
    """What `use` makes of the arrays of a key in the cache `name`, which it reads one by one; None
    where they are not there, or not whole.
    """
    if not limit_bytes():
        return None
    file = folder() / name / f"{key}.npz"
    try:
        with np.load(file, allow_pickle=False) as stored:
            os.utime(file)
            return use(stored)
    except UNREADABLE:
        return None


def there(name: str, key: str) -> bool:
    """Whether the cache `name` has a file of a key, whole or not."""
    return bool(limit_bytes()) and (folder() / name / f"{key}.npz").is_file()


def keep(name: str, key: str, arrays: Iterable[tuple[str, np.ndarray]]) -> None:
    """Keep arrays that are written as they are made, so that not all are in memory at once.

    A cache that cannot be written is said in a warning.
    """
    if not (most := limit_bytes()):
        return
    file = folder() / name / f"{key}.npz"
    try:
        _write(file, arrays, most)
        _prune(file.parent, most)
    except OSError as error:
        warnings.warn(f"nothing is kept in {file.parent}: {error}", stacklevel=2)


def kept(name: str, key: str, make: Callable[[], Arrays]) -> Arrays:
    """The arrays of a key from the cache `name`, or as `make` returns them, which are then kept.

    A cache that cannot be written is said in a warning, and the arrays are returned all the same.
    """
    if (stored := read(name, key, dict)) is not None:
        return stored
    arrays = make()
    keep(name, key, arrays.items())
    return arrays


def _write(file: Path, arrays: Iterable[tuple[str, np.ndarray]], most: int) -> None:
    """The file is there whole or not at all; what takes more than `most` bytes is not written."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    written = 0
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_STORED) as packed:
            for name, array in arrays:
                with packed.open(f"{name}.npy", "w", force_zip64=True) as stream:
                    np.lib.format.write_array(stream, np.asanyarray(array), allow_pickle=False)
                if (written := written + array.nbytes) > most:
                    return
        os.replace(part, file)
    finally:
        part.unlink(missing_ok=True)


def _prune(cache: Path, most: int) -> None:
    """Remove what was not used for longest until `most` bytes are left, and what killed processes
    left half written.
    """
    for path in cache.glob(".*.part"):
        with contextlib.suppress(FileNotFoundError):
            if time.time() - path.stat().st_mtime > STALE_S:
                path.unlink()
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
