"""Whether a difference holds for other images: pictures are a sample too, as soon as a study shows
several (framings, persons, skins, lights).

Intervals that resample people alone speak for the images that were shown (Clark 1973, "The
language-as-fixed-effect fallacy", Journal of Verbal Learning and Verbal Behavior 12(4),
doi:10.1016/S0022-5371(73)80014-3).
Beside them stands his analysis by items: the mean preference about a pair at each kind of image is
one number, and Student's t test asks whether their mean is 0 for images of that sort. It needs
`FEWEST_IMAGES` kinds, and with few it finds little: that is what few images say of others.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
from scipy import stats

from analysis.inference.pairs import preferences
from analysis.inference.people import holm
from analysis.options import Options
from analysis.panel import panels, with_notes
from analysis.responses import Responses

FEWEST_IMAGES = 3


def by_images(responses: Responses, options: Options) -> pd.DataFrame:
    """a, b, images, mean_preference, low, high, p, holm_p, least, most: over the kinds of images at
    which a pair was asked; least and most: the mean preference at the ones that favour a and b
    most.
    """
    columns = ["a", "b", "images", "mean_preference", "low", "high", "p", "holm_p", "least", "most"]
    parts = list(panels(responses).values())[-1].parts
    if len(parts) < FEWEST_IMAGES:
        note = (
            f"nothing is said of other images, which needs {FEWEST_IMAGES} kinds of images: there "
            f"{'is' if len(parts) == 1 else 'are'} {len(parts)}"
        )
        return with_notes([], columns, [note])
    means: dict[tuple[str, str], list[float]] = {}
    for part in parts:
        given = preferences(part)
        for k, (i, j) in enumerate(combinations(range(len(part.items)), 2)):
            one = given[:, k][np.isfinite(given[:, k])]
            if len(one):
                means.setdefault((part.items[i], part.items[j]), []).append(float(one.mean()))
    rows = []
    for (a, b), values in means.items():
        count, mean = len(values), float(np.mean(values))
        error = float(np.std(values, ddof=1) / np.sqrt(count)) if count >= FEWEST_IMAGES else 0.0
        low = high = p = np.nan
        if error > 0:
            half = stats.t.ppf((1 + options.level) / 2, count - 1) * error
            low, high = mean - half, mean + half
            p = float(2 * stats.t.sf(abs(mean) / error, count - 1))
        rows.append((a, b, count, mean, low, high, p, np.nan, min(values), max(values)))
    table = with_notes(rows, columns, [])
    table["holm_p"] = holm(table.p.to_numpy(float)) if len(table) else table.p
    return table
