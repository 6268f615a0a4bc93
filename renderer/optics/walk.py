"""The compiled photon walk behind montecarlo.py: one function, plain arrays in, weights added to
plain arrays.

Wang, Jacques and Zheng 1995, "MCML: Monte Carlo modeling of light transport in multi-layered
tissues", doi:10.1016/0169-2607(95)01640-F; scattering by Henyey and Greenstein 1941. What costs
time there is done otherwise here, without loss: path lengths by a ziggurat instead of a logarithm,
azimuths by a table and a short series (error below 1e-14) instead of sine and cosine, and turning a
direction needs one division and one square root.
"""

from __future__ import annotations

import math

import numba
import numpy as np

ROULETTE_BELOW, ROULETTE_CHANCE = 1e-4, 0.1  # MCML's
AZIMUTHS = 256
_ANGLES = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
COSINES, SINES = np.cos(_ANGLES), np.sin(_ANGLES)
AZIMUTH_STEP = 2 * math.pi / AZIMUTHS * 2.0**-45


def _ziggurat(strips: int = 256, tail: float = 7.69711747013104972):
    """Edges x and heights exp(-x) of strips of one area under exp(-x); Marsaglia and Tsang 2000,
    doi:10.18637/jss.v005.i08.
    """
    area = (tail + 1) * math.exp(-tail)
    x = [area / math.exp(-tail), tail]
    while len(x) < strips:
        x.append(-math.log(math.exp(-x[-1]) + area / x[-1]))
    x = np.array([*x, 0.0])
    return x, np.exp(-x)


STRIPS, HEIGHTS = _ziggurat()
TAIL = STRIPS[1]
_INLINE = {"inline": "always", "error_model": "numpy"}


@numba.njit(**_INLINE)
def _bits(state):
    """splitmix64: Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195. (next state, 64 random
    bits).
    """
    state = state + np.uint64(0x9E3779B97F4A7C15)
    z = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return state, z ^ (z >> np.uint64(31))


@numba.njit(**_INLINE)
def _uniform(bits):
    """In [0, 1), from the upper 53 bits."""
    return np.float64(np.int64(bits >> np.uint64(11))) * 1.1102230246251565e-16


@numba.njit(**_INLINE)
def _exponential(state):
    """(next state, -ln u) without the logarithm, exact."""
    start = 0.0
    while True:
        state, bits = _bits(state)
        strip = np.int64(bits & np.uint64(255))
        x = _uniform(bits) * STRIPS[strip]
        if x < STRIPS[strip + 1]:
            return state, start + x
        if strip == 0:
            start += TAIL  # beyond the tail the law is the same again
            continue
        state, bits = _bits(state)
        if HEIGHTS[strip] + _uniform(bits) * (HEIGHTS[strip + 1] - HEIGHTS[strip]) < math.exp(-x):
            return state, start + x


@numba.njit(**_INLINE)
def _azimuth(bits):
    """Cosine and sine of a uniform angle: the table's nearest angle, turned by at most pi / 256."""
    at = np.int64(bits >> np.uint64(56))
    d = (
        np.float64(np.int64((bits >> np.uint64(11)) & np.uint64(0x1FFFFFFFFFFF)) - 0x100000000000)
        * AZIMUTH_STEP
    )
    dd = d * d
    s = d * (1 - dd * (1 / 6) * (1 - dd * (1 / 20)))
    c = 1 - dd * 0.5 * (1 - dd * (1 / 12))
    return COSINES[at] * c - SINES[at] * s, SINES[at] * c + COSINES[at] * s


@numba.njit(**_INLINE)
def henyey_greenstein(g, u):
    """Cosine of the angle by which light turns, of mean g, from a uniform u: Henyey and Greenstein
    1941, inverted.
    """
    if g == 0:
        return 1 - 2 * u
    t = (1 - g * g) / (1 - g + 2 * g * u)
    return (1 + g * g - t * t) / (2 * g)


@numba.njit(**_INLINE)
def fresnel(n1, n2, cos1):
    """(reflectance of unpolarised light, cosine beyond the face); exact; 1 and 0 in total
    reflection.
    """
    ratio = n1 / n2
    sine2 = ratio * ratio * (1 - cos1 * cos1)
    if sine2 >= 1:
        return 1.0, 0.0
    cos2 = math.sqrt(1 - sine2)
    s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2)
    p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2)
    return 0.5 * (s * s + p * p), cos2


@numba.njit(**_INLINE)
def _bin(edges, value):
    """i with edges[i] <= value < edges[i + 1], for rising edges; len(edges) - 1 beyond the last."""
    low, count = 0, len(edges)
    while count > 1:
        half = count >> 1
        low += half if value >= edges[low + half] else 0  # no branch to predict
        count -= half
    return low


@numba.njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def walk(
    photons,
    state,
    diffuse,
    n,
    z,
    mu_t,
    albedo,
    g,
    r2_edges,
    sin2_edges,
    unscattered,
    absorbed,
    radial,
    angular,
):
    """Walk photons from `state` on, add their weights, and return the next state.

    Layers i = 0 .. L-1 lie between depths z[i] and z[i + 1], mm; n is (L + 2,) with what lies above
    and below at its ends; mu_t (1/mm), albedo and g are (L,). Light enters at the origin, straight
    down or (diffuse) cosine-distributed from above. unscattered (2,): light that left above
    (mirrored at once or later) and below without being scattered. absorbed (L,). radial (4, bins +
    1): light scattered once that left above, more than once above, once below, more than once
    below, by r^2; the last bin is all beyond. angular (2, bins): scattered light above and below by
    the squared sine of its exit angle.

    Every weight that is launched is added somewhere: what roulette takes is absorbed, what it gives
    is absorbed negatively, so the sums are conserved to rounding while their means do not change.
    """
    last = len(mu_t) - 1
    for _ in range(photons):
        ux, cosine = 0.0, 1.0
        if diffuse:
            state, bits = _bits(state)
            cosine = math.sqrt(1 - _uniform(bits))
            ux = (
                math.sqrt(1 - cosine * cosine) * n[0] / n[1]
            )  # all is round about the axis, so any azimuth will do
        mirrored, uz = fresnel(n[0], n[1], cosine)
        unscattered[0] += mirrored
        weight = 1 - mirrored
        if weight <= 0:
            continue
        uy = x = y = depth = 0.0
        layer = order = 0
        entered = weight  # the weight with which the photon came into its layer
        top, bottom, mu, alpha, mean_cos = z[0], z[1], mu_t[0], albedo[0], g[0]
        state, path = _exponential(state)  # optical length that is left before the next event
        while True:
            step = path / mu
            there = depth + uz * step
            if there >= top and there <= bottom and mu > 0:
                x += ux * step
                y += uy * step
                depth = there
                weight *= alpha
                if weight < ROULETTE_BELOW:
                    state, bits = _bits(state)
                    if _uniform(bits) >= ROULETTE_CHANCE or weight == 0:
                        absorbed[layer] += entered
                        break
                    weight *= 1 / ROULETTE_CHANCE
                order += 1
                state, bits = _bits(state)
                cosine = henyey_greenstein(mean_cos, _uniform(bits))
                sine = math.sqrt(max(1 - cosine * cosine, 0.0))
                state, bits = _bits(state)
                c, s = _azimuth(bits)
                c *= sine
                s *= sine
                if mean_cos == 0:
                    ux, uy, uz = c, s, cosine
                # a frame about the old direction: Duff et al. 2017, "Building an orthonormal basis,
                # revisited"
                else:
                    sign = math.copysign(1.0, uz)
                    a = -1 / (sign + uz)
                    b = ux * uy * a
                    vx = c * (1 + sign * ux * ux * a) + s * b + cosine * ux
                    vy = c * sign * b + s * (sign + uy * uy * a) + cosine * uy
                    uz = cosine * uz - c * sign * ux - s * uy
                    ux, uy = vx, vy
                state, path = _exponential(state)
                continue

            beyond, face = (layer + 1, bottom) if uz > 0 else (layer - 1, top)
            step = (face - depth) / uz
            path = max(path - step * mu, 0.0)
            x += ux * step
            y += uy * step
            depth = face
            n1, n2 = n[layer + 1], n[beyond + 1]
            cosine = abs(uz)
            if n1 != n2:
                mirrored, cosine = fresnel(n1, n2, cosine)
                if mirrored > 0:
                    state, bits = _bits(state)
                    if _uniform(bits) < mirrored:
                        uz = -uz
                        continue
            absorbed[layer] += entered - weight
            if beyond < 0 or beyond > last:
                below = 0 if beyond < 0 else 1
                if order == 0:
                    unscattered[below] += weight
                else:
                    radial[2 * below + (order > 1), _bin(r2_edges, x * x + y * y)] += weight
                    angular[
                        below, min(_bin(sin2_edges, 1 - cosine * cosine), angular.shape[1] - 1)
                    ] += weight
                break
            ux *= n1 / n2
            uy *= n1 / n2
            uz = math.copysign(cosine, uz)
            layer, entered = beyond, weight
            top, bottom, mu, alpha, mean_cos = (
                z[layer],
                z[layer + 1],
                mu_t[layer],
                albedo[layer],
                g[layer],
            )
    return state
