"""The manifest: what a study shows, image by image. The only thing that the questionnaire reads.

`stimuli.build` writes it; a study of ready-made images has it written by hand (`study` as in a
study's TOML file, `images` with `framing`, `technique`, `file`, `width`, `height`, `sha256`).
"""

import hashlib
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from analysis.manifest import (
    FORMATS,
    NAME,
    VISIBILITY,
    WHOLE,
    ManifestFile,
    open_manifest,
    region_box,
)
from stimuli.errors import InputError
from stimuli.study import FRAMING, Cell, Study, read_study
from stimuli.table import Table
from stimuli.viewing import FILES, FIT, ONE_TO_ONE

FORMAT = FORMATS[-1]
_MEDIA = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".webp": "image/webp"}


#: Folder of a built study: CELL.png, white where light scatters.
MASKS = "masks"


@dataclass(frozen=True)
class Image:
    """An image of the study; `renderer`, `head` and `scene` are None where it was made elsewhere.

    measures: what it cost and how far it is from the reference, where that is known (see
    `analysis.manifest.MEASURES`); region: the part that the study is about, which alone is shown
    and compared, left, top, right, bottom from 0 to 1.
    """

    cell: str
    technique: str
    file: str
    path: Path
    width: int
    height: int
    sha256: str
    parameters: dict = field(default_factory=dict)
    seed: int | None = None
    renderer: dict | None = None
    head: dict | None = None
    measures: dict = field(default_factory=dict)
    levels: dict = field(default_factory=dict)
    scene: dict | None = None
    region: tuple[float, float, float, float] = WHOLE

    @property
    def framing(self) -> str:
        """The level of the factor framing."""
        return self.levels[FRAMING]

    @property
    def box(self) -> tuple[int, int, int, int]:
        """The region of interest in whole pixels of the image: left, top, right, bottom."""
        return region_box(self.region, self.width, self.height)

    @property
    def media_type(self) -> str:
        """As in an HTTP header, from the file's ending."""
        return _MEDIA[self.path.suffix.lower()]


@dataclass(frozen=True)
class Manifest:
    """A study and its images, one for each cell and technique."""

    directory: Path
    study: Study
    images: tuple[Image, ...]
    licences: tuple[dict, ...]
    references: tuple[Image, ...] = ()

    @property
    def shown(self) -> tuple[Image, ...]:
        """All images that a page can show."""
        return self.images + self.references

    def reference(self, cell: str) -> Image | None:
        """What stands between the two images of a cell; None where nothing does."""
        viewer = self.study.viewer
        if not viewer.triplet:
            return None
        if viewer.reference != FILES:
            return self.image(cell, viewer.reference)
        return next(image for image in self.references if image.cell == cell)

    def image(self, cell: str, technique: str) -> Image:
        """The image of a technique in a cell, by its name; KeyError where there is no such pair."""
        for image in self.images:
            if (image.cell, image.technique) == (cell, technique):
                return image
        raise KeyError((cell, technique))


def load_manifest(directory: str | Path, verify: bool = True) -> Manifest:
    """Read DIR/manifest.json and validate it; with `verify` also each file's sha256 and size in
    pixels.
    """
    directory = Path(directory)
    file = open_manifest(directory / NAME)
    value = dict(file.value)
    table = Table(value, str(file.path))
    # before format 3 a study could not say how its images are shown: they fitted the window
    display = FIT if table.one_of("format", FORMATS) in FORMATS[:2] else ONE_TO_ONE
    study_table = table.table("study")
    study = read_study(study_table, display=display)
    study_table.end()
    entries = table.tables("images", least=1)
    for entry in entries:
        entry.value = {key: value for key, value in entry.value.items() if value is not None}
    images = tuple(_image(entry, study, file, place) for place, entry in enumerate(entries))
    references = _references(table, study, images, file)
    licences = table.tables("licences", least=0) if "licences" in value else []
    for licence in licences:
        for key in ("what", "licence", "source"):
            licence.text(key)
    if file.visibility:  # checked there
        table.take(VISIBILITY, dict)
    table.end()
    _one_each(study, images, entries, table)
    if verify:
        for image, entry in (*zip(images, entries), *references):
            _verify(image, entry)
    return Manifest(
        directory,
        study,
        images,
        tuple(licence.value for licence in licences),
        tuple(image for image, _ in references),
    )


def sha256(path: Path) -> str:
    """The sha256 of a file, in hexadecimal."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _references(
    table: Table, study: Study, images: tuple[Image, ...], manifest: ManifestFile
) -> list[tuple[Image, Table]]:
    """`references`: a file for each cell, as large as the cell's images, where the study's viewer
    says "files".
    """
    if "references" not in table.value and study.viewer.reference != FILES:
        return []
    read = []
    for entry in table.tables("references", least=1):
        cell = _cell(entry, study)
        like = next(image for image in images if image.cell == cell.name)
        image = Image(
            cell=cell.name,
            technique=FILES,
            **_file(entry, manifest),
            levels=cell.levels,
            region=like.region,
        )
        if (image.width, image.height) != (like.width, like.height):
            size = f"{(like.width, like.height)}, as the images at {cell.name}"
            raise entry.fault("width, height", (image.width, image.height), size)
        if any(other.cell == cell.name for other, _ in read):
            raise InputError(f"{entry.source}: {entry.key}: a second reference at {cell.name}")
        entry.end()
        read.append((image, entry))
    for cell in study.cells:
        if not any(image.cell == cell.name for image, _ in read):
            raise InputError(f"{table.source}: references: none at {cell.name}")
    return read


def _file(entry: Table, manifest: ManifestFile) -> dict:
    """The file of an image: its path, size and hash."""

    def inside(text: str) -> bool:
        parts = PurePosixPath(text)
        return (
            not parts.is_absolute() and ".." not in parts.parts and parts.suffix.lower() in _MEDIA
        )

    file = entry.take(
        "file",
        str,
        f"the path of a file inside the study's folder that ends in {', '.join(_MEDIA)}",
        inside,
    )
    return {
        "file": file,
        "path": manifest.path.parent / file,
        "width": entry.number("width", 1, 65535),
        "height": entry.number("height", 1, 65535),
        "sha256": entry.take("sha256", str, "64 hexadecimal digits in small letters", _is_sha256),
    }


def _image(entry: Table, study: Study, manifest: ManifestFile, place: int) -> Image:
    image = Image(
        cell=_cell(entry, study).name,
        technique=entry.one_of("technique", (condition.name for condition in study.techniques)),
        **_file(entry, manifest),
        parameters=entry.take("parameters", dict, default={}),
        seed=entry.take("seed", int, default=None),
        renderer=entry.take("renderer", dict, default=None),
        head=entry.take("head", dict, default=None),
        measures=manifest.measures(place),
        levels=_cell(entry, study).levels,
        scene=entry.take("scene", dict, default=None),
        region=manifest.region(place),
    )
    for key in ("measures", "region"):
        entry.take(key, object, "anything", default=None)
    entry.end()
    return image


def _cell(entry: Table, study: Study) -> Cell:
    """The cell of an image: `framing`, and `levels` with the level of each further factor."""
    framing = entry.one_of("framing", (level.name for level in study.framings))
    further = entry.table("levels", default={})
    levels = {FRAMING: framing}
    for factor in study.factors[1:]:
        levels[factor.name] = further.one_of(factor.name, (v.name for v in factor.levels))
    further.end()
    for cell in study.cells:
        if cell.levels == levels:
            return cell
    raise entry.fault("levels", levels, "levels of one of the study's cells")


def _is_sha256(text: str) -> bool:
    return len(text) == 64 and set(text) <= set("0123456789abcdef")


def _one_each(study: Study, images: tuple[Image, ...], entries: list[Table], table: Table) -> None:
    """Each cell and technique has one image, of a file of its own, in one size a framing and with
    one region a cell.
    """
    seen, files, sizes, regions = {}, {}, {}, {}
    for image, entry in zip(images, entries):
        pair, size = (image.cell, image.technique), (image.width, image.height)
        if pair in seen:
            raise InputError(
                f"{entry.source}: {entry.key}: a second image of {pair[1]} at {pair[0]}, after "
                f"{seen[pair]}"
            )
        if image.file in files:
            raise entry.fault(
                "file", image.file, f"a file that differs from that of {files[image.file]}"
            )
        if sizes.setdefault(image.framing, size) != size:
            raise entry.fault(
                "width, height",
                size,
                f"{sizes[image.framing]}, as the other images at {image.framing}",
            )
        if regions.setdefault(image.cell, image.region) != image.region:
            raise entry.fault(
                "region",
                list(image.region),
                f"{list(regions[image.cell])}, as the other images at {image.cell}",
            )
        seen[pair] = files[image.file] = entry.key
    for cell in study.cells:
        for condition in study.techniques:
            if (cell.name, condition.name) not in seen:
                raise InputError(f"{table.source}: images: none of {condition.name} at {cell.name}")


def _verify(image: Image, entry: Table) -> None:
    import PIL.Image

    if not image.path.is_file():
        raise entry.fault("file", image.file, f"a file that is there; {image.path} is not")
    digest = sha256(image.path)
    if digest != image.sha256:
        raise entry.fault(
            "sha256",
            image.sha256,
            f"that of {image.file}, {digest}; the file was changed after the manifest",
        )
    try:
        with PIL.Image.open(image.path) as picture:
            size = picture.size
    except (OSError, PIL.Image.DecompressionBombError) as error:
        raise entry.fault("file", image.file, "an image that can be read") from error
    if size != (image.width, image.height):
        raise entry.fault(
            "width, height", (image.width, image.height), f"{size}, the size of {image.file}"
        )
