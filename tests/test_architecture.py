"""Data flows one way: which package may import which, read from the source."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MAY_IMPORT = {
    "renderer": set(),
    "analysis": set(),
    # what a manifest and a declared analysis are: one schema, standard library alone; and which
    # pairs an adaptive design asks: one rule
    "stimuli": {
        "renderer",
        "analysis.adaptive",
        "analysis.declared",
        "analysis.errors",
        "analysis.files",
        "analysis.manifest",
    },
    "app": {
        "analysis",
        "stimuli.design",
        "stimuli.errors",
        "stimuli.manifest",
        "stimuli.study",
        "stimuli.viewing",
        "stimuli.asking",
        "stimuli.languages",
    },
}
PROFILE_VERBS = {
    "profile",
    "fit",
    "redraw",
    "judge",
    "montecarlo",
    "media",
    "cache",
}  # what they hand over to needs no OpenGL
MODULES = [path for package in MAY_IMPORT for path in sorted((ROOT / package).rglob("*.py"))]


def imported(source: str, package: str) -> set[str]:
    """The dotted names that a module of `package` imports: modules, and what is taken from them."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = (
                package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            )
            base = ".".join([*parts, *([node.module] if node.module else [])])
            names.update(f"{base}.{alias.name}" for alias in node.names)
    return names


def forbidden(names: set[str], package: str, allowed: set[str]) -> set[str]:
    """Those of `names` that lie in another package of ours and in none of the allowed modules."""
    ours = {
        name for name in names if name.split(".")[0] in MAY_IMPORT and name.split(".")[0] != package
    }
    return {
        name for name in ours if not any(f"{name}.".startswith(f"{module}.") for module in allowed)
    }


def test_the_rule_finds_what_it_forbids():
    source = (
        "import renderer.gl\nfrom stimuli import build, study\nfrom .. import x\nfrom "
        "..a import y\nimport numpy"
    )
    names = imported(source, "app.sub")
    assert names == {"renderer.gl", "stimuli.build", "stimuli.study", "app.x", "app.a.y", "numpy"}
    assert forbidden(names, "app", MAY_IMPORT["app"]) == {"renderer.gl", "stimuli.build"}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_imports(path):
    relative = path.relative_to(ROOT)
    package = relative.parts[0]
    allowed = MAY_IMPORT[package]
    if (
        relative.parent.as_posix() == "app/commands"
    ):  # a verb hands over to the stage that has its name
        allowed = (
            allowed
            | {f"stimuli.{relative.stem}"}
            | ({"renderer", "stimuli.scenes"} if relative.stem == "render" else set())
            | ({"renderer.scene"} if relative.stem == "harmonics" else set())
            | ({"renderer"} if relative.stem == "techniques" else set())
            | ({"stimuli.folder"} if relative.stem == "study" else set())
        )
        allowed |= (
            {"renderer.errors", "renderer.caches", "renderer.optics"}
            if relative.stem in PROFILE_VERBS
            else set()
        )
    assert not forbidden(
        imported(path.read_text(), ".".join(relative.parts[:-1])), package, allowed
    )


def at_import(source: str) -> set[str]:
    """What a module imports when it is imported: not in functions, not for types."""
    names: set[str] = set()
    waiting = list(ast.parse(source).body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Try):
            waiting += node.body
    return names


def test_no_import_goes_in_a_circle():
    """Inside packages, too: each module stands on others that do not need it."""
    import networkx

    files = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in MODULES
    }
    graph = networkx.DiGraph()
    for name, path in files.items():
        graph.add_node(name)
        for other in at_import(path.read_text()) & files.keys():
            if other != name and not name.startswith(f"{other}."):
                graph.add_edge(name, other)
    circles = [
        sorted(part) for part in networkx.strongly_connected_components(graph) if len(part) > 1
    ]
    assert not circles


def test_application_never_imports_opengl():
    """The questionnaire must run where there is no graphics at all."""
    names = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in sorted((ROOT / "app").rglob("*.py"))
        if "migrations" not in path.parts
    ]
    assert {"app", "app.cli", "app.commands.serve", "app.commands.render"} <= set(names)
    program = (
        "import sys, importlib\nfor name in sys.argv[1:]: "
        "importlib.import_module(name)\nprint(*sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, *names],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    modules = set(run.stdout.split())
    assert "flask" in modules
    assert not modules & {"OpenGL", "pyrender", "pyglet", "renderer"}


def test_a_study_is_checked_without_the_statistics():
    """stimuli takes the schema of manifests and of [analysis] from analysis, and no more."""
    program = "import sys, stimuli.study, stimuli.manifest; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    modules = set(run.stdout.split())
    assert "analysis.declared" in modules
    assert not modules & {"scipy", "pandas", "matplotlib", "renderer"}


def test_profiles_never_import_opengl():
    names = [
        f"renderer.optics.{path.stem}"
        for path in sorted((ROOT / "renderer/optics").glob("[!_]*.py"))
    ]
    program = (
        "import sys, importlib\nfor name in sys.argv[1:]: "
        "importlib.import_module(name)\nprint(*sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program, "renderer.optics.medium", *names],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert not set(run.stdout.split()) & {"OpenGL", "pyrender", "pyglet", "trimesh", "matplotlib"}


@pytest.mark.skipif(sys.platform != "linux", reason="EGL and OSMesa are Linux's")
def test_renderer_needs_no_x_server():
    """pyrender's viewer, which is imported with it, must not look for the libraries of a screen."""
    program = "import sys, renderer.scene.graph; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    modules = set(run.stdout.split())
    assert "pyrender.viewer" in modules and not any(
        name.startswith("pyglet.libs.x11") for name in modules
    )


def room(path: Path) -> str:
    """The package or sub-package of a file, as the picture calls it: app_commands, renderer."""
    parts = path.relative_to(ROOT).parts[:-1]
    return "_".join(parts[:2])


def test_the_picture_of_the_rooms_is_that_of_the_imports():
    """docs/architecture.md draws no arrow that is not there, and leaves out only those that follow
    from it: into a package's own top (errors, parameters), or by a way that it draws.
    """
    import networkx

    text = (ROOT / "docs/architecture.md").read_text().split("flowchart TD")[1].split("```")[0]
    drawn = networkx.DiGraph()
    for line in text.strip().splitlines():
        source, target = (end.strip().split("[")[0] for end in line.split("-->"))
        drawn.add_edge(source, target)
    real = networkx.DiGraph()
    files = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in MODULES
    }
    for path in MODULES:
        package = ".".join(path.relative_to(ROOT).parts[:-1])
        for name in imported(path.read_text(), package):
            file = files.get(name) or files.get(name.rpartition(".")[0])
            if file and room(file) != room(path):
                real.add_edge(room(path), room(file))
    assert not set(drawn.edges) - set(real.edges)
    followed = networkx.transitive_closure(drawn)
    for source, target in real.edges:
        own_top = source.startswith(f"{target}_") or target.startswith(f"{source}_")
        by_a_way = own_top or followed.has_edge(source, target) or target == "renderer"
        assert by_a_way, (source, target)


def test_what_git_tracks_at_the_top_is_the_house():
    """A file that a slip of the shell wrote and a commit took along is found here."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split("\0")
    folders = {path.split("/")[0] for path in listed if "/" in path}
    assert folders == {
        *(".ci", "analysis", "app", "benchmarks", "docs", "examples", "renderer", "stimuli"),
        *("templates", "tests", "tools"),
    }
    files = {path for path in listed if path and "/" not in path}
    odd = {name for name in files if not all(c.isalnum() or c in "._-" for c in name)}
    assert not odd, odd
