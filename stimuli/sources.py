"""Which files shape an image: what is rendered anew when one of them changes.

Python modules are followed by their imports; shaders that techniques share are all of
renderer/passes and renderer/shaders, and a technique's own are those beside its module and those
that it names. So a comment in the study code, or in another technique, leaves an image as it is.
"""

from __future__ import annotations

import ast
import hashlib
import re
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SHADERS = ("*.glsl", "*.vert", "*.frag", "*.geom")
NAMED = re.compile(r"techniques/(\w+)")
#: Where following starts for every image.
SHARED = ("renderer.renderer", "stimuli.scenes.staging")


@lru_cache(maxsize=256)
def _imports(path: Path) -> frozenset[str]:
    """The dotted names that a file imports from the packages that draw."""
    names = set()
    waiting = list(ast.parse(path.read_bytes()).body)
    while waiting:  # statements alone: most of a file's nodes are in expressions
        node = waiting.pop()
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module)
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
        for held in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting += getattr(node, held, ())
    return frozenset(n for n in names if n.split(".")[0] in ("renderer", "stimuli"))


def _file(name: str) -> Path | None:
    """The file of a dotted name, None where it names something inside a module."""
    path = ROOT.joinpath(*name.split("."))
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        if file.is_file():
            return file
    return None


def modules(*names: str) -> set[Path]:
    """The files of modules and of all that they import; the table of techniques is not followed."""
    files: set[Path] = set()
    waiting = list(names)
    while waiting:
        path = _file(waiting.pop())
        if path is None or path in files or path == ROOT / "renderer/techniques/__init__.py":
            continue
        files.add(path)
        waiting += _imports(path)
    return files


def shared() -> set[Path]:
    """The files behind every image, whatever its technique."""
    files = modules(*SHARED)
    for folder in ("renderer/passes", "renderer/shaders"):
        for pattern in SHADERS:
            files.update((ROOT / folder).glob(pattern))
    files.update(path for path in (ROOT / "stimuli/heads").rglob("*") if path.suffix == ".npz")
    return files


def of_technique(module: str) -> set[Path]:
    """The files of a technique's module: what it imports, the shaders that are named as its modules
    and those that a module or a shader of these names.
    """
    files, folder = modules(module), ROOT / "renderer/techniques"
    shaders = {path for pattern in SHADERS for path in folder.glob(pattern)}
    waiting = list(files)
    while waiting:
        path = waiting.pop()
        names = set(NAMED.findall(path.read_text(encoding="utf-8")))
        if path.parent == folder:
            names.add(path.stem)
        new = {shader for shader in shaders - files if shader.stem in names}
        files |= new
        waiting += new
    return files


def digest(module: str) -> str:
    """The sha256 of all that shapes an image of the technique in `module`."""
    sha256 = hashlib.sha256()
    for path in sorted(shared() | of_technique(module)):
        sha256.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return sha256.hexdigest()
