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
BALL = """
subject = "ball"
[objects.ball]
shape = "sphere"
radius_mm = 20.0
[lights.sun]
direction = [0.5, 0.5, 1.0]
irradiance = [3.0, 3.0, 3.0]
"""
STUDY = """
name = "balls"
title = "Which ball?"
version = 1
seed = 1
scene = "ball.toml"
[render]
size = [48, 27]
supersample = 1
[[framings]]
name = "ball"
label = "Ball"
set = { camera = { framing = "ball", height_mm = 60.0, angle = "front" } }
[[techniques]]
name = "none"
label = "None"
[[techniques]]
name = "golubev"
label = "Golubev"
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
        "app/translations/zh/LC_MESSAGES/messages.mo",
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


def test_it_builds_serves_simulates_and_analyses_away_from_the_checkout(wheel, tmp_path):
    """Unpacked where no checkout is: a scene, its images, a first page, answers, a report."""
    place = tmp_path / "installed"
    zipfile.ZipFile(wheel).extractall(place)
    (tmp_path / "ball.toml").write_text(BALL)
    (tmp_path / "study.toml").write_text(STUDY)
    program = """
import app, sys
assert "installed" in app.__file__, app.__file__
from app.cli import main
assert main(["build", "study.toml", "--out", "study"]) == 0
page = app.create_app("study").test_client().get("/")
assert page.status_code == 200 and b"Which ball?" in page.data
from app.catalogues import catalogue
assert catalogue("it").gettext("Continue") == "Continua"
assert main(["simulate", "study", "--participants", "2", "--seed", "1"]) == 0
answers = "study/simulated/responses.csv"
assert main(["analyse", answers, "--study", "study", "--out", "report"]) == 0
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
