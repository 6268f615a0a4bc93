"""Separable kernels: one 1-D kernel applied along rows, then along columns, in the place of a
radial profile.

Jimenez, Zsolnai, Jarabo, Freude, Auzinger, Wu, von der Pahlen, Wimmer and Gutierrez 2015,
"Separable subsurface scattering", Computer Graphics Forum 34(6), doi:10.1111/cgf.12529. Profiles
are normalised to 1 here (the colour is kept in the albedo), so every kernel sums to 1 per channel,
and the 2-D kernel is a(x) a(y).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from renderer.errors import InputError
from renderer.optics import gaussians

GUIDE_B = (
    np.inf
)  # 1/mm^2; no b is printed for eq. 3.4, and "k = 0 is no guide" holds for an infinite one alone


def tap_offsets(taps: int, reach: float) -> np.ndarray:
    """Offsets in [-reach, reach], dense at the centre: reach * sign(o) o^2, o uniform in [-1, 1]:
    (taps,).
    """
    o = np.linspace(-1, 1, taps)
    return reach * np.sign(o) * o**2


def tap_edges(offsets: np.ndarray) -> np.ndarray:
    """Edges of the interval that each tap stands for, half-way between taps, open at both ends:
    (taps + 1,).
    """
    return np.concatenate([[-np.inf], 0.5 * (offsets[1:] + offsets[:-1]), [np.inf]])


def demo_kernel(
    taps: int, strength=(0.48, 0.41, 0.28), falloff=(1.0, 0.37, 0.3)
) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (taps,) and weights (taps, 3) of the code published with the 2012 report ("Separable
    SSS" demo).

    A radial slice of five of the six Gaussians with the red weights for all channels, stretched per
    channel by `falloff` and blended with the centre by `strength`.
    """
    offsets = tap_offsets(taps, 3.0 if taps > 20 else 2.0)
    r = np.abs(offsets)[:, None] / (0.001 + np.array(falloff))
    profile = sum(
        w * np.exp(-(r**2) / (2 * v)) / (2 * 3.14 * v)
        for w, v in zip(gaussians.SKIN_WEIGHTS[1:, 0], gaussians.SKIN_VARIANCE_MM2[1:], strict=True)
    )
    gap = np.abs(np.diff(offsets))
    area = 0.5 * (np.append(0, gap) + np.append(gap, 0))[:, None]
    weights = area * profile
    weights /= weights.sum(axis=0)
    strength = np.array(strength)
    centre = taps // 2
    weights *= strength
    weights[centre] += 1 - strength
    return offsets, weights


def artist(x_mm, sigma_near_mm, sigma_far_mm, near_weight, scale: float = 1.0) -> np.ndarray:
    """a_m(x) = w G(x, sigma_n) + (1 - w) G(x, sigma_f), eq.

    3.7, sigma = sigma' scale: (N,) and (C,) -> (N, C), 1/mm.

    G(x, sigma) = exp(-x^2 / 2 sigma^2) / (sqrt(2 pi) sigma); Vuletic eq. 3.8 prints 1 / (2 pi
    sigma), which does not integrate to 1.
    """
    near, far, w = (
        np.atleast_1d(np.asarray(v, dtype=float))
        for v in (sigma_near_mm, sigma_far_mm, near_weight)
    )
    if not ((near > 0).all() and (far > 0).all() and scale > 0):
        raise InputError(
            "a near or far scattering distance is not positive; expected millimetres above 0"
        )
    if not ((w >= 0) & (w <= 1)).all():
        raise InputError(f"near weight is {w}; expected 0 to 1")
    x = np.asarray(x_mm, dtype=float)[:, None]
    g = lambda sigma: (
        np.exp(-(x**2) / (2 * (sigma * scale) ** 2)) / (np.sqrt(2 * np.pi) * sigma * scale)
    )
    return w * g(near) + (1 - w) * g(far)


@dataclass(frozen=True)
class Kernel:
    """A kernel on a uniform grid of one channel: x_mm (N,), odd and symmetric; a (N,), 1/mm; error
    of the 2-D product against the profile, sqrt(sum (R - a a)^2) / sqrt(sum R^2).
    """

    method: str
    x_mm: np.ndarray
    a: np.ndarray
    rms_error: float

    @property
    def spacing_mm(self) -> float:
        return float(self.x_mm[1] - self.x_mm[0])

    @property
    def total(self) -> float:
        """int a dx; its square is what the 2-D kernel keeps of the energy."""
        return float(self.a.sum() * self.spacing_mm)

    def taps(self, offsets: np.ndarray) -> np.ndarray:
        """Weights of taps at these offsets, mm: the kernel integrated over each tap's interval, sum
        1: (taps,).
        """
        edges = np.clip(tap_edges(offsets), self.x_mm[0], self.x_mm[-1])
        share = np.concatenate([[0.0], np.cumsum(0.5 * (self.a[1:] + self.a[:-1]))])
        weights = np.diff(np.interp(edges, self.x_mm, share))
        return weights / weights.sum()


def half_grid(reach_mm: float, points: int) -> np.ndarray:
    """0 to reach_mm in `points` equal steps: (points + 1,)."""
    if not (np.isfinite(reach_mm) and reach_mm > 0) or points < 8:
        raise InputError(
            f"reach is {reach_mm} mm in {points} steps; expected a positive reach and 8 steps "
            "or more"
        )
    return np.linspace(0, reach_mm, points + 1)


def quadrant(profile: Callable, x: np.ndarray) -> np.ndarray:
    """The profile averaged over the cells of a quarter plane, normalised so that the whole plane
    holds 1, 1/mm^2: (n, n).

    Cells are squares around the grid's points; 4 x 4 points in each, so that a peak narrower than a
    cell keeps its energy.
    """
    delta = x[1] - x[0]
    sub = (np.arange(4) - 1.5) / 4 * delta
    fine = np.abs(x[:, None] + sub).ravel()
    r = np.hypot(fine[:, None], fine)
    values = (
        np.asarray(profile(r.ravel()), dtype=float).reshape(len(x), 4, len(x), 4).mean(axis=(1, 3))
    )
    count = np.where(np.arange(len(x)) == 0, 1, 2)
    return values / (values * np.outer(count, count)).sum() / delta**2


def _kernel(method: str, x: np.ndarray, half: np.ndarray, R: np.ndarray) -> Kernel:
    count = np.where(np.arange(len(x)) == 0, 1, 2)
    weight = np.outer(count, count)
    error = np.sqrt((weight * (R - np.outer(half, half)) ** 2).sum() / (weight * R**2).sum())
    return Kernel(
        method, np.concatenate([-x[:0:-1], x]), np.concatenate([half[:0:-1], half]), float(error)
    )


def decompose(
    profile: Callable, reach_mm: float, points: int = 200
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The singular value decomposition of R(x, y) on the whole plane, which is symmetric: x (N,)
    mm from 0, singular values (N,) falling, with their signs, and vectors (N, N) over x, a column
    each, so that R = sum of value v(x) v(y).
    """
    x = half_grid(reach_mm, points)
    root = np.sqrt(np.where(np.arange(len(x)) == 0, 1, 2))
    values, vectors = np.linalg.eigh(root[:, None] * quadrant(profile, x) * root)
    order = np.argsort(-np.abs(values))
    return x, values[order], vectors[:, order] / root[:, None]


def svd(profile: Callable, reach_mm: float, points: int = 200) -> Kernel:
    """The rank-one part of the singular value decomposition: least RMS error of all products, but
    it does not keep the energy.

    profile: radii (M,) mm -> values (M,), any scale.
    """
    x, values, vectors = decompose(profile, reach_mm, points)
    half = np.sqrt(values[0]) * np.abs(vectors[:, 0])
    return _kernel("svd", x, half, quadrant(profile, x))


def guide(x: np.ndarray, y: np.ndarray, k: float, b: float = GUIDE_B) -> np.ndarray:
    """Gamma(x, y, k) = (x^2 + y^2)^(k/2) (1 - exp(-b x^2)) (1 - exp(-b y^2)), eq. 3.4, b in 1/mm^2.

    A finite b frees the kernel on the axes, where the energy that the tail does not need then
    gathers in a spike at 0.
    """
    radial = (x**2 + y**2) ** (k / 2)
    return radial if np.isinf(b) else radial * -np.expm1(-b * x**2) * -np.expm1(-b * y**2)


def guided(
    profile: Callable, reach_mm: float, k: float = 2.0, points: int = 200, b: float = GUIDE_B
) -> Kernel:
    """argmin_a int Gamma (R - a(x) a(y))^2 with a >= 0, symmetric, and |a|_1^2 = |R|_1 (eqs.

    3.3 and 3.4).

    k = 0 cares for the peak, k = 2 (the paper's choice) for the tail. Projected L-BFGS over a
    half-line, renormalised in every step.
    """
    from scipy.optimize import minimize

    if not np.isfinite(k) or k < 0 or not b > 0:
        raise InputError(f"k is {k} and b {b}; expected k of 0 or more and b above 0")
    x = half_grid(reach_mm, points)
    delta = x[1] - x[0]
    R = quadrant(profile, x)
    count = np.where(np.arange(len(x)) == 0, 1.0, 2.0)
    weight = guide(x[:, None], x, k, b) * np.outer(count, count)
    weight = weight / (weight * R**2).sum()

    def cost(raw):
        total = (count * raw).sum() * delta
        a = raw / total
        miss = R - np.outer(a, a)
        grad_a = -4 * (weight * miss) @ a
        grad = grad_a / total - (grad_a @ raw) / total**2 * count * delta
        return float((weight * miss**2).sum()), grad

    start = np.sqrt(np.maximum(np.diag(R), 0))
    solution = minimize(
        cost,
        start / ((count * start).sum() * delta),
        jac=True,
        method="L-BFGS-B",
        bounds=[(1e-12, None)] * len(x),
        options={"maxiter": 5000, "maxfun": 20000, "ftol": 1e-13, "gtol": 1e-9},
    )
    if not solution.success:
        raise ArithmeticError(f"guided optimisation did not converge: {solution.message}")
    return _kernel(f"guided k={k:g}", x, solution.x / ((count * solution.x).sum() * delta), R)


def preintegrated(profile: Callable, reach_mm: float, points: int = 200) -> Kernel:
    """a_p(x) = int R(sqrt(x^2 + y^2)) dy over the grid, normalised: exact for light E_1(x) + E_2(y)
    (eqs. 3.5 and 3.6).
    """
    x = half_grid(reach_mm, points)
    R = quadrant(profile, x)
    count = np.where(np.arange(len(x)) == 0, 1, 2)
    return _kernel("preintegrated", x, R @ count * (x[1] - x[0]), R)


def artist_fit(
    profile: Callable, reach_mm: float, points: int = 200
) -> tuple[Kernel, tuple[float, float, float]]:
    """The artist's two Gaussians nearest to the pre-integrated kernel, and (sigma_near, sigma_far,
    weight of the near one), mm.
    """
    from scipy.optimize import least_squares

    exact = preintegrated(profile, reach_mm, points)
    x = half_grid(reach_mm, points)
    goal = exact.a[points:]
    spread = np.sqrt((exact.a * exact.x_mm**2).sum() / exact.a.sum())
    model = lambda p: artist(x, np.exp(p[0]), np.exp(p[1]), 1 / (1 + np.exp(-p[2])))[:, 0]
    solution = least_squares(
        lambda p: model(p) - goal, [np.log(spread / 3), np.log(spread * 1.3), 0.0]
    )
    near, far, w = np.exp(solution.x[0]), np.exp(solution.x[1]), 1 / (1 + np.exp(-solution.x[2]))
    if near > far:
        near, far, w = far, near, 1 - w
    return _kernel("artist", x, model(solution.x), quadrant(profile, x)), (
        float(near),
        float(far),
        float(w),
    )
