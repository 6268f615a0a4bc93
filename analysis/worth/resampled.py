"""Worths in every resample of the participants, `FITTED` resamples at a time, here or elsewhere.

What is fitted together, and from which seed a resample is drawn (`analysis.bootstrap.BLOCK`), hangs
on the number of resamples alone: so the draws are the same to the bit whoever makes them.
"""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from functools import lru_cache
from itertools import repeat
from pathlib import Path

import numpy as np

from analysis import bootstrap
from analysis.options import Options
from analysis.panel import Panel, panels, tied, wins
from analysis.responses import Responses
from analysis.worth.binary import bradley_terry, thurstone_jod
from analysis.worth.existence import impossible
from analysis.worth.ties import davidson

#: Resamples whose worths are solved for together: a multiple of the bootstrap's block.
FITTED = 8 * bootstrap.BLOCK
MODELS = ("bradley_terry", "davidson", "thurstone_jod")

#: Worths (R, n) and davidson's log nu (R,), NaN for others, of so many resamples.
Fits = tuple[np.ndarray, np.ndarray]


def solve(panel: Panel, model: str, counts: np.ndarray, ties: str, reduced: bool) -> Fits:
    """Worths from counts (..., K, 5), with reduced bias or by maximum likelihood."""
    if model == "davidson":
        return davidson(wins(panel, counts, "drop"), tied(panel, counts), reduced)
    model_of = {"bradley_terry": bradley_terry, "thurstone_jod": thurstone_jod}[model]
    worths = model_of(wins(panel, counts, ties), reduced)
    return worths, np.full(worths.shape[:-1], np.nan)


def draws(panel: Panel, model: str, options: Options) -> tuple[np.ndarray, np.ndarray, int]:
    """Worths of all resamples, log nu, and how many have no maximum of the likelihood: then all are
    fitted with reduced bias, unless there is no fallback.
    """
    key = _key(model, options)
    if key not in panel.kept:

        def fits(reduced: bool) -> Iterable[Fits]:
            counts = bootstrap.counts(panel, options)
            for first in _starts(options):
                part = counts[first : first + FITTED]
                yield solve(panel, model, part, options.ties, reduced)

        panel.kept[key] = _gathered(fits, fits(False), options)
    return panel.kept[key]


def prepare(
    responses: Responses, options: Options, executor: Executor, folder: Path | None = None
) -> None:
    """Have an executor make the draws of all panels, which the tables then have.

    folder: one that all workers see, for a file of the answers while they are at it; the system's
    own for temporary files without it.
    """
    models = {*options.models, "thurstone_jod"} & set(MODELS)  # pairs are compared in JOD
    with tempfile.TemporaryDirectory(prefix=".answers-", dir=folder) as place:
        work = []
        for number, panel in enumerate(panels(responses).values()):
            file = Path(place).absolute() / f"{number}.pickle"
            file.write_bytes(pickle.dumps(panel.chosen(slice(None))))
            for model in sorted(models):
                if impossible(panel, model) is None:
                    fits = _by(executor, file, model, options)
                    work.append((panel, model, fits, fits(False)))  # all are on their way
        for panel, model, fits, first in work:
            panel.kept[_key(model, options)] = _gathered(fits, first, options)


def fit_part(file: Path, model: str, options: Options, reduced: bool, first: int) -> Fits:
    """The worths of `FITTED` resamples from `first` on of the panel in a file, in any process."""
    panel = _panel(file)
    counts = bootstrap.counts_between(panel, options, first, first + FITTED)
    return solve(panel, model, counts, options.ties, reduced)


@lru_cache(maxsize=2)
def _panel(file: Path) -> Panel:
    return pickle.loads(file.read_bytes())


def _by(
    executor: Executor, file: Path, model: str, options: Options
) -> Callable[[bool], Iterable[Fits]]:
    def fits(reduced: bool) -> Iterable[Fits]:
        same = (repeat(file), repeat(model), repeat(options), repeat(reduced))
        return executor.map(fit_part, *same, _starts(options))

    return fits


def _gathered(
    fits: Callable[[bool], Iterable[Fits]], first: Iterable[Fits], options: Options
) -> tuple[np.ndarray, np.ndarray, int]:
    worths, log_nu = map(np.concatenate, zip(*first, strict=True))
    without = int((~np.isfinite(worths)).any(axis=1).sum())
    if without and options.fallback != "none":
        worths, log_nu = map(np.concatenate, zip(*fits(True), strict=True))
    return worths, log_nu, without


def _starts(options: Options) -> range:
    return range(0, options.resamples, FITTED)


def _key(model: str, options: Options) -> tuple:
    ties = "drop" if model == "davidson" else options.ties
    return "draws", model, ties, options.resamples, options.seed, options.fallback
