"""A user's own head: what is read, what is made of it, and the one line for everything that cannot
be used.
"""

import base64
import io
import json
import struct

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from stimuli.errors import InputError
from stimuli.heads.placing import Asked
from stimuli.heads.scan import part_kind, read_scan

RADII_MM = np.array([75.0, 115.0, 100.0])  # an ellipsoid of a head's size: 230 mm high


def ellipsoid(rings: int = 24, segments: int = 32) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (mm), uvs and outward faces of a head-sized ellipsoid with a texture seam: its
    first and last column coincide.
    """
    v, u = np.meshgrid(np.linspace(0, 1, rings + 1), np.linspace(0, 1, segments + 1), indexing="ij")
    angle = 2 * np.pi * (u % 1)
    circle = np.where((v == 0) | (v == 1), 0.0, np.sin(np.pi * v))
    unit = np.stack(
        [circle * np.sin(angle), -np.cos(np.pi * v), circle * np.cos(angle)], axis=-1
    ).reshape(-1, 3)
    a = (np.arange(rings)[:, None] * (segments + 1) + np.arange(segments)).reshape(-1)
    b, c, d = a + 1, a + segments + 2, a + segments + 1
    upper, lower = np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)
    faces = np.concatenate(
        [upper[segments:], lower[:-segments]]
    )  # without those that shrink to nothing at the poles
    return unit * RADII_MM, np.stack([u, v], axis=-1).reshape(-1, 2), faces


def obj_text(positions, faces, uvs=None, normals=None, head: str = "") -> str:
    """An OBJ file; all indices of a corner are the same."""
    lines = [head] + ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in positions]
    lines += ["vt {:.9g} {:.9g}".format(*t) for t in (uvs if uvs is not None else [])]
    lines += [
        "vn {:.9g} {:.9g} {:.9g}".format(*n) for n in (normals if normals is not None else [])
    ]
    corner = (
        "{0}/{0}/{0}"
        if normals is not None and uvs is not None
        else "{0}/{0}"
        if uvs is not None
        else "{0}"
    )
    corner = "{0}//{0}" if normals is not None and uvs is None else corner
    lines += ["f " + " ".join(corner.format(i + 1) for i in face) for face in faces]
    return "\n".join(lines) + "\n"


def flat_image(colour, size=(8, 8)) -> Image.Image:
    return Image.new("RGB", size, tuple(colour))


def quarters(side: int = 16) -> Image.Image:
    """A texture whose four quarters tell which way it lies: red, green above blue, white."""
    image, half = np.zeros((side, side, 3), np.uint8), side // 2
    image[:half, :half], image[:half, half:], image[half:, :half], image[half:, half:] = (
        (255, 0, 0),
        (0, 255, 0),
        (0, 0, 255),
        (255, 255, 255),
    )
    return Image.fromarray(image)


def look_up(image: np.ndarray, uvs: np.ndarray) -> np.ndarray:
    """The nearest texels at these texture coordinates, v up, repeating:
    what a renderer would see.
    """
    height, width = image.shape[:2]
    column = np.floor((uvs[:, 0] % 1) * width).astype(int).clip(0, width - 1)
    row = np.floor((1 - uvs[:, 1] % 1) * height).astype(int).clip(0, height - 1)
    return image[row, column]


def gltf_document(
    attributes: dict, faces=None, material: dict | None = None, images=(), **extra
) -> dict:
    """A glTF document with one mesh, everything inside as base64.

    Attributes: name -> array, or (array, accessor properties).
    """
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "bufferViews": [],
        "accessors": [],
        "meshes": [{"primitives": [{"attributes": {}}]}],
    }
    primitive, blob = document["meshes"][0]["primitives"][0], b""
    codes = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125, "i1": 5120, "i2": 5122}

    def add(array, **properties) -> int:
        nonlocal blob
        array = np.asarray(array)
        kind = ("SCALAR", "", "VEC2", "VEC3", "VEC4")[array.ndim > 1 and array.shape[1]]
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes}
        )
        code = codes[array.dtype.str[1:]]
        view = len(document["bufferViews"]) - 1
        document["accessors"].append(
            {
                "bufferView": view,
                "componentType": code,
                "count": len(array),
                "type": kind,
                **properties,
            }
        )
        blob += array.tobytes() + b"\0" * (-array.nbytes % 4)
        return len(document["accessors"]) - 1

    for name, value in attributes.items():
        array, properties = value if isinstance(value, tuple) else (value, {})
        primitive["attributes"][name] = add(array, **properties)
    if faces is not None:
        primitive["indices"] = add(np.asarray(faces, "<u4").reshape(-1))
    if material is not None:
        primitive["material"] = 0
        document["materials"] = [material]
    if images:
        document["textures"] = [{"source": i} for i in range(len(images))]
        document["images"] = [
            {"uri": "data:image/png;base64," + base64.b64encode(png(image)).decode()}
            for image in images
        ]
    document["buffers"] = [
        {"byteLength": len(blob), "uri": "data:;base64," + base64.b64encode(blob).decode()}
    ]
    return document | extra


def png(image: Image.Image) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, "PNG")
    return buffer.getvalue()


def metres(positions) -> np.ndarray:
    return (positions / 1000).astype("<f4")


@pytest.fixture
def folder(tmp_path):
    """Writes files (text, bytes, image, glTF document or trimesh) into a folder and reads the first
    as a scan.
    """

    def read(files: dict, **options):
        for name, content in files.items():
            file = tmp_path / name
            if isinstance(content, Image.Image):
                content.save(file)
            elif isinstance(content, dict):
                file.write_text(json.dumps(content))
            elif isinstance(content, bytes):
                file.write_bytes(content)
            elif isinstance(content, str):
                file.write_bytes(content.encode())
            else:
                content.export(file)
        return read_scan(tmp_path / next(iter(files)), Asked(**options))

    return read


def refused(read, files, *words, **options) -> str:
    """Reading refuses with one line that names the file and holds these words."""
    with pytest.raises(InputError) as caught:
        read(files, **options)
    message = str(caught.value)
    assert "\n" not in message and next(iter(files)) in message and len(message) < 700
    for word in words:
        assert word in message
    return message


def assert_outward(scan, part: int = 0, middle=(0, 0, 0)):
    """Windings and normals of a convex part point away from its middle (mm)."""
    faces = scan.faces[scan.parts == part]
    corners = scan.positions_mm[faces].astype(float)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((across * (corners.mean(axis=1) - middle)).sum(axis=1) > 0).all()
    assert ((across[:, None] * scan.normals[faces]).sum(axis=2) > 0).all()


# What is read


def test_an_obj_becomes_millimetres_triangles_normals_and_uvs(folder):
    positions, uvs, faces = ellipsoid()
    scan = folder({"head.obj": obj_text(positions, faces, uvs)})
    assert scan.name == "head" and (scan.positions_mm.dtype, scan.faces.dtype) == (
        np.float32,
        np.int32,
    )
    assert len(scan.faces) == len(faces)
    np.testing.assert_allclose(
        np.sort(scan.positions_mm[scan.faces], axis=None),
        np.sort(positions[faces], axis=None),
        atol=1e-4,
    )
    assert scan.normals.shape == scan.positions_mm.shape and scan.uvs.shape == (
        len(scan.positions_mm),
        2,
    )
    assert scan.albedo is scan.normal_map is scan.roughness is scan.base_colour is None
    assert scan.part_names == ("head",) and scan.part_kinds == ("skin",) and (scan.parts == 0).all()
    assert list(scan.files) == ["head.obj"] and len(scan.files["head.obj"]) == 64
    assert_outward(scan)


def test_normals_are_smooth_across_the_texture_seam(folder):
    positions, uvs, faces = ellipsoid(48, 64)
    scan = folder({"head.obj": obj_text(positions, faces, uvs)})
    analytic = scan.positions_mm / RADII_MM**2  # the gradient of an ellipsoid
    analytic /= np.linalg.norm(analytic, axis=1, keepdims=True)
    assert np.degrees(np.arccos((analytic * scan.normals).sum(axis=1).clip(-1, 1))).max() < 2
    u, v = scan.uvs.T
    left, right = (scan.normals[(u == side) & (v > 0.01) & (v < 0.99)] for side in (0, 1))
    assert len(left) == 47 and (left == right).all()


def test_given_normals_are_kept_at_unit_length(folder):
    positions, uvs, faces = ellipsoid()
    given = positions + (0, 40, 0)  # tilted on purpose
    scan = folder({"head.obj": obj_text(positions, faces, uvs, 3 * given)})
    expected = scan.positions_mm + (0, 40, 0)
    np.testing.assert_allclose(
        scan.normals, expected / np.linalg.norm(expected, axis=1, keepdims=True), atol=1e-5
    )


def test_a_given_normal_of_no_length_is_computed(folder):
    positions, _, faces = ellipsoid()
    normals = positions.copy()
    normals[200], normals[201], normals[202] = 0, np.nan, 1e200
    scan = folder({"head.obj": obj_text(positions, faces, None, normals)})
    np.testing.assert_allclose(np.linalg.norm(scan.normals, axis=1), 1, atol=1e-6)
    assert_outward(scan)


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_a_gltf_keeps_its_textures_the_right_way_up(tmp_path, suffix):
    positions, uvs, faces = ellipsoid()
    material = PBRMaterial(
        name="Skin",
        baseColorTexture=quarters(),
        normalTexture=flat_image((128, 128, 255), (4, 4)),
        metallicRoughnessTexture=flat_image((0, 77, 0), (2, 2)),
    )
    mesh = trimesh.Trimesh(
        metres(positions), faces, visual=TextureVisuals(uvs, material=material), process=False
    )
    trimesh.Scene(mesh).export(tmp_path / f"head.{suffix}")
    scan = read_scan(tmp_path / f"head.{suffix}")
    assert (
        scan.placing.unit,
        scan.placing.unit_source,
        scan.placing.up,
        scan.placing.up_source,
        scan.notes,
    ) == (
        "m",
        "format",
        "y",
        "format",
        (),
    )
    np.testing.assert_allclose(np.ptp(scan.positions_mm, axis=0), 2 * RADII_MM, rtol=1e-3)
    np.testing.assert_array_equal(scan.albedo, np.asarray(quarters()))
    assert scan.normal_map.shape == (4, 4, 3) and (scan.normal_map == (128, 128, 255)).all()
    assert (
        scan.roughness.shape == (2, 2) and (scan.roughness == 77).all() and scan.base_colour is None
    )
    high_left = (scan.uvs[:, 0] < 0.45) & (abs(scan.uvs[:, 1] - 0.77) < 0.22)
    assert (look_up(scan.albedo, scan.uvs[high_left]) == (255, 0, 0)).all() and (
        scan.positions_mm[high_left, 1] > 0
    ).all()
    assert scan.part_names == ("Skin",)
    assert (len(scan.files) > 1) == (suffix == "gltf")


def test_a_scene_graph_is_applied_and_meshes_are_joined_by_part(folder):
    positions, _, faces = ellipsoid(12, 16)
    normals = positions / RADII_MM**2
    document = gltf_document(
        {"POSITION": metres(positions), "NORMAL": normals.astype("<f4")}, faces, {"name": "Skin"}
    )
    document["scenes"] = [{"nodes": [0]}]
    document["nodes"] = [
        {"scale": [0.01, 0.01, 0.01], "children": [1, 2]},  # a scene in centimetres
        {"mesh": 0, "matrix": [100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 100, 0, 5, 0, 0, 1]},
        {
            "mesh": 1,
            "rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)],
            "scale": [-20, 20, 20],
            "translation": [-3, 4, 8],
        },
        {"mesh": 0, "translation": [9, 9, 9]},  # not in the scene
    ]
    eye = json.loads(json.dumps(document["meshes"][0]))
    eye["primitives"][0]["material"] = 1
    document["meshes"].append(eye)
    document["materials"].append({"name": "Std_Eye_L"})
    scan = folder({"head.gltf": document})
    assert scan.part_names == ("Skin", "Std_Eye_L") and scan.part_kinds == ("skin", "eye")
    head, eyeball = (
        scan.positions_mm[np.unique(scan.faces[scan.parts == part])] for part in (0, 1)
    )
    np.testing.assert_allclose(
        [head.min(0), head.max(0)], [(50, 0, 0) - RADII_MM, (50, 0, 0) + RADII_MM], atol=0.1
    )
    turned = 0.2 * RADII_MM[[1, 0, 2]]  # a quarter turn about z
    np.testing.assert_allclose(
        [eyeball.min(0), eyeball.max(0)], [(-30, 40, 80) - turned, (-30, 40, 80) + turned], atol=0.1
    )
    assert_outward(scan, 0, (50, 0, 0))
    assert_outward(scan, 1, (-30, 40, 80))  # the eye was mirrored


def test_normals_follow_a_scale_that_is_not_even(folder):
    positions, _, faces = ellipsoid()
    sphere = positions / RADII_MM
    document = gltf_document(
        {"POSITION": sphere.astype("<f4"), "NORMAL": sphere.astype("<f4")}, faces
    )
    document["nodes"][0]["scale"] = list(RADII_MM / 1000)
    scan = folder({"head.gltf": document})
    gradient = scan.positions_mm / RADII_MM**2
    np.testing.assert_allclose(
        scan.normals, gradient / np.linalg.norm(gradient, axis=1, keepdims=True), atol=1e-5
    )


def test_packed_and_transformed_texture_coordinates_are_unpacked(folder):
    positions, uvs, faces = ellipsoid()
    down = uvs * (1, -1) + (0, 1)  # glTF's v points down
    transform = {
        "KHR_texture_transform": {"offset": [0.1, 0.2], "scale": [0.5, 0.25], "rotation": np.pi / 2}
    }
    packed = (np.rint(down * 65535).astype("<u2"), {"normalized": True})
    material = {
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0, "texCoord": 1, "extensions": transform}
        }
    }
    document = gltf_document(
        {"POSITION": metres(positions), "TEXCOORD_1": packed}, faces, material, [quarters()]
    )
    scan = folder({"head.gltf": document | {"extensionsRequired": ["KHR_texture_transform"]}})
    plain = folder(
        {
            "plain.gltf": gltf_document(
                {"POSITION": metres(positions), "TEXCOORD_0": down.astype("<f4")}, faces
            )
        }
    )
    u, v = (plain.uvs * (1, -1) + (0, 1)).T
    # Scale, a quarter turn counter-clockwise (as seen, v pointing down), offset.
    expected = np.stack([0.1 + 0.25 * v, 0.2 - 0.5 * u], axis=1) * (1, -1) + (0, 1)
    np.testing.assert_allclose(scan.uvs, expected, atol=1e-4)


def test_strips_and_interleaved_attributes_are_read(folder):
    quad = np.array([[-75, -115, 0], [75, -115, 0], [-75, 115, 50], [75, 115, 50]], float)
    document = gltf_document(
        {"POSITION": np.hstack([metres(quad), np.full((4, 1), np.nan, "<f4")])}
    )
    document["accessors"][0]["type"] = "VEC3"
    document["bufferViews"][0]["byteStride"] = 16
    document["meshes"][0]["primitives"][0]["mode"] = 5
    scan = folder({"mask.gltf": document})
    assert len(scan.faces) == 2 and (scan.normals[:, 2] > 0.8).all()
    document["meshes"][0]["primitives"][0]["mode"] = 6  # a fan from the first corner
    document["accessors"][0]["count"] = 3
    assert len(folder({"mask.gltf": document}).faces) == 1


def test_factors_are_multiplied_onto_textures_in_linear_light(folder):
    positions, uvs, faces = ellipsoid()
    material = {
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "baseColorFactor": [0.5, 1, 1, 1],
            "metallicRoughnessTexture": {"index": 1},
            "roughnessFactor": 0.5,
        },
        "normalTexture": {"index": 2, "scale": 0.5},
    }
    tilted = flat_image((218, 128, 218))  # 45 degrees towards u
    images = [flat_image((255, 128, 0)), flat_image((0, 200, 0)), tilted]
    attributes = {"POSITION": metres(positions), "TEXCOORD_0": uvs.astype("<f4")}
    scan = folder({"head.gltf": gltf_document(attributes, faces, material, images)})
    # Half of linear 1 is 188 in sRGB (IEC 61966-2-1: 1.055 * 0.5**(1/2.4) - 0.055 = 0.7354).
    assert (scan.albedo == (188, 128, 0)).all() and (scan.roughness == 100).all()
    x, _, z = scan.normal_map[0, 0] / 127.5 - 1
    assert np.degrees(np.arctan2(x, z)) == pytest.approx(np.degrees(np.arctan(0.5)), abs=0.6)


def test_without_a_texture_the_colour_of_the_material_is_given(folder):
    positions, _, faces = ellipsoid()
    material = {"pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.4, 0.3, 1]}}
    assert folder(
        {"head.gltf": gltf_document({"POSITION": metres(positions)}, faces, material)}
    ).base_colour == (0.6, 0.4, 0.3)
    files = {
        "head.obj": obj_text(positions, faces, head="mtllib a.mtl\nusemtl skin"),
        "a.mtl": "newmtl skin\nKd 0.6 0.4 0.3\n",
    }
    assert folder(files).base_colour == (0.6, 0.4, 0.3)
    assert (
        folder(
            {"plain.gltf": gltf_document({"POSITION": metres(positions)}, faces, {})}
        ).base_colour
        is None
    )


# OBJ and its material library

QUADS = """
v -75 -115 -100
v 75 -115 -100
v 75 115 -100
v -75 115 -100
v -75 -115 100
v 75 -115 100
v 75 115 100
v -75 115 100
"""


@pytest.mark.parametrize(
    "faces",
    [
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8",
        "f -5 -6 -7 -8\nf -4 -3 -2 -1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8",
        (
            "f 4 3 2\r\nf 4 2 1\r\nf 5 6 7 8 # a comment\r\nf 1\t2 6 \\\r\n 5\r\n  f 2 3 7 "
            "6\r\nf 3 4 8 7 \r\n\r\nf 4 1 5 8\r\n"
        ),
        "vn 0 0 1\nf 4//1 3//1 2 1//1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8",
        "vt 0 0\nf 4/1 3/1 2 1/1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8",
    ],
    ids=["quads", "relative", "layout", "some normals", "some uvs"],
)
def test_one_box_in_several_notations(folder, faces):
    scan = folder({"box.obj": QUADS + faces})
    assert len(scan.faces) == 12 and len(scan.positions_mm) >= 8
    assert trimesh.Trimesh(scan.positions_mm, scan.faces).volume == pytest.approx(150 * 230 * 200)
    assert scan.uvs is None  # and normals: what some corners lack cannot be used
    assert_outward(scan)


def test_a_polygon_is_fanned(folder):
    angle = np.linspace(0, 2 * np.pi, 7)[:-1]
    ring = np.stack([75 * np.cos(angle), 115 * np.sin(angle), 40 * np.cos(angle)], axis=1)
    scan = folder({"ring.obj": obj_text(ring, [range(6)])})
    assert len(scan.faces) == 4 and (scan.normals[:, 2] > 0).all()


def test_positions_are_not_merged_where_uvs_or_normals_differ(folder):
    scan = folder({"box.obj": QUADS + "vt 0 0\nvt 1 0\nf 1/1 2/1 6/1 5/1\nf 2/2 3/2 7/2 6/2"})
    assert len(scan.positions_mm) == 8 and sorted(scan.uvs[:, 0]) == [0] * 4 + [1] * 4
    scan = folder(
        {"box.obj": QUADS + "vn 0 -1 0\nvn 1 0 0\nf 1//1 2//1 6//1 5//1\nf 2//2 3//2 7//2 6//2"}
    )
    assert len(scan.positions_mm) == 8 and sorted(scan.normals[:, 0]) == [0] * 4 + [1] * 4


def test_a_material_library_gives_textures_with_spaces_options_and_foreign_paths(folder):
    positions, uvs, faces = ellipsoid()
    library = """
# made elsewhere
newmtl Skin
Kd 0.1 0.1 0.1
map_Kd -s 1 1 1 -clamp on C:\\Scans\\my head.png
map_Pr -imfchan g rough.png
map_Bump -bm 1.0 normals.png
"""
    files = {
        "head.obj": obj_text(positions, faces, uvs, head="mtllib head materials.mtl\nusemtl Skin"),
        "head materials.mtl": library,
        "my head.png": quarters(),
        "rough.png": Image.new("L", (4, 4), 99),
        "normals.png": flat_image((130, 125, 250)),
    }
    scan = folder(files)
    assert (scan.albedo == np.asarray(quarters())).all() and scan.base_colour is None
    assert (scan.roughness == 99).all() and (scan.normal_map == (130, 125, 250)).all()
    assert list(scan.files) == [
        "head.obj",
        "head materials.mtl",
        "my head.png",
        "rough.png",
        "normals.png",
    ]
    provenance = json.loads(json.dumps(scan.provenance()))
    assert provenance["files"] == scan.files and provenance["parts"] == {"Skin": "skin"}
    assert (provenance["unit"], provenance["unit_source"], provenance["up_source"]) == (
        "mm",
        "guessed",
        "guessed",
    )


def test_a_bump_map_of_heights_is_not_taken_for_normals(folder):
    positions, uvs, faces = ellipsoid()
    files = {
        "head.obj": obj_text(positions, faces, uvs, head="mtllib a.mtl\nusemtl skin"),
        "a.mtl": "newmtl skin\nmap_bump height.png\n",
        "height.png": Image.new("L", (4, 4), 128),
    }
    scan = folder(files)
    assert scan.normal_map is None and any("height.png" in note for note in scan.notes)


def test_a_library_that_is_not_there_is_said_and_names_stay(folder):
    positions, _, faces = ellipsoid()
    scan = folder({"head.obj": obj_text(positions, faces, head="mtllib lost.mtl\nusemtl M_Face")})
    assert scan.part_names == ("M_Face",) and any("lost.mtl" in note for note in scan.notes)


def test_vertex_colours_are_said_to_be_left_out(folder):
    positions, _, faces = ellipsoid()
    text = obj_text(positions, faces)
    text = "\n".join(
        line + " 0.5 0.5 0.5" if line.startswith("v ") else line for line in text.splitlines()
    )
    assert any("colours per vertex" in note for note in folder({"head.obj": text}).notes)


def test_sixteen_bit_grey_is_not_clipped(folder):
    positions, uvs, faces = ellipsoid()
    files = {
        "head.obj": obj_text(positions, faces, uvs, head="mtllib a.mtl\nusemtl skin"),
        "a.mtl": "newmtl skin\nmap_Pr rough.png\n",
        "rough.png": Image.fromarray(np.full((4, 4), 0x8080, np.uint16)),
    }
    assert (folder(files).roughness == 0x80).all()


# Several materials


def heads(*materials: str, last_uvs=lambda uvs: uvs) -> str:
    """Ellipsoids side by side, 160 mm apart, the middle one of all at 0, each with a material of
    a.mtl.
    """
    positions, uvs, faces = ellipsoid()
    lines = ["mtllib a.mtl"]
    for i, material in enumerate(materials):
        own = last_uvs(uvs) if material == materials[-1] else uvs
        moved = positions + (80 * (2 * i + 1 - len(materials)), 0, 0)
        lines += (
            ["v {} {} {}".format(*p) for p in moved]
            + ["vt {} {}".format(*t) for t in own]
            + [f"usemtl {material}"]
        )
        lines += [
            "f " + " ".join(f"{c}/{c}" for c in face) for face in faces + 1 + i * len(positions)
        ]
    return "\n".join(lines)


BOTH = "newmtl one\nmap_Kd one.png\nnewmtl two\n"


def test_several_textures_become_one_atlas(folder):
    files = {
        "two.obj": heads("one", "two"),
        "a.mtl": BOTH + "map_Kd two.png\nnorm n.png\n",
        "one.png": quarters(64),
        "two.png": flat_image((9, 99, 199), (64, 32)),
        "n.png": flat_image((100, 100, 240)),
    }
    scan = folder(files)
    assert scan.part_names == ("one", "two") and any("atlas" in note for note in scan.notes)
    first, second = (np.unique(scan.faces[scan.parts == part]) for part in (0, 1))
    assert (look_up(scan.albedo, scan.uvs[second]) == (9, 99, 199)).all()
    plain = folder(
        files
        | {
            "two.obj": obj_text(
                *(ellipsoid()[i] for i in (0, 2, 1)), head="mtllib a.mtl\nusemtl one"
            )
        }
    )
    inner = (np.abs(plain.uvs % 0.5 - 0.25) < 0.2).all(
        axis=1
    )  # away from the borders of the quarters
    assert (
        look_up(scan.albedo, scan.uvs[first][inner]) == look_up(plain.albedo, plain.uvs[inner])
    ).all() and inner.sum() > 100
    assert (look_up(scan.normal_map, scan.uvs[first]) == (128, 128, 255)).all()
    assert (look_up(scan.normal_map, scan.uvs[second]) == (100, 100, 240)).all()


def test_an_atlas_of_three_has_two_rows(folder):
    colours = {"one": (200, 0, 0), "two": (0, 200, 0), "three": (0, 0, 200)}
    files = {
        "three.obj": heads(*colours),
        "a.mtl": "".join(f"newmtl {name}\nmap_Kd {name}.png\n" for name in colours),
    }
    scan = folder(files | {f"{name}.png": flat_image(colour) for name, colour in colours.items()})
    for part, name in enumerate(scan.part_names):
        assert (
            look_up(scan.albedo, scan.uvs[np.unique(scan.faces[scan.parts == part])])
            == colours[name]
        ).all()


def test_the_atlas_repeats_its_borders_so_that_filtering_does_not_mix_cells(folder):
    files = {
        "two.obj": heads("one", "two"),
        "a.mtl": BOTH + "map_Kd two.png\n",
        "one.png": flat_image((200, 0, 0), (64, 64)),
        "two.png": flat_image((0, 0, 200), (64, 64)),
    }
    scan = folder(files)
    second = np.unique(scan.faces[scan.parts == 1])
    for step in (-1, 1):
        assert (
            look_up(scan.albedo, scan.uvs[second] + step / scan.albedo.shape[1]) == (0, 0, 200)
        ).all()


def test_a_part_with_a_mere_colour_joins_the_atlas(folder):
    files = {"two.obj": heads("one", "two"), "a.mtl": BOTH + "Kd 0.5 1 0\n", "one.png": quarters()}
    scan = folder(files)
    second = np.unique(scan.faces[scan.parts == 1])
    assert (
        look_up(scan.albedo, scan.uvs[second]) == (188, 255, 0)
    ).all()  # sRGB of linear 0.5, as above


def test_materials_that_share_their_textures_need_no_atlas(folder):
    files = {
        "two.obj": heads("one", "two"),
        "a.mtl": BOTH + "map_Kd one.png\n",
        "one.png": quarters(),
    }
    scan = folder(files)
    assert scan.albedo.shape == (16, 16, 3) and scan.part_names == ("one", "two")


def test_an_atlas_takes_textures_from_other_tiles_but_not_repeated_ones(folder):
    files = {
        "two.obj": heads("one", "two", last_uvs=lambda uvs: uvs * 0.9 + (1.05, 3.05)),
        "a.mtl": BOTH + "map_Kd two.png\n",
        "one.png": flat_image((200, 0, 0)),
        "two.png": flat_image((0, 0, 200)),
    }
    scan = folder(files)
    assert (
        look_up(scan.albedo, scan.uvs[np.unique(scan.faces[scan.parts == 1])]) == (0, 0, 200)
    ).all()
    assert_outward(scan, 0, (-80, 0, 0))
    assert_outward(scan, 1, (80, 0, 0))
    refused(
        folder,
        files | {"two.obj": heads("one", "two", last_uvs=lambda uvs: uvs * 50)},
        "'two'",
        "repeats",
        "bake",
    )


def test_a_texture_without_coordinates_is_refused(folder):
    positions, _, faces = ellipsoid()
    files = {
        "head.obj": obj_text(positions, faces, head="mtllib a.mtl\nusemtl one"),
        "a.mtl": BOTH,
        "one.png": quarters(),
    }
    refused(folder, files, "'one'", "no texture coordinates")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("M_Face", "skin"),
        ("Std_Skin_Head", "skin"),
        ("Material.001", "skin"),
        ("eyelid", "skin"),
        ("head", "skin"),
        ("M_ScleraLeft", "eye"),
        ("Std_Eye_R", "eye"),
        ("eyes", "eye"),
        ("M_Teeth", "mouth"),
        ("Std_Tongue", "mouth"),
        ("M_EyeLashes", "hair"),
        ("Eyebrows", "hair"),
        ("HAIR_CARDS", "hair"),
        ("M_EyeOcclusion", "shell"),
        ("Std_Tearline_L", "shell"),
    ],
)
def test_what_a_part_is_comes_from_its_name(name, kind):
    assert part_kind(name) == kind


def test_a_head_without_any_part_of_skin_is_skin(folder):
    positions, _, faces = ellipsoid()
    scan = folder({"hair blend.obj": obj_text(positions, faces, head="usemtl Blend")})
    assert scan.part_kinds == ("skin",) and any("'Blend'" in note for note in scan.notes)
    assert folder({"hair blend.obj": obj_text(positions, faces)}).part_kinds == ("skin",)


# Unit and upward axis


@pytest.mark.parametrize(
    ("scale", "unit"),
    [
        (1, "mm"),
        (0.1, "cm"),
        (0.001, "m"),
        (1 / 25.4, "in"),
        (2.5, "mm"),
        (0.25, "cm"),
        (0.0025, "m"),
    ],
)
def test_the_unit_that_makes_a_head_or_bust_is_guessed_and_said(folder, scale, unit):
    positions, _, faces = ellipsoid()
    scan = folder({"head.obj": obj_text(scale * positions, faces)})
    assert (scan.placing.unit, scan.placing.unit_source) == (unit, "guessed")
    assert 200 < np.ptp(scan.positions_mm[:, 1]) < 600
    assert any(f"unit was taken as {unit}" in note for note in scan.notes)


@pytest.mark.parametrize(("scale", "unit"), [(1, "mm"), (0.1, "cm"), (0.001, "m")])
def test_a_whole_body_is_slender(folder, scale, unit):
    positions, _, faces = ellipsoid()
    scan = folder({"body.obj": obj_text(scale * positions * (1700 / 230, 1700 / 230, 1.2), faces)})
    assert scan.placing.unit == unit and np.ptp(scan.positions_mm[:, 1]) == pytest.approx(
        1700, rel=1e-3
    )


def test_a_given_unit_wins_over_guess_and_format(folder):
    positions, _, faces = ellipsoid()
    scan = folder({"head.obj": obj_text(positions / 10, faces)}, unit="in")
    assert (scan.placing.unit, scan.placing.unit_source) == ("in", "given") and np.ptp(
        scan.positions_mm[:, 1]
    ) == pytest.approx(23 * 25.4, rel=1e-5)
    scan = folder(
        {"head.gltf": gltf_document({"POSITION": positions.astype("<f4")}, faces)}, unit="mm"
    )
    assert (scan.placing.unit, scan.placing.unit_source) == ("mm", "given") and np.ptp(
        scan.positions_mm[:, 1]
    ) == pytest.approx(230, rel=1e-5)


def test_a_gltf_in_millimetres_breaks_its_format_and_is_guessed(folder):
    positions, _, faces = ellipsoid()
    scan = folder({"head.gltf": gltf_document({"POSITION": positions.astype("<f4")}, faces)})
    assert (scan.placing.unit, scan.placing.unit_source) == ("mm", "guessed")


def test_a_size_that_fits_no_unit_is_refused(folder):
    positions, _, faces = ellipsoid()
    refused(
        folder,
        {"head.obj": obj_text(positions * 100, faces)},
        "2.3e+04 units",
        "expected 0.12 to 0.9 m",
    )
    refused(
        folder, {"head.obj": obj_text(positions, faces)}, "230 m across if its unit is m", unit="m"
    )
    refused(folder, {"head.obj": obj_text(positions / 1e9, faces)}, "no head in")


def test_an_obj_with_z_up_is_turned_and_said(folder):
    positions, uvs, faces = ellipsoid()
    standing = positions[:, [0, 2, 1]] * (1, -1, 1)  # as Blender has it: z up, the face towards -y
    text = obj_text(standing, faces, uvs, normals=standing)
    scan = folder({"head.obj": text})
    straight = folder({"straight.obj": obj_text(positions, faces, uvs, normals=positions)})
    assert (scan.placing.up, scan.placing.up_source) == ("z", "guessed") and any(
        "z was taken as up" in note for note in scan.notes
    )
    np.testing.assert_allclose(scan.positions_mm, straight.positions_mm, atol=1e-4)
    np.testing.assert_allclose(scan.normals, straight.normals, atol=1e-5)
    assert (
        folder({"head.obj": text}, up="y").placing.up_source,
        folder({"head.obj": text}, up="y").placing.up,
    ) == ("given", "y")
    assert np.ptp(
        folder({"straight.obj": obj_text(positions, faces)}, up="z").positions_mm[:, 1]
    ) == pytest.approx(200, abs=2)


# Mending


def test_faces_inside_out_are_turned(folder):
    positions, uvs, faces = ellipsoid()
    scan = folder({"head.obj": obj_text(positions, faces[:, ::-1])})
    assert any("inside out" in note for note in scan.notes)
    assert_outward(scan)
    scan = folder({"head.obj": obj_text(positions, faces[:, ::-1], uvs, normals=positions)})
    assert any("inside out" in note for note in scan.notes)
    assert_outward(scan)


def test_given_normals_tell_the_outside_of_a_flat_mask(folder):
    flat = np.array([[-75, -115, 0], [75, -115, 0], [75, 115, 0], [-75, 115, 0]], float)
    for face in ([0, 1, 2, 3], [3, 2, 1, 0]):
        scan = folder({"mask.obj": obj_text(flat, [face], None, np.tile([0, 0, 1], (4, 1)))})
        assert_outward(scan, middle=(0, 0, -1))


def test_normals_that_cancel_out_are_those_of_a_face(folder):
    """Two sheets back to back: at the inner point the front's six triangles face the back's six."""
    x, y = (a.reshape(-1) for a in np.meshgrid([-75, 0, 75], [-115, 0, 115]))
    quads = np.array([[i, i + 1, i + 4, i + 3] for i in (0, 1, 3, 4)])
    front, back = (
        quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3),
        quads[:, [0, 3, 1, 1, 3, 2]].reshape(-1, 3),
    )
    card = obj_text(
        np.stack([x, y, 0 * x], axis=1), np.concatenate([front, back]) - 10, head="usemtl Lashes"
    )
    positions, _, faces = ellipsoid()
    text = obj_text(positions, faces, head="usemtl Skin") + card
    scan = folder({"head.obj": text})
    of_card = scan.faces[scan.parts == 1]
    assert len(of_card) == 16 and (np.abs(scan.normals[of_card, 2]) == 1).all()


def test_an_open_scan_is_fine(folder):
    positions, _, faces = ellipsoid()
    front = faces[positions[faces][..., 2].mean(axis=1) > 20]  # a face without the back of its head
    scan = folder({"mask.obj": obj_text(positions, front)})
    assert len(scan.faces) == len(front) and scan.positions_mm[:, 2].min() > 0
    assert (scan.normals[:, 2] > 0).mean() > 0.99


def test_faces_without_area_or_twice_there_are_left_out_and_counted(folder):
    positions, _uvs, faces = ellipsoid()
    broken = np.concatenate([faces, faces[:5], faces[7:9, ::-1], [[3, 3, 4], [3, 4, 3], [5, 5, 5]]])
    scan = folder({"head.obj": obj_text(positions, broken)})
    assert len(scan.faces) == len(faces)
    assert any(note.startswith("3 of its") and "no area" in note for note in scan.notes)
    assert any(note.startswith("7 of its") and "upon others" in note for note in scan.notes)
    assert_outward(scan)


def fin(positions, faces, count: int = 1):
    """Triangles that stand on edges of the surface."""
    tips = positions[faces[::7][:count, 0]] * 1.2
    new = np.column_stack([faces[::7][:count, :2], len(positions) + np.arange(count)])
    return np.concatenate([positions, tips]), np.concatenate([faces, new])


def test_a_non_manifold_edge_is_refused_with_its_place(folder):
    positions, _uvs, faces = ellipsoid()
    finned = fin(positions, faces, 60)
    message = refused(
        folder,
        {"head.obj": obj_text(*finned)},
        "not a manifold surface",
        "60 of its",
        "more than two faces",
        "mend it",
    )
    assert "(" in message and "mm" in message
    document = gltf_document({"POSITION": metres(finned[0])}, finned[1])
    refused(folder, {"head.gltf": document}, "not a manifold surface")


def test_a_few_bad_edges_in_a_large_scan_are_only_said(folder):
    positions, _uvs, faces = ellipsoid()  # 2,208 edges: one in two hundred may be bad
    assert any(
        note.startswith("11 of its")
        for note in folder({"head.obj": obj_text(*fin(positions, faces, 11))}).notes
    )
    refused(folder, {"head.obj": obj_text(*fin(positions, faces, 12))}, "12 of its")


def test_a_mesh_whose_faces_are_degenerate_by_a_third_is_refused(folder):
    positions, _uvs, faces = ellipsoid()
    broken = np.concatenate([faces, np.repeat(faces[: len(faces) // 2, :1], 3, axis=1)])
    refused(folder, {"head.obj": obj_text(positions, broken)}, "is broken", "no area")


def test_cards_of_hair_are_exempt(folder):
    positions, _uvs, faces = ellipsoid()
    finned, new = fin(positions, faces)
    text = obj_text(positions, faces, head="usemtl Skin")
    text += "usemtl Eyelashes\n" + "\n".join("v {} {} {}".format(*p) for p in finned) + "\n"
    text += "\n".join("f " + " ".join(str(i + 1 + len(positions)) for i in face) for face in new)
    assert folder({"head.obj": text}).part_kinds == ("skin", "hair")


def test_faces_that_disagree_about_outside_need_normals(folder):
    positions, uvs, faces = ellipsoid()
    mixed = faces.copy()
    mixed[::50] = mixed[::50, ::-1]
    refused(folder, {"head.obj": obj_text(positions, mixed)}, "disagree about which side is out")
    scan = folder({"head.obj": obj_text(positions, mixed, uvs, normals=positions)})
    assert any("disagree" in note for note in scan.notes)


# Refusals

TRIANGLE = "v 0 0 0\nv 100 0 0\nv 0 200 0\n"
BASE = gltf_document({"POSITION": metres(ellipsoid()[0])}, ellipsoid()[2])


def changed(**changes) -> dict:
    """The base document with some top-level keys replaced."""
    return json.loads(json.dumps(BASE)) | changes


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"head.xyz": "solid"}, [".xyz", ".glb, .gltf, .obj, .ply or .stl"]),
        ({"head.stl": "solid"}, ["head.stl"]),
        ({"head.ply": "ply\nformat"}, ["not valid PLY"]),
        ({"head.fbx": "Kaydara"}, [".fbx", "export it as .glb"]),
        ({"head": "v 0 0 0"}, ["suffix ''"]),
        ({"head.obj": ""}, ["is empty"]),
        ({"head.glb": b""}, ["is empty"]),
        ({"head.obj": "# nothing\n"}, ["no faces"]),
        ({"head.obj": TRIANGLE}, ["no faces"]),
        ({"head.obj": b"\x89PNG\r\n\x1a\n\0\0\0"}, ["not a text file"]),
        ({"head.obj": TRIANGLE + "f 1 2 4"}, ["line 4", "'f 1 2 4'", "v indices from 1 to 3"]),
        ({"head.obj": TRIANGLE + "f 1 2 0"}, ["line 4", "v indices"]),
        ({"head.obj": TRIANGLE + "f 1 2 -4"}, ["line 4", "v indices"]),
        ({"head.obj": TRIANGLE + "vt 0 0\nf 1/1 2/1 3/2"}, ["line 5", "vt indices from 1 to 1"]),
        ({"head.obj": TRIANGLE + "vt 0 0\nf 1/-1 2/-1 3/-2"}, ["line 5", "vt indices from 1 to 1"]),
        ({"head.obj": TRIANGLE + "f 1//1 2//1 3//1"}, ["line 4", "vn indices"]),
        ({"head.obj": TRIANGLE + "f 1 2"}, ["line 4", "three corners"]),
        ({"head.obj": TRIANGLE + "f 1 2 3\nf 1 x 3"}, ["line 5", "whole numbers"]),
        ({"head.obj": TRIANGLE + "f 1/ 2/ 3/"}, ["line 4"]),
        ({"head.obj": TRIANGLE + "f 1/1/1/1 2 3"}, ["line 4", "v/vt/vn"]),
        ({"head.obj": "v 0 0 0\nv 1 zero 0\nv 1 1 1\nf 1 2 3"}, ["line 2", "'v 1 zero 0'"]),
        ({"head.obj": TRIANGLE + "v 1 2\x0b3 4\nf 1 2 3"}, ["line 4", "numbers"]),
        ({"head.obj": TRIANGLE + "v 1 2\nf 1 2 3"}, ["line 4", "3 or 4 or 6 or 7 numbers"]),
        (
            {"head.obj": "v 0 0 0\nv nan 0 0\nv 0 200 0\nf 1 2 3"},
            ["1 positions", "not finite", "nan"],
        ),
        ({"head.obj": "v 0 0 0\nv 1e999 0 0\nv 0 200 0\nf 1 2 3"}, ["not finite", "inf"]),
        ({"head.obj": TRIANGLE + "vt nan 0\nf 1/1 2/1 3/1"}, ["texture coordinates", "not finite"]),
        ({"head.obj": TRIANGLE + "vt 1e99 0\nf 1/1 2/1 3/1"}, ["absurdly large", "(1e+99, 0)"]),
        (
            {"head.obj": "v 0 0 0\nv 100 0 0\nv 200 0 0\nf 1 2 3\nf 1 1 2"},
            ["2 faces", "without area"],
        ),
        (
            {
                "head.obj": "mtllib a.mtl\nusemtl a\n" + TRIANGLE + "f 1 2 3",
                "a.mtl": "newmtl a\nmap_Kd lost.png\n",
            },
            ["'lost.png'", "not there"],
        ),
        (
            {
                "head.obj": "mtllib a.mtl\nusemtl a\n" + TRIANGLE + "f 1 2 3",
                "a.mtl": f"newmtl a\nmap_Kd {'long' * 80}\n",
            },
            ["not there"],
        ),
        (
            {
                "head.obj": "mtllib a.mtl\nusemtl a\n" + TRIANGLE + "f 1 2 3",
                "a.mtl": "newmtl a\nmap_Kd -o 0.5 t.png\n",
                "t.png": quarters(),
            },
            ["moves or scales a texture"],
        ),
        (
            {
                "head.obj": "mtllib a.mtl\nusemtl a\n" + TRIANGLE + "f 1 2 3",
                "a.mtl": "newmtl a\nKd 2 0 0\n",
            },
            ["'Kd 2 0 0'", "0 to 1"],
        ),
        (
            {
                "head.obj": "mtllib a.mtl\nusemtl a\n" + TRIANGLE + "f 1 2 3",
                "a.mtl": "newmtl a\nmap_Kd t.png\n",
                "t.png": png(quarters())[:60],
            },
            ["'t.png'", "cannot be read", "expected a whole"],
        ),
        (
            {
                "head.obj": "mtllib a.mtl\nusemtl a\n" + TRIANGLE + "f 1 2 3",
                "a.mtl": "newmtl a\nmap_Kd t.png\n",
                "t.png": b"GIMP",
            },
            ["'t.png'", "no known image format"],
        ),
        ({"head.glb": b"PK\3\4 and so on and on and on"}, ["not a GLB file"]),
        ({"head.glb": b"glTF\2\0\0\0"}, ["cut short"]),
        ({"head.glb": b"glTF" + struct.pack("<4I", 1, 20, 0, 0)}, ["version 1"]),
        ({"head.gltf": "{"}, ["JSON", "character"]),
        ({"head.gltf": "[]"}, ["not valid glTF"]),
        ({"head.gltf": {"asset": {"version": "1.0"}}}, ["glTF of version 1.0", "2.0"]),
        ({"head.gltf": {"asset": {"version": "2.0"}}}, ["no faces"]),
        (
            {"head.gltf": changed(extensionsRequired=["KHR_draco_mesh_compression"])},
            ["KHR_draco_mesh_compression", "without compression"],
        ),
        (
            {"head.gltf": changed(buffers=[{"byteLength": 9, "uri": "head.bin"}])},
            ["buffer 'head.bin'", "not there"],
        ),
        (
            {"head.gltf": changed(buffers=[{"byteLength": 9, "uri": "data:;base64,AAAA"}])},
            ["buffer 0 has 3 bytes", "expected 9"],
        ),
        (
            {"head.gltf": changed(buffers=[{"byteLength": 3, "uri": "data:;base64,AAAA"}])},
            ["bufferView 0 reaches outside"],
        ),
        (
            {"head.gltf": changed(buffers=[{"byteLength": 3, "uri": "data:;base64,A%%A"}])},
            ["base64 is damaged"],
        ),
        ({"head.gltf": changed(nodes=[{"mesh": 3}])}, ["meshes[3] of 1"]),
        ({"head.gltf": changed(nodes=[{"children": [0]}])}, ["two parents or is its own"]),
        (
            {"head.gltf": changed(accessors=[a | {"count": 10**9} for a in BASE["accessors"]])},
            ["accessor", "1000000000 items"],
        ),
        (
            {"head.gltf": changed(accessors=[a | {"sparse": {}} for a in BASE["accessors"]])},
            ["not valid glTF", "count"],
        ),
        (
            {"head.gltf": gltf_document({"POSITION": metres(ellipsoid()[0][:50])}, ellipsoid()[2])},
            ["vertex index", "expected 0 to 49"],
        ),
        (
            {"head.gltf": gltf_document({"POSITION": metres(ellipsoid()[0])}, [0, 1, 2, 3])},
            ["4 corners", "multiple of 3"],
        ),
        (
            {
                "head.gltf": gltf_document(
                    {"POSITION": metres(ellipsoid()[0]), "NORMAL": np.ones((3, 3), "<f4")},
                    ellipsoid()[2],
                )
            },
            ["different lengths"],
        ),
        (
            {
                "head.gltf": gltf_document(
                    {
                        "POSITION": metres(ellipsoid()[0]),
                        "TEXCOORD_0": ellipsoid()[1].astype("<f4"),
                    },
                    ellipsoid()[2],
                    {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
                )
                | {"textures": [{"source": 0}], "images": [{"uri": "lost%20one.jpg"}]}
            },
            ["'lost one.jpg'", "not there"],
        ),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(folder, files, words):
    refused(folder, files, *words)


def test_a_missing_file_and_unknown_options_are_refused(tmp_path):
    for path, options, word in [
        (tmp_path / "lost.glb", {}, "is not a file"),
        (tmp_path, {}, "is not a file"),
        (tmp_path / "lost.glb", {"unit": "furlong"}, "mm"),
        (tmp_path / "lost.glb", {"up": "w"}, "y, -y"),
    ]:
        with pytest.raises(InputError, match=word):
            read_scan(path, Asked(**options))


def test_a_glb_cut_anywhere_is_refused_in_one_line(tmp_path):
    positions, uvs, faces = ellipsoid(6, 8)
    material = PBRMaterial(baseColorTexture=quarters())
    mesh = trimesh.Trimesh(
        metres(positions), faces, visual=TextureVisuals(uvs, material=material), process=False
    )
    whole = trimesh.Scene(mesh).export(file_type="glb")
    for end in range(1, len(whole), 61):
        (tmp_path / "head.glb").write_bytes(whole[:end])
        with pytest.raises(InputError):
            read_scan(tmp_path / "head.glb")


@pytest.mark.parametrize("suffix", ["glb", "obj"])
def test_damage_anywhere_is_read_or_refused_but_never_a_crash(tmp_path, suffix):
    positions, uvs, faces = ellipsoid(6, 8)
    if suffix == "glb":
        material = PBRMaterial(baseColorTexture=quarters())
        mesh = trimesh.Trimesh(
            metres(positions), faces, visual=TextureVisuals(uvs, material=material), process=False
        )
        whole = trimesh.Scene(mesh).export(file_type="glb")
    else:
        whole = obj_text(positions, faces, uvs, positions, head="g head").encode()
    random = np.random.default_rng(2018)
    outcomes = set()
    for _ in range(250):
        damaged = np.frombuffer(whole, np.uint8).copy()
        new = random.integers(256, size=3) if suffix == "glb" else random.choice(damaged, size=3)
        damaged[random.integers(len(damaged), size=3)] = new
        (tmp_path / f"head.{suffix}").write_bytes(damaged.tobytes())
        try:
            scan = read_scan(tmp_path / f"head.{suffix}")
            assert np.isfinite(scan.positions_mm).all() and np.isfinite(scan.normals).all()
            outcomes.add("read")
        except InputError as error:
            assert "\n" not in str(error)
            outcomes.add("refused")
    assert outcomes == {"read", "refused"}
