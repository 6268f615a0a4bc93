"""Predicted visibility beside what people answered: which pairs could be told apart, and were.

The prediction is `visibility` of a manifest (`subdermal experiment visibility`): JOD between the
images of a pair as they were shown, by a metric that knows neither realism nor preference. A pair
that could hardly be told apart is answered by guessing; one that could may still divide people.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy import stats

from analysis.codebook import FRAMING, Codebook
from analysis.manifest import ManifestFile

#: JOD below which a pair is hardly told apart: 53 % of forced choices.
HARDLY = 0.1
COLUMNS = ["framing", "technique", "opponent", "predicted_jod", "predicted_flip"]


def read_visibility(manifest: ManifestFile, factor: str = FRAMING) -> pd.DataFrame:
    """framing (the level of `factor`), technique, opponent, predicted_jod (apart), predicted_flip:
    means over the cells of a level, without pairs whose images have changed since.
    """
    levels = {}
    for image in manifest.images:
        further = image.get("levels")
        own = {FRAMING: image.get("framing"), **(further if isinstance(further, dict) else {})}
        levels[image.get("sha256")] = own.get(factor)
    rows = [
        (levels[pair["sha256_a"]], pair["a"], pair["b"], 10 - pair["jod"], pair.get("flip", np.nan))
        for pair in manifest.visibility.get("pairs", [])
        if levels.get(pair["sha256_a"]) is not None
    ]
    table = pd.DataFrame(rows, columns=COLUMNS)
    table = table.groupby(COLUMNS[:3], sort=False, as_index=False)[COLUMNS[3:]].mean()
    about = manifest.visibility
    table.attrs["metric"] = f"{about.get('metric', 'A metric')} {about.get('version', '')}".strip()
    return table


def beside_answers(
    predicted: pd.DataFrame, distributions: pd.DataFrame, worths: pd.DataFrame
) -> pd.DataFrame:
    """What was predicted of each pair that was asked, with n answers, `noticed`: the share that was
    no 'no difference', `mean`: the mean answer from -2 (for technique) to 2 (for opponent), and
    `observed_jod`: how far apart their worths are by Thurstone's case V, NaN where there are none.

    distributions: see `tallies.distributions`; worths: the table of the models.
    """
    merged = predicted.merge(distributions, on=["framing", "technique", "opponent"], how="inner")
    counts = merged[[c for c in distributions.columns if c not in ("framing", "n")][2:]].to_numpy()
    merged = merged[[*COLUMNS, "n"]]
    answers = np.arange(-2, 3)
    n = merged.n.to_numpy(float)
    jod = worths[worths.model == "thurstone_jod"].set_index(["framing", "technique"]).estimate
    one, other = (
        np.array([jod.get(key, np.nan) for key in zip(merged.framing, merged[name], strict=True)])
        for name in ("technique", "opponent")
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        return merged.assign(
            noticed=1 - counts[:, 2] / n,
            mean=counts @ answers / n,
            observed_jod=np.abs(one - other),
        )


def sentences(table: pd.DataFrame, codebook: Codebook, metric: str) -> list[str]:
    """What is to be said of prediction and answers, in words."""
    if table.empty:
        return []
    close = table[table.predicted_jod < HARDLY]
    lines = [
        f"{metric} predicted of {len(close)} of {len(table)} pairs that as shown they are within "
        f"{HARDLY:g} JOD of each other, which 53 of 100 forced choices tell apart."
    ]
    if len(close) and len(close) < len(table):
        far = table[table.predicted_jod >= HARDLY]
        lines.append(
            f"Of answers about those, {100 * _noticed(close):.0f} % saw a difference; of answers "
            f"about the others, {100 * _noticed(far):.0f} %."
        )
    for column, about in (("noticed", "the share that saw a difference"), ("observed_jod", "JOD")):
        known = table[table[column].notna()]
        if len(known) >= 4 and known[column].nunique() > 1 and known.predicted_jod.nunique() > 1:
            result = stats.spearmanr(known.predicted_jod, known[column])
            lines.append(
                f"Rank correlation of the prediction with {about} over {len(known)} pairs: "
                f"{result.statistic:z.2f} (pairs share images: no p is given)."
            )
    return lines


def _noticed(table: pd.DataFrame) -> float:
    return float((table.noticed * table.n).sum() / table.n.sum())
