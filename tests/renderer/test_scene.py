"""Scenes as values: read, checked, written back, patched."""

import numpy as np
import pytest

import renderer
from renderer.errors import InputError as SceneError
from renderer.scene import ANGLES, FRAMINGS, Material, Scene, Skin
from renderer.scene.picture import TONE_MAPS, Picture
from stimuli import scenes
from stimuli.errors import InputError
from stimuli.parts import LIGHTS, PEOPLE, SCENES, names

THESIS = scenes.load_table("thesis")


def test_the_thesis_scene_reads_back():
    scene = scenes.read_scene(THESIS)
    assert list(scene.lights) == ["key", "rim"] and len(scene.environment.panels) == 6
    assert scene.objects["head"].material == "head" and isinstance(scene.materials["head"], Skin)
    assert scene.camera == FRAMINGS["head-shot"] and scene.picture.exposure == 1.45
    assert Scene.read(scene.plain()) == scene


@pytest.mark.parametrize("rig", names(LIGHTS))
@pytest.mark.parametrize("person", names(PEOPLE))
def test_every_rig_and_person_is_a_patch(rig, person):
    patch = {"rig": rig, "objects": {"head": {"person": person}}}
    scene = scenes.read_scene(scenes.merge(THESIS, patch))
    assert scene.objects["head"].person == person and scene.lights


@pytest.mark.parametrize("name", names(SCENES))
def test_every_scene_reads(name):
    assert scenes.read_scene(scenes.load_table(name)).objects


def test_patches_replace_merge_and_remove():
    table = {"lights": {"a": {"kind": "distant"}, "b": {"kind": "point"}}, "subject": "x"}
    merged = scenes.merge(table, {"lights": {"a": {"shadow": False}, "b": False}, "subject": "y"})
    assert merged == {"lights": {"a": {"kind": "distant", "shadow": False}}, "subject": "y"}
    assert table["lights"]["b"] == {"kind": "point"}  # the first is as it was


def test_a_persons_skin_is_the_start_and_the_scene_goes_over_it():
    dark = {"objects": {"head": {"person": "man_dark"}}, "materials": {"head": {"melanin": 0.3}}}
    skin = scenes.read_scene(scenes.merge(THESIS, dark)).materials["head"]
    assert skin.melanin == 0.3 and skin.epidermis_mm == 0.10


def test_cameras_by_name_and_by_number():
    front = scenes.read_scene(scenes.merge(THESIS, {"camera": {"angle": "front"}})).camera
    assert front.yaw_deg == ANGLES["front"] == 0 and front.height_mm == 330.0
    own = {"framing": "nose", "height_mm": 60.0, "yaw_deg": 10.0, "region": [0.2, 0.2, 0.8, 0.8]}
    camera = scenes.read_scene({**THESIS, "camera": own}).camera
    assert camera.framing == "nose" and camera.region == (0.2, 0.2, 0.8, 0.8)
    eye = camera.eye_mm(np.zeros(3))
    assert np.linalg.norm(eye) == pytest.approx(camera.distance_mm)


def test_a_scene_has_framings_of_its_own():
    portrait = scenes.load_table("portrait")
    own = portrait["framings"]
    assert scenes.framings(portrait) == [*own, *(f for f in FRAMINGS if f not in own)]
    assert scenes.framings(THESIS) == list(FRAMINGS)
    for name, camera in own.items():
        made = scenes.read_scene(scenes.merge(portrait, {"camera": {"framing": name}})).camera
        assert made.framing == name and made.height_mm == camera["height_mm"]
    turned = {"camera": {"framing": "ear", "angle": "front", "fov_y_deg": 30.0}}
    camera = scenes.read_scene(scenes.merge(portrait, turned)).camera
    assert (camera.yaw_deg, camera.fov_y_deg, camera.height_mm) == (0.0, 30.0, 100.0)


@pytest.mark.parametrize("wrong", [3, {"near": 3}, {"near": {"yaw": 1.0, "height_mm": 1.0}}])
def test_framings_that_are_none_are_refused(wrong):
    table = {**THESIS, "framings": wrong, "camera": {"framing": "near"}}
    with pytest.raises((InputError, SceneError), match="framings|camera"):
        scenes.read_scene(table)


@pytest.mark.parametrize("tone_map", TONE_MAPS)
def test_tone_maps_keep_greys_grey_and_rise(tone_map):
    steps = np.geomspace(1e-3, 20, 60)
    grey = Picture(exposure=1.0, tone_map=tone_map).encode(np.repeat(steps[:, None], 3, axis=1))
    assert (np.ptp(grey.astype(int), axis=1) <= 1).all()
    assert (np.diff(grey[:, 1].astype(int)) >= 0).all() and grey[0, 1] < 10 and grey[-1, 1] > 240


def test_grain_has_its_strength_and_no_mean():
    made = {
        "objects": {"ball": {"shape": "sphere", "radius_mm": 1.0}},
        "materials": {"ball": {}},
        "lights": {"lamp": {"irradiance": [0.0, 0.0, 0.0]}},
        "camera": {"framing": "far", "height_mm": 900.0, "yaw_deg": 0.0},
        "picture": {"centre": [0.4] * 3, "edge": [0.4] * 3},
    }
    pictures = []
    for grain in (0.0, 0.03):
        made["picture"]["grain"] = grain
        staged = scenes.stage(scenes.read_scene(made))
        with (
            renderer.Renderer(staged.graph, (128, 128), 1, rays=4, shadow_map=64) as drawing,
            drawing.frame() as frame,
        ):
            pictures.append(frame.render(renderer.make("none")).image.astype(float))
    away = (pictures[1] - pictures[0])[:, :50]
    level = pictures[0][64, 10, 1] / 255
    assert away.std() == pytest.approx(
        255 * 0.03 * np.sqrt(4 * level * (1 - level) + 0.05), rel=0.05
    )
    assert abs(away.mean()) < 0.3 and (np.ptp(away, axis=2) <= 1).all()


def test_coatings_and_thickness_make_layers():
    coated = Material(
        medium="upper_dermis", coatings=({"medium": "epidermis", "thickness_mm": 0.2},)
    )
    assert coated.layered()["layers"][1] == {"medium": "upper_dermis"}
    sheet = Material(medium="marble", thickness=3.0).layered()
    assert sheet == {"layers": [{"medium": "marble", "thickness_mm": 3.0}]}
    assert Material(medium="marble").layered() == "marble"


@pytest.mark.parametrize(
    ("patch", "message"),
    [
        ({"rig": "noom"}, "no rig 'noom'; did you mean 'noon'?"),
        ({"objects": {"head": {"person": "woma"}}}, "no person 'woma'; did you mean 'woman'?"),
        ({"objects": {"head": {"shape": "cube"}}}, "scene.objects.head.shape is 'cube'; expected"),
        ({"objects": {"head": {"material": "tin"}}}, "head.material is 'tin'; expected head"),
        ({"subject": "hat"}, "scene.subject is 'hat'; expected one of head"),
        ({"light": {}}, "scene.light is unknown; did you mean 'lights'?"),
        ({"lights": {"key": {"kind": "sun"}}}, "scene.lights.key.kind is 'sun'; expected one of"),
        ({"lights": {"key": {"radius": 1}}}, "scene.lights.key.radius is unknown; did you mean"),
        ({"lights": {"key": {"irradiance": [1, 2]}}}, "key.irradiance is (1, 2); expected 3 num"),
        ({"lights": {"key": {"direction": [0, 0, 0]}}}, "direction is (0, 0, 0); expected a"),
        ({"camera": "near"}, "scene.camera is 'near'; expected a table"),
        ({"camera": {"framing": "far"}}, "scene.camera.framing is 'far'; expected one of close-up"),
        ({"camera": {"angle": "back"}}, "scene.camera.angle is 'back'; expected one of front"),
        ({"camera": {"angle": "front", "yaw_deg": 3}}, "has both angle, 'front', and yaw_deg, 3"),
        ({"camera": {"region": [0.5, 0, 0.5, 1]}}, "expected left < right and top < bottom"),
        ({"picture": {"exposure": 0}}, "scene.picture.exposure is 0; expected 1e-06 to"),
        ({"picture": {"tone_map": "log"}}, "tone_map is 'log'; expected one of 'filmic'"),
        ({"materials": {"head": {"medium": "jam"}}}, "materials.head.medium is 'jam'; expected"),
        ({"materials": {"head": {"melanine": 1}}}, "head.melanine is unknown; did you mean 'mel"),
        ({"materials": {"head": {"thickness": -1}}}, "head.thickness is -1; expected 'solid', or"),
        ({"materials": {"head": {"coatings": [{}]}}}, "coatings[0] is {}; expected a table with"),
        (
            {"materials": {"head": {"medium": {"sigma_a": [1], "sigma_s_prime": [1]}}}},
            "materials.head.medium has 1 channels; expected 3",
        ),
        ({"environment": {"map": 3}}, "scene.environment.map is 3; expected a file"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(patch, message):
    with pytest.raises((SceneError, InputError)) as caught:
        scenes.read_scene(scenes.merge(THESIS, patch))
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_files_are_looked_for_beside_the_scene(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(
        '[objects.a]\nshape = "mesh"\nfile = "a.ply"\n[environment]\nmap = "e.hdr"\n'
        '[materials.a]\nheight_map = "h.png"\n'
    )
    table = scenes.load_table(file)
    assert table["objects"]["a"]["file"] == str(tmp_path / "a.ply")
    assert table["environment"]["map"] == str(tmp_path / "e.hdr")
    assert table["materials"]["a"]["height_map"] == str(tmp_path / "h.png")
    with pytest.raises(InputError, match="no such file"):
        scenes.load_table(tmp_path / "gone.toml")
    file.write_text("[objects")
    with pytest.raises(InputError, match="not TOML"):
        scenes.load_table(file)


def test_a_mesh_is_read_in_its_unit_and_turned_upright(tmp_path):
    import trimesh

    box = trimesh.creation.box((1, 2, 3))
    box.apply_translation((5, 5, 5))
    box.export(tmp_path / "box.ply")
    table = {
        "objects": {
            "box": {
                "shape": "mesh",
                "file": str(tmp_path / "box.ply"),
                "unit": "cm",
                "up": "z",
                "position_mm": [7.0, 0.0, 0.0],
            }
        },
        "environment": {"ambient": [1.0, 1.0, 1.0]},
    }
    staged = scenes.stage(scenes.read_scene(table))
    (mesh,) = (node.mesh for node in staged.graph.mesh_nodes)
    np.testing.assert_allclose(
        np.ptp(mesh.primitives[0].positions, axis=0), [10, 30, 20], atol=1e-4
    )
    np.testing.assert_allclose(staged.graph.subject, [7, 0, 0], atol=1e-4)
    (tmp_path / "box.ply").write_text("no mesh")
    from stimuli.scenes import staging

    staging._mesh_arrays.cache_clear()
    with pytest.raises(InputError, match="cannot be read as a mesh|no triangles"):
        scenes.stage(scenes.read_scene(table))
