"""Every model against Monte Carlo: totals and curves of a few materials."""

from __future__ import annotations

import csv
import io
from dataclasses import astuple, dataclass, fields

import numpy as np

from renderer.errors import InputError
from renderer.optics import models, single
from renderer.optics.medium import Stack, preset
from renderer.optics.photons import MonteCarlo
from renderer.optics.table import CHANNELS

MATERIALS = (
    "wholemilk",
    "marble",
    "skin1",
    "ketchup",
)  # from almost no absorption to almost nothing else
RANGE_MFP = (0.1, 10.0)  # radii that are judged, in mean free paths
KNOWN = 0.05  # relative standard error of a ring that is judged
# Models that leave out light which scatters once are judged with it, too.
WITHOUT_SINGLE = ("better_dipole", "quantized_diffusion")


@dataclass(frozen=True)
class Verdict:
    """One model, one material, one face ("R" or, of a slab, "T") and one channel.

    Light that passes a slab unscattered is not judged. Errors are relative; `total_error` and
    `curve_error` in per cent, the latter the mean of |R - R_MC| / R_MC over logarithmic rings,
    `radial_error` is E of eq. 3.1 over them.
    """

    material: str
    model: str
    face: str
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
        return (
            "good" if worst <= 10 else "fair" if worst <= 25 else "poor" if worst <= 60 else "bad"
        )


def _ring_means(reflectance, edges: np.ndarray) -> np.ndarray:
    """The mean of R over each ring, by Gauss and Legendre in r: (rings,) -> (rings, C)."""
    t, w = np.polynomial.legendre.leggauss(5)
    a, b = edges[:-1, None], edges[1:, None]
    r = 0.5 * (a + b) + 0.5 * (b - a) * t
    values = reflectance(r.ravel()).reshape(*r.shape, -1)
    area = (w * r * 0.5 * (b - a))[..., None]
    return (values * area).sum(1) / area.sum(1)


def _candidates(stack: Stack) -> list[tuple]:
    """(name, face, curve, total (C,)) of every model that can take the stack."""
    out, slab = [], np.isfinite(stack.thickness_mm)
    for name in models.MODELS:
        if name == "montecarlo":
            continue
        try:
            model = models.make(name, stack)
        except InputError:
            continue  # a model for another kind of stack
        R, T = model.totals()
        out.append((name, "R", model.reflectance, R))
        if slab and T is not None:
            out.append((name, "T", model.transmittance, T))
        if name in WITHOUT_SINGLE and not slab:
            once = lambda r, model=model: model.reflectance(r) + single.reflectance(stack, r)
            out.append((f"{name} + single", "R", once, R + single.total(stack)))
    return out


def judge(stack: Stack, photons: int, seed: int) -> list[Verdict]:
    """Every model of one material that can take it, face by face and channel by channel."""
    truth = MonteCarlo(stack, photons, seed)
    results, edges, entered = truth.results(), truth.edges_mm(), truth.entered()
    where = (
        f"{stack.name} {stack.thickness_mm:g} mm"
        if len(stack.layers) == 1 and np.isfinite(stack.thickness_mm)
        else stack.name
    )
    out = []
    for name, face, curve, total in _candidates(stack):
        means = _ring_means(curve, edges[1:])
        for c, result in enumerate(results):
            mfp = min(layer.medium.mfp[c] for layer in stack.layers)
            R, error = (getattr(result, key)[1:] / entered for key in (face, f"{face}_error"))
            seen = (
                (edges[1:-1] >= RANGE_MFP[0] * mfp)
                & (edges[2:] <= RANGE_MFP[1] * mfp)
                & (R > 0)
                & (error < KNOWN * R)
            )
            if not seen.any():
                raise InputError(
                    f"{photons} photons leave no ring of {where} known to {100 * KNOWN:g} %; "
                    "expected more photons"
                )
            area, miss = np.diff(edges[1:] ** 2)[seen], means[seen, c] - R[seen]
            if face == "R":
                known, deviation = (
                    result.diffuse_reflectance / entered,
                    result.diffuse_reflectance_error / entered,
                )
            else:
                known, deviation = (
                    (result.transmittance - result.ballistic) / entered,
                    result.transmittance_error / entered,
                )
            out.append(
                Verdict(
                    where,
                    name,
                    face,
                    CHANNELS[c],
                    float(stack.layers[0].medium.albedo_prime[c]),
                    known,
                    deviation,
                    float(total[c]),
                    100 * (float(total[c]) / known - 1),
                    100 * float(np.abs(miss / R[seen]).mean()),
                    100 * float(np.sqrt((area * miss**2).sum() / (area * R[seen] ** 2).sum())),
                    int(seen.sum()),
                )
            )
    return out


def to_csv(verdicts: list[Verdict]) -> str:
    """One row a material, model and channel."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(f.name for f in fields(Verdict)), "verdict"])
    for verdict in verdicts:
        writer.writerow(
            [*(f"{v:.6g}" if isinstance(v, float) else v for v in astuple(verdict)), verdict.words]
        )
    return out.getvalue()


def to_markdown(verdicts: list[Verdict]) -> str:
    """One row a material, model and face: errors of the total and of the curve, R / G / B, and the
    verdicts.
    """
    order = ("good", "fair", "poor", "bad")
    lines = [
        (
            "| material | model | total, error in % (R / G / B) | curve, mean error in % (R / G "
            "/ B) | verdict |"
        ),
        "|---|---|---|---|---|",
    ]
    for material, model, face in dict.fromkeys((v.material, v.model, v.face) for v in verdicts):
        rows = [v for v in verdicts if (v.material, v.model, v.face) == (material, model, face)]
        words = sorted({v.words for v in rows}, key=order.index)
        lines.append(
            f"| {material} | {model}{', T' if face == 'T' else ''} | "
            f"{' / '.join(f'{v.total_error:+.1f}' for v in rows)} | "
            f"{' / '.join(f'{v.curve_error:.1f}' for v in rows)} | "
            f"{words[0] if len(words) == 1 else f'{words[0]} to {words[-1]}'} |"
        )
    return "\n".join(lines) + "\n"


def judge_presets(
    names=MATERIALS, thickness_mm: float | None = None, photons: int = 1_000_000, seed: int = 0
) -> list[Verdict]:
    """The table for several presets, half-spaces or slabs of one thickness."""
    out = []
    for name in names:
        stack = preset(name)
        if thickness_mm is not None:
            if len(stack.layers) > 1:
                raise InputError(f"{name} has layers of its own; expected no thickness with it")
            stack = Stack.of(stack.layers[0].medium, thickness_mm)
        out += judge(stack, photons, seed)
    return out
