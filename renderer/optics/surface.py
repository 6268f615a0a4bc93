"""What a rough face sends back and lets through: tables for the diffuse models of the shading.

Kelemen and Szirmay-Kalos 2001's specular model over Beckmann's slopes; Burley 2012's diffuse one.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from renderer import caches

#: How light passes the face on its way to the medium and back. "lambert": all of it. "disney":
#: Burley 2012, "Physically-based shading at Disney", sec. 5.3, with its retro-reflection.
#: "conserving": what is not reflected, on the way in and on the way out (d'Eon and Luebke 2007, GPU
#: Gems 3, sec. 14.3.1 and 14.4.1).
DIFFUSE = ("lambert", "disney", "conserving")
TABLE = 32
ROUGHNESS = (0.05, 1.0)  # of the tables' rows


def _halves(samples: int, roughness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half vectors in strata of Beckmann's D (n.h): cosine (M, S, 1) and azimuth (1, 1, P)."""
    u = (np.arange(samples) + 0.5) / samples
    phi = np.pi * (np.arange(samples) + 0.5) / samples
    cosine = 1 / np.sqrt(1 - roughness[:, None] ** 2 * np.log(u))
    return cosine[:, :, None], phi[None, None, :]


def specular_albedo(cosine, roughness, samples: int = 96) -> np.ndarray:
    """Share of light that a face sends back, (C, M, 2): F0 times the first plus the second.

    cosine (C,) of the angle to the normal, in (0, 1]; roughness (M,): Beckmann's slope. The
    integral of D F / (h.h) (n.l) over l, h = l + v not normalised, with F by Schlick, is the mean
    over half vectors drawn from D (n.h) of F (n.l) / ((v.h) (n.h)), h normalised.
    """
    cosine, roughness = np.asarray(cosine, float), np.asarray(roughness, float)
    mu_h, phi = _halves(samples, roughness)
    sin_h = np.sqrt(1 - mu_h**2)
    out = np.empty((len(cosine), len(roughness), 2))
    for k, mu in enumerate(cosine):
        v_h = mu * mu_h + np.sqrt(1 - mu**2) * sin_h * np.cos(phi)
        n_l = 2 * v_h * mu_h - mu
        lit = (v_h > 1e-6) & (n_l > 0)
        safe = np.where(lit, v_h, 1.0)
        value = np.where(lit, n_l / (safe * mu_h), 0.0)
        grazing = (1 - np.clip(safe, 0, 1)) ** 5
        out[k, :, 0] = (value * (1 - grazing)).mean(axis=(1, 2))
        out[k, :, 1] = (value * grazing).mean(axis=(1, 2))
    return out


def disney(n_l, n_v, l_h, roughness) -> np.ndarray:
    """Burley 2012's diffuse over Lambert's: (1 + (F90 - 1)(1 - n.l)^5)(1 + (F90 - 1)(1 - n.v)^5),
    F90 = 1/2 + 2 roughness (l.h)^2.
    """
    f90 = 0.5 + 2 * np.asarray(roughness) * np.asarray(l_h) ** 2
    return (1 + (f90 - 1) * (1 - np.asarray(n_l)) ** 5) * (
        1 + (f90 - 1) * (1 - np.asarray(n_v)) ** 5
    )


def disney_albedo(cosine, roughness, samples: int = 48) -> np.ndarray:
    """Burley's diffuse under even light from everywhere, over Lambert's: (C, M)."""
    cosine, roughness = np.asarray(cosine, float), np.asarray(roughness, float)
    u = (np.arange(samples) + 0.5) / samples
    n_l = np.sqrt(u)[:, None]  # cosine-distributed
    phi = np.pi * u[None, :]
    out = np.empty((len(cosine), len(roughness)))
    for k, mu in enumerate(cosine):
        l_v = mu * n_l + np.sqrt(1 - mu**2) * np.sqrt(1 - n_l**2) * np.cos(phi)
        l_h = np.sqrt((1 + l_v) / 2)
        out[k] = [disney(n_l, mu, l_h, m).mean() for m in roughness]
    return out


@lru_cache(maxsize=1)
def table() -> np.ndarray:
    """(TABLE, TABLE + 1, 4) float32: a row a roughness of ROUGHNESS, a column a cosine of [0, 1].

    x, y: `specular_albedo`; z: `disney_albedo`. The last column has the means over all directions,
    weighted by the cosine: of even light. Kept in the cache `skin`.
    """
    key = caches.key(["face"], [Path(__file__)], ("numpy",))
    return caches.kept("skin", key, lambda: {"table": _table()})["table"]


def _table() -> np.ndarray:
    cosine = (np.arange(TABLE) + 0.5) / TABLE
    roughness = np.linspace(*ROUGHNESS, TABLE)
    out = np.ones((TABLE, TABLE + 1, 4), np.float32)
    out[:, :-1, :2] = specular_albedo(cosine, roughness).transpose(1, 0, 2)
    out[:, :-1, 2] = disney_albedo(cosine, roughness).T
    out[:, -1, :3] = (out[:, :-1, :3] * (2 * cosine / TABLE)[:, None]).sum(axis=1)
    return out
