"""What a renderer keeps on disk: the same to the bit as what was drawn, and the scene's own."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import renderer
from renderer import caches, kept
from renderer.passes.lamps import Lamps
from renderer.passes.surfaces import Surfaces
from renderer.scene.camera import Camera
from renderer.scene.lights import DistantLight
from renderer.scene.material import Material
from tests.renderer.test_hair import stand_of

CAMERA = Camera(height_mm=60.0, yaw_deg=20.0)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def graph_of(light=3.0, medium="skin"):
    """Five strands before a square that scatters, under one lamp."""
    x = np.linspace(-15, 15, 9)
    strands = [np.stack([x, 0.3 * x + k, np.zeros(9)], axis=1) for k in range(-4, 6, 2)]
    graph = stand_of(np.array(strands), 0.8, -20.0)
    for node in list(graph.mesh_nodes):
        for primitive in node.mesh.primitives:
            if hasattr(primitive.material, "value"):
                primitive.material.value = Material(medium=medium)
    graph.add_light(DistantLight(direction=(0.6, 0.0, 0.8), irradiance=(light, light, light)))
    return graph


@contextmanager
def opened(graph=None, keep=kept.CACHES):
    with renderer.Renderer(graph or graph_of(), (96, 64), 2, 0, 4, 256, keep=keep) as drawing:
        yield drawing


def drawn(drawing, *techniques, camera=CAMERA):
    """The texels of a frame's buffers, and the images of techniques."""
    with drawing.frame(camera) as frame:
        images = [frame.render(technique).image for technique in techniques]
        return [texture.read().copy() for texture in frame.surface.textures] + images


TECHNIQUES = [
    renderer.make("golubev", {}),
    renderer.make("splat_dipole", {"spacing_mm": 8.0, "share": 0.9}),  # asks for the depth buffer
    renderer.make("deon_luebke", {"size": 128}),  # for lamps, and light that passes the face anew
]


def test_what_was_kept_is_what_was_drawn_to_the_bit(monkeypatch, folder):
    with opened(keep=()) as drawing:
        plain = drawn(drawing, *TECHNIQUES)
    with opened() as drawing:
        first = drawn(drawing, *TECHNIQUES)
    assert len(list((folder / "views").iterdir())) >= 2, "buffers, and what comes through"
    assert len(list((folder / "shadows").iterdir())) == 1
    assert plain[1][..., 3].max() > 0 and plain[0][..., 3].max() == 1, "hair and a medium are seen"
    monkeypatch.setattr(Lamps, "draw", None)  # nobody may call it
    with opened() as drawing:
        again = drawn(drawing, *TECHNIQUES)
        monkeypatch.setattr(Surfaces, "draw", None)
        monkeypatch.setattr(Surfaces, "draw_transmitted", None)
        once_more = drawn(drawing, TECHNIQUES[0])
    for one, two, three in zip(plain, first, again, strict=True):
        np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(one, three)
    for one, two in zip(plain[:5], once_more, strict=True):
        np.testing.assert_array_equal(one, two)


def test_another_camera_has_buffers_of_its_own_and_the_same_maps(folder, monkeypatch):
    other = replace(CAMERA, yaw_deg=-30.0)
    with opened(keep=()) as drawing:
        plain = drawn(drawing, camera=other)
    with opened() as drawing:
        drawn(drawing)
    monkeypatch.setattr(Lamps, "draw", None)
    with opened() as drawing:
        for one, two in zip(plain, drawn(drawing, camera=other), strict=True):
            np.testing.assert_array_equal(one, two)
    assert len(list((folder / "views").iterdir())) == 2


def test_maps_are_put_by_while_techniques_take_their_light(monkeypatch):
    """As a build has it: they are read again for the next view, and it is the same to the bit."""
    other = replace(CAMERA, yaw_deg=-30.0)
    with opened(keep=()) as drawing:
        plain = [*drawn(drawing, TECHNIQUES[0]), *drawn(drawing, *TECHNIQUES, camera=other)]
        assert vars(drawing).keys() >= {"lamps", "hair"}
    with opened(keep=("shadows",)) as drawing:
        again = drawn(drawing, TECHNIQUES[0])
        assert not vars(drawing).keys() & {"lamps", "hair"}
        monkeypatch.setattr(Lamps, "draw", None)  # nobody may call it
        again += drawn(drawing, *TECHNIQUES, camera=other)
    for one, two in zip(plain, again, strict=True):
        np.testing.assert_array_equal(one, two)


def test_maps_that_could_not_be_kept_stay(monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE_MB", "0")
    with opened(keep=("shadows",)) as drawing:
        drawn(drawing, TECHNIQUES[0])
        assert vars(drawing).keys() >= {"lamps", "hair"}


def test_a_key_follows_all_that_a_scene_has():
    def key(graph, **changed):
        with renderer.Renderer(
            graph, (32, 32), 1, 0, 4, 64, keep=kept.CACHES, **changed
        ) as drawing:
            return drawing.kept_as

    keys = [key(graph_of()), key(graph_of(light=2.0)), key(graph_of(medium="marble"))]
    moved = graph_of()
    for node in list(moved.mesh_nodes):
        for primitive in node.mesh.primitives:
            if hasattr(primitive, "strands"):
                primitive.strands.points[3, 1] += 1e-4
    keys.append(key(moved))
    assert key(graph_of()) == keys[0] and len(set(keys)) == len(keys)


def test_half_a_file_is_drawn_anew(folder):
    with opened() as drawing:
        first = drawn(drawing)
    for file in folder.rglob("*.npz"):
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with opened() as drawing:
        for one, two in zip(first, drawn(drawing), strict=True):
            np.testing.assert_array_equal(one, two)


def test_nothing_is_kept_without_being_asked(folder):
    with opened(keep=()) as drawing:
        drawn(drawing)
    assert not (folder / "views").exists() and not (folder / "shadows").exists()


def test_parts_go_through_what_a_repr_would_shorten():
    from scipy import sparse

    long = np.zeros(5000)
    changed = long.copy()
    changed[2500] = 1
    assert repr(long) == repr(changed)

    def keys(*values):
        return {caches.key(caches.parts(value), [], ()) for value in values}

    assert len(keys({"a": [long]}, {"a": [changed]}, {"b": [long]}, [{"a": long}])) == 4
    assert len(keys(sparse.csr_matrix(long), sparse.csr_matrix(changed))) == 2
    lamp = DistantLight()
    assert len(keys(lamp, replace(lamp, radius_deg=2.5), replace(lamp, radius_deg=2.5))) == 2


def test_every_file_that_draws_is_hashed():
    names = {path.name for path in kept._drawn_by()}
    assert {"skin.frag", "lighting.glsl", "hair.vert", "surfaces.py", "frame.py"} <= names
