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

    # single statistics, of plain numbers
    bradley_terry(wins), standard_errors(wins)  # worths of a win matrix, their errors
    davidson(wins, ties), davidson_sides(counts)  # with ties; with ties and a side
    thurstone_jod(wins, reduced_bias=True)  # JOD, also where a technique never won
    circular_triads(preferred), triad_distribution(5)  # of one person; of guessing
    holm(p), signed_rank(values), sign_test(values), equivalence(values, margin)
    kendall_u(counts), krippendorff_alpha(counts, "interval")
    t_power(0.5, 34), tost_power(0.0, 0.5, 40), sign_power(0.6, 0.2, 30)

`responses_from_records` takes mappings instead of a file. Errors of the user's making are
`InputError`. Figures and the report live in `analysis.figures` and `analysis.report`, which load
matplotlib. Names resolve on first use, so that `analysis.manifest`, `analysis.options` and
`analysis.declared`, which the study's own checks go by, load no scipy.
"""

from __future__ import annotations

import importlib

_WHERE = {
    name: module
    for module, names in {
        "analysis.agreement": (
            "circular_triads",
            "kendall_u",
            "krippendorff_alpha",
            "triad_distribution",
            "zeta",
        ),
        "analysis.ahp": (
            "Comparison",
            "Priorities",
            "comparisons",
            "medians",
            "priorities",
            "priorities_table",
            "read_matrices",
        ),
        "analysis.codebook": ("Codebook", "read_manifest"),
        "analysis.compute": ("Results", "everything"),
        "analysis.errors": ("InputError",),
        "analysis.inference": ("equivalence", "holm", "sign_test", "signed_rank"),
        "analysis.options": ("Exclusions", "Options"),
        "analysis.planning.closed_form": ("sign_power", "t_power", "tost_power"),
        "analysis.responses": (
            "Finding",
            "Responses",
            "read_responses",
            "responses_from_records",
        ),
        "analysis.tallies": (
            "distributions",
            "familiarity",
            "preferences",
            "scores",
            "sides",
            "totals",
            "trend",
        ),
        "analysis.worth": (
            "bradley_terry",
            "davidson",
            "davidson_sides",
            "standard_errors",
            "thurstone_jod",
        ),
    }.items()
    for name in names
}
__all__ = sorted(_WHERE)


def __getattr__(name: str):
    if name not in _WHERE:
        raise AttributeError(f"module 'analysis' has no attribute {name!r}")
    return getattr(importlib.import_module(_WHERE[name]), name)
