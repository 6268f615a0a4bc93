"""Checked values: kinds, ranges, tables of files."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from renderer.errors import InputError
from renderer.parameters import Parameters, nested, parameter


@dataclass(frozen=True)
class Lens(Parameters):
    called: ClassVar[str] = "lens"
    blades: int = parameter(6, unit="blades", low=3, high=12, source="a lens")


@dataclass(frozen=True)
class Camera(Parameters):
    called: ClassVar[str] = "camera"
    height_mm: float = parameter(10.0, unit="mm", low=0.5, high=100.0, source="a test")
    shift: tuple[float, float] = parameter((0.0, 0.0), low=-1.0, high=1.0)
    kind: str = parameter("still", choices=("still", "moving"))
    note: str | None = parameter((None, "text"), optional=True)
    closed: bool = parameter(False)
    lens: Lens = nested(Lens, default=Lens())


def test_a_table_is_read_and_written_back():
    table = {"height_mm": 20, "shift": [0.5, -0.5], "note": "x", "lens": {"blades": 9}}
    camera = Camera.read(table, "scene.camera")
    assert camera.shift == (0.5, -0.5) and camera.lens.blades == 9
    assert Camera.read(camera.plain(), "again") == camera


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"height_mm": 0.1}, "c.height_mm is 0.1 mm; expected 0.5 to 100.0"),
        ({"height_mm": True}, "c.height_mm is True; expected a number"),
        ({"height_mm": float("nan")}, "c.height_mm is nan; expected a number"),
        ({"hight_mm": 1}, "c.hight_mm is unknown; did you mean 'height_mm'?"),
        ({"shift": [1]}, "c.shift is (1,); expected 2 numbers"),
        ({"kind": "slow"}, "c.kind is 'slow'; expected one of 'still', 'moving'"),
        ({"note": " "}, "c.note is ' '; expected a text that is not blank"),
        ({"closed": 1}, "c.closed is 1; expected true or false"),
        ({"lens": {"blades": 4.5}}, "c.lens.blades is 4.5; expected an integer"),
        ({"lens": {"blade": 4}}, "c.lens.blade is unknown; did you mean 'blades'?"),
        ([], "c is []; expected a table"),
    ],
)
def test_what_is_wrong_is_named(table, message):
    with pytest.raises(InputError) as caught:
        Camera.read(table, "c")
    assert str(caught.value) == message
