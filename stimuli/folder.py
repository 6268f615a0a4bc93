"""A study of one's own images: what the names of files in a folder say, and the study of them.

`read_folder` says which image shows which condition at which level, `create` makes the study's
folder (images/, study.toml, manifest.json), `refresh` writes its manifest anew after study.toml was
edited. An image of the study is `images/CELL_CONDITION.png`, as `stimuli.build` names them.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

from analysis.files import replacing
from stimuli import manifest
from stimuli.errors import InputError
from stimuli.parts import read_toml
from stimuli.study import FRAMING, RESERVED, Study, default_wording, read_study
from stimuli.table import Table

STUDY_FILE, IMAGES = "study.toml", "images"
ENDINGS = (".png", ".jpg", ".jpeg", ".webp")
#: Placeholders of a pattern: what is compared, and at which level; any other is a further factor.
CONDITION, LEVEL = "condition", "level"
SEPARATORS = ("__", "_", "-", " ", ".")
#: The level of a study whose names tell none.
ONLY_LEVEL = "all"
#: Part of a grid that must be there for names to be taken for one with gaps.
MOSTLY = 0.5
#: So many images at most are taken for conditions of one level where names tell no levels.
MOST_CONDITIONS = 20
#: Width of the window of most desktop screens, pixels.
COMMON_WINDOW_PX = 1920
_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")


@dataclass(frozen=True)
class Picture:
    """An image file: its path, its name within the folder without the ending, and what it says.

    levels: factor -> level, as written in the name; width, height in pixels.
    """

    path: Path
    name: str
    condition: str
    levels: dict[str, str]
    width: int
    height: int


@dataclass(frozen=True)
class Folder:
    """What a folder of images was understood to be.

    pattern: how names were read; guessed: whether nobody said so; notes: what to think about.
    """

    pattern: str
    guessed: bool
    pictures: tuple[Picture, ...]
    notes: tuple[str, ...] = ()
    names: dict[str, dict[str, str]] = field(default_factory=dict)

    @property
    def factors(self) -> tuple[str, ...]:
        return tuple(self.pictures[0].levels)

    @property
    def conditions(self) -> tuple[str, ...]:
        """As written in the names, in the order of the files."""
        return tuple(dict.fromkeys(one.condition for one in self.pictures))

    def levels(self, factor: str) -> tuple[str, ...]:
        return tuple(dict.fromkeys(one.levels[factor] for one in self.pictures))


def read_folder(directory: Path, pattern: str | None = None) -> Folder:
    """What the images in a folder (and its folders) are; InputError in one line where their names
    or the images themselves cannot make a study.

    pattern: of the names without their endings, such as "{level}_{condition}" or
    "{condition}/{light}_{level}"; guessed where it is None: folders are conditions and files are
    levels, or names are "{level}_{condition}" with whichever separator makes every combination
    occur, or each file is a condition.
    """
    files = _files(directory)
    names = [path.relative_to(directory).with_suffix("").as_posix() for path in files]
    for name, path in zip(names, files):
        if names.count(name) > 1:
            twins = sorted(str(other) for other, n in zip(files, names) if n == name)
            raise InputError(
                f"{path}: {len(twins)} images have this name with different endings "
                f"({', '.join(twins)}); expected one"
            )
    used, read = _guess(directory, names) if pattern is None else _read(directory, names, pattern)
    _check_grid(directory, used, read)
    pictures, notes = [], []
    for path, name in zip(files, names):
        condition, levels = read[name]
        width, height, remarks = _look_at(path)
        notes += remarks
        pictures.append(Picture(path, name, condition, levels, width, height))
    _check_sizes(pictures)
    folder = Folder(used, pattern is None, tuple(pictures), tuple(_merged(notes)))
    return Folder(**vars(folder) | {"names": _names(folder)})


def _files(directory: Path) -> list[Path]:
    if not directory.is_dir():
        raise InputError(f"{directory}: is no folder; expected a folder of images")
    files = [
        path
        for path in sorted(
            directory.rglob("*"), key=lambda path: _natural(str(path.with_suffix("")))
        )
        if path.is_file()
        and path.suffix.lower() in ENDINGS
        and not any(part.startswith(".") for part in path.relative_to(directory).parts)
    ]
    if len(files) < 2:
        raise InputError(
            f"{directory}: holds {len(files)} images; expected two at least, as files that end in "
            f"{', '.join(ENDINGS)}"
        )
    return files


def _natural(text: str) -> list:
    """A key that sorts 2 before 10."""
    parts = re.split(r"(\d+)", text.lower())
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts if part]


def _guess(directory: Path, names: list[str]) -> tuple[str, dict]:
    depths = {name.count("/") for name in names}
    if depths == {1}:
        return _guess_folders(directory, names)
    if depths != {0}:
        if len(depths) > 1:
            other = next(name for name in names if name.count("/") != names[0].count("/"))
            raise InputError(
                f"{directory}: images lie in folders of different depth, such as {names[0]} and "
                f"{other}; expected all in one folder, or all in folders side by side"
            )
        raise InputError(
            f"{directory}: images lie {max(depths)} folders deep, such as {names[0]}; expected "
            "--pattern to say what the folders are, such as '{person}/{condition}/{level}'"
        )
    if split := _best_split(names):
        return split
    return _incomplete_or_single(directory, names)


def _guess_folders(directory: Path, names: list[str]) -> tuple[str, dict]:
    """Folders are conditions, files levels; the folder's name within the file's says nothing."""
    pairs = {name: tuple(name.split("/")) for name in names}
    folders = {folder for folder, _ in pairs.values()}
    if len(folders) == 1:  # images alone in a folder of the folder
        used, read = _guess(directory, [file for _, file in pairs.values()])
        (folder,) = folders
        return f"{folder}/{used}", {f"{folder}/{file}": one for file, one in read.items()}
    pattern = "{condition}/{level}"
    if not _is_grid(pairs.values()):
        for mark in SEPARATORS:
            for repeated in (f"{{level}}{mark}{{condition}}", f"{{condition}}{mark}{{level}}"):
                read = _match_all(names, f"{{condition}}/{repeated}")
                if read and _is_grid([(c, *levels.values()) for c, levels in read.values()]):
                    return f"{{condition}}/{repeated}", read
    return pattern, {name: (folder, {FRAMING: file}) for name, (folder, file) in pairs.items()}


def _best_split(names: list[str]) -> tuple[str, dict] | None:
    """The split of all names into level, separator and condition under which every combination
    occurs; of several the one with the most levels, then with the shortest conditions.
    """
    given, first = set(names), names[0]
    best: tuple[tuple[int, int], str, dict] | None = None
    for mark in SEPARATORS:
        for match in re.finditer(re.escape(mark), first):
            level, condition = first[: match.start()], first[match.end() :]
            if not level or not condition:
                continue
            levels = [n[: -len(mark + condition)] for n in names if n.endswith(mark + condition)]
            conditions = [n[len(level + mark) :] for n in names if n.startswith(level + mark)]
            complete = {f"{one}{mark}{other}" for one, other in product(levels, conditions)}
            if len(conditions) < 2 or complete != given or len(complete) < len(names):
                continue
            rank = len(levels), len(level.rstrip("".join(SEPARATORS)))
            if best is None or rank > best[0]:
                read = {
                    f"{one}{mark}{other}": (other, {FRAMING: one})
                    for one, other in product(levels, conditions)
                }
                best = rank, f"{{level}}{mark}{{condition}}", read
    return best and (best[1], best[2])


def _incomplete_or_single(directory: Path, names: list[str]) -> tuple[str, dict]:
    """Names with a gap in their grid are refused, not taken for something else."""
    for mark in SEPARATORS:
        if all(mark in name.strip(mark) for name in names):
            pairs = [tuple(name.rsplit(mark, 1)) for name in names]
            levels, conditions = ({pair[k] for pair in pairs} for k in (0, 1))
            several = len(levels) > 1 and len(conditions) > 1
            if several and len(pairs) >= MOSTLY * len(levels) * len(conditions):
                read = {n: (c, {FRAMING: v}) for n, (v, c) in zip(names, pairs)}
                _check_grid(directory, f"{{level}}{mark}{{condition}}", read)
    if len(names) > MOST_CONDITIONS:
        raise InputError(
            f"{directory}: {len(names)} images whose names tell no levels, such as {names[0]}; "
            "expected names such as close-up_golubev.png, folders of one condition each, or "
            "--pattern"
        )
    return "{condition}", {name: (name, {FRAMING: ONLY_LEVEL}) for name in names}


def _read(directory: Path, names: list[str], pattern: str) -> tuple[str, dict]:
    """By a pattern that somebody gave."""
    known = _PLACEHOLDER.findall(pattern)
    rest = _PLACEHOLDER.sub("", pattern)
    if CONDITION not in known or "{" in rest or "}" in rest:
        raise InputError(
            f"--pattern is {pattern!r}; expected placeholders in braces, {{condition}} among them, "
            "such as '{level}_{condition}'"
        )
    for name in known:
        wrong = not re.fullmatch(r"[a-z][a-z0-9_]*", name) or (name in RESERVED - {FRAMING})
        if wrong:
            raise InputError(
                f"--pattern has {{{name}}}; expected a name of small letters, digits and '_' that "
                "is no column of the table of answers"
            )
    if LEVEL in known and FRAMING in known:
        raise InputError(f"--pattern is {pattern!r}; {{level}} and {{framing}} are the same")
    read = _match_all(names, pattern)
    if read is None:
        wrong = next(name for name in names if not re.fullmatch(_regex(pattern, "+?"), name))
        raise InputError(f"{directory}: {wrong} is not of the pattern {pattern}")
    return pattern, read


def _match_all(names: list[str], pattern: str) -> dict | None:
    """What names say by a pattern; None where one does not fit. Where a separator also occurs in
    what stands beside it, the reading under which every combination occurs.
    """
    chosen = None
    for repeat in ("+", "+?"):
        matches = [re.fullmatch(_regex(pattern, repeat), name) for name in names]
        if not all(matches):
            return None
        read = {}
        for name, match in zip(names, matches):
            values = match.groupdict()
            condition = values.pop(CONDITION)
            framing = values.pop(LEVEL, None) or values.pop(FRAMING, ONLY_LEVEL)
            read[name] = condition, {FRAMING: framing, **values}
        if chosen is None or _is_grid([(c, *v.values()) for c, v in read.values()]):
            chosen = read
    return chosen


def _regex(pattern: str, repeat: str) -> str:
    parts, known, at = [], set(), 0
    for match in _PLACEHOLDER.finditer(pattern):
        parts.append(re.escape(pattern[at : match.start()]))
        name, at = match[1], match.end()
        parts.append(f"(?P={name})" if name in known else f"(?P<{name}>[^/]{repeat})")
        known.add(name)
    return "".join([*parts, re.escape(pattern[at:])])


def _is_grid(rows: Iterable[tuple[str, ...]]) -> bool:
    """Whether every combination of the columns' values occurs, once."""
    rows = list(rows)
    size = 1
    for column in zip(*rows):
        size *= len(set(column))
    return len(set(rows)) == len(rows) == size


def _check_grid(directory: Path, pattern: str, read: dict) -> None:
    """Every level has every condition: pairs are compared within a level."""
    conditions = list(dict.fromkeys(condition for condition, _ in read.values()))
    by_cell: dict[tuple, dict[str, str]] = {}
    for name, (condition, levels) in read.items():
        seen = by_cell.setdefault(tuple(levels.values()), {})
        if condition in seen:
            raise InputError(
                f"{directory}: {seen[condition]} and {name} are both {condition} at "
                f"{', '.join(levels.values())} by the pattern {pattern}"
            )
        seen[condition] = name
    missing = [(cell, one) for cell in by_cell for one in conditions if one not in by_cell[cell]]
    if missing:
        cell, one = missing[0]
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise InputError(
            f"{directory}: no image of {one} at {', '.join(cell)}{more}, by the pattern {pattern}; "
            "expected every condition at every level (--pattern says how names are read)"
        )
    if len(conditions) < 2:
        raise InputError(
            f"{directory}: one condition alone, {conditions[0]}, by the pattern {pattern}; "
            "expected two at least (--pattern says how names are read)"
        )


def _look_at(path: Path) -> tuple[int, int, list[tuple[str, str]]]:
    """Width, height and remarks (what, of which file) of an image that can be shown as it is."""
    import PIL.Image

    def refused(got: str, expected: str) -> InputError:
        return InputError(f"{path}: {got}; expected {expected}")

    remarks = []
    try:
        with PIL.Image.open(path) as picture:
            picture.load()
            size, mode = picture.size, picture.mode
            if getattr(picture, "n_frames", 1) > 1:
                raise refused(f"has {picture.n_frames} frames", "a still image")
            if picture.getexif().get(0x0112, 1) != 1:
                raise refused("is to be turned by its EXIF data", "its pixels the right way up")
            if mode not in ("RGB", "RGBA", "L", "P"):
                raise refused(f"has pixels of the kind {mode}", "8 bits a channel, RGB or grey")
            if mode == "RGBA" or "transparency" in picture.info:
                lowest, _ = picture.convert("RGBA").getchannel("A").getextrema()
                if lowest < 255:
                    raise refused("has transparent pixels", "an opaque image")
            if picture.format == "JPEG":
                remarks.append(("lossy JPEG: what compression did is seen too", path.name))
            if picture.info.get("icc_profile"):
                remarks.append(("a colour profile, which browsers apply", path.name))
    except (OSError, SyntaxError, ValueError, PIL.Image.DecompressionBombError) as error:
        if isinstance(error, InputError):
            raise
        raise refused("cannot be read as an image", "a whole PNG, JPEG or WebP file") from None
    return *size, remarks


def _merged(remarks: list[tuple[str, str]]) -> Iterator[str]:
    for what in dict.fromkeys(what for what, _ in remarks):
        files = [file for one, file in remarks if one == what]
        yield f"{len(files)} image{'s' if len(files) > 1 else ''}, such as {files[0]}: {what}"


def _check_sizes(pictures: list[Picture]) -> None:
    first: dict[str, Picture] = {}
    for one in pictures:
        other = first.setdefault(one.levels[FRAMING], one)
        if (one.width, one.height) != (other.width, other.height):
            raise InputError(
                f"{one.path} has {one.width}x{one.height} pixels and {other.path} "
                f"{other.width}x{other.height}; expected one size at {one.levels[FRAMING]}"
            )


def _names(folder: Folder) -> dict[str, dict[str, str]]:
    """For conditions and each factor: what is written in file names -> a name for tables."""
    written = {CONDITION: folder.conditions, **{f: folder.levels(f) for f in folder.factors}}
    result: dict[str, dict[str, str]] = {}
    for kind, texts in written.items():
        slugs: dict[str, str] = {}
        for place, text in enumerate(texts, start=1):
            plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
            slug = re.sub(r"[^a-z0-9_-]+", "-", plain).strip("-_") or f"{kind}-{place}"
            if slug in slugs.values():
                twin = next(other for other, name in slugs.items() if name == slug)
                raise InputError(
                    f"{twin!r} and {text!r} both become the name {slug!r}; expected names that "
                    "differ in more than capitals, spaces and accents"
                )
            slugs[text] = slug
        result[kind] = slugs
    return result


def label(text: str) -> str:
    """What people read: as written, with spaces and a capital."""
    shown = " ".join(text.replace("_", " ").split()) or text
    return shown[:1].upper() + shown[1:] if shown.islower() else shown


def understood(folder: Folder) -> list[str]:
    """What was understood of the folder's names, as lines of a table to look through."""
    how = "guessed from the names; --pattern says otherwise" if folder.guessed else "as given"
    lines = [f"pattern     {folder.pattern}   ({how})"]
    kinds = [(CONDITION, "conditions", folder.conditions)]
    kinds += [
        (f, "levels" if f == FRAMING else f"{f} levels", folder.levels(f)) for f in folder.factors
    ]
    for kind, title, texts in kinds:
        width = max(len(folder.names[kind][text]) for text in texts)
        for place, text in enumerate(texts):
            of = [
                one
                for one in folder.pictures
                if (one.condition if kind == CONDITION else one.levels[kind]) == text
            ]
            sizes = sorted({f"{one.width}x{one.height}" for one in of})
            count = f"{len(of)} image{'s' if len(of) > 1 else ''}"
            lines.append(
                f"{title if not place else '':<12}{folder.names[kind][text]:<{width}}   "
                f"{label(text)!r}   {count} of {', '.join(sizes)}, {of[0].path.name}"
                + (", ..." if len(of) > 1 else "")
            )
    return lines


def create(
    folder: Folder,
    out: Path,
    *,
    name: str,
    title: str,
    question: str | None = None,
    seed: int = 1,
) -> Study:
    """Make the study's folder `out`, which must be new or empty, whole or not at all."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out} is there already; expected a new folder")
    out.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}."))
    try:
        (part / IMAGES).mkdir()
        text = _study_toml(folder, name, title, question, seed)
        (part / STUDY_FILE).write_text(text, "utf-8")
        for one in folder.pictures:
            shutil.copyfile(one.path, part / _file(folder, one))
        study = refresh(part)
        part.chmod(0o755)
        if out.is_dir():
            out.rmdir()
        os.replace(part, out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return study


def _file(folder: Folder, one: Picture) -> str:
    cell = ".".join(folder.names[factor][level] for factor, level in one.levels.items())
    condition = folder.names[CONDITION][one.condition]
    return f"{IMAGES}/{cell}_{condition}{one.path.suffix.lower()}"


def refresh(directory: Path) -> Study:
    """Write manifest.json from study.toml and the images beside it, and check all of it."""
    source = directory / STUDY_FILE
    if not source.is_file():
        raise InputError(f"{source}: no such file; `subdermal study new` makes one")
    table = Table(read_toml(source), str(source))
    study = read_study(table)
    table.end()
    images = []
    for cell, condition in product(study.cells, study.techniques):
        stem = f"{cell.name}_{condition.name}"
        files = [
            path
            for path in sorted((directory / IMAGES).glob(f"{stem}.*"))
            if path.stem == stem and path.suffix.lower() in ENDINGS
        ]
        if len(files) != 1:
            raise InputError(
                f"{directory / IMAGES}: {len(files)} images are named {stem}; expected one, as a "
                f"file that ends in {', '.join(ENDINGS)}"
            )
        width, height, _ = _look_at(files[0])
        further = {k: v for k, v in cell.levels.items() if k != FRAMING}
        region = next(one.region for one in study.framings if one.name == cell.framing)
        images.append(
            {
                "framing": cell.framing,
                **({"levels": further} if further else {}),
                "technique": condition.name,
                "file": f"{IMAGES}/{files[0].name}",
                "width": width,
                "height": height,
                **({"region": list(region)} if region != (0, 0, 1, 1) else {}),
                "sha256": manifest.sha256(files[0]),
            }
        )
    record = {"format": manifest.FORMAT, "study": study.record(), "images": images}
    with replacing(directory / manifest.NAME) as part:
        part.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", "utf-8")
    return manifest.load_manifest(directory).study


def remarks(study: Study, directory: Path) -> list[str]:
    """What to think about before people are asked."""
    widest = max(image.box[2] - image.box[0] for image in manifest.load_manifest(directory).images)
    if 2 * widest <= COMMON_WINDOW_PX or study.viewer.display != "1:1":
        return []
    return [
        f"two images of {widest} pixels need a window of {2 * widest}; smaller ones show the "
        'middle of each, to be moved: [viewer] display = "fit" or a region of each level in '
        f"{STUDY_FILE} changes that"
    ]


def _text(value: str) -> str:
    """A TOML string."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _study_toml(folder: Folder, name: str, title: str, question: str | None, seed: int) -> str:
    wording = default_wording("en", rendered=False)
    asked = {**wording["question"], **({"text": question} if question else {})}
    lines = [
        "# What this study asks. After a change here or in images/: subdermal study refresh DIR",
        "# What else a study can say: docs/studies.md",
        "",
        f"name = {_text(name)}",
        f"title = {_text(title)}",
        "version = 1",
        f"seed = {seed}   # draws orders and sides",
        "",
        "# {recorded} stands for what is stored, {questions} and {minutes} for how much is asked.",
        f"consent = {_text(wording['consent'])}",
        "",
        "[question]",
        *(f"{key} = {_text(value)}" for key, value in asked.items()),
        "",
        "# Five answers, or two (values -1, 1), or three.",
    ]
    for level in wording["scale"]:
        lines += ["[[scale]]", f"value = {level['value']}", f"label = {_text(level['label'])}", ""]
    rating = wording["familiarity"]
    lines += [
        "# A self-rating before the pairs.",
        "[familiarity]",
        f"question = {_text(rating['question'])}",
        f"labels = [{', '.join(map(_text, rating['labels']))}]",
        "",
        "[viewer]",
        'display = "1:1"   # image pixels are screen pixels; "fit": as large as the window allows',
        'modes = ["beside", "flicker", "wipe"]',
        "",
        "# How people are checked: these are asked beside the pairs.",
        "[quality]",
        "practice = 1      # pairs before the others",
        "repeats = 0       # pairs that are asked again",
        "",
        "# Declared before anybody is asked, used by subdermal analyse (docs/analysis.md).",
        "[analysis]",
        "margin = 0.25     # as good as each other: a mean within this, on the scale from -2 to 2",
        "",
        "# What is compared; the order is that of every table and figure.",
    ]
    for written, slug in folder.names[CONDITION].items():
        lines += ["[[techniques]]", f'name = "{slug}"', f"label = {_text(label(written))}", ""]
    lines += ["# Where it is compared: pairs are of one level."]
    for written, slug in folder.names[FRAMING].items():
        lines += ["[[framings]]", f'name = "{slug}"', f"label = {_text(label(written))}", ""]
    for factor in folder.factors[1:]:
        lines += ["[[factors]]", f'name = "{factor}"', f"label = {_text(label(factor))}", ""]
        for written, slug in folder.names[factor].items():
            lines += ["[[factors.levels]]", f'name = "{slug}"', f"label = {_text(label(written))}"]
            lines.append("")
    return "\n".join(lines)
