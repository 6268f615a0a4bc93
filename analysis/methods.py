"""methods.md: the paragraph for the paper. Every choice, with its source, the versions and the
seed.
"""

from __future__ import annotations

import platform
import re
from collections.abc import Iterable, Mapping
from importlib import metadata

from analysis.agreement import rules_in_words
from analysis.codebook import FRAMING
from analysis.conclusions import MODEL_NAMES, count
from analysis.inference import alpha_of
from analysis.options import Options
from analysis.responses import Responses
from analysis.worth import FEW_ANSWERS, NO_TASTE, QUADRATURE_ITEMS

#: Key -> reference, as it is cited.
REFERENCES = {
    "saaty1980": "Saaty, T. L. (1980). The Analytic Hierarchy Process. McGraw-Hill.",
    "bradley1952": (
        "Bradley, R. A. and Terry, M. E. (1952). Rank analysis of incomplete "
        "block designs I. Biometrika 39(3/4), 324-345. doi:10.2307/2334029"
    ),
    "davidson1970": (
        "Davidson, R. R. (1970). On extending the Bradley-Terry model to "
        "accommodate ties in paired comparison experiments. JASA 65(329), 317-328. "
        "doi:10.1080/01621459.1970.10481082"
    ),
    "thurstone1927": (
        "Thurstone, L. L. (1927). A law of comparative judgment. Psychological "
        "Review 34(4), 273-286. doi:10.1037/h0070288"
    ),
    "perezortiz2017": (
        "Perez-Ortiz, M. and Mantiuk, R. K. (2017). A practical guide and "
        "software for analysing pairwise comparison experiments. arXiv:1712.03686"
    ),
    "agresti1992": (
        "Agresti, A. (1992). Analysis of ordinal paired comparison data. Applied "
        "Statistics 41(2), 287-297. doi:10.2307/2347562"
    ),
    "wilcoxon1945": (
        "Wilcoxon, F. (1945). Individual comparisons by ranking methods. "
        "Biometrics Bulletin 1(6), 80-83. doi:10.2307/3001968"
    ),
    "holm1979": (
        "Holm, S. (1979). A simple sequentially rejective multiple test procedure. "
        "Scandinavian Journal of Statistics 6(2), 65-70."
    ),
    "schuirmann1987": (
        "Schuirmann, D. J. (1987). A comparison of the two one-sided tests "
        "procedure and the power approach. J. Pharmacokinetics and Biopharmaceutics 15, "
        "657-680. doi:10.1007/BF01068419"
    ),
    "kendall1940": (
        "Kendall, M. G. and Babington Smith, B. (1940). On the method of paired "
        "comparisons. Biometrika 31(3/4), 324-345. doi:10.2307/2332613"
    ),
    "krippendorff2013": "Krippendorff, K. (2013). Content Analysis, 3rd ed. Sage, section 12.3.",
    "page1963": (
        "Page, E. B. (1963). Ordered hypotheses for multiple treatments: a "
        "significance test for linear ranks. JASA 58(301), 216-230. "
        "doi:10.1080/01621459.1963.10500843"
    ),
    "hesterberg2015": (
        "Hesterberg, T. C. (2015). What teachers should know about the "
        "bootstrap. The American Statistician 69(4), 371-386. doi:10.1080/00031305.2015.1089789"
    ),
    "kerby2014": (
        "Kerby, D. S. (2014). The simple difference formula: an approach to "
        "teaching nonparametric correlation. Comprehensive Psychology 3. doi:10.2466/11.IT.3.1"
    ),
    "firth1993": (
        "Firth, D. (1993). Bias reduction of maximum likelihood estimates. Biometrika 80(1), "
        "27-38. doi:10.1093/biomet/80.1.27"
    ),
    "kosmidis2009": (
        "Kosmidis, I. and Firth, D. (2009). Bias reduction in exponential family nonlinear "
        "models. Biometrika 96(4), 793-804. doi:10.1093/biomet/asp055"
    ),
    "westfall1993": (
        "Westfall, P. H. and Young, S. S. (1993). Resampling-based multiple testing. Wiley, "
        "section 2.5."
    ),
    "liang1986": (
        "Liang, K.-Y. and Zeger, S. L. (1986). Longitudinal data analysis using generalized "
        "linear models. Biometrika 73(1), 13-22. doi:10.1093/biomet/73.1.13"
    ),
    "clark1973": (
        "Clark, H. H. (1973). The language-as-fixed-effect fallacy. Journal of Verbal Learning "
        "and Verbal Behavior 12(4), 335-359. doi:10.1016/S0022-5371(73)80014-3"
    ),
    "okabe2002": (
        "Okabe, M. and Ito, K. (2002). Color Universal Design: how to make figures "
        "and presentations that are friendly to colorblind people."
    ),
}
PACKAGES = ("subdermal", "numpy", "scipy", "pandas", "matplotlib", "typst")


def versions(further: Iterable[str] = ()) -> dict[str, str]:
    """Name -> version of what made the numbers and the figures, and of further packages."""
    result = {"Python": platform.python_version()}
    for name in (*PACKAGES, *further):
        try:
            result[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            result[name] = "not installed as a package"
    return result


def rejected_rows(responses: Responses) -> str:
    """How many rows are not counted, and why, in words: a count for each reason."""
    if not responses.findings:
        return "every row of the table was used"
    kinds: dict[str, int] = {}
    for one in responses.findings:
        reason = {
            "duplicate": "the person had answered that question already",
            "no level": "the person has no level to group by",
        }.get(one.kind)
        if reason is None:  # 'answer is '7', expected ...; left is ...': by what is first
            reason = re.sub(r" is '.*?', expected ", " is not ", one.reason.split("; ")[0])
        kinds[reason] = kinds.get(reason, 0) + 1
    listed = "; ".join(f"{number}: {reason}" for reason, number in kinds.items())
    return f"{count(len(responses.findings), 'row')} of the table could not be used ({listed})"


def missing_values(responses: Responses) -> str:
    """What is missing beside answers that are counted, in words; '' where nothing is."""
    kinds: dict[str, list[str]] = {}
    for one in responses.missing:
        kinds.setdefault(one.column, []).append(one.expected)
    if not kinds:
        return ""
    listed = ", ".join(
        f"{column} in {count(len(expected), 'answer')} (not {expected[0]})"
        for column, expected in kinds.items()
    )
    return f"Missing, with the answer counted: {listed}. "


def paragraphs(responses: Responses, options: Options, declared: str) -> list[tuple[str, str]]:
    """(heading, text) in the order of the paper; references as [key]. declared: where margins and
    rules come from.
    """
    frame, alpha = responses.frame, alpha_of(options)
    kind = (
        "SIMULATED participants (programs, not people)" if responses.simulated else "participants"
    )
    pairs = sum(len(items) * (len(items) - 1) // 2 for items in responses.items.values())
    codebook = responses.codebook
    asked = len(frame[["framing", "a", "b"]].drop_duplicates())
    present = {name for items in responses.items.values() for name in items}
    names = ", ".join(
        responses.codebook.label(name) for name in responses.codebook.techniques if name in present
    )
    rows = rejected_rows(responses)
    together = options.family == "study"
    family = f"all {codebook.levels} together" if together else f"each {codebook.level}"
    result = [
        (
            "Answers",
            f"{responses.participants} {kind} compared images in pairs: {names}; at "
            f"{codebook.counted(len(responses.items))} "
            f"({', '.join(responses.codebook.framing_label(name) for name in responses.items)}), "
            f"{asked} of {pairs} pairs in all. They "
            "answered on a scale from \N{MINUS SIGN}2 (strong preference for the left image) "
            "over 0 (no difference seen) to 2 (strong "
            f"preference for the right one). {len(frame)} answers were analysed; {rows}. "
            f"{missing_values(responses)}"
            "Sides and order were as the table gives them; answers were turned to the pair "
            "before anything was computed.",
        ),
        *([("Grouping", " ".join(responses.grouping))] if responses.grouping else []),
        *(
            [("Images", f"The images were made from {'; '.join(codebook.made_from)}.")]
            if codebook.made_from
            else []
        ),
        (
            "Scores and priorities",
            "A strong preference gives two points, a slight one gives one. For the Analytic "
            "Hierarchy Process [saaty1980] the answers 0, 1 "
            "and 2 are the judgements 1, 2 and 3, or their reciprocals. Judgements were put "
            "together over people by the median, taken above "
            f"the diagonal in the order {names} and inverted below it, and by the geometric "
            "mean; priorities are the principal eigenvector "
            "and, beside it, the geometric means of the rows; CR uses Saaty's random index "
            "for up to 10 techniques, and is set against the CR of studies with the same strengths "
            f"whose directions are settled by a coin ({options.resamples} of them).",
        ),
        (
            "Worths",
            f"Worths, centred on 0 within a {codebook.level}, were estimated in four models: "
            "Bradley-Terry [bradley1952] and Thurstone's case V "
            "[thurstone1927] in just-objectionable differences (1 JOD: 75 % prefer one of "
            "the two) [perezortiz2017], with 'no difference' "
            + ("as half a preference each way" if options.ties == "half" else "left out")
            + "; Davidson's model, in which ties are an outcome of their own [davidson1970]; "
            "and a cumulative-logit model of all five answers "
            "[agresti1992] with a fixed side effect and random effects of participants for "
            "techniques and side, by Laplace's approximation "
            f"(by adaptive Gauss-Hermite quadrature for up to {QUADRATURE_ITEMS} techniques "
            f"and at most {FEW_ANSWERS} answers a person; without "
            f"random effects where nobody gave more than {NO_TASTE} answers). "
            f"Models fitted: {', '.join(MODEL_NAMES[name] for name in options.models)}. All are "
            "maximum likelihood where it "
            "has a finite maximum under this handling of ties; "
            + (
                "where it has none (a technique that never wins, or never loses), fits with "
                "reduced bias [firth1993, kosmidis2009], and for the ordinal model weak normal "
                "priors, stand in and are marked."
                if options.fallback != "none"
                else "where it has none no worth is given."
            ),
        ),
        (
            "Intervals",
            f"Intervals are at {100 * options.level:g} %. They resample participants, with "
            f"all of their answers, {options.resamples} times "
            f"(seed {options.seed}) and are expanded percentile intervals [hesterberg2015]; "
            "those of the ordinal model are Wald's, those of "
            "Kendall's u and Krippendorff's alpha are jackknifed over participants. "
            "Where a resample has no finite maximum, all resamples are fitted with reduced bias "
            "and the interval is at least Wald's. "
            "Adjusted intervals of differences hold together over the declared family, by the "
            "largest studentised deviation over the resamples [westfall1993].",
        ),
        (
            "Differences",
            "Each pair was tested on participants, one value a person, by Wilcoxon's "
            "signed-rank test [wilcoxon1945] (zeros dropped, ties with "
            "mean ranks, exact up to 50 people with a preference, then the normal "
            "approximation with ties corrected and no continuity "
            "correction) and by the exact two-sided sign test. The declared test is the "
            f"{'Wilcoxon test' if options.test == 'wilcoxon' else 'sign test'}, corrected by "
            "Holm's procedure [holm1979] over the pairs of "
            f"{family}, at {alpha:g}. Effect sizes are the matched-pairs "
            "rank-biserial correlation [kerby2014] and the standardised mean difference. Beside "
            "the tests of single pairs, which decide, stand contrasts of a linear model of all "
            "answers with people as clusters [liang1986], tests by sign flips of people of any "
            "difference at all, of additivity and of an interaction of technique and "
            f"{codebook.level}, and "
            "t tests over the kinds of images, taken as a sample [clark1973].",
        ),
        ("Equivalence", _equivalence(options, alpha, declared)),
        (
            "Agreement and quality",
            "Consistency is by circular triads and zeta [kendall1940], agreement by "
            "Kendall's u [kendall1940] (chi-square test where everyone "
            "answered every pair without ties; else by flipping decided answers) and "
            "Krippendorff's ordinal alpha [krippendorff2013], all on "
            "answers turned to the pair. "
            + (
                (
                    "The trend over framings is the slope of each person's mean strength of "
                    "preference, and Page's L [page1963]. "
                )
                if codebook.factor == FRAMING
                else ""
            )
            + (
                "Familiarity was set against each person's preference for a technique by "
                "Spearman's correlation, and how often each technique stood on the left was tested "
                "by the binomial; both are Holm-corrected over the same family as the pairs."
            ),
        ),
        (
            "Exclusions",
            "Everyone is counted. Every conclusion was computed again without those whom the rules "
            f"of exclusion name: {rules}."
            if (rules := rules_in_words(options)) != "none"
            else f"Everyone is counted; no rule of exclusion was declared ({declared}).",
        ),
        (
            "Software",
            ", ".join(f"{name} {version}" for name, version in versions().items())
            + ". Figures use the palette of [okabe2002].",
        ),
    ]
    return result


def markdown(responses: Responses, options: Options, declared: str, command: str = "") -> str:
    """methods.md."""
    lines = ["# Methods", ""]
    if responses.simulated:
        lines += [
            (
                "**SIMULATED ANSWERS.** These answers were made by a program; this text "
                "describes how they were analysed."
            ),
            "",
        ]
    parts = paragraphs(responses, options, declared)
    for heading, text in parts:
        lines += [f"**{heading}.** {text}", ""]
    if command:
        lines += [f"Command: `{command}`; table sha256 `{responses.sha256}`.", ""]
    lines += ["## References", ""]
    used = "".join(text for _, text in parts)
    lines += [f"- [{key}] {REFERENCES[key]}" for key in keys_in(used)]
    return "\n".join(lines) + "\n"


def keys_in(text: str) -> list[str]:
    """The keys of the references that are cited, in the order of `REFERENCES`."""
    cited = set(re.findall(r"\w+", " ".join(re.findall(r"\[([\w, ]+)\]", text))))
    return [key for key in REFERENCES if key in cited]


def cited(text: str, order: Mapping[str, int]) -> str:
    """References [key] and [key, other] as their numbers [3] and [3, 4]."""
    for key, place in order.items():
        text = re.sub(rf"(?<=[\[ ]){key}(?=[\],])", str(place), text)
    return text


def _equivalence(options: Options, alpha: float, declared: str) -> str:
    if not options.margin and not options.margin_jod:
        return (
            f"No margin of equivalence was declared ({declared}), so that no equivalence "
            "was tested."
        )
    words = []
    if options.margin:
        words.append(
            "Two techniques are called as good as each other where two one-sided t tests "
            f"[schuirmann1987] at {alpha:g} and the "
            f"{100 * (1 - 2 * alpha):g} % bootstrap interval both put the mean preference "
            f"within \N{PLUS-MINUS SIGN}{options.margin:g} points, the tests corrected by Holm's "
            "procedure like those of difference"
        )
    if options.margin_jod:
        set_against = (
            "the difference in JOD is set against"
            if words
            else "Two techniques are called as good as each other where the bootstrap interval of "
            "their difference in JOD is within"
        )
        words.append(f"{set_against} \N{PLUS-MINUS SIGN}{options.margin_jod:g} JOD")
    return "; ".join(words) + f" ({declared})."
