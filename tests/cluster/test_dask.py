"""Work that the workers of a Dask scheduler do, as on a cluster."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip("distributed", reason="[cluster] is not installed; see make test-cluster")

from app.workers import crew


def start(module, *args):
    command = [sys.executable, "-m", f"distributed.cli.{module}", *map(str, args)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The address of a scheduler with two workers, and their processes."""
    folder = tmp_path_factory.mktemp("dask")
    file = folder / "scheduler.json"
    common = ("--no-dashboard", "--scheduler-file", file)
    scheduler = start("dask_scheduler", "--port", 0, "--host", "127.0.0.1", *common)
    rest = ("--nthreads", 1, "--no-nanny", "--local-directory", folder)
    workers = [start("dask_worker", *common, *rest) for _ in range(2)]
    try:
        deadline = time.monotonic() + 90
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        with crew(cluster=address, expected=2) as made:
            assert made.workers == 2
        yield address, workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def test_a_build_of_which_a_worker_is_killed_is_that_of_one_process(
    cluster, study, here, contents, tmp_path
):
    address, workers = cluster
    out = tmp_path / "out"
    command = [sys.executable, "-m", "app.cli", "build", study, "--out", out, "--cluster", address]
    build = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 120
    while not list(out.glob("records/*.json")) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not (out / "manifest.json").exists()
    os.kill(workers[0].pid, signal.SIGKILL)
    said, err = build.communicate(timeout=180)
    assert build.returncode == 0, err
    assert said == f"{out}: 8 images, 8 rendered, 0 up to date\n"
    assert contents(out) == here


def test_a_scheduler_that_is_not_there_is_named(run, study, tmp_path, monkeypatch):
    monkeypatch.setattr("app.workers.ANSWER_S", 0.5)
    code, _, err = run("build", study, "--out", tmp_path, "--cluster", "tcp://127.0.0.1:9")
    assert code == 2 and err.count("\n") == 1
    assert "no Dask scheduler answers there" in err
