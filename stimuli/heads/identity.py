"""New people: a person's table drawn from a seed, within bounds.

Sex, age, ancestry and tone are drawn first, or given; all else follows from them and from chance.
What is drawn is a table like those of stimuli/people, to be kept in a file and changed by hand.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics import skin
from renderer.parameters import Parameters, parameter
from renderer.scene.picture import LUMA

ANCESTRIES = ("african", "asian", "caucasian")  # of MakeHuman's data
SEXES = ("female", "male")

#: Volume shares of melanin in the epidermis, from the lightest tone to the darkest: Jacques 1998
#: gives 1.3 to 6.3 % for light skin, 11 to 16 % for moderate, 18 to 43 % for dark.
MELANIN = (0.013, 0.43)

# Morph targets below targets/ that are drawn for everybody: (name when below zero, name when above,
# standard deviation, largest). Both sides of what there are two of get nearly the same.
# fmt: off
_TRAITS: tuple[tuple[str, str, float, float], ...] = (
    ("head/head-scale-horiz-decr", "head/head-scale-horiz-incr", 0.14, 0.30),
    ("head/head-scale-vert-decr", "head/head-scale-vert-incr", 0.10, 0.22),
    ("head/head-back-scale-depth-decr", "head/head-back-scale-depth-incr", 0.12, 0.25),
    ("head/head-fat-decr", "head/head-fat-incr", 0.15, 0.35),
    ("forehead/forehead-scale-vert-decr", "forehead/forehead-scale-vert-incr", 0.15, 0.35),
    ("forehead/forehead-temple-decr", "forehead/forehead-temple-incr", 0.20, 0.45),
    ("eyebrows/eyebrows-trans-down", "eyebrows/eyebrows-trans-up", 0.18, 0.40),
    ("eyebrows/eyebrows-angle-down", "eyebrows/eyebrows-angle-up", 0.18, 0.40),
    ("nose/nose-hump-decr", "nose/nose-hump-incr", 0.28, 0.65),
    ("nose/nose-point-down", "nose/nose-point-up", 0.18, 0.40),
    ("nose/nose-point-width-decr", "nose/nose-point-width-incr", 0.20, 0.45),
    ("nose/nose-width1-decr", "nose/nose-width1-incr", 0.18, 0.40),
    ("nose/nose-width2-decr", "nose/nose-width2-incr", 0.22, 0.50),
    ("nose/nose-width3-decr", "nose/nose-width3-incr", 0.20, 0.45),
    ("nose/nose-scale-vert-decr", "nose/nose-scale-vert-incr", 0.16, 0.35),
    ("nose/nose-scale-depth-decr", "nose/nose-scale-depth-incr", 0.16, 0.35),
    ("nose/nose-nostrils-width-decr", "nose/nose-nostrils-width-incr", 0.18, 0.40),
    ("mouth/mouth-scale-horiz-decr", "mouth/mouth-scale-horiz-incr", 0.16, 0.35),
    ("mouth/mouth-cupidsbow-decr", "mouth/mouth-cupidsbow-incr", 0.25, 0.55),
    ("mouth/mouth-upperlip-volume-decr", "mouth/mouth-upperlip-volume-incr", 0.20, 0.45),
    ("mouth/mouth-lowerlip-volume-decr", "mouth/mouth-lowerlip-volume-incr", 0.20, 0.45),
    ("mouth/mouth-trans-down", "mouth/mouth-trans-up", 0.10, 0.22),
    ("chin/chin-height-decr", "chin/chin-height-incr", 0.16, 0.35),
    ("chin/chin-width-decr", "chin/chin-width-incr", 0.20, 0.45),
    ("chin/chin-prominent-decr", "chin/chin-prominent-incr", 0.20, 0.45),
    ("chin/chin-bones-decr", "chin/chin-bones-incr", 0.20, 0.45),
    ("neck/neck-scale-horiz-decr", "neck/neck-scale-horiz-incr", 0.15, 0.35),
)
_PAIRED: tuple[tuple[str, str, float, float], ...] = (
    ("eyes/{}-eye-corner1-down", "eyes/{}-eye-corner1-up", 0.16, 0.35),
    ("eyes/{}-eye-trans-in", "eyes/{}-eye-trans-out", 0.12, 0.28),
    ("eyes/{}-eye-eyefold-down", "eyes/{}-eye-eyefold-up", 0.14, 0.30),
    ("eyes/{}-eye-height2-decr", "eyes/{}-eye-height2-incr", 0.12, 0.28),
    ("cheek/{}-cheek-bones-decr", "cheek/{}-cheek-bones-incr", 0.22, 0.50),
    ("cheek/{}-cheek-volume-decr", "cheek/{}-cheek-volume-incr", 0.18, 0.40),
    ("ears/{}-ear-scale-decr", "ears/{}-ear-scale-incr", 0.15, 0.35),
    ("ears/{}-ear-wing-decr", "ears/{}-ear-wing-incr", 0.18, 0.40),
    ("ears/{}-ear-lobe-decr", "ears/{}-ear-lobe-incr", 0.25, 0.60),
)
_UNEVEN = ("brown-1", "cheek-1", "ear-1", "eye-4", "jaw-1", "mouth-1", "nose-1", "temple-1")
_SHAPES = ("oval", "round", "rectangular", "square", "triangular", "invertedtriangular", "diamond")

# Iris between the fibres, fibres, collarette: linear albedo; and how often each is met without and
# with ancestry of the kind that has light eyes.
_IRISES = {
    "dark brown": ([0.016, 0.009, 0.005], [0.030, 0.016, 0.009], [0.034, 0.018, 0.009], 0.75, 0.12),
    "brown": ([0.034, 0.019, 0.010], [0.060, 0.034, 0.017], [0.075, 0.040, 0.018], 0.24, 0.28),
    "hazel": ([0.055, 0.045, 0.024], [0.088, 0.070, 0.038], [0.115, 0.064, 0.027], 0.01, 0.18),
    "green": ([0.110, 0.130, 0.100], [0.190, 0.200, 0.150], [0.240, 0.150, 0.065], 0.0, 0.14),
    "grey": ([0.130, 0.155, 0.165], [0.220, 0.240, 0.245], [0.220, 0.190, 0.130], 0.0, 0.10),
    "blue": ([0.095, 0.145, 0.190], [0.190, 0.240, 0.280], [0.210, 0.190, 0.140], 0.0, 0.18),
}
# What is left of light after two ways through a fibre; how often, as above.
_HAIRS = {
    "black": ([0.012, 0.009, 0.008], 0.80, 0.10),
    "dark brown": ([0.040, 0.024, 0.015], 0.19, 0.34),
    "brown": ([0.075, 0.044, 0.025], 0.01, 0.28),
    "blond": ([0.260, 0.180, 0.095], 0.0, 0.22),
    "red": ([0.170, 0.060, 0.022], 0.0, 0.06),
}
# fmt: on


@dataclass(frozen=True)
class Bounds(Parameters):
    """Whom to draw; by default anybody between 20 and 75.

    sex: "female", "male" or "" for either; age_years, tone: bounds, equal to fix a value; tone 0 is
    the lightest skin, 1 the darkest, even in the logarithm of melanin (MELANIN); ancestry: weights
    of ANCESTRIES, all 0 to draw them by tone; apart: how far faces go from the average, 1 as the
    standard deviations say.
    """

    called: ClassVar[str] = "bounds"

    sex: str = parameter("", choices=("", *SEXES), source="either")
    age_years: tuple[float, float] = parameter(
        (20.0, 75.0), unit="years", low=16.0, high=90.0, source="adults"
    )
    tone: tuple[float, float] = parameter((0.0, 1.0), low=0.0, high=1.0, source="every tone")
    ancestry: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="weights", low=0.0, high=1.0, source="drawn by tone"
    )
    apart: float = parameter(1.0, low=0.0, high=2.0, source="as drawn for the people that ship")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("age_years", "tone"):
            low, high = getattr(self, name)
            if low > high:
                raise InputError(f"{self.where(name)} is {(low, high)}; expected the lower first")


def draw(seed: int, bounds: Bounds | None = None) -> dict[str, Any]:
    """A person's table, the same for the same seed and bounds.

    seed: 0 or above. Values are those that stimuli.heads.person.Person reads.
    """
    bounds = bounds or Bounds()
    rng = np.random.default_rng([int(seed), 20261126])
    sex = bounds.sex or SEXES[rng.integers(2)]
    age = round(float(rng.uniform(*bounds.age_years)), 1)
    tone = float(rng.uniform(*bounds.tone))
    ancestry = _ancestry(rng, tone)
    if any(bounds.ancestry):
        ancestry = np.array(bounds.ancestry) / sum(bounds.ancestry)
    light = ancestry[2] * (1 - tone)  # the share that has light eyes and hair
    about = {"seed": int(seed), "sex": sex, "age": age, "tone": round(tone, 2)}
    targets = _macro(sex, age, ancestry) | _face(rng, sex, age, bounds.apart)
    eyes = _eyes(rng, light, tone, age)
    hair = _hair(int(seed), rng, sex, age, light, tone, ancestry)
    skin_table = _skin(rng, sex, age, tone, light, hair["colour"])
    if hair["grey"] > 0:  # the scalp is dark of roots
        skin_table["scalp"] = _rounded(0.9 - 0.45 * hair["grey"], 2)
    return {
        "about": ", ".join(f"{name} {value}" for name, value in about.items()),
        "exposure": exposure(skin_table),
        "targets": targets,
        "form": {
            "age_years": age,
            "bones": _rounded(rng.uniform(0.7, 1.0) if sex == "male" else rng.uniform(0.4, 0.7)),
            "asymmetry": _rounded(rng.uniform(0.06, 0.25)),
            "weaker": ("left", "right")[rng.integers(2)],
            "seed": int(rng.integers(2**31)),
            "vermilion_mm": _lips(int(seed), sex, age, ancestry[0]),
        },
        "torso_yaw_deg": _rounded(rng.uniform(-14, 14), 1),
        "clothes": {"colour": _cloth(rng), "power": _rounded(rng.uniform(1.4, 2.4), 2)},
        "eyes": eyes,
        "hair": hair,
        "lashes": _lashes(rng, sex),
        "skin": skin_table,
    }


def exposure(table: dict[str, Any], share: float = 0.25) -> float:
    """The factor of exposure that a photographer gives a face of this skin.

    The albedo's luminance over that of light skin (.30), to the power -share: 1 would make all
    faces equally bright, 0 leaves dark skin with half of the stimulus.
    """
    layers = skin.Layers.read({k: v for k, v in table.items() if k in skin.Layers.names()}, "skin")
    albedo = skin.colour(layers, table["melanin"], table["blood"])
    luminance = float(np.asarray(albedo).ravel()[:3] @ LUMA)
    return _rounded((0.30 / luminance) ** share)


def _rounded(value: float, digits: int = 3) -> float:
    return round(float(value), digits)


def _choice(rng: np.random.Generator, names: list[str], odds: list[float]) -> str:
    total = np.cumsum(odds)
    return names[int(np.searchsorted(total, rng.random() * total[-1], side="right"))]


def _ancestry(rng: np.random.Generator, tone: float) -> np.ndarray:
    """Shares (3,) of ANCESTRIES: mostly one, which one by tone, mixed by a Dirichlet draw."""
    odds = np.array([tone**2, 0.35 * max(1 - abs(2 * tone - 0.7), 0), (1 - tone) ** 1.5]) + 0.01
    main = np.eye(3)[rng.choice(3, p=odds / odds.sum())]
    mixed = rng.dirichlet([0.5, 0.5, 0.5])
    return 0.75 * main + 0.25 * mixed


def _macro(sex: str, age: float, ancestry: np.ndarray) -> dict[str, float]:
    """MakeHuman's shape of body and face; its 'old' is about ninety, and is taken at two thirds,
    since folds are the form's.
    """
    old = 0.66 * float(np.clip((age - 25) / 65, 0, 1))
    ages = {"young": 1 - old, "old": old}
    table = {
        f"macrodetails/{name}-{sex}-{when}": _rounded(share * weight)
        for name, share in zip(ANCESTRIES, ancestry, strict=True)
        for when, weight in ages.items()
    }
    for when, weight in ages.items():
        table[f"macrodetails/universal-{sex}-{when}-averagemuscle-averageweight"] = _rounded(weight)
    return {name: weight for name, weight in table.items() if weight >= 0.005}


def _face(rng: np.random.Generator, sex: str, age: float, apart: float) -> dict[str, float]:
    table: dict[str, float] = {}

    def add(below: str, above: str, value: float) -> None:
        if abs(value) >= 0.005:
            table[above if value > 0 else below] = _rounded(abs(value))

    for below, above, deviation, most in _TRAITS:
        value = apart * rng.normal(0, deviation)
        add(below, above, float(np.clip(value, -most, most)))
    for below, above, deviation, most in _PAIRED:
        value = float(np.clip(apart * rng.normal(0, deviation), -most, most))
        for side in ("l", "r"):
            uneven = value + apart * rng.normal(0, 0.03)
            add(below.format(side), above.format(side), float(np.clip(uneven, -most, most)))
    first, second = rng.permutation(len(_SHAPES))[:2]
    table[f"head/head-{_SHAPES[first]}"] = _rounded(apart * rng.uniform(0.1, 0.4))
    table[f"head/head-{_SHAPES[second]}"] = _rounded(apart * rng.uniform(0.0, 0.2))
    for name in _UNEVEN:
        side = ("l", "r")[rng.integers(2)]
        table[f"asym/asym-{name}-{side}"] = _rounded(rng.uniform(0.0, 0.25))
    for side in ("l", "r"):  # the data's eyes are large; adults' lids stand lower with age
        table[f"eyes/{side}-eye-scale-decr"] = _rounded(rng.uniform(0.30, 0.42))
        if age > 35:
            table[f"eyes/{side}-eye-bag-incr"] = _rounded((age - 35) / 40 * rng.uniform(0.1, 0.5))
    opened = rng.uniform(0.25, 0.45) * (1 - 0.4 * np.clip((age - 50) / 40, 0, 1))
    for side in ("left", "right"):
        table[f"expression/units/caucasian/eye-{side}-opened-up"] = _rounded(
            opened + rng.normal(0, 0.015)
        )
    return {name: weight for name, weight in table.items() if weight >= 0.005}


def _lips(seed: int, sex: str, age: float, african: float) -> list[float]:
    """Heights of the upper and the lower lip's red in mm: more of it with African ancestry, less
    with age.
    """
    rng = np.random.default_rng([seed, 20261126, 1])
    upper = (5.9 if sex == "female" else 5.2) + 1.7 * african - 0.03 * max(age - 30, 0)
    upper += float(np.clip(rng.normal(0, 0.5), -1.0, 1.0))
    return [_rounded(upper, 2), _rounded(upper * np.clip(rng.normal(1.55, 0.08), 1.35, 1.75), 2)]


def _eyes(rng: np.random.Generator, light: float, tone: float, age: float) -> dict[str, Any]:
    names = list(_IRISES)
    odds = [(1 - light) * _IRISES[n][3] + light * _IRISES[n][4] for n in names]
    iris, fibres, collarette, *_ = _IRISES[_choice(rng, names, odds)]
    scale = rng.uniform(0.85, 1.15)
    yellow = 0.35 * tone + 0.25 * np.clip((age - 40) / 40, 0, 1)
    sclera = np.array([0.54, 0.466, 0.443]) * (1 - yellow * np.array([0.38, 0.46, 0.55]))
    colours = {"iris": iris, "fibres": fibres, "collarette": collarette}
    table: dict[str, Any] = {
        name: [_rounded(scale * v, 4) for v in value] for name, value in colours.items()
    }
    return table | {
        "iris_mm": _rounded(rng.normal(5.9, 0.12), 2),
        "sclera": [_rounded(v) for v in sclera],
    }


def _lashes(rng: np.random.Generator, sex: str) -> dict[str, Any]:
    longer = 1.12 if sex == "female" else 1.0
    return {
        "upper": int(rng.uniform(120, 175)),
        "upper_mm": _rounded(longer * rng.uniform(6.2, 7.8), 2),
        "lower_mm": _rounded(longer * rng.uniform(3.6, 4.6), 2),
    }


def _cloth(rng: np.random.Generator) -> list[float]:
    """Linear albedo of dark cloth, a little blue, green or red."""
    dark = rng.uniform(0.012, 0.06)
    return [_rounded(dark * rng.uniform(0.8, 1.25), 4) for _ in range(3)]


def _hair(
    seed: int, rng, sex: str, age: float, light: float, tone: float, ancestry
) -> dict[str, Any]:
    names = list(_HAIRS)
    odds = [(1 - light) * _HAIRS[n][1] + light * _HAIRS[n][2] for n in names]
    colour = np.array(_HAIRS[_choice(rng, names, odds)][0]) * rng.uniform(0.8, 1.25)
    grey = float(np.clip((age - rng.normal(45, 7)) / 30, 0, 0.85))
    table: dict[str, Any] = {
        "colour": [_rounded(v, 4) for v in colour],
        "grey": _rounded(grey, 2),
        "style": _style(rng, sex, age, ancestry[0]),
        "brows": int(rng.uniform(420, 660) * (1.0 if sex == "male" else 0.8)),
        "brow_half_mm": _rounded(rng.normal(4.3 if sex == "male" else 3.2, 0.4), 2),
        **_brows(seed, sex, age),
        "stubble": int(rng.uniform(8000, 40000)) if sex == "male" else 0,
    }
    if table["style"] == "coiled":  # coils mirror in every direction, none of them whole
        table["sheen"] = 0.26
    pale = (1 - tone) ** 2
    table["vellus_colour"] = [
        _rounded(v, 4) for v in (0.02 + 0.20 * pale, 0.014 + 0.136 * pale, 0.010 + 0.09 * pale)
    ]
    return table


def _brows(seed: int, sex: str, age: float) -> dict[str, float]:
    """Where brows begin, how they rise and how they end: a man's lie lower and flatter and are
    fuller at the tail, which thins with age.
    """
    rng, male = np.random.default_rng([seed, 20261126, 2]), sex == "male"
    aged = float(np.clip((age - 45) / 30, 0, 1))

    def about(mean: float, deviation: float, digits: int = 1) -> float:
        return _rounded(mean + deviation * float(np.clip(rng.normal(), -2, 2)), digits)

    return {
        "brow_low_mm": about(10.6 if male else 11.6, 0.6),
        "brow_arch_mm": about(4.0 if male else 5.4, 1.1),
        "brow_inner_mm": about(-18.8 if male else -17.4, 1.3),
        "brow_length_mm": about(43.5 if male else 42.0, 2.0),
        "brow_peak": about(0.65, 0.04, 2),
        "brow_tail": about((0.34 if male else 0.22) * (1 - 0.5 * aged), 0.06, 2),
        "brow_hair_mm": about((8.2 if male else 6.8) + 1.5 * male * aged, 0.5),
    }


def _style(rng, sex: str, age: float, curly: float) -> str:
    if sex == "male":
        if age > 50 and rng.random() < 0.35:
            return "thinning"
        names = ("coiled", "cropped") if curly > 0.5 else ("side_part", "cropped", "swept")
    else:
        names = ("coiled", "tied") if curly > 0.5 else ("long", "tied", "curly", "swept")
    return names[rng.integers(len(names))]


def _skin(rng, sex: str, age: float, tone: float, light: float, hair) -> dict[str, Any]:
    low, high = np.log(MELANIN)
    melanin = float(np.exp(low + tone * (high - low)))
    red = hair[0] > 2.2 * hair[1] and hair[0] > 0.1
    oily = rng.uniform(0, 1)
    aged = float(np.clip((age - 30) / 45, 0, 1))
    table: dict[str, Any] = {
        "melanin": _rounded(melanin, 4),
        "blood": _rounded(rng.uniform(0.009, 0.015) + 0.004 * tone, 4),
        "eumelanin": _rounded(np.clip(0.35 + 0.45 * tone - (0.2 if red else 0), 0, 1), 2),
        "epidermis_mm": _rounded(rng.uniform(0.07, 0.10), 3),
        "flush": _rounded(rng.uniform(0.016, 0.032) * (1 + 0.3 * light), 4),
        "uneven": [
            _rounded((0.24 - 0.14 * tone) * rng.uniform(0.75, 1.1) + 0.04 * aged),
            _rounded(rng.uniform(0.19, 0.29) + 0.05 * aged),
        ],
        "freckles": _rounded(rng.uniform(0.03, 0.05) if red else rng.uniform(0.0, 0.03)),
        "freckle_share": _rounded(rng.uniform(0.6, 1.0) if red else rng.uniform(0.1, 0.4), 2),
        "spots": _rounded(rng.uniform(0.03, 0.05) + 0.07 * tone),
        "spot_share": _rounded(rng.uniform(0.1, 0.4) + 0.5 * aged, 2),
        "spots_mm": [0.9, _rounded(rng.uniform(1.8, 2.6) + 2.2 * aged, 2)],
        "red_share": _rounded(rng.uniform(0.25, 0.5) * (1 - tone), 2),
        "lip_melanin": _rounded(0.45 + 0.3 * tone, 2),
        "lip_haze": _rounded(0.20 + 0.32 * tone**2, 2),
        "moles": _rounded(rng.uniform(0.15, 0.35), 2),
        "mole_share": _rounded(rng.uniform(0.08, 0.28), 2),
        "mottling": _rounded(rng.uniform(0.45, 0.78) + 0.26 * np.clip((age - 45) / 30, 0, 1), 2),
        "bumps": _rounded(rng.uniform(0.7, 1.0) + 0.3 * aged, 2),
        "wrinkles": _rounded(np.clip((age - 18) / 40, 0.15, 1.6), 2),
        "pores": _rounded(rng.uniform(0.65, 0.95) + 0.25 * (sex == "male"), 2),
        "roughness_dry": _rounded(0.35 - 0.06 * oily, 3),
        "roughness_oily": _rounded(0.19 - 0.07 * oily, 3),
    }
    if sex == "female":
        table["beard"] = 0.0
    return table


def written(seed: int, bounds: Bounds | None = None) -> str:
    """The text of a drawn person's file."""
    table = draw(seed, bounds)
    lines = [f"# Drawn by `subdermal person draw {seed}`: {table['about']}.", ""]
    lines += [f"{key} = {_value(table[key])}" for key in table if not isinstance(table[key], dict)]
    for name, entries in table.items():
        if isinstance(entries, dict):
            lines += ["", f"[{name}]"]
            lines += [f"{_key(key)} = {_value(value)}" for key, value in entries.items()]
    return "\n".join(lines) + "\n"


def _key(name: str) -> str:
    return name if name.replace("_", "").isalnum() else json.dumps(name)


def _value(value: Any) -> str:
    return json.dumps(value)  # strings, numbers and lists of numbers are the same in TOML
