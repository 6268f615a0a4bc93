"""Who does the work of a verb: this process, more on this machine, or a cluster.

Verbs pass an executor (`concurrent.futures.Executor`) to the stages; stages give it tasks that
carry paths and small tables. `--workers N` starts processes here, `--cluster ADDRESS` uses those of
a Dask scheduler, neither: the stage works by itself. Results are the same to the bit on one kind of
machine.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import click

from analysis.errors import InputError

#: So many times in succession workers may end unasked before any task is finished.
MOST_LOSSES = 3
GRACE_S = 10.0  # a worker that does not stop within that is ended
ANSWER_S = 30.0  # a scheduler, and its first workers, are waited for so long
#: Libraries that start threads of their own, in each worker: its share of the cores.
THREADS = ("LP_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Crew:
    """An executor, None for this process alone, and how many workers it has."""

    executor: Executor | None = None
    workers: int = 1


def options(command: Callable) -> Callable:
    """Gives a verb the options --workers and --cluster, for `crew`."""
    command = click.option(
        "--cluster",
        metavar="ADDRESS",
        help="Work is done by the workers of the Dask scheduler there, as tcp://host:8786; see "
        "docs/scale.md.",
    )(command)
    return click.option(
        "--workers",
        type=click.IntRange(1, 1024),
        metavar="N",
        help="Work is done by so many processes on this machine; by this one alone when not given.",
    )(command)


@contextmanager
def crew(
    workers: int | None = None, cluster: str | None = None, expected: int = 1
) -> Iterator[Crew]:
    """The executor that the options ask for, ended when the block ends: at once, where that is by
    an error. expected: how many workers of a cluster are waited for.
    """
    if workers is not None and cluster is not None:
        raise click.UsageError("expected either --workers or --cluster")
    if cluster is not None:
        with _dask(cluster, expected) as made:
            yield made
    elif workers is not None:
        with Workers(workers) as executor:
            yield Crew(executor, workers)
    else:
        yield Crew()


@contextmanager
def _dask(address: str, expected: int) -> Iterator[Crew]:
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise InputError(
            f"--cluster needs Dask's distributed, which is not here ({error}); install the extra: "
            "pip install --no-deps -r requirements-cluster.lock"
        ) from error
    try:
        client = Client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers there ({error}); expected an address "
            "as tcp://host:8786"
        ) from error
    with client:
        try:
            client.wait_for_workers(expected, timeout=ANSWER_S)
        except TimeoutError:
            raise InputError(
                f"--cluster {address}: the scheduler has {len(client.nthreads())} workers; "
                f"expected {expected} within {ANSWER_S:g} s"
            ) from None
        try:
            yield Crew(client.get_executor(pure=False), len(client.nthreads()))
        except KilledWorker as error:
            raise InputError(
                f"--cluster {address}: a task was given up after several workers ended during it, "
                f"which is mostly for want of memory: {error}"
            ) from error


class Workers(Executor):
    """Spawned processes on this machine; what one was at when it was killed is done by another.

    A ProcessPoolExecutor that is replaced when it breaks. Its processes end when this one does,
    however that happens; Ctrl-C is for this process to act upon.
    """

    def __init__(self, count: int):
        self.count = count
        self._lock = threading.RLock()
        self._losses = 0
        self._closed = False
        # this process holds the only end to write to: when it is gone, the others see that
        self._watched, self._line = _context().Pipe(duplex=False)
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        threads = max(1, _cores() // self.count)
        return ProcessPoolExecutor(
            self.count, _context(), initializer=_begin, initargs=(self._watched, threads)
        )

    def submit(self, fn: Callable, /, *args: Any, **kwargs: Any) -> Future:
        if self._closed:
            raise RuntimeError("the workers have been ended")
        mine: Future = Future()
        self._give(mine, partial(fn, *args, **kwargs))
        return mine

    def _give(self, mine: Future, work: Callable) -> None:
        with self._lock, _without_interrupts():
            try:
                future = self._pool.submit(_run, work)
            except BrokenProcessPool:  # the others of its futures are told in a moment
                self._pool = self._new_pool()
                future = self._pool.submit(_run, work)
            pool = self._pool
        mine.add_done_callback(lambda _: mine.cancelled() and future.cancel())
        future.add_done_callback(partial(self._take, mine, work, pool))

    def _take(self, mine: Future, work: Callable, pool: ProcessPoolExecutor, future: Future):
        """Hand on what became of a piece of work, or give it to another process."""
        if future.cancelled():
            mine.cancel()
            return
        error = future.exception()
        if isinstance(error, BrokenProcessPool) and not self._closed and not mine.cancelled():
            with self._lock:
                if pool is self._pool:
                    self._losses += 1
                    self._pool = self._new_pool()
                lost = self._losses >= MOST_LOSSES
            if not lost:
                self._give(mine, work)
                return
            error = InputError(
                f"worker processes ended {MOST_LOSSES} times before any task was finished, which "
                "is mostly for want of memory; expected fewer --workers"
            )
        elif error is None:
            self._losses = 0
        if mine.set_running_or_notify_cancel():
            if error is None:
                mine.set_result(future.result())
            else:
                mine.set_exception(error)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers, after all that they were given unless that is cancelled."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)
        self._closed = True
        if wait:
            self._line.close()

    def stop(self) -> None:
        """End the workers now, in the midst of what they do."""
        self._closed = True
        self._line.close()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def __exit__(self, kind: type | None, *_: object) -> None:
        self.shutdown() if kind is None else self.stop()


def _context() -> multiprocessing.context.SpawnContext:
    """Spawned, since a fork would share what OpenGL and threads hold."""
    return multiprocessing.get_context("spawn")


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Processes that are started meanwhile do not see Ctrl-C, from their first moment on."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(watched: Connection, threads: int) -> None:
    """A worker's first act: its share of the cores, and to end when it is to, or its parent has."""
    for name in THREADS:
        os.environ.setdefault(name, str(threads))
    os.environ["TQDM_DISABLE"] = "1"  # one bar is shown, by the process that was started
    signal.signal(signal.SIGTERM, _leave)
    threading.Thread(target=_watch, args=(watched,), daemon=True).start()


def _leave(*_: object) -> None:
    raise SystemExit(143)


def _run(work: Callable) -> Any:
    """Do a piece of work; a worker that is to end leaves it, without files half written, at once
    and whatever else it was given.
    """
    try:
        return work()
    except SystemExit:
        os._exit(143)


def _watch(watched: Connection) -> None:
    try:
        watched.recv_bytes()
    except (EOFError, OSError):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE_S)
    os._exit(143)
