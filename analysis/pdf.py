"""report.pdf: the report on paper, set by Typst, with embedded fonts; no browser and no LaTeX are
needed.

The layout is templates/report/report.typ. Words go there as data, never as markup, so that no name
in a table can change it. The fonts are those that come with typst and matplotlib, whatever the
machine has: the same input gives the same bytes.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import matplotlib
import typst

from analysis.figures import DOUBLE_MM, SIMULATED, Picture
from analysis.shown import Shown

TEMPLATE = Path(__file__).parent / "templates" / "report.typ"
#: Width of the text on the page, mm.
TEXT_MM = 174


def make(
    title: str,
    subtitle: str,
    summary: Sequence[tuple[str, Sequence[str]]],
    pictures: Sequence[Picture],
    tables: Sequence[Shown],
    methods: Sequence[tuple[str, str]],
    references: Sequence[str],
    simulated: bool,
) -> bytes:
    """The PDF. summary and methods: (heading, sentences) and (heading, text)."""
    with tempfile.TemporaryDirectory(prefix="subdermal-") as folder:
        root = Path(folder)
        for place, picture in enumerate(pictures):
            (root / f"{place}.svg").write_bytes(picture.svg)
        data = {
            "title": title,
            "subtitle": subtitle,
            "mark": SIMULATED if simulated else "",
            "summary": [
                {"heading": heading, "sentences": list(sentences)}
                for heading, sentences in summary
                if sentences
            ],
            "pictures": [
                {
                    "file": f"{place}.svg",
                    "title": picture.title,
                    "caption": picture.caption,
                    "alt": picture.alt,
                    "width_mm": min(TEXT_MM, _width_mm(picture.svg)),
                }
                for place, picture in enumerate(pictures)
            ],
            "tables": [asdict(one) for one in tables],
            "methods": [{"heading": heading, "text": text} for heading, text in methods],
            "references": list(references),
        }
        (root / "report.json").write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")
        (root / "report.typ").write_bytes(TEMPLATE.read_bytes())
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        return typst.compile(
            str(root / "report.typ"), root=folder, font_paths=[str(fonts)], ignore_system_fonts=True
        )


def _width_mm(svg: bytes) -> float:
    """The width of a figure, from its SVG (points)."""
    found = re.search(rb'<svg[^>]*? width="([0-9.]+)pt"', svg)
    return float(found[1]) / 72 * 25.4 if found else DOUBLE_MM
