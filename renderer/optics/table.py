"""Profiles side by side as rows of a table; an empty field is a value that the model does not
have.
"""

from __future__ import annotations

import csv
import io

import numpy as np

from renderer.optics.model import Profile

CHANNELS = ("R", "G", "B")


def _field(value) -> str:
    return "" if value is None or not np.isfinite(value) else f"{value:.9g}"


def profiles_csv(profiles: list[Profile], r_mm: np.ndarray) -> str:
    """Rows model,r_mm,R_r,R_g,R_b,T_r,T_g,T_b in 1/mm^2."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["model", "r_mm", "R_r", "R_g", "R_b", "T_r", "T_g", "T_b"])
    for profile in profiles:
        R, T = profile.reflectance(r_mm), profile.transmittance(r_mm)
        T = np.full_like(R, np.nan) if T is None else np.broadcast_to(T, R.shape)
        for r, row_R, row_T in zip(r_mm, R, T, strict=True):
            writer.writerow([profile.name, f"{r:.9g}", *map(_field, row_R), *map(_field, row_T)])
    return out.getvalue()


def totals_csv(profiles: list[Profile]) -> str:
    """Rows model,channel,total_reflectance,total_transmittance."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["model", "channel", "total_reflectance", "total_transmittance"])
    for profile in profiles:
        R, T = profile.totals()
        for c, channel in enumerate(CHANNELS):
            writer.writerow(
                [profile.name, channel, f"{R[c]:.6f}", "" if T is None else f"{T[c]:.6f}"]
            )
    return out.getvalue()
