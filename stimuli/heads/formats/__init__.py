"""Readers of a head's file, one module a format: each turns a `Source` into `Part`s and leaves
judging them to `stimuli.heads.scan`.

trimesh reads these formats too, but leaves out in silence what it does not understand or find: a
texture that is missing, a face whose index is out of range, a texture transform, packed texture
coordinates, a material whose library is not there. A picture in a study must not differ from the
scan without anybody being told.
"""

import hashlib
import os
import warnings
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path, PureWindowsPath

import numpy as np
from PIL import Image

from stimuli.errors import InputError

TEXTURE_LIMIT_PX = 8192
"""Textures are held to this many pixels a side: beyond it they cost gigabytes and many drivers
refuse them.
"""


UNNAMED = "head"
"""The name of a part that has none in the file."""


@dataclass(frozen=True, eq=False)
class Material:
    """How a part looks; None where the file does not say. Images are shared between materials by
    identity.
    """

    name: str | None = None
    albedo: np.ndarray | None = None  # (H, W, 3) uint8, sRGB
    base_colour: tuple[float, float, float] | None = (
        None  # linear, 0..1; meant only where there is no albedo
    )
    normal_map: np.ndarray | None = None  # (H, W, 3) uint8, tangent space, green up
    roughness: np.ndarray | None = None  # (H, W) uint8, perceptual roughness, 255 is 1
    roughness_factor: float | None = None  # 0..1; meant only where there is no roughness map


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles of one material, placed in the file's space, in the file's unit."""

    name: str
    positions: np.ndarray  # (n, 3) float64
    faces: np.ndarray  # (m, 3) int64, within range
    normals: np.ndarray | None  # (n, 3) float64, as given: not always of unit length
    uvs: np.ndarray | None  # (n, 2) float64, v up
    material: Material


@dataclass
class Source:
    """The file to read and those beside it: remembers the sha256 of all that was read, and what the
    user should be told.
    """

    path: Path
    files: dict[str, str] = field(
        default_factory=dict
    )  # name as referenced, no absolute path -> sha256
    notes: list[str] = field(default_factory=list)
    copyright: str | None = None  # what the file says of whose it is

    def error(self, message: str) -> InputError:
        """The error to raise, with the file named first."""
        return InputError(f"{self.path}: {message}")

    def note(self, message: str) -> None:
        """Say something once."""
        if message not in self.notes:
            self.notes.append(message)

    def content(self) -> bytes:
        """The scan file itself."""
        return self._read(self.path, self.path.name)

    def find(self, name: str) -> Path | None:
        """Where a file lies that the scan names: as it says, or, for a path of another machine,
        beside the scan.
        """
        plain = name.replace("\\", "/")
        places = (self.path.parent / plain, self.path.parent / plain.rpartition("/")[2])
        return next((place for place in places if os.path.isfile(place)), None)

    def beside(self, name: str, what: str) -> bytes:
        """A file that the scan names."""
        if (place := self.find(name)) is None:
            raise self.error(
                f"refers to the {what} {name!r}, which is not there; expected it in "
                f"{self.path.parent or '.'}"
            )
        return self._read(place, name)

    def _read(self, place: Path, name: str) -> bytes:
        try:
            data = place.read_bytes()
        except OSError as error:
            raise self.error(f"{name!r} cannot be read: {error.strerror}") from None
        plain = PureWindowsPath(name)  # which takes either slash
        self.files[plain.name if plain.anchor else plain.as_posix()] = hashlib.sha256(
            data
        ).hexdigest()
        return data

    def image(self, data: bytes, name: str) -> np.ndarray:
        """Decode an image to (H, W, 3) uint8, without alpha, at most `TEXTURE_LIMIT_PX` a side."""
        try:
            with warnings.catch_warnings(), Image.open(BytesIO(data)) as image:
                warnings.simplefilter("ignore", Image.DecompressionBombWarning)
                if image.mode.startswith(
                    "I"
                ):  # 16 bits of grey, which Pillow's own conversion would clip
                    image = Image.fromarray(
                        (np.asarray(image, np.int64) // 257).clip(0, 255).astype(np.uint8)
                    )
                image = image.convert("RGB")
        except Exception as error:  # Pillow's decoders raise nearly anything on damaged data
            reason = (
                str(error)
                if isinstance(error, (OSError, Image.DecompressionBombError))
                else type(error).__name__
            )
            if isinstance(error, Image.UnidentifiedImageError):
                reason = "no known image format"
            raise self.error(
                f"the texture {name!r} cannot be read ({reason}); expected a whole PNG, JPEG, "
                "TIFF or WebP image"
            ) from None
        if max(image.size) > TEXTURE_LIMIT_PX:
            self.note(
                f"the texture {name!r} has {image.width} x {image.height} pixels and was "
                f"reduced to {TEXTURE_LIMIT_PX} a side"
            )
            image.thumbnail((TEXTURE_LIMIT_PX, TEXTURE_LIMIT_PX), Image.Resampling.LANCZOS)
        return np.asarray(image)


def decode_srgb(encoded: np.ndarray) -> np.ndarray:
    """Linear values, 0..1, of sRGB ones, 0..1 (IEC 61966-2-1)."""
    encoded = np.asarray(encoded, np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encode_srgb(linear: np.ndarray) -> np.ndarray:
    """sRGB values, 0..1, of linear ones, held to 0..1 (IEC 61966-2-1)."""
    linear = np.clip(np.asarray(linear, np.float64), 0, 1)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
