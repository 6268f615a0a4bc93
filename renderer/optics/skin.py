"""Skin as one spectral model: how much melanin and blood there is says both what colour it shows
and in what medium light scatters below.

Donner and Jensen 2006, "A spectral BSSRDF for shading human skin", doi:10.2312/EGWR/EGSR06/409-417:
an epidermis with melanin over a deep dermis with blood, both of index 1.4. Light that comes back is
found by adding layers (renderer.optics.adding), weighted with the observer and daylight D65, and
said in linear sRGB.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

import numpy as np

from renderer import caches
from renderer.optics import adding
from renderer.parameters import Parameters, parameter

ETA = 1.4
WAVELENGTH_NM = np.arange(400.0, 701.0, 10.0)  # (W,)

# Molar extinction of haemoglobin with and without oxygen, 1/cm per mol/l, 400 to 700 nm in steps of
# 10: Prahl's compilation of Gratzer's and Kollias's measurements, omlc.org/spectra/hemoglobin.
# fmt: off
_OXYGENATED = np.array([
    266232, 466840, 480360, 246072, 102580, 62816, 44480, 33209.2, 26629.2, 23684.4, 20932.8,
    20035.2, 24202.4, 39956.8, 53236, 43016, 32613.2, 44496, 50104, 14400.8, 3200, 1506, 942, 610,
    442, 368, 319.6, 294, 277.6, 276, 290,
])
_DEOXYGENATED = np.array([
    223296, 303956, 407560, 528600, 413280, 103292, 23388.8, 16156.4, 14550, 16684, 20862, 25773.6,
    31589.6, 39036.4, 46592, 53412, 53788, 45072, 37020, 28324.4, 14677.2, 9443.6, 6509.6, 5148.8,
    4345.2, 3750.12, 3226.56, 2795.12, 2407.92, 2051.96, 1794.28,
])
_D65 = np.array([  # CIE 15, relative
    82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80,
    104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29, 83.70,
    80.03, 80.21, 82.28, 78.28, 69.72, 71.61,
])
# fmt: on
GRAM_PER_LITRE, GRAM_PER_MOL = 150.0, 64500.0  # of haemoglobin in blood, and its weight
_SRGB = np.array(  # IEC 61966-2-1: XYZ to linear sRGB
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)

# Of the table: melanin and blood from 0 to the most, in steps of the square root, since bright skin
# needs finer ones; the epidermis from the thinnest to the person's own in even steps.
MOST_MELANIN, MOST_BLOOD, THINNEST = 0.6, 0.3, 0.1
SIZE = (5, 32, 32)  # epidermis, melanin, blood
DARKEST = 1e-3  # albedo


def _observer() -> np.ndarray:
    """The CIE 1931 observer (W, 3) by Wyman, Sloan and Shirley 2013, JCGT 2(2), multi-lobe."""

    def lobe(peak, below, above):
        t = (WAVELENGTH_NM - peak) * np.where(peak > WAVELENGTH_NM, below, above)
        return np.exp(-0.5 * t * t)

    x = 0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323)
    x = x - 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    return np.column_stack([x, y, z])


@lru_cache(maxsize=1)
def weights() -> np.ndarray:
    """(W, 3): reflectance (W,) to linear sRGB under D65; a perfect white is (1, 1, 1)."""
    rgb = (_D65[:, None] * _observer()) @ _SRGB.T
    return rgb / rgb.sum(axis=0)


def blood_absorption(oxygenation: float | np.ndarray) -> np.ndarray:
    """Of whole blood, 1/mm: (..., W)."""
    share = np.asarray(oxygenation, float)[..., None]
    molar = share * _OXYGENATED + (1 - share) * _DEOXYGENATED
    return np.log(10) * molar * GRAM_PER_LITRE / GRAM_PER_MOL / 10


def baseline_absorption() -> np.ndarray:
    """Of tissue without pigment, 1/mm (W,): Donner and Jensen 2006, after Jacques."""
    return 0.0244 + 8.53 * np.exp(-(WAVELENGTH_NM - 154) / 66.2)


def melanin_absorption(eumelanin: float) -> np.ndarray:
    """Of melanosomes, 1/mm (W,): 6.6e10 l^-3.33 of eumelanin, 2.9e14 l^-4.75 of pheomelanin."""
    brown = 6.6e10 * WAVELENGTH_NM**-3.33
    return eumelanin * brown + (1 - eumelanin) * 2.9e14 * WAVELENGTH_NM**-4.75


def scattering() -> np.ndarray:
    """sigma_s' of the epidermis, 1/mm (W,); the dermis has half of it (Donner and Jensen 2006)."""
    return 14.74 * WAVELENGTH_NM**-0.22 + 2.2e11 * WAVELENGTH_NM**-4.0


@dataclass(frozen=True)
class Layers(Parameters):
    """What all of a person's skin shares.

    eumelanin: the share of it in melanin, the rest is the redder pheomelanin; oxygenation: the
    share of haemoglobin that carries oxygen; epidermis_mm: the layer that holds melanin; turbidity:
    scattering over that of the paper.
    """

    called: ClassVar[str] = "layers"

    eumelanin: float = parameter(
        0.3, unit="of melanin", low=0.0, high=1.0, source="by eye; Donner and Jensen 2006: 0 to 1"
    )
    oxygenation: float = parameter(
        0.75, unit="of haemoglobin", low=0.0, high=1.0, source="Donner and Jensen 2006"
    )
    epidermis_mm: float = parameter(
        0.06,
        unit="mm",
        low=0.02,
        high=1.0,
        source="of a face, by eye; Donner and Jensen 2006: 0.25",
    )
    turbidity: float = parameter(
        1.0, unit="of sigma_s'", low=0.2, high=3.0, source="1: Donner and Jensen 2006"
    )


def coefficients(
    layers: Layers, melanin, blood
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """sigma_a and sigma_s' of the epidermis, then those of the dermis, 1/mm: (..., W) each.

    melanin: volume share in the epidermis; blood: in the dermis.
    """
    melanin, blood = (np.asarray(x, float)[..., None] for x in (melanin, blood))
    base, s = baseline_absorption(), layers.turbidity * scattering()
    above = melanin * melanin_absorption(layers.eumelanin) + (1 - melanin) * base
    below = blood * blood_absorption(layers.oxygenation) + (1 - blood) * base
    return above, np.broadcast_to(s, above.shape), below, np.broadcast_to(s / 2, below.shape)


def _albedo(directions, above, above_s, below, below_s, thickness_mm) -> np.ndarray:
    """The albedo of an epidermis over a dermis, of coefficients that broadcast: (...)."""
    total, deep = above + above_s, below + below_s
    r, t = adding.slab(directions, total * thickness_mm, above_s / total)
    dermis = adding.half_space(directions, below_s / deep)
    return adding.lit(directions, adding.over(r, t, dermis), ETA)


def spectrum(layers: Layers, melanin, blood, share=1.0) -> np.ndarray:
    """The albedo over WAVELENGTH_NM, of light that entered: (..., W).

    share: how thick the epidermis is here, of the person's own.
    """
    thickness = layers.epidermis_mm * np.asarray(share, float)[..., None]
    parts = coefficients(layers, melanin, blood)
    return _albedo(adding.Directions.of(ETA), *parts, thickness)


def colour(layers: Layers, melanin, blood, share=1.0) -> np.ndarray:
    """The albedo in linear sRGB under D65: (..., 3)."""
    return np.maximum(spectrum(layers, melanin, blood, share) @ weights(), 0)


def axes() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Thickness of the epidermis (of its own), melanin and blood at the table's nodes."""
    thickness, melanin, blood = (np.linspace(0, 1, n) for n in SIZE)
    return THINNEST + (1 - THINNEST) * thickness, MOST_MELANIN * melanin**2, MOST_BLOOD * blood**2


@lru_cache(maxsize=16)
def table(layers: Layers) -> np.ndarray:
    """Logarithm of the albedo in linear sRGB at the nodes of `axes`: (*SIZE, 3).

    Logarithms, since light that passes a pigment fades like that. Kept in the cache `skin`.
    """
    files = [Path(__file__), Path(adding.__file__)]
    arrays = caches.kept("skin", caches.key((layers,), files, ("numpy",)), lambda: _table(layers))
    return arrays["log_albedo"]


def _table(layers: Layers) -> caches.Arrays:
    thickness, melanin, blood = axes()
    directions = adding.Directions.of(ETA)
    above, above_s, *_ = coefficients(layers, melanin, 0.0)
    *_, below, below_s = coefficients(layers, 0.0, blood)
    total = above + above_s
    dermis = adding.half_space(directions, below_s / (below + below_s))
    out = np.empty((*SIZE, 3))
    for k, share in enumerate(thickness):
        depth = total * layers.epidermis_mm * share
        r, t = adding.slab(directions, depth, above_s / total)
        for j in range(len(blood)):
            back = adding.lit(directions, adding.over(r, t, dermis[j]), ETA)
            out[k, :, j] = np.log(np.maximum(back @ weights(), DARKEST))
    return {"log_albedo": out}


def shown(layers: Layers, melanin, blood, share=1.0) -> np.ndarray:
    """The table's albedo (..., 3) between its nodes, as the shader reads it."""
    values, places = table(layers), []
    for value, low, most, n, power in (
        (share, THINNEST, 1.0, SIZE[0], 1.0),
        (melanin, 0.0, MOST_MELANIN, SIZE[1], 0.5),
        (blood, 0.0, MOST_BLOOD, SIZE[2], 0.5),
    ):
        at = np.clip((np.asarray(value, float) - low) / (most - low), 0, 1)
        places.append(at**power * (n - 1))
    places = np.broadcast_arrays(*places)
    low = [np.minimum(p.astype(int), n - 2) for p, n in zip(places, SIZE, strict=True)]
    part = [p - i for p, i in zip(places, low, strict=True)]
    out = np.zeros((*places[0].shape, 3))
    for corner in range(8):
        high = [corner >> axis & 1 for axis in range(3)]
        weight = np.ones(places[0].shape)
        for axis in range(3):
            weight = weight * (part[axis] if high[axis] else 1 - part[axis])
        at = tuple(i + h for i, h in zip(low, high, strict=True))
        out += weight[..., None] * values[at]
    return np.exp(out)


def medium(layers: Layers, albedo, melanin: float, blood: float) -> dict:
    """Epidermis over dermis in three channels, a table as renderer.optics.media reads it, whose
    albedo is `albedo` (3,).

    A channel of sRGB spans wavelengths between which coefficients differ by an order, so that no
    mean of them gives its albedo. Scattering is the mean over what comes back in the channel; so is
    absorption, then scaled by one factor a channel until the layers' albedo is the one that is
    asked for.
    """
    from scipy.optimize import brentq

    above, above_s, below, below_s = (
        c @ _shares(layers, melanin, blood) for c in coefficients(layers, melanin, blood)
    )
    directions = adding.Directions.of(ETA)
    for c in range(3):

        def miss(log_factor: float, c=c) -> float:
            parts = above[c] * np.exp(log_factor), above_s[c], below[c] * np.exp(log_factor)
            return float(_albedo(directions, *parts, below_s[c], layers.epidermis_mm) - albedo[c])

        factor = np.exp(brentq(miss, -5, 5, xtol=1e-4))
        above[c], below[c] = above[c] * factor, below[c] * factor
    epidermis, dermis = (
        {"sigma_a": _rounded(a), "sigma_s_prime": _rounded(s), "eta": ETA}
        for a, s in ((above, above_s), (below, below_s))
    )
    layered = ({**epidermis, "thickness_mm": layers.epidermis_mm}, dermis)
    return {"layers": layered, "name": "person"}


def _shares(layers: Layers, melanin: float, blood: float) -> np.ndarray:
    """How much of what comes back in a channel is of each wavelength: (W, 3)."""
    share = np.maximum(weights(), 0) * spectrum(layers, melanin, blood)[:, None]
    return share / share.sum(axis=0)


def _rounded(values: np.ndarray) -> tuple[float, ...]:
    """Six digits: the same medium, and the same key of its curve, on every machine."""
    return tuple(float(f"{value:.6g}") for value in values)
