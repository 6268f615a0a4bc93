"""Eyelashes: generated strands along the lids' margins."""

from __future__ import annotations

import numpy as np

from stimuli.heads.anatomy import Anatomy
from stimuli.heads.person import Hair

POINTS = 7


def grown(anatomy: Anatomy, skin: np.ndarray, rng: np.random.Generator, own: Hair) -> list[dict]:
    """Upper and lower lashes along the lid margins, which the base mesh's lash helpers mark."""
    from scipy.spatial import cKDTree

    tree, out = cKDTree(skin), []
    for name, curve in anatomy.lashes.items():
        ball = anatomy.eyes[0] if "-l-" in name else anatomy.eyes[1]
        upper = name.endswith("2")
        side = np.sign(ball.centre[0])
        away = np.linalg.norm(curve - ball.centre, axis=1)
        roots = curve[away < np.quantile(away, 0.35)]
        fit = [np.polyfit(roots[:, 0] - ball.centre[0], roots[:, k], 3) for k in (1, 2)]
        low, high = np.quantile(roots[:, 0] - ball.centre[0], [0.04, 0.96])
        count = 150 if upper else 75
        x = rng.uniform(low, high, count)
        at = np.column_stack([ball.centre[0] + x, np.polyval(fit[0], x), np.polyval(fit[1], x)])
        outward = (at - ball.centre) / np.linalg.norm(at - ball.centre, axis=1, keepdims=True)
        splay = side * (x * side + 3) / 16.0
        direction = outward * [1.0, 0.35, 1.0] + np.column_stack(
            [
                0.55 * splay + 0.16 * rng.normal(size=count),
                np.full(count, -0.22 if upper else -0.45),
                np.zeros(count),
            ]
        )
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        length = (
            own.lashes
            * (rng.uniform(5.5, 8.5, count) if upper else rng.uniform(3.0, 5.0, count))
            * (0.75 + 0.25 * (x * side - low) / (high - low))
        )
        s = np.linspace(0, 1, POINTS)
        curl = np.array([0, 1.0 if upper else -0.35, 0.0])
        points = at[:, None] + length[:, None, None] * (
            s[None, :, None] * direction[:, None] + (0.62 * s**2)[None, :, None] * curl
        )
        points += 0.07 * rng.normal(size=(count, 1, 3)) * length[:, None, None] * s[None, :, None]
        out.append(
            {
                "points": points,
                "width_mm": np.full(count, 0.060 if upper else 0.045),
                "colour": np.tile(np.array(own.colour) * 0.7, (count, 1)),
                "cover": np.full((count, POINTS), 0.2),
                "root_vertex": tree.query(at)[1],
            }
        )
    return out
