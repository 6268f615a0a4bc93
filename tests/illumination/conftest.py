"""A ball by each local model, and a box for rays."""

import pytest

from stimuli import scenes


@pytest.fixture
def ball():
    """ball(**material) -> the graph of a ball under a sun and a lamp with three constants."""

    def made(**material):
        table = {
            "objects": {"ball": {"shape": "sphere", "radius_mm": 40.0}},
            "materials": {"ball": {"kind": "shading", **material}},
            "lights": {
                "sun": {"direction": [0.5, 0.4, 0.8], "irradiance": [3, 2, 2], "shadow": False},
                "lamp": {
                    "kind": "point",
                    "position_mm": [-80, 60, 90],
                    "irradiance": [0.3, 0.3, 0.5],
                    "attenuation": [0.1, 1.0, 2.0],
                    "shadow": False,
                },
            },
            "environment": {"ambient": [0.2, 0.3, 0.1]},
            "camera": {"framing": "ball", "height_mm": 100.0, "angle": "front"},
        }
        return scenes.stage(scenes.read_scene(table)).graph

    return made
