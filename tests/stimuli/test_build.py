"""The build, with a renderer that draws coloured rectangles: what it renders, keeps, writes and
refuses.
"""

import dataclasses
import json
import os
import shutil
import subprocess
from concurrent.futures import Executor, Future

import numpy as np
import PIL.Image
import pytest

import stimuli.build
import stimuli.drawing
from stimuli.build import Built, build
from stimuli.errors import InputError, Stopped
from stimuli.manifest import load_manifest, sha256
from stimuli.study import load_study

IMAGES = ["near_plain.png", "near_soft.png", "far_plain.png", "far_soft.png"]


def built(rendered, kept):
    return Built(rendered, kept, notes=("a sphere has no face",))


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def test_manifest_tells_how_each_image_was_made(small_study, fake_renderer, out):
    assert build(small_study, out) == built(4, 0)
    manifest = load_manifest(out)
    assert manifest.study.record() == small_study.record()
    assert [image.file for image in manifest.images] == [f"images/{file}" for file in IMAGES]
    image = manifest.image("far", "soft")
    assert image.sha256 == sha256(image.path) and PIL.Image.open(image.path).size == (32, 18)
    assert image.parameters == {"technique": "blur", "supersample": 1, "radius_mm": 2.5}
    assert image.seed == 5
    assert image.measures == {
        "samples_per_pixel": 6.5
    }  # of 4 and 9; nothing is scattered where there are 0
    assert image.renderer == {"version": "1", "gl_vendor": "fake", "commit": stimuli.build.commit()}
    assert image.head == {"source": "a sphere"}
    assert manifest.licences[0]["licence"] == "CC0-1.0"
    assert len({image.sha256 for image in manifest.images}) == 4


def test_times_are_measured_when_asked_and_kept(small_study, fake_renderer, out):
    build(small_study, out)
    assert build(small_study, out, rounds=3) == built(0, 4)
    expected = [2.0, 4.0, 2.0, 4.0]
    assert [image.measures["milliseconds"] for image in load_manifest(out).images] == expected
    assert build(small_study, out) == built(0, 4)
    assert [image.measures["milliseconds"] for image in load_manifest(out).images] == expected


def test_shared_passes_are_drawn_once_per_framing(small_study, fake_renderer, out):
    build(small_study, out)
    assert fake_renderer.frames == ["near", "far"]


def test_one_seed_gives_the_same_bytes_anywhere(small_study, fake_renderer, tmp_path):
    build(small_study, tmp_path / "one")
    build(small_study, tmp_path / "two")
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert str(tmp_path).encode() not in b"".join(contents(tmp_path / "one").values())


def test_second_build_renders_nothing_and_changes_nothing(small_study, fake_renderer, out):
    build(small_study, out)
    before = contents(out)
    assert build(small_study, out) == built(0, 4)
    assert len(fake_renderer.drawn) == 4 and contents(out) == before
    assert build(small_study, out, force=True) == built(4, 0)
    assert contents(out) == before


def as_one_file(out, version, **more):
    """Puts the records of a folder into one file, as builds of before kept them."""
    images = {}
    for path in (out / "records").iterdir():
        done = json.loads(path.read_text())
        images[done.pop("file")] = {key: done[key] for key in done if key != "format"}
    images |= dict.fromkeys(more.get("gone", ()), images[f"images/{IMAGES[0]}"])
    if version == 1:
        images = {file: {"key": one["key"], "image": one["image"]} for file, one in images.items()}
    shutil.rmtree(out / "records")
    record = {"format": f"subdermal-build/{version}", "images": images}
    (out / "build.json").write_text(json.dumps(record))


def test_a_folder_of_the_first_edition_is_built_anew(small_study, fake_renderer, out):
    """Its images are rendered under their names; one that the study no longer has is removed."""
    build(small_study, out)
    before = contents(out)
    shutil.copy(out / "images/near_plain.png", out / "images/gone_plain.png")
    as_one_file(out, 1, gone=["images/gone_plain.png"])
    assert build(small_study, out) == built(4, 0)
    assert contents(out) == before


def test_a_folder_with_one_record_of_all_images_goes_on(small_study, fake_renderer, out):
    """Nothing is rendered anew; the file becomes a record an image."""
    build(small_study, out)
    before = contents(out)
    as_one_file(out, 2)
    assert build(small_study, out) == built(0, 4)
    assert contents(out) == before


def test_what_a_killed_process_left_half_written_goes(small_study, fake_renderer, out):
    build(small_study, out)
    before = contents(out)
    for half in ("images/.near_plain.png.1f.part", "records/.near_plain.json.1f.part"):
        (out / half).write_bytes(b"half")
    (out / "images" / IMAGES[3]).unlink()
    assert build(small_study, out) == built(1, 3)
    assert contents(out) == before


def test_changed_parameters_render_that_technique_alone(write_toml, fake_renderer, out):
    path = write_toml()
    build(load_study(path), out)
    fake_renderer.drawn.clear()
    path = write_toml(path.read_text().replace("2.5", "4.0"))
    assert build(load_study(path), out) == built(2, 2)
    assert {parameters.radius_mm for _, parameters in fake_renderer.drawn} == {4.0}
    assert load_manifest(out).image("near", "soft").parameters["radius_mm"] == 4.0


def test_new_wording_renders_nothing_but_reaches_the_manifest(small_study, fake_renderer, out):
    build(small_study, out)
    assert build(dataclasses.replace(small_study, title="Which is softer?", seed=8), out) == built(
        0, 4
    )
    assert load_manifest(out).study.title == "Which is softer?"


@pytest.mark.parametrize("change", [{"size": (34, 18)}, {"supersample": 2}, {"seed": 6}])
def test_other_rendering_renders_everything(small_study, fake_renderer, out, change):
    build(small_study, out)
    study = dataclasses.replace(
        small_study, render=dataclasses.replace(small_study.render, **change)
    )
    assert build(study, out) == built(4, 0)
    load_manifest(out)


def test_other_scene_or_source_renders_everything(small_study, fake_renderer, out, monkeypatch):
    build(small_study, out)
    noon = dataclasses.replace(small_study, scene={**small_study.scene, "rig": "noon"})
    assert build(noon, out) == built(4, 0)
    monkeypatch.setattr(stimuli.drawing, "_source", lambda module: "another")
    assert build(noon, out) == built(4, 0)


def test_a_scene_is_put_up_once_for_all_its_cameras(write_toml, fake_renderer, out):
    """Two people: two scenes, each with two framings; another exposure is no other scene."""
    people = (
        '\n[[factors]]\nname = "skin"\nlabel = "Skin"\n'
        '[[factors.levels]]\nname = "pale"\nlabel = "Pale"\n'
        "set = { materials = { head = { melanin = 0.1 } } }\n"
        '[[factors.levels]]\nname = "dark"\nlabel = "Dark"\n'
        "set = { materials = { head = { melanin = 0.2 } }, picture = { exposure = 1.2 } }\n"
    )
    study = load_study(write_toml(write_toml().read_text() + people))
    assert build(study, out) == built(8, 0)
    assert [scene.materials["head"].melanin for scene in fake_renderer.scenes] == [0.1, 0.2]
    assert fake_renderer.frames == ["near", "far"] * 2
    images = load_manifest(out).images
    assert images[0].levels == {"framing": "near", "skin": "pale"}
    assert images[0].file == "images/near.pale_plain.png"
    assert {image.scene["picture"]["exposure"] for image in images} == {1.45, 1.2}
    (out / images[-1].file).unlink()
    fake_renderer.scenes.clear()
    assert build(study, out) == built(1, 7)
    assert len(fake_renderer.scenes) == 1


def test_a_users_file_leaves_its_name_and_its_hash_alone(write_toml, fake_renderer, out, tmp_path):
    (tmp_path / "scan.glb").write_bytes(b"one")
    text = write_toml().read_text() + '\n[head]\nname = "scan.glb"\n'
    study = load_study(write_toml(text))
    build(study, out)
    assert str(tmp_path).encode() not in b"".join(contents(out).values())
    assert load_manifest(out).images[0].scene["objects"]["head"]["file"] == "scan.glb"
    (tmp_path / "scan.glb").write_bytes(b"two")
    assert build(study, out) == built(4, 0)


def test_image_changed_by_hand_is_rendered_again(small_study, fake_renderer, out):
    build(small_study, out)
    before = contents(out)
    (out / "images" / IMAGES[1]).write_bytes(b"scribble")
    (out / "images" / IMAGES[2]).unlink()
    assert build(small_study, out) == built(2, 2)
    assert contents(out) == before


def test_images_of_a_study_come_from_one_driver(small_study, fake_renderer, out):
    build(small_study, out)
    (out / "images" / IMAGES[0]).unlink()
    fake_renderer.driver = "another"
    assert build(small_study, out) == built(4, 0)
    assert {image.renderer["gl_vendor"] for image in load_manifest(out).images} == {"another"}


def test_interrupted_build_goes_on(small_study, fake_renderer, out, tmp_path):
    fake_renderer.stop_after = 3
    with pytest.raises(Stopped, match="stopped with 3 of 4 images rendered") as caught:
        build(small_study, out)
    assert caught.value.exit_code == 130
    assert sorted(path.name for path in (out / "images").iterdir()) == sorted(IMAGES[:3])
    with pytest.raises(InputError, match="cannot be read: No such file"):
        load_manifest(out)
    fake_renderer.stop_after = None
    assert build(small_study, out) == built(1, 3)
    build(small_study, tmp_path / "whole")
    assert contents(out) == contents(tmp_path / "whole")


class Elsewhere(Executor):
    """Does each task at once, as `before` leaves it, with nothing but the task."""

    def __init__(self, before=lambda task: task):
        self.before, self.tasks = before, []

    def submit(self, fn, /, *args):
        future = Future()
        try:
            args = [self.before(task) for task in args]
            self.tasks += args
            future.set_result(fn(*args))
        except BaseException as error:
            future.set_exception(error)
        return future


@pytest.fixture
def worker(monkeypatch):
    """This process as a worker that has not drawn yet."""
    monkeypatch.setattr(stimuli.drawing, "_studio", stimuli.drawing.Studio())
    monkeypatch.setattr(stimuli.drawing, "_thread", None)


def test_an_executor_makes_the_same_files(small_study, fake_renderer, worker, out, tmp_path):
    """A task for each camera, and the scene is put up once."""
    build(small_study, tmp_path / "here")
    assert len(fake_renderer.scenes) == 1
    elsewhere = Elsewhere()
    assert build(small_study, out, executor=elsewhere, workers=2) == built(4, 0)
    assert contents(out) == contents(tmp_path / "here")
    assert [len(task.stimuli) for task in elsewhere.tasks] == [2, 2]
    assert len(fake_renderer.scenes) == 2
    assert build(small_study, out, executor=Elsewhere()) == built(0, 4)


def test_a_task_that_is_done_again_draws_what_is_missing(
    small_study, fake_renderer, worker, out, tmp_path
):
    """As where a worker was killed before it could say that it had finished."""
    fake_renderer.stop_after = 3
    lost = Elsewhere()
    with pytest.raises(Stopped, match="stopped with 3 of 4 images rendered"):
        build(small_study, out, executor=lost)
    fake_renderer.stop_after = None
    for task in lost.tasks:
        stimuli.drawing.draw(task)
    assert len(fake_renderer.drawn) == 4
    assert build(small_study, out, executor=Elsewhere()) == built(0, 4)
    build(small_study, tmp_path / "whole")
    assert contents(out) == contents(tmp_path / "whole")


def test_a_scene_is_one_task_where_there_are_many(write_toml, fake_renderer, worker, out):
    skins = "".join(
        f'\n[[factors.levels]]\nname = "s{k}"\nlabel = "S{k}"\n'
        f"set = {{ materials = {{ head = {{ melanin = 0.{k} }} }} }}\n"
        for k in range(1, 4)
    )
    text = write_toml().read_text() + '\n[[factors]]\nname = "skin"\nlabel = "Skin"\n' + skins
    study, sizes = load_study(write_toml(text)), {}
    for workers in (1, 2):
        elsewhere = Elsewhere()
        build(study, out, force=True, executor=elsewhere, workers=workers)
        sizes[workers] = [len(task.stimuli) for task in elsewhere.tasks]
    assert sizes == {1: [4] * 3, 2: [2] * 6}


def test_a_worker_that_cannot_give_the_same_bytes_says_so(
    small_study, fake_renderer, worker, out, monkeypatch
):
    def fails(message, before, **more):
        with pytest.raises(InputError, match=message):
            build(small_study, out, executor=Elsewhere(before), **more)
        assert not (out / "manifest.json").exists()

    with monkeypatch.context() as patch:
        another = lambda module: "another"
        other = lambda task: patch.setattr(stimuli.drawing, "_source", another) or task
        fails("would make images/.* from other source or files", other)
    with monkeypatch.context() as patch:
        other = lambda task: patch.setattr(fake_renderer, "driver", "another") or task
        fails("draws with 1, another; expected 1, fake", other)
    elsewhere = lambda task: dataclasses.replace(task, out="/nowhere")
    fails("does not see /nowhere; expected a folder on a file system of all workers", elsewhere)
    monkeypatch.setattr(stimuli.drawing, "_thread", -1)  # another than this
    fails("has several threads; expected one", lambda task: task)
    with pytest.raises(InputError, match="times are asked for, 2 rounds, with workers"):
        build(small_study, out, rounds=2, executor=Elsewhere())


def test_images_that_workers_kept_for_themselves_are_missed(
    small_study, fake_renderer, worker, out, monkeypatch
):
    monkeypatch.setattr(stimuli.drawing, "draw", lambda task: None)
    with pytest.raises(InputError, match="workers drew 4 images that are not here, as images/near"):
        build(small_study, out, executor=Elsewhere())


def test_failing_disk_leaves_no_half_file(small_study, fake_renderer, out, monkeypatch):
    build(small_study, out)
    (out / "images" / IMAGES[0]).unlink()

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="No space"):
        build(small_study, out)
    assert sorted(path.name for path in (out / "images").iterdir()) == sorted(IMAGES[1:])


def test_only_its_own_strays_are_removed(small_study, fake_renderer, out):
    build(small_study, out)
    shutil.copy(out / "images" / IMAGES[0], out / "images" / "mine.png")
    (out / "images" / IMAGES[2]).write_bytes(b"kept, since it was changed")
    (out / "study.sqlite3").write_bytes(b"answers")
    near_only = dataclasses.replace(small_study, cells=small_study.cells[:1])
    assert build(near_only, out) == built(0, 2)
    assert sorted(path.name for path in (out / "images").iterdir()) == sorted(
        [*IMAGES[:3], "mine.png"]
    )
    assert (out / "study.sqlite3").read_bytes() == b"answers"
    assert len(load_manifest(out).images) == 2


def test_manifest_of_ready_made_images_is_not_overwritten(small_study, fake_renderer, ready_made):
    before = contents(ready_made)
    with pytest.raises(
        InputError, match="manifest.json: not written by a build, and not overwritten"
    ):
        build(small_study, ready_made, force=True)
    assert contents(ready_made) == before


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"format": "subdermal-build/0", "images": {}}'])
@pytest.mark.parametrize("name", ["build.json", "records/near_plain.json"])
def test_foreign_record_is_refused(small_study, fake_renderer, out, text, name):
    (out / name).parent.mkdir(parents=True)
    (out / name).write_text(text)
    with pytest.raises(InputError, match=f"{name}: not the record of a build"):
        build(small_study, out)
    assert contents(out) == {name: text.encode()}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("height_mm = 400.0, ", "", r"far: scene\.camera\.framing is 'far'; expected one of"),
        ('"blur"', '"blurred"', r"techniques\[1\]: no technique 'blurred'"),
        ("2.5", "-2.5", r"techniques\[1\]: radius_mm: got -2.5, expected > 0"),
    ],
)
def test_what_the_renderer_does_not_know_is_named_before_anything_is_written(
    write_toml, fake_renderer, out, old, new, message
):
    path = write_toml(write_toml().read_text().replace(old, new))
    with pytest.raises(InputError, match=message):
        build(load_study(path), out)
    assert not out.exists() and not fake_renderer.drawn


def test_renderer_that_returns_another_size_is_a_defect(small_study, fake_renderer, out):
    study = dataclasses.replace(
        small_study, render=dataclasses.replace(small_study.render, size=(40, 20))
    )
    with pytest.raises(RuntimeError, match=r"rendered \(18, 32, 3\)"):
        stimuli.drawing.write_png(
            out,
            np.zeros((18, 32, 3), np.uint8),
            study.render.size,
        )


def test_commit_of_a_checkout(tmp_path, monkeypatch):
    """The commit, "-dirty" when tracked source differs, nothing outside a checkout or below its
    top.
    """

    def git(*args):
        identity = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
        return subprocess.run(
            ["git", "-C", tmp_path, *identity, *args], check=True, capture_output=True, text=True
        ).stdout

    monkeypatch.setattr(stimuli.build, "_ROOT", tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert stimuli.build.commit() is None
    (tmp_path / "renderer").mkdir()
    for name in ("renderer/a.py", "notes.txt"):
        (tmp_path / name).write_text("1")
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    head = git("rev-parse", "HEAD").strip()
    assert stimuli.build.commit() == head
    (tmp_path / "notes.txt").write_text("2")
    assert stimuli.build.commit() == head
    (tmp_path / "renderer/a.py").write_text("2")
    assert stimuli.build.commit() == head + "-dirty"
    monkeypatch.setattr(stimuli.build, "_ROOT", tmp_path / "renderer")
    assert stimuli.build.commit() is None
