"""Materials: what light meets at a surface and below it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from renderer.errors import InputError
from renderer.optics import skin
from renderer.parameters import Parameters, parameter, weights
from renderer.scene.picture import LUMA

#: What a head's masks say, in the order of their columns: how much of each, in [0, 1].
MASKS = ("lips", "flush", "hair", "eyelid", "pores", "oil", "beard", "inside")
#: A material's maps, image files: albedo in sRGB, normals in tangent space, the others grey.
MAPS = ("albedo_map", "normal_map", "roughness_map", "height_map", "specular_map", "kernel_map")
#: What of procedural skin can lie over an albedo map.
LAYERS = ("relief", "freckles", "moles", "mottling", "hair", "oil")
_SHARE = {"low": 0.0, "high": 1.0}
# Means of the shader's noises, by integration: of a freckle's cell, of the positive part of four
# octaves, of the dots below the surface; of a brown and a red spot's cell over the cube of the sum
# of their least and largest size.
FRECKLE_MEAN, MOTTLING_MEAN, DOTS_MEAN = 0.0074, 0.27, 0.05
BROWN_MEAN, RED_MEAN = 6.0e-5, 6.9e-5
# What is left of the skin's colour under and between hair, and in the mouth and the nostrils.
SCALP, ROOTED, INSIDE = (0.22, 0.21, 0.21), (0.36, 0.32, 0.27), (0.50, 0.26, 0.24)
SHAVEN = (0.21, 0.15, 0.09)  # what roots below shaven skin take of its colour: red most
#: The medium of a skin that follows from its own pigments.
PERSON = "person"


@dataclass(frozen=True)
class Material(Parameters):
    """A surface of one colour, or with maps, over a medium that scatters or does not.

    medium: a preset's name or a table of coefficients (renderer.optics.media), "" for a surface
    that does not scatter. thickness: "solid", or that of a sheet of the medium in mm. coatings:
    layers above it, outermost first, each a table with `medium` and `thickness_mm`. albedo is
    linear, the share of diffuse light that comes back. Maps are image files over the surface's
    texture coordinates (a scan brings its own): MAPS says which. height_map: white stands height_mm
    above black; specular_map: of `specular`; kernel_map: how large an artist wants the filter of
    techniques that ask for it (gosselin).
    """

    kind: ClassVar[str] = "plain"
    called: ClassVar[str] = "material"

    medium: str | dict = "skin"
    thickness: str | float = "solid"
    coatings: tuple[dict, ...] = ()
    albedo: tuple[float, float, float] = parameter(
        (0.56, 0.38, 0.30), source="light skin, chosen by eye", **_SHARE
    )
    roughness: float = parameter(
        0.36, unit="Beckmann slope", low=0.02, high=1.0, source="chosen by eye"
    )
    f0: float = parameter(0.028, low=0.0, high=1.0, source="Fresnel at an index of 1.4")
    specular: float = parameter(1.0, low=0.0, high=10.0, source="1 is physical")
    lobe_roughness: tuple[float, float] = parameter(
        (0.85, 1.5), unit="of the roughness", low=0.1, high=3.0, source="chosen by eye"
    )
    lobe_share: float = parameter(0.25, source="of the second lobe, chosen by eye", **_SHARE)
    albedo_map: str = ""
    normal_map: str = ""
    roughness_map: str = ""
    height_map: str = ""
    specular_map: str = ""
    kernel_map: str = ""
    height_mm: float = parameter(
        1.0, unit="mm from black to white", low=-1000.0, high=1000.0, source="the map's own"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in MAPS:
            value = getattr(self, name)
            if not isinstance(value, str):
                raise InputError(f"{self.where(name)} is {value!r:.60}; expected a file")
        if not isinstance(self.medium, str | Mapping):
            raise InputError(
                f"{self.where('medium')} is {self.medium!r:.60}; "
                "expected a preset's name or a table of coefficients"
            )
        thickness = self.thickness
        number = isinstance(thickness, int | float) and not isinstance(thickness, bool)
        if thickness != "solid" and not (number and 0 < thickness < 1e5):
            raise InputError(
                f"{self.where('thickness')} is {thickness!r:.60}; expected 'solid', or millimetres "
                "above 0"
            )
        for k, layer in enumerate(self.coatings):
            if not isinstance(layer, Mapping) or set(layer) != {"medium", "thickness_mm"}:
                raise InputError(
                    f"{self.where('coatings')}[{k}] is {layer!r:.60}; expected a table with medium "
                    "and thickness_mm"
                )
        if (self.coatings or thickness != "solid") and not self.medium:
            raise InputError(
                f"{self.where('medium')} is empty; expected one for the sheet or the coatings"
            )

    def plain(self) -> dict[str, Any]:
        return {"kind": self.kind, **super().plain()}

    def layered(self) -> str | dict:
        """The medium with its thickness and its coatings, as renderer.optics.media reads it."""
        if self.thickness == "solid" and not self.coatings:
            return self.medium
        below = {"medium": self.medium} if isinstance(self.medium, str) else dict(self.medium)
        if self.thickness != "solid":
            below["thickness_mm"] = self.thickness
        return {"layers": [*(dict(layer) for layer in self.coatings), below]}

    @property
    def scatters(self) -> bool:
        """Whether there is a medium below the surface."""
        return bool(self.medium)


def _band(*default: float) -> Any:
    """Where something sets in, is whole, begins to end, has ended."""
    return parameter(default, unit="mm", low=-500.0, high=500.0, source="by eye")


def _layers(name: str) -> Any:
    """The parameter of the spectral model."""
    field = {f.name: f for f in fields(skin.Layers)}[name]
    return parameter(
        field.default, **{k: field.metadata[k] for k in ("unit", "source", "low", "high")}
    )


def _period(default: float) -> Any:
    return parameter(default, unit="mm", low=0.1, high=100.0, source="by eye")


_BANDS = (
    "forehead_lines_mm",
    "forehead_lines_half_mm",
    "crows_feet_mm",
    "crows_feet_rad",
    "lid_lines_mm",
    "lid_lines_half_mm",
)


@dataclass(frozen=True)
class Skin(Material):
    """Procedural skin: pigments, pores, furrows and hair below the surface over the solid noise.

    Colour follows from melanin, blood and the epidermis by renderer.optics.skin; with `medium =
    "person"` so does the medium below, from the mean over the face. Highlights are two lobes, whose
    roughness is that between the relief: what of the relief is too fine for a pixel is added to it.

    The masks of a head (lips, flush, beard, ...) say where; on a surface that brings none, `masks`
    says how much of each there is everywhere. map_layers: those of LAYERS that also lie over an
    albedo map, which stands for the pigments and the lips.

    Wrinkles lie between heights in mm, over which they set in and end: forehead_lines_mm above the
    eyes and forehead_lines_half_mm to the sides; crows_feet_mm from a place outwards of and above
    each eye, within crows_feet_rad of the horizontal; lid_lines_mm above and lid_lines_half_mm
    beside each eye. Those of the forehead and those of the eyes lie on what is not farther behind
    the eyes than wrinkles_behind_mm.
    """

    kind: ClassVar[str] = "skin"

    map_layers: tuple[str, ...] = LAYERS
    masks: dict[str, float] = field(default_factory=dict)

    melanin: float = parameter(
        0.024, unit="volume share of the epidermis", low=0.0, high=0.6, source="by eye"
    )
    blood: float = parameter(
        0.012, unit="volume share of the dermis", low=0.0, high=0.3, source="by eye"
    )
    eumelanin: float = _layers("eumelanin")
    oxygenation: float = _layers("oxygenation")
    epidermis_mm: float = _layers("epidermis_mm")
    turbidity: float = _layers("turbidity")
    flush: float = parameter(0.026, unit="share of blood more", low=0.0, high=0.3, source="by eye")
    mottling: float = parameter(0.65, low=0.0, high=5.0, source="of what was chosen by eye")
    uneven: tuple[float, float] = parameter(
        (0.20, 0.27), unit="of melanin, of blood", low=0.0, high=2.0, source="by eye"
    )
    eyelid_blood: float = parameter(
        0.006, unit="share of blood more", low=0.0, high=0.3, source="by eye"
    )
    eyelid_epidermis: float = parameter(0.55, source="of the epidermis, by eye", low=0.1, high=1.0)
    lid_margin: tuple[float, float, float] = parameter(
        (0.49, 0.27, 0.24), source="albedo of the wet rim of lids, by eye", **_SHARE
    )
    lid_margin_shares: tuple[float, float, float] = parameter(
        (0.22, 0.45, 0.45),
        unit="of lid_margin over the skin's own; of light lost at the ball, below the upper lid",
        source="by eye",
        **_SHARE,
    )
    tarsus: float = parameter(
        0.8, source="of what comes through a lid, that its plate stops, by eye", **_SHARE
    )
    lash_line: float = parameter(0.22, source="of light, along the lashes' roots, by eye", **_SHARE)
    lip_blood: tuple[float, float] = parameter(
        (0.034, 0.080), unit="share of blood: border, seam", low=0.0, high=0.3, source="by eye"
    )
    lip_melanin: float = parameter(0.45, source="of the skin's melanin, by eye", **_SHARE)
    lip_melanin_inner: float = parameter(
        1.0, source="of the lips' melanin that is left at the seam, by eye", **_SHARE
    )
    lip_epidermis: float = parameter(0.40, source="of the epidermis, by eye", low=0.1, high=1.0)
    lip_haze: float = parameter(
        0.22, source="of the vermilion that its dry surface and venous blood dull, by eye", **_SHARE
    )
    lip_haze_colour: tuple[float, float, float] = parameter(
        (1.16, 0.92, 1.0), unit="of its luminance", low=0.0, high=3.0, source="mauve, by eye"
    )
    lip_ragged: float = parameter(
        0.10, unit="of the mask", low=0.0, high=0.5, source="how uneven the border is, by eye"
    )
    lip_muscle: float = parameter(
        0.95, source="of what comes through a lip, that its muscle stops, by eye", **_SHARE
    )
    cartilage: float = parameter(
        0.5, source="of what comes through an ear, that its cartilage stops, by eye", **_SHARE
    )
    nose_wing: float = parameter(
        0.95,
        source="of what comes through a nostril's wing, that its fat and fibres stop, by eye",
        **_SHARE,
    )
    freckles: float = parameter(
        0.035, unit="share of melanin more", low=0.0, high=0.6, source="by eye"
    )
    freckle_share: float = parameter(0.45, source="of cells of 3.4 mm, by eye", **_SHARE)
    spots: float = parameter(
        0.05, unit="share of melanin more", low=0.0, high=0.6, source="larger ones, by eye"
    )
    spot_share: float = parameter(0.40, source="of cells of 9 mm, red ones too, by eye", **_SHARE)
    spots_mm: tuple[float, float] = parameter(
        (0.9, 3.2), unit="mm across: least, largest", low=0.1, high=5.0, source="by eye"
    )
    red_spots: float = parameter(
        0.045, unit="share of blood more", low=0.0, high=0.3, source="by eye"
    )
    red_share: float = parameter(0.45, source="of the spots, by eye", **_SHARE)
    moles: float = parameter(0.25, unit="share of melanin more", low=0.0, high=0.6, source="by eye")
    mole_share: float = parameter(0.20, source="of cells of 31 mm, by eye", **_SHARE)
    vessels: float = parameter(
        0.05, unit="share of blood more", low=0.0, high=0.3, source="fine ones, by eye"
    )
    veins: float = parameter(
        1.0,
        unit="of 13, 6, 2 % less light",
        low=0.0,
        high=5.0,
        source="by eye after Kienle et al. 1996, doi:10.1364/AO.35.001151",
    )
    beard: float = parameter(1.0, low=0.0, high=1.3, source="tint of shaven skin, by eye")
    scalp: float = parameter(0.9, source="darkening under hair, by eye", **_SHARE)
    scalp_from: float = parameter(
        0.45,
        unit="of the mask of hair, from which it tints skin",
        low=0.0,
        high=0.95,
        source="by eye",
    )
    pores: float = parameter(1.0, low=0.0, high=5.0, source="depth, of 0.080 and 0.040 mm")
    pore_shade: float = parameter(0.48, source="how much darker a deep pore is, by eye", **_SHARE)
    furrows: float = parameter(1.0, low=0.0, high=5.0, source="depth, of 0.030 mm")
    bumps: float = parameter(1.0, low=0.0, high=5.0, source="height, of `bumps_mm`")
    bumps_mm: tuple[float, float, float] = parameter(
        (0.045, 0.060, 0.11),
        unit="mm over 1.6, 4.1 and 11 mm",
        low=0.0,
        high=1.0,
        source="by eye: a mean roughness of 15 to 30 µm over the first two",
    )
    wrinkles: float = parameter(1.0, low=0.0, high=5.0, source="depth, of 0.020 to 0.060 mm")
    lip_folds: float = parameter(1.0, low=0.0, high=5.0, source="depth, of 0.090 and 0.035 mm")
    micro_mm: tuple[float, float] = parameter(
        (0.030, 0.018),
        unit="mm over 0.62 and 0.34 mm",
        low=0.0,
        high=0.2,
        source="relief that only the mirror sees, by eye",
    )
    f0_oily: float = parameter(
        0.035, low=0.0, high=1.0, source="Fresnel at an index of 1.46, of sebum"
    )
    roughness_dry: float = parameter(
        0.31, unit="Beckmann slope", low=0.02, high=1.0, source="between relief, by eye"
    )
    roughness_oily: float = parameter(
        0.15, unit="Beckmann slope", low=0.02, high=1.0, source="between relief, by eye"
    )
    roughness_lips: float = parameter(
        0.18, unit="Beckmann slope", low=0.02, high=1.0, source="moist, by eye"
    )
    lobe_roughness: tuple[float, float] = parameter(
        (0.55, 1.35), unit="of the roughness", low=0.1, high=3.0, source="by eye"
    )
    lobe_share: float = parameter(0.80, source="of the broad lobe on dry skin, by eye", **_SHARE)
    lobe_share_oily: float = parameter(0.32, source="of it on oily skin, by eye", **_SHARE)
    oil_patches: float = parameter(
        0.55, low=0.0, high=2.0, source="of the oil there is, over 21, 7 and 2 mm, by eye"
    )

    forehead_lines_mm: tuple[float, float, float, float] = _band(24.0, 32.0, 58.0, 66.0)
    forehead_lines_half_mm: tuple[float, float] = _band(32.0, 50.0)
    forehead_lines_period_mm: float = _period(10.5)
    forehead_lines_width_mm: float = parameter(
        1.6, unit="mm, half width", low=0.2, high=20.0, source="by eye"
    )
    crows_feet_place_mm: tuple[float, float] = parameter(
        (17.0, -1.0), unit="mm outwards and above", low=-50.0, high=50.0, source="by eye"
    )
    crows_feet_mm: tuple[float, float, float, float] = _band(2.0, 7.0, 12.0, 22.0)
    crows_feet_rad: tuple[float, float] = parameter(
        (0.6, 1.1), unit="radians", low=0.0, high=3.2, source="by eye"
    )
    lid_lines_mm: tuple[float, float, float, float] = _band(-20.0, -13.0, -9.5, -7.5)
    lid_lines_half_mm: tuple[float, float] = _band(12.0, 18.0)
    lid_lines_period_mm: float = _period(2.3)
    wrinkles_behind_mm: tuple[float, float] = parameter(
        (25.0, 67.5), unit="mm: forehead, eyes", low=0.0, high=500.0, source="by eye"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.medium == PERSON and (self.coatings or self.thickness != "solid"):
            raise InputError(
                f"{self.where('medium')} is {PERSON!r} with a thickness or coatings; expected "
                "neither, its layers are the skin's own"
            )
        for name in self.map_layers:
            if name not in LAYERS:
                known = ", ".join(LAYERS)
                raise InputError(
                    f"{self.where('map_layers')} has {name!r:.60}; expected of {known}"
                )
        shares = weights(self.where("masks"), self.masks, "masks", 0, 1, MASKS)
        object.__setattr__(self, "masks", shares)
        for name in _BANDS:
            band = getattr(self, name)
            if any(low >= high for low, high in pairwise(band)):
                raise InputError(f"{self.where(name)} is {band}; expected places that rise")

    @property
    def layers(self) -> skin.Layers:
        """What the spectral model takes as the same everywhere."""
        names = skin.Layers.names()
        return skin.Layers(**{name: getattr(self, name) for name in names})

    def pigments(self, masks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Melanin, blood and thickness of the epidermis (of its own) at masks (N, 8): (N,) each.

        Melanin lies at the epidermis's base, so that a thin one has as much of it.

        What `pigments` of passes/skin.frag averages to where its noises are zero on average.
        """
        column = {name: masks[:, k] for k, name in enumerate(MASKS)}
        lips, inner = lip_places(column["lips"])
        eyelid, flushed = column["eyelid"], column["flush"]
        freckles = self.freckles * self.freckle_share * (0.5 + 0.5 * flushed) * FRECKLE_MEAN
        spots = self.spot_share * sum(self.spots_mm) ** 3
        brown, red = (1 - self.red_share) * BROWN_MEAN, self.red_share * RED_MEAN
        freckles = (freckles + self.spots * brown * spots) * (1 - lips)
        of_lips = self.lip_melanin * (1 + (self.lip_melanin_inner - 1) * inner)
        melanin = self.melanin * (1 + (of_lips - 1) * lips) + freckles
        blood = self.blood + self.flush * flushed + self.eyelid_blood * eyelid
        blood = blood + self.mottling * (0.003 + 0.012 * flushed) * MOTTLING_MEAN
        blood = blood + self.red_spots * red * spots
        border, seam = self.lip_blood
        blood = blood + lips * (border + (seam - border) * inner - blood)
        thin = 1 + (self.eyelid_epidermis - 1) * np.maximum(eyelid, 0.7 * flushed)
        thin = thin + lips * (self.lip_epidermis - thin)
        return melanin / thin, blood, thin

    def mean_albedo(self, masks: np.ndarray) -> np.ndarray:
        """Linear albedo (N, 3) at the scale of bounced light, from masks (N, 8)."""
        column = {name: masks[:, k : k + 1] for k, name in enumerate(MASKS)}
        albedo = skin.shown(self.layers, *self.pigments(masks))
        lips, inner = lip_places(column["lips"])
        dull = albedo @ LUMA[:, None] * np.array(self.lip_haze_colour)
        albedo = albedo + self.lip_haze * lips * (1 - 0.5 * inner) * (dull - albedo)
        hair = _smoothstep(self.scalp_from, 1.0, column["hair"])
        rooted, shaven = 0.75 * hair, 0.75 * self.beard * column["beard"] * (1 - hair)
        albedo = albedo * (1 + self.scalp * hair * (np.array(SCALP) - 1))
        dots = 0.45 * DOTS_MEAN * np.maximum(rooted, 0.75 * shaven)
        albedo = albedo * (1 - rooted * np.array(ROOTED) - shaven * np.array(SHAVEN) - dots)
        return albedo * (1 + column["inside"] * (np.array(INSIDE) - 1))

    def own_medium(self, masks: np.ndarray, share: np.ndarray) -> dict:
        """The medium of `medium = "person"`: the layers whose albedo is the mean of what is shown.

        masks (N, 8); share (N,): the weight of each place, which is its area on a face.
        """
        share = share / share.sum()
        melanin, blood, _ = (share @ value for value in self.pigments(masks))
        return skin.medium(self.layers, share @ self.mean_albedo(masks), melanin, blood)


def lip_places(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From the mask of lips, which is 0.5 at their border and 1 at the seam: how much of lip there
    is, and how near the seam; in [0, 1].
    """
    return _smoothstep(0.0, 0.6, mask), np.clip(2 * mask - 1, 0, 1)


def _smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


#: Local illumination models, in the order of their numbers in passes/local.frag.
MODELS = ("lambert", "phong", "blinn_phong", "cook_torrance")


@dataclass(frozen=True)
class Shading(Material):
    """An opaque, glossy, mirroring or clear surface by a local illumination model.

    A lamp's irradiance E makes the radiance E / pi (k_d (n . l) + k_s lobe), where k_d is `albedo`
    and the lobe is (r . v)^exponent (Phong 1975), (n . h)^exponent (Blinn 1977) or none (Lambert);
    Cook and Torrance's is E k_s F G D / (4 (n . v)), of `roughness` and `f0`. To it come `emission`
    and, where nothing computes interreflection, k_a times the scene's mean environment radiance.
    k_r and k_t are the shares of the mirrored and of the refracted ray (Whitted 1980, whose single
    k_s is both k_s and k_r). Formulas: renderer/illumination/models.py.
    """

    kind: ClassVar[str] = "shading"

    medium: str | dict = ""
    albedo: tuple[float, float, float] = parameter((0.6, 0.6, 0.6), source="k_d", **_SHARE)
    model: str = parameter("blinn_phong", choices=MODELS, source="Blinn 1977 is the usual one")
    k_a: tuple[float, float, float] | None = parameter(
        (None, (0.5, 0.5, 0.5)), optional=True, source="the albedo, where it is not given", **_SHARE
    )
    k_s: tuple[float, float, float] = parameter(
        (0.3, 0.3, 0.3), low=0.0, high=10.0, source="usually the same in all channels"
    )
    exponent: float = parameter(
        30.0, unit="of the cosine", low=1.0, high=1e4, source="Phong 1975: 1 to 10 is dull"
    )
    emission: tuple[float, float, float] = parameter(
        (0.0, 0.0, 0.0), unit="radiance", low=0.0, high=1e6, source="the scene's"
    )
    k_r: tuple[float, float, float] = parameter((0.0, 0.0, 0.0), source="no mirror", **_SHARE)
    k_t: tuple[float, float, float] = parameter((0.0, 0.0, 0.0), source="not clear", **_SHARE)
    index: float = parameter(1.5, low=1.0, high=4.0, source="crown glass")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.medium:
            raise InputError(
                f"{self.where('medium')} is {self.medium!r:.60}; expected none: light does not "
                "scatter below an illumination model"
            )
        for name in MAPS[1:]:
            if getattr(self, name):
                raise InputError(
                    f"{self.where(name)} is not for kind 'shading'; expected albedo_map alone"
                )
        most = max(map(sum, zip(self.albedo, self.k_r, self.k_t, strict=True)))
        if most > 1 + 1e-9:
            raise InputError(
                f"{self.where('albedo')} + k_r + k_t is {most:g}; expected at most 1 a channel"
            )

    @property
    def ambient(self) -> tuple[float, float, float]:
        """k_a."""
        return self.albedo if self.k_a is None else self.k_a


#: Keys of materials of the first edition that are parameters of the techniques now.
MOVED = {"thickness_scale": "thickness_scale", "transmission_wrap": "translucency_wrap"}

MATERIALS: dict[str, type[Material]] = {kind.kind: kind for kind in (Material, Skin, Shading)}


def read_material(table: Mapping[str, Any], where: str) -> Material:
    """A material from a table, by its `kind`."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {table!r:.60}; expected a table")
    kind = table.get("kind", "plain")
    if kind not in MATERIALS:
        raise InputError(f"{where}.kind is {kind!r:.60}; expected one of {', '.join(MATERIALS)}")
    for key in MOVED.keys() & table.keys():
        raise InputError(
            f"{where}.{key} is unknown; expected the parameter {MOVED[key]} of a technique"
        )
    return MATERIALS[kind].read({k: v for k, v in table.items() if k != "kind"}, where)
