"""The base of techniques that blur an atlas by a sum of Gaussians, each from the one before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from renderer import gl
from renderer.techniques.atlas import Atlas, AtlasTechnique
from renderer.techniques.cascade import ADD, START, SumOfGaussians

#: Of a blur along an axis; techniques/atlas_gaussian.glsl has room for as many.
MOST_TAPS = 49


@dataclass(frozen=True)
class AtlasGaussians(SumOfGaussians, AtlasTechnique):
    """Blurs along u, then v. A technique is its parameters, `terms` among them."""

    def taps(self) -> int:
        return self.reads()

    def cascade(
        self, atlas: Atlas, source: gl.Texture, sigmas: Sequence[float]
    ) -> Iterator[gl.Texture]:
        """A texture blurred by each sigma (mm) after the one before.

        What it yields is good until the next but one: two targets are drawn in turn.
        """
        taps, spacing, _ = self.axis_taps()
        common = {
            "stop": int(self.seams == "stop"),
            "even_mm": atlas.mean_texel_mm() if self.stretch == "none" else 0.0,
            "taps": np.pad(taps, (0, MOST_TAPS - len(taps))),
            "spacing": spacing,
            "reach": len(taps) // 2,
        }
        row, *turns = (atlas.target() for _ in range(1 + min(2, len(sigmas))))
        stretched = [atlas.target(), atlas.target()] if self.stretch == "blurred" else []
        texel_mm = atlas.given["texel_mm"]

        def blur(source: gl.Texture, into: gl.Target, sigma: float) -> gl.Texture:
            for axis, target in (((1.0, 0.0), row), ((0.0, 1.0), into)):
                own = {"source": source, "axis": axis, "sigma": sigma, "texel_mm": texel_mm}
                atlas.draw(target, "techniques/atlas_gaussian.glsl", **own, **common)
                source = target.textures[0]
            return source

        for k, sigma in enumerate(sigmas):
            source = blur(source, turns[k % 2], sigma)
            if stretched:
                texel_mm = blur(texel_mm, stretched[k % 2], sigma)
            yield source

    def filter(self, atlas: Atlas) -> gl.Texture:
        blurs, unblurred = self.blurs(self.fit(atlas.inputs.curve))
        sigmas, weights = zip(*blurs, strict=True)
        total = atlas.target()
        atlas.draw(total, START, unblurred=unblurred, samples=0.0)
        for source, weight in zip(self.cascade(atlas, atlas.light, sigmas), weights, strict=True):
            atlas.draw(total, ADD, blend="add", source=source, weight=weight)
        return total.textures[0]
