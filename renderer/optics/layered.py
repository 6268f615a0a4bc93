"""Any number of layers: multipoles joined in frequency space (Kubelka and Munk), Donner and Jensen
2005.

Two ways that must agree: a two-dimensional FFT of tabulated profiles, as in Rohat sec. 5.1.2, and a
Hankel transform of the multipole's exact spectrum. A sign says from which side a layer is lit: +
from above, - from below.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.special import j0

from renderer.errors import InputError
from renderer.optics.medium import Stack
from renderer.optics.model import Profile, radii
from renderer.optics.multipole import Multipole

FFT_SIZE = 2048  # points a side at most
FARTHEST = 3e4  # radii that the Hankel transform takes, in the finest length of the stack


class Faces(NamedTuple):
    """Spectra of a layer lit from above (R, T) and from below (R_below, T_below); arrays of one
    shape.
    """

    R: np.ndarray
    T: np.ndarray
    R_below: np.ndarray
    T_below: np.ndarray


def join(a: Faces, b: Faces) -> Faces:
    """Layer a on top of layer b, per frequency.

    T12+ = T1+ T2+ / (1 - R1- R2+), R12+ = R1+ + T1+ R2+ T1- / (1 - R1- R2+), and mirrored. Vuletic
    eqs. 2.81 and 2.82 write one R1 and T1 for both sides, which holds only where the layer is the
    same from both.
    """
    echo = 1 - a.R_below * b.R
    return Faces(
        a.R + a.T * b.R * a.T_below / echo,
        a.T * b.T / echo,
        b.R_below + b.T_below * a.R_below * b.T / echo,
        b.T_below * a.T_below / echo,
    )


def _multipoles(stack: Stack) -> list[tuple[Multipole, Multipole]]:
    """Each layer between its neighbours' indices, lit from above and from below."""
    index = [stack.n_above, *(layer.medium.eta for layer in stack.layers), stack.n_below]
    out = []
    for i, layer in enumerate(stack.layers):
        one = Stack((layer,), index[i], index[i + 2], roughness=stack.roughness if i == 0 else 0.0)
        out.append((Multipole(one), Multipole(one.flipped())))
    return out


def hankel(
    spectra: Callable[[np.ndarray], np.ndarray], r_mm: np.ndarray, finest_mm: float
) -> np.ndarray:
    """f(r) = (1 / 2 pi) int f(k) J0(k r) k dk, radii of one octave at a time: (N, S).

    spectra: k (K, 1) in 1/mm -> (K, S); finest_mm: the least depth of a source, whose spectrum
    falls as exp(-k z).
    """
    octave = np.floor(np.log2(np.maximum(r_mm / finest_mm, 1)))
    parts = {each: _octave(spectra, r_mm[octave == each], finest_mm) for each in np.unique(octave)}
    out = np.empty((len(r_mm), next(iter(parts.values())).shape[1]))
    for each, values in parts.items():
        out[octave == each] = values
    return out


def _octave(spectra: Callable, r: np.ndarray, finest_mm: float) -> np.ndarray:
    """By panels of Gauss and Legendre that J0 of the largest radius crosses in three periods."""
    k_max = 40 / finest_mm
    panels = max(int(np.ceil(k_max * r.max() / (6 * np.pi))), 20)
    # Finer towards k = 0, where weak absorption bends the spectrum.
    edges = k_max * np.linspace(0, 1, panels + 1)
    edges = np.unique(np.concatenate([edges, edges[1] * np.geomspace(1e-4, 1, 24)]))
    t, w = np.polynomial.legendre.leggauss(24)
    half = 0.5 * np.diff(edges)
    k = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * t).ravel()
    w = (half[:, None] * w).ravel()
    weighted = spectra(k[:, None]) * (w * k / (2 * np.pi))[:, None]
    parts = np.array_split(r, max(len(r) * len(k) // 4_000_000, 1))
    return np.concatenate([j0(np.outer(part, k)) @ weighted for part in parts if len(part)])


@dataclass(frozen=True)
class Layered(Profile):
    """R_d(r) and T_d(r) of a stack.

    method: "hankel" (exact spectra, any radius) or "fft" (tabulated profiles on a grid).
    """

    method: str = "hankel"

    name: ClassVar[str] = "layered"
    paper: ClassVar[str] = "Donner and Jensen 2005"
    knows_roughness: ClassVar[bool] = True
    layers: ClassVar[int] = 0

    def __post_init__(self):
        super().__post_init__()
        if self.method not in ("hankel", "fft"):
            raise InputError(f"method is {self.method!r}; expected 'hankel' or 'fft'")
        _multipoles(self.stack)

    def spectrum(self, k) -> Faces:
        """Exact spectra of the whole stack at angular frequency k, 1/mm: (..., 1) or scalar ->
        (..., C).
        """
        whole = None
        for above, below in _multipoles(self.stack):
            faces = Faces(
                *above.spectrum(k),
                *(below.spectrum(k) if np.isfinite(above.thickness_mm) else (0.0, 0.0)),
            )
            whole = faces if whole is None else join(whole, faces)
        return whole

    def totals(self):
        faces = self.spectrum(0.0)
        return faces.R, faces.T

    def reflectance(self, r_mm):
        return self._profiles(r_mm)[0]

    def transmittance(self, r_mm):
        return self._profiles(r_mm)[1]

    def _profiles(self, r_mm) -> tuple[np.ndarray, np.ndarray]:
        return self._hankel(r_mm) if self.method == "hankel" else self._fft(r_mm)

    def finest_mm(self) -> float:
        """The shortest distance from a first source to a face."""
        out = []
        for layer in self.stack.layers:
            mfp = layer.medium.mfp
            out += [mfp.min()] + (
                [(layer.thickness_mm - mfp).min()] if np.isfinite(layer.thickness_mm) else []
            )
        return float(min(out))

    def _hankel(self, r_mm) -> tuple[np.ndarray, np.ndarray]:
        r = radii(r_mm)[:, 0]
        finest = self.finest_mm()
        if r.max() > FARTHEST * finest:
            raise InputError(
                f"{self.name}: a radius of {r.max():.3g} mm is too far for layers as fine as "
                f"{finest:.3g} mm; expected at most {FARTHEST * finest:.3g} mm"
            )

        def spectra(k: np.ndarray) -> np.ndarray:
            faces = self.spectrum(k)
            return np.concatenate([faces.R, np.broadcast_to(faces.T, faces.R.shape)], axis=1)

        out = hankel(spectra, r, finest)
        return out[:, : self.stack.channels], out[:, self.stack.channels :]

    def grid(
        self, size: int = FFT_SIZE, spacing_mm: float | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """R_d and T_d along a row of the FFT grid: radii (size / 4,) and (size / 4, C) each.

        Profiles are tabulated on a size x size grid that holds twice the support (no wrap), times
        spacing^2 a convolution, which Vuletic eqs. 2.77 f. and Rohat sec. 5.1.2 leave out.
        """
        delta = spacing_mm or self.finest_mm() / 5
        x = delta * np.minimum(np.arange(size), size - np.arange(size))
        radius = np.hypot(x[: size // 2 + 1, None], x[None, : size // 2 + 1])
        # Each profile is evaluated along a radius once and looked up; cubic in r^2 near the peak.
        from scipy.interpolate import CubicSpline

        table = np.concatenate([[0], np.geomspace(delta / 8, radius.max() * 1.001, 1200)])
        reflect = np.concatenate([np.arange(size // 2 + 1), np.arange(size // 2 - 1, 0, -1)])

        def transform(values):
            quarter = CubicSpline(table, values)(radius)
            return np.fft.rfft2(quarter[np.ix_(reflect, reflect)]).real * delta**2

        R, T = [], []
        pairs = [
            (
                a,
                (a.reflectance(table), a.transmittance(table)),
                (b.reflectance(table), b.transmittance(table))
                if np.isfinite(a.thickness_mm)
                else None,
            )
            for a, b in _multipoles(self.stack)
        ]
        for c in range(self.stack.channels):
            whole = None
            for _, down, up in pairs:
                faces = Faces(
                    transform(down[0][:, c]),
                    transform(down[1][:, c]),
                    *((transform(up[0][:, c]), transform(up[1][:, c])) if up else (0.0, 0.0)),
                )
                whole = faces if whole is None else join(whole, faces)
            for out, spectrum in ((R, whole.R), (T, whole.T)):
                out.append(
                    np.fft.irfft2(np.broadcast_to(spectrum, (size, size // 2 + 1)), s=(size, size))[
                        0, : size // 4
                    ]
                    / delta**2
                )
        return x[: size // 4], np.stack(R, axis=-1), np.stack(T, axis=-1)

    def _fft(self, r_mm) -> tuple[np.ndarray, np.ndarray]:
        from scipy.interpolate import CubicSpline

        r = radii(r_mm)[:, 0]
        x, R, T = self.grid()
        if r.max() > x[-1]:
            raise InputError(
                f"the FFT's grid ends at {x[-1]:.3g} mm, asked for {r.max():.3g} mm; expected "
                "smaller radii or the Hankel transform"
            )
        return CubicSpline(x, R)(r), CubicSpline(x, T)(r)
