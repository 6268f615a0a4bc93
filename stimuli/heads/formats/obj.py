"""Wavefront OBJ with its material library (MTL).

P. Bourke's transcription of the specification (Appendix B1, "Object files") and, for `map_Pr` and
`norm`, the physically based extension of Exocortex's Clara.io that Blender writes.
"""

import re
from dataclasses import replace

import numpy as np

from stimuli.heads.formats import UNNAMED, Material, Part, Source

WIDTHS = {b"v": (3, 4, 6, 7), b"vt": (1, 2, 3), b"vn": (3,)}
"""How many values each kind of line may have: v also with a weight or with a colour, vt also with
a depth.
"""

OPTION_VALUES = {"-mm": 2, "-o": 3, "-s": 3, "-t": 3}
"""How many values an option of a texture has in an MTL file (the last three: at most); every other
one has one.
"""


def read(source: Source) -> list[Part]:
    """Read the parts of an OBJ file: one for each material, or each group where there are no
    materials.
    """
    text = (
        source.content()
        .replace(b"\r\n", b"\n")
        .replace(b"\r", b"\n")
        .replace(b"\\\n", b"  ")
        .replace(b"\t", b" ")
    )
    if b"\0" in text[:4096]:
        raise source.error("is not a text file; expected Wavefront OBJ")
    lines = _Lines(re.sub(rb"(?m)^ +", b"", text) + b"\n", source)
    positions, uvs, normals = lines.numbers(b"v"), lines.numbers(b"vt"), lines.numbers(b"vn")
    if positions.shape[1] >= 6:
        source.note("its colours per vertex are not used; skin colour comes from a texture")
    corners, face_starts, face_lines = lines.faces(
        {b"v": len(positions), b"vt": len(uvs), b"vn": len(normals)}
    )

    # Fan of each polygon with n corners: (first, first + k, first + k + 1), k = 1 .. n - 2.
    triangles_of = np.diff(face_starts, append=len(corners)) - 2
    first = np.repeat(face_starts, triangles_of)
    step = (
        np.arange(len(first)) - np.repeat(np.cumsum(triangles_of) - triangles_of, triangles_of) + 1
    )
    triangles = np.stack([first, first + step, first + step + 1], axis=1)

    names, face_name = lines.names(face_lines)
    triangle_name = np.repeat(face_name, triangles_of)
    library = _library(source, lines)
    parts = []
    for index in np.unique(triangle_name):
        name, is_material = names[index]
        used, faces = np.unique(triangles[triangle_name == index], return_inverse=True)
        v, vt, vn = corners[used].T
        # A vertex of ours is a distinct triple (v, vt, vn): number the pairs, then the triples.
        pair = np.unique(v * (len(uvs) + 1) + vt + 1, return_inverse=True)[1]
        sample, vertex = np.unique(
            pair * (len(normals) + 1) + vn + 1, return_index=True, return_inverse=True
        )[1:]
        v, vt, vn = v[sample], vt[sample], vn[sample]
        parts.append(
            Part(
                name=name,
                positions=positions[v, :3],
                faces=vertex[faces.reshape(-1, 3)],
                normals=normals[vn] if vn.min() >= 0 else None,
                uvs=np.pad(uvs, ((0, 0), (0, 1)))[vt, :2] if vt.min() >= 0 else None,
                material=library.get(name, Material(name)) if is_material else Material(),
            )
        )
    return parts


class _Lines:
    """The lines of an OBJ file, found by their first word, without a Python loop over them."""

    def __init__(self, text: bytes, source: Source):
        self.text, self.source = text, source
        self.bytes = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(self.bytes == ord("\n"))
        self.starts = np.concatenate([[0], ends[:-1] + 1])
        self.lengths = ends - self.starts + 1

    def of(self, word: bytes) -> np.ndarray:
        """Indices of the lines that begin with this word (and a space)."""
        matches = np.ones(len(self.starts), bool)
        for offset, letter in enumerate(word + b" "):
            at = np.minimum(self.starts + offset, len(self.bytes) - 1)
            matches &= self.bytes[at] == letter
        return np.flatnonzero(matches)

    def rest(self, line: int, word: bytes) -> str:
        """A line without its first word and comment."""
        start = self.starts[line]
        return (
            self.text[start + len(word) : start + self.lengths[line]]
            .partition(b"#")[0]
            .decode("utf-8", "replace")
            .strip()
        )

    def body(self, lines: np.ndarray, word: bytes) -> np.ndarray:
        """The bytes of these lines, the first word of each blanked."""
        mask = np.zeros(len(self.starts), bool)
        mask[lines] = True
        body = self.bytes[np.repeat(mask, self.lengths)].copy()
        starts = np.cumsum(self.lengths[lines]) - self.lengths[lines]
        for offset in range(len(word)):
            body[starts + offset] = ord(" ")
        if (body == ord("#")).any():  # a comment behind the values
            body = np.frombuffer(
                re.sub(rb"#[^\n]*", lambda m: b" " * len(m[0]), body.tobytes()), np.uint8
            )
        return body

    def numbers(self, word: bytes) -> np.ndarray:
        """The values of all v, vt or vn lines: (lines, values a line) float64; (0, 3) where there
        are none.
        """
        lines = self.of(word)
        if not len(lines):
            return np.empty((0, 3))
        try:
            values = np.fromstring(self.body(lines, word).tobytes(), sep=" ")
            width, rest = divmod(len(values), len(lines))
            if not rest and width in WIDTHS[word]:
                return values.reshape(-1, width)
        except ValueError:
            pass
        usual = len(self.rest(lines[0], word).split())  # now that something is wrong, find where
        for line in lines:
            text = self.rest(line, word)
            values = re.split(" +", text)
            if (
                len(values) != usual
                or usual not in WIDTHS[word]
                or not all(map(_is_number, values))
            ):
                break
        wanted = " or ".join(map(str, WIDTHS[word]))
        raise self.source.error(
            f"line {line + 1}: found {f'{word.decode()} {text}'[:60]!r}, expected {wanted} "
            "numbers, the same count on every such line"
        )

    def faces(self, counts: dict[bytes, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The corners (k, 3) of all faces as indices from 0 into v, vt, vn (-1: not given), where
        each face begins, and its line.
        """
        lines = self.of(b"f")
        if not len(lines):
            return np.empty((0, 3), np.int64), np.empty(0, np.int64), lines
        body = self.body(lines, b"f")
        line_of_byte = np.repeat(np.arange(len(lines)), self.lengths[lines])
        blank = (body == ord(" ")) | (body == ord("\n"))
        tokens = np.flatnonzero(~blank & np.concatenate([[True], blank[:-1]]))
        line_of_token = line_of_byte[tokens]
        corners_of = np.bincount(line_of_token, minlength=len(lines))

        def at(line: int, expected: str) -> Exception:
            return self.source.error(
                f"line {lines[line] + 1}: found "
                f"{('f ' + self.rest(lines[line], b'f'))[:60]!r}, expected {expected}"
            )

        if (corners_of < 3).any():
            raise at(np.argmax(corners_of < 3), "a face of three corners or more")
        # A corner is "v", "v/vt", "v//vn" or "v/vt/vn": count its slashes, then read all numbers at
        # once.
        slashes = np.add.reduceat((body == ord("/")).astype(np.int64), tokens)
        if (slashes > 2).any():
            raise at(
                line_of_token[np.argmax(slashes > 2)],
                "corners of the form v, v/vt, v//vn or v/vt/vn",
            )
        try:
            values = np.fromstring(
                body.tobytes().replace(b"//", b"/0/").replace(b"/", b" "), dtype=np.int64, sep=" "
            )
            whole = len(values) == (slashes + 1).sum()
        except ValueError:
            whole = False
        if not whole:
            corner = re.compile(r"-?\d+(/-?\d+|/-?\d*/-?\d+)?")
            bad = (
                i
                for i, line in enumerate(lines)
                if not all(map(corner.fullmatch, self.rest(line, b"f").split()))
            )
            raise at(next(bad), "corners of the form v, v/vt, v//vn or v/vt/vn, in whole numbers")
        begin = np.cumsum(slashes + 1) - (slashes + 1)
        corners = np.zeros((len(tokens), 3), np.int64)
        for column in range(3):
            given = slashes >= column
            corners[given, column] = values[begin[given] + column]

        for column, word in enumerate((b"v", b"vt", b"vn")):
            index = corners[:, column]
            relative = index < 0  # counts back from the last one defined before the face
            index[relative] += np.searchsorted(self.of(word), lines[line_of_token[relative]]) + 1
            bad = (index > counts[word]) | (index < 1) & (relative | (word == b"v"))
            if bad.any():
                raise at(
                    line_of_token[np.argmax(bad)],
                    f"{word.decode()} indices from 1 to {counts[word]}",
                )
        return corners - 1, np.cumsum(corners_of) - corners_of, lines

    def names(self, face_lines: np.ndarray) -> tuple[list[tuple[str, bool]], np.ndarray]:
        """The names (and whether each is a material's) of the parts,
        and the index of each face's.
        """
        word = next((word for word in (b"usemtl", b"g") if len(self.of(word))), b"o")
        lines = self.of(word)
        labels = [(UNNAMED, False)] + [(self.rest(line, word), word == b"usemtl") for line in lines]
        index = {label: i for i, label in enumerate(dict.fromkeys(labels))}
        of_label = np.array([index[label] for label in labels])
        return list(index), of_label[np.searchsorted(lines, face_lines)]


def _is_number(text: str) -> bool:
    return (
        re.fullmatch(
            r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|[-+]?(nan|inf(inity)?)",
            text,
            re.ASCII | re.IGNORECASE,
        )
        is not None
    )


def _library(source: Source, lines: _Lines) -> dict[str, Material]:
    """The materials of every library that the file names; one that is missing is told of, for its
    colours are then unknown.
    """
    materials: dict[str, Material] = {}
    images: dict[str, np.ndarray] = {}
    for line in lines.of(b"mtllib"):
        name = lines.rest(line, b"mtllib")
        if source.find(name) is None:
            source.note(
                f"its material library {name!r} is not there: parts keep their names but have "
                "no textures"
            )
            continue
        current = None
        for text in source.beside(name, "material library").decode("utf-8", "replace").splitlines():
            word, _, rest = text.partition("#")[0].strip().partition(" ")
            word, rest = word.lower(), rest.strip()
            if word == "newmtl":
                current = rest
                materials[current] = Material(current)
            elif current is not None and rest:
                materials[current] = replace(
                    materials[current], **_property(source, images, word, rest)
                )
    return materials


def _property(source: Source, images: dict[str, np.ndarray], word: str, rest: str) -> dict:
    """What one line of a material sets.

    Kd is taken as linear, and not multiplied onto map_Kd: exporters rarely mean it.
    """
    if word == "kd":
        values = rest.split()
        if values[0] in ("spectral", "xyz"):
            return {}
        colour = tuple(float(value) if _is_number(value) else np.nan for value in values)
        if len(colour) not in (1, 3) or not all(0 <= value <= 1 for value in colour):
            raise source.error(
                f"its material library has the colour {f'Kd {rest}'!r}; expected three "
                "numbers from 0 to 1"
            )
        return {"base_colour": colour * (3 // len(colour))}
    if word == "pr":
        return (
            {"roughness_factor": float(rest)} if _is_number(rest) and 0 <= float(rest) <= 1 else {}
        )
    if word not in ("map_kd", "map_pr", "norm", "map_kn", "map_bump", "bump"):
        return {}
    name = _texture_name(source, rest)
    if name not in images:
        images[name] = source.image(source.beside(name, "texture"), name)
    image = images[name]
    if word == "map_kd":
        return {"albedo": image}
    if word == "map_pr":
        return {
            "roughness": images.setdefault(f"{name} (grey)", np.ascontiguousarray(image[..., 1]))
        }
    if word in ("norm", "map_kn") or _looks_like_normals(image):
        return {"normal_map": image}
    source.note(
        f"its bump map {name!r} is not used: it holds heights of unknown scale, not normals"
    )
    return {}


def _texture_name(source: Source, rest: str) -> str:
    """The file name behind the options of a map line, which may hold spaces."""
    words = rest.split(" ")
    while len(words) > 1 and words[0].startswith("-"):
        option, *words = words
        count = 0
        while (
            count < OPTION_VALUES.get(option, 1)
            and len(words) > 1
            and (option not in ("-o", "-s", "-t") or _is_number(words[0]))
        ):
            value, *words = words
            count += 1
            if option in ("-o", "-s") and float(value) != (option == "-s"):
                raise source.error(
                    f"its material library moves or scales a texture ({rest!r}), which is not "
                    "supported; bake it first"
                )
    return " ".join(words).strip()


def _looks_like_normals(image: np.ndarray) -> bool:
    """Whether an image holds tangent-space normals: mostly (0, 0, 1), stored as (128, 128, 255)."""
    mean = image.reshape(-1, 3).mean(axis=0)
    return bool(np.abs(mean[:2] - 128).max() < 24 and mean[2] > 180)
