"""People for the command line: drawn by a seed, and seen side by side, in the same scene, before
the same camera, by the same technique.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFont

from stimuli.heads.identity import Bounds, written
from stimuli.parts import PEOPLE, person_table
from stimuli.parts import names as known
from stimuli.scenes import load_table, merge, read_scene, stage
from stimuli.study import with_head

__all__ = ["Bounds", "everybody", "portraits", "sheet", "written"]
GAP, LINE = 6, 26
PAPER, INK = (24, 24, 26), (225, 225, 225)


def everybody() -> tuple[str, ...]:
    """The names of the people that ship."""
    return tuple(known(PEOPLE))


def portraits(
    names: Sequence[str],
    scene: str,
    patch: dict[str, Any],
    technique: str,
    size: tuple[int, int],
    supersample: int,
    seed: int,
) -> Iterator[tuple[str, Image.Image]]:
    """Each person's name and picture, one after the other, so that memory is that of one.

    Raises InputError for a person, scene or technique that there is not, before any is drawn.
    """
    import renderer

    chosen = renderer.make(technique)
    tables = [merge(with_head(load_table(scene), name), patch) for name in names]
    scenes = [read_scene(table) for table in tables]
    for name, definition in zip(names, scenes, strict=True):
        staged = stage(definition, seed)
        with (
            renderer.Renderer(
                staged.graph, size=size, supersample=supersample, seed=seed
            ) as drawing,
            drawing.frame() as frame,
        ):
            yield name, Image.fromarray(frame.render(chosen).image)


def sheet(pictures: Sequence[tuple[str, Image.Image]], columns: int) -> Image.Image:
    """The pictures in rows of so many, names and what they are about below."""
    width, height = pictures[0][1].size
    rows = -(-len(pictures) // columns)
    across, down = width + GAP, height + LINE + GAP
    page = Image.new("RGB", (columns * across + GAP, rows * down + GAP), PAPER)
    draw, font = ImageDraw.Draw(page), ImageFont.load_default(14)
    for k, (name, picture) in enumerate(pictures):
        x, y = GAP + k % columns * across, GAP + k // columns * down
        page.paste(picture, (x, y))
        about = person_table(name).get("about", "")
        words = f"{Path(name).stem}: {about}" if about else Path(name).stem
        while draw.textlength(words, font=font) > width and len(words) > 4:
            words = words[:-4] + "..."
        draw.text((x + width / 2, y + height + LINE / 2), words, font=font, fill=INK, anchor="mm")
    return page
