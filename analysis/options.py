"""What the analyst decides before the numbers are seen: resamples, seed, level, margins, the
declared test, the exclusions.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from analysis.errors import InputError

#: Name of the rows in which all framings are taken together.
OVERALL = "overall"
#: Below this number of participants no interval and no test on participants is given.
FEWEST_PEOPLE = 5


@dataclass(frozen=True)
class Exclusions:
    """Rules under which a participant is left out in the second pass of `agreement.sensitivity`,
    and nowhere else; None: no rule.

    answered_share      leave out who answered less than this share of the study's questions, 0 to 1
    one_side_share      ... who chose one side in at least this share of decided answers, 0 to 1,
                        where that is unlikely by chance (two-sided binomial p below 0.001)
    median_rt_ms        ... whose median answer took less than this, milliseconds
    same_answer_share   ... who gave one and the same answer this often, 0 to 1
    zeta                ... whose coefficient of consistency, averaged over framings, is below this,
                        at most 1
    repeat_share        ... who, asked again, chose the same direction less often than this, 0 to 1
    trap_share          ... who answered less than this share of trap pairs as is obvious, 0 to 1
    """

    answered_share: float | None = 0.5
    one_side_share: float | None = 0.9
    median_rt_ms: float | None = 500.0
    same_answer_share: float | None = 0.95
    zeta: float | None = None
    repeat_share: float | None = None
    trap_share: float | None = None

    def __post_init__(self) -> None:
        for name in (
            *("answered_share", "one_side_share", "same_answer_share", "repeat_share"),
            "trap_share",
        ):
            _within(f"exclusions.{name}", getattr(self, name), 0, 1)
        _within("exclusions.median_rt_ms", self.median_rt_ms, 0, float("inf"))
        _within("exclusions.zeta", self.zeta, -1, 1)


@dataclass(frozen=True)
class Options:
    """The analyst's choices; each is recorded in the output.

    resamples   participants are resampled this often, from 100 to 1,000,000
    seed        of every random number in the analysis, from 0
    level       of the intervals, between 0.5 and 1
    margin      two techniques are as good as each other where the mean preference is within
                +-margin, points on the scale from -2 to 2, above 0; None: no equivalence is tested
    margin_jod  the same for the difference in JOD, above 0
    test        'wilcoxon' or 'sign': the declared test, which Holm's correction is applied to
    family      'study': Holm over all pairs of all framings together; 'framing': over the pairs of
                one framing
    ties        how bradley_terry and thurstone_jod take 'no difference': 'half' a win for each, or
                'drop'
    fallback    what stands in where maximum likelihood has no finite maximum: 'reduced_bias' (for
                the ordinal model weak priors), or 'none'
    models      the models of worth to fit
    exclusions  see `Exclusions`
    declared    names of the choices that a study declared, rules as 'exclusions.NAME'; the others
                are defaults or were given later
    """

    resamples: int = 1000
    seed: int = 0
    level: float = 0.95
    margin: float | None = None
    margin_jod: float | None = None
    test: str = "wilcoxon"
    family: str = "study"
    ties: str = "half"
    fallback: str = "reduced_bias"
    models: tuple[str, ...] = ("bradley_terry", "davidson", "thurstone_jod", "ordinal")
    exclusions: Exclusions = field(default_factory=Exclusions)
    declared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, least, most in (("resamples", 100, 1_000_000), ("seed", 0, 2**63 - 1)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
                raise InputError(f"{name} is {value!r}, expected an integer from {least} to {most}")
        if not 0.5 < self.level < 1:
            raise InputError(
                f"level is {self.level!r}, expected a number between 0.5 and 1, such as 0.95"
            )
        for name in ("margin", "margin_jod"):
            value = getattr(self, name)
            if value is not None and not 0 < value < float("inf"):
                raise InputError(f"{name} is {value!r}, expected a number above 0")
        for name, known in (
            ("test", ("wilcoxon", "sign")),
            ("family", ("study", "framing")),
            ("ties", ("half", "drop")),
            ("fallback", ("reduced_bias", "none")),
        ):
            if getattr(self, name) not in known:
                raise InputError(
                    f"{name} is {getattr(self, name)!r}, expected one of {', '.join(known)}"
                )
        models = Options.__dataclass_fields__["models"].default
        if not isinstance(self.models, tuple):
            raise InputError(
                f"models is {self.models!r:.60}, expected a list of {', '.join(models)}"
            )
        unknown = [str(name) for name in self.models if name not in models]
        if unknown:
            raise InputError(
                f"models names the unknown {', '.join(unknown)}; expected some of "
                f"{', '.join(models)}"
            )


def _within(name: str, value: float | None, low: float, high: float) -> None:
    if value is not None and not low <= value <= high:
        raise InputError(f"{name} is {value!r}, expected a number from {low} to {high}")
