"""What a scene's renderer draws once, kept on disk by all that it follows from.

`shadows`: the lamps' maps, and what of each lamp's light reaches each point of hair; one file a
scene. `views`: a frame's shared buffers and the light that comes through; one file a scene, camera
and size. Texels are kept in the type of their textures, so that what is read is what was drawn, to
the bit; their keys say the OpenGL driver and hash every file of the renderer that draws.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from renderer import caches, gl
from renderer.passes.hair import Hair
from renderer.passes.lamps import Lamps
from renderer.passes.surfaces import Drawn
from renderer.scene.graph import Contents

ROOT = Path(__file__).parent
CACHES = ("shadows", "views")
#: Folders whose files are hashed, and files beside them.
FOLDERS = ("gl", "optics", "passes", "scene", "shaders")
FILES = ("frame.py", "kept.py", "renderer.py")
SUFFIXES = (".py", ".frag", ".vert", ".geom", ".glsl")
ROWS = 256  # of a buffer that are in memory at once


@cache
def _drawn_by() -> tuple[Path, ...]:
    files = [path for name in FOLDERS for path in (ROOT / name).rglob("*")]
    return (*(path for path in files if path.suffix in SUFFIXES), *(ROOT / f for f in FILES))


def scene_key(contents: Contents, drawn: list[Drawn], surroundings: tuple, *rest) -> str:
    """Of all that a scene's maps and buffers follow from but the camera.

    drawn: surfaces and eyes with their baked light; surroundings: `Surroundings.content`; rest:
    seeds, sizes and what OpenGL says of itself.
    """
    parts = [*caches.parts(contents.lights), *surroundings, *rest]
    for one in drawn:
        parts += [*_primitive(one.item.primitive), one.item.pose, one.item.mesh, one.id]
        parts += caches.parts(one.baked)
    for item in contents.strands:
        parts += [*caches.parts(item.primitive.strands), item.pose, item.mesh]
    return caches.key(parts, _drawn_by(), ("numpy", "scipy"))


def view_key(scene: str, *camera) -> str:
    """Of a frame's buffers. scene: `scene_key`; camera: arrays and sizes."""
    return caches.key([scene, *camera], (), ())


def _primitive(part) -> Iterator:
    if hasattr(part, "eye"):
        yield from caches.parts(part.eye)
        return
    yield from (part.positions, part.normals, part.faces, part.masks)
    yield from caches.parts([part.texcoord_0, part.scatters, part.landmarks])
    yield from caches.parts([part.material.value, part.material.maps])


def load_shadows(key: str, lamps: Lamps, hair: list[Hair]) -> bool:
    """Fill the lamps' maps and the hair's light from the cache; False where they are not there."""

    def fill(stored) -> bool:
        for name, texture in lamps.maps().items():
            texture.set_bits(stored[name])
        for k, own in enumerate(hair):
            own.set_lit(stored[f"hair_{k}"])
        return True

    return bool(caches.read("shadows", key, fill))


def keep_shadows(key: str, lamps: Lamps, hair: list[Hair]) -> None:
    """Put the lamps' maps and the hair's light into the cache."""

    def arrays() -> Iterator[tuple[str, np.ndarray]]:
        for name, texture in lamps.maps().items():
            yield name, texture.bits()
        for k, own in enumerate(hair):
            yield f"hair_{k}", own.lit()

    caches.keep("shadows", key, arrays())


def load_view(key: str, target: gl.Target) -> bool:
    """Fill a target's textures from the cache; False where they are not there, or not whole."""

    def fill(stored) -> bool:
        for low, high in _bands(target.height):
            shape = (high - low, target.width)
            packed = stored[f"covered_{low}"]
            covered = np.unpackbits(packed, count=shape[0] * shape[1]).reshape(shape) > 0
            for k, texture in enumerate(target.textures):
                values = stored[f"{k}_{low}"]
                texels = np.zeros((*shape, values.shape[1]), values.dtype)
                texels[covered] = values
                texture.write_rows(low, texels)
        return True

    return bool(caches.read("views", key, fill))


def keep_view(key: str, target: gl.Target) -> None:
    """Put a target's textures into the cache: of the pixels where one of them is not 0."""

    def arrays() -> Iterator[tuple[str, np.ndarray]]:
        for low, high in _bands(target.height):
            bands = [target.read_rows(k, low, high) for k in range(len(target.textures))]
            covered = np.zeros((high - low, target.width), bool)
            for band in bands:
                for channel in range(band.shape[2]):
                    covered |= band[..., channel] != 0
            yield f"covered_{low}", np.packbits(covered)
            for k, band in enumerate(bands):
                yield f"{k}_{low}", band[covered]

    caches.keep("views", key, arrays())


def _bands(height: int) -> Iterator[tuple[int, int]]:
    for low in range(0, height, ROWS):
        yield low, min(low + ROWS, height)
