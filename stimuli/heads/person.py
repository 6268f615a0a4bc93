"""A person: the named set of parameters that a head is generated from (stimuli/people/*.toml)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.parameters import Parameters, nested, parameter, refuse_unknown, weights
from stimuli.heads.expression import Expression
from stimuli.heads.form import Form
from stimuli.heads.regions import Regions
from stimuli.heads.styles import Style

_COLOUR = {"unit": "linear albedo", "low": 0.0, "high": 1.0}


@dataclass(frozen=True)
class Eyes(Parameters):
    """Eyes and the lids about them; `iris` is its colour between the fibres.

    gaze: "lens", where each picture's camera is, or "given", by yaw and pitch. Lids are fitted to
    the given gaze in both cases.
    """

    called: ClassVar[str] = "eyes"

    radius_mm: float = parameter(
        12.0, unit="mm", low=10.0, high=14.0, source="Bekerman et al. 2014, 10.1155/2014/503645"
    )
    iris_mm: float = parameter(
        5.7,
        unit="mm, radius",
        low=4.5,
        high=6.5,
        source="Rufer et al. 2005: 11.71 +- .42 mm white to white; on heads as small as these",
    )
    pupil_mm: float = parameter(
        1.6, unit="mm, radius", low=0.5, high=4.0, source="Watson and Yellott 2012, in bright light"
    )
    iris: tuple[float, float, float] = parameter((0.055, 0.075, 0.070), source="by eye", **_COLOUR)
    fibres: tuple[float, float, float] = parameter(
        (0.105, 0.118, 0.092), source="by eye", **_COLOUR
    )
    collarette: tuple[float, float, float] = parameter(
        (0.13, 0.078, 0.030), source="by eye", **_COLOUR
    )
    limbus_mm: float = parameter(
        1.1, unit="mm, width of the dark ring's edge", low=0.1, high=3.0, source="by eye"
    )
    limbus: float = parameter(
        0.5, unit="share of light that the ring takes", low=0.0, high=1.0, source="by eye"
    )
    sclera: tuple[float, float, float] = parameter((0.47, 0.407, 0.367), source="by eye", **_COLOUR)
    veins: float = parameter(1.0, unit="of their strength", low=0.0, high=4.0, source="by eye")
    redness: float = parameter(
        1.0, unit="of the corners' redness", low=0.0, high=4.0, source="by eye"
    )
    gaze: str = parameter("lens", choices=("lens", "given"), source="portraits look into the lens")
    gaze_yaw_deg: float = parameter(
        17.0, unit="degrees to the person's left", low=-40.0, high=40.0, source="to the camera"
    )
    gaze_pitch_deg: float = parameter(
        0.0, unit="degrees up", low=-25.0, high=25.0, source="straight ahead"
    )
    opening_width_mm: float = parameter(
        26.0, unit="mm", low=18.0, high=34.0, source="adults 28 to 30, on heads as small as these"
    )
    opening_height_mm: float = parameter(
        8.4, unit="mm", low=3.0, high=14.0, source="adults 9 to 11, relaxed less"
    )
    mrd1_mm: float = parameter(
        3.2,
        unit="mm, upper lid's edge above the pupil's middle",
        low=0.0,
        high=7.0,
        source="Putterman 2012: 4 to 4.5 in adults; relaxed, and on small heads, less",
    )
    lid_asymmetry_mm: float = parameter(
        0.3,
        unit="mm, the left upper lid higher than the right",
        low=-2.0,
        high=2.0,
        source="by eye; up to 1 is usual",
    )
    canthal_tilt_mm: float = parameter(
        0.6,
        unit="mm, the outer corner higher than the base mesh's",
        low=-4.0,
        high=4.0,
        source="by eye; adults' stands 1 to 2 above the inner",
    )
    almond: float = parameter(
        0.9, unit="share, over the base mesh's own shape", low=0.0, high=1.0, source="by eye"
    )
    lid_thickness: float = parameter(
        0.44, unit="of the base mesh's 3.3 mm", low=0.3, high=1.5, source="by eye; adults 2 mm"
    )
    forward_mm: float = parameter(
        1.2,
        unit="mm, ball and lids before the base mesh's",
        low=-4.0,
        high=5.0,
        source="by eye: deep-set eyes lie in the brow's shade",
    )
    crease_mm: float = parameter(
        2.8,
        unit="mm above the upper edge, as far as that shows",
        low=0.5,
        high=8.0,
        source="by eye; 3 to 4 of the lid's 8 to 10 show",
    )
    crease_depth_mm: float = parameter(0.45, unit="mm", low=0.0, high=2.0, source="by eye")
    fold_mm: float = parameter(
        2.0, unit="mm, fullness above the crease", low=-2.0, high=5.0, source="by eye"
    )
    lid_shade: float = parameter(
        0.62, unit="share of light at the upper lid's edge", low=0.0, high=1.0, source="by eye"
    )
    lid_shade_mm: float = parameter(
        2.4, unit="mm, over which it falls by e", low=0.2, high=10.0, source="by eye"
    )
    lid_shade_shares: tuple[float, float, float, float] = parameter(
        (0.5, 0.40, 0.55, 0.36),
        unit="of lid_shade: at the lower lid, the corners, where a lid touches, the ball's sides",
        low=0.0,
        high=1.0,
        source="by eye",
    )
    lash_veil: float = parameter(
        0.2,
        unit="share of light from everywhere that lashes keep off the ball",
        low=0.0,
        high=1.0,
        source="by eye; more where they are dense, or the skin about them sends less back",
    )
    meniscus_mm: float = parameter(
        0.35, unit="mm, height", low=0.0, high=1.5, source="Mainstone et al. 1996: 0.2 to 0.5 mm"
    )
    tears_rad: tuple[float, float] = parameter(
        (0.03, 0.09),
        unit="radians, over which a lamp's edge is blurred: on the cornea, on the white",
        low=0.002,
        high=0.5,
        source="by eye; a film of tears is uneven by some hundredths",
    )
    caruncle: float = parameter(
        1.0, unit="of 4 mm, 0: none", low=0.0, high=1.6, source="Duke-Elder 1961: 5 by 3 mm"
    )

    @property
    def direction(self) -> np.ndarray:
        """The given gaze, a unit vector (3,)."""
        yaw, pitch = np.radians(self.gaze_yaw_deg), np.radians(self.gaze_pitch_deg)
        return np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])


@dataclass(frozen=True)
class Lashes(Parameters):
    """Lashes of one eye, in tufts whose hairs share length, splay and curl; 0 hairs: none."""

    called: ClassVar[str] = "lashes"

    upper: int = parameter(130, unit="hairs", low=0, high=1000, source="Na et al. 2006: 90 to 160")
    lower: int = parameter(70, unit="hairs", low=0, high=1000, source="Na et al. 2006: 75 to 80")
    tufts: float = parameter(2.6, unit="hairs a tuft", low=1.0, high=10.0, source="by eye")
    upper_mm: float = parameter(7.2, unit="mm", low=0.5, high=16.0, source="adults 8 to 12")
    lower_mm: float = parameter(4.2, unit="mm", low=0.5, high=12.0, source="adults 6 to 8")
    width_mm: float = parameter(0.068, unit="mm, at the root", low=0.01, high=0.3, source="adults")
    curl: float = parameter(
        1.0, unit="of the upper lashes' curve", low=0.0, high=2.5, source="by eye"
    )
    colour: tuple[float, float, float] | None = parameter(
        (None, (0.02, 0.012, 0.008)),
        optional=True,
        source="0.6 of the hair's",
        unit="linear albedo",
        low=0.0,
        high=1.0,
    )


@dataclass(frozen=True)
class Hair(Parameters):
    """Hair of head, brows, lids, beard and face; 0 strands: none.

    colour: what two ways through a fibre leave of light, its melanin's absorption; the share `grey`
    of it is lost, in some strands all and in others little (`grey_mixed`); lightness: standard
    deviation of the logarithm of a strand's colour.
    style: a name of stimuli/hairstyles or a table (stimuli/heads/styles.py).
    """

    called: ClassVar[str] = "hair"

    colour: tuple[float, float, float] = parameter(
        (0.036, 0.020, 0.012), source="dark brown, by eye", **_COLOUR
    )
    grey: float = parameter(0.0, unit="share", low=0.0, high=1.0, source="by eye")
    grey_colour: tuple[float, float, float] = parameter(
        (0.46, 0.44, 0.40), source="by eye", **_COLOUR
    )
    grey_mixed: float = parameter(
        0.8,
        unit="towards 0 strands are full or bare, above 2 most lie between",
        low=0.01,
        high=50.0,
        source="by eye",
    )
    grey_lightness: float = parameter(
        0.45, unit="of lightness, in bare strands", low=0.0, high=2.0, source="by eye"
    )
    lightness: float = parameter(0.28, low=0.0, high=1.5, source="by eye")
    style: Style = nested(Style, default_factory=lambda: Style.read("side_part", "hair.style"))
    scalp: int = parameter(
        100000, unit="strands", low=0, high=250000, source="Robbins 2012, 100,000 on average"
    )
    width_mm: float = parameter(
        0.072, unit="mm", low=0.01, high=0.2, source="Robbins 2012: 0.05 to 0.09"
    )
    width_uneven: float = parameter(
        0.13, unit="standard deviation, of the width", low=0.0, high=0.5, source="by eye"
    )
    fly_width: float = parameter(
        0.65, unit="of the width, of strands that fly", low=0.1, high=1.5, source="by eye"
    )
    scalp_length: float = parameter(
        1.0, unit="of the style's lengths", low=0.05, high=4.0, source="by eye"
    )
    hairline_mm: float = parameter(
        0.0, unit="mm lower on the forehead", low=-40.0, high=30.0, source="by eye"
    )
    brows: int = parameter(
        540, unit="hairs a brow", low=0, high=5000, source="250 to 500 of adults, by eye"
    )
    sheen: float = parameter(
        0.5,
        unit="of what whole scales mirror",
        low=0.0,
        high=1.0,
        source="Robbins 2012, scales wear and lift; by eye, on black hair",
    )
    spread_deg: float = parameter(
        7.5,
        unit="degrees, standard deviation of the primary highlight",
        low=2.0,
        high=25.0,
        source="Marschner et al. 2003: 5 to 10; more where scales are worn",
    )
    brow_sheen: float = parameter(
        0.12,
        unit="of what whole scales mirror",
        low=0.0,
        high=1.0,
        source="of brows and beard, which lie in disorder; by eye",
    )
    brow_grey: float = parameter(
        0.6, unit="of the scalp's grey", low=0.0, high=1.0, source="brows grey later; by eye"
    )
    leaves_mm: tuple[float, float] = parameter(
        (40.0, 140.0),
        unit="mm from the root",
        low=1.0,
        high=700.0,
        source="begins to leave and has left what lights the root: a neck's to a head's width",
    )
    brow_fine: float = parameter(
        0.9, unit="fine hairs below each", low=0.0, high=5.0, source="by eye"
    )
    brow_width_mm: float = parameter(
        0.078, unit="mm, at the root", low=0.01, high=0.2, source="adults 0.05 to 0.1"
    )
    brow_uneven: float = parameter(
        1.0, unit="of 0.5 mm and a tenth of the arch", low=0.0, high=4.0, source="by eye"
    )
    brow_low_mm: float = parameter(
        11.0, unit="mm above the eye's centre", low=0.0, high=40.0, source="second trial"
    )
    brow_arch_mm: float = parameter(5.0, unit="mm", low=-5.0, high=20.0, source="second trial")
    brow_half_mm: float = parameter(4.4, unit="mm", low=0.5, high=12.0, source="second trial")
    brow_inner_mm: float = parameter(
        -18.0, unit="mm outwards of the eye's centre", low=-40.0, high=10.0, source="by eye"
    )
    brow_length_mm: float = parameter(43.0, unit="mm", low=10.0, high=80.0, source="by eye")
    brow_peak: float = parameter(
        0.64, unit="of its length", low=0.3, high=0.9, source="the lateral third, by eye"
    )
    brow_tail: float = parameter(
        0.25, unit="of the hairs of its body", low=0.0, high=1.0, source="by eye"
    )
    brow_hair_mm: float = parameter(8.0, unit="mm, longest", low=1.0, high=25.0, source="by eye")
    brow_light: float = parameter(0.35, unit="of the colour", low=0.1, high=6.0, source="by eye")
    stubble: int = parameter(30000, unit="hairs", low=0, high=100000, source="second trial")
    stubble_mm: tuple[float, float] = parameter(
        (0.15, 0.55), unit="mm, shortest and longest", low=0.05, high=40.0, source="a day's beard"
    )
    vellus: int = parameter(45000, unit="hairs", low=0, high=200000, source="second trial")
    vellus_mm: tuple[float, float] = parameter(
        (1.0, 3.0), unit="mm, shortest and longest", low=0.1, high=10.0, source="second trial"
    )
    vellus_width_mm: float = parameter(
        0.012, unit="mm", low=0.002, high=0.05, source="second trial"
    )
    vellus_colour: tuple[float, float, float] = parameter(
        (0.22, 0.15, 0.10), source="by eye", **_COLOUR
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("stubble_mm", "vellus_mm", "leaves_mm"):
            low, high = getattr(self, name)
            if low > high:
                raise InputError(f"{self.where(name)} is {(low, high)}; expected the shorter first")

    @classmethod
    def read(cls, table: Mapping[str, Any], where: str) -> Hair:
        if isinstance(table, Mapping) and "style" in table:
            table = {**table, "style": Style.read(table["style"], f"{where}.style")}
        return super().read(table, where)


@dataclass(frozen=True)
class Clothes(Parameters):
    """What a person wears where a scene shows them dressed.

    The neckline is half of a superellipse of `power` (2 round, 1.2 a V) that hangs from
    NECKLINE_TOP_MM (stimuli/heads/garment.py) below the eyes of the mesh without targets: half_mm
    to each side, front_mm and back_mm deep. ease_mm lies between skin and cloth at the neckline,
    loose_mm more far below it. hem_mm wide is its band, thicker by hem_thick_mm; folds_mm: how high
    the cloth's folds are; weave_mm: a stitch of its knit.
    """

    called: ClassVar[str] = "clothes"

    kind: str = parameter("shirt", choices=("none", "shirt"), source="by eye")
    colour: tuple[float, float, float] = parameter((0.018, 0.019, 0.022), source="dark", **_COLOUR)
    half_mm: float = parameter(72.0, unit="mm", low=50.0, high=130.0, source="by eye")
    front_mm: float = parameter(50.0, unit="mm", low=15.0, high=160.0, source="by eye")
    back_mm: float = parameter(14.0, unit="mm", low=5.0, high=120.0, source="by eye")
    power: float = parameter(2.2, low=1.0, high=6.0, source="by eye")
    ease_mm: float = parameter(1.3, unit="mm", low=0.8, high=20.0, source="by eye")
    loose_mm: float = parameter(8.0, unit="mm", low=0.0, high=40.0, source="by eye")
    hem_mm: float = parameter(16.0, unit="mm", low=3.0, high=40.0, source="a T-shirt's collar")
    hem_thick_mm: float = parameter(0.7, unit="mm", low=0.2, high=5.0, source="a T-shirt's collar")
    folds_mm: float = parameter(7.0, unit="mm", low=0.0, high=15.0, source="by eye")
    weave_mm: float = parameter(0.9, unit="mm", low=0.2, high=10.0, source="of a stitch, by eye")
    roughness: float = parameter(0.8, unit="Beckmann slope", low=0.05, high=1.0, source="by eye")
    specular: float = parameter(0.35, low=0.0, high=10.0, source="1 is a smooth face's; by eye")


@dataclass(frozen=True)
class Person(Parameters):
    """A person.

    about: who it is, in words; exposure: the factor of a picture's exposure when they are its
    subject; targets: weight of each of MakeHuman's morph targets, by its path below targets/;
    arm_drop_deg: how far the arms hang down; torso_yaw_deg, torso_roll_deg: how far the torso is
    turned below a head that looks along +z; clothes: worn where a scene shows them dressed; skin:
    what their skin says over renderer.scene.Skin's defaults, read with the scene's materials.
    """

    called: ClassVar[str] = "person"

    about: str = ""
    exposure: float = parameter(1.0, low=0.05, high=20.0, source="as for light skin")
    targets: dict[str, float] = field(default_factory=dict)
    form: Form = field(default_factory=Form)
    arm_drop_deg: float = parameter(32.0, unit="degrees", low=0.0, high=80.0, source="by eye")
    torso_yaw_deg: float = parameter(
        0.0,
        unit="degrees to the person's left, below the head",
        low=-60.0,
        high=60.0,
        source="pose",
    )
    torso_roll_deg: float = parameter(
        0.0, unit="degrees, right shoulder down", low=-20.0, high=20.0, source="pose"
    )
    expression: Expression = field(default_factory=Expression)
    clothes: Clothes = field(default_factory=Clothes)
    eyes: Eyes = field(default_factory=Eyes)
    hair: Hair = field(default_factory=Hair)
    lashes: Lashes = field(default_factory=Lashes)
    regions: Regions = field(default_factory=Regions)
    skin: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, table: Mapping[str, Any], where: str) -> Person:
        refuse_unknown(table, cls.names(), where)
        targets = weights(f"{where}.targets", table.get("targets", {}), "weights", -1, 1.5)
        own = ("about", "exposure", "arm_drop_deg", "torso_yaw_deg", "torso_roll_deg")
        said = super().read({k: v for k, v in table.items() if k in own}, where)
        parts = {
            name: kind.read(table.get(name, {}), f"{where}.{name}") for name, kind in _PARTS.items()
        }
        own_skin = dict(table.get("skin", {}))
        return replace(said, targets=targets, skin=own_skin, **parts)


#: The tables of a person's file.
_PARTS: dict[str, type[Parameters]] = {
    "form": Form,
    "expression": Expression,
    "clothes": Clothes,
    "eyes": Eyes,
    "hair": Hair,
    "lashes": Lashes,
    "regions": Regions,
}
