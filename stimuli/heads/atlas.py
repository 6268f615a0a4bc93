"""One material for a head of many: textures are laid side by side, and the texture coordinates
follow.
"""

from dataclasses import replace

import numpy as np
from PIL import Image

from stimuli.heads.formats import TEXTURE_LIMIT_PX, Material, Part, Source, encode_srgb

GUTTER = (
    1 / 32
)  # of a cell's inner side: repeats the border, so that filtering and mipmaps do not mix neighbours
UNKNOWN_COLOUR = (
    0.8,
    0.8,
    0.8,
)  # linear: of a part without colour among coloured ones; what MTL viewers show
UNKNOWN_ROUGHNESS = 0.5
GREY = 0.03  # linear: no skin's channels are as near as that; modelling programs show such colours


def combine(source: Source, parts: list[Part]) -> tuple[list[Part], Material]:
    """Give all parts one material: theirs if they look alike, else an atlas with a cell for each
    look.

    In an atlas a texture that repeats can serve only faces that stay within one repetition;
    anything else is refused.
    """
    for part in parts:
        if part.uvs is None and _has_texture(part.material):
            raise source.error(f"the part {part.name!r} has a texture but no texture coordinates")
    if not any(_has_texture(part.material) for part in parts):
        tints = [part.material.base_colour for part in parts if part.material.base_colour]
        if tints and all(max(tint) - min(tint) <= GREY for tint in tints):
            source.note(
                "its colours are greys and were left out; give an albedo image or a person's skin"
            )
            return parts, Material()
    looks = {_look(part.material): part.material for part in parts}
    materials = list(looks.values())
    if len(materials) == 1:
        return parts, materials[0]
    columns = int(np.ceil(np.sqrt(len(materials))))
    rows = -(-len(materials) // columns)
    if any(map(_has_texture, materials)):
        source.note(
            f"its {len(materials)} materials were laid out in one atlas of {columns} x {rows} cells"
        )

    def sheet(name: str, fill) -> np.ndarray | None:
        """The atlas of one kind of texture; `fill` gives the value of a material without it. None
        where no material has it.
        """
        images = [getattr(material, name) for material in materials]
        present = [image for image in images if image is not None]
        if not present and (
            name != "albedo" or all(material.base_colour is None for material in materials)
        ):
            return None
        step = round(1 / GUTTER)
        wanted = max((max(image.shape[:2]) for image in present), default=1)
        fitting = TEXTURE_LIMIT_PX // columns // (step + 2)  # gutter widths in pixels
        gutter = min(-(-wanted // step), fitting)
        if -(-wanted // step) > fitting:
            source.note(
                f"its {name.replace('_', ' ')} textures were reduced from {wanted} to "
                f"{gutter * step} pixels a side for the atlas"
            )
        side, cell = gutter * step, gutter * (step + 2)
        depth = (3,) if name != "roughness" else ()
        result = np.zeros((rows * cell, columns * cell, *depth), np.uint8)
        for i, (material, image) in enumerate(zip(materials, images, strict=True)):
            row, column = divmod(i, columns)
            if image is None:
                inner = np.broadcast_to(
                    np.rint(np.multiply(fill(material), 255)).astype(np.uint8), (side, side, *depth)
                )
            else:
                inner = np.asarray(
                    Image.fromarray(image).resize((side, side), Image.Resampling.LANCZOS)
                )
            border = [(gutter, gutter)] * 2 + [(0, 0)] * len(depth)
            result[row * cell : (row + 1) * cell, column * cell : (column + 1) * cell] = np.pad(
                inner, border, mode="edge"
            )
        return result

    def roughness_of(material: Material) -> float:
        return UNKNOWN_ROUGHNESS if material.roughness_factor is None else material.roughness_factor

    atlas = Material(
        albedo=sheet(
            "albedo", lambda material: encode_srgb(material.base_colour or UNKNOWN_COLOUR)
        ),
        normal_map=sheet("normal_map", lambda _: (128 / 255, 128 / 255, 1)),
        roughness=sheet("roughness", roughness_of),
    )
    cells = {
        look: (i % columns, rows - 1 - i // columns) for i, look in enumerate(looks)
    }  # from the lower left: v is up
    placed = []
    for part in parts:
        part = (
            _within_one_tile(source, part)
            if _has_texture(part.material)
            else replace(part, uvs=np.full((len(part.positions), 2), 0.5))
        )
        within = (GUTTER + part.uvs) / (1 + 2 * GUTTER)
        placed.append(replace(part, uvs=(cells[_look(part.material)] + within) / (columns, rows)))
    return placed, atlas


def _has_texture(material: Material) -> bool:
    return any(
        image is not None for image in (material.albedo, material.normal_map, material.roughness)
    )


def _look(material: Material) -> tuple:
    """What tells two materials apart."""
    images = tuple(
        id(image)
        for image in (material.albedo, material.normal_map, material.roughness)
        if image is not None
    )
    return images, material.base_colour if material.albedo is None else None


def _within_one_tile(source: Source, part: Part) -> Part:
    """Shift each face by whole repetitions of the texture so that it lies in [0, 1], parting
    vertices where neighbours differ.
    """
    corners = part.uvs[part.faces]  # (m, 3, 2)
    shift = np.floor(corners.min(axis=1) + GUTTER / 2)
    if (corners - shift[:, None]).max() > 1 + GUTTER / 2:
        raise source.error(
            f"the part {part.name!r} repeats its texture across faces, which an atlas of "
            "several cannot; bake one texture"
        )
    if not shift.any():
        return part
    keys = np.column_stack([part.faces.reshape(-1), np.repeat(shift, 3, axis=0)]).astype(np.int64)
    unique, faces = np.unique(keys, axis=0, return_inverse=True)
    vertex = unique[:, 0]
    return replace(
        part,
        positions=part.positions[vertex],
        faces=faces.reshape(-1, 3),
        normals=None if part.normals is None else part.normals[vertex],
        uvs=part.uvs[vertex] - unique[:, 1:],
    )
