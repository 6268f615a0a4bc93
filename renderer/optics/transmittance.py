"""Light that a thin part lets through, by its thickness: T(s), the share of the light on the lit
side.

Any sum of Gaussians: gaussians.transmittance (Jimenez et al. 2010); Burley: burley.transmittance; a
slab by its physics: Multipole(...).totals(). Here: Beer's law, as Green 2004 uses it.
"""

from __future__ import annotations

import numpy as np

from renderer.errors import InputError


def beer(thickness_mm, sigma_t) -> np.ndarray:
    """T = exp(-sigma_t s), Green 2004, "Real-time approximations to subsurface scattering", GPU
    Gems, ch. 16.

    thickness_mm (N,), sigma_t (C,) in 1/mm -> (N, C).
    """
    s, sigma_t = np.asarray(thickness_mm, dtype=float), np.asarray(sigma_t, dtype=float)
    if not (
        np.isfinite(sigma_t).all()
        and (sigma_t >= 0).all()
        and np.isfinite(s).all()
        and (s >= 0).all()
    ):
        raise InputError("a thickness or sigma_t is negative or not finite; expected 0 or more")
    return np.exp(-s[..., None] * sigma_t)


def beer_of(thickness_mm: float, transmitted) -> np.ndarray:
    """sigma_t, 1/mm, with which Beer's law gives these shares at one thickness: the artist's way to
    choose it.
    """
    transmitted = np.asarray(transmitted, dtype=float)
    if not thickness_mm > 0 or not ((transmitted > 0) & (transmitted <= 1)).all():
        raise InputError(
            f"transmitted share is {transmitted} at {thickness_mm} mm; expected shares in (0, "
            "1] and a thickness above 0"
        )
    return -np.log(transmitted) / thickness_mm
