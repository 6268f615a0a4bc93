"""Which files an image is rendered anew for."""

import pytest

import renderer
from stimuli import sources


def files(module):
    """Of a technique's images, below the checkout."""
    own = sources.shared() | sources.of_technique(module)
    return {path.relative_to(sources.ROOT).as_posix() for path in own}


def test_an_image_hangs_on_its_technique_and_on_what_all_share():
    plus = files("renderer.techniques.golubev_plus")
    assert {
        "renderer/techniques/golubev_plus.py",
        "renderer/techniques/golubev_plus.glsl",
        "renderer/techniques/golubev.py",
        "renderer/shaders/burley_disc.glsl",
        "renderer/passes/skin.frag",
        "renderer/frame.py",
        "renderer/renderer.py",
        "renderer/optics/fits.py",
        "stimuli/heads/skin.py",
    } <= plus
    assert not plus & {
        "renderer/optics/judge.py",
        "renderer/techniques/jimenez_gaussian.py",
        "renderer/techniques/jimenez_gaussian.glsl",
        "stimuli/study.py",
        "stimuli/build.py",
    }
    assert "renderer/techniques/golubev_plus.glsl" not in files("renderer.techniques.golubev")


@pytest.mark.parametrize("name", renderer.TECHNIQUES)
def test_a_technique_brings_its_shader_and_its_bases(name):
    own = files(f"renderer.techniques.{name}")
    base = {"atlas": "atlas_seen.glsl", "points": "splat.frag"}.get(
        renderer.TECHNIQUES[name].domain, f"{name}.glsl"
    )
    assert f"renderer/techniques/{base}" in own


def test_no_shader_is_nobodys():
    folder = sources.ROOT / "renderer/techniques"
    shaders = {path.name for path in folder.iterdir() if path.suffix in (".glsl", ".frag", ".vert")}
    named = {file for name in renderer.TECHNIQUES for file in files(f"renderer.techniques.{name}")}
    assert shaders <= {file.rsplit("/", 1)[1] for file in named}


@pytest.mark.parametrize(
    ("file", "changes"), [("optics/judge.py", False), ("techniques/golubev.glsl", True)]
)
def test_a_comment_in_a_file_changes_the_digest_of_what_hangs_on_it(
    file, changes, tmp_path, monkeypatch
):
    for folder in ("renderer", "stimuli"):
        for path in (sources.ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".glsl", ".frag", ".vert", ".geom"):
                copy = tmp_path / path.relative_to(sources.ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.write_bytes(path.read_bytes())
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    before = sources.digest("renderer.techniques.golubev")
    with (tmp_path / "renderer" / file).open("a") as handle:
        handle.write("\n# a comment\n" if file.endswith(".py") else "\n// a comment\n")
    assert (sources.digest("renderer.techniques.golubev") != before) is changes
