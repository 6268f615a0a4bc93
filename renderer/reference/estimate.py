"""What walks find, pass by pass: two independent halves, kept on disk, to be taken up again."""

from __future__ import annotations

import hashlib
import json
import os
import time
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from renderer import caches
from renderer.optics import chandrasekhar, media
from renderer.optics.medium import Medium, Stack
from renderer.reference.blocks import Block, Start, blocks
from renderer.reference.blocks import walked as walked_blocks
from renderer.reference.walk import Solid, Walks
from renderer.scene.shapes import points_on

BLOCK = 60_000  # walks of a channel that are on their way together
SAVE_EVERY_S = 20.0
PROBES = 2048  # places whose light tells one scene from another

#: Irradiance (K, C) at triangles (K,) with barycentric weights (K, 3).
Light = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Walked:
    """The medium that is walked in. residual (C,): rms at a straight edge between it and the curve
    of the medium that was asked for, 0 where it is that one; albedo (C,): what a half-space of it
    sends back of diffuse light that has entered; layered: it stands for layers, which let other
    light through thin parts (docs/techniques.md).
    """

    medium: Medium
    residual: np.ndarray
    albedo: np.ndarray
    layered: bool = False


def walked(description: str | dict, index: float = 0.0) -> Walked:
    """The medium of what a scene names: its own coefficients where it is one deep layer; else the
    isotropic medium whose curve is nearest (renderer.optics.media.invert).

    index: of refraction within over that outside; 0: the medium's own, 1 for what is inverted.
    """
    return _walked(json.dumps(description, sort_keys=True, default=list), index)


@lru_cache(maxsize=32)
def _walked(description: str, index: float) -> Walked:
    stack, target = (read(json.loads(description)) for read in (media.read, media.curve))
    deep = isinstance(stack, Stack) and len(stack.layers) == 1 and np.isinf(stack.thickness_mm)
    if deep and stack.n_above == 1:
        medium, residual = stack.layers[0].medium, np.zeros(stack.channels)
        if index and index != medium.eta:
            medium = replace(medium, eta=index)
            target = media.simulated(Stack.of(medium))
    else:
        inversion = media.invert(target, eta=index or 1.0)
        medium, residual = inversion.medium, inversion.residual
        if medium.eta != 1:
            target = media.simulated(Stack.of(medium))
    if medium.eta == 1 and medium.g == 0:
        albedo = chandrasekhar.diffuse_albedo(medium.albedo)
    else:
        albedo = np.asarray(target.albedo)
    layered = isinstance(stack, Stack) and len(stack.layers) > 1
    return Walked(medium, residual, albedo, layered)


@dataclass(frozen=True)
class Halves:
    """values (2, N, C): scattered irradiance by two independent sets of walks, `walks` each.

    carried (2, N, C): what the same walks would find under a light of 1 everywhere: close to 1, and
    a matter of shape and medium alone.
    """

    values: np.ndarray
    carried: np.ndarray
    walks: int

    @property
    def mean(self) -> np.ndarray:
        """Both together (N, C)."""
        return self.values.mean(axis=0)

    @property
    def noise(self) -> np.ndarray:
        """Standard error of `mean`, rms over the points (C,)."""
        if not self.values.size:
            return np.zeros(self.values.shape[-1])
        return np.sqrt(((self.values[0] - self.values[1]) ** 2).mean(axis=0)) / 2

    def pooled(self, points: np.ndarray, own: np.ndarray, cell_mm: float) -> Halves:
        """With less noise, and no longer without bias: `carried` is averaged over about a cell of
        space, so that only what light differs from a point's own (N, C) is left to its walks alone.

        A walk's weight is most of its noise; how much of it comes back varies by shape, slowly.
        """
        smooth = np.stack([_over_cells(points, half, cell_mm) for half in self.carried])
        return Halves(self.values + own * (smooth - self.carried), smooth, self.walks)


def rms_error(values: np.ndarray, halves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """rms difference (C,) of values (N, C) from what halves (2, N, C) estimate, without the halves'
    noise, and its standard error (C,).

    The halves are independent, so that (v - a)(v - b) is (v - truth)^2 on average. Noise can leave
    its mean below 0 where hardly anything differs: the root is then given as negative. Both are 0
    where nothing differs at all.
    """
    squares = (values - halves[0]) * (values - halves[1])
    mean = squares.mean(axis=0)
    rms = np.sign(mean) * np.sqrt(np.abs(mean))
    spread = squares.std(axis=0) / np.sqrt(len(squares))
    return rms, np.divide(spread, 2 * np.abs(rms), out=np.zeros_like(rms), where=rms != 0)


def estimate(
    solid: Solid,
    medium: Walked,
    points: np.ndarray,
    normals: np.ndarray,
    index: np.ndarray,
    light: Light,
    walks: int,
    seed: int,
    keep: bool = True,
    executor: Executor | None = None,
) -> Halves:
    """Scattered irradiance at points (N, 3) on a solid, by `walks` walks a point and channel, even.

    As techniques give it: what leaves over what a half-space sends back, so that constant light on
    a flat slab stays as it is and the surface's own albedo is multiplied on later. index (N,):
    a number of each point, which decides its walks together with the seed. What takes longer than
    SAVE_EVERY_S is kept in the cache while it runs (`keep`), and taken up from there. executor:
    walks, in processes that see the cache, while this one looks up their light; the same to the
    bit.
    """
    half, channels = walks // 2, medium.medium.channels
    sums = np.zeros((2, 2, len(points), channels))  # under the light and under 1, by half
    # so many walks of a point at a time that small pictures fill a block too
    together = max(1, min(half, BLOCK // max(2 * len(points), 1)))
    name = f"{_key(solid, medium.medium, points, index, light, seed)}-{walks}" if keep else None
    start = Start(solid.parts, medium.medium, points, normals, index, seed)
    ahead: Iterator[list[Walks]] | None = None

    def all_from(done: int) -> Iterator[Block]:
        for first in range(done, half, together):
            yield from blocks(len(points), first, min(together, half - first), BLOCK)

    def add(done: int, count: int) -> None:
        nonlocal ahead
        if ahead is None:
            folder = caches.folder() / "reference"
            ahead = walked_blocks(start, solid, executor, all_from(done), folder)
        for block in blocks(len(points), done, count, BLOCK):
            _add(sums, *block.walks(len(points)), next(ahead), light)

    def halves(done: int) -> Halves:
        return Halves(*sums / (done * medium.albedo), done)

    try:
        accumulate(name, sums, half, together, add, halves, "walk")
    finally:
        if ahead is not None:
            ahead.close()
    return halves(half)


def accumulate(
    name: str | None,
    sums: np.ndarray,
    half: int,
    together: int,
    add: Callable[[int, int], None],
    halves: Callable[[int], Halves],
    unit: str,
) -> None:
    """Add to sums until each half has `half` units: add(done, count) adds the next `count`, at most
    `together`, to both; halves(done) is what they come to.

    name: of the file in the cache, None for none. What takes longer than SAVE_EVERY_S is kept while
    it runs and taken up from there. Only whole steps are kept: what is interrupted within one goes
    on from the last that was, so that nothing is counted twice.
    """
    from tqdm import tqdm

    file = caches.folder() / "reference" / f"{name}.npz" if name else None
    done, whole = take_up(file, sums, half), True
    started = saved = time.monotonic()
    bar = tqdm(
        total=half * 2,
        initial=done * 2,
        desc="reference",
        unit=unit,
        unit_scale=half > 10_000,
        disable=None,
        leave=False,
    )
    try:
        while done < half:
            count = min(together, half - done)
            whole = False
            add(done, count)
            done += count
            whole = True
            bar.update(2 * count)
            noise = " ".join(f"{v:.4f}" for v in halves(done).noise)
            bar.set_postfix_str(f"standard error {noise}")
            if time.monotonic() - saved > SAVE_EVERY_S:
                save(file, sums, done)
                saved = time.monotonic()
    finally:
        bar.close()
        if whole and time.monotonic() - started > SAVE_EVERY_S:
            save(file, sums, done)


def _add(
    sums: np.ndarray, place: np.ndarray, number: np.ndarray, walks: list[Walks], light: Light
) -> None:
    """Add to the sums of both halves what a block's walks bring, of each channel: walk w is that of
    point place[w] and of number[w], whose parity is its half.
    """
    points = sums.shape[2]
    triangles = np.concatenate([w.triangle for w in walks])
    if not len(triangles):
        return
    lit = light(triangles, np.concatenate([w.weights for w in walks]))
    begin = 0
    for c, w in enumerate(walks):
        arrived = w.carried * lit[begin : begin + len(w.carried), c]
        begin += len(w.carried)
        where = 2 * place[w.source] + number[w.source] % 2
        for sum_, of in zip(sums, (arrived, w.carried)):
            counted = np.bincount(where, of, 2 * points)
            sum_[:, :, c] += counted.reshape(-1, 2).T


def _over_cells(points: np.ndarray, values: np.ndarray, cell_mm: float) -> np.ndarray:
    """Values (N, C) at points (N, 3), averaged over cells of space and linear between them."""
    low = np.floor(points / cell_mm).astype(np.int64)
    part = points / cell_mm - low
    corners = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(8, 3)
    shares = np.stack([np.where(c, part, 1 - part).prod(axis=1) for c in corners])
    places = (low + corners[:, None]).reshape(-1, 3)
    size = np.ptp(places, axis=0) + 1
    flat = np.ravel_multi_index(tuple((places - places.min(axis=0)).T), tuple(size))
    _, cell = np.unique(flat, return_inverse=True)
    cell = cell.reshape(8, -1)
    weight = np.bincount(cell.ravel(), shares.ravel())
    result = np.empty_like(values)
    for c in range(values.shape[1]):
        total = np.bincount(cell.ravel(), (shares * values[:, c]).ravel())
        result[:, c] = (shares * (total / np.maximum(weight, 1e-12))[cell]).sum(axis=0)
    return result


def _key(
    solid: Solid, medium: Medium, points: np.ndarray, index: np.ndarray, light: Light, seed: int
) -> str:
    """A hash of all that an estimate is made from; of the light, by what some places have of it."""
    areas = 0.5 * np.linalg.norm(
        np.cross(
            solid.corners[:, 1] - solid.corners[:, 0], solid.corners[:, 2] - solid.corners[:, 0]
        ),
        axis=1,
    )
    rng = np.random.default_rng(0)
    probes = light(*points_on(areas, (np.arange(PROBES) + 0.5) / PROBES, rng))
    digest = hashlib.sha256()
    for name in ("walk.py", "blocks.py", "estimate.py"):
        digest.update(Path(__file__).with_name(name).read_bytes())
    for array in (solid.corners, solid.middle, points, index, probes):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr((medium, seed, BLOCK)).encode())
    return digest.hexdigest()[:32]


def take_up(file: Path | None, sums: np.ndarray, half: int) -> int:
    """Put the furthest kept sums of this key that are not too far into `sums`: walks of a half."""
    best = 0
    for kept in file.parent.glob(f"{file.stem.split('-')[0]}-*.npz") if file else ():
        try:
            with np.load(kept, allow_pickle=False) as stored:
                done, stored_sums = int(stored["done"]), stored["sums"]
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            continue
        if stored_sums.shape == sums.shape and best < done <= half:
            best, sums[:] = done, stored_sums
    return best


def save(file: Path | None, sums: np.ndarray, done: int) -> None:
    """Write the sums whole or not at all."""
    if file is None:
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f".{file.stem}.{os.getpid()}.npz")
    try:
        np.savez(part, sums=sums, done=done)
        os.replace(part, file)
    finally:
        part.unlink(missing_ok=True)
