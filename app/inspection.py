"""The page of `subdermal inspect`: a study's images in the questionnaire's own viewer, without a
server, and beside them what was found.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, select_autoescape
from PIL import Image

from analysis.files import replacing
from app.renditions import FOLDER, Rendition, rendition
from stimuli.manifest import Manifest
from stimuli.viewing import Screen, shown_size

_HERE = Path(__file__).resolve().parent
#: The viewer's modules, what is imported first; on the page they are one script, as files opened
#: without a server may not import each other.
_MODULES = ("geometry.js", "pictures.js", "pair.js")
_WORDS = {"image": "Image", "loading": "Loading …", "resampled": "resampled, {percent} %"}
KINDS = {
    "brightness": "Brightness",
    "colour": "Colour",
    "clipped": "Clipped highlights",
    "noise": "Noise",
    "outside": "Differences outside the skin",
    "alike": "Pairs that look alike",
}


@dataclass(frozen=True)
class Fetched:
    """What the browser of somebody who is asked every pair fetches: images once each, in bytes."""

    images: int
    webp: int
    png: int
    screen: Screen

    @property
    def words(self) -> str:
        webp, png = (f"{size / 1e6:.2f} MB" for size in (self.webp, self.png))
        return (
            f"a browser on {self.screen.width}x{self.screen.height} fetches {self.images} images: "
            f"{webp} of lossless WebP, {png} of PNG where it takes no other"
        )


def fetched(manifest: Manifest) -> Fetched:
    """The same, at the size at which a question begins on the study's `[viewer.screen]`. Made as
    the server makes it and kept where it looks first, so that nobody waits for it.
    """
    viewer = manifest.study.viewer
    screen = viewer.screen or Screen()
    wanted = []
    for image in manifest.images:
        natural = Rendition(image, 0).natural
        shown = shown_size(viewer, screen, natural)
        width = shown.width if shown.fitted else natural[0]
        reference = manifest.reference(image.cell)
        if reference is not None:
            wanted.append(Rendition(reference, width))
        if viewer.boost is None:
            wanted.append(Rendition(image, width))
        else:
            wanted.append(Rendition(image, width, reference, viewer.boost.amplify))
    kept = manifest.directory / FOLDER
    each = {one.name: one for one in wanted}.values()
    sizes = [sum(len(rendition(one, kept, webp=webp)[0]) for one in each) for webp in (True, False)]
    return Fetched(len(each), *sizes, screen)


def script() -> str:
    """The pair viewer as one script."""
    parts = []
    for name in _MODULES:
        text = (_HERE / "static" / name).read_text(encoding="utf-8")
        text = re.sub(r"^import .*?;\n", "", text, flags=re.MULTILINE)
        parts.append(re.sub(r"^export ", "", text, flags=re.MULTILINE))
    return "\n".join(parts)


def write(manifest: Manifest, found: Any, out: Path) -> Path:
    """Write `index.html` into `out`, beside the difference maps, and return it.

    found: a stimuli.inspect.Inspection.
    """
    study = manifest.study
    cells = {}
    for image in manifest.images:
        label = next(study.cell_label(cell) for cell in study.cells if cell.name == image.cell)
        cell = cells.setdefault(image.cell, {"label": label, "images": {}})
        left, top, right, bottom = image.box
        cell["whole"] = {"width": image.width, "height": image.height}
        cell["images"][image.technique] = {
            "address": _address(image, out) + "?w=",
            "width": right - left,
            "height": bottom - top,
        }
    viewer = {**study.viewer.record(), "display": "1:1", "modes": ["beside", "flicker", "wipe"]}
    viewer = {key: viewer[key] for key in ("display", "modes", "surround", "zoom", "gap")}
    data = {
        "cells": cells,
        "labels": {one.name: one.label for one in study.techniques},
        "maps": {
            f"{pair.cell} {a} {b}": pair.map
            for pair in found.pairs
            for a, b in ((pair.a, pair.b), (pair.b, pair.a))
        },
        "viewer": {**viewer, "zoom": max(8, viewer["zoom"])},
        "words": _WORDS,
    }
    environment = Environment(
        loader=FileSystemLoader(_HERE / "templates"), autoescape=select_autoescape()
    )
    page = environment.get_template("inspection.html").render(
        study=study,
        found=found,
        kinds=KINDS,
        cells=cells,
        data=data,
        labels=data["labels"],
        has_jod=any(pair.jod is not None for pair in found.pairs),
        has_outside=any(pair.outside is not None for pair in found.pairs),
        style=(_HERE / "static" / "style.css").read_text(encoding="utf-8"),
        script=script(),
        json=json.dumps(data).replace("<", "\\u003c"),
        ink=study.viewer.ink,
        surround=study.viewer.surround,
    )
    file = out / "index.html"
    with replacing(file) as part:
        part.write_text(page, encoding="utf-8")
    return file


def _address(image, out: Path) -> str:
    """Where the page finds an image's region: the image itself where that is all of it."""
    from urllib.parse import quote

    if image.box == (0, 0, image.width, image.height):
        path = Path(os.path.relpath(image.path, out))
    else:
        path = Path("regions") / f"{image.cell}_{image.technique}.png"
        (out / "regions").mkdir(parents=True, exist_ok=True)
        with Image.open(image.path) as picture, replacing(out / path) as part:
            picture.convert("RGB").crop(image.box).save(part, format="PNG")
    return quote(path.as_posix())
