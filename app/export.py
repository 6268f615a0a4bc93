"""The table of answers: one row an answer, written as it is read, with a codebook. Withdrawn
answers are never in it.

One list describes the columns: the header, the rows and the codebook all come from it.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import ColumnElement, Select, func, select
from sqlalchemy.orm import Session, selectinload, undefer

from analysis.files import replacing
from analysis.manifest import KINDS
from app import parquet, recruiting
from app.models import Link, Participant, Response, Trial, participant_code
from app.questionnaire import screen
from app.study import Study
from stimuli.asking import ADAPTIVE, Ask
from stimuli.manifest import NAME as MANIFEST
from stimuli.study import FRAMING

CHUNK_ROWS = 500


@dataclass(frozen=True)
class Row:
    """What one row of the table is made of."""

    study: Study
    simulated: bool
    participant: Participant
    trial: Trial
    response: Response


@dataclass(frozen=True)
class Column:
    """A column of responses.csv: its name, type, unit or range, meaning, and how it comes out of a
    row.
    """

    name: str
    type: str
    values: str
    description: str
    value: Callable[[Row], Any]


def _time(value: datetime) -> str:
    return value.isoformat(timespec="milliseconds").replace("+00:00", "Z")


COLUMNS = (
    Column(
        "participant",
        "text",
        "P0001, P0002, ...",
        "Code of the participant, in the order of consent; says nothing about the person",
        lambda r: r.participant.code,
    ),
    Column(
        "familiarity",
        "integer",
        "a level of the study",
        "Self-rating, such as familiarity with computer graphics, from the lowest level up",
        lambda r: r.participant.familiarity,
    ),
    Column(
        "framing",
        "text",
        "a framing of the study",
        "Distance at which both images of the question were taken",
        lambda r: r.study.definition.cell(r.trial.cell).framing,
    ),
    Column(
        "left",
        "text",
        "a technique of the study",
        "Technique of the left (or upper) image, called A",
        lambda r: r.trial.left,
    ),
    Column(
        "right",
        "text",
        "a technique of the study",
        "Technique of the right (or lower) image, called B",
        lambda r: r.trial.right,
    ),
    Column(
        "answer",
        "integer",
        "-2 to 2",
        (
            "Answer to the study's question, as the analysis counts it: -2 clearly left, -1 "
            "slightly left, 0 no difference seen, 1 slightly right, 2 clearly right"
        ),
        lambda r: r.response.answer,
    ),
    Column(
        "point",
        "integer",
        "-5 to 5",
        (
            "The point of the study's scale that was given; the codebook says as which answer each "
            "counts. Empty: answered before it was recorded"
        ),
        lambda r: r.response.point,
    ),
    Column(
        "kind",
        "text",
        ", ".join(KINDS),
        (
            "What the question is for: main counts; repeat and swapped ask a pair again, on the "
            "same and on the other sides; practice comes first; trap has an obvious answer; bias "
            "shows one image on both sides"
        ),
        lambda r: r.trial.kind,
    ),
    Column(
        "expected",
        "integer",
        "-1, 0, 1",
        (
            "Sign of the answer that is expected where one is: of traps the side of the better "
            "image, of bias 0; else empty"
        ),
        lambda r: r.study.definition.quality.expected(
            r.trial.kind, r.trial.cell, r.trial.left, r.trial.right
        ),
    ),
    Column(
        "order",
        "integer",
        "from 1",
        "Place of the question in this participant's random order",
        lambda r: r.trial.order,
    ),
    Column(
        "rt_ms",
        "integer",
        "ms",
        (
            "Time from both images being on the screen to the confirmed answer; after a reload "
            "from the last showing (see timed_by, times_shown)"
        ),
        lambda r: r.response.rt_ms,
    ),
    Column(
        "started_at",
        "time",
        "ISO 8601, UTC",
        "When the question was first sent to the browser",
        lambda r: _time(r.response.started_at),
    ),
    Column(
        "answered_at",
        "time",
        "ISO 8601, UTC",
        "When the answer was committed",
        lambda r: _time(r.response.answered_at),
    ),
    Column(
        "timed_by",
        "text",
        "browser, server",
        (
            "Clock of rt_ms: browser, or, without JavaScript, the server from sending the "
            "question to receiving the answer"
        ),
        lambda r: r.response.timed_by,
    ),
    Column(
        "times_shown",
        "integer",
        "from 1",
        "How often the question was sent to the browser; above 1 after a reload",
        lambda r: r.response.times_shown,
    ),
    Column(
        "completed",
        "integer",
        "0, 1",
        "Whether the participant answered every question",
        lambda r: int(r.participant.completed_at is not None),
    ),
    Column(
        "language",
        "text",
        "en, it, pt, zh",
        "Language of the page that asked; empty: answered before it was recorded",
        lambda r: r.response.language or "",
    ),
    Column(
        "consent_language",
        "text",
        "en, it, pt, zh",
        "Language of the consent that the participant read; empty: before it was recorded",
        lambda r: r.participant.consent_language or "",
    ),
    Column(
        "consent_sha256",
        "text",
        "64 hexadecimal digits",
        "SHA-256 of the consent text as it was shown, which the codebook lists by language",
        lambda r: r.participant.consent_sha256 or "",
    ),
    Column("study", "text", "", "Name of the study", lambda r: r.study.name),
    Column("study_version", "integer", "from 1", "Version of the study", lambda r: r.study.version),
    Column(
        "simulated",
        "integer",
        "0, 1",
        "1: a program gave the answer, 0: a person did. Never both in one table",
        lambda r: int(r.simulated),
    ),
    Column(
        "seed",
        "text",
        "study seed/list number, or study seed/adaptive number hash",
        (
            "What pairs, order and sides were drawn from: the seed of the study and the number of "
            "the list; of an adaptive design the number of the participant and the beginning of "
            "the hash of what the pairs were chosen from (assignments.jsonl); without a word, "
            "drawn before lists were dealt, by the participant's number"
        ),
        lambda r: r.trial.seed,
    ),
    Column(
        "image_left_sha256",
        "text",
        "64 hexadecimal digits",
        "SHA-256 of the file of the left image, as in manifest.json",
        lambda r: r.response.image_left_sha256,
    ),
    Column(
        "image_right_sha256",
        "text",
        "64 hexadecimal digits",
        "SHA-256 of the file of the right image, as in manifest.json",
        lambda r: r.response.image_right_sha256,
    ),
    Column(
        "viewport_width",
        "integer",
        "CSS pixels",
        "Width of the inside of the browser's window; empty without JavaScript",
        lambda r: r.response.viewport_width,
    ),
    Column(
        "viewport_height",
        "integer",
        "CSS pixels",
        "Height of the inside of the browser's window; empty without JavaScript",
        lambda r: r.response.viewport_height,
    ),
    Column(
        "device_pixel_ratio",
        "number",
        "physical pixels a CSS pixel",
        "Display scaling times zoom; empty without JavaScript",
        lambda r: r.response.device_pixel_ratio,
    ),
    Column(
        "shown_width",
        "number",
        "CSS pixels",
        (
            "Width of each whole image on the page, of which its region of interest is shown; "
            "times device_pixel_ratio it is physical pixels; empty "
            "without JavaScript"
        ),
        lambda r: r.response.shown_width,
    ),
    Column(
        "shown_height",
        "number",
        "CSS pixels",
        (
            "Height of each whole image on the page, of which its region of interest is shown; "
            "times device_pixel_ratio it is physical pixels; empty without JavaScript"
        ),
        lambda r: r.response.shown_height,
    ),
    Column(
        "view",
        "text",
        "beside, flicker, wipe, triplet, boosted, unscripted",
        (
            "How the pair was looked at when it was answered; unscripted: without JavaScript, side "
            "by side and scaled by the browser; empty: answered before it was recorded"
        ),
        lambda r: r.response.view or "",
    ),
    *(
        Column(
            f"{view}_ms",
            "integer",
            "ms",
            f"Time of rt_ms that the pair was shown {words}; empty without JavaScript",
            lambda r, name=f"{view}_ms": getattr(r.response, name),
        )
        for view, words in (
            ("beside", "side by side, or one above the other"),
            ("flicker", "in one place, to be swapped"),
            ("wipe", "in one place, with a divider"),
            ("triplet", "with the reference between the two"),
            ("boosted", "with the reference between the two, differences from it boosted"),
        )
    ),
    Column(
        "away_ms",
        "integer",
        "ms",
        (
            "Time of rt_ms that the page was hidden or another window had the keys, which is not "
            "in the times of the views; empty without JavaScript"
        ),
        lambda r: r.response.away_ms,
    ),
    Column(
        "flips",
        "integer",
        "from 0",
        (
            "How often the images were swapped in place, of boosted triplets with the reference; "
            "empty without JavaScript"
        ),
        lambda r: r.response.flips,
    ),
    Column(
        "pixel_scale",
        "number",
        "screen pixels an image pixel",
        (
            "As the question began: 1 is pixel for pixel, a broken number resampled; empty "
            "without JavaScript"
        ),
        lambda r: r.response.pixel_scale,
    ),
    Column(
        "pixel_scale_largest",
        "number",
        "screen pixels an image pixel",
        "The largest that was looked at; empty without JavaScript",
        lambda r: r.response.pixel_scale_largest,
    ),
    Column(
        "seen_share",
        "number",
        "0 to 1",
        (
            "Part of the region of interest that was on the screen at once as the question began; "
            "below 1 the window was too small for it; empty without JavaScript"
        ),
        lambda r: r.response.seen_share,
    ),
    *(
        Column(
            name,
            kind,
            unit,
            f"{words}, of the page that looks at the screen; empty without it",
            lambda r, name=name: screen.columns(
                r.participant.screen, r.study.definition.screen.distance_cm
            )[name],
        )
        for name, kind, unit, words in (
            ("pixels_per_mm", "number", "screen pixels a mm", "By a card held to the screen"),
            (
                "pixels_per_degree",
                "number",
                "screen pixels a degree",
                "Of visual angle at the distance that the study asks for",
            ),
            ("display_gamma", "number", "", "By a grey matched to fine stripes; sRGB is about 2.2"),
            ("dark_steps_seen", "number", "0 to 4", "Squares 4, 8, 12, 16 levels above black"),
            ("bright_steps_seen", "number", "0 to 4", "Squares 4, 8, 12, 16 levels below white"),
            ("plates_read", "integer", "from 0", "Colour plates whose digit was read"),
            (
                "plates_given",
                "text",
                "digits, with ; between them",
                "What was read of each colour plate, nothing where none was given",
            ),
        )
    ),
    Column(
        "reason_ticks",
        "text",
        "numbers from 1, with ; between them",
        "The words of the study that were ticked as a reason for the choice; empty for none",
        lambda r: r.response.reason_ticks,
    ),
    Column(
        "reason_text",
        "text",
        "as it was written",
        "A reason for the choice in the participant's words; empty for none",
        lambda r: r.response.reason_text,
    ),
    Column(
        "rt_server_ms",
        "integer",
        "ms",
        (
            "Time from first sending the question to receiving the answer by the server's clock: "
            "more than rt_ms by loading and sending; empty: answered before it was recorded"
        ),
        lambda r: r.response.rt_server_ms,
    ),
    Column(
        "rt_reported_ms",
        "integer",
        "ms",
        (
            "What the browser said where it was more than the server's clock allows; rt_ms is then "
            "the server's"
        ),
        lambda r: r.response.rt_reported_ms,
    ),
    Column(
        "rt_flag",
        "text",
        "fast, impossible",
        (
            "fast: rt_ms is below `fastest_ms` of the study's [quality], by default 200: less than "
            "it takes to see and press; impossible: see rt_reported_ms; else empty"
        ),
        lambda r: (
            "impossible"
            if r.response.rt_reported_ms is not None
            else "fast"
            if r.response.rt_ms < r.study.definition.quality.fastest_ms
            else ""
        ),
    ),
)


def columns(study: Study) -> tuple[Column, ...]:
    """The columns of a study's table: one for each factor beside framing, after framing's."""
    place = 1 + next(i for i, column in enumerate(COLUMNS) if column.name == FRAMING)
    further = [
        Column(
            factor.name,
            "text",
            "a level of the study",
            f"{factor.label}: the level that both images of the question have",
            lambda r, name=factor.name: r.study.definition.cell(r.trial.cell).levels[name],
        )
        for factor in study.definition.factors[1:]
    ]
    definition = study.definition
    own = [_own(ask, "before") for ask in definition.before] + [
        _own(ask, "after") for ask in definition.after
    ]
    return (*COLUMNS[:place], *further, *COLUMNS[place:], *own)


def _own(ask: Ask, when: str) -> Column:
    """The column of a question of the study's own."""
    values = ", ".join(f"{k}: {label}" for k, label in enumerate(ask.options, 1) if label)
    return Column(
        ask.name,
        "integer" if ask.options else "text",
        values or "as it was written",
        f"Asked {when} the pairs: {ask.text} Empty where it was left out",
        lambda r: _stated(r, ask),
    )


def _stated(row: Row, ask: Ask) -> int | str | None:
    """What was answered to a question of the study's own: a number where it has options."""
    value = next((s.value for s in row.participant.statements if s.name == ask.name), "")
    if not ask.options:
        return value
    return int(value) if value else None


def counted(*columns: Any, who: ColumnElement[bool] | None = None) -> Select:
    """`select(*columns)` over the answers that count: committed, of participants who did not
    withdraw, were not excluded and did not only try the study out; or of others, `who`.
    """
    return (
        select(*columns)
        .select_from(Response)
        .join(Trial, Response.trial_id == Trial.id)
        .join(Participant, Response.participant_id == Participant.id)
        .where(recruiting.counts() if who is None else who)
    )


def count(session: Session) -> int:
    """How many rows the table has."""
    return session.scalar(counted(func.count()))


def records(
    session: Session, study: Study, *, simulated: bool, who: ColumnElement[bool] | None = None
) -> Iterator[dict[str, Any]]:
    """The rows of the table, by participant and order, as mappings."""
    query = counted(Participant, Trial, Response, who=who).order_by(Participant.id, Trial.order)
    query = query.options(selectinload(Participant.statements))
    described = columns(study)
    for participant, trial, response in session.execute(
        query.execution_options(yield_per=CHUNK_ROWS)
    ):
        row = Row(study, simulated, participant, trial, response)
        yield {column.name: column.value(row) for column in described}


def judgements(session: Session, study: Study) -> list[dict[str, Any]]:
    """What the numbers of the dashboard need of each answer, with the names of responses.csv: a
    fraction of the columns, and no objects.
    """
    levels = {cell.name: cell.levels for cell in study.definition.cells}
    query = counted(
        Participant.id,
        Participant.familiarity,
        Trial.cell,
        Trial.left,
        Trial.right,
        Trial.order,
        Response.answer,
        Response.rt_ms,
        Trial.kind,
    )
    names = ("participant", "familiarity", "left", "right", "order", "answer", "rt_ms", "kind")
    expected = study.definition.quality.expected
    return [
        dict(
            zip(names, (participant_code(number), rating, left, right, order, answer, rt_ms, kind))
        )
        | {"expected": expected(kind, cell, left, right)}
        | levels[cell]
        for number, rating, cell, left, right, order, answer, rt_ms, kind in session.execute(
            query.order_by(Participant.id, Trial.order)
        )
    ]


def responses_csv(session: Session, study: Study, *, simulated: bool) -> Iterator[str]:
    """responses.csv, a chunk at a time."""
    names = [column.name for column in columns(study)]
    return _csv(names, (row.values() for row in records(session, study, simulated=simulated)))


def responses_jsonl(session: Session, study: Study, *, simulated: bool) -> Iterator[str]:
    """responses.jsonl: the same rows, an object a line, texts as they were written."""
    lines: list[str] = []
    for row in records(session, study, simulated=simulated):
        lines.append(json.dumps(row, ensure_ascii=False) + "\n")
        if len(lines) == CHUNK_ROWS:
            yield "".join(lines)
            lines = []
    yield "".join(lines)


def responses_parquet(session: Session, study: Study, *, simulated: bool) -> Iterator[bytes]:
    """responses.parquet: the same rows with the types of the codebook; needs pyarrow."""
    about = {
        "study": study.name,
        "study_version": str(study.version),
        "simulated": str(int(simulated)),
        "rows": str(count(session)),
    }
    return parquet.parquet(columns(study), records(session, study, simulated=simulated), about)


def write_zip(file: BinaryIO, session: Session, study: Study, *, simulated: bool) -> None:
    """All tables of one snapshot as a zip, with SHA256SUMS and the number of answers in
    counts.json; responses.parquet where pyarrow is installed.
    """
    parts: dict[str, Iterable[str] | Iterable[bytes]] = {
        "responses.csv": responses_csv(session, study, simulated=simulated),
        "responses.jsonl": responses_jsonl(session, study, simulated=simulated),
        "codebook.csv": codebook_csv(study),
        "codebook.md": [codebook_md(study, simulated=simulated)],
        "manifest.json": [(study.directory / MANIFEST).read_text("utf-8")],
        "counts.json": [json.dumps({"responses": count(session), "simulated": simulated}) + "\n"],
    }
    if study.definition.assignment.design == ADAPTIVE:
        parts["assignments.jsonl"] = assignments_jsonl(session, study)
    if parquet.available():
        parts["responses.parquet"] = responses_parquet(session, study, simulated=simulated)
    sums = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, pieces in parts.items():
            digest = hashlib.sha256()
            with archive.open(name, "w", force_zip64=True) as entry:
                for piece in pieces:
                    data = piece.encode() if isinstance(piece, str) else piece
                    entry.write(data)
                    digest.update(data)
            sums.append(f"{digest.hexdigest()}  {name}\n")
        archive.writestr("SHA256SUMS", "".join(sums))


def assignments_jsonl(session: Session, study: Study) -> Iterator[str]:
    """assignments.jsonl: of each participant of an adaptive design what the pairs were chosen from
    (`stimuli.design.adaptive_trials`): with the seed it gives the same list again.
    """
    query = select(Participant).where(Participant.design_state.is_not(None))
    query = query.options(undefer(Participant.design_state)).order_by(Participant.id)
    for person in session.scalars(query.execution_options(yield_per=CHUNK_ROWS)):
        row = {"participant": person.code, "number": person.id, "seed": study.seed}
        row["state"] = json.loads(person.design_state)
        yield json.dumps(row) + "\n"


def pilot_csv(session: Session, study: Study, *, simulated: bool) -> Iterator[str]:
    """The same of those who tried the study out and did not withdraw."""
    who = Participant.pilot.is_(True) & Participant.withdrawn_at.is_(None)
    rows = records(session, study, simulated=simulated, who=who)
    return _csv([column.name for column in columns(study)], (row.values() for row in rows))


def table_csv(names: list[str], rows: Iterable[dict[str, Any]]) -> Iterator[str]:
    """Mappings as a table."""
    return _csv(names, ([row[name] for name in names] for row in rows))


def completed_on(session: Session, code: str) -> date | None:
    """The day on which a completion code was given; None where it was not."""
    query = select(Participant.completed_at).where(Participant.completion_code == code)
    completed_at = session.scalar(query) if code else None
    return None if completed_at is None else completed_at.date()


def completions_csv(session: Session) -> Iterator[str]:
    """completions.csv: a row for each completion code, to pay by; in the codes' order, so that it
    does not say who gave which answers.
    """
    given = select(Participant).where(Participant.completion_code.is_not(None))
    participants = session.scalars(given.order_by(Participant.completion_code))
    return _csv(
        ("completion_code", "completed_on", "withdrawn"),
        (
            (one.completion_code, one.completed_at.date().isoformat(), int(bool(one.withdrawn_at)))
            for one in participants
        ),
    )


def recruits_csv(session: Session, study: Study) -> Iterator[str]:
    """recruits.csv: who came by a recruiter's link and how far they got, to pay or turn down; in
    the order of the recruiter's names, so that it does not say who gave which answers.
    """
    names = study.definition.recruiting.parameters
    participants = session.scalars(
        select(Participant)
        .where(Participant.recruit_id.is_not(None))
        .order_by(Participant.recruit_id)
    )
    rows = (
        (
            *(json.loads(one.recruit).get(name, "") for name in names),
            one.completion_code or "",
            int(one.completed_at is not None),
            int(one.withdrawn_at is not None),
            int(one.excluded_at is not None),
        )
        for one in participants
    )
    header = (*names, "completion_code", "completed", "withdrawn", "excluded")
    return _csv(header, rows)


def links_csv(session: Session) -> Iterator[str]:
    """links.csv: single-use links and what became of each; not whose answers are whose."""
    rows = session.execute(select(Link, Participant).outerjoin(Participant).order_by(Link.id))
    return _csv(
        ("link", "label", "made_on", "state"),
        (
            (link.token, link.label, link.made_at.date().isoformat(), _state(person))
            for link, person in rows
        ),
    )


def _state(person: Participant | None) -> str:
    if person is None:
        return "unused"
    if person.withdrawn_at:
        return "withdrawn"
    return "completed" if person.completed_at else "begun"


def codebook_csv(study: Study) -> Iterator[str]:
    """codebook.csv: a row for each column of responses.csv."""
    return _csv(
        ("column", "type", "values", "description"),
        ((c.name, c.type, c.values, c.description) for c in columns(study)),
    )


def codebook_md(study: Study, *, simulated: bool) -> str:
    """codebook.md: the same for reading, with what the names and numbers stand for."""
    definition = study.definition
    lines = [
        f"# Codebook of {definition.title} ({definition.name}, version {definition.version})",
        "",
        "One row of `responses.csv` is one answer. "
        + (
            "**All answers are simulated.**"
            if simulated
            else "Answers that were withdrawn are not in it."
        ),
        "",
        "| column | type | values | description |",
        "|---|---|---|---|",
        *(f"| `{c.name}` | {c.type} | {c.values} | {c.description} |" for c in columns(study)),
        "",
        f"Question: {definition.question.text}",
        *_shown(study),
        "",
        *(
            f"- point {point.value}, counts as answer {point.counts}: {point.label or '(no words)'}"
            for point in definition.scale
        ),
        *(
            f"- {factor.name} `{level.name}`: {level.label}"
            for factor in definition.factors
            for level in factor.levels
        ),
        *(
            f"- technique `{condition.name}`: {condition.label}"
            for condition in definition.techniques
        ),
        *(f"- reason {place}: {tick}" for place, tick in enumerate(definition.reason.ticks, 1)),
        *(f"- consent in {name}: `{study.consent_sha256(name)}`" for name in definition.languages),
        "",
        f"Familiarity: {definition.familiarity.question}",
        "",
        *(
            f"- familiarity {value}: {label}"
            for value, label in zip(definition.familiarity.levels, definition.familiarity.labels)
        ),
    ]
    return "\n".join(lines) + "\n"


def _shown(study: Study) -> list[str]:
    """What stood between the two images, of a study of triplets."""
    viewer = study.definition.viewer
    if not viewer.triplet:
        return []
    text = f"Shown: triplets, with the reference `{viewer.reference}` between the two images"
    if boost := viewer.boost:
        text += (
            f", boosted: {boost.zoom} screen pixels an image pixel, differences from the reference "
            f"times {boost.amplify:g}, each in turn with it {boost.flicker_hz:g} times a second"
        )
    counts = "An answer counts for the image that it names, as in a study of pairs."
    return ["", f"{text}. {counts}"]


def write(directory: Path, session: Session, study: Study, *, simulated: bool) -> int:
    """Write responses.csv and the codebooks into a folder, each whole or not at all; the number of
    answers.
    """
    directory.mkdir(parents=True, exist_ok=True)
    _write(directory / "codebook.csv", codebook_csv(study))
    _write(directory / "codebook.md", [codebook_md(study, simulated=simulated)])
    _write(directory / "responses.csv", responses_csv(session, study, simulated=simulated))
    return count(session)


def _write(path: Path, parts: Iterable[str]) -> None:
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        file.writelines(parts)


def _harmless(value: Any) -> Any:
    """A text that no spreadsheet takes for a formula, whoever wrote it; responses.jsonl has it as
    it was written.
    """
    return f"'{value}" if isinstance(value, str) and value[:1] in _FORMULA else value


_FORMULA = frozenset("=+-@\t\r")


def _csv(header: Iterable[str], rows: Iterable[Iterable[Any]]) -> Iterator[str]:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(header)
    for number, row in enumerate(rows, start=1):
        writer.writerow(map(_harmless, row))
        if number % CHUNK_ROWS == 0:
            yield buffer.getvalue()
            buffer.seek(0)
            buffer.truncate()
    yield buffer.getvalue()
