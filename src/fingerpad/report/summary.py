"""What a run found, in sentences made from its numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fingerpad.data import paper
from fingerpad.report.formatting import fixed, joined, number


def summary(results: Mapping[str, Any]) -> list[str]:
    """Return the paragraphs that open the report: what was found, then what was met and missed.

    Parameters
    ----------
    results : mapping
        The whole results; sections that are absent are passed over.

    Returns
    -------
    list of str

    Examples
    --------
    >>> row = {"quantity": "FSS", "paper": "0.81", "ours": "0.7", "met": False}
    >>> summary({"comparison": [row]})
    ['Of 1 judged comparison with the paper, 0 are met and 1 is missed. Missed: FSS (0.7, the paper 0.81).']
    """
    levels: tuple[tuple[str, Callable[[Mapping[str, Any]], str]], ...] = (
        ("skin_deflection", _skin),
        ("single_unit", _nerve),
        ("discrimination", _percept),
    )
    found = " ".join(say(results[section]) for section, say in levels if results.get(section))
    return [text for text in (found, _verdicts(results.get("comparison") or [])) if text]


def _skin(section: Mapping[str, Any]) -> str:
    fits = {
        f"Trial {trial[-1]}": content["cylinder"]["r2"]
        for trial, content in sorted(section.items())
        if trial.startswith("trial") and content.get("cylinder", {}).get("r2") is not None
    }
    if not fits:
        return ""
    best = max(fits, key=lambda name: fits[name])
    listed = joined([f"{name} {fixed(fit, 2)}" for name, fit in fits.items()])
    return (
        f"Skin: of the material trials, {best} comes closest to the observed deflection under the cylinder "
        f"(R²: {listed}); in the paper Trial 3 does."
    )


def _nerve(section: Mapping[str, Any]) -> str:
    return (
        "Nerve: the fitted afferent reaches a fractional sum of squares of "
        f"{fixed(section.get('fss_out_of_sample'), 2)} on positions of the bar that it was not fitted to "
        f"(the paper: {fixed(paper.FSS_OUT_OF_SAMPLE.value, 2)}) and "
        f"{fixed(section.get('fss_in_sample'), 2)} on all positions."
    )


def _percept(section: Mapping[str, Any]) -> str:
    rates = section.get("gradient_sum", {}).get("static") or {}
    people, comparison = section.get("goodwin") or {}, section["curvature_per_m"][1:]
    told = [
        f"{number(curvature)} 1/m in {_percent(rates['hit_rate'][comparison.index(curvature)])} of trials "
        f"(people: {_percent(observed)})"
        for curvature, observed in zip(
            people.get("curvature_per_m", []), people.get("hit_rate", []), strict=True
        )
        if rates and curvature in comparison
    ]
    if not told:
        return ""
    return (
        f"Percept: with noise of {number(section.get('noise_sigma'))}, the static Gradient Sum tells spheres "
        f"of {joined(told)} from the standard; the paper's noise is "
        f"{number(section.get('noise_sigma_paper'))}."
    )


def _percent(fraction: float | None) -> str:
    return "an unknown share" if fraction is None else f"{100.0 * fraction:.0f} %"


def _verdicts(comparison: Sequence[Mapping[str, Any]]) -> str:
    if not comparison:
        return ""
    met = [row for row in comparison if row.get("met") is True]
    missed = [row for row in comparison if row.get("met") is False]
    open_rows = len(comparison) - len(met) - len(missed)
    judged = len(met) + len(missed)
    text = (
        f"Of {judged} judged comparison{'s' * (judged != 1)} with the paper, {len(met)} {_are(len(met))} met "
        f"and {len(missed)} {_are(len(missed))} missed."
    )
    if missed:
        listed = "; ".join(f"{row['quantity']} ({row['ours']}, the paper {row['paper']})" for row in missed)
        text += f" Missed: {listed}."
    if open_rows:
        text += f" {open_rows} more {_are(open_rows)} shown without a verdict."
    return text


def _are(count: int) -> str:
    return "is" if count == 1 else "are"
