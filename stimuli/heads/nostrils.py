"""Open nostrils: the base mesh has a dent where a nose has two passages."""

from __future__ import annotations

import numpy as np

from stimuli.heads.form import Form
from stimuli.heads.relief import Reference
from stimuli.heads.smooth import smoothstep

#: Front and back end of the left one on the base mesh without targets, x and z, y above the eyes.
ENDS_MM = ((7.4, -43.0, 160.6), (12.4, -43.5, 152.6))
BORE = (0.0, 0.94, -0.34)  # which way it leads
ABOUT_MM = 5.0  # of the opening along its bore: what lies farther off is lip or the nose's back
REACH = 2.6  # half axes: farther off nothing is moved


def _frames(form: Form, reference: Reference):
    """Of each side: middle (3,), half axes (2,) mm, axes (3, 3) as rows: along, outwards, bore."""
    for side in (1, -1):
        ends = reference.carried(np.array(ENDS_MM) * [side, 1, 1])
        bore = np.array(BORE) / np.linalg.norm(BORE)
        along = ends[1] - ends[0]
        long = 0.5 * np.linalg.norm(along) * form.nostril_long
        along = along - (along @ bore) * bore
        along /= np.linalg.norm(along)
        out = np.cross(bore, along)
        out *= np.sign(out[0]) * side
        half = np.array([long, form.nostril_wide * long])
        yield ends.mean(axis=0), half, np.array([along, out, bore])


def _within(points: np.ndarray, middle, half, axes) -> tuple[np.ndarray, ...]:
    """Of points (N, 3): how far from the middle in half axes, how far outwards in half axes, and
    how far along the bore in mm, (N,) each.
    """
    off = (points - middle) @ axes.T
    return np.hypot(off[:, 0] / half[0], off[:, 1] / half[1]), off[:, 1] / half[1], off[:, 2]


def near(form: Form, reference: Reference, points: np.ndarray) -> np.ndarray:
    """(N,) bool: the points about the openings, whose walls coarse triangles would blur."""
    result = np.zeros(len(points), bool)
    if form.nostril_mm:
        for frame in _frames(form, reference):
            r, _, along = _within(points, *frame)
            result |= (r < 1.7) & (np.abs(along) < ABOUT_MM)
    return result


def opened(
    form: Form, reference: Reference, points: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How far vertices are moved (N, 3) mm, and how deep in a nostril they come to lie (N,) in
    [0, 1].

    points, normals (N, 3). The passage is nostril_mm deep behind a rounded rim; the wing's margin
    rises by nostril_arch_mm, so that the opening is seen from the front.
    """
    moved, deep = np.zeros_like(points), np.zeros(len(points))
    if not form.nostril_mm:
        return moved, deep
    for middle, half, axes in _frames(form, reference):
        r, out, along = _within(points, middle, half, axes)
        close = (r < REACH) & (np.abs(along) < 2 * ABOUT_MM)
        about = smoothstep(0, 1, (ABOUT_MM - np.abs(along)) / 1.5)
        share = about * smoothstep(0, 1, (0.35 - normals @ axes[2]) / 0.3)
        share *= smoothstep(0, 1, (1.0 - r) / (1.0 - form.nostril_wall)) * close
        # the margin of the wing, both its skin and its lining
        margin = np.exp(-(((r - 1.15) / 0.75) ** 2)) * smoothstep(0, 1, (out - 0.1) / 0.7)
        margin *= np.exp(-((along / 4.0) ** 2)) * smoothstep(0, 1, (REACH - r) / 0.8) * close
        way = form.nostril_mm * share + form.nostril_arch_mm * margin
        moved += way[:, None] * axes[2]
        lining = smoothstep(0, 1, (1.0 - r) / 0.8) * smoothstep(
            0, 1, (0.7 - normals @ axes[2]) / 0.5
        )
        deep = np.maximum(deep, lining * about)
    return moved, deep
