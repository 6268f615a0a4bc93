"""Questions that tell how well people look: asked, marked, and apart in the analysis."""

import pytest

from analysis.agreement import participants
from analysis.codebook import read_manifest
from analysis.declared import options
from analysis.responses import read_responses
from app import create_app, export
from app.dashboard import live
from stimuli.errors import InputError
from tests.app.conftest import Person

QUALITY = {
    "practice": 1,
    "repeats": 2,
    "swapped": 2,
    "bias": 1,
    "traps": [{"framing": "close-up", "better": "golubev", "worse": "none"}],
}


def test_each_is_marked_and_only_the_main_ones_count(tmp_path, write_study):
    folder = write_study(
        tmp_path / "study",
        quality=QUALITY,
        analysis={"exclusions": {"trap_share": 0.5, "repeat_share": False}},
    )
    app = create_app(folder)
    assert "37 questions" in Person(app).get("/").text
    study = app.extensions["study"]
    first = Person(app).begin()
    assert "<strong>Practice</strong>" in first.page.text
    for person, side in ((first, -1), (Person(app).begin(), 1)):
        person.answer(*[side] * 37)
        assert person.path == "/thanks"
    with app.extensions["database"].read() as db:
        rows = list(export.records(db, study, simulated=False))
        numbers = live.numbers(db, study)
    kinds = [row["kind"] for row in rows]
    assert [kinds.count(kind) for kind in ("main", "practice", "repeat", "swapped", "bias")] == [
        *(60, 2, 4, 4, 2)
    ]
    assert sum(numbers["sides"]["preferred"].values()) == 60
    assert sum(framing["answers"] for framing in numbers["framings"]) == 60
    path = folder / "responses.csv"
    with app.extensions["database"].read() as db:
        path.write_text("".join(export.responses_csv(db, study, simulated=False)))
    answers = read_responses(path, read_manifest(folder))
    assert len(answers.frame) == 60 and len(answers.repeats) == 8
    assert all(finding.kind == "duplicate" for finding in answers.findings)
    assert any("2 answers to trap pairs stand apart" in note for note in answers.notes)
    assert any("0 see no difference, 1 prefer the left, 1 the right" in n for n in answers.notes)
    people = participants(answers, options(study.definition.analysis, "the study"))
    traps = {row["participant"]: row["expected"] for row in rows if row["kind"] == "trap"}
    for row in people.itertuples():
        side = {"P0001": -1, "P0002": 1}[row.participant]
        fell = traps[row.participant] != side
        assert (row.traps, row.trap_share) == (1, 0.0 if fell else 1.0)
        assert ("trap_share" in row.excluded) == fell


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"repeats": 9, "swapped": 7}, "together, expected at most 15"),
        ({"practice": -1}, "quality.practice"),
        ({"traps": [{"framing": "far", "better": "golubev", "worse": "none"}]}, "traps.*framing"),
        ({"traps": [{"framing": "close-up", "better": "none", "worse": "none"}]}, "worse"),
        ({"trap": []}, "did you mean 'traps'"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path, write_study, changes, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "study", quality=changes))
