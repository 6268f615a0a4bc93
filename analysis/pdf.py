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
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import matplotlib
import typst

from analysis.figures import DOUBLE_MM, SIMULATED, Picture
from analysis.shown import Shown

TEMPLATE = Path(__file__).parent / "templates" / "report.typ"
#: Width of the text on the page, mm, no less than the widest figure, so that no letter shrinks; and
#: the gap between two figures beside each other.
TEXT_MM, GAP_MM = 178, 4
#: Tables with more columns are set across.
MOST_COLUMNS = 9


def make(
    title: str,
    subtitle: str,
    summary: Sequence[tuple[str, Sequence[str]]],
    pictures: Sequence[Picture],
    tables: Sequence[Shown],
    notes: Sequence[tuple[str, Sequence[str]]],
    methods: Sequence[tuple[str, str]],
    references: Sequence[str],
    simulated: bool,
) -> bytes:
    """The PDF. summary and notes: (heading, sentences); methods: (heading, text)."""
    with tempfile.TemporaryDirectory(prefix="subdermal-") as folder:
        root = Path(folder)
        places = {picture.name: place for place, picture in enumerate(pictures)}
        for picture in pictures:
            (root / f"{places[picture.name]}.svg").write_bytes(picture.svg)
        data = {
            "title": title,
            "subtitle": subtitle,
            "mark": SIMULATED if simulated else "",
            "summary": [
                {"heading": heading, "sentences": list(sentences)}
                for heading, sentences in summary
                if sentences
            ],
            "rows": [
                [
                    {
                        "file": f"{places[picture.name]}.svg",
                        "title": picture.title,
                        "caption": picture.caption,
                        "alt": picture.alt,
                        "width_mm": min(TEXT_MM, _size_mm(picture.svg)[0]),
                    }
                    for picture in row
                ]
                for row in rows(pictures)
            ],
            "most_columns": MOST_COLUMNS,
            "tables": [asdict(one) for one in tables],
            "notes": [{"heading": heading, "sentences": list(lines)} for heading, lines in notes],
            "methods": [{"heading": heading, "text": text} for heading, text in methods],
            "references": list(references),
        }
        (root / "report.typ").write_bytes(TEMPLATE.read_bytes())
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        source = {"root": folder, "font_paths": [str(fonts)], "ignore_system_fonts": True}
        without = dict.fromkeys(("rows", "tables", "notes", "methods", "references"), ())
        _write(root, data | without)
        room = typst.query(str(root / "report.typ"), "<room>", field="value", one=True, **source)
        _write(root, data | {"room_mm": float(room)})
        return typst.compile(str(root / "report.typ"), **source)


def _write(root: Path, data: Mapping[str, object]) -> None:
    (root / "report.json").write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")


def rows(pictures: Sequence[Picture]) -> list[list[Picture]]:
    """Rows of figures: two narrow ones beside each other. report.typ puts each on the first page
    that has room for it, so that no page is left half empty before a tall figure.
    """
    result: list[list[Picture]] = []
    single: list[Picture] | None = None
    for picture in pictures:
        narrow = 2 * _size_mm(picture.svg)[0] + GAP_MM <= TEXT_MM
        if narrow and single is not None:
            single.append(picture)
            single = None
            continue
        result.append([picture])
        single = result[-1] if narrow else single
    return result


def _size_mm(svg: bytes) -> tuple[float, float]:
    """Width and height of a figure, from its SVG (points)."""
    sizes = [
        re.search(rb'<svg[^>]*? %s="([0-9.]+)pt"' % name, svg) for name in (b"width", b"height")
    ]
    if not all(sizes):
        return DOUBLE_MM, DOUBLE_MM / 2
    return tuple(float(one[1]) / 72 * 25.4 for one in sizes)
