"""From a table of answers to tables and figures.

Knows nothing of the renderer, the stimuli or the web application.

The public face (numpy, pandas and scipy, no matplotlib):

    from analysis import read_responses, read_manifest, scores, comparisons, priorities
    # a tidy table, see Responses
    responses = read_responses("responses.csv", read_manifest("study"))
    scores(responses)  # framing, technique, score
    for framing, comparison in comparisons(responses).items():  # AHP matrix of medians
        if not comparison.missing:
            print(framing, priorities(comparison.matrix))  # vector, lambda_max, ci, cr

    # every statistic, see analysis.compute
    results = everything(responses, Options(seed=1, margin=0.5))
    results.tables["worths"], results.notes["worths"]  # numbers; what was refused and why

`responses_from_records` takes mappings instead of a file. Errors of the user's making are
`InputError`. Figures and the report live in `analysis.figures` and `analysis.report`, which load
matplotlib.
"""

from analysis.ahp import (
    Comparison,
    Priorities,
    comparisons,
    medians,
    priorities,
    priorities_table,
    read_matrices,
)
from analysis.codebook import Codebook, read_manifest
from analysis.compute import Results, everything
from analysis.errors import InputError
from analysis.options import Exclusions, Options
from analysis.responses import Finding, Responses, read_responses, responses_from_records
from analysis.tallies import distributions, familiarity, preferences, scores, sides, totals, trend

__all__ = [
    "Codebook",
    "Comparison",
    "Exclusions",
    "Finding",
    "InputError",
    "Options",
    "Priorities",
    "Responses",
    "Results",
    "comparisons",
    "distributions",
    "everything",
    "familiarity",
    "medians",
    "preferences",
    "priorities",
    "priorities_table",
    "read_manifest",
    "read_matrices",
    "read_responses",
    "responses_from_records",
    "scores",
    "sides",
    "totals",
    "trend",
]
