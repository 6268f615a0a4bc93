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
    assert "<li>your answers to 3 other questions</li>" in text
    assert "<li>the reasons that you give for a choice</li>" in text
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
        assert (row["age"], row["glasses"], row["remarks"]) == (1, 2, "none")
        assert (row["answer"], row["reason_ticks"], row["reason_text"]) == (1, "2", "<b>ears</b>")
    book = export.codebook_md(app.extensions["study"], simulated=False)
    assert "| `age` | integer | 1: under 30, 2: 30 on |" in book and "- reason 2: ears glow" in book


def test_the_screen_is_looked_at(tmp_path, write_study):
    wanted = {"least_px": [1600, 700], "otherwise": "warn", "distance_cm": 60}
    app = create_app(write_study(tmp_path / "screen", screen=wanted))
    somebody = Person(app)
    assert "the zoom" in somebody.get("/").text
    somebody.send("consent", consent="yes")
    somebody.send("familiarity", familiarity=3)
    assert somebody.path == "/screen"
    window = {"window_width": 640, "window_height": 400, "device_pixel_ratio": 2, "zoom": 1}
    seen = {"card_width": 342.4, "grey": 186, "dark_steps": 3, "bright_steps": "nonsense"}
    somebody.send("window_width", **window, **seen)
    assert "smaller than the study needs: 1600 x 700" in somebody.page.text
    somebody.send("window_width", **window, **seen, anyway="yes")
    assert somebody.path == "/question"
    somebody.answer(1)
    with app.extensions["database"].read() as db:
        (row,) = export.records(db, app.extensions["study"], simulated=False)
    assert row["pixels_per_mm"] == 8.0  # 342.4 CSS pixels are 684.8, over 85.6 mm
    assert row["pixels_per_degree"] == pytest.approx(8 * 600 * 0.0174533, rel=1e-3)
    assert row["display_gamma"] == pytest.approx(2.2, abs=0.01)
    assert (row["dark_steps_seen"], row["bright_steps_seen"]) == (3, None)


def test_a_screen_that_is_too_small_can_be_refused(tmp_path, write_study):
    wanted = {"least_px": [1600, 700], "otherwise": "refuse", "card": False, "gamma": False}
    somebody = Person(create_app(write_study(tmp_path / "screen", screen=wanted)))
    somebody.get("/")
    somebody.send("consent", consent="yes")
    somebody.send("familiarity", familiarity=3)
    small = {"window_width": 800, "window_height": 700, "device_pixel_ratio": 1, "anyway": "yes"}
    somebody.send("window_width", **small)
    assert "smaller than the study needs" in somebody.page.text
    somebody.get("/question")
    assert somebody.path == "/screen"
    somebody.send("window_width", **small | {"device_pixel_ratio": 2})
    assert somebody.path == "/question"


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
    applies = app.extensions["study"].definition.reason.applies
    drawn = [applies(f"7/{person}", order) for person in range(50) for order in range(30)]
    assert drawn == [applies(f"7/{p}", order) for p in range(50) for order in range(30)]
    assert 0.35 < sum(drawn) / len(drawn) < 0.45


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"before": [{"name": "answer", "kind": "text", "text": "?"}]}, "no other column"),
        ({"before": [{"name": "a", "kind": "choice", "text": "?"}]}, r"before\[0\].options"),
        ({"after": [{"name": "a", "kind": "choise", "text": "?"}]}, "one of choice, scale, text"),
        ({"reason": {"share": 2}}, "a number from 0 to 1"),
        ({"screen": {"least_px": [1]}}, "screen.least_px"),
        ({"pages": {"break_every": -1}}, "pages.break_every"),
        ({"scale": [{"value": -1, "label": "a"}, {"value": 2, "label": "b"}]}, "both sides"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path, write_study, changes, error):
    with pytest.raises(InputError, match=error):
        create_app(write_study(tmp_path / "study", **changes))


#: Every column about a participant: by which words of the consent, or why no words are needed.
STORED = {
    "your self-rating": "familiarity",
    "your answers": "answer point reason_ticks reason_text image_left_sha256 image_right_sha256",
    "the times at which you began, answered and ended": "consented_at answered_at started_at "
    "completed_at withdrawn_at rt_ms timed_by rt_server_ms rt_reported_ms at",
    "how often a question was opened": "times_shown",
    "the size of your window and of the images on it, and its scaling": "viewport_width "
    "viewport_height device_pixel_ratio shown_width shown_height pixel_scale seen_share",
    "how you looked at each pair (views, zoom, how long)": "view beside_ms flicker_ms wipe_ms "
    "triplet_ms boosted_ms flips pixel_scale_largest",
    "how long the page was out of sight": "away_ms",
    "the language of the pages": "language consent_language",
}
#: Numbers and codes that the server makes, what a researcher notes, what a recruiter's link says.
OURS = (
    "id participant_id trial_id visit completion_code withdrawal_key resume_code pilot recruit "
    "recruit_id list_number design_state "
    "screen excluded_at excluded_because consent_sha256"
)
OWN = "name value"  # of the study's own questions


def test_the_consent_says_all_that_is_stored():
    from app.models import Participant, Response, Statement
    from app.study import RECORDED

    assert tuple(STORED) == RECORDED
    known = set(" ".join([*STORED.values(), OURS, OWN]).split())
    columns = {c.name for table in (Participant, Response, Statement) for c in table.__table__.c}
    assert columns <= known, columns - known
