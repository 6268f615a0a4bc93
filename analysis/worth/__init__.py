"""How much each technique is worth: four models of paired comparisons, centred on 0 within a
framing, with intervals.

bradley_terry   P(i over j) = logistic(w_i - w_j).  Bradley and Terry 1952, Biometrika 39,
                doi:10.2307/2334029. 'No difference' is half a win for each, or dropped
                (`Options.ties`).
davidson        P(i) : P(j) : P(no difference) = pi_i : pi_j : nu sqrt(pi_i pi_j), w = log pi.
                Davidson 1970, JASA 65(329), doi:10.1080/01621459.1970.10481082: 'no difference' is
                an outcome of its own.
thurstone_jod   P(i over j) = Phi((w_i - w_j) / JOD_SIGMA), case V, in just-objectionable
                differences: at 1 JOD 75 % prefer one, with 'no difference' as in bradley_terry.
                Thurstone 1927; Perez-Ortiz and Mantiuk 2017, arXiv:1712.03686.
ordinal         all five answers, with a side effect and participants; see `worth.ordinal`. Worths
                are logits for one participant, intervals Wald's from the observed information.
                Under Laplace's approximation spreads come out some 10 % small with 10 answers a
                person; worths 1 to 2 %.

One rule for the study and its resamples: a fit is maximum likelihood where that has a finite
maximum under the declared handling of ties. Where it has none - a technique that never won is an
ordinary result with few people - the fallback (`Options.fallback`) stands in and is marked:
'reduced_bias' (Firth 1993) for the first three, weak normal priors for ordinal. Where some resample
has no maximum, all resamples of that panel are fitted with reduced bias, so that the interval
survives them; it is then at least as wide as Wald's, since resampling a technique that always won
shows nothing of how often it might lose. What no penalty can mend (groups that were never
compared, all answers 'no difference') is NaN, and `missing_fit` names why.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from analysis import bootstrap
from analysis.options import Options
from analysis.panel import Panel, panels, tied, wins, with_notes
from analysis.responses import Responses
from analysis.worth import resampled
from analysis.worth.binary import (
    JOD_SIGMA,
    bradley_terry,
    covariance,
    standard_errors,
    thurstone_jod,
)
from analysis.worth.binary import connected as strongly_connected
from analysis.worth.existence import confounded_side, impossible, missing_fit, no_maximum
from analysis.worth.ordinal import (
    FEW_ANSWERS,
    NO_TASTE,
    QUADRATURE_ITEMS,
    Ordinal,
    answers_each,
    fitted,
    ordinal,
)
from analysis.worth.ties import davidson, davidson_covariance, davidson_sides

__all__ = [
    "FEW_ANSWERS",
    "JOD_SIGMA",
    "NO_TASTE",
    "QUADRATURE_ITEMS",
    "Ordinal",
    "bootstrapped",
    "bradley_terry",
    "confounded_side",
    "davidson",
    "davidson_sides",
    "estimated",
    "fit",
    "fitted",
    "goodness",
    "impossible",
    "missing_fit",
    "no_maximum",
    "ordinal",
    "ordinal_fit",
    "parameters",
    "standard_errors",
    "strongly_connected",
    "thurstone_jod",
    "wald_covariance",
    "widened",
    "worths",
]

#: How a fit was made, as the column `fit` of the tables has it.
ML, REDUCED, PRIOR_FIT = "maximum likelihood", "reduced bias", "weak prior"


def stood_in(fit: pd.Series) -> pd.Series:
    """Of the tables' column `fit`: where something else stands in for maximum likelihood."""
    return ~fit.isin([ML, ""])


@dataclass(frozen=True)
class Fit:
    """estimate, low, high (n,), NaN where there is none; method: how the estimate was made, '' if
    there is none; notes: what was refused or replaced, and why.
    """

    estimate: np.ndarray
    low: np.ndarray
    high: np.ndarray
    method: str
    notes: tuple[str, ...] = ()


def worths(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, model, technique, estimate, low, high, fit; empty numbers where a fit does not
    exist, named in attrs['notes'].

    fit: 'maximum likelihood', or the fallback where that has no finite maximum: 'reduced bias' or
    'weak prior'.
    """
    rows, notes = [], bootstrap.few(responses)
    for name, panel in panels(responses).items():
        for model in options.models:
            one = fit(panel, model, options)
            values = zip(panel.items, one.estimate, one.low, one.high, strict=True)
            rows += [(name, model, *value, one.method) for value in values]
            notes += [f"{name}, {model}: {line}" for line in one.notes]
    columns = ["framing", "model", "technique", "estimate", "low", "high", "fit"]
    return with_notes(rows, columns, notes)


def parameters(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, model, parameter, estimate, low, high: what the models have beside worths.

    davidson: log_nu. ordinal: side (logits, positive favours the right image), threshold_slight and
    threshold_strong (logits), sd_preference and sd_side (logits, without interval), answers,
    log_likelihood (Laplace).
    """
    rows, notes = [], []
    for name, panel in panels(responses).items():
        if "davidson" in options.models and np.isfinite(estimated(panel, "davidson", options)[0]):
            reduced = no_maximum(panel, "davidson") is not None
            strict, level = wins(panel, panel.counts, "drop"), tied(panel, panel.counts)
            log_nu = float(davidson(strict, level, reduced)[1])
            _, draws, _ = resampled.draws(panel, "davidson", options)
            low, high = bootstrap.interval(draws, panel.people, options.level)
            if np.isfinite(log_nu):
                rows.append((name, "davidson", "log_nu", log_nu, float(low), float(high)))
            else:
                notes.append(
                    f"{name}, davidson: no answer is 'no difference', nu is 0 and log_nu has "
                    "no number"
                )
        one = ordinal_fit(panel, options) if "ordinal" in options.models else None
        if one is None:
            continue
        half = stats.norm.ppf((1 + options.level) / 2) * one.side_error
        rows.append((name, "ordinal", "side", one.side, one.side - half, one.side + half))
        for label, value in zip(one.threshold_names, one.thresholds, strict=True):
            rows.append((name, "ordinal", label, value, np.nan, np.nan))
        for label in ("sd_preference", "sd_side", "answers", "log_likelihood"):
            rows.append((name, "ordinal", label, float(getattr(one, label)), np.nan, np.nan))
    columns = ["framing", "model", "parameter", "estimate", "low", "high"]
    return with_notes(rows, columns, notes)


def goodness(responses: Responses, options: Options) -> pd.DataFrame:
    """framing, model, parameters, log_likelihood, deviance, df, p: how well a model describes what
    was answered about each pair.

    deviance    of bradley_terry, thurstone_jod and davidson: twice the log-likelihood that a number
                of its own for each pair has more; df the pairs' numbers less the parameters; p by
                chi-square. Ties as half wins make the deviance of the first two small; answers of
                one person, which are not independent, make it large.
    ordinal     its log-likelihood alone: with people in it there is no such saturated model.
    Fits of a fallback are left out.
    """
    rows, notes = [], []
    for name, panel in panels(responses).items():
        for model in options.models:
            if model == "ordinal":
                one = ordinal_fit(panel, options)
                if one is not None and not one.prior:
                    likelihood = one.log_likelihood
                    rows.append((name, model, one.parameters, likelihood, np.nan, np.nan, np.nan))
                continue
            if missing_fit(panel, model, options.ties):
                no_fit = impossible(panel, model) or options.fallback == "none"
                reason = "there is no fit" if no_fit else "the fit is not maximum likelihood"
                notes.append(f"{name}, {model}: no deviance: {reason}")
                continue
            rows.append((name, model, *_deviance(panel, model, options)))
    columns = ["framing", "model", "parameters", "log_likelihood", "deviance", "df", "p"]
    return with_notes(rows, columns, notes)


def _deviance(panel: Panel, model: str, options: Options) -> tuple[float, ...]:
    """parameters, log-likelihood, deviance, df, p of a model of the pairs."""
    n = len(panel.items)
    i, j = np.triu_indices(n, 1)
    if model == "davidson":
        won, level = wins(panel, panel.counts, "drop"), tied(panel, panel.counts)
        counts = np.stack([won[i, j], won[j, i], level[i, j]], axis=1)
        worth, log_nu = davidson(won, level)
        d = worth[i] - worth[j]
        logits = np.stack([d / 2, -d / 2, np.full_like(d, log_nu)], axis=1)
        ties = bool(level.any())
        parameters = n if ties else n - 1
        p = np.exp(logits - logits.max(axis=1, keepdims=True))
        p /= p.sum(axis=1, keepdims=True)
        outcomes = 2 if ties else 1
    else:
        won = wins(panel, panel.counts, options.ties)
        counts = np.stack([won[i, j], won[j, i]], axis=1)
        link = {"bradley_terry": stats.logistic, "thurstone_jod": stats.norm}[model]
        scale = JOD_SIGMA if model == "thurstone_jod" else 1.0
        worth = estimated(panel, model, options) / scale
        d = worth[i] - worth[j]
        p = np.stack([link.cdf(d), link.sf(d)], axis=1)
        parameters, outcomes = n - 1, 1
    total = counts.sum(axis=1, keepdims=True)
    share = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0)
    seen = counts > 0
    fitted_value = float((counts[seen] * np.log(p[seen])).sum())
    saturated = float((counts[seen] * np.log(share[seen])).sum())
    deviance = max(0.0, 2 * (saturated - fitted_value))
    df = int((total > 0).sum()) * outcomes - parameters
    chance = float(stats.chi2.sf(deviance, df)) if df > 0 else np.nan
    return parameters, fitted_value, deviance, float(df), chance


def bootstrapped(panel: Panel, model: str, options: Options) -> np.ndarray:
    """(resamples, n): the worths of bradley_terry, davidson or thurstone_jod in each resample.

    By maximum likelihood; all with reduced bias where some resample has no finite maximum and the
    fallback is on. NaN where a resample has no fit.
    """
    return resampled.draws(panel, model, options)[0]


def estimated(panel: Panel, model: str, options: Options) -> np.ndarray:
    """(n,): the worths of bradley_terry, davidson or thurstone_jod, by the fallback where maximum
    likelihood has no finite maximum; NaN where there is no fit.
    """
    empty = np.full(len(panel.items), np.nan)
    if impossible(panel, model):
        return empty
    reduced = no_maximum(panel, model, options.ties) is not None
    if reduced and options.fallback == "none":
        return empty
    return resampled.solve(panel, model, panel.counts, options.ties, reduced)[0]


def fit(panel: Panel, model: str, options: Options) -> Fit:
    """One model of one panel, with intervals and with what is to be said of it."""
    empty = np.full(len(panel.items), np.nan)
    if reason := impossible(panel, model):
        return Fit(empty, empty, empty, "", (f"no finite worths: {reason}",))
    reason = no_maximum(panel, model, options.ties)
    if reason and options.fallback == "none":
        return Fit(empty, empty, empty, "", (f"no finite worths: {reason}",))
    if model == "ordinal":
        return _ordinal(panel, options, reason)
    estimate = estimated(panel, model, options)
    draws, _, without = resampled.draws(panel, model, options)
    low, high = bootstrap.interval(draws, panel.people, options.level)
    notes = []
    if reason:
        notes.append(
            f"maximum likelihood has no finite worths, since {reason}: worths with reduced bias "
            "stand in"
        )
    elif without and options.fallback == "none":
        enough = np.isfinite(low).all()
        kept = "they are left out of the interval" if enough else "too many for an interval"
        notes.append(f"no finite worths in {without} of {options.resamples} resamples; {kept}")
    elif without:
        notes.append(
            f"no finite maximum in {without} of {options.resamples} resamples: the interval is "
            "that of worths with reduced bias"
        )
    spread = wald_covariance(panel, model, options)
    if spread is not None:
        errors = np.sqrt(np.diag(spread))
        low, high = widened(low, high, estimate, errors, options.level)
    return Fit(estimate, low, high, REDUCED if reason else ML, tuple(notes))


def wald_covariance(panel: Panel, model: str, options: Options) -> np.ndarray | None:
    """(n, n): the inverse information of the fit with reduced bias, where resamples have to be
    fitted so; None where all are maximum likelihood.
    """
    if options.fallback == "none" or not resampled.draws(panel, model, options)[2]:
        return None
    counts = panel.counts
    if model == "davidson":
        return davidson_covariance(wins(panel, counts, "drop"), tied(panel, counts), True)
    return covariance(wins(panel, counts, options.ties), model, True)


def widened(
    low: np.ndarray, high: np.ndarray, value: np.ndarray, errors: np.ndarray, level: float
) -> tuple[np.ndarray, np.ndarray]:
    """The interval made at least as wide as value +- z errors; NaN stays."""
    half = stats.norm.ppf((1 + level) / 2) * errors
    return np.minimum(low, value - half), np.maximum(high, value + half)


def ordinal_fit(panel: Panel, options: Options) -> Ordinal | None:
    """The ordinal model, with weak priors where it has no maximum without; None where it has no
    fit.
    """
    if impossible(panel, "ordinal"):
        return None
    one = None if no_maximum(panel, "ordinal") else fitted(panel)
    if one is None and options.fallback != "none":
        one = fitted(panel, prior=True)
    return one


def _ordinal(panel: Panel, options: Options, reason: str | None) -> Fit:
    reason = reason or (
        "with few answers a participant tastes, thresholds and worths can grow together without end"
    )
    one = ordinal_fit(panel, options)
    if one is None:
        empty = np.full(len(panel.items), np.nan)
        words = f"no finite worths: no maximum of the likelihood was found; {reason}"
        return Fit(empty, empty, empty, "", (words,))
    half = stats.norm.ppf((1 + options.level) / 2) * one.errors
    notes = _caveats(panel, one)
    if one.prior:
        notes = [
            f"maximum likelihood has no finite worths, since {reason}: a fit with weak priors "
            "stands in",
            *notes,
        ]
    method = PRIOR_FIT if one.prior else ML
    return Fit(one.worth, one.worth - half, one.worth + half, method, tuple(notes))


def _caveats(panel: Panel, one: Ordinal) -> list[str]:
    most = answers_each(panel)
    if most <= NO_TASTE:
        return [
            f"nobody gave more than {most} answers: tastes of their own cannot be told from "
            "noise and are not in the model"
        ]
    if most <= FEW_ANSWERS and len(panel.items) > QUADRATURE_ITEMS and one.sd_preference > 0.5:
        return [
            f"nobody gave more than {most} answers, and tastes differ: Laplace's "
            "approximation makes worths a few per cent small"
        ]
    return []
