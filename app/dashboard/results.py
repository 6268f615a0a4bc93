"""What the answers say so far: points, AHP, worths with their intervals, circular triads."""

from __future__ import annotations

from math import comb, isfinite
from typing import TYPE_CHECKING, Any

from app.study import Study

if TYPE_CHECKING:
    from analysis.ahp import Comparison
    from analysis.options import Options
    from analysis.responses import Responses

#: The model whose worths are shown: the first of these that the study's analysis fits. Differences
#: in JOD say how many people prefer one, and take a thousand resamples in a tenth of a second.
MODELS = ("thurstone_jod", "davidson", "bradley_terry", "ordinal")
UNITS = {"thurstone_jod": "JOD", "bradley_terry": "logits", "davidson": "logits"}


def framings(answers: Responses | None, study: Study, options: Options) -> list[dict[str, Any]]:
    """For each framing: points, AHP priority and worth of each technique, consistency, circular
    triads, and what is still missing.
    """
    if answers is None:
        return []
    from analysis import ahp, tallies
    from analysis.panel import panels

    points = {
        (row.framing, row.technique): row.score for row in tallies.scores(answers).itertuples()
    }
    totals = tallies.totals(answers).set_index("framing")
    panel_of, circles = panels(answers, overall=False), _triads(answers, options)
    result = []
    for framing, comparison in ahp.comparisons(answers).items():
        priorities = _priorities(comparison, study)
        most = max(points[framing, name] for name in comparison.items) or 1
        worth = _worths(panel_of[framing], options)
        pairs = panel_of[framing].answered.sum(axis=0)
        result.append(
            {
                "name": framing,
                "label": answers.codebook.framing_label(framing),
                "total": int(totals.total[framing]),
                "answers": int(totals.answers[framing]),
                "pairs": {"least": int(pairs.min()), "most": int(pairs.max())},
                "coherence": priorities.sentence()
                if priorities
                else "Some pairs have no answer yet.",
                "cr": _number(priorities.cr) if priorities else None,
                "triads": circles[framing],
                "model": worth["model"],
                "unit": worth["unit"],
                "level": f"{100 * options.level:g}",
                "notes": worth["notes"],
                "techniques": [
                    {
                        "name": name,
                        "label": answers.codebook.label(name),
                        "score": int(points[framing, name]),
                        "score_share": float(points[framing, name] / most),
                        "priority": float(priorities.vector[i]) if priorities else None,
                        **worth["techniques"][name],
                    }
                    for i, name in enumerate(comparison.items)
                ],
            }
        )
    _place(result)
    return result


def _priorities(comparison: Comparison, study: Study):
    """AHP priorities; None before every pair has an answer."""
    from analysis import ahp

    if len(comparison.items) < len(study.techniques) or comparison.missing:
        return None
    return ahp.priorities(comparison.matrix)


def _worths(panel, options: Options) -> dict[str, Any]:
    """Worth and interval of each technique of a framing, None where there is none, and why."""
    from analysis.worth import REDUCED, fit

    model = next(name for name in MODELS if name in options.models)
    one = fit(panel, model, options)
    notes = list(one.notes)
    if one.method == REDUCED and not notes:
        notes.append("worths with reduced bias")
    values = zip(panel.items, one.estimate, one.low, one.high, strict=True)
    techniques = {
        name: {"worth": _number(worth), "low": _number(low), "high": _number(high)}
        for name, worth, low, high in values
    }
    if panel.people and all(one["low"] is None for one in techniques.values()) and not notes:
        notes.append("too few people for intervals")
    return {
        "model": model,
        "unit": UNITS.get(model, "logits"),
        "notes": notes,
        "techniques": techniques,
    }


def _triads(answers: Responses, options: Options) -> dict[str, dict[str, Any]]:
    """Framing -> circular triads of a person who answered every pair, on the mean, with an
    interval and the mean of guessing; and of the majority. None where nobody did.
    """
    from analysis.agreement import consistency

    rows: dict[str, dict[str, Any]] = {}
    for row in consistency(answers, options).itertuples():
        rows.setdefault(row.framing, {})[row.statistic] = row
    result = {}
    for framing, of in rows.items():
        circular, zeta = of.get("circular_triads"), of.get("zeta")
        pooled, items = of.get("pooled_circular_triads"), len(answers.items[framing])
        result[framing] = {
            "mean": _number(circular.value) if circular else None,
            "low": _number(circular.low) if circular else None,
            "high": _number(circular.high) if circular else None,
            "p": _number(circular.p) if circular else None,
            "zeta": _number(zeta.value) if zeta else None,
            # a triad without a tie goes in a circle one time in four (Moran 1947)
            "guessing": comb(items, 3) / 4,
            "majority": _number(pooled.value) if pooled else None,
        }
    return result


def _place(framings: list[dict[str, Any]]) -> None:
    """Where worths stand on one axis for all framings, from 0 to 100: `at`, `from` and `to`."""
    every = [
        value
        for one in framings
        for technique in one["techniques"]
        for value in (technique["worth"], technique["low"], technique["high"])
        if value is not None
    ]
    least, most = min(every, default=0.0), max(every, default=0.0)
    width = (most - least) or 1.0

    def place(value: float | None) -> float | None:
        return None if value is None else round(2 + 96 * (value - least) / width, 2)

    for one in framings:
        one["zero"] = place(0.0)
        for technique in one["techniques"]:
            technique["at"] = place(technique["worth"])
            technique["from"] = place(technique["low"])
            technique["to"] = place(technique["high"])


def _number(value: float | None) -> float | None:
    """A finite number, for JSON."""
    return float(value) if value is not None and isfinite(value) else None
