"""Walks of a reference in blocks: here, or by an executor's processes, in order and ahead of use.

A process is given the path of a file with surfaces, medium and places, and which block of walks;
what it gives back is where they left. Walks know their numbers, so blocks are the same anywhere.
"""

from __future__ import annotations

import os
import pickle
import socket
import uuid
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from renderer.errors import InputError
from renderer.optics.medium import Medium
from renderer.reference.walk import Part, Solid, Walks, walk

AHEAD = 16  # blocks that are given away, or have come back, before the first of them is used


@dataclass(frozen=True)
class Start:
    """What walks start from, see `estimate`: surfaces, medium, points and normals (N, 3), index
    (N,), seed.
    """

    parts: tuple[Part, ...]
    medium: Medium
    points: np.ndarray
    normals: np.ndarray
    index: np.ndarray
    seed: int


@dataclass(frozen=True)
class Block:
    """Of walks `2 done` to `2 (done + count)` of all points those from `first` on, `size` at most:
    numbered point by point.
    """

    done: int
    count: int
    first: int
    size: int

    def walks(self, points: int) -> tuple[np.ndarray, np.ndarray]:
        """The point (W,) and the number (W,) of each."""
        numbers = np.arange(2 * self.done, 2 * (self.done + self.count))
        last = min(self.first + self.size, points * len(numbers))
        which = np.arange(self.first, last)
        return which // len(numbers), numbers[which % len(numbers)]


def blocks(points: int, done: int, count: int, size: int) -> list[Block]:
    """All of a step, `count` walks further a point and half."""
    return [Block(done, count, first, size) for first in range(0, 2 * points * count, size)]


def walk_block(start: Start, solid: Solid, block: Block) -> list[Walks]:
    """The walks of a block, of each channel."""
    place, number = block.walks(len(start.points))
    names = start.index[place].astype(np.uint64) * np.uint64(65536) + number.astype(np.uint64)
    at = (start.points[place], start.normals[place], names, [start.seed])
    return [walk(solid, start.medium, c, *at) for c in range(start.medium.channels)]


def walked(
    start: Start, solid: Solid, executor: Executor | None, wanted: Iterable[Block], folder: Path
) -> Iterator[list[Walks]]:
    """`walk_block` of the wanted blocks in their order. folder: for the file that is handed on."""
    if executor is None:
        yield from (walk_block(start, solid, block) for block in wanted)
        return
    waiting: deque = deque()
    with handed_on(start, folder) as file:
        try:
            for block in wanted:
                waiting.append(executor.submit(walk_there, file, block))
                if len(waiting) == AHEAD:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


@contextmanager
def handed_on(start: Start, folder: Path) -> Iterator[Path]:
    """The path of a file in a folder from which other processes read a start."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f".walks-{uuid.uuid4().hex}.pickle"
    try:
        file.write_bytes(pickle.dumps(start))
        yield file
    finally:
        file.unlink(missing_ok=True)


def walk_there(file: Path, block: Block) -> list[Walks]:
    """`walk_block` in another process."""
    return walk_block(*_read(file), block)


def walk_in(file: Path, channel: int, *photons: np.ndarray) -> Walks:
    """`walk` in another process, from photons: points, normals, index, directions inside."""
    start, solid = _read(file)
    points, normals, index, inside = photons
    return walk(solid, start.medium, channel, points, normals, index, [start.seed], inside)


@lru_cache(maxsize=1)
def _read(file: Path) -> tuple[Start, Solid]:
    try:
        start = pickle.loads(file.read_bytes())
    except FileNotFoundError:
        raise InputError(
            f"worker {socket.gethostname()}:{os.getpid()} does not see {file}; expected "
            "SUBDERMAL_CACHE to name a folder on a file system of all workers"
        ) from None
    return start, Solid(start.parts)
