"""Burley's three curve fits against our own Monte Carlo, albedo 0.01 to 0.99: mean relative errors
beside the published ones.

Every albedo is simulated by itself (montecarlo.half_space) with about the same time, so that low
albedos get the most photons; results are kept, and an interrupted run goes on. What Vuletic tells
of the memo says neither at which radii it compared nor how they were spaced, so the table has
several readings: ranges of radii in mean free paths or in each parametrisation's own length; rings
of equal weight on a logarithmic or a linear scale of r, or weighted by the light in them. Only
rings that are known to KNOWN count. See docs/montecarlo.md.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.optimize import minimize_scalar
from tqdm import tqdm

from renderer.optics import burley, chandrasekhar
from renderer.optics.dipole import grosjean_D
from renderer.optics.montecarlo import half_space

PUBLISHED = {
    "mfp": (4.9, 5.5),
    "dmfp": (6.4, 7.7),
    "diffuse": (2.6, 3.9),
}  # per cent: best s per albedo, curve fit
ALBEDOS = np.round(np.arange(0.01, 0.995, 0.01), 2)
EDGES = np.concatenate([[0], np.geomspace(0.02, 2000, 104)])  # rings 12 % wide, mfp
READINGS = [  # radii from, to, in the parametrisation's own length instead of mfp, weight of rings
    (0.02, 4.0, False, "logarithmic"),
    (0.05, 4.0, False, "logarithmic"),
    (0.05, 4.0, False, "linear"),
    (0.05, 4.0, False, "light"),
    (0.05, 8.0, False, "logarithmic"),
    (0.05, 8.0, False, "linear"),
    (0.05, 8.0, False, "light"),
    (0.02, 2.0, True, "logarithmic"),
    (0.02, 4.0, True, "logarithmic"),
]
KNOWN = 0.05
WEIGHTS = {
    "logarithmic": lambda low, high, share: np.log(high / low),
    "linear": lambda low, high, share: high - low,
    "light": lambda low, high, share: share,
}


def photons_for(alpha: float, effort: float) -> int:
    """So many photons that each albedo takes about `effort` microseconds of walking: a photon goes
    through about this many events.
    """
    events = 3 + 0.5 / np.sqrt(1 - alpha)
    return int(effort / events) * 64


def simulations(effort: float, seed: int) -> dict:
    """Rings of every albedo: {(diffuse, A): (alpha, share (rings,), error (rings,), total, its
    error)}.
    """
    simulated = {}
    for diffuse in (False, True):
        for i, A in enumerate(
            tqdm(ALBEDOS, desc="diffuse" if diffuse else "searchlight", unit="albedo", disable=None)
        ):
            alpha = chandrasekhar.albedo_of(float(A), diffuse)
            result = half_space(
                alpha,
                photons_for(alpha, effort),
                200 * seed + 100 * diffuse + i,
                "diffuse" if diffuse else "searchlight",
                EDGES,
            )
            simulated[diffuse, A] = (
                alpha,
                result.R * result.area_mm2,
                result.R_error * result.area_mm2,
                result.diffuse_reflectance,
                result.diffuse_reflectance_error,
            )
    return simulated


def judge(
    name: str, simulated: dict, shortest: float, longest: float, own_length: bool, weight: str
) -> np.ndarray:
    """Rows of (best s, its error, the fit's s, its error, rings that count), one an albedo: (99,
    5).
    """
    fit, rows = burley.PARAMETRISATIONS[name], []
    for A in ALBEDOS:
        alpha, share, error, *_ = simulated[name == "diffuse", A]
        length = (
            float(np.sqrt(grosjean_D(1 - alpha, alpha) / (1 - alpha))) if name == "dmfp" else 1.0
        )
        unit = length if own_length else 1.0
        low, high = EDGES[:-1], EDGES[1:]
        keep = (low >= shortest * unit) & (high <= longest * unit) & (error < KNOWN * share)
        low, high, share = low[keep], high[keep], share[keep]
        weights = WEIGHTS[weight](low, high, share)

        def miss(log_s):
            d = length / np.exp(log_s)  # noqa: B023
            relative = A * (burley.cdf(high, d) - burley.cdf(low, d)) / share - 1  # noqa: B023
            return float((weights * np.abs(relative)).sum() / weights.sum())  # noqa: B023

        grid = np.log(length * np.geomspace(0.3, 12, 120))
        at = int(np.argmin([miss(s) for s in grid]))
        best = minimize_scalar(
            miss,
            bounds=(grid[max(at - 1, 0)], grid[min(at + 1, 119)]),
            method="bounded",
            options={"xatol": 1e-5},
        )
        rows.append((np.exp(best.x), best.fun, fit(A), miss(np.log(fit(A))), keep.sum()))
    return np.array(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description="Burley's curve fits against Monte Carlo.")
    parser.add_argument(
        "--effort",
        type=float,
        default=1e5,
        help="events / 64 walked for each albedo; errors fall with its square root",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        help="draws the photons; every simulation has a seed of its own that follows from it",
    )
    arguments = parser.parse_args()
    simulated = simulations(arguments.effort, arguments.seed)
    off = [(total - A) / error for (_, A), (*_, total, error) in simulated.items()]
    print(
        f"totals against Chandrasekhar: rms {np.sqrt(np.mean(np.square(off))):.2f}, worst "
        f"{np.abs(off).max():.1f} standard errors of {len(off)} totals"
    )
    print("\nmean relative error over albedo in %: s best for each albedo / s of the curve fit")
    print(
        f"{'radii':<18}{'weight of rings':<17}"
        + "".join(f"{name:>14}" for name in PUBLISHED)
        + f"{'rings':>8}"
    )
    print(
        f"{'published':<35}"
        + "".join(f"{f'{best} / {fit}':>14}" for best, fit in PUBLISHED.values())
    )
    for shortest, longest, own, weight in READINGS:
        judged = [judge(name, simulated, shortest, longest, own, weight) for name in PUBLISHED]
        cells = "".join(
            f"{f'{100 * rows[:, 1].mean():.1f} / {100 * rows[:, 3].mean():.1f}':>14}"
            for rows in judged
        )
        radii = f"{shortest}-{longest:g} " + ("own" if own else "mfp")
        last = np.mean([rows[:, 4].mean() for rows in judged])
        print(f"{radii:<18}{weight:<17}{cells}{last:>8.1f}")
    print("\nby albedo, first reading: error in % with the best s / with the fit")
    print(f"{'A':<6}" + "".join(f"{name:>14}" for name in PUBLISHED))
    judged = [judge(name, simulated, *READINGS[0]) for name in PUBLISHED]
    for A in (0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.97, 0.98, 0.99):
        at = round(A * 100) - 1
        print(
            f"{A:<6}"
            + "".join(
                f"{f'{100 * rows[at, 1]:.1f} / {100 * rows[at, 3]:.1f}':>14}" for rows in judged
            )
        )


if __name__ == "__main__":
    main()
