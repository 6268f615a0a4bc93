"""What the computation has to say of its tables, as sentences of the report: what was refused and
why, which variant was used; in labels and words, what is said of several framings said once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from analysis import worth_figures
from analysis.codebook import Codebook
from analysis.conclusions import MODEL_NAMES, MOST, listed, with_labels
from analysis.options import OVERALL

#: Words for the names of columns and statistics that notes are written in.
NAMES = {
    **MODEL_NAMES,
    "holm_p": "Holm's p",
    "log_nu": "log nu",
    "kendall_u_conditional": "Kendall's u with ties kept",
    "kendall_u": "Kendall's u",
    "krippendorff_alpha": "Krippendorff's alpha",
    "side_effect": "side effect",
    "one_side_share": "of one side",
    "answered_share": "of answered questions",
    "same_answer_share": "of the same answer",
    "median_rt_ms": "of the median time",
    "repeat_share": "of answers when asked again",
    "trap_share": "of answers to trap pairs",
    "strength_slope": "Strength over the order",
    "side_slope": "Side over the order",
    "time_slope": "Time over the order",
    "carry_over": "Carry-over",
    "rt_ms": "the time of an answer",
    "started_at": "when a question was shown",
}
#: What the notes of a table are about.
TOPICS = {
    "tallies": "Scores",
    "pair_medians": "Medians",
    "ahp_intervals": "AHP priorities",
    "ahp_consistency": "Consistency of the AHP matrices",
    "worths": "Worths",
    "worth_models": "Models of worth",
    "goodness": "Goodness of fit",
    "pairs": "Pairs",
    "contrasts": "Contrasts",
    "omnibus": "Omnibus tests",
    "by_images": "Images as a sample",
    "trend": "Preference against distance",
    "order_effects": "Order",
    "agreement": "Agreement",
    "side_balance": "Sides",
    "participants": "Exclusions",
    "sensitivity": "Exclusions",
    "familiarity_interaction": "Familiarity",
}


def remarks(lines: Iterable[str], codebook: Codebook) -> list[str]:
    """The notes of one table as sentences, in the order of the first of each.

    'FRAMING: TEXT', 'FRAMING, MODEL: TEXT' and 'FRAMING, A against B: TEXT' with the same text are
    one sentence.
    """
    about: dict[str, dict[str, list[str]]] = {}
    for line in lines:
        head, mark, text = line.partition(": ")
        framing, _, of = head.partition(", ")
        if mark and framing in (*codebook.framings, OVERALL):
            about.setdefault(text, {}).setdefault(framing, []).append(of)
        else:
            about.setdefault(line, {})
    sentences = []
    for text, framings in about.items():
        alike: dict[str, list[str]] = {}
        for framing, named in framings.items():
            named = [name for name in named if name]
            of = f"{len(named)} pairs" if len(named) > MOST else "; ".join(named)
            alike.setdefault(of, []).append(worth_figures.framing_label(codebook, framing))
        heads = [listed(where) + (f", {of}" if of else "") for of, where in alike.items()]
        sentences.append(plain(f"{'; '.join(heads)}: {text}" if heads else text, codebook))
    return sentences


def plain(line: str, codebook: Codebook) -> str:
    """A note as a sentence: labels and words for names."""
    line = re.sub(
        r"(?<![\w-])("
        + "|".join(sorted(map(re.escape, NAMES), key=len, reverse=True))
        + r")(?!\w)",
        lambda match: NAMES[match[0]],
        with_labels(line, codebook),
    )
    return (line[:1].upper() + line[1:]).rstrip(".") + "."


def topics(
    notes: Mapping[str, Iterable[str]], of_table: Iterable[str], codebook: Codebook
) -> list[tuple[str, list[str]]]:
    """(topic, sentences) of all tables, in the order of `TOPICS`; first what is said of the table
    of answers.
    """
    by_topic = {"Answers": [plain(line, codebook) for line in of_table]}
    for name, topic in TOPICS.items():
        by_topic.setdefault(topic, []).extend(remarks(notes.get(name, ()), codebook))
    return [(topic, sentences) for topic, sentences in by_topic.items() if sentences]
