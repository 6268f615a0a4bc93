"""Colour plates: all that tells figure from ground is what a dichromat lacks; a study's rule."""

import io

import numpy as np
import pytest
from PIL import Image

from app import create_app, export
from app.models import Participant
from app.plates import CONES, DIGITS, KINDS, Plate, plates
from stimuli.asking import PLATE_KINDS
from stimuli.errors import InputError
from tests.app.conftest import Person

#: What the missing cone is taken for, of the other two (Vienot, Brettel and Mollon 1999); they give
#: none for tritanopes, for whom any linear form says the same here: half of the others' mean.
SEEN_AS = {
    "protan": (0, [0.0, 2.02344, -2.52581]),
    "deutan": (1, [0.494207, 0.0, 1.24827]),
    "tritan": (2, [0.25, 0.25, 0.0]),
}


def separation(values, figure):
    """How often a dot of the figure has more than one of the ground: 0.5 tells nothing."""
    above = values[figure][:, None] > values[~figure][None]
    return above.mean()


@pytest.mark.parametrize("kind", SEEN_AS)
def test_a_dichromat_sees_one_colour_and_others_two(kind):
    cone, weights = SEEN_AS[kind]
    for digit in DIGITS[:3]:
        plate = Plate(kind, digit, (1, int(digit)))
        places, figure, colours = plate.dots
        assert colours.min() > 0 and colours.max() < 1  # no dot is clipped, so none gives it away
        lms = colours @ CONES.T
        seen = lms.copy()
        seen[:, cone] = lms @ weights
        hue = seen / seen.sum(axis=1, keepdims=True)
        assert np.ptp(hue, axis=0).max() < 1e-9  # one chromaticity
        # and the light alone, which is random, says as little as a coin, to their eyes
        assert abs(separation(seen.sum(axis=1), figure) - 0.5) < 0.15
        others = lms[:, cone] / lms.sum(axis=1)
        assert separation(others, figure) in (0, 1)
        assert 25 < figure.sum() < len(places) / 3


def test_the_first_plate_is_for_everybody_and_dots_do_not_touch():
    first, *others = plates(7, 6)
    assert [one.kind for one in others] == ["protan", "deutan", "protan", "deutan", "protan"]
    assert [one.kind for one in plates(7, 4, ("tritan", "protan"))[1:]] == [
        "tritan",
        "protan",
        "tritan",
    ]
    assert set(KINDS) == {first.kind, *PLATE_KINDS}
    places, figure, colours = first.dots
    assert separation(colours.sum(axis=1), figure) > 0.95
    apart = np.hypot(*(places[:, None, :2] - places[None, :, :2]).transpose(2, 0, 1))
    apart -= places[:, 2] + places[:, None, 2]
    assert apart[np.triu_indices(len(places), 1)].min() > 1
    assert plates(7, 6) == (first, *others) and plates(8, 6) != plates(7, 6)


def at_the_screen(app):
    somebody = Person(app)
    somebody.get("/")
    consent = somebody.page.text
    somebody.send("consent", consent="yes")
    somebody.send("familiarity", familiarity=3)
    assert somebody.path == "/screen"
    return somebody, consent


def test_what_was_read_is_recorded_and_the_rule_applied(tmp_path, write_study):
    wanted = {"card": False, "gamma": False, "plates": 3, "plates_read": 2}
    app = create_app(write_study(tmp_path / "plates", screen=wanted))
    shown = plates(7, 3)
    somebody, consent = at_the_screen(app)
    assert "which colour plates you read" in consent
    assert somebody.page.text.count('alt="Picture of dots') == 3
    image = Image.open(io.BytesIO(somebody.http.get("/plate/2.png").data))
    assert image.size == (880, 880) and somebody.http.get("/plate/4.png").status_code == 404
    read = {f"plate_{k}": one.digit for k, one in enumerate(shown, 1)}
    somebody.send("window_width", **read | {"plate_3": ""})
    assert somebody.path == "/question"
    somebody.answer(1)
    with app.extensions["database"].read() as db:
        (row,) = export.records(db, app.extensions["study"], simulated=False)
    assert (row["plates_read"], row["plates_given"]) == (
        2,
        f"{shown[0].digit};{shown[1].digit};",
    )
    other, _ = at_the_screen(app)
    other.send("window_width", **read | {"plate_2": "x", "plate_3": "8"})
    assert other.path == "/not-taken" and "read most of the plates" in other.page.text
    for path in ("/question", "/screen", "/"):  # and cannot be tried again
        other.get(path)
        assert other.path == "/not-taken"
    with app.extensions["database"].read() as db:
        person = db.get(Participant, 2)
        assert person.excluded_because == "read 1 of 3 colour plates, 2 are needed"


def test_without_a_rule_nobody_is_turned_away(tmp_path, write_study):
    app = create_app(write_study(tmp_path / "plates", screen={"plates": 2}))
    somebody, _ = at_the_screen(app)
    somebody.send("window_width")
    assert somebody.path == "/question"
    with pytest.raises(InputError, match=r"screen\.plates_read: got 3"):
        create_app(write_study(tmp_path / "many", screen={"plates": 2, "plates_read": 3}))


def test_a_study_without_plates_says_and_stores_nothing_of_them(person, app):
    somebody = person()
    assert "colour plates" not in somebody.get("/").text
    assert somebody.http.get("/plate/1.png").status_code == 404
    somebody.begin().answer(1)
    with app.extensions["database"].read() as db:
        (row,) = export.records(db, app.extensions["study"], simulated=False)
    assert row["plates_read"] is None and row["plates_given"] is None
