"""Every statistic of a study in one call: tables with fixed columns, and notes.

The notes say what was refused and which variant was used.

    from analysis import read_responses
    from analysis.compute import everything
    results = everything(read_responses("responses.csv"))
    results.tables["worths"]            # a DataFrame
    results.notes["worths"]             # what is not in it, and why

Numbers that do not exist are empty (NaN), and a note names the reason. Intervals are at
`Options.level`; unless a table says otherwise they come from a bootstrap over participants
(`analysis.bootstrap`). Preferences run from -2 (strong for a) over 0 to 2 (strong for b). The
framing 'overall' holds all framings together, where there are several.

Answers that were read with another factor (`read_responses(..., factor="lighting")`) are grouped
by it: every table keeps its columns, and `framing` holds the level. The table notes begins with
what the levels hold, under the name 'all'.

    tallies         framing,technique,score,low,high
                    points, see analysis.tallies
    pair_medians    framing,a,b,n,median_preference,low,high
    ahp_intervals   framing,aggregation,method,technique,priority,low,high
                    aggregation median|geometric_mean, method eigenvector|row_geometric_mean
    ahp_consistency framing,aggregation,ci,ci_low,ci_high,cr,cr_low,cr_high,a,b,
                    judgement,consistent,chance_cr,chance_share
                    a,b: the judgement to look at again, 'consistent' what the others imply;
                    chance_cr, chance_share: where the CR lies among studies settled by a coin
    worths          framing,model,technique,estimate,low,high,fit
                    centred on 0 within a framing; fit: 'maximum likelihood', or what stands in
    worth_models    framing,model,parameter,estimate,low,high
                    ties, side effect, spread of people
    goodness        framing,model,parameters,log_likelihood,deviance,df,p
                    how well a model describes the pairs
    pairs           framing,a,b,n,strong_a,slight_a,none,slight_b,strong_b,wilcoxon_p,sign_p,holm_p,
                    tost_p,wilcoxon_method,mean_preference,low,high,equivalence_low,
                    equivalence_high,tost_holm_p,equivalent,rank_biserial,dz,jod,jod_low,jod_high,
                    jod_equivalent,simultaneous_low,simultaneous_high,jod_simultaneous_low,
                    jod_simultaneous_high,rank_biserial_low,rank_biserial_high,dz_low,dz_high
                    jod: worth of b less worth of a
    contrasts       framing,a,b,estimate,low,high,p,holm_p
                    differences of worths from all answers of a framing, points
    omnibus         framing,question,people,size,p
                    any difference, additivity, interaction of technique and framing
    trend           statistic,value,low,high,p
                    preference against distance
    by_images       a,b,images,mean_preference,low,high,p,holm_p,least,most
                    kinds of images as a sample
    order_effects   statistic,people,value,low,high,p
                    fatigue, and what the question before does
    agreement       framing,statistic,value,low,high,p
    side_balance    framing,technique,left,right,left_share,p,holm_p
                    on which side each technique stood
    participants    participant,familiarity,answers,left,none,right,side_p,same_answer_share,
                    median_rt_ms,circular_triads,zeta,repeats,repeat_share,traps,trap_share,
                    agreement_with_others,excluded
                    excluded: the rule that fires, or ''
    sensitivity     framing,conclusion,a,b,everyone,without_excluded,changed
                    with and without the excluded
    familiarity_interaction
                    framing,technique,n,slope,low,high,spearman,p,holm_p,detectable
                    detectable: the correlation found with a power of 0.8
    notes           table,note
                    what was refused, and why
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from analysis import agreement, ahp, bootstrap, inference, worth
from analysis.options import Options
from analysis.responses import Responses
from analysis.worth import resampled


@dataclass(frozen=True)
class Results:
    """tables: name -> DataFrame; notes: name -> lines; options: what was chosen;
    see the module for the columns.
    """

    tables: Mapping[str, pd.DataFrame]
    notes: Mapping[str, tuple[str, ...]]
    options: Options


#: Table -> what makes it, in the order of the report.
TABLES = {
    "tallies": bootstrap.score_intervals,
    "pair_medians": bootstrap.median_intervals,
    "ahp_intervals": ahp.priority_intervals,
    "ahp_consistency": ahp.consistency_intervals,
    "worths": worth.worths,
    "worth_models": worth.parameters,
    "goodness": worth.goodness,
    "pairs": inference.pairs,
    "contrasts": inference.contrasts,
    "omnibus": inference.omnibus,
    "by_images": inference.by_images,
    "trend": inference.trend,
    "order_effects": inference.order_effects,
    "agreement": agreement.agreement,
    "side_balance": agreement.side_balance,
    "participants": agreement.participants,
    "sensitivity": agreement.sensitivity,
    "familiarity_interaction": inference.familiarity_interaction,
}


def everything(
    responses: Responses,
    options: Options | None = None,
    progress: Callable[[Iterable], Iterable] = lambda steps: steps,
    executor: Executor | None = None,
    folder: Path | None = None,
) -> Results:
    """All tables of this module's docstring.

    Deterministic: the same answers and options give the same bytes. progress wraps the list of
    tables, as tqdm does. executor: fits the worths of the resamples, which take longest; folder:
    one that its workers see, the system's own for temporary files without it.
    """
    options = options or Options()
    if executor is not None:
        resampled.prepare(responses, options, executor, folder)
    tables = {name: TABLES[name](responses, options) for name in progress(list(TABLES))}
    notes = {name: table.attrs.get("notes", ()) for name, table in tables.items()}
    lines = [("all", line) for line in responses.grouping] + [
        (name, line) for name, remarks in notes.items() for line in remarks
    ]
    return Results(
        tables | {"notes": pd.DataFrame(lines, columns=["table", "note"])}, notes, options
    )
