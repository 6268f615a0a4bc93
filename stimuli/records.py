"""What a build has finished: a small file for each image, DIR/records/NAME.json.

It holds the key of what the image was made from, its entry in the manifest, the licences and notes
of its scene. Whoever draws an image writes its record after it, so that several processes can work
on one folder, and what any of them finished stays finished whatever becomes of it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from analysis.files import replacing
from stimuli import manifest
from stimuli.errors import InputError

FOLDER = "records"
FORMAT = "subdermal-record/1"
#: Where earlier versions kept all records; the first edition's lack licences and notes.
OLD_FILE = "build.json"
OLD_FORMAT, FIRST_FORMAT = "subdermal-build/2", "subdermal-build/1"
#: The key of a record whose image is to be rendered anew, whatever it was made from.
NO_KEY = ""


def read(out: Path) -> dict[str, dict]:
    """The finished images by file: {"key", "image", "licences", "notes"}.

    Reads the file of an earlier version too, whose first edition's images get a key that no image
    has. Refuses a folder whose manifest is not a build's.
    """
    records = _read_old(out)
    for path in sorted((out / FOLDER).glob("*.json")):
        done = _read_json(path)
        if done.pop("format", None) != FORMAT or not {"file", "key", "image"} <= set(done):
            raise _foreign(path)
        records[done.pop("file")] = done
    if not records and not (out / FOLDER).is_dir() and (out / manifest.NAME).exists():
        raise InputError(
            f"{out / manifest.NAME}: not written by a build, and not overwritten: choose "
            "another folder"
        )
    return records


def read_one(out: Path, file: str) -> dict | None:
    """The record of an image, None where there is none."""
    path = place(out, file)
    return _read_json(path) if path.is_file() else None


def named(out: Path) -> set[str]:
    """The images that have a record."""
    return {f"images/{name[:-5]}.png" for name in os.listdir(out / FOLDER) if name[-5:] == ".json"}


def write(out: Path, file: str, done: dict) -> None:
    """Keep the record of an image, whole or not at all."""
    write_json(place(out, file), {"format": FORMAT, "file": file, **done})


def write_json(path: Path, record: dict) -> None:
    """Write JSON in UTF-8, whole or not at all."""
    text = json.dumps(record, indent=2, ensure_ascii=False) + "\n"
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def upgrade(out: Path, records: dict[str, dict]) -> None:
    """Make the folder of records, and put the one file of an earlier version into it."""
    (out / FOLDER).mkdir(parents=True, exist_ok=True)
    if (out / OLD_FILE).exists():
        for file, done in records.items():
            write(out, file, done)
        (out / OLD_FILE).unlink()


def remove(out: Path, file: str) -> None:
    place(out, file).unlink(missing_ok=True)


def place(out: Path, file: str) -> Path:
    """Where the record of an image, images/NAME.png, is."""
    return out / FOLDER / f"{Path(file).stem}.json"


def is_finished(out: Path, file: str, key: str, done: dict | None) -> bool:
    """Whether an image is there as its record says, and made from what the key stands for."""
    if done is None or done["key"] != key or not (out / file).is_file():
        return False
    return manifest.sha256(out / file) == done["image"]["sha256"]


def _read_old(out: Path) -> dict[str, dict]:
    path = out / OLD_FILE
    if not path.exists():
        return {}
    record = _read_json(path)
    images = record.get("images")
    if isinstance(images, dict):
        if record.get("format") == OLD_FORMAT:
            return images
        if record.get("format") == FIRST_FORMAT:
            return {
                file: {"licences": [], "notes": [], **done, "key": NO_KEY}
                for file, done in images.items()
            }
    raise _foreign(path)


def _read_json(path: Path) -> dict:
    try:
        record = json.loads(path.read_bytes())
    except ValueError:
        raise _foreign(path) from None
    if not isinstance(record, dict):
        raise _foreign(path)
    return record


def _foreign(path: Path) -> InputError:
    return InputError(
        f"{path}: not the record of a build of this version: choose another folder, or delete "
        "it to render anew what it stands for"
    )
