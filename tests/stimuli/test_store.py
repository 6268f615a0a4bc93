"""Images sent to where fsspec has an address, and fetched from there; hashes are checked."""

import json

import fsspec
import pytest

from stimuli.errors import InputError
from stimuli.manifest import load_manifest
from stimuli.store import Moved, pull, push


@pytest.fixture(params=["memory", "file"])
def url(request, tmp_path):
    """An empty place of two kinds."""
    yield "memory://study" if request.param == "memory" else f"file://{tmp_path}/store/study"
    fsspec.filesystem("memory").store.clear()


def test_a_study_goes_and_comes_as_it_is(ready_made, url, tmp_path):
    assert push(ready_made, url) == Moved(4, 0)
    assert push(ready_made, url) == Moved(0, 4)
    assert pull(url, tmp_path / "there") == Moved(4, 0)
    assert pull(url, tmp_path / "there") == Moved(0, 4)
    for image in load_manifest(ready_made).images:
        assert (tmp_path / "there" / image.file).read_bytes() == image.path.read_bytes()


def test_what_was_changed_in_either_place_is_moved_again(ready_made, url, tmp_path):
    push(ready_made, url)
    pull(url, tmp_path / "there")
    (tmp_path / "there/near-unreal.png").write_bytes(b"scribble")
    assert pull(url, tmp_path / "there") == Moved(1, 3)
    with fsspec.open(f"{url}/far-blender.png", "wb") as file:
        file.write(b"scribble")
    (tmp_path / "there/far-blender.png").unlink()
    with pytest.raises(InputError, match=r"far-blender.png: is [0-9a-f]{64}; expected"):
        pull(url, tmp_path / "there")
    assert not (tmp_path / "there/far-blender.png").exists()
    assert push(ready_made, url) == Moved(1, 3)
    assert pull(url, tmp_path / "there") == Moved(1, 3)


def test_the_command_says_what_moved_and_what_cannot(run, ready_made, tmp_path):
    code, out, err = run("store", "push", ready_made, f"file://{tmp_path}/store")
    assert (code, out) == (0, f"file://{tmp_path}/store: 4 images sent, 0 were there\n"), err
    code, out, _ = run("store", "pull", tmp_path / "store", tmp_path / "there")
    assert (code, out) == (0, f"{tmp_path / 'there'}: 4 images fetched, 0 were there\n")
    for address, message in (("nowhere://x", "expected an address of fsspec"), ("empty", "has no")):
        code, out, err = run("store", "pull", address, tmp_path / "other")
        assert code == 2 and not out and err.count("\n") == 1 and message in err
    manifest = json.loads((ready_made / "manifest.json").read_text())
    assert json.loads((tmp_path / "store/manifest.json").read_text()) == manifest
