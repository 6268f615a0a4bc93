"""Whether differences hold for other people: tests on participants, never on single answers;
equivalence; contrasts; omnibus tests; trend; order; familiarity.

people       tests of one number a person, or of counts of people: signed ranks, sign, two one-sided
             t tests, Holm
pairs        every pair, with the verdict that the report draws
contrasts    differences of worths from all answers of a framing
omnibus      any difference at all, additivity, interaction of technique and framing
images       whether a difference holds for other images
order        fatigue, and what the question before does
trend, familiarity

All differences point the same way: positive is for b.
"""

from analysis.inference.contrasts import contrasts, linear_contrasts
from analysis.inference.familiarity import familiarity_interaction, net_scores
from analysis.inference.images import by_images
from analysis.inference.omnibus import omnibus
from analysis.inference.order import order_effects
from analysis.inference.pairs import PAIRS, pairs, preferences, simultaneous, verdict
from analysis.inference.people import (
    EXACT_PEOPLE,
    alpha_of,
    equivalence,
    holm,
    holm_in_families,
    sign_flip,
    sign_test,
    signed_rank,
)
from analysis.inference.trend import trend

__all__ = [
    "EXACT_PEOPLE",
    "PAIRS",
    "alpha_of",
    "by_images",
    "contrasts",
    "equivalence",
    "familiarity_interaction",
    "holm",
    "holm_in_families",
    "linear_contrasts",
    "net_scores",
    "omnibus",
    "order_effects",
    "pairs",
    "preferences",
    "sign_flip",
    "sign_test",
    "signed_rank",
    "simultaneous",
    "trend",
    "verdict",
]
