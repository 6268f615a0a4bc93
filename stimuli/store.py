"""A study's images in an object store or any other place that fsspec has an address for.

What is kept there are the files of the manifest under their names, and the manifest. Hashes decide:
a file that is there as the manifest says is not sent again, and one that comes otherwise than the
manifest says is refused and not kept.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.files import replacing
from stimuli import manifest
from stimuli.errors import InputError

AT_ONCE = 8  # files on their way


@dataclass(frozen=True)
class Moved:
    """How many files were sent or fetched, and how many were there already."""

    moved: int
    kept: int


def push(directory: Path, url: str, progress: Callable = lambda steps, total: steps) -> Moved:
    """Send the images of the study in a folder, each read back, and then its manifest.

    progress wraps the steps, whose number it is given.
    """
    study = manifest.load_manifest(directory)
    files, place = _place(url)

    def send(image: manifest.Image) -> bool:
        name = f"{place}/{image.file}"
        if _sha256(files, name) == image.sha256:
            return False
        _make_parent(files, name)
        files.put_file(str(image.path), name)
        if (arrived := _sha256(files, name)) != image.sha256:
            raise InputError(f"{url}/{image.file}: arrived as {arrived}; expected {image.sha256}")
        return True

    sent = _all(send, study.shown, progress)
    files.put_file(str(directory / manifest.NAME), f"{place}/{manifest.NAME}")
    return Moved(sum(sent), len(sent) - sum(sent))


def pull(url: str, directory: Path, progress: Callable = lambda steps, total: steps) -> Moved:
    """Fetch a study into a folder: its manifest where there is none, the images that are missing or
    others; InputError where one is not what the manifest says.
    """
    files, place = _place(url)
    if not (directory / manifest.NAME).exists():
        data = _read(files, f"{place}/{manifest.NAME}", url)
        directory.mkdir(parents=True, exist_ok=True)
        with replacing(directory / manifest.NAME) as part:
            part.write_bytes(data)
    study = manifest.load_manifest(directory, verify=False)

    def fetch(image: manifest.Image) -> bool:
        if image.path.is_file() and manifest.sha256(image.path) == image.sha256:
            return False
        data = _read(files, f"{place}/{image.file}", url)
        if (arrived := hashlib.sha256(data).hexdigest()) != image.sha256:
            raise InputError(f"{url}/{image.file}: is {arrived}; expected {image.sha256}")
        image.path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(image.path) as part:
            part.write_bytes(data)
        return True

    fetched = _all(fetch, study.shown, progress)
    manifest.load_manifest(directory)
    return Moved(sum(fetched), len(fetched) - sum(fetched))


def _all(move: Callable, images: Iterable[manifest.Image], progress: Callable) -> list[bool]:
    """Several at once; one file that two images name is moved once."""
    different = list({image.file: image for image in images}.values())
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return list(progress(pool.map(move, different), len(different)))


def _place(url: str) -> tuple[Any, str]:
    """The file system of an address and the path in it."""
    import fsspec

    try:
        files, path = fsspec.core.url_to_fs(url)
    except (ValueError, ImportError) as error:  # an unknown kind, or one whose package is not here
        raise InputError(
            f"{url}: {' '.join(str(error).split())}; expected an address of fsspec, as "
            "s3://bucket/study, whose package is installed"
        ) from error
    return files, path.rstrip("/")


def _read(files: Any, path: str, url: str) -> bytes:
    try:
        return files.cat_file(path)
    except FileNotFoundError:
        raise InputError(
            f"{url}: has no {path}; expected what `subdermal store push` sent"
        ) from None


def _sha256(files: Any, path: str) -> str | None:
    try:
        return hashlib.sha256(files.cat_file(path)).hexdigest()
    except FileNotFoundError:
        return None


def _make_parent(files: Any, path: str) -> None:
    files.makedirs(path.rpartition("/")[0], exist_ok=True)
