"""Local illumination models: light from one direction to radiance in another.

n, l, v (N, 3) are unit vectors at a surface: its normal, towards the lamp, towards the viewer; a
lobe is (N,). The radiance that an irradiance E (of a surface that faces the lamp) makes is

    Lambert      E / pi k_d (n . l)
    Phong        E / pi (k_d (n . l) + k_s (r . v)^exponent), r = 2 (n . l) n - l
    Blinn-Phong  E / pi (k_d (n . l) + k_s (n . h)^exponent), h = (l + v) / |l + v|
    Cook-Torrance  E (k_d (n . l) / pi + k_s F G D / (4 (n . v)))

so that the texts' light intensity I is E / pi: a white matt surface that faces the lamp has that
radiance. As BRDFs, Phong's and Blinn's terms are divided by (n . l): neither is reciprocal, nor do
they keep energy; the texts intend it so. Ambient light adds k_a I_a, emission adds itself; a lamp's
three constants of attenuation are renderer.scene.lights.PointLight's. renderer/shaders/models.glsl
has the same lobes.

Phong 1975, doi:10.1145/360825.360839; Blinn 1977, doi:10.1145/563858.563893; Cook and Torrance
1982, doi:10.1145/357290.357293.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from renderer.scene.material import MODELS, Material, Shading


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Row by row: (N, 3), (N, 3) -> (N,)."""
    return np.einsum("ni,ni->n", a, b)


def unit(a: np.ndarray) -> np.ndarray:
    """Rows of length 1 (N, 3)."""
    return a / np.maximum(np.linalg.norm(a, axis=1, keepdims=True), 1e-30)


def mirrored(d: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Directions (N, 3) that travel along d after a mirror of normal n."""
    return d - 2 * dot(d, n)[:, None] * n


def refracted(d: np.ndarray, n: np.ndarray, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Snell's law: directions (N, 3), and where they are real (N,), else total reflection.

    d travels against n; eta: the index on the side of n over that behind it.
    """
    c = -dot(d, n)
    k = 1 - eta**2 * (1 - c**2)
    through = eta[:, None] * d + (eta * c - np.sqrt(np.maximum(k, 0)))[:, None] * n
    return unit(through), k > 0


def phong(n, l, v, exponent) -> np.ndarray:
    """(r . v)^exponent."""
    return np.maximum(dot(mirrored(-l, n), v), 0) ** exponent


def blinn_phong(n, l, v, exponent) -> np.ndarray:
    """(n . h)^exponent."""
    return np.maximum(dot(n, unit(l + v)), 0) ** exponent


def beckmann(cosine: np.ndarray, m) -> np.ndarray:
    """D of slopes m, cosine = n . h: int D cosine dw = 1.

    Cook and Torrance, and texts after them, leave the 1 / pi out here.
    """
    c2 = np.clip(cosine, 1e-4, 1) ** 2
    return np.exp((c2 - 1) / (m**2 * c2)) / (np.pi * m**2 * c2**2)


def fresnel(cosine: np.ndarray, f0) -> np.ndarray:
    """F of a dielectric whose reflectance at normal incidence is f0, exact (Cook and Torrance, the
    appendix), at the cosine of the angle to the half vector.
    """
    s = np.minimum(np.sqrt(f0), 0.999)
    eta = (1 + s) / (1 - s)
    g = np.sqrt(np.maximum(eta**2 + cosine**2 - 1, 0))
    a = (g - cosine) / (g + cosine)
    b = (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return 0.5 * a**2 * (1 + b**2)


def shadowing(nh, nv, nl, vh) -> np.ndarray:
    """G of V-shaped grooves: min(1, 2 nh nv / vh, 2 nh nl / vh)."""
    return np.minimum(1, 2 * nh * np.minimum(nv, nl) / vh)


def cook_torrance(n, l, v, m, f0) -> np.ndarray:
    """F G D / (4 (n . v)), the specular radiance of unit irradiance.

    Texts print (n . l) / (n . v) F G D, whose 1 / 4 is lost and whose (n . l) is the lamp's own.
    """
    h = unit(l + v)
    nh, nv = np.clip(dot(n, h), 1e-4, 1), np.maximum(dot(n, v), 1e-3)
    nl, vh = np.maximum(dot(n, l), 0), np.maximum(dot(v, h), 1e-4)
    return fresnel(vh, f0) * shadowing(nh, nv, nl, vh) * beckmann(nh, m) / (4 * nv)


@dataclass(frozen=True)
class Coefficients:
    """A material's numbers at N points (or of N materials): colours (N, 3), the rest (N,).

    model: places in MODELS.
    """

    model: np.ndarray
    albedo: np.ndarray
    ambient: np.ndarray
    k_s: np.ndarray
    exponent: np.ndarray
    roughness: np.ndarray
    f0: np.ndarray
    emission: np.ndarray
    k_r: np.ndarray
    k_t: np.ndarray
    index: np.ndarray

    @classmethod
    def of(cls, materials: Sequence[Material]) -> Self:
        """Of materials; one of another kind than "shading" is taken by `opaque`."""
        shaded = [opaque(material) for material in materials]
        values = {
            name: np.array([getattr(s, name) for s in shaded], float)
            for name in cls.__dataclass_fields__
            if name != "model"
        }
        return cls(model=np.array([MODELS.index(s.model) for s in shaded]), **values)

    def at(self, places: np.ndarray, albedo: np.ndarray | None = None) -> Self:
        """Those at places (N,), with an albedo (N, 3) that the surface has of its own there."""
        taken = {name: getattr(self, name)[places] for name in self.__dataclass_fields__}
        if albedo is not None:
            same = (taken["ambient"] == taken["albedo"]).all(axis=1, keepdims=True)
            taken["ambient"] = np.where(same, albedo, taken["ambient"])
            taken["albedo"] = albedo
        return type(self)(**taken)


def opaque(material: Material) -> Shading:
    """A material of another kind as Cook and Torrance's: its albedo, roughness, f0 and highlight.

    What lies below its surface, and its relief, are left out.
    """
    if isinstance(material, Shading):
        return material
    return Shading(
        model="cook_torrance",
        albedo=material.albedo,
        roughness=material.roughness,
        f0=material.f0,
        k_s=(material.specular,) * 3,
    )


def reflected(
    at: Coefficients, n: np.ndarray, l: np.ndarray, v: np.ndarray, irradiance: np.ndarray
) -> np.ndarray:
    """Radiance (N, 3) of light from l: irradiance (N, 3) is that on a surface that faces it."""
    nl = dot(n, l)
    lobe = np.zeros(len(n))
    for number, name in enumerate(MODELS):
        here = np.flatnonzero((at.model == number) & (nl > 0))
        if not here.size or name == "lambert":
            continue
        vectors = n[here], l[here], v[here]
        if name == "cook_torrance":
            lobe[here] = np.pi * cook_torrance(*vectors, at.roughness[here], at.f0[here])
        else:
            glossy = phong if name == "phong" else blinn_phong
            lobe[here] = glossy(*vectors, at.exponent[here])
    total = at.albedo * np.maximum(nl, 0)[:, None] + at.k_s * lobe[:, None]
    return total * irradiance / np.pi
