"""It installs as a wheel, which has inside its packages what a checkout has beside them."""

import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import renderer

ROOT = Path(__file__).resolve().parents[1]
TABLE = """participant,familiarity,framing,left,right,answer,order,rt_ms,started_at
P1,3,near,unreal,blender,1,1,900,2024-05-01T09:00:00Z
P2,2,near,blender,unreal,-1,1,800,2024-05-01T09:00:00Z
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    options = ["--no-deps", "--no-build-isolation", "--quiet", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "wheel", str(ROOT), *options, "-w", str(folder)]
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    (file,) = folder.glob("subdermal-*.whl")
    return file


def test_it_holds_what_is_needed_and_no_package_of_another_name(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    top = {name.split("/")[0] for name in names}
    assert {name for name in top if ".dist-info" not in name} == {
        "analysis",
        "app",
        "renderer",
        "stimuli",
    }
    for needed in (
        "app/templates/questionnaire/question.html",
        "app/static/style.css",
        "app/migrations/versions/0002_cells.py",
        "analysis/templates/report.typ",
        "analysis/templates/report.html",
        "renderer/passes/skin.frag",
        "renderer/passes/square.geom",
        "renderer/techniques/golubev.glsl",
        "stimuli/scenes/thesis.toml",
        "stimuli/people/man.toml",
        "stimuli/studies/thesis.toml",
    ):
        assert needed in names, needed


def test_it_serves_and_analyses_away_from_the_checkout(wheel, tmp_path):
    """Unpacked where no checkout is: help, a study's first page, a report, a scene."""
    place = tmp_path / "installed"
    zipfile.ZipFile(wheel).extractall(place)
    (tmp_path / "responses.csv").write_text(TABLE)
    study = ROOT / "tests/app/first_edition"
    (tmp_path / "study").mkdir()
    for path in study.iterdir():
        if path.suffix in (".png", ".json"):
            (tmp_path / "study" / path.name).write_bytes(path.read_bytes())
    program = """
import app, sys
assert "installed" in app.__file__, app.__file__
page = app.create_app("study").test_client().get("/")
assert page.status_code == 200 and b"Which engine?" in page.data
from app.cli import main
assert main(["analyse", "responses.csv", "--out", "report"]) == 0
from stimuli import scenes
assert scenes.read_scene(scenes.load_table("thesis")).lights
"""
    run = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(place)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "report" / "report.html").is_file()
    assert (tmp_path / "report" / "report.pdf").is_file()


def test_one_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == renderer.VERSION
    assert f"version: {renderer.VERSION}" in (ROOT / "CITATION.cff").read_text()
