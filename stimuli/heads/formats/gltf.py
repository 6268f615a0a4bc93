"""glTF 2.0, as .glb or as .gltf with its files (The Khronos Group, "glTF 2.0 Specification", 2021;
section numbers below are its).

Read are the triangles of the scene with its transforms, and of each material the base colour,
normal and roughness. Skins, morph targets and animation are left at rest, vertex colours are left
out; both are said.
"""

import base64
import json
import struct
from urllib.parse import unquote

import numpy as np

from stimuli.errors import InputError
from stimuli.heads.formats import UNNAMED, Material, Part, Source, decode_srgb, encode_srgb

COMPONENT = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}  # 3.6.2.2
COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = 4, 5, 6  # 3.7.2.1
GLB_MAGIC, GLB_JSON, GLB_BIN = b"glTF", 0x4E4F534A, 0x004E4942  # 4.4
READ_EXTENSIONS = (
    "KHR_materials_",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
    "KHR_lights_punctual",
)
"""The beginnings of the names of extensions that a file may require: these are read, or change
nothing that is read.
"""


def read(source: Source) -> list[Part]:
    """Read the parts of a glTF file: one for each primitive of each mesh, wherever the scene places
    it.
    """
    data = source.content()
    try:
        document, binary = (
            _glb(source, data) if source.path.suffix.lower() == ".glb" else (json.loads(data), b"")
        )
        return _Document(source, document, binary).parts()
    except InputError:
        raise
    except json.JSONDecodeError as error:
        raise source.error(
            f"is not valid glTF: its JSON ends or breaks at character {error.pos} of "
            f"{len(error.doc)}"
        ) from None
    except RecursionError:
        raise source.error("is not valid glTF: its nodes are nested too deeply") from None
    except (KeyError, IndexError, TypeError, AttributeError, ValueError, OverflowError) as error:
        reason = f"{type(error).__name__}: {error}".replace("\n", " ")
        raise source.error(
            f"is not valid glTF ({reason}); expected a file that a glTF validator accepts"
        ) from None


def _glb(source: Source, data: bytes) -> tuple[dict, bytes]:
    """Take the two chunks out of a binary file (4.4)."""
    if data[:4] != GLB_MAGIC:
        raise source.error(
            f"is not a GLB file: it begins with {data[:4]!r}, expected {GLB_MAGIC!r}"
        )
    if len(data) < 20:
        raise source.error(f"is cut short: it has {len(data)} bytes, expected 20 or more")
    version, length, json_length, json_type = struct.unpack_from("<4I", data, 4)
    if version != 2 or json_type != GLB_JSON:
        raise source.error(
            f"is a GLB file of version {version}; expected version 2, beginning with its JSON"
        )
    if len(data) < length or length < 20 + json_length:
        raise source.error(
            f"is cut short: it has {len(data)} bytes, its header promises "
            f"{max(length, 20 + json_length)}"
        )
    document, binary, at = json.loads(data[20 : 20 + json_length]), b"", 20 + json_length
    if at + 8 <= length:
        size, kind = struct.unpack_from("<2I", data, at)
        if kind == GLB_BIN:
            binary = data[at + 8 : at + 8 + size]
    return document, binary


def medium(source: Source, unit_mm: float) -> dict | None:
    """The medium that the file's materials name, as a table of renderer.optics.media, or None.

    KHR_materials_volume has the extinction, sigma_t = -ln(attenuationColor) / attenuationDistance;
    KHR_materials_volume_scatter the colour after multiple scattering, from which the single-
    scattering albedo follows (Kulla and Conty 2017, "Revisiting physically based shading at
    Imageworks", SIGGRAPH course), and g; KHR_materials_ior the index. unit_mm: of the file's unit.
    """
    data = source.content()
    try:
        glb = source.path.suffix.lower() == ".glb"
        document = _glb(source, data)[0] if glb else json.loads(data)
        media = [
            _medium(source, str(material.get("name", k)), material.get("extensions", {}), unit_mm)
            for k, material in enumerate(document.get("materials", []))
            if "KHR_materials_volume_scatter" in material.get("extensions", {})
        ]
    except InputError:
        raise
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        reason = f"{type(error).__name__}: {error}".replace("\n", " ")
        raise source.error(f"is not valid glTF ({reason}); expected a validator's glTF") from None
    if any(other != media[0] for other in media):
        raise source.error(
            f"has {len(media)} materials that scatter differently; expected one medium, or a "
            "medium in the scene"
        )
    return media[0] if media else None


def _medium(source: Source, name: str, extensions: dict, unit_mm: float) -> dict:
    """The medium of one material's extensions."""
    volume, scatter = (
        extensions.get(f"KHR_materials_{kind}", {}) for kind in ("volume", "volume_scatter")
    )
    distance = float(volume.get("attenuationDistance", np.inf))
    colour = np.array(volume.get("attenuationColor", (1, 1, 1)), float)
    many = np.array(scatter.get("multiscatterColor", (0, 0, 0)), float)
    g, eta = (
        float(scatter.get("scatterAnisotropy", 0)),
        float(extensions.get("KHR_materials_ior", {}).get("ior", 1.5)),
    )
    for what, values, good, expected in (
        ("attenuationDistance", distance, 0 < distance < np.inf, "a distance above 0"),
        (
            "attenuationColor",
            colour,
            colour.shape == (3,) and ((colour > 0) & (colour < 1)).all(),
            "three numbers between 0 and 1",
        ),
        (
            "multiscatterColor",
            many,
            many.shape == (3,) and ((many >= 0) & (many < 1)).all(),
            "three numbers from 0 to below 1",
        ),
        ("scatterAnisotropy", g, -1 < g < 1, "a number between -1 and 1"),
    ):
        if not good:
            raise source.error(f"material {name!r}: {what} is {values}; expected {expected}")
    sigma_t = -np.log(colour) / (distance * unit_mm)
    s = 4.097125 + 4.20863 * many - np.sqrt(9.59217 + 41.6808 * many + 17.7126 * many**2)
    s = np.clip(s, 0, 1)
    albedo = (1 - s**2) / (1 - g * s**2)
    return {
        "sigma_a": tuple((sigma_t * (1 - albedo)).tolist()),
        "sigma_s": tuple((sigma_t * albedo).tolist()),
        "g": g,
        "eta": eta,
        "name": name,
    }


class _Document:
    """A glTF document and its buffers."""

    def __init__(self, source: Source, document: dict, binary: bytes):
        self.source, self.document = source, document
        version = str(document["asset"]["version"])
        if version.partition(".")[0] != "2":
            raise source.error(f"is glTF of version {version}; expected 2.0")
        unread = [
            name
            for name in document.get("extensionsRequired", [])
            if not name.startswith(READ_EXTENSIONS)
        ]
        if unread:
            raise source.error(
                f"requires the glTF extension {', '.join(unread)}, which is not read; export "
                "it without compression"
            )
        self.buffers = [
            self._buffer(i, buffer, binary) for i, buffer in enumerate(document.get("buffers", []))
        ]
        source.copyright = str(document["asset"].get("copyright", "")).strip()[:200] or None
        self.placed: set[int] = set()  # nodes: they form trees (3.5.2)
        self.images: dict[int, np.ndarray] = {}
        self.materials: dict[int, Material] = {}

    def _buffer(self, index: int, buffer: dict, binary: bytes) -> bytes:
        data = self._uri(buffer["uri"], "buffer") if "uri" in buffer else binary
        if len(data) < buffer["byteLength"]:
            raise self.source.error(
                f"is cut short: buffer {index} has {len(data)} bytes, expected "
                f"{buffer['byteLength']}"
            )
        return data

    def _uri(self, uri: str, what: str) -> bytes:
        """The data behind a URI: inside it, or a file beside the document."""
        if not uri.startswith("data:"):
            return self.source.beside(unquote(uri), what)
        try:
            return base64.b64decode(uri.partition(",")[2], validate=True)
        except ValueError:
            raise self.source.error(f"holds a {what} whose base64 is damaged") from None

    def _view(self, index: int) -> tuple[bytes, int]:
        """The bytes of a buffer view, and its stride (0: packed)."""
        view = self._item("bufferViews", index)
        start = view.get("byteOffset", 0)
        buffer = self.buffers[view["buffer"]]
        if not 0 <= start <= start + view["byteLength"] <= len(buffer):
            raise self.source.error(
                f"is not valid glTF: bufferView {index} reaches outside its buffer of "
                f"{len(buffer)} bytes"
            )
        return buffer[start : start + view["byteLength"]], view.get("byteStride", 0)

    def _item(self, kind: str, index: int) -> dict:
        items = self.document.get(kind, [])
        if not isinstance(index, int) or not 0 <= index < len(items):
            raise self.source.error(
                f"is not valid glTF: it refers to {kind}[{index}] of {len(items)}"
            )
        return items[index]

    def accessor(self, index: int) -> np.ndarray:
        """An accessor's values (count, columns): float64, normalised ones mapped to [0, 1] or [-1,
        1] (3.6.2).
        """
        accessor = self._item("accessors", index)
        dtype, columns, count = (
            np.dtype(COMPONENT[accessor["componentType"]]),
            COLUMNS[accessor["type"]],
            accessor["count"],
        )
        if "bufferView" in accessor:
            place = accessor["bufferView"], accessor.get("byteOffset", 0)
            values = self._items(index, *place, dtype, columns, count)
        elif "sparse" in accessor:
            self._count(index, count)
            values = np.zeros((count, columns))
        else:
            raise self.source.error(
                f"stores accessor {index} in compressed form, which is not read; export it plainly"
            )
        if "sparse" in accessor:  # 3.6.2.3
            values = self._replaced(index, values, accessor["sparse"], dtype)
        if accessor.get("normalized"):
            values = np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values

    def _items(self, index, view, start, dtype, columns, count) -> np.ndarray:
        """`count` items of a buffer view for accessor `index`: (count, columns) float64."""
        data, stride = self._view(view)
        stride = stride or dtype.itemsize * columns
        self._count(index, count)
        if start < 0 or start + (count - 1) * stride + dtype.itemsize * columns > len(data):
            raise self.source.error(
                f"is not valid glTF: accessor {index} asks for {count} items, more than its "
                "bufferView has"
            )
        strides = (stride, dtype.itemsize)
        values = np.ndarray((count, columns), dtype.newbyteorder("<"), data, start, strides)
        return values.astype(np.float64)

    def _count(self, index: int, count: int) -> None:
        """Refuse a number of items that no file of this size can mean."""
        most = max(1_000_000, 100 * sum(map(len, self.buffers)))
        if type(count) is not int or not 1 <= count <= most:
            raise self.source.error(
                f"is not valid glTF: accessor {index} asks for {count} items, more than its "
                "buffers have"
            )

    def _replaced(self, index: int, values: np.ndarray, sparse: dict, dtype) -> np.ndarray:
        """The values of accessor `index` with those that its sparse part gives."""
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        kind = np.dtype(COMPONENT[where["componentType"]])
        at = self._items(
            index, where["bufferView"], where.get("byteOffset", 0), kind, 1, count
        ).astype(np.int64)[:, 0]
        if at.min() < 0 or at.max() >= len(values):
            raise self.source.error(
                f"is not valid glTF: accessor {index} replaces item {at.max()} of {len(values)}"
            )
        place = what["bufferView"], what.get("byteOffset", 0)
        values[at] = self._items(index, *place, dtype, values.shape[1], count)
        return values

    def parts(self) -> list[Part]:
        """All triangles of the scene (3.5.1: the default one, else the first, else every root)."""
        nodes = self.document.get("nodes", [])
        if self.document.get("scenes"):
            roots = self._item("scenes", self.document.get("scene", 0)).get("nodes", [])
        else:
            roots = sorted(
                set(range(len(nodes))).difference(*(node.get("children", []) for node in nodes))
            )
        return [part for root in roots for part in self._placed(root, np.eye(4))]

    def _placed(self, index: int, outer: np.ndarray) -> list[Part]:
        """The parts below a node, in the scene's space."""
        node = self._item("nodes", index)
        if index in self.placed:
            raise self.source.error(
                f"is not valid glTF: node {index} has two parents or is its own; expected trees"
            )
        self.placed.add(index)
        matrix = outer @ _local_matrix(node)
        parts = []
        if "mesh" in node:
            mesh = self._item("meshes", node["mesh"])
            if any(node.get("weights", mesh.get("weights", []))):
                self.source.note(
                    "its morph targets are not applied: the head is read in its base shape"
                )
            if "skin" in node:
                self.source.note("its skeleton is not applied: the head is read as it was modelled")
            name = mesh.get("name") or node.get("name") or UNNAMED
            parts = [
                part
                for primitive in mesh["primitives"]
                if (part := self._part(name, primitive, matrix))
            ]
        return parts + [
            part for child in node.get("children", []) for part in self._placed(child, matrix)
        ]

    def _part(self, mesh_name: str, primitive: dict, matrix: np.ndarray) -> Part | None:
        attributes, mode = primitive["attributes"], primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN):
            self.source.note("its points and lines are not used")
            return None
        if "COLOR_0" in attributes:
            self.source.note(
                "its colours per vertex are not used; skin colour comes from a texture or a "
                "material"
            )
        positions = self.accessor(attributes["POSITION"])
        order = np.arange(len(positions))
        if "indices" in primitive:
            order = self.accessor(primitive["indices"])[:, 0].astype(np.int64)
            if order.max() >= len(positions):
                raise self.source.error(
                    f"the mesh {mesh_name!r} has vertex index {order.max()}, expected 0 to "
                    f"{len(positions) - 1}"
                )
        if mode == TRIANGLES:
            if len(order) % 3:
                raise self.source.error(
                    f"the mesh {mesh_name!r} has {len(order)} corners, expected a multiple of 3"
                )
            faces = order.reshape(-1, 3)
        elif mode == STRIP:
            faces = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
            faces[1::2] = faces[1::2, [1, 0, 2]]
        else:
            faces = np.stack([np.full(len(order) - 2, order[0]), order[1:-1], order[2:]], axis=1)

        normals = self.accessor(attributes["NORMAL"]) if "NORMAL" in attributes else None
        linear = matrix[:3, :3]
        if np.linalg.det(linear) < 0:  # 3.7.4: a mirroring transform turns the winding round
            faces = faces[:, ::-1]
        if normals is not None:
            normals = normals @ np.linalg.pinv(linear)  # inverse transpose, for row vectors
        material, uvs = Material(), None
        if "material" in primitive:
            material, texture = self._material(primitive["material"])
            uvs = self._uvs(attributes, texture)
        elif "TEXCOORD_0" in attributes:
            uvs = self._uvs(attributes, {})
        lengths = {len(values) for values in (positions, normals, uvs) if values is not None}
        if len(lengths) > 1:
            raise self.source.error(
                f"is not valid glTF: the attributes of the mesh {mesh_name!r} have different "
                f"lengths {sorted(lengths)}"
            )
        return Part(
            material.name or mesh_name,
            positions @ linear.T + matrix[:3, 3],
            faces,
            normals,
            uvs,
            material,
        )

    def _uvs(self, attributes: dict, texture: dict) -> np.ndarray | None:
        """Texture coordinates, moved as KHR_texture_transform says, v turned up (glTF's points
        down).
        """
        transform = texture.get("extensions", {}).get("KHR_texture_transform", {})
        name = f"TEXCOORD_{transform.get('texCoord', texture.get('texCoord', 0))}"
        if name not in attributes:
            return None
        uvs = self.accessor(attributes[name]) * transform.get("scale", (1, 1))
        angle = transform.get("rotation", 0.0)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        return (uvs @ turn + transform.get("offset", (0, 0))) * (1, -1) + (0, 1)

    def _material(self, index: int) -> tuple[Material, dict]:
        """A material, and the texture reference that says where its textures lie (3.9)."""
        stored = self._item("materials", index)
        pbr = stored.get("pbrMetallicRoughness", {})
        colour, factor = pbr.get("baseColorTexture"), pbr.get("baseColorFactor")
        if specular := stored.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness"):
            colour, factor = specular.get("diffuseTexture"), specular.get("diffuseFactor")
        rough, normal = pbr.get("metallicRoughnessTexture"), stored.get("normalTexture")
        references = [reference for reference in (colour, rough, normal) if reference]
        places = [
            (r.get("texCoord", 0), r.get("extensions", {}).get("KHR_texture_transform", {}))
            for r in references
        ]
        if any(place != places[0] for place in places):
            raise self.source.error(
                f"the material {stored.get('name', index)!r} lays its textures out "
                "differently; expected one layout"
            )
        texture = references[0] if references else {}
        if index not in self.materials:
            tint = tuple(float(value) for value in factor[:3]) if factor else None
            self.materials[index] = Material(
                name=stored.get("name"),
                albedo=_tinted(self._image(colour), tint or (1.0, 1.0, 1.0)) if colour else None,
                base_colour=tint,
                normal_map=_scaled_normals(self._image(normal), normal.get("scale", 1.0))
                if normal
                else None,
                roughness=self._roughness(rough, pbr.get("roughnessFactor", 1.0))
                if rough
                else None,
                roughness_factor=pbr.get("roughnessFactor"),
            )
        return self.materials[index], texture

    def _roughness(self, reference: dict, factor: float) -> np.ndarray:
        return np.rint(self._image(reference)[..., 1] * factor).astype(
            np.uint8
        )  # 3.9.2: roughness is in green

    def _image(self, reference: dict) -> np.ndarray:
        texture = self._item("textures", reference["index"])
        index = texture.get("extensions", {}).get("EXT_texture_webp", texture).get("source")
        if index is None:
            raise self.source.error(
                f"has texture {reference['index']} in a form that is not read; export it as "
                "PNG or JPEG"
            )
        if index not in self.images:
            image = self._item("images", index)
            name = image.get("name") or f"image {index}"
            if "uri" in image:
                name = name if image["uri"].startswith("data:") else unquote(image["uri"])
                data = self._uri(image["uri"], "texture")
            else:
                data = self._view(image["bufferView"])[0]
            self.images[index] = self.source.image(data, name)
        return self.images[index]


def _local_matrix(node: dict) -> np.ndarray:
    """A node's transform: its matrix, or T R S (3.5.2)."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= node.get("scale", (1, 1, 1))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _tinted(image: np.ndarray, factor: tuple[float, ...]) -> np.ndarray:
    """An sRGB image times a linear factor (3.9.2), in sRGB."""
    if all(value == 1 for value in factor):
        return image
    table = np.stack(
        [encode_srgb(decode_srgb(np.arange(256) / 255) * value) for value in factor], axis=1
    )
    return np.rint(np.stack([table[image[..., i], i] for i in range(3)], axis=-1) * 255).astype(
        np.uint8
    )


def _scaled_normals(image: np.ndarray, scale: float) -> np.ndarray:
    """A normal map with x and y times `normalTexture.scale` (3.9.3), of unit length again."""
    if scale == 1:
        return image
    normals = (image / 127.5 - 1) * (scale, scale, 1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True).clip(1e-6)
    return np.rint((normals + 1) * 127.5).astype(np.uint8)
