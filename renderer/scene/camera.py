"""Where the camera stands: a framing and an angle by name, or numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.parameters import Parameters, parameter


@dataclass(frozen=True)
class Camera(Parameters):
    """A camera that looks at `target_mm` so that `height_mm` fill the image's height.

    `target_mm` is relative to the subject: the midpoint of a head's eyes, or an object's centre.
    `yaw_deg` turns the camera about the target towards the person's left, `pitch_deg` lifts it.
    With an `f_number` it has a lens: what is not at the distance of the target less `focus_mm` is
    blurred as on a sensor `sensor_mm` high; 0 is a pinhole.
    `region` is the part of the image that the study is about, as left, top, right, bottom in
    [0, 1]: what a page shows where the whole does not fit, and what metrics look at.
    """

    called: ClassVar[str] = "camera"

    framing: str = parameter("close-up", source="the study's word for the distance")
    target_mm: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="mm", low=-1e5, high=1e5, source="relative to the subject"
    )
    height_mm: float = parameter(330.0, unit="mm", low=0.1, high=1e5, source="at the target")
    yaw_deg: float = parameter(28.0, unit="degrees", low=-360.0, high=360.0, source="chosen by eye")
    pitch_deg: float = parameter(2.0, unit="degrees", low=-89.0, high=89.0, source="chosen by eye")
    fov_y_deg: float = parameter(
        16.0, unit="degrees", low=0.5, high=150.0, source="a portrait lens of 85 mm"
    )
    f_number: float = parameter(0.0, low=0.0, high=64.0, source="0: everything is sharp")
    focus_mm: float = parameter(
        0.0, unit="mm nearer than the target", low=-1e4, high=1e4, source="the target's distance"
    )
    sensor_mm: float = parameter(24.0, unit="mm", low=1.0, high=200.0, source="35 mm film")
    region: tuple[float, float, float, float] = parameter(
        (0.0, 0.0, 1.0, 1.0), unit="of the image", low=0.0, high=1.0, source="the whole image"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        left, top, right, bottom = self.region
        if not (left < right and top < bottom):
            raise InputError(
                f"camera.region is {self.region}; expected left < right and top < bottom"
            )

    @classmethod
    def read(cls, table: dict[str, Any], where: str) -> Camera:
        """A camera from a table: `framing` and `angle` by name first, then numbers over them."""
        if not isinstance(table, Mapping):
            raise InputError(f"{where} is {table!r:.60}; expected a table")
        table = dict(table)
        angle = table.pop("angle", None)
        named = table.get("framing")
        if named is not None and (not isinstance(named, str) or not named.strip()):
            raise InputError(f"{where}.framing is {named!r:.60}; expected a name")
        start = FRAMINGS.get(named or "close-up")
        if start is None:
            if "height_mm" not in table or (angle is None and "yaw_deg" not in table):
                raise InputError(
                    f"{where}.framing is {named!r}; expected one of {', '.join(FRAMINGS)}, "
                    "or a name of your own with height_mm and yaw_deg (or angle)"
                )
            start = cls(framing=named)
        values = start.plain()
        if angle is not None:
            if angle not in ANGLES:
                raise InputError(f"{where}.angle is {angle!r}; expected one of {', '.join(ANGLES)}")
            if "yaw_deg" in table:
                raise InputError(
                    f"{where} has both angle, {angle!r}, and yaw_deg, {table['yaw_deg']!r}; "
                    "expected one of them"
                )
            values["yaw_deg"] = ANGLES[angle]
        return super().read({**values, **table}, where)

    def at(self, angle: str) -> Camera:
        """This camera turned to a named angle."""
        return replace(self, yaw_deg=ANGLES[angle])

    @property
    def distance_mm(self) -> float:
        """From the target to the eye of the camera."""
        return self.height_mm / (2 * np.tan(np.radians(self.fov_y_deg) / 2))

    def eye_mm(self, subject: np.ndarray) -> np.ndarray:
        """The camera's place (3,) for a subject at (3,)."""
        yaw, pitch = np.radians(self.yaw_deg), np.radians(self.pitch_deg)
        away = [np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)]
        return self.target(subject) + self.distance_mm * np.array(away)

    def target(self, subject: np.ndarray) -> np.ndarray:
        """What the camera looks at (3,), for a subject at (3,)."""
        return np.asarray(subject, dtype=float) + self.target_mm


#: The thesis's three distances (its section 4.3), each with a yaw of its own, chosen by eye.
FRAMINGS: dict[str, Camera] = {
    camera.framing: camera
    for camera in (
        Camera("close-up", (9.0, -20.0, -18.0), 136.0, 33.0, 2.0),
        Camera("head-shot", (4.0, -32.0, -60.0), 330.0, 28.0, 2.0),
        Camera("half-length", (2.0, -92.0, -90.0), 452.0, 20.0, 1.0),
    )
}

#: Yaw in degrees of the thesis's figure 4.7: the same head from three sides.
ANGLES: dict[str, float] = {"front": 0.0, "three-quarter": 33.0, "profile": 85.0}
