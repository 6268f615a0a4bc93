"""CONTRIBUTING's example of a technique is drawn as it stands there."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.special import erfc

from renderer.gl import program
from renderer.parameters import parameter
from renderer.techniques.screen import ScreenTechnique
from tests.renderer.slab import edge_response, scatter
from tests.renderer.test_techniques import SKIN

PAGE = Path(__file__).resolve().parents[2] / "CONTRIBUTING.md"


def example():
    """The class and the shader of the page."""
    text = PAGE.read_text().split("(both files whole):")[1].split("## Add a person")[0]
    text = re.sub(r"^    ", "", text, flags=re.M)
    python, shader = text.split("#include", 1)
    names = {
        "dataclass": dataclass,
        "ClassVar": ClassVar,
        "ScreenTechnique": ScreenTechnique,
        "parameter": parameter,
        "np": np,
        "erfc": erfc,
        "__name__": __name__,
    }
    exec(python, names)
    return names["Disc"], "#include" + shader


def test_the_example_is_a_technique(drawing, patch, tmp_path, monkeypatch):
    Disc, shader = example()
    folder = tmp_path / "renderer"
    (folder / "techniques").mkdir(parents=True)
    (folder / "techniques" / "disc.glsl").write_text(shader)
    (folder / "shaders").symlink_to(program.ROOT / "shaders")
    monkeypatch.setattr(program, "ROOT", folder)
    technique = Disc()
    assert technique.fit_error(SKIN).shape == (3,)
    light = np.tile(np.array([3.1, 1.7, 0.4]), (360, 640, 1))
    out, count = scatter(technique, patch(light))
    np.testing.assert_allclose(out, light, rtol=1e-3)
    assert (count[..., 0] == 16).all()
    u, got, _ = edge_response(drawing, technique, SKIN, 9000.0, 480.0)
    assert np.abs(got - technique.edge(SKIN, u)).max() < 0.03
