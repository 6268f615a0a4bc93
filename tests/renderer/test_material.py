"""A material's maps, and procedural skin over them."""

import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.errors import InputError as MaterialError
from stimuli import scenes
from stimuli.errors import InputError

GREY = 0.2158605  # linear, of 128 in sRGB


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    """One colour, a rise along u in 16 bits, half of the specular light."""
    folder = tmp_path_factory.mktemp("maps")
    files = {
        "albedo": np.full((8, 8, 3), 128, np.uint8),
        "height": np.tile(np.linspace(0, 65535, 1024).astype(np.uint16), (8, 1)),
        "specular": np.full((8, 8), 128, np.uint8),
    }
    for name, texels in files.items():
        Image.fromarray(texels).save(folder / f"{name}.png")
    return {name: str(folder / f"{name}.png") for name in files}


def slab(**material):
    """A slab that faces camera and lamp."""
    table = {
        "objects": {"slab": {"shape": "slab", "size_mm": [24.0, 24.0, 10.0]}},
        "materials": {"slab": {"kind": "skin", "wrinkles": 1.0, **material}},
        "lights": {"sun": {"direction": [0.0, 0.0, 1.0], "irradiance": [2.0, 2.0, 2.0]}},
        "camera": {"framing": "slab", "height_mm": 12.0, "angle": "front"},
    }
    return scenes.stage(scenes.read_scene(table)).graph


def shaded(**material):
    """Irradiance, specular light and albedo (H, W, 3) of the slab's face."""
    graph = slab(**material)
    with (
        renderer.Renderer(graph, (48, 48), 1, rays=8, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        return [texture.read()[..., :3].copy() for texture in frame.surface.textures[:3]]


def test_an_albedo_map_is_shown_and_skin_lies_over_it_as_far_as_it_says(maps):
    mapped = shaded(albedo_map=maps["albedo"], map_layers=[])
    np.testing.assert_allclose(mapped[2], GREY, rtol=2e-3)
    np.testing.assert_allclose(mapped[0], 2.0, rtol=1e-3)  # flat: no relief
    masks = {"pores": 1.0}
    freckled = shaded(
        albedo_map=maps["albedo"],
        map_layers=["freckles"],
        masks=masks,
        freckles=0.5,
        freckle_share=1.0,
    )
    assert freckled[2].min() < 0.7 * GREY and np.isclose(freckled[2], GREY, rtol=2e-3).mean() > 0.5
    np.testing.assert_allclose(freckled[0], 2.0, rtol=1e-3)
    rough = shaded(albedo_map=maps["albedo"], map_layers=["relief"], masks=masks)
    assert rough[0].std() > 5e-4 and 0.75 * GREY < rough[2].min() < 0.99 * GREY  # pores are darker
    np.testing.assert_array_less(rough[2], GREY * 1.002)


def test_a_height_map_tilts_the_surface_by_its_slope(maps):
    part = next(iter(slab(masks={}).meshes)).primitives[0]
    front = part.normals[:, 2] > 0.99
    per_mm = float(np.ptp(part.texcoord_0[front, 0])) / 24.0  # u runs along a side
    flat = {"albedo_map": maps["albedo"], "map_layers": []}
    irradiance, _, _ = shaded(**flat, height_map=maps["height"], height_mm=0.75 / per_mm)
    np.testing.assert_allclose(irradiance, 2.0 / np.hypot(1.0, 0.75), rtol=5e-3)


def test_a_specular_map_scales_specular_light(maps):
    flat = {"albedo_map": maps["albedo"], "map_layers": []}
    whole, half = (shaded(**flat, **own)[1] for own in ({}, {"specular_map": maps["specular"]}))
    assert whole.min() > 0
    np.testing.assert_allclose(half / whole, 128 / 255, rtol=3e-3)


@pytest.mark.parametrize(
    ("material", "words"),
    [
        ({"map_layers": ["warts"]}, "materials.slab.map_layers has 'warts'; expected of relief,"),
        ({"masks": {"pores": 2}}, "materials.slab.masks.pores is 2; expected 0 to 1"),
        ({"lid_lines_mm": [1, 2, 2, 3]}, "expected places that rise"),
        ({"height_map": 3}, "materials.slab.height_map is 3; expected a file"),
        ({"albedo_map": "gone.png"}, "no such file; expected an image for albedo_map"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(material, words):
    with pytest.raises((MaterialError, InputError)) as caught:
        slab(**material)
    assert words in str(caught.value) and "\n" not in str(caught.value)
