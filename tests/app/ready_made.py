"""A study of ready-made images: written by hand, no renderer."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
from PIL import Image

FRAMINGS = ("close-up", "head-shot", "half-length")
TECHNIQUES = ("none", "jimenez_separable", "golubev", "golubev_plus", "jimenez_gaussian")


def write_study(directory: Path, size: tuple[int, int] = (64, 36), **changes) -> Path:
    """Write 15 small PNGs (each of one colour of its own) and their manifest; `changes` replace keys of the study."""
    (directory / "images").mkdir(parents=True)
    images = []
    for f, framing in enumerate(FRAMINGS):
        for t, technique in enumerate(TECHNIQUES):
            pixels = np.full((size[1], size[0], 3), (60 + 40 * t, 90, 60 + 60 * f), np.uint8)
            file = f"images/{framing}_{technique}.png"
            Image.fromarray(pixels).save(directory / file)
            digest = hashlib.sha256((directory / file).read_bytes()).hexdigest()
            images.append({"framing": framing, "technique": technique, "file": file, "width": size[0], "height": size[1], "sha256": digest})
    study = {
        "name": "ready-made",
        "title": "Which one?",
        "version": 1,
        "seed": 7,
        "framings": [{"name": name, "label": name.capitalize()} for name in FRAMINGS],
        "techniques": [{"name": name, "label": name.replace("_", " ").capitalize()} for name in TECHNIQUES],
    } | changes
    manifest = {"format": "subdermal-manifest/1", "study": study, "images": images}
    (directory / "manifest.json").write_text(json.dumps(manifest))
    return directory
