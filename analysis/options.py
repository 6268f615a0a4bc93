"""What the analyst decides before the numbers are seen: resamples, seed, level, margins, the
declared test, the exclusions.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from analysis.errors import InputError

#: Name of the rows in which all framings are taken together.
OVERALL = "overall"
#: Below this number of participants no interval and no test on participants is given.
FEWEST_PEOPLE = 5


@dataclass(frozen=True)
class Exclusions:
    """Rules under which a participant is left out in the second pass of `agreement.sensitivity`,
    and nowhere else; None: no rule.

    answered_share      leave out who answered less than this share of the study's questions, 0 to
                        1; where nobody was asked all, of the most that anybody answered
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
class Sampling:
    """How `analysis.posterior` draws, and its priors.

    chains, draws, warmup  so many chains of so many draws each, after so many steps of warm-up
    target_acceptance      the share of steps that the sampler aims to accept, between 0 and 1:
                           nearer to 1, smaller steps
    prior_worth            spread of techniques' worths
    prior_image            spread of what a technique gains in one image
    prior_taste            spread of people's own tastes for a technique
    prior_person_side      spread of people's leaning to a side
    prior_side             the side effect: standard deviation of a normal prior about 0
    prior_slight           the threshold of a slight preference
    prior_clear            from that to the threshold of a clear one
    Priors are scales in logits, above 0, of half-normal distributions but for prior_side's.
    """

    chains: int = 4
    draws: int = 1000
    warmup: int = 1000
    target_acceptance: float = 0.95
    prior_worth: float = 2.0
    prior_image: float = 1.0
    prior_taste: float = 1.0
    prior_person_side: float = 1.0
    prior_side: float = 1.0
    prior_slight: float = 1.0
    prior_clear: float = 2.0

    def __post_init__(self) -> None:
        for name, least, most in (
            ("chains", 2, 64),
            ("draws", 100, 100_000),
            ("warmup", 100, 100_000),
        ):
            _whole(f"posterior.{name}", getattr(self, name), least, most)
        for one in fields(self):
            value = getattr(self, one.name)
            most = 1 if one.name == "target_acceptance" else 1000
            if one.type == "float" and not 0 < value < most:
                raise InputError(
                    f"posterior.{one.name} is {value!r}, expected a number above 0 and below {most}"
                )

    @property
    def priors(self) -> dict[str, float]:
        """Name without 'prior_' -> scale, logits."""
        names = (one.name for one in fields(self) if one.name.startswith("prior_"))
        return {name.removeprefix("prior_"): getattr(self, name) for name in names}


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
    posterior   see `Sampling`
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
    posterior: Sampling = field(default_factory=Sampling)
    declared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, least, most in (("resamples", 100, 1_000_000), ("seed", 0, 2**63 - 1)):
            _whole(name, getattr(self, name), least, most)
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


def _whole(name: str, value: object, least: int, most: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise InputError(f"{name} is {value!r}, expected an integer from {least} to {most}")


def _within(name: str, value: float | None, low: float, high: float) -> None:
    if value is not None and not low <= value <= high:
        raise InputError(f"{name} is {value!r}, expected a number from {low} to {high}")
