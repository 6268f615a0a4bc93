"""Puts tables, figures and words together: `tables/*.csv`, `figures/*.pdf`, `.svg` and `.png`,
`report.tex`, `methods.md`, `report.pdf` and `report.html`, one page to read.

Everything is made in memory first and then written file by file, each one whole or not at all; the
report comes last.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from pathlib import Path

import jinja2
import numpy as np
import pandas as pd

from analysis import (
    ahp,
    compute,
    conclusions,
    figures,
    latex,
    methods,
    objective,
    remarks,
    shown,
    tallies,
    visibility,
    worth_figures,
)
from analysis.ahp import Comparison, Priorities
from analysis.codebook import FRAMING, Codebook
from analysis.conclusions import count as _count
from analysis.conclusions import listed as _listed
from analysis.declared import UNDECLARED
from analysis.errors import InputError
from analysis.files import csv_bytes, replacing
from analysis.methods import rejected_rows
from analysis.methods import versions as _versions
from analysis.objective import Measured
from analysis.options import Options
from analysis.responses import Responses
from analysis.shown import NOTHING

TEMPLATES = Path(__file__).parent / "templates"
RULE = "Medians are taken above the diagonal, in this order of techniques, and inverted below it."
SIMULATED_SENTENCE = (
    "These answers were made by a program: no person was asked, and nothing "
    "here says how skin looks."
)
#: How many unusable rows the page shows; tables/rejected_rows.csv holds all.
SHOWN_ROWS = 100


def report_responses(
    responses: Responses,
    pair: tuple[str, str] | None = None,
    command: str = "",
    options: Options | None = None,
    declared: str = UNDECLARED,
    measured: Measured | None = None,
    visible: pd.DataFrame | None = None,
    progress: Callable[[Iterable], Iterable] = lambda steps: steps,
    executor: Executor | None = None,
    folder: Path | None = None,
) -> dict[str, bytes]:
    """All files of the analysis of a response table: path inside the output folder -> content.

    pair: the two techniques of the box plot; without it golubev and golubev_plus where both are
    present, else the first two. options: the choices of the analysis, and `declared`, where they
    come from; measured: what the manifest holds of cost and fidelity; visible: what was predicted
    of each pair (`visibility.read_visibility`). progress wraps the list of
    tables, as tqdm does; executor, folder: see `compute.everything`.
    """
    options = options or Options()
    codebook = responses.codebook
    pair = _pair(responses, pair)
    slugs = file_names(responses.items)
    scores, totals, sides = (
        tallies.scores(responses),
        tallies.totals(responses),
        tallies.sides(responses),
    )
    comparisons = ahp.comparisons(responses)
    priorities = _priorities(comparisons)
    tables = {
        "scores": scores,
        "totals": totals,
        "medians": ahp.medians(responses),
        "distributions": tallies.distributions(responses),
        "familiarity": tallies.familiarity(responses),
        "sides": sides,
        "ahp_priorities": ahp.priorities_table(comparisons),
        "rejected_rows": pd.DataFrame(
            [
                (one.line, one.last_line, one.kind, one.reason, one.row)
                for one in responses.findings
            ],
            columns=["line", "last_line", "kind", "reason", "row"],
        ),
        "missing_values": pd.DataFrame(
            [(one.line, one.column, one.value, one.expected) for one in responses.missing],
            columns=["line", "column", "value", "expected"],
        ),
    } | {f"ahp_matrix_{slugs[framing]}": _matrix_table(one) for framing, one in comparisons.items()}
    results = compute.everything(responses, options, progress, executor, folder)
    tables |= results.tables
    beside, correlated = None, None
    if measured is not None:
        beside = objective.against_worth(measured.table, results.tables["worths"])
        correlated = objective.correlations(beside)
        tables |= {"objective": beside, "objective_correlations": correlated}
    seen = None
    if visible is not None and len(visible):
        seen = visibility.beside_answers(visible, tables["distributions"], results.tables["worths"])
        tables["visibility"] = seen
    if responses.simulated:
        tables = {name: table.assign(simulated=1) for name, table in tables.items()}

    simulated = responses.simulated
    pictures = worth_figures.draw_results(results.tables, codebook, options, simulated)
    cost_words = []
    if measured is not None:
        for measure, rows in beside.groupby("measure", sort=False):
            about = objective.MEASURES[measure]
            pictures += worth_figures.draw_objective(
                rows, measure, about, codebook, simulated, 100 * options.level
            )
        cost_words = objective.sentences(beside, correlated, measured.notes, codebook)
    seen_words = []
    if seen is not None and len(seen):
        pictures.append(worth_figures.draw_visibility(seen, codebook, simulated))
        seen_words = visibility.sentences(seen, codebook, visible.attrs.get("metric", "A metric"))
    pictures += figures.draw_responses(responses, priorities, pair, slugs)
    read = shown.all_shown(results.tables, codebook, options)
    read |= {one.name: one for one in shown.not_counted(responses) if one.rows}
    concluded = conclusions.conclude(
        results.tables, results.notes, codebook, options, responses.participants, simulated
    )
    chance = results.tables["ahp_consistency"].query("aggregation == 'median'")
    chance = dict(zip(chance.framing, chance.chance_share, strict=True))
    counted = _summary(responses, scores, totals, sides, comparisons, priorities, pair, chance)
    title = codebook.title or "Answers to pairs of images"
    subtitle = (
        "Which of two images looks more realistic: what was answered, what follows "
        "from it, and what does not."
    )
    summary = [
        *([("Simulated", [SIMULATED_SENTENCE])] if simulated else []),
        ("What can be concluded", concluded.can),
        ("What cannot be concluded", concluded.cannot),
        ("What was counted", [*counted, *_not_drawn(responses)]),
        *([("Cost and fidelity beside worth", cost_words)] if cost_words else []),
        *([("Predicted visibility beside answers", seen_words)] if seen_words else []),
    ]
    text = methods.paragraphs(responses, options, declared)
    used = "".join(words for _, words in text)
    cited = {key: place for place, key in enumerate(methods.keys_in(used), start=1)}
    references = [methods.REFERENCES[key] for key in cited]
    numbered = [(heading, methods.cited(words, cited)) for heading, words in text]
    beside_tables = remarks.topics(results.notes, responses.notes, codebook)
    more = {
        "methods.md": methods.markdown(responses, options, declared, command).encode(),
        "report.tex": latex.document(read.values(), title, simulated, beside_tables).encode(),
        "report.pdf": _pdf(
            title,
            subtitle,
            summary,
            pictures,
            list(read.values()),
            beside_tables,
            numbered,
            references,
            simulated,
        ),
    }
    return _files(
        tables,
        pictures,
        more,
        title=title,
        subtitle=subtitle,
        simulated=simulated,
        summary=[(heading, sentences) for heading, sentences in summary if sentences],
        shown=read,
        remarks={name: remarks.remarks(lines, codebook) for name, lines in results.notes.items()},
        methods=numbered,
        references=references,
        declared=declared,
        counts=[
            ("participant", responses.participants),
            ("answer", len(responses.frame)),
            ("technique", len({name for items in responses.items.values() for name in items})),
            ("framing" if codebook.factor == FRAMING else "level", len(responses.items)),
            ("unused row", len(responses.findings)),
        ],
        scores=_crossed(scores, "score", codebook, list(responses.items)),
        totals=[
            (codebook.framing_label(row.framing), row.total, row.answers, row.mean_strength)
            for row in totals.itertuples()
        ],
        sides=[
            (codebook.framing_label(row.framing), row.left, row.none, row.right)
            for row in sides.itertuples()
        ],
        matrices=_matrices(comparisons, priorities, codebook, chance),
        priorities=_crossed(tables["ahp_priorities"], "priority", codebook, list(responses.items)),
        rule=RULE,
        order=[codebook.label(name) for name in codebook.techniques],
        order_rule=codebook.order_rule,
        framings=[codebook.framing_label(name) for name in codebook.framings],
        framing_rule=codebook.framing_rule,
        codebook=codebook,
        notes=[remarks.plain(note, codebook) for note in responses.notes],
        findings=responses.findings[:SHOWN_ROWS],
        rows=responses.rows,
        when=_when(responses),
        source=responses.source,
        sha256=responses.sha256,
        command=command,
    )


def report_matrices(
    comparisons: Mapping[str, Comparison], source: str = "", command: str = ""
) -> dict[str, bytes]:
    """The same for matrices of judgements that were made elsewhere."""
    items = next(iter(comparisons.values())).items
    codebook = Codebook(
        tuple(comparisons), items, f"that of items in {source}", f"that of {source}"
    )
    priorities = _priorities(comparisons)
    slugs = file_names(comparisons)
    table = ahp.priorities_table(comparisons)
    tables = {"ahp_priorities": table} | {
        f"ahp_matrix_{slugs[name]}": _matrix_table(one) for name, one in comparisons.items()
    }
    shares = {name: dict(zip(items, one.vector, strict=True)) for name, one in priorities.items()}
    return _files(
        tables,
        figures.draw_priorities(shares, priorities, codebook),
        {},
        title="Priorities from matrices of judgements",
        subtitle="The matrices as given, their priorities and how coherent they are.",
        simulated=False,
        summary=[
            (
                "",
                [
                    f"{codebook.framing_label(name)}: highest priority for "
                    f"{_listed(_first(share, codebook))}, "
                    f"{max(share.values()):.3f}. {priorities[name].sentence()}"
                    for name, share in shares.items()
                ],
            )
        ],
        counts=[("technique", len(items)), ("framing", len(comparisons))],
        matrices=_matrices(comparisons, priorities, codebook),
        priorities=_crossed(table, "priority", codebook, list(comparisons)),
        rule="The matrices were given; nothing was counted here.",
        order=list(items),
        order_rule=codebook.order_rule,
        framings=list(comparisons),
        framing_rule=codebook.framing_rule,
        codebook=codebook,
        source=source,
        command=command,
    )


def write_files(files: Mapping[str, bytes], out: str | Path) -> None:
    """Write each file whole or not at all; what else lies in the folder stays."""
    out = Path(out)
    try:
        for name, content in files.items():
            path = out / name
            path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(path) as part:
                part.write_bytes(content)
    except OSError as error:
        raise InputError(
            f"{error.filename or out}: cannot be written: {error.strerror}; expected a folder "
            "for --out"
        ) from None


def file_names(names: Iterable[str]) -> dict[str, str]:
    """Name -> a file name of its own, on any file system: letters, digits, '.', '_', '-', told
    apart whatever the case.
    """
    slugs: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name)[:60].strip("._") or "framing"
        slug, count = plain, 1
        while slug.lower() in taken:
            count += 1
            slug = f"{plain}_{count}"
        taken.add(slug.lower())
        slugs[name] = slug
    return slugs


def _files(
    tables: Mapping[str, pd.DataFrame],
    pictures: list[figures.Picture],
    more: Mapping[str, bytes],
    **page: object,
) -> dict[str, bytes]:
    files = {f"tables/{name}.csv": csv_bytes(table, 10) for name, table in tables.items()}
    for picture in pictures:
        files |= picture.files
    files |= more
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["inline"] = lambda svg: (
        "data:image/svg+xml;base64," + base64.b64encode(svg).decode()
    )
    environment.filters["digits"] = _digits
    page = {
        "versions": _versions(),
        "files": sorted(files),
        "pictures": {
            kind: [one for one in pictures if (one.kind or one.name) == kind]
            for kind in dict.fromkeys(one.kind or one.name for one in pictures)
        },
        **page,
    }
    files["report.html"] = environment.get_template("report.html").render(page).encode()
    return files


def _when(responses: Responses) -> str:
    """When answers were given and how long half of them took; '' where nothing is known."""
    begun, rt_ms = responses.frame.started_at, responses.frame.rt_ms
    words = []
    if begun.notna().any():
        first, last = (f"{time:%Y-%m-%d}" for time in (begun.min(), begun.max()))
        when = f"on {first}" if first == last else f"from {first} to {last}"
        words.append(f"Answers were given {when}")
    if rt_ms.notna().any():
        words.append(f"half of them took less than {rt_ms.median() / 1000:.1f} s")
    text = "; ".join(words)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _pdf(*parts: object) -> bytes:
    from analysis import pdf

    return pdf.make(*parts)


def _digits(value: float | None, digits: int = 3) -> str:
    return NOTHING if value is None or np.isnan(value) else f"{value:z.{digits}f}"


def _pair(responses: Responses, pair: tuple[str, str] | None) -> tuple[str, str]:
    """The pair of the box plot, checked."""
    present = [
        name
        for name in responses.codebook.techniques
        if any(name in items for items in responses.items.values())
    ]
    if pair is None:
        known = ("golubev", "golubev_plus")
        return known if set(known) <= set(present) else tuple(present[:2])
    if len(pair) != 2 or pair[0] == pair[1] or not set(pair) <= set(present):
        raise InputError(
            f"the pair is {','.join(pair)!r}, expected two different ones of {', '.join(present)}"
        )
    return tuple(pair)


def _priorities(comparisons: Mapping[str, Comparison]) -> dict[str, Priorities]:
    return {
        name: ahp.priorities(one.matrix) for name, one in comparisons.items() if not one.missing
    }


def _matrix_table(comparison: Comparison) -> pd.DataFrame:
    table = pd.DataFrame(comparison.matrix, columns=list(comparison.items))
    table.insert(0, "technique", list(comparison.items), allow_duplicates=True)
    return table


def _matrices(
    comparisons: Mapping[str, Comparison],
    priorities: Mapping[str, Priorities],
    codebook: Codebook,
    chance: Mapping[str, float] | None = None,
) -> list[dict]:
    return [
        {
            "framing": codebook.framing_label(name),
            "items": [codebook.label(item) for item in one.items],
            "rows": [
                ["" if np.isnan(cell) else f"{cell:.4g}" for cell in row] for row in one.matrix
            ],
            "missing": [f"{codebook.label(a)} with {codebook.label(b)}" for a, b in one.missing],
            "priorities": priorities.get(name),
            "words": priorities[name].sentence((chance or {}).get(name, np.nan))
            if name in priorities
            else "",
        }
        for name, one in comparisons.items()
    ]


def _crossed(table: pd.DataFrame, column: str, codebook: Codebook, framings: list[str]) -> dict:
    """A table with one row a technique and one column a framing, for the page."""
    cells = table.set_index(["technique", "framing"])[column]
    used = [name for name in codebook.techniques if name in set(table.technique)]
    return {
        "framings": [codebook.framing_label(name) for name in framings],
        "rows": [
            (codebook.label(name), [cells.get((name, framing)) for framing in framings])
            for name in used
        ],
    }


def _summary(
    responses: Responses,
    scores: pd.DataFrame,
    totals: pd.DataFrame,
    sides: pd.DataFrame,
    comparisons: Mapping[str, Comparison],
    priorities: Mapping[str, Priorities],
    pair: tuple[str, str],
    chance: Mapping[str, float],
) -> list[str]:
    """What the numbers say, in sentences that hold for these answers and claim no more."""
    codebook, frame = responses.codebook, responses.frame
    sentences = []
    people = _count(
        responses.participants, "simulated participant" if responses.simulated else "participant"
    )
    unused = f"{rejected_rows(responses)[:1].upper()}{rejected_rows(responses)[1:]}."
    sentences.append(
        (
            f"{people} gave {_count(len(frame), 'answer')} at "
            f"{codebook.counted(len(responses.items))}. "
        )
        + (unused if responses.findings else "Every row of the table is counted.")
        + (
            f" {_count(len(responses.missing), 'value')} beside answers "
            f"{'is' if len(responses.missing) == 1 else 'are'} missing ({_missing(responses)}); "
            "their answers are counted."
            if responses.missing
            else ""
        )
    )
    for framing, rows in scores.groupby("framing", sort=False):
        points = dict(zip(rows.technique, rows.score, strict=True))
        total, most, fewest = sum(points.values()), max(points.values()), min(points.values())
        words = f"{codebook.framing_label(framing)}: "
        if most == fewest:
            words += f"all techniques have {_count(most, 'point')}."
        else:
            best, last = (
                _first(points, codebook),
                [codebook.label(name) for name in points if points[name] == fewest],
            )
            words += (
                f"{_listed(best)} got the most points "
                f"({most}{' each' if len(best) > 1 else ''} of {total}), "
                f"{_listed(last)} the fewest ({fewest}{' each' if len(last) > 1 else ''})."
            )
            if framing in priorities:
                shares = dict(
                    zip(comparisons[framing].items, priorities[framing].vector, strict=True)
                )
                top = _first(shares, codebook)
                if len(top) == len(shares):
                    words += " The AHP priorities put none before another."
                else:
                    words += (
                        f" The AHP priorities put {_listed(top)} "
                        f"first{' too' if top == best else ''}."
                    )
        if framing in priorities:
            words += f" {priorities[framing].sentence(chance.get(framing, np.nan))}"
        elif comparisons[framing].missing:
            words += (
                f" No priorities: {_count(len(comparisons[framing].missing), 'pair')} "
                "had no answer."
            )
        sentences.append(words)
    if len(totals) > 1:
        strength = totals.mean_strength.to_numpy()
        steps = np.diff(strength)
        way = "neither only weaken nor only grow"
        if (steps == 0).all():
            way = "do not change"
        elif (steps < 0).all() or (steps > 0).all():
            way = f"get {'weaker' if steps[0] < 0 else 'stronger'} with every step"
        values = ", ".join(
            f"{row.mean_strength:.2f} ({codebook.framing_label(row.framing)})"
            for row in totals.itertuples()
        )
        path = "From near to far" if codebook.near_to_far else "From framing to framing"
        path = f"{path}, preferences {way}: on" if codebook.factor == FRAMING else "On"
        sentences.append(f"{path} average an answer gave {values} points, of at most 2.")
    a, b = (codebook.label(name) for name in pair)
    values = "; ".join(
        (
            f"{codebook.framing_label(framing)} {(one < 0).sum()}, {(one == 0).sum()} and "
            f"{(one > 0).sum()}"
        )
        for framing, one in tallies.preferences(responses, pair).items()
    )
    sentences.append(
        f"{a} against {b}, in answers for the first, for neither and for the second: {values}."
        if values
        else f"{a} and {b} were never compared."
    )
    sentences.append(
        "Over all answers the image on the left was preferred "
        f"{_count(sides.left.sum(), 'time')}, the one on the right "
        f"{_count(sides.right.sum(), 'time')}; no difference was seen "
        f"{_count(sides.none.sum(), 'time')}."
    )
    return sentences


def _not_drawn(responses: Responses) -> list[str]:
    """Figures that are left out for want of room, in a sentence."""
    present = {name for items in responses.items.values() for name in items}
    if len(present) <= figures.MOST_PREFERENCES:
        return []
    return [
        f"With {len(present)} techniques the answers of each against each other one are not drawn; "
        "tables/distributions.csv has them, and the figure of every difference their means."
    ]


def _missing(responses: Responses) -> str:
    """'familiarity 12, rt_ms 1'."""
    columns = [one.column for one in responses.missing]
    return ", ".join(f"{name} {columns.count(name)}" for name in dict.fromkeys(columns))


def _first(values: Mapping[str, float], codebook: Codebook) -> list[str]:
    top = max(values.values())
    return [
        codebook.label(name) for name, value in values.items() if np.isclose(value, top, rtol=1e-9)
    ]
