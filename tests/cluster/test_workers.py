"""Work that processes of this machine do: what one does, whatever becomes of them."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import wait
from pathlib import Path

import click
import numpy as np
import pytest

from analysis import responses_from_records
from analysis.compute import everything
from analysis.errors import InputError
from analysis.options import Options
from analysis.planning import Plan, plan_table
from analysis.planning.power import PART
from analysis.worth.resampled import FITTED
from app.workers import MOST_LOSSES, THREADS, crew
from renderer.optics import montecarlo
from renderer.reference import estimate as estimates
from renderer.reference import traced
from renderer.reference.walk import Part, Solid
from renderer.scene.shapes import slab
from tests.cluster.tasks import die, die_once, threads
from tests.renderer.test_traced import CAMERA, MATCHED, PIXELS
from tests.renderer.test_traced import slab as traced_slab

ROOT = Path(__file__).resolve().parents[2]
#: Writes a file in each of two processes for ever; Ctrl-C ends it.
ENDLESS = """
import sys, time
from pathlib import Path
from analysis.files import replacing
from app.workers import crew

def write(name):
    with replacing(Path(name)) as part:
        part.write_text("half")
        time.sleep(60)

if __name__ == "__main__":
    with crew(workers=2) as made:
        list(made.executor.map(write, sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def two():
    """Two processes, for all tests in which nobody ends them."""
    with crew(workers=2) as made:
        yield made.executor


def test_a_build_by_two_processes_is_that_of_one(run, study, here, contents, tmp_path):
    code, out, err = run("build", study, "--out", tmp_path / "out", "--workers", 2)
    assert (code, out) == (0, f"{tmp_path / 'out'}: 8 images, 8 rendered, 0 up to date\n"), err
    assert "8/8" in err
    assert contents(tmp_path / "out") == here


def test_workers_share_the_cores_and_are_no_forks(monkeypatch):
    for name in THREADS:
        monkeypatch.delenv(name, raising=False)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    with crew(workers=1) as made:
        ((pid, shares),) = made.executor.map(threads, [THREADS])
    assert pid != os.getpid() and shares == [str(cores)] * len(THREADS)


def test_what_a_killed_worker_was_at_is_done_by_another(tmp_path):
    with crew(workers=2) as made:
        work = [made.executor.submit(die_once, tmp_path / name) for name in "ab"]
        assert [future.result(60) for future in work] == ["a", "b"]


def test_work_that_ends_every_worker_is_given_up():
    with pytest.raises(InputError, match=f"ended {MOST_LOSSES} times before any task"):
        with crew(workers=1) as made:
            made.executor.submit(die, 0).result(60)


def test_cancelled_work_is_not_done(tmp_path):
    with crew(workers=1) as made:
        work = [made.executor.submit(time.sleep, 0.5) for _ in range(6)]
        work[-1].cancel()
        wait(work[:1])
    assert work[-1].cancelled() and all(future.done() for future in work)


@pytest.mark.parametrize("who", ["all", "parent killed"])
def test_workers_end_when_they_are_to(tmp_path, who):
    """By Ctrl-C, which the whole group gets; or with the process that started them."""
    (tmp_path / "endless.py").write_text(ENDLESS)
    command = [sys.executable, tmp_path / "endless.py", tmp_path / "a", tmp_path / "b"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env=environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored behind `&`
    )
    deadline = time.monotonic() + 60
    while len(list(tmp_path.glob(".*.part"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    if who == "all":
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=30)
        assert err.count("KeyboardInterrupt") == 1 and "Process Spawn" not in err
    else:
        process.kill()
        process.communicate(timeout=30)  # returns when no worker holds stderr open any more
    while list(tmp_path.glob(".*.part")) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["endless.py"]
    with pytest.raises(ProcessLookupError):  # nobody of the group is left
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            os.killpg(process.pid, 0)
            time.sleep(0.05)


def test_photons_by_two_processes_are_those_of_threads(two):
    """To the bit, wherever a batch is cut."""
    layers = [montecarlo.Layer(n=1.4, mu_a=1, mu_s=10, g=0.9, d=0.5)]
    alone = montecarlo.simulate(layers, 60_001, 3, cache=False, threads=1)
    shared = montecarlo.simulate(layers, 60_001, 3, cache=False, executor=two)
    assert shared.tally.sums.tobytes() == alone.tally.sums.tobytes()


def test_light_traced_by_two_processes_is_that_of_one(two, tmp_path, monkeypatch):
    """To the bit, of light that enters more than once; what was handed on is gone afterwards."""
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path))
    monkeypatch.setattr(traced, "PART", 700)  # a block is several tasks
    world, made = traced_slab((0.0, 0.6, 0.8), radiance=0.1), estimates.walked(MATCHED)
    eye = traced.Eye.of(CAMERA, np.ones((PIXELS, PIXELS), bool), 1000.0, world)
    alone = traced.trace(world, made, eye, 3000, 3, keep=False)
    shared = traced.trace(world, made, eye, 3000, 3, keep=False, executor=two)
    assert alone.values.mean() > 0.5 and shared.values.tobytes() == alone.values.tobytes()
    assert not list((tmp_path / "reference").iterdir())


def test_power_by_two_processes_is_that_of_one(two):
    """Of studies in two parts, each with a seed of its own."""
    plan = Plan(("a", "b", "c"), ("a", "b"), studies=PART + 1, most=40)
    alone = plan_table(plan)
    shared = plan_table(plan, executor=two)
    for here, there in zip(alone, shared, strict=True):
        assert here.to_csv() == there.to_csv()


def test_the_bootstrap_by_two_processes_is_that_of_one(two, tmp_path):
    """Of one technique that hardly ever loses too: a resample without a maximum."""
    rng = np.random.default_rng(4)
    rows = [
        (f"p{person}", "near", a, b, int(answer))
        for person in range(14)
        for a, b, worth in (("x", "y", 0.2), ("x", "z", 1.8), ("y", "z", 0.6))
        for answer in np.clip(np.round(rng.normal(worth, 0.8, 1)), -2, 2)
    ]
    columns = ("participant", "framing", "left", "right", "answer")
    records = [dict(zip(columns, row)) for row in rows]
    options = Options(resamples=FITTED + 40)
    alone = everything(responses_from_records(records), options).tables
    responses = responses_from_records(records)
    shared = everything(responses, options, executor=two, folder=tmp_path).tables
    assert alone.keys() == shared.keys() and not list(tmp_path.iterdir())
    for name, table in alone.items():
        assert table.to_csv() == shared[name].to_csv(), name


def test_a_reference_by_two_processes_is_that_of_one(two, monkeypatch, tmp_path):
    """Of several blocks a step and several steps, and what is handed over is taken away."""
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path))
    monkeypatch.setattr(estimates, "BLOCK", 700)
    bar = slab((6.0, 4.0, 4.0))
    solid = Solid([Part(bar.positions, bar.faces)])
    x = np.linspace(-2, 2, 500)
    points, normals = np.column_stack([x, 0 * x, 2 + 0 * x]), np.tile([0.0, 0.0, 1.0], (500, 1))
    light = lambda triangle, weights: np.column_stack([weights[:, 0]] * 3) + triangle[:, None]
    rest = (points, normals, np.arange(500), light, 6, 1, False)
    alone = estimates.estimate(solid, estimates.walked("skin1"), *rest)
    shared = estimates.estimate(solid, estimates.walked("skin1"), *rest, two)
    assert shared.values.tobytes() == alone.values.tobytes() and alone.values.std() > 0
    assert not list((tmp_path / "reference").iterdir())


def test_one_kind_of_workers_is_asked_for():
    with pytest.raises(click.UsageError, match="either --workers or --cluster"):
        with crew(2, "tcp://here:8786"):
            pass
