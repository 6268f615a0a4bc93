"""The form of a generated person between the morph targets and the skin's relief: folds, tendons
and bones by name, their places on the reference head, and how deep they are at which age.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from renderer.errors import InputError
from renderer.parameters import Parameters, parameter, refuse_unknown

SIDES = ("left", "right")


@dataclass(frozen=True)
class Relief(Parameters):
    """One fold or rise.

    height_mm: of its middle along the normal, negative for a groove; width_mm: at the distance of
    one width from the middle 1/e of it is left; bulge_mm: of the swelling beside it, on the outer
    side (the one that `bulge` of its Place says), highest at bulge_width_mm from the middle.
    """

    called: ClassVar[str] = "relief"

    height_mm: float = parameter(0.0, unit="mm", low=-15.0, high=15.0, source="by eye")
    width_mm: float = parameter(2.0, unit="mm", low=0.3, high=60.0, source="by eye")
    bulge_mm: float = parameter(0.0, unit="mm", low=-8.0, high=8.0, source="by eye")
    bulge_width_mm: float = parameter(5.0, unit="mm", low=0.5, high=60.0, source="by eye")


@dataclass(frozen=True)
class Place:
    """Where something lies on the reference head, and what it is there.

    points: (x, y) or (x, y, z) mm of a curve on the base mesh without targets, x from the middle,
    y above the eyes, z as the mesh has it; two numbers are dropped on the face from the front,
    three are taken to the nearest point of the skin. One point is a spot. both: mirrored to the
    other side. fold: it deepens with age from the first year to the second; rises of bone do not.
    taper: shares of the curve over which it sets in and ends. bulge: +1 the swelling lies to the
    left of the curve's direction seen from outside, -1 to the right.
    """

    points: tuple[tuple[float, ...], ...]
    relief: Relief
    both: bool = True
    fold: tuple[float, float] | None = None
    young: float = 0.0
    taper: tuple[float, float] = (0.3, 0.3)
    bulge: int = 1


def _fold(points, height, width, bulge=0.0, bulge_width=5.0, *, ages=(20, 65), **rest) -> Place:
    return Place(points, Relief(height, width, bulge, bulge_width), fold=ages, **rest)


def _bone(points, height, width, **rest) -> Place:
    return Place(points, Relief(height, width), **rest)


# fmt: off
#: What there is, by name. Depths are those of its later year; all were chosen by eye under clay and
#: portrait light, on the places that anatomy gives them.
PLACES: dict[str, Place] = {
    # folds of the face
    "nasolabial": _fold(
        ((15.5, -34), (19.5, -40), (24, -48), (28.5, -57), (31.5, -66), (32.5, -73)),
        -1.5, 3.2, 1.2, 8.0, young=0.25, taper=(0.25, 0.6)),
    "tear_trough": _fold(
        ((15.5, -5.5), (18.5, -11), (23.5, -15.5), (30, -18)),
        -1.3, 4.0, 0.35, 6.0, young=0.30, taper=(0.45, 0.6)),
    "lid_bag": _fold(
        ((21, -9.5), (27, -12.2), (34, -12.2), (41, -9)),
        -0.7, 2.3, 0.55, 4.2, young=0.15, taper=(0.4, 0.4), ages=(30, 70)),
    "lid_crease": _fold(
        ((18.5, 3.5), (22, 7.0), (27, 9.6), (33, 10.0), (39, 7.8), (44.5, 3.6)),
        -0.5, 0.75, young=0.7),
    "wing_crease": _fold(
        ((13.6, -32), (16.8, -35), (18.4, -39), (17.8, -43.5), (15.0, -46.5)),
        -1.1, 1.6, young=0.85, taper=(0.35, 0.3)),
    "philtrum": _fold(
        ((0, -48.5), (0, -53), (0, -58.5)), -0.6, 2.5, young=0.9, both=False,
        taper=(0.35, 0.4)),
    "philtrum_columns": _bone(
        ((3.4, -48.5), (4.4, -53.5), (5.4, -58.5)), 0.3, 1.7, taper=(0.4, 0.4)),
    "mentolabial": _fold(
        ((-13, -83.5), (-6, -85.5), (0, -86), (6, -85.5), (13, -83.5)),
        -1.2, 2.6, young=0.5, both=False, taper=(0.35, 0.35)),
    "marionette": _fold(
        ((26.5, -71), (28.5, -77), (29.5, -84), (29.0, -91)),
        -1.2, 1.7, 0.9, 5.5, ages=(38, 75), taper=(0.2, 0.5)),
    "mouth_corner": _fold(
        ((25.4, -68.3), (27.2, -69.6)), -0.7, 2.3, young=0.8, taper=(0.0, 0.0)),
    "crows_foot_upper": _fold(
        ((48, 3.5), (53, 6.5), (59, 8.5)), -0.42, 0.75, ages=(28, 65), taper=(0.4, 0.6)),
    "crows_foot_middle": _fold(
        ((48, 0), (54, -0.5), (61, -2.5)), -0.50, 0.75, ages=(28, 65), taper=(0.4, 0.6)),
    "crows_foot_lower": _fold(
        ((47, -4), (52, -7.5), (58, -11.5)), -0.42, 0.75, ages=(28, 65), taper=(0.4, 0.6)),
    "frown": _fold(
        ((6.2, 12), (5.2, 17), (5.6, 23)), -0.65, 1.0, 0.3, 3.0, ages=(28, 70), taper=(0.4, 0.5)),
    "nose_root": _fold(
        ((-7.5, 4.0), (0, 3.2), (7.5, 4.0)), -0.45, 0.9, both=False, ages=(35, 75),
        taper=(0.4, 0.4)),
    "forehead_low": _fold(
        ((-38, 28), (-22, 31.5), (-8, 29.0), (4, 28.5), (18, 31.0), (34, 29.5)),
        -0.42, 0.95, 0.16, 3.0, both=False, ages=(25, 70), taper=(0.3, 0.35)),
    "forehead_middle": _fold(
        ((-35, 37.0), (-20, 41), (-6, 38.5), (7, 39), (22, 41.5), (40, 37)),
        -0.50, 1.0, 0.18, 3.2, both=False, ages=(25, 70), taper=(0.35, 0.3)),
    "forehead_high": _fold(
        ((-26, 49), (-12, 51.5), (0, 50), (14, 52), (27, 49)),
        -0.36, 1.0, 0.14, 3.2, both=False, ages=(32, 75), taper=(0.4, 0.4)),
    "neck_ring_upper": _fold(
        ((-40, -106, 88), (-24, -115), (0, -119), (24, -115), (40, -106, 88)),
        -0.75, 1.3, 0.4, 6.0, both=False, young=0.15, taper=(0.45, 0.45)),
    "neck_ring_lower": _fold(
        ((-36, -132, 80), (-18, -140), (0, -143), (20, -139), (36, -132, 80)),
        -0.70, 1.3, 0.4, 6.0, both=False, young=0.15, taper=(0.45, 0.45)),
    "jowl": _fold(((40, -88),), 2.6, 10.0, ages=(42, 80)),
    "cheek_hollow": _fold(((47, -50),), -2.6, 15.0, young=0.45),
    "temple": _fold(((58, 24),), -3.0, 15.0, young=0.5),
    # bones, muscles and tendons
    "frontal_eminence": _bone(((27, 50),), 2.2, 17.0),
    "glabella": _bone(((0, 13),), 0.9, 7.0, both=False),
    "brow_ridge": _bone(((7, 16), (16, 18.5), (27, 18.5), (37, 15), (44, 9.5)), 1.5, 5.0),
    "cheekbone": _bone(((30, -20), (42, -18), (54, -13), (64, -8)), 1.7, 8.5),
    "jaw": _bone(((56, -70, 76), (49, -85, 96), (38, -97), (24, -105)), 1.3, 6.0),
    "chin_pad": _bone(((6.5, -95),), 0.7, 6.0),
    "larynx": _bone(((0, -110), (0, -117), (0, -126)), 2.6, 7.5, both=False, taper=(0.35, 0.35)),
    "neck_muscle": _bone(
        ((64, -52, 38), (55, -88, 46), (40, -128, 68), (23, -160, 88), (9, -181, 100)),
        4.5, 7.5, taper=(0.3, 0.1)),
    "neck_muscle_outer": _bone(
        ((44, -122, 62), (38, -150, 74), (38, -178, 82)), 1.6, 5.5),
    "collar_bone": _bone(
        ((11, -187), (26, -187.5), (45, -183), (70, -176), (95, -170), (120, -164), (142, -163)),
        5.0, 6.0, taper=(0.1, 0.35)),
    "above_collar_bone": _bone(((54, -170),), -5.0, 13.0),
    "below_collar_bone": _bone(((92, -191),), -3.0, 14.0),
    "breastbone_notch": _bone(((0, -180),), -5.0, 7.0, both=False),
    "breastbone": _bone(((0, -205), (0, -250), (0, -300)), -1.8, 8.0, both=False),
    "shoulder_muscle": _bone(((38, -112, 14), (66, -146, 22), (105, -162, 26)), 3.0, 14.0),
    "nipple": _bone(((83, -349),), 1.6, 2.6),
    # the ear's cartilage, and how its lobe hangs from the cheek
    "antihelix": _bone(
        ((76.7, -30.5, 49), (78.4, -27, 46), (80.3, -22, 44.3), (82.2, -16, 43.6),
         (83.9, -10, 44.2), (83.2, -5, 46), (81.7, -1.5, 48.5)), 1.1, 3.0, taper=(0.3, 0.4)),
    "tragus": _bone(
        ((73.6, -20.5, 60), (74.0, -24.5, 59.8), (73.7, -28, 60)), 1.0, 3.2, taper=(0.4, 0.4)),
    "antitragus": _bone(((75.3, -32.5, 52),), 0.6, 3.6),
    "tragal_notch": _bone(((73.1, -32, 57),), -0.4, 3.0),
    "ear_lobe": _bone(((74.7, -39, 55),), 1.0, 5.0),
    "ear_lobe_edge": _bone(((74.2, -43.3, 53.5),), 1.6, 5.0),
    "ear_lobe_crease": _bone(
        ((69.7, -37, 66), (69.2, -41, 65), (69.2, -44, 62.5)), -0.9, 3.0, taper=(0.5, 0.2)),
}
# fmt: on


@dataclass(frozen=True)
class Form(Parameters):
    """The middle scale of a person's form; relief goes over the defaults of PLACES by name.

    age_years: how deep folds are (bones stay); folds and bones: factors of all of them. The weaker
    side's are shallower by the share asymmetry, and curves stray by about wander_mm, drawn from
    seed. lips_mm: how far closed lips lie over each other, 0
    leaves them as the mesh has them; lip_ridge_mm: height of the ridge along
    the vermilion's border, lip_ridge_width_mm wide; vermilion_mm: heights of the upper and the
    lower lip's red in the middle, 0 leaves the mesh's. nostril_mm: how deep the nostrils are, 0
    leaves them closed; nostril_long: their length, of the mesh's own dent's; nostril_wide: their
    width, of the length; nostril_wall: how far from their middle they are full deep, so that their
    walls are steeper the more it is; nostril_arch_mm: how far the wing's margin rises over them.
    """

    called: ClassVar[str] = "form"

    age_years: float = parameter(38.0, unit="years", low=15.0, high=95.0, source="by eye")
    folds: float = parameter(1.0, low=0.0, high=3.0, source="1 is PLACES as it stands")
    bones: float = parameter(1.0, low=0.0, high=3.0, source="1 is PLACES as it stands")
    asymmetry: float = parameter(0.14, low=0.0, high=1.0, source="by eye")
    weaker: str = parameter("left", choices=SIDES, source="of the person's sides")
    wander_mm: float = parameter(0.7, unit="mm", low=0.0, high=5.0, source="by eye")
    seed: int = parameter(0, low=0, high=2**31 - 1, source="of what strays")
    lips_mm: float = parameter(0.7, unit="mm", low=0.0, high=3.0, source="by eye")
    lip_ridge_mm: float = parameter(0.30, unit="mm", low=-1.0, high=2.0, source="by eye")
    lip_ridge_width_mm: float = parameter(1.1, unit="mm", low=0.3, high=5.0, source="by eye")
    vermilion_mm: tuple[float, float] = parameter(
        (0.0, 0.0), unit="mm, upper and lower", low=0.0, high=20.0, source="the targets' own"
    )
    nostril_mm: float = parameter(6.0, unit="mm", low=0.0, high=12.0, source="by eye")
    nostril_long: float = parameter(0.92, low=0.5, high=1.6, source="1 is about 9 mm")
    nostril_wide: float = parameter(0.50, low=0.2, high=1.2, source="by eye")
    nostril_wall: float = parameter(
        0.20, unit="of the half axes", low=0.0, high=0.8, source="by eye"
    )
    nostril_arch_mm: float = parameter(1.0, unit="mm", low=-1.0, high=4.0, source="by eye")
    relief: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        where = self.where("relief")
        if not isinstance(self.relief, Mapping):
            raise InputError(f"{where} is {self.relief!r:.60}; expected a table of named tables")
        refuse_unknown(self.relief, PLACES, where)
        own = {}
        for name, table in self.relief.items():
            if isinstance(table, Mapping):
                base = {k: v for k, v in self._usual(name).plain().items() if k not in table}
                table = Relief.read({**base, **table}, f"{where}.{name}")
            if not isinstance(table, Relief):
                raise InputError(f"{where}.{name} is {table!r:.60}; expected a table")
            own[name] = table
        object.__setattr__(self, "relief", own)

    @classmethod
    def none(cls) -> Form:
        """The morphed mesh as it is."""
        return cls(folds=0.0, bones=0.0, lips_mm=0.0, lip_ridge_mm=0.0, nostril_mm=0.0)

    def _usual(self, name: str) -> Relief:
        """What stands in PLACES, at this age."""
        place = PLACES[name]
        share = self.bones
        if place.fold is not None:
            first, last = place.fold
            t = min(max((self.age_years - first) / (last - first), 0.0), 1.0)
            share = self.folds * (place.young + (1 - place.young) * t)
        usual = place.relief
        return Relief(
            min(max(share * usual.height_mm, -15.0), 15.0),
            usual.width_mm,
            min(max(share * usual.bulge_mm, -8.0), 8.0),
            usual.bulge_width_mm,
        )

    def of(self, name: str) -> Relief:
        """The fold or rise of a name: the person's own, else that of their age."""
        return self.relief.get(name) or self._usual(name)
