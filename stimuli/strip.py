"""A comparison strip: the same crop of every condition of a study, side by side and named, pixel
for pixel.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from stimuli.errors import InputError
from stimuli.manifest import load_manifest

BAND_PX = 34
GAP_PX = 4
CROP = re.compile(r"(\d+)x(\d+)\+(\d+)\+(\d+)")


def parse_crop(text: str) -> tuple[int, int, int, int]:
    """(x, y, width, height) from "WIDTHxHEIGHT+X+Y", ImageMagick's geometry."""
    match = CROP.fullmatch(text)
    if not match or not int(match[1]) or not int(match[2]):
        raise InputError(
            f"the crop is {text!r}; expected WIDTHxHEIGHT+X+Y, such as 400x400+760+480"
        )
    width, height, x, y = map(int, match.groups())
    return x, y, width, height


def strip(
    folder: str | Path, framings: Sequence[str], crops: list[tuple[int, int, int, int]]
) -> Image.Image:
    """One column a condition in the study's order, for each framing one row a crop (the whole image
    without crops), names above.
    """
    manifest = load_manifest(Path(folder))
    names = [f.name for f in manifest.study.framings]
    for framing in framings:
        if framing not in names:
            known = ", ".join(names)
            raise InputError(f"{folder}: no framing {framing!r}; expected one of {known}")
    paths = {(i.framing, i.technique): i.path for i in reversed(manifest.images)}
    columns = [
        (c.label, [Image.open(paths[framing, c.name]).convert("RGB") for framing in framings])
        for c in manifest.study.techniques
    ]
    width, height = columns[0][1][0].size
    boxes = crops or [(0, 0, width, height)]
    for x, y, w, h in boxes:
        if x + w > width or y + h > height or w != boxes[0][2]:
            raise InputError(
                f"the crop {w}x{h}+{x}+{y} does not fit; expected one width for all crops, "
                f"inside {width}x{height}"
            )
    column = boxes[0][2]
    sheet = Image.new(
        "RGB",
        (
            len(columns) * (column + GAP_PX) - GAP_PX,
            BAND_PX + len(framings) * sum(h + GAP_PX for *_, h in boxes) - GAP_PX,
        ),
        (24, 24, 26),
    )
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(20)
    for k, (label, images) in enumerate(columns):
        left, top = k * (column + GAP_PX), BAND_PX
        draw.text(
            (left + column / 2, BAND_PX / 2), label, font=font, fill=(236, 236, 236), anchor="mm"
        )
        for image, (x, y, w, h) in product(images, boxes):
            sheet.paste(image.crop((x, y, x + w, y + h)), (left, top))
            top += h + GAP_PX
    return sheet
