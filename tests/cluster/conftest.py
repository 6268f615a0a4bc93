"""A small study that is really drawn: two media, two cameras, two techniques."""

import pytest

from stimuli.build import build
from stimuli.study import load_study

SCENE = """
[objects.bar]
shape = "slab"
size_mm = [40.0, 20.0, 20.0]
[materials.bar]
medium = "deon_luebke"
[lights.lamp]
kind = "point"
position_mm = [-150.0, 130.0, 160.0]
irradiance = [1.0, 1.0, 1.0]
[environment]
ambient = [0.1, 0.1, 0.1]
[camera]
framing = "near"
height_mm = 40.0
yaw_deg = 0.0
[picture]
exposure = 1.0
"""
STUDY = """
name = "bars"
title = "Which is softer?"
version = 1
seed = 7
scene = "bar.toml"
[render]
size = [48, 27]
supersample = 1
seed = 5
[[framings]]
name = "near"
label = "Near"
set = { camera = { framing = "near", height_mm = 40.0, yaw_deg = 0.0 } }
[[framings]]
name = "far"
label = "Far"
set = { camera = { framing = "far", height_mm = 70.0, yaw_deg = 20.0 } }
[[factors]]
name = "medium"
label = "Medium"
[[factors.levels]]
name = "skin"
label = "Skin"
set = { materials = { bar = { medium = "deon_luebke" } } }
[[factors.levels]]
name = "dermis"
label = "Dermis"
set = { materials = { bar = { medium = "skin1" } } }
[[techniques]]
name = "none"
label = "None"
[[techniques]]
name = "golubev"
label = "Golubev"
"""


@pytest.fixture(scope="session")
def study(tmp_path_factory):
    """The path of the study."""
    folder = tmp_path_factory.mktemp("bars")
    (folder / "bar.toml").write_text(SCENE)
    (folder / "bars.toml").write_text(STUDY)
    return folder / "bars.toml"


@pytest.fixture(scope="session")
def contents():
    """All files of a folder, by their names."""
    return lambda folder: {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="session")
def here(study, tmp_path_factory, contents):
    """The files that this process makes of it."""
    out = tmp_path_factory.mktemp("here")
    build(load_study(study), out)
    files = contents(out)
    assert len(files) == 8 + 8 + 4 + 1  # images, their records, a mask a cell, the manifest
    return files
