"""What a study asks beside the pairs: its own questions, reasons, rests, other scales."""

import pytest

from app import create_app, export
from app.commands import simulate
from stimuli.errors import InputError
from tests.app.conftest import Person

STUDY = {
    "framings": [{"name": "close-up", "label": "near"}],
    "before": [
        {"name": "age", "kind": "choice", "text": "How old?", "options": ["under 30", "30 on"]},
        {"name": "glasses", "kind": "scale", "text": "How well do you see?"}
        | {"options": ["badly", "", "well"], "required": False},
    ],
    "after": [{"name": "remarks", "kind": "text", "text": "Remarks?", "required": False}],
    "reason": {"share": 1, "ticks": ["softer skin", "ears glow"], "text": "Why?"},
    "pages": {"instructions": "Look closely.", "debrief": "It was about skin.", "break_every": 4},
    "scale": [{"value": -1, "label": "left"}, {"value": 1, "label": "right"}],
}


@pytest.fixture
def study_dir(tmp_path, write_study):
    folder = write_study(tmp_path / "study", **STUDY)
    # five techniques at one of the three framings of the images: ten pairs
    import json

    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["images"] = [i for i in manifest["images"] if i["framing"] == "close-up"]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


def test_the_whole_of_it_in_its_order(app, person):
    somebody = person()
    text = somebody.get("/").text
    assert "your answers to 3 other questions, the reasons that you give" in text
    somebody.send("consent", consent="yes")
    somebody.send("familiarity", familiarity=3)
    assert somebody.path == "/before"
    somebody.get("/question")
    assert somebody.path == "/before"
    somebody.send("stated", glasses=2)
    assert "not marked as optional" in somebody.page.text  # and what was given stays
    assert 'name="glasses" value="2" checked' in somebody.page.text
    somebody.send("stated", age=1, glasses=2)
    assert somebody.path == "/question" and "Look closely." in somebody.page.text
    somebody.get("/question?rested=0")
    for done in range(1, 11):
        somebody.send("trial", answer=1, rt_ms=300, reason_2="yes", reason_text=" <b>ears</b> ")
        if done in (4, 8):
            assert f"{done} of 10 questions are answered" in somebody.page.text
            somebody.get(f"/question?rested={done}")
            assert somebody.get("/question").text.count(
                "Question "
            )  # a reload needs no second rest
    assert somebody.path == "/after"
    somebody.get("/thanks")
    assert somebody.path == "/after"  # no code before the last page
    somebody.page = somebody.http.post(
        "/after",
        data=somebody.form("stated") | {"remarks": "none"},
        follow_redirects=True,
    )
    assert somebody.path == "/thanks" and "It was about skin." in somebody.page.text
    with app.extensions["database"].read() as db:
        rows = list(export.records(db, app.extensions["study"], simulated=False))
    assert len(rows) == 10
    for row in rows:
        assert (row["age"], row["glasses"], row["remarks"]) == ("1", "2", "none")
        assert (row["answer"], row["reason_ticks"], row["reason_text"]) == (1, "2", "<b>ears</b>")
    book = export.codebook_md(app.extensions["study"], simulated=False)
    assert "| `age` | integer | 1: under 30, 2: 30 on |" in book and "- reason 2: ears glow" in book


def test_an_answer_that_the_scale_lacks_is_not_taken(app):
    somebody = Person(app)
    somebody.get("/")
    somebody.send("consent", consent="yes")
    somebody.send("familiarity", familiarity=3)
    somebody.send("stated", age=2)
    somebody.get("/question?rested=0")
    somebody.send("trial", answer=0, rt_ms=300)
    assert "choose one of the answers" in somebody.page.text and somebody.answers == []


def test_programs_go_through_all_of_it(study_dir):
    simulate.command.main(
        [str(study_dir), "--participants", "2", "--seed", "1"], standalone_mode=False
    )
    table = (study_dir / "simulated" / "responses.csv").read_text().splitlines()
    header, *rows = (line.split(",") for line in table)
    assert len(rows) == 20
    answers = [dict(zip(header, row)) for row in rows]
    assert {row["answer"] for row in answers} <= {"-1", "1"}
    assert {row["remarks"] for row in answers} == {"simulated"}
    assert all(row["age"] in "12" for row in answers)


def test_reasons_are_asked_of_a_share_that_the_seed_draws(tmp_path, write_study):
    app = create_app(write_study(tmp_path / "study", reason={"share": 0.4}))
    asked = app.extensions["study"].definition.reason.asked
    drawn = [asked(f"7/{person}", order) for person in range(50) for order in range(30)]
    assert drawn == [asked(f"7/{p}", order) for p in range(50) for order in range(30)]
    assert 0.35 < sum(drawn) / len(drawn) < 0.45


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"before": [{"name": "answer", "kind": "text", "text": "?"}]}, "no other column"),
        ({"before": [{"name": "a", "kind": "choice", "text": "?"}]}, r"before\[0\].options"),
        ({"after": [{"name": "a", "kind": "choise", "text": "?"}]}, "one of choice, scale, text"),
        ({"reason": {"share": 2}}, "a number from 0 to 1"),
        ({"pages": {"break_every": -1}}, "pages.break_every"),
        ({"scale": [{"value": -1, "label": "a"}, {"value": 2, "label": "b"}]}, "both sides"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path, write_study, changes, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "study", **changes))
