"""The base of techniques that blur an atlas by a sum of Gaussians, each from the one before."""

from __future__ import annotations

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

    def filter(self, atlas: Atlas) -> gl.Texture:
        blurs, unblurred = self.blurs(self.fit(atlas.inputs.curve))
        taps, spacing, _ = self.axis_taps()
        common = {
            "stop": int(self.seams == "stop"),
            "even_mm": atlas.mean_texel_mm() if self.stretch == "none" else 0.0,
            "taps": np.pad(taps, (0, MOST_TAPS - len(taps))),
            "spacing": spacing,
            "reach": len(taps) // 2,
        }
        row, blurred, total = atlas.target(), atlas.target(), atlas.target()
        atlas.draw(total, START, unblurred=unblurred, samples=0.0)
        source, shader = atlas.light, "techniques/atlas_gaussian.glsl"
        for sigma, weight in blurs:
            own = {**common, "sigma": sigma}
            atlas.draw(row, shader, source=source, axis=(1.0, 0.0), **own)
            atlas.draw(blurred, shader, source=row.textures[0], axis=(0.0, 1.0), **own)
            source = blurred.textures[0]
            atlas.draw(total, ADD, blend="add", source=source, weight=weight)
        return total.textures[0]
