"""What is sent of an image: its region of interest, pixel for pixel or resampled once, as lossless
WebP or PNG.

Made when it is first asked for and kept in the study's folder `renditions`, which can be removed at
any time. Both images of a pair go the same way, so that nothing but their pixels differs.
"""

from __future__ import annotations

import hashlib
import io
import threading
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import PIL.Image

from analysis.files import replacing
from stimuli.manifest import Image

FOLDER = "renditions"
#: Beyond this the files that were longest unused go, so that no visitor fills the disk.
MOST_BYTES = 2**30
#: Widths to which images are resampled are multiples of this: windows of any size share them.
STEP_PX = 16
LARGEST_PX = 8192
WEBP, PNG = "image/webp", "image/png"
#: Lossless; the rest trades time for size (half a second and two thirds of the PNG at 1920x1080).
_WEBP = {"format": "WEBP", "lossless": True, "exact": True, "quality": 50, "method": 4}
#: What a PNG may say of its pixels that a WebP cannot.
_CHANGE_PIXELS = {"gamma", "transparency"}
_locks: dict[str, threading.Lock] = {}


class Changed(Exception):
    """The file of an image is not there any more, or its bytes are others."""


@dataclass(frozen=True)
class Rendition:
    """The box (left, top, right, bottom; pixels) of an image at a width on the screen, pixels.

    amplify: what its difference from the reference, if there is one, is multiplied by.
    """

    image: Image
    width: int
    reference: Image | None = None
    amplify: float = 1.0

    @property
    def name(self) -> str:
        """Under which it is kept, without an ending."""
        box = "-".join(map(str, self.image.box))
        name = f"{self.image.sha256}_{box}_{self.width}"
        return f"{name}_{self.reference.sha256}_{self.amplify:g}" if self.reference else name

    @property
    def natural(self) -> tuple[int, int]:
        """Width and height of the box, image pixels."""
        left, top, right, bottom = self.image.box
        return right - left, bottom - top

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels; heights are rounded as the page's script does."""
        width, height = self.natural
        return self.width, max(1, (2 * self.width * height + width) // (2 * width))

    @property
    def offered(self) -> bool:
        """Whether it can be asked for: the box itself, or a step that is no unreasonable size."""
        width, _ = self.natural
        steps = self.width % STEP_PX == 0 and STEP_PX <= self.width <= min(4 * width, LARGEST_PX)
        return self.width == width or (steps and max(self.size) <= LARGEST_PX)


def rendition(rendered: Rendition, folder: Path, *, webp: bool) -> tuple[bytes, str]:
    """The bytes and their media type. webp: whether the browser takes it.

    Raises `Changed` where the file is not the one that the study was opened with.
    """
    image = rendered.image
    for one in filter(None, (image, rendered.reference)):
        check(one.path.resolve(), one.sha256)
    kept = folder / f"{rendered.name}.{'webp' if webp else 'png'}"
    with _locks.setdefault(kept.name, threading.Lock()):
        try:
            data = kept.read_bytes()
            kept.touch()
        except OSError:
            data = _made(rendered, webp)
            _keep(kept, data)
    return data, WEBP if data[8:12] == b"WEBP" else PNG if data[1:4] == b"PNG" else image.media_type


def check(path: Path, sha256: str) -> None:
    """Raise `Changed` unless the file is there with these bytes."""
    if not path.is_file() or _digest(path, path.stat().st_mtime_ns, path.stat().st_size) != sha256:
        raise Changed(f"{path} was changed or removed after the study was opened")


@lru_cache(maxsize=1024)
def _digest(path: Path, _mtime_ns: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _made(rendered: Rendition, webp: bool) -> bytes:
    path = rendered.image.path.resolve()
    with PIL.Image.open(path) as picture:
        plain = picture.mode in ("RGB", "RGBA", "L") and not picture.info.keys() & _CHANGE_PIXELS
        whole = rendered.natural == picture.size and rendered.width == picture.width
        if whole and not rendered.reference and (not plain or not webp):
            return path.read_bytes()  # nothing is gained, or something would be lost
        profile = picture.info.get("icc_profile")
        shown = _cut(picture, rendered)
    if rendered.reference:
        with PIL.Image.open(rendered.reference.path.resolve()) as picture:
            shown = amplified(shown, _cut(picture, rendered), rendered.amplify)
    out = io.BytesIO()
    more = {"icc_profile": profile} if profile else {}
    shown.save(out, **(_WEBP if webp else {"format": "PNG"}), **more)
    return out.getvalue()


def _cut(picture: PIL.Image.Image, rendered: Rendition) -> PIL.Image.Image:
    """The box of a picture, at the width."""
    picture.load()
    if picture.mode.startswith("I"):  # 16 bits of grey, which Pillow would clip
        picture = PIL.Image.fromarray((np.asarray(picture) // 257).astype(np.uint8))
    if picture.mode not in ("RGB", "RGBA", "L"):
        picture = picture.convert("RGBA" if "transparency" in picture.info else "RGB")
    if rendered.natural != picture.size:
        picture = picture.crop(rendered.image.box)
    return picture if picture.size == rendered.size else resampled(picture, rendered.size)


def amplified(
    picture: PIL.Image.Image, reference: PIL.Image.Image, factor: float
) -> PIL.Image.Image:
    """The reference with `factor` times the picture's difference from it, in sRGB values of 0 to
    255, rounded and held to that range; RGB.
    """
    one, other = (np.asarray(each.convert("RGB"), np.float64) for each in (picture, reference))
    return PIL.Image.fromarray(
        np.clip(np.rint(other + factor * (one - other)), 0, 255).astype(np.uint8)
    )


def resampled(picture: PIL.Image.Image, size: tuple[int, int]) -> PIL.Image.Image:
    """Lanczos, three lobes, in linear light (sRGB, IEC 61966-2-1), where the mean of black and
    white pixels is what an eye at a distance sees; RGB.
    """
    encoded = np.asarray(picture.convert("RGB"), np.float32) / 255
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    channels = [
        np.asarray(PIL.Image.fromarray(light[..., k]).resize(size, PIL.Image.Resampling.LANCZOS))
        for k in range(3)
    ]
    light = np.clip(np.stack(channels, axis=-1), 0, 1)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return PIL.Image.fromarray(np.rint(255 * encoded).astype(np.uint8))


def _keep(path: Path, data: bytes) -> None:
    """Write it down for the next who asks; where that cannot be done, it is made again then."""
    try:
        path.parent.mkdir(exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(data)
        files = [(one.stat(), one) for one in path.parent.iterdir()]
        total = sum(stat.st_size for stat, _ in files)
        for stat, one in sorted(files, key=lambda pair: pair[0].st_mtime):
            if total <= MOST_BYTES:
                break
            one.unlink(missing_ok=True)
            total -= stat.st_size
    except OSError:
        pass
