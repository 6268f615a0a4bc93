"""Procedural skin as the shader draws it: its colour is the model's, its highlights keep energy,
stay the same at every distance and do not sparkle.
"""

import dataclasses

import numpy as np
import pytest

import renderer
from renderer.errors import InputError
from renderer.optics import media
from renderer.optics import skin as spectral
from renderer.optics.transmittance import Translucency
from renderer.scene.material import Skin
from renderer.scene.picture import LUMA
from stimuli import scenes

EVEN = {
    "uneven": [0.0, 0.0],
    "mottling": 0.0,
    "freckles": 0.0,
    "moles": 0.0,
    "vessels": 0.0,
}
FLAT = {"pores": 0.0, "furrows": 0.0, "bumps": 0.0, "lip_folds": 0.0, "micro_mm": [0.0, 0.0]}


def shaded(material, height_mm=12.0, size=48, target=(0.0, 0.0, 0.0), **scene):
    """Specular light and albedo (H, W, 3) of a slab's face that looks at the camera."""
    table = {
        "objects": {"slab": {"shape": "slab", "size_mm": [24.0, 24.0, 10.0]}},
        "materials": {"slab": {"kind": "skin", **material}},
        "lights": {"sun": {"direction": [0.0, 0.0, 1.0], "irradiance": [2.0] * 3, "shadow": False}},
        "camera": {
            "framing": "slab",
            "height_mm": height_mm,
            "angle": "front",
            "target_mm": list(target),
        },
    }
    graph = scenes.stage(scenes.read_scene(scenes.merge(table, scene))).graph
    with (
        renderer.Renderer(graph, (size, size), 1, rays=8, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        return [texture.read()[..., :3].astype(float) for texture in frame.surface.textures[1:3]]


@pytest.mark.parametrize(
    "masks", [{}, {"flush": 0.8}, {"eyelid": 1.0}, {"lips": 1.0}, {"lips": 0.75, "flush": 0.3}]
)
def test_the_colour_is_the_spectral_models_and_what_light_bounces_off(masks):
    """The shader's look-up, the model itself and the mean that the bake takes are one."""
    skin = Skin(masks=masks, **{k: tuple(v) if isinstance(v, list) else v for k, v in EVEN.items()})
    row = np.array([[masks.get(name, 0.0) for name in renderer.scene.MASKS]])
    _, albedo = shaded({**EVEN, **FLAT, "masks": masks})
    noise = 0.004 if not masks.get("lips") else 0.1  # lips and flush keep some of their own
    noise = max(noise, 0.02 if masks.get("flush") else 0)
    expected = skin.mean_albedo(row)[0]
    np.testing.assert_allclose(albedo.mean(axis=(0, 1)), expected, rtol=noise)
    model = spectral.colour(skin.layers, *(value[0] for value in skin.pigments(row)))
    # only what dulls the lips is not of the model: it keeps their luminance to a few per cent
    pure = dataclasses.replace(skin, lip_haze=0.0).mean_albedo(row)[0]
    np.testing.assert_allclose(pure, model, rtol=0.02)
    np.testing.assert_allclose(expected @ LUMA, pure @ LUMA, rtol=0.02)
    assert (expected[0] < pure[0] and expected[2] > pure[2]) == ("lips" in masks)


def test_dark_lips_are_lighter_towards_the_seam_by_what_melanin_is_missing_there():
    masks, row = {"lips": 1.0}, np.array([[float(n == "lips") for n in renderer.scene.MASKS]])
    dark = {"melanin": 0.25, "lip_melanin": 0.8, "masks": masks}
    means = []
    for inner in (1.0, 0.25):
        own = {"lip_melanin_inner": inner, **dark}
        _, albedo = shaded({**EVEN, **FLAT, **own})
        means.append(albedo.mean(axis=(0, 1)))
        even = {k: tuple(v) if isinstance(v, list) else v for k, v in EVEN.items()}
        np.testing.assert_allclose(means[-1], Skin(**{**even, **own}).mean_albedo(row)[0], rtol=0.1)
    assert (means[1] > 1.3 * means[0]).all()


def test_no_more_light_is_sent_back_than_comes():
    """A perfect mirror in even light from everywhere, rough and smooth, with all its relief."""
    mirror = {"f0": 1.0, "f0_oily": 1.0, "masks": {"oil": 0.6, "pores": 0.5}}
    sky = {"lights": {"sun": False}, "environment": {"ambient": [1.0, 1.0, 1.0]}}
    specular, _ = shaded(mirror, **sky)
    assert 0.5 < specular.mean() < 1 and specular.max() < 1.005


def through(cartilage=0.0, ear=None, **skin):
    """Light (3,) that comes through the middle of a slab 3 mm thick, lit from behind, where an
    ear's middle lies at ear (3,) mm from it, or is nowhere.
    """
    skin = {"kind": "skin", "medium": "skin", "cartilage": cartilage, **skin}
    table = {
        "objects": {"slab": {"shape": "slab", "size_mm": [24.0, 24.0, 3.0]}},
        "materials": {"slab": skin},
        "lights": {"sun": {"direction": [0.0, 0.0, -1.0], "irradiance": [20.0] * 3}},
        "camera": {"framing": "slab", "height_mm": 6.0, "angle": "front"},
    }
    graph = scenes.stage(scenes.read_scene(table)).graph
    for node in graph.mesh_nodes:
        for primitive in node.mesh.primitives:
            middle = primitive.positions.mean(axis=0)
            primitive.landmarks = {} if ear is None else {"ear_l": middle + ear}
    with (
        renderer.Renderer(graph, (16, 16), 1, rays=8, shadow_map=128) as drawing,
        drawing.frame() as frame,
    ):
        return frame.transmitted(Translucency()).read()[..., :3].mean(axis=(0, 1))


def test_cartilage_stops_light_in_an_ear_but_not_in_its_lobe_nor_elsewhere():
    plain = through(0.6, None)
    assert plain[0] > 0.01
    np.testing.assert_allclose(through(0.6, np.array([0.0, -5.0, 0.0])), 0.4 * plain, rtol=0.02)
    np.testing.assert_allclose(through(0.0, np.array([0.0, -5.0, 0.0])), plain, rtol=0.01)
    np.testing.assert_allclose(through(0.6, np.array([0.0, 30.0, 0.0])), plain, rtol=0.01)


def test_a_nostrils_wing_stops_light_on_its_lining_but_not_on_skin():
    plain = through()
    lining = {"masks": {"inside": 0.4}}
    np.testing.assert_allclose(through(nose_wing=0.0, **lining), 0.6 * plain, rtol=0.01)
    np.testing.assert_allclose(through(nose_wing=0.9, **lining), 0.06 * plain, rtol=0.02)
    np.testing.assert_allclose(through(nose_wing=0.9), plain, rtol=0.01)


OILY = {"masks": {"oil": 0.7, "pores": 0.3}, "oil_patches": 0.0}


def test_skin_shines_alike_at_every_distance():
    """Relief that is seen, and the slopes that stand for it where a pixel covers many of them."""
    near, _ = shaded(OILY, 12.0, 192)  # 0.06 mm a pixel
    far, _ = shaded(OILY, 96.0, 48)  # 2 mm
    flat, _ = shaded({**OILY, **FLAT}, 12.0, 48)
    near, far, flat = near.mean(), far[22:26, 22:26].mean(), flat.mean()
    assert far == pytest.approx(near, rel=0.2) and flat > 1.3 * near


def test_nothing_sparkles():
    """A shift by a third of a pixel changes a pixel's highlight by a few hundredths."""
    still, moved = (shaded(OILY, 48.0, 48, (x, 0.0, 0.0))[0][16:32, 16:32] for x in (0.0, 1 / 3))
    assert still.mean() > 0.01
    assert np.sqrt(((moved - still) ** 2).mean()) < 0.12 * still.mean()


def test_a_skin_scatters_in_its_own_layers():
    """`medium = "person"`: the albedo of the medium is the one that is shown; darker skin lets
    light less far."""
    reach = []
    for melanin in (0.02, 0.3):
        table = {
            "objects": {"slab": {"shape": "slab", "size_mm": [24.0, 24.0, 10.0]}},
            "materials": {"slab": {"kind": "skin", "medium": "person", "melanin": melanin}},
            "environment": {"ambient": [1.0, 1.0, 1.0]},
        }
        scene = scenes.read_scene(table)
        part = next(iter(scenes.stage(scene).graph.meshes)).primitives[0]
        walked = media.curve(part.material.value.layered(), photons=20_000)
        shown = scene.materials["slab"].mean_albedo(part.masks[:1])[0]
        np.testing.assert_allclose(walked.albedo, shown, rtol=0.05)
        reach.append(walked.mean_radius())
    assert (reach[1] < 0.8 * reach[0]).all()


@pytest.mark.parametrize(
    ("material", "words"),
    [
        ({"kind": "skin", "thickness": 3.0}, "medium is 'person' with a thickness or coatings"),
        ({"kind": "plain"}, "medium is 'person'; expected one of skin"),
    ],
)
def test_only_a_whole_skin_has_a_medium_of_its_own(material, words):
    table = {"objects": {"ball": {"shape": "sphere"}}}
    with pytest.raises(InputError) as caught:
        scenes.read_scene({**table, "materials": {"ball": {**material, "medium": "person"}}})
    assert words in str(caught.value) and "\n" not in str(caught.value)


WIDE = {"height_mm": 24.0, "size": 160}  # 0.15 mm a pixel


def test_light_that_bounces_off_takes_uneven_skin_at_its_mean():
    """Spots, freckles and mottling are as much pigment as `pigments` reckons with."""
    for own in (
        {"freckles": 0.3, "freckle_share": 1.0, "spot_share": 0.0, "uneven": (0.0, 0.0)},
        {"freckles": 0.0, "spots": 0.3, "spot_share": 1.0, "red_share": 0.0, "uneven": (0.0, 0.0)},
        {"freckles": 0.0, "spot_share": 1.0, "red_spots": 0.2, "red_share": 1.0},
        {"mottling": 3.0, "freckles": 0.0, "spot_share": 0.0, "uneven": (0.0, 0.6)},
    ):
        values = {"moles": 0.0, "vessels": 0.0, "mottling": 0.0, **own}
        row = np.zeros((1, len(renderer.scene.MASKS)))
        _, albedo = shaded({**FLAT, **values}, **WIDE)
        expected = Skin(**values).mean_albedo(row)[0]
        np.testing.assert_allclose(albedo.mean(axis=(0, 1)), expected, rtol=0.05)


def test_skin_is_uneven_at_every_scale_and_red_spots_are_blood():
    """Standard deviations of the albedo's logarithm over 0.5, 1.5 and 5 mm."""
    from scipy.ndimage import gaussian_filter

    def over(scale_mm, albedo):
        pixels = scale_mm / 0.15
        log = np.log(albedo[..., 1])
        return (gaussian_filter(log, pixels / 4) - gaussian_filter(log, pixels)).std()

    _, uneven = shaded({**FLAT, "spot_share": 0.0, "freckles": 0.0}, **WIDE)
    _, even = shaded({**FLAT, **EVEN, "spot_share": 0.0, "freckles": 0.0}, **WIDE)
    for scale, least in ((0.5, 0.007), (1.5, 0.014), (5.0, 0.017)):
        assert over(scale, uneven) > least > over(scale, even) + 0.005
    spotted = {**FLAT, **EVEN, "spot_share": 1.0}
    share = []  # of what red light loses, of green's
    for red in (0.0, 1.0):
        _, albedo = shaded({**spotted, "red_share": red}, **WIDE)
        lost = np.log(albedo.min(axis=(0, 1)) / np.median(albedo, axis=(0, 1)))
        assert lost[1] < np.log(0.85)
        share.append(lost[0] / lost[1])
    assert share[1] < 0.75 * share[0], share
