"""Scales of two to eleven points, and limits that a study sets."""

import csv
import io

import pytest

from analysis import responses
from app import create_app, export
from stimuli.errors import InputError
from tests.app.conftest import Person

COUNTS = {-3: -2, -2: -2, -1: -1, 0: 0, 1: 1, 2: 2, 3: 2}
WORDS = {-3: "Surely A", 0: "Neither", 3: "Surely B"}
SEVEN = [{"value": v, "label": WORDS.get(v, ""), "counts": c} for v, c in COUNTS.items()]


def test_a_finer_scale_is_kept_whole_and_counts_as_declared(tmp_path, write_study):
    app = create_app(write_study(tmp_path / "study", scale=SEVEN))
    study, visitor = app.extensions["study"], Person(app).begin()
    page = visitor.page.text
    assert page.count('name="answer"') == 7 and "<span>Neither</span>" in page
    assert "<span>2</span>" in page  # a point without words has its number
    given = [-3, -2, -1, 0, 1, 2, 3] * 4 + [3, -3]
    first = visitor.form("trial")
    visitor.answer(*given)
    assert visitor.answers == [COUNTS[value] for value in given]
    assert [row.point for row in visitor.rows] == given
    assert visitor.path == "/thanks"
    # the same answer again is one; another point of the same strength is refused
    for value, status in ((-3, 200), (-2, 409)):
        again = visitor.http.post(
            "/question",
            data={**first, "answer": value},
            headers={"Accept": "application/json"},
        )
        assert again.status_code == status
    with app.extensions["database"].read() as db:
        text = "".join(export.responses_csv(db, study, simulated=False))
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [int(row["point"]) for row in rows] == given
    path = tmp_path / "responses.csv"
    path.write_text(text)
    assert responses.read_responses(path).rows == 30
    codebook = export.codebook_md(study, simulated=False)
    assert "- point -3, counts as answer -2: Surely A" in codebook
    assert "- point 2, counts as answer 2: (no words)" in codebook
    assert study.definition.strengths[2] == "6 / Surely B"


@pytest.mark.parametrize("points", [2, 3, 6, 11])
def test_scales_of_every_length(tmp_path, write_study, points):
    half = points // 2
    values = [v for v in range(-half, half + 1) if v or points % 2]
    scale = [{"value": v, "label": f"point {v}", "counts": max(-2, min(2, v))} for v in values]
    definition = create_app(write_study(tmp_path / "study", scale=scale)).extensions["study"]
    assert [point.value for point in definition.definition.scale] == values


@pytest.mark.parametrize(
    "scale, error",
    [
        ([{**one, "counts": 0} for one in SEVEN], "have their values' signs"),
        ([{k: v for k, v in one.items() if k != "counts"} for one in SEVEN], "counts: missing"),
        ([{**one, "label": ""} for one in SEVEN], r"scale\[0\].label"),
        ([{**SEVEN[0], "value": v} for v in range(-6, 6)], "2 to 11 tables"),
        ([{"value": -1, "label": "A"}, {"value": 1, "label": ""}], r"scale\[1\].label"),
    ],
)
def test_scales_that_count_for_nothing_are_refused(tmp_path, write_study, scale, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "study", scale=scale))


def test_limits_are_the_studys(tmp_path, write_study):
    app = create_app(
        write_study(
            tmp_path / "study",
            quality={"fastest_ms": 400},
            pages={"seconds": [60, 60]},
            viewer={"gap": 24},
        )
    )
    visitor = Person(app)
    assert "30 minutes" in visitor.get("/").text
    visitor.begin().answer(1)  # in 321 ms
    assert 'data-gap="24"' in visitor.page.text
    assert "--gap: 24px" in visitor.get("/study.css").text
    with app.extensions["database"].read() as db:
        (row,) = export.records(db, app.extensions["study"], simulated=False)
    assert row["rt_flag"] == "fast"
