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
    """The box (left, top, right, bottom; pixels) of an image at a width on the screen, pixels."""

    image: Image
    width: int

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
    path = image.path.resolve()
    check(path, image.sha256)
    box = "-".join(map(str, image.box))
    kept = folder / f"{image.sha256}_{box}_{rendered.width}.{'webp' if webp else 'png'}"
    with _locks.setdefault(kept.name, threading.Lock()):
        try:
            data = kept.read_bytes()
            kept.touch()
        except OSError:
            data = _made(rendered, path, webp)
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


def _made(rendered: Rendition, path: Path, webp: bool) -> bytes:
    with PIL.Image.open(path) as picture:
        picture.load()
        plain = picture.mode in ("RGB", "RGBA", "L") and not picture.info.keys() & _CHANGE_PIXELS
        whole = rendered.natural == picture.size and rendered.width == picture.width
        if whole and (not plain or not webp):
            return path.read_bytes()  # nothing is gained, or something would be lost
        profile = picture.info.get("icc_profile")
        if picture.mode.startswith("I"):  # 16 bits of grey, which Pillow would clip
            picture = PIL.Image.fromarray((np.asarray(picture) // 257).astype(np.uint8))
        if picture.mode not in ("RGB", "RGBA", "L"):
            picture = picture.convert("RGBA" if "transparency" in picture.info else "RGB")
        if not whole:
            picture = picture.crop(rendered.image.box)
        if picture.size != rendered.size:
            picture = resampled(picture, rendered.size)
        out = io.BytesIO()
        more = {"icc_profile": profile} if profile else {}
        picture.save(out, **(_WEBP if webp else {"format": "PNG"}), **more)
        return out.getvalue()


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
