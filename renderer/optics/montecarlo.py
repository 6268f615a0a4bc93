"""Monte Carlo in layered media: the judge of every diffusion profile here.

Photons as in MCML (see walk.py) in plane layers with refractive faces. Photons are walked in
BATCHES independent batches, each with a random stream of its own that follows from the seed alone;
standard errors come from the spread between batches. So the numbers depend on photons and seed, and
not on how many threads there were or how often the run was interrupted.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import time
import zipfile
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import asdict, astuple, dataclass, field
from pathlib import Path

import numpy as np

from renderer import caches
from renderer.errors import InputError
from renderer.optics.medium import Stack, reach

BATCHES = 64
CHUNK, CHUNK_S = (
    256,
    0.02,
)  # photons between two looks at the clock: this many at first, then as many as take that long
STRETCH_S = 0.25  # what a worker is given at a time, and loses when it is stopped
SAVE_EVERY_S = 30.0
BINS, MOST_BINS, ANGLES = 120, 10_000, 90
ILLUMINATIONS = ("searchlight", "diffuse")


def _number(name: str, value, low: float, expected: str, finite: bool = True) -> float:
    good = isinstance(value, (int, float, np.number)) and not isinstance(value, (bool, np.bool_))
    if not good or not value >= low or (finite and math.isinf(value)):
        raise InputError(f"{name} is {value!r}; expected {expected}")
    return float(value)


@dataclass(frozen=True)
class Layer:
    """A homogeneous layer: index n >= 1; mu_a and mu_s, absorption and scattering in 1/mm, >= 0;
    mean cosine -1 < g < 1; thickness d in mm, > 0, infinite for a half-space.
    """

    n: float = 1.0
    mu_a: float = 0.0
    mu_s: float = 0.0
    g: float = 0.0
    d: float = math.inf

    def __post_init__(self):
        _number("n", self.n, 1, "an index of refraction, 1 or more")
        _number("mu_a", self.mu_a, 0, "absorption in 1/mm, 0 or more")
        _number("mu_s", self.mu_s, 0, "scattering in 1/mm, 0 or more")
        if abs(_number("g", self.g, -1, "a mean cosine between -1 and 1, both excluded")) >= 1:
            raise InputError(
                f"g is {self.g!r}; expected a mean cosine between -1 and 1, both excluded"
            )
        if _number("d", self.d, 0, "a thickness in mm, more than 0", finite=False) == 0:
            raise InputError("d is 0; expected a thickness in mm, more than 0")
        for name in self.__dataclass_fields__:  # so that 1 and 1.0 have one name in the cache
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def mu_t(self) -> float:
        """Extinction, 1/mm."""
        return self.mu_a + self.mu_s

    @classmethod
    def parse(cls, text: str) -> Layer:
        """A layer from "n=1.4 mu_a=1 mu_s=10 g=0.9 d=1"; n is 1, g is 0 and d infinite where they
        are left out.
        """
        values = {}
        for word in text.replace(",", " ").split():
            name, _, value = word.partition("=")
            if name not in cls.__dataclass_fields__ or name in values:
                raise InputError(
                    f"layer {text!r}: {word!r}; expected each of n, mu_a, mu_s, g and d at "
                    "most once, as in mu_a=0.1"
                )
            try:
                values[name] = float(value)
            except ValueError:
                raise InputError(
                    f"layer {text!r}: {name} is {value!r}; expected a number"
                ) from None
        if not {"mu_a", "mu_s"} <= set(values):
            raise InputError(f"layer {text!r} lacks mu_a or mu_s; expected both, in 1/mm")
        return cls(**values)


def layers_of(stack: Stack, channel: int) -> list[Layer]:
    """A stack's layers as one of its channels meets them, outermost first."""
    return [
        Layer(
            n=layer.medium.eta,
            mu_a=layer.medium.sigma_a[channel],
            mu_s=float(layer.medium.sigma_s[channel]),
            g=float(layer.medium.g),
            d=float(layer.thickness_mm),
        )
        for layer in stack.layers
    ]


@dataclass(frozen=True)
class Setting:
    """Everything that the numbers depend on, but for the number of photons."""

    layers: tuple[Layer, ...]
    seed: int
    n_above: float
    n_below: float
    illumination: str
    edges_mm: tuple[float, ...]
    angles: int = ANGLES

    def __post_init__(self):
        if not self.layers or not all(isinstance(layer, Layer) for layer in self.layers):
            raise InputError("layers is empty or holds something else; expected at least one Layer")
        if any(math.isinf(layer.d) for layer in self.layers[:-1]):
            raise InputError(
                "a layer with another below it is infinite; expected a thickness d in mm"
            )
        if math.isinf(self.layers[-1].d) and self.layers[-1].mu_a == 0:
            raise InputError(
                "the last layer is infinite and absorbs nothing, so photons would never end; "
                "expected mu_a > 0 or a thickness d"
            )
        for name in ("n_above", "n_below"):
            object.__setattr__(
                self,
                name,
                _number(name, getattr(self, name), 1, "an index of refraction, 1 or more"),
            )
        if self.illumination not in ILLUMINATIONS:
            raise InputError(
                f"illumination is {self.illumination!r}; expected {' or '.join(ILLUMINATIONS)}"
            )
        object.__setattr__(self, "seed", _whole("seed", self.seed, 0))
        edges = np.array(self.edges_mm)
        if len(edges) - 1 > MOST_BINS:
            raise InputError(f"there are {len(edges) - 1} bins; expected {MOST_BINS} at most")
        if (
            len(edges) < 2
            or not np.isfinite(edges).all()
            or edges[0] != 0
            or (np.diff(edges) <= 0).any()
        ):
            raise InputError(
                "the edges of the bins are not rising numbers; expected 0 < r1 < r2 < ..., "
                "in mm, 0 first"
            )

    def key(self) -> str:
        """Name of this setting's results: a hash of all parameters and of the code that walks."""
        code = Path(__file__).with_name("walk.py").read_bytes()
        return hashlib.sha256(code + json.dumps(asdict(self)).encode()).hexdigest()[:32]

    def arrays(self) -> tuple:
        """The arguments of walk() that do not change."""
        layers = np.array([astuple(layer) for layer in self.layers])
        n, mu_a, mu_s, g, d = layers.T
        mu_t = mu_a + mu_s
        return (
            self.illumination == "diffuse",
            np.array([self.n_above, *n, self.n_below]),
            np.concatenate([[0.0], np.cumsum(d)]),
            mu_t,
            np.divide(mu_s, mu_t, out=np.zeros_like(mu_t), where=mu_t > 0),
            np.where(np.abs(g) < 1e-6, 0.0, g),  # below, the inversion would divide by nothing
            np.array(self.edges_mm) ** 2,
            np.sin(np.linspace(0, np.pi / 2, self.angles + 1)) ** 2,
        )


def _whole(name: str, value, low: int) -> int:
    if (
        isinstance(value, (bool, np.bool_))
        or not isinstance(value, (int, np.integer))
        or value < low
    ):
        raise InputError(f"{name} is {value!r}; expected a whole number of {low} or more")
    return int(value)


class Tally:
    """Sums of weights of every batch: one (BATCHES, K) array and its named views, (BATCHES, ...)
    each.
    """

    def __init__(self, setting: Setting):
        bins = len(setting.edges_mm)
        shapes = {
            "unscattered": (2,),
            "absorbed": (len(setting.layers),),
            "radial": (4, bins),
            "angular": (2, setting.angles),
        }
        self.sums = np.zeros((BATCHES, sum(math.prod(shape) for shape in shapes.values())))
        at = 0
        for name, shape in shapes.items():
            size = math.prod(shape)
            setattr(self, name, self.sums[:, at : at + size].reshape(BATCHES, *shape))
            at += size


#: What a run estimates, each with its standard error.
ESTIMATES = (
    "specular",
    "ballistic",
    "diffuse_reflectance",
    "single_reflectance",
    "multiple_reflectance",
    "transmittance",
    "single_transmittance",
    "multiple_transmittance",
    "absorbed",
    "absorbed_by_layer",
    "R",
    "R_single",
    "R_multiple",
    "R_beyond",
    "T",
    "T_single",
    "T_multiple",
    "T_beyond",
    "R_angular",
    "T_angular",
)


@dataclass(frozen=True, eq=False)
class Result:
    """What became of one unit of light.

    All shares are of the incident light; each NAME has a NAME_error, one standard error from the
    spread between batches. `simulate` says what each is.
    """

    setting: Setting
    photons: int
    tally: Tally
    specular: float = field(init=False)
    specular_error: float = field(init=False)
    ballistic: float = field(init=False)
    ballistic_error: float = field(init=False)
    diffuse_reflectance: float = field(init=False)
    diffuse_reflectance_error: float = field(init=False)
    single_reflectance: float = field(init=False)
    single_reflectance_error: float = field(init=False)
    multiple_reflectance: float = field(init=False)
    multiple_reflectance_error: float = field(init=False)
    transmittance: float = field(init=False)
    transmittance_error: float = field(init=False)
    single_transmittance: float = field(init=False)
    single_transmittance_error: float = field(init=False)
    multiple_transmittance: float = field(init=False)
    multiple_transmittance_error: float = field(init=False)
    absorbed: float = field(init=False)
    absorbed_error: float = field(init=False)
    absorbed_by_layer: np.ndarray = field(init=False)
    absorbed_by_layer_error: np.ndarray = field(init=False)
    R: np.ndarray = field(init=False)
    R_error: np.ndarray = field(init=False)
    R_single: np.ndarray = field(init=False)
    R_single_error: np.ndarray = field(init=False)
    R_multiple: np.ndarray = field(init=False)
    R_multiple_error: np.ndarray = field(init=False)
    R_beyond: float = field(init=False)
    R_beyond_error: float = field(init=False)
    T: np.ndarray = field(init=False)
    T_error: np.ndarray = field(init=False)
    T_single: np.ndarray = field(init=False)
    T_single_error: np.ndarray = field(init=False)
    T_multiple: np.ndarray = field(init=False)
    T_multiple_error: np.ndarray = field(init=False)
    T_beyond: float = field(init=False)
    T_beyond_error: float = field(init=False)
    R_angular: np.ndarray = field(init=False)
    R_angular_error: np.ndarray = field(init=False)
    T_angular: np.ndarray = field(init=False)
    T_angular_error: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        sizes = batch_sizes(self.photons)
        for name, sums in self._sums().items():
            mean = sums.sum(0) / self.photons
            off = sums - sizes.reshape(-1, *[1] * (sums.ndim - 1)) * mean
            error = np.sqrt((off**2).sum(0) * BATCHES / (BATCHES - 1)) / self.photons
            scalar = mean.ndim == 0
            object.__setattr__(self, name, float(mean) if scalar else mean)
            object.__setattr__(self, f"{name}_error", float(error) if scalar else error)

    def _sums(self) -> dict[str, np.ndarray]:
        """The sum over each batch's photons of every estimate: (BATCHES, ...)."""
        radial, angular, unscattered = self.tally.radial, self.tally.angular, self.tally.unscattered
        absorbed, area, angle = self.tally.absorbed, self.area_mm2, self.solid_angle
        rings, beyond = radial[..., :-1], radial[..., -1]
        return {
            "specular": unscattered[:, 0],
            "ballistic": unscattered[:, 1],
            "diffuse_reflectance": radial[:, :2].sum((1, 2)),
            "single_reflectance": radial[:, 0].sum(1),
            "multiple_reflectance": radial[:, 1].sum(1),
            "transmittance": radial[:, 2:].sum((1, 2)) + unscattered[:, 1],
            "single_transmittance": radial[:, 2].sum(1),
            "multiple_transmittance": radial[:, 3].sum(1),
            "absorbed": absorbed.sum(1),
            "absorbed_by_layer": absorbed,
            "R": rings[:, :2].sum(1) / area,
            "R_single": rings[:, 0] / area,
            "R_multiple": rings[:, 1] / area,
            "R_beyond": beyond[:, :2].sum(1),
            "T": rings[:, 2:].sum(1) / area,
            "T_single": rings[:, 2] / area,
            "T_multiple": rings[:, 3] / area,
            "T_beyond": beyond[:, 2:].sum(1),
            "R_angular": angular[:, 0] / angle,
            "T_angular": angular[:, 1] / angle,
        }

    @property
    def edges_mm(self) -> np.ndarray:
        """Edges of the rings in which light was counted: (bins + 1,)."""
        return np.array(self.setting.edges_mm)

    @property
    def r_mm(self) -> np.ndarray:
        """Middle of each ring: (bins,). A curve like 1 / r has just its mean there."""
        return (self.edges_mm[1:] + self.edges_mm[:-1]) / 2

    @property
    def area_mm2(self) -> np.ndarray:
        """Area of each ring: (bins,)."""
        return np.pi * np.diff(self.edges_mm**2)

    @property
    def angle_edges(self) -> np.ndarray:
        """Edges of the exit angles, radians from the normal: (angles + 1,)."""
        return np.linspace(0, np.pi / 2, self.setting.angles + 1)

    @property
    def solid_angle(self) -> np.ndarray:
        """Solid angle of each bin of exit angles, sr: (angles,)."""
        return -2 * np.pi * np.diff(np.cos(self.angle_edges))

    def as_dict(self) -> dict:
        """Everything, ready for JSON."""
        plain = lambda value: value.tolist() if isinstance(value, np.ndarray) else value
        setting = asdict(self.setting)
        setting["layers"] = [
            {name: value for name, value in layer.items() if value != math.inf}
            for layer in setting["layers"]
        ]
        record = {
            "photons": self.photons,
            **setting,
            "r_mm": plain(self.r_mm),
            "angle_edges": plain(self.angle_edges),
        }
        del record["angles"]
        for name in ESTIMATES:
            for key in (name, f"{name}_error"):
                record[key] = plain(getattr(self, key))
        return record


def batch_sizes(photons: int) -> np.ndarray:
    """How many photons each batch walks: (BATCHES,)."""
    return photons // BATCHES + (np.arange(BATCHES) < photons % BATCHES)


def _reach_mm(layers: Sequence[Layer]) -> float:
    """A radius that holds nearly all of what comes back (renderer.optics.medium.reach)."""
    thickness = sum(layer.d for layer in layers)
    reaches = []
    for layer in layers:
        if mu_t := layer.mu_a + layer.mu_s * (1 - layer.g):
            diffuse = 1 / math.sqrt(3 * layer.mu_a * mu_t) if layer.mu_a else math.inf
            reaches.append(reach(1 / mu_t, diffuse, thickness))
    return max(reaches, default=1.0)


def cache_folder() -> Path:
    """Where results are kept."""
    return caches.folder() / "montecarlo"


def simulate(
    layers: Sequence[Layer],
    photons: int = 1_000_000,
    seed: int = 0,
    n_above: float = 1.0,
    n_below: float = 1.0,
    illumination: str = "searchlight",
    r_max_mm: float | None = None,
    bins: int | Sequence[float] = BINS,
    cache: bool = True,
    progress: bool = False,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Result:
    """Send light on a stack of layers, first one on top, and count where it leaves.

    illumination: "searchlight", straight down at the origin, or "diffuse", cosine-distributed from
    above at the origin. bins: that many rings out to r_max_mm, r_max (i / bins)^2 wide apart, so
    that they are finest near the origin; or the edges of the rings themselves, 0 first, mm.
    r_max_mm defaults to a radius that holds nearly all of the light.

    The result has, each with its standard error in NAME_error and as a share of the incident light:

    * specular: mirrored at the first face, or come back from further down without being scattered;
    * diffuse_reflectance = single_reflectance + multiple_reflectance: left above, scattered once,
      or more than once;
    * transmittance = ballistic + single_transmittance + multiple_transmittance: left below;
      ballistic is unscattered;
    * absorbed, absorbed_by_layer (L,);
    * specular + diffuse_reflectance + transmittance + absorbed = 1 to rounding,

    and curves of scattered light: R, R_single, R_multiple, T, ... in 1/mm^2 on rings r_mm, edges_mm
    (what left beyond the last ring is R_beyond, T_beyond: the curve times area_mm2 and this sum to
    the total), and R_angular, T_angular in 1/sr, radiance times cosine as in MCML, on bins of exit
    angles angle_edges: times solid_angle they sum to the scattered total.

    cache: keep the result in the user's cache, where an interrupted run goes on and one with more
    photons starts from the largest with fewer. progress: a bar on stderr. threads: one a core if
    None. executor: walks instead of threads of this process, in as many workers as it has. The
    numbers depend on neither.
    """
    layers = tuple(layers)
    photons, threads = (
        _whole("photons", photons, BATCHES),
        _cores() if threads is None else _whole("threads", threads, 1),
    )
    if np.ndim(bins) == 0:
        count = min(_whole("bins", bins, 1), MOST_BINS + 1)  # more than enough to be refused
        radius = (
            _reach_mm([layer for layer in layers if isinstance(layer, Layer)])
            if r_max_mm is None
            else r_max_mm
        )
        if _number("r_max_mm", radius, 0, "a radius in mm, more than 0") == 0:
            raise InputError("r_max_mm is 0; expected a radius in mm, more than 0")
        bins = radius * (np.arange(count + 1) / count) ** 2
    elif r_max_mm is not None:
        raise InputError("r_max_mm and the edges of the bins are both given; expected one of them")
    setting = Setting(
        layers, seed, n_above, n_below, illumination, tuple(float(edge) for edge in bins)
    )
    run = Run(setting, photons, cache_folder() if cache else None)
    if (run.done < run.sizes).any():
        if executor is not None:
            run.go(progress, executor)
        else:
            with ThreadPoolExecutor(threads) as pool:
                run.go(progress, pool)
    return Result(setting, photons, run.tally)


def half_space(
    alpha: float,
    photons: int,
    seed: int = 0,
    illumination: str = "searchlight",
    bins: int | Sequence[float] = BINS,
    **rest,
) -> Result:
    """Burley's setting: isotropic scatterers of single-scattering albedo alpha, no boundary,
    sigma_t = 1/mm, so that mm are mean free paths.

    illumination "diffuse" is his diffuse transmission: light that enters cosine-distributed.
    """
    return simulate(
        [Layer(mu_a=1 - alpha, mu_s=alpha)],
        photons,
        seed,
        illumination=illumination,
        bins=bins,
        **rest,
    )


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Run:
    """The batches of one simulation: how far each is, its random state and its sums; can be left
    and taken up at any chunk.
    """

    def __init__(self, setting: Setting, photons: int, folder: Path | None):
        self.setting, self.sizes = setting, batch_sizes(photons)
        self.tally = Tally(setting)
        self.done = np.zeros(BATCHES, dtype=np.int64)
        self.state = np.random.SeedSequence(setting.seed).generate_state(BATCHES, np.uint64)
        self.file = None
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            self.file = folder / f"{setting.key()}-{photons}.npz"
            self._take_up(folder)

    def _take_up(self, folder: Path) -> None:
        """Start from the stored run of this setting that is furthest and not too far; what cannot
        be read does not count.
        """
        for file in folder.glob(f"{self.setting.key()}-*.npz"):
            try:
                with np.load(file, allow_pickle=False) as stored:
                    done, state, sums = stored["done"], stored["state"], stored["sums"]
            except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
                continue
            fits = done.shape == state.shape == (BATCHES,) and sums.shape == self.tally.sums.shape
            if fits and (done <= self.sizes).all() and done.sum() > self.done.sum():
                self.done[:], self.state[:], self.tally.sums[:] = done, state, sums

    def save(self) -> None:
        """Write the run whole or not at all."""
        if self.file is None:
            return
        part = self.file.with_name(f".{self.file.stem}.{os.getpid()}.npz")
        try:
            np.savez(part, done=self.done, state=self.state, sums=self.tally.sums)
            os.replace(part, self.file)
        finally:
            part.unlink(missing_ok=True)

    def go(self, progress: bool, executor: Executor) -> None:
        """Walk what is left, a stretch of each batch at a time. However this ends, the stretches
        that are finished are kept.
        """
        from tqdm import tqdm

        bar = tqdm(
            total=int(self.sizes.sum()),
            initial=int(self.done.sum()),
            desc="photons",
            unit="",
            unit_scale=True,
            disable=None if progress else True,
        )
        waiting: dict[Future, int] = {}

        def give(b: int) -> None:
            left = int(self.sizes[b] - self.done[b])
            if left:
                stretch = (self.setting, self.state[b], self.tally.sums[b].copy(), left)
                waiting[executor.submit(walk_stretch, *stretch)] = b

        def take(future: Future) -> None:
            b = waiting.pop(future)
            walked, self.state[b], self.tally.sums[b] = future.result()
            self.done[b] += walked
            bar.update(walked)

        saved = time.monotonic()
        with bar:
            try:
                for b in range(BATCHES):
                    give(b)
                while waiting:
                    for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                        b = waiting[future]
                        take(future)
                        give(b)
                    if time.monotonic() - saved > SAVE_EVERY_S:
                        self.save()
                        saved = time.monotonic()
            finally:
                for future in waiting:
                    future.cancel()
                for future in [f for f in waiting if f.done() and not f.cancelled()]:
                    if future.exception() is None:
                        take(future)
                self.save()


def walk_stretch(
    setting: Setting, state: np.uint64, sums: np.ndarray, most: int
) -> tuple[int, np.uint64, np.ndarray]:
    """Walk photons of one batch on from `state` for about STRETCH_S, `most` at most, and add to its
    sums (K,): (how many, the next state, the sums). In whatever process: it carries all it needs,
    and where a batch is cut changes nothing.
    """
    from renderer.optics.walk import walk

    mine, walked, count = Tally(setting), 0, CHUNK
    mine.sums[0] = sums
    views = (mine.unscattered[0], mine.absorbed[0], mine.radial[0], mine.angular[0])
    arrays, started = setting.arrays(), time.perf_counter()
    while walked < most and time.perf_counter() - started < STRETCH_S:
        count, before = min(count, most - walked), time.perf_counter()
        state = np.uint64(walk(count, state, *arrays, *views))
        walked += count
        if time.perf_counter() - before < CHUNK_S:
            count *= 2
    return walked, state, mine.sums[0].copy()
