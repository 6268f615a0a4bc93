"""Tables of what slabs send back and let through, over distance and thickness, for splats.

Rohat 2012, sec. 4.3, 5.1.2, after Donner and Jensen 2005, doi:10.1145/1073204.1073308: R(r, d) and
T(r, d) of the multipole, looked up by the thickness of a part. Two sources of them: a dipole that
was fitted to a medium's curve, with the images of its two sources between two faces; and a stack of
layers by their own coefficients, joined in frequency space (coatings lie on both faces of a part).
Both are multiples of what a thick part sends back.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from renderer.optics.dipole import pole
from renderer.optics.fits import DipoleFit
from renderer.optics.layered import Layered, hankel
from renderer.optics.medium import Stack
from renderer.optics.multipole import image_sum
from renderer.optics.transmittance import part

IMAGES = 24  # pairs on each side, of the fitted multipole

#: Totals by thickness and densities by radius: (D,) mm -> (D, C) twice; ((D,), (N,)) -> (D, N, C).
Totals = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
Densities = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Slabs:
    """Slabs of one medium, as multiples of what a thick part of it sends back.

    totals(thickness_mm (D,)): R and T of a slab, (D, C) each. densities(thickness_mm (D,), r_mm
    (N,)): R and T a mm2 at a distance along the face, (D, N, C) each; their integrals over the
    plane are the totals. Thinner slabs than least_mm (C,) count as that thick. endless: whether R
    and T depend on thickness, which they do not where the medium is a sheet itself.
    """

    totals: Totals
    densities: Densities
    least_mm: np.ndarray
    endless: bool = True

    def farthest(self, share: float) -> float:
        """The thickness beyond which no channel lets more than a share through, mm."""
        d = np.geomspace(float(self.least_mm.min()), 1e4 * float(self.least_mm.max()), 400)
        seen = (self.totals(d)[1] > share).any(axis=1)
        return float(d[min(np.flatnonzero(seen)[-1] + 1, len(d) - 1)]) if seen.any() else d[0]


def fitted(fit: DipoleFit, thinnest: float, nearest_mm: tuple[float, float] = (0.0, 0.0)) -> Slabs:
    """Slabs of the medium that a dipole was fitted to: its sources and their images.

    z_b = (z_v - z_r) / 2 = 2 A D is that of both faces, z_r is the mean free path; an endless slab
    is the dipole itself. thinnest: in mean free paths, above 1, below which the first source would
    lie under the far face; nearest_mm: no source is seen as nearer to the lit face, and to the far
    one, than that, so that what it sends is spread wider along the face; totals stay.
    """
    l, z_b, sigma = fit.real_mm, (fit.virtual_mm - fit.real_mm) / 2, fit.sigma_tr
    whole = 0.5 * (np.exp(-sigma * l) + np.exp(-sigma * fit.virtual_mm))

    def geometry(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        d = np.maximum(np.asarray(d, float)[:, None], thinnest * l)
        return d, d + 2 * z_b

    def totals(thickness_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        d, P = geometry(thickness_mm)
        R = image_sum(l, sigma, P) - image_sum(-l - 2 * z_b, sigma, P)
        T = image_sum(d - l, sigma, P) - image_sum(d + l + 2 * z_b, sigma, P)
        return 0.5 * R / whole, 0.5 * T / whole

    def densities(thickness_mm: np.ndarray, r_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        d, P = geometry(thickness_mm)
        r = np.asarray(r_mm, float)[None, :, None]
        d, P = d[:, None], P[:, None]
        R, T = np.zeros((2, len(thickness_mm), len(r_mm), len(l)))

        def source(z: np.ndarray, more: np.ndarray) -> np.ndarray:
            return np.exp(sigma * more) * pole(r, np.sign(z) * (np.abs(z) + more), sigma)

        back, on = np.maximum(nearest_mm[0] - l, 0), np.maximum(nearest_mm[1] - (d - l), 0)

        for i in range(-IMAGES, IMAGES + 1):
            z_r, z_v = 2 * i * P + l, 2 * i * P - l - 2 * z_b
            R += source(z_r, back) - source(z_v, back)
            T += source(d - z_r, on) - source(d - z_v, on)
        return np.maximum(R, 0) / whole, np.maximum(T, 0) / whole

    return Slabs(totals, densities, thinnest * l)


def layered(stack: Stack, thinnest: float, nearest_mm: tuple[float, float] = (0.0, 0.0)) -> Slabs:
    """Slabs of a stack of layers, by their coefficients: the combined profiles of coatings and what
    lies below.

    thinnest: of the last layer, in its mean free paths; nearest_mm: as in `fitted`, by the first
    layer's mean free path and the last one's sigma_tr.
    """
    first, last = stack.layers[0].medium, stack.layers[-1].medium
    endless = bool(np.isinf(stack.thickness_mm))
    coated = 2 * sum(layer.thickness_mm for layer in stack.layers[:-1])
    least = np.full(stack.channels, coated + thinnest * float(last.mfp.max()))
    whole = Layered(stack).totals()[0]

    def slab(d: float) -> Layered:
        return Layered(part(stack, max(float(d), float(least[0]))))

    def totals(thickness_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = [slab(d).totals() for d in np.atleast_1d(thickness_mm)]
        R, T = (np.stack([np.broadcast_to(b[k], whole.shape) for b in both]) for k in (0, 1))
        return R / whole, T / whole

    def densities(thickness_mm: np.ndarray, r_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        slabs = [slab(d) for d in thickness_mm]
        finest = min(one.finest_mm() for one in slabs)

        def spectra(k: np.ndarray) -> np.ndarray:
            fall = np.sqrt(k**2 + last.sigma_tr**2) - last.sigma_tr
            shape, columns = (len(k), stack.channels), []
            faces = [one.spectrum(k) for one in slabs]
            wider = np.exp(-fall * np.maximum(nearest_mm[0] - first.mfp, 0))
            columns += [np.broadcast_to(f.R * wider, shape) for f in faces]
            for one, f in zip(slabs, faces, strict=True):
                above = np.maximum(nearest_mm[1] - (one.thickness_mm - first.mfp), 0)
                columns.append(np.broadcast_to(f.T * np.exp(-fall * above), shape))
            return np.concatenate(columns, axis=1)

        flat = hankel(spectra, np.asarray(r_mm, float), finest)
        both = flat.reshape(len(r_mm), 2, len(slabs), stack.channels).transpose(1, 2, 0, 3)
        return np.maximum(both[0], 0) / whole, np.maximum(both[1], 0) / whole

    return Slabs(totals, densities, least, endless)
