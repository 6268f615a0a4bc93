"""report.tex: every table that is read, with booktabs, to be compiled alone or taken apart."""

from __future__ import annotations

from collections.abc import Iterable

from analysis.figures import SIMULATED
from analysis.shown import MINUS, NOTHING, Shown

_ESCAPES = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_\allowbreak{}",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    MINUS: r"$-$",
    NOTHING: "--",
    "\N{PLUS-MINUS SIGN}": r"$\pm$",
}

#: Tables with more columns are set smaller; in those of so many names longer than this break.
MOST_COLUMNS, WIDE_COLUMNS, LONGEST = 9, 8, 20

PREAMBLE = (
    r"% Tables with booktabs. Compile this file alone, or \input the part between the lines"
    r""" of '%' of one table.
\documentclass[10pt]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{lmodern}
\usepackage{textcomp}
\usepackage[a4paper,landscape,margin=15mm]{geometry}
\usepackage{array,booktabs,longtable}
\setlength{\tabcolsep}{3.5pt}
\setlength{\LTcapwidth}{\textwidth}
\begin{document}
"""
)


def escape(text: str) -> str:
    """Any text as LaTeX prints it; characters that the fonts lack stay as UTF-8."""
    return "".join(_ESCAPES.get(mark, mark) for mark in " ".join(text.split()))


def table(shown: Shown, simulated: bool = False) -> str:
    """One table as a longtable, which may run over pages.

    A cell that repeats the one above it in the first column stays empty.
    """
    columns = "".join(
        "r" if numeric else _text_column(shown, place)
        for place, numeric in enumerate(shown.numeric)
    )
    caption = escape(f"{SIMULATED}. {shown.caption}" if simulated else shown.caption)
    head = " & ".join(escape(name) for name in shown.columns)
    note = escape(shown.note)
    lines = [
        f"% {shown.name}",
        rf"\begin{{longtable}}{{@{{}}{columns}@{{}}}}",
        rf"\caption{{{caption}{'. ' + note if note else ''}}}"
        rf"\label{{tab:{escape_label(shown.name)}}}\\",
        rf"\toprule {head} \\ \midrule \endfirsthead",
        rf"\toprule {head} \\ \midrule \endhead",
        r"\bottomrule \endlastfoot",
    ]
    above = None
    for row in shown.rows:
        cells = [escape(cell) for cell in row]
        if above is not None and row[0] != above:
            lines.append(r"\addlinespace")
        cells[0] = cells[0] if row[0] != above else ""
        # a cell that begins with a bracket would be read as the length of \\
        lines.append(
            " & ".join("{}" + cell if cell.startswith("[") else cell for cell in cells) + r" \\"
        )
        above = row[0]
    lines.append(r"\end{longtable}")
    if len(shown.columns) > MOST_COLUMNS:  # 7 points, so that it stays on the page
        lines[1:] = [r"{\scriptsize\setlength{\tabcolsep}{1.8pt}", *lines[1:], "}"]
    return "\n".join([*lines, ""])


def _text_column(shown: Shown, place: int) -> str:
    """A column of text: as wide as it is, or in a table of many columns so wide, with lines that
    break.
    """
    longest = max((len(row[place]) for row in shown.rows), default=0)
    if len(shown.columns) < WIDE_COLUMNS or longest <= LONGEST:
        return "l"
    return rf">{{\raggedright\arraybackslash}}p{{{LONGEST / 2:g}em}}"


def escape_label(name: str) -> str:
    return "".join(mark if mark.isalnum() else "-" for mark in name)


def document(
    tables: Iterable[Shown],
    title: str,
    simulated: bool = False,
    notes: Iterable[tuple[str, Iterable[str]]] = (),
) -> str:
    """All tables in one file that compiles alone, and after them what is said of them: notes,
    (topic, sentences).
    """
    size = [r"\footnotesize" + "\n", rf"\section*{{{escape(title)}}}" + "\n"]
    if simulated:
        size.append(rf"\noindent\textbf{{{SIMULATED}}}: every answer was made by a program." + "\n")
    paragraphs = [
        rf"\noindent\textbf{{{escape(topic)}.}} {escape(' '.join(sentences))}\par"
        for topic, sentences in notes
    ]
    return "\n".join(
        [PREAMBLE, *size, *(table(one, simulated) for one in tables)]
        + ([r"\section*{Notes to the tables}", *paragraphs] if paragraphs else [])
        + [r"\end{document}", ""]
    )
