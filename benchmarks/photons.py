"""Photons per second against a plain C loop in the manner of MCML, compiled in the same run;
scaling with threads; memory.

Each round runs C and ours in turn, so that drift hits both alike; medians of CPU and wall seconds,
and their ratio. C gets the same photons and layers and counts the same curves with the optimisation
that its compiler has for this processor. Without a C compiler the yardstick is mcml_loop(), the
same plain loop through numba. Both must agree in what they computed.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numba
import numpy as np

from renderer.optics.montecarlo import Layer, Result, simulate

ROUNDS = 5
FLAGS = ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math"]
# the first three are MCML's own samples and checks, the last is near what skin does to red light
CASES = {
    "slab, g .75, tau 2": (2_000_000, [Layer(1, 1, 9, 0.75, 0.2)]),
    "half-space, n 1.5, g 0": (1_000_000, [Layer(1.5, 1, 9)]),
    "three layers, n 1.37": (
        500_000,
        [Layer(1.37, 0.1, 10, 0.9, 1), Layer(1.37, 0.1, 1, 0, 1), Layer(1.37, 0.2, 1, 0.7, 2)],
    ),
    "half-space, n 1.4, g .9, albedo .998": (100_000, [Layer(1.4, 0.02, 10, 0.9)]),
}


@numba.njit(cache=True, error_model="numpy")
def mcml_loop(photons, seed, n, z, mu_a, mu_t, g):
    """What mcml.c does, for where there is no C compiler: (diffuse reflectance, transmittance,
    absorbed).
    """
    np.random.seed(seed)
    R = T = A = 0.0
    layers = len(mu_t)
    specular = ((n[0] - n[1]) / (n[0] + n[1])) ** 2
    for _ in range(photons):
        x = y = depth = ux = uy = 0.0
        uz, w, left, i = 1.0, 1 - specular, 0.0, 0
        while True:
            if left == 0:
                left = -math.log(1 - np.random.random())
            step = left / mu_t[i]
            face = z[i + 1] if uz > 0 else z[i]
            to_face = (face - depth) / uz if uz != 0 else np.inf
            if to_face < step:
                left -= to_face * mu_t[i]
                x, y, depth = x + ux * to_face, y + uy * to_face, face
                beyond = i + 1 if uz > 0 else i - 1
                ratio = n[i + 1] / n[beyond + 1]
                sin2 = ratio * math.sqrt(1 - uz * uz)
                f, cos2 = 1.0, 0.0
                if sin2 < 1:
                    cos1, cos2 = abs(uz), math.sqrt(1 - sin2 * sin2)
                    s, p = (
                        (ratio * cos1 - cos2) / (ratio * cos1 + cos2),
                        (cos1 - ratio * cos2) / (cos1 + ratio * cos2),
                    )
                    f = 0.5 * (s * s + p * p)
                if np.random.random() < f:
                    uz = -uz
                    continue
                if beyond < 0:
                    R += w
                    break
                if beyond == layers:
                    T += w
                    break
                ux, uy, uz, i = ux * ratio, uy * ratio, math.copysign(cos2, uz), beyond
                continue
            x, y, depth, left = x + ux * step, y + uy * step, depth + uz * step, 0.0
            A += w * mu_a[i] / mu_t[i]
            w *= 1 - mu_a[i] / mu_t[i]
            cost = 2 * np.random.random() - 1
            if g[i] != 0:
                cost = (1 + g[i] ** 2 - ((1 - g[i] ** 2) / (1 + g[i] * cost)) ** 2) / (2 * g[i])
            sint, psi = math.sqrt(1 - cost * cost), 2 * math.pi * np.random.random()
            cosp, sinp = math.cos(psi), math.sin(psi)
            if abs(uz) > 1 - 1e-12:
                ux, uy, uz = sint * cosp, sint * sinp, math.copysign(cost, uz * cost)
            else:
                t = math.sqrt(1 - uz * uz)
                ux, uy, uz = (
                    sint * (ux * uz * cosp - uy * sinp) / t + ux * cost,
                    sint * (uy * uz * cosp + ux * sinp) / t + uy * cost,
                    -sint * cosp * t + uz * cost,
                )
            if w < 1e-4:
                if w == 0 or np.random.random() > 0.1:
                    break
                w *= 10
    return R / photons, T / photons, A / photons


def yardstick(folder: Path):
    """(its name, run(photons, seed, layers) -> wall s, CPU s, diffuse reflectance,
    transmittance).
    """
    if compiler := shutil.which("cc"):
        program = folder / "mcml"
        subprocess.run(
            [compiler, *FLAGS, "-o", program, Path(__file__).with_name("mcml.c"), "-lm"], check=True
        )
        version = subprocess.run(
            [compiler, "--version"], capture_output=True, text=True, check=True
        ).stdout.splitlines()[0]

        def run(photons, seed, layers):
            words = [
                str(value)
                for layer in layers
                for value in (layer.n, layer.mu_a, layer.mu_s, layer.g, layer.d)
            ]
            out = subprocess.run(
                [program, str(photons), str(seed), "1", "1", *words],
                capture_output=True,
                text=True,
                check=True,
            )
            wall, cpu, _, R, T, _ = map(float, out.stdout.split())
            return wall, cpu, R, T

        return f"plain C, {version}, {' '.join(FLAGS)}", run

    def run(photons, seed, layers):
        n = np.array([1.0, *(layer.n for layer in layers), 1.0])
        z = np.concatenate([[0.0], np.cumsum([layer.d for layer in layers])])
        columns = [
            np.array([getattr(layer, name) for layer in layers], dtype=float)
            for name in ("mu_a", "mu_t", "g")
        ]
        mcml_loop(10, seed, n, z, *columns)
        wall, cpu = time.perf_counter(), time.process_time()
        R, T, _ = mcml_loop(photons, seed, n, z, *columns)
        return time.perf_counter() - wall, time.process_time() - cpu, R, T

    return "the same plain loop through numba (there is no cc)", run


def ours(photons: int, seed: int, layers: list[Layer], threads: int) -> tuple[float, float, Result]:
    wall, cpu = time.perf_counter(), time.process_time()
    result = simulate(layers, photons, seed, cache=False, threads=threads)
    return time.perf_counter() - wall, time.process_time() - cpu, result


def speed() -> None:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    ours(1000, 0, [Layer(1.4, 1, 9)], 1)  # compiles
    with tempfile.TemporaryDirectory() as folder:
        name, plain = yardstick(Path(folder))
        print(
            f"yardstick: {name}; {ROUNDS} rounds in turn, medians; million photons a second "
            f"on one thread, then on {cores}"
        )
        print(
            "wall x: how much faster all threads are; CPU x: what more they cost (1: nothing "
            f"is lost, so idle cores scale); load {os.getloadavg()[0]:.1f}"
        )
        print(
            f"{'case':<38}{'plain CPU':>10}{'ours CPU':>10}{'ratio':>7}{'plain wall':>12}"
            f"{'ours wall':>11}{f'{cores} threads':>11}{'wall x':>8}{'CPU x':>7}  off"
        )
        for case, (photons, layers) in CASES.items():
            rows, shares = [], []
            for round_ in range(ROUNDS):
                wall, cpu, R, _T = plain(photons, round_, layers)
                one = ours(photons, round_, layers, 1)
                many = ours(photons, round_, layers, cores)
                rows.append((cpu, one[1], wall, one[0], many[0], many[1]))
                shares.append(
                    (
                        R - one[2].diffuse_reflectance - (one[2].specular - _first(layers)),
                        one[2].diffuse_reflectance_error,
                    )
                )
            # The yardstick has about our error; the mean of all rounds must agree.
            off = np.mean([d for d, _ in shares]) / (
                np.sqrt(2 / ROUNDS) * np.mean([e for _, e in shares])
            )
            plain_cpu, our_cpu, plain_wall, our_wall, all_wall, all_cpu = (
                photons / 1e6 / np.median(np.array(rows), axis=0)
            )
            print(
                f"{case:<38}{plain_cpu:>10.3f}{our_cpu:>10.3f}{our_cpu / plain_cpu:>7.2f}"
                f"{plain_wall:>12.3f}{our_wall:>11.3f}{all_wall:>11.3f}"
                f"{all_wall / our_wall:>8.2f}{our_cpu / all_cpu:>7.2f}  {off:+.1f} sigma",
                flush=True,
            )
            if abs(off) > 4:
                sys.exit(
                    f"photons: {case}: the yardstick and ours disagree by {off:.1f} standard errors"
                )


def _first(layers: list[Layer]) -> float:
    """Mirror reflection at the first face: what the yardstick calls specular."""
    return ((1 - layers[0].n) / (1 + layers[0].n)) ** 2


def memory() -> None:
    """Peak memory of a process of its own for each number of photons."""
    print("\nphotons      peak memory MB")
    program = (
        "import sys, resource; from renderer.optics.montecarlo import *; "
        "simulate([Layer(1.5, 1, 9)], int(sys.argv[1]), cache=False); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    for photons in (10_000, 100_000, 1_000_000, 10_000_000):
        out = subprocess.run(
            [sys.executable, "-c", program, str(photons)],
            capture_output=True,
            text=True,
            check=True,
        )
        per_mb = 1024 * 1024 if sys.platform == "darwin" else 1024
        print(f"{photons:<13}{int(out.stdout) / per_mb:>8.0f}")


if __name__ == "__main__":
    speed()
    memory()
