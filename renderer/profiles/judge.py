"""Every model against Monte Carlo: totals and curves of a few materials."""

from __future__ import annotations

import csv
import io
from dataclasses import astuple, dataclass, fields

import numpy as np

from renderer.errors import InputError
from renderer.medium import Stack, preset
from renderer.profiles import models, single
from renderer.profiles.photons import MonteCarlo
from renderer.profiles.table import CHANNELS

MATERIALS = ("wholemilk", "marble", "skin1", "ketchup")  # from almost no absorption to almost nothing else
RANGE_MFP = (0.1, 10.0)  # radii that are judged, in mean free paths
KNOWN = 0.05  # relative standard error of a ring that is judged
# Models that leave out light which scatters once are judged with it, too.
WITHOUT_SINGLE = ("better_dipole", "quantized_diffusion")


@dataclass(frozen=True)
class Verdict:
    """One model, one material, one channel. Errors are relative; `total_error` and `curve_error` in per cent, the latter the mean of
    |R - R_MC| / R_MC over logarithmic rings, `radial_error` is E of eq. 3.1 over them."""

    material: str
    model: str
    channel: str
    albedo_prime: float
    montecarlo_total: float
    montecarlo_standard_error: float
    model_total: float
    total_error: float
    curve_error: float
    radial_error: float
    rings: int

    @property
    def words(self) -> str:
        """What to think of it, by the worse of the total's and the curve's error."""
        worst = max(abs(self.total_error), self.curve_error)
        return "good" if worst <= 10 else "fair" if worst <= 25 else "poor" if worst <= 60 else "bad"


def _ring_means(reflectance, edges: np.ndarray) -> np.ndarray:
    """The mean of R over each ring, by Gauss and Legendre in r: (rings,) -> (rings, C)."""
    t, w = np.polynomial.legendre.leggauss(5)
    a, b = edges[:-1, None], edges[1:, None]
    r = 0.5 * (a + b) + 0.5 * (b - a) * t
    values = reflectance(r.ravel()).reshape(*r.shape, -1)
    area = (w * r * 0.5 * (b - a))[..., None]
    return (values * area).sum(1) / area.sum(1)


def judge(stack: Stack, photons: int, seed: int) -> list[Verdict]:
    """Every model of one material that can take it, channel by channel."""
    truth = MonteCarlo(stack, photons, seed)
    results, edges = truth.results(), truth.edges_mm()
    candidates: list[tuple] = []
    for name in models.MODELS:
        if name == "montecarlo":
            continue
        try:
            model = models.make(name, stack)
        except InputError:
            continue  # a model for another kind of stack
        candidates.append((name, model.reflectance, model.totals()[0]))
        if name in WITHOUT_SINGLE:
            extra, total = (lambda r: single.reflectance(stack, r)), single.total(stack)
            candidates.append((f"{name} + single", lambda r, model=model: model.reflectance(r) + extra(r), model.totals()[0] + total))
    out = []
    for name, reflectance, total in candidates:
        means = _ring_means(reflectance, edges[1:])
        for c, result in enumerate(results):
            mfp = min(layer.medium.mfp[c] for layer in stack.layers)
            R, error = result.R[1:] / truth.entered(), result.R_error[1:] / truth.entered()
            seen = (edges[1:-1] >= RANGE_MFP[0] * mfp) & (edges[2:] <= RANGE_MFP[1] * mfp) & (R > 0) & (error < KNOWN * R)
            if not seen.any():
                raise InputError(f"{photons} photons leave no ring of {stack.name} known to {100 * KNOWN:g} %; expected more photons")
            area, miss = np.diff(edges[1:] ** 2)[seen], means[seen, c] - R[seen]
            known, deviation = result.diffuse_reflectance / truth.entered(), result.diffuse_reflectance_error / truth.entered()
            out.append(Verdict(
                stack.name, name, CHANNELS[c], float(stack.layers[0].medium.albedo_prime[c]), known, deviation, float(total[c]),
                100 * (float(total[c]) / known - 1), 100 * float(np.abs(miss / R[seen]).mean()),
                100 * float(np.sqrt((area * miss**2).sum() / (area * R[seen] ** 2).sum())), int(seen.sum())))
    return out


def to_csv(verdicts: list[Verdict]) -> str:
    """One row a material, model and channel."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(f.name for f in fields(Verdict)), "verdict"])
    for verdict in verdicts:
        writer.writerow([*(f"{v:.6g}" if isinstance(v, float) else v for v in astuple(verdict)), verdict.words])
    return out.getvalue()


def to_markdown(verdicts: list[Verdict]) -> str:
    """One row a material and model: errors of the total and of the curve, R / G / B, and the worst verdict."""
    order = ("good", "fair", "poor", "bad")
    lines = ["| material | model | total, error in % (R / G / B) | curve, mean error in % (R / G / B) | verdict |", "|---|---|---|---|---|"]
    keys = dict.fromkeys((v.material, v.model) for v in verdicts)
    for material, model in keys:
        rows = [v for v in verdicts if (v.material, v.model) == (material, model)]
        words = sorted({v.words for v in rows}, key=order.index)
        lines.append(f"| {material} | {model} | {' / '.join(f'{v.total_error:+.1f}' for v in rows)} | "
                     f"{' / '.join(f'{v.curve_error:.1f}' for v in rows)} | {words[0] if len(words) == 1 else f'{words[0]} to {words[-1]}'} |")
    return "\n".join(lines) + "\n"


def judge_presets(names=MATERIALS, photons: int = 1_000_000, seed: int = 0) -> list[Verdict]:
    """The table for several presets."""
    return [verdict for name in names for verdict in judge(preset(name), photons, seed)]
