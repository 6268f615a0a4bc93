"""The medium that a glTF file gives: KHR_materials_volume_scatter."""

import base64
import json

import numpy as np
import pytest

from renderer.optics import chandrasekhar, media
from stimuli import scenes
from stimuli.errors import InputError

VOLUME = {"attenuationDistance": 2.0, "attenuationColor": [0.5, 0.25, 0.125]}
SCATTER = {"multiscatterColor": [0.9, 0.6, 0.3]}


def table(folder, *materials, **scene):
    """A scene of one tetrahedron with these extensions on its materials."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    faces = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], np.uint16)
    data = points.tobytes() + faces.tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": f"m{k}", "extensions": e} for k, e in enumerate(materials)],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [1, 1, 1],
            },
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }
    file = folder / "thing.gltf"
    file.write_text(json.dumps(document))
    own = {"shape": "mesh", "file": str(file), "unit": "cm"}
    return {"objects": {"thing": own}, "environment": {"ambient": [1.0] * 3}, **scene}


def material(scatter=SCATTER, volume=VOLUME, **more):
    return {"KHR_materials_volume": volume, "KHR_materials_volume_scatter": scatter, **more}


def test_a_mesh_brings_its_medium(tmp_path):
    """Extinction of 2 cm halving, quartering, ...; the albedo is that which looks so."""
    made = table(tmp_path, material(KHR_materials_ior={"ior": 1.4}))
    found = scenes.read_scene(made).materials["thing"].medium
    sigma_t = np.array(found["sigma_a"]) + found["sigma_s"]
    np.testing.assert_allclose(sigma_t, np.log(2) / 20 * np.array([1, 2, 3]))
    assert found["eta"] == 1.4 and found["g"] == 0
    albedo = np.array(found["sigma_s"]) / sigma_t
    # the fit's colour is the reflectance of an index-matched half space, exactly Chandrasekhar's
    np.testing.assert_allclose(
        chandrasekhar.diffuse_albedo(albedo), SCATTER["multiscatterColor"], atol=0.02
    )
    assert media.read(found).channels == 3
    assert scenes.stage(scenes.read_scene(made)).graph.mesh_nodes


def test_the_scene_goes_over_the_file_and_anisotropy_keeps_the_colour(tmp_path):
    forward = table(tmp_path, material({**SCATTER, "scatterAnisotropy": 0.8}))
    found = scenes.read_scene(forward).materials["thing"].medium
    stack = media.read(found)
    (layer,) = stack.layers
    plain = media.read(scenes.read_scene(table(tmp_path, material())).materials["thing"].medium)
    np.testing.assert_allclose(
        layer.medium.albedo_prime, plain.layers[0].medium.albedo_prime, atol=1e-12
    )
    own = table(tmp_path, material(), materials={"thing": {"medium": "marble"}})
    assert scenes.read_scene(own).materials["thing"].medium == "marble"
    without = table(tmp_path, {"KHR_materials_ior": {"ior": 1.4}})
    assert scenes.read_scene(without).materials["thing"].medium == "skin"


@pytest.mark.parametrize(
    ("materials", "message"),
    [
        ([material(volume={})], "material 'm0': attenuationDistance is inf; expected"),
        ([material({"multiscatterColor": [1, 0, 0]})], "multiscatterColor is [1. 0. 0.]; expected"),
        ([material({**SCATTER, "scatterAnisotropy": 1})], "scatterAnisotropy is 1.0; expected"),
        ([material(), material({"multiscatterColor": [0.1] * 3})], "2 materials that scatter diff"),
        ([material({"multiscatterColor": "red"})], "is not valid glTF (ValueError"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, materials, message):
    with pytest.raises(InputError) as caught:
        scenes.read_scene(table(tmp_path, *materials))
    assert message in str(caught.value) and "\n" not in str(caught.value)
