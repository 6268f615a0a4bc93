"""Burley's curve fits judged by a Monte Carlo of their own setting: half-space, no boundary,
isotropic scatterers, sigma_t = 1/mm.

Where photons go does not depend on what the medium absorbs, only their weight alpha^n after n
scatterings does. So photons are walked once and counted by (n, r); every albedo's profile is a
weighted sum of that table. Photons are ended with probability 1 - ALPHA_END a scattering, which
only thins out those whose weight is spent.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np

from renderer.errors import InputError
from renderer.optics import burley, chandrasekhar
from renderer.optics.dipole import grosjean_D

ALPHA_END = 1 - 1.2e-5  # the albedo whose half-space returns 0.99
EXACT_ORDERS = 256  # below, one row an order; above, rows of 1 %
ORDER_ROWS = EXACT_ORDERS + 1200
R_MIN, R_MAX, R_BINS = 0.02, 2000.0, 200  # mm = mean free paths; logarithmic bins
BATCH = 20_000
ALBEDOS = np.round(np.arange(0.01, 0.995, 0.01), 2)  # the memo's
RANGE = (0.05, 8.0)  # radii that are judged, in mean free paths


@numba.njit(inline="always")
def _next(state):
    """splitmix64: Steele, Lea and Flood 2014, doi:10.1145/2714064.2660195."""
    state = state + np.uint64(0x9E3779B97F4A7C15)
    z = state
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return state, (np.float64(z >> np.uint64(11)) + 0.5) * 1.1102230246251565e-16


@numba.njit(nogil=True, cache=True)
def _walk(photons, seed, diffuse, alpha_end, counts):
    """Walk photons; counts[row of n, bin of r] += 1 for each that leaves."""
    state = np.uint64(seed)
    for _ in range(16):
        state, u = _next(state)
    low, per_bin = np.log(R_MIN), R_BINS / np.log(R_MAX / R_MIN)
    log_end = np.log(alpha_end)
    for _ in range(photons):
        x = y = z = ux = uy = 0.0
        uz = 1.0
        if diffuse:
            state, u = _next(state)
            uz = np.sqrt(u)
            ux = np.sqrt(1 - u)  # the profile is round: any azimuth
        state, u = _next(state)
        last = np.log(u) / log_end  # scatterings that this photon is given
        n = 0
        while True:
            state, u = _next(state)
            step = -np.log(u)
            if z + step * uz < 0:
                step = -z / uz
                x += step * ux
                y += step * uy
                r = np.sqrt(x * x + y * y)
                b = int((np.log(r) - low) * per_bin) if r > R_MIN else 0
                row = n if n < EXACT_ORDERS else EXACT_ORDERS + int(np.log(n / EXACT_ORDERS) * 100)
                counts[min(row, ORDER_ROWS - 1), min(b, R_BINS)] += 1
                break
            x += step * ux
            y += step * uy
            z += step * uz
            n += 1
            if n > last:
                break
            state, u = _next(state)
            uz = 2 * u - 1
            state, u = _next(state)
            side = np.sqrt(1 - uz * uz)
            phi = 6.283185307179586 * u
            ux, uy = side * np.cos(phi), side * np.sin(phi)


def _orders() -> np.ndarray:
    """The number of scatterings that each row of the table stands for: (ORDER_ROWS,)."""
    rows = np.arange(ORDER_ROWS - EXACT_ORDERS)
    return np.concatenate([np.arange(EXACT_ORDERS), EXACT_ORDERS * np.exp((rows + 0.5) / 100)])


@dataclass(frozen=True)
class Table:
    """Photons by (scatterings, radius): counts (ORDER_ROWS, R_BINS + 1), the first bin holds all
    below R_MIN too.
    """

    photons: int
    seed: int
    diffuse: bool
    counts: np.ndarray

    def profile(self, alpha: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bin edges (R_BINS + 1,), share of the light in each bin (R_BINS,) and its standard
        error.
        """
        weight = (alpha / ALPHA_END) ** _orders()
        share, square = weight @ self.counts, weight**2 @ self.counts
        share, square = share[:-1] / self.photons, square[:-1] / self.photons
        return (
            np.geomspace(R_MIN, R_MAX, R_BINS + 1),
            share,
            np.sqrt(np.maximum(square - share**2, 0) / self.photons),
        )

    def total(self, alpha: float) -> tuple[float, float]:
        """Total reflectance and its standard error."""
        weight = (alpha / ALPHA_END) ** _orders()
        mean, square = ((w @ self.counts).sum() / self.photons for w in (weight, weight**2))
        return float(mean), float(np.sqrt((square - mean**2) / self.photons))


@lru_cache(maxsize=4)
def walk(photons: int, seed: int = 0, diffuse: bool = False) -> Table:
    """Walk photons on all cores; the same seed gives the same table on any number of them."""
    import os
    from concurrent.futures import ThreadPoolExecutor

    if isinstance(photons, bool) or not isinstance(photons, (int, np.integer)) or photons < 1:
        raise InputError(f"photons is {photons!r}; expected a whole number of 1 or more")
    sizes = [BATCH] * (photons // BATCH) + ([photons % BATCH] if photons % BATCH else [])
    seeds = np.random.SeedSequence([seed, int(diffuse)]).generate_state(len(sizes), np.uint64)

    def batch(job):
        counts = np.zeros((ORDER_ROWS, R_BINS + 1), dtype=np.int32)
        _walk(*job, diffuse, ALPHA_END, counts)
        return counts

    total = np.zeros((ORDER_ROWS, R_BINS + 1), dtype=np.int64)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for counts in pool.map(batch, zip(sizes, seeds, strict=True)):
            total += counts
    return Table(int(photons), seed, diffuse, total)


@dataclass(frozen=True)
class Judged:
    """One parametrisation against Monte Carlo, per albedo of ALBEDOS: best s, its error, the fit's
    s and its error (mean |relative error|).
    """

    parametrisation: str
    albedo: np.ndarray
    s_best: np.ndarray
    error_best: np.ndarray
    s_fit: np.ndarray
    error_fit: np.ndarray


def judge(
    parametrisation: str, photons: int, seed: int = 0, albedos=ALBEDOS, known: float = 0.05
) -> Judged:
    """Compare R(r) of each albedo with Monte Carlo over RANGE.

    The error is the mean of |R - R_MC| / R_MC over logarithmic bins whose standard error is below
    `known`; R is averaged over a bin by its CDF, as photons are. The memo prints neither its radii
    nor their spacing, and both matter: docs/profiles.md.
    """
    from scipy.optimize import minimize_scalar

    if parametrisation not in burley.PARAMETRISATIONS:
        raise InputError(
            f"parametrisation is {parametrisation!r}; expected one of "
            f"{', '.join(burley.PARAMETRISATIONS)}"
        )
    fit = burley.PARAMETRISATIONS[parametrisation]
    diffuse = parametrisation == "diffuse"
    table = walk(photons, seed, diffuse)
    rows = []
    for A in np.asarray(albedos, dtype=float):
        alpha = chandrasekhar.albedo_of(A, diffuse)
        length = (
            float(np.sqrt(grosjean_D(1 - alpha, alpha) / (1 - alpha)))
            if parametrisation == "dmfp"
            else 1.0
        )
        edges, share, error = table.profile(alpha)
        keep = (edges[:-1] >= RANGE[0]) & (edges[1:] <= RANGE[1]) & (error < known * share)
        if not keep.any():
            raise InputError(
                f"{photons} photons leave no bin known to {100 * known:g} % at an albedo of "
                f"{A:g}; expected more"
            )
        low, high, share = edges[:-1][keep], edges[1:][keep], share[keep]

        def miss(log_s, A=A, low=low, high=high, length=length, share=share):
            got = A * (
                burley.cdf(high, length / np.exp(log_s)) - burley.cdf(low, length / np.exp(log_s))
            )
            return float(np.abs(got / share - 1).mean())

        # The error has one valley in s; a grid finds it, a search narrows it.
        grid = np.log(length * np.geomspace(0.4, 10, 80))
        at = int(np.argmin([miss(s) for s in grid]))
        best = minimize_scalar(
            miss,
            bounds=(grid[max(at - 1, 0)], grid[min(at + 1, 79)]),
            method="bounded",
            options={"xatol": 1e-5},
        )
        rows.append((np.exp(best.x), best.fun, fit(A), miss(np.log(fit(A)))))
    columns = np.array(rows).T
    return Judged(parametrisation, np.asarray(albedos, dtype=float), *columns)
