"""The files of a posterior: tables, all draws, a figure and posterior.md, doubts first."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis import figures
from analysis.codebook import Codebook
from analysis.figures import BLUE, SIMULATED, Picture
from analysis.files import csv_bytes
from analysis.methods import versions
from analysis.options import OVERALL, Options
from analysis.posterior.model import NEW_IMAGE, Posterior
from analysis.responses import Responses
from analysis.worth_figures import rungs

NAMES = {
    "sd_image": "spread of what a technique gains in one image",
    "sd_taste": "spread of people's tastes for a technique",
    "sd_person_side": "spread of people's leaning to a side",
    "side": "leaning to the right",
    "threshold_slight": "from here on a preference",
    "threshold_clear": "from here on a clear one",
}


def posterior_files(
    posterior: Posterior, responses: Responses, command: str = "", fingerprint: str = ""
) -> tuple[dict[str, bytes], list[str]]:
    """The files, path -> content, and what they say in short, a sentence each, doubts first;
    fingerprint: of what the study declares, see `analysis.declared`.
    """
    codebook, simulated, level = responses.codebook, responses.simulated, posterior.options.level
    worths, pairs, parameters = posterior.worths(), posterior.pairs(), posterior.parameters()
    sentences = [*_doubts(posterior), *_best(posterior, worths, codebook), *_images(posterior)]
    tables = {"posterior_worths": worths, "posterior_pairs": pairs}
    tables |= {"posterior_parameters": parameters}
    page = _page(posterior, responses, tables, sentences, command, fingerprint)
    files = {
        f"{name}.csv": csv_bytes(table.assign(simulated=int(simulated)), 6)
        for name, table in tables.items()
    }
    files |= {"posterior.npz": posterior.draws(), "posterior.md": page.encode()}
    for picture in draw_posterior(worths, codebook, simulated, level):
        files |= picture.files
    return files, sentences


def place_label(codebook: Codebook, name: str) -> str:
    """'All images', 'A new image', or the image's levels."""
    named = {OVERALL: "All images", NEW_IMAGE: "A new image"}
    return named.get(name) or codebook.framing_label(name)


def _doubts(posterior: Posterior) -> list[str]:
    doubts = posterior.doubts()
    if not doubts:
        return []
    return [
        f"These draws may not be those of the posterior: {'; '.join(doubts)}. Draw more, or warm "
        "up longer."
    ]


def _best(posterior: Posterior, worths: pd.DataFrame, codebook: Codebook) -> list[str]:
    """Which technique is most probably the best, at each place."""
    sentences = []
    for name, rows in worths.groupby("framing", sort=False):
        row = rows.loc[rows.p_best.idxmax()]
        sentences.append(
            f"{place_label(codebook, name)}: {codebook.label(row.technique)} is the best with "
            f"probability {row.p_best:.2f}."
        )
    return sentences


def _images(posterior: Posterior) -> list[str]:
    """What one image can change."""
    level = posterior.options.level
    if len(posterior.images) < 2:
        return ["One kind of image was shown: nothing is said of others."]
    low, middle, high = np.quantile(
        posterior.spread["image"], [(1 - level) / 2, 0.5, (1 + level) / 2]
    )
    return [
        f"What a technique gains or loses from image to image spreads by {middle:.2f} logits "
        f"[{low:.2f}, {high:.2f}]; rows of 'a new image' have that in their intervals."
    ]


def _origin(options: Options) -> str:
    """Where priors and sampling come from."""
    names = [name.partition(".")[2] for name in options.declared if name.startswith("posterior.")]
    if not names:
        return "No prior was declared in a study file: they are defaults or were given."
    return f"Declared in the study file: {', '.join(names)}; the others are defaults or were given."


def _page(
    posterior: Posterior,
    responses: Responses,
    tables: dict[str, pd.DataFrame],
    sentences: list[str],
    command: str,
    fingerprint: str,
) -> str:
    codebook, sampling = responses.codebook, posterior.options.posterior
    percent = f"{100 * posterior.options.level:g} %"
    lines = ["# What the answers make of the techniques, by a Bayesian model", ""]
    if responses.simulated:
        lines += [f"**{SIMULATED}**", ""]
    lines += [f"- {sentence}" for sentence in sentences]
    lines += [
        "",
        f"{posterior.answers} answers of {posterior.people} participants at "
        f"{len(posterior.images)} kinds of images. Worths are in logits, 0 is the mean of the "
        f"techniques, intervals are central and hold {percent} of the posterior. People and images "
        "are both samples: a technique's worth "
        "is that over all images, and what one image adds to it is drawn from a spread of its own.",
        "",
        "![Worths](figures/posterior.svg)",
        "",
        "| | technique | median | interval | best with probability |",
        "|---|---|--:|---|--:|",
    ]
    for row in tables["posterior_worths"].itertuples():
        lines.append(
            f"| {place_label(codebook, row.framing)} | {codebook.label(row.technique)} | "
            f"{row.median:z.2f} | {row.low:z.2f} to {row.high:z.2f} | {row.p_best:.2f} |"
        )
    lines += ["", "## Pairs", "", "| | A | B | A less B | interval | A is better |"]
    lines += ["|---|---|---|--:|---|--:|"]
    for row in tables["posterior_pairs"].itertuples():
        lines.append(
            f"| {place_label(codebook, row.framing)} | {codebook.label(row.a)} | "
            f"{codebook.label(row.b)} | {row.median:z.2f} | {row.low:z.2f} to {row.high:z.2f} | "
            f"{row.p_a_better:.2f} |"
        )
    lines += ["", "## The other parameters, and whether the draws can be trusted", ""]
    lines += ["| | median | interval | R-hat | effective draws |", "|---|--:|---|--:|--:|"]
    for row in tables["posterior_parameters"].itertuples():
        name = row.parameter.removeprefix("worth.")
        label = NAMES.get(name) or f"worth of {codebook.label(name)}"
        lines.append(
            f"| {label} | {row.median:z.2f} | {row.low:z.2f} to {row.high:z.2f} | "
            f"{row.r_hat:.3f} | {row.ess:.0f} |"
        )
    priors = sampling.priors
    lines += [
        "",
        "## How",
        "",
        "- Cumulative logits with thresholds symmetric about 0, a side effect, and crossed random "
        "effects of people and images (`analysis/posterior/model.py`).",
        f"- Priors, half-normal, logits: the spread of worths {priors['worth']:g}, of images "
        f"{priors['image']:g}, of tastes {priors['taste']:g}, of leanings to a side "
        f"{priors['person_side']:g}; the steps of the thresholds {priors['slight']:g} and "
        f"{priors['clear']:g}; normal: the side {priors['side']:g}.",
        f"- {sampling.chains} chains of {sampling.draws} draws after {sampling.warmup} of warm-up, "
        f"No-U-Turn sampler aiming at an acceptance of {sampling.target_acceptance:g}, seed "
        f"{posterior.options.seed}.",
        f"- {_origin(posterior.options)}",
        *([f"- sha256 of the study's [analysis]: {fingerprint}."] if fingerprint else []),
        f"- Answers: {responses.source}, sha256 {responses.sha256}.",
        "- " + ", ".join(f"{k} {v}" for k, v in versions(("jax", "numpyro")).items()) + ".",
    ]
    if command:
        lines += ["", f"    {command}"]
    return "\n".join(lines) + "\n"


def draw_posterior(
    worths: pd.DataFrame, codebook: Codebook, simulated: bool = False, level: float = 0.95
) -> list[Picture]:
    """Worths over all images, with the pale interval of a new image; then image by image."""
    places = [name for name in dict.fromkeys(worths.framing) if name != NEW_IMAGE]
    height = 0.5 + 0.2 * worths.technique.nunique()

    def alt(page: list[str]) -> str:
        return "; ".join(
            f"{place_label(codebook, name)}: "
            + ", ".join(
                f"{codebook.label(row.technique)} {row.median:z.2f}"
                for row in worths[worths.framing == name].itertuples()
            )
            for name in page
        )

    return figures._paged(
        "posterior",
        "Worths by the Bayesian model",
        "Posterior medians of worth in logits, 0 the mean of the techniques, with central "
        f"intervals that hold {100 * level:g} % of the posterior; pale: at an image of the same "
        "sort that nobody has seen.",
        figures._chunks(places, 2 * figures._rows_that_fit(height, 0.25)),
        alt,
        _ladders,
        worths,
        codebook,
        simulated=simulated,
    )


def _ladders(places: list[str], worths: pd.DataFrame, codebook: Codebook) -> Figure:
    height = 0.5 + 0.2 * worths.technique.nunique()
    figure, panels = figures._panels(
        len(places), min(2, len(places)), height, below_in=0.25, sharex=True
    )
    overall = worths[worths.framing == OVERALL].sort_values("median", ascending=False)
    order = list(overall.technique)
    for ax, place in zip(panels, places, strict=True):
        here = worths[worths.framing == place].set_index("technique").loc[order]
        if place == OVERALL:
            new = worths[worths.framing == NEW_IMAGE].set_index("technique")
            for y, name in enumerate(name for name in order if name in new.index):
                row = new.loc[name]
                ax.plot([row.low, row.high], [y, y], color="#bcd9ec", linewidth=5, zorder=1)
        for y, row in enumerate(here.itertuples()):
            ax.plot([row.low, row.high], [y, y], color=BLUE, linewidth=1.6, zorder=2)
            ax.plot(row.median, y, "o", color=BLUE, markersize=4.5, zorder=3)
        rungs(ax, [codebook.label(name) for name in order])
        ax.set_title(figures._cut(place_label(codebook, place), 34), loc="left")
    figure.supxlabel("logits, to the right looks more real", size=8)
    return figure
